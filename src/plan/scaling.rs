//! How stored values become the numbers that stages compute with, and those the data's units.

use crate::lanes::ToF32;
use crate::volume::bricks::Bricks;
use crate::volume::{Volume, VoxelType};

/// How stored values become the f32 numbers of the stages, and those the data's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaling {
    /// Conversion on load, where it takes more than a cast.
    pub(crate) to_f32: Option<ToF32>,
    /// Data value = `scale` * number + `offset`; positive, so that numbers rise with values.
    pub(crate) scale: f64,
    /// See `scale`.
    pub(crate) offset: f64,
}

impl Scaling {
    /// Chooses a conversion that keeps the values of `volume` within f32 and, for types wider than f32, their differences exact.
    pub(crate) fn new(volume: &Volume, bricks: &Bricks) -> Self {
        let (min, max) = bricks.range;
        let (slope, _) = volume.rescale();
        let range = max - min;
        let exact = min.abs().max(max.abs()) <= f64::from(1 << 24);
        // Where the slope is negative, numbers are turned around on load: first crossings and local maxima are the values' own.
        let sign = slope.signum();
        let map = |gain: f64, bias: f64| Some(ToF32 { gain: sign * gain, bias: sign * gain * bias });
        let plain = if slope < 0.0 { map(1.0, 0.0) } else { None };
        let to_f32 = match volume.voxels().voxel_type() {
            VoxelType::U8 | VoxelType::I8 | VoxelType::U16 | VoxelType::I16 => plain,
            VoxelType::U32 | VoxelType::I32 if exact => plain,
            VoxelType::U32 | VoxelType::I32 => map(1.0, min),
            // Differences of neighbours must not overflow, nor sums over a ray.
            VoxelType::F32 if min < max && range > 1e20 => map(libm::scalbn(1.0, -64), 0.0),
            VoxelType::F32 => plain,
            VoxelType::F64 if min > max => plain,
            VoxelType::F64 if min == max || (1e-20..1e20).contains(&range) => map(1.0, min),
            VoxelType::F64 => map(power_of_two_near(1.0 / (max * 0.5 - min * 0.5)), min),
        };
        Self::of(volume, to_f32)
    }

    /// The conversion to the numbers that the coefficients of a spline over `volume` are: the same, but 0 for the least value, so that
    /// their rounding is a share of the range.
    pub(crate) fn of_spline(volume: &Volume, bricks: &Bricks) -> (Self, ToF32) {
        let map = Self::new(volume, bricks).to_f32.unwrap_or(ToF32 { gain: 1.0, bias: 0.0 });
        let (min, max) = bricks.range;
        let map = if map.bias == 0.0 && min <= max { ToF32 { gain: map.gain, bias: map.gain * min } } else { map };
        (Self::of(volume, Some(map)), map)
    }

    /// The scale of a volume whose stored values are converted by `to_f32`.
    pub(crate) fn of(volume: &Volume, to_f32: Option<ToF32>) -> Self {
        let (slope, intercept) = volume.rescale();
        let m = to_f32.unwrap_or(ToF32 { gain: 1.0, bias: 0.0 });
        Self { to_f32, scale: slope / m.gain, offset: slope * (m.bias / m.gain) + intercept }
    }

    /// The number that stands for a value in the data's units.
    pub(crate) fn number(&self, value: f64) -> f64 {
        (value - self.offset) / self.scale
    }
}

/// The power of two next below |x|, within the normal range of f64.
fn power_of_two_near(x: f64) -> f64 {
    let (_, exponent) = libm::frexp(x);
    libm::scalbn(1.0, exponent.clamp(-1000, 1000) - 1)
}

/// Values in the data's units, in rising order, of stored values from `low` to `high`.
pub(crate) fn value_range(volume: &Volume, low: f64, high: f64) -> (f64, f64) {
    let (slope, intercept) = volume.rescale();
    let (a, b) = (low * slope + intercept, high * slope + intercept);
    if slope < 0.0 { (b, a) } else { (a, b) }
}
