//! Readers of volume files: a file per format, one room for limits and bounded reading.
//!
//! | format | files | what is read |
//! |---|---|---|
//! | DICOM | `.dcm`, `.dicom`, `.ima` | a file, a folder, a zip or tar archive of them; series by position, gantry tilt, frames; RLE, JPEG, JPEG-LS, JPEG 2000 |
//! | NRRD | `.nrrd`, `.nhdr` | raw, gzip, bzip2, hex and ascii; data in the file, beside it or in many; oblique axes; colours, channels, frames |
//! | NIfTI | `.nii`, `.hdr`, `.img` | versions 1 and 2, ANALYZE 7.5; one file or a pair; sform, qform; rescale; colours, channels, frames |
//! | MetaImage | `.mha`, `.mhd` | raw, zlib and ascii; data in the file, beside it or in many; both byte orders; oblique axes; colours, channels, frames |
//! | VTK legacy | `.vtk` | structured points, binary and ascii; arrays of points or cells by name; colours, channels |
//! | VTK XML | `.vti`, `.vtr` | image data, rectilinear grids of even spacing; ascii, base64 and raw, zlib and LZ4; both byte orders; any array of points or cells |
//! | MRC/CCP4 | `.mrc`, `.map`, `.ccp4`, `.rec`, `.st` | i8, u8, i16, u16, f16, f32 and complex f32; both byte orders; skewed cells, any order of axes; stacks of volumes |
//! | NumPy | `.npy` | (z, y, x), (frame, z, y, x), (z, y, x, colour), (z, y, x, vector); C and Fortran order, both byte orders |
//! | Zarr | `.zarr`, `.zip`, `.ozx` | folders and zip files of versions 2 and 3, OME-Zarr 0.1 to 0.5; a level, frame, channel; gzip, zlib, bz2, LZ4, Zstandard, Blosc; shards |
//! | NumPy archive | `.npz` | an array by its name, else the first of three dimensions; stored or deflated |
//! | TIFF | `.tif`, `.tiff`, `.btf`, `.tf8` | many pages, BigTIFF, OME-TIFF, ImageJ; integers and floats; strips and tiles; LZW, deflate and PackBits |
//! | image stack |  | a folder or a pattern of PNG, TIFF, JPEG, BMP or PNM images, one a slice, of 8 and 16 bits; float TIFF; greys and colours |
//! | VolVis | `.dat` | three dimensions, then little-endian u16 voxels; known by its exact length |
//!
//! Voxels alone, in a file of any name, are read where a [`RawSpec`] describes them.
//!
//! Each but archives, TIFF and images may also lie inside gzip, whatever its name. Voxels keep their type; 64-bit integers are kept in
//! 32 bits when every value fits. No reader takes memory before the header's claim has been held against [`Limits`], the file's length, and
//! what deflate can inflate it to; voxels are read straight into their place, so the peak is the voxels once and a small buffer. Images and
//! pages of TIFF files are unpacked several at a time, which takes a quarter of the voxels more at most and 32 MiB, or one slice.
//!
//! Large files that hold voxels as they are needed are mapped instead of read; see [`Limits::map_bytes`], also for what that asks of a
//! file.
//!
//! Volumes are written by [`write()`], as NRRD, NIfTI, MetaImage, NumPy and raw files; with levels of detail, as OME-Zarr, by `write_pyramid`.
//!
//! A format is a file here that declares one `Reader`: its name, its extensions, what of it is read, how it is recognised, and how it is
//! read. A line in `formats!` below makes it known. What is recognised and not read stands in `refused.rs`. Readers work on a `Store`: a
//! file, as a stream or at chosen places, or a folder of files.

mod ascii;
mod dat;
#[cfg(feature = "dicom")]
mod dicom;
mod field;
mod folder;
mod gzip;
mod hex;
mod layout;
mod magnitude;
mod metaimage;
mod mrc;
#[cfg(any(feature = "dicom", feature = "stacks"))]
mod natural;
mod nifti;
mod npy;
mod npz;
mod nrrd;
mod raw;
mod reader;
mod reading;
mod refused;
#[cfg(feature = "stacks")]
mod slices;
mod source;
mod spread;
#[cfg(feature = "stacks")]
mod stack;
mod store;
mod stored;
#[cfg(feature = "stacks")]
mod tiff;
#[cfg(feature = "dicom")]
mod tree;
mod vti;
mod vtk;
mod write;
#[cfg(feature = "zarr")]
mod zarr;
mod zip;

