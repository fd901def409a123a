//! The value at a place of the volume, by each filter, in f64.

use crate::plan::VolumeData;
use crate::scene::Filter;
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;

/// How values between voxels are found.
pub(super) enum Lookup<'v> {
    Linear(&'v Volume),
    Nearest(&'v Volume),
    Cubic(&'v Volume, Box<VolumeData>),
}

impl<'v> Lookup<'v> {
    /// Looks `volume` up by `filter`.
    pub(super) fn new(volume: &'v Volume, filter: Filter) -> Result<Self> {
        Ok(match filter {
            Filter::Linear => Self::Linear(volume),
            Filter::Nearest => Self::Nearest(volume),
            Filter::Cubic { prefilter } => {
                let refused = || Error::invalid("filter cubic: this machine does not give the memory for its coefficients");
                Self::Cubic(volume, Box::new(VolumeData::of_spline(volume, prefilter).ok_or_else(refused)?))
            }
        })
    }

    /// The value at index coordinates `at` in the data's units, clamped to the outermost voxels.
    pub(super) fn value(&self, at: DVec3) -> f64 {
        match self {
            Self::Linear(volume) => volume.sample(at),
            Self::Nearest(volume) => {
                let dims = volume.grid().dims();
                // Halfway between two voxels the upper one counts, as in the pipeline.
                volume.value([0, 1, 2].map(|axis| (libm::floor(at[axis] + 0.5).max(0.0) as usize).min(dims[axis] - 1)))
            }
            Self::Cubic(volume, data) => spline(volume, data, at),
        }
    }
}

/// The spline's four weights at `w` from 0 to 1 between its two middle coefficients.
fn weights(w: f64) -> [f64; 4] {
    let r = 1.0 - w;
    let (w0, w3) = (r * r * r, w * w * w);
    [w0, 4.0 + 3.0 * w * w * (w - 2.0), 4.0 + 3.0 * r * r * (r - 2.0), w3].map(|x| x / 6.0)
}

fn spline(volume: &Volume, data: &VolumeData, at: DVec3) -> f64 {
    let Some(coefficients) = &data.coefficients else { unreachable!("the spline's data has its coefficients") };
    let dims = volume.grid().dims();
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
    data.scaling.scale * sum + data.scaling.offset
}
