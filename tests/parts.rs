//! Parts of volumes that a scene asks for: crop boxes, and the magnitude of vectors.

#![cfg(feature = "scene-file")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use slicestack::scene::{Overrides, SceneFile};
use slicestack::volume::edit::CropBox;
use slicestack::volume::io::{self, Choice, Reading};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Channels, Grid, Origin, Segment, VolumeSource, Voxels};
use slicestack::{Limits, Volume};
use std::fmt::Write;
use std::path::PathBuf;

/// Voxels along x, y and z.
const DIMS: [usize; 3] = [5, 4, 3];
const COUNT: usize = 60;

/// A file of these bytes, in the folder of one test.
fn file(test: &str, name: &str, bytes: &[u8]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("parts").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The three numbers of voxel i, some of them negative.
fn vector(i: usize) -> [f64; 3] {
    [i as f64 * 3.0 - 40.0, 4.0 - (i % 7) as f64, ((i * i) % 11) as f64]
}

fn magnitude(i: usize) -> f64 {
    let [x, y, z] = vector(i);
    (x * x + y * y + z * z).sqrt()
}

/// The vectors in files of several formats, as 16-bit numbers and as text.
fn files(test: &str) -> Vec<PathBuf> {
    let words: Vec<u8> = (0..COUNT).flat_map(vector).flat_map(|x| (x as i16).to_le_bytes()).collect();
    let with = |header: &str| [header.as_bytes(), &words].concat();
    let nrrd =
        "NRRD0004\ntype: short\ndimension: 4\nsizes: 3 5 4 3\nkinds: 3-vector domain domain domain\nendian: little\nencoding: raw\n\n";
    let mha = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 5 4 3\n\
               ElementNumberOfChannels = 3\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
    let mut header = "{'descr': '<i2', 'fortran_order': False, 'shape': (3, 4, 5, 3), }".to_owned();
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let npy = [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), &words].concat();
    let mut vtk = "# vtk DataFile Version 3.0\nflow\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 4 3\nORIGIN 0 0 0\nSPACING 1 1 1\n\
                   POINT_DATA 60\nVECTORS flow float\n"
        .to_owned();
    let mut numbers = String::new();
    for [x, y, z] in (0..COUNT).map(vector) {
        writeln!(numbers, "{x} {y} {z}").unwrap();
    }
    vtk += &numbers;
    let vti = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <ImageData WholeExtent=\"0 4 0 3 0 2\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n<Piece Extent=\"0 4 0 3 0 2\">\n<PointData Vectors=\"flow\">\n\
         <DataArray type=\"Float64\" Name=\"flow\" NumberOfComponents=\"3\" format=\"ascii\">\n{numbers}</DataArray>\n</PointData>\n</Piece>\n\
         </ImageData>\n</VTKFile>\n"
    );
    vec![
        file(test, "flow.nrrd", &with(nrrd)),
        file(test, "flow.mha", &with(mha)),
        file(test, "flow.npy", &npy),
        file(test, "flow.vtk", vtk.as_bytes()),
        file(test, "flow.vti", vti.as_bytes()),
    ]
}

#[test]
fn the_magnitude_of_vectors_in_every_format_that_has_them() {
    for path in files("magnitude") {
        let name = path.display();
        let reading = Reading::new().choice(Choice::new().magnitude());
        let volume = io::read_as(&path, &reading).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(volume.grid().dims(), DIMS, "{name}");
        for i in 0..COUNT {
            let at = [i % 5, i / 5 % 4, i / 20];
            let got = volume.value(at);
            assert!((got - magnitude(i)).abs() <= 1e-7 * magnitude(i), "{name}, voxel {i}: {got}, not {}", magnitude(i));
        }
        assert!(
            matches!((volume.voxels(), path.extension().unwrap() == "vti"), (Voxels::F64(_), true) | (Voxels::F32(_), false)),
            "{name}"
        );
        assert!(volume.notes().iter().any(|note| note.contains("magnitude of 3 numbers")), "{name}: {:?}", volume.notes());
        // One of them is still there by its number; and by the key of a scene.
        let one = io::read_as(&path, &Reading::new().choice(Choice::new().channel(1))).unwrap();
        assert_eq!(one.value([3, 2, 1]), vector(33)[1], "{name}");
        for (key, want) in [("\"magnitude\"", magnitude(33)), ("1", vector(33)[1]), ("\"1\"", vector(33)[1])] {
            let text = format!("[volume]\npath = {:?}\nchannel = {key}\n", path.display().to_string());
            let scene = SceneFile::parse(&text, "", &Overrides::default()).unwrap();
            let loaded = scene.volume().load(&Limits::default()).unwrap();
            assert!((loaded.value([3, 2, 1]) - want).abs() < 1e-5, "{name}: {key}");
        }
    }
}

