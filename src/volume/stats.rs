//! What the values of a volume are: range, mean, histogram, and the numbers that are none.

use super::voxels::{Voxel, Voxels, with_voxels};
use rayon::prelude::*;

/// Bins of [`Statistics::histogram`].
pub const HISTOGRAM_BINS: usize = 256;

/// Summary of a volume's values, in the data's units (rescaled), non-finite voxels left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Smallest finite value; 0 when there is none.
    pub min: f64,
    /// Largest finite value; 0 when there is none.
    pub max: f64,
    /// Mean of the finite values.
    pub mean: f64,
    /// Voxels that are NaN or infinite.
    pub non_finite: usize,
    /// Counts in [`HISTOGRAM_BINS`] equal bins from `min` to `max`.
    pub histogram: Vec<u64>,
}

/// Voxels summed by one task. Fixed, so that the mean's rounding does not depend on the number of threads.
const CHUNK: usize = 1 << 16;

impl Statistics {
    /// The value below which `fraction` of the finite voxels lie, to the width of a histogram bin.
    pub fn percentile(&self, fraction: f64) -> f64 {
        let total: u64 = self.histogram.iter().sum();
        let want = fraction.clamp(0.0, 1.0) * total as f64;
        let width = (self.max - self.min) / HISTOGRAM_BINS as f64;
        let mut below = 0.0;
        for (bin, &count) in self.histogram.iter().enumerate() {
            let next = below + count as f64;
            if next >= want && count > 0 {
                return self.min + width * (bin as f64 + (want - below) / count as f64);
            }
            below = next;
        }
        self.max
    }

    pub(super) fn of(voxels: &Voxels, slope: f64, intercept: f64) -> Self {
        with_voxels!(voxels, v => of_slice(v, slope, intercept))
    }
}

fn of_slice<T: Voxel>(voxels: &[T], slope: f64, intercept: f64) -> Statistics {
    let partial: Vec<(f64, f64, f64, usize)> = voxels
        .par_chunks(CHUNK)
        .map(|chunk| {
            let (mut min, mut max, mut sum, mut bad) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0);
            for &x in chunk {
                let v = x.to_f64() * slope + intercept;
                if v.is_finite() {
                    min = min.min(v);
                    max = max.max(v);
                    sum += v;
                } else {
                    bad += 1;
                }
            }
            (min, max, sum, bad)
        })
        .collect();
    let min = partial.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
    let max = partial.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
    let non_finite: usize = partial.iter().map(|p| p.3).sum();
    let count = voxels.len() - non_finite;
    if count == 0 {
        return Statistics { min: 0.0, max: 0.0, mean: 0.0, non_finite, histogram: vec![0; HISTOGRAM_BINS] };
    }
    // Each chunk's sum is divided first: 1e7 voxels of 1e308 have a mean.
    let mean = partial.iter().map(|p| p.2 / count as f64).sum();
    let scale = HISTOGRAM_BINS as f64 / (max - min);
    let histogram = voxels
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut bins = vec![0u64; HISTOGRAM_BINS];
            for &x in chunk {
                let v = x.to_f64() * slope + intercept;
                if v.is_finite() {
                    // A single value gives inf * 0 = NaN, which `as` turns into bin 0.
                    bins[(((v - min) * scale) as usize).min(HISTOGRAM_BINS - 1)] += 1;
                }
            }
            bins
        })
        .reduce(
            || vec![0; HISTOGRAM_BINS],
            |mut a, b| {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                a
            },
        );
    Statistics { min, max, mean, non_finite, histogram }
}
