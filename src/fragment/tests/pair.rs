//! Twins of classification by the values at a slab's two sides.

use super::classify::{between_entries, color_bound, hold_color, position};
use super::*;

/// A slab between two values, and how far each of them may be off.
struct Sides {
    front: f64,
    back: f64,
    off: f64,
}

/// The values at both sides of fragment `i`'s slab; nothing where one of them is not finite.
fn sides(b: &Batch, i: usize) -> Option<Sides> {
    let front = if b.slice == b.pixels.first[i] { b.pixels.entry[i] } else { b.pixels.previous[0][i] };
    let back = b.sample.value[i];
    (front.is_finite() && back.is_finite()).then(|| Sides { front: f64::from(front), back: f64::from(back), off: 0.0 })
}

/// The same, moved so that the straight line between them has the mean of a parabola: the one through three slices or, where no two slices lie
/// before the slab, through both sides and the middle.
fn sides_of_second_order(b: &Batch, i: usize) -> Option<Sides> {
    let Sides { front, back, .. } = sides(b, i)?;
    let first = b.pixels.first[i];
    let (third, middle) = if b.slice == first {
        let m = f64::from(b.pixels.middle[0][i]);
        (m, m)
    } else if b.slice == BEHIND || b.slice == first + 1 {
        let m = f64::from(b.pixels.middle[1][i]);
        (m, m)
    } else {
        // Lagrange's polynomial through the values at -1, 0 and 1 slabs, at 1/2.
        let before = f64::from(b.pixels.previous[1][i]);
        (before, -0.125 * before + 0.75 * front + 0.375 * back)
    };
    if third.is_nan() {
        return sides(b, i);
    }
    // Simpson's rule is exact for parabolas.
    let mean = (front + 4.0 * middle + back) / 6.0;
    let (small, large) = (front.min(back), front.max(back));
    // One side moves: the larger one where the mean lies below that of the line, else the smaller one.
    let (new_small, new_large) = if 2.0 * mean < small + large {
        (small, (2.0 * mean - small).clamp(small, large))
    } else {
        ((2.0 * mean - large).clamp(small, large), large)
    };
    let off = 6.0 * ROUNDING * (front.abs() + back.abs() + third.abs());
    let (front, back) = if front <= back { (new_small, new_large) } else { (new_large, new_small) };
    Some(Sides { front, back, off })
}

/// A colour of a table over pairs with `side` entries along each value, linear in both; rows are front values.
fn between_pairs(entries: &[[f32; 4]], side: usize, x: f64, y: f64) -> [f64; 4] {
    let along_back = |row: usize| between_entries(&entries[row * side..][..side], y);
    let row = (x as usize).min(side - 2);
    let part = x - row as f64;
    let (near, far) = (along_back(row), along_back(row + 1));
    std::array::from_fn(|c| near[c] * (1.0 - part) + far[c] * part)
}

/// The colour of a slab, and how far an f32 may be off it.
fn slab_color(frame: &Frame<'_>, sides: &Sides, fine: bool) -> ([f64; 4], f64) {
    let side = frame.color.last as usize + 1;
    let per_unit = f64::from(frame.color.scale[0]) * f64::from(frame.color.scale[1]);
    let ((x, x_off), (y, y_off)) = (position(frame, sides.front), position(frame, sides.back));
    // Each way a colour changes by no more than 1 from entry to entry.
    let off = x_off + y_off + 2.0 * sides.off * per_unit;
    let pair = between_pairs(frame.color.table.entries(), side, x, y);
    let bound = color_bound(off) + 4.0 * ROUNDING;
    let Some((table, [offset, factor, end])) = frame.color.fine.as_ref().filter(|_| fine) else { return (pair, bound) };
    // Slabs within an interval have the colour of their mean value; it gives way to the pair's as they grow to a whole one.
    let [offset, factor, end] = [offset, factor, end].map(|&f| f64::from(f));
    let at = ((x + y) / 2.0 - offset) * factor;
    let mean = between_entries(table.entries(), at.clamp(0.0, end));
    let part = (x - y).abs().min(1.0);
    let mean_off = off * factor + 4.0 * ROUNDING * (at.abs() + offset.abs() * factor);
    (std::array::from_fn(|c| mean[c] * (1.0 - part) + pair[c] * part), bound + color_bound(mean_off) + off)
}

