//! What a picture says of its making.

use crate::picture::Metadata;
use crate::scene::{Annotations, SceneFile, SceneFormat, write_scene};
use crate::volume::{Origin, VolumeSource};
use crate::{Error, Picture, Result, Scene, Volume};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const SCENE: &str = "slicestack.scene";
const KEYS: &str = "slicestack.scene.keys";
const VERSION: &str = "slicestack.version";
const PIXELS: &str = "slicestack.sha256";
const VOLUME: &str = "slicestack.volume.sha256";
const LABELS: &str = "slicestack.labels.sha256";

/// Digits of a key's value that are kept.
const DIGITS: usize = 8;

/// What a picture was made of, and by which version.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Provenance {
    /// The scene, as the text of a scene file in TOML. Its section `[volume]` names no file.
    pub scene: String,
    /// The version of this crate.
    pub version: String,
    /// SHA-256 of the pixels in f32.
    pub sha256: String,
    /// Fingerprint of the volume.
    pub volume_sha256: String,
    /// Fingerprint of the label map beside the volume, empty without one.
    pub labels_sha256: String,
    /// Digits of the SHA-256 of each key's value when the picture was made.
    keys: BTreeMap<String, String>,
}

impl Provenance {
    /// That of `picture`, made of `scene` for `volume`, which came from `source`.
    ///
    /// # Errors
    /// As [`write_scene`].
    pub fn of(scene: &Scene, source: &VolumeSource, volume: &Volume, picture: &Picture) -> Result<Self> {
        // Whoever reads it need not know what is usual for the volume.
        let scene = scene.clone().with_opacity_from(scene.color_opacity(volume));
        let scene = scene_text(&scene, source)?;
        let keys = digests(&scene)?;
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let labels_sha256 = labels_sha256(volume);
        Ok(Self { keys, scene, version, sha256: picture.sha256(), volume_sha256: volume.sha256(), labels_sha256 })
    }

    /// It as texts of a picture file.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a text holds a zero character.
    pub fn metadata(&self) -> Result<Metadata> {
        let keys: Vec<String> = self.keys.iter().map(|(key, digits)| format!("{key} {digits}\n")).collect();
        let metadata = Metadata::new()
            .with(SCENE, self.scene.as_str())?
            .with(KEYS, keys.concat())?
            .with(VERSION, self.version.as_str())?
            .with(PIXELS, self.sha256.as_str())?
            .with(VOLUME, self.volume_sha256.as_str())?;
        if self.labels_sha256.is_empty() { Ok(metadata) } else { metadata.with(LABELS, self.labels_sha256.as_str()) }
    }

    /// What the texts of a picture say of its making; `None` where there is no scene among them.
    pub fn read(metadata: &Metadata) -> Option<Self> {
        let text = |key: &str| metadata.get(key).unwrap_or_default().trim().to_owned();
        let keys = metadata.get(KEYS).unwrap_or_default().lines().filter_map(|line| line.split_once(' '));
        Some(Self {
            scene: metadata.get(SCENE)?.to_owned(),
            version: text(VERSION),
            sha256: text(PIXELS),
            volume_sha256: text(VOLUME),
            labels_sha256: text(LABELS),
            keys: keys.map(|(key, digits)| (key.to_owned(), digits.to_owned())).collect(),
        })
    }

    /// What the file at `path` says of its making; `None` where it says nothing.
    ///
    /// # Errors
    /// As [`Metadata::open`].
    pub fn open(path: impl AsRef<Path>) -> Result<Option<Self>> {
        Ok(Self::read(&Metadata::open(path)?))
    }

    /// Keys of the scene whose values are not those that the picture was made with: changed, added or removed since. All of them where the
    /// picture does not say.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene is no TOML.
    pub fn edited_keys(&self) -> Result<Vec<String>> {
        let now = digests(&self.scene)?;
        let both: std::collections::BTreeSet<&String> = now.keys().chain(self.keys.keys()).collect();
        Ok(both.into_iter().filter(|key| now.get(*key) != self.keys.get(*key)).cloned().collect())
    }
}

/// The scene file of `scene`, without the name of a file that holds the volume.
fn scene_text(scene: &Scene, source: &VolumeSource) -> Result<String> {
    // Stand-ins that are taken out again: a file is named by nothing.
    const STAND_IN: &str = "volume";
    const LABELS_IN: &str = "labels";
    let nameless = match source.path() {
        Some(_) => source.clone().with_path(STAND_IN),
        None => source.clone(),
    };
    let labels = source.labels.as_deref().map(|labels| labels.clone().with_path(LABELS_IN));
    let labelled = labels.is_some();
    let nameless = nameless.with_labels(labels);
    let text = write_scene(scene, Some(&nameless), &Annotations::new(), SceneFormat::Toml)?;
    let without = |text: String, name: &str| text.replacen(&format!("path = \"{name}\"\n"), "", 1);
    let text = if labelled { without(text, LABELS_IN) } else { text };
    Ok(match nameless.origin {
        Origin::Phantom(..) => text,
        Origin::File(_) | Origin::Raw(..) => without(text, STAND_IN),
    })
}

/// For each key of a scene in TOML digits of the SHA-256 of its value.
fn digests(scene: &str) -> Result<BTreeMap<String, String>> {
    let table: toml::Table = toml::from_str(scene).map_err(|e| Error::invalid(format!("the scene: {}", e.message())))?;
    let mut found = BTreeMap::new();
    let mut note = |key: String, value: &toml::Value| {
        let hash: String = Sha256::digest(value.to_string()).iter().map(|b| format!("{b:02x}")).collect();
        found.insert(key, hash[..DIGITS].to_owned());
    };
    for (section, value) in &table {
        match value {
            toml::Value::Table(inner) => inner.iter().for_each(|(key, value)| note(format!("{section}.{key}"), value)),
            list => note(section.clone(), list),
        }
    }
    Ok(found)
}

/// Fingerprint of the label map beside `volume`, empty without one.
pub(super) fn labels_sha256(volume: &Volume) -> String {
    volume.labels().map(crate::volume::LabelMap::sha256).unwrap_or_default()
}

/// Files that a picture was made of: no picture says where they are.
///
/// ```
/// use slicestack::proof::Inputs;
///
/// let inputs = Inputs::new().volume("head.nrrd").labels("segments.nrrd");
/// assert!(inputs.volume.is_some() && Inputs::new().labels.is_none());
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Inputs {
    /// The volume's file; `None` for a built-in one.
    pub volume: Option<PathBuf>,
    /// The file of the label map beside it; `None` without one.
    pub labels: Option<PathBuf>,
}

impl Inputs {
    /// No files: for pictures of built-in volumes.
    pub fn new() -> Self {
        Self::default()
    }

    /// The files with the volume's.
    #[must_use]
    pub fn volume(mut self, path: impl Into<PathBuf>) -> Self {
        self.volume = Some(path.into());
        self
    }

    /// The files with that of the label map beside the volume.
    #[must_use]
    pub fn labels(mut self, path: impl Into<PathBuf>) -> Self {
        self.labels = Some(path.into());
        self
    }
}

/// The scene that a picture carries, read.
pub(super) fn scene_file(scene: &str, inputs: &Inputs) -> Result<SceneFile> {
    let mut overrides = crate::scene::Overrides::default();
    if let Some(path) = &inputs.volume {
        overrides.set_volume(path);
    }
    if let Some(path) = &inputs.labels {
        overrides.set_labels(path);
    }
    SceneFile::parse(scene, "", &overrides)
}
