//! VTK's XML format: every way to write an array, where its grid is, which array is taken, and damage.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod files;
#[path = "files/vti.rs"]
mod writer;

use files::{Random, Sample, gz};
use glam::DVec3;
use slicestack::Limits;
use slicestack::volume::io::{self, Choice, Endian, Item, Part, Reading};
use slicestack::volume::{Colors, Volume, VoxelType, Voxels};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use writer::{Array, Pack, Style, Way, base64, kind_name};

const WAYS: [Way; 4] = [Way::Text, Way::Base64, Way::AppendedRaw, Way::AppendedBase64];
const PACKS: [Pack; 3] = [Pack::None, Pack::Zlib, Pack::Lz4];
const ORDERS: [Endian; 2] = [Endian::Little, Endian::Big];
const SPACE: &str = "Origin=\"1 2 3\" Spacing=\"1 2 3\"";

fn scalars(name: &str, sample: &Sample, endian: Endian) -> Array {
    let (kind, name) = (kind_name(sample.kind()), name.to_owned());
    Array { kind, name, components: 1, bytes: sample.bytes(endian), text: sample.text() }
}

/// Numbers of several components, all below 120.
fn tuples(kind: &'static str, name: &str, components: usize, numbers: &[u8]) -> Array {
    let wide = |n: &u8| if kind == "UInt16" { vec![*n, 0] } else { vec![*n] };
    let bytes = numbers.iter().flat_map(wide).collect();
    Array { kind, name: name.to_owned(), components, bytes, text: numbers.iter().map(|n| format!("{n} ")).collect() }
}

fn open(bytes: &[u8], reading: &Reading) -> Result<Volume, String> {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("volume.vti");
    std::fs::write(&path, bytes).unwrap();
    io::read_as(&path, reading).map_err(|e| {
        let line = e.to_string();
        assert!(line.contains("volume.vti") && !line.contains('\n') && line.len() < 400, "{line:?}");
        line
    })
}

fn read(bytes: &[u8]) -> Volume {
    open(bytes, &Reading::new()).unwrap()
}

fn told(bytes: &[u8]) -> String {
    open(bytes, &Reading::new()).unwrap_err()
}

fn chosen(choice: Choice) -> Reading {
    Reading::new().choice(choice)
}

/// `file` with the first `from` replaced.
fn with(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = file.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

#[test]
fn every_type_comes_back_in_every_way() {
    let mut read_back = 0;
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, [5, 4, 6]);
        for (way, pack, endian) in WAYS.into_iter().flat_map(|w| PACKS.into_iter().flat_map(move |p| ORDERS.map(|o| (w, p, o)))) {
            for (wide, block) in [(false, 96), (true, 104), (true, 1 << 15)] {
                let style = Style { endian, wide, block, ..Style::new(way, pack) };
                let file = style.image(sample.dims, SPACE, &[scalars("density", &sample, endian)], &[]);
                for bytes in [gz(&file), file] {
                    let volume = read(&bytes);
                    assert_eq!(*volume.voxels(), sample.voxels, "{kind} {style:?}");
                    assert_eq!(volume.grid().dims(), sample.dims);
                    assert!(volume.notes().is_empty(), "{:?}", volume.notes());
                    read_back += 1;
                }
            }
        }
    }
    assert_eq!(read_back, 8 * 24 * 3 * 2);
}

#[test]
fn integers_of_64_bits_are_kept_where_they_fit() {
    let numbers: Vec<i64> = (0..24).map(|n| n * 1_000_003 - 7).collect();
    for endian in ORDERS {
        for (way, pack) in [(Way::AppendedRaw, Pack::None), (Way::Base64, Pack::Zlib), (Way::Text, Pack::None)] {
            let style = Style { endian, ..Style::new(way, pack) };
            let array = |kind, numbers: &[i64]| Array {
                kind,
                name: "labels".to_owned(),
                components: 1,
                bytes: numbers.iter().flat_map(|n| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() }).collect(),
                text: numbers.iter().map(|n| format!("{n}\n")).collect(),
            };
            let volume = read(&style.image([2, 3, 4], SPACE, &[array("Int64", &numbers)], &[]));
            assert_eq!(*volume.voxels(), Voxels::I32(numbers.iter().map(|&n| n as i32).collect()));
            let high: Vec<i64> = numbers.iter().map(|n| n + 3_000_000_000).collect();
            let volume = read(&style.image([2, 3, 4], SPACE, &[array("UInt64", &high)], &[]));
            assert_eq!(*volume.voxels(), Voxels::U32(high.iter().map(|&n| n as u32).collect()));
            let line = told(&style.image([2, 3, 4], SPACE, &[array("Int64", &high)], &[]));
            assert!(line.contains("voxel 0 is") && line.contains("2999999993") && line.contains("i32"), "{line}");
        }
    }
}

