//! The sections `[[clip]]`: planes that cut the box.

use super::section::Context;
use crate::Result;
use crate::scene::{ClipPlane, Scene};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A plane that cuts the box: kept is where normal . p >= offset.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a plane: { normal = [x, y, z], offset = d }")]
pub(super) struct ClipKeys {
    /// Direction from the plane to what is kept, world space.
    pub normal: [f64; 3],
    /// Where the plane cuts a line along normal, in world units for a normal of length 1.
    #[serde(default)]
    pub offset: f64,
}

/// The planes that cut `scene`.
pub(super) fn of(scene: &Scene) -> Vec<ClipKeys> {
    scene.clip_planes().iter().map(|p| ClipKeys { normal: p.normal().to_array(), offset: p.offset() }).collect()
}

/// `scene` cut by `planes`.
pub(super) fn apply(planes: &[ClipKeys], cx: &Context<'_>, scene: Scene) -> Result<Scene> {
    let planes: Result<Vec<ClipPlane>> = planes.iter().map(|c| ClipPlane::new(DVec3::from_array(c.normal), c.offset)).collect();
    scene.with_clip_planes(planes?).map_err(|e| cx.error("clip", e.to_string()))
}
