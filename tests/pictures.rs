//! Picture files read back: what was written, what other programs write, and what no picture is.

#![cfg(feature = "encoders")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use png::{BitDepth, ColorType};
use slicestack::picture::{Depth, Format};
use slicestack::{Error, Picture};
use std::fs;

/// Premultiplied pixels of all kinds: transparent, faint, opaque, of any colour.
fn varied(width: u32, height: u32) -> Picture {
    let mut state = 7u32;
    let mut random = || {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 8) as f32 / 16777216.0
    };
    let pixel = |i: u32| {
        let a = match i % 4 {
            0 => 0.0,
            1 => 1.0,
            // No alpha that rounds to 0: a file of 8 bits would keep the colour, reading it would not.
            2 => 0.004 + random() * 0.01,
            _ => 0.01 + 0.99 * random(),
        };
        [a * random(), a * random(), a * random(), a]
    };
    Picture::from_pixels(width, height, (0..width * height).map(pixel).collect()).unwrap()
}

/// The same colours before white.
fn opaque(picture: &Picture) -> Picture {
    let pixels = picture.pixels().iter().map(|&[r, g, b, a]| [r + 1.0 - a, g + 1.0 - a, b + 1.0 - a, 1.0]).collect();
    Picture::from_pixels(picture.width(), picture.height(), pixels).unwrap()
}

/// Largest difference of two components.
fn difference(a: &Picture, b: &Picture) -> f32 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    a.pixels().iter().flatten().zip(b.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn what_is_saved_opens_again() {
    let dir = tempfile::tempdir().unwrap();
    for (width, height) in [(1, 1), (7, 5), (64, 33)] {
        let picture = varied(width, height);
        for format in Format::ALL {
            for depth in [Depth::Eight, Depth::Sixteen] {
                let picture = if format == Format::Jpeg { opaque(&picture) } else { picture.clone() };
                let path = dir.path().join(format!("a.{}", format.name()));
                picture.save(&path, depth).unwrap();
                let read = Picture::open(&path).unwrap();
                // A premultiplied component is a product of two that were each rounded by half a step.
                let steps = match (format, depth) {
                    (Format::Npy | Format::Exr, _) => {
                        assert_eq!(read.sha256(), picture.sha256(), "{format:?}");
                        continue;
                    }
                    (Format::Jpeg, _) if width > 1 => continue,
                    (Format::Png | Format::Tiff, Depth::Sixteen) => 65535.0,
                    (Format::Jpeg, _) => 60.0,
                    _ => 255.0,
                };
                assert!(difference(&read, &picture) <= 1.001 / steps, "{format:?} {depth:?}: {}", difference(&read, &picture) * steps);
                // What the file holds does not change by being read and written again.
                if format != Format::Jpeg {
                    assert_eq!(read.encode(format, depth).unwrap(), fs::read(&path).unwrap(), "{format:?} {depth:?}");
                }
            }
        }
    }
}

#[test]
fn floats_come_back_to_the_bit_whatever_they_are() {
    let numbers = [0.0, -0.0, 1.0e-45, -3.5, 1.0e30, f32::INFINITY, f32::MIN_POSITIVE, 0.1];
    let pixels: Vec<[f32; 4]> = numbers.iter().map(|&n| [n, -n, 0.5 * n, n]).collect();
    let picture = Picture::from_pixels(4, 2, pixels).unwrap();
    for format in [Format::Npy, Format::Exr] {
        let read = Picture::decode(&picture.encode(format, Depth::Eight).unwrap(), "a").unwrap();
        let bits = |p: &Picture| p.pixels().iter().flatten().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&picture), "{format:?}");
    }
}