#[test]
fn large_raw_arrays_are_mapped() {
    let sample = Sample::new(VoxelType::U16, [20, 30, 40]);
    let first = Sample::new(VoxelType::U8, [20, 30, 40]);
    let style = Style::new(Way::AppendedRaw, Pack::None);
    let file = style.image(sample.dims, SPACE, &[scalars("a", &first, style.endian), scalars("b", &sample, style.endian)], &[]);
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("volume.vti");
    for spaces in 0..4 {
        // The place in the file decides whether the numbers are aligned.
        let file = with(&file, "<PointData>", &format!("<PointData>{}", " ".repeat(spaces)));
        std::fs::write(&path, &file).unwrap();
        let start = &sample.bytes(style.endian)[..60];
        let at = file.windows(60).position(|w| w == start).unwrap();
        let limits = Limits::new().map_bytes(1000);
        for (name, voxels) in [("a", &first.voxels), ("b", &sample.voxels)] {
            let volume = io::read_as(&path, &chosen(Choice::new().array(name)).limits(limits)).unwrap();
            assert_eq!(volume.voxels(), voxels);
            assert_eq!(volume.voxels().is_mapped(), name == "a" || at % 2 == 0, "{name} {spaces}");
        }
    }
}

#[test]
fn origin_spacing_direction_and_extent_place_the_grid() {
    let sample = Sample::new(VoxelType::I16, [5, 4, 6]);
    let style = Style::new(Way::Text, Pack::None);
    let turned = "Origin=\"1 2 3\" Spacing=\"0.5 2 3\" Direction=\"0 -1 0 1 0 0 0 0 1\"";
    let file = style.image(sample.dims, turned, &[scalars("a", &sample, style.endian)], &[]);
    let file = with(&file, "Extent=\"0 4 0 3 0 5\"", "Extent=\"10 14 -1 2 0 5\"");
    let volume = read(&with(&file, "<Piece Extent=\"0 4 0 3 0 5\"", "<Piece Extent=\"10 14 -1 2 0 5\""));
    // Rows of Direction are rows of the matrix: x of the grid runs along the world's y, y against its x.
    let world = |p: [f64; 3]| volume.grid().index_to_world().transform_point3(DVec3::from_array(p));
    assert_eq!(world([0.0; 3]), DVec3::new(1.0 + 2.0, 2.0 + 5.0, 3.0));
    assert_eq!(world([1.0, 0.0, 0.0]) - world([0.0; 3]), DVec3::new(0.0, 0.5, 0.0));
    assert_eq!(world([0.0, 1.0, 0.0]) - world([0.0; 3]), DVec3::new(-2.0, 0.0, 0.0));
    assert_eq!(world([0.0, 0.0, 1.0]) - world([0.0; 3]), DVec3::new(0.0, 0.0, 3.0));
    // A piece alone of a larger whole.
    let part = read(&with(&file, "WholeExtent=\"10", "WholeExtent=\"-20"));
    assert_eq!(part.grid().dims(), sample.dims);
    assert_eq!(part.notes(), ["the file has the extent 0 4 0 3 0 5 of the whole extent -20 14 -1 2 0 5"]);
    // Nothing said.
    let plain = style.image(sample.dims, "", &[scalars("a", &sample, style.endian)], &[]);
    assert_eq!(read(&plain).grid().index_to_world().translation, DVec3::ZERO);
    assert!(told(&style.image(sample.dims, "Spacing=\"1 0 1\"", &[scalars("a", &sample, style.endian)], &[])).contains("axis 1 is 0"));
    let flat = Sample::new(VoxelType::U8, [5, 4, 1]);
    let volume = read(&style.image(flat.dims, "Spacing=\"2 2 0\"", &[scalars("a", &flat, style.endian)], &[]));
    assert_eq!(volume.notes(), ["the spacing along z, where there is one layer of points, is taken as 1"]);
    assert_eq!(volume.grid().spacing(), [2.0, 2.0, 1.0]);
}

