//! The rays of a block: between which slices each pixel is covered, and how much of the ray lies beyond the outer planes.
//!
//! A pixel is covered by slice k exactly where the edge functions of the slice's polygon say so. Because the box is convex those
//! slices follow each other, so two numbers a pixel replace a test per slice. They come from the ray's entry and exit in units
//! of slices; where rounding leaves one in doubt, the edge functions of that very slice decide.

use crate::fragment::PixelBlock;
use crate::fragment::batch::{BATCH, SIDE};
use crate::proxy::Stack;

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
}

/// The box seen from the picture, prepared once a frame.
#[derive(Debug)]
pub(crate) struct Beams<'s> {
    stack: &'s Stack,
    sides: Vec<Side>,
}

/// Slices that matter to a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BlockRange {
    /// First and last slice that covers any pixel; empty when the first is above the last.
    pub(crate) any: (i64, i64),
    /// First and last slice that covers every pixel with a whole slab; empty when the first is above the last.
    pub(crate) whole: (i64, i64),
    /// Fragments the block's slices leave in all.
    pub(crate) fragments: u64,
}

impl<'s> Beams<'s> {
    pub(crate) fn new(stack: &'s Stack) -> Self {
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let far = stack.far.abs().max(stack.near.abs());
        let sides = stack
            .half_spaces
            .iter()
            .map(|s| {
                let plane = s.b.abs() * w + s.c.abs() * h;
                let size = if stack.perspective { s.a.abs() + far * (s.g.abs() + plane) } else { s.a.abs() + far * s.g.abs() + plane };
                Side { a: s.a, b: s.b, c: s.c, g: s.g, error: size * 1e-14 }
            })
            .collect();
        Self { stack, sides }
    }

    /// Fills `pixels` for the block whose first pixel is (x0,y0). `inside(i)` tells which lanes belong to the picture and tile.
    pub(crate) fn block(&self, x0: u32, y0: u32, inside: impl Fn(usize) -> bool, pixels: &mut PixelBlock) -> BlockRange {
        let stack = self.stack;
        let count = stack.count as i64;
        pixels.doubt = 0;
        let mut any = (i64::MAX, i64::MIN);
        let mut whole = (i64::MIN, i64::MAX);
        let mut fragments = 0;
        for i in 0..BATCH {
            let (x, y) = (f64::from(x0) + (i % SIDE) as f64 + 0.5, f64::from(y0) + (i / SIDE) as f64 + 0.5);
            let (px, py) = stack.view.plane(x, y);
            if stack.perspective {
                pixels.slant[i] = (1.0 + (px * px + py * py)).sqrt() as f32;
            } else {
                pixels.plane_squared[i] = (px * px + py * py) as f32;
            }
            let ray = if inside(i) { self.ray(x, y) } else { Ray::MISS };
            let (first, last) = (ray.first.max(0), ray.last.min(count - 1));
            if first > last {
                (pixels.first[i], pixels.last[i]) = (1, 0);
                whole = (i64::MAX, i64::MIN);
                continue;
            }
            (pixels.first[i], pixels.last[i]) = (first as i32, last as i32);
            if first == last {
                let length = (ray.exit - ray.entry) as f32;
                (pixels.first_length[i], pixels.last_length[i]) = (length, length);
            } else {
                pixels.first_length[i] = ((first as f64 + 0.5) - ray.entry) as f32;
                pixels.last_length[i] = (ray.exit - (last as f64 - 0.5)) as f32;
            }
            any = (any.0.min(first), any.1.max(last));
            whole = (whole.0.max(first + 1), whole.1.min(last - 1));
            if ray.doubt {
                pixels.doubt |= 1 << i;
                whole = (i64::MAX, i64::MIN);
                fragments += (first..=last).filter(|&k| stack.covers(k as u64, x, y)).count() as u64;
            } else {
                fragments += (last - first + 1) as u64;
            }
        }
        BlockRange { any, whole, fragments }
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
            // The ray runs along this side, or as good as: no depth at which it crosses can be trusted.
            if step.abs() < 8.0 * s.error {
                doubt = true;
                continue;
            }
            let at = -f0 / step - 0.5;
            error = error.max(s.error / step.abs());
            if step > 0.0 {
                entry = f64::max(entry, at);
            } else {
                exit = f64::min(exit, at);
            }
        }
        let covers = |k: f64| k >= 0.0 && k < stack.count as f64 && stack.covers(k as u64, x, y);
        // The nearest whole slices inside [entry, exit], those within rounding of an end by their edge functions.
        let close = libm::rint(entry);
        let first = if (entry - close).abs() > error {
            libm::ceil(entry)
        } else if covers(close) {
            close
        } else {
            close + 1.0
        };
        let close = libm::rint(exit);
        let last = if (exit - close).abs() > error {
            libm::floor(exit)
        } else if covers(close) {
            close
        } else {
            close - 1.0
        };
        Ray { entry, exit, first: first as i64, last: last as i64, doubt }
    }
}

/// One ray, in slices.
struct Ray {
    entry: f64,
    exit: f64,
    first: i64,
    last: i64,
    doubt: bool,
}

impl Ray {
    const MISS: Self = Self { entry: 0.0, exit: 0.0, first: 1, last: 0, doubt: false };
}

#[cfg(test)]
mod tests;