/// A PNG of 2 x 1 pixels.
fn png(color: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 2, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ColorType::Indexed {
        encoder.set_palette(vec![255, 0, 0, 0, 51, 255]);
        encoder.set_trns(vec![255, 51]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    out
}

#[test]
fn every_kind_of_png_opens() {
    let red = [1.0, 0.0, 0.0, 1.0];
    for (color, depth, data, want) in [
        (ColorType::Grayscale, BitDepth::One, &[0x40][..], [[0.0, 0.0, 0.0, 1.0], [1.0; 4]]),
        (ColorType::Grayscale, BitDepth::Eight, &[51, 255], [[0.2, 0.2, 0.2, 1.0], [1.0; 4]]),
        (
            ColorType::Grayscale,
            BitDepth::Sixteen,
            &[51, 51, 0, 1],
            [[0.2, 0.2, 0.2, 1.0], [1.0 / 65535.0, 1.0 / 65535.0, 1.0 / 65535.0, 1.0]],
        ),
        (ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 51, 51, 0], [[0.2; 4], [0.0; 4]]),
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen, &[255, 255, 51, 51, 51, 51, 0, 0], [[0.2; 4], [0.0; 4]]),
        (ColorType::Rgb, BitDepth::Eight, &[255, 0, 0, 51, 102, 153], [red, [0.2, 0.4, 0.6, 1.0]]),
        (ColorType::Rgb, BitDepth::Sixteen, &[255, 255, 0, 0, 0, 0, 51, 51, 102, 102, 153, 153], [red, [0.2, 0.4, 0.6, 1.0]]),
        (ColorType::Rgba, BitDepth::Eight, &[255, 0, 0, 255, 255, 51, 0, 51], [red, [0.2, 0.04, 0.0, 0.2]]),
        (
            ColorType::Rgba,
            BitDepth::Sixteen,
            &[255, 255, 0, 0, 0, 0, 255, 255, 255, 255, 51, 51, 0, 0, 51, 51],
            [red, [0.2, 0.04, 0.0, 0.2]],
        ),
        (ColorType::Indexed, BitDepth::Eight, &[0, 1], [red, [0.0, 0.04, 0.2, 0.2]]),
        (ColorType::Indexed, BitDepth::Four, &[0x01], [red, [0.0, 0.04, 0.2, 0.2]]),
    ] {
        let read = Picture::decode(&png(color, depth, data), "a.png").unwrap();
        let want = Picture::from_pixels(2, 1, want.to_vec()).unwrap();
        assert!(difference(&read, &want) < 1e-6, "{color:?} {depth:?}: {:?}", read.pixels());
    }
}

/// A GIF of 2 x 1 pixels, red and transparent, and a second frame, blue and red.
const GIF: &[u8] = b"GIF89a\x02\0\x01\0\x80\0\0\xff\0\0\0\0\xff\
    \x21\xf9\x04\x01\0\0\x01\0\x2c\0\0\0\0\x02\0\x01\0\0\x02\x02\x44\x0a\0\
    \x21\xf9\x04\0\0\0\0\0\x2c\0\0\0\0\x02\0\x01\0\0\x02\x02\x0c\x0a\0\x3b";

#[test]
fn gif_and_pnm_open() {
    let red = [1.0, 0.0, 0.0, 1.0];
    assert_eq!(Picture::decode(GIF, "a.gif").unwrap().pixels(), [red, [0.0; 4]]);
    let grey = |v: f32| [v, v, v, 1.0];
    for (bytes, want) in [
        (&b"P1\n# a bit each\n2 1\n0 1\n"[..], [[1.0; 4], grey(0.0)]),
        (b"P2 2 1 255 51 255\n", [grey(0.2), grey(1.0)]),
        (b"P3\n2 1\n255\n255 0 0 0 0 255\n", [red, [0.0, 0.0, 1.0, 1.0]]),
        (b"P4\n2 1\n\x80", [grey(0.0), grey(1.0)]),
        (b"P5\n2 1\n65535\n\x33\x33\xff\xff", [grey(0.2), grey(1.0)]),
        (b"P6\n2 1\n255\n\xff\0\0\0\0\xff", [red, [0.0, 0.0, 1.0, 1.0]]),
        (b"P7\nWIDTH 2\nHEIGHT 1\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n\xff\0\0\xff\xff\0\0\0", [red, [0.0; 4]]),
    ] {
        let read = Picture::decode(bytes, "a.pnm").unwrap_or_else(|e| panic!("{}: {e}", bytes.escape_ascii()));
        let want = Picture::from_pixels(2, 1, want.to_vec()).unwrap();
        assert!(difference(&read, &want) < 1e-6, "{}: {:?}", bytes.escape_ascii(), read.pixels());
    }
}

/// An .npy file with this header.
fn npy(header: &str, numbers: usize) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\0".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(vec![0; numbers]);
    bytes
}

