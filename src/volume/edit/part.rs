//! The part of a volume that a crop box keeps.

use super::crop;
use crate::settings::Progress;
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;
use std::ops::Range;

/// A box that keeps a part of a volume.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum CropBox {
    /// Voxels along x, y and z, counted from 0, the ends not included.
    Voxels([Range<usize>; 3]),
    /// From and to along the world's x, y and z: kept are the voxels with centres in the smallest block of whole voxels along the volume's own axes that
    /// reaches as far, as far as there are any.
    World([[f64; 2]; 3]),
}

impl CropBox {
    /// The voxels of `volume` that it keeps.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a world box that holds no voxel's centre, and for numbers that are not finite or in falling order.
    pub fn ranges(&self, volume: &Volume) -> Result<[Range<usize>; 3]> {
        let bounds = match self {
            Self::Voxels(ranges) => return Ok(ranges.clone()),
            Self::World(bounds) => bounds,
        };
        if let Some([from, to]) = bounds.iter().find(|[from, to]| !(from.is_finite() && to.is_finite() && from <= to)) {
            return Err(Error::invalid(format!("crop {from} to {to}: finite numbers in rising order are needed")));
        }
        let grid = volume.grid();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in 0..8 {
            let world = DVec3::from_array([0, 1, 2].map(|axis: usize| bounds[axis][corner >> axis & 1]));
            let index = grid.world_to_index().transform_point3(world);
            (low, high) = (low.min(index), high.max(index));
        }
        let dims = grid.dims();
        // A hair wider, so that a bound on a voxel's centre holds it.
        let ranges = [0, 1, 2].map(|axis: usize| {
            let first = libm::ceil(low[axis] - 1e-6).max(0.0);
            let end = (libm::floor(high[axis] + 1e-6) + 1.0).min(dims[axis] as f64);
            first as usize..end.max(0.0) as usize
        });
        if ranges.iter().any(|range| range.start >= range.end) {
            let [[x0, x1], [y0, y1], [z0, z1]] = bounds;
            return Err(Error::invalid(format!("crop {x0} to {x1}, {y0} to {y1}, {z0} to {z1}: no voxel's centre lies in it")));
        }
        Ok(ranges)
    }

    /// The part of `volume` that it keeps, with a note that tells which voxels those are.
    ///
    /// # Errors
    /// As [`CropBox::ranges`] and [`crop`].
    pub fn part(&self, volume: &Volume, progress: Option<&dyn Progress>) -> Result<Volume> {
        let ranges = self.ranges(volume)?;
        let ([nx, ny, nz], [x, y, z]) = (volume.grid().dims(), ranges.clone());
        let note = format!("cropped: voxels {}:{},{}:{},{}:{} of {nx} x {ny} x {nz}", x.start, x.end, y.start, y.end, z.start, z.end);
        Ok(crop(volume, ranges, progress)?.with_note(note))
    }
}