#[test]
fn cells_lie_between_the_points() {
    let sample = Sample::new(VoxelType::F32, [4, 3, 1]);
    let style = Style { endian: Endian::Big, ..Style::new(Way::AppendedBase64, Pack::Lz4) };
    let volume = read(&style.image([5, 4, 1], SPACE, &[], &[scalars("density", &sample, Endian::Big)]));
    assert_eq!(*volume.voxels(), sample.voxels);
    assert_eq!(volume.grid().dims(), [4, 3, 1]);
    assert_eq!(volume.grid().index_to_world().translation, DVec3::new(1.5, 3.0, 3.0));
}

#[test]
fn one_of_several_arrays_is_taken_and_told() {
    let [a, b, c] = [VoxelType::U8, VoxelType::I16, VoxelType::F32].map(|kind| Sample::new(kind, [3, 4, 5]));
    let cell = Sample::new(VoxelType::I8, [2, 3, 4]);
    let vectors: Vec<u8> = (0..180).map(|n| n as u8 % 120).collect();
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("volume.vti");
    for (way, pack) in
        [(Way::AppendedRaw, Pack::None), (Way::AppendedBase64, Pack::Zlib), (Way::Base64, Pack::Lz4), (Way::Text, Pack::None)]
    {
        let style = Style::new(way, pack);
        let points = [
            tuples("UInt16", "v", 3, &vectors),
            scalars("a", &a, style.endian),
            scalars("b", &b, style.endian),
            scalars("c", &c, style.endian),
        ];
        let file = style.image([3, 4, 5], SPACE, &points, &[scalars("a", &cell, style.endian)]);
        let volume = read(&file);
        assert_eq!(*volume.voxels(), a.voxels);
        assert_eq!(volume.notes(), ["of the 5 arrays \"a\" (UInt8, 1 component, points) is read; volume.array chooses another"]);
        let active = with(&file, "<PointData>", "<PointData Scalars=\"c\">");
        assert_eq!(*read(&active).voxels(), c.voxels);
        let read = |choice: Choice| open(&active, &chosen(choice)).unwrap();
        assert_eq!(*read(Choice::new().array("b")).voxels(), b.voxels);
        assert!(read(Choice::new().array("b")).notes().is_empty());
        assert_eq!(*read(Choice::new().array("a").channel(0)).voxels(), a.voxels);
        assert_eq!(*read(Choice::new().array("cells:a")).voxels(), cell.voxels);
        let component = |c: usize| Voxels::U16(vectors.iter().skip(c).step_by(3).map(|&n| u16::from(n)).collect());
        assert_eq!(*read(Choice::new().array("v")).voxels(), component(0));
        assert!(read(Choice::new().array("v")).notes()[0].contains("of the 3 components of \"v\" the first one is read"));
        for c in 0..3 {
            assert_eq!(*read(Choice::new().array("v").channel(c)).voxels(), component(c));
        }
        let refused = |choice| open(&active, &chosen(choice)).unwrap_err();
        assert!(refused(Choice::new().array("v").channel(3)).contains("volume.channel is 3: there are 3, 0 to 2"));
        assert!(refused(Choice::new().channel(1)).contains("there is one channel only"));
        assert!(refused(Choice::new().array("d")).contains("volume.array is \"d\": there is no such array, only \"v\", \"a\""));
        assert!(refused(Choice::new().frame(1)).contains("has no frame to choose"));

        std::fs::write(&path, &active).unwrap();
        let shown = |choice| -> Vec<(Part, String, usize, String, bool)> {
            let items = io::list(&path, &chosen(choice)).unwrap();
            items.into_iter().map(|Item { part, id, count, about, taken, .. }| (part, id, count, about, taken)).collect()
        };
        let all = shown(Choice::new());
        let ids: Vec<&str> = all.iter().map(|i| i.1.as_str()).collect();
        assert_eq!(ids, ["v", "a", "b", "c", "cells:a"]);
        assert_eq!(all.iter().position(|i| i.4), Some(3));
        assert_eq!((all[0].3.as_str(), all[4].3.as_str()), ("UInt16, 3 components, points", "Int8, 1 component, cells"));
        let all = shown(Choice::new().array("v").channel(2));
        assert_eq!((all[0].4, all.len(), all[5].0, all[5].2), (true, 6, Part::Channel, 3));
        assert_eq!(all[5].3, "components of \"v\", number 2 is taken");
    }
}

