//! Where a volume's own values lie, for presets that have no fixed units.

use crate::volume::Statistics;

/// Three values that divide a volume's range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landmarks {
    /// Median of the background: of all that lies below [`Landmarks::split`].
    pub background: f64,
    /// The value that best splits the histogram into background and object (Otsu 1979: largest variance between the two).
    pub split: f64,
    /// The value that 99.5 % of the object lies below.
    pub high: f64,
}

impl Landmarks {
    /// The landmarks of `statistics`; for a volume of one value they are made to rise by 1 each.
    pub fn of(statistics: &Statistics) -> Self {
        let (min, max) = (statistics.min, statistics.max);
        let counts = &statistics.histogram;
        let width = (max - min) / counts.len() as f64;
        let total: u64 = counts.iter().sum();
        if total == 0 || width.is_nan() || width <= 0.0 || width.is_infinite() {
            return Self { background: min - 1.0, split: min, high: min + 1.0 };
        }
        let moment: f64 = counts.iter().enumerate().map(|(i, &c)| i as f64 * c as f64).sum();
        let (mut below, mut below_moment, mut best, mut split_bin) = (0u64, 0.0, -1.0, 0);
        for (i, &c) in counts.iter().enumerate().take(counts.len() - 1) {
            below += c;
            below_moment += i as f64 * c as f64;
            let (w0, w1) = (below as f64, (total - below) as f64);
            let excess = moment * w0 / total as f64 - below_moment;
            let spread = excess * excess / (w0 * w1).max(1.0);
            if spread > best {
                (best, split_bin) = (spread, i + 1);
            }
        }
        let split = min + width * split_bin as f64;
        let share = counts[..split_bin].iter().sum::<u64>() as f64 / total as f64;
        let background = statistics.percentile(share * 0.5).min(split - 0.5 * width);
        let high = statistics.percentile(share + (1.0 - share) * 0.995).max(split + width);
        Self { background, split, high }
    }

    /// The value at position `t` of the scale: -1 = background, 0 = split, 1 = high.
    pub fn at(&self, t: f64) -> f64 {
        if t < 0.0 { self.split + t * (self.split - self.background) } else { self.split + t * (self.high - self.split) }
    }
}
