//! A ray in intervals, cut into pieces that lie in one cell, or certainly in one of a few.
//!
//! ```text
//!   depth  ---[entry]------|[face]|-----------|[face]|----[exit]---
//!               maybe       maybe     one       maybe     maybe
//!               inside     in either  cell     in either  inside
//! ```
//! The depth at which a ray meets a face is known up to rounding alone. Pieces therefore end at both bounds of that depth: between them lies
//! a sliver whose cells are both sides' and which may or may not be inside the box. Ends of pieces are f64 numbers of our own choice, so the
//! integral is cut at them exactly.

use super::interval::Interval;
use crate::scene::View;
use crate::volume::Grid;
use glam::DVec3;

/// A ray: what it is in the real numbers that the view's and the grid's f64 numbers say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Its start (depth 0) and its way for each unit of depth, in the world; the start seen from the eye.
    origin: [Interval; 3],
    pub(super) direction: [Interval; 3],
    pub(super) from_eye: [Interval; 3],
    /// The same in index space.
    at: [Interval; 3],
    step: [Interval; 3],
    /// World units for each unit of depth.
    pub(super) stretch: Interval,
}

fn points(v: DVec3) -> [Interval; 3] {
    v.to_array().map(Interval::point)
}

fn plus(a: [Interval; 3], b: [Interval; 3]) -> [Interval; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

fn dot(a: [Interval; 3], b: [Interval; 3]) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Ray {
    /// The ray through the window position (x,y): see [`View::ray`].
    pub(super) fn new(view: &View, grid: &Grid, x: f64, y: f64) -> Self {
        let scale = Interval::point(view.scale);
        let px = (Interval::point(x) - Interval::point(0.5 * f64::from(view.width))) * scale;
        let py = (Interval::point(0.5 * f64::from(view.height)) - Interval::point(y)) * scale;
        let offset = plus(points(view.right).map(|c| c * px), points(view.up).map(|c| c * py));
        let (from_eye, direction) =
            if view.perspective { ([Interval::ZERO; 3], plus(points(view.forward), offset)) } else { (offset, points(view.forward)) };
        let origin = plus(points(view.eye), from_eye);
        let map = grid.world_to_index();
        let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(points);
        let turned = |v: [Interval; 3]| std::array::from_fn(|i| columns[0][i] * v[0] + columns[1][i] * v[1] + columns[2][i] * v[2]);
        let stretch = (direction[0].squared() + direction[1].squared() + direction[2].squared()).sqrt();
        // A direction of length 1 but for rounding is what the view holds for parallel rays.
        Self { origin, direction, from_eye, at: plus(turned(origin), points(map.translation)), step: turned(direction), stretch }
    }

    /// Where in the cell with the lower corner `low` the ray is at depth `d`.
    pub(super) fn place(&self, d: f64, low: [i64; 3]) -> [Interval; 3] {
        std::array::from_fn(|i| self.at[i] + self.step[i].times(d) - Interval::point(low[i] as f64))
    }

    /// Its way through the cells over `way` units of depth.
    pub(super) fn way(&self, way: Interval) -> [Interval; 3] {
        self.step.map(|s| s * way)
    }

    /// Calls `visit` for one piece after the other, nearest first, until it says false; false where the ray cannot be cut into pieces.
    pub(super) fn walk(&self, view: &View, grid: &Grid, planes: &[(DVec3, f64)], mut visit: impl FnMut(&Cut) -> bool) -> bool {
        let Some(span) = self.span(view, grid, planes) else { return false };
        let Some((entry, exit)) = span else { return true };
        let reach = Interval::new(entry.lo(), exit.hi());
        let mut axes: [Axis; 3] = std::array::from_fn(|i| Axis::new(self.at[i], self.step[i], reach, grid.dims()[i] as i64));
        let mut near = entry.lo();
        while near < exit.hi() {
            let mut far = exit.hi();
            for stop in [entry.hi(), exit.lo()].into_iter().filter(|&stop| stop > near) {
                far = far.min(stop);
            }
            for axis in &mut axes {
                axis.advance(near);
                far = far.min(axis.next());
            }
            let inside = near >= entry.hi() && far <= exit.lo();
            if !visit(&Cut { near, far, inside, cells: axes.map(|axis| axis.cells()) }) {
                break;
            }
            near = far;
        }
        true
    }

    /// The depths at which the ray enters and leaves what is visible: `Some(None)` where it misses that, `None` where nothing is known.
    fn span(&self, view: &View, grid: &Grid, planes: &[(DVec3, f64)]) -> Option<Option<(Interval, Interval)>> {
        let (low, high) = grid.index_bounds();
        // Half-spaces height + rate d >= 0.
        let mut halves = Vec::with_capacity(6 + planes.len());
        for i in 0..3 {
            if low[i] == high[i] && !self.step[i].holds(0.0) {
                // A box without thickness, crossed at one place.
                return Some(None);
            }
            halves.push((self.at[i] - Interval::point(low[i]), self.step[i]));
            halves.push((Interval::point(high[i]) - self.at[i], -self.step[i]));
        }
        for &(normal, offset) in planes {
            let normal = points(normal);
            halves.push((dot(normal, self.origin) - Interval::point(offset), dot(normal, self.direction)));
        }
        let (mut entry, mut exit) = (Interval::point(view.near), Interval::point(f64::INFINITY));
        let crossed = |(height, rate): (Interval, Interval)| -height / rate;
        for &half in halves.iter().filter(|(_, rate)| rate.lo() > 0.0) {
            let at = crossed(half);
            entry = Interval::new(entry.lo().max(at.lo()), entry.hi().max(at.hi()));
        }
        for &half in halves.iter().filter(|(_, rate)| rate.hi() < 0.0) {
            let at = crossed(half);
            exit = Interval::new(exit.lo().min(at.lo()), exit.hi().min(at.hi()));
        }
        if !(entry.lo().is_finite() && exit.hi().is_finite()) {
            return None;
        }
        if exit.hi() <= entry.lo() {
            return Some(None);
        }
        let reach = Interval::new(entry.lo(), exit.hi());
        for &(height, rate) in halves.iter().filter(|(_, rate)| rate.holds(0.0)) {
            let heights = height + rate * reach;
            if heights.hi() < 0.0 {
                return Some(None);
            }
            if heights.lo() < 0.0 {
                // Along a face, or so nearly that rounding hides on which side.
                entry = reach;
            }
        }
        Some(Some((entry, exit)))
    }
}

/// A piece of ray between two depths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub(super) near: f64,
    pub(super) far: f64,
    /// Whether all of it is certainly visible; else any part of it may be.
    pub(super) inside: bool,
    /// For each axis the first and the last cell that it may lie in.
    pub(super) cells: [(i64, i64); 3],
}

