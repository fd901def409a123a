//! What the XML of a VTK file says: where its grid is, and which arrays it has.

use super::super::Endian;
use super::super::field::{Field, shown};
use super::super::source::Source;
use super::super::stored::Stored;
use super::blocks::Compressor;
use super::data::Coding;
use super::extent::Extent;
use super::outline::{Outline, scan};
use crate::volume::VoxelType;
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use roxmltree::{Document, Node};
use std::ops::Range;
use std::path::Path;

/// Where an array's numbers stand.
#[derive(Debug, Clone)]
pub(super) enum Content {
    /// As text in these bytes of the file.
    Text(Range<u64>),
    /// As base64 in these bytes of the file.
    Base64(Range<u64>),
    /// So many bytes or characters behind the start of the appended data.
    Appended(u64),
    /// Nowhere.
    Missing,
}

/// One array of points or cells.
#[derive(Debug, Clone)]
pub(super) struct Array {
    pub(super) name: String,
    /// The type as the file calls it, and what that is if it is a number.
    pub(super) kind: String,
    pub(super) stored: Option<Stored>,
    pub(super) components: usize,
    /// Whether there is a tuple for each cell, not for each point.
    pub(super) cells: bool,
    pub(super) content: Content,
}

impl Array {
    /// The name, quoted on one line.
    pub(super) fn shown(&self) -> String {
        shown(&self.name)
    }

    /// Type, components, points or cells.
    pub(super) fn about(&self) -> String {
        let many = if self.components == 1 { "component" } else { "components" };
        format!("{}, {} {many}, {}", self.kind, self.components, if self.cells { "cells" } else { "points" })
    }

    fn of(path: &Path, node: Node, index: usize, cells: bool, outline: &Outline) -> Result<Self> {
        let name = node.attribute("Name").map_or_else(|| format!("unnamed {index}"), str::to_owned);
        let kind = node.attribute("type").unwrap_or_default().to_owned();
        let components = match node.attribute("NumberOfComponents") {
            None => 1,
            Some(text) => match Field::new(path, "NumberOfComponents", text).sizes()?[..] {
                [n] => n,
                _ => return Err(Error::format(path, format!("array {}: NumberOfComponents is {}", shown(&name), shown(text)))),
            },
        };
        let range = outline.contents.get(&node.range().start).cloned();
        let content = match (node.attribute("format").unwrap_or("ascii"), range) {
            ("appended", _) => match node.attribute("offset").map(|o| o.trim().parse()) {
                Some(Ok(offset)) => Content::Appended(offset),
                _ => {
                    let offset = node.attribute("offset").unwrap_or_default();
                    return Err(Error::format(path, format!("array {}: offset is {}, no number of bytes", shown(&name), shown(offset))));
                }
            },
            ("ascii", Some(range)) => Content::Text(range),
            ("binary", Some(range)) => Content::Base64(range),
            ("ascii" | "binary", None) => Content::Missing,
            (other, _) => {
                return Err(Error::format(
                    path,
                    format!("array {}: format is {}, none of ascii, binary and appended", shown(&name), shown(other)),
                ));
            }
        };
        Ok(Self { name, stored: stored(&kind), kind, components, cells, content })
    }
}

fn stored(kind: &str) -> Option<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Some(match kind {
        "Int8" => I8.into(),
        "UInt8" => U8.into(),
        "Int16" => I16.into(),
        "UInt16" => U16.into(),
        "Int32" => I32.into(),
        "UInt32" => U32.into(),
        "Int64" => Stored::I64,
        "UInt64" => Stored::U64,
        "Float32" => F32.into(),
        "Float64" => F64.into(),
        _ => return None,
    })
}

/// One block of the grid and its arrays.
pub(super) struct Piece {
    /// Its points.
    pub(super) extent: Extent,
    pub(super) arrays: Vec<Array>,
    /// Names of the scalars that are called active, of points and of cells.
    pub(super) active: [Option<String>; 2],
    /// Where the points are along each axis, in a rectilinear grid.
    pub(super) coordinates: Vec<Array>,
}

/// Where the grid's points are.
pub(super) enum Lattice {
    /// The point with the numbers (0, 0, 0), and the steps from one to the next.
    Even { origin: DVec3, spacing: DVec3, direction: DMat3 },
    /// Told by the coordinates of the pieces.
    Rectilinear,
}

/// See the module's page.
pub(super) struct Image {
    pub(super) whole: Extent,
    pub(super) lattice: Lattice,
    pub(super) pieces: Vec<Piece>,
    pub(super) coding: Coding,
    /// How many bytes of the file are passed.
    pub(super) place: u64,
}

