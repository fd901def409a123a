//! A table over values: how many entries, over which values, and which of them are transparent.

use super::Classify;
use super::slab::{Detail, Measure, Slab, color, seen};
use crate::lanes::LookupTable;
use crate::scene::{SlabForm, TransferFunction};

/// Largest difference from the exact function that a table may have, as a share of the strongest slab in it: thin slabs are many,
/// and their errors add up.
///
/// One place cannot keep it: where opacity comes close to 1 over a few entries only. At 1 itself the extinction is infinite, and for slabs much thinner than the reference
/// length the last interval before it rises too late. What lies there is opaque within a few intervals all the same.
pub(super) const TABLE_ERROR: f64 = 1.0 / 16384.0;
/// Shares of a slab that a table of optical depths is judged by: a gradient may leave so little of it, or a piece of a ray be so short, and then
/// depths are told apart that are all opaque in a whole slab. Next to an opacity of 1, which is infinitely deep, the table is wrong in one
/// interval, however narrow that is.
const SHARES: [f64; 3] = [1.0, 1.0 / 8.0, 1.0 / 64.0];
/// Optical depth from which on it does not matter how sharply a table bends.
const BENDS: f64 = 64.0;
/// Most intervals of a table. With a step in the transfer function at least a sixteenth of them resolve it.
const MOST: usize = 1 << 16;
/// How many times as many a finer table has.
const FINER: usize = 4;
/// Fewest intervals of a table that is not constant.
const FEWEST: usize = 64;

/// Over which values a table runs, and in how many intervals; everything but the thickness of the slab.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ValueTable {
    /// Value at the first entry, data units.
    pub(crate) low: f64,
    /// Value at the last entry, data units.
    pub(crate) high: f64,
    /// Intervals between entries.
    pub(crate) intervals: usize,
    /// Count of intervals with any opacity before interval i: `opaque[i]`, one longer than there are intervals.
    opaque: Vec<u32>,
    /// Whether values at or below the first entry, and at or above the last, have any opacity.
    ends: [bool; 2],
    /// Whether values are those of voxels, not interpolated between them.
    voxels: bool,
}

impl ValueTable {
    /// The layout for values of voxels.
    pub(crate) fn of_voxels(self) -> Self {
        Self { voxels: true, ..self }
    }

    /// A layout for interpolated values in [min, max] through `transfer`, fine enough for slabs like `slab`.
    pub(crate) fn new(transfer: &TransferFunction, (min, max): (f64, f64), slab: Slab) -> Self {
        let knots = transfer.knots();
        let (first, last) = (knots[0], knots[knots.len() - 1]);
        // Beyond its outer knots the function is constant, beyond the data nobody looks. At a step the knot's own value is that of
        // its right-hand side, so the table has to start before it.
        let low = if transfer.has_step(first) { min } else { first.max(min).min(max) };
        let high = last.min(max).max(low);
        if !(high > low) {
            let value = if min > last { last } else { low };
            let opaque = u32::from(transfer.eval(value).alpha > 0.0);
            return Self { low: value, high: value, intervals: 1, opaque: vec![0, opaque], ends: [opaque > 0; 2], voxels: false };
        }
        let inner: Vec<f64> = knots.iter().copied().filter(|&k| k > low && k < high).collect();
        let mut intervals = aligned(&inner, low, high).unwrap_or(FEWEST);
        if inner.iter().any(|&k| transfer.has_step(k)) {
            intervals *= (MOST / 8 / intervals).max(1);
        }
        intervals = intervals.min(MOST);
        while intervals < MOST && Self::error(transfer, &inner, low, high, intervals, slab) > TABLE_ERROR {
            intervals = (intervals * 2).min(MOST);
        }
        if intervals == MOST {
            intervals = fitted(transfer, &inner, low, high, slab);
            if slab.detail == Detail::Finer && Self::error(transfer, &inner, low, high, intervals, slab) > TABLE_ERROR {
                intervals *= FINER;
            }
        }
        let width = (high - low) / intervals as f64;
        let entry = |i: usize| transfer.eval(if i == intervals { high } else { low + i as f64 * width }).alpha > 0.0;
        let mut opaque = vec![0];
        for i in 0..intervals {
            opaque.push(opaque[i] + u32::from(entry(i) || entry(i + 1)));
        }
        Self { low, high, intervals, opaque, ends: [entry(0), entry(intervals)], voxels: false }
    }

    /// The value at entry `i`.
    fn value(&self, i: usize) -> f64 {
        if i == self.intervals { self.high } else { self.low + i as f64 * ((self.high - self.low) / self.intervals as f64) }
    }

