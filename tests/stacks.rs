//! Image stacks and TIFF volumes: every voxel against what was written, for every type, byte order, packing and arrangement; and files that
//! are damaged or lie.

#![cfg(feature = "stacks")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;

use files::tiff::Tiff;
use files::{Random, Sample};
use image::{DynamicImage, ImageBuffer};
use slicestack::volume::io::{self, Choice, Endian, Format, Reading};
use slicestack::volume::{Colors, VoxelType, Voxels};
use slicestack::{Limits, Progress, Volume};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const ORDERS: [Endian; 2] = [Endian::Little, Endian::Big];

fn read_bytes(bytes: &[u8], choice: Choice) -> Result<Volume, slicestack::Error> {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.tif");
    std::fs::write(&path, bytes).unwrap();
    io::read_as(&path, &Reading::new().choice(choice))
}

fn read(bytes: &[u8]) -> Volume {
    read_bytes(bytes, Choice::new()).unwrap()
}

fn refused(bytes: &[u8]) -> String {
    let line = read_bytes(bytes, Choice::new()).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.contains("a.tif"), "{line}");
    line
}

#[track_caller]
fn told(volume: &Volume, what: &str) {
    assert!(volume.notes().iter().any(|n| n.contains(what)), "{what:?} is not in {:?}", volume.notes());
}

#[test]
fn every_type_order_and_packing_is_read_exactly() {
    let mut count = 0;
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, [19, 11, 3]);
        for endian in ORDERS {
            for (compression, predictor) in [(1, 1), (5, 1), (5, 2), (8, 1), (8, 2), (8, 3), (32773, 1)] {
                if predictor == 3 && !kind.is_float() {
                    continue;
                }
                for (big, tile) in [(false, None), (true, None), (false, Some([16, 4])), (true, Some([8, 16])), (false, Some([32, 16]))] {
                    let tiff = Tiff { endian, big, compression, predictor, tile, ..Tiff::new() };
                    let volume = read(&tiff.file(&sample));
                    let case = format!("{kind} {endian:?} {compression} {predictor} {big} {tile:?}");
                    assert_eq!(volume.grid().dims(), sample.dims, "{case}");
                    assert!(volume.voxels() == &sample.voxels, "{case}");
                    assert!(
                        matches!(volume.notes(), [one] if one.contains("1 x 1 x 1")) && volume.grid().spacing() == [1.0; 3],
                        "{case}: {:?}",
                        volume.notes()
                    );
                    count += 1;
                }
            }
        }
    }
    assert_eq!(count, 8 * 2 * 6 * 5 + 2 * 2 * 5);
}

#[test]
fn long_codes_of_lzw_are_read() {
    // Enough for codes of 12 bits and a full table, and runs that refer to themselves.
    let mut sample = Sample::new(VoxelType::U8, [200, 150, 2]);
    for (i, byte) in sample.voxels.as_bytes_mut().iter_mut().enumerate() {
        *byte = if i % 1000 < 600 { (i / 1000) as u8 } else { *byte & 3 };
    }
    let tiff = Tiff { compression: 5, rows: 150, ..Tiff::new() };
    assert!(read(&tiff.file(&sample)).voxels() == &sample.voxels);
    // Another writer's.
    use ::tiff::encoder::{Compression, TiffEncoder, colortype::Gray16};
    let sample = Sample::new(VoxelType::U16, [61, 40, 4]);
    let Voxels::U16(numbers) = &sample.voxels else { unreachable!() };
    for (name, compression) in
        [("LZW", Compression::Lzw), ("PackBits", Compression::Packbits), ("deflate", Compression::Deflate(Default::default()))]
    {
        let mut out = std::io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut out).unwrap().with_compression(compression);
        for slice in numbers.chunks(61 * 40) {
            encoder.write_image::<Gray16>(61, 40, slice).unwrap();
        }
        assert!(read(&out.into_inner()).voxels() == &sample.voxels, "{name}");
    }
}

#[test]
fn few_bits_64_bits_halves_and_complex_numbers_are_read() {
    let packed = |bits: usize, values: &[u16]| {
        let (mut out, mut held, mut count) = (Vec::new(), 0u32, 0);
        for row in values.chunks(7) {
            for &v in row {
                (held, count) = (held << bits | u32::from(v), count + bits);
                while count >= 8 {
                    count -= 8;
                    out.push((held >> count) as u8);
                }
            }
            out.push((held << (8 - count)) as u8);
            if count == 0 {
                out.pop();
            }
            count = 0;
        }
        out
    };
    for bits in [1, 2, 3, 4, 6, 7, 10, 12, 14] {
        let mut random = Random(7);
        let values: Vec<u16> = (0..7 * 5 * 2).map(|_| random.below(1 << bits) as u16).collect();
        let pages: Vec<Vec<u8>> = values.chunks(35).map(|page| packed(bits, page)).collect();
        let row = (7 * bits).div_ceil(8);
        for (endian, photometric) in [(Endian::Little, 1), (Endian::Big, 0)] {
            let tiff = Tiff { endian, photometric, ..Tiff::new() };
            // The writer sees rows of bytes; the width is that of the image.
            let pages: Vec<&[u8]> = pages.iter().map(Vec::as_slice).collect();
            let mut bytes = tiff.pages(&pages, [row, 5], 1, (1, bits));
            set(&mut bytes, &tiff, 256, 7);
            let volume = read(&bytes);
            let most = (1 << bits) - 1;
            for (i, &v) in values.iter().enumerate() {
                let want = if photometric == 0 { most - v } else { v };
                assert_eq!(volume.voxels().get(i), f64::from(want), "{bits} bits {endian:?}, voxel {i}");
            }
            assert_eq!(volume.voxels().voxel_type(), if bits > 8 { VoxelType::U16 } else { VoxelType::U8 });
        }
    }
    let numbers: Vec<i64> = (0..24).map(|i| (i - 9) * 100_000_007).collect();
    for endian in ORDERS {
        let order = |b: [u8; 8]| if endian == Endian::Big { b } else { (u64::from_be_bytes(b)).to_le_bytes() };
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| order(n.to_be_bytes())).collect();
        let tiff = Tiff { endian, ..Tiff::new() };
        let pages: Vec<&[u8]> = bytes.chunks(96).collect();
        let volume = read(&tiff.pages(&pages, [4, 3], 8, (2, 64)));
        assert_eq!(volume.voxels(), &Voxels::I32(numbers.iter().map(|&n| n as i32).collect()));
        let (half, complex): ([u16; 3], [f32; 6]) = ([0x3c00, 0xc000, 0x3555], [3.0, 4.0, -5.0, 12.0, 0.0, 1.0]);
        let turn2 = |n: u16| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() };
        let turn4 = |n: f32| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() };
        let half: Vec<u8> = half.into_iter().flat_map(turn2).collect();
        let complex: Vec<u8> = complex.into_iter().flat_map(turn4).collect();
        for (compression, predictor) in [(1, 1), (8, 3)] {
            let tiff = Tiff { endian, compression, predictor, ..Tiff::new() };
            let volume = read(&tiff.pages(&[&half, &half], [3, 1], 2, (3, 16)));
            let third = 0.333_251_95;
            assert_eq!(volume.voxels(), &Voxels::F32(vec![1.0, -2.0, third, 1.0, -2.0, third].into()), "{endian:?}");
        }
        for compression in [1, 5] {
            let tiff = Tiff { endian, compression, ..Tiff::new() };
            let volume = read(&tiff.pages(&[&complex, &complex], [3, 1], 8, (6, 64)));
            assert_eq!(volume.voxels(), &Voxels::F32(vec![5.0, 13.0, 1.0, 5.0, 13.0, 1.0].into()), "{endian:?}");
        }
    }
}

