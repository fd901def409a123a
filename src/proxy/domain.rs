//! A part of a volume that renders its share of the whole picture.
//!
//! ```text
//!   voxels of the whole    0   1   2   3   4   5   6   7        this part owns the samples from index 2 up to but without 5;
//!   this part has                  o   o   o   o                its voxels reach one further: lookups at 4.9 need voxel 5
//!   owned samples                  [-----------)                sides at the end of the whole reach to infinity
//! ```
//!
//! A fragment belongs to the part that owns the position of its sample, so that parts that tile the whole share its fragments without
//! leaving one out or taking one twice. No slab is cut where two parts meet: the pieces of a ray keep the lengths that they have in the
//! whole (Hsu 1993, Ma et al. 1994, for rendering in parts; owning samples instead of segments is what keeps slabs whole).

use super::Stack;
use crate::volume::Grid;
use crate::{Error, Result};
use std::ops::Range;

/// Which part of a whole volume another volume holds.
///
/// # Guarantees
/// The owned cells lie in the whole and are not empty; the voxels hold every corner of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    whole: Grid,
    voxels: [Range<usize>; 3],
    /// Lowest owned index coordinate and the first that is not owned, along each axis; infinite at the whole's own sides.
    owned: [(f64, f64); 3],
    /// Least and greatest finite stored value of the whole, and how many of its voxels are NaN or infinite.
    range: (f64, f64),
    non_finite: usize,
}

