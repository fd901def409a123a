//! From text to a checked table: TOML or JSON, overrides laid over it, and where each key came from.

use super::schema::{Key, KeyKind, keys};
use super::{Document, Overrides, rivals};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Where a key was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// On this line of the file, counted from 1.
    Line(usize),
    /// On the command line.
    Flag,
}

/// Where every key was written, for messages.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    file: Option<PathBuf>,
    keys: BTreeMap<String, Place>,
}

impl Places {
    /// Where `path` (`section.key`, perhaps with indices) was written.
    pub(super) fn of(&self, path: &str) -> Option<Place> {
        self.find(path).map(|f| f.1)
    }

    /// The first key of `section` that was written somewhere.
    pub(super) fn first_in(&self, section: &str) -> Option<&str> {
        let inside = |k: &&String| k.strip_prefix(section).is_some_and(|rest| rest.starts_with('.'));
        self.keys.keys().find(inside).map(String::as_str)
    }

    /// The longest part of `path` that was written somewhere, and where.
    fn find<'p>(&self, path: &'p str) -> Option<(&'p str, Place)> {
        let mut path = path;
        loop {
            if let Some(&place) = self.keys.get(path) {
                return Some((path, place));
            }
            path = &path[..path.rfind(['[', '.'])?];
        }
    }

    /// The error `what` about the key `path`, with its place in front.
    pub(super) fn error(&self, path: &str, what: &str) -> Error {
        match self.of(path) {
            Some(Place::Flag) => Error::invalid(format!("--{path}: {what}")),
            _ => self.placed(path, &format!("{path}: {what}")),
        }
    }

    /// Puts the place in front of an [`Error::Invalid`] whose text begins with a section and a key, as those of the scene's
    /// types do; other errors, and those that name a flag, stay as they are.
    pub(super) fn locate(&self, error: Error) -> Error {
        let Error::Invalid(text) = &error else { return error };
        if text.starts_with("--") {
            return error;
        }
        let mut words = text.split(|c: char| c.is_whitespace() || c == ':').filter(|w| !w.is_empty());
        let path = format!("{}.{}", words.next().unwrap_or_default(), words.next().unwrap_or_default());
        // A flag is named in its own spelling alone.
        match (self.keys.get(&path), text.strip_prefix(&path.replacen('.', " ", 1))) {
            (Some(Place::Flag), Some(rest)) => Error::invalid(format!("--{path}{rest}")),
            _ => self.placed(&path, text),
        }
    }

    fn placed(&self, path: &str, text: &str) -> Error {
        let text = match self.find(path) {
            Some((flag, Place::Flag)) => return Error::invalid(format!("--{flag}: {text}")),
            Some((_, Place::Line(n))) => format!("line {n}: {text}"),
            None => text.to_owned(),
        };
        match &self.file {
            Some(file) => Error::format(file, text),
            None => Error::invalid(text),
        }
    }
}

/// Parses `text`, lays `overrides` over it and checks every key.
pub(super) fn document(text: &str, file: Option<&Path>, overrides: &Overrides) -> Result<(Document, Places)> {
    let mut places = Places { file: file.map(Path::to_path_buf), keys: BTreeMap::new() };
    let json = text.trim_start().starts_with('{');
    let mut table = if json { from_json(text, &mut places)? } else { from_toml(text, &mut places)? };
    let known = keys();
    check_keys(&table, known, &places)?;
    lay_over(&mut table, overrides, known, &mut places)?;
    let document = serde_path_to_error::deserialize(Value::Table(table)).map_err(|e| {
        let (path, what) = (e.path().to_string(), e.into_inner());
        places.error(&path, &in_words(what.message().trim()))
    })?;
    Ok((document, places))
}

/// A message of serde's with its names of types in words.
fn in_words(what: &str) -> String {
    let Some((given, expected)) = what.rsplit_once(", expected ") else { return what.to_owned() };
    let expected = match expected {
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "usize" => "a whole number, 0 or more",
        "i32" | "i64" => "a whole number",
        "f32" | "f64" => "a number",
        other => other,
    };
    format!("{given}, expected {expected}")
}

fn syntax(places: &Places, line: usize, what: &str) -> Error {
    let what = format!("line {line}: {}", what.lines().collect::<Vec<_>>().join("; "));
    match &places.file {
        Some(file) => Error::format(file, what),
        None => Error::invalid(what),
    }
}

