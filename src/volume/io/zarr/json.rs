//! Metadata as JSON, with errors that name the file, the key and the value at fault.

use crate::volume::io::field::shown;
use crate::volume::io::source::Source;
use crate::{Error, Result};
use serde_json::Value;
use std::path::Path;

/// Reads all of a metadata file.
///
/// # Errors
/// When it is over the limit of a header, or no JSON.
pub(super) fn parse(mut source: Source) -> Result<Value> {
    let length = usize::try_from(source.left()).unwrap_or(usize::MAX);
    let bytes = source.header(length, "the metadata")?;
    serde_json::from_slice(&bytes).or_else(|e| {
        // Python writes numbers that are none as bare words, which JSON does not know.
        let spelled = without_bare_words(&bytes);
        serde_json::from_slice(&spelled).map_err(|_| source.fault(format!("no JSON: {e}")))
    })
}

/// The same text with `NaN` and `Infinity` outside of strings turned into `null`.
fn without_bare_words(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let (mut at, mut quoted) = (0, false);
    while let Some(&byte) = text.get(at) {
        let rest = &text[at..];
        let word = [&b"NaN"[..], b"-Infinity", b"Infinity"].into_iter().find(|word| !quoted && rest.starts_with(word));
        let taken = match (word, byte) {
            (Some(word), _) => {
                out.extend_from_slice(b"null");
                at += word.len();
                continue;
            }
            (None, b'\\') if quoted => rest.len().min(2),
            _ => 1,
        };
        quoted ^= byte == b'"';
        out.extend_from_slice(&rest[..taken]);
        at += taken;
    }
    out
}

/// One value of a metadata file, and where it stands.
#[derive(Clone)]
pub(super) struct Json<'a> {
    path: &'a Path,
    key: String,
    value: &'a Value,
}

impl<'a> Json<'a> {
    /// All of the file `path`.
    pub(super) fn new(path: &'a Path, value: &'a Value) -> Self {
        Self { path, key: String::new(), value }
    }

    /// The value itself.
    pub(super) fn value(&self) -> &'a Value {
        self.value
    }

    /// An error about this value.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> Error {
        let key = if self.key.is_empty() { "the metadata" } else { &self.key };
        let value = match self.value {
            Value::String(text) => shown(text),
            // JSON that is written anew has no line ends.
            other => {
                let all = other.to_string();
                let start: String = all.chars().take(60).collect();
                if start.len() < all.len() { start + "..." } else { all }
            }
        };
        Error::format(self.path, format!("{key} is {value}: {what}"))
    }

    fn inner(&self, key: &str) -> String {
        if self.key.is_empty() { key.to_owned() } else { format!("{}.{key}", self.key) }
    }

    /// What stands at `key`; `null` counts as nothing.
    pub(super) fn get(&self, key: &str) -> Option<Json<'a>> {
        let value = self.value.get(key).filter(|v| !v.is_null())?;
        Some(Json { path: self.path, key: self.inner(key), value })
    }

    /// What must stand at `key`.
    pub(super) fn need(&self, key: &str) -> Result<Json<'a>> {
        self.get(key).ok_or_else(|| Error::format(self.path, format!("{} is missing", self.inner(key))))
    }

    /// The values of a list.
    pub(super) fn list(&self) -> Result<Vec<Json<'a>>> {
        let values = self.value.as_array().ok_or_else(|| self.fault("not a list"))?;
        let inner = |(i, value)| Json { path: self.path, key: format!("{}[{i}]", self.key), value };
        Ok(values.iter().enumerate().map(inner).collect())
    }

    pub(super) fn text(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.fault("not a text"))
    }

    /// A finite number.
    pub(super) fn number(&self) -> Result<f64> {
        self.value.as_f64().filter(|v| v.is_finite()).ok_or_else(|| self.fault("not a finite number"))
    }

    /// A list of `count` finite numbers.
    pub(super) fn numbers(&self, count: usize) -> Result<Vec<f64>> {
        let list = self.list()?;
        if list.len() != count {
            return Err(self.fault(format!("{} numbers, {count} are needed", list.len())));
        }
        list.iter().map(Json::number).collect()
    }

    /// A whole number of 0 or more.
    pub(super) fn count(&self) -> Result<usize> {
        let count = self.value.as_u64().and_then(|n| usize::try_from(n).ok());
        count.ok_or_else(|| self.fault("not a whole number of 0 or more"))
    }

    /// A list of whole numbers of 1 or more.
    pub(super) fn sizes(&self) -> Result<Vec<usize>> {
        let size = |json: &Json| match json.count()? {
            0 => Err(json.fault("a size must be at least 1")),
            n => Ok(n),
        };
        self.list()?.iter().map(size).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_are_no_json_become_null() {
        let text = br#"{"a": NaN, "b": [-Infinity, Infinity], "NaN \" NaN": "Infinity"}"#;
        let value: Value = serde_json::from_slice(&without_bare_words(text)).expect("JSON");
        assert_eq!(value, serde_json::json!({"a": null, "b": [null, null], "NaN \" NaN": "Infinity"}));
    }
}
