//! Images of VTK's XML format, `.vti`, and its rectilinear grids of even spacing, `.vtr`.
//!
//! Source of the format: "VTK XML file formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>; what it leaves
//! open (padding of base64, the table of compressed blocks, row-major Direction) is as VTK's own writer has it. One array of the points or
//! cells is read. Cells are one fewer than points along each axis, and lie between them.

mod base64;
mod blocks;
mod choice;
mod data;
mod extent;
mod image;
mod outline;

use super::field::{grid, named};
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading};
use super::source::{Source, Tail, inflated_bound, room};
use super::store::Store;
use super::{Stored, ascii};
use crate::volume::{Space, Volume, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use choice::{Chosen, Kept, choose, items};
use data::{Coding, Contents};
use extent::Extent;
use glam::{DMat3, DVec3};
use image::{Array, Content, Image, Lattice, Piece};

pub(super) const READER: Reader = Reader {
    name: "VTK XML",
    extensions: &["vti", "vtr"],
    reads: "image data, rectilinear grids of even spacing; ascii, base64 and raw, zlib and LZ4; both byte orders; any array of points or cells",
    parts: &[Part::Array, Part::Channel],
    probe,
    read,
    list: Some(list),
};

/// Colours of 3 numbers that are read at a time.
const COLORS: usize = 1 << 14;
/// How far a coordinate may be from an even place, in steps.
const UNEVEN: f64 = 1e-3;

fn probe(clues: &Clues) -> Certainty {
    let xml = clues.head.iter().find(|b| !b.is_ascii_whitespace() && !b"\xef\xbb\xbf".contains(b)) == Some(&b'<');
    if xml && clues.head.windows(8).any(|w| w == b"<VTKFile") { Certainty::Magic } else { clues.by_name(READER.extensions) }
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut source = store.source()?;
    let image = Image::read(&mut source)?;
    items(source.path(), &image, &reading.choice)
}

/// Where the points are; what was taken for granted is added to `notes`.
fn lattice(contents: &mut Contents, image: &Image, notes: &mut Vec<String>) -> Result<(DVec3, DMat3)> {
    let flat = |axis: usize| image.pieces.iter().all(|p| p.extent.dims()[axis] == 1);
    let (origin, mut spacing, direction) = match &image.lattice {
        Lattice::Even { origin, spacing, direction } => (*origin, *spacing, *direction),
        Lattice::Rectilinear => {
            let [piece] = &image.pieces[..] else {
                return Err(
                    contents.fault(format!("a rectilinear grid of {} pieces: only those of one piece are read", image.pieces.len()))
                );
            };
            let (origin, spacing) = even(contents, piece, &image.coding)?;
            (origin, spacing, DMat3::IDENTITY)
        }
    };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if spacing[axis] == 0.0 && flat(axis) {
            spacing[axis] = 1.0;
            notes.push(format!("the spacing along {name}, where there is one layer of points, is taken as 1"));
        }
    }
    Ok((origin, direction * DMat3::from_diagonal(spacing)))
}

/// Place of the point (0, 0, 0) and steps of the coordinates of a rectilinear grid; a step of 0 where there is one point.
fn even(contents: &mut Contents, piece: &Piece, coding: &Coding) -> Result<(DVec3, DVec3)> {
    let (mut origin, mut spacing) = (DVec3::ZERO, DVec3::ZERO);
    let [x, y, z] = &piece.coordinates[..] else {
        return Err(contents.fault(format!("a rectilinear grid with coordinates of {} axes, not 3", piece.coordinates.len())));
    };
    for (axis, array) in [x, y, z].into_iter().enumerate() {
        let n = piece.extent.dims()[axis];
        let Some(stored) = array.stored.filter(|_| array.components == 1) else {
            return Err(contents.fault(format!("coordinates along axis {axis} are {}: not supported", array.about())));
        };
        let places = numbers(contents, coding, array, stored, [n, 1, 1], Kept::Channel(0))?;
        let (first, last) = (places.get(0), places.get(n - 1));
        let step = if n > 1 { (last - first) / (n - 1) as f64 } else { 0.0 };
        if let Some(i) = (0..n).find(|&i| !((places.get(i) - (first + i as f64 * step)).abs() <= UNEVEN * step.abs())) {
            let (found, even) = (places.get(i), first + i as f64 * step);
            let what = format!("coordinate {i} of axis {axis} is {found}, with even steps it would be {even}");
            return Err(contents.fault(format!("a rectilinear grid with uneven spacing ({what}): not supported")));
        }
        spacing[axis] = step;
        let step = if step == 0.0 { 1.0 } else { step };
        origin[axis] = first - step * piece.extent.low[axis] as f64;
    }
    Ok((origin, spacing))
}

