//! Scene files: TOML, or JSON with the same keys.
//!
//! ```text
//!  text --table--> checked table + where each key was written --serde--> Document --sections--> VolumeSource, Scene
//!                       ^ overrides (`section.key = value`)               |
//!  text <------------------------------------------------- Document <--write-----+
//! ```
//! Each section has a file of its own with all about its keys: their words in the schema and in `--help`, what they may be, which
//! exclude each other, what they set in the scene, and which of them say what a scene is (`of`). A key that is left out leaves the scene's
//! own default.
//!
//! Unknown keys are errors. An error names the file, the line and the key, or the flag that overrode it.

mod animation;
mod annotate;
mod camera;
mod clip;
mod cut;
mod fog;
mod image;
mod labels;
mod light;
mod opengl;
mod projected;
mod region;
mod render;
mod schema;
mod section;
mod slices;
mod table;
#[cfg(test)]
mod tests;
mod transfer;
mod transfer2d;
mod transfer_colors;
mod transfer_file;
mod volume;
mod write;

pub use animation::Animation;
pub use schema::{Key, KeyKind, keys, schema};
pub use transfer_file::{FoundTransfer, TransferFile, write_transfer};
pub use write::{SceneFormat, transfer_sections, write_scene};

use crate::scene::{Annotations, Camera, Method, OpacityFrom};
use crate::volume::io::Endian;
use crate::volume::plausible::Doubt;
use crate::volume::{Origin, VolumeSource};
use crate::{Error, Result, Scene, Volume};
use schemars::JsonSchema;
use section::{Context, Data, Rivals};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use table::{Place, Places};

/// Largest scene file that is read.
const MAX_BYTES: u64 = 16 << 20;

/// A scene file for slicestack: a volume, and how to picture it. Every key but the volume has a default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Document {
    /// What to picture.
    #[serde(skip_serializing_if = "is_default")]
    volume: volume::VolumeKeys,
    /// Where the eye is and how it projects: the look-at form (eye, target, up) or the orbit form (azimuth, elevation, roll, zoom).
    #[serde(skip_serializing_if = "is_default")]
    camera: camera::CameraKeys,
    /// The picture itself.
    #[serde(skip_serializing_if = "is_default")]
    image: image::ImageKeys,
    /// From values to colour and opacity: a preset, a colour map, or lists of points.
    #[serde(skip_serializing_if = "is_default")]
    transfer: transfer::TransferKeys,
    /// From value and gradient to colour and opacity, in the place of the section transfer.
    #[serde(skip_serializing_if = "is_default")]
    transfer2d: transfer2d::Transfer2dKeys,
    /// How many slices, and how they are blended.
    #[serde(skip_serializing_if = "is_default")]
    slices: slices::SliceKeys,
    /// OpenGL's fog.
    #[serde(skip_serializing_if = "is_default")]
    fog: fog::FogKeys,
    /// Light on the volume: a material, and one light.
    #[serde(deserialize_with = "light::section", skip_serializing_if = "is_default")]
    light: light::LightKeys,
    /// Up to four lights in the place of that of the section light.
    #[serde(skip_serializing_if = "is_default")]
    lights: Vec<light::LightsKeys>,
    /// How fragments become pixels.
    #[serde(skip_serializing_if = "is_default")]
    render: render::RenderKeys,
    /// State of the OpenGL pipeline, for render.profile = "opengl".
    #[serde(skip_serializing_if = "is_default")]
    opengl: opengl::OpenGlKeys,
    /// What is drawn on the finished picture; nothing unless asked for.
    #[serde(skip_serializing_if = "is_default")]
    annotate: annotate::AnnotateKeys,
    /// A label map beside the volume, or the volume itself where that is one, and what becomes of its segments.
    #[serde(skip_serializing_if = "is_default")]
    labels: labels::LabelKeys,
    /// Up to eight regions of space in which other transfer functions hold.
    #[serde(skip_serializing_if = "is_default")]
    region: Vec<region::RegionKeys>,
    /// Up to six planes that cut the box.
    #[serde(skip_serializing_if = "is_default")]
    clip: Vec<clip::ClipKeys>,
    /// Up to six opaque planes inside the box that show the data on them.
    #[serde(skip_serializing_if = "is_default")]
    cut: Vec<cut::CutKeys>,
}

