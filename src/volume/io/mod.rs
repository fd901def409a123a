//! Readers of volume files: a file per format, one room for limits and bounded reading.
//!
//! | format | files | what is read |
//! |---|---|---|
//! | NRRD | `.nrrd`, `.nhdr` + data | raw, gzip and ascii; both byte orders; oblique axes |
//! | NIfTI-1 | `.nii`, `.nii.gz`, `.hdr` + `.img` | both byte orders; sform, qform; rescale |
//! | MetaImage | `.mha`, `.mhd` + data | raw, zlib and ascii; both byte orders; oblique axes |
//! | VTK legacy | `.vtk` | structured points, binary and ascii, scalars of points or cells |
//! | NumPy | `.npy`, `.npz` | three dimensions (z, y, x), C and Fortran order, both byte orders |
//! | raw | any | voxels alone, described by a [`RawSpec`] |
//!
//! Each may also lie inside gzip, whatever its name. Voxels keep their type; 64-bit integers are kept in 32 bits when every
//! value fits. No reader takes memory before the header's claim has been held against [`Limits`], the file's length, and what
//! deflate can inflate it to; voxels are read straight into their place, so the peak is the voxels once and a small buffer.
//!
//! Large files that hold voxels as they are needed are mapped instead of read; see [`Limits::map_bytes`], also for what that asks of a
//! file.

mod ascii;
mod field;
mod gzip;
mod metaimage;
mod nifti;
mod npy;
mod npz;
mod nrrd;
mod raw;
mod source;
mod stored;
mod vtk;

pub use raw::{RawSpec, read_raw};
pub use stored::Endian;

use crate::Result;
use crate::settings::Limits;
use crate::volume::Volume;
use source::Source;
use std::fmt;
use std::path::Path;
use stored::Stored;

/// A kind of volume file that describes itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say it all")]
pub enum Format {
    Nrrd,
    Nifti,
    MetaImage,
    Vtk,
    Npy,
    Npz,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nrrd => "NRRD",
            Self::Nifti => "NIfTI-1",
            Self::MetaImage => "MetaImage",
            Self::Vtk => "VTK legacy",
            Self::Npy => "NumPy",
            Self::Npz => "NumPy archive",
        })
    }
}

/// What the first bytes of a file tell.
enum Content {
    Known(Format),
    /// Recognized, and not read: what it is and what to do.
    Refused(&'static str),
    Unknown,
}

/// First bytes looked at; enough for the magic of the first file in a tar archive.
const HEAD: usize = 1024;

fn content(head: &[u8]) -> Content {
    let has = |at: usize, magic: &[u8]| head.get(at..).is_some_and(|h| h.starts_with(magic));
    if has(0, b"NRRD") {
        Content::Known(Format::Nrrd)
    } else if has(0, b"# vtk DataFile") {
        Content::Known(Format::Vtk)
    } else if has(0, b"\x93NUMPY") {
        Content::Known(Format::Npy)
    } else if has(0, b"PK\x03\x04") || has(0, b"PK\x05\x06") {
        Content::Known(Format::Npz)
    } else if nifti::starts(head) {
        Content::Known(Format::Nifti)
    } else if has(128, b"DICM") || has(0, &[8, 0, 0, 0]) || has(0, &[8, 0, 5, 0]) {
        Content::Refused("a DICOM file: not supported, convert the series to NRRD or NIfTI")
    } else if metaimage::starts(head) {
        Content::Known(Format::MetaImage)
    } else if has(257, b"ustar") {
        let dicom = has(512 + 128, b"DICM");
        Content::Refused(if dicom {
            "a tar archive of DICOM files: not supported, convert the series to NRRD or NIfTI"
        } else {
            "a tar archive: not supported, unpack it and name the volume file (a DICOM series is not supported either)"
        })
    } else if has(4, b"n+2\0") || has(4, b"ni2\0") {
        Content::Refused("a NIfTI-2 file: not supported, convert it to NIfTI-1")
    } else if has(0, b"<?xml") || has(0, b"<VTKFile") {
        Content::Refused("an XML file: not supported (of VTK, the legacy .vtk format is read)")
    } else if has(0, b"II*\0") || has(0, b"MM\0*") {
        Content::Refused("a TIFF file: not supported")
    } else if has(0, b"\x89HDF") {
        Content::Refused("an HDF5 file: not supported")
    } else {
        Content::Unknown
    }
}

/// The format of what `source` holds: by content, and where that does not tell, by name.
fn identify(source: &mut Source) -> Result<Format> {
    let head = source.peek(HEAD)?;
    if head.is_empty() {
        return Err(source.fault("the file is empty (0 bytes)"));
    }
    match content(head) {
        Content::Known(format) => return Ok(format),
        Content::Refused(what) => return Err(source.fault(what)),
        Content::Unknown => {}
    }
    let shown: String = head.iter().take(8).flat_map(|b| std::ascii::escape_default(*b)).map(char::from).collect();
    let name = source.path().to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    Ok(match name.rsplit_once('.').map_or("", |(_, extension)| extension) {
        // These readers then say what is wrong with the header.
        "nii" | "hdr" | "img" => Format::Nifti,
        "nrrd" | "nhdr" => Format::Nrrd,
        "mha" | "mhd" => Format::MetaImage,
        _ => {
            let what = format!("no volume format is known that starts with \"{shown}\" (a raw file needs its dimensions and type)");
            return Err(source.fault(what));
        }
    })
}

/// The format of the file `path`, by its content (also inside gzip), and by its name only where the content does not tell.
///
/// # Errors
/// When the file cannot be read or is of no known format.
pub fn detect(path: impl AsRef<Path>) -> Result<Format> {
    identify(&mut Source::open(path.as_ref(), &Limits::default())?)
}

/// Reads the volume file `path`, whatever its format. Its name becomes the volume's.
///
/// # Errors
/// When the file cannot be read, is of no known format, is not what it claims, or is over `limits`: one line that names the
/// file and the number at fault.
pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Volume> {
    let path = path.as_ref();
    let mut source = Source::open(path, limits)?;
    let format = identify(&mut source)?;
    if format == Format::Nifti && !nifti::starts(source.peek(HEAD)?) {
        // The voxels of a pair: its header is beside it.
        if let Some(header) = nifti::header_of(path) {
            source = Source::open(&header, limits)?;
        }
    }
    let volume = match format {
        Format::Nrrd => nrrd::read(source)?,
        Format::Nifti => nifti::read(source)?,
        Format::MetaImage => metaimage::read(source)?,
        Format::Vtk => vtk::read(source)?,
        Format::Npy => npy::read(source)?,
        // A zip file is read from its end.
        Format::Npz if source.is_packed() => return Err(source.fault("a zip archive inside gzip is not supported: unpack it first")),
        Format::Npz => npz::read(path, limits)?,
    };
    Ok(if volume.name().is_empty() { volume.with_name(path.display().to_string()) } else { volume })
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
