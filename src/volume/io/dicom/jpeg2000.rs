//! JPEG 2000 by the port of OpenJPEG to Rust. The size that a stream claims is looked at before it is decoded.
//!
//! Source: ITU-T T.800, annex A.5.1 (image and tile size) and annex I (the boxes that may stand around a stream).

use super::image::Layout;
use jpeg2k::{DecodeParameters, Image};

/// Where the stream itself starts: behind the boxes of a file, if there are any.
fn stream(data: &[u8]) -> Option<&[u8]> {
    let magic = [0xff, 0x4f, 0xff, 0x51];
    if data.starts_with(&magic) {
        return Some(data);
    }
    let at = data.windows(4).take(1 << 16).position(|w| w == magic)?;
    Some(&data[at..])
}

/// The numbers of the frame that `data` holds, the samples of a pixel one after the other. `check` is asked whether columns, rows and samples
/// and the number of bits are right.
pub(super) fn decode(data: &[u8], layout: &Layout, check: impl Fn([usize; 3], u32) -> Result<(), String>) -> Result<Vec<i32>, String> {
    let Some(head) = stream(data).and_then(|s| s.get(..44).map(|head| (s, head))) else {
        return Err("the frame is no JPEG 2000 stream".to_owned());
    };
    let (data, head) = head;
    let word = |at: usize| u32::from_be_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let [right, bottom, left, top, tile_columns, tile_rows] = [8, 12, 16, 20, 24, 28].map(word);
    let samples = usize::from(u16::from_be_bytes([head[40], head[41]]));
    let bits = u32::from(head[42] & 0x7f) + 1;
    check([right.saturating_sub(left) as usize, bottom.saturating_sub(top) as usize, samples], bits)?;
    // Each sample has a pixel's size, none is coarser.
    let parts = data.get(42..42 + 3 * samples).unwrap_or_default();
    if parts.len() < 3 * samples || parts.chunks_exact(3).any(|p| p[0] != head[42] || p[1] != 1 || p[2] != 1) {
        return Err("the JPEG 2000 stream has samples of different sizes".to_owned());
    }
    let tiles = u64::from(right.div_ceil(tile_columns.max(1))) * u64::from(bottom.div_ceil(tile_rows.max(1)));
    if tile_columns == 0 || tile_rows == 0 || tiles > layout.pixels() as u64 || tiles > 65535 {
        return Err(format!("the JPEG 2000 stream has {tiles} tiles of {tile_columns} x {tile_rows} pixels"));
    }
    let image = Image::from_bytes_with(data, DecodeParameters::new().strict(true)).map_err(|e| {
        let line: String = e.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(120).collect();
        format!("the JPEG 2000 stream is damaged: {line}")
    })?;
    let components = image.components();
    let fits = |c: &jpeg2k::ImageComponent| c.width() as usize == layout.columns && c.height() as usize == layout.rows;
    // A component without any decoded tile has no memory, which only its description tells.
    if components.len() != samples || components.iter().any(|c| !fits(c) || format!("{c:?}").contains("data: 0x0,")) {
        return Err("the JPEG 2000 stream does not hold the pixels that it claims".to_owned());
    }
    let planes: Vec<&[i32]> = components.iter().map(|c| c.data()).collect();
    if let [plane] = planes[..] {
        return Ok(plane.to_vec());
    }
    Ok((0..layout.pixels()).flat_map(|i| planes.iter().map(move |plane| plane[i])).collect())
}