/// Whether a section says nothing.
fn is_default<T: Default + PartialEq>(section: &T) -> bool {
    *section == T::default()
}

/// Ways to say one thing, of all sections: a key given on the command line drops its rivals from the file.
fn rivals() -> impl Iterator<Item = &'static Rivals> {
    [volume::RIVALS, camera::RIVALS, transfer::RIVALS, slices::RIVALS, render::RIVALS].into_iter().flatten()
}

/// Keys given beside the file, usually by flags: they win over the file's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overrides {
    keys: Vec<(String, String)>,
    /// Names of files that no text can hold: their keys, and the text that stands for each among `keys`.
    files: Vec<(&'static str, String, PathBuf)>,
}

impl Overrides {
    /// Sets `volume.path` to `path`, which may have any name.
    pub fn set_volume(&mut self, path: &Path) {
        self.set_file("volume.path", path);
    }

    /// Sets `labels.path` to `path`, which may have any name.
    pub fn set_labels(&mut self, path: &Path) {
        self.set_file("labels.path", path);
    }

    fn set_file(&mut self, key: &'static str, path: &Path) {
        let text = path.to_string_lossy();
        if path.to_str().is_none() {
            self.files.push((key, text.clone().into_owned(), path.to_path_buf()));
        }
        self.set(key, text);
    }

    /// The file whose name stands for `path` at `key`, where text could not hold it.
    fn file(&self, key: &str, path: &Path, base: &Path) -> Option<PathBuf> {
        let named = |(k, text, _): &&(&str, String, PathBuf)| *k == key && base.join(text) == path;
        self.files.iter().rfind(named).map(|(_, _, file)| base.join(file))
    }

    /// Sets `section.key` to `text`: plain text for keys that take words, else a number, `true`, or a list such as `1,2,3` or
    /// `[0, 1], [100, 0.5]`. Later calls win.
    pub fn set(&mut self, path: impl Into<String>, text: impl Into<String>) {
        self.keys.push((path.into(), text.into()));
    }
}

/// A scene as a file describes it: still without the data that presets and the camera's defaults need.
#[derive(Debug, Clone)]
pub struct SceneFile {
    document: Document,
    places: Places,
    base: PathBuf,
    source: VolumeSource,
    /// The scene as far as it is known without the data.
    partial: Scene,
}

impl SceneFile {
    /// Reads a scene file; paths in it are relative to its directory.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read, [`Error::Format`] when it is no text or longer than 16 MiB, and as
    /// [`SceneFile::parse`].
    pub fn read(path: impl AsRef<Path>, overrides: &Overrides) -> Result<Self> {
        let path = path.as_ref();
        let text = text_of_file(path, MAX_BYTES)?;
        Self::build(&text, Some(path), path.parent().unwrap_or(Path::new("")), overrides)
    }

    /// A scene from `text`, with paths relative to the directory `base`. TOML, or JSON where the text begins with a brace.
    ///
    /// # Errors
    /// [`Error::Invalid`] for text that is neither, an unknown key, a value of the wrong type or out of its range, keys that
    /// exclude each other, and a scene without a volume.
    pub fn parse(text: &str, base: impl AsRef<Path>, overrides: &Overrides) -> Result<Self> {
        Self::build(text, None, base.as_ref(), overrides)
    }

