//! The scene as the page holds it: a scene document in JSON, without a word about files.
//!
//! ```text
//!  page's document --no file named?--> + volume and label map of the command --SceneFile--> Scene
//!  Scene --write_scene--> document --without volume and label map--> page
//! ```

use super::quality::slices;
use crate::scene::{Annotations, ResolvedScene, SceneFile, SceneFormat, keys, write_scene};
use crate::volume::VolumeSource;
use crate::{Error, Result, Scene, Volume};
use serde_json::{Map, Value};
use std::path::PathBuf;

/// The document of a page.
pub(super) type Document = Map<String, Value>;

/// Keys that name files, in whatever section.
const FILES: [&str; 3] = ["path", "file", "layers"];
/// Keys of the section labels that say where the label map is.
pub(super) const MAP: [&str; 6] = ["path", "series", "array", "level", "frame", "channel"];
/// Longest side of a picture.
const SIDE: u32 = 8192;
/// Most pixels of a picture.
const PIXELS: u64 = 1 << 24;
/// Most slices of one: a frame is stopped between blocks of pixels, which must not take long.
const SLICES: u64 = 1 << 16;
/// What stands for the name of a file that is not told.
const STAND_IN: &str = "volume";

/// What the command has opened.
pub(super) struct Opened {
    pub(super) volume: Volume,
    pub(super) source: VolumeSource,
    /// Its scene, with everything decided.
    pub(super) scene: Scene,
    pub(super) annotations: Annotations,
    /// Sections that say where the data is, with a stand-in for each name of a file.
    data: Value,
    labels: Document,
}

/// A scene that a page asks for.
pub(super) struct Asked {
    pub(super) scene: Scene,
    pub(super) annotations: Annotations,
    pub(super) warnings: Vec<String>,
    pub(super) notes: Vec<String>,
}

impl Opened {
    /// `scene` and `annotations` of `volume`, which came from `source`.
    ///
    /// # Errors
    /// As [`write_scene`].
    pub(super) fn new(volume: Volume, source: VolumeSource, scene: Scene, annotations: Annotations) -> Result<Self> {
        let nameless = nameless(&source);
        let mut whole = document(&scene, Some(&nameless), &annotations)?;
        // The volume is there: what a file looks like is asked no more.
        let data = match source.path() {
            Some(_) => serde_json::json!({ "path": STAND_IN }),
            None => whole.remove("volume").unwrap_or_default(),
        };
        let labels = match whole.remove("labels") {
            Some(Value::Object(labels)) if source.labels.is_some() => {
                labels.into_iter().filter(|(key, _)| MAP.contains(&key.as_str())).collect()
            }
            _ => Document::new(),
        };
        Ok(Self { volume, source, scene, annotations, data, labels })
    }

    /// What `document` asks for, in a picture of `size` where that is given.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a document that names a file, a size that is too large, and all that is no scene of this volume.
    pub(super) fn read(&self, mut document: Document, size: Option<(u32, u32)>) -> Result<Asked> {
        document.remove("volume");
        for (section, inner) in &document {
            check_names(section, inner)?;
        }
        document.insert("volume".to_owned(), self.data.clone());
        if !self.labels.is_empty() {
            let section = document.entry("labels").or_insert_with(|| Value::Object(Document::new()));
            let Value::Object(section) = section else { return Err(Error::invalid("labels: is no section")) };
            section.extend(self.labels.clone());
        }
        if let Some((width, height)) = size {
            check_size(width, height)?;
            let image = document.entry("image").or_insert_with(|| Value::Object(Document::new()));
            let Value::Object(image) = image else { return Err(Error::invalid("image: is no section")) };
            image.insert("width".to_owned(), width.into());
            image.insert("height".to_owned(), height.into());
        }
        let file = SceneFile::parse(&Value::Object(document).to_string(), "", &crate::scene::Overrides::default())?;
        let ResolvedScene { scene, warnings, notes } = file.resolve(&self.volume)?;
        check(&scene, &self.volume)?;
        let annotations = file.annotations();
        crate::annotate::check(&annotations, &scene)?;
        Ok(Asked { scene, annotations, warnings, notes })
    }

