//! From a scene to the text of a scene file: every key that says something of it, in numbers that read back to the bit.
//!
//! Each section says its own keys, by a function `of` that names all of them: a new key does not compile until it is thought of there. What
//! depends on the data when a file is read (a preset, a colour map's range, the zoom that fits, a surface's level) is written as what it came
//! to, so that the text gives the same scene whatever later versions would choose.

use super::{
    Document, MAX_BYTES, annotate, camera, clip, cut, fog, image, labels, light, opengl, region, render, slices, transfer, transfer2d,
    volume,
};
use crate::scene::{Annotations, Lighting, Scene, TransferFunction};
use crate::volume::VolumeSource;
use crate::{Error, Result};
use serde_json::Value;
use std::path::Path;

/// Longest line of a list that is not broken.
const LINE: usize = 120;

/// How a scene file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SceneFormat {
    /// TOML: `.toml`.
    #[default]
    Toml,
    /// JSON with the same keys: `.json`.
    Json,
}

impl SceneFormat {
    /// The format that `path`'s extension asks for.
    ///
    /// # Errors
    /// [`Error::Format`] for extensions other than `toml` and `json`.
    pub fn of_path(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("toml") => Ok(Self::Toml),
            Some("json") => Ok(Self::Json),
            _ => Err(Error::format(path, "a scene file ends in .toml or .json")),
        }
    }
}

/// `scene`, the volume it is about and what is drawn on its picture as the text of a scene file; without a volume its section is left out, and whoever reads the text names
/// one ([`super::Overrides`]). The path of a volume is written as it stands in `volume`: readers take it relative to the file.
///
/// [`super::SceneFile`] reads it as a scene equal to `scene`, whatever the volume, but for parts that have no effect on its pictures: a
/// transfer function whose place is taken by one of value and gradient, levels of surfaces that are not drawn, numbers of OpenGL's state that
/// its modes do not use.
///
/// # Errors
/// [`Error::Invalid`] for a path that is not UTF-8 and for a number that TOML cannot hold; [`Error::Limit`] where a table of value and gradient
/// is too large for a scene file, which has 16 MiB at most.
pub fn write_scene(scene: &Scene, volume: Option<&VolumeSource>, annotations: &Annotations, format: SceneFormat) -> Result<String> {
    Document { annotate: annotate::AnnotateKeys::of(annotations), ..Document::of(scene, volume)? }.text(format)
}

/// `transfer` and `lighting` as the sections `[transfer]`, `[light]` and `[[lights]]` of a scene file in TOML.
///
/// # Errors
/// [`Error::Invalid`] for light of numbers that no scene may have.
pub fn transfer_sections(transfer: &TransferFunction, lighting: Option<&Lighting>) -> Result<String> {
    let scene = Scene::new(transfer.clone()).with_lighting(lighting.cloned())?;
    let (light, lights) = light::of(&scene);
    let light = if lighting.is_some() { light::LightKeys { gradient: None, ..light } } else { light::LightKeys::default() };
    let transfer = transfer::TransferKeys { classification: None, ..transfer::TransferKeys::of(&scene) };
    Document { transfer, light, lights, ..Document::default() }.text(SceneFormat::Toml)
}

impl Document {
    /// The document that says what `scene` is, and of which volume.
    fn of(scene: &Scene, volume: Option<&VolumeSource>) -> Result<Self> {
        let (light, lights) = light::of(scene);
        Ok(Self {
            volume: volume.map(volume::VolumeKeys::of).transpose()?.unwrap_or_default(),
            camera: camera::CameraKeys::of(scene.camera()),
            image: image::ImageKeys::of(scene),
            transfer: transfer::TransferKeys::of(scene),
            transfer2d: transfer2d::Transfer2dKeys::of(scene),
            slices: slices::SliceKeys::of(scene),
            fog: fog::FogKeys::of(scene),
            light,
            lights,
            render: render::RenderKeys::of(scene),
            opengl: opengl::OpenGlKeys::of(scene),
            labels: labels::LabelKeys::of(scene, volume)?,
            region: region::of(scene),
            clip: clip::of(scene),
            cut: cut::of(scene),
            annotate: annotate::AnnotateKeys::default(),
        })
    }

    /// Every key that is set, as text.
    pub(super) fn text(&self, format: SceneFormat) -> Result<String> {
        let refused = |e: &dyn std::fmt::Display| Error::invalid(format!("scene: cannot be written: {e}"));
        let text = match format {
            SceneFormat::Toml => {
                let text = toml::to_string(self).map_err(|e| refused(&e))?;
                text.lines().map(|line| broken(line) + "\n").collect()
            }
            SceneFormat::Json => {
                let mut value = serde_json::to_value(self).map_err(|e| refused(&e))?;
                drop_nulls(&mut value);
                serde_json::to_string_pretty(&value).map_err(|e| refused(&e))? + "\n"
            }
        };
        if text.len() as u64 > MAX_BYTES {
            return Err(Error::Limit { what: "scene: bytes of its file".into(), needed: text.len() as u128, limit: MAX_BYTES.into() });
        }
        Ok(text)
    }
}

/// A long list of lists with one of them a line.
fn broken(line: &str) -> String {
    match line.split_once(" = [[") {
        Some((key, list)) if line.len() > LINE => {
            let rows = list.strip_suffix(']').unwrap_or(list).replace("], [", "],\n  [");
            format!("{key} = [\n  [{rows}\n]")
        }
        _ => line.to_owned(),
    }
}

/// A key without a value is one that is not there.
fn drop_nulls(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|_, inner| !inner.is_null());
            map.values_mut().for_each(drop_nulls);
        }
        Value::Array(items) => items.iter_mut().for_each(drop_nulls),
        _ => {}
    }
}
