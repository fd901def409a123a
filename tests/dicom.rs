//! DICOM files of every kind that is read, written here, and read back to the voxel; and what is said of those that are not.

#![cfg(feature = "dicom")]
#![allow(clippy::unwrap_used, reason = "a test that cannot write its file shall stop")]

mod files;
mod peak;

use files::dicom::{
    BIG, DEFLATED, EXPLICIT, IMPLICIT, JPEG_BASELINE, JPEG_LOSSLESS, JPEG_LS, RLE, Set, Value, element, encapsulated, file, jpeg_blocks,
    jpeg_lossless, noise, rle, slice, tar,
};
use files::{Random, gz, join, npz, zip};
use slicestack::volume::io::{self, Choice, Part, Reading};
use slicestack::volume::{Colors, Modality, Space, VoxelType, Voxels};
use slicestack::{Error, Limits, Progress, Volume};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Writes files with names of their own into a folder.
fn folder(files: &[(String, Vec<u8>)]) -> TempDir {
    let dir = TempDir::new().unwrap();
    for (name, bytes) in files {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    dir
}

fn one(bytes: &[u8]) -> slicestack::Result<Volume> {
    let dir = folder(&[("image.dcm".to_owned(), bytes.to_vec())]);
    Volume::open(dir.path().join("image.dcm"))
}

fn refused(path: &Path) -> String {
    let line = Volume::open(path).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.len() < 400, "{line}");
    line
}

fn told(volume: &Volume, what: &str) -> bool {
    volume.notes().iter().any(|n| n.contains(what))
}

fn numbers(volume: &Volume) -> Vec<f64> {
    let voxels = volume.scalars().unwrap();
    (0..voxels.len()).map(|i| voxels.get(i)).collect()
}

const COLUMNS: u16 = 5;
const ROWS: u16 = 3;
const PIXELS: usize = 15;

/// A frame of 16 bits in JPEG-LS.
fn jpeg_ls(pixels: &[u16]) -> Vec<u8> {
    let mut out = Vec::new();
    jpegls::encode(pixels, COLUMNS.into(), ROWS.into(), &mut out).unwrap();
    out
}

/// Slices of a series at the positions `z`, named so that no order of names is theirs; the first one's pixels are `noise(PIXELS, 0)`.
fn series(uid: &str, z: &[f64], change: impl Fn(usize, Set) -> Set) -> Vec<(String, Vec<u8>)> {
    let set = |i: usize| change(i, slice(COLUMNS, ROWS, uid, 100 - i as i64, z[i], &noise(PIXELS, i as u64)));
    (0..z.len()).map(|i| (format!("IM{:03}", (i * 7 + 3) % 101), file(&set(i), EXPLICIT, None))).collect()
}

/// What the slices of [`series`] hold, those of `order` one after the other.
fn expected(order: impl IntoIterator<Item = usize>) -> Vec<f64> {
    order.into_iter().flat_map(|i| noise(PIXELS, i as u64)).map(f64::from).collect()
}

#[test]
fn every_type_in_every_transfer_syntax_to_the_voxel() {
    let words = noise(PIXELS * 3 * 2, 7);
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    for (bits, signed) in [(8u16, 0u16), (8, 1), (16, 0), (16, 1), (32, 0), (32, 1)] {
        let size = usize::from(bits / 8);
        let frame = PIXELS * size;
        let data = &bytes[..3 * frame];
        let want: Vec<f64> = data
            .chunks(size)
            .map(|b| match (b, signed) {
                (&[a], 0) => f64::from(a),
                (&[a], _) => f64::from(a as i8),
                (&[a, b], 0) => f64::from(u16::from_le_bytes([a, b])),
                (&[a, b], _) => f64::from(i16::from_le_bytes([a, b])),
                (&[a, b, c, d], 0) => f64::from(u32::from_le_bytes([a, b, c, d])),
                (&[a, b, c, d], _) => f64::from(i32::from_le_bytes([a, b, c, d])),
                _ => unreachable!(),
            })
            .collect();
        let base = slice(COLUMNS, ROWS, "1", 1, 0.0, &[])
            .text(0x0028_0008, "IS", 3)
            .word(0x0028_0100, bits)
            .word(0x0028_0101, bits)
            .word(0x0028_0102, bits - 1)
            .word(0x0028_0103, signed);
        for uid in [IMPLICIT, EXPLICIT, BIG, DEFLATED, RLE] {
            let bytes = if uid == RLE {
                let plane =
                    |f: usize, b: usize| data[f * frame..(f + 1) * frame].iter().skip(b).step_by(size).copied().collect::<Vec<u8>>();
                let frames: Vec<Vec<u8>> = (0..3).map(|f| rle(&(0..size).rev().map(|b| plane(f, b)).collect::<Vec<_>>())).collect();
                file(&base.clone().without(0x7fe0_0010), RLE, Some(&encapsulated(&frames, &[])))
            } else {
                // The other byte order turns whole numbers around.
                let mut data = data.to_vec();
                if uid == BIG {
                    data.chunks_mut(size).for_each(<[u8]>::reverse);
                }
                file(&base.clone().with(0x7fe0_0010, Value::Bytes("OB", data)), uid, None)
            };
            let volume = one(&bytes).unwrap_or_else(|e| panic!("{bits} {signed} {uid}: {e}"));
            assert_eq!(volume.grid().dims(), [5, 3, 3], "{bits} {uid}");
            assert_eq!(numbers(&volume), want, "{bits} bits, signed {signed}, {uid}");
            assert_eq!(volume.rescale(), (1.0, -1000.0));
            let kind = volume.voxels().voxel_type();
            assert_eq!((kind.bytes(), kind.limits().0 < 0.0), (size, signed == 1));
        }
    }
}

#[test]
fn only_the_bits_that_are_stored_count() {
    let pixels = [0x0fff, 0x1fff, 0xf801, 0x0800, 0x07ff];
    for (stored, high, signed, want) in [
        (12, 11, 0, [4095.0, 4095.0, 2049.0, 2048.0, 2047.0]),
        (12, 11, 1, [-1.0, -1.0, -2047.0, -2048.0, 2047.0]),
        (12, 15, 0, [255.0, 511.0, 3968.0, 128.0, 127.0]),
        (12, 15, 1, [255.0, 511.0, -128.0, 128.0, 127.0]),
    ] {
        let set = slice(5, 1, "1", 1, 0.0, &pixels).word(0x0028_0101, stored).word(0x0028_0102, high).word(0x0028_0103, signed);
        for uid in [EXPLICIT, BIG] {
            assert_eq!(numbers(&one(&file(&set, uid, None)).unwrap()), want, "{stored} bits up to {high}, signed {signed}");
        }
    }
}

#[test]
fn files_without_a_preamble_are_read() {
    let pixels = noise(PIXELS, 3);
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &pixels);
    let want: Vec<f64> = pixels.iter().map(|&p| p.into()).collect();
    for uid in [EXPLICIT, IMPLICIT] {
        let whole = file(&set, uid, None);
        // With the group that names the syntax, and without.
        assert_eq!(numbers(&one(&whole[132..]).unwrap()), want, "{uid}");
        let length = u32::from_le_bytes(whole[140..144].try_into().unwrap()) as usize;
        assert_eq!(numbers(&one(&whole[144 + length..]).unwrap()), want, "{uid}");
    }
    // A folder of such files alone is one of DICOM files.
    let files: Vec<(String, Vec<u8>)> = series("1", &[1.0, 0.0], |_, set| set).into_iter().map(|(n, b)| (n, b[132..].to_vec())).collect();
    assert_eq!(numbers(&Volume::open(folder(&files).path()).unwrap()), expected([1, 0]));
    // A file that names the wrong one of explicit and implicit VR.
    let mut lies = file(&set, IMPLICIT, None);
    let at = lies.windows(IMPLICIT.len() + 1).position(|w| w == b"1.2.840.10008.1.2\0").unwrap() - 2;
    let honest = file(&set, EXPLICIT, None);
    let body = honest.windows(6).position(|w| w == [8, 0, 0, 0, b'U', b'L']).unwrap();
    lies.truncate(at + 2 + IMPLICIT.len() + 1);
    lies.extend(&honest[body..]);
    assert_eq!(numbers(&one(&lies).unwrap()), want);
}

