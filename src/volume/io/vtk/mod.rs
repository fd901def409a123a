//! Structured points of VTK's legacy format, versions 1.0 to 5.x: text header, voxels as text or in big-endian binary.
//!
//! Source of the format: "VTK File Formats", <https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html>. Of several arrays the
//! scalars of the points are read, else another array of the points, else one of the cells; what follows it is another array, metadata, or
//! padding, or else an error.

mod arrays;

use super::field::{Field, grid, named};
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading, no_array, pick};
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, ascii, layout};
use crate::volume::{Space, Volume, VoxelType};
use crate::{Error, Result};
use arrays::{Array, Scan};
use glam::{DMat3, DVec3};

pub(super) const READER: Reader = Reader {
    name: "VTK legacy",
    extensions: &["vtk"],
    reads: "structured points, binary and ascii; arrays of points or cells by name; colours, channels",
    parts: &[Part::Array, Part::Channel],
    probe: |clues| if clues.has(0, b"# vtk DataFile") { Certainty::Magic } else { Certainty::No },
    read,
    list: Some(list),
};

/// What may start a section after the voxels.
const SECTIONS: [&str; 14] = [
    "METADATA",
    "SCALARS",
    "COLOR_SCALARS",
    "LOOKUP_TABLE",
    "VECTORS",
    "NORMALS",
    "TEXTURE_COORDINATES",
    "TENSORS",
    "TENSORS6",
    "FIELD",
    "POINT_DATA",
    "CELL_DATA",
    "GLOBAL_IDS",
    "PEDIGREE_IDS",
];

/// Only another section or padding may follow voxels in binary.
fn check_rest(source: &mut Source, bytes: u64) -> Result<()> {
    let rest = source.peek(64)?;
    let text = String::from_utf8_lossy(rest).trim_start().to_ascii_uppercase();
    // The arrays of a field have names of their own: the scan has found them already.
    if SECTIONS.iter().any(|s| text.starts_with(s)) { Ok(()) } else { source.check_tail(bytes, Tail::Nothing) }
}

