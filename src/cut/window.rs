//! Which values are shown from black to white.

use crate::{Error, Result};

/// A range of values that is shown from the first to the last colour; what is beyond has the end's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    low: f64,
    high: f64,
}

impl Window {
    /// What shows soft tissue in computed tomography, Hounsfield units: -160 to 240.
    pub const SOFT_TISSUE: Self = Self { low: -160.0, high: 240.0 };

    /// Windows in common use for computed tomography, with their names.
    pub const OF_CT: [(&'static str, Self); 4] = [
        ("soft tissue", Self::SOFT_TISSUE),
        ("lung", Self { low: -1350.0, high: 150.0 }),
        ("bone", Self { low: -500.0, high: 1500.0 }),
        ("brain", Self { low: 0.0, high: 80.0 }),
    ];

    /// From `center` - `width` / 2 to `center` + `width` / 2, data units.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a number is not finite, or the width is not positive or vanishes beside the centre.
    pub fn new(center: f64, width: f64) -> Result<Self> {
        let (low, high) = (center - 0.5 * width, center + 0.5 * width);
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(Error::invalid(format!("window {center},{width}: centre and width must be finite, the width above 0")));
        }
        Ok(Self { low, high })
    }

    /// The window that leaves out 1 % of the darkest and 0.5 % of the brightest of `values`; NaN and infinities do not count. One unit wide
    /// where they are all the same, and 0 to 1 where there are none.
    pub fn of_seen(values: impl Iterator<Item = f64>) -> Self {
        let mut seen: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        if seen.is_empty() {
            return Self { low: 0.0, high: 1.0 };
        }
        let last = (seen.len() - 1) as f64;
        let mut at = |share: f64| *seen.select_nth_unstable_by((share * last + 0.5) as usize, f64::total_cmp).1;
        let (low, high) = (at(0.01), at(0.995));
        // The rest may be a few bright spots in the dark.
        let (low, high) = if low < high { (low, high) } else { (at(0.0), at(1.0)) };
        // Also for values so large that half a unit vanishes beside them.
        let half = 0.5f64.max(low.abs() * 1e-9);
        let wide = low < high && (high - low).is_finite();
        if wide { Self { low, high } } else { Self { low: low - half, high: low + half } }
    }

    /// The values of the first and the last colour.
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Centre and width.
    pub fn center_and_width(&self) -> (f64, f64) {
        (0.5 * self.low + 0.5 * self.high, self.high - self.low)
    }
}