impl Domain {
    /// The part of a volume on the grid `whole` that owns `cells` (cell i lies between voxels i and i + 1) and holds the voxels
    /// `voxels`, along x, y and z. `range` is the least and greatest finite stored value of the whole, on which its tables depend, and
    /// `non_finite` the number of its voxels that are NaN or infinite.
    ///
    /// # Errors
    /// [`Error::Invalid`] for cells or voxels that are empty or not in the whole, for cells whose corners are not all among the voxels,
    /// and for a range that is not finite or falls.
    pub fn new(whole: Grid, cells: [Range<usize>; 3], voxels: [Range<usize>; 3], range: (f64, f64), non_finite: usize) -> Result<Self> {
        for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (n, cells, voxels) = (whole.dims()[at], &cells[at], &voxels[at]);
            // An axis of one voxel has one cell, of no extent.
            let last = n.saturating_sub(1).max(1);
            if cells.start >= cells.end || cells.end > last {
                return Err(Error::invalid(format!("domain: cells {cells:?} along {axis}: the whole has cells 0..{last}")));
            }
            if voxels.start >= voxels.end || voxels.end > n {
                return Err(Error::invalid(format!("domain: voxels {voxels:?} along {axis}: the whole has voxels 0..{n}")));
            }
            let corners = cells.start..(cells.end + 1).min(n);
            if voxels.start > corners.start || voxels.end < corners.end {
                return Err(Error::invalid(format!("domain: voxels {voxels:?} along {axis} lack corners of cells {cells:?}, {corners:?}")));
            }
        }
        if !(range.0.is_finite() && range.1.is_finite() && range.0 <= range.1) {
            return Err(Error::invalid(format!("domain: values from {} to {}: must be finite and rise", range.0, range.1)));
        }
        let owned = std::array::from_fn(|axis| {
            let (Range { start, end }, n) = (&cells[axis], whole.dims()[axis]);
            let low = if *start == 0 { f64::NEG_INFINITY } else { *start as f64 };
            let high = if *end + 1 >= n { f64::INFINITY } else { *end as f64 };
            (low, high)
        });
        Ok(Self { whole, voxels, owned, range, non_finite })
    }

    /// The grid of the whole.
    pub fn whole(&self) -> &Grid {
        &self.whole
    }

    /// Voxels of the whole that the part holds, along x, y and z.
    pub fn voxels(&self) -> &[Range<usize>; 3] {
        &self.voxels
    }

    /// Least and greatest finite stored value of the whole.
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Voxels of the whole that are NaN or infinite.
    pub fn non_finite(&self) -> usize {
        self.non_finite
    }

    /// Whether the part owns index coordinates `p` of the whole.
    #[inline]
    fn owns(&self, p: [f64; 3]) -> bool {
        (0..3).all(|i| p[i] >= self.owned[i].0 && p[i] < self.owned[i].1)
    }

    /// The fragments that the part owns of the 8 x 8 pixels from (x,y) on, at depth `d` of the whole's `stack`: bit i is the pixel in
    /// column i % 8, row i / 8.
    pub(crate) fn fragments(&self, stack: &Stack, (x, y): (u32, u32), d: f64) -> u64 {
        /// Twice what rounding moves an index coordinate by, as a share of it and of the voxels.
        const MARGIN: f64 = 1e-9;
        let at = |i: u32| stack.index_at(f64::from(x + i % 8) + 0.5, f64::from(y + i / 8) + 0.5, d).to_array();
        // On a slice positions are affine in x and y: the corners hold the extremes.
        let corners = [0, 7, 56, 63].map(at);
        let mut inside = true;
        for axis in 0..3 {
            let least = corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
            let most = corners.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max);
            let margin = MARGIN * (1.0 + least.abs().max(most.abs()) + stack.dims[axis] as f64);
            let (low, high) = self.owned[axis];
            if most + margin < low || least - margin >= high {
                return 0;
            }
            inside &= least - margin >= low && most + margin < high;
        }
        if inside { u64::MAX } else { (0..64).fold(0, |lanes, i| lanes | u64::from(self.owns(at(i))) << i) }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn domains_that_tile_a_whole_own_every_fragment_once() {
        let whole = Grid::with_spacing([20, 17, 9], [1.0, 0.7, 2.0]).unwrap();
        let cuts: [Vec<usize>; 3] = [vec![0, 5, 13, 19], vec![0, 8, 16], vec![0, 3, 8]];
        let mut domains = Vec::new();
        for z in cuts[2].windows(2) {
            for y in cuts[1].windows(2) {
                for x in cuts[0].windows(2) {
                    let cells = [x[0]..x[1], y[0]..y[1], z[0]..z[1]];
                    let voxels = cells.clone().map(|c| c.start..c.end + 1);
                    domains.push(Domain::new(whole.clone(), cells, voxels, (0.0, 1.0), 0).unwrap());
                }
            }
        }
        let view = Camera::default().resolve(&whole, 64, 48).unwrap();
        let stack = Stack::new(&whole, &view, &[], 40);
        for k in 0..40 {
            for (x, y) in [(0, 0), (24, 16), (32, 24), (56, 40)] {
                let all = domains.iter().map(|d| d.fragments(&stack, (x, y), stack.depth(k)));
                let (union, count) = all.fold((0, 0), |(union, count): (u64, u32), lanes| (union | lanes, count + lanes.count_ones()));
                assert_eq!((union, count), (u64::MAX, 64), "slice {k}, block {x},{y}");
            }
        }
    }

    #[test]
    fn impossible_domains_are_refused() {
        let whole = || Grid::with_spacing([10, 10, 1], [1.0; 3]).unwrap();
        let new = |x: Range<usize>, voxels: Range<usize>| Domain::new(whole(), [x, 0..9, 0..1], [voxels, 0..10, 0..1], (0.0, 1.0), 0);
        assert!(new(0..9, 0..10).is_ok() && new(3..5, 3..6).is_ok());
        for (bad, words) in [
            (new(5..5, 0..10), "domain: cells 5..5 along x: the whole has cells 0..9"),
            (new(3..10, 0..10), "domain: cells 3..10 along x"),
            (new(3..5, 3..11), "domain: voxels 3..11 along x: the whole has voxels 0..10"),
            (new(3..5, 3..5), "domain: voxels 3..5 along x lack corners of cells 3..5, 3..6"),
            (Domain::new(whole(), [0..9, 0..9, 0..1], [0..10, 0..10, 0..1], (1.0, 0.0), 0), "values from 1 to 0"),
        ] {
            let said = bad.unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
