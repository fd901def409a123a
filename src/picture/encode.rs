//! Pictures to files.

use super::{Depth, Format, Picture, npy, png, tiff};
use crate::files::write_whole;
use crate::{Error, Result};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::fmt::Display;
use std::io::Cursor;
use std::path::Path;

/// Quality of a JPEG, of 100.
const QUALITY: u8 = 92;

impl Picture {
    /// The picture as the bytes of a file. `depth` concerns PNG and TIFF alone.
    ///
    /// # Errors
    /// [`Error::Limit`] when a side is longer than the format can hold; [`Error::Invalid`] when an encoder refuses the picture, as
    /// JPEG does where not every pixel is opaque.
    pub fn encode(&self, format: Format, depth: Depth) -> Result<Vec<u8>> {
        let limit = format.entry().largest_side;
        let side = self.width().max(self.height());
        if side > limit {
            return Err(Error::Limit { what: format!("{}: pixels a side", format.title()), needed: side.into(), limit: limit.into() });
        }
        let (width, height) = (self.width(), self.height());
        match (format, depth) {
            (Format::Png, Depth::Eight) => png::rgba8(width, height, &self.to_rgba8()),
            (Format::Png, Depth::Sixteen) => png::rgba16(width, height, &self.to_rgba16()),
            (Format::Npy, _) => Ok(npy::encode(self)),
            (Format::Exr, _) => {
                let mut out = Cursor::new(Vec::new());
                let floats = bytemuck::cast_slice(self.pixels());
                let done = OpenExrEncoder::new(&mut out).write_image(floats, width, height, ExtendedColorType::Rgba32F);
                done.map_err(|e| refused(format, &e))?;
                Ok(out.into_inner())
            }
            (Format::Jpeg, _) => {
                let mut out = Vec::new();
                let encoder = JpegEncoder::new_with_quality(&mut out, QUALITY);
                encoder.write_image(&opaque(self)?, width, height, ExtendedColorType::Rgb8).map_err(|e| refused(format, &e))?;
                Ok(out)
            }
            (Format::WebP, _) => {
                let mut out = Vec::new();
                let encoder = WebPEncoder::new_lossless(&mut out);
                encoder.write_image(&self.to_rgba8(), width, height, ExtendedColorType::Rgba8).map_err(|e| refused(format, &e))?;
                Ok(out)
            }
            (Format::Tiff, _) => tiff::encode(self, depth).map_err(|e| refused(format, &e)),
        }
    }

    /// Writes the picture in the format of `path`'s extension; 8 bits a component unless `depth` says otherwise, which concerns PNG and
    /// TIFF alone.
    ///
    /// The file appears complete or not at all: it is written beside its place and moved there.
    ///
    /// # Errors
    /// [`Error::Format`] for an unknown extension, [`Error::Io`] when the file cannot be written, else as [`Picture::encode`].
    pub fn save(&self, path: impl AsRef<Path>, depth: Depth) -> Result<()> {
        let path = path.as_ref();
        let named = |e| match e {
            Error::Invalid(what) => Error::invalid(format!("{}: {what}", path.display())),
            other => other,
        };
        write_whole(path, &self.encode(Format::of_path(path)?, depth).map_err(named)?)
    }
}

/// The error for a picture that an encoder refuses, on one line.
pub(super) fn refused(format: Format, why: &dyn Display) -> Error {
    Error::invalid(super::decode::one_line(&format!("{}: {why}", format.title())))
}

/// 8-bit RGB of an opaque picture.
fn opaque(picture: &Picture) -> Result<Vec<u8>> {
    let rgba = picture.to_rgba8();
    let transparent = rgba.chunks_exact(4).filter(|p| p[3] < 255).count();
    if transparent > 0 {
        return Err(Error::invalid(format!(
            "JPEG: {transparent} of {} pixels are transparent, which a JPEG cannot hold: give a background or write .png",
            picture.pixels().len()
        )));
    }
    Ok(rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect())
}
