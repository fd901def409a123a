//! Levels of a single array: every voxel, or every second, fourth ... along an axis.
//!
//! The voxel that stands for `step` of them is the one in their middle, so its place is exact; nothing is averaged, and a level is read at
//! the cost of its own voxels. What that leaves out is what pictures are judged for.

use super::{Bricks, Level};
use crate::volume::{Grid, Volume, Voxels, with_voxels};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::fs::File;
use std::io::ErrorKind;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of a row of a brick, about.
const ROW: usize = 256;
/// Rows and planes of a brick.
const ROWS: usize = 16;

/// Bytes of a mapped file that may be in memory before they are let go.
pub(crate) const HELD: u64 = 32 << 20;
/// Bytes beside those that are looked at which the system brings with them, at most.
const BESIDE: u64 = 64 << 10;

/// Bytes from row to row from which on rows are read one by one: the system would bring all that lies between for a mapping.
const APART: usize = 32 << 10;

/// An array's voxels. Pages of a mapped file are let go when enough of them have been looked at.
pub(crate) struct Source {
    voxels: Voxels,
    /// The file that they lie in, and where in it.
    place: Option<(Arc<File>, u64)>,
    /// Its name, for messages.
    name: String,
    looked_at: AtomicU64,
}

impl Source {
    /// Those of `volume`.
    pub(crate) fn of(volume: &Volume) -> Self {
        let place = with_voxels!(volume.voxels(), v => v.place());
        Self { voxels: volume.voxels().clone(), place, name: volume.name().to_owned(), looked_at: AtomicU64::new(0) }
    }

    /// The bytes in `range`, read into `row`; false where they do not come from a file, or this system does not read at places.
    fn read(&self, range: Range<usize>, row: &mut Vec<u8>) -> Result<bool> {
        let Some((file, first)) = &self.place else { return Ok(false) };
        row.resize(range.len(), 0);
        match read_at(file, row, first + range.start as u64) {
            Ok(()) => Ok(true),
            Err(e) if e.kind() == ErrorKind::Unsupported => Ok(false),
            Err(e) => Err(Error::io(&self.name, e)),
        }
    }

    /// The bytes in `range`.
    pub(crate) fn bytes(&self, range: Range<usize>) -> &[u8] {
        &self.voxels.bytes_of()[range]
    }

    /// Tells that so many bytes in a row have been looked at.
    pub(crate) fn looked_at(&self, bytes: usize) {
        let bytes = bytes as u64 + BESIDE;
        if self.voxels.is_mapped() && self.looked_at.fetch_add(bytes, Ordering::Relaxed) + bytes > HELD {
            self.looked_at.store(0, Ordering::Relaxed);
            with_voxels!(&self.voxels, v => v.let_go());
        }
    }
}

/// Some voxels of an array.
struct Plain {
    source: Source,
    /// Voxels of the array along x, y, z.
    whole: [usize; 3],
    /// Of so many voxels one is taken, the one at `offset`.
    steps: [usize; 3],
    /// Voxels of the level, and of a brick.
    dims: [usize; 3],
    sides: [usize; 3],
    /// Bytes of a voxel.
    each: usize,
}

/// The voxel that is taken of `step`.
fn offset(step: usize) -> usize {
    step / 2
}

/// The level of `volume` that takes one of `steps` voxels along each axis.
pub(super) fn level(volume: &Volume, steps: [usize; 3]) -> Result<Level> {
    let grid = volume.grid();
    let (whole, spacing) = (grid.dims(), grid.spacing());
    // An axis that ends before the middle of the first step keeps its first voxel.
    let offsets = [0, 1, 2].map(|axis| offset(steps[axis]).min(whole[axis] - 1));
    let dims = [0, 1, 2].map(|axis| (whole[axis] - 1 - offsets[axis]) / steps[axis] + 1);
    let origin = grid.index_to_world().transform_point3(DVec3::from_array(offsets.map(|n| n as f64)));
    let sizes = DMat3::from_diagonal(DVec3::from_array([0, 1, 2].map(|axis| spacing[axis] * steps[axis] as f64)));
    let coarse = Grid::new(dims, origin, grid.directions() * sizes)?.with_space(grid.space()).with_convention(grid.convention());
    let each = volume.voxels().voxel_type().bytes();
    let sides = [(ROW / each).min(dims[0]), ROWS.min(dims[1]), ROWS.min(dims[2])];
    let source = Source::of(volume);
    Ok(Level::new(coarse, sides, Arc::new(Plain { source, whole, steps, dims, sides, each })))
}

impl Bricks for Plain {
    fn held(&self) -> u64 {
        if self.source.voxels.is_mapped() { HELD } else { 0 }
    }

    fn read(&self, at: [usize; 3]) -> Result<(Vec<u8>, u64)> {
        let first = [0, 1, 2].map(|axis| at[axis] * self.sides[axis]);
        let size = [0, 1, 2].map(|axis| self.sides[axis].min(self.dims[axis] - first[axis]));
        let mut out = Vec::with_capacity(size.iter().product::<usize>() * self.each);
        // From the first to the last voxel of a row, with those between that are not taken.
        let along = |axis: usize, n: usize| offset(self.steps[axis]).min(self.whole[axis] - 1) + n * self.steps[axis];
        let span = ((size[0] - 1) * self.steps[0] + 1) * self.each;
        let apart = self.steps[1] * self.whole[0] * self.each >= APART;
        let mut buffer = Vec::new();
        for z in first[2]..first[2] + size[2] {
            let mut mapped = false;
            for y in first[1]..first[1] + size[1] {
                let voxel = (along(2, z) * self.whole[1] + along(1, y)) * self.whole[0] + along(0, first[0]);
                let range = voxel * self.each..voxel * self.each + span;
                let row = match apart && self.source.read(range.clone(), &mut buffer)? {
                    true => &buffer[..],
                    false => {
                        mapped = true;
                        self.source.bytes(range)
                    }
                };
                match (self.steps[0], self.each) {
                    (1, _) => out.extend_from_slice(row),
                    (2, 1) => every::<2>(row, &mut out),
                    (4, 1) => every::<4>(row, &mut out),
                    (8, 1) => every::<8>(row, &mut out),
                    (step, each) => row.chunks_exact(each).step_by(step).for_each(|voxel| out.extend_from_slice(voxel)),
                }
            }
            if mapped {
                self.source.looked_at(((size[1] - 1) * self.steps[1] * self.whole[0] + size[0]) * self.each);
            }
        }
        let read = (span * size[1] * size[2]) as u64;
        Ok((out, read))
    }
}

/// Appends every `STEP`th byte, the first one too.
fn every<const STEP: usize>(row: &[u8], out: &mut Vec<u8>) {
    let whole = row.chunks_exact(STEP);
    // The last one has none behind it.
    let rest = whole.remainder().first().copied();
    out.extend(whole.map(|group| group[0]));
    out.extend(rest);
}

/// Fills `out` from byte `at` of `file` on; others may read it at the same time.
#[cfg(unix)]
fn read_at(file: &File, out: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

/// Where files have one position for all, the mapping is read.
#[cfg(not(unix))]
fn read_at(_: &File, _: &mut [u8], _: u64) -> std::io::Result<()> {
    Err(ErrorKind::Unsupported.into())
}
