//! A class for each brick of a volume, and what coarse bricks hold.

use super::windows::{COARSE, HIDDEN, SHOWN};
use crate::volume::bricks::Bricks;
use rayon::prelude::*;

/// A class for each brick: 0 where nothing shows.
#[derive(Debug, Clone)]
pub(crate) struct BrickClasses {
    pub(super) dims: [usize; 3],
    pub(super) classes: Vec<u8>,
    /// Bricks of which something shows.
    pub(super) shown: usize,
}

impl BrickClasses {
    /// Classes of `bricks`; `class` gives the class of a range of stored values.
    pub(crate) fn new(bricks: &Bricks, class: impl Fn(f64, f64) -> u8 + Sync) -> Self {
        Self::by_place(bricks, |_, lo, hi| class(lo, hi))
    }

    /// The same where the class depends on the brick's position too: among all of them, x fastest.
    pub(crate) fn by_place(bricks: &Bricks, class: impl Fn(usize, f64, f64) -> u8 + Sync) -> Self {
        let each = |(at, &(lo, hi)): (usize, &(f32, f32))| class(at, f64::from(lo), f64::from(hi));
        let classes: Vec<u8> = bricks.ranges.par_iter().enumerate().map(each).collect();
        let shown = classes.par_iter().filter(|&&c| c > 0).count();
        Self { dims: bricks.dims, classes, shown }
    }

    /// The same, but for bricks in which nothing shows because of how little values change: `hidden` is told a brick's own range of stored
    /// values and the width of the range of the brick and its neighbours, which no difference of two values in it exceeds.
    pub(crate) fn without(mut self, bricks: &Bricks, hidden: impl Fn(f64, f64, f64) -> bool + Sync) -> Self {
        let [nx, ny, nz] = self.dims;
        self.classes.par_iter_mut().enumerate().filter(|(_, class)| **class > 0).for_each(|(at, class)| {
            let (x, y, z) = (at % nx, at / nx % ny, at / (nx * ny));
            let near = |n: usize, count: usize| n.saturating_sub(1)..(n + 2).min(count);
            let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
            for k in near(z, nz) {
                for j in near(y, ny) {
                    for i in near(x, nx) {
                        let (l, h) = bricks.ranges[(k * ny + j) * nx + i];
                        (low, high) = (low.min(l), high.max(h));
                    }
                }
            }
            let (l, h) = bricks.ranges[at];
            if hidden(f64::from(l), f64::from(h), f64::from(high) - f64::from(low)) {
                *class = 0;
            }
        });
        self.shown = self.classes.par_iter().filter(|&&c| c > 0).count();
        self
    }

    /// Share of bricks in which anything shows.
    pub(crate) fn share(&self) -> f64 {
        self.shown as f64 / self.classes.len() as f64
    }

    /// What coarse bricks hold: [`SHOWN`], [`HIDDEN`] or both.
    pub(super) fn coarse(&self) -> ([usize; 3], Vec<u8>) {
        let dims = self.dims.map(|n| n.div_ceil(COARSE));
        let mut classes = vec![0u8; dims.iter().product()];
        let layer = self.dims[0] * self.dims[1];
        classes.par_chunks_exact_mut(dims[0] * dims[1]).zip(self.classes.par_chunks(layer * COARSE)).for_each(|(to, from)| {
            for (y, row) in from.chunks_exact(self.dims[0]).enumerate() {
                let to = &mut to[y % self.dims[1] / COARSE * dims[0]..][..dims[0]];
                for (to, four) in to.iter_mut().zip(row.chunks(COARSE)) {
                    *to = four.iter().fold(*to, |a, &b| a | if b > 0 { SHOWN } else { HIDDEN });
                }
            }
        });
        (dims, classes)
    }
}
