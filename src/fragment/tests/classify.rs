//! Twins of classification by one value.

use super::fetch::{trilinear, weight};
use super::*;

/// The colour at position `x` from 0 on: on the straight line between the entries beside it.
pub(super) fn between_entries(entries: &[[f32; 4]], x: f64) -> [f64; 4] {
    let below = (x as usize).min(entries.len() - 2);
    let part = x - below as f64;
    std::array::from_fn(|c| f64::from(entries[below][c]) * (1.0 - part) + f64::from(entries[below + 1][c]) * part)
}

/// Where in the table `value` stands, and how far an f32 may be off it where it rounds difference and products.
pub(super) fn position(frame: &Frame<'_>, value: f64) -> (f64, f64) {
    let [a, b] = frame.color.scale.map(f64::from);
    let x = (value - f64::from(frame.color.low)) * a * b;
    let last = f64::from(frame.color.last);
    (x.clamp(0.0, last), 4.0 * ROUNDING * x.abs().min(2.0 * last))
}

/// Most that an interpolation between colours from 0 to 1 is off, when its position is off by `x`.
pub(super) fn color_bound(x: f64) -> f64 {
    x + 4.0 * ROUNDING
}

/// A frame whose table has `count` entries, the first `hidden` of them transparent, over about the values of a batch.
fn classifying<'v>(n: &mut Numbers, none: &'v Voxels, count: usize, hidden: usize, split: bool) -> Frame<'v> {
    let mut frame = frame(none, n);
    frame.color.table = Arc::new(LookupTable::new(&colors(n, count, hidden)));
    frame.color.last = (count - 1) as f32;
    // Values reach from -50 to 350: some lie beyond both ends.
    frame.color.low = n.between(-40.0, 40.0) as f32;
    let scale = n.between(0.8, 1.5) as f32 * count as f32 / 300.0;
    frame.color.scale = if split { [scale * 8e-3, 125.0] } else { [scale, 1.0] };
    frame.color.first_visible = hidden.saturating_sub(1) as f32;
    frame
}

/// The table's colour at the value. Rows may be left out where every fragment is transparent, and those alone.
fn hold_values<const SPLIT: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let (mut left_out, mut shown) = (0, 0);
    for round in 0..300 {
        let count = [64, 50, 2, 17][round % 4];
        let hidden = if round % 3 == 0 { 0 } else { n.bits() as usize % count };
        let frame = classifying(n, &none, count, hidden, SPLIT);
        let mut before = batch(n);
        // Rows of low values, or hardly any row would be transparent throughout.
        for lanes in lanes_of_rows(n, 2) {
            let most = n.between(0.0, 200.0);
            before.sample.value[lanes].iter_mut().for_each(|v| *v = n.between(-50.0, most) as f32);
        }
        run::<Classify<SPLIT>>(&frame, &before, &[Part::Color, Part::Alpha, Part::Shown], |after, level| {
            assert_eq!(after.shown & !before.shown, 0, "rows that were not to be classified, at {level}");
            left_out += (before.shown & !after.shown).count_ones();
            shown += after.shown.count_ones();
            for i in 0..BATCH {
                let (x, off) = position(&frame, f64::from(before.sample.value[i]));
                let want = between_entries(frame.color.table.entries(), x);
                hold_color(&before, after, want, color_bound(off), level, i);
            }
        });
    }
    assert!(left_out > 100 && shown > 100, "{left_out} rows left out, {shown} shown");
}

/// Fragment `i` of a shown row has colour `want`; where a row that was listed is not shown, that is transparent.
pub(super) fn hold_color(before: &Batch, after: &Batch, want: [f64; 4], bound: f64, level: &str, i: usize) {
    for c in 0..4 {
        let [got, old] = [after, before].map(|b| if c < 3 { b.slab.color[c][i] } else { b.slab.alpha[i] });
        if listed(after.shown, i) {
            assert_near(got, want[c], bound, level, i);
        } else {
            assert_same(got, old, level, i);
            if listed(before.shown, i) {
                assert_eq!(want[c], 0.0, "something shows in fragment {i}, and its row was left out at {level}");
            }
        }
    }
}

#[test]
pub(super) fn values() {
    let mut n = Numbers::new(41);
    hold_values::<false>(&mut n);
    hold_values::<true>(&mut n);
}

/// The colours of a cell's eight voxels, interpolated; voxels that are NaN or infinite are transparent.
fn hold_corners<const SPLIT: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    for round in 0..200 {
        let frame = classifying(n, &none, [64, 50, 2, 17][round % 4], 0, SPLIT);
        let mut before = batch(n);
        for value in before.rare.corners.0.iter_mut().flatten() {
            let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
            *value = if n.bits() % 9 == 0 { special[n.bits() as usize % 3] } else { n.between(-50.0, 350.0) as f32 };
        }
        for i in 0..BATCH {
            (0..3).for_each(|a| before.sample.weight[a][i] = if n.bits() % 8 == 0 { (n.bits() % 2) as f32 } else { n.unit32() });
        }
        // Every row that takes part is shown, whatever was known before.
        run::<ClassifyCorners<SPLIT>>(&frame, &before, &[Part::Color, Part::Alpha, Part::Shown], |after, level| {
            assert_eq!(after.shown, before.rows, "at {level}");
            for i in 0..BATCH {
                let mut off: f64 = 0.0;
                let colors: [[f64; 4]; 8] = std::array::from_fn(|c| {
                    let value = f64::from(before.rare.corners.0[c][i]);
                    if !value.is_finite() {
                        return [0.0; 4];
                    }
                    let (x, off_here) = position(&frame, value);
                    off = off.max(off_here);
                    between_entries(frame.color.table.entries(), x)
                });
                let want = std::array::from_fn(|c| trilinear(colors.map(|color| color[c]), weight(&before, i)));
                // Three more interpolations between colours.
                hold_color(&before, after, want, color_bound(off) + 9.0 * ROUNDING, level, i);
            }
        });
    }
}

#[test]
pub(super) fn corners() {
    let mut n = Numbers::new(42);
    hold_corners::<false>(&mut n);
    hold_corners::<true>(&mut n);
}
