//! Key frames: a list of moments, each with keys of a scene; between them numbers go from one value to the next.
//!
//! ```toml
//! scene = "head.toml"        # relative to this file; or: volume = "head.nrrd"
//! ease = "smooth"            # slow at every key (the default), or "linear"
//!
//! [[key]]
//! time = 0                   # seconds
//! camera.azimuth = 0
//! transfer.opacity = [[100, 0], [200, 0.5]]
//!
//! [[key]]
//! time = 4
//! camera.azimuth = 360
//! transfer.opacity = [[300, 0], [400, 0.5]]
//! ```
//! A key of the scene that stands in one moment alone holds all the time. Numbers, and lists of the same length of them, are interpolated; words, and
//! lists whose lengths differ, hold until the next moment that has them, and so do seeds of noise. Keys that take whole numbers are rounded.

use super::{KeyKind, MAX_BYTES, Overrides, SceneFile, keys, text_of_file};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most moments.
const MAX_KEYS: usize = 10_000;

/// Keys whose values are names of a noise rather than quantities: they hold.
const SEEDS: [&str; 2] = ["slices.jitter", "render.seed"];

/// Longest animation, seconds.
const LONGEST: f64 = 3600.0;

/// A list of key frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    scene: Option<PathBuf>,
    volume: Option<PathBuf>,
    smooth: bool,
    /// Of each key of the scene: its values by time.
    tracks: BTreeMap<String, Vec<(f64, Value)>>,
    duration: f64,
}

impl Animation {
    /// Reads a list of key frames.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Format`] as for scene files; [`Error::Format`] for an unknown key, moments that do not rise, fewer than two of them, and
    /// more than an hour.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = text_of_file(path, MAX_BYTES)?;
        Self::parse(&text, path.parent().unwrap_or(Path::new(""))).map_err(|what| Error::format(path, what))
    }

    fn parse(text: &str, base: &Path) -> Result<Self, String> {
        let table: Table = toml::from_str(text).map_err(|e: toml::de::Error| e.message().lines().collect::<Vec<_>>().join("; "))?;
        let mut animation = Self { scene: None, volume: None, smooth: true, tracks: BTreeMap::new(), duration: 0.0 };
        let mut moments = Vec::new();
        for (name, value) in table {
            match (name.as_str(), value) {
                ("scene", Value::String(path)) => animation.scene = Some(base.join(path)),
                ("volume", Value::String(path)) => animation.volume = Some(base.join(path)),
                ("ease", Value::String(word)) if word == "smooth" || word == "linear" => animation.smooth = word == "smooth",
                ("ease", other) => return Err(format!("ease = {other}: must be \"smooth\" or \"linear\"")),
                ("key", Value::Array(list)) => moments = list,
                ("scene" | "volume", other) => return Err(format!("{name} = {other}: must be the name of a file")),
                ("key", _) => return Err("key: must be a list of tables, [[key]]".into()),
                _ => return Err(format!("{name}: unknown key; there are scene, volume, ease and [[key]]")),
            }
        }
        if animation.scene.is_some() && animation.volume.is_some() {
            return Err("volume: scene is given too; give one of them".into());
        }
        if !(2..=MAX_KEYS).contains(&moments.len()) {
            return Err(format!("{} [[key]] tables: there can be 2 to {MAX_KEYS}", moments.len()));
        }
        let mut last = f64::NEG_INFINITY;
        for (n, moment) in moments.into_iter().enumerate() {
            let Value::Table(mut moment) = moment else { return Err(format!("key[{n}]: must be a table")) };
            let time = match moment.remove("time") {
                Some(Value::Integer(t)) => t as f64,
                Some(Value::Float(t)) => t,
                _ => return Err(format!("key[{n}]: needs time, a number of seconds")),
            };
            if !(0.0..=LONGEST).contains(&time) || time <= last || (n == 0 && time != 0.0) {
                return Err(format!("key[{n}].time = {time}: times begin at 0 and rise, up to {LONGEST}"));
            }
            last = time;
            animation.add("", moment, time).map_err(|what| format!("key[{n}].{what}"))?;
        }
        animation.duration = last;
        Ok(animation)
    }

    /// Adds the keys of `table`, which stands at `prefix`, to their tracks.
    fn add(&mut self, prefix: &str, table: Table, time: f64) -> Result<(), String> {
        for (name, value) in table {
            let path = format!("{prefix}{name}");
            let known = keys().iter().any(|k| k.path == path);
            match value {
                Value::Table(inner) if !known => self.add(&format!("{path}."), inner, time)?,
                _ if path.starts_with("volume.") || path.starts_with("image.width") || path.starts_with("image.height") => {
                    return Err(format!("{path}: is the same for all frames; set it in the scene"));
                }
                value if known => self.tracks.entry(path).or_default().push((time, value)),
                _ => return Err(format!("{path}: is no key of a scene")),
            }
        }
        Ok(())
    }

    /// The scene file that the key frames are for.
    pub fn scene(&self) -> Option<&Path> {
        self.scene.as_deref()
    }

    /// The volume that they are for, where there is no scene file.
    pub fn volume(&self) -> Option<&Path> {
        self.volume.as_deref()
    }

    /// From the first moment to the last, seconds.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Whether key frames set `path`, a key of the scene.
    pub fn sets(&self, path: &str) -> bool {
        self.tracks.contains_key(path)
    }

    /// Keys of the scene whose values are lists or numbers that cannot be interpolated somewhere: they jump.
    pub fn jumps(&self) -> Vec<&str> {
        let word = |v: &Value| matches!(v, Value::String(_) | Value::Boolean(_));
        let stuck = |w: &[(f64, Value)]| !word(&w[0].1) && mixed(&w[0].1, &w[1].1, 0.5).is_none();
        self.tracks.iter().filter(|(_, track)| track.windows(2).any(stuck)).map(|(path, _)| path.as_str()).collect()
    }

    /// The keys at `time` seconds laid over `given`.
    pub fn at(&self, time: f64, given: &Overrides) -> Overrides {
        let mut overrides = given.clone();
        for (path, track) in &self.tracks {
            let after = track.partition_point(|(t, _)| *t <= time);
            let value = match (after.checked_sub(1).map(|i| &track[i]), track.get(after)) {
                (Some((from, a)), Some((to, b))) => {
                    let share = (time - from) / (to - from);
                    // Slow at both ends: 3 s^2 - 2 s^3.
                    let share = if self.smooth { share * share * (3.0 - 2.0 * share) } else { share };
                    match between(a, b, share) {
                        // The number that noise depends on is no quantity.
                        _ if SEEDS.contains(&path.as_str()) => a.clone(),
                        Value::Float(x) if is_whole(path) => Value::Integer(libm::round(x) as i64),
                        mixed => mixed,
                    }
                }
                (Some((_, only)), None) | (None, Some((_, only))) => only.clone(),
                (None, None) => continue,
            };
            overrides.set(path, text_of(&value));
        }
        overrides
    }

    /// The scene at `time`, from the scene file or volume of these key frames; `given` wins over both.
    ///
    /// # Errors
    /// As [`SceneFile::read`]; [`Error::Invalid`] where neither scene nor volume is named.
    pub fn scene_at(&self, time: f64, given: &Overrides) -> Result<SceneFile> {
        let mut overrides = self.at(time, &Overrides::default());
        overrides.keys.extend(given.keys.iter().cloned());
        overrides.files.extend(given.files.iter().cloned());
        match (&self.scene, &self.volume) {
            (Some(scene), _) => SceneFile::read(scene, &overrides),
            (None, Some(volume)) => {
                let mut all = Overrides::default();
                all.set_volume(volume);
                all.keys.append(&mut overrides.keys);
                all.files.append(&mut overrides.files);
                SceneFile::parse("", "", &all)
            }
            (None, None) => SceneFile::parse("", "", &overrides),
        }
    }
}