/// Which of the arrays is read, and its place among them: the one of that name; else scalars before others, points before cells, arrays of one
/// component before others.
fn choose(source: &Source, arrays: &[Array], reading: &Reading) -> Result<usize> {
    if let Some(name) = &reading.choice.array {
        return arrays
            .iter()
            .position(|a| a.name == *name)
            .ok_or_else(|| source.fault(no_array(name, arrays.iter().map(|a| a.name.as_str()))));
    }
    let rank = |a: &Array| (a.cells, !a.active, a.components != 1);
    let usable = arrays.iter().enumerate().filter(|(_, a)| a.stored.is_some());
    let best = usable.min_by_key(|(i, a)| (rank(a), *i)).map(|(i, _)| i);
    best.ok_or_else(|| match arrays.first() {
        None => source.fault("the file ends before any SCALARS"),
        Some(a) => source.fault(format!("voxels of type {} are not supported", a.kind)),
    })
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut source = store.source()?;
    let scan = Scan::of(&mut source, None)?;
    let taken = choose(&source, &scan.arrays, reading)?;
    let mut items = Vec::new();
    if scan.arrays.len() > 1 {
        items.extend(scan.arrays.iter().enumerate().map(|(i, a)| Item::new(Part::Array, a.name.clone(), a.about(), i == taken)));
    }
    let array = &scan.arrays[taken];
    if array.components > 1 {
        let about = if array.color && reading.choice.channel.is_none() { "together they are a colour" } else { "one of them is read" };
        items.push(Item::row(Part::Channel, array.components, about));
    }
    Ok(items)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let mut notes = Vec::new();
    let mut scan;
    if source.is_once() && reading.choice.array.is_none() {
        // What comes through a pipe comes once: the first array is read.
        scan = Scan::of(&mut source, Some(0))?;
        notes.push("from a pipe the first array is read".to_owned());
    } else {
        let again = if source.is_once() { None } else { Some(Source::open(&path, source.limits())?) };
        scan = Scan::of(&mut source, None)?;
        let taken = choose(&source, &scan.arrays, reading)?;
        if scan.arrays.len() > 1 && reading.choice.array.is_none() {
            let array = &scan.arrays[taken];
            notes.push(format!(
                "array {:?} of {} is read ({}; volume.array chooses another)",
                array.name,
                scan.arrays.len(),
                array.about()
            ));
        }
        source = again.ok_or_else(|| source.fault("an array cannot be chosen from a pipe: give the file"))?;
        scan = Scan::of(&mut source, Some(taken))?;
    }
    let Some(array) = scan.arrays.pop() else { return Err(source.fault("the file ends before any SCALARS")) };
    let stored = array.stored.ok_or_else(|| source.fault(format!("voxels of type {} are not supported", array.kind)))?;
    let points = scan.points.ok_or_else(|| source.fault("the header has no DIMENSIONS"))?;
    let mut spacing = scan.spacing.unwrap_or(DVec3::ONE);
    for axis in 0..3 {
        if spacing[axis] == 0.0 && points[axis] == 1 {
            notes.push(format!("the spacing along axis {axis}, of one point, is 0: it is taken for 1"));
            spacing[axis] = 1.0;
        }
    }
    // Along an axis of one point the cells are flat: they keep its place.
    let dims = points.map(|n| if array.cells { n.max(2) - 1 } else { n });
    let shift = DVec3::from_array(points.map(|n| if array.cells && n > 1 { 0.5 } else { 0.0 }));
    let grid = grid(&path, dims, scan.origin + shift * spacing, DMat3::from_diagonal(spacing), Space::Unknown)?;
    if grid.voxel_count() != array.count {
        let ([x, y, z], said) = (dims, array.count);
        return Err(source.fault(format!("data for {said} voxels, but the dimensions give {x} x {y} x {z} = {}", grid.voxel_count())));
    }
    let components = array.components;
    let colors = array.color && reading.choice.channel.is_none();
    let channel = pick(&path, Part::Channel, reading.choice.channel, components)?;
    if components > 1 && !colors && reading.choice.channel.is_none() {
        notes.push(format!("channel 0 of {components} is read (volume.channel chooses another)"));
    }
    let keep = if colors { 0..components } else { channel..channel + 1 };
    let bytes = (array.count as u64).saturating_mul(components as u64).saturating_mul(stored.bytes() as u64);
    // Behind an array of a field another one may follow, of any name.
    let sections = if array.in_field { None } else { Some(&SECTIONS[..]) };
    let flat = [dims[0].saturating_mul(components), dims[1], dims[2]];
    let voxels = match (scan.binary, components) {
        (true, 1) => source.voxels(dims, stored, Endian::Big, Tail::Unchecked)?,
        (true, _) => source.interleaved(dims, stored, Endian::Big, (components, keep, colors), Tail::Unchecked)?,
        (false, _) if array.fractions => {
            let fractions = ascii::voxels(&mut source, flat, VoxelType::F32.into(), sections)?;
            arrays::bytes_of(&fractions, components, keep, colors)
        }
        (false, 1) => ascii::voxels(&mut source, dims, stored, sections)?,
        (false, _) => layout::picked(&ascii::voxels(&mut source, flat, stored, sections)?, (components, keep, colors)),
    };
    if scan.binary && !array.in_field {
        check_rest(&mut source, bytes)?;
    }
    let volume = if colors { super::field::colors(grid, voxels, components == 4) } else { Volume::new(grid, voxels) };
    Ok(notes.into_iter().fold(named(&path, volume)?, Volume::with_note))
}

/// The next line that is not blank, its first word in capitals, and the rest.
fn statement(source: &mut Source) -> Result<Option<(String, String)>> {
    Ok(words(source)?.map(|(word, rest)| (word.to_ascii_uppercase(), rest)))
}

/// The next line that is not blank: its first word as it stands, and the rest.
fn words(source: &mut Source) -> Result<Option<(String, String)>> {
    while let Some(line) = source.line()? {
        let line = line.trim();
        if !line.is_empty() {
            let (word, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
            return Ok(Some((word.to_owned(), rest.trim().to_owned())));
        }
    }
    Ok(None)
}

/// One size: the number of voxels.
fn one(field: Field) -> Result<usize, Error> {
    match field.sizes()?[..] {
        [n] => Ok(n),
        _ => Err(field.fault("one number of voxels is needed")),
    }
}