fn line_of(text: &str, at: usize) -> usize {
    1 + text.as_bytes().iter().take(at).filter(|&&b| b == b'\n').count()
}

fn from_toml(text: &str, places: &mut Places) -> Result<Table> {
    let fail = |places: &Places, e: &toml::de::Error| syntax(places, line_of(text, e.span().map_or(0, |s| s.start)), e.message());
    let spans = DeTable::parse(text).map_err(|e| fail(places, &e))?;
    note_lines(spans.get_ref(), "", &Lines::of(text), &mut places.keys);
    toml::from_str(text).map_err(|e| fail(places, &e))
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self([0].into_iter().chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }

    /// The line of byte `at`, counted from 1.
    fn at(&self, at: usize) -> usize {
        self.0.partition_point(|&start| start <= at)
    }
}

fn note_lines(table: &DeTable<'_>, prefix: &str, lines: &Lines, keys: &mut BTreeMap<String, Place>) {
    for (name, value) in table {
        let path = format!("{prefix}{}", name.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => note_lines(inner, &format!("{path}."), lines, keys),
            DeValue::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    if let DeValue::Table(inner) = item.get_ref() {
                        note_lines(inner, &format!("{path}[{i}]."), lines, keys);
                    }
                }
            }
            _ => {}
        }
        keys.insert(path, Place::Line(lines.at(name.span().start)));
    }
}

fn from_json(text: &str, places: &mut Places) -> Result<Table> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| {
        let what = e.to_string();
        let what = what.split(" at line ").next().unwrap_or_default();
        syntax(places, e.line(), what)
    })?;
    if !value.is_object() {
        return Err(syntax(places, 1, "a scene in JSON is one object"));
    }
    note_json_lines(text, &mut places.keys);
    match json_to_toml(&value, "", places)? {
        Some(Value::Table(table)) => Ok(table),
        _ => Err(syntax(places, 1, "a scene in JSON is one object")),
    }
}

/// Where the sections of the JSON object `text` and their keys stand: serde_json keeps no positions.
fn note_json_lines(text: &str, keys: &mut BTreeMap<String, Place>) {
    let bytes = text.as_bytes();
    let (mut at, mut line, mut depth, mut section) = (0, 1, 0_usize, String::new());
    while let Some(&byte) = bytes.get(at) {
        let start = at;
        at += 1;
        match byte {
            b'\n' => line += 1,
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            b'"' => {
                while bytes.get(at).is_some_and(|&b| b != b'"') {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
                let is_key = depth <= 2 && text.get(at..).is_some_and(|rest| rest.trim_start().starts_with(':'));
                if let Some(Ok(name)) = text.get(start..at).filter(|_| is_key).map(serde_json::from_str::<String>) {
                    let path = if depth == 1 { name.clone() } else { format!("{section}.{name}") };
                    keys.insert(path, Place::Line(line));
                    if depth == 1 {
                        section = name;
                    }
                }
            }
            _ => {}
        }
    }
}

/// `null` is a key that is not there.
fn json_to_toml(value: &serde_json::Value, path: &str, places: &Places) -> Result<Option<Value>> {
    Ok(Some(match value {
        serde_json::Value::Null => return Ok(None),
        serde_json::Value::Bool(b) => Value::Boolean(*b),
        serde_json::Value::String(s) => Value::String(s.clone()),
        serde_json::Value::Number(n) => match (n.as_i64(), n.as_f64()) {
            (Some(i), _) => Value::Integer(i),
            (None, Some(f)) => Value::Float(f),
            (None, None) => return Err(places.error(path, &format!("{n} is out of range"))),
        },
        serde_json::Value::Array(items) => {
            let mut out = Vec::new();
            for (i, item) in items.iter().enumerate() {
                let path = format!("{path}[{i}]");
                out.push(json_to_toml(item, &path, places)?.ok_or_else(|| places.error(&path, "null in a list"))?);
            }
            Value::Array(out)
        }
        serde_json::Value::Object(map) => {
            let mut out = Table::new();
            for (name, item) in map {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                if let Some(item) = json_to_toml(item, &path, places)? {
                    out.insert(name.clone(), item);
                }
            }
            Value::Table(out)
        }
    }))
}

fn check_keys(table: &Table, known: &[Key], places: &Places) -> Result<()> {
    let sections: Vec<&str> = known.iter().map(|k| k.path.split('.').next().unwrap_or_default()).collect();
    let paths: Vec<&str> = known.iter().map(|k| k.path.as_str()).collect();
    for (section, value) in table {
        if !sections.contains(&section.as_str()) {
            let misplaced = paths.iter().find(|p| p.split_once('.').is_some_and(|(_, k)| k == section));
            let best = misplaced.copied().or_else(|| nearest(section, &sections)).unwrap_or_default();
            return Err(unknown(places, section, best));
        }
        let Value::Table(inner) = value else { continue };
        for name in inner.keys() {
            let path = format!("{section}.{name}");
            if !paths.contains(&path.as_str()) && !paths.contains(&section.as_str()) {
                let misplaced = paths.iter().find(|p| p.split_once('.').is_some_and(|(_, k)| k == name));
                let own: Vec<&str> = paths.iter().filter(|p| p.starts_with(&format!("{section}."))).copied().collect();
                let best = misplaced.copied().or_else(|| nearest(&path, &own)).unwrap_or_default();
                return Err(unknown(places, &path, best));
            }
        }
    }
    Ok(())
}

fn unknown(places: &Places, path: &str, best: &str) -> Error {
    places.error(path, &format!("unknown key; the nearest known one is {best}"))
}

/// The word most like `word`; the first of equals.
pub(super) fn nearest<'a>(word: &str, words: &[&'a str]) -> Option<&'a str> {
    words.iter().copied().min_by_key(|w| strsim::damerau_levenshtein(word, w))
}