    fn build(text: &str, file: Option<&Path>, base: &Path, overrides: &Overrides) -> Result<Self> {
        let (mut document, places) = table::document(text, file, overrides)?;
        document.as_layers();
        let cx = Context { document: &document, places: &places, base };
        let (source, partial) = (document.volume.source(&cx)?, document.before_data(&cx)?);
        // Whoever looks closer wants finer voxels.
        let side = f64::from(partial.size().0.min(partial.size().1));
        let named = |key: &str, source: VolumeSource| match source.path().and_then(|path| overrides.file(key, path, base)) {
            Some(file) => source.with_path(file),
            None => source,
        };
        let labels = document.labels.source(&cx)?.map(|labels| named("labels.path", labels));
        let source = named("volume.path", source).with_labels(labels);
        let source = source.with_pixels((side * document.camera.zoom().max(1.0)).min(f64::from(u32::MAX)) as u32);
        Ok(Self { base: base.to_path_buf(), source, partial, document, places })
    }

    /// The volume that the scene is about.
    pub fn volume(&self) -> &VolumeSource {
        &self.source
    }

    /// Whether the scene says itself how many slices there are, or what error is accepted.
    pub fn says_slices(&self) -> bool {
        self.document.slices.says_slices()
    }

    /// What is to be drawn on the finished picture.
    pub fn annotations(&self) -> Annotations {
        self.document.annotate.annotations()
    }

    /// The scene for its volume, and warnings, one line each: [`SceneFile::resolve`] without its notes.
    ///
    /// # Errors
    /// As [`SceneFile::resolve`].
    pub fn to_scene(&self, volume: &Volume) -> Result<(Scene, Vec<String>)> {
        self.resolve(volume).map(|found| (found.scene, found.warnings))
    }

    /// Cameras once around the volume for `scene`, which came from [`SceneFile::resolve`]: see [`Scene::turntable`].
    ///
    /// # Errors
    /// As [`Scene::turntable`].
    pub fn turntable(&self, scene: &Scene, volume: &Volume, count: u32) -> Result<Vec<Camera>> {
        let d = &self.document;
        let cx = Context { document: d, places: &self.places, base: &self.base };
        let camera = d.camera.camera(&cx, volume.grid(), scene.size())?;
        scene.clone().with_camera(camera).turntable(volume, count, d.camera.zoom())
    }

    /// The scene for its volume, with everything decided that the file leaves open: what a camera fits into the picture, a transfer function, how many
    /// slices, how dense a fog.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::Format`] where what depends on the data cannot be: a look-at camera that stands on the
    /// box's centre, a preset over a range that overflows.
    pub fn resolve(&self, volume: &Volume) -> Result<ResolvedScene> {
        let d = &self.document;
        let cx = Context { document: d, places: &self.places, base: &self.base };
        let mut data = Data { volume, scene: self.partial.clone(), warnings: Vec::new(), notes: Vec::new() };
        // A function of value and gradient stands in the place of a preset, and comes without its light.
        let ready = d.transfer.finish(&cx, &mut data)?.filter(|_| !d.transfer2d.given());
        d.volume.finish(&cx, &mut data)?;
        data.scene.check_with(volume).map_err(|e| cx.places.locate(e))?;
        d.render.finish(&mut data)?;
        d.labels.finish(&cx, &mut data)?;
        region::finish(&d.region, &cx, &mut data)?;
        data.scene = d.camera.apply(&cx, data.scene, volume)?;
        d.image.finish(&mut data)?;
        if ready.is_some() {
            data.scene = d.light.apply(&d.lights, ready, &cx, data.scene)?;
            if data.scene.lighting().is_none() && !d.light.is_off() && !data.scene.blend().projects_values() {
                data.warnings
                    .push("the preset's light is left out: it does not go together with the scene's way to blend slices".to_owned());
            }
        }
        data.scene.check().map_err(|e| cx.places.locate(e))?;
        d.slices.finish(&mut data)?;
        d.fog.finish(&mut data)?;
        cut::finish(&mut data);
        let Data { scene, mut warnings, notes, .. } = data;
        if let Origin::Raw(_, spec) = &self.source.origin {
            let other = if spec.endian == Endian::Little { "big" } else { "little" };
            warnings.extend(volume.doubt().map(|doubt| match doubt {
                Doubt::Endian => {
                    format!("neighbouring voxels differ like noise; with their bytes in the other order they would not: set volume.endian = \"{other}\"")
                }
                Doubt::Signed => "voxels lie at both ends of u16 and nowhere between, as signed numbers would: set volume.type = \"i16\"".to_owned(),
            }));
        }
        let (min, max) = volume.range();
        if volume.scalars().is_some() && min == max && volume.statistics().non_finite == 0 {
            warnings.push(format!("every voxel is {min}: the picture shows the box and nothing in it"));
        }
        if let Some(from) = scene.color_opacity(volume).filter(|_| scene.shows_nothing_of(volume)) {
            warnings.push(format!("the picture is empty: no voxel has an opacity above 0 by its {}", from.name()));
        }
        let by_value = scene.blend().blends_colors()
            && scene.transfer2d().is_none()
            && volume.scalars().is_some()
            && scene.cuts().is_empty()
            && !scene.shows_by_place();
        if by_value && !scene.transfer().opaque_within(min, max) {
            warnings.push(format!("the picture is empty: the transfer function is transparent from {min} to {max}, all the data has"));
        }
        Ok(ResolvedScene { scene, warnings, notes })
    }
}

