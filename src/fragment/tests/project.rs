//! Twins of projections: what a pixel keeps of the values along its ray.

use super::super::project::NOTHING;
use super::*;

/// A batch whose pixels hold what earlier slices leave: a value or none yet, in some of them the result already, and alive where slices follow.
fn gathered(n: &mut Numbers, open: bool) -> Box<Batch> {
    let mut b = batch(n);
    b.pixels.alive = 0;
    for i in 0..BATCH {
        b.pixels.transmittance[i] = if open || n.bits() % 5 != 0 { 1.0 } else { 0.0 };
        if n.bits() % 4 == 0 {
            (b.pixels.color[0][i], b.pixels.color[1][i]) = (NOTHING, NOTHING);
        }
        if n.bits() % 16 == 0 {
            // Equal values make no step.
            b.sample.value[i] = b.pixels.color[0][i].max(-50.0);
        }
        let alive = b.pixels.transmittance[i] > 0.0 && b.pixels.last[i] >= b.slice;
        b.pixels.alive |= u64::from(alive) << i;
    }
    b
}

/// Covered fragments of listed rows change what their pixel keeps to `best` of the old and the new value, the first of them to its own.
fn hold_best<K: for<'v> Kernel<Frame<'v>, Batch>>(seed: u64, best: fn(f32, f32) -> f32) {
    let mut n = Numbers::new(seed);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let before = gathered(&mut n, true);
        run::<K>(&frame, &before, &[Part::Sum], |after, level| {
            for i in 0..BATCH {
                let (old, value) = (before.pixels.color[0][i], before.sample.value[i]);
                let want = match listed(before.rows, i) && bit(before.mask, i) {
                    true if old == NOTHING => value,
                    true => best(old, value),
                    false => old,
                };
                assert_same(after.pixels.color[0][i], want, level, i);
                (1..3).for_each(|c| assert_same(after.pixels.color[c][i], before.pixels.color[c][i], level, i));
            }
        });
    }
}

#[test]
pub(super) fn max() {
    hold_best::<ProjectMax>(81, |a, b| if b > a { b } else { a });
}

#[test]
pub(super) fn min() {
    hold_best::<ProjectMin>(82, |a, b| if b < a { b } else { a });
}

/// Lengths add up, and values above the table's low end times length.
#[test]
pub(super) fn average() {
    let mut n = Numbers::new(83);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let before = batch(&mut n);
        run::<ProjectAverage>(&frame, &before, &[Part::Sum], |after, level| {
            for i in 0..BATCH {
                let counts = listed(before.rows, i) && bit(before.mask, i);
                let length = if counts { f64::from(before.slab.length[i]) } else { 0.0 };
                let more = length * (f64::from(before.sample.value[i]) - f64::from(frame.color.low));
                let [sum, lengths, third] = before.pixels.color.map(|c| f64::from(c[i]));
                assert_near(after.pixels.color[0][i], sum + more, ROUNDING * (sum + 4.0 * more.abs()), level, i);
                assert_near(after.pixels.color[1][i], lengths + length, ROUNDING * (lengths + length), level, i);
                assert_near(after.pixels.color[2][i], third, 0.0, level, i);
            }
        });
    }
}

/// Colours and opacities of shown rows add up, and nothing is hidden.
#[test]
pub(super) fn add() {
    let mut n = Numbers::new(84);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let before = batch(&mut n);
        run::<ProjectAdd>(&frame, &before, &[Part::Sum, Part::Transmittance], |after, level| {
            let channels = |b: &Batch, i: usize| {
                let [red, green, blue] = b.pixels.color.map(|c| c[i]);
                [red, green, blue, b.pixels.transmittance[i]]
            };
            for i in 0..BATCH {
                let (old, got) = (channels(&before, i), channels(after, i));
                let [red, green, blue] = before.slab.color.map(|c| c[i]);
                for (c, slab) in [red, green, blue, before.slab.alpha[i]].into_iter().enumerate() {
                    let more = if listed(before.shown, i) { f64::from(slab) } else { 0.0 };
                    let want = f64::from(old[c]) + more;
                    assert_near(got[c], want, ROUNDING * want, level, i);
                }
            }
        });
    }
}