/// Puts `value` in place of the first number of `tag` in every directory of a file that is no BigTIFF.
fn set(bytes: &mut [u8], tiff: &Tiff, tag: u16, value: u16) {
    let order = |n: u16| if tiff.endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() };
    let number = |b: &[u8]| {
        let fold = |n: usize, b: &u8| n << 8 | usize::from(*b);
        if tiff.endian == Endian::Big { b.iter().fold(0, fold) } else { b.iter().rev().fold(0, fold) }
    };
    let mut at = number(&bytes[4..8]);
    let mut found = 0;
    while at != 0 {
        let count = number(&bytes[at..at + 2]);
        for entry in (0..count).map(|i| at + 2 + 12 * i) {
            if bytes[entry..entry + 2] == order(tag) {
                let wide = number(&bytes[entry + 2..entry + 4]) == 4;
                let place = if wide && tiff.endian == Endian::Big { entry + 10 } else { entry + 8 };
                bytes[place..place + 2].copy_from_slice(&order(value));
                found += 1;
            }
        }
        at = number(&bytes[at + 2 + 12 * count..][..4]);
    }
    assert!(found > 0, "tag {tag}");
}

#[test]
fn colours_become_rgba_or_one_channel() {
    for kind in [VoxelType::U8, VoxelType::U16, VoxelType::F32] {
        for samples in [3, 4, 5] {
            let sample = Sample::new(kind, [6 * samples, 5, 3]);
            for (planar, compression, tile) in [(false, 1, None), (true, 1, None), (false, 8, Some([4, 4])), (true, 5, Some([4, 4]))] {
                let more = if samples > 3 { vec![(338, vec![2; samples - 3])] } else { vec![] };
                let tiff = Tiff { photometric: 2, samples, planar, compression, tile, more, ..Tiff::new() };
                let bytes = tiff.file(&sample);
                let volume = read(&bytes);
                let colors = volume.colors().unwrap();
                assert_eq!((volume.grid().dims(), colors.len()), ([6, 5, 3], 90));
                let full = match kind {
                    VoxelType::U8 => 255.0,
                    VoxelType::U16 => 65535.0,
                    _ => 1.0,
                };
                for i in 0..90 {
                    let found = match colors {
                        Colors::U8(v) => v[i].map(f64::from),
                        Colors::U16(v) => v[i].map(f64::from),
                        Colors::F32(v) => v[i].map(f64::from),
                    };
                    let want: [f64; 4] = std::array::from_fn(|c| if c < samples { sample.voxels.get(i * samples + c) } else { full });
                    assert_eq!(found, want, "{kind} {samples} {planar} {compression}, voxel {i}");
                }
                for channel in 0..samples {
                    let volume = read_bytes(&bytes, Choice::new().channel(channel)).unwrap();
                    assert!((0..90).all(|i| volume.voxels().get(i) == sample.voxels.get(i * samples + channel)));
                    told(&volume, &format!("Channel {channel}"));
                }
                let line = read_bytes(&bytes, Choice::new().channel(samples)).unwrap_err().to_string();
                assert!(line.contains(&format!("volume.channel is {samples}")), "{line}");
            }
        }
    }
}

#[test]
fn alphas_greys_palettes_and_white_that_is_0_are_told() {
    // Premultiplied.
    let sample = Sample { dims: [8, 1, 2], voxels: Voxels::U8(vec![100, 50, 0, 200, 7, 8, 9, 0, 10, 20, 30, 255, 1, 1, 1, 2].into()) };
    let tiff = Tiff { photometric: 2, samples: 4, more: vec![(338, vec![1])], ..Tiff::new() };
    let volume = read(&tiff.file(&sample));
    let Some(Colors::U8(colors)) = volume.colors() else { panic!("no colours") };
    assert_eq!(colors, [[128, 64, 0, 200], [255, 255, 255, 0], [10, 20, 30, 255], [128, 128, 128, 2]]);
    told(&volume, "divided by their alpha");
    // Greys as colours.
    let grey = Sample { dims: [6, 1, 2], voxels: Voxels::U16(vec![5, 5, 5, 900, 900, 900, 7, 7, 7, 0, 0, 0].into()) };
    let tiff = Tiff { photometric: 2, samples: 3, ..Tiff::new() };
    let volume = read(&tiff.file(&grey));
    assert_eq!(volume.scalars(), Some(&Voxels::U16(vec![5, 900, 7, 0].into())));
    told(&volume, "opaque greys");
    // Grey and alpha: the alpha is left out.
    let tiff = Tiff { samples: 2, more: vec![(338, vec![2])], ..Tiff::new() };
    let volume = read(&tiff.file(&Sample { dims: [4, 1, 2], voxels: Voxels::U8((1..9).collect()) }));
    assert_eq!(volume.voxels(), &Voxels::U8(vec![1, 3, 5, 7].into()));
    told(&volume, "Channel 0 (grey) of 2");
    // A palette: colours; ImageJ's is for display alone.
    let map: Vec<u16> = (0..768).map(|i| (i * 85) as u16).collect();
    let indices = Sample::new(VoxelType::U8, [5, 4, 2]);
    let tiff = Tiff { photometric: 3, more: vec![(320, map.clone())], ..Tiff::new() };
    let volume = read(&tiff.file(&indices));
    let Some(Colors::U8(colors)) = volume.colors() else { panic!("no colours") };
    for (i, color) in colors.iter().enumerate() {
        let index = indices.voxels.get(i) as usize;
        assert_eq!(color[..], [map[index] >> 8, map[256 + index] >> 8, map[512 + index] >> 8, 255].map(|n| n as u8)[..]);
    }
    let own = Tiff { description: "ImageJ=1.54f\nimages=2\nslices=2\n".to_owned(), ..tiff };
    let volume = read(&own.file(&indices));
    assert!(volume.scalars() == Some(&indices.voxels));
    told(&volume, "palette is one for display");
    let dir = TempDir::new().unwrap();
    let one = Sample::new(VoxelType::U8, [5, 4, 1]);
    for name in ["1.tif", "2.tif"] {
        std::fs::write(dir.path().join(name), Tiff { description: "ImageJ=1.54f\n".to_owned(), ..own.clone() }.file(&one)).unwrap();
    }
    let volume = Volume::open(dir.path()).unwrap();
    assert!((0..40).all(|i| volume.voxels().get(i) == one.voxels.get(i % 20)));
    told(&volume, "palette is one for display");
    // White is 0.
    let sample = Sample::new(VoxelType::U16, [5, 4, 2]);
    let volume = read(&Tiff { photometric: 0, ..Tiff::new() }.file(&sample));
    assert!((0..40).all(|i| volume.voxels().get(i) == 65535.0 - sample.voxels.get(i)));
    told(&volume, "turned around");
    let sample = Sample::new(VoxelType::I16, [5, 4, 2]);
    assert!(read(&Tiff { photometric: 0, ..Tiff::new() }.file(&sample)).voxels() == &sample.voxels);
}

