//! A part of a volume.

use super::{Steps, room};
use crate::settings::{Limits, Progress};
use crate::volume::{Buffer, Grid, Volume, Voxel, Voxels, with_voxels};
use crate::{Error, Result};
use glam::DVec3;
use std::ops::Range;

/// The voxels of `volume` in `ranges` along x, y and z, each where it was in the world.
///
/// # Errors
/// [`Error::Invalid`] for a range that is empty or goes beyond the volume; [`Error::Stopped`].
pub fn crop(volume: &Volume, ranges: [Range<usize>; 3], progress: Option<&dyn Progress>) -> Result<Volume> {
    let grid = volume.grid();
    let dims = grid.dims();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (Range { start, end }, n) = (ranges[axis].clone(), dims[axis]);
        if start >= end || end > n {
            return Err(Error::invalid(format!("crop {start}:{end} along {name}: not empty and within 0:{n} is needed")));
        }
    }
    let first = DVec3::from_array(std::array::from_fn(|i| ranges[i].start as f64));
    let origin = grid.index_to_world().transform_point3(first);
    let part = Grid::new(ranges.clone().map(|r| r.len()), origin, grid.index_to_world().matrix3)?;
    let part = part.with_space(grid.space()).with_convention(grid.convention());
    let each = volume.channels().count();
    let numbers = with_voxels!(volume.numbers(), v => copy(v, dims, &ranges, each, progress)?);
    let cropped = volume.with_numbers(part, numbers)?;
    cropped.with_labels_of(volume, |places| with_voxels!(places, v => copy(v, dims, &ranges, 1, progress)))
}

/// The numbers in `ranges`; a voxel has `each` of them.
fn copy<T: Voxel>(
    voxels: &Buffer<T>,
    [nx, ny, _]: [usize; 3],
    [x, y, z]: &[Range<usize>; 3],
    each: usize,
    progress: Option<&dyn Progress>,
) -> Result<Voxels> {
    // There are no more of them than the volume has already, so no limit can be in the way.
    let none = Limits::new().voxel_bytes(u64::MAX);
    let mut out = room::<T>(x.len() * y.len() * z.len() * each, &none, "the part of the volume")?;
    let steps = Steps::new(progress, "cropping", y.len() * z.len());
    let rows = z.clone().flat_map(|k| y.clone().map(move |j| k * ny + j));
    for (to, row) in out.chunks_exact_mut(x.len() * each).zip(rows) {
        let first = (row * nx + x.start) * each;
        to.copy_from_slice(&voxels[first..first + to.len()]);
        steps.next()?;
    }
    Ok(T::wrap(out.into()))
}