#[test]
fn the_magic_counts_whatever_stands_before_it() {
    for start in [&b"\x5c\x01\0\0"[..], b"II*\0", b"MM\0*", b"PK\x03\x04", b"NRRD", b"<?xml"] {
        let mut bytes = file(&slice(COLUMNS, ROWS, "1", 1, 0.0, &noise(PIXELS, 0)), EXPLICIT, None);
        bytes[..start.len()].copy_from_slice(start);
        let dir = folder(&[("image".to_owned(), bytes)]);
        assert_eq!(io::detect(dir.path().join("image")).unwrap().name(), "DICOM");
        assert_eq!(numbers(&Volume::open(dir.path().join("image")).unwrap()), expected([0]));
    }
}

#[test]
fn a_series_is_ordered_by_position_wherever_its_files_are() {
    let z = [30.0, 10.0, 20.0, 50.0, 40.0];
    let files = series("1", &z, |_, set| set);
    let nested: Vec<(String, Vec<u8>)> = files.iter().enumerate().map(|(i, (n, b))| (format!("a/{}/{n}", i % 2), b.clone())).collect();
    let want = expected([1, 2, 0, 4, 3]);
    let named: Vec<(&str, Vec<u8>)> = nested.iter().map(|(n, b)| (n.as_str(), b.clone())).collect();
    let mut in_tar = vec![("a/".to_owned(), Vec::new())];
    in_tar.extend(nested.clone());
    let archives = [
        ("scan.zip".to_owned(), zip(&named, false, |_| {})),
        ("deflated.zip".to_owned(), zip(&named, true, |_| {})),
        ("scan.tar".to_owned(), tar(&in_tar)),
        ("scan.tar.gz".to_owned(), gz(&tar(&in_tar))),
    ];
    let (flat, deep, packed) = (folder(&files), folder(&nested), folder(&archives));
    let mut ways = vec![flat.path().to_owned(), flat.path().join("IM*"), deep.path().to_owned()];
    ways.extend(archives.iter().map(|a| packed.path().join(&a.0)));
    for way in ways {
        let volume = Volume::open(&way).unwrap_or_else(|e| panic!("{}: {e}", way.display()));
        assert_eq!(numbers(&volume), want, "{}", way.display());
        let grid = volume.grid();
        assert_eq!((grid.dims(), grid.spacing(), grid.space()), ([5, 3, 5], [0.5, 0.75, 10.0], Space::Lps));
        assert_eq!(grid.origin().to_array(), [-10.0, 20.0, 10.0]);
        assert_eq!((volume.modality(), volume.rescale()), (Modality::Ct, (1.0, -1000.0)));
        assert_eq!(volume.name(), way.display().to_string());
        assert!(volume.notes().is_empty(), "{:?}", volume.notes());
        assert!(io::list(&way, &Reading::new()).unwrap().is_empty());
    }
    // Nothing but voxels comes out of a file.
    let debug = format!("{:?}", Volume::open(flat.path()).unwrap());
    assert!(!debug.contains("Somebody") && !debug.contains("4711"));
    // A zip of arrays is still one.
    let arrays = folder(&[(
        "a.npz".to_owned(),
        npz(&[("a.npy", files::npy(&files::Sample::new(VoxelType::U8, [2, 2, 2]), io::Endian::Little, false, 1))], true),
    )]);
    assert_eq!(io::detect(arrays.path().join("a.npz")).unwrap().name(), "NumPy archive");
}

#[test]
fn one_gzip_file_is_looked_into() {
    let bytes = file(&slice(COLUMNS, ROWS, "1", 1, 0.0, &noise(PIXELS, 0)), EXPLICIT, None);
    let dir = folder(&[
        ("a.dcm.gz".to_owned(), gz(&bytes)),
        ("b.dcm.gz".to_owned(), {
            let mut damaged = gz(&bytes);
            let end = damaged.len();
            damaged[end - 6] ^= 1;
            damaged
        }),
    ]);
    assert_eq!(numbers(&Volume::open(dir.path().join("a.dcm.gz")).unwrap()), expected([0]));
    assert!(refused(&dir.path().join("b.dcm.gz")).contains("damaged"));
}

#[test]
fn a_tilted_gantry_shears_the_grid() {
    let z = [0.0, 2.0, 4.0, 6.0];
    let tilt = |i: usize, set: Set| set.numbers(0x0020_0032, &[-10.0, 20.0 + 0.5 * i as f64, z[i]]);
    let dir = folder(&series("1", &z, tilt));
    let volume = Volume::open(dir.path()).unwrap();
    let map = volume.grid().index_to_world();
    assert_eq!(map.matrix3.to_cols_array(), [0.5, 0.0, 0.0, 0.0, 0.75, 0.0, 0.0, 0.5, 2.0]);
    assert!(told(&volume, "sheared") && told(&volume, "14.036"), "{:?}", volume.notes());
    assert_eq!(numbers(&volume), expected(0..4));
    // Oblique planes, from back to front: ordered along the normal, no axis of the world.
    let (row, column) = ([0.0, 0.8, 0.6], [1.0, 0.0, 0.0]);
    let oblique = |i: usize, set: Set| {
        let along = [0.0, 0.6, -0.8].map(|n| n * 3.0 * i as f64);
        set.numbers(0x0020_0037, &[row, column].concat()).numbers(0x0020_0032, &along)
    };
    let dir = folder(&series("1", &z, oblique));
    let volume = Volume::open(dir.path()).unwrap();
    assert_eq!(numbers(&volume), expected(0..4));
    assert!((volume.grid().spacing()[2] - 3.0).abs() < 1e-12 && volume.notes().is_empty());
    assert!((volume.grid().index_to_world().matrix3.z_axis - glam::DVec3::new(0.0, 1.8, -2.4)).length() < 1e-12);
}

#[test]
fn duplicates_are_named_and_copies_left_out() {
    let mut files = series("1", &[0.0, 1.0, 2.0], |_, set| set);
    files.push(("copy".to_owned(), files[1].1.clone()));
    let dir = folder(&files);
    let volume = Volume::open(dir.path()).unwrap();
    assert!(told(&volume, "copies of others: 1"), "{:?}", volume.notes());
    assert_eq!(numbers(&volume), expected(0..3));
    files[3] = ("other".to_owned(), file(&slice(COLUMNS, ROWS, "1", 77, 1.0, &noise(PIXELS, 9)), EXPLICIT, None));
    let dir = folder(&files);
    let line = refused(dir.path());
    assert!(line.contains("other") && line.contains(&files[1].0) && line.contains("(-10, 20, 1)") && line.contains("1 mm along"), "{line}");
}

