//! Asking what boxes of bricks hold, eight at a time.

use super::windows::Windows;
use crate::lanes::{Kernel, Lanes, WIDTH};
use std::array;

/// Boxes asked about at once, at most.
pub(crate) const BOXES: usize = 64;

/// Boxes of runs of slices, each a step further than the one before.
#[derive(Debug, Clone)]
pub(crate) struct BoxQuery<'w> {
    windows: &'w Windows,
    /// Least x, y, z of the first box, and greatest; in bricks.
    at: [f32; 8],
    step: [f32; 8],
    count: usize,
    /// Whether the second window is the first one's neighbour along x at most.
    beside: bool,
}

impl<'w> BoxQuery<'w> {
    /// `count` boxes: `at` and `step` in cells. `beside` tells that they are at most a brick larger than windows; larger ones count as
    /// visible.
    pub(crate) fn new(windows: &'w Windows, (at, step): ([f64; 8], [f64; 8]), count: usize, beside: bool) -> Self {
        let per_cell = 1.0 / windows.cells as f64;
        let slack = |i: usize| if i < 4 { -windows.slack } else { windows.slack };
        Self {
            windows,
            at: array::from_fn(|i| (at[i] * per_cell + slack(i)) as f32),
            step: array::from_fn(|i| (step[i] * per_cell) as f32),
            count: count.min(BOXES),
            beside,
        }
    }
}

/// Classes of what boxes hold.
pub(crate) type BoxClasses = [u8; BOXES];

/// Finds them, eight at a time; a few more than there are boxes may be set. With `FLAGS` classes are joined bit by bit.
pub(crate) struct QueryBoxes<const FLAGS: bool>;

impl<'w, const FLAGS: bool> Kernel<BoxQuery<'w>, BoxClasses> for QueryBoxes<FLAGS> {
    #[inline(always)]
    fn run<L: Lanes>(query: &BoxQuery<'w>, classes: &mut BoxClasses) {
        if query.beside { query_boxes::<L, FLAGS, true>(query, classes) } else { query_boxes::<L, FLAGS, false>(query, classes) }
    }
}

#[inline(always)]
fn query_boxes<L: Lanes, const FLAGS: bool, const BESIDE: bool>(query: &BoxQuery<'_>, classes: &mut BoxClasses) {
    let windows = query.windows;
    let [dx, dy, _] = windows.dims.map(|n| L::splat_i(n as i32));
    let (one, sides) = (L::splat_i(1), windows.sides.map(|n| L::splat_i(n as i32)));
    let numbers = L::load(&array::from_fn(|n| n as f32));
    let low = L::splat_i(0xff);
    for (eight, classes) in classes.chunks_exact_mut(WIDTH).take(query.count.div_ceil(WIDTH)).enumerate() {
        let n = L::add(L::splat((WIDTH * eight) as f32), numbers);
        let brick = |i: usize| {
            let x = L::add(L::splat(query.at[i]), L::mul(L::splat(query.step[i]), n));
            L::trunc(L::min(L::max(x, L::splat(0.0)), L::splat(windows.top[i])))
        };
        let first: [L::I; 3] = array::from_fn(brick);
        let last: [L::I; 3] = array::from_fn(|axis| brick(4 + axis));
        let second: [L::I; 3] = array::from_fn(|i| L::max_i(first[i], L::sub_i(L::add_i(last[i], one), sides[i])));
        // Bricks that neither window holds, if there are any.
        let far = |i: usize, most: L::I| L::sub_i(L::sub_i(second[i], first[i]), most);
        let between = L::max_i(far(0, if BESIDE { one } else { sides[0] }), L::max_i(far(1, sides[1]), far(2, sides[2])));
        let (mut near, mut beside) = (L::splat_i(0), L::splat_i(0));
        for z in [first[2], second[2]] {
            for y in [first[1], second[1]] {
                let row = L::mul_i(L::add_i(L::mul_i(z, dy), y), dx);
                let both = L::byte_pairs(&windows.classes, L::add_i(row, first[0]));
                near = join::<L, FLAGS>(near, L::and_i(both, low));
                if BESIDE {
                    beside = join::<L, FLAGS>(beside, L::sar::<8>(both));
                } else {
                    near = join::<L, FLAGS>(near, L::and_i(L::byte_pairs(&windows.classes, L::add_i(row, second[0])), low));
                }
            }
        }
        let class = if BESIDE { L::select_i(L::gt_i(second[0], first[0]), join::<L, FLAGS>(near, beside), near) } else { near };
        let class = L::select_i(L::gt_i(between, L::splat_i(0)), L::splat_i(i32::from(u8::MAX)), class);
        let mut found = [0; WIDTH];
        L::store_i(class, &mut found);
        for (to, found) in classes.iter_mut().zip(found) {
            *to = found as u8;
        }
    }
}

/// What bricks hold together.
#[inline(always)]
fn join<L: Lanes, const FLAGS: bool>(a: L::I, b: L::I) -> L::I {
    if FLAGS { L::or_i(a, b) } else { L::max_i(a, b) }
}

#[cfg(test)]
mod tests {
    use super::super::windows::{COARSE, HIDDEN, SHOWN};
    use super::super::{BrickClasses, SkipTable};
    use super::*;
    use crate::lanes::Level;
    use crate::volume::Voxels;
    use crate::volume::bricks::{BRICK, Bricks};

    const DIMS: [usize; 3] = [70, 41, 55];

