//! One image of a stack: its header first, then its pixels.

use super::names::Kind;
use crate::volume::VoxelType;
use crate::volume::io::folder::Folder;
use crate::volume::io::slices::{Alpha, Color, Pixels};
use crate::volume::io::store::{Places, Store};
use crate::volume::io::tiff::Single;
use crate::{Error, Result, files};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{BufReader, Read, Seek, SeekFrom};

/// Memory that a decoder may take beside two copies of the pixels.
const BESIDE: u64 = 16 << 20;
/// Pixels that a file may claim whatever its length.
const FEW_PIXELS: u64 = 1 << 20;
/// Most pixels that a byte of a file may stand for beyond that: deflate makes at most 1032 bytes of one, eight pixels to a byte.
const PIXELS_A_BYTE: u64 = 8 * 1032;

/// An image whose header is read.
pub(super) enum Picture {
    Tiff(Box<Single>),
    Other { places: Places, decoder: Box<dyn ImageDecoder>, pixels: Pixels },
}

impl Picture {
    /// Reads the header of the image `name` in `folder`, which its name tells to be of `kind`.
    ///
    /// # Errors
    /// When it is of another kind, claims more pixels than it can hold, or is not supported.
    pub(super) fn open(folder: &Folder, name: &str, kind: Kind) -> Result<Self> {
        let Some(source) = folder.at(name)? else {
            return Err(Error::format(folder.path(), format!("{name:?} is gone while the folder is read")));
        };
        let store = Store::File(source);
        let format = match kind {
            Kind::Tiff => return Single::open(store).map(|single| Self::Tiff(Box::new(single))),
            Kind::Png => ImageFormat::Png,
            Kind::Jpeg => ImageFormat::Jpeg,
            Kind::Bmp => ImageFormat::Bmp,
            Kind::Pnm => ImageFormat::Pnm,
        };
        Self::other(store.places("an image")?, kind, format)
    }

    fn other(places: Places, kind: Kind, format: ImageFormat) -> Result<Self> {
        let io = |e| Error::io(places.path(), e);
        let mut file = files::open(places.path()).map_err(io)?;
        let mut head = Vec::new();
        (&mut file).take(32).read_to_end(&mut head).map_err(io)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        if image::guess_format(&head).ok() != Some(format) {
            let shown = head[..head.len().min(8)].escape_ascii();
            return Err(places.fault(format!("no {kind} image: it starts with \"{shown}\"")));
        }
        let claim = |width: u64, height: u64| {
            let count = width.saturating_mul(height);
            if count > FEW_PIXELS && count > PIXELS_A_BYTE.saturating_mul(places.length()) {
                let length = places.length();
                return Err(places.fault(format!("{kind} image of {length} bytes: it cannot hold {width} x {height} pixels")));
            }
            Ok(())
        };
        // The decoder takes memory for rows before it tells their length.
        if let (Kind::Png, Some(&[a, b, c, d, e, f, g, h])) = (kind, head.get(16..24)) {
            claim(u32::from_be_bytes([a, b, c, d]).into(), u32::from_be_bytes([e, f, g, h]).into())?;
        }
        let fault = |e: image::ImageError| places.fault(format!("{kind} image: {}", one_line(&e.to_string())));
        let limited = |bytes: u64| {
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some(bytes);
            limits
        };
        let mut reader = ImageReader::with_format(BufReader::new(file), format);
        // A JPEG file is read whole.
        reader.limits(limited(BESIDE.saturating_add(places.length())));
        let mut decoder = reader.into_decoder().map_err(fault)?;
        let (width, height) = decoder.dimensions();
        claim(width.into(), height.into())?;
        if width == 0 || height == 0 {
            return Err(places.fault(format!("{kind} image of {width} x {height} pixels")));
        }
        decoder.set_limits(limited(decoder.total_bytes().saturating_mul(2).saturating_add(BESIDE))).map_err(fault)?;
        use VoxelType::{U8, U16};
        let (kind_of, samples, color) = match decoder.color_type() {
            ColorType::L8 => (U8, 1, Color::Grey),
            ColorType::L16 => (U16, 1, Color::Grey),
            ColorType::La8 => (U8, 2, Color::GreyAlpha),
            ColorType::La16 => (U16, 2, Color::GreyAlpha),
            ColorType::Rgb8 => (U8, 3, Color::Rgb(Alpha::None)),
            ColorType::Rgb16 => (U16, 3, Color::Rgb(Alpha::None)),
            ColorType::Rgba8 => (U8, 4, Color::Rgb(Alpha::Straight)),
            ColorType::Rgba16 => (U16, 4, Color::Rgb(Alpha::Straight)),
            other => return Err(places.fault(format!("{kind} image of {other:?} pixels: not supported"))),
        };
        let pixels = Pixels { width: width as usize, height: height as usize, stored: kind_of.into(), samples, color };
        Ok(Self::Other { places, decoder: Box::new(decoder), pixels })
    }

    /// What its pixels are.
    pub(super) fn pixels(&self) -> Pixels {
        match self {
            Self::Tiff(single) => single.pixels,
            Self::Other { pixels, .. } => *pixels,
        }
    }

    /// What is to be told of how its numbers are read.
    pub(super) fn notes(&self) -> Vec<String> {
        match self {
            Self::Tiff(single) => single.notes(),
            Self::Other { .. } => Vec::new(),
        }
    }

    /// Whether it is one of several files that a description in it tells the order of.
    pub(super) fn is_part(&self) -> bool {
        matches!(self, Self::Tiff(single) if single.is_part())
    }

    /// Reads the numbers of all pixels, in this machine's order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub(super) fn decode(self, out: &mut [u8]) -> Result<()> {
        match self {
            Self::Tiff(single) => single.decode(out),
            Self::Other { places, decoder, .. } => {
                if decoder.total_bytes() != out.len() as u64 {
                    return Err(places.fault("it changes while it is read"));
                }
                decoder.read_image_boxed(out).map_err(|e| places.fault(one_line(&format!("its pixels are damaged: {e}"))))
            }
        }
    }

    /// An error about this image.
    pub(super) fn changed(&self) -> Error {
        let what = "it changes while it is read";
        match self {
            Self::Tiff(single) => single.fault(what),
            Self::Other { places, .. } => places.fault(what),
        }
    }
}

/// A message of a library on one line.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