#[test]
fn missing_slices_are_interpolated_and_told() {
    let dir = folder(&series("1", &[0.0, 1.0, 2.0, 4.0, 5.0, 8.0], |_, set| set));
    let volume = Volume::open(dir.path()).unwrap();
    assert!(told(&volume, "3 of 9, between 2 and 4 mm, 5 and 8 mm"), "{:?}", volume.notes());
    assert_eq!((volume.grid().dims(), volume.grid().spacing()[2]), ([5, 3, 9], 1.0));
    let slice = |i: usize| noise(PIXELS, i as u64);
    let between = |a: usize, b: usize, t: f64| -> Vec<f64> {
        slice(a).iter().zip(slice(b)).map(|(&a, b)| libm::rint(f64::from(a) + t * (f64::from(b) - f64::from(a)))).collect()
    };
    let want =
        [expected(0..3), between(2, 3, 0.5), expected(3..5), between(4, 5, 1.0 / 3.0), between(4, 5, 2.0 / 3.0), expected([5])].concat();
    assert_eq!(numbers(&volume), want);
    // Uneven ones are resampled to the smallest step.
    let dir = folder(&series("1", &[0.0, 1.0, 2.5, 4.0], |_, set| set));
    let volume = Volume::open(dir.path()).unwrap();
    assert!(told(&volume, "unevenly spaced, 1 to 1.5 mm: 5 slices 1 mm apart"), "{:?}", volume.notes());
    let want = [expected(0..2), between(1, 2, 2.0 / 3.0), between(2, 3, 1.0 / 3.0), expected([3])].concat();
    assert_eq!(numbers(&volume), want);
    // Within one in a hundred they are even.
    let dir = folder(&series("1", &[0.0, 1.0, 2.005, 3.0], |_, set| set));
    assert!(Volume::open(dir.path()).unwrap().notes().is_empty());
}

