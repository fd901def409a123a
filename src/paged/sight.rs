//! Which voxels a part of the picture needs, of which level.

use crate::proxy::{HalfSpace, Stack};
use crate::scene::{ClipPlane, View};
use crate::volume::levels::Levels;
use std::ops::Range;

/// Voxels around those that trilinear lookups touch: gradients look one further.
const HALO: i64 = 1;

/// Pixels along a voxel's side, at most, where no error asks for smaller ones: of two levels the one nearer to a pixel is taken.
const LARGEST: f64 = 1.414;

/// A box of voxels: the first one, and how many, along x, y and z.
pub(super) type VoxelBox = ([usize; 3], [usize; 3]);

/// A rectangle of the window: least and greatest x and y.
pub(super) type Window = [(f64, f64); 2];

/// One level as the picture sees it.
struct Seen {
    /// Index coordinates as functions of window position and depth.
    index: [HalfSpace; 3],
    dims: [usize; 3],
    /// Largest side of a voxel, world units.
    size: f64,
}

/// The levels as the picture sees them, cut into the slices of the finest.
pub(super) struct Sight {
    pub(super) stack: Stack,
    seen: Vec<Seen>,
}

impl Sight {
    pub(super) fn new(levels: &Levels, view: &View, clip_planes: &[ClipPlane], count: u64) -> Self {
        let stack = Stack::new(levels.grid(), view, clip_planes, count);
        let seen = levels.levels().iter().map(|level| {
            let grid = level.grid();
            let own = Stack::between(grid, view, &[], (stack.near, stack.far), count);
            Seen { index: own.index, dims: grid.dims(), size: grid.spacing().into_iter().fold(0.0, f64::max) }
        });
        let seen = seen.collect();
        Self { stack, seen }
    }

    /// The slices, through a piece of a level that holds the voxels of `(first, size)`.
    pub(super) fn stack_of(&self, level: usize, (first, size): VoxelBox) -> Stack {
        let of = &self.seen[level];
        // Their constant part stands by itself in both projections.
        let index = [0, 1, 2].map(|axis| HalfSpace { a: of.index[axis].a - first[axis] as f64, ..of.index[axis] });
        Stack { index, dims: size, ..self.stack.clone() }
    }

    /// The coarsest level whose voxels are not larger than [`LARGEST`] pixels at `depth`, or one `finer` levels below it.
    fn level_at(&self, depth: f64, finer: usize) -> usize {
        let view = &self.stack.view;
        let pixel = if view.perspective { view.scale * depth } else { view.scale };
        let level = self.seen.iter().rposition(|seen| seen.size <= pixel * LARGEST).unwrap_or(0);
        level.saturating_sub(finer)
    }

    /// The level of each slice: runs of slices that have the same, nearest first.
    pub(super) fn runs(&self, finer: usize) -> Vec<(Range<i64>, usize)> {
        let level = |k: i64| self.level_at(self.stack.depth(k as u64), finer);
        let mut runs: Vec<(Range<i64>, usize)> = Vec::new();
        let count = self.stack.count as i64;
        let mut k = 0;
        while k < count {
            // Levels rise with the depth: the last slice of this one is found by halving.
            let (own, mut low, mut high) = (level(k), k, count);
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if level(middle) == own { low = middle } else { high = middle }
            }
            runs.push((k..high, own));
            k = high;
        }
        runs
    }

    /// Whether every slice is looked up in the finest level.
    pub(super) fn is_finest(&self, finer: usize) -> bool {
        self.runs(finer).iter().all(|run| run.1 == 0)
    }

    /// The voxels that lookups between two depths in a part of the window may touch; at least one.
    pub(super) fn voxels(&self, level: usize, [x, y]: Window, (near, far): (f64, f64)) -> VoxelBox {
        let of = &self.seen[level];
        let (mut first, mut size) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for d in [near, far] {
                let [a, b, c] = of.index[axis].at_depth(self.stack.perspective, d);
                for x in [x.0, x.1] {
                    for y in [y.0, y.1] {
                        let u = a + b * x + c * y;
                        (low, high) = (low.min(u), high.max(u));
                    }
                }
            }
            let last = of.dims[axis] as i64 - 1;
            // Lookups beyond the volume find its edge. A hair more for what rounding moves.
            let from = ((low - 1e-3).max(0.0) as i64 - HALO).clamp(0, last);
            let to = ((high + 1e-3).max(0.0) as i64 + 1 + HALO).clamp(from, last);
            // A cell has two corners.
            let from = if to == from { (from - 1).max(0) } else { from };
            (first[axis], size[axis]) = (from as usize, (to - from + 1) as usize);
        }
        (first, size)
    }
}
