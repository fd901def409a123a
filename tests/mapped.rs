//! Mapped files give what reading them gives; those that cannot be mapped are read, and those that lie are refused all the same.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;

use files::{Sample, dat, gz, join, meta, meta_header, nifti, nifti_header, npy, nrrd, vtk};
use slicestack::scene::{Filter, Method, Scene, Slicing, TransferFunction};
use slicestack::volume::io::{self, Endian, RawSpec};
use slicestack::volume::{VoxelType, Voxels};
use slicestack::{Limits, Volume, render};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const DIMS: [usize; 3] = [6, 5, 4];
const MAP_ALL: Limits = Limits::new().voxel_bytes(1 << 20).header_bytes(1 << 16).map_bytes(0);
const MAP_NONE: Limits = MAP_ALL.map_bytes(u64::MAX);
const NATIVE: Endian = if cfg!(target_endian = "big") { Endian::Big } else { Endian::Little };
const OTHER: Endian = if cfg!(target_endian = "big") { Endian::Little } else { Endian::Big };

fn save(dir: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Reads a file with and without mapping: both ways must agree with the sample. Returns whether it was mapped.
fn both(sample: &Sample, what: &str, read: impl Fn(&Limits) -> slicestack::Result<Volume>) -> bool {
    let (mapped, plain) = (read(&MAP_ALL).unwrap(), read(&MAP_NONE).unwrap());
    assert!(!plain.voxels().is_mapped(), "{what}");
    assert!(*plain.voxels() == sample.voxels, "{what}: voxels differ");
    assert!(mapped.voxels() == plain.voxels(), "{what}: mapped voxels differ");
    assert_eq!((mapped.statistics(), mapped.grid()), (plain.statistics(), plain.grid()), "{what}");
    mapped.voxels().is_mapped()
}

/// A NRRD file with a comment so long that its voxels start `rest` bytes behind a multiple of 8.
fn padded_nrrd(sample: &Sample, endian: Endian, rest: usize) -> Vec<u8> {
    let plain = nrrd(sample, endian, "raw");
    let bytes = sample.bytes(endian).len();
    let (head, data) = plain.split_at(plain.len() - bytes);
    let head = head.strip_suffix(b"\n").unwrap();
    let fill = (8 + rest - (head.len() + 3) % 8) % 8;
    join(&[head, b"#", &vec![b'-'; fill], b"\n\n", data])
}

#[test]
fn every_type_and_format_is_the_same_mapped_or_read() {
    let dir = TempDir::new().unwrap();
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, DIMS);
        for endian in [NATIVE, OTHER] {
            let lies = kind.bytes() == 1 || endian == NATIVE;
            let file = |name: &str, bytes: &[u8]| {
                let path = save(&dir, name, bytes);
                both(&sample, &format!("{name} {kind} {endian:?}"), |limits| io::read(&path, limits))
            };
            assert_eq!(file("a.nrrd", &padded_nrrd(&sample, endian, 0)), lies, "NRRD {kind} {endian:?}");
            assert_eq!(file("a.nii", &nifti(&sample, endian)), lies, "NIfTI {kind} {endian:?}");
            assert_eq!(file("a.npy", &npy(&sample, endian, false, 1)), lies, "NumPy {kind} {endian:?}");
            assert!(!file("a.npy", &npy(&sample, endian, true, 1)), "NumPy with z fastest is turned");
            assert!(!file("a.nrrd", &nrrd(&sample, endian, "gzip")) && !file("a.nrrd", &nrrd(&sample, endian, "ascii")));
            assert!(!file("a.nii.gz", &gz(&nifti(&sample, endian))));
            // Wherever their voxels happen to lie.
            file("a.mha", &meta(&sample, endian, "raw"));
            assert!(!file("a.mha", &meta(&sample, endian, "zlib")));
            if kind.bytes() == 1 || NATIVE == Endian::Little {
                assert_eq!(file("a.vtk", &vtk(&sample, "BINARY", "3.0")), kind.bytes() == 1, "VTK is big-endian: {kind}");
            }

            if kind == VoxelType::U16 && endian == Endian::Little {
                assert_eq!(file("a.dat", &dat(DIMS.map(|n| n as u16), &sample.bytes(endian))), lies, "VolVis");
            }

            save(&dir, "a.raw", &sample.bytes(endian));
            let msb = if endian == Endian::Big { "big" } else { "little" };
            let name = match kind {
                VoxelType::F32 => "float".to_owned(),
                VoxelType::F64 => "double".to_owned(),
                other => format!("{}int{}", if other.name().starts_with('u') { "u" } else { "" }, other.bytes() * 8),
            };
            let fields = format!("type: {name}\ndimension: 3\nsizes: 6 5 4\nencoding: raw\nendian: {msb}\ndata file: a.raw\n");
            assert_eq!(file("a.nhdr", format!("NRRD0004\n{fields}").as_bytes()), lies, "detached NRRD {kind} {endian:?}");
            assert_eq!(file("a.mhd", meta_header(&sample, endian, "", "a.raw").as_bytes()), lies, "MetaImage {kind} {endian:?}");
            save(&dir, "p.img", &sample.bytes(endian));
            assert_eq!(file("p.hdr", &nifti_header(&sample, endian, b"ni1\0")), lies, "NIfTI pair {kind} {endian:?}");
            for offset in [0u64, 8, 3] {
                let spec = RawSpec::new(DIMS, kind).with_endian(endian).with_offset(offset);
                let path = save(&dir, "b.raw", &join(&[&vec![7; offset as usize], &sample.bytes(endian)]));
                let mapped = both(&sample, &format!("raw {kind} {endian:?} from {offset}"), |limits| io::read_raw(&path, &spec, limits));
                assert_eq!(mapped, lies && (kind.bytes() == 1 || offset != 3), "raw {kind} {endian:?} from {offset}");
            }
        }
    }
}

