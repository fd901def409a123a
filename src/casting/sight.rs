//! Rays through pixels: where each enters and leaves what is visible of the box, in f64.

use super::Piece;
use crate::proxy::{Edge, HalfSpace, Stack};
use crate::volume::Grid;

/// Where a ray is in the volume. Depths are along the view direction, world units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Index coordinates at depth 0.
    pub(super) start: [f64; 3],
    /// Their change per unit of depth.
    pub(super) slope: [f64; 3],
    /// Length of the ray per unit of depth.
    pub(super) stretch: f64,
    /// Distance from the line of sight at depth 0, squared.
    pub(super) aside: f64,
    /// Depths at which it enters and leaves.
    pub(super) entry: f64,
    pub(super) exit: f64,
    /// What these are off by at most.
    pub(super) error: f64,
    /// Its position in the window.
    pub(super) window: (f64, f64),
}

impl Ray {
    /// Index coordinates at depth `d`.
    pub(super) fn at(&self, d: f64) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| self.start[axis] + d * self.slope[axis])
    }

    /// Depth at which its coordinate along `axis` is `index`.
    pub(super) fn reaches(&self, axis: usize, index: f64) -> f64 {
        (index - self.start[axis]) / self.slope[axis]
    }

    /// The axis of the volume along which it passes most voxels; of equal ones the first.
    pub(super) fn major(&self) -> usize {
        let [x, y, z] = self.slope.map(f64::abs);
        if x >= y && x >= z {
            0
        } else if y >= z {
            1
        } else {
            2
        }
    }

    /// The piece between two depths, in slabs of `thickness`, looked up at `place`; `None` for what is left of it within the box, if that is
    /// nothing.
    pub(super) fn piece(&self, (near, far): (f64, f64), thickness: f64, place: [f64; 3]) -> Option<Piece> {
        let (near, far) = (near.max(self.entry), far.min(self.exit));
        let length = (far - near) * self.stretch / thickness;
        (length > 0.0).then_some(Piece { place, depth: 0.5 * (near + far), length })
    }
}

/// The box and the clip planes as rays meet them.
pub(super) struct Sight<'s> {
    stack: &'s Stack,
    /// Depths between which something of the box is seen.
    depths: (f64, f64),
    /// Half-spaces, and what rounding adds to each anywhere in the picture at most.
    sides: Vec<(HalfSpace, f64)>,
}

impl<'s> Sight<'s> {
    /// What the view of `stack` shows of a volume on `grid`.
    pub(super) fn new(stack: &'s Stack, grid: &Grid) -> Self {
        let depths = Stack::depth_range(grid, &stack.view).unwrap_or((0.0, 0.0));
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let far = depths.0.abs().max(depths.1.abs());
        let error = |s: &HalfSpace| {
            let plane = s.b.abs() * w + s.c.abs() * h;
            1e-14 * if stack.perspective { s.a.abs() + far * (s.g.abs() + plane) } else { s.a.abs() + far * s.g.abs() + plane }
        };
        Self { stack, depths, sides: stack.half_spaces.iter().map(|s| (*s, error(s))).collect() }
    }

    /// Whether window position (x,y) at depth `d` lies inside, by edge functions and fill rule.
    pub(super) fn covers(&self, (x, y): (f64, f64), d: f64) -> bool {
        self.stack.half_spaces.iter().all(|h| Edge::new(h.at_depth(self.stack.perspective, d)).contains(x, y))
    }

    /// The ray through window position (x,y); `None` where it passes the box by.
    pub(super) fn ray(&self, x: f64, y: f64) -> Option<Ray> {
        let stack = self.stack;
        let (near, far) = self.depths;
        let (mut entry, mut exit) = (near, far);
        let (mut error, mut doubt): (f64, bool) = (1e-9 * stack.spacing, false);
        // As a function of depth: base + slope d.
        let along = |s: &HalfSpace| {
            let plane = s.b * x + s.c * y;
            if stack.perspective { (s.a, s.g + plane) } else { (s.a + plane, s.g) }
        };
        for (side, rounding) in &self.sides {
            let (base, slope) = along(side);
            let (f0, f1) = (base + slope * near, base + slope * far);
            if f0 > *rounding && f1 > *rounding {
                continue;
            }
            if f0 < -rounding && f1 < -rounding {
                return None;
            }
            if (slope * stack.spacing).abs() < 8.0 * rounding {
                // The ray runs along this side: no depth at which it crosses can be trusted.
                doubt = true;
                continue;
            }
            let at = near - f0 / slope;
            error = error.max(rounding / slope.abs());
            if slope > 0.0 {
                entry = entry.max(at);
            } else {
                exit = exit.min(at);
            }
        }
        if !(entry <= exit + error) || doubt && !self.covers((x, y), 0.5 * (entry + exit)) {
            return None;
        }
        let (px, py) = stack.view.plane(x, y);
        let squared = px * px + py * py;
        let (stretch, aside) = if stack.perspective { ((1.0 + squared).sqrt(), 0.0) } else { (1.0, squared) };
        let index = stack.index.map(|f| along(&f));
        Some(Ray { start: index.map(|i| i.0), slope: index.map(|i| i.1), stretch, aside, entry, exit, error, window: (x, y) })
    }
}
