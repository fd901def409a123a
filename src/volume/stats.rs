//! Statistics of a volume's values: range, mean, histogram, and how many are NaN or infinite.

use super::voxels::{Voxel, Voxels};
use rayon::prelude::*;

/// Bins of [`Statistics::histogram`].
pub const HISTOGRAM_BINS: usize = 256;

/// Summary of a volume's values, in the data's units (rescaled). Voxels that are NaN or infinite are counted and otherwise left out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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

/// Voxels that one task adds up. A fixed number, so that the mean's rounding does not depend on the number of threads.
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
        match voxels {
            Voxels::U8(v) => of_counts(&counts(v, 1 << 8, usize::from), 0.0, slope, intercept),
            Voxels::I8(v) => of_counts(&counts(v, 1 << 8, |x| usize::from(x as u8 ^ 0x80)), -128.0, slope, intercept),
            Voxels::U16(v) => of_counts(&counts(v, 1 << 16, usize::from), 0.0, slope, intercept),
            Voxels::I16(v) => of_counts(&counts(v, 1 << 16, |x| usize::from(x as u16 ^ 0x8000)), -32768.0, slope, intercept),
            Voxels::U32(v) => of_slice(v, slope, intercept),
            Voxels::I32(v) => of_slice(v, slope, intercept),
            Voxels::F32(v) => of_slice(v, slope, intercept),
            Voxels::F64(v) => of_slice(v, slope, intercept),
        }
    }
}

/// How often each of `kinds` different numbers occurs among the voxels; `index` gives a number's place in the table. The statistics follow
/// from these counts, so one pass over the voxels is enough.
fn counts<T: Voxel>(voxels: &[T], kinds: usize, index: impl Fn(T) -> usize + Sync) -> Vec<u64> {
    // Each task has a table of its own, so there are few and large ones; of fewer than 2^32 voxels, so that 32 bits can count them.
    let chunk = voxels.len().div_ceil(64).clamp(1 << 18, 1 << 31);
    voxels
        .par_chunks(chunk)
        .map(|chunk| {
            // Two tables take turns: neighbours are often equal, and a count that was just written takes the processor a while to read again.
            let mut tables = vec![0u32; 2 * kinds];
            let (even, odd) = tables.split_at_mut(kinds);
            let pairs = chunk.chunks_exact(2);
            pairs.remainder().iter().for_each(|&x| even[index(x)] += 1);
            for pair in pairs {
                even[index(pair[0])] += 1;
                odd[index(pair[1])] += 1;
            }
            even.iter().zip(odd).map(|(a, b)| u64::from(*a) + u64::from(*b)).collect::<Vec<u64>>()
        })
        .reduce(|| vec![0; kinds], add)
}

fn add(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

/// Statistics of voxels among which the number `first` + i occurs `counts[i]` times.
fn of_counts(counts: &[u64], first: f64, slope: f64, intercept: f64) -> Statistics {
    let values = || counts.iter().enumerate().filter(|c| *c.1 > 0).map(|(i, &c)| ((first + i as f64) * slope + intercept, c));
    let finite = || values().filter(|v| v.0.is_finite());
    let (all, total) = (counts.iter().sum::<u64>(), finite().map(|v| v.1).sum::<u64>());
    let non_finite = (all - total) as usize;
    if total == 0 {
        return Statistics { min: 0.0, max: 0.0, mean: 0.0, non_finite, histogram: vec![0; HISTOGRAM_BINS] };
    }
    let min = finite().map(|v| v.0).fold(f64::INFINITY, f64::min);
    let max = finite().map(|v| v.0).fold(f64::NEG_INFINITY, f64::max);
    let mean = finite().map(|(v, c)| v * (c as f64 / total as f64)).sum();
    let scale = HISTOGRAM_BINS as f64 / (max - min);
    let mut histogram = vec![0; HISTOGRAM_BINS];
    finite().for_each(|(v, c)| histogram[bin(v, min, scale)] += c);
    Statistics { min, max, mean, non_finite, histogram }
}

/// The bin of value `v`, where `scale` is bins per unit. A single value gives inf * 0 = NaN, which `as` turns into bin 0.
fn bin(v: f64, min: f64, scale: f64) -> usize {
    (((v - min) * scale) as usize).min(HISTOGRAM_BINS - 1)
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
    // Each chunk's sum is divided before they are added: the sum of 1e7 voxels of 1e308 would be infinite, their mean is not.
    let mean = partial.iter().map(|p| p.2 / count as f64).sum();
    let scale = HISTOGRAM_BINS as f64 / (max - min);
    let histogram = voxels
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut bins = vec![0u64; HISTOGRAM_BINS];
            for &x in chunk {
                let v = x.to_f64() * slope + intercept;
                if v.is_finite() {
                    bins[bin(v, min, scale)] += 1;
                }
            }
            bins
        })
        .reduce(|| vec![0; HISTOGRAM_BINS], add);
    Statistics { min, max, mean, non_finite, histogram }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counting_tells_the_same_as_looking_at_every_voxel() {
        let numbers: Vec<i64> = (0..700_001).map(|i: i64| (i * 2_654_435_761) >> 9).collect();
        let same = |counted: Statistics, looked: Statistics| {
            assert!((counted.mean - looked.mean).abs() <= 1e-9 * looked.max.abs().max(looked.min.abs()), "{counted:?} {looked:?}");
            assert_eq!(Statistics { mean: 0.0, ..counted }, Statistics { mean: 0.0, ..looked });
        };
        for (slope, intercept) in [(1.0, 0.0), (-0.37, 12.0)] {
            macro_rules! check {
                ($t:ty) => {
                    let voxels: Vec<$t> = numbers.iter().map(|&n| n as $t).collect();
                    same(Statistics::of(&voxels.clone().into(), slope, intercept), of_slice(&voxels, slope, intercept));
                };
            }
            check!(u8);
            check!(i8);
            check!(u16);
            check!(i16);
        }
        let one = Statistics::of(&vec![7u16; 5].into(), 1.0, 0.5);
        assert_eq!((one.min, one.max, one.mean, one.histogram[0]), (7.5, 7.5, 7.5, 5));
        // Values that become infinite when rescaled are not counted as values.
        let far = Statistics::of(&vec![1u16, 3, 60_000].into(), 1e304, 0.0);
        assert_eq!((far.non_finite, far.min, far.max), (1, 1e304, 3e304));
        assert!((far.mean / 2e304 - 1.0).abs() < 1e-12);
    }
}