/// What is told of images that say nothing of sizes.
pub(super) const NO_SIZES: &str = "The images do not say how large voxels are: 1 x 1 x 1 is taken (volume.spacing sets it).";

pub use crate::lanes::{cut_file, survive_cut_files};
pub use raw::{RawSpec, read_raw};
pub use reading::{Choice, Item, Part, Reading};
pub use stored::Endian;
pub use write::{WriteFormat, Writing, Written, write, write_to};
#[cfg(feature = "zarr")]
pub use zarr::write_pyramid;

use crate::settings::Limits;
use crate::volume::{Levels, Volume};
use crate::{Error, Result};
use folder::Folder;
use reader::{Certainty, Clues, Reader};
use refused::REFUSALS;
use std::fmt;
use std::path::Path;
use store::Store;
use stored::Stored;

macro_rules! formats {
    ($($(#[$when:meta])* $format:ident in $module:ident,)*) => {
        /// A kind of volume file that describes itself.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        #[allow(missing_docs, reason = "the names say it all")]
        pub enum Format {
            $($(#[$when])* $format,)*
        }

        impl Format {
            /// All of them that this build reads.
            pub const ALL: &'static [Self] = &[$($(#[$when])* Self::$format,)*];

            fn reader(self) -> &'static Reader {
                match self {
                    $($(#[$when])* Self::$format => &$module::READER,)*
                }
            }
        }
    };
}

// Of two that are as sure of a file the first one reads it. A reader that takes other libraries stands behind a feature of its own, such as
// `#[cfg(feature = "dicom")]`; without it `refused.rs` says what is missing.
formats! {
    // Before archives and folders of other formats, which it looks into.
    #[cfg(feature = "dicom")]
    Dicom in dicom,
    Nrrd in nrrd,
    Nifti in nifti,
    MetaImage in metaimage,
    Vtk in vtk,
    Vti in vti,
    Mrc in mrc,
    Npy in npy,
    // A zip file of Zarr is told from one of arrays by its first file.
    #[cfg(feature = "zarr")]
    Zarr in zarr,
    Npz in npz,
    #[cfg(feature = "stacks")]
    Tiff in tiff,
    #[cfg(feature = "stacks")]
    Stack in stack,
    Dat in dat,
}

impl Format {
    /// What it is called.
    pub fn name(self) -> &'static str {
        self.reader().name
    }

    /// Extensions of its files, in lower case, without the dot.
    pub fn extensions(self) -> &'static [&'static str] {
        self.reader().extensions
    }

    /// What of it is read, in a few words.
    pub fn reads(self) -> &'static str {
        self.reader().reads
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What the clues tell.
enum Verdict {
    Known(Format),
    /// Recognised and not read: what it is and what to do.
    Refused(&'static str),
    Unknown,
}

/// The surest of all formats and refusals.
fn judge(clues: &Clues) -> Verdict {
    let (mut surest, mut verdict) = (Certainty::No, Verdict::Unknown);
    let known = Format::ALL.iter().map(|&format| ((format.reader().probe)(clues), Verdict::Known(format)));
    let refused = REFUSALS.iter().map(|refusal| ((refusal.probe)(clues), Verdict::Refused(refusal.says)));
    for (certainty, candidate) in known.chain(refused) {
        if certainty > surest {
            (surest, verdict) = (certainty, candidate);
        }
    }
    verdict
}

/// The format of what `store` holds.
fn identify(store: &mut Store) -> Result<Format> {
    let clues = store.clues()?;
    let says = match judge(&clues) {
        Verdict::Known(format) => return Ok(format),
        Verdict::Refused(says) => says.to_owned(),
        Verdict::Unknown => {
            let shown: String = clues.head.iter().take(8).flat_map(|b| std::ascii::escape_default(*b)).map(char::from).collect();
            format!("no volume format is known that starts with \"{shown}\" (a raw file needs its dimensions and type)")
        }
    };
    Err(match store {
        Store::Folder(folder) if !says.starts_with("is a directory") => Error::format(folder.path(), instead_of(folder)),
        _ => Error::format(store.path(), says),
    })
}

/// Most files of a folder that are looked into for one to name.
const LOOKED_INTO: usize = 64;

/// What is said of a folder of no known format: what may be given in its place.
fn instead_of(folder: &Folder) -> String {
    let mut refused = None;
    for name in folder.names().iter().take(LOOKED_INTO) {
        // A file that cannot be read is not one to name.
        let Ok(mut file) = folder.file(name) else { continue };
        let Ok(clues) = file.clues() else { continue };
        match judge(&clues) {
            Verdict::Known(_) => return format!("is a directory, not a volume: give one volume file, such as {name:?} in it"),
            Verdict::Refused(says) => refused = refused.or(Some(format!("{name:?} in it is {says}"))),
            Verdict::Unknown => {}
        }
    }
    let found = refused.unwrap_or_else(|| match folder.names().len() {
        0 => "there are no files in it".to_owned(),
        1 => "the one file in it is of no format that is known".to_owned(),
        n if n > LOOKED_INTO => format!("the first {LOOKED_INTO} of {n} files in it are of no format that is known"),
        n => format!("the {n} files in it are of no format that is known"),
    });
    format!("is a directory, not a volume: {found}")
}

/// The format of the file `path`, by its content (also inside gzip), and by its name only where the content does not tell.
///
/// # Errors
/// When the file or folder cannot be read or is of no known format.
pub fn detect(path: impl AsRef<Path>) -> Result<Format> {
    identify(&mut Store::open(path.as_ref(), &Limits::default())?)
}

/// Reads the volume file or folder `path`, whatever its format: [`read_as`] with nothing chosen.
///
/// # Errors
/// As [`read_as`].
pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Volume> {
    read_as(path, &Reading::new().limits(*limits))
}

/// Reads the volume file or folder `path`, whatever its format; `-` is standard input, and a name with `*` or `?` in it stands for several
/// files of a folder. Its name becomes the volume's. What was chosen or repaired on the way stands in [`Volume::notes`].
///
/// # Errors
/// When the file cannot be read, is of no known format, is not what it claims, is over the limits, or has nothing of what is chosen: one line
/// that names the file and the number at fault. For a folder of no known format, a line that says what may be given instead.
/// [`Error::Stopped`] when it was stopped.
pub fn read_as(path: impl AsRef<Path>, reading: &Reading) -> Result<Volume> {
    let path = path.as_ref();
    if reading.choice.magnitude {
        return magnitude::read(path, reading);
    }
    let mut store = Store::open(path, &reading.limits)?;
    let format = identify(&mut store)?;
    reading.check(store.path(), format.name(), format.reader().parts)?;
    let name = store.path().display().to_string();
    let volume = (format.reader().read)(store, reading)?;
    Ok(if volume.name().is_empty() { volume.with_name(name) } else { volume })
}

/// The levels of detail of the volume file or folder `path`: those of an OME-Zarr image as they are, of other files every voxel, every second,
/// every fourth ... of the volume that [`read_as`] gives. Where that is mapped, or an OME-Zarr image, no voxels are read here.
///
/// # Errors
/// As [`read_as`]; [`Error::Invalid`] for colours and labels. The limits hold for what has to be read into memory: see [`Limits::within`].
pub fn read_levels(path: impl AsRef<Path>, reading: &Reading) -> Result<Levels> {
    let path = path.as_ref();
    #[cfg(feature = "zarr")]
    if !Store::comes_once(path) && !reading.choice.magnitude {
        let mut store = Store::open(path, &reading.limits)?;
        if identify(&mut store)? == Format::Zarr {
            reading.check(store.path(), Format::Zarr.name(), Format::Zarr.reader().parts)?;
            return zarr::levels(store, reading);
        }
    }
    Levels::of_volume(&read_as(path, &Reading { pixels: None, ..reading.clone() })?)
}

/// What there is to choose from in the volume file or folder `path`, without reading voxels; empty where there is one volume only. What is
/// chosen already is marked as taken, and so is what would be taken where nothing is. Of what another program sends nothing is listed, since
/// it comes once.
///
/// # Errors
/// As [`read_as`].
pub fn list(path: impl AsRef<Path>, reading: &Reading) -> Result<Vec<Item>> {
    if Store::comes_once(path.as_ref()) {
        return Ok(Vec::new());
    }
    let mut store = Store::open(path.as_ref(), &reading.limits)?;
    let format = identify(&mut store)?;
    match format.reader().list {
        Some(list) => list(store, reading),
        None => Ok(Vec::new()),
    }
}

impl Volume {
    /// Reads the volume file `path` within the default [`Limits`]; see [`read`].
    ///
    /// # Errors
    /// As [`read`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        read(path, &Limits::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_above_has_a_row_for_each_format() {
        let page = include_str!("mod.rs");
        for &format in Format::ALL {
            let extensions: Vec<String> = format.extensions().iter().map(|e| format!("`.{e}`")).collect();
            let row = format!("//! | {format} | {} | {} |\n", extensions.join(", "), format.reads());
            assert!(page.contains(&row), "missing: {row}");
        }
    }
}
