//! Texts beside a picture's pixels: iTXt chunks of a PNG, string attributes of an OpenEXR file. The pixels' bytes are those of a file without
//! them.
//!
//! Chunks of text: <https://www.w3.org/TR/png-3/#11iTXt>. Attributes: <https://openexr.com/en/latest/OpenEXRFileLayout.html>.

use super::decode::picture_bytes;
use super::{Depth, Format, Picture, exr};
use crate::{Error, Result};
use ::png::text_metadata::{EncodableTextChunk, ITXtChunk};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Longest key: that of an attribute in an OpenEXR file without long names.
const LONGEST_KEY: usize = 31;
/// Bytes of text from which a PNG holds it compressed. Shorter ones any program shows.
const COMPRESSED: usize = 8 << 10;
/// Most bytes of one text that is read.
const MOST_TEXT: usize = 32 << 20;
/// Bytes of a PNG before its first chunk, and of that chunk, which is always the same long.
const PNG_HEAD: usize = 8 + 25;

/// Texts by their keys.
///
/// # Guarantees
/// Keys are 1 to 31 printable ASCII characters without spaces; no text holds a zero character.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Metadata(BTreeMap<String, String>);

impl Metadata {
    /// No text.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with `text` under `key`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a key or a text that breaks the guarantees above.
    pub fn with(mut self, key: impl Into<String>, text: impl Into<String>) -> Result<Self> {
        let (key, text) = (key.into(), text.into());
        if !is_key(&key) {
            return Err(Error::invalid(format!("metadata key {key:?}: must be 1 to {LONGEST_KEY} printable ASCII characters, no space")));
        }
        if text.contains('\0') {
            return Err(Error::invalid(format!("metadata {key}: holds a zero character, which ends a text in a file")));
        }
        self.0.insert(key, text);
        Ok(self)
    }

    /// The text under `key`.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Keys and texts, in the order of the keys.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(key, text)| (key.as_str(), text.as_str()))
    }

    /// The texts in the picture file at `path`: none in formats that do not carry any.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read, else as [`Metadata::decode`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::decode(&picture_bytes(path)?, path)
    }

    /// The texts in the bytes of a picture file. `name` names it in errors. Texts under keys that break the guarantees above are left out, and
    /// so are those longer than 32 MiB.
    ///
    /// # Errors
    /// [`Error::Format`] for a PNG or an OpenEXR file that is damaged before its pixels.
    pub fn decode(bytes: &[u8], name: impl AsRef<Path>) -> Result<Self> {
        let texts = match Format::of_start(bytes) {
            Some(Format::Png) => png_texts(bytes, name.as_ref())?,
            Some(Format::Exr) => exr::strings(bytes, name.as_ref())?,
            _ => Vec::new(),
        };
        Ok(Self(texts.into_iter().filter(|(key, text)| is_key(key) && !text.contains('\0')).collect()))
    }
}

fn is_key(key: &str) -> bool {
    (1..=LONGEST_KEY).contains(&key.len()) && key.bytes().all(|b| b.is_ascii_graphic())
}

impl Format {
    /// Whether files of the format carry [`Metadata`]: PNG and OpenEXR do.
    pub fn carries_metadata(self) -> bool {
        matches!(self, Self::Png | Self::Exr)
    }
}

impl Picture {
    /// As [`Picture::encode`], with texts where the format carries them; in other formats there are none.
    ///
    /// # Errors
    /// As [`Picture::encode`].
    pub fn encode_with(&self, format: Format, depth: Depth, metadata: &Metadata) -> Result<Vec<u8>> {
        let mut bytes = self.encode(format, depth)?;
        if metadata.is_empty() {
            return Ok(bytes);
        }
        match format {
            Format::Png => {
                let mut chunks = Vec::new();
                for (key, text) in metadata.iter() {
                    let mut chunk = ITXtChunk::new(key, text);
                    chunk.compressed = text.len() >= COMPRESSED;
                    chunk.encode(&mut chunks).map_err(|e| Error::invalid(format!("PNG: metadata {key}: {e}")))?;
                }
                bytes.splice(PNG_HEAD..PNG_HEAD, chunks);
                Ok(bytes)
            }
            Format::Exr => exr::with_strings(&bytes, metadata.iter()),
            _ => Ok(bytes),
        }
    }
}

