//! Where the rays of a block enter and leave, eight at a time: the slices between, and the lengths of the outermost pieces.

use crate::fragment::{PixelBlock, RaySummary};
use crate::lanes::{BATCH, Kernel, Lanes, SIDE, row_mut};
use crate::plan::EndPieces;

/// Sides that a block's rays may cross; blocks that cross more are done ray by ray.
const SIDES: usize = 12;

/// A side that every ray of a block crosses at a depth that can be trusted.
#[derive(Debug, Clone, Copy, Default)]
struct Crossing {
    /// Whether rays enter there.
    enters: bool,
    /// The side's part b x + c y at the block's first pixel, and its steps from column to column and row to row.
    first: f64,
    b: f64,
    c: f64,
    /// In slices the ray crosses at `base + plane * factor`; in perspective at `(base / (factor + plane) - near) per_slice - 1/2`.
    base: f64,
    factor: f64,
    /// The latest of the block's entries there, or the earliest of its exits.
    inmost: f64,
}

/// All sides that a block's rays cross, and what else the ends of its rays depend on.
#[derive(Debug, Clone)]
pub(super) struct Crossings {
    sides: [Crossing; SIDES],
    len: usize,
    perspective: bool,
    near: f64,
    per_slice: f64,
    count: f64,
    ends: EndPieces,
    /// Bound on the rounding error of entries and exits, in slices.
    pub(super) error: f64,
    /// Pixels that belong to the picture and the tile, one bit each.
    pub(super) inside: u64,
}

impl Crossings {
    pub(super) fn new((perspective, near, spacing, count): (bool, f64, f64, u64), ends: EndPieces, inside: u64) -> Self {
        Self {
            sides: [Crossing::default(); SIDES],
            len: 0,
            perspective,
            near,
            per_slice: 1.0 / spacing,
            count: count as f64,
            ends,
            error: 1e-9,
            inside,
        }
    }

    /// Adds a side, of which `inmost` is the latest of the block's entries or the earliest of its exits; false when there are too many.
    pub(super) fn add(&mut self, enters: bool, [first, b, c]: [f64; 3], (base, factor): (f64, f64), inmost: f64) -> bool {
        let free = self.sides.get_mut(self.len);
        self.len += 1;
        free.map(|side| *side = Crossing { enters, first, b, c, base, factor, inmost }).is_some()
    }

    /// Leaves out sides that every ray crosses before it has crossed another one that lets in, or after one that lets out: no ray enters
    /// the box before `latest`, nor stays in it after `earliest`.
    pub(super) fn keep_between(&mut self, latest: f64, earliest: f64) {
        let mut kept = 0;
        for i in 0..self.len.min(SIDES) {
            let side = self.sides[i];
            // The margin is larger than the kernel's rounding error.
            let matters = if side.enters { side.inmost >= latest - 4.0 * self.error } else { side.inmost <= earliest + 4.0 * self.error };
            if matters {
                self.sides[kept] = side;
                kept += 1;
            }
        }
        self.len = kept;
    }

    /// The latest entry and the earliest exit of any ray.
    pub(super) fn inmost(&self) -> (f64, f64) {
        self.sides[..self.len].iter().fold((-0.5, self.count - 0.5), |(entry, exit), side| {
            if side.enters { (f64::max(entry, side.inmost), exit) } else { (entry, f64::min(exit, side.inmost)) }
        })
    }

    /// Position in slices at which a ray crosses `side`, where the side's part along the window is `plane`.
    fn at(&self, side: &Crossing, plane: f64) -> f64 {
        if self.perspective {
            (side.base / (side.factor + plane) - self.near) * self.per_slice - 0.5
        } else {
            side.base + plane * side.factor
        }
    }

    /// Entry and exit of one ray, in slices: what the kernel computes for it.
    pub(super) fn ray(&self, i: usize) -> (f64, f64) {
        let (mut entry, mut exit) = (-0.5, self.count - 0.5);
        for side in &self.sides[..self.len] {
            let at = self.at(side, side.first + side.c * (i / SIDE) as f64 + side.b * (i % SIDE) as f64);
            if side.enters {
                entry = if at > entry { at } else { entry };
            } else {
                exit = if at < exit { at } else { exit };
            }
        }
        (entry, exit)
    }
}

/// Fills `spans` alone, for a block whose rays all belong to the picture and stay in the box for more than a slice.
pub(super) struct RaySpans;