#[test]
fn colours_of_few_bits_are_stretched_and_calibrations_applied() {
    // 4 bits: two numbers a byte, 2 x 1 pixels of three numbers.
    let tiff = Tiff { photometric: 2, samples: 3, ..Tiff::new() };
    let mut bytes = tiff.pages(&[&[0x0f, 0x84, 0x21], &[0xff, 0xff, 0xf0]], [1, 1], 1, (1, 4));
    set(&mut bytes, &tiff, 256, 2);
    let volume = read(&bytes);
    let Some(Colors::U8(colors)) = volume.colors() else { panic!("no colours") };
    let of = |n: u16| ((n * 255 + 7) / 15) as u8;
    assert_eq!(colors[..2], [[0, 255, of(8), 255], [of(4), of(2), of(1), 255]]);
    told(&volume, "Colours of 4 bits were stretched to 8");
    // ImageJ keeps signed numbers as unsigned ones and a calibration.
    let sample = Sample::new(VoxelType::U16, [5, 4, 2]);
    let description = "ImageJ=1.54f\nimages=2\nslices=2\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n".to_owned();
    let volume = read(&Tiff { description: description.clone(), ..Tiff::new() }.file(&sample));
    assert_eq!((volume.rescale(), volume.value([0; 3])), ((1.0, -32768.0), sample.voxels.get(0) - 32768.0));
    let line = refused(&Tiff { description: description.replace("c1=1.0", "c1=0"), ..Tiff::new() }.file(&sample));
    assert!(line.contains("calibration is \"-32768.0\" + \"0\" x"), "{line}");
    let volume = read(&Tiff { description: description.replace("cf=0", "cf=7"), ..Tiff::new() }.file(&sample));
    assert_eq!(volume.rescale(), (1.0, 0.0));
    told(&volume, "no straight line");
}

/// Slices of one channel and frame of `sample`, whose z counts planes in the order of `axes` (the fastest first), of `sizes` z, c and t.
fn planes(sample: &Sample, axes: &str, sizes: [usize; 3], channel: usize, frame: usize) -> Vec<f64> {
    let [x, y, _] = sample.dims;
    let size = |axis: char| sizes["zct".find(axis).unwrap()];
    let place = |axis: char, z: usize| match axis {
        'z' => z,
        'c' => channel,
        _ => frame,
    };
    let plane = |z: usize| axes.chars().rev().fold(0, |n, axis| n * size(axis) + place(axis, z));
    (0..sizes[0]).flat_map(|z| (0..x * y).map(move |i| (z, i))).map(|(z, i)| sample.voxels.get(plane(z) * x * y + i)).collect()
}

fn all(volume: &Volume) -> Vec<f64> {
    (0..volume.voxels().len()).map(|i| volume.voxels().get(i)).collect()
}

#[test]
fn hyperstacks_of_imagej_are_told_apart() {
    let sample = Sample::new(VoxelType::U16, [6, 5, 24]);
    let description = "ImageJ=1.54f\nimages=24\nchannels=2\nslices=3\nframes=4\nhyperstack=true\nunit=\\u00B5m\nspacing=2.5\nloop=false\n";
    for (alone, compression) in [(false, 1), (false, 8), (true, 1)] {
        for endian in ORDERS {
            let tiff =
                Tiff { endian, alone, compression, description: description.to_owned(), resolution: Some([4, 2]), rows: 5, ..Tiff::new() };
            let bytes = tiff.file(&sample);
            for (channel, frame) in [(0, 0), (1, 0), (0, 3), (1, 2)] {
                let volume = read_bytes(&bytes, Choice::new().channel(channel).frame(frame)).unwrap();
                assert_eq!(volume.grid().dims(), [6, 5, 3]);
                assert_eq!(all(&volume), planes(&sample, "czt", [3, 2, 4], channel, frame), "{alone} {compression} {endian:?}");
                assert_eq!(volume.grid().spacing(), [0.25, 0.5, 2.5]);
                told(&volume, "Voxel sizes are in \u{b5}m");
                told(&volume, &format!("Frame {frame} of 4"));
                told(&volume, &format!("Channel {channel} of 2"));
            }
            let line = read_bytes(&bytes, Choice::new().frame(4)).unwrap_err().to_string();
            assert!(line.contains("volume.frame is 4: there are 4, 0 to 3"), "{line}");
        }
    }
    // One directory, and fewer planes behind it than announced.
    let tiff = Tiff { alone: true, rows: 5, description: "ImageJ=1.54f\nimages=9000\n".to_owned(), ..Tiff::new() };
    assert!(refused(&tiff.file(&sample)).contains("images is 9000, the file holds 2"));
    let tiff = Tiff { description: "ImageJ=1.54f\nimages=25\n".to_owned(), ..Tiff::new() };
    assert!(refused(&tiff.file(&sample)).contains("images is 25, the file has 24 pages"));
    let tiff = Tiff { description: "ImageJ=1.54f\nimages=24\nchannels=5\n".to_owned(), ..Tiff::new() };
    told(&read(&tiff.file(&sample)), "5 channels x 1 slices x 1 frames, the file has 24 pages");
    let tiff = Tiff { description: "ImageJ=1.54f\nimages=24\nchannels=0\n".to_owned(), ..Tiff::new() };
    assert!(refused(&tiff.file(&sample)).contains("channels is \"0\""));
    // Without a unit the resolution is one of printing.
    let tiff = Tiff { resolution: Some([72, 72]), ..Tiff::new() };
    assert_eq!(read(&tiff.file(&sample)).grid().spacing(), [1.0; 3]);
}

