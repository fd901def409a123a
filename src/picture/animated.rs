//! Pictures one after the other in a file that runs without end: GIF, animated PNG, animated WebP.
//!
//! GIF has 256 colours a frame, found for each frame anew, and pixels are opaque or not there. PNG and WebP keep every colour and opacity of 8 bits.

use super::png::Animation;
use super::{Format, Picture};
use crate::{Error, Result};
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How fast palettes of GIF are found, 1 (best) to 30: below 10 pictures look the same, and take several times as long.
const PALETTE_SPEED: i32 = 10;

/// Largest number of frames.
pub const MAX_FRAMES: u32 = 10_000;

/// A kind of file that holds several pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum AnimatedFormat {
    /// GIF: 256 colours a frame.
    Gif,
    /// Animated PNG.
    Png,
    /// Animated WebP, lossless.
    WebP,
}

impl AnimatedFormat {
    /// The format that the extension of `path` names: gif, png or apng, webp.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "gif" => Some(Self::Gif),
            "png" | "apng" => Some(Self::Png),
            "webp" => Some(Self::WebP),
            _ => None,
        }
    }
}

/// Pictures of one size on their way into a file.
pub struct Animated {
    width: u32,
    height: u32,
    duration: Duration,
    writer: Writer,
}

enum Writer {
    Gif(Box<GifEncoder<Shared>>, Shared),
    Png(Animation<Shared>, Shared),
    /// Chunks of frames.
    WebP(Vec<u8>),
}

