//! Maps of electron microscopy and crystallography: 1024 bytes of header, perhaps more of it, then the voxels.
//!
//! Source of the format: MRC2014, <https://www.ccpem.ac.uk/mrc_format/mrc2014.php>; on bytes without a sign, "The MRC file format used by
//! IMOD", <https://bio3d.colorado.edu/imod/doc/mrc_format.txt>. The file's columns, rows and sections may lie along any axes of the unit
//! cell. The cell's axis a lies along x, its axis b in the plane of x and y, as in the Protein Data Bank. Distances are in angstrom.

use super::field::{grid, named};
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading, pick};
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, Stored};
use crate::volume::{LengthUnit, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "MRC/CCP4",
    extensions: &["mrc", "map", "ccp4", "rec", "st"],
    reads: "i8, u8, i16, u16, f16, f32 and complex f32; both byte orders; skewed cells, any order of axes; stacks of volumes",
    parts: &[Part::Frame],
    probe,
    read,
    list: Some(list),
};

const HEADER: usize = 1024;

/// Byte offsets of the fields used, counted from 0.
mod at {
    pub(super) const SIZE: usize = 0;
    pub(super) const MODE: usize = 12;
    pub(super) const START: usize = 16;
    pub(super) const SAMPLING: usize = 28;
    pub(super) const CELL: usize = 40;
    pub(super) const ANGLES: usize = 52;
    pub(super) const AXES: usize = 64;
    pub(super) const LOWEST: usize = 76;
    pub(super) const HIGHEST: usize = 80;
    pub(super) const SPACE_GROUP: usize = 88;
    pub(super) const EXTENDED: usize = 92;
    pub(super) const VERSION: usize = 108;
    pub(super) const IMOD_STAMP: usize = 152;
    pub(super) const IMOD_FLAGS: usize = 156;
    pub(super) const ORIGIN: usize = 196;
    pub(super) const MAP: usize = 208;
    pub(super) const STAMP: usize = 212;
}

/// What IMOD marks its files with.
const IMOD: u32 = 1_146_047_817;
/// Space groups of stacks of volumes: 400 more than those of crystals, which are 1 to 230.
const STACKS: std::ops::RangeInclusive<i32> = 401..=630;

/// A header in one of the two byte orders.
struct Header<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    endian: Endian,
}

impl<'a> Header<'a> {
    /// The header in the byte order that it states, or in the other one where only that makes sense; and whether that is so.
    fn new(path: &'a Path, bytes: &'a [u8]) -> (Self, bool) {
        let stated = if bytes[at::STAMP] == 0x11 { Endian::Big } else { Endian::Little };
        let other = if stated == Endian::Big { Endian::Little } else { Endian::Big };
        let of = |endian| Self { path, bytes, endian };
        let swapped = !of(stated).is_plausible() && of(other).is_plausible();
        // Without a stamp no order is stated.
        (of(if swapped { other } else { stated }), swapped && bytes[at::STAMP] != 0)
    }

    fn i32(&self, at: usize) -> i32 {
        self.endian.u32(&self.bytes[at..]) as i32
    }

    fn triple(&self, at: usize) -> [i32; 3] {
        [at, at + 4, at + 8].map(|at| self.i32(at))
    }

    fn fault(&self, what: String) -> Error {
        Error::format(self.path, what)
    }

    /// Three finite numbers.
    fn vector(&self, at: usize, name: &str) -> Result<DVec3> {
        let v = [at, at + 4, at + 8].map(|at| f64::from(self.endian.f32(&self.bytes[at..])));
        match v.iter().find(|v| !v.is_finite()) {
            Some(bad) => Err(self.fault(format!("{name} has {bad}, not a finite number"))),
            None => Ok(DVec3::from_array(v)),
        }
    }

    /// Whether mode and sizes may be those of a file.
    fn is_plausible(&self) -> bool {
        matches!(self.i32(at::MODE), 0..=6 | 12 | 16 | 101) && self.triple(at::SIZE).iter().all(|n| (1..1 << 24).contains(n))
    }

    fn dims(&self) -> Result<[usize; 3]> {
        let size = self.triple(at::SIZE);
        if let Some(axis) = size.iter().position(|&n| n < 1) {
            return Err(self.fault(format!("{} is {}: it must be at least 1", ["NX", "NY", "NZ"][axis], size[axis])));
        }
        Ok(size.map(|n| n as usize))
    }

    /// Bytes of the header behind the first one.
    fn extended(&self) -> Result<u64> {
        let bytes = self.i32(at::EXTENDED);
        u64::try_from(bytes).map_err(|_| self.fault(format!("NSYMBT is {bytes}: an extended header cannot have so many bytes")))
    }

    /// The flags of IMOD, where that wrote the file: 1 for bytes with a sign, 4 for an origin of the sign that MRC2014 gives it, 16 for bytes
    /// that hold two numbers each.
    fn imod(&self) -> Option<i32> {
        (self.endian.u32(&self.bytes[at::IMOD_STAMP..]) == IMOD).then(|| self.i32(at::IMOD_FLAGS))
    }

