//! NumPy arrays of height x width x 4 in little-endian f32 and C order, row 0 on top: the picture's numbers as they are.
//!
//! A file is the magic, a version, the length of a header, the header and the numbers. The header is a Python dictionary of three keys
//! in text; source: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use super::Picture;
use super::decode::{check_size, pixels_of};
use crate::{Error, Result};
use std::path::Path;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// A picture as a file.
pub(super) fn encode(picture: &Picture) -> Vec<u8> {
    array(&format!("({}, {}, 4)", picture.height(), picture.width()), bytemuck::cast_slice(picture.pixels()))
}

/// An array of that `shape` as a file of format 1.0.
pub(super) fn array(shape: &str, numbers: &[f32]) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut out = Vec::with_capacity(10 + header.len() + numbers.len() * 4);
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&[1, 0]);
    // Below 200 bytes for any picture size.
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    if cfg!(target_endian = "little") {
        out.extend_from_slice(bytemuck::cast_slice(numbers));
    } else {
        out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    }
    out
}

/// The picture in the file `bytes`; `path` names it in errors.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<Picture> {
    let fault = |what: String| Error::format(path, what);
    let short = || fault(format!("a NumPy array of {} bytes: it ends within its header", bytes.len()));
    // The length takes two bytes in version 1, four since.
    let (start, length) = match *bytes.get(6).ok_or_else(short)? {
        1 => (10, bytes.get(8..10).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])))),
        2 | 3 => (12, bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)),
        version => return Err(fault(format!("NumPy format version {version}: 1, 2 and 3 are known"))),
    };
    let end = length.and_then(|n| n.checked_add(start)).filter(|&end| end <= bytes.len()).ok_or_else(short)?;
    let header = String::from_utf8_lossy(&bytes[start..end]);
    let value = |key: &str| value_of(&header, key).ok_or_else(|| fault(format!("the NumPy header has no key '{key}'")));
    let descr = value("descr")?.trim_matches(['\'', '"']);
    if descr != "<f4" {
        return Err(fault(format!("a NumPy array of type {}: a picture is of little-endian f32, '<f4'", shown(descr))));
    }
    let order = value("fortran_order")?;
    if order != "False" {
        return Err(fault(format!("a NumPy array with fortran_order {}: a picture is in C order, False", shown(order))));
    }
    let shape = value("shape")?;
    let sizes: Option<Vec<u64>> =
        shape.trim_matches(['(', ')']).split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect();
    let Some([height, width, 4]) = sizes.as_deref() else {
        return Err(fault(format!("a NumPy array of shape {}: a picture is height x width x 4", shown(shape))));
    };
    let numbers = &bytes[end..];
    let (width, height) = check_size(path, "NumPy", (*width, *height), numbers.len())?;
    let needed = u64::from(width) * u64::from(height) * 16;
    if numbers.len() as u64 != needed {
        return Err(fault(format!("{} bytes of numbers, where {height} x {width} x 4 of f32 take {needed}", numbers.len())));
    }
    let pixels = pixels_of(path, numbers.chunks_exact(16), |pixel| {
        let number = |i: usize| f32::from_le_bytes([pixel[i], pixel[i + 1], pixel[i + 2], pixel[i + 3]]);
        [number(0), number(4), number(8), number(12)]
    })?;
    Ok(Picture::new(width, height, pixels))
}

/// The text of a key's value, up to the comma or brace that ends it; a comma within brackets ends nothing.
fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let at = ['\'', '"'].iter().find_map(|q| header.find(&format!("{q}{key}{q}")))?;
    let text = header[at + key.len() + 2..].trim_start().strip_prefix(':')?.trim_start();
    let mut depth = 0;
    let end = text.find(|c| {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        depth == 0 && matches!(c, ',' | '}')
    })?;
    Some(text[..end].trim_end())
}

/// Text of a file as it may stand in a message: one line, not long.
fn shown(text: &str) -> String {
    text.chars().take(40).flat_map(char::escape_debug).collect()
}
