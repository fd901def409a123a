//! The fields of a NIfTI header that are used, out of the bytes of either version, and what they mean.
//!
//! Source: `nifti1.h` and `nifti2.h`, <https://nifti.nimh.nih.gov>; for ANALYZE 7.5, `dbh.h` of the Mayo Clinic.

use crate::volume::io::field::grid;
use crate::volume::io::layout::Layout;
use crate::volume::io::reading::Part;
use crate::volume::io::source::Source;
use crate::volume::io::{Endian, Stored};
use crate::volume::{Grid, LengthUnit, Space, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DQuat, DVec3};
use std::path::{Path, PathBuf};

/// Bytes of the header of version 1, and of version 2.
const FIRST: usize = 348;
const SECOND: usize = 540;

/// Which of the three kinds of header it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    Analyze,
    One,
    Two,
}

/// Whether the first bytes of a file are such a header: it starts with its own length, in either byte order.
pub(super) fn starts(head: &[u8]) -> bool {
    matches!(head, [0x5c, 1, 0, 0, ..] | [0, 0, 1, 0x5c, ..] | [0x1c, 2, 0, 0, ..] | [0, 0, 2, 0x1c, ..])
}

/// What a code of a transform says of its world.
fn meaning(code: i64) -> &'static str {
    match code {
        1 => " (the scanner's)",
        2 => " (aligned to another file)",
        3 => " (Talairach)",
        4 => " (MNI 152)",
        5 => " (another template)",
        _ => "",
    }
}

/// Byte by byte, in the file's order.
struct Bytes<'a>(&'a [u8], Endian);

impl Bytes<'_> {
    fn i16(&self, at: usize) -> i64 {
        i64::from(self.1.u16(&self.0[at..]) as i16)
    }

    fn i32(&self, at: usize) -> i64 {
        i64::from(self.1.u32(&self.0[at..]) as i32)
    }

    fn i64(&self, at: usize) -> i64 {
        self.1.u64(&self.0[at..]) as i64
    }

    fn f32(&self, at: usize) -> f64 {
        f64::from(self.1.f32(&self.0[at..]))
    }

    fn f64(&self, at: usize) -> f64 {
        self.1.f64(&self.0[at..])
    }
}

/// The header, and what was made of it on the way.
pub(super) struct Header {
    path: PathBuf,
    version: Version,
    pub(super) endian: Endian,
    /// Whether the voxels are in a file of their own.
    pub(super) beside: bool,
    dim: [i64; 8],
    datatype: i64,
    bitpix: i64,
    pixdim: [f64; 8],
    vox_offset: f64,
    slope: f64,
    intercept: f64,
    qform: i64,
    sform: i64,
    quatern: [f64; 3],
    qoffset: [f64; 3],
    srow: [[f64; 4]; 3],
    units: i64,
    intent: i64,
    /// What was repaired.
    pub(super) notes: Vec<String>,
    /// What the grid goes by.
    pub(super) placed: Option<String>,
}

impl Header {
    /// Reads it from the start of `source`.
    pub(super) fn read(source: &mut Source) -> Result<Self> {
        let path = source.path().to_path_buf();
        let start = source.peek(4)?.to_vec();
        let (length, endian) = match start[..] {
            [0x5c, 1, 0, 0] => (FIRST, Endian::Little),
            [0, 0, 1, 0x5c] => (FIRST, Endian::Big),
            [0x1c, 2, 0, 0] => (SECOND, Endian::Little),
            [0, 0, 2, 0x1c] => (SECOND, Endian::Big),
            _ => {
                let bytes = source.header(FIRST, "the NIfTI header")?;
                let found = Endian::Little.u32(&bytes) as i32;
                return Err(source.fault(format!("no NIfTI file: sizeof_hdr is {found}, neither 348 nor 540")));
            }
        };
        let bytes = source.header(length, "the NIfTI header")?;
        let b = Bytes(&bytes, endian);
        if length == SECOND { Self::second(&path, &b) } else { Self::first(&path, &b) }
    }

    fn first(path: &Path, b: &Bytes) -> Result<Self> {
        let magic = &b.0[344..348];
        let version = match magic {
            b"n+1\0" | b"ni1\0" => Version::One,
            // The place of the magic is in no use there, or holds an old count of views.
            [0, 0, 0, _] | [_, 0, 0, 0] => Version::Analyze,
            _ => return Err(Error::format(path, format!("magic is {:?}, not \"n+1\" or \"ni1\"", String::from_utf8_lossy(magic)))),
        };
        let of = |n: usize, at: usize| b.f32(at + 4 * n);
        Ok(Self {
            path: path.to_path_buf(),
            version,
            endian: b.1,
            beside: magic != b"n+1\0",
            dim: std::array::from_fn(|i| b.i16(40 + 2 * i)),
            datatype: b.i16(70),
            bitpix: b.i16(72),
            pixdim: std::array::from_fn(|i| of(i, 76)),
            vox_offset: b.f32(108),
            slope: b.f32(112),
            intercept: b.f32(116),
            qform: b.i16(252),
            sform: b.i16(254),
            quatern: std::array::from_fn(|i| of(i, 256)),
            qoffset: std::array::from_fn(|i| of(i, 268)),
            srow: std::array::from_fn(|r| std::array::from_fn(|c| of(4 * r + c, 280))),
            units: i64::from(b.0[123]),
            intent: b.i16(68),
            notes: Vec::new(),
            placed: None,
        })
    }