#[test]
fn bytes_of_three_or_four_components_are_colours() {
    for (way, pack) in WAYS.into_iter().flat_map(|w| PACKS.map(|p| (w, p))) {
        for components in [3, 4] {
            let numbers: Vec<u8> = (0..30 * 40 * 15 * components).map(|n| (n % 119) as u8).collect();
            let style = Style { block: 1000, ..Style::new(way, pack) };
            let file = style.image([30, 40, 15], SPACE, &[tuples("UInt8", "rgb", components, &numbers)], &[]);
            let volume = read(&file);
            let Some(Colors::U8(found)) = volume.colors() else { panic!("no colours: {style:?}") };
            assert_eq!(found.len(), 30 * 40 * 15);
            for (rgba, c) in found.iter().zip(numbers.chunks(components)) {
                assert_eq!(*rgba, [c[0], c[1], c[2], c.get(3).copied().unwrap_or(255)]);
            }
            assert!(volume.notes()[0].contains("taken for red, green"), "{:?}", volume.notes());
            let one = open(&file, &chosen(Choice::new().channel(1))).unwrap();
            assert_eq!(*one.voxels(), Voxels::U8(numbers.iter().skip(1).step_by(components).copied().collect()));
        }
    }
}

/// Two pieces along x which share the points of one plane.
fn two_pieces(style: Style, sample: &Sample) -> Vec<u8> {
    let [nx, ny, nz] = sample.dims;
    let (mut inside, mut appended) = (Vec::new(), Vec::new());
    for (first, last) in [(3, nx - 1), (0, 3)] {
        let keep: Vec<usize> = (0..nx * ny * nz).filter(|i| (first..=last).contains(&(i % nx))).collect();
        let Voxels::I16(all) = &sample.voxels else { panic!("i16 is needed") };
        let part = Sample { dims: [last - first + 1, ny, nz], voxels: Voxels::I16(keep.iter().map(|&i| all[i]).collect()) };
        let extent = format!("{first} {last} 0 {} 0 {}", ny - 1, nz - 1);
        inside.extend(format!("<Piece Extent=\"{extent}\"><PointData Scalars=\"a\">").bytes());
        inside.extend(style.array(&scalars("a", &part, style.endian), &mut appended));
        inside.extend(b"</PointData></Piece>");
    }
    style.file("ImageData", &format!("WholeExtent=\"0 {} 0 {} 0 {}\"", nx - 1, ny - 1, nz - 1), &inside, &appended)
}

#[test]
fn pieces_are_put_together() {
    let sample = Sample::new(VoxelType::I16, [7, 4, 5]);
    for (way, pack) in WAYS.into_iter().flat_map(|w| PACKS.map(|p| (w, p))) {
        let file = two_pieces(Style::new(way, pack), &sample);
        let volume = read(&file);
        assert_eq!(*volume.voxels(), sample.voxels);
        assert!(volume.notes().is_empty());
        let line = told(&with(&file, "Extent=\"3 6 0 3 0 4\"", "Extent=\"5 8 0 3 0 4\""));
        assert!(line.contains("the 2 pieces do not fill the extent 0 8 0 3 0 4"), "{line}");
        let line = told(&with(&file, "Name=\"a\"", "Name=\"b\""));
        assert!(line.contains("piece 1 has no array \"b\""), "{line}");
    }
}

#[test]
fn rectilinear_grids_are_read_where_their_spacing_is_even() {
    let sample = Sample::new(VoxelType::U8, [3, 4, 1]);
    for (way, pack) in WAYS.into_iter().flat_map(|w| PACKS.map(|p| (w, p))) {
        let file = |x: [f64; 3]| {
            let style = Style::new(way, pack);
            let (mut inside, mut appended) = (b"<Piece Extent=\"2 4 0 3 0 0\"><PointData>".to_vec(), Vec::new());
            inside.extend(style.array(&scalars("a", &sample, style.endian), &mut appended));
            inside.extend(b"</PointData><Coordinates>");
            for axis in [&x[..], &[5.0, 7.0, 9.0, 11.0], &[-4.0]] {
                let places = Sample { dims: [axis.len(), 1, 1], voxels: Voxels::F64(axis.to_vec().into()) };
                inside.extend(style.array(&scalars("", &places, style.endian), &mut appended));
            }
            inside.extend(b"</Coordinates></Piece>");
            style.file("RectilinearGrid", "WholeExtent=\"2 4 0 3 0 0\"", &inside, &appended)
        };
        let volume = read(&file([1.0, 1.5, 2.00001]));
        assert_eq!(*volume.voxels(), sample.voxels);
        let at = volume.grid().index_to_world();
        assert!((at.translation - DVec3::new(1.0, 5.0, -4.0)).length() < 1e-12, "{}", at.translation);
        assert!((DVec3::from(volume.grid().spacing()) - DVec3::new(0.500005, 2.0, 1.0)).length() < 1e-12);
        let line = told(&file([1.0, 1.7, 2.0]));
        assert!(line.contains("uneven spacing (coordinate 1 of axis 0 is 1.7, with even steps it would be 1.5)"), "{line}");
        assert!(told(&file([1.0, f64::NAN, 2.0])).contains("coordinate 1 of axis 0 is NaN"));
    }
}

