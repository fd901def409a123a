//! The JSON schema of scene files, and the list of keys read off it.

use super::Document;
use schemars::generate::SchemaSettings;
use schemars::{Schema, json_schema};
use serde_json::Value;
use std::sync::OnceLock;

/// What a key takes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum KeyKind {
    /// Text; where the list is not empty, one of these words.
    Text(Vec<String>),
    /// A number.
    Scalar,
    /// A whole number.
    Whole,
    /// True or false.
    Truth,
    /// A list of numbers, or of lists or tables of them.
    List,
}

/// A key that a scene file may have.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Key {
    /// `section.key`, or the section alone for a list of tables (`clip`).
    pub path: String,
    /// What it means, one line.
    pub about: String,
    /// What it takes.
    pub kind: KeyKind,
}

/// The JSON schema (draft 2020-12) of scene files, as a document for editors and validators.
pub fn schema() -> Value {
    let mut generator = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true).into_generator();
    let mut value = generator.root_schema_for::<Document>().to_value();
    if let Some(map) = value.as_object_mut() {
        map.insert("title".into(), "slicestack scene".into());
    }
    drop_defaults(&mut value);
    value
}

/// The defaults that the derive finds are those of optional fields: "null", which tells nobody anything.
fn drop_defaults(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.remove("default");
            map.values_mut().for_each(drop_defaults);
        }
        Value::Array(items) => items.iter_mut().for_each(drop_defaults),
        _ => {}
    }
}

/// Every key of a scene file, sections in their order in [`schema`].
pub fn keys() -> &'static [Key] {
    static KEYS: OnceLock<Vec<Key>> = OnceLock::new();
    KEYS.get_or_init(|| keys_of(&schema()))
}

fn keys_of(schema: &Value) -> Vec<Key> {
    let mut keys = Vec::new();
    for (section, about) in properties(schema) {
        let mut inner = properties(about).peekable();
        if inner.peek().is_none() {
            keys.push(key(section.clone(), about));
        }
        keys.extend(inner.map(|(name, about)| key(format!("{section}.{name}"), about)));
    }
    keys
}

fn properties(schema: &Value) -> impl Iterator<Item = (&String, &Value)> {
    schema.get("properties").and_then(Value::as_object).into_iter().flatten()
}

fn key(path: String, schema: &Value) -> Key {
    let about = schema.get("description").and_then(Value::as_str).unwrap_or_default().replace('\n', " ");
    Key { path, about, kind: kind(schema) }
}

/// An optional key is `type: [x, null]` or `anyOf: [x, null]`.
fn kind(schema: &Value) -> KeyKind {
    if let Some(any) = schema.get("anyOf").and_then(Value::as_array) {
        return any.first().map_or(KeyKind::Scalar, kind);
    }
    let first = |v: &Value| v.as_array().map_or_else(|| v.clone(), |a| a.first().cloned().unwrap_or_default());
    match schema.get("type").map(first).as_ref().and_then(Value::as_str) {
        Some("string") => {
            let words = schema.get("enum").and_then(Value::as_array).into_iter().flatten();
            KeyKind::Text(words.filter_map(|w| w.as_str().map(str::to_owned)).collect())
        }
        Some("array") => KeyKind::List,
        Some("boolean") => KeyKind::Truth,
        Some("integer") => KeyKind::Whole,
        _ => KeyKind::Scalar,
    }
}

/// The schema of an optional key that takes one of `names`.
pub(super) fn names(names: impl Iterator<Item = &'static str>) -> Schema {
    let words: Vec<Value> = names.map(Value::from).chain([Value::Null]).collect();
    json_schema!({ "type": ["string", "null"], "enum": words })
}
