//! A tolerance for pictures of many blocks.
//!
//! ```text
//!  pilot:    a few blocks at rising counts ----> about enough slices
//!  a part:   a quarter of the blocks in that many ----> N, enough slices
//!  the rest: in N
//!  judges:   some blocks of both, the likelier the rougher the picture is in them, in 3 N slices: what the error is, and better blocks
//!            enough? done : a little too much? the roughest blocks in 2 N slices : all blocks in more
//! ```
//! Errors are uneven: half of the sum of squares may sit in one block of a hundred. They sit where the picture is rough: at outlines, and where
//! thin things cross. Blocks taken with a probability that grows with their roughness tell the sum best (Hansen, Hurwitz 1943; Horvitz,
//! Thompson 1952): each stands for 1 / probability blocks like it.

use super::few::few;
use super::search::{AIM, Ask, Frames, Goal, MOST, Other, Picked, Reached, between, is_better};
use crate::Result;
use crate::raster::BlockMask;

/// One block in so many is looked at by the pilot, and so many at least.
const PILOT: (usize, usize) = (64, 48);
/// Part of the tolerance that the pilot aims at.
const PILOT_AIM: f64 = 0.75;
/// Squared error over the squared difference to twice the slices, as the pilot takes it: differences of real data hold a part of the finer
/// picture's error too.
const PILOT_FACTOR: f64 = 1.1;
/// Order of errors between the first and the second, as they are found on real data.
const USUAL: f64 = 1.6;
/// Order at which the errors of blocks that got more slices are taken to have fallen: steps and spikes make it low.
const SLOW: f64 = 0.75;
/// How many times an error may be too large for the slices that it takes to be told from it by that order.
const FAR: f64 = 6.0;
/// Fewest slices, and the least share of the first count: thicker slabs are hit and miss.
const LEAST: (u64, u64) = (16, 4);
/// How often the pilot doubles the first count at most.
const DOUBLINGS: u32 = 6;
/// How many times the slices judges have.
const FINE: u64 = 3;
/// Blocks that judge, of the first part and of the others.
const JUDGES: (usize, usize) = (20, 40);
/// The least weight of a block that shows anything, as a share of the mean.
const FLOOR: f64 = 0.4;
/// Standard errors of a sum added to it.
const SURE: f64 = 2.0;
/// Largest estimate over what is wanted, in squares, at which the worst blocks alone get more slices.
const LITTLE: f64 = 4.0;
/// The largest share of blocks that get more slices alone.
const SOME: f64 = 0.6;
/// How many times the slices of the roughest blocks then.
const TWICE: u64 = 2;
/// What of a difference is taken for an error gone.
const SHY: f64 = 0.8;
/// Part of the target, in squares, that more slices for the roughest blocks aim at; and how often they are tried.
const WELL: f64 = 0.85;
const TRIES: usize = 4;
/// One block in so many is rendered first.
const FIRST_PART: usize = 4;
/// Part of the target, in squares, that the first part makes the others aim at.
const MAIN_AIM: f64 = 0.5;
/// How many times their own slices the first blocks may want and stay as they are.
const NEAR: f64 = 1.25;
/// Blocks that show anything up to which the picture is compared whole.
const SMALL: usize = 240;
/// Most pictures.
const ROUNDS: u32 = 8;
/// A share of the estimate before, in squares; one larger than that ends the search.
const PROGRESS: f64 = 0.95;

/// Squared error over the squared difference to so many times the slices, for errors that fall with the order's power of the count.
fn over(times: f64, order: f64) -> f64 {
    let rest = 1.0 - libm::pow(times, -order);
    1.0 / (rest * rest)
}

/// The share of their squared errors that blocks have left in so many times the slices, at most.
fn left_in(times: f64) -> f64 {
    libm::pow(times, -2.0 * SLOW)
}

