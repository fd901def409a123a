//! Error asked for: each block of the picture gets the slices it needs for the RMS error of the colours to stay below a tolerance.
//!
//! An adaptive solver of differential equations tries a coarse and a finer step and refines where the two differ. Here the step is
//! the thickness of the slabs, and the places are blocks of 8 x 8 pixels: all are rendered at two slice counts, and those whose
//! difference weighs most are rendered at twice the count, until what is left is small enough. Blocks lie on the picture's own
//! grid and sums run in its order, so the outcome does not depend on threads or tiles.

use crate::Result;
use crate::raster::BlockMask;

/// Fewest slices a block starts from.
const FIRST: u64 = 32;
/// Most slices a block starts from.
const FIRST_MOST: u64 = 1024;
/// Smallest voxel spacings to a slab at the start: features of a voxel's size must not fall between the slices of both counts.
const SPACINGS: f64 = 2.0;
/// Slices beyond which no block is refined.
const MOST: u64 = 1 << 16;
/// Part of the tolerance aimed at: a difference of two pictures is an estimate of an error, not a bound.
const AIM: f64 = 0.9;
/// Squared error over the squared difference of the first two pictures, for methods of second order and more: on real data the
/// first halving of slabs gains less than it will later.
pub(super) const FIRST_FACTOR: f64 = 0.35;
/// Levels a block may gain nothing from before it is left as it is: rounding and tables end every series.
const PATIENCE: u8 = 2;
/// The level from which this counts: before it, slabs may be too thick to see what they cut.
const RESOLVED: u32 = 6;
/// Rounds after which another method is tried: at once, and when refining has not helped.
const TRIALS: [u32; 3] = [0, 2, 3];
/// One block in this many tries another method.
const TRIED: usize = 16;
/// How much smaller the differences of another method must be, for all that was rendered to be rendered again: its slabs cost twice as much
/// and more, which buys others a third to a quarter of their error, and the first pictures are lost.
const GAIN: f64 = 4.0;
/// Part of the tolerance that ending pixels early may use up.
const TERMINATE: f64 = 0.25;

/// What was reached.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reached {
    /// Estimated RMS error of red, green and blue over the whole picture.
    pub(crate) error: f64,
    /// Blocks by slice count: (slices, blocks), fewest slices first.
    pub(crate) levels: Vec<(u64, usize)>,
}

/// The slice count to start from for a box `depth` deep with voxels `spacing` apart.
pub(crate) fn first_count(depth: f64, spacing: f64) -> u64 {
    (libm::ceil(depth / (SPACINGS * spacing)) as u64).clamp(FIRST, FIRST_MOST)
}

/// Sum of squared errors aimed at, over the red, green and blue of so many pixels.
pub(super) fn target(tolerance: f64, pixels: usize) -> f64 {
    (AIM * tolerance) * (AIM * tolerance) * 3.0 * pixels as f64
}

/// The transmittance at which pixels may end for a tolerance.
pub(crate) fn terminate(scene: f32, tolerance: f64) -> f32 {
    scene.min((TERMINATE * tolerance) as f32)
}

/// Whether block `b` is among those, spread over the picture, that try another method.
fn is_tried(mask: &BlockMask, b: usize) -> bool {
    let (x, y) = mask.column_and_row(b);
    // Every row of blocks has some, and no column is left out.
    (x + 5 * y) % TRIED == 0
}

/// Whether differences `others` of another method are so small beside `ours` that it is worth beginning again with it.
pub(crate) fn better(ours: f64, others: f64) -> bool {
    ours > GAIN * GAIN * others
}

