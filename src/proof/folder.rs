//! A folder of scene files, each with its picture on record beside it.

use super::provenance::Provenance;
use super::verify::as_stored;
use crate::compare::{Comparison, DIFFERENCE_SCALE, Tolerance, difference_map, flip_map};
use crate::files::Staged;
use crate::picture::{Depth, Format, picture_bytes};
use crate::reference::metrics::DEFAULT_PIXELS_PER_DEGREE;
use crate::scene::{Overrides, SceneFile};
use crate::{Error, Picture, Renderer, Result, Settings};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A scene file, and how its picture compares with the one on record.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Checked {
    /// The scene file.
    pub scene: PathBuf,
    /// What was found.
    pub outcome: Outcome,
    /// PNG files for [`page`], by their names: the picture on record (where there is one of the right size), the picture made, their
    /// difference and their FLIP map. None where all is well.
    pub pictures: Vec<(String, Vec<u8>)>,
}

/// How a picture compares with the one on record.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// It is within the tolerance.
    Same(Comparison),
    /// It is not, or there is none on record; in words.
    Differs(String),
    /// There is no picture: the scene or its volume is at fault, or the file on record; in one line.
    Failed(String),
}

/// A picture put on record.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Blessed {
    /// The file.
    pub picture: PathBuf,
    /// Whether it holds other bytes than before.
    pub changed: bool,
}

/// The scene files (`.toml`, `.json`) in `folder`, by name.
fn scenes(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))?;
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| Error::io(folder, e))?.path();
        let scene = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml") || e.eq_ignore_ascii_case("json"));
        if scene && path.is_file() {
            found.push(path);
        }
    }
    if found.is_empty() {
        return Err(Error::format(folder, "holds no scene file (.toml, .json)"));
    }
    found.sort();
    if let Some(pair) = found.windows(2).find(|pair| pair[0].with_extension("") == pair[1].with_extension("")) {
        return Err(Error::format(&pair[1], format!("has the name of {}: two scenes cannot share a picture", pair[0].display())));
    }
    Ok(found)
}

/// The picture on record of a scene file: the one of its name that is there, else a PNG.
fn record(scene: &Path) -> PathBuf {
    // A lossy one cannot be held against anything.
    let formats = Format::ALL.into_iter().filter(|f| *f != Format::Jpeg);
    let names = formats.flat_map(|f| f.extensions().iter().map(|e| scene.with_extension(e)));
    names.into_iter().find(|path| path.is_file()).unwrap_or_else(|| scene.with_extension("png"))
}

/// The picture of a scene file, and what it says of its making.
fn rendered(scene: &Path, settings: &Settings) -> Result<(Picture, Provenance)> {
    let file = SceneFile::read(scene, &Overrides::default())?;
    let volume = file.volume().load(&settings.limits)?;
    let (scene, _) = file.to_scene(&volume)?;
    let (picture, _) = Renderer::new(&volume, settings.clone()).render(&scene)?;
    let provenance = Provenance::of(&scene, file.volume(), &volume, &picture)?;
    Ok((picture, provenance))
}

/// Renders every scene file in `folder` and holds it against the picture of its name beside it, both as that file's format holds them.
///
/// # Errors
/// [`Error::Io`] when the folder cannot be read, [`Error::Format`] when it holds no scene file or two of one name, [`Error::Stopped`]. What is
/// wrong with one scene is its [`Outcome`].
pub fn check(folder: &Path, tolerance: &Tolerance, settings: &Settings) -> Result<Vec<Checked>> {
    let mut all = Vec::new();
    for scene in scenes(folder)? {
        let (outcome, pictures) = match held(&scene, tolerance, settings) {
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(e) => (Outcome::Failed(e.to_string()), Vec::new()),
            Ok(found) => found,
        };
        all.push(Checked { scene, outcome, pictures });
    }
    Ok(all)
}

type Found = (Outcome, Vec<(String, Vec<u8>)>);