/// A part of the picture in so many slices.
struct Part {
    count: u64,
    /// Its blocks that show anything.
    shown: Picked,
    /// How rough they are.
    roughness: Vec<f64>,
    /// Those of them in more slices.
    judged: Judged,
    /// Sum of squared errors: of blocks that do not judge, what may be added to be sure of it, and what judges have left.
    rest: f64,
    sure: f64,
    finer: f64,
    /// How many of the others, the roughest first, are in more slices too.
    more: usize,
}

/// Sum of squared errors of a picture's parts. What makes sure of each is no part of the others.
fn total(parts: &[Part]) -> f64 {
    let sure: f64 = parts.iter().map(|part| part.sure * part.sure).sum();
    parts.iter().map(|part| part.rest + part.finer).sum::<f64>() + sure.sqrt()
}

/// Renders pictures to a goal.
struct Search<'s, 'f> {
    goal: Goal,
    order: f64,
    nothing: [f32; 4],
    pixels: &'s mut [[f32; 4]],
    scratch: &'s mut [[f32; 4]],
    frames: &'s mut Frames<'f>,
}

impl Search<'_, '_> {
    /// Renders `blocks` (all of them without a mask) in `count` slices, and lets some of them judge.
    fn part(&mut self, blocks: Option<&Picked>, count: u64, judges: usize) -> Result<Part> {
        (self.frames)(Ask { count, blocks: blocks.map(|b| &b.mask), kept: true, judge: false }, self.pixels)?;
        let shown = match blocks {
            Some(blocks) => blocks.that_differ(self.pixels, self.nothing),
            None => {
                let all = BlockMask::none(self.goal.size.0, self.goal.size.1).len();
                Picked::new(self.goal.size, (0..all).collect()).that_differ(self.pixels, self.nothing)
            }
        };
        let roughness = shown.roughness(self.pixels);
        let judged = Judged::new(&shown, &roughness, judges);
        let mut errors = self.finer(&judged.blocks, FINE * count)?;
        let factor = over(FINE as f64, self.order);
        errors.iter_mut().for_each(|e| *e *= factor);
        let (rest, sure) = judged.rest(&errors);
        let finer = errors.iter().sum::<f64>() * left_in(FINE as f64);
        Ok(Part { count, shown, roughness, judged, rest, sure, finer, more: 0 })
    }

    /// Renders some blocks in more slices; the squared differences to what they were.
    fn finer(&mut self, blocks: &Picked, count: u64) -> Result<Vec<f64>> {
        if blocks.blocks.is_empty() {
            return Ok(Vec::new());
        }
        (self.frames)(Ask { count, blocks: Some(&blocks.mask), kept: true, judge: true }, self.scratch)?;
        let differences = blocks.differences(self.pixels, self.scratch);
        blocks.copy(self.scratch, self.pixels);
        Ok(differences)
    }

    /// Renders the roughest blocks of `part` in more slices, where that is expected to bring `error` below `target`: whether it was.
    fn roughest(&mut self, part: &mut Part, error: f64, target: f64) -> Result<bool> {
        let times = TWICE as f64;
        let left = left_in(times);
        let mut others = part.judged.others(&part.shown, &part.roughness);
        others.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let others = &others[part.more.min(others.len())..];
        let share = (part.rest + part.sure) / others.iter().map(|o| o.0).sum::<f64>().max(f64::MIN_POSITIVE);
        let mut expected = error;
        let rough = others.iter().take_while(|o| {
            let before = expected;
            expected -= share * o.0 * (1.0 - left) * SHY;
            before > WELL * target
        });
        let mut chosen: Vec<usize> = rough.map(|o| o.1).collect();
        if chosen.is_empty() || expected > target || (part.more + chosen.len()) as f64 > SOME * part.shown.blocks.len() as f64 {
            return Ok(false);
        }
        part.more += chosen.len();
        chosen.sort_unstable();
        let differences: f64 = self.finer(&Picked::new(self.goal.size, chosen), TWICE * part.count)?.iter().sum();
        // Differences hold some of the finer pictures' errors too.
        let before = part.rest;
        part.rest = (part.rest - SHY * differences).max(0.0);
        // What is not sure of less is less.
        part.sure *= part.rest / before.max(f64::MIN_POSITIVE);
        part.finer += over(times, self.order) * differences * left;
        Ok(true)
    }
}