/// Whether the key `path` takes whole numbers alone.
fn is_whole(path: &str) -> bool {
    keys().iter().any(|key| key.path == path && key.kind == KeyKind::Whole)
}

/// The value a share of the way from `a` to `b`, where they are numbers, or lists of the same shape of them; else `a`.
fn between(a: &Value, b: &Value, share: f64) -> Value {
    mixed(a, b, share).unwrap_or_else(|| a.clone())
}

fn mixed(a: &Value, b: &Value, share: f64) -> Option<Value> {
    let number = |v: &Value| match v {
        Value::Integer(n) => Some(*n as f64),
        Value::Float(x) => Some(*x),
        _ => None,
    };
    match (a, b) {
        (Value::Integer(x), Value::Integer(y)) => {
            let mixed = *x as f64 + share * (*y as f64 - *x as f64);
            Some(if libm::floor(mixed) == mixed { Value::Integer(mixed as i64) } else { Value::Float(mixed) })
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            x.iter().zip(y).map(|(a, b)| mixed(a, b, share)).collect::<Option<Vec<_>>>().map(Value::Array)
        }
        (Value::Table(x), Value::Table(y)) if x.len() == y.len() => {
            let each = x.iter().map(|(name, a)| Some((name.clone(), mixed(a, y.get(name)?, share)?)));
            each.collect::<Option<Table>>().map(Value::Table)
        }
        _ => match (number(a), number(b)) {
            (Some(x), Some(y)) => Some(Value::Float(x + share * (y - x))),
            _ => (a == b).then(|| a.clone()),
        },
    }
}