    fn second(path: &Path, b: &Bytes) -> Result<Self> {
        let magic = &b.0[4..8];
        if !matches!(magic, b"n+2\0" | b"ni2\0") {
            return Err(Error::format(path, format!("magic is {:?}, not \"n+2\" or \"ni2\"", String::from_utf8_lossy(magic))));
        }
        let of = |n: usize, at: usize| b.f64(at + 8 * n);
        Ok(Self {
            path: path.to_path_buf(),
            version: Version::Two,
            endian: b.1,
            beside: magic != b"n+2\0",
            dim: std::array::from_fn(|i| b.i64(16 + 8 * i)),
            datatype: b.i16(12),
            bitpix: b.i16(14),
            pixdim: std::array::from_fn(|i| of(i, 104)),
            vox_offset: b.i64(168) as f64,
            slope: b.f64(176),
            intercept: b.f64(184),
            qform: b.i32(344),
            sform: b.i32(348),
            quatern: std::array::from_fn(|i| of(i, 352)),
            qoffset: std::array::from_fn(|i| of(i, 376)),
            srow: std::array::from_fn(|r| std::array::from_fn(|c| of(4 * r + c, 400))),
            units: b.i32(500),
            intent: b.i32(504),
            notes: Vec::new(),
            placed: None,
        })
    }

    fn fault(&self, what: String) -> Error {
        Error::format(&self.path, what)
    }

    /// Bytes of this header.
    pub(super) fn length(&self) -> u64 {
        if self.version == Version::Two { SECOND as u64 } else { FIRST as u64 }
    }

    /// The axes: space, then frames (axis 4), then channels (axis 5). `color` numbers a voxel come before them.
    pub(super) fn layout(&mut self, color: Option<usize>) -> Result<Layout> {
        let count = self.dim[0];
        if !(1..=7).contains(&count) {
            return Err(self.fault(format!("dim[0] is {count}: there must be 1 to 7 dimensions")));
        }
        let mut sizes = [1usize; 8];
        for axis in 1..=count as usize {
            let n = self.dim[axis];
            sizes[axis] = match usize::try_from(n) {
                Ok(0) if axis > 3 => {
                    self.notes.push(format!("dim[{axis}] is 0: it is taken for 1"));
                    1
                }
                Ok(n) if n > 0 => n,
                _ => return Err(self.fault(format!("dim[{axis}] is {n}: it must be at least 1"))),
            };
        }
        if let Some(axis) = (6..8).find(|&a| sizes[a] != 1) {
            return Err(self.fault(format!("dim[{axis}] is {}: a volume of {count} dimensions is not supported", sizes[axis])));
        }
        let layout = Layout::of_space(&self.path, [sizes[1], sizes[2], sizes[3]]);
        let layout = color.map_or(layout.clone(), |n| layout.inner(Part::Channel, n, true));
        if color.is_some() && sizes[5] != 1 {
            return Err(self.fault(format!("dim[5] is {}: several colours a voxel are not supported", sizes[5])));
        }
        Ok(layout.outer(Part::Frame, sizes[4]).outer(Part::Channel, sizes[5]))
    }

    /// Type of the numbers, and how many of them a voxel of colours has.
    pub(super) fn stored(&self) -> Result<(Stored, Option<usize>)> {
        use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
        let code = self.datatype;
        let (stored, color): (Stored, _) = match code {
            2 => (U8.into(), None),
            4 => (I16.into(), None),
            8 => (I32.into(), None),
            16 => (F32.into(), None),
            32 => (Stored::Complex64, None),
            64 => (F64.into(), None),
            128 => (U8.into(), Some(3)),
            256 => (I8.into(), None),
            512 => (U16.into(), None),
            768 => (U32.into(), None),
            1024 => (Stored::I64, None),
            1280 => (Stored::U64, None),
            1792 => (Stored::Complex128, None),
            2304 => (U8.into(), Some(4)),
            // What SPM writes into ANALYZE files for types that those do not have.
            130 if self.version == Version::Analyze => (I8.into(), None),
            132 if self.version == Version::Analyze => (U16.into(), None),
            136 if self.version == Version::Analyze => (U32.into(), None),
            _ => {
                let name = match code {
                    0 => "unknown",
                    1 => "single bits",
                    1536 => "float128",
                    2048 => "complex256",
                    _ => "no type of NIfTI",
                };
                return Err(self.fault(format!("datatype is {code} ({name}): not supported")));
            }
        };
        let bits = (stored.bytes() * 8 * color.unwrap_or(1)) as i64;
        // Some writers leave it 0.
        if self.bitpix != 0 && self.bitpix != bits {
            return Err(self.fault(format!("bitpix is {}, but datatype {code} ({stored}) has {bits} bits", self.bitpix)));
        }
        Ok((stored, color))
    }