    /// The type, and what is to be told of it.
    fn stored(&self) -> Result<(Stored, Option<String>)> {
        use VoxelType::{F32, I8, I16, U8, U16};
        let mode = self.i32(at::MODE);
        let name = match mode {
            0 => {
                if self.imod().is_some_and(|flags| flags & 16 != 0) {
                    return Err(self.fault("mode is 0 with a flag of IMOD for two numbers of 4 bits a byte: not supported".to_owned()));
                }
                let imod = self.imod().is_some_and(|flags| flags & 1 == 0);
                let [low, high] = [at::LOWEST, at::HIGHEST].map(|at| self.endian.f32(&self.bytes[at..]));
                let reason = match () {
                    () if imod => "a flag of IMOD says so".to_owned(),
                    () if low >= 0.0 && high > 127.0 && high <= 255.0 => format!("the header's largest value is {high}"),
                    () => return Ok((I8.into(), None)),
                };
                return Ok((U8.into(), Some(format!("the bytes are read without a sign, since {reason}"))));
            }
            1 => return Ok((I16.into(), None)),
            2 => return Ok((F32.into(), None)),
            4 => return Ok((Stored::Complex64, Some("of the complex numbers the magnitude is taken".to_owned()))),
            6 => return Ok((U16.into(), None)),
            12 => return Ok((Stored::F16, None)),
            3 => "complex numbers of 16-bit integers",
            16 => "RGB colours",
            101 => "numbers of 4 bits",
            _ => "no mode of MRC2014",
        };
        Err(self.fault(format!("mode is {mode} ({name}): not supported")))
    }

    /// Volumes in the file, and sections of each.
    fn frames(&self) -> Result<(usize, usize)> {
        let (nz, mz) = (self.dims()?[2], self.i32(at::SAMPLING + 8));
        let group = self.i32(at::SPACE_GROUP);
        if !STACKS.contains(&group) {
            return Ok((1, nz));
        }
        match usize::try_from(mz) {
            Ok(mz) if mz > 0 && nz % mz == 0 => Ok((nz / mz, mz)),
            _ => Err(self.fault(format!("ISPG is {group}, a stack of volumes, but NZ of {nz} sections is no multiple of MZ, {mz}"))),
        }
    }

    /// Which axis of the cell (0 to 2) columns, rows and sections lie along.
    fn axes(&self, notes: &mut Vec<String>) -> Result<[usize; 3]> {
        let axes = self.triple(at::AXES);
        if axes == [0; 3] {
            notes.push("the header does not say along which axes the voxels lie: x, y and z are taken".to_owned());
            return Ok([0, 1, 2]);
        }
        let mut sorted = axes;
        sorted.sort_unstable();
        if sorted != [1, 2, 3] {
            let [c, r, s] = axes;
            return Err(self.fault(format!("MAPC, MAPR and MAPS are {c}, {r} and {s}: they must be 1, 2 and 3 in some order")));
        }
        Ok(axes.map(|n| n as usize - 1))
    }

    /// Steps along x, y and z of the cell.
    fn steps(&self, notes: &mut Vec<String>) -> Result<[DVec3; 3]> {
        let (cell, sampling) = (self.vector(at::CELL, "the cell")?, self.triple(at::SAMPLING));
        let mut angles = self.vector(at::ANGLES, "the cell's angles")?;
        let mut lengths = [1.0; 3];
        for axis in 0..3 {
            if cell[axis] != 0.0 && sampling[axis] != 0 {
                lengths[axis] = (cell[axis] / f64::from(sampling[axis])).abs();
            } else {
                let name = ["x", "y", "z"][axis];
                notes.push(format!("the header gives no spacing along {name} ({} / {}): 1 is taken", cell[axis], sampling[axis]));
            }
            if angles[axis] == 0.0 {
                angles[axis] = 90.0;
            }
        }
        let cosine = |degrees: f64| if degrees == 90.0 { 0.0 } else { libm::cos(degrees.to_radians()) };
        let [alpha, beta, gamma] = [angles.x, angles.y, angles.z].map(cosine);
        let sine = (1.0 - gamma * gamma).sqrt();
        let y = (alpha - beta * gamma) / sine;
        let rest = 1.0 - beta * beta - y * y;
        // `!(a > b)` also refuses NaN.
        if !(rest > 1e-9) || angles.min_element() < 0.0 || angles.max_element() >= 180.0 {
            return Err(self.fault(format!("the cell's angles are {}, {} and {}: no cell has them", angles.x, angles.y, angles.z)));
        }
        Ok([DVec3::new(lengths[0], 0.0, 0.0), DVec3::new(gamma, sine, 0.0) * lengths[1], DVec3::new(beta, y, rest.sqrt()) * lengths[2]])
    }