#[test]
fn misaligned_voxels_are_read() {
    let dir = TempDir::new().unwrap();
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, DIMS);
        for rest in 0..8 {
            let path = save(&dir, "a.nrrd", &padded_nrrd(&sample, NATIVE, rest));
            let mapped = both(&sample, &format!("{kind}, {rest} bytes off"), |limits| io::read(&path, limits));
            assert_eq!(mapped, rest % kind.bytes() == 0, "{kind}, {rest} bytes off");
        }
    }
}

#[test]
fn small_files_are_read_and_large_ones_mapped() {
    let dir = TempDir::new().unwrap();
    let sample = Sample::new(VoxelType::U16, DIMS);
    let path = save(&dir, "a.raw", &sample.bytes(NATIVE));
    let spec = RawSpec::new(DIMS, VoxelType::U16).with_endian(NATIVE);
    for (map_bytes, mapped) in [(239, true), (240, true), (241, false)] {
        let volume = io::read_raw(&path, &spec, &MAP_ALL.map_bytes(map_bytes)).unwrap();
        assert_eq!(volume.voxels().is_mapped(), mapped, "240 bytes of voxels, mapped from {map_bytes}");
    }
}

#[test]
fn lying_files_are_refused_in_one_line() {
    let dir = TempDir::new().unwrap();
    let sample = Sample::new(VoxelType::F32, DIMS);
    let refused = |path: &Path, limits: &Limits, words: &str| {
        let line = io::read(path, limits).unwrap_err().to_string();
        assert!(line.contains(words) && !line.contains('\n') && line.contains("a."), "{line}");
    };
    let whole = padded_nrrd(&sample, NATIVE, 0);
    let short = save(&dir, "a.nrrd", &whole[..whole.len() - 1]);
    refused(&short, &MAP_ALL, "6 x 5 x 4 voxels of f32 take 480 bytes, the file holds 479 after its header");
    let path = save(&dir, "a.nrrd", &whole);
    refused(&path, &MAP_ALL.voxel_bytes(479), "480 is over the limit of 479");
    // NIfTI ignores what follows the voxels, raw files may hold nothing more.
    let path = save(&dir, "a.raw", &join(&[&sample.bytes(NATIVE), &[0]]));
    let spec = RawSpec::new(DIMS, VoxelType::F32).with_endian(NATIVE);
    let line = io::read_raw(&path, &spec, &MAP_ALL).unwrap_err().to_string();
    assert!(line.contains("should take 480 bytes, there are 481"), "{line}");
}

#[test]
fn pictures_are_the_same_and_writing_spares_the_file() {
    let dir = TempDir::new().unwrap();
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, [17, 9, 12]);
        let path = save(&dir, "a.nii", &nifti(&sample, NATIVE));
        let picture = |limits: &Limits| {
            let volume = io::read(&path, limits).unwrap();
            assert_eq!(volume.voxels().is_mapped(), limits.map_bytes == 0);
            let s = volume.statistics();
            let transfer =
                TransferFunction::new(vec![(s.min, [1.0, 0.3, 0.1]), (s.max, [0.2, 0.8, 1.0])], vec![(s.min, 0.0), (s.max, 0.4)]);
            let scene = Scene::new(transfer.unwrap()).with_size(50, 40).unwrap().with_slices(Slicing::Count(60)).unwrap();
            let spline = scene.clone().with_method(Method::default().with_filter(Filter::CUBIC)).unwrap();
            [render(&volume, &scene).unwrap(), render(&volume, &spline).unwrap()]
        };
        let (mapped, plain) = (picture(&MAP_ALL), picture(&MAP_NONE));
        assert!(plain.iter().all(|p| p.pixel(25, 20)[3] > 0.1) && mapped == plain, "{kind}");

        let before = std::fs::read(&path).unwrap();
        let mut voxels: Voxels = io::read(&path, &MAP_ALL).unwrap().voxels().clone();
        let shared = voxels.clone();
        assert!(voxels.is_mapped() && shared.is_mapped());
        voxels.as_bytes_mut().fill(1);
        assert!(!voxels.is_mapped() && shared == sample.voxels && voxels != shared, "{kind}: a copy is written to");
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }
}