/// What is kept of the numbers of `array`, of type `stored`, for `dims` voxels: one each, or four where they are colours.
fn numbers(contents: &mut Contents, coding: &Coding, array: &Array, stored: Stored, dims: [usize; 3], kept: Kept) -> Result<Voxels> {
    let [nx, ny, nz] = dims;
    let components = array.components;
    let Some(row) = nx.checked_mul(components) else {
        return Err(contents.fault(format!("array {} has {components} components", array.shown())));
    };
    if let Content::Text(_) = array.content {
        let mut source = contents.open(array, coding, 0)?;
        let all = ascii::voxels(&mut source, [row, ny, nz], stored, Some(&[]))?;
        return Ok(if components == 1 { all } else { of_text(&all, components, kept) });
    }
    let each = (components as u128).saturating_mul(stored.bytes() as u128);
    let Ok(want) = u64::try_from(dims.iter().fold(each, |a, &n| a.saturating_mul(n as u128))) else {
        return Err(contents.fault(format!("array {} of {nx} x {ny} x {nz} times {components} numbers is too large", array.shown())));
    };
    let mut source = contents.open(array, coding, want)?;
    match kept {
        Kept::Channel(0) if components == 1 => source.voxels(dims, stored, coding.endian, Tail::Unchecked),
        Kept::Channel(c) => source.interleaved(dims, stored, coding.endian, (components, c..c + 1, false), Tail::Unchecked),
        Kept::Colors if components == 4 => source.voxels([row, ny, nz], stored, coding.endian, Tail::Unchecked),
        Kept::Colors => opaque(&mut source, dims, want),
    }
}

/// Of numbers that were text, those that are kept.
fn of_text(all: &Voxels, components: usize, kept: Kept) -> Voxels {
    match (all, kept) {
        (Voxels::U8(v), Kept::Colors) => {
            v.chunks_exact(components).flat_map(|c| [c[0], c[1], c[2], c.get(3).copied().unwrap_or(u8::MAX)]).collect::<Vec<_>>().into()
        }
        (_, Kept::Channel(c)) => with_voxels!(all, v => v.iter().skip(c).step_by(components).copied().collect::<Vec<_>>().into()),
        // Colours are of u8 alone.
        (_, Kept::Colors) => Voxels::zeros(VoxelType::U8, 0),
    }
}

/// Colours of red, green and blue in `want` bytes of `source`, with an alpha of 255 behind each.
fn opaque(source: &mut Source, [nx, ny, nz]: [usize; 3], want: u64) -> Result<Voxels> {
    let most = source.left().saturating_mul(2);
    let mut voxels = room(source.path(), source.limits(), [nx * 4, ny, nz], VoxelType::U8.into(), most)?;
    let mut chunk = vec![0; 3 * COLORS];
    let mut before = 0;
    for out in voxels.as_bytes_mut().chunks_mut(4 * COLORS) {
        let bytes = &mut chunk[..out.len() / 4 * 3];
        source.read_exact_into(bytes, before, want)?;
        before += bytes.len() as u64;
        for (rgba, rgb) in out.chunks_exact_mut(4).zip(bytes.chunks_exact(3)) {
            rgba[..3].copy_from_slice(rgb);
            rgba[3] = u8::MAX;
        }
    }
    Ok(voxels)
}