/// A scene with everything decided: see [`SceneFile::resolve`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ResolvedScene {
    /// The scene.
    pub scene: Scene,
    /// What is likely not meant, one line each.
    pub warnings: Vec<String>,
    /// What was decided, and why, one line each.
    pub notes: Vec<String>,
}

/// The text of the scene file at `path`, of `most` bytes at most.
fn text_of_file(path: &Path, most: u64) -> Result<String> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let file = crate::files::open(path).map_err(|e| Error::io(path, e))?;
    file.take(most + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    if bytes.len() as u64 > most {
        return Err(Error::format(path, format!("longer than the {most} bytes a scene file may have")));
    }
    String::from_utf8(bytes).map_err(|e| Error::format(path, format!("not a scene: byte {} is no text", e.utf8_error().valid_up_to())))
}

impl Document {
    /// Layers are laid over each other as they are stored, where the scene says nothing else.
    fn as_layers(&mut self) {
        if self.volume.layers.is_none() {
            return;
        }
        self.render.algorithm.get_or_insert(render::AlgorithmKey::Grid);
        self.slices.terminate.get_or_insert(0.0);
        if self.camera == camera::CameraKeys::default() {
            self.camera.along = Some(camera::AlongKey::Z);
        }
    }

    /// All of the scene that does not depend on the data, so that a mistake is found before a volume is loaded.
    fn before_data(&self, cx: &Context<'_>) -> Result<Scene> {
        if self.volume.layers.is_some() && self.render.algorithm == Some(render::AlgorithmKey::Grid) && self.camera.along.is_none() {
            let what = "layers are drawn along an axis (render.algorithm \"grid\"); give camera.along, or another render.algorithm";
            return Err(cx.error("camera", what));
        }
        let from = self.transfer.opacity_from.map(OpacityFrom::from);
        let scene = Scene::new(self.transfer.before_data(cx)?).with_opacity_from(from);
        let scene = self.frame(cx, scene).map_err(|e| cx.places.locate(e))?;
        Ok(scene.with_camera(self.camera.before_data(cx)?))
    }

    /// All sections but camera and transfer function.
    fn frame(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        let scene = self.image.apply(scene)?;
        let scene = self.opengl.apply(cx, scene)?;
        let scene = self.slices.apply(cx, scene)?;
        let method = self.method(scene.method());
        let scene = scene.with_method(method)?;
        self.slices.check_merge(cx, &scene)?;
        let scene = self.fog.apply(cx, scene)?;
        let scene = clip::apply(&self.clip, cx, scene)?;
        self.labels.before_data(cx)?;
        region::before_data(&self.region, cx)?;
        let scene = self.render.apply(cx, scene)?;
        let scene = self.transfer2d.apply(cx, scene)?;
        let scene = self.light.apply(&self.lights, None, cx, scene)?;
        cut::apply(&self.cut, cx, scene)
    }

    /// `method` with what three sections change about it.
    fn method(&self, method: Method) -> Method {
        self.render.method(self.slices.method(self.transfer.method(method)))
    }
}
