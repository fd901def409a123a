//! DICOM: images of one file, or of the many files of a series in a folder, a zip archive or a tar archive.
//!
//! Source of the format: the DICOM standard, <https://www.dicomstandard.org/current>: PS3.5 for how files are written (`elements.rs`,
//! `syntax.rs`, `codecs.rs`), PS3.3 for what images say of themselves (`dataset.rs`, `image.rs`, `geometry.rs`, `unplaced.rs`), PS3.10 for files.
//!
//! Reading goes in two passes. The first one looks at every header, up to the pixels, and sorts images into groups (`series.rs`); one group is
//! taken, and its images are ordered by where they lie (`geometry.rs`, `spacing.rs`; of several moments
//! `moments.rs` tells which one is meant). The second pass reads the pixels of that group alone (`pixels.rs`).
//!
//! Values stay as they are stored, also those of MONOCHROME1, which are shown dark where they are large: a picture is made by a transfer
//! function here, so only a note tells of it. Nothing that tells who was examined is read; the series' description is shown when there are
//! several to choose from.

mod codecs;
mod colors;
mod dataset;
mod elements;
mod geometry;
mod header;
mod image;
#[cfg(feature = "jpeg2000")]
mod jpeg2000;
mod layout;
mod moments;
mod pixels;
mod resample;
mod rle;
mod series;
mod spacing;
mod syntax;
mod tags;
mod unplaced;

use super::field::{grid, named};
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading, pick};
use super::source::Source;
use super::store::Store;
use super::tree::{Tree, is_tar};
use crate::volume::{LengthUnit, Modality, Space, Volume};
use crate::{Error, Result};
use dataset::{has_magic, looks_bare};
use geometry::Stack;
use image::Photometric;
use series::{Frame, Group, Study};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::Path;
use syntax::Codec;

pub(super) const READER: Reader = Reader {
    name: "DICOM",
    extensions: &["dcm", "dicom", "ima"],
    reads: "a file, a folder, a zip or tar archive of them; series by position, gantry tilt, frames; RLE, JPEG, JPEG-LS, JPEG 2000",
    parts: &[Part::Series, Part::Frame, Part::Channel],
    probe,
    read,
    list: Some(list),
};

/// Most files of a folder or archive that are looked into to find out whether it is one of DICOM files.
const LOOKED_INTO: usize = 64;
/// Most bytes of a compressed tar archive that are inflated to find it out.
const INFLATED: u64 = 64 << 20;

fn probe(clues: &Clues) -> Certainty {
    if has_magic(clues.head) {
        return Certainty::Inner;
    }
    let archive = clues.has(0, b"PK\x03\x04") || is_tar(clues.head);
    if clues.folder.is_some() || archive {
        return if clues.has_entry("DICOMDIR") || holds_dicom(clues) { Certainty::Magic } else { Certainty::No };
    }
    if looks_bare(clues.head) { Certainty::Hint } else { clues.by_name(READER.extensions) }
}

/// Whether one of the first files in a folder or archive is a DICOM file by its magic, or all of them look like some without.
fn holds_dicom(clues: &Clues) -> bool {
    let (mut found, mut bare, mut seen, mut passed) = (false, true, 0, 0u64);
    // What cannot be opened is not of this format, or another reader says why.
    let tree = match clues.folder {
        Some(_) => Store::open(clues.path, clues.limits).and_then(Tree::of),
        // A pipe cannot be looked into twice.
        None if !clues.path.is_file() => return is_tar(clues.head),
        None => Source::open(clues.path, clues.limits).and_then(|source| Tree::of(Store::File(source))),
    };
    let looked = tree.and_then(|tree| {
        tree.visit(&|_| true, &mut |mut leaf| {
            seen += 1;
            let head = leaf.source.peek(132).unwrap_or_default();
            found = has_magic(head);
            bare &= looks_bare(head);
            passed = passed.saturating_add(leaf.source.left());
            Ok(!found && seen < LOOKED_INTO && (!clues.packed || passed < INFLATED))
        })
    });
    (found || (bare && seen > 0)) && looked.is_ok()
}

