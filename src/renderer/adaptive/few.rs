//! A tolerance for pictures of few blocks: whole pictures are held against finer ones.
//!
//! With the pictures P(n) of n slices, the error of P(n) is taken to be |P(n) - P(4n)| + |P(4n) - P(2n)| at first: what the finer picture tells
//! of it, and what that picture may be off itself, were its error to fall with the slices' number only. Pictures of similar counts
//! can miss the same detail, and in few pixels agree by chance, so a picture of 8 to 128 times as many slices has the last word.

use super::search::{Ask, Frames, Goal, MOST, Other, Reached, between, is_better, squared};
use crate::Result;
use crate::raster::BlockMask;

/// Part of the tolerance aimed at: in few pixels chance plays a part.
const AIM: f64 = 0.85;
/// How many times their slices the picture has that so many blocks at most are held against at last: the fewer there are, the larger a part
/// chance plays. And what more blocks are held against.
const FINER: [(usize, u64); 2] = [(8, 64), (100, 16)];
const LEAST: u64 = 8;
/// And where they are all the same, or differ in few pixels alone.
const UNSEEN: u64 = 128;
/// Pixels that make up an error, below which the picture is held against that many more too: where few pixels are wrong, others may be that no picture
/// has shown yet, and each is a large part of what is asked for.
const CROWD: f64 = 8.0;
/// What is taken for its error, as a share of its difference to the picture of four times the slices: a third and more, were errors to fall with the
/// slices' number only.
const REST: f64 = 0.5;
/// Doublings beyond the first count from which an estimate that does not fall any more ends the search.
const RESOLVED: u32 = 6;
/// A share of the estimate before; one larger than that is no progress.
const PROGRESS: f64 = 0.8;
/// More slices than a power of the count says, so that rounding does not decide.
const SLACK: f64 = 1.01;
/// Slices saved, as a share, that are worth a picture in between.
const WORTH: f64 = 0.93;

/// Finds the slices that `goal` takes, and renders the picture, of which about so many blocks may show anything; `None` to begin again with
/// another method.
pub(super) fn few(
    goal: Goal,
    shown: usize,
    pixels: &mut [[f32; 4]],
    frames: &mut Frames<'_>,
    other: &mut Other<'_>,
) -> Result<Option<Reached>> {
    let blocks = BlockMask::none(goal.size.0, goal.size.1).len();
    let wanted = AIM * goal.tolerance;
    let mut look = |count: u64, judge: bool| -> Result<Vec<[f32; 4]>> {
        let mut made = vec![[0.0; 4]; goal.pixels()];
        frames(Ask { count, blocks: None, kept: false, judge }, &mut made)?;
        Ok(made)
    };
    let rms = |a: &[[f32; 4]], b: &[[f32; 4]]| goal.rms(squared(a, b));
    let times = FINER.iter().find(|f| shown <= f.0).map_or(LEAST, |f| f.1);
    let mut count = goal.first;
    // Of so many slices, twice, and four times as many.
    let (mut one, mut two) = (look(count, false)?, look(2 * count, true)?);
    let mut before: Option<(u64, f64)> = None;
    // The finest picture so far, and of how many slices: once there is no finer one, it stays.
    let mut finest: Option<(u64, Vec<[f32; 4]>)> = None;
    let (mut round, mut stalled) = (0, 0);
    let (count, error) = loop {
        let four = look(4 * count, true)?;
        let off = rms(&four, &two);
        let mut error = rms(&one, &four) + off;
        if error <= wanted {
            // Much finer pictures have the last word; where some pixels alone differ, or none, something thin may have been missed by all.
            let (mut off, mut is_held) = (off, false);
            for times in [times, UNSEEN] {
                let judge = finest.as_ref().filter(|_| is_held).map_or(&four, |f| &f.1);
                let finer = (times * count).min(MOST);
                let is_asked = times != UNSEEN || crowd(&one, judge) < CROWD;
                if finer > 4 * count && error <= wanted && is_asked {
                    let judge = match finest.take() {
                        Some(found) if found.0 >= finer => found,
                        _ => (finer, look(finer, true)?),
                    };
                    off = rms(&judge.1, &four) * REST;
                    error = rms(&one, &judge.1) + off;
                    (finest, is_held) = (Some(judge), true);
                }
            }
            let judge = finest.as_ref().filter(|_| is_held).map_or(&four, |f| &f.1);
            if error <= wanted {
                let Some(coarser) = before else { break (count, error) };
                let less = libm::ceil(SLACK * between(coarser, (count, error), wanted)) as u64;
                if less as f64 <= WORTH * count as f64 {
                    let error = rms(&look(less, false)?, judge) + off;
                    if error <= wanted {
                        break (less, error);
                    }
                }
                break (count, error);
            }
        }
        stalled = if round > RESOLVED && before.is_some_and(|(_, e)| error > PROGRESS * e) { stalled + 1 } else { 0 };
        if stalled > 1 || 8 * count > MOST {
            // A series that does not fall as it should tells little of its limit.
            break (count, 2.0 * error);
        }
        if round == 2 {
            let mut all = BlockMask::none(goal.size.0, goal.size.1);
            (0..blocks).for_each(|b| all.set(b));
            let own = (rms(&one, &two), rms(&two, &four));
            if let Some(others) = other(4 * count, &all)? {
                if is_better(4 * count, own, goal.rms(others), wanted) {
                    return Ok(None);
                }
            }
        }
        before = Some((count, error));
        round += 1;
        count *= 2;
        (one, two) = (look(count, false)?, four);
    };
    frames(Ask { count, blocks: None, kept: true, judge: false }, pixels)?;
    // What the aim leaves is for what the estimate may be off.
    Ok(Some(Reached { error: error / AIM, levels: vec![(count, blocks)] }))
}

