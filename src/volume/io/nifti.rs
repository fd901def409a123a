//! NIfTI-1: 348 bytes of header, voxels behind it (`.nii`) or beside it (`.hdr` and `.img`).
//!
//! Source of the format: `nifti1.h`, <https://nifti.nimh.nih.gov/nifti-1>. The world is that of `sform`, else of `qform`, else
//! the voxel sizes alone; its axes point to the subject's right, front and top. Data may be longer than the header says when it
//! is not compressed, as in the format's own library.

use super::field::{grid, named};
use super::reader::{Certainty, Reader};
use super::reading::Reading;
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, Stored};
use crate::volume::{Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DQuat, DVec3};
use std::path::{Path, PathBuf};

pub(super) const READER: Reader = Reader {
    name: "NIfTI-1",
    extensions: &["nii", "hdr", "img"],
    reads: "one file or a pair; both byte orders; sform, qform; rescale",
    parts: &[],
    probe: |clues| if starts(clues.head) { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: None,
};

const HEADER: usize = 348;

/// Byte offsets of the fields used, as in `nifti1.h`.
mod at {
    pub(super) const DIM: usize = 40;
    pub(super) const DATATYPE: usize = 70;
    pub(super) const BITPIX: usize = 72;
    pub(super) const PIXDIM: usize = 76;
    pub(super) const VOX_OFFSET: usize = 108;
    pub(super) const SCL_SLOPE: usize = 112;
    pub(super) const SCL_INTER: usize = 116;
    pub(super) const QFORM_CODE: usize = 252;
    pub(super) const SFORM_CODE: usize = 254;
    pub(super) const QUATERN: usize = 256;
    pub(super) const QOFFSET: usize = 268;
    pub(super) const SROW: usize = 280;
    pub(super) const MAGIC: usize = 344;
}

/// Whether the first bytes of a file are a NIfTI-1 or ANALYZE header: it starts with its own length, in either byte order.
fn starts(head: &[u8]) -> bool {
    matches!(head, [0x5c, 1, 0, 0, ..] | [0, 0, 1, 0x5c, ..])
}

struct Header<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    endian: Endian,
}

impl Header<'_> {
    fn i16(&self, at: usize) -> i16 {
        self.endian.u16(&self.bytes[at..]) as i16
    }

    fn f32(&self, at: usize) -> f64 {
        f64::from(self.endian.f32(&self.bytes[at..]))
    }

    fn finite(&self, at: usize, name: &str) -> Result<f64> {
        let value = self.f32(at);
        if value.is_finite() { Ok(value) } else { Err(self.fault(format!("{name} is {value}, not a finite number"))) }
    }

    fn fault(&self, what: String) -> Error {
        Error::format(self.path, what)
    }

    fn dims(&self) -> Result<[usize; 3]> {
        let count = self.i16(at::DIM);
        if !(1..=7).contains(&count) {
            return Err(self.fault(format!("dim[0] is {count}: there must be 1 to 7 dimensions")));
        }
        let mut dims = [1; 3];
        for axis in 1..=count as usize {
            let n = self.i16(at::DIM + 2 * axis);
            match (n, axis) {
                (..1, _) => return Err(self.fault(format!("dim[{axis}] is {n}: it must be at least 1"))),
                (_, 1..4) => dims[axis - 1] = n as usize,
                (1, _) => {}
                _ => return Err(self.fault(format!("dim[{axis}] is {n}: a volume of {count} dimensions is not supported"))),
            }
        }
        Ok(dims)
    }

    fn stored(&self) -> Result<Stored> {
        use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
        let code = self.i16(at::DATATYPE);
        let stored: Stored = match code {
            2 => U8.into(),
            4 => I16.into(),
            8 => I32.into(),
            16 => F32.into(),
            64 => F64.into(),
            256 => I8.into(),
            512 => U16.into(),
            768 => U32.into(),
            1024 => Stored::I64,
            1280 => Stored::U64,
            _ => {
                let name = match code {
                    0 => "unknown",
                    1 => "single bits",
                    32 => "complex64",
                    128 => "RGB colours",
                    1536 => "float128",
                    1792 => "complex128",
                    2048 => "complex256",
                    2304 => "RGBA colours",
                    _ => "no type of NIfTI-1",
                };
                return Err(self.fault(format!("datatype is {code} ({name}): not supported")));
            }
        };
        let bits = self.i16(at::BITPIX);
        // Some writers leave it 0.
        if bits != 0 && bits as usize != stored.bytes() * 8 {
            return Err(self.fault(format!("bitpix is {bits}, but datatype {code} ({stored}) has {} bits", stored.bytes() * 8)));
        }
        Ok(stored)
    }

    /// Voxel size along axis 1 to 3; the format's library takes 1 for 0.
    fn pixdim(&self, axis: usize) -> Result<f64> {
        let size = self.finite(at::PIXDIM + 4 * axis, &format!("pixdim[{axis}]"))?.abs();
        Ok(if size == 0.0 { 1.0 } else { size })
    }

    fn vector(&self, at: usize, name: &str) -> Result<DVec3> {
        Ok(DVec3::new(self.finite(at, name)?, self.finite(at + 4, name)?, self.finite(at + 8, name)?))
    }

    /// Origin and steps.
    fn geometry(&self) -> Result<(DVec3, DMat3)> {
        if self.i16(at::SFORM_CODE) > 0 {
            let column = |c: usize, name| -> Result<DVec3> {
                let row = |r: usize| self.finite(at::SROW + 16 * r + 4 * c, name);
                Ok(DVec3::new(row(0)?, row(1)?, row(2)?))
            };
            let steps = DMat3::from_cols(column(0, "srow[0]")?, column(1, "srow[1]")?, column(2, "srow[2]")?);
            return Ok((column(3, "srow[3]")?, steps));
        }
        let mut sizes = DVec3::new(self.pixdim(1)?, self.pixdim(2)?, self.pixdim(3)?);
        if self.i16(at::QFORM_CODE) <= 0 {
            return Ok((DVec3::ZERO, DMat3::from_diagonal(sizes)));
        }
        let v = self.vector(at::QUATERN, "quatern")?;
        // The unit quaternion's first number is left out of the file; rounding may leave the rest a little over 1.
        let rest = 1.0 - v.length_squared();
        let turn = DQuat::from_xyzw(v.x, v.y, v.z, rest.max(0.0).sqrt());
        if rest < -1e-3 {
            return Err(self.fault(format!("quatern {} {} {} is longer than 1", v.x, v.y, v.z)));
        }
        if self.f32(at::PIXDIM) < 0.0 {
            sizes.z = -sizes.z;
        }
        let steps = DMat3::from_quat(turn.normalize()) * DMat3::from_diagonal(sizes);
        Ok((self.vector(at::QOFFSET, "qoffset")?, steps))
    }

    /// Slope and intercept; a slope that is 0, NaN or infinite means that values are as stored.
    fn rescale(&self) -> Result<(f64, f64)> {
        let slope = self.f32(at::SCL_SLOPE);
        if slope == 0.0 || !slope.is_finite() {
            return Ok((1.0, 0.0));
        }
        Ok((slope, self.finite(at::SCL_INTER, "scl_inter")?))
    }

    /// Where the voxels start; `least` is where the header ends.
    fn offset(&self, least: u64) -> Result<u64> {
        let offset = self.finite(at::VOX_OFFSET, "vox_offset")?;
        // Some writers leave 0 and mean the usual place. f32 counts bytes exactly up to 2^24; a header is far below.
        if offset == 0.0 {
            return Ok(least);
        }
        if offset < least.min(HEADER as u64) as f64 || libm::trunc(offset) != offset || offset > 9e15 {
            return Err(self.fault(format!("vox_offset is {offset}: the voxels cannot start there")));
        }
        Ok(offset as u64)
    }
}