#[test]
fn arrays_that_are_no_pictures_are_refused() {
    let header = |descr: &str, order: &str, shape: &str| format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
    for (bytes, want) in [
        (npy(&header("'<f8'", "False", "(2, 3, 4)"), 192), "a.npy: a NumPy array of type <f8: a picture is of little-endian f32, '<f4'"),
        (npy(&header("'>f4'", "False", "(2, 3, 4)"), 96), "type >f4"),
        (npy(&header("'<f4'", "True", "(2, 3, 4)"), 96), "a NumPy array with fortran_order True: a picture is in C order, False"),
        (npy(&header("'<f4'", "False", "(2, 3, 3)"), 72), "a NumPy array of shape (2, 3, 3): a picture is height x width x 4"),
        (npy(&header("'<f4'", "False", "(24,)"), 96), "of shape (24,)"),
        (npy(&header("'<f4'", "False", "(2, -3, 4)"), 96), "of shape (2, -3, 4)"),
        (npy(&header("'<f4'", "False", "(0, 3, 4)"), 0), "NumPy of 3 x 0 pixels: sides must lie between 1 and 32768"),
        (npy(&header("'<f4'", "False", "(2, 32769, 4)"), 16), "NumPy of 32769 x 2 pixels: sides must lie between 1 and 32768"),
        (npy(&header("'<f4'", "False", "(99999999999999999999, 3, 4)"), 16), "of shape (99999999999999999999, 3, 4)"),
        (
            npy(&header("'<f4'", "False", "(32768, 32768, 4)"), 16),
            "NumPy of 16 bytes: claims 32768 x 32768 pixels, more than these can hold",
        ),
        (npy(&header("'<f4'", "False", "(2, 3, 4)"), 95), "95 bytes of numbers, where 2 x 3 x 4 of f32 take 96"),
        (npy(&header("'<f4'", "False", "(2, 3, 4)"), 97), "97 bytes of numbers, where 2 x 3 x 4 of f32 take 96"),
        (npy("{'descr': '<f4', 'fortran_order': False}\n", 96), "the NumPy header has no key 'shape'"),
        (b"\x93NUMPY\x07\0\x02\0{}".to_vec(), "NumPy format version 7: 1, 2 and 3 are known"),
        (b"\x93NUMPY\x01\0\xff\xff{}".to_vec(), "a NumPy array of 12 bytes: it ends within its header"),
    ] {
        let line = Picture::decode(&bytes, "a.npy").unwrap_err().to_string();
        assert!(line.starts_with("a.npy: ") && line.contains(want) && !line.contains('\n'), "{line}");
    }
    // Later versions, double quotes and other spacing are NumPy's to choose.
    let mut later = b"\x93NUMPY\x03\0".to_vec();
    let text = b"{\"shape\":(1,1,4),\"fortran_order\":False,\"descr\":\"<f4\"}";
    later.extend((text.len() as u32).to_le_bytes());
    later.extend(text);
    later.extend([0.25f32, 0.5, 0.75, 1.0].iter().flat_map(|n| n.to_le_bytes()));
    assert_eq!(Picture::decode(&later, "a").unwrap().pixels(), [[0.25, 0.5, 0.75, 1.0]]);
}

/// A file of each kind that is read, and its name.
fn files() -> Vec<(String, Vec<u8>)> {
    let picture = varied(9, 6);
    let mut all: Vec<(String, Vec<u8>)> = Vec::new();
    for format in Format::ALL {
        let picture = if format == Format::Jpeg { opaque(&picture) } else { picture.clone() };
        all.push((format!("a.{}", format.name()), picture.encode(format, Depth::Eight).unwrap()));
    }
    all.push(("a.gif".into(), GIF.to_vec()));
    all.push(("a.ppm".into(), b"P6\n2 1\n255\n\xff\0\0\0\0\xff".to_vec()));
    all
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    for (name, bytes) in files() {
        // What follows the pixels is not needed in all formats.
        let needed = match name.as_str() {
            "a.png" => bytes.len() - 12,
            "a.jpg" => bytes.len() - 2,
            "a.gif" => 41,
            "a.webp" => bytes.len() - 1,
            _ => bytes.len(),
        };
        assert!(Picture::decode(&bytes, &name).is_ok(), "{name}");
        for length in 0..needed {
            match Picture::decode(&bytes[..length], &name) {
                Err(e) => {
                    let line = e.to_string();
                    assert!(line.starts_with(&format!("{name}: ")) && !line.contains('\n') && line.len() < 300, "{line}");
                }
                Ok(read) => assert_eq!((name.as_str(), read.width()), ("a.jpg", 9), "{length} of {} bytes", bytes.len()),
            }
        }
    }
}

