//! Where the fragments of a block lie in the volume, slice by slice.

use crate::fragment::{Batch, Frame};
use crate::lanes::SIDE;
use crate::proxy::Stack;
use crate::skip::{BoxQuery, Windows};
use std::array;
use std::ops::Range;

/// Index coordinates of a block as functions of depth: `start + d * slope` for its first pixel, and the block's extent.
pub(super) struct BlockTransform {
    pub(super) start: [f64; 3],
    pub(super) slope: [f64; 3],
    pub(super) across: [f64; 3],
    pub(super) down: [f64; 3],
    /// Least and greatest offset of a pixel from the first.
    extent: [[f64; 3]; 2],
    perspective: bool,
    /// Depth from a slice to the next one that is looked up.
    step: f64,
    /// Largest index of a cell's lower corner, and of a voxel.
    pub(super) top: [f64; 3],
    /// The same as a number of cells.
    top_cell: [u32; 3],
    /// Whether there are two voxels at least along each axis.
    thick: bool,
    /// Of a part of a volume: its first voxel, and its last cell, along each axis; positions are those of the whole.
    pub(super) part: Option<[(u32, u32); 3]>,
}

impl BlockTransform {
    pub(super) fn new(stack: &Stack, strides: [usize; 3], forward: f64, x: f64, y: f64) -> Self {
        let (mut start, mut slope) = ([0.0; 3], [0.0; 3]);
        let across = stack.index.map(|f| f.b);
        let down = stack.index.map(|f| f.c);
        for axis in 0..3 {
            let f = stack.index[axis];
            let plane = f.b * x + f.c * y;
            (start[axis], slope[axis]) = if stack.perspective { (f.a, f.g + plane) } else { (f.a + plane, f.g) };
        }
        let far = (SIDE - 1) as f64;
        let extent = [
            array::from_fn(|i| f64::min(0.0, far * across[i]) + f64::min(0.0, far * down[i])),
            array::from_fn(|i| f64::max(0.0, far * across[i]) + f64::max(0.0, far * down[i])),
        ];
        let top = stack.dims.map(|n| n.saturating_sub(2) as f64);
        let top_cell = top.map(|n| n as u32);
        let thick = strides.iter().all(|&s| s != 0);
        let step = forward * stack.spacing;
        Self { start, slope, across, down, extent, perspective: stack.perspective, step, top, top_cell, thick, part: None }
    }

    /// The same for a part of the volume that holds `voxels` of it.
    pub(super) fn of_part(mut self, voxels: &[Range<usize>; 3]) -> Self {
        self.part = Some(array::from_fn(|i| (voxels[i].start as u32, voxels[i].end.saturating_sub(2).max(voxels[i].start) as u32)));
        self
    }

    /// Where the bricks' index coordinates begin.
    pub(super) fn first(&self, axis: usize) -> f64 {
        self.part.map_or(0.0, |part| f64::from(part[axis].0))
    }

    /// Pixel steps grow with depth in perspective.
    pub(super) fn scale(&self, d: f64) -> f64 {
        if self.perspective { d } else { 1.0 }
    }

    /// Least and greatest index coordinates of the block between depths `d0` and `d1`.
    pub(super) fn bounds(&self, d0: f64, d1: f64) -> ([f64; 3], [f64; 3]) {
        let (s0, s1) = (self.scale(d0), self.scale(d1));
        let at = |axis: usize, d: f64| self.start[axis] + d * self.slope[axis];
        (
            array::from_fn(|i| f64::min(at(i, d0) + s0 * self.extent[0][i], at(i, d1) + s1 * self.extent[0][i])),
            array::from_fn(|i| f64::max(at(i, d0) + s0 * self.extent[1][i], at(i, d1) + s1 * self.extent[1][i])),
        )
    }