/// `x.img` for `x.hdr` (`[from, to]` = `["hdr", "img"]`) or the other way round, with `.gz` and capitals kept.
fn pair_of(path: &Path, [from, to]: [&str; 2]) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let (stem, gz) = match name.strip_suffix(".gz") {
        Some(stem) => (stem, ".gz"),
        None => (name, ""),
    };
    let (stem, extension) = stem.rsplit_once('.')?;
    if !extension.eq_ignore_ascii_case(from) {
        return None;
    }
    let to = if extension == from { to.to_owned() } else { to.to_ascii_uppercase() };
    Some(path.with_file_name(format!("{stem}.{to}{gz}")))
}

/// The header beside the voxels `path` of a pair, where there is one; compressed or not.
fn header_of(path: &Path) -> Option<PathBuf> {
    let header = pair_of(path, ["img", "hdr"])?;
    [header.clone(), gz_twin(&header)].into_iter().find(|p| p.is_file())
}

/// The same name with `.gz` taken off or put on.
fn gz_twin(path: &Path) -> PathBuf {
    let name = path.to_string_lossy();
    name.strip_suffix(".gz").map_or_else(|| PathBuf::from(format!("{name}.gz")), PathBuf::from)
}

/// The voxels beside the header `path`, compressed or not.
fn open_image(path: &Path, source: &Source) -> Result<Source> {
    let Some(image) = pair_of(path, ["hdr", "img"]) else {
        return Err(source.fault("magic is \"ni1\": the voxels are in an .img file, but this file is not called .hdr"));
    };
    let twin = gz_twin(&image);
    let image = if !image.exists() && twin.exists() { twin } else { image };
    Source::open(&image, source.limits()).map_err(|e| source.fault(format!("image file: {e}")))
}

fn read(store: Store, _: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    if !starts(source.peek(4)?) {
        // The voxels of a pair: its header is beside them.
        if let Some(header) = header_of(source.path()) {
            source = Source::open(&header, source.limits())?;
        }
    }
    let path = source.path().to_path_buf();
    let bytes = source.header(HEADER, "the NIfTI header")?;
    let endian = match bytes[..4] {
        [0x5c, 1, 0, 0] => Endian::Little,
        [0, 0, 1, 0x5c] => Endian::Big,
        _ => {
            let found = Endian::Little.u32(&bytes) as i32;
            return Err(source.fault(format!("no NIfTI-1 file: sizeof_hdr is {found}, not 348")));
        }
    };
    let header = Header { path: &path, bytes: &bytes, endian };
    let magic = &bytes[at::MAGIC..];
    if !matches!(magic, b"n+1\0" | b"ni1\0") {
        let what = if magic == [0; 4] { " (ANALYZE 7.5 is not supported)" } else { "" };
        return Err(source.fault(format!("magic is {:?}, not \"n+1\" or \"ni1\"{what}", String::from_utf8_lossy(magic))));
    }
    let dims = header.dims()?;
    let stored = header.stored()?;
    let (origin, steps) = header.geometry()?;
    let grid = grid(&path, dims, origin, steps, Space::Ras)?;
    let (slope, intercept) = header.rescale()?;
    let mut data = if magic == b"n+1\0" {
        let offset = header.offset(352)?;
        source.skip(offset - HEADER as u64)?;
        source
    } else {
        let mut data = open_image(&path, &source)?;
        data.skip(header.offset(0)?)?;
        data
    };
    let voxels = data.voxels(dims, stored, endian, Tail::Ignored)?;
    named(&path, named(&path, Volume::new(grid, voxels))?.with_rescale(slope, intercept))
}
