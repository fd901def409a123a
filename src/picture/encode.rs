//! Pictures to files: PNG, NumPy and OpenEXR.

use super::Picture;
use crate::{Error, Result};
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;

/// A picture file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// PNG with straight alpha, 8 or 16 bits a component. Numbers are stored as they are: no gamma chunk, no conversion.
    Png,
    /// NumPy array: height x width x 4, little-endian f32, C order, premultiplied RGBA, row 0 on top.
    Npy,
    /// OpenEXR: premultiplied RGBA in f32, lossless.
    Exr,
}

/// Bits of a PNG's components.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depth {
    /// 8 bits, rounded to nearest.
    #[default]
    Eight,
    /// 16 bits, rounded to nearest.
    Sixteen,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Png, Self::Npy, Self::Exr];

    /// The file name extension, without the dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Npy => "npy",
            Self::Exr => "exr",
        }
    }

    /// The format that `path`'s extension asks for.
    ///
    /// # Errors
    /// [`Error::Format`] that lists the known extensions.
    pub fn of_path(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        Self::ALL
            .into_iter()
            .find(|f| extension.eq_ignore_ascii_case(f.name()))
            .ok_or_else(|| Error::format(path, format!("unknown picture extension \"{extension}\": use .png, .npy or .exr")))
    }
}

impl Picture {
    /// The picture as the bytes of a file. `depth` concerns PNG alone.
    ///
    /// # Errors
    /// [`Error::Invalid`] when an encoder refuses the picture.
    pub fn encode(&self, format: Format, depth: Depth) -> Result<Vec<u8>> {
        match format {
            Format::Png => png_bytes(self, depth),
            Format::Npy => Ok(npy_bytes(self)),
            Format::Exr => exr_bytes(self),
        }
    }

    /// Writes the picture in the format of `path`'s extension; an 8-bit PNG unless `depth` says otherwise.
    ///
    /// The file appears complete or not at all: it is written beside its place and moved there.
    ///
    /// # Errors
    /// [`Error::Format`] for an unknown extension, [`Error::Io`] when the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>, depth: Depth) -> Result<()> {
        let path = path.as_ref();
        let bytes = self.encode(Format::of_path(path)?, depth)?;
        write_whole(path, &bytes)
    }
}

/// Writes `bytes` to `path` through a file beside it, so that `path` holds all of them or stays as it was.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let Some(name) = path.file_name() else {
        return Err(Error::format(path, "names no file"));
    };
    // A device or a pipe cannot be replaced, only written to.
    if path.exists() && !path.is_file() {
        return fs::write(path, bytes).map_err(|e| Error::io(path, e));
    }
    // A link stays one: what it points to is replaced.
    let real = if path.is_symlink() { path.canonicalize().map_err(|e| Error::io(path, e))? } else { path.to_path_buf() };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.part", std::process::id()));
    let part = real.with_file_name(hidden);
    let written = fs::File::create(&part).and_then(|mut f| f.write_all(bytes)).and_then(|()| fs::rename(&part, &real));
    written.map_err(|e| {
        // Whatever there is of it goes; the first error is the one to report.
        drop(fs::remove_file(&part));
        Error::io(path, e)
    })
}

fn png_bytes(picture: &Picture, depth: Depth) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Rgba);
    let data = match depth {
        Depth::Eight => picture.to_rgba8(),
        Depth::Sixteen => {
            encoder.set_depth(png::BitDepth::Sixteen);
            picture.to_rgba16().iter().flat_map(|c| c.to_be_bytes()).collect()
        }
    };
    let refused = |e: png::EncodingError| Error::invalid(format!("png: {e}"));
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(&data).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(out)
}

/// NumPy format 1.0: magic, version, header length, a Python dictionary padded to a multiple of 64, the numbers.
fn npy_bytes(picture: &Picture) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 4), }}", picture.height(), picture.width());
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut out = Vec::with_capacity(10 + header.len() + picture.pixels().len() * 16);
    out.extend_from_slice(b"\x93NUMPY\x01\x00");
    // Below 200 bytes for any picture size.
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    if cfg!(target_endian = "little") {
        out.extend_from_slice(bytemuck::cast_slice(picture.pixels()));
    } else {
        out.extend(picture.pixels().iter().flatten().flat_map(|c| c.to_le_bytes()));
    }
    out
}