/// As flags write it: words as they are, everything else as TOML.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Placement, Slicing};
    use crate::volume::phantom::Phantom;

    const KEYS: &str = "
        ease = \"linear\"
        [[key]]
        time = 0
        camera.azimuth = 0
        camera.elevation = 10
        slices.count = 100
        slices.jitter = 2
        transfer.opacity = [[0, 0], [1, 0.5]]
        fog.mode = \"none\"
        [[key]]
        time = 2
        camera.azimuth = 180.0
        transfer.opacity = [[1, 0], [2, 1]]
        fog.mode = \"exp\"
        slices.count = 201
        slices.jitter = 9
        clip = [{ normal = [1, 0, 0], offset = 4 }]
        [[key]]
        time = 3
        camera.azimuth = 360
        clip = [{ normal = [1, 0, 0], offset = 8 }]
    ";

    fn set(overrides: &Overrides, path: &str) -> Option<String> {
        overrides.keys.iter().find(|(p, _)| p == path).map(|(_, text)| text.clone())
    }

    #[test]
    fn numbers_go_from_key_to_key_and_words_hold() {
        let animation = Animation::parse(KEYS, Path::new("")).expect("key frames");
        assert_eq!(animation.duration(), 3.0);
        let at = |time: f64, path: &str| set(&animation.at(time, &Overrides::default()), path).unwrap_or_default();
        let number = |time: f64, path: &str| at(time, path).parse::<f64>().expect("a number");
        assert_eq!([0.0, 0.5, 1.0, 2.0, 2.5, 3.0].map(|t| number(t, "camera.azimuth")), [0.0, 45.0, 90.0, 180.0, 270.0, 360.0]);
        assert_eq!([0.0, 1.0, 3.0].map(|t| number(t, "camera.elevation")), [10.0; 3]);
        assert_eq!([0.0, 1.9, 2.0, 3.0].map(|t| at(t, "fog.mode")), ["none", "none", "exp", "exp"]);
        assert_eq!([0.0, 0.25, 2.0].map(|t| at(t, "slices.jitter")), ["2", "2", "9"]);
        assert_eq!([0.5, 1.0, 3.0].map(|t| at(t, "slices.count")), ["125", "151", "201"]);
        assert_eq!(at(1.0, "transfer.opacity").replace(' ', ""), "[[0.5,0],[1.5,0.75]]");
        let clip: Table = toml::from_str(&format!("clip = {}", at(2.5, "clip"))).expect("a list");
        assert_eq!(clip["clip"][0]["offset"].as_float().or(clip["clip"][0]["offset"].as_integer().map(|n| n as f64)), Some(6.0));
        assert!(animation.jumps().is_empty());
        let uneven = KEYS.replace("[[1, 0], [2, 1]]", "[[1, 0], [2, 1], [3, 1]]");
        assert_eq!(Animation::parse(&uneven, Path::new("")).expect("key frames").jumps(), ["transfer.opacity"]);
        // Slow at both ends.
        let smooth = Animation::parse(&KEYS.replace("linear", "smooth"), Path::new("")).expect("key frames");
        let eased = |t: f64| set(&smooth.at(t, &Overrides::default()), "camera.azimuth").and_then(|x| x.parse::<f64>().ok());
        assert_eq!([eased(0.0), eased(1.0), eased(2.0)], [Some(0.0), Some(90.0), Some(180.0)]);
        assert!(eased(0.2) < Some(18.0 / 3.0));
    }

    #[test]
    fn scenes_come_out_of_key_frames() {
        let animation = Animation::parse(KEYS, Path::new("")).expect("key frames");
        let mut given = Overrides::default();
        given.set("volume.phantom", "marschner-lobb");
        given.set("camera.fit", "box");
        given.set("slices.count", "30");
        let volume = Phantom::MarschnerLobb.volume(8).expect("volume");
        let scene = animation.scene_at(1.0, &given).and_then(|file| file.to_scene(&volume)).expect("a scene").0;
        assert!(matches!(scene.camera().placement(), Placement::Orbit { azimuth: 90.0, elevation: 10.0, .. }));
        // What is given wins.
        assert_eq!(scene.slicing(), Slicing::Count(30));
    }

    #[test]
    fn mistakes_are_told_by_the_key_frame_that_has_them() {
        let told = |text: &str| Animation::parse(text, Path::new("")).expect_err("a mistake");
        let two = |keys: &str| format!("[[key]]\ntime = 0\n{keys}\n[[key]]\ntime = 1\n");
        assert!(told(&two("camera.azimut = 3")).contains("key[0].camera.azimut: is no key of a scene"));
        assert!(told(&two("volume.path = \"x\"")).contains("volume.path: is the same for all frames"));
        assert!(told("[[key]]\ntime = 0\n").contains("there can be 2 to"));
        assert!(told("[[key]]\ntime = 0\n[[key]]\ntime = 0\n").contains("key[1].time = 0"));
        assert!(told("[[key]]\ntime = 1\n[[key]]\ntime = 2\n").contains("key[0].time = 1"));
        assert!(told("[[key]]\n[[key]]\ntime = 2\n").contains("key[0]: needs time"));
        assert!(told("ease = \"slow\"\n").contains("ease = \"slow\""));
        assert!(told("frames = 3\n").contains("frames: unknown key"));
        assert!(told("scene = 3\n").contains("scene = 3"));
        assert!(told(&format!("scene = \"a\"\nvolume = \"b\"\n{}", two(""))).contains("volume: scene is given too"));
    }
}