    /// Place of the first voxel, and steps along columns, rows and sections.
    fn geometry(&self, notes: &mut Vec<String>) -> Result<(DVec3, DMat3)> {
        let (axes, cell) = (self.axes(notes)?, self.steps(notes)?);
        let steps = axes.map(|axis| cell[axis]);
        // Of a transform the origin is a phase, not a place.
        let mut origin = if self.i32(at::MODE) == 4 { DVec3::ZERO } else { self.vector(at::ORIGIN, "ORIGIN")? };
        // IMOD counted from the origin to the voxels' corner the other way round, before it wrote versions of MRC2014.
        if origin != DVec3::ZERO && self.i32(at::VERSION) == 0 && self.imod().is_some_and(|flags| flags & 4 == 0) {
            origin = -origin;
            notes.push("the sign of the origin is turned around, since the file is in IMOD's own form".to_owned());
        }
        let start = self.triple(at::START).map(f64::from);
        let origin = if origin == DVec3::ZERO { steps[0] * start[0] + steps[1] * start[1] + steps[2] * start[2] } else { origin };
        Ok((origin, DMat3::from_cols(steps[0], steps[1], steps[2])))
    }

    /// Bytes of a whole file, where the header can be that of one.
    fn length(&self) -> Option<u64> {
        let (stored, _) = self.stored().ok()?;
        let numbers = self.dims().ok()?.iter().try_fold(stored.bytes() as u64, |a, &n| a.checked_mul(n as u64))?;
        numbers.checked_add(HEADER as u64)?.checked_add(self.extended().ok()?)
    }
}

fn probe(clues: &Clues) -> Certainty {
    let by_name = clues.by_name(READER.extensions);
    let Some(bytes) = clues.head.get(..HEADER) else { return by_name };
    if clues.has(at::MAP, b"MAP ") || clues.has(at::MAP, b"MAP\0") {
        return Certainty::Magic;
    }
    // Files from before the year 2000 have no magic.
    let (header, _) = Header::new(clues.path, bytes);
    let exact = by_name > Certainty::No && header.length().is_some_and(|length| clues.is_long(length));
    if exact { Certainty::Length } else { by_name }
}

fn header(source: &mut Source) -> Result<Vec<u8>> {
    source.header(HEADER, "the MRC header")
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut source = store.source()?;
    let bytes = header(&mut source)?;
    let (header, _) = Header::new(source.path(), &bytes);
    let (count, sections) = header.frames()?;
    if count == 1 {
        return Ok(Vec::new());
    }
    let frame = pick(source.path(), Part::Frame, reading.choice.frame, count)?;
    let [nx, ny, _] = header.dims()?;
    Ok(vec![Item::row(Part::Frame, count, format!("volumes of {nx} x {ny} x {sections} voxels, number {frame} is taken"))])
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let bytes = header(&mut source)?;
    let (header, swapped) = Header::new(&path, &bytes);
    let mut notes = vec!["distances are in angstrom".to_owned()];
    if swapped {
        let stamp = bytes[at::STAMP];
        notes.push(format!("the machine stamp {stamp:#04x} does not fit the header: the numbers are read in the other byte order"));
    }
    if !bytes[at::MAP..].starts_with(b"MAP") && !header.is_plausible() {
        let [x, y, z] = header.triple(at::SIZE);
        let mode = header.i32(at::MODE);
        let what =
            format!("no MRC file: there is no MAP at byte {}, and its header would give {x} x {y} x {z} voxels of mode {mode}", at::MAP);
        return Err(source.fault(format!("{what} (a raw file needs its dimensions and type)")));
    }
    let (stored, note) = header.stored()?;
    notes.extend(note);
    let [nx, ny, _] = header.dims()?;
    let (count, nz) = header.frames()?;
    let frame = pick(&path, Part::Frame, reading.choice.frame, count)?;
    if count > 1 && reading.choice.frame.is_none() {
        notes.push(format!("of the {count} volumes the first one is read; volume.frame chooses another"));
    }
    if header.i32(at::SPACE_GROUP) == 0 && nz > 1 {
        notes.push("the header calls it a stack of images (ISPG is 0): the images are taken for the slices of a volume".to_owned());
    }
    let (origin, steps) = header.geometry(&mut notes)?;
    let grid = grid(&path, [nx, ny, nz], origin, steps, Space::Unknown)?;
    source.skip(header.extended()?)?;
    let before = grid.voxel_count() as u128 * stored.bytes() as u128 * frame as u128;
    source.skip(u64::try_from(before).unwrap_or(u64::MAX))?;
    let tail = if frame + 1 < count { Tail::Unchecked } else { Tail::Ignored };
    let voxels = source.voxels([nx, ny, nz], stored, header.endian, tail)?;
    Ok(notes.into_iter().fold(named(&path, Volume::new(grid, voxels))?.with_unit(LengthUnit::Angstrom), Volume::with_note))
}