#[test]
fn what_has_no_magnitude_is_refused_in_one_line() {
    let mut header = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\n\n".to_vec();
    header.extend(0..COUNT as u8);
    let path = file("refused", "scalars.nrrd", &header);
    let line = io::read_as(&path, &Reading::new().choice(Choice::new().magnitude())).unwrap_err().to_string();
    assert!(line.contains("one number each") && line.contains("scalars.nrrd") && !line.contains('\n'), "{line}");
    let tight = Reading::new().choice(Choice::new().magnitude()).limits(Limits::new().voxel_bytes(8 * COUNT as u64 - 1));
    let line = io::read_as(&files("refused")[2], &tight).unwrap_err().to_string();
    assert!(line.contains("480"), "{line}");
    let text = "[volume]\npath = \"a.nrrd\"\nchannel = \"size\"\n";
    let line = SceneFile::parse(text, "", &Overrides::default()).unwrap_err().to_string();
    assert!(line.contains("magnitude") && line.contains("volume.channel"), "{line}");
}

#[test]
fn a_crop_box_keeps_its_voxels_where_they_were() {
    let whole = Phantom::SheppLogan.volume(16).unwrap();
    let text = |keys: &str| format!("[volume]\nphantom = \"shepp-logan\"\nsize = 16\n{keys}");
    let parsed = |keys: &str| SceneFile::parse(&text(keys), "", &Overrides::default());
    let loaded = |keys: &str| parsed(keys).unwrap().volume().load(&Limits::default());
    let part = loaded("crop = [[2, 9], [0, 16], [5, 6]]\n").unwrap();
    assert_eq!(part.grid().dims(), [7, 16, 1]);
    for (i, j) in (0..7).flat_map(|i| (0..16).map(move |j| (i, j))) {
        assert_eq!(part.value([i, j, 0]), whole.value([i + 2, j, 5]));
    }
    let world = |v: &Volume, at: [f64; 3]| v.grid().index_to_world().transform_point3(at.into());
    assert!((world(&part, [0.0; 3]) - world(&whole, [2.0, 0.0, 5.0])).length() < 1e-12);
    assert_eq!(part.notes().last().unwrap(), "cropped: voxels 2:9,0:16,5:6 of 16 x 16 x 16");

    // The same box in world units: bounds on the centres hold them, a hair inside leaves them out.
    let (a, b) = (world(&whole, [2.0, 0.0, 5.0]), world(&whole, [8.0, 15.0, 5.0]));
    let bounds = |grown: f64| {
        format!("crop = [[{:?}, {:?}], [-1e9, 1e9], [{:?}, {:?}]]\ncrop_unit = \"world\"\n", a.x - grown, b.x + grown, a.z, b.z)
    };
    assert_eq!(loaded(&bounds(0.0)).unwrap().grid(), part.grid());
    assert_eq!(loaded(&bounds(-0.01 * whole.grid().spacing()[0])).unwrap().grid().dims(), [5, 16, 1]);
    // After all other changes: in a spacing and a place of its own.
    let moved = loaded(
        "spacing = [2.0, 2.0, 2.0]\norigin = [10.0, 0.0, 0.0]\ncrop = [[13.0, 16.5], [0.0, 2.0], [3.0, 9.0]]\ncrop_unit = \"world\"\n",
    )
    .unwrap();
    assert_eq!((moved.grid().dims(), moved.grid().origin().to_array()), ([2, 2, 3], [14.0, 0.0, 4.0]));

    let said = |result: slicestack::Result<String>| {
        let line = result.unwrap_err().to_string();
        assert!(!line.contains('\n'), "{line}");
        line
    };
    let refused = |keys: &str| said(parsed(keys).map(|_| String::new()));
    let unread = |keys: &str| said(loaded(keys).map(|v| format!("{:?}", v.grid().dims())));
    assert!(unread("crop = [[2, 17], [0, 16], [0, 16]]\n").contains("2:17 along x: not empty and within 0:16"));
    assert!(refused("crop = [[2, 2], [0, 16], [0, 16]]\n").contains("volume.crop"));
    assert!(refused("crop = [[0, 2.5], [0, 16], [0, 16]]\n").contains("whole numbers"));
    assert!(refused("crop = [[-1, 2], [0, 16], [0, 16]]\n").contains("whole numbers"));
    assert!(refused("crop_unit = \"world\"\n").contains("volume.crop_unit"));
    assert!(refused("crop = [[3, 2], [0, 16], [0, 16]]\ncrop_unit = \"world\"\n").contains("rising"));
    assert!(unread("crop = [[1e6, 2e6], [0, 16], [0, 16]]\ncrop_unit = \"world\"\n").contains("no voxel's centre"));
}

