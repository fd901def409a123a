//! How often values occur together with sizes of the gradient: where boundaries between materials are.

use super::with_voxels;
use crate::{Error, Progress, Result, Volume};
use glam::DVec3;
use rayon::prelude::*;
use std::fmt::Write;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bins along each axis of a [`JointHistogram`].
pub const JOINT_BINS: usize = 256;

/// Counts of voxels by value and by the size of the gradient.
///
/// The gradient at a voxel is that of [`Volume::gradient`]: half the difference of its two neighbours along each axis, those outside clamped to the
/// edge, per world unit, in f64, through axes that are oblique or of unequal spacing. Where a neighbour is NaN or infinite, it counts as 0.
///
/// # Guarantees
/// The counts add up to the number of voxels that are neither NaN nor infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct JointHistogram {
    values: [f64; 2],
    greatest: f64,
    counts: Vec<u64>,
}

/// A bin with voxels in it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct JointBin {
    /// Values from here to there, data units.
    pub value: [f64; 2],
    /// Sizes of the gradient from here to there, data units per world unit.
    pub gradient: [f64; 2],
    /// Voxels.
    pub count: u64,
}

/// What `position` of the way from `lo` to `hi` is.
fn between(lo: f64, hi: f64, position: f64) -> f64 {
    lo * (1.0 - position) + hi * position
}

/// The bin of something at `part` of the range. A range without extent gives NaN, which `as` turns into bin 0.
fn bin(part: f64) -> usize {
    ((part * JOINT_BINS as f64) as usize).min(JOINT_BINS - 1)
}

impl JointHistogram {
    /// Counts all voxels of `volume`, and tells `progress` how far it is.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a volume of colours, [`Error::Stopped`] when `progress` wants so.
    pub fn of(volume: &Volume, progress: Option<&dyn Progress>) -> Result<Self> {
        if volume.scalars().is_none() {
            return Err(Error::invalid("a joint histogram counts one number a voxel: this volume holds colours"));
        }
        let statistics = volume.statistics();
        let (min, max) = (statistics.min, statistics.max);
        let count = volume.grid().dims()[2];
        let done = AtomicU64::new(0);
        let slice_done = || {
            let n = done.fetch_add(1, Ordering::Relaxed) + 1;
            let goes_on = progress.is_none_or(|p| p.step("joint histogram", n, 2 * count as u64) && !p.is_stopped());
            if goes_on { Ok(()) } else { Err(Error::Stopped) }
        };
        // Few and large tasks, as each has counts of its own.
        let tasks: Vec<Range<usize>> = {
            let each = count.div_ceil(32).max(1);
            (0..count).step_by(each).map(|k| k..(k + each).min(count)).collect()
        };
        let greatest = |range: Range<usize>| {
            range.map(|k| {
                let mut most = 0.0f64;
                in_slice(volume, k, &mut |_, gradient| most = most.max(gradient));
                slice_done().map(|()| most)
            })
        };
        let per_task: Vec<f64> =
            tasks.par_iter().map(|range| greatest(range.clone()).try_fold(0.0, |a, b| Ok(f64::max(a, b?)))).collect::<Result<_>>()?;
        let greatest = per_task.into_iter().fold(0.0, f64::max);
        let counts = tasks
            .par_iter()
            .map(|range| {
                let mut counts = vec![0u64; JOINT_BINS * JOINT_BINS];
                for k in range.clone() {
                    in_slice(volume, k, &mut |value, gradient| {
                        let column = bin((0.5 * value - 0.5 * min) / (0.5 * max - 0.5 * min));
                        counts[bin(gradient / greatest) * JOINT_BINS + column] += 1;
                    });
                    slice_done()?;
                }
                Ok(counts)
            })
            .try_reduce(
                || vec![0; JOINT_BINS * JOINT_BINS],
                |mut a, b| {
                    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                    Ok(a)
                },
            )?;
        Ok(Self { values: [min, max], greatest, counts })
    }

    /// Smallest and largest value, data units.
    pub fn values(&self) -> [f64; 2] {
        self.values
    }

    /// The greatest size of the gradient, data units per world unit.
    pub fn greatest_gradient(&self) -> f64 {
        self.greatest
    }