    /// The document for the page that says what `scene` is.
    ///
    /// # Errors
    /// As [`write_scene`].
    pub(super) fn write(&self, scene: &Scene, annotations: &Annotations) -> Result<Document> {
        let mut document = document(scene, Some(&nameless(&self.source)), annotations)?;
        document.remove("volume");
        if let Some(Value::Object(labels)) = document.get_mut("labels") {
            labels.retain(|key, _| !MAP.contains(&key.as_str()));
        }
        Ok(document)
    }

    /// The text of a scene file that says the same, with the whole paths of its data: it may be kept anywhere.
    ///
    /// # Errors
    /// As [`write_scene`].
    pub(super) fn save(&self, asked: &Asked, format: SceneFormat) -> Result<String> {
        let mut source = whole(self.source.clone());
        source.labels = source.labels.map(|labels| Box::new(whole(*labels)));
        write_scene(&asked.scene, Some(&source), &asked.annotations, format)
    }
}

/// `scene` as a table of sections.
fn document(scene: &Scene, source: Option<&VolumeSource>, annotations: &Annotations) -> Result<Document> {
    let text = write_scene(scene, source, annotations, SceneFormat::Json)?;
    serde_json::from_str(&text).map_err(|e| Error::invalid(format!("scene: {e}")))
}

/// The source with stand-ins for the names of its files.
fn nameless(source: &VolumeSource) -> VolumeSource {
    let mut source = source.clone().with_path(STAND_IN);
    source.labels = source.labels.map(|labels| Box::new(labels.with_path(STAND_IN)));
    source
}

/// The source with the whole path of its file.
fn whole(source: VolumeSource) -> VolumeSource {
    let path: Option<PathBuf> = source.path().map(|path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()));
    match path {
        Some(path) => source.with_path(path),
        None => source,
    }
}

/// Refuses keys at and below `path` that name a file.
fn check_names(path: &str, value: &Value) -> Result<()> {
    match value {
        Value::Object(map) => map.iter().try_for_each(|(key, inner)| {
            if FILES.contains(&key.as_str()) {
                return Err(Error::invalid(format!("{path}.{key}: the page can name no file; the command that started it can")));
            }
            check_names(&format!("{path}.{key}"), inner)
        }),
        Value::Array(items) => items.iter().try_for_each(|item| check_names(path, item)),
        _ => Ok(()),
    }
}

/// Refuses pictures that take more than a view may.
///
/// # Errors
/// [`Error::Invalid`] for those, and where the camera does not resolve.
pub(super) fn check(scene: &Scene, volume: &Volume) -> Result<()> {
    let (width, height) = scene.size();
    check_size(width, height)?;
    let slices = slices(scene, volume)?;
    if slices > SLICES {
        return Err(Error::invalid(format!("slices: {slices} of them; a view has at most {SLICES}")));
    }
    Ok(())
}

fn check_size(width: u32, height: u32) -> Result<()> {
    if width > SIDE || height > SIDE || u64::from(width) * u64::from(height) > PIXELS {
        return Err(Error::invalid(format!("image {width} x {height}: a view has at most {SIDE} pixels a side and {PIXELS} in all")));
    }
    Ok(())
}

/// `error` as the page is told it: without the line of a text that nobody sees, and the key that it is about.
pub(super) fn told(error: &Error) -> (String, Option<&'static str>) {
    let text = error.to_string();
    let line = |rest: &str| rest.split_once(": ").filter(|(n, _)| n.bytes().all(|b| b.is_ascii_digit())).map(|(_, what)| what.to_owned());
    let text = text.strip_prefix("line ").and_then(line).unwrap_or(text);
    let mut words = text.split([' ', ':', '[']).filter(|word| !word.is_empty());
    let first = words.next().unwrap_or_default();
    let both = format!("{first}.{}", words.next().unwrap_or_default());
    let key = keys().iter().map(|key| key.path.as_str()).find(|path| *path == first || *path == both);
    (text, key)
}
