//! Ranges of the interpolated value on a piece of ray.
//!
//! Within a cell the trilinear value along a ray is a cubic in s, the share of the piece that is behind. A polynomial lies between the least
//! and the greatest of its Bernstein coefficients, and a trilinear value between the least and the greatest of its cell's corners.

use super::interval::Interval;
use super::series::{Series, TERMS};
use crate::volume::{Number, Volume, with_voxels};

/// f(s) = c0 + c1 s + c2 s^2 + c3 s^3, s from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cubic(pub(super) [Interval; 4]);

impl Cubic {
    /// Taylor coefficients at `s`, or at every place of a range.
    pub(super) fn taylor(&self, s: Interval) -> [Interval; 4] {
        let [c0, c1, c2, c3] = self.0;
        let last = c3.times(3.0);
        [c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (c2.times(2.0) + s * last), c2 + s * last, c3]
    }

    /// Coefficients over [a,b], by the powers of (s - a) / (b - a).
    fn on(&self, a: f64, b: f64) -> [Interval; 4] {
        // Places on a piece are multiples of a power of two: their difference is exact.
        let h = Interval::point(b) - Interval::point(a);
        let [w0, w1, w2, w3] = self.taylor(Interval::point(a));
        let squared = h * h;
        [w0, w1 * h, w2 * squared, w3 * squared * h]
    }

    /// Values on [a,b].
    pub(super) fn range(&self, a: f64, b: f64) -> Interval {
        let [w0, w1, w2, w3] = self.on(a, b);
        let third = Interval::point(3.0);
        let second = w0 + w1 / third;
        w0.hull(second).hull(second + (w1 + w2) / third).hull(w0 + w1 + w2 + w3)
    }

    /// Derivatives by s on [a,b].
    pub(super) fn slopes(&self, a: f64, b: f64) -> Interval {
        let [_, c1, c2, c3] = self.0;
        let last = c3.times(3.0);
        let (a, b) = (Interval::point(a), Interval::point(b));
        let at = |s: Interval| c1 + s * (c2.times(2.0) + s * last);
        // The middle Bernstein coefficient of a parabola: the blossom of both ends.
        at(a).hull(c1 + (a + b) * c2 + a * b * last).hull(at(b))
    }

    /// The series in the middle of [a,b], and over that range.
    pub(super) fn series(&self, a: f64, b: f64) -> (Series, Series) {
        let pad = |t: [Interval; 4]| {
            let mut out = [Interval::ZERO; TERMS];
            out[..4].copy_from_slice(&t);
            Series(out)
        };
        let middle = pad(self.taylor(Interval::point(0.5 * (a + b))));
        let mut over = pad(self.taylor(Interval::new(a, b)));
        over.0[0] = over.0[0].meet(self.range(a, b));
        over.0[1] = over.0[1].meet(self.slopes(a, b));
        (middle, over)
    }

    fn less(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

/// The field in one cell that a piece of ray may lie in.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellField {
    pub(super) cubic: Cubic,
    /// The least and the greatest corner of the cell.
    pub(super) corners: Interval,
}

/// The value on a piece of ray: that of one cell, or of one of several cells where the piece lies too close to a face to tell.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) main: CellField,
    /// The other cells.
    pub(super) others: Vec<CellField>,
    /// How far the value may be from the main cell's cubic.
    pub(super) apart: f64,
    /// The least and the greatest corner of all of the cells.
    corners: Interval,
    /// Each cell's cubic is at or below this number somewhere on the piece.
    somewhere: f64,
}

impl Field {
    /// Of the cells that a piece may lie in; `None` without one.
    pub(super) fn new(cells: &[CellField]) -> Option<Self> {
        let (&main, others) = cells.split_first()?;
        let corners = others.iter().fold(main.corners, |all, cell| all.hull(cell.corners));
        let apart = others.iter().map(|cell| cell.cubic.less(&main.cubic).range(0.0, 1.0).most()).fold(0.0, f64::max);
        let low = |cell: &CellField| {
            [0.0, 0.5, 1.0].map(|s| cell.cubic.taylor(Interval::point(s))[0].hi()).into_iter().fold(f64::INFINITY, f64::min)
        };
        let somewhere = cells.iter().map(low).fold(f64::NEG_INFINITY, f64::max);
        Some(Self { main, others: others.to_vec(), apart, corners, somewhere })
    }

