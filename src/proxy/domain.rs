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
use crate::volume::edit::crop;
use crate::volume::{Grid, Volume};
use crate::{Error, Result};
use glam::DVec3;
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

    /// The part of a volume on the grid `whole` that owns `cells` and holds `halo` voxels beyond their corners, as far as there are any. See
    /// [`Domain::new`] for the rest, and [`crate::halo`] for how many a scene takes.
    ///
    /// # Errors
    /// As [`Domain::new`].
    pub fn with_halo(whole: Grid, cells: [Range<usize>; 3], halo: [usize; 3], range: (f64, f64), non_finite: usize) -> Result<Self> {
        let voxels = std::array::from_fn(|i| {
            let (Range { start, end }, n) = (&cells[i], whole.dims()[i]);
            start.saturating_sub(halo[i])..end.saturating_add(1).saturating_add(halo[i]).min(n)
        });
        Self::new(whole, cells, voxels, range, non_finite)
    }

    /// The parts that `cuts` make of a volume on the grid `whole`, each with a `halo`: x fastest. The cuts of an axis are index coordinates of
    /// voxels in rising order, without the ends: a part owns the samples from one of them up to but without the next.
    ///
    /// # Errors
    /// [`Error::Invalid`] for cuts that do not rise or do not lie between the first voxel and the last; and as [`Domain::new`].
    ///
    /// ```
    /// use slicestack::proxy::Domain;
    /// use slicestack::volume::Grid;
    ///
    /// let whole = Grid::with_spacing([9, 9, 9], [1.0; 3])?;
    /// let parts = Domain::tiles(&whole, &[vec![4], vec![], vec![2, 5]], [1; 3], (0.0, 255.0), 0)?;
    /// assert_eq!(parts.len(), 6);
    /// assert_eq!(parts[0].voxels(), &[0..6, 0..9, 0..4]); // owns samples up to 4, 9 and 2
    /// # Ok::<(), slicestack::Error>(())
    /// ```
    pub fn tiles(whole: &Grid, cuts: &[Vec<usize>; 3], halo: [usize; 3], range: (f64, f64), non_finite: usize) -> Result<Vec<Self>> {
        let mut edges: [Vec<usize>; 3] = Default::default();
        for axis in 0..3 {
            let last = whole.dims()[axis].saturating_sub(1).max(1);
            edges[axis] = [&[0], cuts[axis].as_slice(), &[last]].concat();
            if let Some(pair) = edges[axis].windows(2).find(|pair| pair[0] >= pair[1]) {
                let axis = ["x", "y", "z"][axis];
                return Err(Error::invalid(format!(
                    "domain: cuts along {axis}: {} is followed by {}, and they end at {last}",
                    pair[0], pair[1]
                )));
            }
        }
        let mut tiles = Vec::new();
        for z in edges[2].windows(2) {
            for y in edges[1].windows(2) {
                for x in edges[0].windows(2) {
                    let cells = [x[0]..x[1], y[0]..y[1], z[0]..z[1]];
                    tiles.push(Self::with_halo(whole.clone(), cells, halo, range, non_finite)?);
                }
            }
        }
        Ok(tiles)
    }

    /// # Errors
    /// [`Error::Invalid`] where it lacks voxels up to `halo` beyond the corners of its cells.
    pub(crate) fn check_halo(&self, halo: [usize; 3]) -> Result<()> {
        for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (n, held, (low, high)) = (self.whole.dims()[at], &self.voxels[at], self.owned[at]);
            let start = if low.is_finite() { (low as usize).saturating_sub(halo[at]) } else { 0 };
            let end = if high.is_finite() { (high as usize + 1).saturating_add(halo[at]).min(n) } else { n };
            if held.start > start || held.end < end {
                return Err(Error::invalid(format!("domain: voxels {held:?} along {axis}: this scene takes voxels {start}..{end}")));
            }
        }
        Ok(())
    }

    /// The grid of the whole.
    pub fn whole(&self) -> &Grid {
        &self.whole
    }

    /// The grid of the voxels that the part holds: each where it is in the whole.
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub fn grid(&self) -> Result<Grid> {
        let first = DVec3::from_array(std::array::from_fn(|i| self.voxels[i].start as f64));
        let (map, dims) = (self.whole.index_to_world(), self.voxels.clone().map(|v| v.len()));
        let grid = Grid::new(dims, map.transform_point3(first), map.matrix3)?;
        Ok(grid.with_convention(self.whole.convention()).with_space(self.whole.space()))
    }

    /// The voxels that the part holds of `volume`, which is the whole: a copy.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the volume is not on the whole's grid.
    pub fn window(&self, volume: &Volume) -> Result<Volume> {
        if volume.grid() != &self.whole {
            return Err(Error::invalid("domain: the volume is not on the grid of the whole"));
        }
        crop(volume, self.voxels.clone(), None)
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

    /// The index coordinates that the part owns along each axis: the first, and the first behind them that is not its own; infinite at the
    /// whole's own sides.
    pub fn owned(&self) -> &[(f64, f64); 3] {
        &self.owned
    }

    /// Whether the part owns index coordinates `p` of the whole.
    #[inline]
    pub fn owns(&self, p: [f64; 3]) -> bool {
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

impl Domain {
    /// As [`Domain::fragments`], of pixels whose samples each lie at a depth of their own.
    pub(crate) fn fragments_each(&self, stack: &Stack, (x, y): (u32, u32), depths: &[f64; 64]) -> u64 {
        let at = |i: u32| stack.index_at(f64::from(x + i % 8) + 0.5, f64::from(y + i / 8) + 0.5, depths[i as usize]).to_array();
        (0..64).fold(0, |lanes, i| lanes | u64::from(self.owns(at(i))) << i)
    }

    /// Slices of `covered` outside of which the part owns no fragment of the 8 x 8 pixels from (x,y) on: some more than it takes.
    pub(crate) fn slices(&self, stack: &Stack, (x, y): (u32, u32), covered: Range<i64>) -> Range<i64> {
        let (mut near, mut far) = (stack.near, stack.far);
        for axis in 0..3 {
            let (low, high) = self.owned[axis];
            // Along a ray the coordinate is affine in depth; the corners' rays hold the others between them.
            let rays = [(0, 0), (7, 0), (0, 7), (7, 7)].map(|(right, below)| {
                let (x, y) = (f64::from(x + right) + 0.5, f64::from(y + below) + 0.5);
                stack.index[axis].along(stack.perspective, x, y)
            });
            for (bound, sign) in [(low, 1.0), (high, -1.0)] {
                if bound.is_infinite() {
                    continue;
                }
                // Where sign (a + m d - bound) is not negative, for any of the rays.
                let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
                for (a, m) in rays {
                    let (a, m) = (sign * (a - bound), sign * m);
                    let at = -a / m;
                    match m {
                        m if m > 0.0 => (from, to) = (from.min(at), f64::INFINITY),
                        m if m < 0.0 => (from, to) = (f64::NEG_INFINITY, to.max(at)),
                        _ if a >= -1e-6 => (from, to) = (f64::NEG_INFINITY, f64::INFINITY),
                        _ => {}
                    }
                }
                (near, far) = (near.max(from), far.min(to));
            }
        }
        // Samples lie up to half a slab from its middle, those of corners beyond the box's ends, and all is rounded.
        const MARGIN: f64 = 3.0;
        let slab = |d: f64| (d - stack.near) / stack.spacing;
        let first = if near <= stack.near { covered.start } else { covered.start.max(libm::floor(slab(near) - MARGIN) as i64) };
        let end = if far >= stack.far { covered.end } else { covered.end.min(libm::ceil(slab(far) + MARGIN) as i64) };
        first..end
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
