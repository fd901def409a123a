//! A table whose entries follow the knots of the transfer function, one piece after the other, however close together or far apart they are: for
//! values that are told apart exactly, as labels are.
//!
//! ```text
//!   value      k0          k1 k2                k3        pieces: below k0, k0 to k1, k1 to k2, ..., from the last knot on
//!   position   0  1 2 3 4  5 6  7 8 9 10 11     12        each has entries of its own at both ends, so no lookup reaches from one into another
//! ```
//!
//! Values become positions in f64, in the lookup itself (`fragment/labels.rs`). Positions rise with values.

use super::Classify;
use super::slab::{Slab, of_straight};
use super::value::TABLE_ERROR;
use crate::lanes::LookupTable;
use crate::scene::{Straight, TransferFunction};

/// Most intervals of all pieces together, unless there are more knots.
const MOST: usize = 1 << 16;
/// Most intervals of one piece.
const MOST_IN_PIECE: usize = 1 << 10;

/// The values between two knots, the first of them among those.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Value at its first entry, data units.
    pub(crate) from: f64,
    /// Distance from there to the knot behind it; infinite where there is none.
    pub(crate) width: f64,
    /// Its first entry.
    pub(crate) first: usize,
    /// Intervals between its entries.
    pub(crate) intervals: usize,
    /// Straight colours and opacities at both ends; between them they lie on a straight line.
    ends: [Straight; 2],
}

impl Piece {
    /// Straight colour and opacity `t` of the way to its end.
    fn at(&self, t: f64) -> Straight {
        let [a, b] = self.ends;
        let between = |a: f64, b: f64| (a + (b - a) * t).clamp(0.0, 1.0);
        Straight { rgb: std::array::from_fn(|c| between(a.rgb[c], b.rgb[c])), alpha: between(a.alpha, b.alpha) }
    }
}

/// A transfer function piece by piece.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnotTable {
    transfer: TransferFunction,
    /// Below the first knot, between knots, and from the last one on.
    pieces: Vec<Piece>,
}

impl KnotTable {
    /// Entries for slabs like `slab` through `transfer`.
    pub(crate) fn new(transfer: &TransferFunction, slab: Slab) -> Self {
        let knots = transfer.knots();
        let most = (MOST / knots.len()).clamp(1, MOST_IN_PIECE);
        let flat =
            |from: f64, straight: Straight, first: usize| Piece { from, width: f64::INFINITY, first, intervals: 0, ends: [straight; 2] };
        // Below the first knot everything is like the smallest value; a step at the knot itself comes after it.
        let mut pieces = vec![flat(knots[0], transfer.eval(f64::MIN), 0)];
        for pair in knots.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let (start, middle) = (transfer.eval(from), transfer.eval(0.5 * from + 0.5 * to));
            // What the function tends to before a step at `to`. Between two f64 side by side there is nothing to tell.
            let beyond = |a: f64, m: f64| (2.0 * m - a).clamp(0.0, 1.0);
            let end =
                Straight { rgb: std::array::from_fn(|c| beyond(start.rgb[c], middle.rgb[c])), alpha: beyond(start.alpha, middle.alpha) };
            let mut piece = Piece { from, width: to - from, first: 0, intervals: 1, ends: [start, end] };
            while piece.intervals < most && error(&piece, slab) > TABLE_ERROR {
                piece.intervals *= 2;
            }
            piece.first = pieces.last().map_or(0, |p: &Piece| p.first + p.intervals + 1);
            pieces.push(piece);
        }
        let last = knots[knots.len() - 1];
        let first = pieces.last().map_or(0, |p| p.first + p.intervals + 1);
        pieces.push(flat(last, transfer.eval(last), first));
        Self { transfer: transfer.clone(), pieces }
    }

    /// Its pieces, in the order of values.
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Straight colour and opacity at a position in the table.
    pub(crate) fn straight(&self, position: f64) -> Straight {
        let at = self.pieces.partition_point(|p| p.first as f64 <= position).max(1) - 1;
        let piece = &self.pieces[at];
        piece.at(if piece.intervals == 0 { 0.0 } else { ((position - piece.first as f64) / piece.intervals as f64).min(1.0) })
    }
}

