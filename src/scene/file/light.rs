//! The sections `[light]` and `[[lights]]`: a material, and what shines on it.

use super::section::{Context, choices};
use crate::scene::{Gradient, Light, LightSource, Lighting, Scene, Shading};
use crate::{Error, Result};
use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LightKeys {
    /// Whether the section stands in the scene, be it empty.
    #[serde(skip)]
    #[schemars(skip)]
    pub present: bool,
    /// What light does: Blinn and Phong's formula (blinn-phong, the default), darker with depth (depth), or nothing (none: presets come lit, and level surfaces are lit from the eye).
    pub model: Option<ModelKey>,
    /// Share of the colour that needs no light; 0.25 unless given.
    pub ambient: Option<f64>,
    /// Share of the colour that turns dark away from a light; 0.75 unless given.
    pub diffuse: Option<f64>,
    /// Strength of the highlight; 0.2 unless given.
    pub specular: Option<f64>,
    /// How narrow the highlight is, 1 to 1000; 20 unless given.
    pub shininess: Option<f64>,
    /// Share of the colour that shines by itself; 0 unless given.
    pub emission: Option<f64>,
    /// Where light comes from: "head" (from the eye, the default), or towards it [x, y, z], world space.
    #[schemars(schema_with = "direction_schema")]
    pub direction: Option<DirectionKey>,
    /// Point that light comes from, world space, instead of a direction.
    pub position: Option<[f64; 3]>,
    /// Red, green, blue of the light, each 0 to 1; white unless given.
    pub color: Option<[f64; 3]>,
    /// Whether surfaces are lit from behind as from in front; true unless given.
    pub two_sided: Option<bool>,
    /// How gradients are taken: differences of neighbours (central, the default), of the cell itself (analytic), or smoothed (sobel).
    pub gradient: Option<GradientKey>,
    /// Size of the gradient at which light counts half, data units per world unit; 0 (light counts wherever there is a gradient), or the preset's own, unless given.
    pub gradient_floor: Option<f64>,
}

/// A light: { direction = [x, y, z] or "head", or position = [x, y, z]; color = [r, g, b] }.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a light: { direction = [x, y, z], color = [r, g, b] }")]
pub(super) struct LightsKeys {
    /// Where light comes from: "head" (from the eye, the default), or towards it [x, y, z], world space.
    #[schemars(schema_with = "direction_schema")]
    pub direction: Option<DirectionKey>,
    /// Point that light comes from, world space, instead of a direction.
    pub position: Option<[f64; 3]>,
    /// Red, green, blue of the light, each 0 to 1; white unless given.
    pub color: Option<[f64; 3]>,
}

/// Words of a direction, or its components.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "expected \"head\" or [x, y, z]")]
pub(super) enum DirectionKey {
    Word(String),
    Towards([f64; 3]),
}

choices! {
    ModelKey { BlinnPhong, Depth, None }
    GradientKey => Gradient { Central, Analytic, Sobel }
}

/// The section as it stands in a scene.
pub(super) fn section<'de, D: serde::Deserializer<'de>>(from: D) -> std::result::Result<LightKeys, D::Error> {
    LightKeys::deserialize(from).map(|keys| LightKeys { present: true, ..keys })
}

fn direction_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "array", "null"], "items": { "type": "number" } })
}

/// The light of `direction`, `position` and `color` of the section `at`.
fn light(
    cx: &Context<'_>,
    at: &str,
    direction: Option<&DirectionKey>,
    position: Option<[f64; 3]>,
    color: Option<[f64; 3]>,
) -> Result<Light> {
    let direction = match direction {
        None => None,
        Some(DirectionKey::Towards(d)) => Some(*d),
        Some(DirectionKey::Word(word)) if word == "head" => None,
        // A flag's value is text.
        Some(DirectionKey::Word(word)) => Some(
            numbers(word)
                .ok_or_else(|| cx.error(&format!("{at}.direction"), format!("\"{word}\": expected \"head\" or three numbers x, y, z")))?,
        ),
    };
    let source = match (direction, position) {
        (Some(_), Some(_)) => return Err(cx.error(&format!("{at}.position"), format!("{at}.direction is given too; give one of them"))),
        (Some(d), None) => LightSource::Direction(DVec3::from_array(d)),
        (None, Some(p)) => LightSource::Position(DVec3::from_array(p)),
        (None, None) => LightSource::Head,
    };
    Light::new(source, color.unwrap_or([1.0; 3])).map_err(|e| match e {
        Error::Invalid(what) if at != "light" => cx.error(at, what.trim_start_matches("light ")),
        other => cx.places.locate(other),
    })
}

fn numbers(text: &str) -> Option<[f64; 3]> {
    let parts: Option<Vec<f64>> = text.trim_matches(['[', ']', ' ']).split(',').map(|part| part.trim().parse().ok()).collect();
    parts?.try_into().ok()
}

