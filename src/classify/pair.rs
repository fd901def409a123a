//! Pre-integration: colour and opacity of a slab between the values at its two sides, as a table over both
//! (Engel, Kraus, Ertl 2001), with the attenuation inside the slab.
//!
//! The value is taken to run straight from one side to the other. With [lo, hi] cut into n equal intervals, the slab from entry i
//! to entry j is a chain of |j - i| pieces, each D / |j - i| thick, one through every interval between them. All entries at
//! one distance |j - i| are windows of equal length sliding over one row of pieces, so a window costs two "over" operations: pieces are
//! grouped in runs as long as the window; a window is the end of one run and the beginning of the next.
//!
//! Between entries the table is linear in both values. A slab whose two values lie within one interval is hardly more than a
//! slab of one value; where the transfer function bends sharply inside intervals such slabs are classified by their mean value, in
//! a table as fine as it takes, and there is a smooth change from one to the other.

use super::Classify;
use super::slab::{Detail, Measure, Slab, color, thinness};
use super::value::{TABLE_ERROR, ValueTable, aligned};
use crate::lanes::LookupTable;
use crate::scene::TransferFunction;
use rayon::prelude::*;

/// Intervals along each side, unless the points of the transfer function ask for a few more.
const INTERVALS: usize = 256;
/// Samples of the transfer function in an interval.
const PARTS: usize = 8;
/// Windows up to this length resolve the inside of intervals; in longer ones an interval is a small part.
const FINE: usize = 8;
/// Extinction times reference length that stands for an opacity of 1: opaque however thin the slab, and still a number.
const OPAQUE: f64 = 1e30;

/// The values a table over pairs runs over, and the transfer function between its entries.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PairTable {
    low: f64,
    high: f64,
    intervals: usize,
    /// Extinction times reference length, and that times colour, at the middles of `PARTS` parts of each interval.
    parts: Vec<[f64; 4]>,
    /// Where the transfer function bends too sharply for these entries: values on their own, for slabs within an interval.
    fine: Option<ValueTable>,
    /// Count of intervals with any opacity before interval i, one longer than there are intervals.
    opaque: Vec<u32>,
    /// Whether values at or below the first entry, and at or above the last, have any opacity.
    ends: [bool; 2],
}

/// Premultiplied colour and what is left of light, as optical depth and as transmittance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    color: [f64; 3],
    depth: f64,
    left: f64,
}

impl Piece {
    const NOTHING: Self = Self { color: [0.0; 3], depth: 0.0, left: 1.0 };

    /// A piece of constant extinction and colour: `emission` is their product.
    fn new(extinction: f64, emission: [f64; 3], length: f64) -> Self {
        if !(extinction > 0.0) {
            return Self::NOTHING;
        }
        let depth = extinction * length;
        let alpha = -libm::expm1(-depth);
        Self { color: emission.map(|e| e / extinction * alpha), depth, left: 1.0 - alpha }
    }

    /// This piece before `back`.
    fn over(self, back: Self) -> Self {
        let color = std::array::from_fn(|c| self.color[c] + self.left * back.color[c]);
        Self { color, depth: self.depth + back.depth, left: self.left * back.left }
    }

    fn entry(self, measure: Measure) -> [f32; 4] {
        if measure == Measure::Thinness {
            return [0.0, 0.0, 0.0, thinness(self.depth) as f32];
        }
        let alpha = -libm::expm1(-self.depth);
        // Rounding must not leave more colour than opacity.
        let [r, g, b] = self.color.map(|c| c.min(alpha) as f32);
        [r, g, b, alpha as f32]
    }
}