impl Image {
    /// Reads what `source` says of itself, up to its appended data or its end.
    pub(super) fn read(source: &mut Source) -> Result<Self> {
        let outline = scan(source)?;
        let path = source.path();
        let document =
            Document::parse(&outline.text).map_err(|e| source.fault(format!("the XML is damaged: {}", shown(&e.to_string()))))?;
        let root = document.root_element();
        if root.tag_name().name() != "VTKFile" {
            return Err(source.fault(format!("an XML file of {}, not of VTKFile", shown(root.tag_name().name()))));
        }
        let kind = root.attribute("type").unwrap_or_default();
        check_kind(path, kind)?;
        let coding = coding(path, root, &outline)?;
        let Some(grid) = elements(root, kind).next() else {
            return Err(source.fault(format!("there is no element {kind} in it")));
        };
        let whole = grid.attribute("WholeExtent").map(|text| extent(path, "WholeExtent", text)).transpose()?;
        let lattice = match kind {
            "ImageData" => Lattice::Even {
                origin: vector(path, grid, "Origin")?.unwrap_or(DVec3::ZERO),
                spacing: vector(path, grid, "Spacing")?.unwrap_or(DVec3::ONE),
                direction: direction(path, grid)?,
            },
            _ => Lattice::Rectilinear,
        };
        let mut pieces = Vec::new();
        for node in elements(grid, "Piece") {
            let extent = match (node.attribute("Extent"), whole) {
                (Some(text), _) => extent(path, "the Extent of a piece", text)?,
                (None, Some(whole)) => whole,
                (None, None) => return Err(source.fault("a piece has no Extent")),
            };
            // A piece without points is no error.
            if !extent.dims().contains(&0) {
                pieces.push(piece(path, node, extent, &outline)?);
            }
        }
        let Some(first) = pieces.first() else {
            return Err(source.fault("there is no piece with points in it"));
        };
        let whole = whole.unwrap_or(first.extent);
        Ok(Self { whole, lattice, pieces, coding, place: outline.place })
    }
}

/// Refuses what is no regular grid.
fn check_kind(path: &Path, kind: &str) -> Result<()> {
    let says = match kind {
        "ImageData" | "RectilinearGrid" => return Ok(()),
        "PImageData" | "PRectilinearGrid" => "it names other files that hold the pieces, which are not put together: give one of them",
        _ => "only ImageData, or a RectilinearGrid of even spacing, is a regular grid of voxels",
    };
    Err(Error::format(path, format!("a VTK file of the type {}: not supported, {says}", shown(kind))))
}

fn coding(path: &Path, root: Node, outline: &Outline) -> Result<Coding> {
    let fault = |what: String| Err(Error::format(path, what));
    let version = root.attribute("version").unwrap_or("0.1");
    if !matches!(version.split('.').next().map(str::parse::<u32>), Some(Ok(0..=2))) {
        return fault(format!("version is {}: versions up to 2 are read", shown(version)));
    }
    let endian = match root.attribute("byte_order") {
        Some("LittleEndian") | None => Endian::Little,
        Some("BigEndian") => Endian::Big,
        Some(other) => return fault(format!("byte_order is {}, neither LittleEndian nor BigEndian", shown(other))),
    };
    let word = match root.attribute("header_type") {
        Some("UInt32") | None => 4,
        Some("UInt64") => 8,
        Some(other) => return fault(format!("header_type is {}, neither UInt32 nor UInt64", shown(other))),
    };
    let compressor = match root.attribute("compressor") {
        None | Some("") => None,
        Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
        Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
        Some(other) => {
            let read = "vtkZLibDataCompressor and vtkLZ4DataCompressor are read";
            return fault(format!("compressor is {}: not supported ({read})", shown(other)));
        }
    };
    let raw = match elements(root, "AppendedData").next().and_then(|a| a.attribute("encoding")) {
        Some("raw") => true,
        Some("base64") | None => false,
        Some(other) => return fault(format!("encoding of AppendedData is {}, neither raw nor base64", shown(other))),
    };
    Ok(Coding { endian, word, compressor, appended: outline.appended, raw })
}

fn elements<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'a str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |n| n.is_element() && n.tag_name().name() == name)
}

fn extent(path: &Path, key: &str, text: &str) -> Result<Extent> {
    let field = Field::new(path, key, text);
    let numbers: Vec<i64> = text
        .split_ascii_whitespace()
        .map(|w| w.parse::<i32>().map(i64::from).map_err(|_| field.fault(format!("{} is no integer of 32 bits", shown(w)))))
        .collect::<Result<_>>()?;
    match numbers[..] {
        [a, b, c, d, e, f] => Ok(Extent { low: [a, c, e], high: [b + 1, d + 1, f + 1] }),
        _ => Err(field.fault(format!("{} numbers, 6 are needed", numbers.len()))),
    }
}

fn vector(path: &Path, node: Node, key: &str) -> Result<Option<DVec3>> {
    let Some(text) = node.attribute(key) else { return Ok(None) };
    Field::new(path, key, text).exactly(3).map(|v| Some(DVec3::new(v[0], v[1], v[2])))
}

/// Row after row; its columns are the directions of the grid's axes.
fn direction(path: &Path, node: Node) -> Result<DMat3> {
    let Some(text) = node.attribute("Direction") else { return Ok(DMat3::IDENTITY) };
    let v = Field::new(path, "Direction", text).exactly(9)?;
    let column = |c: usize| DVec3::new(v[c], v[c + 3], v[c + 6]);
    Ok(DMat3::from_cols(column(0), column(1), column(2)))
}

fn piece(path: &Path, node: Node, extent: Extent, outline: &Outline) -> Result<Piece> {
    let (mut arrays, mut active) = (Vec::new(), [None, None]);
    for (cells, name) in [(false, "PointData"), (true, "CellData")] {
        for data in elements(node, name) {
            active[usize::from(cells)] = data.attribute("Scalars").map(str::to_owned);
            for array in elements(data, "DataArray") {
                arrays.push(Array::of(path, array, arrays.len(), cells, outline)?);
            }
        }
    }
    let coordinates =
        elements(node, "Coordinates").flat_map(|c| c.children().filter(|n| n.is_element() && n.tag_name().name() == "DataArray"));
    let coordinates = coordinates.enumerate().map(|(i, array)| Array::of(path, array, i, false, outline)).collect::<Result<_>>()?;
    Ok(Piece { extent, arrays, active, coordinates })
}