impl Animated {
    /// A file of `format` for `frames` pictures of `width` x `height` pixels, `per_second` of them a second.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no frame or more than [`MAX_FRAMES`], a rate outside 1 to 100, and a size that the format does not hold (GIF up to 65535 pixels a
    /// side, WebP 16383).
    pub fn new(format: AnimatedFormat, (width, height): (u32, u32), frames: u32, per_second: u32) -> Result<Self> {
        if !(1..=MAX_FRAMES).contains(&frames) {
            return Err(Error::invalid(format!("{frames} frames: there can be 1 to {MAX_FRAMES}")));
        }
        if !(1..=100).contains(&per_second) {
            return Err(Error::invalid(format!("{per_second} frames a second: must lie between 1 and 100")));
        }
        let most = match format {
            AnimatedFormat::Gif => 65535,
            AnimatedFormat::Png => u32::MAX,
            AnimatedFormat::WebP => 16383,
        };
        if width.max(height) > most {
            return Err(Error::invalid(format!("{width} x {height} pixels: an animation of this format holds {most} a side")));
        }
        let writer = match format {
            AnimatedFormat::Gif => {
                let out = Shared::default();
                let mut encoder = GifEncoder::new_with_speed(out.clone(), PALETTE_SPEED);
                encoder.set_repeat(Repeat::Infinite).map_err(|e| refused(&e))?;
                Writer::Gif(Box::new(encoder), out)
            }
            AnimatedFormat::Png => {
                let out = Shared::default();
                Writer::Png(Animation::begin(out.clone(), width, height, frames, per_second as u16)?, out)
            }
            AnimatedFormat::WebP => Writer::WebP(Vec::new()),
        };
        Ok(Self { width, height, duration: Duration::from_micros(1_000_000 / u64::from(per_second)), writer })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a picture of another size, or one too many.
    pub fn frame(&mut self, picture: &Picture) -> Result<()> {
        if (picture.width(), picture.height()) != (self.width, self.height) {
            return Err(Error::invalid(format!(
                "a frame of {} x {} pixels in an animation of {} x {}",
                picture.width(),
                picture.height(),
                self.width,
                self.height
            )));
        }
        match &mut self.writer {
            Writer::Gif(encoder, _) => {
                let image = RgbaImage::from_raw(self.width, self.height, picture.to_rgba8());
                let image = image.ok_or_else(|| Error::invalid("a frame without its pixels"))?;
                let frame = Frame::from_parts(image, 0, 0, Delay::from_saturating_duration(self.duration));
                encoder.encode_frame(frame).map_err(|e| refused(&e))
            }
            Writer::Png(animation, _) => animation.frame(picture),
            Writer::WebP(chunks) => {
                let still = picture.encode(Format::WebP, super::Depth::Eight)?;
                chunks.extend(webp_frame(&still, (self.width, self.height), self.duration)?);
                Ok(())
            }
        }
    }

    /// The file.
    ///
    /// # Errors
    /// [`Error::Invalid`] when frames are missing.
    pub fn finish(self) -> Result<Vec<u8>> {
        match self.writer {
            Writer::Gif(encoder, out) => {
                // It writes the end of the file when it goes.
                drop(encoder);
                Ok(out.take())
            }
            Writer::Png(animation, out) => {
                animation.finish()?;
                Ok(out.take())
            }
            Writer::WebP(chunks) => Ok(webp_file(&chunks, (self.width, self.height))),
        }
    }
}

/// Bytes that an encoder and its owner share: encoders keep what they write to.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Shared {
    fn take(self) -> Vec<u8> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The chunk of one frame from the file of a still picture: its compressed pixels with place, size and duration before them
/// (WebP Container Specification, ANMF).
fn webp_frame(still: &[u8], (width, height): (u32, u32), duration: Duration) -> Result<Vec<u8>> {
    let pixels = chunks(still).find(|(name, _)| name == b"VP8L").map(|(_, data)| data);
    let pixels = pixels.ok_or_else(|| Error::invalid("animation: a WebP picture without lossless pixels"))?;
    let mut data = Vec::new();
    // Place (0,0), in units of two pixels; the picture replaces what is there, and stays.
    data.extend([0; 6]);
    data.extend(three(width - 1));
    data.extend(three(height - 1));
    data.extend(three(duration.as_millis() as u32));
    data.push(0b10);
    chunk(&mut data, *b"VP8L", pixels);
    let mut out = Vec::new();
    chunk(&mut out, *b"ANMF", &data);
    Ok(out)
}

/// The file of frames: an extended header with alpha and animation, background and number of rounds, then the frames.
fn webp_file(frames: &[u8], (width, height): (u32, u32)) -> Vec<u8> {
    let mut body = b"WEBP".to_vec();
    let mut header = vec![0b0001_0010, 0, 0, 0];
    header.extend(three(width - 1));
    header.extend(three(height - 1));
    chunk(&mut body, *b"VP8X", &header);
    chunk(&mut body, *b"ANIM", &[0; 6]);
    body.extend_from_slice(frames);
    let mut out = b"RIFF".to_vec();
    out.extend((body.len() as u32).to_le_bytes());
    out.extend(body);
    out
}

/// The lower three bytes of a number, lowest first.
fn three(n: u32) -> [u8; 3] {
    let [a, b, c, _] = n.to_le_bytes();
    [a, b, c]
}

/// Adds a chunk: its name, its length, its data, and a byte of padding where that is odd.
fn chunk(out: &mut Vec<u8>, name: [u8; 4], data: &[u8]) {
    out.extend(name);
    out.extend((data.len() as u32).to_le_bytes());
    out.extend_from_slice(data);
    if data.len() % 2 == 1 {
        out.push(0);
    }
}

/// Names and data of the chunks of a WebP file.
fn chunks(file: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    let mut rest = file.get(12..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (name, length) = (rest.get(..4)?, u32::from_le_bytes(rest.get(4..8)?.try_into().ok()?) as usize);
        let data = rest.get(8..8 + length)?;
        rest = rest.get(8 + length + length % 2..).unwrap_or_default();
        Some((name, data))
    })
}