    /// Values on [a,b].
    pub(super) fn range(&self, a: f64, b: f64) -> Interval {
        (self.main.cubic.range(a, b) + Interval::around_zero(self.apart)).meet(self.corners)
    }

    /// Whether the field may stay at `value`, the greatest of a range: a polynomial that is less anywhere meets it at single places alone.
    pub(super) fn may_stay_at(&self, value: f64) -> bool {
        !(self.somewhere < value)
    }

    /// The value at `s`.
    pub(super) fn at(&self, s: f64) -> Interval {
        (self.main.cubic.taylor(Interval::point(s))[0] + Interval::around_zero(self.apart)).meet(self.corners)
    }
}

/// The corners of the cell whose lower corner is voxel `low`: value at bit 0 = x, bit 1 = y, bit 2 = z. Voxels beyond the grid are those at its
/// edge. `None` where one of them is NaN or infinite: such a cell is transparent.
pub(super) fn corners(volume: &Volume, low: [i64; 3]) -> Option<[Interval; 8]> {
    let dims = volume.grid().dims();
    let pick = |axis: usize, step: i64| (low[axis] + step).clamp(0, dims[axis] as i64 - 1) as usize;
    let (x, y, z) = ([pick(0, 0), pick(0, 1)], [pick(1, 0), pick(1, 1)], [pick(2, 0), pick(2, 1)]);
    let index: [usize; 8] = std::array::from_fn(|c| (z[c >> 2] * dims[1] + y[c >> 1 & 1]) * dims[0] + x[c & 1]);
    let stored: [f64; 8] = with_voxels!(volume.voxels(), v => index.map(|i| v[i].to_f64()));
    let (slope, intercept) = volume.rescale();
    if !stored.iter().all(|s| (slope * s + intercept).is_finite()) {
        return None;
    }
    if (slope, intercept) == (1.0, 0.0) {
        return Some(stored.map(Interval::point));
    }
    let (slope, intercept) = (Interval::point(slope), Interval::point(intercept));
    Some(stored.map(|s| slope * Interval::point(s) + intercept))
}

/// The least and the greatest of them.
pub(super) fn bounds(corners: &[Interval; 8]) -> Interval {
    corners.iter().skip(1).fold(corners[0], |all, &c| all.hull(c))
}

/// The field along a piece of ray within a cell: from `at`, its place in the cell (each in `[0,1]` where the cell is not clamped), over `step`.
///
/// The trilinear form and its derivatives at the start: the change of the value with one, two and three of the cell's axes.
pub(super) fn cubic(v: &[Interval; 8], at: [Interval; 3], step: [Interval; 3]) -> Cubic {
    let [x, y, z] = at;
    let along_x = |i: usize| v[i + 1] - v[i];
    // Values and slopes by x on the four edges along x, then mixed along y, then along z.
    let edges = [0, 2, 4, 6].map(|i: usize| (v[i] + x * along_x(i), along_x(i)));
    let mixed = [0, 2].map(|i: usize| {
        let ((v0, x0), (v1, x1)) = (edges[i], edges[i + 1]);
        let (rise, twist) = (v1 - v0, x1 - x0);
        // Value, and derivatives by x, by y, by both.
        [v0 + y * rise, x0 + y * twist, rise, twist]
    });
    let change: [Interval; 4] = std::array::from_fn(|i| mixed[1][i] - mixed[0][i]);
    let [value, fx, fy, fxy]: [Interval; 4] = std::array::from_fn(|i| mixed[0][i] + z * change[i]);
    let [fz, fxz, fyz, fxyz] = change;
    let [gx, gy, gz] = step;
    Cubic([value, gx * fx + gy * fy + gz * fz, gx * gy * fxy + gx * gz * fxz + gy * gz * fyz, gx * gy * gz * fxyz])
}