impl PairTable {
    /// A table for values in [min, max] through `transfer`.
    pub(crate) fn new(transfer: &TransferFunction, (min, max): (f64, f64), slab: Slab) -> Self {
        let knots = transfer.knots();
        let (first, last) = (knots[0], knots[knots.len() - 1]);
        // A slab's other side may lie beyond the outer knots: the table has to tell how far.
        let (mut low, mut high) = (min, max);
        if !(high > low) {
            // One value in all: any width serves.
            (low, high) = (min - 0.5, min + 0.5);
        }
        let inner: Vec<f64> = knots.iter().copied().filter(|&k| k > low && k < high).collect();
        let whole = aligned(&inner, low, high).unwrap_or(INTERVALS);
        let mut intervals = if whole <= 2 * INTERVALS { whole * (INTERVALS / whole).max(1) } else { INTERVALS };
        let sharp = |intervals| ValueTable::error(transfer, &inner, low, high, intervals, slab) > TABLE_ERROR;
        if sharp(intervals) && intervals <= INTERVALS {
            intervals *= 2;
        }
        if slab.detail == Detail::Finer && sharp(intervals) {
            intervals *= 2;
        }
        let width = (high - low) / intervals as f64;
        let steps = (intervals * PARTS) as f64;
        let parts: Vec<[f64; 4]> = (0..intervals * PARTS)
            .map(|p| {
                let straight = transfer.eval(low + (p as f64 + 0.5) / steps * (high - low));
                let extinction = (-libm::log1p(-straight.alpha)).min(OPAQUE);
                let [r, g, b] = straight.rgb.map(|c| c * extinction);
                [r, g, b, extinction]
            })
            .collect();
        let mut opaque = vec![0];
        for i in 0..intervals {
            let (a, b) = (low + i as f64 * width, low + (i + 1) as f64 * width);
            opaque.push(opaque[i] + u32::from(transfer.opaque_within(a, b)));
        }
        let fine = sharp(intervals).then(|| ValueTable::new(transfer, (low, high), slab));
        let beyond = |value: f64, knot: f64| transfer.eval(value).alpha > 0.0 || transfer.eval(knot).alpha > 0.0;
        Self { low, high, intervals, parts, fine, opaque, ends: [beyond(low, first.min(low)), beyond(high, last.max(high))] }
    }

    /// Entries (i, i+d) and (i+d, i) for all i.
    fn diagonal(&self, d: usize, Slab { ratio, measure, .. }: Slab) -> Vec<[[f32; 4]; 2]> {
        // An interval as one piece, upwards and downwards.
        let groups = if d <= FINE { PARTS } else { 2 };
        let in_group = PARTS / groups;
        let length = ratio / (d * groups) as f64;
        let pieces: Vec<[Piece; 2]> = self
            .parts
            .chunks_exact(PARTS)
            .map(|interval| {
                let mut both = [Piece::NOTHING; 2];
                for group in interval.chunks_exact(in_group) {
                    let mean = |c: usize| group.iter().map(|p| p[c]).sum::<f64>() / in_group as f64;
                    let piece = Piece::new(mean(3), [mean(0), mean(1), mean(2)], length);
                    both = [both[0].over(piece), piece.over(both[1])];
                }
                both
            })
            .collect();
        let n = pieces.len();
        // To the end of the run from each piece on, and from the run's beginning up to each piece.
        let mut tails = pieces.clone();
        let mut heads = pieces.clone();
        for m in (0..n - 1).rev().filter(|m| (m + 1) % d != 0) {
            let next = tails[m + 1];
            tails[m] = [pieces[m][0].over(next[0]), next[1].over(pieces[m][1])];
        }
        for m in (1..n).filter(|m| m % d != 0) {
            let before = heads[m - 1];
            heads[m] = [before[0].over(pieces[m][0]), pieces[m][1].over(before[1])];
        }
        (0..=n - d)
            .map(|i| {
                if i % d == 0 {
                    return tails[i].map(|piece| piece.entry(measure));
                }
                let (a, b) = (tails[i], heads[i + d - 1]);
                [a[0].over(b[0]).entry(measure), b[1].over(a[1]).entry(measure)]
            })
            .collect()
    }
}

impl Classify for PairTable {
    fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    fn last(&self) -> usize {
        self.intervals
    }

    fn fine(&self) -> Option<&ValueTable> {
        self.fine.as_ref()
    }

    /// Entry (i,j) stands at i (entries per row) + j, front value first.
    fn table(&self, transfer: &TransferFunction, slab: Slab) -> LookupTable {
        let side = self.intervals + 1;
        let diagonals: Vec<Vec<[[f32; 4]; 2]>> = (1..side).into_par_iter().map(|d| self.diagonal(d, slab)).collect();
        let mut entries = vec![[0.0; 4]; side * side];
        for i in 0..side {
            let value =
                if i == self.intervals { self.high } else { self.low + i as f64 * ((self.high - self.low) / self.intervals as f64) };
            entries[i * side + i] = color(transfer, value, slab).map(|x| x as f32);
        }
        for (d, diagonal) in diagonals.iter().enumerate() {
            for (i, &[up, down]) in diagonal.iter().enumerate() {
                let j = i + d + 1;
                entries[i * side + j] = up;
                entries[j * side + i] = down;
            }
        }
        LookupTable::new(&entries)
    }

