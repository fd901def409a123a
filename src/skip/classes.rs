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
        let classes: Vec<u8> = bricks.ranges.par_iter().map(|&(lo, hi)| class(f64::from(lo), f64::from(hi))).collect();
        let shown = classes.par_iter().filter(|&&c| c > 0).count();
        Self { dims: bricks.dims, classes, shown }
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