#[test]
fn what_is_not_read_is_told_by_name() {
    let sample = Sample::new(VoxelType::U8, [3, 4, 5]);
    let style = Style::new(Way::AppendedRaw, Pack::Zlib);
    let file = style.image(sample.dims, SPACE, &[scalars("a", &sample, style.endian)], &[]);
    let plain = Style::new(Way::AppendedRaw, Pack::None).image(sample.dims, SPACE, &[scalars("a", &sample, style.endian)], &[]);
    let text = Style::new(Way::Text, Pack::None).image(sample.dims, SPACE, &[scalars("a", &sample, style.endian)], &[]);
    let inline = Style::new(Way::Base64, Pack::None).image(sample.dims, SPACE, &[scalars("a", &sample, style.endian)], &[]);
    let head = |from, to| with(&file, from, to);
    for (bytes, says) in [
        (head("vtkZLib", "vtkLZMA"), "compressor is \"vtkLZMADataCompressor\": not supported"),
        (head("type=\"ImageData\"", "type=\"UnstructuredGrid\""), "a VTK file of the type \"UnstructuredGrid\": not supported, only"),
        (head("type=\"ImageData\"", "type=\"PImageData\""), "names other files that hold the pieces"),
        (head("version=\"1.0\" b", "version=\"3.1\" b"), "version is \"3.1\""),
        (head("LittleEndian", "MiddleEndian"), "byte_order is \"MiddleEndian\""),
        (head("UInt32", "UInt16"), "header_type is \"UInt16\""),
        (head("encoding=\"raw\"", "encoding=\"hex\""), "encoding of AppendedData is \"hex\""),
        (head("offset=\"0\"", "offset=\"x\""), "offset is \"x\""),
        (head("offset=\"0\"", "offset=\"9999\""), "array \"a\" at byte"),
        (head("type=\"UInt8\"", "type=\"Int16\""), "array \"a\" has 60 bytes, but its extent and type take 120"),
        (head("type=\"UInt8\"", "type=\"String\""), "no array of numbers"),
        (head("format=\"appended\"", "format=\"printed\""), "format is \"printed\""),
        (head("Spacing=\"1 2 3\"", "Spacing=\"1 2\""), "2 numbers, 3 are needed"),
        (head("Spacing=\"1 2 3\"", "Spacing=\"1 x 3\""), "\"x\" is not a number"),
        (head("<Piece Extent=\"0 2 0 3 0 4\"", "<Piece Extent=\"0 2 0 3 0 a\""), "\"a\" is no integer"),
        (head("<Piece Extent=\"0 2 0 3 0 4\"", "<Piece Extent=\"0 2 0 3 0 -1\""), "no piece with points"),
        (head("<Piece Extent=\"0 2 0 3 0 4\"", "<Piece Extent=\"0 2 0 3 0 2147483647\""), "2147483648 along one axis"),
        (head("\n _", "\n x_"), "AppendedData starts with \"x\" at byte"),
        (head("NumberOfComponents=\"1\"", "NumberOfComponents=\"99\""), "array \"a\" has 60 bytes, but its extent and type take 5940"),
        (head("<PointData>", "<!DOCTYPE a [<!ENTITY b \"c\">]><PointData>"), "the XML has a DTD"),
        (head("Name=\"a\"", "Name=\"&b;\""), "the XML is damaged"),
        (head("<PointData>", "<PointData a=\"1\" a=\"2\">"), "the XML is damaged"),
        (head("<PointData>", &format!("<PointData {}>", "a=\"\" ".repeat(65))), "more than 64 attributes in the tag before byte"),
        (head("<PointData>", &"<a>".repeat(40)), "more than 32 deep"),
        (head("<PointData>", &format!("<PointData b=\"{}\">", "c".repeat(70_000))), "a tag of more than 65536 bytes"),
        (head("<PointData>", &" ".repeat(1_100_000)), "bytes of XML outside the arrays"),
    ] {
        let line = told(&bytes);
        assert!(line.contains(says), "{line}, should say {says}");
    }
    let at = plain.windows(3).position(|w| w == b"\n _").unwrap() + 2;
    let mut wrong = plain.clone();
    wrong[at + 1] ^= 1;
    assert!(told(&wrong).contains("array \"a\" has 61 bytes, but its extent and type take 60"));
    assert!(told(&plain[..at + 40]).contains("60 bytes, the file holds 35 after its header"), "{}", told(&plain[..at + 40]));
    assert!(told(&plain[..at]).contains("where appended data should start"));
    assert!(told(&plain[..at - 60]).contains("the file ends"));
    let end = text.windows(13).position(|w| w == b"\n</DataArray>").unwrap();
    assert!(told(&text[..end - 5]).contains("within the element DataArray"), "{}", told(&text[..end - 5]));
    assert!(told(&with(&text, "\n</DataArray>", "\n7 </DataArray>")).contains("more than 60 numbers"));
    assert!(told(&with(&text, "0\n255\n", "0\n256\n")).contains("voxel 1 is \"256\", which is no u8"));
    assert!(told(&with(&text, "0\n255\n", "0\n")).contains("only 59 are there"));
    assert!(told(&with(&inline, "\n</DataArray>", "<Value/>x</DataArray>")).contains("in several parts"));
    let line = told(&with(&inline, &String::from_utf8(base64(&[60, 0, 0])).unwrap(), "PA~A"));
    assert!(line.contains("\"~\" stands where base64 has no such character"), "{line}");
    let none = Style::new(Way::Text, Pack::None).file("ImageData", "WholeExtent=\"0 1 0 1 0 1\"", b"<Piece/>", b"");
    assert!(told(&none).contains("no array of numbers"));
    assert!(told(b"<?xml version=\"1.0\"?><a/>").contains("an XML file: not supported"));
    assert!(told(b"<a>VTKFile</a>").contains("not of VTKFile"));
}

