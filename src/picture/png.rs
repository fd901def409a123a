//! PNG: 8 or 16 bits a component, numbers stored as they are, without a gamma, sRGB or ICC chunk.

use super::Format;
use super::encode::refused;
use crate::{Error, Result};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ColorType, ImageEncoder};

/// How hard an encoder tries.
type How = (CompressionType, FilterType);
const USUAL: How = (CompressionType::Default, FilterType::Adaptive);
/// For pictures that are looked at once.
#[cfg(feature = "view")]
const FAST: How = (CompressionType::Fast, FilterType::Up);

/// A PNG of straight RGBA, 8 bits a component, row by row from the top.
///
/// # Errors
/// [`Error::Invalid`] when there are not `width` x `height` pixels, or none.
pub(crate) fn rgba8(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>> {
    encode(width, height, rgba, (ColorType::Rgba8, USUAL))
}

/// As [`rgba8`], in little time and more bytes.
///
/// # Errors
/// As [`rgba8`].
#[cfg(feature = "view")]
pub(crate) fn rgba8_fast(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>> {
    encode(width, height, rgba, (ColorType::Rgba8, FAST))
}

/// A PNG of RGB, 8 bits a component, row by row from the top.
///
/// # Errors
/// [`Error::Invalid`] when there are not `width` x `height` pixels, or none.
#[cfg(feature = "study")]
pub(crate) fn rgb8(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>> {
    encode(width, height, rgb, (ColorType::Rgb8, USUAL))
}

/// A PNG of straight RGBA, 16 bits a component, row by row from the top.
///
/// # Errors
/// [`Error::Invalid`] when there are not `width` x `height` pixels, or none.
pub(super) fn rgba16(width: u32, height: u32, rgba: &[u16]) -> Result<Vec<u8>> {
    encode(width, height, bytemuck::cast_slice(rgba), (ColorType::Rgba16, USUAL))
}

fn encode(width: u32, height: u32, components: &[u8], (color, how): (ColorType, How)) -> Result<Vec<u8>> {
    // The encoder panics where the sizes do not agree.
    let needed = u64::from(width) * u64::from(height) * u64::from(color.bytes_per_pixel());
    if components.len() as u64 != needed {
        return Err(Error::invalid(format!("PNG: {} bytes given for {width} x {height} pixels of {color:?}", components.len())));
    }
    let mut out = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut out, how.0, how.1);
    encoder.write_image(components, width, height, color.into()).map_err(|e| refused(Format::Png, &e))?;
    Ok(out)
}

/// An animated PNG, written frame by frame; it runs without end. The crate `image` reads such files but does not write them.
pub(crate) struct Animation<W: std::io::Write> {
    writer: ::png::Writer<W>,
}

impl<W: std::io::Write> Animation<W> {
    /// Begins an animation of `frames` frames, `per_second` of them a second, at the end of `out`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the encoder refuses a number.
    pub(crate) fn begin(out: W, width: u32, height: u32, frames: u32, per_second: u16) -> Result<Self> {
        let mut encoder = ::png::Encoder::new(out, width, height);
        encoder.set_color(::png::ColorType::Rgba);
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_compression(::png::Compression::Fast);
        encoder.set_animated(frames, 0).map_err(animation_refused)?;
        encoder.set_frame_delay(1, per_second).map_err(animation_refused)?;
        Ok(Self { writer: encoder.write_header().map_err(animation_refused)? })
    }

    /// Shows the frames that follow for `seconds`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the encoder refuses the number.
    #[cfg(feature = "explain")]
    pub(crate) fn slow(&mut self, seconds: u16) -> Result<()> {
        self.writer.set_frame_delay(seconds, 1).map_err(animation_refused)
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// [`Error::Invalid`] when it has another size, or is one too many.
    pub(crate) fn frame(&mut self, picture: &super::Picture) -> Result<()> {
        self.writer.write_image_data(&picture.to_rgba8()).map_err(animation_refused)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`Error::Invalid`] when frames are missing.
    pub(crate) fn finish(self) -> Result<()> {
        self.writer.finish().map_err(animation_refused)
    }
}

/// The number of frames that an animated PNG states; `None` for a still one.
#[cfg(test)]
pub(crate) fn frames(bytes: &[u8]) -> Option<u32> {
    let at = bytes.windows(4).position(|w| w == b"acTL")?;
    bytes.get(at + 4..at + 8).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
}

fn animation_refused(e: ::png::EncodingError) -> Error {
    Error::invalid(format!("animated PNG: {e}"))
}