/// The study in `store`, and which of its groups is taken.
fn chosen(store: Store, reading: &Reading) -> Result<(Tree, Study, usize)> {
    let tree = Tree::of(store)?;
    let study = Study::scan(&tree, reading)?;
    let taken = study.choose(&tree, reading)?;
    Ok((tree, study, taken))
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let (tree, study, taken) = chosen(store, reading)?;
    let mut items = if study.groups.len() > 1 { study.items(taken) } else { Vec::new() };
    // What cannot be stacked is told when it is read. Images of the same UID are taken for copies here.
    let mut frames = study.groups[taken].frames.clone();
    let repeated = series::repeated(&study.images, &study.groups[taken]);
    let mut seen = BTreeSet::new();
    frames.retain(|f| !repeated.contains(&f.image) || seen.insert((&study.images[f.image].object, f.frame)));
    let sums = |images: &BTreeSet<usize>| pixel_sums(&tree, &study, images);
    if let Ok(stack) = geometry::stack(&study, tree.path(), &frames, &sums, reading) {
        if stack.moments > 1 {
            let values = if stack.values.is_empty() { String::new() } else { format!("{}, ", stack.values) };
            let about = format!("images at each position: {values}frame {} is read", reading.choice.frame.unwrap_or(0));
            items.push(Item::row(Part::Frame, stack.moments, about));
        }
    }
    if study.first(&study.groups[taken]).layout.is_color() {
        let about = match channel(tree.path(), reading)? {
            None => "together they are a colour".to_owned(),
            Some(n) => format!("channel {n} is read, {}", COLORS[n]),
        };
        items.push(Item::row(Part::Channel, COLORS.len(), about));
    }
    Ok(items)
}

/// The channels of a colour.
const COLORS: [&str; 3] = ["red", "green", "blue"];

/// Which channel of a colour is chosen, if one is.
fn channel(path: &Path, reading: &Reading) -> Result<Option<usize>> {
    reading.choice.channel.map(|n| pick(path, Part::Channel, Some(n), COLORS.len())).transpose()
}

/// The frames of a group in their order; of files that are the same to the byte one alone.
fn stacked(tree: &Tree, study: &Study, group: &Group, reading: &Reading) -> Result<(Option<String>, Stack)> {
    let repeated = series::repeated(&study.images, group);
    let mut frames = group.frames.clone();
    let mut note = None;
    if !repeated.is_empty() {
        let copies = copies(tree, study, &repeated)?;
        frames.retain(|f| !copies.contains(&f.image));
        if !copies.is_empty() {
            note = Some(format!("Files left out since they are copies of others: {}.", copies.len()));
        }
    }
    let sums = |images: &BTreeSet<usize>| pixel_sums(tree, study, images);
    Ok((note, geometry::stack(study, tree.path(), &frames, &sums, reading)?))
}

/// Adds the next `length` bytes of `source` to `hash`, or as many as there are.
fn add(hash: &mut Sha256, source: &mut Source, path: &Path, length: u64) -> Result<()> {
    let mut chunk = vec![0; 1 << 16];
    let mut stream = source.by_ref().take(length);
    loop {
        let n = stream.read(&mut chunk).map_err(|e| Error::io(path, e))?;
        if n == 0 {
            return Ok(());
        }
        hash.update(&chunk[..n]);
    }
}

/// Checksums of the pixels of `images` and of all that gives them a meaning. Those of a palette have none.
fn pixel_sums(tree: &Tree, study: &Study, images: &BTreeSet<usize>) -> Result<BTreeMap<usize, Vec<u8>>> {
    let by_leaf: BTreeMap<usize, usize> = images.iter().map(|&i| (study.images[i].leaf, i)).collect();
    let mut found = BTreeMap::new();
    tree.visit(&|leaf| by_leaf.contains_key(&leaf), &mut |leaf| {
        let Some(&index) = by_leaf.get(&leaf.index) else { return Ok(true) };
        let image = &study.images[index];
        if image.palette.is_some() {
            return Ok(true);
        }
        let mut source = pixels::source(image, leaf.source)?;
        let rescale: Vec<_> = image.frames.iter().map(|f| (f.slope, f.intercept)).collect();
        let mut hash = Sha256::new();
        hash.update(format!("{:?}", (&image.syntax, image.layout, image.bits, image.planar, image.words, rescale)));
        let native = image.layout.native_bytes() as u64 * image.frames.len() as u64;
        add(&mut hash, &mut source, &leaf.path, if image.syntax.codec == Codec::Native { native } else { u64::MAX })?;
        found.insert(index, hash.finalize().to_vec());
        Ok(true)
    })?;
    Ok(found)
}