/// Renders `pixels`, a picture `width` pixels wide, to `tolerance`. `render(count, blocks, pixels)` fills in blocks of the picture
/// in `count` slices, all of them without a mask. `first_order` tells of methods whose error falls with the slices' number only.
///
/// When pictures leave too large an error, `other(count, blocks, difference)` is asked whether to give up for another method: then
/// nothing is returned. It hears of some blocks, their slices and their sum of squared differences to half as many.
pub(crate) fn refine(
    tolerance: f64,
    (first, first_order): (u64, bool),
    width: usize,
    pixels: &mut [[f32; 4]],
    mut render: impl FnMut(u64, Option<&BlockMask>, &mut [[f32; 4]]) -> Result<()>,
    mut other: impl FnMut(u64, &BlockMask, f64) -> Result<bool>,
) -> Result<Option<Reached>> {
    let mask = BlockMask::none(width, pixels.len() / width);
    let target = target(tolerance, pixels.len());
    let mut coarse = pixels.to_vec();
    render(first, None, &mut coarse)?;
    render(2 * first, None, pixels)?;
    let mut blocks = Blocks {
        level: vec![1; mask.len()],
        difference: differences(&coarse, pixels, &mask),
        most_order: if first_order { 1.0 } else { MOST_ORDER },
        stalled: vec![0; mask.len()],
        factor: vec![1.0, if first_order { 1.0 } else { FIRST_FACTOR }],
    };
    let mut round = 0;
    loop {
        let error: f64 = (0..mask.len()).map(|b| blocks.error(b)).sum();
        let chosen = if error <= target { Vec::new() } else { blocks.choose(target, |level| first << (level + 1) <= MOST) };
        if chosen.is_empty() {
            let rms = (error / (3 * pixels.len()) as f64).sqrt();
            return Ok(Some(Reached { error: rms, levels: blocks.levels(first) }));
        }
        if TRIALS.contains(&round) {
            // Only blocks that have come as far as any are worth a comparison.
            let highest = chosen.iter().map(|&b| blocks.level[b]).max().unwrap_or(0);
            let mut some = mask.clone();
            let among: Vec<usize> = (0..mask.len()).filter(|&b| blocks.level[b] == highest && is_tried(&mask, b)).collect();
            among.iter().for_each(|&b| some.set(b));
            let difference: f64 = among.iter().map(|&b| blocks.difference[b]).sum();
            if difference > 0.0 && other(first << highest, &some, difference)? {
                return Ok(None);
            }
        }
        round += 1;
        coarse.copy_from_slice(pixels);
        let highest = chosen.iter().map(|&b| blocks.level[b]).max().unwrap_or(0);
        for level in 1..=highest {
            let group: Vec<usize> = chosen.iter().copied().filter(|&b| blocks.level[b] == level).collect();
            if group.is_empty() {
                continue;
            }
            let mut wanted = mask.clone();
            group.iter().for_each(|&b| wanted.set(b));
            render(first << (level + 1), Some(&wanted), pixels)?;
            blocks.advance(&group, level, &differences(&coarse, pixels, &wanted));
        }
    }
}

/// Order of a method of second order and more, a little less.
const MOST_ORDER: f64 = 1.9;

/// Squared error over squared difference, where doubling the slices has brought sums of squared differences from `before` to `after`.
fn factor_after(before: f64, after: f64, most_order: f64) -> f64 {
    // They fall by 4^p from level to level.
    let order = (0.5 * libm::log2(before / after.max(1e-300))).clamp(1.0, most_order);
    let step = libm::exp2(order) - 1.0;
    1.0 / (step * step)
}

/// As [`factor_after`], for methods of second order.
pub(super) fn next_factor(before: f64, after: f64) -> f64 {
    factor_after(before, after, MOST_ORDER)
}

/// How far each block has come.
struct Blocks {
    /// Block b is rendered in first << level[b] slices.
    level: Vec<u32>,
    /// Sum of squared differences to the level before.
    difference: Vec<f64>,
    /// The order that a method can have at most, a little less.
    most_order: f64,
    /// Levels in a row that a block gained nothing from.
    stalled: Vec<u8>,
    /// Squared error at a level over the squared difference to the level before.
    factor: Vec<f64>,
}

impl Blocks {
    /// Estimated sum of squared errors of block `b`.
    fn error(&self, b: usize) -> f64 {
        self.difference[b] * self.factor[self.level[b] as usize]
    }

    /// The fewest blocks whose refinement is expected to bring the sum below `target`, worst first.
    fn choose(&self, target: f64, refinable: impl Fn(u32) -> bool) -> Vec<usize> {
        let mut order: Vec<usize> =
            (0..self.level.len()).filter(|&b| refinable(self.level[b]) && self.stalled[b] < PATIENCE && self.error(b) > 0.0).collect();
        order.sort_by(|&a, &b| self.error(b).total_cmp(&self.error(a)).then(a.cmp(&b)));
        let total: f64 = (0..self.level.len()).map(|b| self.error(b)).sum();
        let mut left = total;
        for (n, &b) in order.iter().enumerate() {
            // Half the slab, a quarter of the squared error at least.
            left -= 0.75 * self.error(b);
            if left <= target {
                order.truncate(n + 1);
                return order;
            }
        }
        // One step will not do: refine whatever matters.
        let mut left = total;
        let matters = order.iter().take_while(|&&b| {
            let before = left;
            left -= self.error(b);
            before > 0.01 * total
        });
        let matters = matters.count();
        order.truncate(matters);
        order
    }