/// The cells of one axis along the ray. Faces are the voxel centres 0 to n-1; the cell before the first is -1.
#[derive(Debug, Clone, Copy)]
enum Axis {
    /// The ray hardly moves along the axis.
    Still { cells: (i64, i64) },
    /// It passes the faces one after the other, rising or falling.
    Moving {
        at: Interval,
        step: Interval,
        n: i64,
        /// How many faces are certainly behind, and how many may be.
        passed: i64,
        begun: i64,
    },
}

impl Axis {
    fn new(at: Interval, step: Interval, reach: Interval, n: i64) -> Self {
        if step.holds(0.0) {
            let place = at + step * reach;
            let cell = |x: f64| (x.floor() as i64).clamp(-1, n - 1);
            return Self::Still { cells: (cell(place.lo()), cell(place.hi())) };
        }
        let place = at + step.times(reach.lo());
        // One face less than those that are behind: no rounding reaches that far.
        let passed =
            if step.lo() > 0.0 { (place.lo().floor() as i64).saturating_sub(1) } else { (n - 2).saturating_sub(place.hi().ceil() as i64) };
        let passed = passed.clamp(0, n);
        Self::Moving { at, step, n, passed, begun: passed }
    }

    /// The depths at which the ray may meet its i-th face.
    fn face(at: Interval, step: Interval, n: i64, i: i64) -> Interval {
        let number = if step.lo() > 0.0 { i } else { n - 1 - i };
        (Interval::point(number as f64) - at) / step
    }

    /// Counts the faces up to `depth`.
    fn advance(&mut self, depth: f64) {
        if let Self::Moving { at, step, n, passed, begun } = self {
            while *passed < *n && Self::face(*at, *step, *n, *passed).hi() <= depth {
                *passed += 1;
            }
            *begun = (*begun).max(*passed);
            while *begun < *n && Self::face(*at, *step, *n, *begun).lo() <= depth {
                *begun += 1;
            }
        }
    }

    /// The next depth at which what is known of its cells changes.
    fn next(&self) -> f64 {
        let Self::Moving { at, step, n, passed, begun } = *self else { return f64::INFINITY };
        let begins = if begun < n { Self::face(at, step, n, begun).lo() } else { f64::INFINITY };
        let ends = if passed < begun { Self::face(at, step, n, passed).hi() } else { f64::INFINITY };
        begins.min(ends)
    }

    fn cells(&self) -> (i64, i64) {
        match *self {
            Self::Still { cells } => cells,
            Self::Moving { step, passed, begun, .. } if step.lo() > 0.0 => (passed - 1, begun - 1),
            Self::Moving { n, passed, begun, .. } => (n - 1 - begun, n - 1 - passed),
        }
    }
}