/// A frame with a table over pairs and a fine one; nothing shows between values below the entry `hidden`.
fn classifying<'v>(n: &mut Numbers, none: &'v Voxels, hidden: usize, split: bool) -> Frame<'v> {
    let side = 21;
    let mut frame = frame(none, n);
    let mut entries = colors(n, side * side, 0);
    let fine = [0.5f32, 1.9, 37.0];
    let mut fine_entries = colors(n, 38, 0);
    if hidden > 0 {
        for (row, column) in (0..=hidden).flat_map(|row| (0..=hidden).map(move |column| (row, column))) {
            entries[row * side + column] = [0.0; 4];
        }
        let end = ((hidden as f32 - fine[0]) * fine[1]) as usize + 1;
        fine_entries[..=end].fill([0.0; 4]);
    }
    frame.color.table = Arc::new(LookupTable::new(&entries));
    frame.color.fine = Some((Arc::new(LookupTable::new(&fine_entries)), fine));
    frame.color.last = (side - 1) as f32;
    frame.color.low = n.between(-40.0, 40.0) as f32;
    let scale = n.between(0.06, 0.12) as f32;
    frame.color.scale = if split { [scale * 8e-3, 125.0] } else { [scale, 1.0] };
    frame.color.first_visible = hidden as f32;
    frame
}

/// A batch of slabs: some behind the last slices, some hardly more than one value, some values NaN or infinite, some rows low throughout.
fn slabs(n: &mut Numbers) -> Box<Batch> {
    let mut b = batch(n);
    b.shown = b.rows;
    b.slice = if n.bits() % 4 == 0 { BEHIND } else { (n.bits() % 7) as i32 };
    for i in 0..BATCH {
        match n.bits() % 12 {
            0 => b.sample.value[i] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][n.bits() as usize % 3],
            1 => b.pixels.previous[0][i] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][n.bits() as usize % 3],
            2 => b.pixels.entry[i] = f32::NAN,
            3 => b.pixels.previous[1][i] = f32::NAN,
            4 => (b.pixels.middle[0][i], b.pixels.middle[1][i]) = (f32::NAN, f32::NAN),
            5..8 => {
                let value = b.sample.value[i];
                b.pixels.previous[0][i] = value + n.between(-12.0, 12.0) as f32;
                b.pixels.previous[1][i] = value + n.between(-24.0, 24.0) as f32;
                b.pixels.entry[i] = value + n.between(-12.0, 12.0) as f32;
                b.pixels.middle = b.pixels.middle.map(|mut m| {
                    m[i] = value + n.between(-12.0, 12.0) as f32;
                    m
                });
            }
            _ => {}
        }
    }
    for lanes in lanes_of_rows(n, 3) {
        let most = n.between(-20.0, 60.0);
        for i in lanes {
            (b.sample.value[i], b.pixels.previous[0][i]) = (n.between(-50.0, most) as f32, n.between(-50.0, most) as f32);
            b.pixels.entry[i] = n.between(-50.0, most) as f32;
        }
    }
    b
}

/// The slab's colour; transparent without two finite values. The values of this slice are kept for the next one in all listed rows.
fn hold_pairs<const SPLIT: bool, const SECOND: bool, const FINE: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let (mut left_out, mut shown) = (0, 0);
    for round in 0..300 {
        let hidden = if round % 3 == 0 { 0 } else { 1 + n.bits() as usize % 8 };
        let frame = classifying(n, &none, hidden, SPLIT);
        let before = slabs(n);
        let sets = [Part::Color, Part::Alpha, Part::Shown, Part::Previous];
        run::<ClassifyPair<SPLIT, SECOND, FINE>>(&frame, &before, &sets, |after, level| {
            assert_eq!(after.shown & !before.rows, 0, "rows that are not listed, at {level}");
            left_out += (before.rows & !after.shown).count_ones();
            shown += after.shown.count_ones();
            for i in 0..BATCH {
                let sides = if SECOND { sides_of_second_order(&before, i) } else { sides(&before, i) };
                let (want, bound) = sides.map_or(([0.0; 4], 0.0), |sides| slab_color(&frame, &sides, FINE));
                hold_color(&before, after, want, bound, level, i);
                let old = [before.pixels.previous[0][i], before.pixels.previous[1][i]];
                let kept = if listed(before.rows, i) { [before.sample.value[i], old[0]] } else { old };
                (0..2).for_each(|k| assert_same(after.pixels.previous[k][i], kept[k], level, i));
            }
        });
    }
    assert!(left_out > 100 && shown > 100, "{left_out} rows left out, {shown} shown");
}

#[test]
pub(super) fn pairs() {
    let mut n = Numbers::new(51);
    hold_pairs::<false, false, false>(&mut n);
    hold_pairs::<true, false, false>(&mut n);
}

#[test]
pub(super) fn pairs_with_a_fine_table() {
    let mut n = Numbers::new(52);
    hold_pairs::<false, false, true>(&mut n);
    hold_pairs::<true, false, true>(&mut n);
}

#[test]
pub(super) fn pairs_of_second_order() {
    let mut n = Numbers::new(53);
    hold_pairs::<false, true, false>(&mut n);
    hold_pairs::<true, true, false>(&mut n);
}

#[test]
pub(super) fn pairs_of_second_order_with_a_fine_table() {
    let mut n = Numbers::new(54);
    hold_pairs::<false, true, true>(&mut n);
    hold_pairs::<true, true, true>(&mut n);
}
