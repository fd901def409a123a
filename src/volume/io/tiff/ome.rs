//! OME-TIFF: the description of the first page is XML that tells what the pages are.
//!
//! Source: the OME-TIFF specification, <https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html>, and the schema of
//! OME-XML, 2016-06.

use super::directory::{MOST_PAGES, Tiff};
use super::series::{Plane, Series};
use crate::volume::LengthUnit;
use crate::volume::io::field::shown;
use crate::volume::io::folder::Folder;
use crate::volume::io::reading::{Part, Reading, pick};
use crate::volume::io::store::Store;
use crate::{Error, Result};
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Whether a description is OME-XML.
pub(super) fn is_it(description: &str) -> bool {
    description.trim_end().ends_with("</OME>") || description.trim_end().ends_with("</ome:OME>") || description.contains("<OME ")
}

/// One of the images that the XML describes.
struct Image<'a> {
    tiff: &'a Tiff,
    pixels: Node<'a, 'a>,
    /// Identifier of the file itself.
    uuid: Option<&'a str>,
}

/// What an image's planes are: slices, channels and frames, and their order.
struct Shape {
    slices: usize,
    /// Planes that channels take: several channels may share one.
    channels: usize,
    frames: usize,
    axes: [char; 3],
}

impl Shape {
    fn count(&self) -> usize {
        self.slices.saturating_mul(self.channels).saturating_mul(self.frames)
    }

    /// Position of a plane among all that are kept.
    fn place(&self, [z, c, t]: [usize; 3]) -> Option<usize> {
        let inside = z < self.slices && c < self.channels && t < self.frames;
        inside.then_some((t * self.channels + c) * self.slices + z)
    }
}

/// The planes of the image that is chosen in the file `tiff`.
///
/// # Errors
/// When the XML is damaged or tells of planes that are not there.
pub(super) fn series(tiff: &Tiff, reading: &Reading) -> Result<Series> {
    let document = Document::parse(&tiff.description).map_err(|e| damaged(tiff, &e))?;
    let root = document.root_element();
    let images: Vec<Node> = children(root, "Image").collect();
    let chosen = match &reading.choice.series {
        None => None,
        Some(n) => {
            Some(n.parse::<usize>().map_err(|_| tiff.fault(format!("volume.series is {}: OME-TIFF counts images from 0", shown(n))))?)
        }
    };
    if images.is_empty() {
        let other = children(root, "BinaryOnly").next().and_then(|n| n.attribute("MetadataFile"));
        return Err(tiff.fault(match other {
            Some(name) => {
                format!("OME-XML: what the pages are stands in {}: such files are not supported, save them as one OME-TIFF", shown(name))
            }
            None => "OME-XML: no image in it".to_owned(),
        }));
    }
    let index = pick(tiff.places.path(), Part::Series, chosen, images.len())?;
    let pixels = children(images[index], "Pixels").next().ok_or_else(|| tiff.fault(format!("OME-XML: image {index} has no Pixels")))?;
    let image = Image { tiff, pixels, uuid: root.attribute("UUID") };
    let mut series = image.series()?;
    if images.len() > 1 {
        let name = name_of(images[index]);
        series.notes.push(format!("Image {index} ({name}) of {} in the file was taken: volume.series chooses another.", images.len()));
    }
    Ok(series)
}

/// XML that cannot be parsed. The message may quote it.
fn damaged(tiff: &Tiff, error: &roxmltree::Error) -> Error {
    let what: String = error.to_string().chars().filter(|c| !c.is_control()).take(120).collect();
    tiff.fault(format!("OME-XML: {what}"))
}

/// Names of the images in the XML, where there are several.
pub(super) fn images(tiff: &Tiff) -> Vec<String> {
    let Ok(document) = Document::parse(&tiff.description) else { return Vec::new() };
    children(document.root_element(), "Image").map(name_of).collect()
}