/// Copies the voxels of one piece to their place among those of `all`; each takes `size` bytes.
fn paste(from: &mut Voxels, piece: &Extent, into: &mut Voxels, all: &Extent, size: usize) {
    let ([px, py, pz], [ax, ay, _]) = (piece.dims(), all.dims());
    let [x, y, z] = [0, 1, 2].map(|axis| (piece.low[axis] - all.low[axis]) as usize);
    let (from, into) = (from.as_bytes_mut(), into.as_bytes_mut());
    for k in 0..pz {
        for j in 0..py {
            let (source, place) = ((k * py + j) * px * size, (((z + k) * ay + y + j) * ax + x) * size);
            into[place..place + px * size].copy_from_slice(&from[source..source + px * size]);
        }
    }
}

/// The voxels of all pieces together, which are those of `all`.
fn together(contents: &mut Contents, image: &Image, chosen: &Chosen, all: &Extent, most: u64, reading: &Reading) -> Result<Voxels> {
    let missing = |i: usize| Error::format(contents.path(), format!("piece {i} has no array {} of the same type", chosen.array.shown()));
    let same = |a: &&Array| (&a.name, a.cells) == (&chosen.array.name, chosen.array.cells);
    let alike = |a: &&Array| (a.stored, a.components) == (chosen.array.stored, chosen.array.components);
    let arrays: Vec<&Array> = (image.pieces.iter().enumerate())
        .map(|(i, piece)| piece.arrays.iter().find(same).filter(alike).ok_or_else(|| missing(i)))
        .collect::<Result<_>>()?;
    let Some(stored) = chosen.array.stored else { return Err(missing(0)) };
    let extent = |piece: &Piece| if chosen.array.cells { piece.extent.cells() } else { piece.extent };
    if let [array] = arrays[..] {
        return numbers(contents, &image.coding, array, stored, all.dims(), chosen.kept);
    }
    if !all.is_covered(image.pieces.iter().map(extent)) {
        let what = format!("the {} pieces do not fill the extent {all}", image.pieces.len());
        return Err(contents.fault(what));
    }
    let each = if chosen.kept == Kept::Colors { 4 } else { 1 };
    let [nx, ny, nz] = all.dims();
    let mut voxels = room(contents.path(), contents.limits(), [nx * each, ny, nz], stored, most)?;
    let size = each * stored.voxel_type().bytes();
    for (i, (piece, array)) in image.pieces.iter().zip(arrays).enumerate() {
        reading.step(i as u64, image.pieces.len() as u64)?;
        let extent = extent(piece);
        let mut part = numbers(contents, &image.coding, array, stored, extent.dims(), chosen.kept)?;
        paste(&mut part, &extent, &mut voxels, all, size);
    }
    Ok(voxels)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    // No number takes less than one compressed byte in so many.
    let most = inflated_bound(source.left());
    let image = Image::read(&mut source)?;
    let path = source.path().to_path_buf();
    let chosen = choose(&path, &image, &reading.choice)?;
    let mut notes = chosen.notes.clone();
    let mut contents = Contents::new(source, image.place);
    let points = image.pieces.iter().fold(image.pieces[0].extent, |all, piece| all.joined(&piece.extent));
    if points != image.whole {
        notes.push(format!("the file has the extent {points} of the whole extent {}", image.whole));
    }
    let (origin, steps) = lattice(&mut contents, &image, &mut notes)?;
    let all = if chosen.array.cells { points.cells() } else { points };
    let shift = |axis: usize| if chosen.array.cells && points.dims()[axis] > 1 { 0.5 } else { 0.0 };
    let first = DVec3::from_array([0, 1, 2].map(|axis| all.low[axis] as f64 + shift(axis)));
    let grid = grid(&path, all.dims(), origin + steps * first, steps, Space::Unknown)?;
    let voxels = together(&mut contents, &image, &chosen, &all, most, reading)?;
    let volume = match chosen.kept {
        Kept::Colors => super::field::colors(grid, voxels, chosen.array.components == 4),
        Kept::Channel(_) => Volume::new(grid, voxels),
    };
    Ok(notes.into_iter().fold(named(&path, volume)?, Volume::with_note))
}
