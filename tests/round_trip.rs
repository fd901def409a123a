//! What the formats' writers put down comes back exactly, for every voxel type, byte order and encoding.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;

use files::{Sample, dat, gz, join, meta, meta_header, nifti, nifti_header, npy, npy_raw, npz, nrrd, put_f32, put_i16, vtk, zlib};
use glam::DVec3;
use slicestack::volume::io::{self, Endian, Format, RawSpec};
use slicestack::volume::{Modality, Space, VoxelType, Voxels};
use slicestack::{Limits, Volume};
use std::path::Path;
use tempfile::TempDir;

const DIMS: [usize; 3] = [5, 3, 4];

fn save(dir: &TempDir, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn open(name: &str, bytes: &[u8]) -> Volume {
    let dir = TempDir::new().unwrap();
    Volume::open(save(&dir, name, bytes)).unwrap()
}

fn same(volume: &Volume, sample: &Sample, what: &str) {
    assert_eq!(volume.grid().dims(), sample.dims, "{what}");
    assert_eq!(volume.voxels().voxel_type(), sample.kind(), "{what}");
    assert!(*volume.voxels() == sample.voxels, "{what}: voxels differ");
}

#[test]
fn every_type_order_and_encoding() {
    let dir = TempDir::new().unwrap();
    for kind in VoxelType::ALL {
        let sample = Sample::new(kind, DIMS);
        for endian in [Endian::Little, Endian::Big] {
            let mut files: Vec<(Format, String, Vec<u8>)> = Vec::new();
            for encoding in ["raw", "gzip", "ascii"] {
                files.push((Format::Nrrd, format!("nrrd {encoding}"), nrrd(&sample, endian, encoding)));
            }
            for encoding in ["raw", "zlib", "ascii"] {
                files.push((Format::MetaImage, format!("meta {encoding}"), meta(&sample, endian, encoding)));
            }
            for (encoding, version) in [("BINARY", "1.0"), ("ASCII", "3.0"), ("BINARY", "5.1")] {
                files.push((Format::Vtk, format!("vtk {encoding}"), vtk(&sample, encoding, version)));
            }
            files.push((Format::Nifti, "nifti".into(), nifti(&sample, endian)));
            for version in [1, 2, 3] {
                for fortran in [false, true] {
                    let array = npy(&sample, endian, fortran, version);
                    for deflated in [false, true] {
                        let archive = npz(&[("a.npy", array.clone())], deflated);
                        files.push((Format::Npz, format!("npz {deflated}"), archive));
                    }
                    files.push((Format::Npy, format!("npy v{version} fortran {fortran}"), array));
                }
            }
            for (format, what, bytes) in files {
                let what = format!("{what} {kind} {endian:?}");
                // The name tells nothing: the content must.
                let path = save(&dir, "volume", &bytes);
                assert_eq!(io::detect(&path).unwrap(), format, "{what}");
                let volume = Volume::open(&path).unwrap();
                same(&volume, &sample, &what);
                let spacing = if matches!(format, Format::Npy | Format::Npz) { [1.0; 3] } else { [1.0, 2.0, 3.0] };
                assert_eq!(volume.grid().spacing(), spacing, "{what}");
                // Inside gzip, under the same name. A zip file is read from its end and cannot be.
                if format != Format::Npz {
                    let path = save(&dir, "volume", &gz(&bytes));
                    assert_eq!(io::detect(&path).unwrap(), format, "{what}");
                    same(&Volume::open(&path).unwrap(), &sample, &format!("gzip of {what}"));
                }
            }
            let spec =
                RawSpec::new(DIMS, kind).with_endian(endian).with_offset(7).with_spacing([1.0, 1.0, -2.0]).with_origin([4.0, 5.0, 6.0]);
            let bytes = join(&[b"headers", &sample.bytes(endian)]);
            for bytes in [bytes.clone(), gz(&bytes)] {
                let volume = io::read_raw(save(&dir, "volume", &bytes), &spec, &Limits::default()).unwrap();
                same(&volume, &sample, "raw");
                assert_eq!(volume.grid().index_to_world().transform_point3(DVec3::ONE), DVec3::new(5.0, 6.0, 4.0));
            }
        }
    }
}

#[test]
fn voxels_beside_their_header() {
    let dir = TempDir::new().unwrap();
    let sample = Sample::new(VoxelType::I16, DIMS);
    let (little, big) = (sample.bytes(Endian::Little), sample.bytes(Endian::Big));
    let check = |path: &Path| same(&Volume::open(path).unwrap(), &sample, &path.display().to_string());
    let nhdr = |data: &str, rest: &str| {
        let fields = "type: short\ndimension: 3\nsizes: 5 3 4\nendian: little\n";
        save(&dir, "a.nhdr", format!("NRRD0004\n{fields}{rest}data file: {data}\n").as_bytes())
    };
    save(&dir, "voxels.raw", &join(&[b"one\ntwo\nxyz", &little]));
    check(&nhdr("voxels.raw", "encoding: raw\nline skip: 2\nbyte skip: 3\n"));
    check(&nhdr("./voxels.raw", "encoding: raw\nbyte skip: -1\n"));
    save(&dir, "voxels.raw.gz", &join(&[b"one line\n", &gz(&join(&[b"skip", &little]))]));
    check(&nhdr("voxels.raw.gz", "encoding: gzip\nline skip: 1\nbyte skip: 4\n"));

    save(&dir, "voxels.zraw", &zlib(&big));
    check(&save(&dir, "a.mhd", meta_header(&sample, Endian::Big, "CompressedData = True\n", "voxels.zraw").as_bytes()));
    check(&save(&dir, "a.mhd", meta_header(&sample, Endian::Little, "HeaderSize = -1\n", "voxels.raw").as_bytes()));
    check(&save(&dir, "a.mhd", meta_header(&sample, Endian::Little, "HeaderSize = 11\n", "voxels.raw").as_bytes()));

    let header = save(&dir, "pair.hdr", &nifti_header(&sample, Endian::Big, b"ni1\0"));
    let image = save(&dir, "pair.img", &big);
    check(&header);
    check(&image);
    std::fs::remove_file(&image).unwrap();
    save(&dir, "pair.img.gz", &gz(&big));
    check(&header);
}

#[test]
fn nrrd_axes_and_spaces() {
    let nrrd = |fields: &str| open("a", format!("NRRD0005\ntype: uchar\nencoding: ascii\n{fields}\n\n1 2 3 4 5 6 7 8").as_bytes());
    let last = |v: &Volume| v.grid().index_to_world().transform_point3(DVec3::ONE);
    let v = nrrd("dimension: 4\nsizes: 1 2 2 2\nspace: RAS\nspace directions: none (0,2,0) (3,0,0) (0,0,-4)\nspace origin: (10,20,30)");
    assert_eq!((v.grid().dims(), v.grid().space()), ([2, 2, 2], Space::Ras));
    assert_eq!(last(&v), DVec3::new(13.0, 22.0, 26.0));
    // A left-handed space is turned into a right-handed one.
    let v =
        nrrd("dimension: 3\nsizes: 2 2 2\nspace: left-anterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (5,0,0)");
    assert_eq!((v.grid().space(), last(&v)), (Space::Ras, DVec3::new(-6.0, 1.0, 1.0)));
    let v = nrrd("dimension: 2\nsizes: 4 2\nspacings: 2 3\nmodality:=CT");
    assert_eq!((v.grid().dims(), v.grid().spacing(), v.modality()), ([4, 2, 1], [2.0, 3.0, 1.0], Modality::Ct));
    let v = nrrd("dimension: 4\nsizes: 2 2 2 1\nspacings: 2 3 4 nan");
    assert_eq!(v.grid().spacing(), [2.0, 3.0, 4.0]);
    let v = nrrd("dimension: 3\nsizes: 2 2 2\naxis mins: 0 0 0\naxis maxs: 4 6 8");
    assert_eq!((v.grid().spacing(), v.grid().origin()), ([2.0, 3.0, 4.0], DVec3::new(1.0, 1.5, 2.0)));
}

#[test]
fn nifti_forms_and_rescale() {
    let sample = Sample::new(VoxelType::I16, DIMS);
    let with = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = nifti(&sample, Endian::Big);
        edit(&mut bytes);
        open("a.nii", &bytes)
    };
    let float = |b: &mut Vec<u8>, at, v| put_f32(b, at, v, Endian::Big);
    let last = |v: &Volume| v.grid().index_to_world().transform_point3(DVec3::ONE);
    // No form: the voxel sizes alone.
    assert_eq!(last(&with(&|_| {})), DVec3::new(1.0, 2.0, 3.0));
    // A quarter turn about z (quaternion cos 45, 0, 0, sin 45), mirrored along the third axis, moved.
    let v = with(&|b| {
        put_i16(b, 252, 1, Endian::Big);
        float(b, 76, -1.0);
        float(b, 264, 0.5f32.sqrt());
        [10.0, 20.0, 30.0].into_iter().enumerate().for_each(|(i, o)| float(b, 268 + 4 * i, o));
    });
    assert!(last(&v).abs_diff_eq(DVec3::new(8.0, 21.0, 27.0), 1e-6), "{}", last(&v));
    assert_eq!(v.grid().space(), Space::Ras);
    // sform goes before qform.
    let v = with(&|b| {
        put_i16(b, 252, 1, Endian::Big);
        put_i16(b, 254, 1, Endian::Big);
        [0.0, 1.0, 0.0, 5.0, 2.0, 0.0, 0.0, 6.0, 0.5, 0.0, 3.0, 7.0].into_iter().enumerate().for_each(|(i, o)| float(b, 280 + 4 * i, o));
    });
    assert_eq!(last(&v), DVec3::new(6.0, 8.0, 10.5));
    // Slope 0 means none, whatever the intercept.
    let v = with(&|b| float(b, 116, 100.0));
    assert_eq!(v.rescale(), (1.0, 0.0));
    let v = with(&|b| {
        float(b, 112, 2.0);
        float(b, 116, -1024.0);
    });
    assert_eq!(v.rescale(), (2.0, -1024.0));
    assert_eq!(v.value([0, 0, 0]), 2.0 * f64::from(i16::MIN) - 1024.0);
    // A fourth and fifth dimension of 1 are none.
    let v = with(&|b| put_i16(b, 40, 5, Endian::Big));
    assert_eq!(v.grid().dims(), DIMS);
}

