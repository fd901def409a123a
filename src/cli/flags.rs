//! Every key of a scene file as a flag: `--camera.azimuth 30`.

use super::Usage;
use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use slicestack::scene::{Key, KeyKind, Overrides, keys};

const HEADING: &str = "Keys of the scene (each overrides the scene file)";

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
    /// [`Usage`] for a clip plane that is none.
    pub(super) fn apply(&self, overrides: &mut Overrides) -> Result<(), Usage> {
        for (path, values) in &self.0 {
            match values.as_slice() {
                _ if *path == "clip" => overrides.set(*path, clip_list(values)?),
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
fn clip_list(values: &[String]) -> Result<String, Usage> {
    let plane = |text: &String| {
        if text.contains('{') {
            return Ok(text.trim().trim_start_matches('[').trim_end_matches(']').to_owned());
        }
        let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        match numbers.as_deref() {
            Some([x, y, z]) => Ok(format!("{{ normal = [{x:?}, {y:?}, {z:?}] }}")),
            Some([x, y, z, offset]) => Ok(format!("{{ normal = [{x:?}, {y:?}, {z:?}], offset = {offset:?} }}")),
            _ => {
                Err(Usage(format!("--clip {text}: write the plane's normal and where it lies, {CLIP}; kept is where normal . p >= offset")))
            }
        }
    };
    let planes: Vec<String> = values.iter().map(plane).collect::<Result<_, _>>()?;
    Ok(format!("[{}]", planes.join(", ")))
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
        let arg = Arg::new(key.path.as_str()).long(key.path.as_str()).help(key.about.as_str()).help_heading(HEADING);
        // `-h` stays short; `--help` shows them all. Numbers may be negative.
        let arg = arg.hide_short_help(true).allow_hyphen_values(true).action(ArgAction::Append);
        command.arg(match &key.kind {
            KeyKind::Text(words) if words.is_empty() => arg.value_name("TEXT"),
            KeyKind::Text(words) => arg.value_name("WORD").value_parser(PossibleValuesParser::new(words.iter().map(String::as_str))),
            // The flag alone says true.
            KeyKind::Truth => arg.value_name("true|false").allow_hyphen_values(false).num_args(0..=1).default_missing_value("true"),
            KeyKind::List if key.path == "clip" => arg.value_name(CLIP),
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
