//! The section `[transfer2d]`: from a value and the size of its gradient to colour and opacity.

use super::section::{Context, Given};
use crate::Result;
use crate::picture::Picture;
use crate::scene::transfer2d::Entries;
use crate::scene::{Region, Scene, Shape, Transfer2d};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Transfer2dKeys {
    /// Regions, [{ shape = "box", value = [a, b], gradient = [g, h], color = [r, g, b], opacity = 0.5 }, ...]; shapes are box, triangle, gaussian, levoy.
    pub regions: Option<Vec<RegionKeys>>,
    /// NumPy file of gradient x value x 4 numbers (f32, straight red, green, blue and opacity), instead of regions; or these numbers
    /// themselves, row by row: [[[r, g, b, a], ...], ...].
    #[schemars(schema_with = "table_schema")]
    pub table: Option<TableKey>,
    /// Values at the table's first and last column.
    pub range: Option<[f64; 2]>,
    /// Sizes of the gradient at the table's first and last row, data units per world unit.
    pub gradient_range: Option<[f64; 2]>,
    /// Length that opacities refer to, world units; the smallest voxel spacing unless given.
    pub opacity_unit: Option<f64>,
}

/// The name of a table's file, or its rows.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "expected the name of a NumPy file, or rows of [r, g, b, a]")]
pub(super) enum TableKey {
    File(String),
    Rows(Vec<Vec<[f64; 4]>>),
}

fn table_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "array", "null"], "items": { "type": "array", "items": { "type": "array", "items": { "type": "number" } } } })
}

/// A region of values and sizes of gradients.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
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
    fn of(&Region { shape, color, opacity }: &Region) -> Self {
        match shape {
            Shape::Box { value, gradient } => Self::Box { value, gradient, color, opacity },
            Shape::Triangle { value, width, gradient } => Self::Triangle { value, width, gradient, color, opacity },
            Shape::Gaussian { value, width, gradient, height } => Self::Gaussian { value, width, gradient, height, color, opacity },
            Shape::Levoy { value, thickness } => Self::Levoy { value, thickness, color, opacity },
        }
    }

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

/// The table with these rows of straight colours and opacities.
fn table_of(rows: &[Vec<[f64; 4]>], range: [f64; 2], gradient_range: [f64; 2]) -> Result<Transfer2d> {
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(n) = rows.iter().position(|row| row.len() != columns) {
        return Err(crate::Error::invalid(format!("row {n} has {} colours, the first one {columns}", rows[n].len())));
    }
    let colors: Vec<[f32; 4]> = rows.iter().flatten().map(|c| c.map(|x| x as f32)).collect();
    Transfer2d::table((columns, rows.len()), &colors, range, gradient_range)
}

impl Transfer2dKeys {
    /// The keys that say what the function of value and gradient of `scene` is; none where there is none.
    pub(super) fn of(scene: &Scene) -> Self {
        let Some(t) = scene.transfer2d() else { return Self::default() };
        let regions = t.region_list();
        let rows = |t: &Entries| t.colors.chunks(t.columns).map(|row| row.iter().map(|c| c.map(f64::from)).collect()).collect();
        Self {
            regions: (!regions.is_empty()).then(|| regions.iter().map(RegionKeys::of).collect()),
            table: t.entries().map(|t| TableKey::Rows(rows(t))),
            range: t.entries().map(|t| t.range),
            gradient_range: t.entries().map(|t| t.gradient_range),
            opacity_unit: t.unit(),
        }
    }

    /// Whether the section says anything.
    pub(super) fn given(&self) -> bool {
        *self != Self::default()
    }

    /// `scene` through the section's transfer function, where there is one.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        if !self.given() {
            return Ok(scene);
        }
        // Level surfaces without a colour of their own still have that of the section transfer.
        if !cx.document.render.is_iso() {
            cx.refuse(&cx.document.transfer.given(), "transfer2d is given too; give one of them")?;
        }
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
                match path {
                    TableKey::Rows(rows) => {
                        table_of(rows, range, gradient_range).map_err(|e| cx.error("transfer2d.table", e.to_string()))?
                    }
                    TableKey::File(path) => {
                        let path = cx.base.join(path);
                        let table = Picture::open(&path)?;
                        Transfer2d::table((table.width() as usize, table.height() as usize), table.pixels(), range, gradient_range)
                            .map_err(|e| crate::Error::format(&path, e.to_string()))?
                    }
                }
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