/// Finds the slices that `goal` takes, and renders the picture, whose pixels without anything in them are `nothing`; `None` to begin again
/// with another method. `scratch` is as large as the picture.
pub(super) fn many(
    goal: Goal,
    nothing: [f32; 4],
    (pixels, scratch): (&mut [[f32; 4]], &mut [[f32; 4]]),
    frames: &mut Frames<'_>,
    other: &mut Other<'_>,
) -> Result<Option<Reached>> {
    let Some(mut count) = pilot(&goal, scratch, frames, other)? else { return Ok(None) };
    let mask = BlockMask::none(goal.size.0, goal.size.1);
    let all = mask.len();
    let target = goal.sum(AIM * goal.tolerance);
    let order = if goal.first_order { 1.0 } else { 2.0 };
    let mut search = Search { goal, order, nothing, pixels, scratch, frames };
    let is_first = |b: &usize| {
        let (x, y) = mask.column_and_row(*b);
        (x + 2 * y) % FIRST_PART == 0
    };
    let (first, others): (Vec<usize>, Vec<usize>) = (0..all).partition(|b| is_first(b));
    let (first, others) = (Picked::new(goal.size, first), Picked::new(goal.size, others));
    let more = |sum: f64, count: u64| {
        let times = libm::pow(sum / (MAIN_AIM * target), 0.5 / USUAL.min(order)).clamp(0.4, 4.0);
        (libm::ceil(count as f64 * times) as u64).clamp(LEAST.0, MOST / FINE)
    };
    // A quarter of the blocks tells how many slices the others take.
    let mut parts = Vec::new();
    for _ in 0..ROUNDS {
        let part = search.part(Some(&first), count, JUDGES.0)?;
        if part.shown.blocks.len() * FIRST_PART <= SMALL {
            // Judges would be most of what shows.
            return few(goal, SMALL, search.pixels, search.frames, other);
        }
        let sum = (part.rest + part.finer) * FIRST_PART as f64;
        // Where nothing is seen, nothing is known.
        let next = if sum > 0.0 { more(sum, count) } else { count };
        let is_near = next as f64 <= NEAR * count as f64;
        count = next;
        if is_near {
            // As many slices as the others, or more.
            parts.push(part);
            break;
        }
        if next < 3 * part.count {
            break;
        }
    }
    let rest = if parts.is_empty() { None } else { Some(&others) };
    parts.push(search.part(rest, count, JUDGES.1)?);
    let mut before = f64::INFINITY;
    for round in 0.. {
        let mut error = total(&parts);
        for _ in 0..TRIES {
            let worst = parts.iter_mut().max_by(|a, b| a.rest.total_cmp(&b.rest));
            let Some(part) = worst.filter(|_| error > target && error <= LITTLE * target) else { break };
            if !search.roughest(part, error, target)? {
                break;
            }
            error = total(&parts);
        }
        let stalls = round > 2 && error > PROGRESS * before;
        before = error;
        if error <= target || stalls || round >= ROUNDS || FINE * count >= MOST {
            let mut levels: Vec<(u64, usize)> = Vec::new();
            let last = parts.len() - 1;
            for (n, part) in parts.iter().enumerate() {
                let mut add = |count: u64, blocks: usize| match levels.iter_mut().find(|l| l.0 == count) {
                    Some(level) => level.1 += blocks,
                    None => levels.push((count, blocks)),
                };
                let (judges, more) = (part.judged.chances.len(), part.more);
                let blocks = if last == 0 {
                    all
                } else if n == 0 {
                    first.blocks.len()
                } else {
                    others.blocks.len()
                };
                add(part.count, blocks - judges - more);
                add(TWICE * part.count, more);
                add(FINE * part.count, judges);
            }
            levels.retain(|l| l.1 > 0);
            levels.sort_unstable();
            // A series that does not fall as it should tells little of its limit: twice the error, in squares.
            let error = if error > target { 4.0 * error } else { error };
            return Ok(Some(Reached { error: goal.rms(error) / AIM, levels }));
        }
        let likely = 0.5 * (error + parts.iter().map(|part| part.rest + part.finer).sum::<f64>());
        count = more(likely, count).max(count + count / 5);
        parts.clear();
        parts.push(search.part(None, count, JUDGES.1)?);
    }
    Ok(None)
}

