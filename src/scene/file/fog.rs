//! The section `[fog]`: OpenGL's fog.

use super::section::{Context, Given, choices};
use crate::Result;
use crate::scene::{Fog, FogDistance, FogMode, FogWeighting, Scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FogKeys {
    /// How the fog factor falls with distance; none unless given.
    pub mode: Option<FogModeKey>,
    /// exp and exp2: density per world unit; 1 unless given.
    pub density: Option<f64>,
    /// linear: distance at which fog begins; 0 unless given.
    pub start: Option<f64>,
    /// linear: distance at which only fog is left; 1 unless given.
    pub end: Option<f64>,
    /// Red, green, blue of the fog, each 0 to 1; black unless given.
    pub color: Option<[f64; 3]>,
    /// Distance along the view direction (planar, the default) or from the eye (radial).
    pub distance: Option<FogDistanceKey>,
    /// Fog weighted by opacity (alpha, the default) or as OpenGL writes it (literal, the default in the profile opengl), which lights
    /// up empty slices of premultiplied colours.
    pub weighting: Option<FogWeightingKey>,
    /// Whether the background is fogged too.
    pub background: Option<bool>,
}

choices! {
    FogModeKey { None, Linear, Exp, Exp2 }
    FogDistanceKey => FogDistance { Planar, Radial }
    FogWeightingKey => FogWeighting { Alpha, Literal }
}

impl FogKeys {
    /// The keys that say what the fog of `scene` is.
    pub(super) fn of(scene: &Scene) -> Self {
        let fog = scene.fog();
        let (mode, density, start, end) = match fog.map(Fog::mode) {
            None => (None, None, None, None),
            Some(FogMode::Linear { start, end }) => (Some(FogModeKey::Linear), None, Some(start), Some(end)),
            Some(FogMode::Exp { density }) => (Some(FogModeKey::Exp), Some(density), None, None),
            Some(FogMode::Exp2 { density }) => (Some(FogModeKey::Exp2), Some(density), None, None),
        };
        Self {
            mode,
            density,
            start,
            end,
            color: fog.map(Fog::color),
            distance: fog.map(|f| f.distance().into()),
            weighting: fog.map(|f| f.weighting().into()),
            background: Some(scene.fogged_background()),
        }
    }

    /// `scene` in the fog, if there is one. The section `[opengl]` has been applied before, because it sets another weighting.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        let fog = self.fog(cx, scene.opengl().is_some())?;
        Ok(scene.with_fogged_background(self.background == Some(true)).with_fog(fog))
    }

    fn fog(&self, cx: &Context<'_>, opengl: bool) -> Result<Option<Fog>> {
        let Some(mode) = self.mode(cx)? else { return Ok(None) };
        let usual = if opengl { FogWeighting::Literal } else { FogWeighting::Alpha };
        let fog = Fog::new(mode, self.color.unwrap_or([0.0; 3]))?
            .with_distance(self.distance.map_or(FogDistance::Planar, FogDistance::from))
            .with_weighting(self.weighting.map_or(usual, FogWeighting::from));
        Ok(Some(fog))
    }

    fn mode(&self, cx: &Context<'_>) -> Result<Option<FogMode>> {
        let density: [Given; 1] = [("fog.density", self.density.is_some())];
        let linear: [Given; 2] = [("fog.start", self.start.is_some()), ("fog.end", self.end.is_some())];
        match self.mode.unwrap_or(FogModeKey::None) {
            FogModeKey::None => {
                // Keys of a fog without a mode would be passed over in silence, and a forgotten mode never noticed.
                cx.refuse(&density, "has no effect without fog.mode = \"exp\" or \"exp2\"")?;
                cx.refuse(&linear, "has no effect without fog.mode = \"linear\"")?;
                // The mode "none" itself, though, switches off a fog that is described.
                if self.mode.is_none() {
                    let described = [
                        ("fog.color", self.color.is_some()),
                        ("fog.distance", self.distance.is_some()),
                        ("fog.weighting", self.weighting.is_some()),
                    ];
                    cx.refuse(&described, "has no effect without fog.mode")?;
                }
                Ok(None)
            }
            FogModeKey::Linear => {
                cx.refuse(&density, "belongs to the modes exp and exp2, not to linear")?;
                Ok(Some(FogMode::Linear { start: self.start.unwrap_or(0.0), end: self.end.unwrap_or(1.0) }))
            }
            mode @ (FogModeKey::Exp | FogModeKey::Exp2) => {
                cx.refuse(&linear, "belongs to the mode linear, not to exp or exp2")?;
                let density = self.density.unwrap_or(1.0);
                Ok(Some(if mode == FogModeKey::Exp { FogMode::Exp { density } } else { FogMode::Exp2 { density } }))
            }
        }
    }
}