/// The name of an image or a channel; the start of a long one.
fn name_of(node: Node) -> String {
    node.attribute("Name").unwrap_or_default().chars().filter(|c| !c.is_control()).take(60).collect()
}

/// How many files the XML names.
pub(super) fn files(tiff: &Tiff) -> usize {
    let Ok(document) = Document::parse(&tiff.description) else { return 0 };
    let names = document.descendants().filter(|n| n.tag_name().name() == "UUID").filter_map(|n| n.attribute("FileName"));
    names.collect::<BTreeSet<_>>().len()
}

/// Elements called `name` directly in `node`, of whatever namespace.
fn children<'a>(node: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |n| n.is_element() && n.tag_name().name() == name)
}

impl<'a> Image<'a> {
    /// The attribute `name` as a number.
    fn number(&self, node: Node<'a, 'a>, name: &str) -> Result<Option<usize>> {
        match node.attribute(name) {
            None => Ok(None),
            Some(text) => match text.trim().parse() {
                Ok(n) => Ok(Some(n)),
                Err(_) => Err(self.tiff.fault(format!("OME-XML: {name} is {}, not a number of at least 0", shown(text)))),
            },
        }
    }

    fn size(&self, name: &str) -> Result<usize> {
        match self.number(self.pixels, name)? {
            Some(n) if n > 0 => Ok(n),
            other => Err(self.tiff.fault(format!("OME-XML: {name} is {}: it must be at least 1", other.unwrap_or(0)))),
        }
    }

    /// Numbers a pixel of the first page.
    fn samples(&self) -> Result<usize> {
        let first = match children(self.pixels, "TiffData").next() {
            Some(block) => self.number(block, "IFD")?.unwrap_or(0),
            None => 0,
        };
        Ok(self.tiff.layout(first.min(self.tiff.pages.len() - 1)).samples)
    }

    /// Sizes and order, for `samples` numbers a pixel.
    fn shape(&self, samples: usize) -> Result<Shape> {
        let [slices, channels, frames] = [self.size("SizeZ")?, self.size("SizeC")?, self.size("SizeT")?];
        if channels % samples != 0 {
            return Err(self.tiff.fault(format!("OME-XML: SizeC is {channels}, but pixels have {samples} numbers each")));
        }
        let order = self.pixels.attribute("DimensionOrder").unwrap_or("XYZCT");
        let axes: Vec<char> = order.to_ascii_lowercase().chars().skip(2).collect();
        let axes = match axes[..] {
            [a, b, c] if order.starts_with("XY") && ['z', 'c', 't'].iter().all(|axis| [a, b, c].contains(axis)) => [a, b, c],
            _ => {
                return Err(self
                    .tiff
                    .fault(format!("OME-XML: DimensionOrder is {}, not XY and then Z, C and T in some order", shown(order))));
            }
        };
        let shape = Shape { slices, channels: channels / samples, frames, axes };
        match shape.count() {
            ..=MOST_PAGES => Ok(shape),
            count => {
                let what = format!("OME-XML: SizeZ {slices} x SizeC {channels} x SizeT {frames} are {count} planes");
                Err(self.tiff.fault(format!("{what}: more than {MOST_PAGES} are not supported")))
            }
        }
    }

    fn series(&self) -> Result<Series> {
        let tiff = self.tiff;
        let shape = self.shape(self.samples()?)?;
        let (planes, others) = self.planes(&shape)?;
        let (width, height) = (self.size("SizeX")?, self.size("SizeY")?);
        if let Some(plane) = planes.first() {
            let holder = if plane.file == 0 { tiff } else { &others[plane.file - 1] };
            let layout = holder.layout(plane.page);
            let (page, w, h) = (plane.page, layout.width, layout.height);
            if (width, height) != (w, h) {
                return Err(holder.fault(format!("OME-XML: an image of {width} x {height} pixels, page {page} has {w} x {h}")));
            }
        }
        let names = children(self.pixels, "Channel").map(name_of).collect();
        let mut notes = Vec::new();
        let (spacing, unit) = self.spacing(&mut notes)?;
        let Shape { slices, channels, frames, .. } = shape;
        Ok(Series { slices, channels, frames, planes, names, spacing, unit, rescale: None, notes, others, plain_palette: false })
    }

