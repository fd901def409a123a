//! What the header of an OpenEXR file claims, looked at before the decoder takes memory by it; and texts in it.
//!
//! A file is a magic, a version with flags, and for each part a list of attributes that an empty name ends. An attribute is a name, a
//! type, both ended by a zero byte, the length of its value in four bytes, and the value. Source:
//! <https://openexr.com/en/latest/OpenEXRFileLayout.html>.

use super::decode::{FEW_PIXELS, PIXELS_A_BYTE, check_size};
use crate::{Error, Result};
use std::path::Path;

/// Flag of the version: the file has several parts, whose headers follow each other and end with an empty one.
const MULTIPART: u32 = 1 << 12;
/// Most rows of a block in a file without tiles.
const BLOCK_ROWS: u64 = 256;
/// Fewest bytes that a channel takes in the list of them.
const CHANNEL_BYTES: usize = 18;

/// Checks every part: the pixels that are stored, those that are shown, and the blocks in which they are decoded.
///
/// # Errors
/// [`Error::Format`] naming `path` when a header does not end, or claims sizes that are too large, be it for the file's length.
pub(super) fn check(bytes: &[u8], path: &Path) -> Result<()> {
    let short = || Error::format(path, format!("OpenEXR of {} bytes: it ends within its header", bytes.len()));
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).ok_or_else(short);
    // The place behind the next zero byte.
    let behind = |at: usize| bytes.get(at..).and_then(|b| b.iter().position(|&b| b == 0)).map(|n| at + n + 1).ok_or_else(short);
    let size = |size| check_size(path, "OpenEXR", size, bytes.len());
    let multipart = word(4)? & MULTIPART != 0;
    let mut at = 8;
    loop {
        // The attributes of one part.
        let (mut width, mut tile, mut channels) = (0, None, 0);
        loop {
            let kind = behind(at)?;
            let name = &bytes[at..kind - 1];
            if name.is_empty() {
                at = kind;
                break;
            }
            let value = behind(kind)? + 4;
            let length = word(value - 4)? as usize;
            let end = value.checked_add(length).filter(|&end| end <= bytes.len()).ok_or_else(short)?;
            match (name, length) {
                (b"dataWindow" | b"displayWindow", 16) => {
                    let edge = |i: usize| Ok::<_, Error>(i64::from(word(value + 4 * i)? as i32));
                    let side = |from: i64, to: i64| u64::try_from(to - from + 1).unwrap_or(0);
                    let sides = (side(edge(0)?, edge(2)?), side(edge(1)?, edge(3)?));
                    size(sides)?;
                    width = width.max(sides.0);
                }
                (b"tiles", 9) => {
                    let sides = (u64::from(word(value)?), u64::from(word(value + 4)?));
                    size(sides)?;
                    tile = Some(sides);
                }
                (b"channels", _) => channels = length / CHANNEL_BYTES,
                _ => {}
            }
            at = end;
        }
        let (w, h) = tile.unwrap_or((width, BLOCK_ROWS));
        let numbers = (w * h).saturating_mul(channels as u64);
        if numbers > 4 * FEW_PIXELS && numbers > 4 * PIXELS_A_BYTE * bytes.len() as u64 {
            let what = format!("OpenEXR of {} bytes: claims blocks of {w} x {h} pixels and {channels} channels", bytes.len());
            return Err(Error::format(path, what + ", more than these can hold"));
        }
        if !multipart || bytes.get(at) == Some(&0) {
            return Ok(());
        }
    }
}

/// A place in the header of the file's first part.
struct Attribute<'b> {
    name: &'b [u8],
    kind: &'b [u8],
    value: &'b [u8],
}

/// The attributes of the first part, and the place of the empty name that ends them.
///
/// # Errors
/// [`Error::Format`] naming `path` when the header does not end.
fn attributes<'b>(bytes: &'b [u8], path: &Path) -> Result<(Vec<Attribute<'b>>, usize)> {
    let short = || Error::format(path, format!("OpenEXR of {} bytes: it ends within its header", bytes.len()));
    let text = |at: usize| {
        let rest = bytes.get(at..)?;
        rest.iter().position(|&b| b == 0).map(|n| &rest[..n])
    };
    let (mut found, mut at) = (Vec::new(), 8);
    loop {
        let name = text(at).ok_or_else(short)?;
        if name.is_empty() {
            return Ok((found, at));
        }
        let kind = text(at + name.len() + 1).ok_or_else(short)?;
        let start = at + name.len() + kind.len() + 6;
        let length = bytes.get(start - 4..start).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize).ok_or_else(short)?;
        at = start.checked_add(length).filter(|&end| end <= bytes.len()).ok_or_else(short)?;
        found.push(Attribute { name, kind, value: &bytes[start..at] });
    }
}

/// Names and texts of the string attributes, but for `type`, which tells how the pixels are stored.
///
/// # Errors
/// [`Error::Format`] naming `path` when the header does not end.
pub(super) fn strings(bytes: &[u8], path: &Path) -> Result<Vec<(String, String)>> {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).ok();
    let (all, _) = attributes(bytes, path)?;
    Ok(all.iter().filter(|a| a.kind == b"string" && a.name != b"type").filter_map(|a| Some((text(a.name)?, text(a.value)?))).collect())
}

/// The file `bytes`, of one part and written here, with string attributes added. The list of places of its blocks follows the header: they
/// move by as much as is added.
///
/// # Errors
/// [`Error::Invalid`] for a text that is longer than the format can count, and a list of places that does not end where the first block begins.
pub(super) fn with_strings<'t>(bytes: &[u8], texts: impl Iterator<Item = (&'t str, &'t str)>) -> Result<Vec<u8>> {
    let (_, end) = attributes(bytes, Path::new("OpenEXR"))?;
    let mut added = Vec::new();
    for (name, text) in texts {
        let length = i32::try_from(text.len()).map_err(|_| Error::invalid(format!("OpenEXR: metadata {name}: longer than 2 GiB")))?;
        added.extend(name.as_bytes());
        added.extend(b"\0string\0");
        added.extend(length.to_le_bytes());
        added.extend(text.as_bytes());
    }
    let mut out = Vec::with_capacity(bytes.len() + added.len());
    out.extend(&bytes[..end]);
    out.extend(&added);
    out.push(0);
    let (mut at, mut first) = (end + 1, u64::MAX);
    while (at as u64) < first {
        let place = bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        let place = place.ok_or_else(|| Error::invalid("OpenEXR: no block follows the list of their places"))?;
        first = first.min(place);
        out.extend((place + added.len() as u64).to_le_bytes());
        at += 8;
    }
    out.extend(bytes.get(at..).unwrap_or_default());
    Ok(out)
}