    /// Takes blocks of `group` from `level` to the next, with their differences; learns the method's order from them.
    fn advance(&mut self, group: &[usize], level: u32, differences: &[f64]) {
        let before: f64 = group.iter().map(|&b| self.difference[b]).sum();
        let after: f64 = group.iter().map(|&b| differences[b]).sum();
        let factor = factor_after(before, after, self.most_order);
        let next = level as usize + 1;
        if self.factor.len() <= next {
            self.factor.resize(next + 1, 1.0);
            self.factor[next] = factor;
        }
        for &b in group {
            self.level[b] = level + 1;
            // A halving of slabs that brings hardly anything is rounding.
            let gained = level < RESOLVED || differences[b] < 0.7 * self.difference[b];
            self.stalled[b] = if gained { 0 } else { self.stalled[b] + 1 };
            self.difference[b] = differences[b];
        }
    }

    fn levels(&self, first: u64) -> Vec<(u64, usize)> {
        let highest = self.level.iter().copied().max().unwrap_or(0);
        let count = |level: u32| self.level.iter().filter(|&&l| l == level).count();
        (0..=highest).map(|l| (first << l, count(l))).filter(|&(_, n)| n > 0).collect()
    }
}

/// Squared difference of red, green and blue.
pub(super) fn squared_difference(a: &[f32; 4], b: &[f32; 4]) -> f64 {
    (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).map(|d| d * d).sum()
}

/// Sums of squared differences of red, green and blue, block by block.
pub(crate) fn differences(a: &[[f32; 4]], b: &[[f32; 4]], mask: &BlockMask) -> Vec<f64> {
    let mut sums = vec![0.0; mask.len()];
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        if a != b {
            sums[mask.block_of_pixel(i)] += squared_difference(a, b);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 64 blocks whose errors are weight(block) * N^-order.
    fn run(tolerance: f64, order: f64, weight: impl Fn(usize) -> f64) -> (f64, Reached, u64) {
        let mask = BlockMask::none(64, 64);
        let mut pixels = vec![[0.0; 4]; 64 * 64];
        let mut work = 0;
        let render = |count: u64, blocks: Option<&BlockMask>, pixels: &mut [[f32; 4]]| {
            for (i, p) in pixels.iter_mut().enumerate() {
                let b = mask.block_of_pixel(i);
                if blocks.is_none_or(|m| m.takes(i % 64 / 8, i / 64 / 8)) {
                    work += count;
                    *p = [(0.5 + weight(b) * libm::pow(count as f64, -order)) as f32; 4];
                }
            }
            Ok(())
        };
        let reached = refine(tolerance, (32, false), 64, &mut pixels, render, |_, _, _| Ok(false)).unwrap().unwrap();
        let sum: f64 = pixels.iter().map(|p| (f64::from(p[0]) - 0.5) * (f64::from(p[0]) - 0.5)).sum();
        ((sum / pixels.len() as f64).sqrt(), reached, work / 64 / 64)
    }

    #[test]
    fn errors_end_below_the_tolerance_and_not_far_below() {
        for order in [1.0, 1.5, 2.0] {
            for tolerance in [1e-3, 1e-4] {
                let (error, reached, _) = run(tolerance, order, |_| 1.0);
                assert!(error <= tolerance, "order {order}: {error} > {tolerance}");
                assert!(
                    error > tolerance / 10.0 || reached.levels == [(64, 64)],
                    "order {order}: {error} of {tolerance}, {:?}",
                    reached.levels
                );
                assert!(reached.error <= tolerance);
            }
        }
    }

    #[test]
    fn work_goes_where_the_error_is() {
        let (error, reached, work) = run(1e-4, 1.0, |b| if b == 20 { 1.0 } else { 1e-3 });
        assert!(error <= 1e-4);
        assert_eq!(reached.levels[0], (64, 63), "{:?}", reached.levels);
        // Uniform slices would take over a thousand a pixel.
        assert!(work < 200, "{work} slices a pixel");
    }

    #[test]
    fn a_tolerance_out_of_reach_is_told() {
        let mask = BlockMask::none(8, 8);
        assert_eq!(mask.len(), 1);
        let mut pixels = vec![[0.0; 4]; 64];
        let mut most = 0;
        let render = |n: u64, _: Option<&BlockMask>, p: &mut [[f32; 4]]| {
            most = n;
            p.fill([if n.trailing_zeros() % 2 == 0 { 0.1 } else { 0.2 }; 4]);
            Ok(())
        };
        let reached = refine(1e-3, (32, false), 8, &mut pixels, render, |_, _, _| Ok(false)).unwrap().unwrap();
        assert!(reached.error > 1e-3);
        assert!(most <= 32 << 8, "a block that gains nothing is left after {most} slices");
    }
    #[test]
    fn blocks_that_try_a_method_are_spread() {
        for (width, height) in [(512, 512), (100, 300), (640, 8)] {
            let mask = BlockMask::none(width, height);
            let count = (0..mask.len()).filter(|&b| is_tried(&mask, b)).count();
            assert!(count * 20 >= mask.len() && count * 13 <= mask.len(), "{count} of {}", mask.len());
        }
    }
}
