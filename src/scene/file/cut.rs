//! The sections `[[cut]]`: opaque planes that show the data on them.

use super::schema::names;
use super::section::{Context, Data};
use crate::Result;
use crate::scene::{ColorMap, CutPlane, Scene};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An opaque plane that shows the data on it: where normal . p = offset, inside the box.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a plane: { normal = [x, y, z], offset = d }")]
pub(super) struct CutKeys {
    /// Direction across the plane, world space.
    pub normal: [f64; 3],
    /// Where the plane cuts a line along normal, in world units for a normal of length 1.
    #[serde(default)]
    pub offset: f64,
    /// Colours from the least value to the greatest; gray unless given.
    #[serde(default)]
    #[schemars(schema_with = "maps")]
    pub colormap: Option<String>,
    /// Centre and width of the values between the first and the last colour, data units; all of the data's unless given.
    #[serde(default)]
    pub window: Option<[f64; 2]>,
}

fn maps(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    names(ColorMap::ALL.into_iter().map(ColorMap::name))
}

/// The planes inside `scene`.
pub(super) fn of(scene: &Scene) -> Vec<CutKeys> {
    let keys = |p: &CutPlane| CutKeys {
        normal: p.normal().to_array(),
        offset: p.offset(),
        colormap: Some(p.colors().name().to_owned()),
        window: p.window().map(|(center, width)| [center, width]),
    };
    scene.cuts().iter().map(keys).collect()
}

/// `scene` with `planes` inside it.
pub(super) fn apply(planes: &[CutKeys], cx: &Context<'_>, scene: Scene) -> Result<Scene> {
    let plane = |(i, keys): (usize, &CutKeys)| {
        let refused = |e: crate::Error| cx.error(&format!("cut[{i}]"), e.to_string());
        let mut plane = CutPlane::new(DVec3::from_array(keys.normal), keys.offset).map_err(refused)?;
        if let Some(name) = &keys.colormap {
            plane = plane.with_colors(cx.named(&format!("cut[{i}].colormap"), name, &ColorMap::ALL, ColorMap::name)?);
        }
        match keys.window {
            Some([center, width]) => plane.with_window(center, width).map_err(refused),
            None => Ok(plane),
        }
    };
    let planes: Result<Vec<CutPlane>> = planes.iter().enumerate().map(plane).collect();
    // Refusals of the scene's begin with the section.
    scene.with_cuts(planes?).map_err(|e| cx.error("cut", e.to_string().trim_start_matches("cut: ")))
}

/// Tells which planes pass the box by, and which values planes without a window show.
pub(super) fn finish(data: &mut Data<'_>) {
    let corners = data.volume.grid().corners();
    for (n, plane) in data.scene.cuts().iter().enumerate() {
        let beyond = corners.map(|c| plane.normal().dot(c) - plane.offset());
        if beyond.iter().all(|d| *d > 0.0) || beyond.iter().all(|d| *d < 0.0) {
            data.warnings.push(format!("cut[{n}]: passes the volume's box by, and shows nothing"));
        }
    }
    if let Some(plane) = data.scene.cuts().iter().find(|p| p.window().is_none()) {
        let (low, high) = plane.values(data.volume.range());
        data.notes.push(format!("cut.window is not given: colours go from {low} to {high}, all of the data's values"));
    }
}
