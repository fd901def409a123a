//! Looking at some of a picture's blocks before all of it is rendered: how many slices an error asked for takes.
//!
//! A sample of the blocks is rendered at several slice counts, and the finest of these pictures stands for the truth. Errors are uneven: a
//! few blocks hold much of them. So what counts is not the sample's mean but a bound on the picture's sum, the mean and two standard
//! errors; where a sample that small says too little, nothing is decided here.

use super::refine::{FIRST_FACTOR, next_factor, squared_difference, target};
use crate::Result;
use crate::lanes::{BATCH, SIDE};
use crate::raster::BlockMask;

/// One block in this many is looked at.
const SAMPLED: usize = 8;
/// Fewest blocks of a sample that differ at all.
const FEWEST: usize = 48;
/// Fewest slices, and the least share of the first count: thicker slabs are hit and miss.
const LEAST: (u64, u64) = (16, 4);
/// How often the first count may be doubled for the truth.
const MOST: u64 = 32;
/// Share of the finest count up to which its pictures can tell a count from another.
const TOLD: f64 = 0.75;
/// Sum of squares in units of the sample's own above which it says too little.
const UNSURE: f64 = 6.0;

/// What a look at some blocks tells.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Sampled {
    /// So many slices do, leaving this RMS error.
    Count(u64, f64),
    /// Another method does better.
    Other,
    /// Nothing certain.
    Unsure,
}

/// Whether block `b` is looked at.
fn is_sampled(mask: &BlockMask, b: usize) -> bool {
    let (x, y) = mask.column_and_row(b);
    (x + 3 * y) % SAMPLED == 0
}

/// The fewest slices with which a picture of `width` x `height` pixels keeps `tolerance`.
///
/// `render(count, blocks, pixels)` fills in blocks of `scratch` in `count` slices, `first` of them at first. `first_order`, and
/// `other(count, blocks, difference)`, which is asked once it takes many, are as for [`super::refine::refine`].
pub(crate) fn sample(
    tolerance: f64,
    (first, first_order): (u64, bool),
    (width, height): (usize, usize),
    scratch: &mut [[f32; 4]],
    mut render: impl FnMut(u64, &BlockMask, &mut [[f32; 4]]) -> Result<()>,
    mut other: impl FnMut(u64, &BlockMask, f64) -> Result<bool>,
) -> Result<Sampled> {
    let mut mask = BlockMask::none(width, height);
    let blocks: Vec<usize> = (0..mask.len()).filter(|&b| is_sampled(&mask, b)).collect();
    if blocks.len() < FEWEST {
        return Ok(Sampled::Unsure);
    }
    blocks.iter().for_each(|&b| mask.set(b));
    let target = target(tolerance, width * height);
    let rms = |sum: f64| (sum / (3 * width * height) as f64).sqrt();
    let mut made: Vec<(u64, Vec<[f32; 4]>)> = Vec::new();
    let mut make = |count: u64| -> Result<(u64, Vec<[f32; 4]>)> {
        render(count, &mask, scratch)?;
        Ok((count, gathered(scratch, (width, height), &mask, &blocks)))
    };
    made.push(make(first)?);
    made.push(make(2 * first)?);
    loop {
        let Some(((finest, truth), coarser)) = made.split_last() else { return Ok(Sampled::Unsure) };
        let (mut sums, mut last) = (Vec::new(), Vec::new());
        for (count, pixels) in coarser {
            let each = differences(pixels, truth);
            match bound(&each, mask.len()) {
                Some(bound) => sums.push((*count, bound)),
                None => return Ok(Sampled::Unsure),
            }
            last = each;
        }
        let sampled = last.iter().sum::<f64>();
        // What the finest of them is off itself, in squares.
        let difference = sums[sums.len() - 1].1;
        let factor = match coarser {
            [.., (c, before), (b, after)] if !first_order && 2 * c == *b => {
                next_factor(differences(before, after).iter().sum(), sampled).min(FIRST_FACTOR)
            }
            _ if first_order => 1.0,
            _ => FIRST_FACTOR,
        };
        let off = factor * difference;
        // Errors of a smooth series have one sign, so that differences leave out what both have.
        for sum in &mut sums {
            let rms = sum.1.sqrt() + off.sqrt();
            sum.1 = rms * rms;
        }
        let (coarsest, sum) = sums[0];
        if sum <= target {
            let less = coarsest / 2;
            if less < LEAST.0.max(first / LEAST.1) {
                return Ok(Sampled::Count(coarsest, rms(sum)));
            }
            made.insert(0, make(less)?);
            continue;
        }
        sums.push((*finest, off));
        if let Some(pair) = sums.windows(2).find(|pair| pair[1].1 <= target) {
            let ((a, above), (b, under)) = (pair[0], pair[1]);
            // Sums of squares fall by a power of the count.
            let t = libm::log(above / target) / libm::log(above / under.max(1e-3 * target));
            let count = libm::ceil(a as f64 * libm::pow(b as f64 / a as f64, t.min(1.0)));
            if count <= TOLD * *finest as f64 {
                return Ok(Sampled::Count(count as u64, rms(target)));
            }
        }
        let next = 2 * finest;
        if next > MOST * first {
            return Ok(Sampled::Unsure);
        }
        // Where this many slices do not reach the error, another method may.
        if next == 8 * first && other(*finest, &mask, sampled)? {
            return Ok(Sampled::Other);
        }
        made.push(make(next)?);
    }
}

