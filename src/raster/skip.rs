//! What bricks hold: whether the transfer function shows anything of them, and how much colour and opacity change there.
//!
//! A frame asks of eight runs of slices at once what a block's rays can touch on them. Every brick stands for the greatest class of a
//! window of bricks from it on, and the two windows at the ends of a run's box cover it, as long as it is no more than twice as large.
//!
//! ```text
//!   box of bricks   . . x x x x x . .
//!   two windows         [first  ]
//!                         [second ]
//! ```
//!
//! Along parallel rays all boxes are of one size or a brick larger. There a window is as large as the smaller of them, so that the second one
//! is the first one's neighbour, and both come in one load.

use super::merge::{NINE, THREE};
use crate::lanes::{Kernel, Lanes, SIDE, WIDTH};
use crate::proxy::{HalfSpace, Stack};
use crate::scene::MAX_SLICES;
use crate::volume::bricks::{BRICK, Bricks};
use rayon::prelude::*;
use std::array;

/// Runs looked at at once, at most.
pub(super) const BOXES: usize = 64;
/// Bricks of a coarse brick along each axis.
const COARSE: usize = 4;

/// In a coarse brick something shows.
pub(super) const SHOWN: u8 = 1;
/// In a coarse brick there are bricks of which nothing shows.
pub(super) const HIDDEN: u8 = 2;

/// A class for each brick: 0 where nothing shows.
#[derive(Debug, Clone)]
pub(crate) struct BrickClasses {
    dims: [usize; 3],
    classes: Vec<u8>,
    shown: usize,
}

impl BrickClasses {
    /// BrickClasses of `bricks`, where `class` tells that of a range of stored values.
    pub(crate) fn new(bricks: &Bricks, class: impl Fn(f64, f64) -> u8 + Sync) -> Self {
        let classes: Vec<u8> = bricks.ranges.par_iter().map(|&(lo, hi)| class(f64::from(lo), f64::from(hi))).collect();
        let shown = classes.par_iter().filter(|&&c| c > 0).count();
        Self { dims: bricks.dims, classes, shown }
    }

    /// Share of bricks in which anything shows.
    pub(crate) fn share(&self) -> f64 {
        self.shown as f64 / self.classes.len() as f64
    }

    /// What coarse bricks hold: [`SHOWN`], [`HIDDEN`] or both.
    fn coarse(&self) -> ([usize; 3], Vec<u8>) {
        let dims = self.dims.map(|n| n.div_ceil(COARSE));
        let mut classes = vec![0u8; dims.iter().product()];
        let layer = self.dims[0] * self.dims[1];
        classes.par_chunks_exact_mut(dims[0] * dims[1]).zip(self.classes.par_chunks(layer * COARSE)).for_each(|(to, from)| {
            for (y, row) in from.chunks_exact(self.dims[0]).enumerate() {
                let to = &mut to[y % self.dims[1] / COARSE * dims[0]..][..dims[0]];
                for (to, four) in to.iter_mut().zip(row.chunks(COARSE)) {
                    *to = four.iter().fold(*to, |a, &b| a | if b > 0 { SHOWN } else { HIDDEN });
                }
            }
        });
        (dims, classes)
    }
}

/// The greatest classes of windows of bricks.
#[derive(Debug, Clone)]
pub(crate) struct Windows {
    dims: [usize; 3],
    /// Sides of a window in bricks.
    sides: [usize; 3],
    /// Cells along a brick's side.
    cells: usize,
    /// The last brick, twice, to clamp first and last bricks to.
    top: [f32; 8],
    /// By how much boxes of f32 coordinates are too small at most, in bricks.
    slack: f64,
    /// And one more, to be read beside the last.
    classes: Vec<u8>,
    /// Whether classes of bricks are joined bit by bit, and not by the greatest.
    flags: bool,
}