#[test]
fn claims_are_refused_before_memory_is_taken() {
    let before = peak();
    let sample = Sample::new(VoxelType::U8, [8, 8, 8]);
    for way in [Way::AppendedRaw, Way::AppendedBase64, Way::Base64] {
        for pack in PACKS {
            let style = Style { block: 512, ..Style::new(way, pack) };
            let mut array = scalars("a", &sample, style.endian);
            let file = style.image(sample.dims, SPACE, &[array], &[]);
            let limited = open(&file, &Reading::new().limits(Limits::new().voxel_bytes(511))).unwrap_err();
            assert!(limited.contains("512 is over the limit of 511"), "{limited}");
            // Ten bytes that say they are a gibibyte.
            array = scalars("a", &sample, style.endian);
            array.bytes.truncate(10);
            let huge = style.image([1024, 1024, 1024], SPACE, &[array], &[]);
            assert!(told(&huge).contains("1073741824"), "{}", told(&huge));
        }
    }
    // Tables that claim more than is there.
    let words = |w: [u32; 4]| w.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let style = Style::new(Way::AppendedRaw, Pack::Zlib);
    let file = |words: &[u8]| {
        let piece = b"<Piece Extent=\"0 1023 0 1023 0 1023\"><PointData><DataArray type=\"UInt8\" Name=\"a\" format=\"appended\" offset=\"0\"/></PointData></Piece>";
        style.file("ImageData", "WholeExtent=\"0 1023 0 1023 0 1023\"", piece, words)
    };
    let line = told(&file(&words([1, 1 << 30, 0, 20])));
    assert!(line.contains("takes 1073741824 bytes, but 20 compressed bytes cannot hold more than 20640"), "{line}");
    let line = told(&file(&words([1 << 30, 1, 0, 20])));
    assert!(line.contains("cannot have 1073741824 compressed blocks of 1 bytes"), "{line}");
    let line = told(&file(&words([1, 1 << 30, 0, u32::MAX])));
    assert!(line.contains("takes 4294967295 bytes for 1073741824"), "{line}");
    let line = told(&file(&words([u32::MAX, u32::MAX, u32::MAX, 1])));
    assert!(line.contains("has 18446744065119617025 bytes, but its extent and type take 1073741824"), "{line}");
    let grown = peak() - before;
    assert!(grown < 1 << 29, "address space grew by {grown} bytes");
}