/// A bound on the sum over `all` blocks from those of a sample; nothing where the sample says too little.
fn bound(sample: &[f64], all: usize) -> Option<f64> {
    let (count, sum) = (sample.len() as f64, sample.iter().sum::<f64>());
    let mean = sum / count;
    let variance = sample.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    // Of a sample without repetition, from so many.
    let left = 1.0 - count / all as f64;
    let bound = sum + 2.0 * (count * variance * left).sqrt();
    let some = sample.iter().filter(|&&x| x > 0.0).count();
    (some >= FEWEST && bound <= UNSURE * sum).then_some(bound * all as f64 / count)
}

/// The pixels of some blocks, one block after the other; black where a block leaves the picture.
fn gathered(pixels: &[[f32; 4]], (width, height): (usize, usize), mask: &BlockMask, blocks: &[usize]) -> Vec<[f32; 4]> {
    let mut all = vec![[0.0; 4]; blocks.len() * BATCH];
    for (to, &block) in all.chunks_exact_mut(BATCH).zip(blocks) {
        let (bx, by) = mask.column_and_row(block);
        let (x, end) = (bx * SIDE, ((bx + 1) * SIDE).min(width));
        for (to, y) in to.chunks_exact_mut(SIDE).zip(by * SIDE..height) {
            to[..end - x].copy_from_slice(&pixels[y * width + x..y * width + end]);
        }
    }
    all
}

