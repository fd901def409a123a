//! The rays of a block: between which slices each pixel is covered, and how much of the ray lies beyond the outer planes.
//!
//! A pixel is covered by slice k exactly where the edge functions of the slice's polygon say so. Because the box is convex those
//! slices follow each other, so two numbers a pixel replace a test per slice. They come from the ray's entry and exit in units
//! of slices; where rounding leaves one in doubt, the edge functions of that very slice decide.

mod ends;
mod path;

use crate::fragment::{PixelBlock, RaySummary};
use crate::lanes::{BATCH, Level, SIDE};
use crate::lean::LEAN;
use crate::plan::EndPieces;
use crate::proxy::Stack;
use ends::{Crossings, RayEnds, RaySpans};
pub(crate) use path::Path;

/// A half-space prepared for a frame.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// The edge function: see [`crate::proxy::HalfSpace`].
    a: f64,
    b: f64,
    c: f64,
    g: f64,
    /// Bound on the rounding error of the function anywhere in the picture.
    error: f64,
    /// Least and greatest of its part along the depth, between the stack's ends.
    rise: (f64, f64),
    /// Where parallel rays cross it, in slices: `base + plane * per_step`.
    base: f64,
    per_step: f64,
    /// Its change from slice to slice along parallel rays.
    step: f64,
    /// Least and greatest of b x + c y within a block, beside its first pixel's.
    across: (f64, f64),
}

/// The box seen from the picture, prepared once a frame.
pub(crate) struct RayIntervals<'s> {
    stack: &'s Stack,
    sides: Vec<Side>,
    radial: bool,
    piece_ends: EndPieces,
    ends: fn(&Crossings, &mut PixelBlock),
    spans: fn(&Crossings, &mut PixelBlock),
}

/// Slices that matter to a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BlockRange {
    /// First and last slice that covers any pixel; empty when the first is above the last.
    pub(crate) any: (i64, i64),
    /// First and last slice that covers every pixel with a whole slab; empty when the first is above the last.
    pub(crate) whole: (i64, i64),
    /// The last of the pixels' first slices.
    pub(crate) last_first: i64,
    /// Fragments the block's slices leave in all.
    pub(crate) fragments: u64,
    /// Pieces of rays that cross a corner of the box between two slices.
    pub(crate) corners: u64,
    /// Sum of the pixels' last slices, where `settled` is false.
    pub(crate) lasts: i64,
    /// Whether the block's pixels hold where their rays enter and leave.
    pub(crate) settled: bool,
}

impl BlockRange {
    pub(crate) const NONE: Self =
        Self { any: (1, 0), whole: (1, 0), last_first: i64::MIN, fragments: 0, corners: 0, lasts: 0, settled: true };
}

impl<'s> RayIntervals<'s> {
    /// Prepares `stack`, for rays in vectors of `level`; `radial` asks for the distances that radial fog needs.
    pub(crate) fn new(stack: &'s Stack, radial: bool, ends: EndPieces, level: Level) -> Self {
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let far = stack.far.abs().max(stack.near.abs());
        let sides = stack
            .half_spaces
            .iter()
            .map(|s| {
                let plane = s.b.abs() * w + s.c.abs() * h;
                let size = if stack.perspective { s.a.abs() + far * (s.g.abs() + plane) } else { s.a.abs() + far * s.g.abs() + plane };
                let (rise0, rise1) = (s.g * stack.near, s.g * stack.far);
                let step = s.g * stack.spacing;
                let per_step = -1.0 / step;
                let base = (s.a + rise0) * per_step - 0.5;
                let rise = (rise0.min(rise1), rise0.max(rise1));
                let (right, down) = (s.b * (SIDE - 1) as f64, s.c * (SIDE - 1) as f64);
                let across = (right.min(0.0) + down.min(0.0), right.max(0.0) + down.max(0.0));
                Side { a: s.a, b: s.b, c: s.c, g: s.g, error: size * 1e-14, rise, base, per_step, step, across }
            })
            .collect();
        Self {
            stack,
            sides,
            radial: radial && !LEAN,
            piece_ends: ends,
            ends: level.kernel::<RayEnds, _, _>(),
            spans: level.kernel::<RaySpans, _, _>(),
        }
    }

