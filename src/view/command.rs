//! The command line of a picture: the one that started the view, with a flag for each key of the sections that differ since.
//!
//! ```text
//!  arguments of `view` --sections that are as they were--> kept
//!  sections that differ --> --section.key=value            then read again as the command would: does the same scene come of it?
//! ```

use super::document::{Asked, Document, MAP, Opened};
use crate::Result;
use crate::scene::{Annotations, KeyKind, ResolvedScene, SceneFile, keys};
use serde_json::{Value, json};

/// Flags without a value.
const BARE: [&str; 1] = ["no-mmap"];
/// Short flags, and the sections of the keys that they stand for.
const SHORT: [(&str, &str); 7] = [
    ("preset", "transfer"),
    ("size", "image"),
    ("count", "slices"),
    ("azimuth", "camera"),
    ("elevation", "camera"),
    ("zoom", "camera"),
    ("background", "image"),
];
/// What is told where a command line alone does not make the picture.
const SAVE: &str = "Flags cannot say all of this scene: save the scene, and render that file.";

/// Reads arguments as `slicestack render` does.
pub(super) type Reader = dyn Fn(&[String]) -> Result<SceneFile> + Send + Sync;

/// How the view was started.
pub(super) struct Start {
    /// Scene or volume, and flags of the scene.
    pub(super) arguments: Vec<String>,
    pub(super) read: Box<Reader>,
}

/// A flag with its values, or the scene or volume that is named.
#[derive(Debug, PartialEq)]
struct Group {
    /// Of the scene; `None` for what belongs to none, such as the input.
    section: Option<String>,
    words: Vec<String>,
}

/// The command line that makes the picture of `asked`.
///
/// # Errors
/// As [`Opened::write`].
pub(super) fn answer(opened: &Opened, start: Option<&Start>, asked: &Asked) -> Result<Value> {
    let (width, height) = asked.scene.size();
    let Some(start) = start else {
        let command = format!("slicestack render SCENE.toml --size {width}x{height} -o picture.png");
        return Ok(json!({ "command": command, "complete": false, "note": SAVE }));
    };
    let before = opened.write(&opened.scene, &opened.annotations)?;
    let after = opened.write(&asked.scene, &asked.annotations)?;
    let changed = |section: &str| before.get(section) != after.get(section);
    let with = |changed: &dyn Fn(&str) -> bool| {
        let kept = groups(&start.arguments).into_iter().filter(|g| !g.section.as_deref().is_some_and(changed));
        let mut arguments: Vec<String> = kept.flat_map(|g| g.words).collect();
        arguments.extend(flags(&after, changed));
        let read = (start.read)(&arguments).and_then(|file| Ok((file.resolve(&opened.volume)?, file.annotations())));
        let same = |(found, annotations): (ResolvedScene, Annotations)| found.scene == asked.scene && annotations == asked.annotations;
        (arguments, read.is_ok_and(same))
    };
    let mut found = with(&changed);
    // What a section leaves open may have been decided by another: a camera that fits what shows, by the transfer function.
    if !found.1 {
        let all = with(&|_| true);
        found = if all.1 { all } else { found };
    }
    let (arguments, complete) = found;
    let words: Vec<String> =
        ["slicestack", "render"].into_iter().map(str::to_owned).chain(arguments.iter().map(|word| quoted(word))).collect();
    Ok(json!({ "command": words.join(" "), "complete": complete, "note": (!complete).then_some(SAVE) }))
}

/// `arguments` flag by flag.
fn groups(arguments: &[String]) -> Vec<Group> {
    let truths: Vec<&str> = keys().iter().filter(|key| key.kind == KeyKind::Truth).map(|key| key.path.as_str()).collect();
    let mut groups: Vec<Group> = Vec::new();
    let mut words = arguments.iter().peekable();
    while let Some(word) = words.next() {
        let Some(flag) = word.strip_prefix("--").filter(|flag| !flag.is_empty()) else {
            groups.push(Group { section: None, words: vec![word.clone()] });
            continue;
        };
        let name = flag.split('=').next().unwrap_or_default();
        let mut group = Group { section: section_of(name), words: vec![word.clone()] };
        let takes = !flag.contains('=') && !BARE.contains(&name);
        // The value of what is true or false may be left out.
        let value = words.next_if(|next| takes && !(truths.contains(&name) && next.starts_with('-')));
        group.words.extend(value.cloned());
        groups.push(group);
    }
    groups
}