/// The largest whole number at or below `x` plus one, for x from -1 up; `off` widens to how far such x lie above whole numbers.
#[inline(always)]
fn next_whole<L: Lanes>(x: L::D, off: &mut (L::D, L::D)) -> L::I {
    let x = L::add_d(x, L::splat_d(1.0));
    let whole = L::trunc_d(x);
    let above = L::sub_d(x, L::to_d(whole));
    *off = (L::min_d(above, off.0), L::max_d(above, off.1));
    whole
}

impl Kernel<Crossings, PixelBlock> for RaySpans {
    #[inline(always)]
    fn run<L: Lanes>(w: &Crossings, pixels: &mut PixelBlock) {
        if w.perspective { spans::<L, true>(w, pixels) } else { spans::<L, false>(w, pixels) }
    }
}

#[inline(always)]
fn spans<L: Lanes, const PERSPECTIVE: bool>(w: &Crossings, pixels: &mut PixelBlock) {
    let (least, greatest) = (L::splat_i(i32::MIN), L::splat_i(i32::MAX));
    let mut first_range = (greatest, least);
    let mut last_range = (greatest, least);
    let (mut firsts, mut lasts) = (L::splat_i(0), L::splat_i(0));
    let mut off = (L::splat_d(1.0), L::splat_d(0.0));
    for r in 0..SIDE {
        let (entry, exit) = ends::<L, PERSPECTIVE>(w, r);
        let first = next_whole::<L>(entry, &mut off);
        let after = next_whole::<L>(exit, &mut off);
        first_range = (L::min_i(first_range.0, first), L::max_i(first_range.1, first));
        last_range = (L::min_i(last_range.0, after), L::max_i(last_range.1, after));
        (firsts, lasts) = (L::add_i(firsts, first), L::add_i(lasts, after));
    }
    // So close to a slice that edge functions may have to decide, and a little farther: adding one rounds.
    let error = 2.0 * w.error + 1e-15 * w.count;
    let close = L::lt_d(off.0, L::splat_d(error)) | L::lt_d(L::splat_d(1.0 - error), off.1);
    let sum = |x: L::I| lanes::<L>(x).iter().map(|&n| i64::from(n)).sum::<i64>();
    let (firsts, afters) = (sum(firsts), sum(lasts));
    pixels.summary = RaySummary {
        first: (lowest::<L>(first_range.0), highest::<L>(first_range.1)),
        last: (lowest::<L>(last_range.0) - 1, highest::<L>(last_range.1) - 1),
        fragments: afters.abs_diff(firsts),
        lasts: afters - BATCH as i64,
        covered: u64::MAX,
        close: u64::from(close),
    };
}