#[test]
fn series_are_told_apart_and_chosen() {
    let mut files = series("1", &[0.0, 1.0], |_, set| set.text(0x0020_0011, "IS", 1));
    files.extend(series("2", &[0.0, 1.0, 2.0], |_, set| set.text(0x0020_0011, "IS", 2)).into_iter().map(|(n, b)| (format!("two/{n}"), b)));
    // Two directions in one series, a localizer, and what is no image.
    let turned = |i: usize, set: Set| {
        let set = set.text(0x0020_0011, "IS", 3);
        if i > 1 { set.numbers(0x0020_0037, &[0.0, 1.0, 0.0, 0.0, 0.0, -1.0]).numbers(0x0020_0032, &[i as f64, 0.0, 0.0]) } else { set }
    };
    files.extend(series("3", &[0.0, 1.0, 2.0, 3.0], turned).into_iter().map(|(n, b)| (format!("three/{n}"), b)));
    let shown =
        series("4", &[0.0, 1.0, 2.0, 3.0], |_, set| set.text(0x0020_0011, "IS", 4).text(0x0008_0008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER"));
    files.extend(shown.into_iter().map(|(n, b)| (format!("four/{n}"), b)));
    files.push(("report".to_owned(), file(&slice(1, 1, "5", 1, 0.0, &[]).without(0x7fe0_0010), EXPLICIT, None)));
    files.push((
        "segments".to_owned(),
        file(&slice(1, 1, "6", 1, 0.0, &[1]).text(0x0008_0016, "UI", "1.2.840.10008.5.1.4.1.1.66.4"), EXPLICIT, None),
    ));
    files.push(("notes.txt".to_owned(), b"nothing".to_vec()));
    let dir = folder(&files);
    let volume = Volume::open(dir.path()).unwrap();
    assert_eq!(numbers(&volume), expected(0..3));
    for what in ["Series 1 of 5 is read, that of most images", "1 is an object without pixels", "1 is a segmentation", "1 is no DICOM file"]
    {
        assert!(told(&volume, what), "{what}: {:?}", volume.notes());
    }
    let items = io::list(dir.path(), &Reading::new()).unwrap();
    assert_eq!(items.len(), 5);
    assert!(items.iter().enumerate().all(|(i, item)| item.id == i.to_string() && item.part == Part::Series && item.taken == (i == 1)));
    assert_eq!(items[0].about, "CT, \"chest\", 2 images, 5 x 3 pixels of 0.5 x 0.75 mm");
    assert!(items[4].about.ends_with("a localizer"), "{}", items[4].about);
    let chosen = |series: &str| io::read_as(dir.path(), &Reading::new().choice(Choice::new().series(series)));
    assert_eq!(numbers(&chosen("0").unwrap()), expected(0..2));
    assert_eq!(numbers(&chosen("1.2.3.1").unwrap()), expected(0..2));
    assert_eq!(numbers(&chosen("3").unwrap()).len(), 2 * PIXELS);
    assert!(told(&chosen("0").unwrap(), "as chosen"));
    for (series, says) in [
        ("5", "volume.series is 5: there are 5, 0 to 4"),
        ("1.2.3", "any of 0, 1, 2, 3, 4; give one of these numbers"),
        ("1.2.3.3", "any of 2, 3; give"),
        ("9.9", "none of the 5 series has a UID that starts so"),
        ("", "none of the 5"),
    ] {
        let line = chosen(series).unwrap_err().to_string();
        assert!(line.contains(says) && !line.contains('\n'), "{line}");
    }
    let line = io::read_as(dir.path(), &Reading::new().choice(Choice::new().level(0))).unwrap_err().to_string();
    assert!(line.contains("DICOM has no level to choose"), "{line}");
}

#[test]
fn several_images_at_each_position_are_moments() {
    let z: Vec<f64> = (0..6).map(|i| f64::from(i % 2)).collect();
    // The moment runs against the order of files.
    let phase = |i: usize, set: Set| set.numbers(0x0018_1060, &[100.0 - 10.0 * (i / 2) as f64]);
    let dir = folder(&series("1", &z, phase));
    for frame in 0..3 {
        let volume = io::read_as(dir.path(), &Reading::new().choice(Choice::new().frame(frame))).unwrap();
        assert!(told(&volume, "3 images at each position, which differ in trigger time"), "{:?}", volume.notes());
        assert_eq!(numbers(&volume), expected([4 - 2 * frame, 5 - 2 * frame]), "{frame}");
    }
    let items = io::list(dir.path(), &Reading::new()).unwrap();
    assert_eq!(items.iter().map(|i| (i.part, i.count)).collect::<Vec<_>>(), [(Part::Frame, 3)]);
    let line = io::read_as(dir.path(), &Reading::new().choice(Choice::new().frame(3))).unwrap_err().to_string();
    assert!(line.contains("volume.frame is 3: there are 3, 0 to 2"), "{line}");
}

#[test]
fn moments_that_are_not_everywhere_are_left_out() {
    // Moments 0 and 2 at both positions, moment 1 at the first one alone.
    let (z, moment) = ([0.0, 0.0, 0.0, 1.0, 1.0], [2, 1, 0, 0, 2]);
    let dir = folder(&series("1", &z, |i, set| set.text(0x0020_0100, "IS", moment[i])));
    let volume = io::read_as(dir.path(), &Reading::new().choice(Choice::new().frame(1))).unwrap();
    assert_eq!(numbers(&volume), expected([0, 4]));
    assert!(told(&volume, "Images left out: 1, of moments") && told(&volume, "2 images at each position"), "{:?}", volume.notes());
    assert_eq!(numbers(&Volume::open(dir.path()).unwrap()), expected([2, 3]));
}

/// An enhanced image: `order` gives the slice that each frame shows.
fn enhanced(order: &[usize], undefined: bool) -> Set {
    let group = |tag: u32, set: Set| (tag, Value::Items(vec![set], undefined));
    let frames: Vec<Set> = order
        .iter()
        .map(|&i| {
            let position = Set::default().numbers(0x0020_0032, &[1.0, 2.0, 2.5 * i as f64]);
            let values = Set::default().numbers(0x0028_1052, &[-24.0]).numbers(0x0028_1053, &[2.0]).text(0x0028_1054, "LO", "HU");
            Set(vec![
                group(0x0020_9113, position),
                group(0x0028_9145, values),
                group(0x0018_9118, Set::default().with(0x0020_9153, Value::Doubles(vec![7.0]))),
            ])
        })
        .collect();
    let shared = Set(vec![
        group(0x0028_9110, Set::default().numbers(0x0028_0030, &[0.25, 0.125]).numbers(0x0018_0050, &[9.0])),
        group(0x0020_9116, Set::default().numbers(0x0020_0037, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0])),
    ]);
    let pixels: Vec<u16> = order.iter().flat_map(|&i| noise(PIXELS, i as u64)).collect();
    let mut set = slice(COLUMNS, ROWS, "1", 1, 0.0, &pixels).text(0x0028_0008, "IS", order.len());
    for tag in [0x0020_0032, 0x0020_0037, 0x0028_0030, 0x0018_0050, 0x0028_1052, 0x0028_1053] {
        set = set.without(tag);
    }
    set.with(0x5200_9229, Value::Items(vec![shared], undefined)).with(0x5200_9230, Value::Items(frames, undefined))
}

#[test]
fn enhanced_images_with_shuffled_frames() {
    for (undefined, uid) in [(false, EXPLICIT), (true, EXPLICIT), (true, IMPLICIT), (true, BIG), (false, DEFLATED)] {
        let mut set = enhanced(&[2, 0, 3, 1], undefined);
        if uid == IMPLICIT {
            // Numbers of eight bytes are known by their tag there.
            set = set.without(0x0009_1001);
        }
        let volume = one(&file(&set, uid, None)).unwrap();
        assert_eq!(numbers(&volume), expected(0..4), "{uid}");
        assert_eq!((volume.grid().spacing(), volume.grid().origin().to_array()), ([0.125, 0.25, 2.5], [1.0, 2.0, 0.0]));
        assert_eq!((volume.rescale(), volume.modality()), ((2.0, -24.0), Modality::Ct));
    }
    // Two moments in one file, told apart by their index.
    let mut set = enhanced(&[1, 0, 1, 0], true);
    for (tag, value) in &mut set.0 {
        if let (0x5200_9230, Value::Items(frames, _)) = (*tag, value) {
            for (i, frame) in frames.iter_mut().enumerate() {
                let index = Set::default().with(0x0020_9128, Value::Bytes("UL", vec![1 - i as u8 / 2, 0, 0, 0]));
                frame.0.push((0x0020_9111, Value::Items(vec![index], true)));
            }
        }
    }
    let pixels: Vec<u16> = (0..4).flat_map(|i| noise(PIXELS, i)).collect();
    let dir = folder(&[("a".to_owned(), file(&set.with(0x7fe0_0010, Value::Words("OW", pixels)), EXPLICIT, None))]);
    for (frame, order) in [(0, [3, 2]), (1, [1, 0])] {
        let volume = io::read_as(dir.path().join("a"), &Reading::new().choice(Choice::new().frame(frame))).unwrap();
        assert_eq!(numbers(&volume), expected(order));
        assert!(told(&volume, "differ in temporal position"), "{:?}", volume.notes());
    }
    // A frame too few is described.
    let set = enhanced(&[2, 0, 3, 1], true).text(0x0028_0008, "IS", 3);
    assert!(one(&file(&set, EXPLICIT, None)).unwrap_err().to_string().contains("frames described: 4, frames there: 3"));
}

#[test]
fn slices_of_different_slopes_are_computed() {
    let dir = folder(&series("1", &[0.0, 1.0, 2.0], |i, set| set.numbers(0x0028_1053, &[0.5 + i as f64])));
    let volume = Volume::open(dir.path()).unwrap();
    assert!(told(&volume, "kept as f32"));
    let want: Vec<f64> = (0..3)
        .flat_map(|i| noise(PIXELS, i).into_iter().map(move |p| f64::from((f64::from(p) * (0.5 + i as f64) - 1000.0) as f32)))
        .collect();
    assert_eq!((numbers(&volume), volume.rescale()), (want, (1.0, 0.0)));
    let dir = folder(&series("1", &[0.0], |_, set| set.numbers(0x0028_1053, &[0.0])));
    assert!(refused(dir.path()).contains("rescale slope 0"));
}

#[test]
fn compressed_frames_to_the_voxel() {
    let frames: Vec<Vec<u16>> = (0..3).map(|i| noise(PIXELS, i)).collect();
    let base = slice(COLUMNS, ROWS, "1", 1, 0.0, &[]).without(0x7fe0_0010);
    let many = base.clone().text(0x0028_0008, "IS", 3);
    let jpeg: Vec<Vec<u8>> = frames.iter().map(|f| jpeg_lossless(COLUMNS, ROWS, f)).collect();
    let even = |n: usize| n.next_multiple_of(2);
    // Each frame in two fragments, found by the list or by how a stream starts.
    let halves: Vec<Vec<u8>> = jpeg.iter().flat_map(|j| [j[..20].to_vec(), j[20..].to_vec()]).collect();
    let mut starts = vec![0u32];
    jpeg.iter().for_each(|j| starts.push(starts.last().unwrap() + 16 + 20 + even(j.len() - 20) as u32));
    let jls: Vec<Vec<u8>> = frames.iter().map(|f| jpeg_ls(f)).collect();
    for (uid, fragments) in [
        (JPEG_LOSSLESS, encapsulated(&jpeg, &[])),
        (JPEG_LOSSLESS, encapsulated(&halves, &starts[..3])),
        (JPEG_LOSSLESS, encapsulated(&halves, &[])),
        (JPEG_LOSSLESS, encapsulated(&halves, &[0; 3])),
        (JPEG_LS, encapsulated(&jls, &[])),
        (
            "1.2.840.10008.1.2.1.98",
            encapsulated(&frames.iter().map(|f| f.iter().flat_map(|p| p.to_le_bytes()).collect()).collect::<Vec<_>>(), &[]),
        ),
    ] {
        let volume = one(&file(&many, uid, Some(&fragments))).unwrap_or_else(|e| panic!("{uid}: {e}"));
        assert_eq!(numbers(&volume), expected(0..3), "{uid}");
        // A frame too few.
        let line = one(&file(&many.clone().text(0x0028_0008, "IS", 4), uid, Some(&fragments))).unwrap_err().to_string();
        assert!(line.contains("frame") && line.contains("image.dcm"), "{line}");
    }
    let blocks = [vec![3], vec![200], vec![128], vec![255]];
    let eight = base.clone().word(0x0028_0010, 8).word(0x0028_0011, 32).word(0x0028_0100, 8).word(0x0028_0101, 8).word(0x0028_0102, 7);
    let stream = jpeg_blocks(32, 8, &blocks);
    let volume = one(&file(&eight, JPEG_BASELINE, Some(&encapsulated(std::slice::from_ref(&stream), &[])))).unwrap();
    assert!(numbers(&volume).iter().enumerate().all(|(i, &v)| v == f64::from(blocks[i % 32 / 8][0])), "{:?}", numbers(&volume));
    // A stream of another size than the file says is not decoded.
    for (tag, value) in [(0x0028_0010, 9), (0x0028_0011, 31)] {
        let line = one(&file(&eight.clone().word(tag, value), JPEG_BASELINE, Some(&encapsulated(std::slice::from_ref(&stream), &[]))))
            .unwrap_err()
            .to_string();
        assert!(line.contains("holds 32 x 8 pixels of 1 x 8 bits, the header says"), "{line}");
    }
}

#[test]
fn colours_become_colours() {
    let rgb: Vec<u8> = noise(PIXELS * 3, 4).iter().map(|&w| w as u8).collect();
    let base = slice(COLUMNS, ROWS, "1", 1, 0.0, &[]).word(0x0028_0100, 8).word(0x0028_0101, 8).word(0x0028_0102, 7);
    let color = base.clone().word(0x0028_0002, 3).text(0x0028_0004, "CS", "RGB");
    let want: Vec<[u8; 4]> = rgb.chunks(3).map(|p| [p[0], p[1], p[2], 255]).collect();
    let planes: Vec<u8> = (0..3).flat_map(|c| rgb.iter().skip(c).step_by(3).copied().collect::<Vec<u8>>()).collect();
    let coded = rle(&planes.chunks(PIXELS).map(<[u8]>::to_vec).collect::<Vec<_>>());
    for bytes in [
        file(&color.clone().with(0x7fe0_0010, Value::Bytes("OB", rgb.clone())), EXPLICIT, None),
        file(&color.clone().word(0x0028_0006, 1).with(0x7fe0_0010, Value::Bytes("OB", planes.clone())), EXPLICIT, None),
        file(&color.clone().without(0x7fe0_0010), RLE, Some(&encapsulated(&[coded], &[]))),
    ] {
        let volume = one(&bytes).unwrap();
        assert_eq!(volume.colors(), Some(Colors::U8(&want)));
        assert_eq!(volume.modality(), Modality::Unknown);
    }
    // Bytes in words of the other byte order, of which there is an odd number.
    let turned: Vec<u16> = rgb.chunks(2).map(|p| u16::from_be_bytes([p.get(1).copied().unwrap_or(0), p[0]])).collect();
    let volume = one(&file(&color.clone().with(0x7fe0_0010, Value::Words("OW", turned)), BIG, None)).unwrap();
    assert_eq!(volume.colors(), Some(Colors::U8(&want)));
    // Brightness alone is gray; red is what BT.601 says.
    let ybr = color
        .clone()
        .text(0x0028_0004, "CS", "YBR_FULL")
        .with(0x7fe0_0010, Value::Bytes("OB", [[90, 128, 128], [76, 85, 255]].concat().repeat(8)));
    let volume = one(&file(&ybr, EXPLICIT, None)).unwrap();
    let Some(Colors::U8(got)) = volume.colors() else { panic!("no colours of 8 bits") };
    assert_eq!((got[0], got[1]), ([90, 90, 90, 255], [254, 0, 0, 255]));
    // A palette of three colours that starts at pixel 1.
    let table = |values: [u16; 3]| Value::Words("OW", values.to_vec());
    let indices: Vec<u8> = (0..PIXELS as u8).map(|i| i % 5).collect();
    let mut palette = base.text(0x0028_0004, "CS", "PALETTE COLOR").with(0x7fe0_0010, Value::Bytes("OB", indices.clone()));
    for i in 0..3 {
        palette = palette.with(0x0028_1101 + i, Value::Words("US", vec![3, 1, 16]));
        palette = palette.with(0x0028_1201 + i, table([i as u16, 1000 + i as u16, 65535]));
    }
    let volume = one(&file(&palette, EXPLICIT, None)).unwrap();
    let row = |i: usize| [[0, 1, 2, 65535], [1000, 1001, 1002, 65535], [65535; 4]][i];
    let want: Vec<[u16; 4]> = indices.iter().map(|&i| row(usize::from(i.saturating_sub(1)).min(2))).collect();
    assert_eq!(volume.colors(), Some(Colors::U16(&want)));
}

#[test]
fn single_images_and_those_without_a_place() {
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &noise(PIXELS, 0));
    let spacing = |set: &Set| {
        let volume = one(&file(set, EXPLICIT, None)).unwrap();
        assert_eq!(numbers(&volume), expected([0]));
        (volume.grid().spacing(), volume.grid().space(), volume.notes().join(" "))
    };
    let (found, space, notes) = spacing(&set);
    assert_eq!((found, space), ([0.5, 0.75, 1.5], Space::Lps));
    assert!(notes.contains("1.5 mm apart by the slice thickness"), "{notes}");
    assert_eq!(spacing(&set.clone().numbers(0x0018_0088, &[2.5])).0, [0.5, 0.75, 2.5]);
    let bare = set.clone().without(0x0018_0050).without(0x0028_0030).without(0x0020_0032);
    let (found, space, notes) = spacing(&bare);
    assert_eq!((found, space), ([1.0, 1.0, 1.0], Space::Unknown));
    assert!(notes.contains("size of a pixel is not given") && notes.contains("distance of slices is not given"), "{notes}");
    assert_eq!(spacing(&bare.clone().numbers(0x0018_1164, &[0.2, 0.1])).0, [0.1, 0.2, 1.0]);
    // By instance numbers, which count down.
    let dir = folder(&series("1", &[0.0, 1.0, 2.0], |_, set| set.without(0x0020_0032)));
    let volume = Volume::open(dir.path()).unwrap();
    assert_eq!(numbers(&volume), expected([2, 1, 0]));
    assert!(told(&volume, "ordered by Instance Number (0020,0013)"));
    let inverted = one(&file(&set.clone().text(0x0028_0004, "CS", "MONOCHROME1"), EXPLICIT, None)).unwrap();
    assert!(told(&inverted, "MONOCHROME1"), "{:?}", inverted.notes());
    assert_eq!(numbers(&inverted), expected([0]));
    // A table of Hounsfield units it is only where it says so.
    let other = one(&file(&set.clone().text(0x0028_1054, "LO", "mgml"), EXPLICIT, None)).unwrap();
    assert_eq!(other.modality(), Modality::Unknown);
    let dose = set
        .clone()
        .text(0x0028_0008, "IS", 2)
        .with(0x3004_000c, Value::Text("DS", "0\\4".to_owned()))
        .numbers(0x3004_000e, &[0.25])
        .without(0x0028_1053);
    let dose = dose.with(0x7fe0_0010, Value::Words("OW", [noise(PIXELS, 0), noise(PIXELS, 1)].concat()));
    let volume = one(&file(&dose, EXPLICIT, None)).unwrap();
    assert_eq!((numbers(&volume), volume.grid().spacing()[2], volume.rescale().0), (expected(0..2), 4.0, 0.25));
}

