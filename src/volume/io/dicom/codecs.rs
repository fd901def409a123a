//! Frames that are compressed by JPEG, JPEG-LS and JPEG 2000. Their own headers are held against the file's before they are decoded.
//!
//! Sources: ITU-T T.81 (JPEG), T.87 (JPEG-LS), T.800 (JPEG 2000) for the headers; DICOM PS3.5, sections 8.2 and A.4, for what may be used.

use super::image::{Image, Layout, Photometric};
use super::rle;
use super::syntax::Codec;
use jpeg_decoder::{ColorTransform, Decoder};

/// What the header of a JPEG or JPEG-LS stream says.
struct Jpeg {
    bits: u8,
    rows: usize,
    columns: usize,
    samples: usize,
    /// The second byte of the marker that the frame starts with.
    marker: u8,
    /// Whether it says of itself that its colours are brightness and differences.
    is_ybr: bool,
}

impl Jpeg {
    /// Looks at the segments before the first scan.
    fn of(data: &[u8]) -> Result<Self, String> {
        if !data.starts_with(&[0xff, 0xd8]) {
            return Err("the frame is no JPEG stream: it does not start with FF D8".to_owned());
        }
        let (mut at, mut is_ybr, mut found) = (2, false, None);
        loop {
            let Some(&[0xff, marker, high, low]) = data.get(at..at + 4) else {
                return Err(format!("the JPEG stream has no marker at byte {at}"));
            };
            // Any number of FF may stand before a marker.
            if marker == 0xff {
                at += 1;
                continue;
            }
            let length = usize::from(u16::from_be_bytes([high, low]));
            let segment = data.get(at + 4..at + 2 + length).unwrap_or_default();
            match marker {
                0xe0 => is_ybr |= segment.starts_with(b"JFIF"),
                0xee => is_ybr |= segment.starts_with(b"Adobe") && segment.get(11) == Some(&1),
                0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf | 0xf7 => {
                    let &[bits, r1, r0, c1, c0, samples, ..] = segment else {
                        return Err("the JPEG stream's frame header is cut short".to_owned());
                    };
                    if found.is_some() {
                        return Err("the JPEG stream has two frame headers".to_owned());
                    }
                    let (rows, columns) = (usize::from(u16::from_be_bytes([r1, r0])), usize::from(u16::from_be_bytes([c1, c0])));
                    found = Some(Self { bits, rows, columns, samples: samples.into(), marker, is_ybr: false });
                }
                0xda => {
                    return found.map(|f| Self { is_ybr, ..f }).ok_or_else(|| "the JPEG stream has no frame header".to_owned());
                }
                _ => {}
            }
            at += 2 + length.max(2);
        }
    }

    fn check(&self, layout: &Layout) -> Result<(), String> {
        same_size("JPEG stream", [self.columns, self.rows, self.samples], u32::from(self.bits), layout)
    }
}

fn same_size(what: &str, [columns, rows, samples]: [usize; 3], bits: u32, layout: &Layout) -> Result<(), String> {
    if [columns, rows, samples] != [layout.columns, layout.rows, layout.samples] || bits > layout.allocated || bits == 0 {
        return Err(format!(
            "the {what} holds {columns} x {rows} pixels of {samples} x {bits} bits, the header says {} x {} of {} x {}",
            layout.columns, layout.rows, layout.samples, layout.allocated
        ));
    }
    Ok(())
}

/// The frame that `data` holds: in this machine's byte order, the samples of a pixel one after the other, colours as the file's photometric
/// interpretation says.
///
/// # Errors
/// When it is damaged, or not of the size that the file's header says.
pub(super) fn decode(image: &Image, data: &[u8]) -> Result<Vec<u8>, String> {
    let layout = &image.layout;
    let out = match image.syntax.codec {
        Codec::Rle => rle::decode(data, layout)?,
        Codec::Jpeg => jpeg(data, layout)?,
        Codec::JpegLs => jpeg_ls(data, layout)?,
        Codec::Jpeg2000 => jpeg_2000(data, layout)?,
        Codec::Native | Codec::Bare | Codec::Unread => return Err(format!("{} is not decoded", image.syntax.name)),
    };
    if out.len() != layout.frame_bytes() {
        return Err(format!("a frame was decoded to {} bytes, the header says {}", out.len(), layout.frame_bytes()));
    }
    Ok(out)
}

/// Numbers of 8 or 16 bits as many bits as they have in the file.
fn widened(values: impl ExactSizeIterator<Item = i32>, layout: &Layout) -> Vec<u8> {
    match layout.kind().bytes() {
        1 => values.map(|v| v as u8).collect(),
        2 => values.flat_map(|v| (v as u16).to_ne_bytes()).collect(),
        _ => values.flat_map(i32::to_ne_bytes).collect(),
    }
}

fn jpeg(data: &[u8], layout: &Layout) -> Result<Vec<u8>, String> {
    let head = Jpeg::of(data)?;
    head.check(layout)?;
    let lossless = head.marker == 0xc3;
    if !lossless && head.bits != 8 {
        return Err(format!("JPEG of {} bits is read only where it is lossless", head.bits));
    }
    let mut decoder = Decoder::new(data);
    decoder.set_max_decoding_buffer_size(layout.pixels() * layout.samples * 2);
    if layout.samples == 3 {
        // Taken as they are, unless the stream contradicts the file's header.
        let convert = head.is_ybr && layout.photometric == Photometric::Rgb && !lossless;
        decoder.set_color_transform(if convert { ColorTransform::YCbCr } else { ColorTransform::RGB });
    }
    let out = decoder.decode().map_err(|e| format!("the JPEG stream is damaged: {e}"))?;
    let count = layout.pixels() * layout.samples;
    if out.len() == count {
        return Ok(if layout.kind().bytes() == 1 { out } else { widened(out.iter().map(|&v| v.into()), layout) });
    }
    if out.len() != 2 * count {
        return Err(format!("the JPEG stream holds {} bytes, {count} numbers are needed", out.len()));
    }
    Ok(widened(out.chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]]).into()), layout))
}

fn jpeg_ls(data: &[u8], layout: &Layout) -> Result<Vec<u8>, String> {
    let head = Jpeg::of(data)?;
    head.check(layout)?;
    if head.samples != 1 {
        return Err("JPEG-LS of colours is not supported".to_owned());
    }
    let (columns, rows) = (layout.columns as u32, layout.rows as u32);
    let (values, ..) = jpegls::decode(data, columns, rows).map_err(|e| format!("the JPEG-LS stream is damaged: {e}"))?;
    Ok(widened(values.iter().map(|&v| v.into()), layout))
}

#[cfg(not(feature = "jpeg2000"))]
fn jpeg_2000(_: &[u8], _: &Layout) -> Result<Vec<u8>, String> {
    Err("JPEG 2000 is read only by builds with the feature `jpeg2000`".to_owned())
}

#[cfg(feature = "jpeg2000")]
fn jpeg_2000(data: &[u8], layout: &Layout) -> Result<Vec<u8>, String> {
    super::jpeg2000::decode(data, layout, |size, bits| same_size("JPEG 2000 stream", size, bits, layout))
        .map(|values| widened(values.into_iter(), layout))
}
