//! Every key of a scene file as a flag: `--camera.azimuth 30`.

use super::Usage;
use super::color::color;
use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use slicestack::scene::{Key, KeyKind, Overrides, keys};

const HEADING: &str =
    "Keys of the scene (each overrides the scene file; `slicestack schema` tells more, `slicestack help opengl` lists those of OpenGL)";

/// Keys that have shorter flags beside them, in the help's place.
const SHORTER: [&str; 8] = [
    "transfer.preset",
    "image.width",
    "image.height",
    "image.background",
    "slices.count",
    "camera.azimuth",
    "camera.elevation",
    "camera.zoom",
];

/// Keys that are lists of tables, or belong to one, and are better written in a scene file: flags all the same.
const TABLES: [&str; 3] = ["lights", "render.levels", "volume.path"];

/// Letters that a line of help has for what a key is for.
const LINE: usize = 110;

/// Most words of a key that its line of help lists.
const WORDS: usize = 8;

const CLIP: &str = "NX,NY,NZ[,OFFSET]";
const MATRIX: &str = "opengl.texture_matrix";

/// Scene keys given as flags.
#[derive(Debug, Clone, Default)]
pub(super) struct SceneFlags(Vec<(&'static str, Vec<String>)>);

/// Only the keys of the section `volume`.
#[derive(Debug, Clone, Default)]
pub(super) struct VolumeFlags(SceneFlags);

impl SceneFlags {
    /// Lays the flags over what `overrides` holds already.
    ///
    /// # Errors
    /// [`Usage`] for a plane that is none.
    pub(super) fn apply(&self, overrides: &mut Overrides) -> Result<(), Usage> {
        for (path, values) in &self.0 {
            match values.as_slice() {
                _ if *path == "clip" => overrides.set(*path, plane_list(path, values, "; kept is where normal . p >= offset")?),
                _ if *path == "cut" => overrides.set(*path, plane_list(path, values, "")?),
                [.., last] if is_color(path) => overrides.set(*path, color_list(path, last)?),
                [.., last] if *path == MATRIX => overrides.set(*path, matrix_rows(last)),
                [.., last] => overrides.set(*path, last),
                [] => {}
            }
        }
        Ok(())
    }

    /// Whether a flag of this key was given.
    pub(super) fn has(&self, path: &str) -> bool {
        self.0.iter().any(|f| f.0 == path)
    }
}

impl VolumeFlags {
    /// Whether one was given.
    pub(super) fn any(&self) -> bool {
        !self.0.0.is_empty()
    }

    pub(super) fn apply(&self, overrides: &mut Overrides) -> Result<(), Usage> {
        self.0.apply(overrides)
    }
}

/// `nx,ny,nz,offset`, as often as wanted, as the list of tables that a scene file has; other text is taken as that list itself.
fn plane_list(flag: &str, values: &[String], means: &str) -> Result<String, Usage> {
    let plane = |text: &String| {
        if text.contains('{') {
            return Ok(text.trim().trim_start_matches('[').trim_end_matches(']').to_owned());
        }
        let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        match numbers.as_deref() {
            Some([x, y, z]) => Ok(format!("{{ normal = [{x:?}, {y:?}, {z:?}] }}")),
            Some([x, y, z, offset]) => Ok(format!("{{ normal = [{x:?}, {y:?}, {z:?}], offset = {offset:?} }}")),
            _ => Err(Usage(format!("--{flag} {text}: write the plane's normal and where it lies, {CLIP}{means}"))),
        }
    };
    let planes: Vec<String> = values.iter().map(plane).collect::<Result<_, _>>()?;
    Ok(format!("[{}]", planes.join(", ")))
}

/// Whether the key is a single colour.
fn is_color(path: &str) -> bool {
    matches!(path, "image.background" | "fog.color" | "light.color")
}

/// A colour as the list that a scene file has: a name of CSS, #rgb, #rrggbb, or numbers from 0 to 1.
pub(super) fn color_list(flag: &str, text: &str) -> Result<String, Usage> {
    if text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '[' | '-' | '.' | '+')) {
        return Ok(text.to_owned());
    }
    let Some([r, g, b, a]) = color(text) else {
        return Err(Usage(format!(
            "--{flag} {text}: write a colour's name, #rgb, #rrggbb, or numbers from 0 to 1 with commas between them"
        )));
    };
    Ok(if flag.ends_with("background") { format!("{r},{g},{b},{a}") } else { format!("{r},{g},{b}") })
}