fn ome(pixels: &str, inside: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" UUID=\"urn:uuid:1\"><Image ID=\"Image:0\" Name=\"cells\"><Pixels ID=\"Pixels:0\" SizeX=\"6\" SizeY=\"5\" Type=\"uint16\" {pixels}>{inside}</Pixels></Image></OME>"
    )
}

#[test]
fn ome_files_are_read_in_every_order() {
    let sample = Sample::new(VoxelType::U16, [6, 5, 24]);
    let sizes = "SizeZ=\"3\" SizeC=\"2\" SizeT=\"4\"";
    for order in ["XYZCT", "XYZTC", "XYCZT", "XYCTZ", "XYTZC", "XYTCZ"] {
        let channels = "<Channel Name=\"DAPI\"/><Channel Name=\"GFP\"/>";
        for inside in [format!("{channels}<TiffData/>"), format!("{channels}<TiffData IFD=\"0\" PlaneCount=\"24\"/>"), channels.to_owned()]
        {
            let pixels = format!(
                "DimensionOrder=\"{order}\" {sizes} PhysicalSizeX=\"0.5\" PhysicalSizeY=\"250\" PhysicalSizeYUnit=\"nm\" PhysicalSizeZ=\"0.002\" PhysicalSizeZUnit=\"mm\""
            );
            for big in [false, true] {
                let tiff = Tiff { big, description: ome(&pixels, &inside), ..Tiff::new() };
                let bytes = tiff.file(&sample);
                for (channel, frame) in [(0, 0), (1, 3)] {
                    let volume = read_bytes(&bytes, Choice::new().channel(channel).frame(frame)).unwrap();
                    let axes = order[2..].to_ascii_lowercase();
                    assert_eq!(all(&volume), planes(&sample, &axes, [3, 2, 4], channel, frame), "{order} {inside}");
                    for (found, want) in volume.grid().spacing().iter().zip([0.5, 0.25, 2.0]) {
                        assert!((found - want).abs() < 1e-12, "{found}, not {want}");
                    }
                    told(&volume, "Voxel sizes are in \u{b5}m");
                    told(&volume, &format!("Channel {channel} ({}) of 2", ["DAPI", "GFP"][channel]));
                }
            }
        }
    }
    // Planes wherever the file says.
    let blocks: String = (0..3).map(|z| format!("<TiffData IFD=\"{}\" FirstZ=\"{z}\"/>", [17, 4, 9][z])).collect();
    let pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\"";
    let volume = read(&Tiff { description: ome(pixels, &blocks), ..Tiff::new() }.file(&sample));
    let want: Vec<f64> = [17, 4, 9].iter().flat_map(|k| (k * 30..k * 30 + 30).map(|i| sample.voxels.get(i))).collect();
    assert_eq!(all(&volume), want);
}

#[test]
fn ome_planes_in_other_files_are_read_or_missed() {
    let sample = Sample::new(VoxelType::U16, [6, 5, 2]);
    let dir = TempDir::new().unwrap();
    let pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"4\" SizeC=\"1\" SizeT=\"1\"";
    let block = |file: &str, id: u8, ifd: usize, z: usize| {
        format!("<TiffData IFD=\"{ifd}\" FirstZ=\"{z}\"><UUID FileName=\"{file}\">urn:uuid:{id}</UUID></TiffData>")
    };
    let inside = [block("b.tif", 2, 3, 0), block("a.tif", 1, 0, 1), block("b.tif", 2, 0, 2), block("a.tif", 1, 1, 3)].concat();
    let own = Tiff { description: ome(pixels, &inside), ..Tiff::new() }.file(&sample);
    let path = dir.path().join("a.tif");
    std::fs::write(&path, &own).unwrap();
    let line = Volume::open(&path).unwrap_err().to_string();
    assert!(line.contains("planes are in \"b.tif\", which is not beside this file"), "{line}");
    // More pages than the file itself has.
    let mut turned = Sample::new(VoxelType::U16, [6, 5, 4]);
    turned.voxels.as_bytes_mut().reverse();
    std::fs::write(dir.path().join("b.tif"), Tiff { endian: Endian::Big, compression: 8, ..Tiff::new() }.file(&turned)).unwrap();
    let volume = Volume::open(&path).unwrap();
    let slice = |s: &Sample, z: usize| (z * 30..z * 30 + 30).map(|i| s.voxels.get(i)).collect::<Vec<_>>();
    assert_eq!(all(&volume), [slice(&turned, 3), slice(&sample, 0), slice(&turned, 0), slice(&sample, 1)].concat());
    let line = Volume::open(dir.path()).unwrap_err().to_string();
    assert!(line.contains("2 pages: a slice of a stack has one image"), "{line}");
    // No way out of the folder.
    for name in ["../b.tif", "/b.tif", "x/b.tif", "..", "x\\b.tif"] {
        let inside = [block("a.tif", 1, 0, 0), block(name, 2, 0, 1)].concat();
        std::fs::write(&path, Tiff { description: ome(pixels, &inside), ..Tiff::new() }.file(&sample)).unwrap();
        let line = Volume::open(&path).unwrap_err().to_string();
        assert!(line.contains("no name of a file") || line.contains("no way to a file"), "{name}: {line}");
    }
    // Slices in files of their own: the folder alone does not tell their order.
    let one = Sample::new(VoxelType::U16, [6, 5, 1]);
    let inside = [block("b.tif", 2, 0, 0), block("a.tif", 1, 0, 1)].concat();
    let pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"";
    for name in ["a.tif", "b.tif"] {
        std::fs::write(dir.path().join(name), Tiff { description: ome(pixels, &inside), ..Tiff::new() }.file(&one)).unwrap();
    }
    let line = Volume::open(dir.path()).unwrap_err().to_string();
    assert!(line.contains("the OME-XML in \"a.tif\" tells how its files belong together: give that file"), "{line}");
    assert_eq!(all(&Volume::open(&path).unwrap()), [slice(&one, 0), slice(&one, 0)].concat());
    // Renamed: the only file that is named is the file itself.
    let pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\"";
    let inside = [block("old.tif", 7, 0, 0), block("old.tif", 7, 1, 1)].concat();
    let volume = read(&Tiff { description: ome(pixels, &inside), ..Tiff::new() }.file(&sample));
    assert!(volume.voxels() == &sample.voxels);
}

