//! The section `[transfer]`: from values to colour and opacity.

use super::schema::names;
use super::section::{Context, Data, Rivals, choices};
use crate::scene::preset::{Landmarks, Preset, looks_hounsfield_plus_1024};
use crate::scene::{Classification, ColorMap, Lighting, Method, TransferFunction};
use crate::{Result, Volume};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TransferKeys {
    /// Ready-made transfer function; the best guess for the data where the scene has no transfer keys at all.
    #[schemars(schema_with = "preset_names")]
    pub preset: Option<String>,
    /// Colour map laid over range.
    #[schemars(schema_with = "colormap_names")]
    pub colormap: Option<String>,
    /// Values at which the colour map begins and ends; the data's object, background left out, unless given.
    pub range: Option<[f64; 2]>,
    /// Points [value, red, green, blue], piecewise linear.
    pub color: Option<Vec<[f64; 4]>>,
    /// Points [value, opacity per opacity_unit], piecewise linear.
    pub opacity: Option<Vec<[f64; 2]>>,
    /// Points [size of the gradient in data units per world unit, factor 0 to 1 on the opacity per unit length], piecewise linear.
    pub gradient_opacity: Option<Vec<[f64; 2]>>,
    /// Length that opacities refer to, world units; the smallest voxel spacing or the preset's own unless given.
    pub opacity_unit: Option<f64>,
    /// Interpolate and then classify (post, the default), classify first (pre), or integrate over slabs (pre-integrated, or
    /// second-order, which knows the values' curvature too).
    pub classification: Option<ClassificationKey>,
}

choices! {
    ClassificationKey => Classification { Post, Pre, PreIntegrated, SecondOrder }
}

fn preset_names(_: &mut SchemaGenerator) -> Schema {
    names(Preset::ALL.into_iter().map(Preset::name))
}

fn colormap_names(_: &mut SchemaGenerator) -> Schema {
    names(ColorMap::ALL.into_iter().map(ColorMap::name))
}

pub(super) const RIVALS: &[Rivals] = &[
    (&["transfer.preset"], &["transfer.colormap", "transfer.range", "transfer.color", "transfer.opacity", "transfer.opacity_unit"]),
    (&["transfer.colormap"], &["transfer.preset", "transfer.color"]),
    (&["transfer.color", "transfer.opacity"], &["transfer.preset"]),
];

impl TransferKeys {
    /// The transfer function as far as it can be made without the volume, so that a mistake is found before one is loaded.
    pub(super) fn before_data(&self, cx: &Context<'_>) -> Result<TransferFunction> {
        let preset = self.preset(cx)?;
        self.colormap(cx)?;
        if preset.is_some() {
            let lists = [
                ("transfer.colormap", self.colormap.is_some()),
                ("transfer.range", self.range.is_some()),
                ("transfer.color", self.color.is_some()),
                ("transfer.opacity", self.opacity.is_some()),
            ];
            cx.refuse(&lists, "transfer.preset is given too; give one of them")?;
        }
        if self.colormap.is_some() {
            cx.refuse(&[("transfer.color", self.color.is_some())], "transfer.colormap is given too; give one of them")?;
        } else {
            cx.refuse(&[("transfer.range", self.range.is_some())], "is for transfer.colormap, which is not given")?;
        }
        if let Some([lo, hi]) = self.range.filter(|r| !(r[0].is_finite() && r[1].is_finite() && r[0] != r[1])) {
            return Err(cx.error("transfer.range", format!("[{lo}, {hi}]: must be two different finite numbers")));
        }
        let colors = self.colors().unwrap_or_else(|| vec![(0.0, [1.0; 3])]);
        let opacities = self.opacities().unwrap_or_else(|| vec![(0.0, 1.0)]);
        TransferFunction::new(colors, opacities).and_then(|t| self.with_rest(t)).map_err(|e| cx.places.locate(e))
    }

    /// The scene through the transfer function for its volume; and the light of that, where it comes lit.
    pub(super) fn finish(&self, cx: &Context<'_>, data: &mut Data<'_>) -> Result<Option<Lighting>> {
        let made = self.function(cx, data.volume, &mut data.warnings).and_then(|(t, light)| Ok((self.with_rest(t)?, light)));
        let (transfer, light) = made.map_err(|e| cx.places.locate(e))?;
        data.scene = data.scene.clone().with_transfer(transfer);
        Ok(light)
    }