/// The section that a flag belongs to; none for one that says where the data is, which the page does not change.
fn section_of(flag: &str) -> Option<String> {
    let map = flag.strip_prefix("labels.").is_some_and(|key| MAP.contains(&key));
    if BARE.contains(&flag) || map || flag.starts_with("volume.") {
        return None;
    }
    let short = SHORT.iter().find(|(short, _)| *short == flag).map(|(_, section)| *section);
    let section = short.unwrap_or_else(|| flag.split('.').next().unwrap_or_default());
    Some(if section == "lights" { "light" } else { section }.to_owned())
}

/// A flag for each key of the sections of `document` that have `changed`.
fn flags(document: &Document, changed: &dyn Fn(&str) -> bool) -> Vec<String> {
    let mut flags = Vec::new();
    for (section, value) in document.iter().filter(|(section, _)| changed(section)) {
        let Value::Object(inner) = value else {
            flags.extend(list_flags(section, value));
            continue;
        };
        if let (Some(width), Some(height), "image") = (inner.get("width"), inner.get("height"), section.as_str()) {
            flags.push(format!("--size={width}x{height}"));
        }
        let inner = inner.iter().filter(|(key, _)| !(section == "image" && matches!(key.as_str(), "width" | "height")));
        flags.extend(inner.map(|(key, value)| format!("--{section}.{key}={}", text(value))));
    }
    flags
}

/// Flags for a list of tables: one for each plane, where the list is of planes, else one for the whole list.
fn list_flags(section: &str, list: &Value) -> Vec<String> {
    let planes = list.as_array().filter(|_| section == "clip").and_then(|planes| planes.iter().map(plane).collect::<Option<Vec<_>>>());
    match planes {
        Some(planes) => planes.iter().map(|plane| format!("--{section}={plane}")).collect(),
        None => vec![format!("--{section}={}", inline(list))],
    }
}

/// `NX,NY,NZ,OFFSET`.
fn plane(table: &Value) -> Option<String> {
    let table = table.as_object().filter(|table| table.keys().all(|key| matches!(key.as_str(), "normal" | "offset")))?;
    let numbers = table.get("normal")?.as_array()?.iter().chain([table.get("offset").unwrap_or(&Value::Null)]);
    Some(numbers.filter(|n| n.is_number()).map(ToString::to_string).collect::<Vec<_>>().join(","))
}

/// A value as a flag has it: text as it is, a list of numbers without brackets.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) if !items.is_empty() && items.iter().all(Value::is_number) => {
            items.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
        }
        other => inline(other),
    }
}

/// A value as TOML has it within a line.
fn inline(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", ")),
        Value::Object(table) => {
            let keys: Vec<String> = table.iter().map(|(key, value)| format!("{key} = {}", inline(value))).collect();
            format!("{{ {} }}", keys.join(", "))
        }
        other => other.to_string(),
    }
}

/// A word as a shell takes it for one.
fn quoted(word: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"_@%+=:,./-".contains(&b);
    if !word.is_empty() && word.bytes().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_taken_apart_as_the_command_reads_them() {
        let words = [
            "--camera.azimuth",
            "-38",
            "head.nrrd",
            "--no-mmap",
            "--annotate.axes",
            "--size=8x8",
            "--clip",
            "1,0,0,-2",
            "--annotate.box",
            "true",
        ];
        let found = groups(&words.map(str::to_owned));
        let told: Vec<(Option<&str>, usize)> = found.iter().map(|g| (g.section.as_deref(), g.words.len())).collect();
        let camera = Some("camera");
        let annotate = Some("annotate");
        assert_eq!(told, [(camera, 2), (None, 1), (None, 1), (annotate, 1), (Some("image"), 1), (Some("clip"), 2), (annotate, 2)]);
    }

    #[test]
    fn words_are_quoted_where_a_shell_would_part_them() {
        assert_eq!(quoted("--camera.eye=1,2,3"), "--camera.eye=1,2,3");
        assert_eq!(quoted("it's a head.nrrd"), "'it'\\''s a head.nrrd'");
    }
}