/// Blocks that judge, and what each stands for.
struct Judged {
    blocks: Picked,
    /// Probability that the block was taken.
    chances: Vec<f64>,
}

impl Judged {
    /// Some of the blocks `shown`, the likelier the rougher they are.
    fn new(shown: &Picked, roughness: &[f64], judges: usize) -> Self {
        let sizes: Vec<f64> = roughness.iter().map(|d| d.sqrt()).collect();
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let weights: Vec<f64> = sizes.iter().map(|s| s + FLOOR * mean + f64::MIN_POSITIVE).collect();
        let wanted = judges.min(weights.len()) as f64;
        // Blocks that would be taken more than once are taken for certain; the others share what is left.
        let mut certain = vec![false; weights.len()];
        let scale = loop {
            let free: f64 = weights.iter().zip(&certain).filter(|(_, c)| !**c).map(|(w, _)| w).sum();
            let left = wanted - certain.iter().filter(|c| **c).count() as f64;
            let scale = if free > 0.0 { left / free } else { 0.0 };
            let before = certain.iter().filter(|c| **c).count();
            certain.iter_mut().zip(&weights).for_each(|(c, w)| *c |= w * scale >= 1.0);
            if certain.iter().filter(|c| **c).count() == before {
                break scale;
            }
        };
        // Systematic: one step after the other through the sum of chances.
        let (mut blocks, mut chances, mut passed, mut next) = (Vec::new(), Vec::new(), 0.0, 0.5);
        for ((&block, weight), certain) in shown.blocks.iter().zip(&weights).zip(&certain) {
            let chance = if *certain { 1.0 } else { weight * scale };
            passed += if *certain { 0.0 } else { chance };
            if *certain || passed > next {
                next += if *certain { 0.0 } else { 1.0 };
                blocks.push(block);
                chances.push(chance.min(1.0));
            }
        }
        Self { blocks: Picked::new(shown.size, blocks), chances }
    }

    /// The sum of squared errors over the blocks that do not judge, from those that do, and what may be added to be sure of it.
    fn rest(&self, errors: &[f64]) -> (f64, f64) {
        let (mut sum, mut variance) = (0.0, 0.0);
        for (error, chance) in errors.iter().zip(&self.chances) {
            sum += error * (1.0 / chance - 1.0);
            let stands_for = error / chance;
            variance += (1.0 - chance) * stands_for * stands_for;
        }
        (sum, SURE * variance.sqrt())
    }

    /// The blocks that do not judge, with their roughness.
    fn others(&self, shown: &Picked, roughness: &[f64]) -> Vec<(f64, usize)> {
        let judging = |b: &usize| self.blocks.blocks.binary_search(b).is_ok();
        shown.blocks.iter().zip(roughness).filter(|(b, _)| !judging(b)).map(|(&b, &d)| (d, b)).collect()
    }
}