fn held(scene: &Path, tolerance: &Tolerance, settings: &Settings) -> Result<Found> {
    let (picture, _) = rendered(scene, settings)?;
    let record = record(scene);
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let png = |what: &str, picture: &Picture| Ok::<_, Error>((format!("{stem}-{what}.png"), picture.encode(Format::Png, Depth::Eight)?));
    if !record.is_file() {
        return Ok((Outcome::Differs(format!("there is no {}", record.display())), vec![png("after", &picture)?]));
    }
    let bytes = picture_bytes(&record)?;
    let (before, after) = (Picture::decode(&bytes, &record)?, as_stored(&picture, &bytes, &record)?);
    let ((w, h), (v, g)) = ((before.width(), before.height()), (after.width(), after.height()));
    if (w, h) != (v, g) {
        let why = format!("{v} x {g} pixels, {} has {w} x {h}", record.display());
        return Ok((Outcome::Differs(why), vec![png("before", &before)?, png("after", &after)?]));
    }
    let comparison = Comparison::of(&before, &after)?;
    let Some(beyond) = tolerance.exceeded(&comparison) else { return Ok((Outcome::Same(comparison), Vec::new())) };
    let place = comparison.worst.map_or_else(String::new, |(x, y)| format!(", largest difference {:.3e} at {x},{y}", comparison.max));
    let pictures = vec![
        png("before", &before)?,
        png("after", &after)?,
        png("difference", &difference_map(&before, &after)?)?,
        png("flip", &flip_map(&before, &after, DEFAULT_PIXELS_PER_DEGREE)?)?,
    ];
    Ok((Outcome::Differs(beyond + &place), pictures))
}

/// Renders every scene file in `folder` and puts its picture on record beside it, with what it says of its making. A picture that is there gives
/// way where it says that of itself too, or with `force`; otherwise none is written at all.
///
/// # Errors
/// As [`check`]; [`Error::Format`] for a picture that may not be replaced; whatever reading, rendering and writing may say.
pub fn bless(folder: &Path, force: bool, settings: &Settings) -> Result<Vec<Blessed>> {
    let scenes = scenes(folder)?;
    for scene in &scenes {
        let record = record(scene);
        if !force && record.is_file() && Provenance::open(&record).ok().flatten().is_none() {
            return Err(Error::format(&record, "is there already and carries no scene: it was not made here; --force replaces it"));
        }
    }
    let mut encoded = Vec::new();
    for scene in &scenes {
        let (picture, provenance) = rendered(scene, settings)?;
        let record = record(scene);
        let bytes = picture.encode_with(Format::of_path(&record)?, Depth::Eight, &provenance.metadata()?)?;
        encoded.push((record, bytes));
    }
    let mut all = Vec::new();
    let mut staged = Staged::new();
    for (picture, bytes) in encoded {
        let changed = std::fs::read(&picture).ok().as_ref() != Some(&bytes);
        if changed {
            staged.add(&picture, &bytes)?;
        }
        all.push(Blessed { picture, changed });
    }
    staged.finish()?;
    Ok(all)
}

const STYLE: &str = "
:root{color-scheme:light dark}body{margin:0 auto;max-width:1200px;padding:16px;font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.5em}h2{font-size:1.1em;margin:1.6em 0 .3em}.soft{opacity:.75;font-size:.9em}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(220px,1fr));gap:12px}figure{margin:0}
img{width:100%;height:auto;border:1px solid #8888;image-rendering:pixelated}figcaption{font-size:.9em}
";

/// A page of what was found, and the pictures that it shows, by their names: `index.html`, and PNG files to stand beside it.
pub fn page(checked: &[Checked]) -> Vec<(String, Vec<u8>)> {
    let wrong = checked.iter().filter(|c| !matches!(c.outcome, Outcome::Same(_))).count();
    let mut body = format!("<h1>{wrong} of {} pictures are not those on record</h1>\n", checked.len());
    // Writing to a String cannot fail.
    let _ = writeln!(body, "<p class=\"soft\">Difference: {DIFFERENCE_SCALE}. FLIP: black 0, pale yellow 1.</p>");
    let mut files = Vec::new();
    for c in checked {
        let name = escape(&c.scene.file_name().unwrap_or_default().to_string_lossy());
        let (what, why) = match &c.outcome {
            Outcome::Same(_) => continue,
            Outcome::Differs(why) => ("differs", why),
            Outcome::Failed(why) => ("cannot be rendered", why),
        };
        let _ = writeln!(body, "<h2>{name}: {what}</h2>\n<p>{}</p>\n<div class=\"pictures\">", escape(why));
        for (file, bytes) in &c.pictures {
            let caption = file.trim_end_matches(".png").rsplit('-').next().unwrap_or_default();
            let src = file.bytes().fold(String::new(), |mut src, b| {
                let _ = if b.is_ascii_alphanumeric() || b"-._".contains(&b) {
                    write!(src, "{}", char::from(b))
                } else {
                    write!(src, "%{b:02X}")
                };
                src
            });
            let _ = writeln!(body, "<figure><img src=\"{src}\" alt=\"{name}: {caption}\"><figcaption>{caption}</figcaption></figure>");
            files.push((file.clone(), bytes.clone()));
        }
        body.push_str("</div>\n");
    }
    let html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, \
         initial-scale=1\">\n<title>Golden pictures</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    );
    files.insert(0, ("index.html".to_owned(), html.into_bytes()));
    files
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
