//! The tricubic B-spline over a volume along one ray: a polynomial of degree nine in each cell.
//!
//! Its coefficients solve (c(k-1) + 4 c(k) + c(k+1)) / 6 = voxel k along each line of voxels, a tridiagonal system; without prefilter they are the
//! voxels. Beyond the outermost voxels they are mirrored there: c(-1) = c(1), which makes the slope there zero, as it is outside.

use super::field::{Along, Cubic, Turns, solve};
use crate::scene::{Filter, Scene};
use crate::volume::{Number, Volume, with_voxels};
use crate::{Error, Result};

/// Degree of the spline along a ray that is oblique to all axes.
const DEGREE: usize = 9;

/// The spline over a volume, in the data's units.
#[derive(Debug)]
pub(super) struct Spline {
    dims: [usize; 3],
    /// x fastest; NaN where the voxel is not finite.
    coefficients: Vec<f64>,
}

/// A polynomial of degree nine at most: c0 + c1 s + c2 s^2 + ...
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Nonic(pub(super) [f64; DEGREE + 1]);

impl Spline {
    /// The spline that `scene` looks up in `volume`; `None` where it does not ask for one.
    ///
    /// # Errors
    /// [`Error::Invalid`] when this machine does not give the memory for the coefficients.
    pub(super) fn of(scene: &Scene, volume: &Volume) -> Result<Option<Self>> {
        let Filter::Cubic { prefilter } = scene.method().filter else { return Ok(None) };
        let dims = volume.grid().dims();
        let count: usize = dims.iter().product();
        let mut coefficients: Vec<f64> = Vec::new();
        if crate::memory::reserve(&mut coefficients, count).is_err() {
            let bytes = 8 * count as u128;
            return Err(Error::invalid(format!("render filter cubic: {bytes} bytes for the reference, this machine does not give them")));
        }
        let (slope, intercept) = volume.rescale();
        with_voxels!(volume.voxels(), v => coefficients.extend(v.iter().map(|v| slope * v.to_f64() + intercept)));
        let holes: Vec<usize> = (0..count).filter(|&i| !coefficients[i].is_finite()).collect();
        if !holes.is_empty() {
            fill(&mut coefficients, dims[0], slope);
        }
        if prefilter {
            let steps = [1, dims[0], dims[0] * dims[1]];
            for axis in 0..3 {
                let (n, step) = (dims[axis], steps[axis]);
                let mut line = vec![0.0; n];
                for first in (0..count).filter(|i| i / step % n == 0) {
                    (0..n).for_each(|k| line[k] = coefficients[first + k * step]);
                    interpolating(&mut line);
                    (0..n).for_each(|k| coefficients[first + k * step] = line[k]);
                }
            }
        }
        holes.into_iter().for_each(|i| coefficients[i] = f64::NAN);
        Ok(Some(Self { dims, coefficients }))
    }

    /// The field along a piece of ray in the cell whose lower corner is voxel `low`, and bounds of its values: from `place` in the cell, over
    /// `step`, in voxels. With an axis given, the field's derivative along it. `None` where a voxel that the cell mixes is not finite.
    pub(super) fn along(&self, low: [i64; 3], place: [f64; 3], step: [f64; 3], by: Option<usize>) -> Option<(Nonic, f64, f64)> {
        let axes: [([usize; 4], [[f64; 4]; 4]); 3] = std::array::from_fn(|a| self.axis(a, low[a], place[a], step[a], by == Some(a)));
        let [nx, ny, _] = self.dims;
        let at = |i: usize, j: usize, k: usize| self.coefficients[(axes[2].0[k] * ny + axes[1].0[j]) * nx + axes[0].0[i]];
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        // Differences from one of the coefficients, because weights add up to 1, and those of a derivative to 0.
        let base = at(0, 0, 0);
        let mut field = [0.0; DEGREE + 1];
        for k in 0..4 {
            let mut layer = [0.0; 7];
            for j in 0..4 {
                let mut row = [0.0; 4];
                for i in 0..4 {
                    let c = at(i, j, k);
                    if !c.is_finite() {
                        return None;
                    }
                    (least, most) = (least.min(c), most.max(c));
                    row.iter_mut().zip(axes[0].1[i]).for_each(|(sum, w)| *sum += w * (c - base));
                }
                add_product(&mut layer, &row, &axes[1].1[j]);
            }
            add_product(&mut field, &layer, &axes[2].1[k]);
        }
        if by.is_none() {
            field[0] += base;
        }
        field.iter().all(|c| c.is_finite()).then_some((Nonic(field), least, most))
    }

    /// The four coefficients that the cell from voxel `low` of an axis mixes, and the weight of each along the piece, by powers of s. With `slope`
    /// the weights' derivatives by the position.
    fn axis(&self, axis: usize, low: i64, place: f64, step: f64, slope: bool) -> ([usize; 4], [[f64; 4]; 4]) {
        let n = self.dims[axis] as i64;
        if n == 1 {
            let weight = if slope { 0.0 } else { 1.0 };
            return ([0; 4], [[weight, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]);
        }
        // Constant beyond the outermost voxels.
        let (cell, w, b) = match low {
            ..0 => (0, 0.0, 0.0),
            _ if low > n - 2 => (n - 2, 1.0, 0.0),
            _ => (low, place, step),
        };
        let mirrored = |i: i64| (if i < 0 { -i } else { i.min(2 * n - 2 - i) }) as usize;
        let r = 1.0 - w;
        // Each weight's value and its derivatives by position.
        let jets = [
            [r * r * r / 6.0, -r * r / 2.0, r, -1.0],
            [(3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0, (3.0 * w * w - 4.0 * w) / 2.0, 3.0 * w - 2.0, 3.0],
            [(-3.0 * w * w * w + 3.0 * w * w + 3.0 * w + 1.0) / 6.0, (-3.0 * w * w + 2.0 * w + 1.0) / 2.0, 1.0 - 3.0 * w, -3.0],
            [w * w * w / 6.0, w * w / 2.0, w, 1.0],
        ];
        let taylor = |[d0, d1, d2, d3]: [f64; 4]| [d0, d1 * b, d2 * b * b / 2.0, d3 * b * b * b / 6.0];
        let weights = jets.map(|[d0, d1, d2, d3]| taylor(if slope { [d1, d2, d3, 0.0] } else { [d0, d1, d2, d3] }));
        (std::array::from_fn(|t| mirrored(cell - 1 + t as i64)), weights)
    }
}

/// Adds the product of two polynomials.
fn add_product<const N: usize>(sum: &mut [f64; N], a: &[f64], b: &[f64]) {
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            sum[i + j] += x * y;
        }
    }
}