const COLUMNS: [f64; SIDE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Fills `first`, `last`, their lengths and `spans`.
pub(super) struct RayEnds;

/// Entries and exits of a row of rays.
#[inline(always)]
fn ends<L: Lanes, const PERSPECTIVE: bool>(w: &Crossings, r: usize) -> (L::D, L::D) {
    let (mut entry, mut exit) = (L::splat_d(-0.5), L::splat_d(w.count - 0.5));
    let columns = L::load_d(&COLUMNS);
    for side in &w.sides[..w.len.min(SIDES)] {
        let plane = L::add_d(L::splat_d(side.first + side.c * r as f64), L::mul_d(L::splat_d(side.b), columns));
        let at = if PERSPECTIVE {
            let depth = L::div_d(L::splat_d(side.base), L::add_d(L::splat_d(side.factor), plane));
            L::sub_d(L::mul_d(L::sub_d(depth, L::splat_d(w.near)), L::splat_d(w.per_slice)), L::splat_d(0.5))
        } else {
            L::add_d(L::splat_d(side.base), L::mul_d(plane, L::splat_d(side.factor)))
        };
        if side.enters {
            entry = L::max_d(at, entry);
        } else {
            exit = L::min_d(at, exit);
        }
    }
    (entry, exit)
}

/// The whole number next to `x`, and whether it lies within `error` of it.
#[inline(always)]
fn nearest<L: Lanes>(x: L::D, error: L::D) -> (L::I, L::D, u8) {
    // Both ends lie within -1/2 and the count; truncation after a shift rounds.
    let whole = L::sub_i(L::trunc_d(L::add_d(x, L::splat_d(1.5))), L::splat_i(1));
    let near = L::to_d(whole);
    let off = L::max_d(L::sub_d(x, near), L::sub_d(near, x));
    (whole, near, L::le_d(off, error))
}

impl Kernel<Crossings, PixelBlock> for RayEnds {
    #[inline(always)]
    fn run<L: Lanes>(w: &Crossings, pixels: &mut PixelBlock) {
        let (zero, error, half) = (L::splat_d(0.0), L::splat_d(w.error), L::splat_d(0.5));
        let (least, greatest) = (L::splat_i(i32::MIN), L::splat_i(i32::MAX));
        let mut first_range = (greatest, least);
        let mut last_range = (greatest, least);
        let mut fragments = L::splat_i(0);
        let (mut covered, mut close) = (0u64, 0u64);
        for r in 0..SIDE {
            let (entry, exit) = if w.perspective { ends::<L, true>(w, r) } else { ends::<L, false>(w, r) };
            let hit = L::le_d(entry, L::add_d(exit, error)) & (w.inside >> (8 * r)) as u8;
            // A ray that misses may have any position; conversion to integers needs a limited range.
            let (entry, exit) = (L::min_d(entry, L::splat_d(w.count + 1.0)), L::max_d(exit, L::splat_d(-2.0)));
            let (near, near_d, entry_close) = nearest::<L>(entry, error);
            let after = L::from_bits(L::lt_d(near_d, entry));
            let first = L::select_i(after, L::add_i(near, L::splat_i(1)), near);
            let (near, near_d, exit_close) = nearest::<L>(exit, error);
            let before = L::from_bits(L::lt_d(exit, near_d));
            let last = L::select_i(before, L::sub_i(near, L::splat_i(1)), near);
            let empty = L::bits(L::gt_i(first, last));
            let between = if w.ends.whole() { 0 } else { empty & L::lt_d(error, L::sub_d(exit, entry)) };
            let unsettled = hit & (entry_close | exit_close | between);
            let settled = hit & !empty & !unsettled;
            let (first_d, last_d) = (L::to_d(first), L::to_d(last));
            let (to_first, from_last) = match w.ends {
                EndPieces::Whole | EndPieces::WholeBetween => (L::splat(1.0), L::splat(1.0)),
                EndPieces::Between => {
                    (L::narrow(L::max_d(L::sub_d(first_d, entry), zero)), L::narrow(L::max_d(L::sub_d(exit, last_d), zero)))
                }
                EndPieces::Partial => {
                    let single = L::eq_i(first, last);
                    let both = L::narrow(L::sub_d(exit, entry));
                    let to_first = L::narrow(L::sub_d(L::add_d(first_d, half), entry));
                    let from_last = L::narrow(L::sub_d(exit, L::sub_d(last_d, half)));
                    (L::select(single, both, to_first), L::select(single, both, from_last))
                }
            };
            L::store(to_first, row_mut(&mut pixels.first_length, r));
            L::store(from_last, row_mut(&mut pixels.last_length, r));
            let m = L::from_bits(settled);
            L::store_i(L::select_i(m, first, L::splat_i(1)), row_mut(&mut pixels.first, r));
            L::store_i(L::select_i(m, last, L::splat_i(0)), row_mut(&mut pixels.last, r));
            let count = L::add_i(L::sub_i(last, first), L::splat_i(1));
            fragments = L::add_i(fragments, L::select_i(m, count, L::splat_i(0)));
            first_range = (L::min_i(first_range.0, L::select_i(m, first, greatest)), L::max_i(first_range.1, L::select_i(m, first, least)));
            last_range = (L::min_i(last_range.0, L::select_i(m, last, greatest)), L::max_i(last_range.1, L::select_i(m, last, least)));
            covered |= u64::from(settled) << (8 * r);
            close |= u64::from(unsettled) << (8 * r);
        }
        pixels.summary = RaySummary {
            first: (lowest::<L>(first_range.0), highest::<L>(first_range.1)),
            last: (lowest::<L>(last_range.0), highest::<L>(last_range.1)),
            fragments: lanes::<L>(fragments).iter().map(|&n| u64::from(n as u32)).sum(),
            lasts: 0,
            covered,
            close,
        };
    }
}

#[inline(always)]
fn lanes<L: Lanes>(x: L::I) -> [i32; SIDE] {
    let mut to = [0; SIDE];
    L::store_i(x, &mut to);
    to
}

#[inline(always)]
fn lowest<L: Lanes>(x: L::I) -> i32 {
    lanes::<L>(x).into_iter().fold(i32::MAX, i32::min)
}

#[inline(always)]
fn highest<L: Lanes>(x: L::I) -> i32 {
    lanes::<L>(x).into_iter().fold(i32::MIN, i32::max)
}
