//! MRC and CCP4 maps: every mode in both byte orders, where the grid is, stacks, and damage.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod files;

use files::{Random, Sample, gz, put_f32, put_i32};
use glam::DVec3;
use slicestack::Limits;
use slicestack::volume::io::{self, Choice, Endian, Format, Part, Reading};
use slicestack::volume::{Volume, VoxelType, Voxels};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const ORDERS: [Endian; 2] = [Endian::Little, Endian::Big];
const UNIT: &str = "distances are in angstrom";

/// A header for voxels of `mode`, cells of 1 x 2 x 3 angstrom, the axes in their usual order.
fn header(dims: [usize; 3], mode: i32, endian: Endian) -> Vec<u8> {
    let mut head = vec![0; 1024];
    for axis in 0..3 {
        let n = dims[axis] as i32;
        put_i32(&mut head, 4 * axis, n, endian);
        put_i32(&mut head, 28 + 4 * axis, n, endian);
        put_f32(&mut head, 40 + 4 * axis, (n * (axis as i32 + 1)) as f32, endian);
        put_f32(&mut head, 52 + 4 * axis, 90.0, endian);
        put_i32(&mut head, 64 + 4 * axis, axis as i32 + 1, endian);
    }
    put_i32(&mut head, 12, mode, endian);
    put_i32(&mut head, 88, 1, endian);
    head[208..212].copy_from_slice(b"MAP ");
    head[212..216].copy_from_slice(if endian == Endian::Big { &[0x11, 0x11, 0, 0] } else { &[0x44, 0x44, 0, 0] });
    head
}

/// A small file that `change` may falsify.
fn small(change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut head = header([3, 4, 5], 1, Endian::Little);
    change(&mut head);
    [head, Sample::new(VoxelType::I16, [3, 4, 5]).bytes(Endian::Little)].concat()
}

fn open_as(name: &str, bytes: &[u8], reading: &Reading) -> Result<Volume, String> {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    io::read_as(&path, reading).map_err(|e| {
        let line = e.to_string();
        assert!(line.contains(name) && !line.contains('\n') && line.len() < 400, "{line:?}");
        line
    })
}

fn read(bytes: &[u8]) -> Volume {
    open_as("volume", bytes, &Reading::new()).unwrap()
}

fn told(bytes: &[u8]) -> String {
    open_as("volume", bytes, &Reading::new()).unwrap_err()
}

fn le(head: &mut [u8], at: usize, value: i32) {
    put_i32(head, at, value, Endian::Little);
}

fn lef(head: &mut [u8], at: usize, value: f32) {
    put_f32(head, at, value, Endian::Little);
}

#[test]
fn every_mode_comes_back_in_both_byte_orders() {
    for endian in ORDERS {
        for (kind, mode) in [(VoxelType::I8, 0), (VoxelType::I16, 1), (VoxelType::F32, 2), (VoxelType::U16, 6)] {
            let sample = Sample::new(kind, [5, 4, 6]);
            let file = [header(sample.dims, mode, endian), sample.bytes(endian)].concat();
            for bytes in [gz(&file), [&file[..], b"more"].concat(), file] {
                let volume = read(&bytes);
                assert_eq!(*volume.voxels(), sample.voxels, "mode {mode} {endian:?}");
                assert_eq!((volume.grid().dims(), volume.grid().spacing()), (sample.dims, [1.0, 2.0, 3.0]));
                assert_eq!(volume.notes(), [UNIT]);
            }
        }
        let numbers = |n: &f32| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() };
        let complex = [3f32, 4.0, -5.0, 12.0, 0.0, -2.5, 8.0, -15.0];
        let file = [header([2, 2, 1], 4, endian), complex.iter().flat_map(numbers).collect()].concat();
        let volume = read(&file);
        assert_eq!(*volume.voxels(), Voxels::F32(vec![5.0, 13.0, 2.5, 17.0].into()));
        assert_eq!(volume.notes(), [UNIT, "of the complex numbers the magnitude is taken"]);
        // 1, -2, 65504, 2^-24
        let half = [0x3c00u16, 0xc000, 0x7bff, 1].map(|n| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() });
        let volume = read(&[header([4, 1, 1], 12, endian), half.concat()].concat());
        assert_eq!(*volume.voxels(), Voxels::F32(vec![1.0, -2.0, 65504.0, f32::from_bits(0x3380_0000)].into()));
    }
}