    fn may_show(&self, lo: f64, hi: f64) -> bool {
        if lo > hi {
            return false;
        }
        if (lo < self.low && self.ends[0]) || (hi > self.high && self.ends[1]) {
            return true;
        }
        let slack = 1e-6 * lo.abs().max(hi.abs()) + 1e-6 * self.low.abs().max(self.high.abs());
        let scale = self.intervals as f64 / (self.high - self.low);
        let top = self.intervals as f64 - 1.0;
        // Entries on both sides of a value take part in its lookup.
        let a = ((lo - slack - self.low) * scale - 1.0).clamp(0.0, top) as usize;
        let b = ((hi + slack - self.low) * scale + 1.0).clamp(0.0, top) as usize;
        self.opaque[b + 1] > self.opaque[a]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SlabForm;

    const ONE: Slab = Slab { ratio: 1.0, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual };

    /// The slab's integral in 20000 steps.
    fn integral(transfer: &TransferFunction, from: f64, to: f64, ratio: f64) -> [f64; 4] {
        let n = 20_000;
        let mut all = Piece::NOTHING;
        for k in 0..n {
            let straight = transfer.eval(from + (to - from) * (f64::from(k) + 0.5) / f64::from(n));
            let extinction = -libm::log1p(-straight.alpha);
            all = all.over(Piece::new(extinction, straight.rgb.map(|c| c * extinction), ratio / f64::from(n)));
        }
        [all.color[0], all.color[1], all.color[2], 1.0 - all.left]
    }

    fn transfers() -> [TransferFunction; 3] {
        let colors = vec![(0.0, [0.9, 0.1, 0.3]), (100.0, [0.2, 0.8, 0.3]), (255.0, [0.1, 0.4, 1.0])];
        [
            vec![(0.0, 0.0), (255.0, 0.9)],
            vec![(99.0, 0.0), (100.0, 0.95), (101.0, 0.0)],
            vec![(40.0, 0.0), (40.0, 0.5), (90.0, 0.5), (90.0, 0.01)],
        ]
        .map(|opacity| TransferFunction::new(colors.clone(), opacity).expect("valid"))
    }

    #[test]
    fn entries_are_the_slabs_integrals() {
        for (t, transfer) in transfers().iter().enumerate() {
            let pairs = PairTable::new(transfer, (0.0, 255.0), ONE);
            let width = 255.0 / pairs.last() as f64;
            for ratio in [0.05, 1.0, 7.0] {
                let table =
                    pairs.table(transfer, Slab { ratio, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual });
                for (i, j) in [(0, 255), (255, 0), (95, 105), (105, 95), (99, 101), (30, 50), (50, 30), (100, 103), (200, 201), (7, 19)] {
                    let entry = |value: i32| (f64::from(value) / width + 0.5) as usize;
                    let (i, j) = (entry(i), entry(j));
                    let want = integral(transfer, i as f64 * width, j as f64 * width, ratio);
                    let got = table.entries()[i * (pairs.last() + 1) + j];
                    for c in 0..4 {
                        let error = (f64::from(got[c]) - want[c]).abs();
                        assert!(error < 2e-2 * want[3] + 1e-7, "transfer {t}, ratio {ratio}, {i} to {j}: {got:?} not {want:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_opacity_of_one_is_opaque_in_the_thinnest_slab() {
        let transfer = TransferFunction::new(vec![(0.0, [0.5; 3])], vec![(10.0, 0.0), (20.0, 1.0), (255.0, 1.0)]).expect("valid");
        let pairs = PairTable::new(&transfer, (0.0, 255.0), ONE);
        let table =
            pairs.table(&transfer, Slab { ratio: 1e-9, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual });
        let last = pairs.last();
        for (i, j) in [(last / 3, last / 3), (last / 3, last), (0, last), (last, 0)] {
            let got = table.entries()[i * (last + 1) + j];
            assert_eq!(got[3], 1.0, "{i} to {j}");
            assert!((got[0] - 0.5).abs() < 1e-6, "{got:?}");
        }
    }

    #[test]
    fn transparent_pairs_are_known() {
        let [_, spike, _] = transfers();
        let pairs = PairTable::new(&spike, (0.0, 255.0), ONE);
        assert!(!pairs.may_show(0.0, 90.0));
        assert!(pairs.may_show(90.0, 110.0));
        assert!(pairs.may_show(0.0, 255.0));
        assert!(!pairs.may_show(120.0, 255.0));
    }
}
