//! NIfTI-1, NIfTI-2 and ANALYZE 7.5: a binary header, voxels behind it (`.nii`) or beside it (`.hdr` and `.img`).
//!
//! Source of the formats: `nifti1.h` and `nifti2.h`, <https://nifti.nimh.nih.gov>. The world is that of `sform`, else of `qform`; its axes point
//! to the subject's right, front and top. With neither, the voxel sizes alone are taken, in an unknown space. Data may be longer than the
//! header says when it is not compressed, as in the format's own library.

mod header;

use super::field::named;
use super::layout::Encoding;
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading};
use super::source::{Source, Tail};
use super::store::Store;
use crate::Result;
use crate::volume::Volume;
use header::{Header, starts};
use std::path::{Path, PathBuf};

pub(super) const READER: Reader = Reader {
    name: "NIfTI",
    extensions: &["nii", "hdr", "img"],
    reads: "versions 1 and 2, ANALYZE 7.5; one file or a pair; sform, qform; rescale; colours, channels, frames",
    parts: &[Part::Frame, Part::Channel],
    probe: |clues| if starts(clues.head) && !clues.has(128, b"DICM") { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: Some(list),
};

/// `x.img` for `x.hdr` (`[from, to]` = `["hdr", "img"]`) or the other way round, with `.gz` and capitals kept.
fn pair_of(path: &Path, [from, to]: [&str; 2]) -> Option<PathBuf> {
    let packed = path.extension()? == "gz";
    let inner = if packed { path.with_extension("") } else { path.to_path_buf() };
    let extension = inner.extension()?;
    if !extension.eq_ignore_ascii_case(from) {
        return None;
    }
    let to = if extension == from { to.to_owned() } else { to.to_ascii_uppercase() };
    let other = inner.with_extension(to);
    Some(if packed { gz_twin(&other) } else { other })
}

/// The header beside the voxels `path` of a pair, where there is one; compressed or not.
fn header_of(path: &Path) -> Option<PathBuf> {
    let header = pair_of(path, ["img", "hdr"])?;
    [header.clone(), gz_twin(&header)].into_iter().find(|p| p.is_file())
}

/// The same name with `.gz` taken off or put on.
fn gz_twin(path: &Path) -> PathBuf {
    if path.extension().is_some_and(|e| e == "gz") {
        return path.with_extension("");
    }
    let mut name = path.as_os_str().to_owned();
    name.push(".gz");
    PathBuf::from(name)
}

/// The voxels beside the header `path`, compressed or not.
fn open_image(path: &Path, source: &Source) -> Result<Source> {
    let Some(image) = pair_of(path, ["hdr", "img"]) else {
        return Err(source.fault("the voxels are in an .img file, but this file is not called .hdr"));
    };
    let twin = gz_twin(&image);
    let image = if !image.exists() && twin.exists() { twin } else { image };
    Source::open(&image, source.limits()).map_err(|e| source.fault(format!("image file: {e}")))
}

/// The stream of the header; its voxels may have been named instead.
fn open_header(store: Store) -> Result<Source> {
    let mut source = store.source()?;
    if !starts(source.peek(4)?) {
        // The voxels of a pair: its header is beside them.
        if let Some(header) = header_of(source.path()) {
            source = Source::open(&header, source.limits())?;
        }
    }
    Ok(source)
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut header = Header::read(&mut open_header(store)?)?;
    let (_, color) = header.stored()?;
    header.layout(color)?.list(reading)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = open_header(store)?;
    let path = source.path().to_path_buf();
    let mut header = Header::read(&mut source)?;
    let (stored, color) = header.stored()?;
    let layout = header.layout(color)?;
    let grid = header.grid(layout.dims)?;
    let (slope, intercept) = header.rescale()?;
    let mut data = if header.beside {
        let mut data = open_image(&path, &source)?;
        data.skip(header.offset(0)?)?;
        data
    } else {
        // Behind the header four bytes say whether extensions follow.
        let offset = header.offset(header.length() + 4)?;
        source.skip(offset - header.length())?;
        source
    };
    let volume = layout.volume(&mut data, (stored, Encoding::Binary(header.endian)), Tail::Ignored, grid, reading)?;
    let volume = if volume.scalars().is_some() { named(&path, volume.with_rescale(slope, intercept))? } else { volume };
    let volume = volume.with_unit(header.unit());
    let labels = header.is_of_labels() && volume.scalars().is_some() && volume.rescale() == (1.0, 0.0);
    let volume = if labels && !volume.voxels().voxel_type().is_float() { named(&path, volume.with_segments(Vec::new()))? } else { volume };
    let volume = header.placed.into_iter().fold(volume, Volume::with_detail);
    Ok(header.notes.into_iter().fold(volume, Volume::with_note))
}
