//! Renders a picture's scene again and says what differs.

use super::provenance::{Inputs, Provenance, labels_sha256, scene_file};
use crate::picture::{Depth, Format, Metadata, picture_bytes};
use crate::{Error, Picture, Renderer, Result, Scene, Settings, Volume};
use std::fmt;
use std::path::Path;

/// What became of a picture's scene, rendered again.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Verdict {
    /// The picture's version and this one's, where they are not the same.
    pub version: Option<(String, String)>,
    /// Fingerprints of the picture's volume and of the one that was loaded, where they are not the same.
    pub volume: Option<(String, String)>,
    /// The same of the label maps beside the volumes.
    pub labels: Option<(String, String)>,
    /// Keys of the scene that were edited in the file.
    pub edited: Vec<String>,
    /// How the picture's pixels differ from those rendered, where they do.
    pub pixels: Option<PixelsDiffer>,
    /// SHA-256 of the pixels as they were and as they were rendered, in f32, where they are not the same.
    pub sha256: Option<(String, String)>,
}

/// Pixels of a file and of the same scene rendered again, both as the file's format holds them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PixelsDiffer {
    /// The pictures are not of one size: width and height of the file's and of the one rendered.
    Size((u32, u32), (u32, u32)),
    /// So many of so many pixels differ.
    Some {
        /// How many do.
        differing: u64,
        /// How many there are.
        pixels: u64,
        /// Column and row of the largest difference, the first such in reading order.
        worst: (u32, u32),
        /// That difference of a component, premultiplied, 0 to 1.
        max: f64,
    },
}

impl Verdict {
    /// Whether the picture is what its scene says: the pixels came out again, bit by bit, before they were rounded into the file and after; of
    /// the same volume, by a scene that nobody edited. Another version that makes the same pixels is no difference.
    pub fn is_same(&self) -> bool {
        self.pixels.is_none() && self.sha256.is_none() && self.volume.is_none() && self.labels.is_none() && self.edited.is_empty()
    }

    /// What differs, one line each: another version too, which alone is no difference.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some((then, now)) = &self.version {
            lines.push(format!("version: made by slicestack {then}, this is {now}"));
        }
        if let Some((then, now)) = &self.volume {
            lines.push(format!("volume: its SHA-256 is {}..., the picture was made of {}...", start(now), start(then)));
        }
        if let Some((then, now)) = &self.labels {
            lines.push(format!("labels: their SHA-256 is {}..., the picture was made of {}...", start(now), start(then)));
        }
        if !self.edited.is_empty() {
            lines.push(format!("scene: edited since the picture was made: {}", self.edited.join(", ")));
        }
        match &self.pixels {
            Some(differ) => lines.push(format!("pixels: {differ}")),
            None => lines.extend(self.sha256.as_ref().map(|_| "pixels: the same as the file holds them, but not in f32".to_owned())),
        }
        lines
    }
}

/// The first digits of a SHA-256.
fn start(hash: &str) -> String {
    if hash.is_empty() { "(none)".to_owned() } else { hash.chars().take(12).collect() }
}

impl fmt::Display for PixelsDiffer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size((w, h), (v, g)) => write!(f, "the file has {w} x {h} of them, the scene {v} x {g}"),
            Self::Some { differing, pixels, worst: (x, y), max } => {
                write!(f, "{differing} of {pixels} differ, most by {max:.3e}, at {x},{y}")
            }
        }
    }
}

/// What a picture file says of its making, read but not yet rendered.
pub(super) struct Carried {
    bytes: Vec<u8>,
    pub(super) file: Picture,
    pub(super) provenance: Provenance,
    edited: Vec<String>,
    pub(super) volume: Volume,
    pub(super) scene: Scene,
}

/// Renders again the scene that the picture file `path` carries, of the volume in the files `inputs`, or of the built-in one
/// that the scene says. A scene that names files of its own is refused: a picture may come from anybody.
///
/// # Errors
/// [`Error::Format`] naming `path` where it carries no scene, or one of a volume or a label map and no file is given for it; whatever reading the picture, the
/// scene and the volume may say, and rendering.
pub fn verify(path: &Path, inputs: &Inputs, settings: &Settings) -> Result<Verdict> {
    Ok(Carried::read(path, inputs, settings)?.render(path, settings)?.0)
}