impl Windows {
    fn new(dims: [usize; 3], mut classes: Vec<u8>, sides: [usize; 3], cells: usize, flags: bool) -> Self {
        let [x, y, z] = dims.map(|n| (n - 1) as f32);
        for (axis, side) in sides.into_iter().enumerate() {
            let mut now = 1;
            while now < side {
                let step = now.min(side - now);
                widen(&mut classes, dims, axis, step, if flags { |a, b| a | b } else { u8::max });
                now += step;
            }
        }
        classes.push(0);
        // A thousandth of a cell for the texture coordinates' own rounding.
        let slack = 1e-3 / cells as f64 + 1e-6 * dims.into_iter().max().unwrap_or(1) as f64;
        Self { dims, sides, cells, top: [x, y, z, 0.0, x, y, z, 0.0], slack, classes, flags }
    }

    /// Whether classes are [`SHOWN`] and [`HIDDEN`], joined bit by bit.
    pub(super) fn holds_flags(&self) -> bool {
        self.flags
    }

    /// The greatest class of bricks `first` to `last` along each axis, all of them in the grid; of any, where they are too many.
    #[inline(always)]
    fn greatest(&self, first: [i32; 3], last: [i32; 3]) -> u8 {
        let [dx, dy, _] = self.dims;
        let (first, last) = (first.map(|v| v as usize), last.map(|v| v as usize));
        let second: [usize; 3] = array::from_fn(|i| first[i].max((last[i] + 1).saturating_sub(self.sides[i])));
        if (0..3).any(|i| second[i] > first[i] + self.sides[i]) {
            return u8::MAX;
        }
        let join = |a: u8, b: u8| if self.flags { a | b } else { a.max(b) };
        let mut class = 0;
        for z in [first[2], second[2]] {
            for y in [first[1], second[1]] {
                let row = (z * dy + y) * dx;
                class = join(join(class, self.classes[row + first[0]]), self.classes[row + second[0]]);
            }
        }
        class
    }

    /// The greatest class of what lookups between index coordinates `lo` and `hi` can touch, or a greater one.
    fn class(&self, lo: [f64; 3], hi: [f64; 3]) -> u8 {
        let brick = |v: f64, i: usize| ((v / self.cells as f64) as i32).clamp(0, self.dims[i] as i32 - 1);
        let slack = self.slack * self.cells as f64;
        self.greatest(array::from_fn(|i| brick(lo[i] - slack, i)), array::from_fn(|i| brick(hi[i] + slack, i)))
    }
}

/// Each class becomes what `join` makes of its own and the one `step` further along `axis`, as far as there is one.
fn widen(classes: &mut [u8], [dx, dy, dz]: [usize; 3], axis: usize, step: usize, join: impl Fn(u8, u8) -> u8 + Sync) {
    let layer = dx * dy;
    let add = |to: &mut [u8], from: &[u8]| to.iter_mut().zip(from).for_each(|(a, &b)| *a = join(*a, b));
    match axis {
        // From a copy: so the compiler sees that it can do many at once.
        0 => classes.par_chunks_exact_mut(dx).with_min_len(256).for_each_init(
            || vec![0; dx],
            |copy, row| {
                copy.copy_from_slice(row);
                add(&mut row[..dx.saturating_sub(step)], &copy[step.min(dx)..]);
            },
        ),
        1 => classes.par_chunks_exact_mut(layer).for_each(|layer| {
            for y in step..dy {
                let (to, from) = layer.split_at_mut(y * dx);
                add(&mut to[(y - step) * dx..(y - step + 1) * dx], &from[..dx]);
            }
        }),
        _ => {
            for z in step..dz {
                let (to, from) = classes.split_at_mut(z * layer);
                add(&mut to[(z - step) * layer..(z - step + 1) * layer], &from[..layer]);
            }
        }
    }
}

/// BrickClasses as a frame looks at them.
#[derive(Debug, Clone)]
pub(crate) struct SkipTable {
    /// Whether anything shows anywhere.
    pub(super) any: bool,
    /// Whether something shows in every brick.
    pub(super) all: bool,
    pub(super) fine: Windows,
    pub(super) coarse: Windows,
}

/// Sides of windows, in bricks and in coarse bricks.
pub(crate) type Sides = [[usize; 3]; 2];

