//! The tricubic B-spline of a volume: its coefficients, laid out for lookups, and the range of its values in each brick.
//!
//! ```text
//!   coefficient    -1   0   1   2   3 ...  n-1   n       those beyond the outermost voxels are mirrored at them:
//!   voxel               0   1   2   3 ...  n-1           c(-1) = c(1), c(n) = c(n-2)
//!   cell 0          [---------------]                    the four that a cell mixes begin one before it
//! ```
//! Lookups clamp to the outermost voxels, and the field is constant from there to the faces of the box. The mirror goes with that: it makes
//! the spline's slope zero at the outermost voxels, so that value and slope run on without a jump. Both kinds of coefficients have it.

mod prefilter;

use super::bricks::{BRICK, Bricks, above, below, count};
use super::packed;
use super::voxels::{Voxel, Voxels, with_voxels};
use crate::lanes::ToF32;
use rayon::prelude::*;

/// Coefficients of a cell along each axis.
pub(crate) const TAPS: usize = 4;

/// Coefficients that a brick's cells mix, along an axis: those of its first cell, and one more for each further cell.
const REACH: usize = BRICK + TAPS - 1;

/// Coefficients of the spline over a volume, with a border, as numbers that stages compute with.
///
/// The first of the 4 x 4 x 4 that cell (i,j,k) mixes is element i + j * strides[1] + k * strides[2]. Along an axis of one voxel the spline is
/// constant: along x its coefficient stands there four times, along y and z the stride is 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) values: Vec<f32>,
    /// Distance to the next coefficient along x, y and z.
    pub(crate) strides: [usize; 3],
    /// Coefficients along x, y and z, the border included.
    dims: [usize; 3],
}

/// Border before the first voxel of an axis of `n`.
fn border(n: usize) -> usize {
    usize::from(n > 1)
}

impl Coefficients {
    /// Coefficients along each axis of a grid of `dims`, the border included.
    fn bordered([nx, ny, nz]: [usize; 3]) -> [usize; 3] {
        let with = |n: usize| n + 2 * border(n);
        [if nx == 1 { TAPS } else { with(nx) }, with(ny), with(nz)]
    }

    /// Elements between rows and between layers, and of all of them; `None` where they are more than can be counted.
    fn layout(dims: [usize; 3]) -> Option<([usize; 2], usize)> {
        let [px, py, pz] = Self::bordered(dims);
        // Gaps are an element in sixteen at most, so nothing below overflows.
        px.checked_mul(py)?.checked_mul(pz)?.checked_mul(2 * size_of::<f32>())?;
        let [row, layer] = packed::strides([px, py, pz], size_of::<f32>());
        Some(([row, layer], layer * (pz - 1) + row * (py - 1) + px))
    }

    /// Bytes that the coefficients of a grid of `dims` take.
    pub(crate) fn bytes(dims: [usize; 3]) -> u128 {
        Self::layout(dims).map_or(u128::MAX, |(_, len)| (len * size_of::<f32>()) as u128)
    }

    /// The coefficients of `voxels` on a grid of `dims`, of stored values converted by `map`; `None` where this machine does not give the memory.
    ///
    /// With `prefilter` the spline goes through the voxels, otherwise they are its coefficients. Voxels that are NaN or infinite are NaN among
    /// the coefficients, so that every cell that mixes them is NaN, and no other. The prefilter takes the last finite voxel before them in their
    /// row along x in their place, or the first one after them; in a row without any, the number 0. Each line of voxels is one serial recursion
    /// in f64, so the number of threads changes no bit.
    pub(crate) fn new(voxels: &Voxels, dims: [usize; 3], map: ToF32, prefilter: bool) -> Option<Self> {
        with_voxels!(voxels, v => build(v, dims, map, prefilter))
    }

    /// The rows of each layer, the border included: `rows[k][j]`.
    fn rows(&mut self) -> Vec<Vec<&mut [f32]>> {
        let [px, py, pz] = self.dims;
        let (row, layer) = (self.row(), self.layer());
        let rows = |layer| <[f32]>::chunks_mut(layer, row).take(py).map(|row| &mut row[..px]).collect();
        self.values.chunks_mut(layer).take(pz).map(rows).collect()
    }

    /// Elements from row to row, where there is more than one.
    fn row(&self) -> usize {
        if self.strides[1] == 0 { self.dims[0] } else { self.strides[1] }
    }

    /// Elements from layer to layer, where there is more than one.
    fn layer(&self) -> usize {
        if self.strides[2] == 0 { self.values.len() } else { self.strides[2] }
    }

