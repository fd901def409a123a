//! What the header of an OpenEXR file claims, looked at before the decoder takes memory by it.
//!
//! A file is a magic, a version with flags, and for each part a list of attributes that an empty name ends. An attribute is a name, a
//! type, both ended by a zero byte, the length of its value in four bytes, and the value. Source:
//! <https://openexr.com/en/latest/OpenEXRFileLayout.html>.

use super::decode::check_size;
use crate::{Error, Result};
use std::path::Path;

/// Flag of the version: the file has several parts, whose headers follow each other and end with an empty one.
const MULTIPART: u32 = 1 << 12;

/// Checks the windows of every part: the pixels that are stored, and those that are shown.
///
/// # Errors
/// [`Error::Format`] naming `path` when a header does not end, or a window is too large, or too large for the file's length.
pub(super) fn check(bytes: &[u8], path: &Path) -> Result<()> {
    let short = || Error::format(path, format!("OpenEXR of {} bytes: it ends within its header", bytes.len()));
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).ok_or_else(short);
    // The place behind the next zero byte.
    let behind = |at: usize| bytes.get(at..).and_then(|b| b.iter().position(|&b| b == 0)).map(|n| at + n + 1).ok_or_else(short);
    let multipart = word(4)? & MULTIPART != 0;
    let mut at = 8;
    loop {
        let name = at;
        let kind = behind(name)?;
        if kind == name + 1 {
            // An empty name: the end of this header, and of all of them where no other follows.
            if !multipart || bytes.get(kind) == Some(&0) {
                return Ok(());
            }
            at = kind;
            continue;
        }
        let value = behind(kind)? + 4;
        let length = word(value - 4)? as usize;
        let end = value.checked_add(length).filter(|&end| end <= bytes.len()).ok_or_else(short)?;
        if matches!(&bytes[name..kind - 1], b"dataWindow" | b"displayWindow") && length == 16 {
            let [left, top, right, bottom] =
                [word(value)?, word(value + 4)?, word(value + 8)?, word(value + 12)?].map(|w| i64::from(w as i32));
            let side = |from: i64, to: i64| u64::try_from(to - from + 1).unwrap_or(0);
            check_size(path, "OpenEXR", (side(left, right), side(top, bottom)), bytes.len())?;
        }
        at = end;
    }
}