/// Those of `images` that have the same bytes as an earlier one.
fn copies(tree: &Tree, study: &Study, images: &BTreeSet<usize>) -> Result<BTreeSet<usize>> {
    let by_leaf: BTreeMap<usize, usize> = images.iter().map(|&i| (study.images[i].leaf, i)).collect();
    let (mut seen, mut found) = (BTreeSet::new(), BTreeSet::new());
    tree.visit(&|leaf| by_leaf.contains_key(&leaf), &mut |mut leaf| {
        let mut hash = Sha256::new();
        add(&mut hash, &mut leaf.source, &leaf.path, u64::MAX)?;
        if !seen.insert(hash.finalize()) {
            found.extend(by_leaf.get(&leaf.index));
        }
        Ok(true)
    })?;
    Ok(found)
}

/// What the group's files say that one should know.
fn remarks(study: &Study, frames: &[Frame]) -> Vec<String> {
    let images: Vec<&image::Image> = frames.iter().map(|f| &study.images[f.image]).collect();
    let mut notes = Vec::new();
    if images[0].layout.photometric == Photometric::Inverted {
        notes.push("Large values are meant to be shown dark (MONOCHROME1): values are as stored.".to_owned());
    }
    if images.iter().any(|i| i.has_table) {
        notes.push("The files have a table of values (modality LUT), which is not applied.".to_owned());
    }
    if images[0].frames[0].kind.as_deref().is_some_and(|kind| kind.contains("MOSAIC")) {
        notes.push("Each image is a mosaic of several slices, which is not taken apart.".to_owned());
    }
    notes
}

/// The kind of values of a series.
fn modality(study: &Study, frames: &[Frame]) -> Modality {
    let image = &study.images[frames[0].image];
    let facts = &image.frames[frames[0].frame];
    match image.modality.as_str() {
        // Without an intercept values are not known to be Hounsfield units.
        "CT" if facts.intercept.is_some() && facts.hounsfield.unwrap_or(true) => Modality::Ct,
        "MR" => Modality::Mr,
        // CT of other units, and what does not say.
        "CT" | "" => Modality::Unknown,
        _ => Modality::Other,
    }
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let (tree, study, taken) = chosen(store, reading)?;
    let group = &study.groups[taken];
    let damaged = study.damaged(&tree, taken)?;
    let color = study.first(group).layout.is_color();
    let channel = if color { channel(tree.path(), reading)? } else { None };
    if !color {
        pick(tree.path(), Part::Channel, reading.choice.channel, 1)?;
    }
    let (copies, stack) = stacked(&tree, &study, group, reading)?;
    let mut notes = Vec::new();
    if study.groups.len() > 1 {
        let how = match reading.choice.series {
            Some(_) => "as chosen",
            None if study.is_tied(taken) => "one of those with most images",
            None => "that of most images",
        };
        notes.push(format!("Series {taken} of {} is read, {how}: {}.", study.groups.len(), study.about(group)));
    }
    notes.extend(study.left_out.iter().cloned());
    notes.extend(damaged);
    notes.extend(copies);
    notes.extend(stack.notes.iter().cloned());
    notes.extend(remarks(&study, &stack.slices));
    if let Some(n) = channel {
        notes.push(format!("Of the colours channel {n} is read, {}.", COLORS[n]));
    }
    let loaded = pixels::load(&tree, &study, &stack, channel, reading)?;
    if let Some(padding) = loaded.padding {
        notes.push(format!("Pixels outside of what was scanned have the stored value {padding}."));
    }
    if loaded.computed {
        notes.push("Slices have different slopes or intercepts: values are computed and kept as f32.".to_owned());
    }
    let layout = study.images[stack.slices[0].image].layout;
    let dims = [layout.columns, layout.rows, stack.plan.count(stack.slices.len())];
    let grid = grid(tree.path(), dims, stack.origin, stack.steps, stack.space)?;
    let volume = if loaded.is_color {
        named(tree.path(), Volume::with_colors(grid, loaded.voxels).and_then(Volume::without_alpha))?
    } else {
        let volume = named(tree.path(), Volume::new(grid, loaded.voxels))?;
        let volume = named(tree.path(), volume.with_rescale(loaded.rescale.0, loaded.rescale.1))?;
        let volume = volume.with_unit((stack.space != Space::Unknown).then_some(LengthUnit::Millimetre));
        if color { volume } else { volume.with_modality(modality(&study, &stack.slices)) }
    };
    Ok(notes.into_iter().fold(volume, Volume::with_note))
}
