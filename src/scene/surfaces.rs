//! Level surfaces: where the values of a volume equal a number, drawn as surfaces of a colour and an opacity.

use super::linear_light::to_linear;
use super::{Blend, Gradient, Scene};
use crate::{Error, Result};

/// Most level surfaces of a scene.
pub const MAX_LEVELS: usize = 16;

/// The surface at one value of a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelSurface {
    level: f64,
    color: Option<[f64; 3]>,
    opacity: f64,
}

impl LevelSurface {
    /// The surface where values are `level`, data units: of a straight `color` (red, green, blue, each 0 to 1; without one the transfer
    /// function's at the level) and an `opacity`, 0 to 1, which does not depend on the angle at which a ray meets it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a level that is not finite, and for a colour or an opacity outside `[0,1]`.
    pub fn new(level: f64, color: Option<[f64; 3]>, opacity: f64) -> Result<Self> {
        if !level.is_finite() {
            return Err(Error::invalid(format!("level {level}: must be finite")));
        }
        if let Some(c) = color.iter().flatten().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::invalid(format!("color {c}: outside [0,1]")));
        }
        if !(0.0..=1.0).contains(&opacity) {
            return Err(Error::invalid(format!("opacity {opacity}: outside [0,1]")));
        }
        Ok(Self { level, color, opacity })
    }

    /// Its value, data units.
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Its straight colour; `None` for the transfer function's at its value.
    pub fn color(&self) -> Option<[f64; 3]> {
        self.color
    }

    /// Its opacity, 0 to 1.
    pub fn opacity(&self) -> f64 {
        self.opacity
    }
}

/// Where between two slices a ray meets a level surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Hit {
    /// Where the interpolated values cross the level, by bisection to 1/65536 of the distance of two slices.
    #[default]
    Refined,
    /// At the first slice behind the crossing: up to a slab too far away. For comparison: surfaces show rings where they pass from slice to
    /// slice.
    FirstSample,
}

/// The surfaces of a scene in the numbers of a frame, by rising level.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Surfaces {
    /// Level, straight colour, opacity.
    pub(crate) levels: Vec<(f64, [f64; 3], f64)>,
    /// Whether a ray that enters the box above the level meets the surface there.
    pub(crate) capped: bool,
}

impl Scene {
    /// The scene drawn as level surfaces, in any order of levels: all that a ray meets, the nearest in front, each translucent by its opacity.
    /// Its blend becomes [`Blend::Surfaces`].
    ///
    /// The box's faces and clip planes are no surfaces: a ray that enters above a level sees the inside of that surface where it leaves it.
    /// Voxels that are NaN or infinite part the values on both of their sides, and there is no surface between those.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no surface, for more than [`MAX_LEVELS`], and for two of one level; together with the profile `opengl`.
    pub fn with_levels(mut self, levels: Vec<LevelSurface>) -> Result<Self> {
        if levels.is_empty() || levels.len() > MAX_LEVELS {
            return Err(Error::invalid(format!("render levels: {} are given, there can be 1 to {MAX_LEVELS}", levels.len())));
        }
        if let Some(twice) = levels.iter().enumerate().find_map(|(n, a)| levels[..n].iter().find(|b| b.level == a.level)) {
            return Err(Error::invalid(format!("render levels: {} is given twice", twice.level)));
        }
        self.levels = levels;
        self.with_blend(Blend::Surfaces)
    }

    /// The scene whose level surfaces are met at another place between two slices.
    #[must_use]
    pub fn with_hit(mut self, hit: Hit) -> Self {
        self.hit = hit;
        self
    }

    /// Whether level surfaces keep their colour as it is where the scene has no light; else, and unless asked for, they are lit from the eye:
    /// 0.2 of the colour wherever they face, all of it where they face the eye.
    #[must_use]
    pub fn with_flat_surfaces(mut self, flat: bool) -> Self {
        self.flat_surfaces = flat;
        self
    }

    /// The surfaces of [`Blend::Surfaces`].
    pub fn levels(&self) -> &[LevelSurface] {
        &self.levels
    }

    /// Where between two slices level surfaces are met.
    pub fn hit(&self) -> Hit {
        self.hit
    }

    /// Whether level surfaces keep their colour as it is where the scene has no light.
    pub fn flat_surfaces(&self) -> bool {
        self.flat_surfaces
    }

    /// The surfaces that rays are followed through. `None` where there are none, and for [`Blend::Iso`] when nothing else is asked of it: that
    /// first crossing has a projection of its own.
    pub(crate) fn surfaces(&self) -> Option<Surfaces> {
        let color = |level: f64| self.transfer().eval(level).rgb;
        match self.blend {
            Blend::Iso { level } => {
                let plain =
                    self.lighting.is_none() && !self.flat_surfaces && self.hit == Hit::Refined && self.gradient == Gradient::Central;
                (!plain).then(|| Surfaces { levels: vec![(level, color(level), 1.0)], capped: true })
            }
            Blend::Surfaces => {
                let mut levels: Vec<_> =
                    self.levels.iter().map(|s| (s.level, s.color.unwrap_or_else(|| color(s.level)), s.opacity)).collect();
                levels.sort_by(|a, b| a.0.total_cmp(&b.0));
                Some(Surfaces { levels, capped: false })
            }
            _ => None,
        }
    }

    /// Its surfaces with colours of amounts of light.
    pub(super) fn levels_in_light(&self) -> Vec<LevelSurface> {
        self.levels.iter().map(|s| LevelSurface { color: s.color.map(|rgb| rgb.map(to_linear)), ..*s }).collect()
    }
}
