//! Files to pictures.

use super::MAX_SIDE;
use super::file::{no_memory, read_picture, unknown};
use super::format::{Entry, recognized};
use super::{Picture, exr, npy, tiff};
use crate::{Error, Result};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// Most bytes of a file: the largest picture as floats, and room for what stands beside the pixels.
const FILE_BYTES: u64 = 16 * (MAX_SIDE as u64) * (MAX_SIDE as u64) + (1 << 20);
/// Pixels that a file may claim whatever its length: some compressions say "all alike" in a few bytes.
pub(super) const FEW_PIXELS: u64 = 1 << 22;
/// Most pixels that a byte of a file may stand for beyond that: deflate makes at most 1032 bytes of one, eight pixels to a byte.
pub(super) const PIXELS_A_BYTE: u64 = 8 * 1032;
/// Memory that a decoder may take beside two copies of the pixels, in bytes.
const DECODER_BYTES: u64 = 16 << 20;

/// The bytes of the picture file at `path`; of a file that is none no more than its beginning is read.
///
/// # Errors
/// [`Error::Io`], [`Error::Format`] when it is no picture, [`Error::Limit`] when it is larger than the largest picture.
pub(crate) fn picture_bytes(path: &Path) -> Result<Vec<u8>> {
    read_picture(path, FILE_BYTES)
}

impl Picture {
    /// Reads a picture file: PNG, NumPy, OpenEXR, JPEG, WebP, TIFF, GIF (its first frame) or PNM. Its first bytes tell which; the name
    /// does not matter.
    ///
    /// Straight colours of 8 or 16 bits are divided by 255 or 65535 and premultiplied by alpha; colours of OpenEXR and NumPy files
    /// are premultiplied already and stay as they are, to the bit. A file without alpha is opaque. Gamma, colour profiles and
    /// orientation are not applied. A NumPy array is height x width x 4 in little-endian f32 and C order.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read or its pixels do not fit into memory, [`Error::Limit`] when it is larger than the largest
    /// picture, else as [`Picture::decode`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::decode(&picture_bytes(path)?, path)
    }

    /// Reads a picture from the bytes of a file, as [`Picture::open`] does. `name` names it in errors.
    ///
    /// # Errors
    /// [`Error::Format`] when the bytes are no picture, not a whole one, of a kind that is not read, or claim a side of 0 or above
    /// [`MAX_SIDE`] or more pixels than so few bytes can hold; [`Error::Io`] when there is no memory for the pixels.
    pub fn decode(bytes: &[u8], name: impl AsRef<Path>) -> Result<Self> {
        let path = name.as_ref();
        let entry = recognized(bytes).ok_or_else(|| unknown(path, bytes))?;
        match entry.codec {
            None => npy::decode(bytes, path),
            Some(codec) => decode(bytes, path, entry, codec),
        }
    }
}

/// Decodes with the crate `image`.
fn decode(bytes: &[u8], path: &Path, entry: &Entry, codec: ImageFormat) -> Result<Picture> {
    let fault = |e: image::ImageError| Error::format(path, one_line(&format!("{} of {} bytes: {e}", entry.title, bytes.len())));
    match (codec, bytes) {
        (ImageFormat::OpenExr, _) => exr::check(bytes, path)?,
        (ImageFormat::Tiff, _) => tiff::check(bytes, path)?,
        // The decoder takes memory for rows before it tells their length.
        (ImageFormat::Png, &[_, _, _, _, _, _, _, _, _, _, _, _, b'I', b'H', b'D', b'R', w0, w1, w2, w3, h0, h1, h2, h3, ..]) => {
            let claimed = [[w0, w1, w2, w3], [h0, h1, h2, h3]].map(|side| u64::from(u32::from_be_bytes(side)));
            check_size(path, entry.title, claimed.into(), bytes.len())?;
        }
        _ => {}
    }
    let limited = |bytes: u64| {
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(bytes);
        limits
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), codec);
    reader.limits(limited(DECODER_BYTES));
    let mut decoder = reader.into_decoder().map_err(fault)?;
    let (width, height) = decoder.dimensions();
    check_size(path, entry.title, (width.into(), height.into()), bytes.len())?;
    let (color, length) = (decoder.color_type(), decoder.total_bytes());
    decoder.set_limits(limited(length.saturating_mul(2).saturating_add(DECODER_BYTES))).map_err(fault)?;
    let mut raw = reserved(path, usize::try_from(length).unwrap_or(usize::MAX))?;
    raw.resize(length as usize, 0u8);
    decoder.read_image(&mut raw).map_err(fault)?;
    let straight = match codec {
        ImageFormat::OpenExr => false,
        ImageFormat::Tiff => !tiff::is_premultiplied(bytes),
        _ => true,
    };
    Ok(Picture::new(width, height, premultiplied(path, &raw, color, straight)?))
}

