//! Stacks of 2D textures: the layers of voxels along the axis that the view is most along, each interpolated in itself.
//!
//! ```text
//!   |    |    |    |     layers of voxels, a voxel apart along their axis
//!   |  --+----+----+->   a ray at an angle t to the axis has 1 / cos t voxels between two of them
//! ```
//! Each sample stands for the distance between two layers along its ray, or, without the correction, for a voxel whatever the angle: then a volume
//! is the fainter the more it is turned, up to a factor of sqrt(3) at its corners. Where the axis changes the picture jumps, because there are other layers.
//!
//! Source: C. Rezk-Salama et al., Interactive volume rendering on standard PC graphics hardware, 2000.

use super::Piece;
use super::sight::Ray;
use crate::proxy::Stack;
use crate::scene::View;
use crate::volume::Grid;

/// The axis of `grid` that is most parallel to the direction of `view`; of equal ones the first.
pub(super) fn nearest_axis(grid: &Grid, view: &View) -> usize {
    let directions = grid.directions();
    let along = [0, 1, 2].map(|axis: usize| directions.col(axis).dot(view.forward).abs());
    (1..3).fold(0, |best, axis| if along[axis] > along[best] { axis } else { best })
}

/// The layers of a frame.
pub(super) struct Layers {
    axis: usize,
    count: usize,
    /// Distance of two layers along their axis, world units.
    distance: f64,
    corrected: bool,
}

impl Layers {
    /// The layers of `stack` along `axis`, whose samples stand for lengths `corrected` for the angle.
    pub(super) fn new(stack: &Stack, axis: usize, corrected: bool) -> Self {
        Self { axis, count: stack.dims[axis], distance: stack.spacing, corrected }
    }

    /// The samples of `ray`.
    pub(super) fn along<'l>(&'l self, ray: &'l Ray) -> impl Iterator<Item = Piece> + use<'l> {
        let slope = ray.slope[self.axis];
        // A ray along the layers meets none.
        let count = if slope == 0.0 { 0 } else { self.count };
        let between = ray.stretch / slope.abs() / self.distance;
        let length = if self.corrected { between } else { 1.0 };
        (0..count).filter_map(move |n| {
            let layer = if slope > 0.0 { n } else { self.count - 1 - n } as f64;
            let depth = ray.reaches(self.axis, layer);
            // The outermost layers of a box of nodes lie on its faces.
            let inside = depth >= ray.entry - ray.error && depth <= ray.exit + ray.error;
            let mut place = ray.at(depth);
            place[self.axis] = layer;
            inside.then_some(Piece { place, depth, length })
        })
    }
}