impl SkipTable {
    /// `contents` in windows of `sides`.
    pub(crate) fn new(contents: &BrickClasses, sides: Sides) -> Self {
        let (dims, classes) = contents.coarse();
        Self {
            any: contents.shown > 0,
            all: contents.shown == contents.classes.len(),
            fine: Windows::new(contents.dims, contents.classes.clone(), sides[0], BRICK, false),
            coarse: Windows::new(dims, classes, sides[1], COARSE * BRICK, true),
        }
    }

    /// The greatest class of what lookups between index coordinates `lo` and `hi` can touch, or a greater one.
    pub(super) fn class(&self, lo: [f64; 3], hi: [f64; 3]) -> u8 {
        match self.fine.class(lo, hi) {
            u8::MAX => self.coarse.class(lo, hi) & SHOWN,
            class => class,
        }
    }

    /// Sides of its windows.
    pub(crate) fn sides(&self) -> Sides {
        [self.fine.sides, self.coarse.sides]
    }
}

/// The runs of a frame's slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Runs {
    /// Slices of a run.
    pub(super) slices: i64,
    /// Runs of a coarse run.
    pub(super) coarse: i64,
    /// Slices that one of them needs besides its own.
    pub(super) back: i64,
    /// Whether a run's slices are worth a look each.
    pub(super) thick: bool,
    /// Sides of windows for the boxes of runs and of coarse runs.
    pub(crate) sides: Sides,
}

impl Runs {
    /// Runs of `stack`. With slabs `between` slices each reaches back to the slice before; where slabs `merge` they suit threes and nines.
    pub(crate) fn new(stack: &Stack, between: bool, merge: bool) -> Self {
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let along = |f: &HalfSpace, x: f64, y: f64| (f.g + if stack.perspective { f.b * x + f.c * y } else { 0.0 }).abs() * stack.spacing;
        let cells = stack.index.iter().map(|f| along(f, 0.5 * w, 0.5 * h)).fold(0.0, f64::max);
        // No frame has more.
        let thin = ((THIN / cells) as i64).min(MAX_SLICES as i64);
        let slices = match thin {
            _ if !merge => thin.max(1),
            NINE.. => thin / NINE * NINE,
            _ => THREE,
        };
        // Nines do not lie across coarse runs; smaller ones tell more where slices are far apart.
        let coarse = if merge && slices == THREE && thin >= 2 * THREE { 4 * THREE } else { 8 };
        let back = i64::from(between);
        let scale = if stack.perspective { stack.far } else { 1.0 };
        let sides = [1, coarse].map(|runs| {
            let planes = (slices * runs - 1 + back) as f64;
            let brick = (if runs == 1 { BRICK } else { COARSE * BRICK }) as f64;
            array::from_fn(|i| {
                let f = &stack.index[i];
                let steepest = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].iter().map(|&(x, y)| along(f, x, y)).fold(0.0, f64::max);
                let cells = scale * (SIDE - 1) as f64 * (f.b.abs() + f.c.abs()) + planes * steepest;
                // The fewest bricks that such a box and the slack around it touch, wherever they lie; one more is the most.
                let least = (((cells + WIDER) / brick) as usize + 1).min(stack.dims[i]);
                // Nearer boxes are smaller: windows that are not too large for them, nor too small for this one.
                if stack.perspective { 1 << least.ilog2() } else { least }
            })
        });
        Self { slices, coarse, back, thick: merge && thin < THREE, sides }
    }
}

/// More cells than the slack of [`Windows`] on both sides together.
const WIDER: f64 = 1e-2;
/// Cells along the rays' main axis that a run crosses at most, if it has more than one slice: to look at fewer does not pay.
const THIN: f64 = 1.5;

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
    /// `count` boxes: `at` and `step` in cells. `beside` tells that they are a brick larger than windows at most; others are looked at as if they
    /// held anything.
    pub(super) fn new(windows: &'w Windows, (at, step): ([f64; 8], [f64; 8]), count: usize, beside: bool) -> Self {
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
    use super::*;
    use crate::lanes::Level;
    use crate::volume::Voxels;

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