/// Sums of squared differences of red, green and blue, block by block of those gathered.
fn differences(a: &[[f32; 4]], b: &[[f32; 4]]) -> Vec<f64> {
    let block = |(a, b): (&[[f32; 4]], &[[f32; 4]])| a.iter().zip(b).map(|(a, b)| squared_difference(a, b)).sum();
    a.chunks(BATCH).zip(b.chunks(BATCH)).map(block).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (256, 256);

    /// A sample of a picture whose errors are weight(block) * N^-2; and the slices that it takes, per pixel.
    fn run(tolerance: f64, weight: impl Fn(usize) -> f64) -> (Sampled, f64) {
        let mask = BlockMask::none(SIZE.0, SIZE.1);
        let mut scratch = vec![[0.0; 4]; SIZE.0 * SIZE.1];
        let mut work = 0;
        let render = |count: u64, blocks: &BlockMask, pixels: &mut [[f32; 4]]| {
            for (i, p) in pixels.iter_mut().enumerate() {
                if blocks.takes(i % SIZE.0 / SIDE, i / SIZE.0 / SIDE) {
                    work += count;
                    let error = weight(mask.block_of_pixel(i)) / (count * count) as f64;
                    // Uneven within a block, so that blocks differ.
                    *p = [(0.5 + error * (1.0 + (i % 7) as f64 / 7.0)) as f32; 4];
                }
            }
            Ok(())
        };
        let found = sample(tolerance, (64, false), SIZE, &mut scratch, render, |_, _, _| Ok(false)).unwrap();
        (found, work as f64 / scratch.len() as f64)
    }

    #[test]
    fn enough_slices_are_found_and_not_many_more() {
        // An error of about 1.45 / N^2 times the weight.
        for (weight, tolerance) in [(30.0, 1e-2), (30.0, 1e-3), (30.0, 1e-4), (300.0, 1e-3)] {
            let (found, work) = run(tolerance, |b| weight * (1.0 + (b % 3) as f64));
            let Sampled::Count(count, error) = found else { panic!("{weight} {tolerance}: {found:?}") };
            let rms = |n: f64| weight * (14.0f64 / 3.0).sqrt() * 1.45 / (n * n);
            let best = (rms(1.0) / tolerance).sqrt().max(16.0);
            let got = count as f64;
            assert!(rms(got) <= tolerance && error <= tolerance, "{weight} {tolerance}: {count} slices leave {:.2e}", rms(got));
            assert!(got <= 1.4 * best, "{weight} {tolerance}: {count} slices, {best:.0} would do");
            assert!(work <= 60.0 + 0.9 * best, "{weight} {tolerance}: looking takes {work:.0} slices a pixel, the picture {count}");
        }
    }

    #[test]
    fn a_sample_that_says_too_little_decides_nothing() {
        // Nearly all of the error in one block; hardly any block that differs; a picture of a few blocks.
        assert_eq!(run(1e-4, |b| if b == 0 { 1e5 } else { 1.0 }).0, Sampled::Unsure);
        assert_eq!(run(1e-4, |b| if b < 100 { 30.0 } else { 0.0 }).0, Sampled::Unsure);
        let mut few = vec![[0.0; 4]; 64 * 64];
        let none = |_: u64, _: &BlockMask, _: &mut [[f32; 4]]| panic!("nothing to look at");
        assert_eq!(sample(1e-3, (64, false), (64, 64), &mut few, none, |_, _, _| Ok(false)).unwrap(), Sampled::Unsure);
    }

    #[test]
    fn the_bound_lies_above_what_is_bounded() {
        // Errors of blocks that differ a hundredfold, in many orders.
        let all: Vec<f64> = (0..1024u64).map(|i| 0.01 + ((i * 7919) % 1024) as f64 / 1024.0).collect();
        let sum: f64 = all.iter().sum();
        let mut above = 0;
        for start in 0..SAMPLED {
            let sample: Vec<f64> = all.iter().copied().skip(start).step_by(SAMPLED).collect();
            above += usize::from(bound(&sample, all.len()).unwrap() >= sum);
        }
        assert!(above >= SAMPLED - 1, "{above} of {SAMPLED}");
        assert_eq!(bound(&[0.0; 100], 800), None);
    }

    #[test]
    fn blocks_are_gathered_whole_and_at_the_edges() {
        let (width, height) = (20, 13);
        let pixels: Vec<[f32; 4]> = (0..width * height).map(|i| [i as f32; 4]).collect();
        let mask = BlockMask::none(width, height);
        let all = gathered(&pixels, (width, height), &mask, &[0, 5]);
        assert_eq!(all.len(), 2 * BATCH);
        assert_eq!(all[9][0], 21.0);
        // The last block has four columns and five rows.
        let last = &all[BATCH..];
        assert_eq!((last[0][0], last[3][0], last[4][0], last[4 * SIDE + 3][0], last[5 * SIDE][0]), (176.0, 179.0, 0.0, 259.0, 0.0));
        assert_eq!(differences(&all, &all), [0.0; 2]);
        assert_eq!(differences(&all, &vec![[0.0; 4]; 2 * BATCH])[1], 3.0 * last.iter().map(|p| f64::from(p[0] * p[0])).sum::<f64>());
    }
}
