//! The section `[transfer]`: from values to colour and opacity.

use super::Place;
use super::projected;
use super::schema::names;
use super::section::{Context, Data, Given, Rivals, choices};
use super::transfer_file::{FoundTransfer, TransferFile};
use crate::scene::preset::{Guess, Landmarks, Preset};
use crate::scene::{Blend, Classification, ColorMap, Lighting, Method, OpacityFrom, Scene, TransferFunction};
use crate::{Error, Result, Volume};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TransferKeys {
    /// Ready-made transfer function; the best guess for the data where the scene has no transfer keys at all.
    #[schemars(schema_with = "preset_names")]
    pub preset: Option<String>,
    /// File of a transfer function, relative to the scene file: .vp or presets.xml of 3D Slicer, .json of ParaView, .csv, or a scene file, of
    /// which [transfer] and [light] count. Its opacities are per 1 world unit (VTK's default) unless it says otherwise; its light comes with
    /// it, and keys of [light] change that.
    pub file: Option<String>,
    /// Which transfer function of a transfer.file that holds several.
    pub name: Option<String>,
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
    /// Voxels that are colours: what their opacity goes by. alpha (the default where they have one) is the opacity per opacity_unit itself; luma
    /// (the default elsewhere: 0.2126 R + 0.7152 G + 0.0722 B) and maximum, the largest of R, G and B, go through the points of opacity, over
    /// 0 to 1.
    pub opacity_from: Option<OpacityFromKey>,
    /// Interpolate and then classify (post, the default), classify first (pre), or integrate over slabs (pre-integrated, or
    /// second-order, which knows the values' curvature too).
    pub classification: Option<ClassificationKey>,
}

choices! {
    ClassificationKey => Classification { Post, Pre, PreIntegrated, SecondOrder }
    OpacityFromKey => OpacityFrom { Alpha, Luma, Maximum }
}

fn preset_names(_: &mut SchemaGenerator) -> Schema {
    names(Preset::ALL.into_iter().map(Preset::name))
}

fn colormap_names(_: &mut SchemaGenerator) -> Schema {
    names(ColorMap::ALL.into_iter().map(ColorMap::name))
}

pub(super) const RIVALS: &[Rivals] = &[
    (
        &["transfer.preset"],
        &[
            "transfer.file",
            "transfer.name",
            "transfer.colormap",
            "transfer.range",
            "transfer.color",
            "transfer.opacity",
            "transfer.gradient_opacity",
            "transfer.opacity_unit",
        ],
    ),
    (
        &["transfer.file"],
        &[
            "transfer.preset",
            "transfer.name",
            "transfer.colormap",
            "transfer.range",
            "transfer.color",
            "transfer.opacity",
            "transfer.gradient_opacity",
            "transfer.opacity_unit",
        ],
    ),
    (&["transfer.colormap"], &["transfer.preset", "transfer.file", "transfer.name", "transfer.color"]),
    (&["transfer.color", "transfer.opacity"], &["transfer.preset", "transfer.file", "transfer.name"]),
];

impl TransferKeys {
    /// The keys that say what the transfer function of `scene` is, point by point. A function of value and gradient stands in its place, but
    /// for the colours of level surfaces.
    pub(super) fn of(scene: &Scene) -> Self {
        if let Some(from) = scene.opacity_from() {
            return Self::of_colors(scene, from);
        }
        let counts = scene.transfer2d().is_none() || matches!(scene.blend(), Blend::Iso { .. } | Blend::Surfaces);
        let t = Some(scene.transfer()).filter(|_| counts);
        let factors = t.map(TransferFunction::gradient_opacity).filter(|points| !points.is_empty());
        Self {
            preset: None,
            file: None,
            name: None,
            colormap: None,
            range: None,
            color: t.map(|t| t.color().iter().map(|&(v, [r, g, b])| [v, r, g, b]).collect()),
            opacity: t.map(|t| t.opacity().iter().map(|&(v, a)| [v, a]).collect()),
            gradient_opacity: factors.map(|points| points.iter().map(|&(g, factor)| [g, factor]).collect()),
            opacity_unit: t.and_then(TransferFunction::unit),
            opacity_from: None,
            classification: Some(scene.method().classification.into()),
        }
    }

    /// The keys that say what opacities of colours are in `scene`: voxels have colours of their own, and alphas where those count.
    fn of_colors(scene: &Scene, from: OpacityFrom) -> Self {
        let t = scene.transfer();
        let points = || t.opacity().iter().map(|&(v, a)| [v, a]).collect();
        Self {
            opacity: (from != OpacityFrom::Alpha).then(points),
            opacity_unit: t.unit(),
            opacity_from: Some(from.into()),
            ..Self::default()
        }
    }