fn exr_bytes(picture: &Picture) -> Result<Vec<u8>> {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let channels = SpecificChannels::rgba(|Vec2(x, y)| {
        let [r, g, b, a] = picture.pixels()[y * width + x];
        (r, g, b, a)
    });
    let mut out = Cursor::new(Vec::new());
    let image = Image::from_channels((width, height), channels);
    image.write().non_parallel().to_buffered(&mut out).map_err(|e| Error::invalid(format!("exr: {e}")))?;
    Ok(out.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let pixels = (0..15).map(|i| {
            let a = i as f32 / 14.0;
            [a * 0.25, a * 0.5, a * 1.0, a]
        });
        Picture::new(5, 3, pixels.collect())
    }

    #[test]
    fn png_holds_straight_colours_and_no_colour_space() {
        for depth in [Depth::Eight, Depth::Sixteen] {
            let bytes = picture().encode(Format::Png, depth).expect("encode");
            let mut reader = png::Decoder::new(Cursor::new(&bytes)).read_info().expect("png");
            let info = reader.info();
            assert_eq!((info.width, info.height, info.color_type), (5, 3, png::ColorType::Rgba));
            assert!(info.gama_chunk.is_none() && info.srgb.is_none() && info.icc_profile.is_none());
            let mut data = vec![0; reader.output_buffer_size().expect("size")];
            reader.next_frame(&mut data).expect("frame");
            match depth {
                Depth::Eight => {
                    assert_eq!(data, picture().to_rgba8());
                    // The first pixel is transparent, the last opaque, colours straight.
                    assert_eq!((&data[..4], &data[56..]), (&[0, 0, 0, 0][..], &[64, 128, 255, 255][..]));
                }
                Depth::Sixteen => {
                    let data: Vec<u16> = data.chunks(2).map(|c| u16::from_be_bytes([c[0], c[1]])).collect();
                    assert_eq!(data, picture().to_rgba16());
                    assert_eq!(data[56..], [16384, 32768, 65535, 65535]);
                }
            }
        }
    }

    #[test]
    fn npy_has_the_layout_numpy_states() {
        let bytes = picture().encode(Format::Npy, Depth::Eight).expect("encode");
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let header = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
        assert_eq!((10 + header) % 64, 0);
        let text = std::str::from_utf8(&bytes[10..10 + header]).expect("ascii");
        assert!(text.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 5, 4), }") && text.ends_with('\n'));
        let numbers: Vec<f32> = bytes[10 + header..].chunks(4).map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
        let want: Vec<f32> = picture().pixels().iter().flatten().copied().collect();
        assert_eq!(numbers, want);
    }

    #[test]
    fn exr_gives_the_same_numbers_back() {
        use exr::prelude::{ReadChannels, ReadLayers, read};
        let bytes = picture().encode(Format::Exr, Depth::Eight).expect("encode");
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, _| (size.width(), vec![[0.0f32; 4]; size.area()]),
                |(width, pixels), at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b, a],
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .expect("exr");
        assert_eq!(image.layer_data.channel_data.pixels.1, picture().pixels());
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let dir = tempfile::tempdir().expect("dir");
        let path = dir.path().join("a.PNG");
        picture().save(&path, Depth::Eight).expect("save");
        assert!(fs::read(&path).expect("read").starts_with(b"\x89PNG"));
        let bad = picture().save(dir.path().join("a.jpg"), Depth::Eight).expect_err("extension").to_string();
        assert!(bad.contains("a.jpg: unknown picture extension \"jpg\": use .png, .npy or .exr"), "{bad}");
        let nowhere = picture().save(dir.path().join("no/such/a.png"), Depth::Eight).expect_err("directory").to_string();
        assert!(nowhere.contains("no/such/a.png") && !nowhere.contains('\n'), "{nowhere}");
        // A directory in the way: refused, and nothing left beside it.
        fs::create_dir(dir.path().join("d.png")).expect("mkdir");
        picture().save(dir.path().join("d.png"), Depth::Eight).expect_err("directory in the way");
        let mut left: Vec<_> = fs::read_dir(dir.path()).expect("list").map(|e| e.expect("entry").file_name()).collect();
        left.sort();
        assert_eq!(left, ["a.PNG", "d.png"]);
    }
}