/// Decoded components as premultiplied RGBA; `straight` says that they are not premultiplied yet.
fn premultiplied(path: &Path, raw: &[u8], color: ColorType, straight: bool) -> Result<Vec<[f32; 4]>> {
    let channels = usize::from(color.channel_count());
    match usize::from(color.bytes_per_pixel()) / channels {
        1 => spread(path, raw, channels, straight, |[b]| f32::from(b) / 255.0),
        2 => spread(path, raw, channels, straight, |b| f32::from(u16::from_ne_bytes(b)) / 65535.0),
        4 => spread(path, raw, channels, straight, f32::from_ne_bytes),
        bytes => Err(Error::format(path, format!("components of {bytes} bytes are not read"))),
    }
}

/// Pixels of 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 components of `N` bytes.
fn spread<const N: usize>(
    path: &Path,
    raw: &[u8],
    channels: usize,
    straight: bool,
    read: impl Fn([u8; N]) -> f32,
) -> Result<Vec<[f32; 4]>> {
    pixels_of(path, raw.chunks_exact(N * channels), |pixel| {
        let component = |i: usize| read(std::array::from_fn(|k| pixel[i * N + k]));
        let [r, g, b] = if channels < 3 { [component(0); 3] } else { [component(0), component(1), component(2)] };
        let a = if channels % 2 == 0 { component(channels - 1) } else { 1.0 };
        if straight { [r * a, g * a, b * a, a] } else { [r, g, b, a] }
    })
}

/// One pixel made of each of `parts`.
///
/// # Errors
/// [`Error::Io`] when they do not fit into memory.
pub(super) fn pixels_of<T>(
    path: &Path,
    parts: impl ExactSizeIterator<Item = T>,
    pixel: impl FnMut(T) -> [f32; 4],
) -> Result<Vec<[f32; 4]>> {
    let mut pixels = reserved(path, parts.len())?;
    pixels.extend(parts.map(pixel));
    Ok(pixels)
}

/// An empty vector with room for `count` elements.
fn reserved<T>(path: &Path, count: usize) -> Result<Vec<T>> {
    let mut all = Vec::new();
    crate::memory::reserve(&mut all, count).map_err(|_| no_memory(path, count as u64 * size_of::<T>() as u64))?;
    Ok(all)
}

/// Width and height of a picture that a file of `length` bytes may hold.
///
/// # Errors
/// [`Error::Format`] when a side is 0 or above [`MAX_SIDE`], or the file far too short for so many pixels.
pub(super) fn check_size(path: &Path, title: &str, (width, height): (u64, u64), length: usize) -> Result<(u32, u32)> {
    let sides = 1..=u64::from(MAX_SIDE);
    if !sides.contains(&width) || !sides.contains(&height) {
        return Err(Error::format(path, format!("{title} of {width} x {height} pixels: sides must lie between 1 and {MAX_SIDE}")));
    }
    let pixels = width * height;
    if pixels > FEW_PIXELS && pixels > PIXELS_A_BYTE * length as u64 {
        return Err(Error::format(path, format!("{title} of {length} bytes: claims {width} x {height} pixels, more than these can hold")));
    }
    Ok((width as u32, height as u32))
}

/// A message of a library on one line.
pub(super) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