/// About as many slices as `goal` takes, from some blocks; `None` for another method.
fn pilot(goal: &Goal, scratch: &mut [[f32; 4]], frames: &mut Frames<'_>, other: &mut Other<'_>) -> Result<Option<u64>> {
    let all = BlockMask::none(goal.size.0, goal.size.1);
    let step = PILOT.0.min(all.len() / PILOT.1).max(1);
    let taken = |b: &usize| {
        let (x, y) = all.column_and_row(*b);
        // Every row of blocks has some, and no column is left out.
        (x + 5 * y) % step == 0
    };
    let some = Picked::new(goal.size, (0..all.len()).filter(taken).collect());
    let wanted = PILOT_AIM * goal.tolerance;
    let share = some.blocks.len() as f64 / all.len() as f64;
    let mut look = |count: u64| -> Result<Vec<[f32; 4]>> {
        frames(Ask { count, blocks: Some(&some.mask), kept: false, judge: false }, scratch)?;
        Ok(some.gathered(scratch))
    };
    let (order, factor): (f64, f64) = if goal.first_order { (1.0, over(2.0, 1.0)) } else { (USUAL, PILOT_FACTOR) };
    let mut count = goal.first;
    let mut one = look(count)?;
    let mut before: Option<(u64, f64)> = None;
    for doubling in 0.. {
        let two = look(2 * count)?;
        let difference = super::search::squared(&one, &two);
        let error = goal.rms(factor * difference / share);
        let found = match before {
            Some(coarser) if error <= wanted => Some(between(coarser, (count, error), wanted)),
            // Errors may fall faster with more slices than they rise with fewer.
            _ if error <= wanted => Some(count as f64 * (error / wanted).sqrt()),
            _ if error <= FAR * wanted => Some(count as f64 * libm::pow(error / wanted, 1.0 / order)),
            _ => None,
        };
        if let Some(found) = found {
            return Ok(Some((libm::ceil(found) as u64).max(LEAST.0.max(goal.first / LEAST.1))));
        }
        // Where this many slices do not reach the error, another method may.
        if let (1, Some((_, coarser))) = (doubling, before) {
            if let Some(others) = other(2 * count, &some.mask)? {
                if is_better(2 * count, (coarser, error), goal.rms(factor * others / share), wanted) {
                    return Ok(None);
                }
            }
        }
        if doubling == DOUBLINGS || FINE * 2 * count >= MOST {
            return Ok(Some(count));
        }
        before = Some((count, error));
        count *= 2;
        one = two;
    }
    Ok(None)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::lanes::SIDE;

    const SIZE: (usize, usize) = (320, 256);

    /// A picture whose errors are weight(block) * N^-order and whose roughness is rough(block): the true error, what was told of it, and the slices
    /// taken, per pixel, over those of the picture alone.
    fn run(tolerance: f64, order: u32, weight: impl Fn(usize) -> f64, rough: impl Fn(usize) -> f32) -> (f64, Reached, f64) {
        let mask = BlockMask::none(SIZE.0, SIZE.1);
        let (mut pixels, mut scratch) = (vec![[0.0; 4]; SIZE.0 * SIZE.1], vec![[0.0; 4]; SIZE.0 * SIZE.1]);
        let mut work = 0;
        let exact = |i: usize| 0.5 + rough(mask.block_of_pixel(i)) * ((i * 31 + i / SIZE.0 * 17) % 7) as f32;
        let mut frames = |ask: Ask<'_>, pixels: &mut [[f32; 4]]| {
            for (i, p) in pixels.iter_mut().enumerate() {
                if ask.blocks.is_none_or(|m| m.takes(i % SIZE.0 / SIDE, i / SIZE.0 / SIDE)) {
                    work += ask.count;
                    let error = weight(mask.block_of_pixel(i)) * libm::pow(ask.count as f64, -f64::from(order));
                    // Uneven within a block.
                    *p = [exact(i) + (error * (0.5 + (i % 5) as f64 / 4.0)) as f32; 4];
                }
            }
            Ok(())
        };
        let goal = Goal { tolerance, size: SIZE, first: 64, first_order: order == 1 };
        let reached = many(goal, [0.0; 4], (&mut pixels, &mut scratch), &mut frames, &mut |_, _| Ok(None)).unwrap().unwrap();
        let sum: f64 = pixels.iter().enumerate().map(|(i, p)| f64::from(p[0] - exact(i))).map(|d| d * d).sum();
        let alone: u64 = reached.levels.iter().map(|&(count, blocks)| count * blocks as u64 * 64).sum();
        ((sum / pixels.len() as f64).sqrt(), reached, work as f64 / alone as f64)
    }

    #[test]
    fn errors_end_below_the_tolerance_and_not_far_below() {
        for (order, weight) in [(2, 30.0), (2, 300.0), (2, 3.0), (1, 0.3), (1, 3.0)] {
            for tolerance in [1e-2, 1e-3] {
                let (error, reached, work) = run(tolerance, order, |b| weight * (1.0 + (b % 3) as f64), |b| 0.002 * (b % 4) as f32);
                println!(
                    "order {order} weight {weight} tolerance {tolerance}: {error:.2e} of {:.2e}, work {work:.2}, {reached:?}",
                    reached.error
                );
                assert!(error <= reached.error && reached.error <= tolerance, "order {order}, {weight}: {error:.2e} of {reached:?}");
                assert!(error > tolerance / 4.0 || reached.levels[0].0 == LEAST.0, "order {order}, {weight}: {error:.2e}, {reached:?}");
                assert!(work < 6.0, "order {order}, {weight}: {work:.2} times the slices of the picture");
            }
        }
    }

    #[test]
    fn an_error_in_few_blocks_is_found_where_the_picture_is_rough() {
        let few = |b: usize| b % 97 == 5;
        let (error, reached, _) = run(1e-3, 2, |b| if few(b) { 300.0 } else { 3.0 }, |b| if few(b) { 0.02 } else { 0.001 });
        assert!(error <= reached.error && reached.error <= 1e-3, "{error:.2e}, {reached:?}");
    }

    #[test]
    fn roughness_that_tells_nothing_makes_the_estimate_larger_and_not_too_small() {
        // The rough blocks are exact, and the smooth ones have all of the error.
        for tolerance in [1e-2, 1e-3, 3e-4] {
            let (error, reached, _) = run(tolerance, 2, |b| if b % 4 == 0 { 0.0 } else { 40.0 }, |b| if b % 4 == 0 { 0.05 } else { 0.0 });
            assert!(error <= reached.error && reached.error <= tolerance, "{tolerance}: {error:.2e}, {reached:?}");
        }
    }

    #[test]
    fn a_tolerance_out_of_reach_ends() {
        let (error, reached, _) = run(1e-9, 1, |_| 1.0, |_| 0.01);
        assert!(error <= reached.error && reached.error > 1e-9, "{error:.2e}, {reached:?}");
    }

    #[test]
    fn blocks_that_judge_stand_for_the_others() {
        let all = Picked::new(SIZE, (0..1280).collect());
        let roughness: Vec<f64> = (0..1280u32).map(|b| f64::from((b * 7919) % 1280)).map(|x| x * x).collect();
        let judged = Judged::new(&all, &roughness, 40);
        assert!((35..=45).contains(&judged.chances.len()), "{}", judged.chances.len());
        // Errors in proportion to the roughness, and others with nothing to do with it.
        for errors in [roughness.clone(), (0..1280u32).map(|b| f64::from((b * 104_729) % 997)).collect()] {
            let of: Vec<f64> = judged.blocks.blocks.iter().map(|&b| errors[b]).collect();
            let (rest, sure) = judged.rest(&of);
            let truth = errors.iter().sum::<f64>() - of.iter().sum::<f64>();
            assert!((rest - truth).abs() <= 0.35 * truth && rest + sure >= truth, "{rest} of {truth}, {sure}");
        }
    }
}
