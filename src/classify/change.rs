//! How much a slab's colour and opacity change over a range of values, as a share of the strongest slab's, in classes half an octave apart.

use crate::lanes::LookupTable;

/// Ranges of values are told apart by this many intervals along each side.
const SIDE: usize = 256;
/// The last class.
const LAST: u8 = 26;
/// Classes, from nothing visible (0) and hardly any change (1, up to 2^-12) to any change.
pub(crate) const CHANGES: usize = LAST as usize + 1;

/// The largest change of red, green, blue (premultiplied) or opacity in `class`, as a share of the strongest slab's opacity.
pub(crate) fn most(class: u8) -> f64 {
    match class {
        0 => 0.0,
        c if c < LAST => libm::exp2(0.5 * f64::from(i32::from(c) - 25)),
        _ => f64::INFINITY,
    }
}

/// Classes of all ranges of values that a table tells apart.
#[derive(Debug, Clone)]
pub(crate) struct ChangeClasses {
    low: f64,
    /// Intervals per unit of value; negative where the table runs from high values to low ones, 0 for a table of one entry.
    per_value: f64,
    side: usize,
    /// Class of values from interval i to interval j at `i * side + j`.
    classes: Vec<u8>,
}

impl ChangeClasses {
    /// Classes of a table whose entries 0 to `last` stand for values from `low` to `high`.
    pub(crate) fn new(table: &LookupTable, (low, high): (f64, f64), last: usize) -> Self {
        let side = last.clamp(1, SIDE);
        let bounds: Vec<f64> = (0..=LAST).map(most).collect();
        let entry = |i: usize| &table.entries()[i];
        // Least and greatest of each interval, both of its ends among them.
        let parts: Vec<[[f32; 4]; 2]> = (0..side)
            .map(|i| {
                (i * last / side..=(i + 1) * last / side)
                    .map(entry)
                    .fold([*entry(i * last / side); 2], |[a, b], e| [min(a, *e), max(b, *e)])
            })
            .collect();
        let strongest = f64::from(strongest(table));
        let mut classes = vec![0; side * side];
        for i in 0..side {
            let [mut least, mut greatest] = parts[i];
            for (j, &[a, b]) in parts.iter().enumerate().skip(i) {
                (least, greatest) = (min(least, a), max(greatest, b));
                let change = (0..4).map(|c| f64::from(greatest[c]) - f64::from(least[c])).fold(0.0, f64::max) / strongest;
                classes[i * side + j] =
                    if greatest[3] > 0.0 { bounds.iter().skip(1).position(|&b| change <= b).map_or(LAST, |c| c as u8 + 1) } else { 0 };
            }
        }
        let per_value = if high > low { side as f64 / (high - low) } else { 0.0 };
        Self { low, per_value, side, classes }
    }

    /// Class of a field that stays within `[lo, hi]`; of nothing where `lo > hi`.
    pub(crate) fn class(&self, lo: f64, hi: f64) -> u8 {
        if lo > hi {
            return 0;
        }
        // Conversion saturates: values beyond the table belong to its ends.
        let part = |value: f64| (((value - self.low) * self.per_value) as usize).min(self.side - 1);
        self.classes[part(lo) * self.side + part(hi)]
    }
}

/// Opacity of the strongest slab in a table.
pub(crate) fn strongest(table: &LookupTable) -> f32 {
    table.entries().iter().fold(0.0, |most: f32, entry| most.max(entry[3]))
}

fn min(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| a[c].min(b[c]))
}

fn max(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| a[c].max(b[c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_bound_what_changes() {
        for last in [1usize, 7, 255, 256, 1000] {
            let color = |i: usize| {
                let a = if i * 3 < last { 0.0 } else { 0.5 + 0.5 * libm::sin(i as f64 * 9.0 / last as f64) };
                [0.3 * a, 0.2, a * a, a].map(|x| if a > 0.0 { x as f32 } else { 0.0 })
            };
            let colors: Vec<[f32; 4]> = (0..=last).map(color).collect();
            let table = LookupTable::new(&colors);
            let (low, high) = (-3.0, 5.0);
            let changes = ChangeClasses::new(&table, (low, high), last);
            let strongest = f64::from(strongest(&table));
            let mut seen = [false; 2];
            for case in 0..400 {
                let lo = low - 1.0 + f64::from(case % 20) * 0.5;
                let hi = lo + f64::from(case / 20) * 0.4;
                let at = |v: f64| ((v - low) / (high - low)).clamp(0.0, 1.0) * last as f64;
                let (first, end) = (libm::floor(at(lo)) as usize, libm::ceil(at(hi)) as usize);
                let range = |c: usize| {
                    let all = colors[first..=end].iter().map(|e| f64::from(e[c]));
                    all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
                };
                let change = (0..4).map(range).fold(0.0, f64::max);
                let class = changes.class(lo, hi);
                assert!(change <= most(class) * strongest, "{last} {lo} {hi}: {change}, class {class}");
                let visible = colors[first..=end].iter().any(|e| e[3] > 0.0);
                assert!(!visible || class > 0);
                seen[usize::from(class > 0)] = true;
            }
            assert!(seen[1] && (seen[0] || last == 1));
        }
        assert_eq!(ChangeClasses::new(&LookupTable::new(&[[0.1, 0.1, 0.1, 0.2]]), (4.0, 4.0), 0).class(1.0, 9.0), 1);
        assert_eq!(ChangeClasses::new(&LookupTable::new(&[[0.0; 4]]), (4.0, 4.0), 0).class(1.0, 9.0), 0);
    }
}