/// Largest difference between a piece's slabs and the straight lines between its entries, in the middle of intervals, as a share of its
/// strongest slab.
fn error(piece: &Piece, slab: Slab) -> f64 {
    let n = piece.intervals as f64;
    let entry = |x: f64| of_straight(piece.at(x / n), slab);
    let (mut worst, mut strongest) = (0.0, 0.0);
    for i in 0..piece.intervals {
        let (a, middle, b) = (entry(i as f64), entry(i as f64 + 0.5), entry(i as f64 + 1.0));
        for c in 0..4 {
            worst = f64::max(worst, (0.5 * (a[c] + b[c]) - middle[c]).abs());
        }
        strongest = f64::max(strongest, a[3].max(b[3]));
    }
    if strongest > 0.0 { worst / strongest } else { 0.0 }
}

impl Classify for KnotTable {
    fn range(&self) -> (f64, f64) {
        (self.pieces[0].from, self.pieces[self.pieces.len() - 1].from)
    }

    fn last(&self) -> usize {
        self.pieces.last().map_or(0, |p| p.first)
    }

    fn table(&self, _: &TransferFunction, slab: Slab) -> LookupTable {
        let entries = self.pieces.iter().flat_map(|piece| {
            let n = piece.intervals.max(1) as f64;
            (0..=piece.intervals).map(move |i| of_straight(piece.at(i as f64 / n), slab).map(|x| x as f32))
        });
        LookupTable::new(&entries.collect::<Vec<_>>())
    }

    fn may_show(&self, lo: f64, hi: f64) -> bool {
        lo <= hi && self.transfer.opaque_within(lo, hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classify::{Detail, Measure};
    use crate::scene::SlabForm;

    const ONE: Slab = Slab { ratio: 1.0, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual };

    fn position(table: &KnotTable, value: f64) -> f64 {
        let p = table.pieces();
        let at = p.iter().skip(1).take_while(|p| p.from <= value).count();
        let t = if p[at].intervals == 0 { 0.0 } else { (value - p[at].from) / p[at].width };
        p[at].first as f64 + t * p[at].intervals as f64
    }

    #[test]
    fn every_value_has_its_color_however_close_the_knots() {
        let big = 4_294_967_290.0;
        let color = vec![(0.0, [1.0, 0.5, 0.0]), (16_777_217.4, [1.0, 0.0, 0.0]), (16_777_217.6, [0.0, 1.0, 0.0]), (big, [0.0, 0.0, 1.0])];
        let opacity = vec![(16_777_217.4, 0.0), (16_777_217.6, 0.9), (1e9, 0.9), (1e9, 0.2), (big - 0.5, 0.3), (big + 0.5, 1.0)];
        let transfer = TransferFunction::new(color, opacity).expect("valid");
        let table = KnotTable::new(&transfer, ONE);
        let entries = table.table(&transfer, ONE);
        let values =
            [-5.0, 0.0, 1.0, 16_777_216.0, 16_777_217.0, 16_777_218.0, 999_999_999.0, 1e9, 1e9 + 1.0, big - 1.0, big, big + 1.0, 5e9];
        for value in values {
            let x = position(&table, value);
            let exact = transfer.eval(value);
            let straight = table.straight(x);
            let (i, t) = (x as usize, x.fract() as f32);
            for c in 0..4 {
                let want = if c < 3 { exact.rgb[c] } else { exact.alpha };
                let got = if c < 3 { straight.rgb[c] } else { straight.alpha };
                assert!((got - want).abs() < 1e-12, "{value}: {straight:?} not {exact:?}");
                let (a, b) = (entries.entries()[i][c], entries.entries()[i + 1][c]);
                let slab = of_straight(exact, ONE)[c];
                assert!((f64::from(a + (b - a) * t) - slab).abs() < 1e-4, "{value}: component {c}");
            }
        }
        let all: Vec<f64> = values.iter().map(|&v| position(&table, v)).collect();
        assert!(all.windows(2).all(|w| w[0] <= w[1]), "{all:?}");
        assert!(!table.may_show(0.0, 16_777_217.0) && table.may_show(0.0, 16_777_218.0) && !table.may_show(1.0, 0.0));
    }

    #[test]
    fn a_step_at_the_only_knot_has_two_sides() {
        let transfer = TransferFunction::new(vec![(7.0, [1.0; 3])], vec![(7.0, 0.25), (7.0, 0.5)]).expect("valid");
        let table = KnotTable::new(&transfer, ONE);
        assert_eq!([6.9, 7.0, 7.1].map(|v| table.straight(position(&table, v)).alpha), [0.25, 0.5, 0.5]);
    }
}