    /// The part of the method that stands in this section.
    pub(super) fn method(&self, method: Method) -> Method {
        self.classification.map_or(method, |c| method.with_classification(c.into()))
    }

    /// `transfer` with the unit of opacities and the gradient opacity that are given, or else its own.
    fn with_rest(&self, transfer: TransferFunction) -> Result<TransferFunction> {
        let transfer = match &self.gradient_opacity {
            Some(points) => transfer.with_gradient_opacity(points.iter().map(|&[g, factor]| (g, factor)).collect())?,
            None => transfer,
        };
        match self.opacity_unit {
            Some(length) => transfer.with_unit(length),
            None => Ok(transfer),
        }
    }

    fn preset(&self, cx: &Context<'_>) -> Result<Option<Preset>> {
        self.preset.as_deref().map(|name| cx.named("transfer.preset", name, &Preset::ALL, Preset::name)).transpose()
    }

    fn colormap(&self, cx: &Context<'_>) -> Result<Option<ColorMap>> {
        self.colormap.as_deref().map(|name| cx.named("transfer.colormap", name, &ColorMap::ALL, ColorMap::name)).transpose()
    }

    fn colors(&self) -> Option<Vec<(f64, [f64; 3])>> {
        self.color.as_ref().map(|list| list.iter().map(|&[v, r, g, b]| (v, [r, g, b])).collect())
    }

    fn opacities(&self) -> Option<Vec<(f64, f64)>> {
        self.opacity.as_ref().map(|list| list.iter().map(|&[v, a]| (v, a)).collect())
    }

    /// The transfer function for `volume`, in its own unit of opacities.
    fn function(&self, cx: &Context<'_>, volume: &Volume, warnings: &mut Vec<String>) -> Result<(TransferFunction, Option<Lighting>)> {
        let (colors, opacities) = (self.colors(), self.opacities());
        if self.colormap.is_none() && colors.is_none() && opacities.is_none() {
            return self.ready_made(cx, volume, warnings);
        }
        // Whatever the scene leaves out of color and opacity comes from a ramp over the object's values.
        let colors = match colors {
            Some(colors) => colors,
            None => {
                let [lo, hi] = self.range.unwrap_or_else(|| {
                    let marks = Landmarks::of(volume.statistics());
                    [marks.at(-0.8), marks.at(1.0)]
                });
                self.colormap(cx)?.unwrap_or(ColorMap::Gray).spread(lo, hi)
            }
        };
        let transfer = match opacities {
            Some(opacities) => TransferFunction::new(colors, opacities)?,
            None => {
                let ramp = Preset::GreyRamp.transfer(volume)?;
                let transfer = TransferFunction::new(colors, ramp.opacity().to_vec())?;
                match ramp.unit() {
                    Some(length) => transfer.with_unit(length)?,
                    None => transfer,
                }
            }
        };
        Ok((transfer, None))
    }

    /// The preset that is given, or else the transfer function that suits the volume best; and its light.
    fn ready_made(&self, cx: &Context<'_>, volume: &Volume, warnings: &mut Vec<String>) -> Result<(TransferFunction, Option<Lighting>)> {
        if let Some(preset) = self.preset(cx)? {
            warnings.extend(preset.suits(volume).err());
            return Ok((preset.transfer(volume)?, preset.lighting(volume)));
        }
        // Every built-in volume has a transfer function of its own, which fits its own values alone.
        if let Some((phantom, size)) = cx.document.volume.unscaled_phantom() {
            return Ok((phantom.default_transfer(size), None));
        }
        if looks_hounsfield_plus_1024(volume.statistics()) {
            warnings.push("the values look like HU + 1024: set volume.intercept = -1024 to use the ct presets".into());
        }
        let preset = Preset::suggest(volume).first().copied().unwrap_or(Preset::GreyRamp);
        Ok((preset.transfer(volume)?, preset.lighting(volume)))
    }
}
