//! Zarr and OME-Zarr: every voxel comes back, whatever the version, type, order, codec and shard; the volume that is meant is taken; damaged
//! folders get one clear line.

#![cfg(feature = "zarr")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;
#[path = "files/zarr.rs"]
mod writer;

use files::{Random, Sample};
use slicestack::volume::io::{self, Choice, Endian, Format, Part, Reading};
use slicestack::volume::{Channels, VoxelType};
use slicestack::{Error, Limits, Progress, Volume};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use writer::{Frame, Packed, Zarr};

/// This machine's.
const NATIVE: Endian = if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little };

const FRAME: Frame = Frame { method: 1, shuffle: 1, block: 1 << 16, split: true, copied: false };

fn put(dir: &Path, name: &str, text: impl AsRef<[u8]>) {
    let path = dir.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

fn choice(choice: Choice) -> Reading {
    Reading::new().choice(choice)
}

/// The line that reading `path` ends with.
fn told(path: &Path, reading: &Reading) -> String {
    let line = io::read_as(path, reading).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.len() < 500, "{line}");
    line
}

/// Writes and reads a sample, whose every voxel must come back.
fn check(zarr: &Zarr, sample: &Sample) {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.zarr");
    zarr.write(sample, &path);
    let volume = io::read(&path, &Limits::default());
    assert!(volume.is_ok(), "{zarr:?}: {volume:?}");
    let volume = volume.unwrap();
    assert_eq!(volume.grid().dims(), sample.dims, "{zarr:?}");
    assert!(*volume.voxels() == sample.voxels, "{zarr:?}: other voxels");
    assert!(!volume.notes().iter().any(|n| n.contains("not stored")), "{:?}", volume.notes());
}

#[test]
fn every_type_in_both_orders_of_bytes() {
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, [7, 6, 5]);
        for version in [2, 3] {
            for endian in [Endian::Little, Endian::Big] {
                check(&Zarr { endian, ..Zarr::new(version, [2, 4, 3]) }, &sample);
                check(&Zarr { endian, packed: Packed::Blosc(FRAME), ..Zarr::new(version, [5, 6, 7]) }, &sample);
            }
        }
    }
}

#[test]
fn every_order_of_dimensions_separator_and_shape_of_chunks() {
    let sample = Sample::new(VoxelType::I16, [7, 6, 5]);
    for chunk in [[1, 1, 1], [2, 3, 4], [5, 6, 7], [8, 9, 10], [1, 6, 7], [5, 1, 2], [3, 6, 7]] {
        for separator in ['.', '/'] {
            for order in [[0, 1, 2], [2, 1, 0]] {
                check(&Zarr { order, separator, ..Zarr::new(2, chunk) }, &sample);
            }
            for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                check(&Zarr { order, separator, ..Zarr::new(3, chunk) }, &sample);
            }
        }
    }
}

/// A sample that compresses, with something of everything in it.
fn compressible(kind: VoxelType) -> Sample {
    let mut sample = Sample::new(kind, [19, 17, 13]);
    let size = kind.bytes();
    let bytes = sample.voxels.as_bytes_mut();
    for (i, number) in bytes.chunks_exact_mut(size).enumerate() {
        if i % 97 > 20 {
            number.fill(0);
            number[0] = (i / 97 % 5) as u8;
        }
    }
    sample
}

#[test]
fn every_codec() {
    for kind in [VoxelType::U8, VoxelType::I16, VoxelType::F32, VoxelType::F64] {
        let sample = compressible(kind);
        for version in [2, 3] {
            for packed in [Packed::Not, Packed::Gzip, Packed::Zlib, Packed::Bzip2, Packed::Zstd, Packed::Lz4] {
                check(&Zarr { packed, ..Zarr::new(version, [5, 17, 10]) }, &sample);
            }
        }
        for packed in [Packed::Not, Packed::Gzip, Packed::Zstd, Packed::Blosc(FRAME)] {
            check(&Zarr { packed, checked: true, ..Zarr::new(3, [5, 17, 10]) }, &sample);
        }
    }
}

#[test]
fn every_kind_of_blosc_frame() {
    for kind in [VoxelType::U8, VoxelType::I16, VoxelType::F32, VoxelType::F64] {
        let sample = compressible(kind);
        for (method, shuffle) in [0, 1, 3, 4].into_iter().flat_map(|method| [0, 1, 2].map(|shuffle| (method, shuffle))) {
            for split in [false, true] {
                for block in [1 << 20, 4096, 1000] {
                    let frame = Frame { method, shuffle, block, split, copied: false };
                    check(&Zarr { packed: Packed::Blosc(frame), ..Zarr::new(2, [13, 17, 19]) }, &sample);
                }
            }
        }
        check(&Zarr { packed: Packed::Blosc(Frame { copied: true, ..FRAME }), ..Zarr::new(2, [5, 17, 10]) }, &sample);
    }
}

