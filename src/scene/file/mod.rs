//! Scene files: TOML, or JSON with the same keys.
//!
//! ```text
//!  text --table--> checked table + where each key was written --serde--> Document --build--> VolumeSource, Scene
//!                       ^ overrides (`section.key = value`)
//! ```
//! Unknown keys are errors. An error names the file, the line and the key, or the flag that overrode it.

mod build;
mod keys;
mod opengl;
mod schema;
mod table;
#[cfg(test)]
mod tests;

pub use schema::{Key, KeyKind, keys, schema};

use crate::volume::VolumeSource;
use crate::{Error, Result, Scene, Volume};
use keys::Document;
use std::path::{Path, PathBuf};
use table::{Place, Places};

/// Largest scene file that is read.
const MAX_BYTES: u64 = 16 << 20;

/// Keys given beside the file, usually by flags: they win over the file's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overrides(Vec<(String, String)>);

impl Overrides {
    /// Sets `section.key` to `text`: plain text for keys that take words, else a number, `true`, or a list such as `1,2,3` or
    /// `[0, 1], [100, 0.5]`. Later calls win.
    pub fn set(&mut self, path: impl Into<String>, text: impl Into<String>) {
        self.0.push((path.into(), text.into()));
    }
}

/// A scene as a file describes it: still without the data that presets and the camera's defaults need.
#[derive(Debug, Clone)]
pub struct SceneFile {
    document: Document,
    places: Places,
    base: PathBuf,
    source: VolumeSource,
    shell: Scene,
}

impl SceneFile {
    /// Reads a scene file; paths in it are relative to its directory.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read, [`Error::Format`] when it is no text or longer than 16 MiB, and as
    /// [`SceneFile::parse`].
    pub fn read(path: impl AsRef<Path>, overrides: &Overrides) -> Result<Self> {
        use std::io::Read;
        let path = path.as_ref();
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
        file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(Error::format(path, format!("longer than the {MAX_BYTES} bytes a scene file may have")));
        }
        let text = String::from_utf8(bytes)
            .map_err(|e| Error::format(path, format!("not a scene: byte {} is no text", e.utf8_error().valid_up_to())))?;
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
        let (document, places) = table::document(text, file, overrides)?;
        let builder = build::Builder { document: &document, places: &places, base };
        let (source, shell) = (builder.source()?, builder.shell()?);
        Ok(Self { base: base.to_path_buf(), source, shell, document, places })
    }

    /// The volume that the scene is about.
    pub fn volume(&self) -> &VolumeSource {
        &self.source
    }

    /// The scene for its volume, and what the user should hear about it, one line each.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::Format`] where what depends on the data cannot be: a look-at camera that stands on the
    /// box's centre, a preset over a range that overflows.
    pub fn to_scene(&self, volume: &Volume) -> Result<(Scene, Vec<String>)> {
        build::Builder { document: &self.document, places: &self.places, base: &self.base }.finish(&self.shell, volume)
    }
}