    /// Where each plane is, and the files beside this one.
    fn planes(&self, shape: &Shape) -> Result<(Vec<Plane>, Vec<Tiff>)> {
        let mut files = Files { image: self, names: BTreeMap::new(), others: Vec::new(), folder: None, renamed: self.is_alone() };
        let blocks: Vec<Node> = children(self.pixels, "TiffData").collect();
        let told = |found: usize| {
            let Shape { slices, channels, frames, .. } = shape;
            let what = format!("{slices} slices x {channels} channels x {frames} frames");
            self.tiff.fault(format!("OME-XML: {what} are {} planes, the file has {found}", shape.count()))
        };
        let is_bare = |block: &Node| ["IFD", "PlaneCount", "FirstZ", "FirstC", "FirstT"].iter().all(|a| !block.has_attribute(*a));
        if blocks.iter().all(|b| is_bare(b) && !b.children().any(|n| n.is_element())) {
            // Nothing is said: the pages in their order.
            let pages = self.tiff.images();
            if pages.len() < shape.count() {
                return Err(told(pages.len()));
            }
            let planes: Vec<Plane> = pages[..shape.count()].iter().map(|&page| Plane::page(page)).collect();
            return Ok((Series::sorted(&planes, shape.axes, [shape.slices, shape.channels, shape.frames]), Vec::new()));
        }
        let samples = self.samples()?;
        let mut found: BTreeMap<usize, Plane> = BTreeMap::new();
        for block in blocks {
            let file = files.of(block)?;
            let pages = match file {
                0 => self.tiff,
                n => &files.others[n - 1],
            };
            let ifd = self.number(block, "IFD")?;
            let first = ifd.unwrap_or(0);
            let left = pages.pages.len().saturating_sub(first);
            let count = match (self.number(block, "PlaneCount")?, ifd) {
                (Some(count), _) => count,
                (None, Some(_)) => 1,
                (None, None) => left.min(shape.count()),
            };
            if count > left {
                let (path, all) = (pages.places.path(), pages.pages.len());
                return Err(Error::format(
                    path,
                    format!("OME-XML: pages {first} to {} of {all} are told of", first.saturating_add(count) - 1),
                ));
            }
            let [z, c, t] = ["FirstZ", "FirstC", "FirstT"].map(|name| self.number(block, name));
            let mut at = [z?.unwrap_or(0), c?.unwrap_or(0) / samples, t?.unwrap_or(0)];
            for page in first..first + count {
                let Some(place) = shape.place(at) else {
                    let [z, c, t] = at;
                    return Err(self.tiff.fault(format!("OME-XML: there is no slice {z} of channel {c} and frame {t}")));
                };
                if found.insert(place, Plane { file, page, raw: None }).is_some() {
                    let [z, c, t] = at;
                    return Err(self.tiff.fault(format!("OME-XML: slice {z} of channel {c} and frame {t} is told twice")));
                }
                // The next one in the image's order.
                for axis in shape.axes {
                    let (place, size) = match axis {
                        'z' => (0, shape.slices),
                        'c' => (1, shape.channels),
                        _ => (2, shape.frames),
                    };
                    at[place] += 1;
                    if at[place] < size || axis == shape.axes[2] {
                        break;
                    }
                    at[place] = 0;
                }
            }
        }
        if found.len() < shape.count() {
            return Err(told(found.len()));
        }
        Ok((found.into_values().collect(), files.others))
    }

    /// Whether all planes are in one file by its name, so that it is this one whatever it is called now.
    fn is_alone(&self) -> bool {
        let mut names = self.pixels.descendants().filter(|n| n.tag_name().name() == "UUID").map(|n| (n.attribute("FileName"), n.text()));
        let first = names.next();
        names.all(|n| Some(n) == first)
    }