#[test]
fn what_is_not_read_is_named() {
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &noise(PIXELS, 0));
    let bare = set.clone().without(0x7fe0_0010);
    let fragments = encapsulated(&[vec![0; 64]], &[]);
    let twelve = {
        let mut stream = jpeg_blocks(32, 8, &[vec![3], vec![200], vec![128], vec![255]]);
        stream[2 + 2 + 67 + 4] = 12;
        stream
    };
    let wide = bare.clone().word(0x0028_0010, 8).word(0x0028_0011, 32);
    let class = element(0x0002_0002, &Value::Text("UI", "1.2.840.10008.1.3.10".to_owned()), true, io::Endian::Little);
    let listing = join(&[&[0; 128], b"DICM", &class, &file(&bare, EXPLICIT, None)[132..]]);
    for (bytes, says) in [
        (
            file(&bare, "1.2.840.10008.1.2.4.110", Some(&fragments)),
            "JPEG XL lossless (1.2.840.10008.1.2.4.110) cannot be read here: convert",
        ),
        (file(&bare, "1.2.3.4", Some(&fragments)), "a transfer syntax that is not known (1.2.3.4) cannot be read here"),
        (file(&bare, JPEG_LOSSLESS, Some(&fragments)), "the frame is no JPEG stream"),
        (file(&wide, JPEG_BASELINE, Some(&encapsulated(&[twelve], &[]))), "JPEG of 12 bits is read only where it is lossless"),
        (file(&bare, RLE, Some(&fragments)), "an RLE frame has 0 segments"),
        (file(&bare, EXPLICIT, None), "a DICOM file that is an object without pixels"),
        (file(&bare, EXPLICIT, Some(&fragments)), "pixels are in fragments, the transfer syntax says that they are not"),
        (file(&set, RLE, None), "the pixels are not in fragments"),
        (
            file(&set.clone().word(0x0028_0010, 4), EXPLICIT, None),
            "one frame of 5 x 4 pixels of 1 x 16 bits: 40 bytes are needed, there are 30",
        ),
        (file(&set.clone().text(0x0028_0008, "IS", 2_000_000_000), EXPLICIT, None), "frames: 2000000000 is over the limit of 65536"),
        (
            file(&set.clone().text(0x0028_0008, "IS", 60_000), EXPLICIT, None),
            "60000 frames of 5 x 3 pixels of 1 x 16 bits: 1800000 bytes are needed, there are 30",
        ),
        (file(&bare.clone().text(0x0028_0008, "IS", 60_000), RLE, Some(&fragments)), "frames claimed: 60000, 88 bytes follow"),
        (file(&set.clone().text(0x0028_0008, "IS", -1), EXPLICIT, None), "Number of Frames (0028,0008) is -1"),
        (file(&set.clone().word(0x0028_0010, 0), EXPLICIT, None), "Rows (0028,0010) is 0"),
        (file(&set.clone().without(0x0028_0011), EXPLICIT, None), "there are pixels and no Columns (0028,0011)"),
        (file(&set.clone().word(0x0028_0101, 17), EXPLICIT, None), "of 16 bits allocated 17 are stored"),
        (
            file(&set.clone().word(0x0028_0100, 24).word(0x0028_0101, 24).word(0x0028_0102, 23), EXPLICIT, None),
            "pixels of 24 bits are not supported",
        ),
        (file(&set.clone().text(0x0028_0004, "CS", "HSV").word(0x0028_0002, 3), EXPLICIT, None), "photometric interpretation \"HSV\""),
        (file(&set.clone().word(0x0028_0002, 3), EXPLICIT, None), "pixels of 3 samples are MONOCHROME2, which have 1"),
        (file(&set.clone().text(0x0020_0032, "DS", "1\\2"), EXPLICIT, None), "Image Position (Patient) (0020,0032) has 2 numbers, 3"),
        (file(&set.clone().text(0x0020_0032, "DS", "1\\2\\x"), EXPLICIT, None), "(0020,0032) is \"x\": not a number"),
        (file(&set.clone().numbers(0x0020_0037, &[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]), EXPLICIT, None), "not of length 1 and at right angles"),
        (
            file(&set.clone().text(0x0008_0016, "UI", "1.2.840.10008.5.1.4.1.1.66.4"), EXPLICIT, None),
            "a DICOM file that is a segmentation: it is not read, give",
        ),
        (listing, "a DICOM file that is a list of files (DICOMDIR): give the folder"),
        (b"nothing of the kind".to_vec(), "no DICOM file: it has neither"),
    ] {
        let line = one(&bytes).err().unwrap_or_else(|| panic!("read: {says}")).to_string();
        assert!(line.contains(says) && line.contains("image.dcm") && !line.contains('\n'), "{line:?} should say {says:?}");
    }
    // Folders and archives of nothing.
    let dir = folder(&[("DICOMDIR".to_owned(), file(&bare, EXPLICIT, None)), ("x.txt".to_owned(), b"x".to_vec())]);
    assert!(refused(dir.path()).contains("no DICOM image among its files: 1 is an object without pixels, 1 is no DICOM file"));
    // A damaged file of another series is told, one of the series that is read is an error, be it its header or its pixels that are cut.
    let mut files = series("1", &[0.0, 1.0, 2.0], |_, set| set);
    let alone = folder(&files);
    let cut = &files[1];
    for length in [300, cut.1.len() - 100, cut.1.len() - 4] {
        std::fs::write(alone.path().join(&cut.0), &cut.1[..length]).unwrap();
        let line = refused(alone.path());
        assert!(line.contains(&cut.0) && line.ends_with(": take the file away to read the others"), "{line}");
    }
    files.extend(series("2", &[0.0], |_, set| set).into_iter().map(|(n, b)| (format!("two/{n}"), b)));
    files.push(("zzz".to_owned(), files[0].1[..300].to_vec()));
    let dir = folder(&files);
    assert!(told(&Volume::open(dir.path()).unwrap(), "A file is left out since it is damaged: "));
    let (path, end) = (dir.path().join(&files[1].0), files[1].1.len());
    std::fs::write(&path, &files[1].1[..end - 4]).unwrap();
    let line = refused(dir.path());
    assert!(line.contains(&files[1].0) && line.contains("30 bytes are needed, there are 26"), "{line}");
}

