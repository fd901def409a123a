//! The value at a place of the volume, by each filter, in f64.

use super::Scaling;
use crate::scene::Filter;
use crate::volume::Volume;
use crate::volume::spline::Coefficients;
use glam::DVec3;

/// How values between voxels are found.
#[derive(Debug, Clone, Copy)]
pub(crate) enum PointLookup<'v> {
    Linear(&'v Volume),
    Nearest(&'v Volume),
    /// The spline's coefficients, and how the numbers that they are become values.
    Cubic(&'v Volume, &'v Coefficients, Scaling),
}

impl<'v> PointLookup<'v> {
    /// Looks `volume` up by `filter`; `data` holds the coefficients of its spline, where that is asked for.
    pub(crate) fn new(volume: &'v Volume, filter: Filter, data: Option<&'v super::VolumeData>) -> Self {
        match (filter, data.and_then(|data| Some((data.coefficients.as_ref()?, data.scaling)))) {
            (Filter::Cubic { .. }, Some((coefficients, scaling))) => Self::Cubic(volume, coefficients, scaling),
            (Filter::Nearest, _) => Self::Nearest(volume),
            (Filter::Linear | Filter::Cubic { .. }, _) => Self::Linear(volume),
        }
    }

    /// The value at index coordinates `at` in the data's units, clamped to the outermost voxels.
    pub(crate) fn value(&self, at: DVec3) -> f64 {
        match self {
            Self::Linear(volume) => volume.sample(at),
            Self::Nearest(volume) => {
                let dims = volume.grid().dims();
                // Halfway between two voxels the upper one counts, as in the pipeline.
                volume.value([0, 1, 2].map(|axis| (libm::floor(at[axis] + 0.5).max(0.0) as usize).min(dims[axis] - 1)))
            }
            Self::Cubic(volume, coefficients, scaling) => scaling.scale * spline(volume.grid().dims(), coefficients, at) + scaling.offset,
        }
    }
}

/// The spline's four weights at `w` from 0 to 1 between its two middle coefficients.
fn weights(w: f64) -> [f64; 4] {
    let r = 1.0 - w;
    let (w0, w3) = (r * r * r, w * w * w);
    [w0, 4.0 + 3.0 * w * w * (w - 2.0), 4.0 + 3.0 * r * r * (r - 2.0), w3].map(|x| x / 6.0)
}

/// The number of the spline at `at`.
fn spline(dims: [usize; 3], coefficients: &Coefficients, at: DVec3) -> f64 {
    let mut cell = [0usize; 3];
    let mut weight = [[0.0; 4]; 3];
    for axis in 0..3 {
        let last = dims[axis] - 1;
        let u = at[axis].clamp(0.0, last as f64);
        cell[axis] = (u as usize).min(last.saturating_sub(1));
        weight[axis] = weights(u - cell[axis] as f64);
    }
    let first = (0..3).map(|axis| cell[axis] * coefficients.strides[axis]).sum::<usize>();
    let mut sum = 0.0;
    for k in 0..4 {
        let mut layer = 0.0;
        for j in 0..4 {
            let from = first + j * coefficients.strides[1] + k * coefficients.strides[2];
            let row = &coefficients.values[from..from + 4];
            layer += weight[1][j] * row.iter().zip(weight[0]).map(|(&c, w)| w * f64::from(c)).sum::<f64>();
        }
        sum += weight[2][k] * layer;
    }
    sum
}
