//! Which bricks hold anything the transfer function shows, as sums over boxes of bricks.

use crate::volume::bricks::{BRICK, Bricks};
use rayon::prelude::*;

/// What a box of cells holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    /// Nothing visible.
    Empty,
    /// Some visible bricks.
    Mixed,
    /// Visible bricks only: looking closer cannot help.
    Full,
}

/// A table of sums: visible bricks below and before each corner, so that any box takes eight lookups.
#[derive(Debug, Clone)]
pub(crate) struct Occupancy {
    dims: [usize; 3],
    cells: [u32; 3],
    sums: Vec<u32>,
}

impl Occupancy {
    /// Occupancy of `bricks` on a grid of `dims` voxels, where `visible` tells whether a range of stored values shows.
    pub(crate) fn new(bricks: &Bricks, dims: [usize; 3], visible: impl Fn(f64, f64) -> bool + Sync) -> Self {
        let [bx, by, bz] = bricks.dims;
        let (sx, sy) = (bx + 1, (bx + 1) * (by + 1));
        let mut sums = vec![0u32; sy * (bz + 1)];
        // Each layer's own sums first, all layers at once; then every layer takes in the one below.
        sums[sy..].par_chunks_exact_mut(sy).zip(bricks.ranges.par_chunks_exact(bx * by)).for_each(|(sums, ranges)| {
            for (y, ranges) in ranges.chunks_exact(bx).enumerate() {
                let (before, row) = sums[y * sx..(y + 2) * sx].split_at_mut(sx);
                let mut along = 0;
                for ((&(lo, hi), sum), before) in ranges.iter().zip(&mut row[1..]).zip(&before[1..]) {
                    along += u32::from(visible(f64::from(lo), f64::from(hi)));
                    *sum = along + before;
                }
            }
        });
        for z in 1..=bz {
            let (before, layer) = sums[(z - 1) * sy..(z + 1) * sy].split_at_mut(sy);
            layer.iter_mut().zip(before).for_each(|(sum, before)| *sum += *before);
        }
        Self { dims: bricks.dims, cells: dims.map(|n| n.saturating_sub(2) as u32), sums }
    }

    /// Share of bricks that are visible.
    pub(crate) fn share(&self) -> f64 {
        let all: usize = self.dims.iter().product();
        f64::from(self.sums.last().copied().unwrap_or(0)) / all as f64
    }

    /// What the cells that lookups between index coordinates `lo` and `hi` can touch hold.
    #[inline]
    pub(crate) fn content(&self, lo: [f64; 3], hi: [f64; 3]) -> Content {
        let mut a = [0usize; 3];
        let mut b = [0usize; 3];
        for axis in 0..3 {
            // Lookups beyond the border take the border's cells. A hair more for the rounding of f32 coordinates.
            let top = self.cells[axis];
            a[axis] = ((lo[axis] - 1e-3) as u32).min(top) as usize / BRICK;
            b[axis] = ((hi[axis] + 1e-3) as u32).min(top) as usize / BRICK + 1;
        }
        let (sx, sy) = (self.dims[0] + 1, (self.dims[0] + 1) * (self.dims[1] + 1));
        let (near, far) = (a[2] * sy, b[2] * sy);
        let (top, bottom) = (a[1] * sx, b[1] * sx);
        let row = |at: usize| self.sums[at + b[0]].wrapping_sub(self.sums[at + a[0]]);
        let visible = row(far + bottom).wrapping_sub(row(far + top)).wrapping_sub(row(near + bottom)).wrapping_add(row(near + top));
        let all = (b[0] - a[0]) * (b[1] - a[1]) * (b[2] - a[2]);
        match visible as usize {
            0 => Content::Empty,
            n if n == all => Content::Full,
            _ => Content::Mixed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Voxels;

    #[test]
    fn sums_agree_with_looking_at_every_brick() {
        let dims = [40usize, 25, 33];
        let values: Vec<u8> =
            (0..dims.iter().product::<usize>()).map(|i| if i % 5000 == 0 || (i % 40 < 17 && i > 14_000) { 200 } else { 3 }).collect();
        let bricks = Bricks::new(&Voxels::U8(values.into()), dims);
        let visible = |_: f64, hi: f64| hi > 100.0;
        let occupancy = Occupancy::new(&bricks, dims, visible);
        let brick = |x: usize, y: usize, z: usize| {
            let (lo, hi) = bricks.ranges[(z * bricks.dims[1] + y) * bricks.dims[0] + x];
            visible(f64::from(lo), f64::from(hi))
        };
        let mut seen = [false; 3];
        for case in 0..3000usize {
            let lo = [case * 7 % 41, case * 5 % 26, case * 3 % 34].map(|v| v as f64 - 0.5);
            let hi = [lo[0] + (case % 13) as f64, lo[1] + (case % 9) as f64, lo[2] + (case % 17) as f64];
            let cell = |v: f64, n: usize| (v.max(0.0) as usize).min(n - 2) / BRICK;
            let (mut some, mut every) = (false, true);
            for z in cell(lo[2] - 1e-3, dims[2])..=cell(hi[2] + 1e-3, dims[2]) {
                for y in cell(lo[1] - 1e-3, dims[1])..=cell(hi[1] + 1e-3, dims[1]) {
                    for x in cell(lo[0] - 1e-3, dims[0])..=cell(hi[0] + 1e-3, dims[0]) {
                        some |= brick(x, y, z);
                        every &= brick(x, y, z);
                    }
                }
            }
            let want = if every {
                Content::Full
            } else if some {
                Content::Mixed
            } else {
                Content::Empty
            };
            seen[want as usize] = true;
            assert_eq!(occupancy.content(lo, hi), want);
        }
        assert_eq!(seen, [true; 3]);
    }
}
