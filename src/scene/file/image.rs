//! The section `[image]`: the picture's size, and what is behind the volume.

use super::section::Data;
use crate::Result;
use crate::scene::{Scene, Straight};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ImageKeys {
    /// Columns of pixels; 512 unless given, for render.algorithm = "grid" as many as there are voxels.
    pub width: Option<u32>,
    /// Rows of pixels; as for width.
    pub height: Option<u32>,
    /// Red, green, blue, opacity behind the volume, each 0 to 1, not premultiplied; transparent unless given.
    pub background: Option<[f64; 4]>,
}

impl ImageKeys {
    /// The keys that say what the picture of `scene` is.
    pub(super) fn of(scene: &Scene) -> Self {
        let ((width, height), Straight { rgb: [r, g, b], alpha }) = (scene.size(), scene.background());
        Self { width: Some(width), height: Some(height), background: Some([r, g, b, alpha]) }
    }

    /// A picture of rows of voxels has a pixel for each, unless the scene says how many.
    pub(super) fn finish(&self, data: &mut Data<'_>) -> Result<()> {
        let Some((columns, rows)) = data.scene.voxel_rows(data.volume) else { return Ok(()) };
        let (width, height) = (self.width.unwrap_or(columns), self.height.unwrap_or(rows));
        data.scene = data.scene.clone().with_size(width, height)?;
        Ok(())
    }

    /// `scene` at the size and over the background that are given.
    pub(super) fn apply(&self, scene: Scene) -> Result<Scene> {
        let (width, height) = scene.size();
        let scene = scene.with_size(self.width.unwrap_or(width), self.height.unwrap_or(height))?;
        match self.background {
            Some([r, g, b, alpha]) => scene.with_background(Straight { rgb: [r, g, b], alpha }),
            None => Ok(scene),
        }
    }
}
