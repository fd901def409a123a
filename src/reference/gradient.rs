//! The gradient of the interpolated values along one ray: a cubic polynomial for each component in each cell.
//!
//! Differences are taken at the corners of a cell and interpolated between them, which every kind of gradient comes to. Like every lookup, one
//! beyond the outermost voxel centres is that of the nearest place between them, and voxels beyond the grid are those at its edge.

use super::field::{Corners, cubic};
use super::spline::{Nonic, Spline};
use crate::scene::Gradient;
use crate::volume::{Number, Volume, with_voxels};
use glam::DVec3;

/// Gradients of a volume.
#[derive(Debug, Clone)]
pub(super) struct Gradients<'a> {
    volume: &'a Volume,
    kind: Gradient,
    /// What a difference of 1 from voxel to voxel along each axis is as a gradient, world space.
    covectors: [DVec3; 3],
}

/// Voxels around a cell, x fastest: from the one before its lower corner to the one behind its upper corner, along each axis.
type Block = [f64; 64];

impl<'a> Gradients<'a> {
    pub(super) fn new(volume: &'a Volume, kind: Gradient) -> Self {
        // The reciprocal basis: covector i is at right angles to the other two axes, and 1 along its own.
        let m = volume.grid().index_to_world().matrix3;
        let axes = [m.x_axis, m.y_axis, m.z_axis];
        let units = axes.map(DVec3::normalize);
        let covectors = [0, 1, 2].map(|i: usize| {
            let across = units[(i + 1) % 3].cross(units[(i + 2) % 3]);
            across / (units[i].dot(across) * axes[i].length())
        });
        Self { volume, kind, covectors }
    }

    /// The gradient along a piece of ray in the cell whose lower corner is voxel `low`: world space, data units per world unit. The piece
    /// goes from `place` in the cell over `step`. Nothing where a voxel around is NaN or infinite. The analytic gradient is that of `spline`
    /// where values are; differences are those of voxels always.
    pub(super) fn along(&self, low: [i64; 3], place: [f64; 3], step: [f64; 3], spline: Option<&Spline>) -> Option<[Nonic; 3]> {
        let spline = spline.filter(|_| self.kind == Gradient::Analytic);
        let dims = self.volume.grid().dims();
        let (mut cell, mut at, mut over) = ([0; 3], [0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let top = dims[axis] as i64 - 1;
            (cell[axis], at[axis], over[axis]) = match low[axis] {
                below if below < 0 => (0, 0.0, 0.0),
                // One voxel long: its cell has no width.
                _ if top == 0 => (0, 0.0, 0.0),
                beyond if beyond >= top => (top - 1, 1.0, 0.0),
                inside => (inside, place[axis], step[axis]),
            };
        }
        let block = self.block(cell);
        let mut world = [Nonic::default(); 3];
        for (axis, covector) in self.covectors.iter().enumerate() {
            let along = match spline {
                Some(spline) => spline.along(low, place, step, Some(axis))?.0,
                None => Nonic::from(cubic(&differences(&block, self.kind, axis), at, over)),
            };
            for (sum, share) in world.iter_mut().zip(covector.to_array()) {
                sum.0.iter_mut().zip(along.0).for_each(|(s, c)| *s += share * c);
            }
        }
        world.iter().all(|w| w.0.iter().all(|c| c.is_finite())).then_some(world)
    }

    fn block(&self, cell: [i64; 3]) -> Block {
        let dims = self.volume.grid().dims();
        let pick = |axis: usize, step: usize| (cell[axis] + step as i64 - 1).clamp(0, dims[axis] as i64 - 1) as usize;
        let (slope, intercept) = self.volume.rescale();
        with_voxels!(self.volume.voxels(), v => std::array::from_fn(|i| {
            let [x, y, z] = [pick(0, i % 4), pick(1, i / 4 % 4), pick(2, i / 16)];
            slope * v[(z * dims[1] + y) * dims[0] + x].to_f64() + intercept
        }))
    }
}

/// Differences per voxel along `axis` at the corners of the block's middle cell.
fn differences(block: &Block, kind: Gradient, axis: usize) -> Corners {
    const STRIDES: [usize; 3] = [1, 4, 16];
    let own = STRIDES[axis];
    let [first, second] = [STRIDES[(axis + 1) % 3], STRIDES[(axis + 2) % 3]];
    std::array::from_fn(|corner| {
        let here = (0..3).map(|a| (1 + (corner >> a & 1)) * STRIDES[a]).sum::<usize>();
        match kind {
            Gradient::Central => 0.5 * block[here + own] - 0.5 * block[here - own],
            Gradient::Analytic => {
                // The same at both ends of an edge.
                let start = here - (corner >> axis & 1) * own;
                block[start + own] - block[start]
            }
            Gradient::Sobel => {
                let mut sum = 0.0;
                for (i, a) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                    for (j, b) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                        let beside = here + i * first + j * second - first - second;
                        sum += a * b / 32.0 * block[beside + own] - a * b / 32.0 * block[beside - own];
                    }
                }
                sum
            }
        }
    })
}