#[test]
fn metaimage_axes() {
    let sample = Sample::new(VoxelType::U8, DIMS);
    let extra = "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 20 30\nModality = MET_MOD_MR\n\
                 ElementToIntensityFunctionSlope = 0.5\nElementToIntensityFunctionOffset = 3\n";
    let v = open("a.mha", &join(&[meta_header(&sample, Endian::Little, extra, "LOCAL").as_bytes(), &sample.bytes(Endian::Little)]));
    // The first axis runs along +y, the second along -x; spacing 1, 2, 3.
    assert_eq!(v.grid().index_to_world().transform_point3(DVec3::ONE), DVec3::new(8.0, 21.0, 33.0));
    assert_eq!((v.grid().space(), v.modality(), v.rescale()), (Space::Lps, Modality::Mr, (0.5, 3.0)));
}

#[test]
fn vtk_cells_and_fields() {
    let head = "# vtk DataFile Version 4.2\n\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 2\nASPECT_RATIO 2 2 2\nORIGIN 1 1 1\n";
    let v = open("a", format!("{head}CELL_DATA 4\nSCALARS s float\nLOOKUP_TABLE default\n1 2 3 4\n").as_bytes());
    assert_eq!((v.grid().dims(), v.grid().origin()), ([2, 2, 1], DVec3::splat(2.0)));
    let v = open("a", format!("{head}POINT_DATA 18\nFIELD FieldData 1\nf 1 18 int\n{}", "7 ".repeat(18)).as_bytes());
    assert!(*v.voxels() == Voxels::I32(vec![7; 18].into()));
    // Without a LOOKUP_TABLE line, and with another array behind.
    let v = open("a", format!("{head}POINT_DATA 18\nSCALARS s short\n{}VECTORS v float\n1 2 3", "-7 ".repeat(18)).as_bytes());
    assert!(*v.voxels() == Voxels::I16(vec![-7; 18].into()));
}