    /// Boxes of `count` runs of slices: `near` and `far` are the first run's first and last depth, `step` is the way to the next.
    pub(super) fn boxes<'w>(&self, windows: &'w Windows, (near, far): (f64, f64), step: f64, count: usize) -> BoxQuery<'w> {
        let (mut at, mut steps) = ([0.0; 8], [0.0; 8]);
        for axis in 0..3 {
            for (end, extent) in self.extent.iter().enumerate() {
                // Affine in depth either way.
                let (start, slope) = if self.perspective {
                    (self.start[axis], self.slope[axis] + extent[axis])
                } else {
                    (self.start[axis] + extent[axis], self.slope[axis])
                };
                let depth = if (slope < 0.0) == (end == 0) { far } else { near };
                at[4 * end + axis] = start + depth * slope - self.first(axis);
                steps[4 * end + axis] = step * slope;
            }
        }
        BoxQuery::new(windows, (at, steps), count, !self.perspective)
    }

    /// Sets what is the same at all depths.
    pub(super) fn prepare(&self, frame: &Frame<'_>, batch: &mut Batch) {
        let strides = frame.sample.strides;
        let steps = self.slope.map(|s| s * self.step);
        let upper = if steps[2] > 0.0 { strides[2] as isize } else { 0 };
        let new = steps.iter().any(|s| s.abs() > 1.0);
        batch.geometry.cells.strides = strides;
        batch.geometry.cells.ahead = (0..3).map(|i| cells_ahead(steps[i]) * strides[i] as isize).sum::<isize>() + upper;
        batch.geometry.cells.others = new.then_some(strides[2] as isize - 2 * upper);
        if !self.perspective {
            self.spread(1.0, batch);
        }
    }

    /// As [`BlockTransform::place`], for a part of the volume: the base voxel of positions is the whole's, so that they have the very same
    /// bits, and offsets count from a voxel of the part.
    pub(super) fn place_part(&self, part: &[(u32, u32); 3], d: f64, frame: &Frame<'_>, batch: &mut Batch) {
        self.place(d, frame, batch);
        let scale = self.scale(d);
        let mut base = 0;
        for axis in 0..3 {
            let least = self.start[axis] + d * self.slope[axis] + scale * self.extent[0][axis];
            let low = (least as u32).min(self.top_cell[axis]);
            batch.whole_base[axis] = low as usize;
            let (first, last) = part[axis];
            let own = low.clamp(first, last);
            base += (own - first) as usize * frame.sample.strides[axis];
            batch.geometry.floor[axis] = (f64::from(own) - f64::from(low)) as f32;
            batch.geometry.top[axis] = (f64::from(last) - f64::from(low)) as f32;
            batch.geometry.reach[axis] =
                if frame.sample.strides[axis] == 0 { batch.geometry.floor[axis] } else { batch.geometry.top[axis] + 1.0 };
        }
        batch.geometry.cells.base = base;
        batch.geometry.inner = false;
    }

    /// Sets the steps from pixel to pixel.
    fn spread(&self, scale: f64, batch: &mut Batch) {
        batch.geometry.across = self.across.map(|a| (scale * a) as f32);
        batch.geometry.down = self.down.map(|a| (scale * a) as f32);
    }

    /// Sets where the batch's fragments lie at depth `d`, relative to a base voxel below all of them.
    #[inline(always)]
    pub(super) fn place(&self, d: f64, frame: &Frame<'_>, batch: &mut Batch) {
        let scale = self.scale(d);
        let mut base = 0;
        let mut lowest = [0.0; 3];
        let mut inner = self.thick;
        for axis in 0..3 {
            let first = self.start[axis] + d * self.slope[axis];
            let least = first + scale * self.extent[0][axis];
            // Truncation equals floor from 0 up, and everything below becomes 0.
            let low = (least as u32).min(self.top_cell[axis]);
            lowest[axis] = f64::from(low);
            batch.geometry.origin[axis] = (first - lowest[axis]) as f32;
            base += low as usize * frame.sample.strides[axis];
            // Well inside: f32 coordinates are off by less.
            inner &= least >= 1e-3 && first + scale * self.extent[1][axis] < self.top[axis] + (1.0 - 1e-3);
        }
        batch.geometry.cells.base = base;
        batch.geometry.inner = inner;
        if !inner {
            for axis in 0..3 {
                batch.geometry.top[axis] = (self.top[axis] - lowest[axis]) as f32;
                // The last voxel: one above the last cell's lower corner, unless the axis has a single voxel.
                batch.geometry.reach[axis] =
                    if frame.sample.strides[axis] == 0 { 0.0 } else { (self.top[axis] - lowest[axis]) as f32 + 1.0 };
            }
        }
        if self.perspective {
            self.spread(scale, batch);
        }
    }
}

/// The cell to ask the memory for, from one that is looked up, along an axis on which the next slice lies `step` cells further.
///
/// Short steps are rounded away from zero: what they reach first is in the cells that follow.
fn cells_ahead(step: f64) -> isize {
    let size = step.abs();
    let cells = if size < 2.0 { libm::ceil(size) } else { libm::rint(size) };
    (if step < 0.0 { -cells } else { cells }) as isize
}
