//! The sections `[[region]]`: regions of space with a transfer function of their own.

use super::section::{Context, Data, choices};
use crate::scene::preset::Preset;
use crate::scene::{FocusRegion, FocusShape, Scene, TransferFunction};
use crate::{Error, Result};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A region in which another transfer function holds; of several that hold a place the first counts.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a region: { shape = \"sphere\", center = [x, y, z], radius = r, preset = \"ct-bone\" }")]
pub(super) struct RegionKeys {
    /// sphere, or box, whose faces lie across the world's axes.
    pub shape: ShapeKey,
    /// Its centre, world units.
    pub center: [f64; 3],
    /// sphere: radius, world units.
    #[serde(default)]
    pub radius: Option<f64>,
    /// box: lengths along x, y and z, world units.
    #[serde(default)]
    pub size: Option<[f64; 3]>,
    /// Ready-made transfer function that holds in it, in the place of points.
    #[serde(default)]
    pub preset: Option<String>,
    /// Points [value, red, green, blue]; the scene's own colours unless given.
    #[serde(default)]
    pub color: Option<Vec<[f64; 4]>>,
    /// Points [value, opacity per opacity_unit]; the scene's own opacities unless given.
    #[serde(default)]
    pub opacity: Option<Vec<[f64; 2]>>,
    /// Length that opacities refer to, world units; that of the preset or of the scene's own opacities, else the smallest voxel spacing, unless given.
    #[serde(default)]
    pub opacity_unit: Option<f64>,
}

choices! {
    ShapeKey { Sphere, Box }
}

/// The regions of `scene`.
pub(super) fn of(scene: &Scene) -> Vec<RegionKeys> {
    let keys = |region: &FocusRegion| {
        let (shape, radius, size) = match region.shape() {
            FocusShape::Sphere { radius } => (ShapeKey::Sphere, Some(radius), None),
            FocusShape::Box { size } => (ShapeKey::Box, None, Some(size)),
        };
        let transfer = region.transfer();
        RegionKeys {
            shape,
            center: region.center().to_array(),
            radius,
            size,
            preset: None,
            color: Some(transfer.color().iter().map(|&(v, [r, g, b])| [v, r, g, b]).collect()),
            opacity: Some(transfer.opacity().iter().map(|&(v, a)| [v, a]).collect()),
            opacity_unit: transfer.unit(),
        }
    };
    scene.regions().iter().map(keys).collect()
}

/// Finds mistakes that need no volume to be found.
pub(super) fn before_data(regions: &[RegionKeys], cx: &Context<'_>) -> Result<()> {
    for (n, keys) in regions.iter().enumerate() {
        keys.preset(cx, n)?;
        // Whatever function holds in it.
        let any = TransferFunction::new(vec![(0.0, [0.0; 3])], vec![(0.0, 0.0)])?;
        let own = if keys.preset.is_some() { any } else { keys.of_points(&any).map_err(|e| placed(cx, n, &e))? };
        keys.region(cx, n, own)?;
    }
    Ok(())
}

/// The scene with `regions` for its volume.
pub(super) fn finish(regions: &[RegionKeys], cx: &Context<'_>, data: &mut Data<'_>) -> Result<()> {
    let mut list = Vec::new();
    for (n, keys) in regions.iter().enumerate() {
        let transfer = match keys.preset(cx, n)? {
            Some(preset) => {
                let found = preset.found(Some(data.volume)).map_err(|e| placed(cx, n, &e))?;
                data.warnings.extend(found.warnings);
                found.transfer
            }
            None => keys.of_points(data.scene.transfer()).map_err(|e| placed(cx, n, &e))?,
        };
        let transfer = match keys.opacity_unit {
            Some(length) => transfer.with_unit(length).map_err(|e| placed(cx, n, &e))?,
            None => transfer,
        };
        let region = keys.region(cx, n, transfer)?;
        if !region.touches(data.volume.grid()) {
            data.warnings.push(format!("region[{n}]: lies outside the volume's box, and changes nothing"));
        }
        list.push(region);
    }
    data.scene = data.scene.clone().with_regions(list).map_err(|e| cx.places.locate(e))?;
    Ok(())
}

/// `error` about region `n`.
fn placed(cx: &Context<'_>, n: usize, error: &Error) -> Error {
    cx.error(&format!("region[{n}]"), error.to_string())
}

impl RegionKeys {
    fn preset(&self, cx: &Context<'_>, n: usize) -> Result<Option<Preset>> {
        let Some(name) = &self.preset else { return Ok(None) };
        let lists = [(format!("region[{n}].color"), self.color.is_some()), (format!("region[{n}].opacity"), self.opacity.is_some())];
        cx.refuse(&lists.each_ref().map(|(key, given)| (key.as_str(), *given)), "preset is given too; give one of them")?;
        cx.named(&format!("region[{n}].preset"), name, &Preset::ALL, Preset::name).map(Some)
    }

    /// The function of its points, and of those of `main` where it has none.
    fn of_points(&self, main: &TransferFunction) -> Result<TransferFunction> {
        if self.color.is_none() && self.opacity.is_none() {
            return Err(Error::invalid("give a preset, or points of color or opacity"));
        }
        let colors = self.color.as_ref().map(|list| list.iter().map(|&[v, r, g, b]| (v, [r, g, b])).collect());
        let opacities = self.opacity.as_ref().map(|list| list.iter().map(|&[v, a]| (v, a)).collect());
        let unit = self.opacity_unit.or(if self.opacity.is_none() { main.unit() } else { None });
        let own =
            TransferFunction::new(colors.unwrap_or_else(|| main.color().to_vec()), opacities.unwrap_or_else(|| main.opacity().to_vec()))?;
        match unit {
            Some(length) => own.with_unit(length),
            None => Ok(own),
        }
    }

    /// The region, in which `transfer` holds.
    fn region(&self, cx: &Context<'_>, n: usize, transfer: TransferFunction) -> Result<FocusRegion> {
        let needs = |key: &str, what: &str| cx.error(&format!("region[{n}]"), format!("a {what} needs its {key}"));
        let other = |key: &str, given: bool, what: &str| cx.refuse(&[(&format!("region[{n}].{key}"), given)], &format!("is for a {what}"));
        let shape = match self.shape {
            ShapeKey::Sphere => {
                other("size", self.size.is_some(), "box; a sphere has a radius")?;
                FocusShape::Sphere { radius: self.radius.ok_or_else(|| needs("radius", "sphere"))? }
            }
            ShapeKey::Box => {
                other("radius", self.radius.is_some(), "sphere; a box has a size")?;
                FocusShape::Box { size: self.size.ok_or_else(|| needs("size", "box"))? }
            }
        };
        FocusRegion::new(shape, DVec3::from_array(self.center), transfer).map_err(|e| placed(cx, n, &e))
    }
}