/// Puts finite numbers in the place of others: the last one before in the row, or the first one after; in rows without any, the value of the least voxel
/// (the greatest value where the rescaling's slope is negative).
fn fill(values: &mut [f64], row: usize, slope: f64) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let least = if slope < 0.0 { finite.fold(f64::NEG_INFINITY, f64::max) } else { finite.fold(f64::INFINITY, f64::min) };
    for row in values.chunks_exact_mut(row) {
        let first = row.iter().copied().find(|v| v.is_finite());
        let mut last = first.unwrap_or(if least.is_finite() { least } else { 0.0 });
        for v in row {
            if v.is_finite() {
                last = *v;
            } else {
                *v = last;
            }
        }
    }
}

/// Turns numbers into the coefficients of the spline through them: elimination forwards, substitution backwards.
fn interpolating(line: &mut [f64]) {
    let n = line.len();
    if n < 2 {
        return;
    }
    // Rows of the system: 4 on the diagonal, 1 beside it, and 2 in the first and the last row, where the mirror adds up.
    let mut over = vec![0.5; n];
    line[0] *= 6.0 / 4.0;
    for k in 1..n {
        let under = if k == n - 1 { 2.0 } else { 1.0 };
        let pivot = 4.0 - under * over[k - 1];
        over[k] = 1.0 / pivot;
        line[k] = (6.0 * line[k] - under * line[k - 1]) / pivot;
    }
    for k in (0..n - 1).rev() {
        line[k] -= over[k] * line[k + 1];
    }
}

fn horner(c: &[f64], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// The derivative of the first coefficients of a polynomial.
fn derivative<const N: usize>(c: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| if i + 1 < N { (i + 1) as f64 * c[i + 1] } else { 0.0 })
}

/// Places in (0,1) where the polynomial of this degree changes its sign, rising: between two turns it does so once at most, and its turns are
/// where its derivative changes sign.
fn sign_changes(c: &[f64; DEGREE + 1], degree: usize) -> Turns {
    let none = Turns::new(std::iter::empty());
    if degree == 0 || one_sign(&c[..=degree]) {
        return none;
    }
    let slope = derivative(c);
    let turns = sign_changes(&slope, degree - 1);
    let mut from = 0.0;
    let between = turns.iter().chain([1.0]).filter_map(|to| {
        let (a, b) = (std::mem::replace(&mut from, to), to);
        let changes = (horner(c, a) < 0.0) != (horner(c, b) < 0.0);
        changes.then(|| solve(|s| horner(c, s), |s| horner(&slope, s), 0.0, a, b)).filter(|&s| s > 0.0 && s < 1.0)
    });
    Turns::new(between)
}

/// Whether the polynomial has one sign on [0,1] as far as its Bernstein coefficients tell, between which all of its values lie.
fn one_sign(c: &[f64]) -> bool {
    let n = c.len() - 1;
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..=n {
        // C(i,j) / C(n,j), from j to j + 1 by (i - j) / (n - j).
        let (mut b, mut share) = (0.0, 1.0);
        for (j, c) in c.iter().enumerate().take(i + 1) {
            b += share * c;
            share *= if j < n { (i - j) as f64 / (n - j) as f64 } else { 0.0 };
        }
        (least, most) = (least.min(b), most.max(b));
    }
    least >= 0.0 || most <= 0.0
}

impl Nonic {
    /// The highest power that it has.
    pub(super) fn degree(&self) -> usize {
        self.0.iter().rposition(|&c| c != 0.0).unwrap_or(0)
    }

    pub(super) fn at(&self, s: f64) -> f64 {
        horner(&self.0, s)
    }

    pub(super) fn slope(&self, s: f64) -> f64 {
        (1..=DEGREE).rev().fold(0.0, |sum, i| sum * s + i as f64 * self.0[i])
    }
}

impl From<Cubic> for Nonic {
    fn from(Cubic([a, b, c, d]): Cubic) -> Self {
        let mut all = [0.0; DEGREE + 1];
        all[..4].copy_from_slice(&[a, b, c, d]);
        Self(all)
    }
}

impl Along for Nonic {
    fn coefficients(&self) -> &[f64] {
        &self.0[..=self.degree()]
    }

    fn at(&self, s: f64) -> f64 {
        Self::at(self, s)
    }

    fn slope(&self, s: f64) -> f64 {
        Self::slope(self, s)
    }

    fn varies(&self) -> bool {
        self.0[1..].iter().any(|&c| c != 0.0)
    }

    fn turns(&self) -> Turns {
        sign_changes(&derivative(&self.0), DEGREE - 1)
    }
}

#[cfg(test)]
mod tests;