    /// Voxels whose value lies in bin `column` of [`JOINT_BINS`] equal ones over the values and whose gradient in bin `row` of those from 0 to the
    /// greatest.
    ///
    /// # Panics
    /// When one of them is not below [`JOINT_BINS`].
    pub fn count(&self, column: usize, row: usize) -> u64 {
        assert!(column < JOINT_BINS && row < JOINT_BINS, "bin {column},{row} of {JOINT_BINS} x {JOINT_BINS}");
        self.counts[row * JOINT_BINS + column]
    }

    /// All voxels counted.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The bins that are not empty, values rising, gradients after each other.
    pub fn bins(&self) -> impl Iterator<Item = JointBin> + '_ {
        let part = |i: usize| i as f64 / JOINT_BINS as f64;
        let [lo, hi] = self.values;
        let full = self.counts.iter().enumerate().filter(|c| *c.1 > 0);
        full.map(move |(i, &count)| {
            let (row, column) = (i / JOINT_BINS, i % JOINT_BINS);
            JointBin {
                value: [between(lo, hi, part(column)), between(lo, hi, part(column + 1))],
                gradient: [self.greatest * part(row), self.greatest * part(row + 1)],
                count,
            }
        })
    }

    /// The bins that are not empty as a table: a line of names, then a line a bin.
    pub fn csv(&self) -> String {
        let mut text = String::from("value_low,value_high,gradient_low,gradient_high,count\n");
        for JointBin { value: [a, b], gradient: [c, d], count } in self.bins() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{a:?},{b:?},{c:?},{d:?},{count}");
        }
        text
    }
}

/// Tells `each` the value and the size of the gradient of every finite voxel of slice `k`.
fn in_slice(volume: &Volume, k: usize, each: &mut impl FnMut(f64, f64)) {
    let [nx, ny, nz] = volume.grid().dims();
    let (slope, intercept) = volume.rescale();
    let to_world = volume.grid().world_to_index().matrix3.transpose();
    with_voxels!(volume.voxels(), voxels => {
        let row = |j: usize, k: usize| &voxels[(k * ny + j) * nx..][..nx];
        let value = |x| slope * crate::lanes::Number::to_f64(x) + intercept;
        for j in 0..ny {
            let (this, before, behind) = (row(j, k), row(j.saturating_sub(1), k), row((j + 1).min(ny - 1), k));
            let (below, above) = (row(j, k.saturating_sub(1)), row(j, (k + 1).min(nz - 1)));
            for i in 0..nx {
                let v = value(this[i]);
                if !v.is_finite() {
                    continue;
                }
                // Halves first: the difference of two numbers may leave f64.
                let half = |high, low| 0.5 * value(high) - 0.5 * value(low);
                let along = DVec3::new(
                    half(this[(i + 1).min(nx - 1)], this[i.saturating_sub(1)]),
                    half(behind[i], before[i]),
                    half(above[i], below[i]),
                );
                each(v, length(to_world * along));
            }
        }
    });
}