    /// The transfer function as far as it can be made without the volume, so that a mistake is found before one is loaded.
    pub(super) fn before_data(&self, cx: &Context<'_>) -> Result<TransferFunction> {
        if self.opacity_from.is_some() {
            self.refuse_values(cx)?;
        }
        let preset = self.preset(cx)?;
        self.colormap(cx)?;
        if preset.is_some() || self.file.is_some() {
            let lists = [
                ("transfer.preset", preset.is_some() && self.file.is_some()),
                ("transfer.colormap", self.colormap.is_some()),
                ("transfer.range", self.range.is_some()),
                ("transfer.color", self.color.is_some()),
                ("transfer.opacity", self.opacity.is_some()),
            ];
            let given = if self.file.is_some() { "transfer.file" } else { "transfer.preset" };
            cx.refuse(&lists, &format!("{given} is given too; give one of them"))?;
        }
        let Some(file) = self.file(cx)? else {
            cx.refuse(&[("transfer.name", self.name.is_some())], "is for transfer.file, which is not given")?;
            return self.of_keys(cx);
        };
        // What needs no volume is known now; else anything will do until there is one.
        let transfer = if file.needs_volume()? { Self::default().of_keys(cx)? } else { file.transfer(None)?.transfer };
        self.with_rest(transfer).map_err(|e| cx.places.locate(e))
    }

    /// The transfer function of the keys themselves, as far as it can be made without the volume.
    fn of_keys(&self, cx: &Context<'_>) -> Result<TransferFunction> {
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
        if let Some(usual) = OpacityFrom::usual(data.volume.channels()) {
            return self.finish_colors(cx, data, usual).map(|()| None);
        }
        if let Some((transfer, lighting)) = self.projected(cx, data)? {
            data.scene = data.scene.clone().with_transfer(self.with_rest(transfer).map_err(|e| cx.places.locate(e))?);
            return Ok(lighting);
        }
        if self.is_open(cx) && !cx.document.transfer2d.given() {
            if let Some((transfer, lighting)) = cx.document.labels.alone(cx, data)? {
                data.scene = data.scene.clone().with_transfer(self.with_rest(transfer).map_err(|e| cx.places.locate(e))?);
                return Ok(Some(lighting));
            }
        }
        if let Some(guess) = self.guess(cx, data.volume) {
            data.notes.push(format!("transfer function {}: {} (--preset NAME: another)", guess.preset.name(), guess.reason));
            data.warnings.extend(guess.advice);
            let transfer = guess.preset.transfer(data.volume).and_then(|t| self.with_rest(t)).map_err(|e| cx.places.locate(e))?;
            data.scene = data.scene.clone().with_transfer(transfer);
            return Ok(guess.preset.lighting(data.volume));
        }
        let FoundTransfer { transfer, lighting, warnings } = self.found(cx, Some(data.volume))?;
        data.warnings.extend(warnings);
        data.scene = data.scene.clone().with_transfer(transfer);
        Ok(lighting)
    }

    /// Whether the section says nothing about what values look like, and the volume is none that comes with its own transfer function.
    pub(super) fn is_open(&self, cx: &Context<'_>) -> bool {
        !self.tells_looks() && cx.document.volume.unscaled_phantom().is_none()
    }

    /// Whether the section says what values look like.
    fn tells_looks(&self) -> bool {
        self.given().iter().any(|(key, given)| *given && !matches!(*key, "transfer.gradient_opacity" | "transfer.opacity_unit"))
    }

    /// What the volume is taken for, where that decides.
    fn guess(&self, cx: &Context<'_>, volume: &Volume) -> Option<Guess> {
        (self.is_open(cx) && !cx.document.transfer2d.given()).then(|| Guess::of(volume))
    }

    /// What a projection or a surface looks like, where the section leaves it open; and its light.
    fn projected(&self, cx: &Context<'_>, data: &mut Data<'_>) -> Result<Option<(TransferFunction, Option<Lighting>)>> {
        let blend = data.scene.blend();
        if blend.blends_colors() {
            return Ok(None);
        }
        let window = cx.document.render.values();
        if self.tells_looks() && window.is_some() && !matches!(blend, Blend::AttenuatedMip { .. }) {
            return Err(cx.error("render.window", "the section transfer says already what values look like (transfer.range is its window)"));
        }
        if let Some(given) = window.filter(|_| !self.tells_looks()) {
            return Ok(Some((projected::grey(given)?, None)));
        }
        if !self.is_open(cx) {
            return Ok(None);
        }
        if matches!(blend, Blend::Iso { .. } | Blend::Surfaces) {
            let (transfer, lighting) = projected::surface()?;
            return Ok(Some((transfer, Some(lighting))));
        }
        let (grid, (width, height)) = (data.volume.grid(), data.scene.size());
        let view = cx.document.camera.camera(cx, grid, (width, height))?.resolve(grid, width, height)?;
        let found = projected::window(data.volume, &view, blend)?;
        if let Some((_, [low, high])) = &found {
            let [from, to] = [*low, *high].map(|x| projected::short(x, high - low));
            data.notes.push(format!(
                "window {from} to {to}: what this projection shows (render.window or transfer.colormap with transfer.range: another)"
            ));
        }
        Ok(found.map(|(transfer, _)| (transfer, None)))
    }

