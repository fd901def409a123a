//! The greatest classes of windows of bricks, fine and coarse.

use super::BrickClasses;
use crate::volume::bricks::BRICK;
use rayon::prelude::*;
use std::array;

/// Bricks of a coarse brick along each axis.
pub(super) const COARSE: usize = 4;

/// In a coarse brick something shows.
pub(crate) const SHOWN: u8 = 1;
/// In a coarse brick there are bricks of which nothing shows.
pub(super) const HIDDEN: u8 = 2;

/// The greatest classes of windows of bricks.
#[derive(Debug, Clone)]
pub(crate) struct Windows {
    pub(super) dims: [usize; 3],
    /// Sides of a window in bricks.
    pub(super) sides: [usize; 3],
    /// Cells along a brick's side.
    pub(super) cells: usize,
    /// The last brick, twice, to clamp first and last bricks to.
    pub(super) top: [f32; 8],
    /// By how much boxes of f32 coordinates are too small at most, in bricks.
    pub(super) slack: f64,
    /// Greatest class of the window that begins at each brick, x fastest; and a 0 more, because two bytes are read at once.
    pub(super) classes: Vec<u8>,
    /// Whether classes of bricks are joined bit by bit, and not by the greatest.
    flags: bool,
}

impl Windows {
    pub(super) fn new(dims: [usize; 3], mut classes: Vec<u8>, sides: [usize; 3], cells: usize, flags: bool) -> Self {
        let [x, y, z] = dims.map(|n| (n - 1) as f32);
        for (axis, side) in sides.into_iter().enumerate() {
            let mut now = 1;
            while now < side {
                let step = now.min(side - now);
                // Each by a function of its own, which the compiler sees: one that it is handed would be called for every brick.
                if flags {
                    widen(&mut classes, dims, axis, step, |a, b| a | b);
                } else {
                    widen(&mut classes, dims, axis, step, |a, b| a.max(b));
                }
                now += step;
            }
        }
        classes.push(0);
        // A thousandth of a cell for the texture coordinates' own rounding.
        let slack = 1e-3 / cells as f64 + 1e-6 * dims.into_iter().max().unwrap_or(1) as f64;
        Self { dims, sides, cells, top: [x, y, z, 0.0, x, y, z, 0.0], slack, classes, flags }
    }

    /// Whether classes are [`SHOWN`] and [`HIDDEN`], joined bit by bit.
    pub(crate) fn holds_flags(&self) -> bool {
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
    pub(super) fn class(&self, lo: [f64; 3], hi: [f64; 3]) -> u8 {
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

/// The skip table: greatest classes of windows of fine bricks and of coarse ones.
#[derive(Debug, Clone)]
pub(crate) struct SkipTable {
    /// Whether anything shows anywhere.
    pub(crate) any: bool,
    /// Whether something shows in every brick.
    pub(crate) all: bool,
    pub(crate) fine: Windows,
    pub(crate) coarse: Windows,
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
    pub(crate) fn class(&self, lo: [f64; 3], hi: [f64; 3]) -> u8 {
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
