//! What the files hold that are written, by what other readers say of them.

use super::*;
use std::fs;
use std::io::Cursor;
use std::path::Path;

/// 5 x 3 pixels from transparent to opaque.
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
        let mut reader = ::png::Decoder::new(Cursor::new(&bytes)).read_info().expect("png");
        let info = reader.info();
        assert_eq!((info.width, info.height, info.color_type), (5, 3, ::png::ColorType::Rgba));
        assert!(info.gama_chunk.is_none() && info.srgb.is_none() && info.icc_profile.is_none());
        for chunk in [&b"gAMA"[..], b"sRGB", b"iCCP", b"cHRM", b"cICP", b"pHYs"] {
            assert!(!bytes.windows(4).any(|w| w == chunk));
        }
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
    let few = png::rgba8(2, 2, &[0; 15]).expect_err("too few").to_string();
    assert_eq!(few, "PNG: 15 bytes given for 2 x 2 pixels of Rgba8");
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
fn exr_has_four_channels_of_f32() {
    let bytes = picture().encode(Format::Exr, Depth::Eight).expect("encode");
    // The list in the order of the alphabet: a name, type 2 (32-bit float), whether numbers are linear to the eye, one sample a pixel.
    let mut list = Vec::new();
    for (name, linear) in [(b'A', 1), (b'B', 0), (b'G', 0), (b'R', 0)] {
        list.extend([name, 0, 2, 0, 0, 0, linear, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    list.push(0);
    let at = bytes.windows(16).position(|w| w == b"channels\0chlist\0").expect("list");
    assert_eq!(bytes[at + 20..at + 20 + list.len()], list);
}

#[test]
fn tiff_says_that_its_alpha_is_straight() {
    for (depth, bits) in [(Depth::Eight, 8), (Depth::Sixteen, 16)] {
        let bytes = picture().encode(Format::Tiff, depth).expect("encode");
        let mut decoder = ::tiff::decoder::Decoder::new(Cursor::new(&bytes)).expect("tiff");
        assert_eq!(decoder.dimensions().expect("size"), (5, 3));
        assert_eq!(decoder.colortype().expect("colours"), ::tiff::ColorType::RGBA(bits));
        let mut tag = |tag| decoder.find_tag_unsigned::<u16>(tag).expect("tag");
        assert_eq!((tag(::tiff::tags::Tag::ExtraSamples), tag(::tiff::tags::Tag::Compression)), (Some(2), Some(1)));
        // Another file of the same numbers, said to be premultiplied.
        let at = bytes.windows(8).position(|w| w == [82, 1, 3, 0, 1, 0, 0, 0]).expect("entry of tag 338");
        let mut premultiplied = bytes.clone();
        premultiplied[at + 8] = 1;
        let [straight, premultiplied] = [bytes, premultiplied].map(|b| Picture::decode(&b, "a.tif").expect("decode"));
        // Pixel 7: alpha 1/2, colour 1/4, 1/2, 1.
        let [s, p] = [straight.pixel(2, 1), premultiplied.pixel(2, 1)];
        for (c, color) in [0.25, 0.5, 1.0].into_iter().enumerate() {
            assert!((s[c] - 0.5 * color).abs() < 0.004 && (p[c] - color).abs() < 0.004, "{s:?} {p:?}");
        }
    }
}

#[test]
fn a_jpeg_holds_opaque_pictures_alone() {
    let why = picture().encode(Format::Jpeg, Depth::Eight).expect_err("transparent").to_string();
    assert_eq!(why, "JPEG: 14 of 15 pixels are transparent, which a JPEG cannot hold: give a background or write .png");
    let opaque = Picture::new(24, 16, (0..24 * 16).map(|i| [0.2, 0.4, (i % 24) as f32 / 24.0, 1.0]).collect());
    let bytes = opaque.encode(Format::Jpeg, Depth::Eight).expect("encode");
    let read = Picture::decode(&bytes, "a.jpg").expect("decode");
    let most = opaque.pixels().iter().flatten().zip(read.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(most < 0.04, "{most}");
}

#[test]
fn a_side_too_long_for_a_format_is_refused() {
    let long = Picture::new(16384, 1, vec![[0.0, 0.0, 0.0, 1.0]; 16384]);
    let why = long.encode(Format::WebP, Depth::Eight).expect_err("too long").to_string();
    assert_eq!(why, "WebP: pixels a side: 16384 is over the limit of 16383");
    let longer = Picture::new(1, 65536, vec![[0.0, 0.0, 0.0, 1.0]; 65536]);
    let why = longer.encode(Format::Jpeg, Depth::Eight).expect_err("too long").to_string();
    assert_eq!(why, "JPEG: pixels a side: 65536 is over the limit of 65535");
}

#[test]
fn names_and_first_bytes_tell_the_format() {
    for format in Format::ALL {
        assert_eq!(Format::of_name(format.name()), Some(format));
        for extension in format.extensions() {
            assert_eq!(Format::of_path(Path::new(&format!("a.b.{}", extension.to_uppercase()))).expect("extension"), format);
        }
        let opaque = Picture::new(1, 1, vec![[0.5, 0.25, 0.0, 1.0]]);
        let bytes = opaque.encode(format, Depth::Eight).expect("encode");
        assert_eq!(Format::of_start(&bytes[..12]), Some(format));
        assert_eq!(Format::of_start(&bytes[..2]), None);
        assert!(!format.about().is_empty());
    }
    assert_eq!(Format::of_start(b"RIFF\x10\0\0\0WAVEfmt "), None);
    assert_eq!(Format::choices(), ".png, .npy, .exr, .jpg, .webp or .tif");
    let why = Format::of_path(Path::new("a.GIF")).expect_err("not written").to_string();
    assert_eq!(why, "a.GIF: GIF is read but not written: use .png, .npy, .exr, .jpg, .webp or .tif");
}

#[test]
fn a_file_appears_whole_or_not_at_all() {
    let dir = tempfile::tempdir().expect("dir");
    let path = dir.path().join("a.PNG");
    picture().save(&path, Depth::Eight).expect("save");
    assert!(fs::read(&path).expect("read").starts_with(b"\x89PNG"));
    let bad = picture().save(dir.path().join("a.bmp"), Depth::Eight).expect_err("extension").to_string();
    assert!(bad.contains("a.bmp: unknown picture extension \"bmp\": use .png, .npy, .exr, .jpg, .webp or .tif"), "{bad}");
    let refused = picture().save(dir.path().join("a.jpg"), Depth::Eight).expect_err("transparent").to_string();
    assert!(refused.contains("a.jpg: JPEG: 14 of 15 pixels"), "{refused}");
    let nowhere = picture().save(dir.path().join("no/such/a.png"), Depth::Eight).expect_err("directory").to_string();
    assert!(nowhere.contains("no/such/a.png") && !nowhere.contains('\n'), "{nowhere}");
    // A directory in the way: refused, and nothing left beside it.
    fs::create_dir(dir.path().join("d.png")).expect("mkdir");
    picture().save(dir.path().join("d.png"), Depth::Eight).expect_err("directory in the way");
    let mut left: Vec<_> = fs::read_dir(dir.path()).expect("list").map(|e| e.expect("entry").file_name()).collect();
    left.sort();
    assert_eq!(left, ["a.PNG", "d.png"]);
}