    /// The transfer function and its light, for `volume` where they need one.
    pub(super) fn found(&self, cx: &Context<'_>, volume: Option<&Volume>) -> Result<FoundTransfer> {
        let mut warnings = Vec::new();
        let made = self.function(cx, volume, &mut warnings).and_then(|(t, light)| Ok((self.with_rest(t)?, light)));
        let (transfer, lighting) = made.map_err(|e| cx.places.locate(e))?;
        Ok(FoundTransfer { transfer, lighting, warnings })
    }

    /// Whether the transfer function is laid over a volume's values.
    pub(super) fn needs_volume(&self, cx: &Context<'_>) -> Result<bool> {
        if let Some(file) = self.file(cx)? {
            return file.needs_volume();
        }
        if let Some(preset) = self.preset(cx)? {
            return Ok(!preset.is_ct());
        }
        let colors = self.color.is_some() || (self.colormap.is_some() && self.range.is_some());
        Ok(!colors || self.opacity.is_none())
    }

    /// The file that is given.
    fn file(&self, cx: &Context<'_>) -> Result<Option<TransferFile>> {
        let Some(path) = &self.file else { return Ok(None) };
        if path.is_empty() {
            return Err(cx.error("transfer.file", "is empty"));
        }
        // A path given as a flag means what it means to the shell.
        let typed = cx.places.of("transfer.file") == Some(Place::Flag);
        let full = if typed { Path::new(path).to_path_buf() } else { cx.base.join(path) };
        TransferFile::open_at(&full, self.name.as_deref(), false).map(Some)
    }

    /// The part of the method that stands in this section.
    pub(super) fn method(&self, method: Method) -> Method {
        self.classification.map_or(method, |c| method.with_classification(c.into()))
    }

    /// `transfer` with the unit of opacities and the gradient opacity that are given, or else its own.
    pub(super) fn with_rest(&self, transfer: TransferFunction) -> Result<TransferFunction> {
        let transfer = match &self.gradient_opacity {
            Some(points) => transfer.with_gradient_opacity(points.iter().map(|&[g, factor]| (g, factor)).collect())?,
            None => transfer,
        };
        match self.opacity_unit {
            Some(length) => transfer.with_unit(length),
            None => Ok(transfer),
        }
    }

    /// The keys that say what values look like.
    pub(super) fn given(&self) -> [Given; 9] {
        [
            ("transfer.preset", self.preset.is_some()),
            ("transfer.file", self.file.is_some()),
            ("transfer.name", self.name.is_some()),
            ("transfer.colormap", self.colormap.is_some()),
            ("transfer.range", self.range.is_some()),
            ("transfer.color", self.color.is_some()),
            ("transfer.opacity", self.opacity.is_some()),
            ("transfer.gradient_opacity", self.gradient_opacity.is_some()),
            ("transfer.opacity_unit", self.opacity_unit.is_some()),
        ]
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

    /// The transfer function for `volume`, in its own unit of opacities, and the light that it comes in.
    fn function(
        &self,
        cx: &Context<'_>,
        volume: Option<&Volume>,
        warnings: &mut Vec<String>,
    ) -> Result<(TransferFunction, Option<Lighting>)> {
        if let Some(file) = self.file(cx)? {
            let found = file.transfer(volume)?;
            warnings.extend(found.warnings);
            return Ok((found.transfer, found.lighting));
        }
        let needed = || volume.ok_or_else(|| Error::invalid("transfer: is laid over a volume's values, and there is no volume"));
        let (colors, opacities) = (self.colors(), self.opacities());
        if self.colormap.is_none() && colors.is_none() && opacities.is_none() {
            return self.ready_made(cx, volume, needed, warnings);
        }
        // Whatever the scene leaves out of color and opacity comes from a ramp over the object's values.
        let colors = match colors {
            Some(colors) => colors,
            None => {
                let [lo, hi] = match self.range {
                    Some(range) => range,
                    None => {
                        let marks = Landmarks::of(needed()?.statistics());
                        [marks.at(-0.8), marks.at(1.0)]
                    }
                };
                self.colormap(cx)?.unwrap_or(ColorMap::Gray).spread(lo, hi)
            }
        };
        let transfer = match opacities {
            Some(opacities) => TransferFunction::new(colors, opacities)?,
            None => {
                let ramp = Preset::GreyRamp.transfer(needed()?)?;
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
    fn ready_made<'v>(
        &self,
        cx: &Context<'_>,
        volume: Option<&'v Volume>,
        needed: impl Fn() -> Result<&'v Volume>,
        warnings: &mut Vec<String>,
    ) -> Result<(TransferFunction, Option<Lighting>)> {
        if let Some(preset) = self.preset(cx)? {
            let found = preset.found(volume)?;
            warnings.extend(found.warnings);
            return Ok((found.transfer, found.lighting));
        }
        // Every built-in volume has a transfer function of its own, which fits its own values alone.
        if let Some((phantom, size)) = cx.document.volume.unscaled_phantom() {
            return Ok((phantom.default_transfer(size), None));
        }
        let volume = needed()?;
        let guess = Guess::of(volume);
        warnings.extend(guess.advice);
        Ok((guess.preset.transfer(volume)?, guess.preset.lighting(volume)))
    }
}