#[test]
fn bytes_have_no_sign_where_the_header_says_so() {
    let bytes = [0u8, 100, 127, 128, 200, 255];
    let file = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut head = header([3, 2, 1], 0, Endian::Little);
        change(&mut head);
        read(&[&head[..], &bytes].concat())
    };
    let signed = Voxels::I8(bytes.iter().map(|&b| b as i8).collect());
    let unsigned = Voxels::U8(bytes.to_vec().into());
    assert_eq!(*file(&|_| ()).voxels(), signed);
    let imod = |flags: i32| {
        move |h: &mut Vec<u8>| {
            h[152..156].copy_from_slice(b"IMOD");
            le(h, 156, flags);
        }
    };
    assert_eq!(*file(&imod(1)).voxels(), signed);
    let volume = file(&imod(4));
    assert_eq!(*volume.voxels(), unsigned);
    assert_eq!(volume.notes()[1], "the bytes are read without a sign, since a flag of IMOD says so");
    let volume = file(&|h| lef(h, 80, 255.0));
    assert_eq!(*volume.voxels(), unsigned);
    assert_eq!(volume.notes()[1], "the bytes are read without a sign, since the header's largest value is 255");
    assert_eq!(*file(&|h| (lef(h, 76, -128.0), lef(h, 80, 200.0)).0).voxels(), signed);
}

#[test]
fn axes_cell_and_start_place_the_grid() {
    // Columns along z, rows along x, sections along y.
    let volume = read(&small(|h| {
        for (at, n) in [(64, 3), (68, 1), (72, 2), (16, 10), (20, -20), (24, 30)] {
            le(h, at, n);
        }
    }));
    let at = volume.grid().index_to_world();
    // Of the sampling along x, y and z: 3, 4 and 5 steps in 3, 8 and 15 angstrom.
    assert_eq!(at.matrix3.x_axis, DVec3::new(0.0, 0.0, 3.0));
    assert_eq!(at.matrix3.y_axis, DVec3::new(1.0, 0.0, 0.0));
    assert_eq!(at.matrix3.z_axis, DVec3::new(0.0, 2.0, 0.0));
    assert_eq!(at.translation, DVec3::new(-20.0, 60.0, 30.0));
    // An origin goes before the start.
    let volume = read(&small(|h| (le(h, 16, 10), lef(h, 196, 0.5), lef(h, 204, -7.0)).0));
    assert_eq!(volume.grid().index_to_world().translation, DVec3::new(0.5, 0.0, -7.0));
    // IMOD had it the other way round.
    let imod = |flags: i32, version: i32| {
        let volume = read(&small(|h| {
            h[152..156].copy_from_slice(b"IMOD");
            le(h, 156, flags);
            le(h, 108, version);
            lef(h, 196, 0.5);
        }));
        (volume.grid().index_to_world().translation.x, volume.notes().len())
    };
    assert_eq!((imod(1, 0), imod(5, 0), imod(1, 20140)), ((-0.5, 2), (0.5, 1), (0.5, 1)));
    // A cell of 80, 100 and 120 degrees: lengths and angles come back.
    let volume = read(&small(|h| (lef(h, 52, 80.0), lef(h, 56, 100.0), lef(h, 60, 120.0)).0));
    let steps = volume.grid().index_to_world().matrix3;
    let (a, b, c) = (steps.x_axis, steps.y_axis, steps.z_axis);
    let angle = |u: DVec3, v: DVec3| u.angle_between(v).to_degrees();
    assert!((angle(b, c) - 80.0).abs() < 1e-6 && (angle(a, c) - 100.0).abs() < 1e-6 && (angle(a, b) - 120.0).abs() < 1e-6);
    assert!((a.length() - 1.0).abs() < 1e-12 && (b.length() - 2.0).abs() < 1e-12 && (c.length() - 3.0).abs() < 1e-12);
    assert!(a.y == 0.0 && a.z == 0.0 && b.z == 0.0 && c.z > 0.0);
    // Nothing said.
    let volume = read(&small(|h| h[28..76].fill(0)));
    assert_eq!(volume.grid().spacing(), [1.0; 3]);
    assert_eq!(volume.notes().len(), 5, "{:?}", volume.notes());
    assert_eq!(volume.notes()[1], "the header does not say along which axes the voxels lie: x, y and z are taken");
    assert_eq!(volume.notes()[4], "the header gives no spacing along z (0 / 0): 1 is taken");
}

