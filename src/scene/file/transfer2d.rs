//! The section `[transfer2d]`: from a value and the size of its gradient to colour and opacity.

use super::section::{Context, Given};
use crate::Result;
use crate::picture::Picture;
use crate::scene::{Region, Scene, Shape, Transfer2d};
use schemars::JsonSchema;
use serde::Deserialize;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Transfer2dKeys {
    /// Regions, [{ shape = "box", value = [a, b], gradient = [g, h], color = [r, g, b], opacity = 0.5 }, ...]; shapes are box, triangle, gaussian, levoy.
    pub regions: Option<Vec<RegionKeys>>,
    /// NumPy file of gradient x value x 4 numbers (f32, straight red, green, blue and opacity), instead of regions.
    pub table: Option<String>,
    /// Values at the table's first and last column.
    pub range: Option<[f64; 2]>,
    /// Sizes of the gradient at the table's first and last row, data units per world unit.
    pub gradient_range: Option<[f64; 2]>,
    /// Length that opacities refer to, world units; the smallest voxel spacing unless given.
    pub opacity_unit: Option<f64>,
}

/// A region of values and sizes of gradients.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "shape")]
pub(super) enum RegionKeys {
    Box {
        value: [f64; 2],
        gradient: [f64; 2],
        #[serde(default = "white")]
        color: [f64; 3],
        opacity: f64,
    },
    Triangle {
        value: f64,
        width: f64,
        gradient: f64,
        #[serde(default = "white")]
        color: [f64; 3],
        opacity: f64,
    },
    Gaussian {
        value: f64,
        width: f64,
        gradient: f64,
        height: f64,
        #[serde(default = "white")]
        color: [f64; 3],
        opacity: f64,
    },
    Levoy {
        value: f64,
        thickness: f64,
        #[serde(default = "white")]
        color: [f64; 3],
        opacity: f64,
    },
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

impl RegionKeys {
    fn region(&self) -> Region {
        match *self {
            Self::Box { value, gradient, color, opacity } => Region { shape: Shape::Box { value, gradient }, color, opacity },
            Self::Triangle { value, width, gradient, color, opacity } => {
                Region { shape: Shape::Triangle { value, width, gradient }, color, opacity }
            }
            Self::Gaussian { value, width, gradient, height, color, opacity } => {
                Region { shape: Shape::Gaussian { value, width, gradient, height }, color, opacity }
            }
            Self::Levoy { value, thickness, color, opacity } => Region { shape: Shape::Levoy { value, thickness }, color, opacity },
        }
    }
}

impl Transfer2dKeys {
    /// Whether the section says anything.
    pub(super) fn given(&self) -> bool {
        *self != Self::default()
    }

    /// `scene` through the section's transfer function, where there is one.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        if !self.given() {
            return Ok(scene);
        }
        cx.refuse(&cx.document.transfer.given(), "transfer2d is given too; give one of them")?;
        let ranges: [Given; 2] = [("transfer2d.range", self.range.is_some()), ("transfer2d.gradient_range", self.gradient_range.is_some())];
        let transfer = match (&self.regions, &self.table) {
            (Some(regions), None) => {
                cx.refuse(&ranges, "is for transfer2d.table, which is not given")?;
                Transfer2d::regions(regions.iter().map(RegionKeys::region).collect())
                    .map_err(|e| cx.error("transfer2d.regions", e.to_string()))?
            }
            (None, Some(path)) => {
                let (Some(range), Some(gradient_range)) = (self.range, self.gradient_range) else {
                    return Err(cx.error("transfer2d.table", "needs transfer2d.range and transfer2d.gradient_range"));
                };
                let path = cx.base.join(path);
                let table = Picture::open(&path)?;
                Transfer2d::table((table.width() as usize, table.height() as usize), table.pixels(), range, gradient_range)
                    .map_err(|e| crate::Error::format(&path, e.to_string()))?
            }
            (Some(_), Some(_)) => return Err(cx.error("transfer2d.table", "transfer2d.regions is given too; give one of them")),
            (None, None) => return Err(cx.error("transfer2d.opacity_unit", "there are no transfer2d.regions, and no transfer2d.table")),
        };
        let transfer = match self.opacity_unit {
            Some(length) => transfer.with_unit(length).map_err(|e| cx.places.locate(e))?,
            None => transfer,
        };
        scene.with_transfer2d(Some(transfer)).map_err(|e| cx.places.locate(e))
    }
}
