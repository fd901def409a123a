//! Light on the volume: a material, up to four lights, and where normals come from.
//!
//! The formula is Blinn's form of Phong's, as OpenGL 1.x writes it, on straight colours c:
//!
//! ```text
//!  c' = c (emission + ambient + diffuse sum(S c_light)) + specular sum(H^shininess c_light),   clamped to [0,1]
//!  S = |n.l|   H = |n.h|   h = (l + v) / |l + v|   n = -g / |g|        one-sided: max(0, .) in place of |.|
//! ```
//! g is the gradient of the interpolated values in world units, so that n points from dense to thin; l points to the light and v to the
//! eye. Where the gradient is faint n is little more than noise: with [`Lighting::gradient_floor`] g0 the lit colour counts by the weight
//! |g|^2 / (|g|^2 + g0^2), the unlit colour by the rest. A gradient of 0 leaves the colour unlit.

use crate::{Error, Result};
use glam::DVec3;

/// Most lights of a scene.
pub const MAX_LIGHTS: usize = 4;

/// How the gradient of the values is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Gradient {
    /// Half the difference of the values one voxel ahead and one behind along each axis, both interpolated: smooth from cell to cell.
    #[default]
    Central,
    /// The derivative of the interpolation itself, from the voxels that a value is interpolated between. Linear interpolation has jumps in it
    /// from cell to cell.
    Analytic,
    /// Central differences smoothed with the weights 1 2 1 along both other axes (Sobel), interpolated: 64 voxels, for noisy data.
    Sobel,
}

/// Where light comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LightSource {
    /// From the eye.
    Head,
    /// From very far away: the direction towards it, world space. Its length does not matter.
    Direction(DVec3),
    /// From a point, world space; it does not get weaker with distance.
    Position(DVec3),
}

/// A light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    source: LightSource,
    color: [f64; 3],
}

impl Default for Light {
    fn default() -> Self {
        Self { source: LightSource::Head, color: [1.0; 3] }
    }
}

impl Light {
    /// A light from `source` of a colour (red, green, blue, each 0 to 1).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a direction of length 0, for numbers that are not finite, and for colours outside `[0,1]`.
    pub fn new(source: LightSource, color: [f64; 3]) -> Result<Self> {
        if let Some(c) = color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::invalid(format!("light color {c}: outside [0,1]")));
        }
        let source = match source {
            LightSource::Direction(d) | LightSource::Position(d) if !d.is_finite() => {
                let key = if matches!(source, LightSource::Position(_)) { "position" } else { "direction" };
                return Err(Error::invalid(format!("light {key} [{}, {}, {}]: must be finite", d.x, d.y, d.z)));
            }
            LightSource::Direction(d) if super::is_unit(d.length()) => source,
            LightSource::Direction(d) => {
                // Scaled first: squares may leave f64.
                let most = d.abs().max_element();
                if most == 0.0 {
                    return Err(Error::invalid("light direction [0, 0, 0]: must not have length 0"));
                }
                LightSource::Direction((d / most).normalize())
            }
            other => other,
        };
        Ok(Self { source, color })
    }

    /// Where it comes from; directions have length 1.
    pub fn source(&self) -> LightSource {
        self.source
    }

    /// Red, green, blue, each 0 to 1.
    pub fn color(&self) -> [f64; 3] {
        self.color
    }
}

/// What light does to colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Shading {
    /// The formula at the top of this page.
    #[default]
    BlinnPhong,
    /// Darker with depth, as early systems showed it: c' = c (1 - (d - d0) / (d1 - d0)), where the box reaches from depth d0 to d1. Needs
    /// no gradient.
    Depth,
}

/// A material and the lights on it.
///
/// # Guarantees
/// Coefficients are finite and not negative, the shininess lies between 1 and 1000, and there is one light at least, four at most.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Lighting {
    /// What light does to colours.
    pub shading: Shading,
    /// Share of the colour that no light is needed for.
    pub ambient: f64,
    /// Share of the colour that turns dark away from a light.
    pub diffuse: f64,
    /// Strength of the highlight, in the light's colour.
    pub specular: f64,
    /// How narrow the highlight is: 1 to 1000.
    pub shininess: f64,
    /// Share of the colour that shines by itself.
    pub emission: f64,
    /// Whether surfaces are lit from behind as from in front.
    pub two_sided: bool,
    /// Size of the gradient at which light counts half, data units per world unit; 0: light counts in full wherever there is a gradient.
    pub gradient_floor: f64,
    lights: Vec<Light>,
}

impl Default for Lighting {
    fn default() -> Self {
        Self {
            shading: Shading::BlinnPhong,
            ambient: 0.25,
            diffuse: 0.75,
            specular: 0.2,
            shininess: 20.0,
            emission: 0.0,
            two_sided: true,
            gradient_floor: 0.0,
            lights: vec![Light::default()],
        }
    }
}

impl Lighting {
    /// The lights.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The same material in other lights.
    ///
    /// # Errors
    /// [`Error::Invalid`] for none, and for more than [`MAX_LIGHTS`].
    pub fn with_lights(mut self, lights: Vec<Light>) -> Result<Self> {
        if lights.is_empty() || lights.len() > MAX_LIGHTS {
            return Err(Error::invalid(format!("lights: {} are given, there can be 1 to {MAX_LIGHTS}", lights.len())));
        }
        self.lights = lights;
        Ok(self)
    }

    /// Whether light depends on the gradient of the values.
    pub(crate) fn needs_gradient(&self) -> bool {
        self.shading == Shading::BlinnPhong
    }

    /// The same with every component of the lights' colours turned into another within `[0,1]`.
    pub(super) fn with_colors_turned(&self, turn: impl Fn(f64) -> f64) -> Self {
        let turned = |light: &Light| Light { color: light.color.map(|c| turn(c).clamp(0.0, 1.0)), ..*light };
        Self { lights: self.lights.iter().map(turned).collect(), ..self.clone() }
    }

    /// That every number is in its range.
    pub(super) fn check(&self) -> Result<()> {
        let coefficients = [
            ("ambient", self.ambient),
            ("diffuse", self.diffuse),
            ("specular", self.specular),
            ("emission", self.emission),
            ("gradient_floor", self.gradient_floor),
        ];
        for (key, x) in coefficients {
            if !(x >= 0.0 && x.is_finite()) {
                return Err(Error::invalid(format!("light {key} {x}: must be finite and not negative")));
            }
        }
        if !(1.0..=1000.0).contains(&self.shininess) {
            return Err(Error::invalid(format!("light shininess {}: must lie between 1 and 1000", self.shininess)));
        }
        Ok(())
    }
}
