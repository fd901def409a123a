//! From keys to the scene's own types: what goes together, what excludes each other, and every default.

use super::keys::*;
use super::table::nearest;
use super::{Document, Place, Places};
use crate::scene::preset::{Landmarks, Preset, looks_hounsfield_plus_1024};
use crate::scene::{
    Accumulation, Blend, Camera, Classification, ClipPlane, ColorMap, Ends, Filter, Fog, FogDistance, FogMode, FogWeighting, Method, Order,
    Placement, Projection, SampleAt, Scene, SlabForm, Slicing, Straight, Target, TransferFunction,
};
use crate::volume::io::{Endian, RawSpec};
use crate::volume::phantom::Phantom;
use crate::volume::{BoxConvention, Grid, Modality, Origin, VolumeSource, VoxelType};
use crate::{Error, Result, Volume};
use glam::DVec3;
use std::path::Path;

/// Voxels along each axis of a phantom whose size is not given.
const PHANTOM_SIZE: usize = 128;

pub(super) struct Builder<'a> {
    pub(super) document: &'a Document,
    pub(super) places: &'a Places,
    pub(super) base: &'a Path,
}

impl Builder<'_> {
    pub(super) fn error(&self, path: &str, what: impl AsRef<str>) -> Error {
        self.places.error(path, what.as_ref())
    }

    /// The member of `all` called `name`.
    fn named<T: Copy>(&self, path: &str, name: &str, all: &[T], name_of: impl Fn(T) -> &'static str) -> Result<T> {
        let names: Vec<&str> = all.iter().map(|&t| name_of(t)).collect();
        all.iter().copied().find(|&t| name_of(t) == name).ok_or_else(|| {
            let best = nearest(name, &names).unwrap_or_default();
            self.error(path, format!("unknown \"{name}\"; the nearest known one is \"{best}\", all are {}", names.join(", ")))
        })
    }

    /// An error when one of `keys` is given, for the reason `why`.
    pub(super) fn refuse(&self, keys: &[(&str, bool)], why: &str) -> Result<()> {
        keys.iter().find(|k| k.1).map_or(Ok(()), |(key, _)| Err(self.error(key, why)))
    }

    /// Keys that a scene file may have but that no stage renders. Each line goes when its stage comes.
    fn not_offered(&self) -> Result<()> {
        let r = &self.document.render;
        let missing = [("render.linear_light", "true", r.linear_light == Some(true))];
        missing.iter().find(|m| m.2).map_or(Ok(()), |(key, value, _)| Err(self.error(key, format!("\"{value}\" is not offered yet"))))
    }

    /// The volume's origin, and what to change about it.
    pub(super) fn source(&self) -> Result<VolumeSource> {
        let v = &self.document.volume;
        let raw_keys = [
            ("volume.dimensions", v.dimensions.is_some()),
            ("volume.type", v.kind.is_some()),
            ("volume.endian", v.endian.is_some()),
            ("volume.offset", v.offset.is_some()),
        ];
        let raw = v.dimensions.is_some() || v.kind.is_some();
        let origin = match (&v.path, &v.phantom) {
            (Some(_), Some(_)) => return Err(self.error("volume.phantom", "volume.path is given too; a scene has one volume")),
            (None, None) => return Err(self.error("volume", "give volume.path (a file) or volume.phantom (a built-in volume)")),
            (None, Some(name)) => {
                self.refuse(&raw_keys, "belongs to raw files, not to built-in volumes")?;
                let size = v.size.unwrap_or(PHANTOM_SIZE);
                if !(1..=1 << 16).contains(&size) {
                    return Err(self.error("volume.size", format!("{size}: must lie between 1 and {}", 1 << 16)));
                }
                Origin::Phantom(self.named("volume.phantom", name, &Phantom::ALL, Phantom::name)?, size)
            }
            (Some(path), None) => {
                self.refuse(&[("volume.size", v.size.is_some())], "belongs to built-in volumes (volume.phantom), not to files")?;
                // A path typed as a flag means what it means to the shell.
                let typed = self.places.of("volume.path") == Some(Place::Flag);
                let full = if typed { Path::new(path).to_path_buf() } else { self.base.join(path) };
                if path.is_empty() {
                    return Err(self.error("volume.path", "is empty"));
                }
                if raw {
                    Origin::Raw(full, self.raw()?)
                } else {
                    self.refuse(&raw_keys, "belongs to raw files, which volume.dimensions and volume.type describe")?;
                    Origin::File(full)
                }
            }
        };
        if let Some(s) = v.spacing.filter(|s| s.iter().any(|x| !x.is_finite() || *x == 0.0)) {
            return Err(self.error("volume.spacing", format!("{s:?}: every number must be finite and not 0")));
        }
        if let Some(o) = v.origin.filter(|o| o.iter().any(|x| !x.is_finite())) {
            return Err(self.error("volume.origin", format!("{o:?}: every number must be finite")));
        }
        if let Some(s) = v.slope.filter(|s| !s.is_finite() || *s == 0.0) {
            return Err(self.error("volume.slope", format!("{s}: must be finite and not 0")));
        }
        if let Some(i) = v.intercept.filter(|i| !i.is_finite()) {
            return Err(self.error("volume.intercept", format!("{i}: must be finite")));
        }
        let mut source = VolumeSource::new(origin);
        source.convention = match v.convention {
            Some(BoxKey::Nodes) => BoxConvention::Nodes,
            Some(BoxKey::Cells) | None => BoxConvention::Cells,
        };
        source.modality = v.modality.map(|m| match m {
            ModalityKey::Ct => Modality::Ct,
            ModalityKey::Mr => Modality::Mr,
        });
        (source.slope, source.intercept) = (v.slope, v.intercept);
        // A raw file's description holds these already.
        if !raw {
            (source.spacing, source.position) = (v.spacing, v.origin);
        }
        Ok(source)
    }

    fn raw(&self) -> Result<RawSpec> {
        let v = &self.document.volume;
        let needs = |key: &str, example: &str| self.error(key, format!("a raw file needs it, for example {key} = {example}"));
        let dimensions = v.dimensions.ok_or_else(|| needs("volume.dimensions", "[256, 256, 113]"))?;
        let kind = v.kind.as_deref().ok_or_else(|| needs("volume.type", "\"u8\""))?;
        if dimensions.contains(&0) {
            return Err(self.error("volume.dimensions", format!("{dimensions:?}: every dimension must be at least 1")));
        }
        Ok(RawSpec {
            dimensions,
            voxel_type: self.named("volume.type", kind, &VoxelType::ALL, VoxelType::name)?,
            endian: if v.endian == Some(EndianKey::Big) { Endian::Big } else { Endian::Little },
            spacing: v.spacing.unwrap_or([1.0; 3]),
            origin: v.origin.unwrap_or([0.0; 3]),
            offset: v.offset.unwrap_or(0),
        })
    }

    /// All of the scene that does not depend on the data: so that a mistake is found before a volume is loaded.
    pub(super) fn shell(&self) -> Result<Scene> {
        self.not_offered()?;
        let d = self.document;
        let t = &d.transfer;
        let preset = t.preset.as_deref().map(|n| self.named("transfer.preset", n, &Preset::ALL, Preset::name)).transpose()?;
        t.colormap.as_deref().map(|n| self.named("transfer.colormap", n, &ColorMap::ALL, ColorMap::name)).transpose()?;
        if preset.is_some() {
            let lists = [
                ("transfer.colormap", t.colormap.is_some()),
                ("transfer.range", t.range.is_some()),
                ("transfer.color", t.color.is_some()),
                ("transfer.opacity", t.opacity.is_some()),
            ];
            self.refuse(&lists, "transfer.preset is given too; give one of them")?;
        }
        if t.colormap.is_some() {
            self.refuse(&[("transfer.color", t.color.is_some())], "transfer.colormap is given too; give one of them")?;
        } else {
            self.refuse(&[("transfer.range", t.range.is_some())], "is for transfer.colormap, which is not given")?;
        }
        if let Some([lo, hi]) = t.range.filter(|r| !(r[0].is_finite() && r[1].is_finite() && r[0] != r[1])) {
            return Err(self.error("transfer.range", format!("[{lo}, {hi}]: must be two different finite numbers")));
        }
        let white = (vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]);
        let transfer = TransferFunction::new(self.colors().unwrap_or(white.0), self.opacities().unwrap_or(white.1));
        let scene = self.frame(Scene::new(transfer.map_err(|e| self.places.locate(e))?)).map_err(|e| self.places.locate(e))?;
        // A look-at camera whose defaults come from the box is checked again when there is one.
        let stand_in = Grid::with_spacing([1; 3], [1.0; 3])?;
        let camera = match (d.camera.eye, d.camera.target, d.camera.up) {
            (Some(_), Some(_), Some(_)) | (None, ..) => self.camera(&stand_in, (64, 64))?,
            _ => self.camera_angle().map(|_| Camera::default())?,
        };
        Ok(scene.with_camera(camera))
    }

    fn colors(&self) -> Option<Vec<(f64, [f64; 3])>> {
        self.document.transfer.color.as_ref().map(|list| list.iter().map(|&[v, r, g, b]| (v, [r, g, b])).collect())
    }

    fn opacities(&self) -> Option<Vec<(f64, f64)>> {
        self.document.transfer.opacity.as_ref().map(|list| list.iter().map(|&[v, a]| (v, a)).collect())
    }

    /// Size, background, slices, fog, clip planes, blending.
    fn frame(&self, mut scene: Scene) -> Result<Scene> {
        let d = self.document;
        let (width, height) = scene.size();
        scene = scene.with_size(d.image.width.unwrap_or(width), d.image.height.unwrap_or(height))?;
        if let Some([r, g, b, alpha]) = d.image.background {
            scene = scene.with_background(Straight { rgb: [r, g, b], alpha })?;
        }
        if let Some(unit) = d.transfer.opacity_unit {
            scene = scene.with_opacity_unit(unit)?;
        }
        scene = match (d.slices.count, d.slices.spacing, d.slices.tolerance) {
            (None, None, None) => scene,
            (Some(n), None, None) => scene.with_slices(Slicing::Count(n))?,
            (None, Some(s), None) => scene.with_slices(Slicing::Spacing(s))?,
            (None, None, Some(t)) => scene.with_slices(Slicing::Tolerance(t))?,
            (count, ..) => {
                let (key, other) = if count.is_some() { ("slices.count", "slices.spacing or") } else { ("slices.spacing", "") };
                let other = format!("{other} slices.tolerance").trim().to_owned();
                return Err(self.error(key, format!("{other} is given too; give one of them")));
            }
        };
        if let Some(state) = self.opengl()? {
            scene = scene.with_opengl(state)?;
        }
        scene = match d.slices.order {
            Some(OrderKey::FrontToBack) => scene.with_order(Order::FrontToBack),
            Some(OrderKey::BackToFront) => scene.with_order(Order::BackToFront),
            None => scene,
        };
        if let Some(t) = d.slices.terminate {
            scene = scene.with_terminate(t as f32)?;
        }
        scene = scene.with_method(self.method())?;
        let back = d.slices.merge == Some(true) && scene.order() == Order::BackToFront;
        self.refuse(&[("slices.merge", back)], "is for slices blended front to back: it goes by the light that they still get through")?;
        let fog = self.fog()?;
        scene = scene.with_fogged_background(d.fog.background == Some(true)).with_fog(fog);
        let planes: Result<Vec<ClipPlane>> = d.clip.iter().map(|c| ClipPlane::new(DVec3::from_array(c.normal), c.offset)).collect();
        scene = scene.with_clip_planes(planes?).map_err(|e| self.error("clip", e.to_string()))?;
        scene.with_blend(self.blend()?)
    }

    fn method(&self) -> Method {
        let (t, s, r) = (&self.document.transfer, &self.document.slices, &self.document.render);
        Method {
            classification: match t.classification {
                None | Some(ClassificationKey::Post) => Classification::Post,
                Some(ClassificationKey::Pre) => Classification::Pre,
                Some(ClassificationKey::PreIntegrated) => Classification::PreIntegrated,
                Some(ClassificationKey::SecondOrder) => Classification::SecondOrder,
            },
            filter: if r.filter == Some(FilterKey::Nearest) { Filter::Nearest } else { Filter::Linear },
            slab: if s.slab == Some(SlabKey::Riemann) { SlabForm::Riemann } else { SlabForm::Exponential },
            sample: if s.sample == Some(SampleKey::End) { SampleAt::End } else { SampleAt::Center },
            ends: if s.ends == Some(EndsKey::Whole) { Ends::Whole } else { Ends::Partial },
            target: match r.target {
                None if r.profile == Some(ProfileKey::Opengl) => Target::Unorm8,
                None | Some(TargetKey::F32) => Target::F32,
                Some(TargetKey::Unorm8) => Target::Unorm8,
                Some(TargetKey::Unorm16) => Target::Unorm16,
            },
            accumulation: match s.accumulation {
                None | Some(AccumulationKey::Auto) => Accumulation::Auto,
                Some(AccumulationKey::Plain) => Accumulation::Plain,
                Some(AccumulationKey::Compensated) => Accumulation::Compensated,
            },
            extrapolate: s.extrapolate == Some(true),
            merge: s.merge == Some(true),
        }
    }

    fn fog(&self) -> Result<Option<Fog>> {
        let f = &self.document.fog;
        let mode = f.mode.unwrap_or(FogModeKey::None);
        let linear = [("fog.start", f.start.is_some()), ("fog.end", f.end.is_some())];
        let mode = match mode {
            FogModeKey::None => {
                // Silence would hide a forgotten mode.
                self.refuse(&[("fog.density", f.density.is_some())], "has no effect without fog.mode = \"exp\" or \"exp2\"")?;
                self.refuse(&linear, "has no effect without fog.mode = \"linear\"")?;
                // A mode of "none" switches off a fog that is described.
                let looks =
                    [("fog.color", f.color.is_some()), ("fog.distance", f.distance.is_some()), ("fog.weighting", f.weighting.is_some())];
                if f.mode.is_none() {
                    self.refuse(&looks, "has no effect without fog.mode")?;
                }
                return Ok(None);
            }
            FogModeKey::Linear => {
                self.refuse(&[("fog.density", f.density.is_some())], "belongs to the modes exp and exp2, not to linear")?;
                FogMode::Linear { start: f.start.unwrap_or(0.0), end: f.end.unwrap_or(1.0) }
            }
            FogModeKey::Exp | FogModeKey::Exp2 => {
                self.refuse(&linear, "belongs to the mode linear, not to exp or exp2")?;
                let density = f.density.unwrap_or(1.0);
                if mode == FogModeKey::Exp { FogMode::Exp { density } } else { FogMode::Exp2 { density } }
            }
        };
        let mut fog = Fog::new(mode, f.color.unwrap_or([0.0; 3]))?;
        if f.distance == Some(FogDistanceKey::Radial) {
            fog = fog.with_distance(FogDistance::Radial);
        }
        let opengl = self.document.render.profile == Some(ProfileKey::Opengl);
        if f.weighting.unwrap_or(if opengl { FogWeightingKey::Literal } else { FogWeightingKey::Alpha }) == FogWeightingKey::Literal {
            fog = fog.with_weighting(FogWeighting::Literal);
        }
        Ok(Some(fog))
    }

    fn blend(&self) -> Result<Blend> {
        let r = &self.document.render;
        let kind = r.blend.unwrap_or(BlendKey::Over);
        self.refuse(&[("render.threshold", r.threshold.is_some() && kind != BlendKey::Lmip)], "is for render.blend = \"lmip\" alone")?;
        self.refuse(&[("render.level", r.level.is_some() && kind != BlendKey::Iso)], "is for render.blend = \"iso\" alone")?;
        let merge = self.document.slices.merge == Some(true);
        self.refuse(&[("slices.merge", merge && kind != BlendKey::Over)], "is for render.blend = \"over\" alone")?;
        Ok(match kind {
            BlendKey::Over => Blend::Over,
            BlendKey::Mip => Blend::Mip,
            BlendKey::Min => Blend::Min,
            BlendKey::Average => Blend::Average,
            BlendKey::Add => Blend::Add,
            // Any local maximum stops the ray.
            BlendKey::Lmip => Blend::Lmip { threshold: r.threshold.unwrap_or(f64::MIN) },
            // Placed at the data's split between background and object by `finish`.
            BlendKey::Iso => Blend::Iso { level: r.level.unwrap_or(0.0) },
        })
    }

    fn camera_angle(&self) -> Result<Projection> {
        let c = &self.document.camera;
        if c.projection == Some(ProjectionKey::Perspective) {
            self.refuse(&[("camera.height", c.height.is_some())], "belongs to orthographic cameras; a perspective one has camera.fov_y")?;
            Ok(Projection::Perspective { fov_y: c.fov_y.unwrap_or(30.0) })
        } else {
            self.refuse(
                &[("camera.fov_y", c.fov_y.is_some())],
                "needs camera.projection = \"perspective\"; an orthographic one has height",
            )?;
            Ok(Projection::Orthographic { height: c.height })
        }
    }

    fn camera(&self, grid: &Grid, (width, height): (u32, u32)) -> Result<Camera> {
        let c = &self.document.camera;
        let projection = self.camera_angle()?;
        let orbit = [
            ("camera.azimuth", c.azimuth.is_some()),
            ("camera.elevation", c.elevation.is_some()),
            ("camera.roll", c.roll.is_some()),
            ("camera.zoom", c.zoom.is_some()),
        ];
        let placement = if let Some(eye) = c.eye {
            self.refuse(&orbit, "mixes the orbit form (azimuth, elevation, roll, zoom) with the look-at form (eye, target, up)")?;
            let eye = DVec3::from_array(eye);
            let target = c.target.map_or(grid.center(), DVec3::from_array);
            let (front, up) = grid.space().front_and_up();
            // Straight from above or below, the subject's front is up.
            let steep = (target - eye).try_normalize().is_some_and(|d| d.cross(up).length() < 1e-6);
            Placement::LookAt { eye, target, up: c.up.map_or(if steep { front } else { up }, DVec3::from_array) }
        } else {
            let look = [("camera.target", c.target.is_some()), ("camera.up", c.up.is_some())];
            self.refuse(&look, "belongs to the look-at form, which needs camera.eye")?;
            let Placement::Orbit { azimuth, elevation, roll, zoom } = Camera::default().placement() else {
                return Err(Error::invalid("camera: the default camera is not in the orbit form"));
            };
            Placement::Orbit {
                azimuth: c.azimuth.unwrap_or(azimuth),
                elevation: c.elevation.unwrap_or(elevation),
                roll: c.roll.unwrap_or(roll),
                zoom: c.zoom.unwrap_or(zoom),
            }
        };
        // A height is the height; and unless the scene says how large, an elongated box is not cut off.
        let placement = match placement {
            Placement::Orbit { azimuth, elevation, roll, .. }
                if c.zoom.is_none() && matches!(projection, Projection::Orthographic { height: Some(_) }) =>
            {
                Placement::Orbit { azimuth, elevation, roll, zoom: 1.0 }
            }
            Placement::Orbit { azimuth, elevation, roll, zoom } if c.zoom.is_none() => {
                let zoom = Camera::new(placement, projection).map_or(zoom, |camera| camera.zoom_that_fits(grid, width, height, zoom));
                Placement::Orbit { azimuth, elevation, roll, zoom }
            }
            placement => placement,
        };
        let camera = Camera::new(placement, projection).and_then(|camera| match c.near {
            Some(near) => camera.with_near(near),
            None => Ok(camera),
        });
        camera.map_err(|e| self.places.locate(e))
    }

    /// What the data decides: presets, colour maps, the camera's defaults.
    pub(super) fn finish(&self, shell: &Scene, volume: &Volume) -> Result<(Scene, Vec<String>)> {
        let mut warnings = Vec::new();
        let (transfer, unit) = self.transfer(volume, &mut warnings)?;
        let mut scene = shell.clone().with_camera(self.camera(volume.grid(), shell.size())?).with_transfer(transfer);
        // The scene's own unit stands already.
        if let Some(unit) = unit.filter(|_| scene.opacity_unit().is_none()) {
            scene = scene.with_opacity_unit(unit)?;
        }
        if matches!(scene.blend(), Blend::Iso { .. }) && self.document.render.level.is_none() {
            let level = Landmarks::of(volume.statistics()).split;
            warnings.push(format!("render.level is not given: the surface is taken at {level}"));
            scene = scene.with_blend(Blend::Iso { level })?;
        }
        let slices = &self.document.slices;
        if slices.merge == Some(false) && slices.tolerance.is_some() {
            warnings.push("slices.merge = false is not heeded: to a tolerance slabs are merged where that will do".to_owned());
        }
        let (min, max) = volume.range();
        if min == max && volume.statistics().non_finite == 0 {
            warnings.push(format!("every voxel is {min}: the picture shows the box and nothing in it"));
        }
        if matches!(scene.blend(), Blend::Over | Blend::Add) && !scene.transfer().opaque_within(min, max) {
            warnings.push(format!("the picture is empty: the transfer function is transparent from {min} to {max}, all the data has"));
        }
        Ok((scene, warnings))
    }

    fn transfer(&self, volume: &Volume, warnings: &mut Vec<String>) -> Result<(TransferFunction, Option<f64>)> {
        let t = &self.document.transfer;
        let located = |r: Result<TransferFunction>| r.map_err(|e| self.places.locate(e));
        let (colors, opacities) = (self.colors(), self.opacities());
        if t.colormap.is_none() && colors.is_none() && opacities.is_none() {
            // A built-in volume in its own units knows its looks.
            let v = &self.document.volume;
            let phantom = v.phantom.as_deref().filter(|_| t.preset.is_none() && v.slope.is_none() && v.intercept.is_none());
            if let Some(phantom) = phantom.and_then(Phantom::from_name) {
                return Ok((phantom.default_transfer(), Some(Phantom::opacity_unit(v.size.unwrap_or(PHANTOM_SIZE)))));
            }
            let preset = match t.preset.as_deref() {
                Some(name) => {
                    let preset = self.named("transfer.preset", name, &Preset::ALL, Preset::name)?;
                    warnings.extend(preset.suits(volume).err());
                    preset
                }
                None => {
                    if looks_hounsfield_plus_1024(volume.statistics()) {
                        warnings.push("the values look like HU + 1024: set volume.intercept = -1024 to use the ct presets".into());
                    }
                    Preset::suggest(volume).first().copied().unwrap_or(Preset::GreyRamp)
                }
            };
            let found = preset.transfer(volume).map_err(|e| self.places.locate(e))?;
            return Ok((found.transfer, found.opacity_unit));
        }
        // Whatever the scene leaves out of color and opacity comes from a ramp over the object's values.
        let colors = match (colors, t.colormap.as_deref()) {
            (Some(colors), _) => colors,
            (None, map) => {
                let map = map.map(|n| self.named("transfer.colormap", n, &ColorMap::ALL, ColorMap::name)).transpose()?;
                let [lo, hi] = t.range.unwrap_or_else(|| {
                    let marks = Landmarks::of(volume.statistics());
                    [marks.at(-0.8), marks.at(1.0)]
                });
                map.unwrap_or(ColorMap::Gray).spread(lo, hi)
            }
        };
        match opacities {
            Some(opacities) => Ok((located(TransferFunction::new(colors, opacities))?, None)),
            None => {
                let ramp = Preset::GreyRamp.transfer(volume).map_err(|e| self.places.locate(e))?;
                Ok((located(TransferFunction::new(colors, ramp.transfer.opacity().to_vec()))?, ramp.opacity_unit))
            }
        }
    }
}