/// The length of `g`, whose squares may leave f64; 0 where it is not finite.
fn length(g: DVec3) -> f64 {
    let most = g.abs().max_element();
    if most > 1e-100 && most < 1e100 {
        return g.length();
    }
    let scaled = if most > 0.0 && g.is_finite() { (g / most).length() * most } else { 0.0 };
    if scaled.is_finite() { scaled } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, Voxels};
    use glam::DMat3;

    /// Another way to the same counts: voxel by voxel, through the volume's own gradient.
    fn brute_force(volume: &Volume) -> (f64, Vec<u64>) {
        let [nx, ny, nz] = volume.grid().dims();
        let mut list = Vec::new();
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let v = volume.value([i, j, k]);
                    if v.is_finite() {
                        let g = volume.gradient(DVec3::new(i as f64, j as f64, k as f64)).length();
                        list.push((v, if g.is_finite() { g } else { 0.0 }));
                    }
                }
            }
        }
        let least = list.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        let most = list.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
        let steepest = list.iter().map(|p| p.1).fold(0.0, f64::max);
        let mut counts = vec![0; JOINT_BINS * JOINT_BINS];
        for (v, g) in list {
            let place = |t: f64| ((t * 256.0).floor() as usize).min(255);
            counts[place(g / steepest) * JOINT_BINS + place((v - least) / (most - least))] += 1;
        }
        (steepest, counts)
    }

    fn numbers(n: usize) -> impl Iterator<Item = u32> {
        (0..n as u32).map(|i| i.wrapping_mul(2_654_435_761) >> 20)
    }

    #[test]
    fn an_oblique_volume_is_counted_as_by_hand() {
        let steps = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(-0.2, 1.5, 0.3), DVec3::new(0.0, 0.4, -3.0));
        let grid = Grid::new([13, 9, 7], DVec3::new(1.0, 2.0, 3.0), steps).expect("grid");
        let voxels: Vec<i16> = numbers(13 * 9 * 7).map(|x| x as i16 - 1000).collect();
        let volume = Volume::new(grid, Voxels::I16(voxels.into())).and_then(|v| v.with_rescale(0.5, 3.0)).expect("volume");
        let joint = JointHistogram::of(&volume, None).expect("counts");
        let (steepest, counts) = brute_force(&volume);
        assert!((joint.greatest_gradient() / steepest - 1.0).abs() < 1e-12);
        assert_eq!(joint.total(), 13 * 9 * 7);
        // A gradient on the edge between two bins may round to either side.
        let apart: u64 = joint.counts.iter().zip(&counts).map(|(a, b)| a.abs_diff(*b)).sum();
        assert!(apart <= 2, "{apart} voxels in other bins");
        assert_eq!(joint.bins().map(|b| b.count).sum::<u64>(), joint.total());
        for bin in joint.bins() {
            assert!(bin.value[0] < bin.value[1] && bin.gradient[0] < bin.gradient[1] && bin.count > 0);
        }
        let csv = joint.csv();
        assert!(csv.starts_with("value_low,value_high,gradient_low,gradient_high,count\n"));
        assert_eq!(csv.lines().count(), 1 + joint.bins().count());
        let told: u64 = csv.lines().skip(1).map(|l| l.rsplit(',').next().expect("a count").parse::<u64>().expect("a number")).sum();
        assert_eq!(told, joint.total());
    }

    #[test]
    fn a_ramp_has_one_gradient() {
        let grid = Grid::with_spacing([64, 3, 2], [0.25, 1.0, 2.0]).expect("grid");
        let values: Vec<f32> = (0..64 * 6).map(|i| (i % 64) as f32 * 2.0).collect();
        let joint = Volume::new(grid, Voxels::F32(values.into())).and_then(|v| JointHistogram::of(&v, None)).expect("counts");
        // Two a voxel of a quarter: 8 a unit inside, half of that at both ends, where the neighbour is the voxel itself.
        assert_eq!((joint.greatest_gradient(), joint.values()), (8.0, [0.0, 126.0]));
        assert_eq!((0..JOINT_BINS).map(|c| joint.count(c, 255)).sum::<u64>(), 62 * 6);
        assert_eq!((joint.count(0, 128), joint.count(255, 128)), (6, 6));
    }

    #[test]
    fn numbers_that_are_not_finite_are_left_out_and_extreme_ones_counted() {
        let grid = |n| Grid::with_spacing([n, 1, 1], [1e-3, 1.0, 1.0]).expect("grid");
        let count = |values: Vec<f64>| {
            let n = values.len();
            Volume::new(grid(n), Voxels::F64(values.into())).and_then(|v| JointHistogram::of(&v, None)).expect("counts")
        };
        let joint = count(vec![0.0, f64::NAN, 1.0, 2.0, f64::INFINITY, 3.0]);
        assert_eq!((joint.total(), joint.greatest_gradient()), (4, 0.0));
        let joint = count(vec![-f64::MAX, f64::MAX, 0.0, 1e200]);
        assert_eq!(joint.total(), 4);
        assert_eq!(count(vec![7.0; 5]).count(0, 0), 5);
        assert_eq!(count(vec![f64::NAN; 5]).total(), 0);
    }

    #[test]
    fn it_stops_when_asked_to() {
        struct Stop;
        impl Progress for Stop {
            fn step(&self, _: &str, done: u64, total: u64) -> bool {
                assert!(done <= total);
                false
            }
        }
        let grid = Grid::with_spacing([2, 2, 50], [1.0; 3]).expect("grid");
        let volume = Volume::new(grid, Voxels::zeros(crate::volume::VoxelType::U8, 200)).expect("volume");
        assert!(matches!(JointHistogram::of(&volume, Some(&Stop)), Err(Error::Stopped)));
    }
}