fn refused(e: &image::ImageError) -> Error {
    Error::invalid(format!("animation: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::gif::GifDecoder;
    use image::codecs::webp::WebPDecoder;
    use image::{AnimationDecoder, ImageDecoder};
    use std::io::Cursor;

    /// A disc that wanders over a transparent ground, with colours that need more than 256 shades.
    fn picture(n: u32) -> Picture {
        let pixels = (0..40 * 30)
            .map(|i| {
                let (x, y) = (f64::from(i % 40), f64::from(i / 40));
                let (dx, dy) = (x - 8.0 - f64::from(n), y - 15.0);
                let inside = dx * dx + dy * dy < 60.0;
                if inside { [(x / 40.0) as f32, (y / 30.0) as f32, 0.3, 1.0] } else { [0.0; 4] }
            })
            .collect();
        Picture::new(40, 30, pixels)
    }

    fn file(format: AnimatedFormat) -> Vec<u8> {
        let mut animated = Animated::new(format, (40, 30), 5, 20).expect("an animation");
        (0..5).for_each(|n| animated.frame(&picture(n)).expect("a frame"));
        animated.finish().expect("a file")
    }

    #[test]
    fn webp_holds_every_pixel_of_every_frame() {
        let bytes = file(AnimatedFormat::WebP);
        let decoder = WebPDecoder::new(Cursor::new(&bytes)).expect("WebP");
        assert!(decoder.has_animation() && decoder.dimensions() == (40, 30));
        let frames = decoder.into_frames().collect_frames().expect("frames");
        assert_eq!(frames.len(), 5);
        for (n, frame) in frames.iter().enumerate() {
            assert_eq!(frame.buffer().as_raw(), &picture(n as u32).to_rgba8(), "frame {n}");
            assert_eq!(frame.delay().numer_denom_ms(), (50, 1));
        }
    }

    #[test]
    fn png_holds_every_pixel_of_every_frame() {
        let bytes = file(AnimatedFormat::Png);
        assert_eq!(crate::picture::png::frames(&bytes), Some(5));
        let decoder = image::codecs::png::PngDecoder::new(Cursor::new(&bytes)).expect("PNG").apng().expect("animated");
        let frames = decoder.into_frames().collect_frames().expect("frames");
        for (n, frame) in frames.iter().enumerate() {
            assert_eq!(frame.buffer().as_raw(), &picture(n as u32).to_rgba8(), "frame {n}");
        }
    }

    #[test]
    fn gif_is_near_in_colour_and_exact_in_where_nothing_is() {
        let bytes = file(AnimatedFormat::Gif);
        assert!(bytes.ends_with(&[0x3b]), "the end of the file is there");
        let frames = GifDecoder::new(Cursor::new(&bytes)).expect("GIF").into_frames().collect_frames().expect("frames");
        assert_eq!(frames.len(), 5);
        for (n, frame) in frames.iter().enumerate() {
            let want = picture(n as u32).to_rgba8();
            for (got, want) in frame.buffer().as_raw().chunks(4).zip(want.chunks(4)) {
                assert_eq!(got[3], want[3], "frame {n}");
                if want[3] > 0 {
                    let off = (0..3).map(|c| got[c].abs_diff(want[c])).max().unwrap_or(0);
                    assert!(off <= 24, "{got:?} for {want:?}");
                }
            }
        }
    }

    #[test]
    fn impossible_animations_are_refused() {
        let new = |format, size, frames, rate| Animated::new(format, size, frames, rate).map(|_| ());
        assert!(new(AnimatedFormat::Gif, (4, 4), 0, 20).is_err() && new(AnimatedFormat::Gif, (4, 4), MAX_FRAMES + 1, 20).is_err());
        assert!(new(AnimatedFormat::Gif, (4, 4), 2, 0).is_err() && new(AnimatedFormat::Gif, (4, 4), 2, 101).is_err());
        assert!(new(AnimatedFormat::WebP, (16384, 4), 2, 20).is_err() && new(AnimatedFormat::Gif, (65536, 4), 2, 20).is_err());
        let mut small = Animated::new(AnimatedFormat::WebP, (4, 4), 2, 20).expect("an animation");
        assert!(small.frame(&picture(0)).is_err_and(|e| e.to_string().contains("40 x 30")));
        assert_eq!(AnimatedFormat::of_path(Path::new("a/B.GIF")), Some(AnimatedFormat::Gif));
        assert_eq!(AnimatedFormat::of_path(Path::new("frames")), None);
    }
}