/// 40 x 32 pixels of 16 bits, 300 x + 1000 (y / 8), in lossless JPEG 2000 as OpenJPEG 2.5.2 writes it.
#[cfg(feature = "jpeg2000")]
const JPEG_2000: &str = "\
    ff4fff5100290000000000280000002000000000000000000000002800000020000000000000000000010d0101ff52000c00000001000504040001ff\
    5c00134070787880787880787880787880787880ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e32ff\
    90000a0000000000d30001ff93cffc001405604f570fc03f00287f8040059302797c97c03f00483f90a00e0968170b3b7735d67473cb267fc1fc8440\
    fd8580273ac9df19f1545b1286f5769e8eba7ccccccccccec1590968e6d2bc5b24c0fd83207ec62040e405db0850db75203d5bbf0c2265dab4784e19\
    7cc9dca1000018477917ab8b4a945a183fe90536828360ac4506b5d8941be924266dcffa414da0a0d7c07e62101f98d0742de07be03eb83bde94eb04\
    0e7a423f00d4dfb84c9c7ca4e35e0000000c2422a30c61211f4fa309097fffd9\
    ";

#[cfg(feature = "jpeg2000")]
#[test]
fn jpeg_2000_to_the_voxel_and_damaged() {
    let stream: Vec<u8> =
        JPEG_2000.as_bytes().chunks(2).map(|h| u8::from_str_radix(std::str::from_utf8(h).unwrap(), 16).unwrap()).collect();
    let set = slice(40, 32, "1", 1, 0.0, &[]).without(0x7fe0_0010).text(0x0028_0008, "IS", 2);
    let bytes = |stream: &[u8]| file(&set, "1.2.840.10008.1.2.4.90", Some(&encapsulated(&[stream.to_vec(), stream.to_vec()], &[])));
    let want: Vec<f64> = (0..2 * 40 * 32).map(|i| f64::from(300 * (i % 40) + 1000 * (i / 40 % 32 / 8))).collect();
    assert_eq!(numbers(&one(&bytes(&stream)).unwrap()), want);
    // The size that a stream claims is held against the header before it is decoded, and there must be something to decode.
    let mut wide = stream.clone();
    wide[8] = 0x7f;
    for (stream, says) in [
        (wide, "the header says 40 x 32 of 1 x 16"),
        (stream[..140].to_vec(), "JPEG 2000 stream"),
        (stream[..60].to_vec(), "JPEG 2000 stream"),
    ] {
        let line = one(&bytes(&stream)).unwrap_err().to_string();
        assert!(line.contains(says) && line.contains("frame 0") && !line.contains('\n'), "{line}");
    }
    let mut random = Random(7);
    let mut read = 0;
    for _ in 0..300 {
        let mut damaged = stream.clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(damaged.len());
            damaged[at] = random.next() as u8;
        }
        let start = Instant::now();
        match one(&bytes(&damaged)) {
            Ok(volume) => {
                read += 1;
                assert_eq!(volume.voxels().len(), want.len());
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
        assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    }
    assert!((1..300).contains(&read), "{read}");
}

#[cfg(not(feature = "jpeg2000"))]
#[test]
fn jpeg_2000_without_its_feature_is_named() {
    let set = slice(40, 32, "1", 1, 0.0, &[]).without(0x7fe0_0010);
    let line = one(&file(&set, "1.2.840.10008.1.2.4.90", Some(&encapsulated(&[vec![0xff, 0x4f]], &[])))).unwrap_err().to_string();
    assert!(line.contains("JPEG 2000 is read only by builds with the feature `jpeg2000`"), "{line}");
}

struct StopAt(u64);

impl Progress for StopAt {
    fn step(&self, _: &str, done: u64, total: u64) -> bool {
        assert!(done <= total, "{done} of {total}");
        done < self.0
    }
}

#[test]
fn limits_hold_and_work_can_be_stopped() {
    let dir = folder(&series("1", &[0.0, 1.0, 2.0], |_, set| set));
    let small = Limits::new().voxel_bytes(3 * 30 - 1);
    let line = io::read(dir.path(), &small).unwrap_err().to_string();
    assert!(line.contains("90 is over the limit of 89"), "{line}");
    let line = io::read(dir.path(), &Limits::new().header_bytes(8)).unwrap_err().to_string();
    assert!(line.contains("bytes before the pixels") && line.contains("over the limit of 512"), "{line}");
    for at in [1, 3, 5] {
        let result = io::read_as(dir.path(), &Reading::new().progress(Arc::new(StopAt(at))));
        assert!(matches!(result, Err(Error::Stopped)), "{at}");
    }
    assert!(io::read_as(dir.path(), &Reading::new().progress(Arc::new(StopAt(7)))).is_ok());
}

/// Paths of files to damage: one of each kind.
fn seeds() -> Vec<Vec<u8>> {
    let pixels = noise(PIXELS, 0);
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &pixels);
    let bare = set.clone().without(0x7fe0_0010);
    let planes: Vec<Vec<u8>> = [1, 0].map(|b| pixels.iter().map(|p| p.to_le_bytes()[b]).collect()).to_vec();
    let jls = jpeg_ls(&pixels);
    let entries: Vec<(String, Vec<u8>)> =
        (0..3).map(|i| (format!("{i}"), file(&slice(COLUMNS, ROWS, "1", i, i as f64, &pixels), EXPLICIT, None))).collect();
    let named: Vec<(&str, Vec<u8>)> = entries.iter().map(|(n, b)| (n.as_str(), b.clone())).collect();
    let eight = bare.clone().word(0x0028_0010, 8).word(0x0028_0011, 32).word(0x0028_0100, 8).word(0x0028_0101, 8).word(0x0028_0102, 7);
    let mut color = eight.clone().word(0x0028_0002, 3).text(0x0028_0004, "CS", "YBR_FULL_422");
    color.0.retain(|(tag, _)| *tag != 0x0009_1001);
    vec![
        file(&set, EXPLICIT, None),
        file(&set, IMPLICIT, None),
        file(&set, BIG, None),
        file(&set, DEFLATED, None),
        file(&enhanced(&[2, 0, 3, 1], true), EXPLICIT, None),
        file(&enhanced(&[2, 0, 3, 1], false), IMPLICIT, None),
        file(&bare, RLE, Some(&encapsulated(&[rle(&planes)], &[]))),
        file(&bare, JPEG_LOSSLESS, Some(&encapsulated(&[jpeg_lossless(COLUMNS, ROWS, &pixels)], &[0]))),
        file(&bare, JPEG_LS, Some(&encapsulated(&[jls], &[]))),
        file(&eight, JPEG_BASELINE, Some(&encapsulated(&[jpeg_blocks(32, 8, &[vec![3], vec![200], vec![128], vec![255]])], &[]))),
        file(
            &color,
            JPEG_BASELINE,
            Some(&encapsulated(&[jpeg_blocks(32, 8, &[vec![3, 4, 5], vec![200; 3], vec![128; 3], vec![255; 3]])], &[])),
        ),
        zip(&named, true, |_| {}),
        tar(&entries),
        gz(&tar(&entries)),
    ]
}