/// Peak of this process's address space in bytes: memory that was asked for, used or not.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmPeak:"));
    line.and_then(|l| l.split_whitespace().nth(1)?.parse::<u64>().ok()).map_or(0, |kib| kib * 1024)
}

#[cfg(unix)]
#[test]
fn appended_arrays_come_through_a_pipe_and_others_are_refused() {
    let sample = Sample::new(VoxelType::U16, [5, 4, 6]);
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("volume.vti");
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    let through = |file: Vec<u8>| {
        let to = path.clone();
        let writer = std::thread::spawn(move || drop(std::fs::write(to, file)));
        let result = io::read(&path, &Limits::new()).map_err(|e| e.to_string());
        writer.join().unwrap();
        result
    };
    for (way, pack) in WAYS.into_iter().flat_map(|w| PACKS.map(|p| (w, p))) {
        let style = Style::new(way, pack);
        let file = style.image(sample.dims, SPACE, &[scalars("a", &sample, style.endian)], &[]);
        for file in [gz(&file), file] {
            match through(file) {
                Ok(volume) => assert!(*volume.voxels() == sample.voxels && matches!(way, Way::AppendedRaw | Way::AppendedBase64)),
                Err(line) => assert!(line.contains("cannot be read from a pipe") && matches!(way, Way::Text | Way::Base64), "{line}"),
            }
        }
    }
}

#[test]
fn reading_pieces_can_be_stopped() {
    struct Stop;
    impl slicestack::Progress for Stop {
        fn step(&self, _: &str, done: u64, total: u64) -> bool {
            assert_eq!(total, 2);
            done < 1
        }
    }
    let file = two_pieces(Style::new(Way::AppendedRaw, Pack::None), &Sample::new(VoxelType::I16, [7, 4, 5]));
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("volume.vti");
    std::fs::write(&path, file).unwrap();
    let result = io::read_as(&path, &Reading::new().progress(std::sync::Arc::new(Stop)));
    assert!(matches!(result, Err(slicestack::Error::Stopped)));
}

#[test]
fn damaged_files_never_panic_or_dawdle() {
    let s = Sample::new(VoxelType::I16, [4, 5, 6]);
    let mut seeds = vec![two_pieces(Style::new(Way::AppendedRaw, Pack::Lz4), &s)];
    for (way, pack) in WAYS.into_iter().flat_map(|w| PACKS.map(|p| (w, p))) {
        seeds.push(Style { wide: true, ..Style::new(way, pack) }.image(s.dims, SPACE, &[scalars("a", &s, Endian::Little)], &[]));
    }
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("damaged.vti");
    let mut random = Random(42);
    let (mut read, mut refused, before) = (0, 0, peak());
    for seed in &seeds {
        let head = seed.iter().rposition(|&b| b == b'_').unwrap_or(400).min(600);
        for _ in 0..150 {
            let mut bytes = seed.clone();
            for _ in 0..1 + random.below(4) {
                let reach = if random.below(2) == 0 { bytes.len().min(head) } else { bytes.len() };
                let at = random.below(reach.max(1));
                match random.below(6) {
                    _ if bytes.is_empty() => {}
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 => bytes[at] = random.next() as u8,
                    2 if random.below(3) == 0 => bytes.truncate(at),
                    2 | 3 => bytes.insert(at, b"0123456789 -.\n<>\"_="[random.below(19)]),
                    4 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
                    _ => {
                        let copy = bytes[at..(at + 8).min(bytes.len())].to_vec();
                        bytes.splice(at..at, copy);
                    }
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            let start = Instant::now();
            match Volume::open(&path) {
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
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {:?}", start.elapsed(), bytes.escape_ascii().to_string());
        }
    }
    assert!(read > 100 && refused > 1000, "{read} read, {refused} refused");
    // Threads' own arenas are far below this.
    let grown = peak() - before;
    assert!(grown < 1 << 30, "address space grew by {grown} bytes");
}