    /// Where opacity reaches 1 at one entry and falls on both sides, gives that entry what makes the table's mean over both intervals right.
    ///
    /// Extinction is infinite at that value, but not its integral over values: a field that passes it is no wall. An entry of 1 would make
    /// one of it, the more likely the thinner slabs are: they meet the intervals beside it more often, and are hardly less opaque there. With
    /// (1 - a) rising in a straight line from 0 to q over an interval, the mean of 1 - (1 - a)^r is 1 - q^r / (r + 1).
    fn level_peaks(&self, transfer: &TransferFunction, ratio: f64, colors: &mut [[f32; 4]]) {
        for &knot in transfer.knots().iter().filter(|&&k| k > self.low && k < self.high && transfer.eval(k).alpha >= 1.0) {
            let i = libm::rint((knot - self.low) / (self.high - self.low) * self.intervals as f64) as usize;
            if i == 0 || i >= self.intervals || colors[i][3] < 1.0 || transfer.has_step(knot) {
                continue;
            }
            let left = |at: usize| 1.0 - transfer.eval(self.value(at)).alpha;
            let (q, p) = (left(i - 1), left(i + 1));
            if !(q > 0.0 && p > 0.0) {
                continue;
            }
            // Means of both intervals, twice each, less the entries beside: 1 - q^r (2 / (r + 1) - 1) on average.
            let share = (1.0 - ratio) / (1.0 + ratio);
            let alpha = 1.0 - 0.5 * share * (libm::pow(q, ratio) + libm::pow(p, ratio));
            let alpha = alpha.clamp(0.0, 1.0);
            let rgb = transfer.eval(knot).rgb;
            colors[i] = [rgb[0] * alpha, rgb[1] * alpha, rgb[2] * alpha, alpha].map(|x| x as f32);
        }
    }

    /// Whether it is finer than tables usually are.
    pub(crate) fn is_finer(&self) -> bool {
        self.intervals > MOST
    }

    /// Largest difference between the interpolated table and the function, at `knots` and in the middle of intervals, as a share of
    /// the largest opacity there.
    pub(super) fn error(transfer: &TransferFunction, knots: &[f64], low: f64, high: f64, intervals: usize, slab: Slab) -> f64 {
        let width = (high - low) / intervals as f64;
        let entries: Vec<[f64; 4]> = (0..=intervals).map(|i| color(transfer, low + i as f64 * width, slab)).collect();
        let shares = if slab.measure == Measure::OpticalDepth { &SHARES[..] } else { &SHARES[..1] };
        let mut strongest = entries.iter().fold(0.0, |most: f64, e| most.max(seen(*e, slab.measure, 1.0)[3]));
        let mut differ = |value: f64| {
            let x = (value - low) / width;
            let i = (x as usize).min(intervals - 1);
            let (a, b, t) = (entries[i], entries[i + 1], x - i as f64);
            let exact = color(transfer, value, slab);
            strongest = strongest.max(seen(exact, slab.measure, 1.0)[3]);
            let found = [0, 1, 2, 3].map(|c: usize| a[c] + (b[c] - a[c]) * t);
            let apart = |share: f64| {
                let (found, exact) = (seen(found, slab.measure, share), seen(exact, slab.measure, share));
                (0..4).map(|c| (found[c] - exact[c]).abs()).fold(0.0, f64::max)
            };
            shares.iter().map(|&share| apart(share)).fold(0.0, f64::max)
        };
        let middles = (0..intervals).map(|i| low + (i as f64 + 0.5) * width);
        let worst = knots.iter().copied().chain(middles).map(&mut differ).fold(0.0, f64::max);
        if strongest > 0.0 { worst / strongest } else { 0.0 }
    }
}

impl Classify for ValueTable {
    fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    fn table(&self, transfer: &TransferFunction, slab: Slab) -> LookupTable {
        if self.high == self.low {
            return LookupTable::new(&[color(transfer, self.low, slab).map(|x| x as f32)]);
        }
        let mut colors: Vec<[f32; 4]> = (0..=self.intervals).map(|i| color(transfer, self.value(i), slab).map(|x| x as f32)).collect();
        if !self.voxels && slab.form == SlabForm::Exponential && slab.measure == Measure::Opacity {
            self.level_peaks(transfer, slab.ratio, &mut colors);
        }
        LookupTable::new(&colors)
    }

    fn last(&self) -> usize {
        if self.high == self.low { 0 } else { self.intervals }
    }

    fn may_show(&self, lo: f64, hi: f64) -> bool {
        if lo > hi {
            return false;
        }
        if self.high == self.low {
            return self.opaque[1] > 0;
        }
        // Rounding of the interpolation may leave the range by a few units in the last place of f32.
        let slack = 1e-6 * lo.abs().max(hi.abs());
        let margin = slack + 1e-6 * self.low.abs().max(self.high.abs());
        if hi + margin < self.low {
            return self.ends[0];
        }
        if lo - margin > self.high {
            return self.ends[1];
        }
        let scale = self.intervals as f64 / (self.high - self.low);
        let top = self.intervals as f64 - 1.0;
        let a = ((lo - slack - self.low) * scale).clamp(0.0, top) as usize;
        let b = ((hi + slack - self.low) * scale).clamp(0.0, top) as usize;
        self.opaque[b + 1] > self.opaque[a]
    }
}