/// A pixel whose result stands, or that has no more slices, is finished; rows that are not listed stay as they were.
fn hold_alive(before: &Batch, after: &Batch, level: &str, i: usize) {
    let goes_on = after.pixels.transmittance[i] > 0.0 && before.pixels.last[i] > before.slice;
    let want = bit(before.pixels.alive, i) && (goes_on || !listed(before.rows, i));
    assert_eq!(bit(after.pixels.alive, i), want, "fragment {i} at {level}");
}

/// A value's place in the window, times exp(-S), where S is what the values before it have added; the largest is kept. Pixels that no value to come can
/// outdo are finished.
#[test]
pub(super) fn attenuated() {
    let mut n = Numbers::new(87);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    let by = frame.attenuation.as_deref().unwrap();
    let (mut found, mut finished) = (0, 0);
    for _ in 0..200 {
        let mut before = gathered(&mut n, false);
        for i in 0..BATCH {
            before.pixels.color[0][i] = if n.bits() % 5 == 0 { NOTHING } else { n.between(0.0, 1.0) as f32 };
            before.pixels.color[1][i] = if n.bits() % 5 == 0 { 0.0 } else { n.between(0.0, 4.0) as f32 };
        }
        run::<ProjectAttenuated>(&frame, &before, &[Part::Sum, Part::Transmittance, Part::Alive], |after, level| {
            for i in 0..BATCH {
                let [best, sum, third] = before.pixels.color.map(|c| c[i]);
                let (value, left) = (before.sample.value[i], before.pixels.transmittance[i]);
                let open = listed(before.rows, i) && bit(before.mask, i) && left > 0.0;
                let [got, now] = [0, 1].map(|c: usize| after.pixels.color[c][i]);
                assert_same(after.pixels.color[2][i], third, level, i);
                if !open {
                    assert_same(got, best, level, i);
                    assert_same(now, sum, level, i);
                } else {
                    let place = ((f64::from(value) - f64::from(by.low)) * f64::from(by.per_unit)).clamp(0.0, 1.0);
                    let shown = place * f64::exp(-f64::from(sum));
                    found += usize::from(shown > f64::from(best));
                    assert_near(got, shown.max(f64::from(best)), 8.0 * ROUNDING, level, i);
                    let length = f64::from(by.per_slab) * f64::from(before.slab.length[i]);
                    let want = f64::from(sum) + length * place;
                    assert_near(now, want, ROUNDING * (want.abs() + 8.0), level, i);
                }
                // Within rounding of the bound either may be.
                let bound = f64::exp(-f64::from(now)) - f64::from(got);
                if listed(before.rows, i) && bound.abs() > 1e-5 {
                    assert_same(after.pixels.transmittance[i], if bound < 0.0 { 0.0 } else { left }, level, i);
                    finished += usize::from(open && bound < 0.0);
                }
                hold_alive(&before, after, level, i);
            }
        });
    }
    assert!(found > 1000 && finished > 100, "{found} larger, {finished} finished");
}

/// Where values fall again from one that is at the level or above it, that one was the first local maximum: the pixel keeps it and is
/// finished. Until then the pixel keeps the last value, and the largest of all beside it.
#[test]
pub(super) fn local_maximum() {
    let mut n = Numbers::new(85);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    let mut found = 0;
    for _ in 0..200 {
        let before = gathered(&mut n, false);
        run::<ProjectLmip>(&frame, &before, &[Part::Sum, Part::Transmittance, Part::Alive], |after, level| {
            for i in 0..BATCH {
                let [last, most, third] = before.pixels.color.map(|c| c[i]);
                let (value, left) = (before.sample.value[i], before.pixels.transmittance[i]);
                let open = listed(before.rows, i) && bit(before.mask, i) && left > 0.0;
                let peak = open && last >= frame.blend.level && value < last;
                let [want_last, want_most, want_left] = if peak {
                    [last, most, 0.0]
                } else if open {
                    [value, if value > most { value } else { most }, left]
                } else {
                    [last, most, left]
                };
                found += usize::from(peak);
                assert_same(after.pixels.color[0][i], want_last, level, i);
                assert_same(after.pixels.color[1][i], want_most, level, i);
                assert_same(after.pixels.color[2][i], third, level, i);
                assert_same(after.pixels.transmittance[i], want_left, level, i);
                hold_alive(&before, after, level, i);
            }
        });
    }
    assert!(found > 1000, "{found} maxima");
}

