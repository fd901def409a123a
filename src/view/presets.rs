//! Presets: the document with another transfer function, and a small picture of it.

use super::document::{Asked, Document, Opened};
use super::quality::{Level, Subject};
use crate::picture::png;
use crate::{Error, Renderer, Result};
use serde_json::{Value, json};

/// Longest side of a small picture.
const SIDE: u32 = 512;
/// Most slices of one.
const SLICES: u64 = 128;
/// Sections in whose place the preset comes.
const SECTIONS: [&str; 4] = ["transfer", "transfer2d", "light", "lights"];

/// What `document` comes to with the transfer function and light of `preset`.
///
/// # Errors
/// As [`Opened::read`]; [`Error::Invalid`] for a preset that there is none of.
pub(super) fn with_preset(opened: &Opened, mut document: Document, preset: &str, size: Option<(u32, u32)>) -> Result<Asked> {
    // How slabs are classified is the scene's, not the preset's.
    let classification = document.get("transfer").and_then(|transfer| transfer.get("classification")).cloned();
    document.retain(|section, _| !SECTIONS.contains(&section.as_str()));
    let mut transfer = json!({ "preset": preset });
    if let Some(Value::String(word)) = classification {
        transfer["classification"] = word.into();
    }
    document.insert("transfer".to_owned(), transfer);
    opened.read(document, size)
}

/// A PNG of `document` with `preset`, of `side` x `side` pixels.
///
/// # Errors
/// As [`with_preset`] and [`Renderer::render`].
pub(super) fn thumbnail(opened: &Opened, renderer: &mut Renderer, document: Document, preset: &str, side: u32) -> Result<Vec<u8>> {
    if !(1..=SIDE).contains(&side) {
        return Err(Error::invalid(format!("size {side}: a small picture has 1 to {SIDE} pixels a side")));
    }
    let scene = with_preset(opened, document, preset, Some((side, side)))?.scene;
    let subject = Subject::of(&scene, &opened.volume)?;
    let scene = Level { slices: subject.slices.min(SLICES), divisor: 1.0 }.coarse(&scene, subject)?;
    let (picture, _) = renderer.render(&scene)?;
    png::rgba8_fast(side, side, &picture.to_rgba8())
}