#[test]
fn what_there_is_to_choose_is_listed() {
    let sample = Sample::new(VoxelType::U16, [6, 5, 24]);
    let pixels = "DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"2\" SizeT=\"4\"";
    let description = ome(pixels, "<Channel Name=\"DAPI\"/><Channel Name=\"GFP\"/><TiffData/>");
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.tif");
    std::fs::write(&path, Tiff { description, ..Tiff::new() }.file(&sample)).unwrap();
    let shown = |reading: &Reading| {
        let items = io::list(&path, reading).unwrap();
        items.iter().map(|i| format!("{} {} {} {} {}", i.part, i.id, i.count, i.about, i.taken)).collect::<Vec<_>>()
    };
    let want = ["channel 0 1 DAPI true", "channel 1 1 GFP false", "frame 0 4 moments of a sequence true"];
    assert_eq!(shown(&Reading::new()), want);
    let want = ["channel 0 1 DAPI false", "channel 1 1 GFP true", "frame 0 4 moments of a sequence true"];
    assert_eq!(shown(&Reading::new().choice(Choice::new().channel(1))), want);
    std::fs::write(&path, Tiff { photometric: 2, samples: 3, ..Tiff::new() }.file(&sample)).unwrap();
    assert_eq!(shown(&Reading::new()), ["channel 0 1 red false", "channel 1 1 green false", "channel 2 1 blue false"]);
    std::fs::write(&path, Tiff::new().file(&sample)).unwrap();
    assert!(shown(&Reading::new()).is_empty());
}

#[test]
fn plain_files_are_mapped_and_read_alike() {
    for kind in [VoxelType::U8, VoxelType::U16, VoxelType::F32] {
        let sample = Sample::new(kind, [16, 8, 6]);
        let dir = TempDir::new().unwrap();
        let path = dir.path().join("a.tif");
        for endian in ORDERS {
            for big in [false, true] {
                std::fs::write(&path, Tiff { endian, big, ..Tiff::new() }.file(&sample)).unwrap();
                let mapped = io::read(&path, &Limits::new().map_bytes(0)).unwrap();
                let read = io::read(&path, &Limits::new().map_bytes(u64::MAX)).unwrap();
                assert!(mapped.voxels() == &sample.voxels && read.voxels() == &sample.voxels);
                let native = kind.bytes() == 1 || (endian == Endian::Big) == cfg!(target_endian = "big");
                assert_eq!((mapped.voxels().is_mapped(), read.voxels().is_mapped()), (native, false), "{kind} {endian:?} {big}");
            }
        }
    }
}

#[test]
fn smaller_pages_are_left_out() {
    let sample = Sample::new(VoxelType::U8, [6, 5, 3]);
    let tiff = Tiff { more: vec![(254, vec![0])], ..Tiff::new() };
    let mut bytes = tiff.file(&sample);
    // The last page alone.
    let at = bytes.windows(4).rposition(|w| w == [254, 0, 3, 0]).unwrap();
    bytes[at + 8] = 1;
    let volume = read(&bytes);
    assert_eq!(volume.grid().dims(), [6, 5, 2]);
    told(&volume, "1 of 3 pages");
}

/// Writes images to a folder and reads it.
fn folder(images: &[(&str, DynamicImage)]) -> TempDir {
    let dir = TempDir::new().unwrap();
    for (name, image) in images {
        image.save(dir.path().join(name)).unwrap();
    }
    dir
}

fn grey(seed: u64) -> DynamicImage {
    let mut random = Random(seed);
    ImageBuffer::from_fn(7, 5, |_, _| image::Luma([random.next() as u8])).into()
}

#[test]
fn folders_are_stacks_in_natural_order() {
    let slices: Vec<DynamicImage> = (0..12).map(|i| grey(100 + i)).collect();
    for (extension, kind) in [("png", "PNG"), ("bmp", "BMP"), ("tif", "TIFF"), ("pgm", "PNM")] {
        let names: Vec<String> = (0..12).map(|i| format!("s{}.{extension}", i + 1)).collect();
        let images: Vec<(&str, DynamicImage)> = names.iter().map(String::as_str).zip(slices.iter().cloned()).collect();
        let dir = folder(&images);
        std::fs::write(dir.path().join("Thumbs.db"), b"anything").unwrap();
        let volume = Volume::open(dir.path()).unwrap();
        assert_eq!(io::detect(dir.path()).unwrap(), Format::Stack);
        assert_eq!(volume.grid().dims(), [7, 5, 12]);
        let want: Vec<u8> = slices.iter().flat_map(|s| s.to_luma8().into_raw()).collect();
        assert_eq!(volume.voxels(), &Voxels::U8(want[..].to_vec().into()), "{extension}");
        told(&volume, &format!("12 {kind} images"));
        told(&volume, &format!("from \"s1.{extension}\" to \"s12.{extension}\""));
        told(&volume, "Thumbs.db");
        // A pattern: s1, s10, s11, s12.
        let volume = Volume::open(dir.path().join(format!("s1*.{extension}"))).unwrap();
        assert_eq!(volume.grid().dims(), [7, 5, 4]);
        let want: Vec<u8> = [0, 9, 10, 11].iter().flat_map(|&i| slices[i].to_luma8().into_raw()).collect();
        assert_eq!(volume.voxels(), &Voxels::U8(want.into()));
    }
}