#[test]
fn damaged_files_never_panic_or_dawdle() {
    let dir = TempDir::new().unwrap();
    let path: PathBuf = dir.path().join("damaged.dcm");
    let mut random = Random(42);
    let (mut read, mut refused) = (0, 0);
    let before = peak::peak();
    for seed in seeds() {
        std::fs::write(&path, &seed).unwrap();
        Volume::open(&path).unwrap();
        for round in 0..200 {
            let mut bytes = seed.clone();
            for _ in 0..1 + random.below(4) {
                // The first half of all damage goes behind the preamble, where the header is, the other half anywhere; at the end are pixels.
                let from = if round % 2 == 0 { 128 } else { bytes.len().saturating_sub(200) }.min(bytes.len());
                let at = (from + random.below((bytes.len() - from).max(1))).min(bytes.len().saturating_sub(1));
                match random.below(7) {
                    _ if bytes.is_empty() => {}
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 | 2 => bytes[at] = random.next() as u8,
                    3 => bytes.truncate(at),
                    4 => bytes.insert(at, b"0123456789\\-.\0\xff"[random.below(15)]),
                    5 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
                    _ => {
                        let copy = bytes[at..(at + 8).min(bytes.len())].to_vec();
                        bytes.splice(at..at, copy);
                    }
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            let start = Instant::now();
            match io::read(&path, &Limits::new().voxel_bytes(64 << 20)) {
                Ok(v) => {
                    read += 1;
                    let held = v.colors().map_or(v.voxels().len(), |c| match c {
                        Colors::U8(c) => c.len(),
                        Colors::U16(c) => c.len(),
                        Colors::F32(c) => c.len(),
                    });
                    assert_eq!(held, v.grid().voxel_count());
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
    assert!(read > 300 && refused > 600, "{read} read, {refused} refused");
    // Many of the files claim more; tests beside this one take a few.
    let grown = peak::peak() - before;
    assert!(grown < 256 << 20, "memory grew by {grown} bytes");
}

#[test]
fn slices_without_positions_are_ordered_by_what_there_is() {
    // Names that 2 stands before 10 in, against the order of UIDs.
    let bare = |i: usize, set: Set| set.without(0x0020_0032).without(0x0020_0013).text(0x0008_0018, "UI", format!("1.2.{}", 90 - i));
    let names = |files: Vec<(String, Vec<u8>)>| -> Vec<(String, Vec<u8>)> {
        files.into_iter().enumerate().map(|(i, (_, b))| (format!("slice{}.dcm", 8 + i), b)).collect()
    };
    let z = [0.0; 4];
    let volume = Volume::open(folder(&names(series("1", &z, bare))).path()).unwrap();
    assert_eq!(numbers(&volume), expected(0..4));
    assert!(told(&volume, "ordered by the names of files"), "{:?}", volume.notes());
    // By places along an axis, with one slice missing, whatever the names.
    let located = |i: usize, set: Set| bare(i, set).numbers(0x0020_1041, &[[9.0, 0.0, 3.0, 12.0][i]]);
    let volume = Volume::open(folder(&names(series("1", &z, located))).path()).unwrap();
    assert!(told(&volume, "ordered by Slice Location (0020,1041), 3 mm apart") && told(&volume, "missing: 1 of 5"), "{:?}", volume.notes());
    assert_eq!((volume.grid().dims()[2], volume.grid().spacing()[2], volume.grid().space()), (5, 3.0, Space::Unknown));
    assert_eq!((numbers(&volume)[..2 * PIXELS].to_vec(), numbers(&volume)[3 * PIXELS..].to_vec()), (expected([1, 2]), expected([0, 3])));
    // Positions count where directions are missing.
    let lines = |i: usize, set: Set| set.without(0x0020_0037).numbers(0x0020_0032, &[5.0, 4.0 * [2.0, 0.0, 1.0][i], 7.0]);
    let volume = Volume::open(folder(&series("1", &[0.0; 3], lines)).path()).unwrap();
    assert_eq!(numbers(&volume), expected([1, 2, 0]));
    assert!(told(&volume, "by their positions along (0, 1, 0), 4 mm apart") && !told(&volume, "give no"), "{:?}", volume.notes());
    assert_eq!((volume.grid().spacing(), volume.grid().space()), ([0.5, 0.75, 4.0], Space::Unknown));
}

#[test]
fn sizes_of_pixels_that_are_not_given_or_none() {
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &noise(PIXELS, 0));
    let volume = one(&file(&set.clone().without(0x0028_0030).text(0x0028_0034, "IS", "3\\2"), EXPLICIT, None)).unwrap();
    assert_eq!(volume.grid().spacing(), [1.0, 1.5, 1.5]);
    assert!(told(&volume, "Pixel Aspect Ratio (0028,0034) alone is given, 3 to 2"), "{:?}", volume.notes());
    let volume = one(&file(&set.numbers(0x0028_0030, &[0.0, -1.0]), EXPLICIT, None)).unwrap();
    assert!(told(&volume, "Pixel Spacing (0028,0030) is 0 -1: it is taken for 1 1"), "{:?}", volume.notes());
    assert_eq!(volume.grid().spacing(), [1.0, 1.0, 1.5]);
}

#[test]
fn one_channel_of_colours_is_chosen() {
    let rgb: Vec<u8> = noise(PIXELS * 3, 4).iter().map(|&w| w as u8).collect();
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &[]).word(0x0028_0100, 8).word(0x0028_0101, 8).word(0x0028_0102, 7);
    let color = set.word(0x0028_0002, 3).text(0x0028_0004, "CS", "RGB").with(0x7fe0_0010, Value::Bytes("OB", rgb.clone()));
    let dir = folder(&[("image.dcm".to_owned(), file(&color, EXPLICIT, None))]);
    let path = dir.path().join("image.dcm");
    let about =
        |reading: &Reading| io::list(&path, reading).unwrap().iter().map(|i| (i.part, i.count, i.about.clone())).collect::<Vec<_>>();
    assert_eq!(about(&Reading::new()), [(Part::Channel, 3, "together they are a colour".to_owned())]);
    for channel in 0..3 {
        let reading = Reading::new().choice(Choice::new().channel(channel));
        let volume = io::read_as(&path, &reading).unwrap();
        let want: Vec<f64> = rgb.iter().skip(channel).step_by(3).map(|&v| v.into()).collect();
        assert_eq!((numbers(&volume), volume.rescale(), volume.modality()), (want, (1.0, 0.0), Modality::Unknown));
        assert!(about(&reading)[0].2.starts_with(&format!("channel {channel} is read")));
    }
    let line = io::read_as(&path, &Reading::new().choice(Choice::new().channel(3))).unwrap_err().to_string();
    assert!(line.contains("volume.channel is 3: there are 3, 0 to 2"), "{line}");
    let dir = folder(&series("1", &[0.0, 1.0], |_, set| set));
    let line = io::read_as(dir.path(), &Reading::new().choice(Choice::new().channel(1))).unwrap_err().to_string();
    assert!(line.contains("volume.channel is 1: there is one channel only"), "{line}");
}

#[test]
fn copies_and_repeats_at_the_same_positions() {
    // The same pixels under another UID.
    let mut files = series("1", &[0.0, 1.0, 2.0], |_, set| set);
    files.push(("copy".to_owned(), file(&slice(COLUMNS, ROWS, "1", 7, 1.0, &noise(PIXELS, 1)), EXPLICIT, None)));
    let volume = Volume::open(folder(&files).path()).unwrap();
    assert_eq!(numbers(&volume), expected(0..3));
    assert!(told(&volume, "same position and pixels as others: 1"), "{:?}", volume.notes());
    // A scan made twice, one slice of which is blank both times.
    let (z, instance) = ([0.0, 1.0, 2.0, 0.0, 1.0, 2.0], [1, 2, 3, 4, 5, 6]);
    let twice = |instance: [i64; 6]| {
        series("1", &z, move |i, set| {
            let set = set.text(0x0020_0013, "IS", instance[i]);
            if i % 3 == 0 { set.with(0x7fe0_0010, Value::Words("OW", vec![0; PIXELS])) } else { set }
        })
    };
    let dir = folder(&twice(instance));
    let second = io::read_as(dir.path(), &Reading::new().choice(Choice::new().frame(1))).unwrap();
    assert_eq!(numbers(&second), [vec![0.0; PIXELS], expected([4, 5])].concat());
    assert!(told(&second, "2 images at each position, which differ in instance number"), "{:?}", second.notes());
    // Numbers that do not rise from one time to the next say nothing.
    let line = refused(folder(&twice([1, 3, 5, 2, 4, 6])).path());
    assert!(line.contains("take one of them away") && line.contains("same position"), "{line}");
    // Only what differs is named, with its values.
    let echoes = |i: usize, set: Set| set.numbers(0x0018_0081, &[[5.0, 12.0][i / 3]]).numbers(0x0018_1060, &[40.0]);
    let items = io::list(folder(&series("1", &z, echoes)).path(), &Reading::new()).unwrap();
    assert_eq!(items[0].about, "images at each position: echo times 5 and 12 ms, frame 0 is read");
}

#[test]
fn padding_is_told_where_it_is() {
    let set = slice(5, 1, "1", 1, 0.0, &[1, 2, 63536, 4, 5]).word(0x0028_0120, 63536);
    assert!(told(&one(&file(&set, EXPLICIT, None)).unwrap(), "have the stored value 63536"));
    let signed = set.clone().word(0x0028_0103, 1);
    assert!(told(&one(&file(&signed, EXPLICIT, None)).unwrap(), "have the stored value -2000"));
    assert!(one(&file(&set.word(0x0028_0120, 3), EXPLICIT, None)).unwrap().notes().iter().all(|n| !n.contains("outside")));
}

#[test]
fn slices_out_of_line() {
    let z = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0];
    // To and fro is no tilt.
    let zigzag = |i: usize, set: Set| set.numbers(0x0020_0032, &[3.0 * (i % 2) as f64, 0.0, z[i]]);
    let volume = Volume::open(folder(&series("1", &z, zigzag)).path()).unwrap();
    assert!(told(&volume, "do not lie on a straight line") && !told(&volume, "tilt"), "{:?}", volume.notes());
    assert_eq!(volume.grid().index_to_world().matrix3.z_axis.to_array(), [0.0, 0.0, 2.0]);
    // A stray one is left out; two of them are in the way.
    let volume = Volume::open(folder(&series("1", &[0.0, 2.0, 4.0, 6.0, 500.0], |_, set| set)).path()).unwrap();
    assert!(told(&volume, "lies alone 494 mm from"), "{:?}", volume.notes());
    assert_eq!((numbers(&volume), volume.grid().spacing()[2]), (expected(0..4), 2.0));
    let line = refused(folder(&series("1", &[0.0, 2.0, 4.0, 6.0, 500.0, 502.0], |_, set| set)).path());
    assert!(line.contains("lies 494 mm from the next slice") && line.contains("take away the slices on one side"), "{line}");
    // Positions that are a little beside their places stay where they are.
    let volume = Volume::open(folder(&series("1", &[0.0, 2.02, 4.04, 6.0, 8.02, 10.04], |_, set| set)).path()).unwrap();
    assert!(volume.notes().is_empty() && volume.grid().dims()[2] == 6, "{:?}", volume.notes());
}

#[test]
fn archives_of_nothing_say_what_they_hold() {
    let listed = zip(&[("a.png", b"x".to_vec()), ("b.png", b"y".to_vec())], false, |_| {});
    let dir = folder(&[("a.zip".to_owned(), listed)]);
    assert!(refused(&dir.path().join("a.zip")).contains("holds 2 files, none of a format that is read from archives (DICOM, NumPy, Zarr)"));
}

#[test]
fn voxels_do_not_depend_on_threads() {
    let frames: Vec<Vec<u8>> = (0..40).map(|i| jpeg_lossless(COLUMNS, ROWS, &noise(PIXELS, i))).collect();
    let set = slice(COLUMNS, ROWS, "1", 1, 0.0, &[]).without(0x7fe0_0010).text(0x0028_0008, "IS", 40);
    let dir = folder(&[("a.dcm".to_owned(), file(&set, JPEG_LOSSLESS, Some(&encapsulated(&frames, &[]))))]);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let volume = pool.install(|| Volume::open(dir.path().join("a.dcm"))).unwrap();
        assert!(matches!(volume.voxels(), Voxels::U16(_)));
        assert_eq!(numbers(&volume), expected(0..40));
    }
}