    /// Bricks of the spline's values, as stored values: each is bounded by the coefficients that its cells mix, with positive weights whose sum is 1.
    /// `map` is the conversion that they were made with, `non_finite` the number of voxels that are NaN or infinite.
    pub(crate) fn bricks(&self, dims: [usize; 3], map: ToF32, non_finite: usize) -> Bricks {
        let counts = dims.map(count);
        let [px, py, pz] = self.dims;
        let reach = |b: usize, p: usize| b * BRICK..(b * BRICK + REACH).min(p);
        let mut numbers = vec![(f32::INFINITY, f32::NEG_INFINITY); counts.iter().product()];
        numbers.par_chunks_mut(counts[0] * counts[1]).enumerate().for_each_init(
            || vec![(0.0f32, 0.0f32); px],
            |columns, (bz, layer)| {
                for (by, bricks) in layer.chunks_exact_mut(counts[0]).enumerate() {
                    columns.fill((f32::INFINITY, f32::NEG_INFINITY));
                    for z in reach(bz, pz) {
                        for y in reach(by, py) {
                            let from = z * self.layer() + y * self.row();
                            for (range, &c) in columns.iter_mut().zip(&self.values[from..from + px]) {
                                widen(range, (c, c));
                            }
                        }
                    }
                    for (bx, brick) in bricks.iter_mut().enumerate() {
                        columns[reach(bx, px)].iter().for_each(|&range| widen(brick, range));
                    }
                }
            },
        );
        let stored = |number: f64| ((number + map.bias) / map.gain).clamp(f64::MIN, f64::MAX);
        let mut all = (f64::INFINITY, f64::NEG_INFINITY);
        let ranges = numbers
            .into_iter()
            .map(|(low, high)| {
                if low > high {
                    return (f32::INFINITY, f32::NEG_INFINITY);
                }
                let (low, high) = (f64::from(low), f64::from(high));
                let rounding = ROUNDING * low.abs().max(high.abs());
                let (a, b) = (stored(low - rounding), stored(high + rounding));
                let (a, b) = (a.min(b), a.max(b));
                all = (f64::min(all.0, a), f64::max(all.1, b));
                (below(a), above(b))
            })
            .collect();
        Bricks { dims: counts, ranges, range: all, non_finite }
    }
}

/// By how much a value mixed in f32 may leave the range of its coefficients, as a share of the largest: six interpolations after one another, each
/// of which rounds three times.
const ROUNDING: f64 = 1.2e-6;

/// Widens `range` by another; NaN widens nothing.
fn widen(range: &mut (f32, f32), (low, high): (f32, f32)) {
    range.0 = if low < range.0 { low } else { range.0 };
    range.1 = if high > range.1 { high } else { range.1 };
}

fn build<T: Voxel>(voxels: &[T], dims: [usize; 3], map: ToF32, prefilter: bool) -> Option<Coefficients> {
    let [nx, ny, nz] = dims;
    let ([row, layer], len) = Coefficients::layout(dims)?;
    let mut values = Vec::new();
    crate::memory::reserve(&mut values, len).ok()?;
    values.resize(len, 0.0f32);
    let strides = [1, if ny > 1 { row } else { 0 }, if nz > 1 { layer } else { 0 }];
    let mut all = Coefficients { values, strides, dims: Coefficients::bordered(dims) };
    let [bx, by, bz] = dims.map(border);
    let hole = |v: T| T::FLOAT && !v.is_finite();
    // Along x, and along y in the same layer.
    let layers: Vec<Vec<&mut [f32]>> = all.rows().into_iter().skip(bz).take(nz).collect();
    layers.into_par_iter().zip(voxels.par_chunks(nx * ny)).for_each(|(mut rows, voxels)| {
        let mut line = vec![0.0f64; nx];
        for (row, voxels) in rows[by..].iter_mut().zip(voxels.chunks_exact(nx)) {
            let mut last = voxels.iter().find(|&&v| !hole(v)).map_or(0.0, |v| v.to_f64() * map.gain - map.bias);
            for (number, &v) in line.iter_mut().zip(voxels) {
                if !hole(v) {
                    last = v.to_f64() * map.gain - map.bias;
                }
                *number = last;
            }
            if prefilter {
                prefilter::line(&mut line);
            }
            row[bx..].iter_mut().zip(&line).for_each(|(to, &c)| *to = c as f32);
        }
        if prefilter {
            prefilter::across(&mut rows[by..by + ny]);
        }
    });
    // Along z: all layers of a row at a time.
    if prefilter && nz > 1 {
        let mut lines: Vec<Vec<&mut [f32]>> = (0..all.dims[1]).map(|_| Vec::with_capacity(nz + 2)).collect();
        for layer in all.rows() {
            lines.iter_mut().zip(layer).for_each(|(line, row)| line.push(row));
        }
        lines.into_par_iter().for_each(|mut rows| prefilter::across(&mut rows[bz..bz + nz]));
    }
    if T::FLOAT {
        let layers: Vec<Vec<&mut [f32]>> = all.rows().into_iter().skip(bz).take(nz).collect();
        layers.into_par_iter().zip(voxels.par_chunks(nx * ny)).for_each(|(mut rows, voxels)| {
            for (row, voxels) in rows[by..].iter_mut().zip(voxels.chunks_exact(nx)) {
                row[bx..].iter_mut().zip(voxels).filter(|(_, v)| hole(**v)).for_each(|(c, _)| *c = f32::NAN);
            }
        });
    }
    mirror(&mut all, dims);
    Some(all)
}

/// Fills the border. Along x an axis of one voxel has it four times.
fn mirror(all: &mut Coefficients, [nx, ny, nz]: [usize; 3]) {
    let mut layers = all.rows();
    layers.par_iter_mut().for_each(|rows| {
        for row in rows.iter_mut() {
            let last = row.len() - 1;
            if nx == 1 {
                row.fill(row[0]);
            } else {
                (row[0], row[last]) = (row[2], row[last - 2]);
            }
        }
        if ny > 1 {
            mirror_ends(rows, |to, from| to.copy_from_slice(from));
        }
    });
    if nz > 1 {
        mirror_ends(&mut layers, |to, from| to.iter_mut().zip(from).for_each(|(to, from)| to.copy_from_slice(from)));
    }
}

/// Makes the first of `list` a copy of the third, and the last of the last but two.
fn mirror_ends<T>(list: &mut [T], copy: impl Fn(&mut T, &T)) {
    let last = list.len() - 1;
    let (front, rest) = list.split_at_mut(1);
    copy(&mut front[0], &rest[1]);
    let (rest, back) = list.split_at_mut(last);
    copy(&mut back[0], &rest[last - 2]);
}

#[cfg(test)]
mod tests;