#[test]
fn every_type_of_image_is_read_exactly() {
    let mut random = Random(3);
    let mut bytes = |n: usize| (0..n).map(|_| random.next() as u8).collect::<Vec<_>>();
    let mut words = |n: usize| bytes(n).into_iter().zip(bytes(n)).map(|(a, b)| u16::from_be_bytes([a, b])).collect::<Vec<_>>();
    let (w, h) = (7, 5);
    macro_rules! image {
        ($pixel:ty, $n:expr, $values:expr) => {
            DynamicImage::from(ImageBuffer::<$pixel, _>::from_raw(w, h, $values).unwrap())
        };
    }
    let mut make = |case: usize| -> DynamicImage {
        let n = (w * h) as usize;
        let wide = words(4 * n);
        let narrow: Vec<u8> = wide.iter().map(|&v| v as u8).collect();
        match case {
            0 => image!(image::Luma<u16>, 1, wide[..n].to_vec()),
            1 => image!(image::LumaA<u8>, 2, narrow[..2 * n].to_vec()),
            2 => image!(image::Rgb<u8>, 3, narrow[..3 * n].to_vec()),
            3 => image!(image::Rgba<u8>, 4, narrow),
            4 => image!(image::Rgb<u16>, 3, wide[..3 * n].to_vec()),
            _ => image!(image::Rgba<u16>, 4, wide),
        }
    };
    for case in 0..6 {
        let slices: Vec<DynamicImage> = (0..3).map(|_| make(case)).collect();
        for extension in ["png", "tif"] {
            if extension == "tif" && case == 1 {
                continue; // Not written.
            }
            let names: Vec<String> = (0..3).map(|i| format!("{i}.{extension}")).collect();
            let dir = folder(&names.iter().map(String::as_str).zip(slices.iter().cloned()).collect::<Vec<_>>());
            let volume = Volume::open(dir.path()).unwrap();
            match (volume.colors(), case) {
                (None, 0) => {
                    let want: Vec<u16> = slices.iter().flat_map(|s| s.to_luma16().into_raw()).collect();
                    assert_eq!(volume.voxels(), &Voxels::U16(want.into()));
                }
                (None, 1) => {
                    let want: Vec<u8> = slices.iter().flat_map(|s| s.as_bytes().chunks(2).map(|p| p[0])).collect();
                    assert_eq!(volume.voxels(), &Voxels::U8(want.into()));
                    told(&volume, "Channel 0 (grey) of 2 was taken");
                }
                (Some(Colors::U8(v)), 2 | 3) => {
                    let want: Vec<u8> = slices.iter().flat_map(|s| s.to_rgba8().into_raw()).collect();
                    assert_eq!(v.as_flattened(), want);
                }
                (Some(Colors::U16(v)), 4 | 5) => {
                    let want: Vec<u16> = slices.iter().flat_map(|s| s.to_rgba16().into_raw()).collect();
                    assert_eq!(v.as_flattened(), want);
                }
                (found, _) => panic!("{case} {extension}: {:?}", found.is_some()),
            }
            if case == 5 {
                let volume = io::read_as(dir.path(), &Reading::new().choice(Choice::new().channel(2))).unwrap();
                let want: Vec<u16> =
                    slices.iter().flat_map(|s| s.to_rgba16().into_raw().chunks(4).map(|p| p[2]).collect::<Vec<_>>()).collect();
                assert_eq!(volume.voxels(), &Voxels::U16(want.into()));
                told(&volume, "Channel 2 (blue) of 4");
            }
        }
    }
    // JPEG loses: the numbers are those of its decoder.
    let dir = folder(&[("1.jpg", grey(1)), ("2.jpeg", grey(2))]);
    let want: Vec<u8> = ["1.jpg", "2.jpeg"].iter().flat_map(|n| image::open(dir.path().join(n)).unwrap().to_luma8().into_raw()).collect();
    assert_eq!(Volume::open(dir.path()).unwrap().voxels(), &Voxels::U8(want.into()));
    // Floats in TIFF.
    let dir = TempDir::new().unwrap();
    let sample = Sample::new(VoxelType::F32, [7, 5, 1]);
    for name in ["a9.tif", "a10.tif"] {
        std::fs::write(dir.path().join(name), Tiff { compression: 8, predictor: 3, ..Tiff::new() }.file(&sample)).unwrap();
    }
    let volume = Volume::open(dir.path()).unwrap();
    assert!((0..70).all(|i| volume.voxels().get(i) == sample.voxels.get(i % 35)));
}

#[test]
fn stacks_that_are_none_are_refused_in_one_line() {
    let line = |dir: &Path| {
        let line = Volume::open(dir).unwrap_err().to_string();
        assert!(!line.contains('\n') && line.contains(&dir.parent().unwrap().display().to_string()), "{line}");
        line
    };
    let dir = folder(&[
        ("1.png", grey(1)),
        ("2.png", grey(2)),
        ("3.png", DynamicImage::new_luma8(7, 6)),
        ("4.png", DynamicImage::new_luma8(1, 1)),
    ]);
    let told = line(dir.path());
    assert!(told.contains("3.png: an image of 7 x 6 pixels of u8, but \"1.png\" has 7 x 5 pixels of u8"), "{told}");
    let dir = folder(&[("1.png", grey(1)), ("2.png", DynamicImage::new_rgb16(7, 5))]);
    let told = line(dir.path());
    assert!(told.contains("2.png: an image of 7 x 5 pixels of 3 (RGB) u16, but \"1.png\" has 7 x 5 pixels of u8"), "{told}");
    let dir = folder(&[("1.png", grey(1)), ("2.png", grey(2)), ("3.bmp", grey(3))]);
    assert!(line(dir.path()).contains("several kinds, such as \"1.png\" and \"3.bmp\": give a pattern"));
    assert_eq!(Volume::open(dir.path().join("*.png")).unwrap().grid().dims(), [7, 5, 2]);
    // One image alone.
    for name in ["1.png", "3.bmp"] {
        let told = line(&dir.path().join(name));
        assert!(told.contains("one image, not a volume: give the folder"), "{told}");
    }
    let one = Tiff::new().file(&Sample::new(VoxelType::U8, [6, 5, 1]));
    assert!(refused(&one).contains("one image, not a volume: give the folder"));
    let dir = folder(&[("1.png", grey(1))]);
    assert!(line(dir.path()).contains("\"1.png\" in it is one image, not a volume"));
    // Wrong names and damage.
    std::fs::write(dir.path().join("2.png"), b"GIF89a and more").unwrap();
    assert!(line(dir.path()).contains("2.png: no PNG image: it starts with \"GIF89a a\""));
    let good = std::fs::read(dir.path().join("1.png")).unwrap();
    std::fs::write(dir.path().join("2.png"), &good[..good.len() - 30]).unwrap();
    assert!(line(dir.path()).contains("2.png: its pixels are damaged"));
    let mut huge = good.clone();
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    std::fs::write(dir.path().join("1.png"), &huge).unwrap();
    assert!(line(dir.path()).contains("it cannot hold 2147483647 x 2147483647 pixels"));
    // Many pages among single ones.
    let dir = TempDir::new().unwrap();
    std::fs::write(dir.path().join("1.tif"), &one).unwrap();
    std::fs::write(dir.path().join("2.tif"), Tiff::new().file(&Sample::new(VoxelType::U8, [6, 5, 3]))).unwrap();
    assert!(line(dir.path()).contains("2.tif: 3 pages: a slice of a stack has one image"));
    // A volume of another format in the folder is the one to give.
    let dir = folder(&[("1.png", grey(1)), ("2.png", grey(2))]);
    std::fs::write(dir.path().join("brain.nrrd"), files::nrrd(&Sample::new(VoxelType::U8, [4, 5, 6]), Endian::Little, "raw")).unwrap();
    assert!(line(dir.path()).contains("such as \"brain.nrrd\""));
    // Limits.
    let dir = folder(&[("1.png", grey(1)), ("2.png", grey(2))]);
    let told = io::read(dir.path(), &Limits::new().voxel_bytes(69)).unwrap_err().to_string();
    assert!(told.contains("7 x 5 x 2 voxels of u8: 70 is over the limit of 69"), "{told}");
}