    fn contents() -> (Bricks, BrickClasses) {
        let values: Vec<u8> = (0..DIMS.iter().product::<usize>())
            .map(|i| {
                let [x, y, z] = [i % 70, i / 70 % 41, i / 2870];
                if (x / 9 + y / 7 + z / 11) % 3 == 0 || x > 30 && y < 36 { (x + y) as u8 } else { 0 }
            })
            .collect();
        let bricks = Bricks::new(&Voxels::U8(values.into()), DIMS);
        let contents = BrickClasses::new(&bricks, |_, hi| hi as u8);
        (bricks, contents)
    }

    /// The greatest class of the bricks of `cells` cells between two points, one by one; of coarse ones what they hold; and the bricks along
    /// each axis.
    fn brute(bricks: &Bricks, lo: [f64; 3], hi: [f64; 3], cells: usize) -> (u8, [usize; 3]) {
        let brick = |v: f64, i: usize| (v.max(0.0) as usize / cells).min((DIMS[i] - 2) / cells);
        let (a, b): ([usize; 3], [usize; 3]) = (array::from_fn(|i| brick(lo[i], i)), array::from_fn(|i| brick(hi[i], i)));
        let fine = |i: usize, at: usize| at * cells / BRICK..((at + 1) * cells / BRICK).min(bricks.dims[i]);
        let (mut most, mut flags) = (0, 0);
        for z in fine(2, a[2]).start..fine(2, b[2]).end {
            for y in fine(1, a[1]).start..fine(1, b[1]).end {
                for x in fine(0, a[0]).start..fine(0, b[0]).end {
                    let class = bricks.ranges[(z * bricks.dims[1] + y) * bricks.dims[0] + x].1 as u8;
                    most = most.max(class);
                    flags |= if class > 0 { SHOWN } else { HIDDEN };
                }
            }
        }
        (if cells == BRICK { most } else { flags }, array::from_fn(|i| b[i] - a[i] + 1))
    }

    #[test]
    fn two_windows_along_each_axis_cover_a_box_and_nothing_else() {
        let (bricks, contents) = contents();
        let (mut exact, mut empty, mut full) = (0, 0, 0);
        for sides in [[[1, 1, 1], [1, 1, 1]], [[2, 2, 2], [1, 2, 1]], [[4, 3, 1], [2, 1, 2]], [[4, 3, 7], [3, 2, 2]]] {
            let skip_table = SkipTable::new(&contents, sides);
            assert_eq!(skip_table.sides(), sides);
            for case in 0..20_000usize {
                let lo = [case * 7 % 73, case * 5 % 44, case * 3 % 58].map(|v| v as f64 - 1.5);
                let hi = [lo[0] + (case % 17) as f64, lo[1] + (case % 13) as f64, lo[2] + (case % 29) as f64];
                for (windows, sides, cells) in [(&skip_table.fine, sides[0], BRICK), (&skip_table.coarse, sides[1], COARSE * BRICK)] {
                    let (want, count) = brute(&bricks, lo, hi, cells);
                    let got = windows.class(lo, hi);
                    let enough = if cells == BRICK { got >= want } else { got & want == want };
                    assert!(enough, "{lo:?} {hi:?} in windows of {sides:?}: {got}, not {want}");
                    if (0..3).all(|i| (sides[i]..=2 * sides[i]).contains(&count[i])) {
                        assert_eq!(got, want, "{lo:?} {hi:?} in windows of {sides:?}");
                        exact += 1;
                        empty += usize::from(if cells == BRICK { got == 0 } else { got == HIDDEN });
                        full += usize::from(cells != BRICK && got == SHOWN);
                    } else if (0..3).any(|i| count[i] > 2 * sides[i]) {
                        assert_eq!(got, u8::MAX);
                    }
                }
            }
        }
        assert!(exact > 1000 && empty > 50 && full > 50, "{exact} exact, {empty} empty, {full} full");
    }

    #[test]
    fn runs_are_seen_alike_at_every_level_and_never_overlooked() {
        let (bricks, contents) = contents();
        let skip_table = SkipTable::new(&contents, [[2, 2, 2], [1, 1, 1]]);
        for case in 0..300 {
            let at: [f64; 8] = array::from_fn(|i| f64::from((case * (7 + i as i32)) % 60) * 0.83 - 3.0 + if i < 4 { 0.0 } else { 5.0 });
            let step: [f64; 8] = array::from_fn(|i| f64::from(case % 11 - 5) * 0.31 * (1.0 + 0.1 * (i % 4) as f64));
            let seen = |level: Level, windows: &Windows| {
                let query = BoxQuery::new(windows, (at, step), 20, case % 2 == 0);
                let mut classes = [0; BOXES];
                if windows.holds_flags() {
                    level.kernel::<QueryBoxes<true>, BoxQuery<'_>, BoxClasses>()(&query, &mut classes);
                } else {
                    level.kernel::<QueryBoxes<false>, BoxQuery<'_>, BoxClasses>()(&query, &mut classes);
                }
                classes
            };
            let (want, coarse) = (seen(Level::SCALAR, &skip_table.fine), seen(Level::SCALAR, &skip_table.coarse));
            for level in Level::available() {
                assert_eq!(seen(level, &skip_table.fine), want, "{}", level.name());
                assert_eq!(seen(level, &skip_table.coarse), coarse, "{}", level.name());
            }
            for (n, &class) in want[..20].iter().enumerate() {
                let (lo, hi) = (array::from_fn(|i| at[i] + n as f64 * step[i]), array::from_fn(|i| at[4 + i] + n as f64 * step[4 + i]));
                if (0..3).all(|i| lo[i] <= hi[i]) {
                    assert!(class >= brute(&bricks, lo, hi, BRICK).0, "run {n} of {at:?}");
                    let flags = brute(&bricks, lo, hi, COARSE * BRICK).0;
                    assert_eq!(coarse[n] & flags, flags, "run {n} of {at:?}");
                }
            }
        }
    }
}