fn lay_over(table: &mut Table, overrides: &Overrides, known: &[Key], places: &mut Places) -> Result<()> {
    for (path, text) in &overrides.keys {
        let Some(key) = known.iter().find(|k| k.path == *path) else {
            let paths: Vec<&str> = known.iter().map(|k| k.path.as_str()).collect();
            let best = nearest(path, &paths).unwrap_or_default();
            return Err(Error::invalid(format!("--{path}: unknown key; the nearest known one is {best}")));
        };
        places.keys.insert(path.clone(), Place::Flag);
        let value = value(text, &key.kind).map_err(|what| places.error(path, &what))?;
        match path.split_once('.') {
            None => {
                table.insert(path.clone(), value);
            }
            Some((section, name)) => {
                let inner = table.entry(section).or_insert_with(|| Value::Table(Table::new()));
                if let Value::Table(inner) = inner {
                    inner.insert(name.to_owned(), value);
                }
            }
        }
    }
    for (winners, losers) in rivals() {
        if !winners.iter().any(|w| places.of(w) == Some(Place::Flag)) {
            continue;
        }
        for loser in *losers {
            if places.of(loser) == Some(Place::Flag) {
                continue;
            }
            if let Some((section, name)) = loser.split_once('.') {
                if let Some(Value::Table(inner)) = table.get_mut(section) {
                    inner.remove(name);
                }
                places.keys.remove(*loser);
            }
        }
    }
    Ok(())
}

/// The value of a flag: text stays as it is, a list may do without its outer brackets.
fn value(text: &str, kind: &KeyKind) -> Result<Value, String> {
    match kind {
        KeyKind::Text(_) => Ok(Value::String(text.to_owned())),
        KeyKind::Scalar | KeyKind::Whole | KeyKind::Truth => {
            number(text).or_else(|| inline(text)).ok_or_else(|| format!("cannot read {:?}", text.trim()))
        }
        KeyKind::List => {
            let numbers: Option<Vec<Value>> = text.trim().trim_start_matches('[').trim_end_matches(']').split(',').map(number).collect();
            let list = match inline(text) {
                Some(list @ Value::Array(_)) => Some(list),
                // [a, b], [c, d]: a list without its brackets.
                _ => inline(&format!("[{text}]")),
            };
            list.or(numbers.map(Value::Array)).ok_or_else(|| format!("cannot read the list {:?}; write 1,2,3", text.trim()))
        }
    }
}

/// A number as people type it: TOML wants 0.5 where they write .5.
fn number(text: &str) -> Option<Value> {
    let text = text.trim();
    text.parse().map(Value::Integer).or_else(|_| text.parse().map(Value::Float)).ok()
}

fn inline(text: &str) -> Option<Value> {
    let mut table: Table = toml::from_str(&format!("x = {text}")).ok()?;
    // A line break in the text could carry further keys.
    table.remove("x").filter(|_| table.is_empty())
}
