//! Fog over a piece of ray: the range of its factor, and its series.

use super::interval::Interval;
use super::series::{Series, TERMS};
use crate::scene::{Fog, FogDistance, FogMode};

/// Fog along one ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayFog {
    mode: FogMode,
    pub(super) color: [f64; 3],
    distance: Distance,
}

/// How the fog's distance z comes from the depth d.
#[derive(Debug, Clone, Copy)]
enum Distance {
    /// z = d.
    Planar,
    /// z^2 = q0 + q1 d + q2 d^2: the eye is not on a parallel ray.
    Radial([Interval; 3]),
}

impl RayFog {
    /// Fog along the ray that starts at `from_eye`, seen from the eye, and goes on by `direction` for each unit of depth.
    pub(super) fn new(fog: &Fog, from_eye: [Interval; 3], direction: [Interval; 3]) -> Self {
        let dot = |a: [Interval; 3], b: [Interval; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let squared = |a: [Interval; 3]| a[0].squared() + a[1].squared() + a[2].squared();
        let distance = match fog.distance() {
            FogDistance::Planar => Distance::Planar,
            FogDistance::Radial => Distance::Radial([squared(from_eye), dot(from_eye, direction).times(2.0), squared(direction)]),
        };
        Self { mode: fog.mode(), color: fog.color(), distance }
    }

    /// Distances at depths from `near` to `far`, which are not negative.
    fn distances(&self, near: f64, far: f64) -> Interval {
        let d = Interval::new(near, far);
        match self.distance {
            Distance::Planar => d,
            Distance::Radial([q0, q1, q2]) => (q0 + d * (q1 + d * q2)).sqrt(),
        }
    }

    /// Factors at depths from `near` to `far`.
    pub(super) fn factors(&self, near: f64, far: f64) -> Interval {
        factor(self.mode, self.distances(near, far))
    }

    /// The factor's series, by the share of the piece from depth `near` on over `way`: in the middle of [a,b], and over that range. `None`
    /// where it has a kink there.
    pub(super) fn series(&self, near: f64, way: Interval, (a, b): (f64, f64)) -> Option<(Series, Series)> {
        let whole = self.at(near, way, Interval::new(a, b))?;
        Some((self.at(near, way, Interval::point(0.5 * (a + b)))?, whole))
    }

    fn at(&self, near: f64, way: Interval, s: Interval) -> Option<Series> {
        let d = Interval::point(near) + way * s;
        let series = |first: [Interval; 3]| {
            let mut out = [Interval::ZERO; TERMS];
            out[..3].copy_from_slice(&first);
            Series(out)
        };
        // The distance, and its square.
        let squared = match self.distance {
            Distance::Planar => series([d.squared(), (d * way).times(2.0), way.squared()]),
            Distance::Radial([q0, q1, q2]) => series([q0 + d * (q1 + d * q2), way * (q1 + d * q2.times(2.0)), way.squared() * q2]),
        };
        let distance = || match self.distance {
            Distance::Planar => series([d, way, Interval::ZERO]),
            Distance::Radial(_) => squared.sqrt(),
        };
        let scaled = |x: &Series, by: Interval| Series(x.0.map(|c| c * by));
        Some(match self.mode {
            FogMode::Linear { start, end } => {
                if start == end {
                    return None;
                }
                let scale = Interval::ONE / (Interval::point(start) - Interval::point(end));
                let factor = scaled(&distance().plus(-Interval::point(end)), scale);
                let f = factor.0[0];
                if f.lo() >= 1.0 {
                    Series::constant(Interval::ONE)
                } else if f.hi() <= 0.0 {
                    Series::constant(Interval::ZERO)
                } else if f.lo() >= 0.0 && f.hi() <= 1.0 {
                    factor
                } else {
                    return None;
                }
            }
            FogMode::Exp { density } => scaled(&distance(), Interval::point(density)).exp_minus(),
            FogMode::Exp2 { density } => scaled(&squared, Interval::point(density).squared()).exp_minus(),
        })
    }
}

/// The factor at distances: 1 = clear, 0 = nothing but fog.
pub(super) fn factor(mode: FogMode, z: Interval) -> Interval {
    let exponent = match mode {
        FogMode::Linear { start, end } if start == end => {
            let (all, none) = (z.hi() < end, z.lo() >= end);
            return if all { Interval::ONE } else { Interval::new(0.0, f64::from(u8::from(!none))) };
        }
        FogMode::Linear { start, end } => {
            return ((Interval::point(end) - z) / (Interval::point(end) - Interval::point(start))).clamp(0.0, 1.0);
        }
        FogMode::Exp { density } => Interval::point(density) * z,
        FogMode::Exp2 { density } => (Interval::point(density) * z).squared(),
    };
    exponent.exp_minus()
}