#[test]
fn filters_of_version_2() {
    let filters = [
        (r#"{"id": "delta", "dtype": "<i2"}"#, [300i16, -600, 1, 32767].map(i16::to_le_bytes).concat()),
        (r#"{"id": "shuffle", "elementsize": 2}"#, vec![0x2c, 0xd4, 0xd5, 0xd4, 0x01, 0xfe, 0xfe, 0x7e]),
    ];
    for (filter, bytes) in filters {
        let dir = TempDir::new().unwrap();
        let metadata = zarray(&[1, 2, 2], &[1, 2, 2], "<i2", "0").replace("\"filters\": null", &format!("\"filters\": [{filter}]"));
        put(dir.path(), ".zarray", metadata.replace("\"compressor\": null", r#""compressor": {"id": "gzip"}"#));
        put(dir.path(), "0.0.0", files::gz(&bytes));
        let volume = Volume::open(dir.path()).unwrap();
        let found: Vec<f64> = (0..4).map(|i| volume.voxels().get(i)).collect();
        assert_eq!(found, [300.0, -300.0, -299.0, 32468.0], "{filter}");
    }
}

/// Chunks that another program encoded: name of the compressor, and bytes.
fn chunks_of_numcodecs() -> Vec<(&'static str, Vec<u8>)> {
    let lines = include_str!("files/zarr_chunks.txt").lines().filter(|line| !line.starts_with('#'));
    let byte = |hex: &[u8]| u8::from_str_radix(std::str::from_utf8(hex).unwrap(), 16).unwrap();
    lines.map(|line| line.split_once(' ').unwrap()).map(|(id, hex)| (id, hex.as_bytes().chunks(2).map(byte).collect())).collect()
}

/// Writes an array of such a chunk into the folder `dir`.
fn put_chunk(dir: &Path, id: &str, bytes: &[u8]) {
    put(
        dir,
        ".zarray",
        zarray(&[8, 12, 16], &[8, 12, 16], "<i2", "0").replace("\"compressor\": null", &format!("\"compressor\": {{\"id\": \"{id}\"}}")),
    );
    put(dir, "0.0.0", bytes);
}

#[test]
fn chunks_of_another_program() {
    let chunks = chunks_of_numcodecs();
    assert_eq!(chunks.len(), 9);
    for (id, bytes) in chunks {
        let dir = TempDir::new().unwrap();
        put_chunk(dir.path(), id, &bytes);
        let volume = Volume::open(dir.path()).unwrap();
        for (x, y, z) in (0..16).flat_map(|x| (0..12).flat_map(move |y| (0..8).map(move |z| (x, y, z)))) {
            assert_eq!(volume.value([x, y, z]), (x * (y / 4) + z / 2 * 16) as f64, "{id} {x} {y} {z}");
        }
    }
}

#[test]
fn shards_with_their_list_at_either_end() {
    let sample = compressible(VoxelType::I16);
    for shard in [[1, 1, 1], [2, 2, 2], [1, 3, 4], [9, 9, 9]] {
        for index_at_start in [false, true] {
            for packed in [Packed::Not, Packed::Zstd, Packed::Blosc(FRAME)] {
                let order = [2, 0, 1];
                check(&Zarr { shard: Some(shard), index_at_start, packed, order, checked: true, ..Zarr::new(3, [2, 5, 6]) }, &sample);
            }
        }
    }
}

/// Version 2 metadata of an array that is not compressed, chunks separated by points.
fn zarray(shape: &[usize], chunks: &[usize], code: &str, fill: &str) -> String {
    format!(
        r#"{{"zarr_format": 2, "shape": {shape:?}, "chunks": {chunks:?}, "dtype": "{code}", "compressor": null, "fill_value": {fill},
        "order": "C", "filters": null}}"#
    )
}

#[test]
fn numbers_of_other_sizes_are_converted() {
    let dir = TempDir::new().unwrap();
    let cases: [(&str, Vec<u8>, Vec<f64>); 8] = [
        ("|b1", vec![0, 1], vec![0.0, 1.0]),
        ("<i8", [-7i64, 1 << 30].map(i64::to_le_bytes).concat(), vec![-7.0, f64::from(1 << 30)]),
        (">u8", [7u64, 1 << 31].map(u64::to_be_bytes).concat(), vec![7.0, 2147483648.0]),
        ("<f2", vec![0, 0x3c, 0, 0xc0], vec![1.0, -2.0]),
        (">f2", vec![0x3c, 0, 0xc0, 0], vec![1.0, -2.0]),
        ("<c8", [3f32, 4.0, 0.0, -1.0].map(f32::to_le_bytes).concat(), vec![5.0, 1.0]),
        (">c16", [3f64, 4.0, 0.0, -1.0].map(f64::to_be_bytes).concat(), vec![5.0, 1.0]),
        ("<c16", [6f64, 8.0, 1.0, 0.0].map(f64::to_le_bytes).concat(), vec![10.0, 1.0]),
    ];
    for (code, bytes, expected) in cases {
        put(dir.path(), ".zarray", zarray(&[1, 1, 2], &[1, 1, 2], code, "0"));
        put(dir.path(), "0.0.0", bytes);
        let volume = Volume::open(dir.path()).unwrap();
        assert_eq!([0, 1].map(|x| volume.value([x, 0, 0])).to_vec(), expected, "{code}");
    }
    std::fs::remove_file(dir.path().join("0.0.0")).unwrap();
    put(dir.path(), ".zarray", zarray(&[2, 2, 3], &[1, 1, 2], "<i8", "0"));
    put(dir.path(), "1.0.1", [1i64 << 40, i64::MAX].map(i64::to_le_bytes).concat());
    let line = told(dir.path(), &Reading::new());
    assert!(line.contains("voxel 8 is 1099511627776 (i64): it does not fit i32"), "{line}");
    // What lies outside the array does not count.
    put(dir.path(), "1.0.1", [5i64, i64::MAX].map(i64::to_le_bytes).concat());
    assert_eq!(Volume::open(dir.path()).unwrap().value([2, 0, 1]), 5.0);
}

#[test]
fn chunks_that_are_not_stored_have_the_fill_value() {
    let dir = TempDir::new().unwrap();
    for (code, fill, expected) in [("|u1", "7", 7.0), ("<i2", "-3", -3.0), ("<f4", "\"Infinity\"", f64::INFINITY), ("<i2", "null", 0.0)] {
        put(dir.path(), ".zarray", zarray(&[4, 5, 6], &[2, 5, 4], code, fill));
        put(dir.path(), "1.0.0", vec![0; 2 * 5 * 4 * code[2..].parse::<usize>().unwrap()]);
        let volume = Volume::open(dir.path()).unwrap();
        for (x, y, z) in (0..6).flat_map(|x| (0..5).flat_map(move |y| (0..4).map(move |z| (x, y, z)))) {
            let stored = z >= 2 && x < 4;
            assert_eq!(volume.value([x, y, z]), if stored { 0.0 } else { expected }, "{code} {x} {y} {z}");
        }
        assert!(volume.notes().iter().any(|n| n.starts_with("3 of 4 chunks are not stored")), "{:?}", volume.notes());
    }
    put(dir.path(), ".zarray", zarray(&[4, 5, 6], &[2, 5, 4], "<f8", "\"NaN\""));
    put(dir.path(), "1.0.0", vec![0; 2 * 5 * 4 * 8]);
    let volume = Volume::open(dir.path()).unwrap();
    assert!(volume.value([0, 0, 0]).is_nan() && volume.value([0, 0, 2]) == 0.0);
    // Where one file alone may be there, it is asked for by its name.
    let metadata =
        Zarr::new(3, [2, 5, 4]).metadata(&Sample::new(VoxelType::U8, [4, 5, 2])).replace("\"fill_value\": 0", "\"fill_value\": 9");
    let one = dir.path().join("one");
    put(&one, "zarr.json", metadata);
    let volume = Volume::open(&one).unwrap();
    assert!((0..40).all(|i| volume.voxels().get(i) == 9.0));
    assert!(
        volume.notes().iter().any(|n| n == "1 of 1 chunks are not stored: their voxels have the fill value 9."),
        "{:?}",
        volume.notes()
    );
    // A value that voxels cannot have matters where a chunk is missing alone.
    put(dir.path(), ".zarray", zarray(&[2, 5, 4], &[2, 5, 4], "<i8", &i64::MIN.to_string()));
    assert!(told(dir.path(), &Reading::new()).contains("fill_value is -9223372036854775808 (i64)"));
    put(dir.path(), "0.0.0", vec![0; 2 * 5 * 4 * 8]);
    assert_eq!(Volume::open(dir.path()).unwrap().value([3, 4, 1]), 0.0);
    // Nor do many chunks that are not there cost anything.
    ["0.0.0", "1.0.0"].iter().for_each(|name| std::fs::remove_file(dir.path().join(name)).unwrap());
    put(dir.path(), "5.6.7", [1]);
    put(dir.path(), ".zarray", zarray(&[1 << 10, 1 << 10, 1 << 10], &[1, 1, 1], "|u1", "0"));
    let start = Instant::now();
    let volume = Volume::open(dir.path()).unwrap();
    assert!(volume.notes().iter().any(|n| n.starts_with("1073741823 of 1073741824")), "{:?}", volume.notes());
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
}

/// An image of two frames, three channels and three levels; in version 3 the attributes are in `zarr.json`.
fn image(dir: &Path, version: u8) -> Vec<Vec<u8>> {
    let mut levels = Vec::new();
    let mut datasets = Vec::new();
    for level in 0..3usize {
        let (nz, ny, nx) = (4, 16 >> level, 32 >> level);
        let shape = [2, 3, nz, ny, nx];
        let count: usize = shape.iter().product();
        let voxels: Vec<u8> = (0..count).map(|i| (i * 31 + level * 7) as u8).collect();
        let chunk = nz * ny * nx;
        let metadata = if version == 2 {
            zarray(&shape, &[1, 1, nz, ny, nx], "|u1", "0")
        } else {
            format!(
                r#"{{"zarr_format": 3, "node_type": "array", "shape": {shape:?}, "data_type": "uint8", "fill_value": 0, "codecs": ["bytes"],
                "chunk_grid": {{"name": "regular", "configuration": {{"chunk_shape": [1, 1, {nz}, {ny}, {nx}]}}}},
                "chunk_key_encoding": {{"name": "v2"}}}}"#
            )
        };
        let name = if version == 2 { ".zarray" } else { "zarr.json" };
        put(dir, &format!("s{level}/{name}"), metadata);
        for (i, bytes) in voxels.chunks(chunk).enumerate() {
            put(dir, &format!("s{level}/{}.{}.0.0.0", i / 3, i % 3), bytes);
        }
        let scale = f64::from(1 << level) / 2.0;
        datasets.push(format!(
            r#"{{"path": "s{level}", "coordinateTransformations": [{{"type": "scale", "scale": [1, 1, 2000, {scale}, {scale}]}},
            {{"type": "translation", "translation": [0, 0, 3000, 5, 7]}}]}}"#
        ));
        levels.push(voxels);
    }
    let ome = format!(
        r#""multiscales": [{{"version": "0.4", "name": "cells", "axes": [{{"name": "t", "type": "time", "unit": "second"}}, {{"name": "c", "type":
        "channel"}}, {{"name": "z", "type": "space", "unit": "nanometer"}}, {{"name": "y", "type": "space", "unit": "micrometer"}}, {{"name":
        "x", "type": "space", "unit": "micrometer"}}], "datasets": [{}], "coordinateTransformations": [{{"type": "scale", "scale": [1, 1, 1, 1,
        2]}}]}}], "omero": {{"channels": [{{"label": "DAPI"}}, {{"label": "GFP"}}, {{"label": "RFP"}}]}}"#,
        datasets.join(", ")
    );
    if version == 2 {
        put(dir, ".zgroup", r#"{"zarr_format": 2}"#);
        put(dir, ".zattrs", format!("{{{ome}, \"mean\": NaN}}"));
    } else {
        put(
            dir,
            "zarr.json",
            format!(r#"{{"zarr_format": 3, "node_type": "group", "attributes": {{"ome": {{"version": "0.5", {ome}}}}}}}"#),
        );
    }
    levels
}

#[test]
fn the_level_frame_and_channel_that_are_meant() {
    for version in [2, 3] {
        let dir = TempDir::new().unwrap();
        let levels = image(dir.path(), version);
        let pixels = |n: u32| Reading::new().pixels(Some(n));
        let cases = [
            (Reading::new(), 0, 0, 0),
            (choice(Choice::new().level(2).frame(1).channel(2)), 2, 1, 2),
            (choice(Choice::new().channel(1)), 0, 0, 1),
            // The box is 32 micrometres long.
            (pixels(32), 0, 0, 0),
            (pixels(16), 1, 0, 0),
            (pixels(8), 2, 0, 0),
            (pixels(4), 2, 0, 0),
            (pixels(16).choice(Choice::new().level(0)), 0, 0, 0),
            (Reading::new().limits(Limits::new().voxel_bytes(512)), 1, 0, 0),
            (choice(Choice::new().array("s1").frame(1)), 1, 1, 0),
        ];
        for (reading, level, frame, channel) in cases {
            let volume = io::read_as(dir.path(), &reading).unwrap();
            let dims = [32 >> level, 16 >> level, 4];
            assert_eq!(volume.grid().dims(), dims);
            let count: usize = dims.iter().product();
            let expected = &levels[level][(frame * 3 + channel) * count..][..count];
            assert!((0..count).all(|i| volume.voxels().get(i) == f64::from(expected[i])), "level {level}");
            let size = f64::from(1 << level) / 2.0;
            assert_eq!(volume.grid().spacing(), [2.0 * size, size, 2.0]);
            assert_eq!(volume.grid().origin().to_array(), [14.0, 5.0, 3.0]);
            let notes = volume.notes().join(" ");
            let name = ["DAPI", "GFP", "RFP"][channel];
            assert!(notes.contains(&format!("Level {level} of 0 to 2 is read")) && notes.contains("micrometer"), "{notes}");
            assert!(notes.contains(&format!("Frame {frame} of 0 to 1 is read.")), "{notes}");
            assert!(notes.contains(&format!("Channel {channel} of 0 to 2, {name:?}, is read.")), "{notes}");
        }
        let wrong = [
            (Choice::new().level(3), "volume.level is 3: there are 3, 0 to 2"),
            (Choice::new().frame(2), "volume.frame is 2: there are 2, 0 to 1"),
            (Choice::new().channel(3), "volume.channel is 3: there are 3, 0 to 2"),
            (Choice::new().array("s7"), "volume.array is \"s7\": not there; there are \".\""),
            (Choice::new().array("s1").level(2), "volume.level is 2: the array that is chosen is level 1"),
            (Choice::new().array("../a"), "no way to a file of this folder"),
            (Choice::new().series("1"), "volume.series is 1: Zarr has no series to choose"),
        ];
        for (wrong, says) in wrong {
            let line = told(dir.path(), &choice(wrong));
            assert!(line.contains(says), "{line}");
        }
    }
}

#[test]
fn what_may_be_chosen_is_listed() {
    let dir = TempDir::new().unwrap();
    image(dir.path(), 2);
    let items = io::list(dir.path(), &choice(Choice::new().level(1).channel(2))).unwrap();
    let lines: Vec<String> = items.iter().map(|i| format!("{} {} {} {} {}", i.part, i.id, i.count, i.about, i.taken)).collect();
    let expected = [
        "level 0 1 32 x 16 x 4 voxels of 1 x 0.5 x 2 micrometer false",
        "level 1 1 16 x 8 x 4 voxels of 2 x 1 x 2 micrometer true",
        "level 2 1 8 x 4 x 4 voxels of 4 x 2 x 2 micrometer false",
        "frame 0 2 frame 0 is taken true",
        "channel 0 1 DAPI false",
        "channel 1 1 GFP false",
        "channel 2 1 RFP true",
    ];
    assert_eq!(lines, expected);
    // Voxels are not needed for that, nor is each level.
    std::fs::remove_dir_all(dir.path().join("s0")).unwrap();
    let items = io::list(dir.path(), &Reading::new()).unwrap();
    assert!(items[0].about.starts_with("cannot be read: ") && !items[0].taken && items[1].taken, "{items:?}");
    assert!(Volume::open(dir.path()).unwrap().notes().iter().any(|n| n == "A finer level cannot be read."));
    assert!(told(dir.path(), &choice(Choice::new().level(0))).contains("the level \"s0\" is not there"));
}

#[test]
fn arrays_and_images_of_labels_in_a_group() {
    let dir = TempDir::new().unwrap();
    let (a, b) = (Sample::new(VoxelType::U8, [4, 3, 2]), Sample::new(VoxelType::I16, [5, 4, 3]));
    put(dir.path(), ".zgroup", r#"{"zarr_format": 2}"#);
    put(dir.path(), "deep/.zgroup", r#"{"zarr_format": 2}"#);
    put(dir.path(), "a/.zarray", zarray(&[9], &[9], "|u1", "0"));
    put(dir.path(), "text/.zarray", zarray(&[9, 9, 9], &[9, 9, 9], "|O", "0"));
    Zarr::new(2, [2, 2, 2]).write(&b, &dir.path().join("deep/b"));
    Zarr::new(2, [2, 2, 2]).write(&a, &dir.path().join("z"));
    let volume = Volume::open(dir.path()).unwrap();
    assert!(*volume.voxels() == b.voxels);
    assert!(volume.notes().contains(&"Of 2 images and arrays in the group \"deep/b\" is read.".to_owned()), "{:?}", volume.notes());
    assert!(*io::read_as(dir.path(), &choice(Choice::new().array("z/"))).unwrap().voxels() == a.voxels);
    for path in ["z", "z/.zarray"] {
        assert_eq!(io::detect(dir.path().join(path)).unwrap(), Format::Zarr);
        assert!(*Volume::open(dir.path().join(path)).unwrap().voxels() == a.voxels, "{path}");
    }
    let line = told(dir.path(), &choice(Choice::new().array("deep")));
    assert!(line.contains("volume.array is \"deep\": a group, neither an image nor an array; there are \"deep/b\", \"z\""), "{line}");
    let line = told(dir.path(), &choice(Choice::new().array("text")));
    assert!(line.contains("dtype is \"|O\": a type"), "{line}");
    // An image goes before arrays, its labels behind it.
    image(&dir.path().join("image"), 2);
    Zarr::new(2, [2, 2, 2]).write(&a, &dir.path().join("image/labels/cells/0"));
    put(dir.path(), "image/labels/.zgroup", r#"{"zarr_format": 2}"#);
    put(
        dir.path(),
        "image/labels/cells/.zattrs",
        r#"{"multiscales": [{"axes": ["z", "y", "x"], "datasets": [{"path": "0"}]}], "image-label": {"colors":
        [{"label-value": 7, "rgba": [255, 0, 51, 255]}, {"label-value": 999, "rgba": [0, 0, 0, 0]}], "properties": [{"label-value": 7, "name": "nucleus"}]}}"#,
    );
    let items = io::list(dir.path(), &Reading::new()).unwrap();
    let names: Vec<&str> = items.iter().filter(|i| i.part == Part::Array).map(|i| i.id.as_str()).collect();
    assert_eq!(names, ["image", "deep/b", "z", "image/labels/cells"]);
    assert!(items[0].taken && !items[1].taken);
    let labels = io::read_as(dir.path(), &choice(Choice::new().array("image/labels/cells"))).unwrap();
    assert!(*labels.voxels() == a.voxels);
    let Channels::Label(segments) = labels.channels() else { panic!("{:?}", labels.channels()) };
    assert_eq!(segments.len(), 1);
    assert_eq!((segments[0].value, segments[0].name.as_str(), segments[0].color), (7, "nucleus", Some([1.0, 0.0, 0.2])));
}

#[test]
fn dimensions_without_names_are_taken_in_the_usual_order() {
    let dir = TempDir::new().unwrap();
    let cases: [(&[usize], [usize; 3], &str); 4] = [
        (&[3, 4], [4, 3, 1], "taken as y, x"),
        (&[2, 3, 4, 5], [5, 4, 3], "taken as c, z, y, x"),
        (&[2, 2, 3, 4, 5], [5, 4, 3], "taken as t, c, z, y, x"),
        (&[1, 3, 1, 4, 5], [5, 4, 3], "taken as one, z, one, y, x"),
    ];
    for (shape, dims, says) in cases {
        let count: usize = shape.iter().product();
        put(dir.path(), ".zarray", zarray(shape, shape, "|u1", "0"));
        put(dir.path(), &vec!["0"; shape.len()].join("."), (0..count).map(|i| i as u8).collect::<Vec<_>>());
        let volume = Volume::open(dir.path()).unwrap();
        assert_eq!(volume.grid().dims(), dims);
        assert!((0..dims.iter().product()).all(|i| volume.voxels().get(i) == i as f64), "{shape:?}");
        assert!(volume.notes()[0].contains(says), "{:?}", volume.notes());
    }
    // With names, x may be the first dimension.
    put(dir.path(), ".zarray", zarray(&[2, 3, 4], &[2, 3, 4], "|u1", "0"));
    put(dir.path(), ".zattrs", r#"{"_ARRAY_DIMENSIONS": ["x", "y", "z"]}"#);
    put(dir.path(), "0.0.0", (0..24).collect::<Vec<u8>>());
    let volume = Volume::open(dir.path()).unwrap();
    assert_eq!((volume.grid().dims(), volume.value([1, 2, 3]), volume.value([1, 0, 0])), ([2, 3, 4], 23.0, 12.0));
}

/// A zip file of all files of the folder `dir`, each below `prefix`.
fn zipped(dir: &Path, prefix: &str, deflated: bool, metadata_first: bool, change: impl Fn(&mut (u32, u32, u32))) -> Vec<u8> {
    let way = |path: &Path| format!("{prefix}{}", path.strip_prefix(dir).unwrap().to_str().unwrap().replace('\\', "/"));
    let mut entries: Vec<(String, Vec<u8>)> = all_files(dir).iter().map(|path| (way(path), std::fs::read(path).unwrap())).collect();
    entries.sort_by_key(|(name, _)| (name.ends_with("zarray") || name.ends_with(".json")) != metadata_first);
    let entries: Vec<(&str, Vec<u8>)> = entries.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    files::zip(&entries, deflated, change)
}

#[test]
fn zip_files_are_read_as_folders() {
    let sample = compressible(VoxelType::I16);
    let shard = Zarr { shard: Some([2, 1, 2]), packed: Packed::Gzip, ..Zarr::new(3, [3, 17, 5]) };
    for zarr in [Zarr::new(2, [5, 9, 10]), Zarr { separator: '/', ..Zarr::new(2, [5, 9, 10]) }, shard] {
        let dir = TempDir::new().unwrap();
        zarr.write(&sample, &dir.path().join("a"));
        for (prefix, deflated, metadata_first, name) in
            [("", false, true, "b"), ("a.zarr/", true, true, "b.zip"), ("", true, false, "b.zarr.zip")]
        {
            let bytes = zipped(&dir.path().join("a"), prefix, deflated, metadata_first, |_| {});
            put(dir.path(), name, bytes);
            let path = dir.path().join(name);
            assert_eq!(io::detect(&path).unwrap(), Format::Zarr);
            let volume = Volume::open(&path);
            assert!(volume.is_ok(), "{zarr:?} {name}: {volume:?}");
            assert!(*volume.unwrap().voxels() == sample.voxels, "{zarr:?} {name}");
        }
    }
    let dir = TempDir::new().unwrap();
    image(&dir.path().join("a"), 3);
    put(dir.path(), "b.ozx", zipped(&dir.path().join("a"), "", true, true, |_| {}));
    let path = dir.path().join("b.ozx");
    let choice = choice(Choice::new().level(1).channel(2));
    let (folder, zip) = (io::read_as(dir.path().join("a"), &choice).unwrap(), io::read_as(&path, &choice).unwrap());
    assert!(folder.voxels() == zip.voxels() && folder.grid() == zip.grid() && folder.notes() == zip.notes());
    assert_eq!(io::list(dir.path().join("a"), &choice).unwrap(), io::list(&path, &choice).unwrap());
    // A chunk whose checksum is another one.
    put(dir.path(), "b.ozx", zipped(&dir.path().join("a"), "", true, true, |(_, length, sum)| *sum ^= u32::from(*length == 2048)));
    let line = told(&path, &Reading::new());
    assert!(line.contains("b.ozx: ") && line.contains("the zip entry's checksum does not match"), "{line}");
    put(dir.path(), "c.zarr.zip", files::zip(&[("a", vec![1])], false, |_| {}));
    let line = told(&dir.path().join("c.zarr.zip"), &Reading::new());
    assert!(line.ends_with("c.zarr.zip: none of zarr.json, .zarray, .zgroup, .zattrs is in it"), "{line}");
}

#[test]
fn one_chunk_that_is_a_file_as_it_is_needed_is_mapped() {
    let sample = Sample::new(VoxelType::I16, [7, 6, 5]);
    let dir = TempDir::new().unwrap();
    let limits = Limits::new().map_bytes(0);
    for (chunk, order, mapped) in
        [([5, 6, 7], [0, 1, 2], true), ([5, 6, 7], [2, 1, 0], false), ([5, 6, 8], [0, 1, 2], false), ([4, 6, 7], [0, 1, 2], false)]
    {
        let path = dir.path().join(format!("{chunk:?}{order:?}"));
        Zarr { order, endian: NATIVE, ..Zarr::new(2, chunk) }.write(&sample, &path);
        let volume = io::read(&path, &limits).unwrap();
        assert!(*volume.voxels() == sample.voxels);
        assert_eq!(volume.voxels().is_mapped(), mapped, "{chunk:?} {order:?}");
    }
}

/// Counts steps, and stops after so many.
struct Stop {
    after: u64,
    seen: AtomicU64,
}

impl Progress for Stop {
    fn step(&self, _: &str, done: u64, total: u64) -> bool {
        assert!(done <= total);
        self.seen.fetch_add(1, Ordering::Relaxed);
        done < self.after
    }
}

#[test]
fn progress_is_told_and_stops() {
    let dir = TempDir::new().unwrap();
    Zarr::new(2, [2, 3, 3]).write(&Sample::new(VoxelType::U8, [9, 8, 7]), dir.path());
    for (after, stopped) in [(u64::MAX, false), (0, true)] {
        let progress = Arc::new(Stop { after, seen: AtomicU64::new(0) });
        let result = io::read_as(dir.path(), &Reading::new().progress(progress.clone()));
        assert_eq!(matches!(result, Err(Error::Stopped)), stopped);
        assert!(progress.seen.load(Ordering::Relaxed) >= 1);
    }
}

#[test]
fn every_bad_folder_gets_one_clear_line() {
    let sample = Sample::new(VoxelType::I16, [4, 5, 6]);
    let dir = TempDir::new().unwrap();
    let path = dir.path();
    let v2 = Zarr::new(2, [2, 5, 4]);
    let v3 = Zarr { shard: Some([1, 1, 1]), ..Zarr::new(3, [2, 5, 4]) };
    let (old, new) = (v2.metadata(&sample), v3.metadata(&sample));
    let plain = Zarr::new(3, [2, 5, 4]).metadata(&sample);
    let cases: Vec<(&str, String, &str)> = vec![
        (".zarray", "{".into(), "no JSON: "),
        (".zarray", "[]".into(), "zarr_format is missing"),
        (".zarray", old.replace("\": 2", "\": 1"), "zarr_format is 1: a .zarray file is of version 2"),
        (".zarray", old.replace("[6, 5, 4]", "[6, 5, -4]"), "shape[2] is -4: not a whole number"),
        (".zarray", old.replace("[6, 5, 4]", "[6, 0, 4]"), "shape[1] is 0: a size must be at least 1"),
        (".zarray", old.replace("[6, 5, 4]", "6"), "shape is 6: not a list"),
        (".zarray", old.replace("[6, 5, 4]", "[]"), "0 dimensions"),
        (".zarray", old.replace("[6, 5, 4]", "[6]").replace("[2, 5, 4]", "[2]"), "shape is 6: a volume has x, y"),
        (".zarray", old.replace("[6, 5, 4]", "[6, 5, 4, 3, 2, 7]").replace("[2, 5, 4]", "[2, 5, 4, 1, 1, 1]"), "shape is 6 x 5 x 4 x 3 x 2 x 7: a volume"),
        (".zarray", old.replace("[2, 5, 4]", "[2, 5]"), "chunks is [2,5]: 2 numbers for an array of 3 dimensions"),
        (".zarray", old.replace("[6, 5, 4]", "[9999999, 9999999, 4]"), "is over the limit of 17179869184"),
        (".zarray", old.replace("[2, 5, 4]", "[1099511627776, 1, 1]"), "bytes of a chunk of 1099511627776 x 1 x 1 numbers of i16: 2199023255552 is over"),
        (".zarray", old.replace("[2, 5, 4]", "[18446744073709551615, 18446744073709551615, 4]"), "is over the limit"),
        (".zarray", old.replace("<i2", "<i3"), "dtype is \"<i3\": a type that is not supported"),
        (".zarray", old.replace("<i2", "=i2"), "dtype is \"=i2\": a type starts with"),
        (".zarray", old.replace("\"<i2\"", "[[\"r\", \"|u1\"]]"), "records of several fields are not supported"),
        (".zarray", old.replace("\"fill_value\": 0", "\"fill_value\": 70000"), "fill_value is 70000: no value of i16"),
        (".zarray", old.replace("\"C\"", "\"K\""), "order is \"K\": neither C nor F"),
        (".zarray", old.replace("\"compressor\": null", "\"compressor\": {\"id\": \"lzma\"}"), "the codec lzma is not supported"),
        (".zarray", old.replace("\"filters\": null", "\"filters\": [{\"id\": \"fixedscaleoffset\"}]"), "the filter fixedscaleoffset is not supported"),
        ("zarr.json", plain.replace("\"array\"", "\"table\""), "node_type is \"table\": neither array nor group"),
        ("zarr.json", plain.replace("int16", "bfloat16"), "data_type is \"bfloat16\": a type that is not supported"),
        ("zarr.json", plain.replace("regular", "rectangular"), "a grid of chunks that is not regular is not supported"),
        ("zarr.json", plain.replace("default", "else"), "an encoding of chunk keys that is not supported"),
        ("zarr.json", plain.replace("[0, 1, 2]", "[0, 1, 1]"), "not the numbers 0 to 2 in some order"),
        ("zarr.json", plain.replace("\"bytes\"", "\"vlen-utf8\""), "a codec that is not supported here"),
        ("zarr.json", plain.replace("little", "middle"), "endian is \"middle\": neither little nor big"),
        ("zarr.json", new.replacen("[2, 5, 4]", "[4, 5, 5]", 1), "a shard of 5 is no whole number of chunks of 4"),
        ("zarr.json", new.replace("\"end\"", "\"middle\""), "index_location is \"middle\": neither start nor end"),
        ("zarr.json", r#"{"zarr_format": 3, "node_type": "group"}"#.into(), "neither an image nor an array of two or more dimensions"),
        (".zattrs", r#"{"multiscales": []}"#.into(), "multiscales is []: no image is described"),
        (".zattrs", r#"{"multiscales": [{"datasets": []}]}"#.into(), "no level is described"),
        (".zattrs", r#"{"multiscales": [{"datasets": [{"path": "0"}]}]}"#.into(), "the level \"0\" is not there"),
        (".zattrs", r#"{"multiscales": [{"datasets": [{"path": "../0"}]}]}"#.into(), "no way to a file of this folder"),
        (
            ".zattrs",
            r#"{"multiscales": [{"axes": ["y", "x"], "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1]}]}]}]}"#
                .into(),
            "scale is [1]: 1 numbers, 2 are needed",
        ),
        (
            ".zattrs",
            r#"{"multiscales": [{"axes": ["y", "x"], "datasets": [{"path": "0", "coordinateTransformations": [{"type": "rotation"}]}]}]}"#.into(),
            "type is \"rotation\": a transformation that is neither scale nor translation",
        ),
    ];
    for (file, text, says) in cases {
        let folder = path.join("bad");
        put(&folder, file, &text);
        let line = told(&folder, &Reading::new());
        assert!(line.contains(says) && line.contains("bad"), "{line:?} should say {says:?}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

#[test]
fn damaged_chunks_are_named() {
    let sample = compressible(VoxelType::I16);
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("bad");
    let check = |zarr: &Zarr, change: &dyn Fn(&mut Vec<u8>), says: &str| {
        zarr.write(&sample, &path);
        let chunk = path.join(zarr.key([0, 0, 1]));
        let mut bytes = std::fs::read(&chunk).unwrap();
        change(&mut bytes);
        std::fs::write(&chunk, bytes).unwrap();
        let line = told(&path, &Reading::new());
        assert!(line.starts_with(&chunk.display().to_string()) && line.contains(says), "{line:?} should say {says:?}");
        std::fs::remove_dir_all(&path).unwrap();
    };
    let with = |packed| Zarr { packed, ..Zarr::new(2, [5, 17, 10]) };
    // 1700 bytes each.
    check(&with(Packed::Not), &|b| b.truncate(9), "its bytes should be 1700, there are 9");
    check(&with(Packed::Not), &|b| b.push(0), "1701 bytes, a chunk takes 1700 at most");
    check(&with(Packed::Gzip), &|b| b.truncate(30), "gzip: damaged after");
    check(&with(Packed::Gzip), &|b| *b = files::gz(&[0; 1699]), "gzip: its bytes should be 1700, there are 1699");
    check(&with(Packed::Gzip), &|b| *b = files::gz(&vec![0; 50 << 20]), "gzip: its bytes should be 1700, there are more");
    check(&with(Packed::Zlib), &|b| b[0] = 0, "zlib: damaged");
    check(&with(Packed::Bzip2), &|b| b[0] = 0, "bz2: damaged");
    check(&with(Packed::Zstd), &|b| b[0] = 0, "zstd: no frame starts with");
    check(&with(Packed::Zstd), &|b| b.truncate(b.len() - 2), "zstd: damaged");
    // Blocks that repeat one byte 131072 times, in a frame of a window of 1 TiB.
    let bomb = |b: &mut Vec<u8>| {
        let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 30 << 3];
        (0..4000).for_each(|_| frame.extend([0x02, 0x00, 0x10, 7]));
        *b = [frame, vec![0x03, 0, 0x10, 7]].concat();
    };
    check(&with(Packed::Zstd), &bomb, "zstd: damaged after 0 bytes: its bytes should be 1700, there are more");
    check(&with(Packed::Lz4), &|b| b[1] = 0, "lz4: its bytes should be 1700, there are 164");
    check(&with(Packed::Lz4), &|b| b.truncate(8), "lz4: 4 bytes cannot hold 1700");
    let frame = |frame| with(Packed::Blosc(frame));
    check(&frame(FRAME), &|b| b.truncate(9), "blosc: a frame of 9 bytes, its header takes 16");
    check(&frame(FRAME), &|b| b[0] = 3, "format version 3");
    check(&frame(FRAME), &|b| b[4] ^= 1, "blosc: its bytes should be 1700, there are more");
    check(&frame(FRAME), &|b| b[8..12].fill(0), "1700 bytes in blocks of 0");
    check(&frame(FRAME), &|b| b[3] = 0, "of numbers of 0 bytes");
    check(&frame(FRAME), &|b| b[2] |= 4, "Blosc2 is not supported");
    check(&frame(FRAME), &|b| b[2] = 2 << 5 | 17, "compressed by Snappy: not supported");
    check(&frame(FRAME), &|b| b[16] = 0xff, "block 0: its stream at byte");
    check(&frame(FRAME), &|b| b.truncate(40), "a frame of");
    check(&frame(Frame { copied: true, ..FRAME }), &|b| b[12] -= 1, "1700 bytes as they are, 1699 follow");
    let checked = Zarr { checked: true, ..Zarr::new(3, [5, 17, 10]) };
    check(&checked, &|b| b[3] ^= 1, "crc32c: the checksum is");
    let shard = Zarr { shard: Some([3, 1, 1]), packed: Packed::Gzip, ..Zarr::new(3, [5, 17, 10]) };
    check(&shard, &|b| b.truncate(b.len() - 1), "the list of chunks: the checksum is");
    check(&shard, &|b| b.truncate(40), "a list of 3 chunks takes 52 bytes, the shard has 40");
    check(&shard, &|b| b[1] = 0, "the chunk from byte 0 on: gzip: damaged");
    let unchecked = |b: &mut Vec<u8>| {
        let at = b.len() - 52;
        b[at + 7] = 1;
        let sum = crc(&b[at..at + 48]);
        b.truncate(at + 48);
        b.extend(sum);
    };
    check(&shard, &unchecked, "chunk 0 x 0 x 0 should take");
}

/// CRC-32C.
fn crc(bytes: &[u8]) -> [u8; 4] {
    let step = |rest: u32| if rest & 1 == 1 { rest >> 1 ^ 0x82f6_3b78 } else { rest >> 1 };
    let rest = bytes.iter().fold(u32::MAX, |rest, &b| (0..8).fold(rest ^ u32::from(b), |rest, _| step(rest)));
    (!rest).to_le_bytes()
}

#[cfg(unix)]
#[test]
fn links_are_not_followed() {
    let sample = Sample::new(VoxelType::U8, [4, 5, 6]);
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a");
    put(dir.path(), "outside", "secret");
    Zarr { separator: '/', ..Zarr::new(2, [6, 5, 4]) }.write(&sample, &path);
    std::fs::remove_file(path.join("0/0/0")).unwrap();
    std::os::unix::fs::symlink("../../../outside", path.join("0/0/0")).unwrap();
    assert!(told(&path, &Reading::new()).contains("links in a folder are not followed"));
}

/// A zip file that stands alone in its folder.
const ZIP: &str = "a.zip";

/// All files under `dir`, sorted.
fn all_files(dir: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(all_files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

#[test]
fn damaged_folders_never_panic_or_dawdle() {
    let sample = compressible(VoxelType::I16);
    let frame = |method, shuffle| Packed::Blosc(Frame { method, shuffle, block: 1000, split: true, copied: false });
    let mut seeds = vec![
        Zarr { shard: Some([2, 1, 2]), packed: Packed::Zstd, checked: true, ..Zarr::new(3, [7, 17, 5]) },
        Zarr { shard: Some([2, 1, 2]), index_at_start: true, packed: frame(1, 1), ..Zarr::new(3, [7, 17, 5]) },
    ];
    for packed in [Packed::Not, Packed::Gzip, Packed::Zlib, Packed::Bzip2, Packed::Zstd, Packed::Lz4] {
        seeds.push(Zarr { packed, order: [2, 1, 0], ..Zarr::new(2, [19, 17, 10]) });
    }
    for (method, shuffle) in [(0, 1), (1, 0), (1, 2), (3, 1), (4, 1), (4, 2)] {
        seeds.push(Zarr { packed: frame(method, shuffle), ..Zarr::new(2, [19, 17, 13]) });
    }
    let limits = Limits::new().voxel_bytes(64 << 20);
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("damaged");
    let mut random = Random(42);
    let (mut read, mut refused) = (0, 0);
    let mut writers: Vec<Box<dyn Fn()>> = vec![Box::new(|| drop(image(&path, 2)))];
    writers.extend(seeds.iter().map(|seed| Box::new(|| seed.write(&sample, &path)) as Box<dyn Fn()>));
    for deflated in [false, true] {
        let (path, plain) = (path.clone(), dir.path().join("plain"));
        writers.push(Box::new(move || {
            image(&plain, 3);
            put(&path, ZIP, zipped(&plain, "", deflated, true, |_| {}));
        }));
    }
    for (id, bytes) in chunks_of_numcodecs() {
        let path = path.clone();
        writers.push(Box::new(move || put_chunk(&path, id, &bytes)));
    }
    for write in writers {
        write();
        let files = all_files(&path);
        let metadata: Vec<_> = files.iter().filter(|f| f.file_name().is_some_and(|n| n.to_string_lossy().contains('z'))).collect();
        for _ in 0..80 {
            // Half of the damage goes into the metadata.
            let file = if random.below(2) == 0 { metadata[random.below(metadata.len())] } else { &files[random.below(files.len())] };
            let good = std::fs::read(file).unwrap();
            let mut bytes = good.clone();
            for _ in 0..1 + random.below(3) {
                let at = random.below(bytes.len().max(1));
                match random.below(6) {
                    _ if bytes.is_empty() => {}
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 => bytes[at] = random.next() as u8,
                    2 => bytes.truncate(at),
                    3 => bytes.insert(at, b"0123456789 -.,\"[]{}\xff"[random.below(20)]),
                    4 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
                    _ => {
                        let copy = bytes[at..(at + 8).min(bytes.len())].to_vec();
                        bytes.splice(at..at, copy);
                    }
                }
            }
            std::fs::write(file, &bytes).unwrap();
            let start = Instant::now();
            let zip = path.join(ZIP);
            match io::read(if zip.exists() { &zip } else { &path }, &limits) {
                Ok(v) => {
                    read += 1;
                    assert_eq!(v.voxels().len(), v.grid().voxel_count());
                }
                Err(e) => {
                    refused += 1;
                    let message = e.to_string();
                    assert!(!message.contains('\n') && message.contains("damaged"), "{message:?}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {}", start.elapsed(), bytes.escape_ascii());
            std::fs::write(file, good).unwrap();
        }
        std::fs::remove_dir_all(&path).unwrap();
    }
    // Damage among the voxels is often harmless, damage in the metadata seldom: both must have happened.
    assert!(read > 100 && refused > 800, "{read} read, {refused} refused");
}