/// How many pixels the difference of two pictures is made of, were it as large in each of them; 0 where there is none. It is the square of the sum of
/// the pixels' squared differences over the sum of their squares.
fn crowd(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let (mut sum, mut squares) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let squared: f64 = (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).map(|d| d * d).sum();
        sum += squared;
        squares += squared * squared;
    }
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (20, 12);

    fn run(tolerance: f64, error: impl Fn(u64, usize) -> f64) -> (f64, Reached) {
        let mut pixels = vec![[0.0; 4]; SIZE.0 * SIZE.1];
        let mut frames = |ask: Ask<'_>, pixels: &mut [[f32; 4]]| {
            pixels.iter_mut().enumerate().for_each(|(i, p)| *p = [0.5 + error(ask.count, i) as f32; 4]);
            Ok(())
        };
        let goal = Goal { tolerance, size: SIZE, first: 32, first_order: false };
        let reached = few(goal, 6, &mut pixels, &mut frames, &mut |_, _| Ok(None)).unwrap().unwrap();
        let sum: f64 = pixels.iter().map(|p| f64::from(p[0] - 0.5)).map(|d| d * d).sum();
        ((sum / pixels.len() as f64).sqrt(), reached)
    }

    #[test]
    fn errors_end_below_the_tolerance_and_not_far_below() {
        for (order, least) in [(1.0, 1e-3), (2.0, 1e-5)] {
            for tolerance in [1e-2, 1e-3, least] {
                let (error, reached) = run(tolerance, |n, i| (1.0 + (i % 5) as f64) * libm::pow(n as f64, -order));
                // Of errors of the first order the whole is told, and f32 rounds it.
                assert!(error <= 1.002 * reached.error && reached.error <= tolerance, "order {order}: {error:.2e}, {reached:?}");
                assert!(error > tolerance / 3.0 || reached.levels[0].0 == 32, "order {order}, {tolerance}: {error:.2e}, {reached:?}");
            }
        }
    }

    #[test]
    fn pictures_that_agree_by_chance_do_not_end_the_search() {
        // Pictures of 32 and 64 slices miss the same detail.
        let (error, reached) = run(1e-3, |n, _| if n < 100 { 0.1 } else { 0.05 / n as f64 });
        assert!(error <= 1e-3 && reached.error <= 1e-3, "{error:.2e}, {reached:?}");
    }

    #[test]
    fn a_difference_is_made_of_as_many_pixels_as_have_it() {
        let plain = vec![[0.5; 4]; 100];
        let mut other = plain.clone();
        assert_eq!(crowd(&plain, &other), 0.0);
        other[7] = [0.25; 4];
        assert_eq!(crowd(&plain, &other), 1.0);
        other[9..14].fill([0.75; 4]);
        assert_eq!(crowd(&plain, &other), 6.0);
        // One pixel that is off by far counts for most of it.
        other[20] = [100.0; 4];
        assert!(crowd(&plain, &other) < 1.01);
    }

    #[test]
    fn a_tolerance_out_of_reach_is_told() {
        let (error, reached) = run(1e-3, |n, i| if (u64::from(n.trailing_zeros()) + i as u64) % 2 == 0 { 0.1 } else { 0.2 });
        assert!(reached.error > 1e-3 && error > 1e-3, "{error:.2e}, {reached:?}");
    }
}