#[test]
fn numpy_shapes_types_and_archives() {
    let words: Vec<u8> = [1i64, -2, i64::from(i32::MAX), i64::from(i32::MIN)].iter().flat_map(|v| v.to_le_bytes()).collect();
    let v = open("a", &npy_raw(1, "{'descr': '<i8', 'fortran_order': False, 'shape': (1, 2, 2)}", &words));
    assert!(*v.voxels() == Voxels::I32(vec![1, -2, i32::MAX, i32::MIN].into()));
    let v = open("a", &npy_raw(1, "{'descr': '<i8', 'fortran_order': True, 'shape': (1, 2, 2)}", &words));
    assert!(*v.voxels() == Voxels::I32(vec![1, i32::MAX, -2, i32::MIN].into()));
    let v = open("a", &npy_raw(2, "{'descr': '|b1', 'fortran_order': False, 'shape': (1, 2, 1, 3, 1)}", &[0, 1, 1, 0, 1, 0]));
    assert_eq!(v.grid().dims(), [1, 3, 2]);
    assert!(*v.voxels() == Voxels::U8(vec![0, 1, 1, 0, 1, 0].into()));

    // The first array of three dimensions, past text and a table; its name is told.
    let sample = Sample::new(VoxelType::F32, DIMS);
    let text = npy_raw(1, "{'descr': '<U3', 'fortran_order': False, 'shape': (1,)}", &[0; 12]);
    let table = npy_raw(1, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3)}", &[0; 6]);
    let array = npy(&sample, Endian::Big, false, 1);
    let v =
        open("a", &npz(&[("readme.txt", vec![1]), ("t.npy", text), ("m.npy", table), ("ct.npy", array.clone()), ("z.npy", array)], true));
    same(&v, &sample, "npz");
    assert!(v.name().ends_with("a:ct"), "{}", v.name());
}

