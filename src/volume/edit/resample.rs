//! Other voxels for the same box.

use super::taps::Taps;
use super::{Steps, room};
use crate::settings::{Limits, Progress};
use crate::volume::{Channels, Grid, Volume, Voxel, Voxels, with_voxels};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// How many voxels are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sampling {
    /// So many along x, y and z.
    Dimensions([usize; 3]),
    /// As many as come nearest to this distance from voxel to voxel along each axis, world units. The box stays as it is, so the distance
    /// that comes about may be a little larger or smaller.
    Spacing([f64; 3]),
}

impl Sampling {
    /// The voxels that this makes of `grid`, along x, y and z.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a size of 0, a distance that is none, and more voxels than a grid may have.
    pub fn dims(self, grid: &Grid) -> Result<[usize; 3]> {
        let dims = match self {
            Self::Dimensions(dims) => dims,
            Self::Spacing(spacing) => {
                if let Some(bad) = spacing.iter().find(|s| !s.is_finite() || **s <= 0.0) {
                    return Err(Error::invalid(format!("spacing {bad}: must be finite and over 0")));
                }
                let old = grid.spacing();
                // Too many saturate, and are refused by the grid.
                std::array::from_fn(|i| libm::round(grid.dims()[i] as f64 * old[i] / spacing[i]).max(1.0) as usize)
            }
        };
        spread(grid, dims)?;
        Ok(dims)
    }
}

/// `dims` voxels that fill the box of `grid`.
fn spread(grid: &Grid, dims: [usize; 3]) -> Result<Grid> {
    // A dimension of 0 is refused below; nothing is to be divided by it.
    let ratio = DVec3::from_array(std::array::from_fn(|i| grid.dims()[i] as f64 / dims[i].max(1) as f64));
    let origin = grid.index_to_world().transform_point3((ratio - 1.0) / 2.0);
    let steps = grid.index_to_world().matrix3 * DMat3::from_diagonal(ratio);
    Ok(Grid::new(dims, origin, steps)?.with_space(grid.space()).with_convention(grid.convention()))
}

/// The volume with another number of voxels in the same box, evenly placed: the box of cells, whose faces lie half a voxel beyond the
/// centres of the outermost voxels, stays the same.
///
/// Along an axis that gets more voxels, values are looked up at the new centres as the renderer does: linearly, clamped to the edge. Along
/// one that gets fewer, a new voxel is the mean of what it covers, parts of voxels counted as parts; so details that are too small for
/// the new voxels are averaged and leave no patterns. Labels are those of the voxel that the new centre lies in. Colours are averaged by
/// their opacity. Results have the volume's own type, rounded to nearest, ties to even.
///
/// # Errors
/// As [`Sampling::dims`]; [`Error::Limit`] when the voxels would take more memory than `limits` allow; [`Error::Stopped`].
pub fn resample(volume: &Volume, sampling: Sampling, limits: &Limits, progress: Option<&dyn Progress>) -> Result<Volume> {
    let old = volume.grid().dims();
    let new = sampling.dims(volume.grid())?;
    if new == old {
        return Ok(volume.clone());
    }
    let grid = spread(volume.grid(), new)?;
    let labels = matches!(volume.channels(), Channels::Label(_));
    let taps = [0, 1, 2].map(|axis| if labels { Taps::nearest(old[axis], new[axis]) } else { Taps::new(old[axis], new[axis]) });
    let numbers = with_voxels!(volume.numbers(), v => sample(v, old, &taps, volume.channels(), limits, progress)?);
    volume.with_numbers(grid, numbers)
}

/// Rows of numbers that one thread works with.
struct Rows {
    /// A row of old voxels.
    old: Vec<f64>,
    /// The same, resampled along x.
    x: Vec<f64>,
    /// Its sum along y, and what this started with; then the same along z.
    y: [Vec<f64>; 2],
    z: [Vec<f64>; 2],
}

/// The mean of `row` and those before it: the first one, and what the weighted others add to it. A mean of equal numbers is that number to
/// the bit, and of two the linear interpolation a + t (b - a).
fn add([sum, first]: &mut [Vec<f64>; 2], row: &[f64], index: usize, weight: f64) {
    if index == 0 {
        sum.copy_from_slice(row);
        first.copy_from_slice(row);
        return;
    }
    for ((sum, first), value) in sum.iter_mut().zip(first).zip(row) {
        *sum += weight * (value - *first);
    }
}

fn sample<T: Voxel>(
    voxels: &[T],
    [nx, ny, _]: [usize; 3],
    [along_x, along_y, along_z]: &[Taps; 3],
    channels: &Channels,
    limits: &Limits,
    progress: Option<&dyn Progress>,
) -> Result<Voxels> {
    let each = channels.count();
    let (width, rows) = (along_x.len() * each, along_y.len() * along_z.len());
    let mut out = room::<T>(width * rows, limits, "the resampled volume")?;
    let steps = Steps::new(progress, "resampling", rows);
    let zeros = || vec![0.0; width];
    let buffers = || Rows { old: vec![0.0; nx * each], x: zeros(), y: [zeros(), zeros()], z: [zeros(), zeros()] };
    out.par_chunks_exact_mut(width).enumerate().try_for_each_init(buffers, |buffers, (row, to)| {
        let Rows { old, x, y, z } = buffers;
        let (first_z, weights_z) = along_z.of(row / along_y.len());
        let (first_y, weights_y) = along_y.of(row % along_y.len());
        for (k, &weight_z) in weights_z.iter().enumerate() {
            for (j, &weight_y) in weights_y.iter().enumerate() {
                let from = ((first_z + k) * ny + first_y + j) * nx * each;
                old.iter_mut().zip(&voxels[from..from + nx * each]).for_each(|(to, from)| *to = from.to_f64());
                if each > 1 {
                    old.chunks_exact_mut(each).for_each(premultiply);
                }
                along(old, along_x, each, x);
                add(y, x, j, weight_y);
            }
            add(z, &y[0], k, weight_z);
        }
        if each > 1 {
            z[0].chunks_exact_mut(each).for_each(divide);
        }
        to.iter_mut().zip(&z[0]).for_each(|(to, &value)| *to = T::from_f64(value));
        steps.next()
    })?;
    Ok(T::wrap(out.into()))
}

/// Resamples the row `old` along x into `new`; a voxel has `each` numbers.
fn along(old: &[f64], taps: &Taps, each: usize, new: &mut [f64]) {
    for (i, to) in new.chunks_exact_mut(each).enumerate() {
        let (first, weights) = taps.of(i);
        for (c, to) in to.iter_mut().enumerate() {
            let start = old[first * each + c];
            let rest = weights.iter().enumerate().skip(1);
            *to = rest.fold(start, |sum, (n, weight)| sum + weight * (old[(first + n) * each + c] - start));
        }
    }
}

/// A colour, times its opacity.
fn premultiply(color: &mut [f64]) {
    if let [r, g, b, a] = color {
        (*r, *g, *b) = (*r * *a, *g * *a, *b * *a);
    }
}

/// The straight colour again; black where it is transparent.
fn divide(color: &mut [f64]) {
    if let [r, g, b, a] = color {
        (*r, *g, *b) = if *a > 0.0 { (*r / *a, *g / *a, *b / *a) } else { (0.0, 0.0, 0.0) };
    }
}