impl Carried {
    /// Reads the picture file, its scene and its volume.
    pub(super) fn read(path: &Path, inputs: &Inputs, settings: &Settings) -> Result<Self> {
        let bytes = picture_bytes(path)?;
        let file = Picture::decode(&bytes, path)?;
        let Some(provenance) = Provenance::read(&Metadata::decode(&bytes, path)?) else {
            return Err(Error::format(path, "carries no scene (slicestack.scene): it was made without metadata, or lost it"));
        };
        let named = |e: Error| match e {
            Error::Invalid(what) => Error::format(path, format!("its scene: {what}")),
            other => other,
        };
        let edited = provenance.edited_keys().map_err(named)?;
        if let Some(key) = named_file(&provenance.scene) {
            return Err(Error::format(
                path,
                format!("its scene names a file ({key}), which no picture made here does: it is not followed"),
            ));
        }
        if inputs.volume.is_none() && !names_volume(&provenance.scene) {
            return Err(Error::format(path, "does not say where its volume is: name the file with --volume FILE"));
        }
        let labelled = !provenance.labels_sha256.is_empty();
        if labelled && inputs.labels.is_none() {
            return Err(Error::format(path, "does not say where its label map is: name the file with --labels FILE"));
        }
        if !labelled && inputs.labels.is_some() {
            return Err(Error::format(path, "was made without a label map beside its volume: leave --labels out"));
        }
        let scene_file = scene_file(&provenance.scene, inputs).map_err(named)?;
        let volume = scene_file.volume().load(&settings.limits)?;
        let (scene, _) = scene_file.to_scene(&volume).map_err(named)?;
        Ok(Self { bytes, file, provenance, edited, volume, scene })
    }

    /// Renders the scene and holds the file against that: what was found, and the picture rendered.
    pub(super) fn render(&self, path: &Path, settings: &Settings) -> Result<(Verdict, Picture)> {
        let (picture, _) = Renderer::new(&self.volume, settings.clone()).render(&self.scene)?;
        let apart = |then: &str, now: String| (then != now).then(|| (then.to_owned(), now));
        let verdict = Verdict {
            version: apart(&self.provenance.version, env!("CARGO_PKG_VERSION").to_owned()),
            volume: apart(&self.provenance.volume_sha256, self.volume.sha256()),
            labels: apart(&self.provenance.labels_sha256, labels_sha256(&self.volume)),
            edited: self.edited.clone(),
            pixels: pixels(&self.file, &as_stored(&picture, &self.bytes, path)?),
            sha256: apart(&self.provenance.sha256, picture.sha256()),
        };
        Ok((verdict, picture))
    }
}

/// The value of a key of a scene in TOML.
fn value(scene: &str, section: &str, key: &str) -> Option<toml::Value> {
    toml::from_str::<toml::Table>(scene).ok()?.get(section)?.get(key).cloned()
}

/// A key by which a scene asks for a file to be read. A picture comes from anywhere, and must not choose which files are opened here.
fn named_file(scene: &str) -> Option<&'static str> {
    let keys = [
        ("volume.path", "volume", "path"),
        ("labels.path", "labels", "path"),
        ("transfer.file", "transfer", "file"),
        ("transfer2d.table", "transfer2d", "table"),
    ];
    keys.into_iter().find(|(_, section, key)| value(scene, section, key).is_some_and(|v| v.is_str())).map(|(path, ..)| path)
}

/// Whether a scene is of a built-in volume, which needs no file.
fn names_volume(scene: &str) -> bool {
    value(scene, "volume", "phantom").is_some()
}

/// `picture` after it has been through a file of the kind that `bytes` are.
pub(super) fn as_stored(picture: &Picture, bytes: &[u8], path: &Path) -> Result<Picture> {
    let format = Format::of_start(bytes).unwrap_or(Format::Npy);
    // The byte behind width and height in a PNG's first chunk is the depth; no other format that carries a scene has two.
    let sixteen = format == Format::Png && bytes.get(24) == Some(&16);
    let depth = if sixteen { Depth::Sixteen } else { Depth::Eight };
    Picture::decode(&picture.encode(format, depth)?, path)
}

/// How `file` differs from `made`, to the bit.
fn pixels(file: &Picture, made: &Picture) -> Option<PixelsDiffer> {
    let size = |p: &Picture| (p.width(), p.height());
    if size(file) != size(made) {
        return Some(PixelsDiffer::Size(size(file), size(made)));
    }
    let (mut differing, mut worst, mut max) = (0, (0, 0), -1.0);
    for (i, (a, b)) in file.pixels().iter().zip(made.pixels()).enumerate() {
        if a.map(f32::to_bits) == b.map(f32::to_bits) {
            continue;
        }
        differing += 1;
        let most = a.iter().zip(b).map(|(x, y)| (f64::from(*x) - f64::from(*y)).abs()).fold(0.0, f64::max);
        if most > max {
            let width = file.width() as usize;
            (max, worst) = (most, ((i % width) as u32, (i / width) as u32));
        }
    }
    (differing > 0).then(|| PixelsDiffer::Some { differing, pixels: file.pixels().len() as u64, worst, max: f64::max(max, 0.0) })
}
