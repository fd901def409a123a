//! One ray's way through the box, in depths; and its slabs' numbers and pieces, wherever they lie along it.

use super::RayIntervals;
use crate::plan::EndPieces;
use crate::proxy::{Edge, HalfSpace, RaySlabs};

/// Depths at which a ray enters what there is of the box and leaves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Path {
    pub(crate) entry: f64,
    pub(crate) exit: f64,
}

/// The first and the last slab that a ray has a sample of, and the lengths of its pieces there, in slabs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RayEnd {
    pub(crate) first: i64,
    pub(crate) last: i64,
    pub(crate) first_length: f32,
    pub(crate) last_length: f32,
    /// Whether the ray passes between two samples and meets none: its one piece is looked up at the nearest.
    pub(crate) corner: bool,
}

impl RayIntervals<'_> {
    /// The way of the ray through window position (x,y); `None` where it misses.
    pub(crate) fn path(&self, x: f64, y: f64) -> Option<Path> {
        let stack = self.stack;
        let (mut entry, mut exit) = (stack.near, stack.far);
        for side in &self.sides {
            let space = HalfSpace { a: side.a, b: side.b, c: side.c, g: side.g };
            let (base, slope) = space.along(stack.perspective, x, y);
            let (near, far) = (base + slope * stack.near, base + slope * stack.far);
            if near > side.error && far > side.error {
                continue;
            }
            if near < -side.error && far < -side.error {
                return None;
            }
            if (slope * stack.spacing).abs() < 8.0 * side.error {
                // The ray runs along this side: the fill rule has it in or out.
                let middle = space.at_depth(stack.perspective, 0.5 * (stack.near + stack.far));
                if !Edge::new(middle).contains(x, y) {
                    return None;
                }
                continue;
            }
            let at = -base / slope;
            if slope > 0.0 {
                entry = f64::max(entry, at);
            } else {
                exit = f64::min(exit, at);
            }
        }
        (entry < exit).then_some(Path { entry, exit })
    }

    /// The pieces of a ray on its way along `path`, as long as its `slabs` say; `None` where there is none.
    pub(crate) fn pieces(&self, path: Path, slabs: RaySlabs) -> Option<RayEnd> {
        let count = self.stack.count as i64;
        let position = |depth: f64| (depth - slabs.near) / slabs.spacing - 0.5;
        let (entry, exit) = (position(path.entry), position(path.exit));
        // Samples lie within a slab of the stack's ends at least: casts keep them.
        let first = (libm::ceil(entry) as i64).max(0);
        let last = (libm::floor(exit) as i64).min(count - 1);
        let whole = self.piece_ends == EndPieces::Whole;
        if first > last {
            let nearest = (libm::floor(0.5 * (entry + exit) + 0.5) as i64).clamp(0, count - 1);
            let through = (exit - entry) as f32;
            let piece = RayEnd { first: nearest, last: nearest, first_length: through, last_length: through, corner: true };
            return (!whole && exit > entry).then_some(piece);
        }
        let (first_length, last_length) = match first == last {
            _ if whole => (1.0, 1.0),
            true => ((exit - entry) as f32, (exit - entry) as f32),
            false => (((first as f64 + 0.5) - entry) as f32, (exit - (last as f64 - 0.5)) as f32),
        };
        Some(RayEnd { first, last, first_length, last_length, corner: false })
    }
}