/// The smallest number of intervals, of at least [`FEWEST`], that puts every knot on an entry, if it is reasonable.
pub(super) fn aligned(knots: &[f64], low: f64, high: f64) -> Option<usize> {
    let range = high - low;
    // Knots in units of 1/2^s of the data's unit: whole numbers for s up to 4 in all common tables.
    for s in [1.0, 2.0, 4.0, 8.0, 16.0] {
        let whole = |x: f64| {
            let y = x * s;
            (y.abs() < 1e9 && libm::fabs(y - libm::rint(y)) < 1e-9).then(|| libm::rint(y) as u64)
        };
        let Some(total) = whole(range) else { continue };
        let Some(offsets) = knots.iter().map(|k| whole(k - low)).collect::<Option<Vec<u64>>>() else { continue };
        let unit = offsets.iter().copied().fold(total, gcd);
        let mut intervals = (total / unit.max(1)) as usize;
        if intervals == 0 || intervals > MOST / 4 {
            return None;
        }
        while intervals < FEWEST {
            intervals *= 2;
        }
        return Some(intervals);
    }
    None
}

/// The number of intervals, up to [`MOST`], whose entries come closest to all knots, weighted by how sharply the function bends
/// there: for spikes too narrow for any table of that size to resolve by chance.
fn fitted(transfer: &TransferFunction, knots: &[f64], low: f64, high: f64, slab: Slab) -> usize {
    // More knots than these are never all met.
    const KNOTS: usize = 64;
    let gap = knots.windows(2).map(|w| w[1] - w[0]).fold((high - low) * 1e-3, f64::min) * 1e-3;
    let mut bends: Vec<(f64, f64)> = knots
        .iter()
        .map(|&k| {
            let at = |v: f64| {
                let entry = color(transfer, v, slab);
                if entry[3] > BENDS { entry.map(|x| x * (BENDS / entry[3])) } else { entry }
            };
            let (a, b, c) = (at(k - gap), at(k), at(k + gap));
            (k, (0..4).map(|i| ((c[i] - b[i]) - (b[i] - a[i])).abs() / gap).fold(0.0, f64::max))
        })
        .collect();
    bends.sort_by(|a, b| b.1.total_cmp(&a.1));
    bends.truncate(KNOTS);
    let error = |m: usize| {
        let width = (high - low) / m as f64;
        bends.iter().fold(0.0, |worst: f64, &(k, bend)| {
            let x = (k - low) / width;
            let t = x - libm::floor(x);
            worst.max(t * (1.0 - t) * width * bend)
        })
    };
    let (mut best, mut least) = (MOST, error(MOST));
    for m in MOST / 4..MOST {
        if least <= TABLE_ERROR {
            break;
        }
        let e = error(m);
        if e < least {
            (best, least) = (m, e);
        }
    }
    best
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classify::{Detail, Measure};

    const ONE: Slab = Slab { ratio: 1.0, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual };

    fn gray(opacity: Vec<(f64, f64)>) -> TransferFunction {
        TransferFunction::new(vec![(0.0, [0.2, 0.5, 1.0]), (1000.0, [1.0, 0.5, 0.0])], opacity).expect("valid")
    }

    fn worst(transfer: &TransferFunction, range: (f64, f64), ratio: f64) -> f64 {
        let slab = Slab { ratio, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual };
        let layout = ValueTable::new(transfer, range, slab);
        let table = layout.table(transfer, slab);
        let n = 100_003;
        (0..=n)
            .map(|i| {
                let value = range.0 + (range.1 - range.0) * f64::from(i) / f64::from(n);
                let x = ((value - layout.low) / (layout.high - layout.low) * layout.last() as f64).clamp(0.0, layout.last() as f64);
                let [entry, next] = [table.entries()[x as usize], table.entries()[x as usize + 1]];
                let exact = color(transfer, value, slab);
                (0..4).map(|c| (f64::from(entry[c]) + f64::from(next[c] - entry[c]) * x.fract() - exact[c]).abs()).fold(0.0, f64::max)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn tables_stay_within_a_1024th_of_full_scale() {
        let ramp = gray(vec![(0.0, 0.0), (1000.0, 0.9)]);
        let spike = gray(vec![(400.0, 0.0), (400.7, 0.6), (401.3, 0.0)]);
        let odd = gray(vec![(0.1, 0.0), (333.3333, 0.02), (333.7, 0.9), (777.77, 0.1)]);
        for transfer in [ramp, spike, odd] {
            for ratio in [0.01, 1.0] {
                let e = worst(&transfer, (0.0, 1000.0), ratio);
                assert!(e < 1.0 / 1024.0, "ratio {ratio}: {e}");
            }
        }
    }

    #[test]
    fn a_spike_up_to_opacity_one_is_kept_at_its_reference_length() {
        let spike = gray(vec![(400.0, 0.0), (400.7, 1.0), (401.3, 0.0)]);
        assert!(worst(&spike, (0.0, 1000.0), 1.0) < 1.0 / 1024.0);
    }

    #[test]
    fn whole_number_knots_fall_on_entries() {
        let points: Vec<(f64, f64)> = (0..256).map(|i| (f64::from(i), f64::from(i * 7919 % 256) / 512.0)).collect();
        let transfer = gray(points.clone());
        let layout = ValueTable::new(
            &transfer,
            (0.0, 255.0),
            Slab { ratio: 0.5, form: SlabForm::Exponential, measure: Measure::Opacity, detail: Detail::Usual },
        );
        assert_eq!(layout.intervals % 255, 0);
        assert!(worst(&transfer, (0.0, 255.0), 0.5) < 1.0 / 1024.0);
    }

    #[test]
    fn transparent_ranges_are_known() {
        let transfer = gray(vec![(100.0, 0.0), (200.0, 0.5), (300.0, 0.0), (500.0, 0.0), (600.0, 0.1)]);
        let layout = ValueTable::new(&transfer, (0.0, 1000.0), ONE);
        assert!(!layout.may_show(0.0, 99.0));
        assert!(layout.may_show(0.0, 101.0));
        assert!(!layout.may_show(310.0, 490.0));
        assert!(layout.may_show(250.0, 400.0));
        assert!(layout.may_show(900.0, 1000.0));
        assert!(!layout.may_show(f64::INFINITY, f64::NEG_INFINITY));
    }

    #[test]
    fn data_beyond_every_knot_is_one_color() {
        let transfer = gray(vec![(100.0, 0.3), (200.0, 0.5)]);
        let above = ValueTable::new(&transfer, (2000.0, 3000.0), ONE);
        assert_eq!(above.table(&transfer, ONE).entries()[0][3], 0.5);
        let below = ValueTable::new(&transfer, (-30.0, -20.0), ONE);
        assert_eq!(below.table(&transfer, ONE).entries()[0][3], 0.3f32);
    }

    #[test]
    fn a_peak_of_opacity_1_has_the_mean_of_its_intervals() {
        // Knots on entries: 0, 250, 1000.
        let peak = gray(vec![(0.0, 0.0), (250.0, 1.0), (1000.0, 0.2)]);
        for ratio in [1.0, 0.3, 1e-2, 1e-4] {
            let slab = Slab { ratio, ..ONE };
            let layout = ValueTable::new(&peak, (0.0, 1000.0), slab);
            let table = layout.table(&peak, slab);
            let i = (250.0 / 1000.0 * layout.last() as f64).round() as usize;
            let width = 1000.0 / layout.last() as f64;
            let found = |value: f64| {
                let x = value / width;
                let (a, b) = (table.entries()[x as usize][3], table.entries()[x as usize + 1][3]);
                f64::from(a) + f64::from(b - a) * x.fract()
            };
            // Finely where extinction is infinite: by the square root of the distance.
            let mean = |of: &dyn Fn(f64) -> f64| {
                let n = 200_000;
                let part = |side: f64| {
                    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
                    (0..n).map(|k| of(250.0 + side * width * at(k) * at(k)) * 2.0 * at(k)).sum::<f64>() / f64::from(n)
                };
                part(1.0) + part(-1.0)
            };
            let exact = mean(&|value| color(&peak, value, slab)[3]);
            let got = mean(&found);
            assert!((got - exact).abs() <= 1e-5 * exact, "{ratio}: {got} of {exact}");
            // Values of voxels keep the wall.
            assert_eq!(layout.clone().of_voxels().table(&peak, slab).entries()[i][3], 1.0);
            assert!(ratio == 1.0 || table.entries()[i][3] < 1.0);
        }
        // A plateau is a wall, and so is the last point.
        for walls in [vec![(0.0, 0.0), (250.0, 1.0), (500.0, 1.0), (1000.0, 0.2)], vec![(0.0, 0.0), (1000.0, 1.0)]] {
            let walls = gray(walls);
            let slab = Slab { ratio: 1e-3, ..ONE };
            let layout = ValueTable::new(&walls, (0.0, 1000.0), slab);
            assert!(layout.table(&walls, slab).entries().iter().any(|e| e[3] == 1.0));
        }
    }
}
