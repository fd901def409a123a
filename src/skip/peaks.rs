//! The largest or smallest values that bricks reach, as classes in windows: a projection of the largest or smallest value passes over what cannot
//! change its pixels any more.

use super::windows::Windows;
use super::{BrickClasses, Sides};
use crate::volume::bricks::{BRICK, Bricks};

/// Numbers that a byte tells apart.
const CLASSES: usize = 256;

/// The greatest class of bricks whose bound is known; greater ones stand for boxes of too many bricks.
const TOP: usize = 253;

/// What interpolation may add to a brick's largest number by rounding, relative to the largest number there is: less than this.
const SLACK: f64 = 4e-6;

/// How far bricks reach up, or down where smallest values are looked for.
#[derive(Debug)]
pub(crate) struct PeakClasses {
    /// Whether smallest values are looked for.
    pub(crate) falls: bool,
    bricks: BrickClasses,
    bounds: [f32; CLASSES],
}

impl PeakClasses {
    /// Of `bricks`, whose stored values become numbers by `number`. Lookups are `exact` where all voxels around them are equal, or may be rounded even there.
    pub(crate) fn new(bricks: &Bricks, falls: bool, exact: bool, number: impl Fn(f64) -> f64 + Sync) -> Self {
        let sign = if falls { -1.0 } else { 1.0 };
        // The least and the greatest reach of values between two stored ones.
        let reach = |low: f64, high: f64| {
            let (a, b) = (sign * number(low), sign * number(high));
            (a.min(b), a.max(b))
        };
        let (least, most) = if bricks.range.0 <= bricks.range.1 { reach(bricks.range.0, bricks.range.1) } else { (0.0, 0.0) };
        let (step, slack) = ((most - least) / (TOP - 1) as f64, SLACK * least.abs().max(most.abs()));
        // Class 0: bricks of the least reach, all of whose voxels are equal.
        let class = |low: f64, high: f64| {
            if low > high {
                return 0;
            }
            let (from, to) = reach(low, high);
            if exact && from == to && to <= least { 0 } else { 1 + (((to - least) / step).max(0.0) as usize).min(TOP - 1) as u8 }
        };
        let bounds = std::array::from_fn(|class| match class {
            0 => (sign * least) as f32,
            _ if class <= TOP => (sign * (least + class as f64 * step + slack)) as f32,
            _ => sign as f32 * f32::INFINITY,
        });
        Self { falls, bricks: BrickClasses::new(bricks, class), bounds }
    }

    /// In windows of `sides`.
    pub(crate) fn table(&self, sides: Sides) -> PeakTable {
        let windows = Windows::new(self.bricks.dims, self.bricks.classes.clone(), sides[0], BRICK, false);
        PeakTable { falls: self.falls, windows, bounds: self.bounds }
    }
}

/// The greatest reach of windows of bricks.
#[derive(Debug, Clone)]
pub(crate) struct PeakTable {
    /// Whether smallest values are looked for.
    pub(crate) falls: bool,
    pub(crate) windows: Windows,
    bounds: [f32; CLASSES],
}

impl PeakTable {
    /// The number that no lookup in bricks of `class` and lower ones is above; or below, where smallest values are looked for.
    pub(crate) fn bound(&self, class: u8) -> f32 {
        self.bounds[usize::from(class)]
    }

    /// Sides of its windows, in bricks.
    pub(crate) fn sides(&self) -> [usize; 3] {
        self.windows.sides
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Voxels;

    #[test]
    fn no_value_of_a_brick_is_beyond_its_bound() {
        let dims = [23, 14, 9];
        let values: Vec<f32> =
            (0..dims.iter().product()).map(|i: usize| if i % 23 < 9 { -5.0 } else { ((i * 7919) % 991) as f32 * 0.37 - 100.0 }).collect();
        let bricks = Bricks::new(&Voxels::F32(values.into()), dims);
        for falls in [false, true] {
            for gain in [1.0, -2.0] {
                let classes = PeakClasses::new(&bricks, falls, true, |v| v * gain);
                let table = classes.table([[1; 3]; 2]);
                let mut seen = std::collections::BTreeSet::new();
                for (at, &(low, high)) in bricks.ranges.iter().enumerate() {
                    let class = classes.bricks.classes[at];
                    seen.insert(class);
                    for v in [low, high] {
                        let (number, bound) = (f64::from(v) * gain, f64::from(table.bound(class)));
                        assert!(if falls { number >= bound } else { number <= bound }, "{number} is beyond {bound}");
                    }
                    // And not much below it, but for those that reach farthest.
                    let own = [low, high].map(|v| f64::from(v) * gain);
                    let own = if falls { own[0].min(own[1]) } else { own[0].max(own[1]) };
                    assert!((own - f64::from(table.bound(class))).abs() < 4.0, "{own} of class {class}");
                }
                assert!(seen.len() > 3, "{seen:?}");
            }
        }
        // Bricks of one value, all the same: exact, so that a pixel that has seen it needs no more of them.
        let flat = Bricks::new(&Voxels::F32(vec![3.0; 8 * 8 * 8].into()), [8; 3]);
        assert_eq!(PeakClasses::new(&flat, false, true, |v| v).table([[1; 3]; 2]).bound(0), 3.0);
    }
}