    /// As [`RayIntervals::block`], but where every ray is sure to stay in the box for a while, without the pixels' own first and last slices and
    /// lengths: most blocks show nothing on slices that do not cover them whole.
    pub(crate) fn range(&self, x0: u32, y0: u32, inside: u64, pixels: &mut PixelBlock) -> BlockRange {
        let (x, y) = (f64::from(x0) + 0.5, f64::from(y0) + 0.5);
        let mut crossings = self.none_crossed(inside);
        let found = self.crossings(x, y, &mut crossings);
        if found == Found::Clear && inside == u64::MAX {
            let (entry, exit) = crossings.inmost();
            if exit - entry > 1.0 + 4.0 * crossings.error {
                pixels.doubt = 0;
                (self.spans)(&crossings, pixels);
                let RaySummary { first, last, fragments, lasts, close, .. } = pixels.summary;
                if close == 0 {
                    // No ray ends on a slice that covers the block whole.
                    pixels.last = [i32::MAX; BATCH];
                    let (first, last) = (wide(first), wide(last));
                    let (any, whole) = ((first.0, last.1), self.whole(first.1, last.0));
                    return BlockRange { any, whole, last_first: first.1, fragments, corners: 0, lasts, settled: false };
                }
            }
        }
        self.settle(x, y, found, &crossings, pixels)
    }

    /// Fills `pixels` for the block whose first pixel is (x0,y0). Bit i of `inside` tells whether lane i belongs to the picture and tile.
    pub(crate) fn block(&self, x0: u32, y0: u32, inside: u64, pixels: &mut PixelBlock) -> BlockRange {
        let (x, y) = (f64::from(x0) + 0.5, f64::from(y0) + 0.5);
        let mut crossings = self.none_crossed(inside);
        let found = self.crossings(x, y, &mut crossings);
        self.settle(x, y, found, &crossings, pixels)
    }

    /// See [`RayIntervals::block`].
    fn settle(&self, x0: f64, y0: f64, found: Found, crossings: &Crossings, pixels: &mut PixelBlock) -> BlockRange {
        pixels.doubt = 0;
        match found {
            Found::Nothing => return BlockRange::NONE,
            Found::Clear => (self.ends)(crossings, pixels),
            Found::Doubtful => {
                (pixels.first, pixels.last) = ([1; BATCH], [0; BATCH]);
                pixels.summary = RaySummary { close: crossings.inside, ..RaySummary::NONE };
            }
        }
        let count = self.stack.count as i64;
        let RaySummary { first, last, mut fragments, mut covered, close: mut open, .. } = pixels.summary;
        let (mut first, mut last) = (wide(first), wide(last));
        let mut corners = 0;
        // Rays that the kernel could not decide are computed one by one.
        while open != 0 {
            let i = open.trailing_zeros() as usize;
            open &= open - 1;
            let (x, y) = (x0 + (i % SIDE) as f64, y0 + (i / SIDE) as f64);
            let ray = if found == Found::Clear {
                let (entry, exit) = crossings.ray(i);
                self.between(entry, exit, crossings.error, x, y, false)
            } else {
                self.ray(x, y)
            };
            let (f, l) = (ray.first.max(0), ray.last.min(count - 1));
            if f > l {
                (pixels.first[i], pixels.last[i]) = (1, 0);
                continue;
            }
            covered |= 1 << i;
            (pixels.first[i], pixels.last[i]) = (f as i32, l as i32);
            (pixels.first_length[i], pixels.last_length[i]) = self.lengths(&ray, f, l);
            first = (first.0.min(f), first.1.max(f));
            last = (last.0.min(l), last.1.max(l));
            if ray.doubt {
                pixels.doubt |= 1 << i;
                fragments += (f..=l).filter(|&k| self.stack.covers(k as u64, x, y)).count() as u64;
            } else if ray.corner {
                corners += 1;
            } else {
                fragments += (l - f + 1) as u64;
            }
        }
        if covered == 0 {
            return BlockRange::NONE;
        }
        let whole = if covered == u64::MAX && pixels.doubt == 0 { self.whole(first.1, last.0) } else { BlockRange::NONE.whole };
        BlockRange { any: (first.0, last.1), whole, last_first: first.1, fragments, corners, lasts: 0, settled: true }
    }