    /// Voxel size along axis 1 to 3; the format's library takes 1 for 0.
    fn size(&mut self, axis: usize) -> Result<f64> {
        let size = self.pixdim[axis].abs();
        if !size.is_finite() {
            return Err(self.fault(format!("pixdim[{axis}] is {}, not a finite number", self.pixdim[axis])));
        }
        if size == 0.0 && self.dim[0] >= axis as i64 && self.dim[axis] > 1 {
            self.notes.push(format!("pixdim[{axis}] is 0: it is taken for 1"));
        }
        Ok(if size == 0.0 { 1.0 } else { size })
    }

    /// Where the voxels are: by the sform, where it can be used; else by the qform; else by the voxel sizes alone, in an unknown space.
    pub(super) fn grid(&mut self, dims: [usize; 3]) -> Result<Grid> {
        if self.version == Version::Analyze {
            self.notes.push(
                "an ANALYZE 7.5 file: it does not say where left and right are; the axes are taken as they lie in the file".to_owned(),
            );
        }
        let (sform, qform) = if self.version == Version::Analyze { (0, 0) } else { (self.sform, self.qform) };
        if sform > 0 {
            let column = |c: usize| DVec3::from_array(std::array::from_fn(|r| self.srow[r][c]));
            let steps = DMat3::from_cols(column(0), column(1), column(2));
            match Grid::new(dims, column(3), steps) {
                Ok(grid) => {
                    self.placed = Some(format!("the sform, code {sform}{}", meaning(sform)));
                    return Ok(grid.with_space(Space::Ras));
                }
                Err(e) => {
                    let instead = if qform > 0 { "the qform is taken" } else { "the voxel sizes alone are taken" };
                    self.notes.push(format!("the sform cannot be used ({e}): {instead}"));
                }
            }
        }
        let mut sizes = DVec3::new(self.size(1)?, self.size(2)?, self.size(3)?);
        if qform > 0 {
            let (v, offset) = (DVec3::from_array(self.quatern), DVec3::from_array(self.qoffset));
            // The unit quaternion's first number is left out of the file; rounding may leave the rest a little over 1.
            let rest = 1.0 - v.length_squared();
            if v.is_finite() && offset.is_finite() && rest >= -1e-3 {
                let turn = DQuat::from_xyzw(v.x, v.y, v.z, rest.max(0.0).sqrt());
                if self.pixdim[0] < 0.0 {
                    sizes.z = -sizes.z;
                }
                let steps = DMat3::from_quat(turn.normalize()) * DMat3::from_diagonal(sizes);
                let grid = grid(&self.path, dims, offset, steps, Space::Ras)?;
                self.placed = Some(format!("the qform, code {qform}{}", meaning(qform)));
                return Ok(grid);
            }
            let what = format!("quatern {} {} {}, qoffset {} {} {}", v.x, v.y, v.z, offset.x, offset.y, offset.z);
            self.notes.push(format!("the qform cannot be used ({what}): the voxel sizes alone are taken"));
        } else if self.version != Version::Analyze && sform <= 0 {
            self.notes.push("sform_code and qform_code are 0: the file does not say how the axes lie in the body".to_owned());
        }
        grid(&self.path, dims, DVec3::ZERO, DMat3::from_diagonal(sizes), Space::Unknown)
    }

    /// The unit of lengths, where the file says it.
    pub(super) fn unit(&self) -> Option<LengthUnit> {
        match self.units & 7 {
            _ if self.version == Version::Analyze => None,
            1 => Some(LengthUnit::Metre),
            2 => Some(LengthUnit::Millimetre),
            3 => Some(LengthUnit::Micrometre),
            _ => None,
        }
    }

    /// Whether the voxels are said to be labels (`NIFTI_INTENT_LABEL`).
    pub(super) fn is_of_labels(&self) -> bool {
        self.version != Version::Analyze && self.intent == 1002
    }

    /// Slope and intercept; a slope that is 0, NaN or infinite means that values are as stored, and so does every slope of ANALYZE files.
    pub(super) fn rescale(&self) -> Result<(f64, f64)> {
        if self.version == Version::Analyze || self.slope == 0.0 || !self.slope.is_finite() {
            return Ok((1.0, 0.0));
        }
        if !self.intercept.is_finite() {
            return Err(self.fault(format!("scl_inter is {}, not a finite number", self.intercept)));
        }
        Ok((self.slope, self.intercept))
    }

    /// Where the voxels start; `least` is where the header ends.
    pub(super) fn offset(&self, least: u64) -> Result<u64> {
        let offset = self.vox_offset;
        // Some writers leave 0 and mean the usual place. f32 counts bytes exactly up to 2^24; a header is far below.
        if offset == 0.0 {
            return Ok(least);
        }
        if !offset.is_finite() {
            return Err(self.fault(format!("vox_offset is {offset}, not a finite number")));
        }
        if offset < least.min(self.length()) as f64 || libm::trunc(offset) != offset || offset > 9e15 {
            return Err(self.fault(format!("vox_offset is {offset}: the voxels cannot start there")));
        }
        Ok(offset as u64)
    }
}