/// A world box over turned axes keeps every voxel whose centre lies in it.
#[test]
fn a_world_box_over_oblique_axes_holds_all_centres_in_it() {
    let turn = glam::DMat3::from_rotation_z(0.6) * glam::DMat3::from_rotation_x(-0.4);
    let grid = Grid::new([12, 10, 8], [3.0, -2.0, 1.0].into(), turn * glam::DMat3::from_diagonal([1.0, 1.5, 0.7].into())).unwrap();
    let volume = Volume::new(grid.clone(), Voxels::U16((0..960).collect::<Vec<u16>>().into())).unwrap();
    let bounds = [[4.0, 8.0], [1.0, 5.0], [-1.0, 2.5]];
    let ranges = CropBox::World(bounds).ranges(&volume).unwrap();
    let mut inside = 0;
    for (k, j, i) in (0..8).flat_map(|k| (0..10).flat_map(move |j| (0..12).map(move |i| (k, j, i)))) {
        let p = grid.index_to_world().transform_point3([i as f64, j as f64, k as f64].into());
        if (0..3).all(|axis| (bounds[axis][0]..=bounds[axis][1]).contains(&p[axis])) {
            inside += 1;
            assert!(ranges[0].contains(&i) && ranges[1].contains(&j) && ranges[2].contains(&k), "{i},{j},{k}");
        }
    }
    assert!(inside > 20 && ranges.iter().map(|r| r.len()).product::<usize>() < 960, "{inside} of {ranges:?}");
}

#[test]
fn labels_and_colours_are_cropped_alike() {
    let grid = Grid::with_spacing(DIMS, [1.0; 3]).unwrap();
    let crop = CropBox::Voxels([1..4, 0..2, 2..3]);
    let colors = Volume::with_colors(grid.clone(), Voxels::U8((0..240).collect::<Vec<u8>>().into())).unwrap();
    let part = crop.part(&colors, None).unwrap();
    assert_eq!((part.grid().dims(), part.colors().unwrap().get(0)), ([3, 2, 1], colors.colors().unwrap().get(41)));
    let segments = vec![Segment::new(3, "liver")];
    let labels =
        Volume::new(grid, Voxels::U8((0..60).map(|i| i % 5).collect::<Vec<u8>>().into())).unwrap().with_segments(segments).unwrap();
    let part = crop.part(&labels, None).unwrap();
    assert_eq!((part.value([1, 1, 0]), part.channels()), (labels.value([2, 1, 2]), labels.channels()));
    assert!(matches!(part.channels(), Channels::Label(_)));
    // A source with its box in the library.
    let source = VolumeSource::new(Origin::Phantom(Phantom::Cloud, 12)).with_crop(crop);
    assert_eq!(source.load(&Limits::default()).unwrap().grid().dims(), [3, 2, 1]);
}