/// The keys of a light.
fn light_keys(light: &Light) -> LightsKeys {
    let (direction, position) = match light.source() {
        LightSource::Head => (Some(DirectionKey::Word("head".to_owned())), None),
        LightSource::Direction(towards) => (Some(DirectionKey::Towards(towards.to_array())), None),
        LightSource::Position(point) => (None, Some(point.to_array())),
    };
    LightsKeys { direction, position, color: Some(light.color()) }
}

/// The keys that say what the light on `scene` is. One light stands with its material, several stand beside it.
pub(super) fn of(scene: &Scene) -> (LightKeys, Vec<LightsKeys>) {
    let gradient = Some(scene.gradient().into());
    let Some(l) = scene.lighting() else {
        let model = scene.flat_surfaces().then_some(ModelKey::None);
        return (LightKeys { model, gradient, ..LightKeys::default() }, Vec::new());
    };
    let all: Vec<LightsKeys> = l.lights().iter().map(light_keys).collect();
    let (own, several) = match <[LightsKeys; 1]>::try_from(all) {
        Ok([one]) => (one, Vec::new()),
        Err(all) => (LightsKeys::default(), all),
    };
    let material = LightKeys {
        present: true,
        model: Some(match l.shading {
            Shading::BlinnPhong => ModelKey::BlinnPhong,
            Shading::Depth => ModelKey::Depth,
        }),
        ambient: Some(l.ambient),
        diffuse: Some(l.diffuse),
        specular: Some(l.specular),
        shininess: Some(l.shininess),
        emission: Some(l.emission),
        direction: own.direction,
        position: own.position,
        color: own.color,
        two_sided: Some(l.two_sided),
        gradient,
        gradient_floor: Some(l.gradient_floor),
    };
    (material, several)
}

impl LightKeys {
    /// Whether the section asks for light. Its kind of gradient alone does not: opacity may depend on gradients too.
    fn given(&self) -> bool {
        let gradient = Self { gradient: self.gradient, present: self.present, ..Self::default() };
        self.model != Some(ModelKey::None) && (*self != gradient || (self.present && self.gradient.is_none()))
    }

    /// Whether light is turned off.
    pub(super) fn is_off(&self) -> bool {
        self.model == Some(ModelKey::None)
    }

    /// `scene` in the light that the sections describe: changes to `ready`, the light of a preset, where there is one.
    pub(super) fn apply(&self, lights: &[LightsKeys], ready: Option<Lighting>, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        let scene = scene.with_gradient(self.gradient.map_or(Gradient::Central, Gradient::from));
        let scene = scene.with_flat_surfaces(self.model == Some(ModelKey::None));
        if self.model == Some(ModelKey::None) {
            return scene.with_lighting(None);
        }
        let asked = self.given() || !lights.is_empty();
        if !asked && ready.is_none() {
            return scene.with_lighting(None);
        }
        let mut lighting = ready.unwrap_or_default();
        if let Some(model) = self.model {
            lighting.shading = if model == ModelKey::Depth { Shading::Depth } else { Shading::BlinnPhong };
        }
        let set = |to: &mut f64, given: Option<f64>| *to = given.unwrap_or(*to);
        set(&mut lighting.ambient, self.ambient);
        set(&mut lighting.diffuse, self.diffuse);
        set(&mut lighting.specular, self.specular);
        set(&mut lighting.shininess, self.shininess);
        set(&mut lighting.emission, self.emission);
        set(&mut lighting.gradient_floor, self.gradient_floor);
        lighting.two_sided = self.two_sided.unwrap_or(lighting.two_sided);
        if lights.is_empty() {
            let own = light(cx, "light", self.direction.as_ref(), self.position, self.color)?;
            if self.direction.is_some() || self.position.is_some() || self.color.is_some() {
                lighting = lighting.with_lights(vec![own])?;
            }
        } else {
            let own = [
                ("light.direction", self.direction.is_some()),
                ("light.position", self.position.is_some()),
                ("light.color", self.color.is_some()),
            ];
            cx.refuse(&own, "[[lights]] are given too, each with its own; give one of them")?;
            let each = |(i, l): (usize, &LightsKeys)| light(cx, &format!("lights[{i}]"), l.direction.as_ref(), l.position, l.color);
            let all: Result<Vec<Light>> = lights.iter().enumerate().map(each).collect();
            lighting = lighting.with_lights(all?).map_err(|e| cx.error("lights", e.to_string().trim_start_matches("lights: ")))?;
        }
        let lit = scene.clone().with_lighting(Some(lighting));
        // The light of a preset gives way to what it does not go together with; one that is asked for does not.
        if !asked && lit.is_err() { scene.with_lighting(None) } else { lit.map_err(|e| cx.places.locate(e)) }
    }
}
