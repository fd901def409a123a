//! A tolerance for pictures of few blocks: whole pictures are held against one of four times as many slices.
//!
//! With the pictures P(n) of n slices, the error of P(n) is taken to be at most |P(n) - P(4n)| + |P(4n) - P(2n)|: what the finer picture has
//! of it, and what that picture may be off itself, were its error to fall with the slices' number only. Two pictures of similar counts
//! can miss the same detail, and in few pixels agree by chance; three of them, over a factor of four, hardly do.

use super::search::{Ask, Frames, Goal, MOST, Other, Reached, between, is_better, squared};
use crate::Result;
use crate::raster::BlockMask;

/// Part of the tolerance aimed at: in few pixels chance plays a part.
const AIM: f64 = 0.85;
/// Doublings beyond the first count from which an estimate that does not fall any more ends the search.
const RESOLVED: u32 = 6;
/// A share of the estimate before; one larger than that is no progress.
const PROGRESS: f64 = 0.8;
/// Slices saved, as a share, that are worth a picture in between.
const WORTH: f64 = 0.93;

/// Finds the slices that `goal` takes, and renders the picture; `None` to begin again with another method.
pub(super) fn few(goal: Goal, pixels: &mut [[f32; 4]], frames: &mut Frames<'_>, other: &mut Other<'_>) -> Result<Option<Reached>> {
    let blocks = BlockMask::none(goal.size.0, goal.size.1).len();
    let wanted = AIM * goal.tolerance;
    let mut look = |count: u64, judge: bool| -> Result<Vec<[f32; 4]>> {
        let mut made = vec![[0.0; 4]; goal.pixels()];
        frames(Ask { count, blocks: None, kept: false, judge }, &mut made)?;
        Ok(made)
    };
    let rms = |a: &[[f32; 4]], b: &[[f32; 4]]| goal.rms(squared(a, b));
    let mut count = goal.first;
    // Of so many slices, twice, and four times as many.
    let (mut one, mut two) = (look(count, false)?, look(2 * count, true)?);
    let mut before: Option<(u64, f64)> = None;
    let (mut round, mut stalled) = (0, 0);
    let (count, error) = loop {
        let four = look(4 * count, true)?;
        let off = rms(&four, &two);
        let error = rms(&one, &four) + off;
        if error <= wanted {
            let Some(coarser) = before else { break (count, error) };
            let less = libm::ceil(between(coarser, (count, error), wanted)) as u64;
            if less as f64 <= WORTH * count as f64 {
                let error = rms(&look(less, false)?, &four) + off;
                if error <= wanted {
                    break (less, error);
                }
            }
            break (count, error);
        }
        stalled = if round > RESOLVED && before.is_some_and(|(_, e)| error > PROGRESS * e) { stalled + 1 } else { 0 };
        if stalled > 1 || 8 * count > MOST {
            break (count, error);
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
    Ok(Some(Reached { error, levels: vec![(count, blocks)] }))
}