#[test]
fn extended_headers_are_passed_over_and_voxels_mapped() {
    let sample = Sample::new(VoxelType::F32, [5, 4, 6]);
    let mut head = header(sample.dims, 2, Endian::Little);
    le(&mut head, 92, 160);
    let file = [&head[..], &[7; 160], &sample.bytes(Endian::Little)].concat();
    assert_eq!(*read(&file).voxels(), sample.voxels);
    let reading = Reading::new().limits(Limits::new().map_bytes(100));
    let volume = open_as("volume.mrc", &file, &reading).unwrap();
    assert!(volume.voxels().is_mapped() && *volume.voxels() == sample.voxels);
    assert_eq!(*read(&gz(&file)).voxels(), sample.voxels);
}

#[test]
fn old_files_are_known_by_name_and_length() {
    let sample = Sample::new(VoxelType::I16, [5, 4, 6]);
    let dir = TempDir::new().unwrap();
    for endian in ORDERS {
        let mut head = header(sample.dims, 1, endian);
        head[208..216].fill(0);
        let file = [head, sample.bytes(endian)].concat();
        for (name, bytes) in [("a.mrc", file.clone()), ("b.rec.gz", gz(&file)), ("c.st", file.clone())] {
            let path = dir.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(io::detect(&path).unwrap(), Format::Mrc);
            let volume = Volume::open(&path).unwrap();
            assert_eq!((volume.voxels(), volume.notes()), (&sample.voxels, &[UNIT.to_owned()][..]));
        }
        assert!(told(&file).contains("no volume format is known"));
        // A stamp that is wrong.
        let mut lies = file.clone();
        lies[208..214].copy_from_slice(if endian == Endian::Big { b"MAP \x44\x41" } else { b"MAP \x11\x11" });
        let volume = read(&lies);
        assert_eq!(*volume.voxels(), sample.voxels);
        assert!(volume.notes()[1].contains("does not fit the header"), "{:?}", volume.notes());
    }
    let line = open_as("noise.map", &[9; 2000], &Reading::new()).unwrap_err();
    assert!(line.contains("no MRC file: there is no MAP at byte 208") && line.contains("a raw file needs"), "{line}");
    assert!(open_as("short.mrc", &[9; 20], &Reading::new()).unwrap_err().contains("1024 bytes, the file ends after 20"));
}

#[test]
fn one_volume_of_a_stack_is_read() {
    let sample = Sample::new(VoxelType::U16, [5, 4, 6]);
    let mut head = header(sample.dims, 6, Endian::Little);
    le(&mut head, 88, 401);
    le(&mut head, 36, 2);
    let bytes = sample.bytes(Endian::Little);
    let file = [&head[..], &bytes].concat();
    let frame = |n| open_as("stack.mrc", &file, &Reading::new().choice(Choice::new().frame(n)));
    let Voxels::U16(all) = &sample.voxels else { panic!("u16 was asked for") };
    for (n, part) in all.chunks(40).enumerate() {
        let volume = frame(n).unwrap();
        assert_eq!(*volume.voxels(), Voxels::U16(part.to_vec().into()));
        assert_eq!((volume.grid().dims(), volume.grid().spacing()[2]), ([5, 4, 2], 9.0));
        assert_eq!(volume.notes(), [UNIT]);
        let packed = open_as("stack.mrc.gz", &gz(&file), &Reading::new().choice(Choice::new().frame(n))).unwrap();
        assert_eq!(packed.voxels(), volume.voxels());
    }
    assert!(frame(3).unwrap_err().contains("volume.frame is 3: there are 3, 0 to 2"));
    assert_eq!(read(&file).notes()[1], "of the 3 volumes the first one is read; volume.frame chooses another");
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("stack.mrc");
    std::fs::write(&path, &file).unwrap();
    let items = io::list(&path, &Reading::new().choice(Choice::new().frame(1))).unwrap();
    assert_eq!((items.len(), items[0].part, items[0].count), (1, Part::Frame, 3));
    assert_eq!(items[0].about, "volumes of 5 x 4 x 2 voxels, number 1 is taken");
    // One volume, and images.
    std::fs::write(&path, small(|_| ())).unwrap();
    assert!(io::list(&path, &Reading::new()).unwrap().is_empty());
    assert!(read(&small(|h| le(h, 88, 0))).notes()[1].contains("a stack of images"));
    let line = open_as("a.mrc", &small(|_| ()), &Reading::new().choice(Choice::new().frame(1))).unwrap_err();
    assert!(line.contains("there is one frame only"), "{line}");
}