#[test]
fn what_is_not_supported_is_named() {
    let sample = Sample::new(VoxelType::U8, [6, 5, 3]);
    let with = |change: fn(&mut Tiff)| {
        let mut tiff = Tiff::new();
        change(&mut tiff);
        refused(&tiff.file(&sample))
    };
    assert!(with(|t| t.compression = 7).contains("page 0: Compression is 7 (JPEG): not supported"));
    assert!(with(|t| t.compression = 50000).contains("Compression is 50000 (Zstandard)"));
    assert!(with(|t| t.compression = 4).contains("of fax machines"));
    assert!(with(|t| (t.photometric, t.samples) = (6, 3)).contains("PhotometricInterpretation is 6 (YCbCr)"));
    assert!(with(|t| t.predictor = 3).contains("Predictor is 3 for 8 bits of SampleFormat 1"));
    assert!(with(|t| t.kind = Some((3, 24))).contains("floats of 24 bits"));
    assert!(with(|t| t.kind = Some((1, 24))).contains("integers of 24 bits"));
    assert!(with(|t| t.kind = Some((9, 8))).contains("SampleFormat is 9"));
    assert!(with(|t| t.more = vec![(266, vec![2])]).contains("FillOrder is 2"));
    let ome_of = |pixels: &str, inside: &str| refused(&Tiff { description: ome(pixels, inside), ..Tiff::new() }.file(&sample));
    let sizes = "SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\"";
    assert!(ome_of(&format!("DimensionOrder=\"XYZCT\" {sizes}"), "").contains("are 6 planes, the file has 3"));
    assert!(ome_of(&format!("DimensionOrder=\"XYQCT\" {sizes}"), "").contains("DimensionOrder is \"XYQCT\""));
    assert!(ome_of("SizeZ=\"3\" SizeC=\"1\" SizeT=\"0\"", "").contains("SizeT is 0"));
    assert!(ome_of("SizeZ=\"3\" SizeC=\"1\" SizeT=\"x\"", "").contains("SizeT is \"x\""));
    let three = "SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\"";
    assert!(ome_of(three, "<TiffData IFD=\"1\" PlaneCount=\"3\"/>").contains("pages 1 to 3 of 3"));
    assert!(ome_of(three, "<TiffData IFD=\"0\" FirstZ=\"3\"/>").contains("no slice 3"));
    assert!(ome_of(three, "<TiffData IFD=\"0\"/>").contains("are 3 planes, the file has 1"));
    assert!(ome_of("SizeZ=\"18446744073709551615\" SizeC=\"9\" SizeT=\"9\"", "<TiffData IFD=\"0\"/>").contains("more than 1048576"));
    assert!(ome_of(three, "<TiffData IFD=\"0\"/><TiffData IFD=\"1\"/>").contains("slice 0 of channel 0 and frame 0 is told twice"));
    assert!(ome_of(three, &"<a>".repeat(100_000)).contains("OME-XML: "));
    assert!(ome_of(&format!("{three} PhysicalSizeX=\"-1\""), "").contains("PhysicalSizeX is \"-1\""));
    let wrong = ome(three, "").replace("SizeX=\"6\"", "SizeX=\"7\"");
    assert!(refused(&Tiff { description: wrong, ..Tiff::new() }.file(&sample)).contains("7 x 5 pixels, page 0 has 6 x 5"));
    let line =
        refused(&Tiff { description: "<OME><BinaryOnly MetadataFile=\"a.companion.ome\"/></OME>".to_owned(), ..Tiff::new() }.file(&sample));
    assert!(line.contains("stands in \"a.companion.ome\""), "{line}");
    let line = refused(&Tiff { description: "<OME ><Image></OME>".to_owned(), ..Tiff::new() }.file(&sample));
    assert!(line.contains("OME-XML: "), "{line}");
    assert!(refused(&files::gz(&Tiff::new().file(&sample))).contains("a TIFF file inside gzip is not supported"));
    let line = ome_of(&format!("{three} DimensionOrder=\"{}\"", "X".repeat(9000)), "");
    assert!(line.len() < 300, "{line}");
    // Directories in a circle, lying sizes, pages unlike each other.
    let mut circle = Tiff::new().file(&sample);
    let first: [u8; 4] = circle[4..8].try_into().unwrap();
    let end = circle.len() - 4;
    circle[end..].copy_from_slice(&first);
    assert!(refused(&circle).contains("the directory of page 2 leads back"));
    let mut wide = Tiff::new().file(&sample);
    set(&mut wide, &Tiff::new(), 256, 60000);
    assert!(refused(&wide).contains("3 planes of 60000 x 5 pixels of u8 take 900000 bytes, there cannot be more than"));
    let mut unlike = Tiff::new().file(&sample);
    let at = unlike.windows(4).rposition(|w| w == [1, 1, 3, 0]).unwrap();
    unlike[at + 8] = 4;
    assert!(refused(&unlike).contains("page 2 is 6 x 4 pixels of u8, the first one is 6 x 5"));
    let cut = Tiff::new().file(&sample);
    assert!(refused(&cut[..cut.len() - 20]).contains("the TIFF directory of page 2 of"));
}