/// Sixteen numbers, row by row, as the four rows that a scene file has; other text is taken as those rows themselves.
fn matrix_rows(text: &str) -> String {
    let numbers: Vec<&str> = text.split(',').collect();
    if numbers.len() != 16 || text.contains('[') {
        return text.to_owned();
    }
    let rows: Vec<String> = numbers.chunks(4).map(|row| format!("[{}]", row.join(","))).collect();
    format!("[{}]", rows.join(","))
}

fn augment(command: Command, wanted: fn(&Key) -> bool) -> Command {
    keys().iter().filter(|k| wanted(k)).fold(command, |command, key| {
        let arg = Arg::new(key.path.as_str()).long(key.path.as_str()).help(in_a_line(key)).help_heading(HEADING);
        let arg = arg.hide_possible_values(true).hide(is_hidden(key));
        // Numbers may be negative.
        let arg = arg.allow_hyphen_values(true).action(ArgAction::Append);
        command.arg(match &key.kind {
            KeyKind::Text(words) if words.is_empty() => arg.value_name("TEXT"),
            KeyKind::Text(words) => arg.value_name("WORD").value_parser(PossibleValuesParser::new(words.iter().map(String::as_str))),
            // The flag alone says true.
            KeyKind::Truth => arg.value_name("true|false").allow_hyphen_values(false).num_args(0..=1).default_missing_value("true"),
            KeyKind::List if matches!(key.path.as_str(), "clip" | "cut") => arg.value_name(CLIP),
            KeyKind::List if key.path == MATRIX => arg.value_name("16 NUMBERS"),
            KeyKind::List => arg.value_name("A,B,..."),
            _ => arg.value_name("VALUE"),
        })
    })
}

fn collect(matches: &ArgMatches, wanted: fn(&Key) -> bool) -> SceneFlags {
    let given = keys().iter().filter(|k| wanted(k)).filter_map(|key| {
        let values = matches.get_many::<String>(&key.path)?;
        Some((key.path.as_str(), values.cloned().collect()))
    });
    SceneFlags(given.collect())
}

/// What a key is for, as far as it goes into a line, and the words that it takes.
fn in_a_line(key: &Key) -> String {
    let first = key.about.split_inclusive(". ").next().unwrap_or(&key.about).trim_end_matches([' ', '.']);
    // A line that is too long ends where a part of it does.
    let first = match first.char_indices().nth(LINE) {
        Some((end, _)) => first[..end].rfind([';', ':', ',']).map_or(first, |at| &first[..at]),
        None => first,
    };
    match &key.kind {
        KeyKind::Text(words) if !words.is_empty() && words.len() <= WORDS => format!("{first} [{}]", words.join(", ")),
        _ => first.to_owned(),
    }
}

/// Whether the key has its line elsewhere.
fn is_hidden(key: &Key) -> bool {
    let path = key.path.as_str();
    of_opengl(key) || path.starts_with("transfer2d.") || SHORTER.contains(&path) || TABLES.contains(&path)
}

/// The keys of the profile opengl, one a line.
pub(super) fn opengl_keys() -> String {
    let mut text = String::from("Keys of the profile opengl (render.profile = \"opengl\"), each a flag of the same name:\n");
    for key in keys().iter().filter(|k| of_opengl(k)) {
        text += &format!("  --{:32}{}\n", key.path, in_a_line(key));
    }
    text
}

fn of_opengl(key: &Key) -> bool {
    key.path.starts_with("opengl.")
}

fn any(_: &Key) -> bool {
    true
}

fn of_volume(key: &Key) -> bool {
    key.path.starts_with("volume.")
}

impl Args for SceneFlags {
    fn augment_args(command: Command) -> Command {
        augment(command, any)
    }

    fn augment_args_for_update(command: Command) -> Command {
        augment(command, any)
    }
}

impl FromArgMatches for SceneFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(collect(matches, any))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0.extend(collect(matches, any).0);
        Ok(())
    }
}

impl Args for VolumeFlags {
    fn augment_args(command: Command) -> Command {
        augment(command, of_volume)
    }

    fn augment_args_for_update(command: Command) -> Command {
        augment(command, of_volume)
    }
}

impl FromArgMatches for VolumeFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(collect(matches, of_volume)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0.update_from_arg_matches(matches)
    }
}