    /// The slices that cover every pixel of a block with a whole slab, from the last of the pixels' first slices and the first of their
    /// last ones.
    pub(crate) fn whole(&self, first: i64, last: i64) -> (i64, i64) {
        if self.piece_ends.whole() { (first, last) } else { (first + 1, last - i64::from(!self.piece_ends.between())) }
    }

    /// Lengths of the outermost pieces of a ray whose first and last slices are `first` and `last`.
    fn lengths(&self, ray: &Ray, first: i64, last: i64) -> (f32, f32) {
        // To the middle of the first slice's slab, and from that of the last.
        let (to_first, from_last) = (first as f64 - ray.entry, ray.exit - last as f64);
        let through = (ray.exit - ray.entry) as f32;
        match self.piece_ends {
            EndPieces::Whole | EndPieces::WholeBetween => (1.0, 1.0),
            // Rounding may put the face a hair behind the slice.
            EndPieces::Between if ray.corner && to_first < 0.0 => (0.0, through),
            EndPieces::Between if ray.corner && from_last < 0.0 => (through, 0.0),
            EndPieces::Between => (to_first.max(0.0) as f32, from_last.max(0.0) as f32),
            EndPieces::Partial if first == last => (through, through),
            EndPieces::Partial => (((first as f64 + 0.5) - ray.entry) as f32, (ray.exit - (last as f64 - 0.5)) as f32),
        }
    }

    /// Lengths of the block's rays per unit of depth, or squared distances from the picture's middle, where a stage wants them.
    pub(crate) fn plane(&self, x0: u32, y0: u32, pixels: &mut PixelBlock) {
        let (x0, y0) = (f64::from(x0) + 0.5, f64::from(y0) + 0.5);
        let view = &self.stack.view;
        if !(self.stack.perspective || self.radial) {
            return;
        }
        for i in 0..BATCH {
            let (px, py) = view.plane(x0 + (i % SIDE) as f64, y0 + (i / SIDE) as f64);
            if self.stack.perspective {
                pixels.slant[i] = (1.0 + (px * px + py * py)).sqrt() as f32;
            } else {
                pixels.plane_squared[i] = (px * px + py * py) as f32;
            }
        }
    }

    /// The sides that the rays of a block cross.
    ///
    /// Sides that no ray of the block runs along are crossed at a depth that can be trusted; a block with another side among
    /// them is left to [`RayIntervals::ray`], ray by ray.
    fn crossings(&self, x0: f64, y0: f64, found: &mut Crossings) -> Found {
        let stack = self.stack;
        let (near, far, spacing) = (stack.near, stack.far, stack.spacing);
        let per_slice = 1.0 / spacing;
        let mut error: f64 = 1e-9;
        // Latest of the sides' earliest entries in the block, earliest of their latest exits.
        let (mut latest, mut earliest) = (-0.5, stack.count as f64 - 0.5);
        for s in &self.sides {
            let first = s.b * x0 + s.c * y0;
            let (least, most) = (first + s.across.0, first + s.across.1);
            let (enters, p, q, base, factor);
            if stack.perspective {
                let (low, high) = (s.g + least, s.g + most);
                let (f0, f1) = (s.a + near * low, s.a + far * low);
                let (g0, g1) = (s.a + near * high, s.a + far * high);
                if f0.min(f1).min(g0).min(g1) > s.error {
                    continue;
                }
                if f0.max(f1).max(g0).max(g1) < -s.error {
                    return Found::Nothing;
                }
                if low * high <= 0.0 || low.abs().min(high.abs()) * spacing < 8.0 * s.error {
                    return Found::Doubtful;
                }
                error = error.max(s.error / (low.abs().min(high.abs()) * spacing));
                let at = |slope: f64| (-s.a / slope - near) * per_slice - 0.5;
                (enters, p, q, base, factor) = (low > 0.0, at(low), at(high), -s.a, s.g);
            } else {
                let (low, high) = (s.a + least, s.a + most);
                if low + s.rise.0 > s.error {
                    continue;
                }
                if high + s.rise.1 < -s.error {
                    return Found::Nothing;
                }
                if s.step.abs() < 8.0 * s.error {
                    return Found::Doubtful;
                }
                error = error.max(s.error * s.per_step.abs());
                (base, factor) = (s.base, s.per_step);
                (enters, p, q) = (s.step > 0.0, base + least * s.per_step, base + most * s.per_step);
            }
            let inmost = if enters {
                latest = f64::max(latest, p.min(q));
                p.max(q)
            } else {
                earliest = f64::min(earliest, p.max(q));
                p.min(q)
            };
            if !found.add(enters, [first, s.b, s.c], (base, factor), inmost) {
                return Found::Doubtful;
            }
        }
        found.error = error;
        if latest > earliest + error {
            return Found::Nothing;
        }
        found.keep_between(latest, earliest);
        Found::Clear
    }