#[test]
fn changed_bytes_neither_panic_nor_take_more_than_the_file_can_hold() {
    for (name, bytes) in files() {
        for at in 0..bytes.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff, bytes[at] ^ 1, bytes[at].wrapping_add(1)] {
                let mut changed = bytes.clone();
                changed[at] = value;
                match Picture::decode(&changed, &name) {
                    Ok(read) => assert!(read.pixels().len() <= 1 << 22, "{name}: {} x {}", read.width(), read.height()),
                    Err(e) => assert!(e.to_string().starts_with(&format!("{name}: ")), "{e}"),
                }
            }
        }
    }
}

#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let claim = |name: &str, at: usize, sizes: &[&[u8]]| {
        let mut bytes = files().into_iter().find(|f| f.0 == name).unwrap().1;
        for (i, size) in sizes.iter().enumerate() {
            bytes[at + i * size.len()..][..size.len()].copy_from_slice(size);
        }
        Picture::decode(&bytes, name).unwrap_err().to_string()
    };
    let place = |name: &str, mark: &[u8]| {
        let bytes = files().into_iter().find(|f| f.0 == name).unwrap().1;
        bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len()
    };
    let (most, over) = (32768u32, 32769u32);
    for (line, want) in [
        (claim("a.png", 16, &[&over.to_be_bytes(), &[0, 0, 0, 1]]), "PNG of 32769 x 1 pixels: sides must lie between 1 and 32768"),
        (claim("a.png", 16, &[&[0; 4]]), "PNG of 0 x 6 pixels"),
        (claim("a.png", 16, &[&most.to_be_bytes(), &most.to_be_bytes()]), "claims 32768 x 32768 pixels, more than these can hold"),
        (claim("a.exr", place("a.exr", b"dataWindow\0box2i\0\x10\0\0\0") + 8, &[&most.to_le_bytes()]), "OpenEXR of 32769 x 6 pixels"),
        (claim("a.exr", place("a.exr", b"displayWindow\0box2i\0\x10\0\0\0") + 12, &[&over.to_le_bytes()]), "OpenEXR of 9 x 32770 pixels"),
        (claim("a.tif", place("a.tif", b"\0\x01\x04\0\x01\0\0\0"), &[&over.to_le_bytes()]), "TIFF of 32769 x 6 pixels"),
        (claim("a.jpg", place("a.jpg", b"\xff\xc0\0\x11\x08"), &[&[0xff, 0xff], &[0, 1]]), "JPEG of 1 x 65535 pixels"),
        (claim("a.gif", 6, &[&[0, 0x40], &[0, 0x40]]), "GIF of 66 bytes: claims 16384 x 16384 pixels, more than these can hold"),
        (claim("a.ppm", 3, &[b"99999"]), "PNM of "),
    ] {
        assert!(line.contains(want), "{line}");
    }
}

#[test]
fn what_is_no_picture_is_told_by_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    fs::write(path("empty.png"), "").unwrap();
    fs::write(path("notes.png"), "not a \npicture").unwrap();
    fs::write(path("short.png"), "\u{89}").unwrap();
    // The name does not matter: first bytes tell the format.
    varied(3, 2).save(path("a.npy"), Depth::Eight).unwrap();
    fs::rename(path("a.npy"), path("a.png")).unwrap();
    assert_eq!(Picture::open(path("a.png")).unwrap(), varied(3, 2));
    for (name, want) in [
        ("empty.png", "empty.png: is empty; PNG, NumPy, OpenEXR, JPEG, WebP, TIFF, GIF and PNM are read"),
        ("notes.png", "notes.png: is no picture: it starts with \"not a \\np\"; PNG, NumPy, "),
        ("short.png", "short.png: is no picture: it starts with \"\\xc2\\x89\""),
        ("missing.png", "missing.png: "),
        ("", ": "),
    ] {
        let error = Picture::open(path(name)).unwrap_err();
        let line = error.to_string();
        assert!(line.contains(want) && !line.contains('\n'), "{line}");
        assert_eq!(matches!(error, Error::Io { .. }), name == "missing.png" || name.is_empty(), "{line}");
    }
}