/// Rows of values with plateaus, slice by slice: what pixels have kept in the end is the first run of equal values at the level or above it with smaller
/// ones, or the row's end, on both sides; without one, the largest value.
#[test]
fn the_first_maximum_of_whole_rows() {
    let mut n = Numbers::new(88);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for round in 0..60 {
        let length = 1 + round % 9;
        // The level, 100, is among them.
        let rows: Vec<[f32; BATCH]> = (0..length).map(|_| std::array::from_fn(|_| 98.0 + (n.bits() % 5) as f32)).collect();
        for level in Level::available() {
            let mut batch = gathered(&mut Numbers::new(1), false);
            (batch.mask, batch.rows, batch.pixels.alive) = (u64::MAX, u8::MAX, u64::MAX);
            batch.pixels.color = [[NOTHING; BATCH]; 3];
            batch.pixels.transmittance = [1.0; BATCH];
            for values in &rows {
                batch.sample.value = *values;
                level.kernel::<ProjectLmip, Frame<'_>, Batch>()(&frame, &mut batch);
            }
            for i in 0..BATCH {
                let row: Vec<f32> = rows.iter().map(|values| values[i]).collect();
                let maximum = (0..row.len()).find(|&at| {
                    let end = (at..row.len()).find(|&k| row[k] != row[at]).unwrap_or(row.len());
                    let rises = at == 0 || row[at - 1] < row[at];
                    rises && (end == row.len() || row[end] < row[at]) && row[at] >= frame.blend.level
                });
                let want = maximum.map_or_else(|| row.iter().copied().fold(NOTHING, f32::max), |at| row[at]);
                let [last, most, _] = batch.pixels.color.map(|c| c[i]);
                let got = if batch.pixels.transmittance[i] == 0.0 { last } else { most };
                assert_eq!(got, want, "{row:?} at {}", level.name());
            }
        }
    }
}

/// Where the level lies between the value of the slice before and this one's, or the first value of all is at it or above, the surface is hit: on
/// the straight line between both, or on the first slice. The pixel keeps where, in slices, and is finished.
#[test]
pub(super) fn surface() {
    let mut n = Numbers::new(86);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    let level_at = frame.blend.level;
    let mut found = 0;
    for _ in 0..200 {
        let before = gathered(&mut n, false);
        run::<ProjectIso>(&frame, &before, &[Part::Sum, Part::Transmittance, Part::Alive], |after, level| {
            for i in 0..BATCH {
                let [last, at, third] = before.pixels.color.map(|c| c[i]);
                let (value, left) = (before.sample.value[i], before.pixels.transmittance[i]);
                let open = listed(before.rows, i) && bit(before.mask, i) && left > 0.0;
                // Before its first value a ray is outside.
                let outside = last < level_at;
                let hit = open && outside == (value >= level_at);
                assert_same(after.pixels.color[0][i], if open { value } else { last }, level, i);
                assert_same(after.pixels.color[2][i], third, level, i);
                assert_same(after.pixels.transmittance[i], if hit { 0.0 } else { left }, level, i);
                if hit {
                    found += 1;
                    let [from, to, surface] = [last, value, level_at].map(f64::from);
                    let part = if last == NOTHING { 1.0 } else { (surface - from) / (to - from) };
                    let want = f64::from(before.slice) - 1.0 + part;
                    assert_near(after.pixels.color[1][i], want, ROUNDING * (want.abs() + 4.0), level, i);
                } else {
                    assert_same(after.pixels.color[1][i], at, level, i);
                }
                hold_alive(&before, after, level, i);
            }
        });
    }
    assert!(found > 1000, "{found} surfaces");
}