    /// What [`RayIntervals::crossings`] begins with.
    fn none_crossed(&self, inside: u64) -> Crossings {
        let Stack { perspective, near, spacing, count, .. } = *self.stack;
        Crossings::new((perspective, near, spacing, count), self.piece_ends, inside)
    }

    /// Entry, exit and covering slices of the ray through window position (x,y).
    fn ray(&self, x: f64, y: f64) -> Ray {
        let stack = self.stack;
        let (near, far, spacing) = (stack.near, stack.far, stack.spacing);
        // In slices: plane k is at k, slab k from k - 1/2 to k + 1/2.
        let (mut entry, mut exit) = (-0.5, stack.count as f64 - 0.5);
        let mut error: f64 = 1e-9;
        let mut doubt = false;
        for s in &self.sides {
            let plane = s.b * x + s.c * y;
            // f = base + slope d.
            let (base, slope) = if stack.perspective { (s.a, s.g + plane) } else { (s.a + plane, s.g) };
            let (f0, f1) = (base + slope * near, base + slope * far);
            if f0 > s.error && f1 > s.error {
                continue;
            }
            if f0 < -s.error && f1 < -s.error {
                return Ray::MISS;
            }
            let step = slope * spacing;
            // The ray is parallel to this side, or nearly: no depth at which it crosses can be trusted.
            if step.abs() < 8.0 * s.error {
                doubt = true;
                continue;
            }
            // Beyond the stack it does not matter how far.
            let at = (-f0 / step - 0.5).clamp(-1.0, stack.count as f64);
            error = error.max(s.error / step.abs());
            if step > 0.0 {
                entry = f64::max(entry, at);
            } else {
                exit = f64::min(exit, at);
            }
        }
        self.between(entry, exit, error, x, y, doubt)
    }

    /// The slices between `entry` and `exit`; those within `error` of an end by their edge functions at (x,y).
    #[inline]
    fn between(&self, entry: f64, exit: f64, error: f64, x: f64, y: f64, doubt: bool) -> Ray {
        let count = self.stack.count as f64;
        let covers = |k: i64| k >= 0 && (k as f64) < count && self.stack.covers(k as u64, x, y);
        if !(entry <= exit + error) {
            return Ray::MISS;
        }
        // Both ends lie within -1/2 and the count; truncation after a shift rounds without a library call.
        let close = (entry + 1.5) as i64 - 1;
        let first =
            if (entry - close as f64).abs() > error { close + i64::from(entry > close as f64) } else { close + i64::from(!covers(close)) };
        let close = (exit + 1.5) as i64 - 1;
        let last =
            if (exit - close as f64).abs() > error { close - i64::from(exit < close as f64) } else { close - i64::from(!covers(close)) };
        if first > last && !doubt && !self.piece_ends.whole() && exit - entry > error {
            // The ray cuts a corner of the box between two slices: its one piece is looked up on the nearest of them.
            let nearest = ((0.5 * (entry + exit) + 0.5) as i64).clamp(0, self.stack.count as i64 - 1);
            return Ray { entry, exit, first: nearest, last: nearest, doubt, corner: true };
        }
        Ray { entry, exit, first, last, doubt, corner: false }
    }
}

/// What is known of the sides a block's rays cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    /// All rays miss.
    Nothing,
    /// Every crossing is known to within an error.
    Clear,
    /// Some ray runs along a side.
    Doubtful,
}

fn wide((a, b): (i32, i32)) -> (i64, i64) {
    (i64::from(a), i64::from(b))
}

/// One ray, in slices.
struct Ray {
    entry: f64,
    exit: f64,
    first: i64,
    last: i64,
    doubt: bool,
    /// Whether the ray passes between two slices and meets none.
    corner: bool,
}

impl Ray {
    const MISS: Self = Self { entry: 0.0, exit: 0.0, first: 1, last: 0, doubt: false, corner: false };
}

#[cfg(test)]
mod tests;