#[test]
fn what_is_wrong_is_told_in_one_line() {
    for (change, says) in [
        (&(|h: &mut Vec<u8>| le(h, 12, 3)) as &dyn Fn(&mut Vec<u8>), "mode is 3 (complex numbers of 16-bit integers): not supported"),
        (
            &|h| {
                le(h, 12, 0);
                h[152..156].copy_from_slice(b"IMOD");
                le(h, 156, 17);
            },
            "mode is 0 with a flag of IMOD for two numbers of 4 bits a byte: not supported",
        ),
        (&|h| le(h, 12, 101), "mode is 101 (numbers of 4 bits): not supported"),
        (&|h| le(h, 12, 16), "mode is 16 (RGB colours): not supported"),
        (&|h| le(h, 12, 77), "mode is 77 (no mode of MRC2014): not supported"),
        (&|h| le(h, 4, 0), "NY is 0: it must be at least 1"),
        (&|h| le(h, 8, -5), "NZ is -5"),
        (&|h| le(h, 8, 6), "144 bytes, the file holds 120"),
        (&|h| le(h, 92, -4), "NSYMBT is -4"),
        (&|h| le(h, 92, 200), "200 bytes are to be skipped, only 120 follow"),
        (&|h| le(h, 64, 2), "MAPC, MAPR and MAPS are 2, 2 and 3"),
        (&|h| le(h, 72, 4), "are 1, 2 and 4"),
        (&|h| (le(h, 88, 401), le(h, 36, 2)).0, "NZ of 5 sections is no multiple of MZ, 2"),
        (&|h| (le(h, 88, 401), le(h, 36, 0)).0, "no multiple of MZ, 0"),
        (&|h| lef(h, 52, 200.0), "the cell's angles are 200, 90 and 90"),
        (&|h| (lef(h, 52, 10.0), lef(h, 56, 10.0)).0, "the cell's angles are 10, 10 and 90"),
        (&|h| lef(h, 60, 180.0), "90, 90 and 180"),
        (&|h| lef(h, 56, f32::NAN), "the cell's angles has NaN"),
        (&|h| lef(h, 40, f32::INFINITY), "the cell has inf"),
        (&|h| lef(h, 200, f32::NAN), "ORIGIN has NaN"),
        (&|h| (le(h, 0, i32::MAX), le(h, 4, i32::MAX)).0, "2147483647 x 2147483647 x 5 voxels: the count overflows"),
        (&|h| (le(h, 0, 1 << 20), le(h, 4, 1 << 20)).0, "over the limit of 17179869184"),
    ] {
        let line = told(&small(change));
        assert!(line.contains(says), "{line}, should say {says}");
    }
    let limits = Reading::new().limits(Limits::new().voxel_bytes(119));
    assert!(open_as("a.mrc", &small(|_| ()), &limits).unwrap_err().contains("120 is over the limit of 119"));
    let cut = &small(|_| ())[..1100];
    assert!(told(cut).contains("120 bytes, the file holds 76"));
    assert!(told(&gz(cut)).contains("cut short") || told(&gz(cut)).contains("only 76"), "{}", told(&gz(cut)));
}

#[test]
fn damaged_files_never_panic_or_dawdle() {
    let seeds = [
        small(|_| ()),
        gz(&small(|_| ())),
        small(|h| (le(h, 88, 401), le(h, 36, 1)).0),
        small(|h| (le(h, 12, 0), le(h, 92, 60)).0),
        small(|h| (le(h, 12, 12), lef(h, 60, 120.0)).0),
    ];
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("damaged.mrc");
    let mut random = Random(7);
    let (mut read, mut refused) = (0, 0);
    for seed in &seeds {
        for _ in 0..400 {
            let mut bytes = seed.clone();
            for _ in 0..1 + random.below(4) {
                let reach = if random.below(2) == 0 { bytes.len().min(216) } else { bytes.len() };
                let at = random.below(reach.max(1));
                match random.below(8) {
                    _ if bytes.is_empty() => {}
                    0 | 1 => bytes[at] ^= 1 << random.below(8),
                    2 | 3 => bytes[at] = random.next() as u8,
                    4 => bytes.truncate(at.max(bytes.len() / 2)),
                    5 => bytes.insert(at, random.next() as u8),
                    6 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
                    _ => {
                        let from = at / 4 * 4;
                        let end = (from + 4).min(bytes.len());
                        bytes[from..end].fill(if random.below(2) == 0 { 0xff } else { 0 });
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
                    assert!(!message.contains('\n') && message.contains("damaged.mrc"), "{message:?}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {:?}", start.elapsed(), bytes.escape_ascii().to_string());
        }
    }
    assert!(read > 100 && refused > 500, "{read} read, {refused} refused");
}
