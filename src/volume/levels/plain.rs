//! Levels of a single array: every voxel, or every second, fourth ... along an axis.
//!
//! The voxel that stands for `step` of them is the one in their middle, so its place is exact; nothing is averaged, and a level is read at
//! the cost of its own voxels. What that leaves out is what pictures are judged for.

use super::{Bricks, Level};
use crate::volume::{Grid, Volume, Voxels, with_voxels};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;

/// Bytes of a row of a brick, about: one read of a file, of not so many bytes that most of them are for nothing.
const ROW: usize = 256;
/// Rows and planes of a brick.
const ROWS: usize = 16;

/// The bytes of an array's voxels, wherever they are.
pub(crate) enum Source {
    Memory(Voxels),
    File { file: Arc<File>, first: u64, path: PathBuf },
}

impl Source {
    /// Those of `volume`: read from its file where that is mapped.
    pub(crate) fn of(volume: &Volume) -> Self {
        let voxels = volume.voxels();
        match with_voxels!(voxels, v => place_of(v)) {
            Some((file, first)) => Self::File { file, first, path: PathBuf::from(volume.name()) },
            None => Self::Memory(voxels.clone()),
        }
    }

    /// `out.len()` bytes from byte `from` on.
    pub(crate) fn read(&self, from: usize, out: &mut [u8]) -> Result<()> {
        match self {
            Self::Memory(voxels) => out.copy_from_slice(&voxels.bytes_of()[from..from + out.len()]),
            Self::File { file, first, path } => read_at(file, out, first + from as u64).map_err(|e| Error::io(path, e))?,
        }
        Ok(())
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

#[cfg(feature = "formats")]
fn place_of<T: bytemuck::Pod>(buffer: &crate::volume::Buffer<T>) -> Option<(Arc<File>, u64)> {
    buffer.place().cloned()
}

#[cfg(not(feature = "formats"))]
fn place_of<T: bytemuck::Pod>(_: &crate::volume::Buffer<T>) -> Option<(Arc<File>, u64)> {
    None
}

impl Bricks for Plain {
    fn read(&self, at: [usize; 3]) -> Result<(Vec<u8>, u64)> {
        let first = [0, 1, 2].map(|axis| at[axis] * self.sides[axis]);
        let size = [0, 1, 2].map(|axis| self.sides[axis].min(self.dims[axis] - first[axis]));
        let mut out = Vec::with_capacity(size.iter().product::<usize>() * self.each);
        // From the first to the last voxel of a row, with those between that are not taken.
        let along = |axis: usize, n: usize| offset(self.steps[axis]).min(self.whole[axis] - 1) + n * self.steps[axis];
        let span = ((size[0] - 1) * self.steps[0] + 1) * self.each;
        let mut row = vec![0; span];
        for z in first[2]..first[2] + size[2] {
            for y in first[1]..first[1] + size[1] {
                let voxel = (along(2, z) * self.whole[1] + along(1, y)) * self.whole[0] + along(0, first[0]);
                self.source.read(voxel * self.each, &mut row)?;
                match (self.steps[0], self.each) {
                    (1, _) => out.extend_from_slice(&row),
                    (step, 1) => out.extend(row.iter().step_by(step)),
                    (step, each) => row.chunks_exact(each).step_by(step).for_each(|voxel| out.extend_from_slice(voxel)),
                }
            }
        }
        let read = (span * size[1] * size[2]) as u64;
        Ok((out, read))
    }
}

/// Fills `out` from byte `at` of `file` on; others may read it at the same time.
#[cfg(unix)]
fn read_at(file: &File, out: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

/// Fills `out` from byte `at` of `file` on; others may read it at the same time.
#[cfg(windows)]
fn read_at(file: &File, out: &mut [u8], at: u64) -> std::io::Result<()> {
    let mut done = 0;
    while done < out.len() {
        match std::os::windows::fs::FileExt::seek_read(file, &mut out[done..], at + done as u64)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            n => done += n,
        }
    }
    Ok(())
}

/// Fills `out` from byte `at` of `file` on, one reader after the other.
#[cfg(not(any(unix, windows)))]
fn read_at(file: &File, out: &mut [u8], at: u64) -> std::io::Result<()> {
    use std::io::{Read, Seek, SeekFrom};
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut file = file;
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(out)
}