    /// Voxel sizes in the unit of the first one.
    fn spacing(&self, notes: &mut Vec<String>) -> Result<([f64; 3], Option<LengthUnit>)> {
        let mut spacing = [1.0; 3];
        let mut unit: Option<&str> = None;
        for (size, axis) in spacing.iter_mut().zip(["X", "Y", "Z"]) {
            let (name, unit_name) = (format!("PhysicalSize{axis}"), format!("PhysicalSize{axis}Unit"));
            let Some(text) = self.pixels.attribute(name.as_str()) else { continue };
            let value: f64 = text.trim().parse().unwrap_or(f64::NAN);
            if !(value.is_finite() && value > 0.0) {
                return Err(self.tiff.fault(format!("OME-XML: {name} is {}: it must be above 0", shown(text))));
            }
            let own = self.pixels.attribute(unit_name.as_str()).unwrap_or("\u{b5}m");
            let first = *unit.get_or_insert(own);
            *size = match (metres(own), metres(first)) {
                _ if own == first => value,
                (Some(a), Some(b)) => value * (a / b),
                _ => return Err(self.tiff.fault(format!("OME-XML: voxel sizes in {} and in {}", shown(first), shown(own)))),
            };
        }
        if let Some(unit) = unit {
            let unit: String = unit.chars().filter(|c| !c.is_control()).take(20).collect();
            notes.push(format!("Voxel sizes are in {unit}, as the OME-XML says."));
        }
        Ok((spacing, unit.and_then(LengthUnit::from_word)))
    }
}

/// Length of a unit in metres.
fn metres(unit: &str) -> Option<f64> {
    Some(match unit {
        "km" => 1e3,
        "m" => 1.0,
        "dm" => 1e-1,
        "cm" => 1e-2,
        "mm" => 1e-3,
        "\u{b5}m" | "\u{3bc}m" | "um" => 1e-6,
        "nm" => 1e-9,
        "\u{c5}" => 1e-10,
        "pm" => 1e-12,
        "in" => 0.0254,
        "ft" => 0.3048,
        _ => return None,
    })
}

/// The files that an image's planes are in.
struct Files<'a, 'b> {
    image: &'b Image<'a>,
    /// Position of each name: 0 for the file itself.
    names: BTreeMap<&'a str, usize>,
    others: Vec<Tiff>,
    /// The folder that the file is in, once it is needed.
    folder: Option<Folder>,
    /// Whether a name that is not there is that of the file itself.
    renamed: bool,
}

impl<'a> Files<'a, '_> {
    /// Which file a block of planes is in; it is opened where it is another one.
    fn of(&mut self, block: Node<'a, 'a>) -> Result<usize> {
        let Some(uuid) = children(block, "UUID").next() else { return Ok(0) };
        let Some(name) = uuid.attribute("FileName") else { return Ok(0) };
        let tiff = self.image.tiff;
        let path = tiff.places.path();
        let is_own =
            path.file_name().is_some_and(|n| n.to_str() == Some(name)) || uuid.text().is_some_and(|id| Some(id) == self.image.uuid);
        if is_own || self.renamed {
            return Ok(0);
        }
        if let Some(&known) = self.names.get(name) {
            return Ok(known);
        }
        if name.contains('/') {
            return Err(tiff.fault(format!("OME-XML: planes are in {}, which is no name of a file beside this one", shown(name))));
        }
        let folder = match &mut self.folder {
            Some(folder) => folder,
            none => {
                let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
                none.insert(Folder::open(parent, tiff.places.limits())?)
            }
        };
        let Some(source) = folder.at(name)? else {
            return Err(tiff.fault(format!("OME-XML: planes are in {}, which is not beside this file", shown(name))));
        };
        let other = Tiff::open(Store::File(source))?;
        self.others.push(other);
        self.names.insert(name, self.others.len());
        Ok(self.others.len())
    }
}
