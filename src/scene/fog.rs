//! Fog as OpenGL 1.x computes it: a factor from the eye's distance, and a mix with the fog colour.

use crate::{Error, Result};

/// How the fog factor falls with distance z (world units).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FogMode {
    /// f = (end - z) / (end - start); with start = end: 1 before it, 0 behind.
    Linear {
        /// Distance at which fog begins.
        start: f64,
        /// Distance at which only fog is left.
        end: f64,
    },
    /// f = exp(-density z).
    Exp {
        /// Density per world unit, not negative.
        density: f64,
    },
    /// f = exp(-(density z)^2).
    Exp2 {
        /// Density per world unit, not negative.
        density: f64,
    },
}

/// Which distance fog is computed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FogDistance {
    /// |z| in eye space: one number a slice.
    #[default]
    Planar,
    /// Distance from the eye to the fragment.
    Radial,
}

/// How the fog's colour is mixed into a premultiplied colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FogWeighting {
    /// C' = f C + (1-f) A C_fog: right for premultiplied colours.
    #[default]
    Alpha,
    /// C' = f C + (1-f) C_fog: OpenGL's formula, which lights up empty slices. For showing the mistake.
    Literal,
}

/// Fog of a scene.
///
/// # Guarantees
/// Numbers are finite, the density is not negative, the colour lies in `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fog {
    mode: FogMode,
    color: [f64; 3],
    distance: FogDistance,
    weighting: FogWeighting,
}

impl Fog {
    /// Fog of `mode` and straight `color`, by planar distance and weighted by alpha.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a negative or non-finite number, or a colour outside `[0,1]`.
    pub fn new(mode: FogMode, color: [f64; 3]) -> Result<Self> {
        match mode {
            FogMode::Linear { start, end } if !(start.is_finite() && end.is_finite()) => {
                return Err(Error::invalid(format!("fog start {start}, end {end}: must be finite")));
            }
            FogMode::Exp { density } | FogMode::Exp2 { density } if !(density >= 0.0 && density.is_finite()) => {
                return Err(Error::invalid(format!("fog density {density}: must be finite and not negative")));
            }
            _ => {}
        }
        if let Some(c) = color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::invalid(format!("fog color {c}: outside [0,1]")));
        }
        Ok(Self { mode, color, distance: FogDistance::Planar, weighting: FogWeighting::Alpha })
    }

    /// The same fog with each component of its colour turned into another within `[0,1]`.
    pub(super) fn with_color_turned(mut self, turn: impl Fn(f64) -> f64) -> Self {
        self.color = self.color.map(|c| turn(c).clamp(0.0, 1.0));
        self
    }

    /// The same fog by another distance.
    #[must_use]
    pub fn with_distance(mut self, distance: FogDistance) -> Self {
        self.distance = distance;
        self
    }

    /// The same fog by another weighting.
    #[must_use]
    pub fn with_weighting(mut self, weighting: FogWeighting) -> Self {
        self.weighting = weighting;
        self
    }

    /// How the factor falls.
    pub fn mode(&self) -> FogMode {
        self.mode
    }

    /// Straight colour of the fog.
    pub fn color(&self) -> [f64; 3] {
        self.color
    }

    /// Which distance counts.
    pub fn distance(&self) -> FogDistance {
        self.distance
    }

    /// How the fog's colour is mixed into a premultiplied colour.
    pub fn weighting(&self) -> FogWeighting {
        self.weighting
    }

    /// The fog factor at distance `z` (world units): 1 = clear, 0 = nothing but fog.
    pub fn factor(&self, z: f64) -> f64 {
        let z = z.abs();
        let f = match self.mode {
            FogMode::Linear { start, end } if start == end => f64::from(u8::from(z < end)),
            FogMode::Linear { start, end } => (end - z) / (end - start),
            FogMode::Exp { density } => libm::exp(-density * z),
            FogMode::Exp2 { density } => libm::exp(-(density * z) * (density * z)),
        };
        f.clamp(0.0, 1.0)
    }
}