#[test]
fn volvis_files_are_known_by_name_and_length() {
    let dir = TempDir::new().unwrap();
    // The second looks like the start of a DICOM file.
    for dims in [DIMS, [8, 5, 3], [1, 1, 1]] {
        let sample = Sample::new(VoxelType::U16, dims);
        let bytes = dat(dims.map(|n| n as u16), &sample.bytes(Endian::Little));
        let (one, two) = bytes.split_at(bytes.len() / 2);
        let files = [
            ("a.dat", bytes.clone()),
            ("A.DAT", bytes.clone()),
            ("a.dat.gz", gz(&bytes)),
            ("b.dat", gz(&bytes)),
            ("c.dat.gz", join(&[&gz(one), &gz(two), &[0; 512]])),
        ];
        for (name, bytes) in files {
            let path = save(&dir, name, &bytes);
            assert_eq!(io::detect(&path).unwrap(), Format::Dat, "{name} {dims:?}");
            let volume = Volume::open(&path).unwrap();
            same(&volume, &sample, name);
            assert_eq!((volume.grid().spacing(), volume.name()), ([1.0; 3], path.to_str().unwrap()));
        }
        // Under another name nothing tells.
        assert_ne!(io::detect(save(&dir, "a.bin", &bytes)).ok(), Some(Format::Dat));
        // A magic number tells more than the name.
        assert_eq!(io::detect(save(&dir, "a.dat", &nrrd(&sample, Endian::Little, "raw"))).unwrap(), Format::Nrrd);
    }
}

#[test]
fn formats_say_what_they_are() {
    assert!(Format::ALL.contains(&Format::Dat) && Format::ALL.len() >= 9);
    for &format in Format::ALL {
        assert_eq!(format.to_string(), format.name());
        // A stack of images is known by its folder.
        assert!(!format.reads().is_empty() && (!format.extensions().is_empty() || format.name() == "image stack"));
        assert!(format.extensions().iter().all(|e| !e.contains('.') && *e == e.to_ascii_lowercase()));
    }
}

#[test]
fn padding_and_members() {
    let sample = Sample::new(VoxelType::U8, DIMS);
    let raw = nrrd(&sample, Endian::Little, "raw");
    // Data longer than needed, as the formats' own tools allow; a gzip file in two members, padded with zeros.
    same(&open("a", &join(&[&raw, b"more than zeros"])), &sample, "longer");
    let (one, two) = raw.split_at(raw.len() - 17);
    same(&open("a", &join(&[&gz(one), &gz(two), &[0; 512]])), &sample, "members");
    let bytes = join(&[&sample.bytes(Endian::Little), b"\n\0\0"]);
    let dir = TempDir::new().unwrap();
    let spec = RawSpec::new(DIMS, VoxelType::U8);
    // Only its length tells whether a bare file is what it is said to be.
    let told = io::read_raw(save(&dir, "a.raw", &bytes), &spec, &Limits::default()).unwrap_err().to_string();
    assert!(told.contains("60 bytes") && told.contains("63"), "{told}");
}

#[test]
fn raw_that_starts_like_gzip_is_raw() {
    let dir = TempDir::new().unwrap();
    let path = save(&dir, "a.raw", &[0x1f, 0x8b, 8, 4]);
    let v = io::read_raw(path, &RawSpec::new([2, 2, 1], VoxelType::U8), &Limits::default()).unwrap();
    assert!(*v.voxels() == Voxels::U8(vec![0x1f, 0x8b, 8, 4].into()));
}