#[test]
fn results_do_not_depend_on_threads_and_reading_can_be_stopped() {
    struct Count(AtomicU64, u64);
    impl Progress for Count {
        fn step(&self, what: &str, done: u64, total: u64) -> bool {
            assert_eq!((what, total), ("reading", 300));
            self.0.fetch_add(1, Ordering::Relaxed);
            done < self.1
        }
    }
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.tif");
    let sample = Sample::new(VoxelType::I16, [9, 8, 300]);
    std::fs::write(&path, Tiff { compression: 5, ..Tiff::new() }.file(&sample)).unwrap();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            assert!(Volume::open(&path).unwrap().voxels() == &sample.voxels);
            let all = Arc::new(Count(AtomicU64::new(0), u64::MAX));
            io::read_as(&path, &Reading::new().progress(all.clone())).unwrap();
            let steps = all.0.load(Ordering::Relaxed);
            let few = Arc::new(Count(AtomicU64::new(0), 1));
            let stopped = io::read_as(&path, &Reading::new().progress(few.clone()));
            assert!(matches!(stopped, Err(slicestack::Error::Stopped)) && few.0.load(Ordering::Relaxed) < steps);
        });
    }
    // Of several damaged pages the first is told, whatever the number of threads.
    let mut bytes = Tiff { compression: 8, ..Tiff::new() }.file(&sample);
    let length = bytes.len();
    bytes[length / 8..length / 2].fill(0x55);
    std::fs::write(&path, &bytes).unwrap();
    let mut lines: Vec<String> = Vec::new();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        lines.push(pool.install(|| Volume::open(&path).unwrap_err().to_string()));
    }
    assert!(lines.iter().all(|l| l == &lines[0]), "{lines:?}");
}

/// Changes a few bytes.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        // Directories come last.
        let length = bytes.len();
        let at = if random.below(2) == 0 {
            random.below(length.max(1))
        } else {
            length.saturating_sub(1 + random.below(700.min(length.max(1))))
        };
        match random.below(6) {
            _ if bytes.is_empty() => {}
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at.max(8)),
            3 => bytes.insert(at, random.next() as u8),
            4 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(length))),
            _ => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
        }
    }
}

/// Peak of this process's address space in bytes.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmPeak:"));
    line.and_then(|l| l.split_whitespace().nth(1)?.parse::<u64>().ok()).map_or(0, |kib| kib * 1024)
}

#[test]
fn damaged_files_never_panic_or_dawdle() {
    let (s, rgb) = (Sample::new(VoxelType::I16, [8, 6, 6]), Sample::new(VoxelType::U8, [9, 5, 3]));
    let description = ome("DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\"", "<TiffData IFD=\"0\" PlaneCount=\"6\"/>")
        .replace("SizeX=\"6\" SizeY=\"5\"", "SizeX=\"8\" SizeY=\"6\"");
    let hyper = "ImageJ=1.54f\nimages=6\nchannels=2\nslices=3\nunit=mm\nspacing=2\n".to_owned();
    let big = Tiff { endian: Endian::Big, big: true, ..Tiff::new() };
    let seeds = [
        Tiff::new().file(&s),
        Tiff { tile: Some([16, 16]), compression: 5, ..big.clone() }.file(&s),
        Tiff { compression: 5, predictor: 2, ..Tiff::new() }.file(&s),
        Tiff { compression: 8, description, ..big.clone() }.file(&s),
        Tiff { compression: 32773, description: hyper.clone(), resolution: Some([3, 4]), ..Tiff::new() }.file(&s),
        Tiff { alone: true, rows: 6, description: hyper, ..big }.file(&s),
        Tiff { photometric: 2, samples: 3, planar: true, ..Tiff::new() }.file(&rgb),
        Tiff { photometric: 3, more: vec![(320, (0..768).collect())], ..Tiff::new() }.file(&rgb),
    ];
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("damaged.tif");
    let mut random = Random(42);
    let (mut read, mut refused) = (0, 0);
    let before = peak();
    for seed in &seeds {
        for _ in 0..300 {
            let mut bytes = seed.clone();
            damage(&mut bytes, &mut random);
            std::fs::write(&path, &bytes).unwrap();
            let start = Instant::now();
            match io::read(&path, &Limits::new().voxel_bytes(64 << 20)) {
                Ok(v) => {
                    read += 1;
                    assert_eq!(v.colors().map_or(v.voxels().len(), |c| c.len()), v.grid().voxel_count());
                }
                Err(e) => {
                    refused += 1;
                    let line = e.to_string();
                    assert!(!line.contains('\n') && line.contains("damaged") && line.len() < 500, "{line:?}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {:?}", start.elapsed(), bytes.escape_ascii().to_string());
        }
    }
    assert!(read > 200 && refused > 800, "{read} read, {refused} refused");
    assert!(peak() - before < 1 << 30, "address space grew by {} bytes", peak() - before);
}

#[test]
fn damaged_images_of_a_stack_never_panic_or_dawdle() {
    let mut random = Random(43);
    let (mut read, mut refused) = (0, 0);
    for extension in ["png", "bmp", "jpg", "pgm", "tif"] {
        let names = [format!("1.{extension}"), format!("2.{extension}")];
        let image = |seed| if extension == "jpg" || extension == "pgm" { grey(seed) } else { DynamicImage::from(grey(seed).to_rgb8()) };
        let dir = folder(&[(&names[0], image(1)), (&names[1], image(2))]);
        let seed = std::fs::read(dir.path().join(&names[0])).unwrap();
        for _ in 0..150 {
            let mut bytes = seed.clone();
            damage(&mut bytes, &mut random);
            std::fs::write(dir.path().join(&names[0]), &bytes).unwrap();
            let start = Instant::now();
            match io::read(dir.path(), &Limits::new().voxel_bytes(64 << 20)) {
                Ok(_) => read += 1,
                Err(e) => {
                    refused += 1;
                    let line = e.to_string();
                    assert!(!line.contains('\n') && line.contains(&dir.path().display().to_string()) && line.len() < 500, "{line:?}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {:?}", start.elapsed(), bytes.escape_ascii().to_string());
        }
    }
    assert!(read > 50 && refused > 200, "{read} read, {refused} refused");
}