/// Texts of a PNG, those of other programs' kinds of chunks too.
fn png_texts(bytes: &[u8], path: &Path) -> Result<Vec<(String, String)>> {
    let fault = |e: ::png::DecodingError| Error::format(path, super::decode::one_line(&format!("PNG of {} bytes: {e}", bytes.len())));
    let mut reader = ::png::Decoder::new(Cursor::new(bytes)).read_info().map_err(fault)?;
    // Chunks may stand behind the pixels too; a file that is damaged there has those before.
    drop(reader.finish());
    let info = reader.info();
    let mut texts = Vec::new();
    for chunk in &info.uncompressed_latin1_text {
        texts.push((chunk.keyword.clone(), chunk.text.clone()));
    }
    for mut chunk in info.compressed_latin1_text.iter().cloned() {
        if chunk.decompress_text_with_limit(MOST_TEXT).is_ok() {
            texts.extend(chunk.get_text().map(|text| (chunk.keyword.clone(), text)));
        }
    }
    for mut chunk in info.utf8_text.iter().cloned() {
        if chunk.decompress_text_with_limit(MOST_TEXT).is_ok() {
            texts.extend(chunk.get_text().map(|text| (chunk.keyword.clone(), text)));
        }
    }
    Ok(texts)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn picture() -> Picture {
        let pixels = (0..300 * 70).map(|i| [0.001 * (i % 900) as f32, 0.5, 0.25, 1.0]).collect();
        Picture::from_pixels(300, 70, pixels).unwrap()
    }

    fn texts() -> Metadata {
        let long: String = (0..40_000).map(|i| char::from(b'a' + (i * i % 26) as u8)).collect();
        let metadata = Metadata::new().with("slicestack.scene", "[camera]\nzoom = 1.0 # \u{e9}\u{4e00}").unwrap();
        metadata.with("slicestack.volume.sha256", "00ff").unwrap().with("long", long).unwrap().with("empty", "").unwrap()
    }

    #[test]
    fn texts_come_back_and_pixels_stay() {
        for format in Format::ALL {
            for depth in [Depth::Eight, Depth::Sixteen] {
                let (plain, with) = (picture().encode(format, depth).unwrap(), picture().encode_with(format, depth, &texts()).unwrap());
                assert_eq!(Picture::decode(&with, "p").unwrap(), Picture::decode(&plain, "p").unwrap(), "{format:?}");
                let want = if format.carries_metadata() { texts() } else { Metadata::new() };
                assert!(Metadata::decode(&with, "p").unwrap() == want, "{format:?}");
                assert!(Metadata::decode(&plain, "p").unwrap().is_empty());
                assert_eq!(picture().encode_with(format, depth, &Metadata::new()).unwrap(), plain, "{format:?}");
            }
        }
        // The pixels' chunk is the same, byte for byte.
        let with = picture().encode_with(Format::Png, Depth::Eight, &texts()).unwrap();
        let plain = picture().encode(Format::Png, Depth::Eight).unwrap();
        assert!(with.ends_with(&plain[PNG_HEAD..]) && with.starts_with(&plain[..PNG_HEAD]));
    }

    #[test]
    fn keys_and_texts_are_checked() {
        for key in ["", "a b", "\u{e9}", "abcdefghijklmnopqrstuvwxyzabcdef"] {
            assert!(Metadata::new().with(key, "x").is_err(), "{key}");
        }
        assert!(Metadata::new().with("a", "x\0y").is_err());
    }

    #[test]
    fn damaged_files_are_refused_or_read_as_far_as_they_go() {
        let texts = texts();
        for format in [Format::Png, Format::Exr] {
            let bytes = picture().encode_with(format, Depth::Eight, &texts).unwrap();
            for end in (0..bytes.len().min(2000)).step_by(7).chain((bytes.len() - 200)..bytes.len()) {
                // An error of one line, or what was found; never a panic.
                if let Err(e) = Metadata::decode(&bytes[..end], "p") {
                    assert!(e.to_string().starts_with("p: ") && !e.to_string().contains('\n'), "{e}");
                }
            }
            for at in 0..bytes.len().min(1200) {
                let mut changed = bytes.clone();
                changed[at] ^= 0x5a;
                if let Err(e) = Metadata::decode(&changed, "p") {
                    assert!(e.to_string().starts_with("p: ") && !e.to_string().contains('\n'), "{e}");
                }
            }
        }
        assert!(Metadata::decode(b"no picture at all", "p").unwrap().is_empty());
    }
}
