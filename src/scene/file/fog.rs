//! The section `[fog]`: OpenGL's fog.

use super::section::{Context, Data, Given, choices};
use crate::Result;
use crate::scene::{Fog, FogDistance, FogMode, FogWeighting, Scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FogKeys {
    /// How the fog factor falls with distance; none unless given.
    pub mode: Option<FogModeKey>,
    /// exp and exp2: density per world unit. Unless given a third of the colour is left where what shows ends (1 in the profile opengl).
    pub density: Option<f64>,
    /// linear: distance at which fog begins: where what shows begins, unless given (0 in the profile opengl).
    pub start: Option<f64>,
    /// linear: distance at which only fog is left; half as far again behind what shows as that is deep, unless given (1 in the profile opengl).
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

/// Share of the colour below which fog counts as hiding a thing.
const HIDDEN: f64 = 0.05;

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

    /// Fog that reaches from where what shows begins to where it ends, for what the section leaves open; and a warning where hardly any colour is left.
    pub(super) fn finish(&self, data: &mut Data<'_>) -> Result<()> {
        let Some(fog) = data.scene.fog().copied() else { return Ok(()) };
        let is_open = match fog.mode() {
            _ if data.scene.opengl().is_some() => false,
            FogMode::Linear { .. } => self.start.is_none() || self.end.is_none(),
            _ => self.density.is_none(),
        };
        let Some((_, [_, farthest])) = data.scene.box_depths(data.volume) else { return Ok(()) };
        // Nothing is open, and nothing to warn of: what shows need not be looked for, which takes a look at every brick.
        if !is_open && (data.scene.opengl().is_some() || fog.factor(farthest) >= HIDDEN) {
            return Ok(());
        }
        let Some(depths) = data.scene.depths(data.volume) else { return Ok(()) };
        let [front, back] = depths.visible.unwrap_or(depths.whole);
        // exp(-thick) is what is left at the back: a third.
        let thick = libm::log(3.0);
        let mode = match fog.mode() {
            _ if data.scene.opengl().is_some() => fog.mode(),
            FogMode::Exp { .. } if self.density.is_none() => FogMode::Exp { density: thick / back },
            FogMode::Exp2 { .. } if self.density.is_none() => FogMode::Exp2 { density: libm::sqrt(thick) / back },
            FogMode::Linear { start, end } => {
                let start = if self.start.is_some() { start } else { front };
                FogMode::Linear { start, end: if self.end.is_some() { end } else { back + 0.5 * (back - front) } }
            }
            mode => mode,
        };
        let fog = Fog::new(mode, fog.color())?.with_distance(fog.distance()).with_weighting(fog.weighting());
        data.scene = data.scene.clone().with_fog(Some(fog));
        let left = fog.factor(front);
        if left < HIDDEN && data.scene.opengl().is_none() {
            data.warnings.push(format!(
                "fog hides the volume: what shows begins {front:.5} world units from the eye, where {:.1} % of the colour is left",
                100.0 * left
            ));
        }
        Ok(())
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
                // Keys of a fog without a mode would be passed over in silence, and a forgotten mode never noticed. The mode "none" itself, though,
                // switches off a fog that is described.
                if self.mode.is_none() {
                    cx.refuse(&density, "has no effect without fog.mode = \"exp\" or \"exp2\"")?;
                    cx.refuse(&linear, "has no effect without fog.mode = \"linear\"")?;
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
