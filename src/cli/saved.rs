//! A scene that a command writes: `render --save-scene`.

use super::Usage;
use super::output::Sink;
use anyhow::{Result, bail};
use slicestack::Scene;
use slicestack::scene::{Annotations, SceneFormat, write_scene};
use slicestack::volume::VolumeSource;
use std::path::{Component, Path, PathBuf};

/// The first line of a scene written as TOML: what others wrote has comments of its own, and is not replaced.
const HEAD: &str = "# Written by slicestack; render it with: slicestack render FILE\n";

/// Where a scene goes.
pub(super) struct SavedScene {
    pub(super) path: PathBuf,
    pub(super) sink: Sink,
    format: SceneFormat,
}

impl SavedScene {
    /// # Errors
    /// [`Usage`] for a name that does not say TOML or JSON; as [`Sink::new`].
    pub(super) fn new(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            bail!(Usage("--save-scene -: a scene goes into a file, which its volume's path is relative to".into()));
        }
        let format = SceneFormat::of_path(path).map_err(|e| Usage(e.to_string()))?;
        Ok(Self { path: path.to_path_buf(), sink: Sink::new(path)?, format })
    }

    /// The file's text, with the volume's path relative to it.
    ///
    /// # Errors
    /// As [`write_scene`].
    pub(super) fn text(&self, scene: &Scene, source: &VolumeSource, annotations: &Annotations) -> Result<String> {
        let source = match source.path() {
            Some(volume) => source.clone().with_path(relative(volume, &self.path)),
            None => source.clone(),
        };
        let text = write_scene(scene, Some(&source), annotations, self.format)?;
        Ok(if self.format == SceneFormat::Toml { HEAD.to_owned() + &text } else { text })
    }
}

/// Whether a file that begins with `start` is a scene like those written here.
pub(super) fn is_saved_scene(start: &[u8]) -> bool {
    start.starts_with(HEAD.as_bytes()) || start.starts_with(b"{\n  \"camera\": {\n")
}

/// `to` as it is called from the folder of the file `from`; as it is where there is no way from one to the other.
fn relative(to: &Path, from: &Path) -> PathBuf {
    let folder = |path: &Path| path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).canonicalize().ok();
    let (Some(home), Some(there), Some(name)) = (folder(from), folder(to), to.file_name()) else { return to.to_path_buf() };
    let (home, there): (Vec<Component<'_>>, Vec<Component<'_>>) = (home.components().collect(), there.components().collect());
    let common = home.iter().zip(&there).take_while(|(a, b)| a == b).count();
    // Another drive.
    if common == 0 {
        return to.to_path_buf();
    }
    let up = home[common..].iter().map(|_| Component::ParentDir);
    up.chain(there[common..].iter().copied()).chain([Component::Normal(name)]).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use std::fs;

    #[test]
    fn paths_are_those_from_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir_all(at("data/raw")).unwrap();
        fs::create_dir_all(at("scenes")).unwrap();
        assert_eq!(relative(&at("data/raw/a.nrrd"), &at("scenes/s.toml")), Path::new("../data/raw/a.nrrd"));
        assert_eq!(relative(&at("scenes/a.nrrd"), &at("scenes/s.toml")), Path::new("a.nrrd"));
        assert_eq!(relative(&at("scenes/../data/a.nrrd"), &at("s.toml")), Path::new("data/a.nrrd"));
        assert_eq!(relative(Path::new("none/a.nrrd"), &at("s.toml")), Path::new("none/a.nrrd"));
    }
}
