//! Volumes written and read again, and volumes made out of volumes: every voxel against what it must be.
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod files;

use files::{Random, Sample};
use glam::{DAffine3, DMat3, DVec3};
use rayon::ThreadPoolBuilder;
use slicestack::volume::edit::{Sampling, convert_type, crop, resample};
use slicestack::volume::io::{self, RawSpec, WriteFormat, Writing, Written};
use slicestack::volume::{Channels, Grid, Modality, Segment, Space, VoxelType, Voxels};
use slicestack::{Error, Limits, Progress, Volume};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tempfile::TempDir;

/// Names of files in each format, as it is and compressed.
const NAMES: [(&str, bool); 10] = [
    ("v.nrrd", false),
    ("v.nrrd", true),
    ("v.nii", false),
    ("v.nii.gz", false),
    ("v.mha", false),
    ("v.mha", true),
    ("v.npy", false),
    ("v.npy.gz", true),
    ("v.raw", false),
    ("v.raw.gz", false),
];

/// Grids of all kinds: plain, anisotropic, mirrored, turned, sheared; in every space.
fn grids(dims: [usize; 3]) -> Vec<Grid> {
    let turned = DMat3::from_cols(DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.48, 0.36, 0.8), DVec3::new(0.64, -0.48, 0.6));
    let spacing = DMat3::from_diagonal(DVec3::new(0.7, 1.3, 2.5));
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.1, 0.9, 0.0), DVec3::new(0.2, -0.3, 1.7));
    let mirrored = DMat3::from_diagonal(DVec3::new(-0.7, 0.7, 3.0));
    let origin = DVec3::new(-12.25, 1.0 / 3.0, 1234.5);
    let mut all = vec![Grid::with_spacing(dims, [1.0; 3]).unwrap(), Grid::with_spacing(dims, [0.5, 0.1, 3.0]).unwrap()];
    for space in [Space::Unknown, Space::Ras, Space::Lps] {
        for steps in [turned * spacing, sheared, mirrored, spacing] {
            all.push(Grid::new(dims, origin, steps).unwrap().with_space(space));
        }
    }
    all
}

fn volume(kind: VoxelType, grid: Grid) -> Volume {
    let voxels = Sample::new(kind, grid.dims()).voxels;
    Volume::new(grid, voxels).unwrap()
}

fn put(volume: &Volume, path: &Path, compress: bool) -> Written {
    let written = io::write(volume, path, &Writing::new().compress(compress)).unwrap();
    assert_eq!(std::fs::metadata(path).unwrap().len(), written.bytes);
    for note in &written.notes {
        assert!(!note.contains('\n') && !note.is_empty());
    }
    written
}

/// What `path` holds; raw files are described by their note.
fn get(path: &Path, written: &Written, dims: [usize; 3], limits: &Limits) -> Volume {
    if !path.to_string_lossy().contains(".raw") {
        return io::read(path, limits).unwrap();
    }
    let note = written.notes.iter().find(|n| n.contains("--volume.dimensions")).unwrap();
    let given = |flag: &str| -> Option<Vec<String>> {
        let words = note.split(&format!("--volume.{flag} ")).nth(1)?;
        Some(words.split_whitespace().next()?.split(',').map(str::to_owned).collect())
    };
    let triple =
        |flag, otherwise: f64| -> [f64; 3] { given(flag).map_or([otherwise; 3], |list| std::array::from_fn(|i| list[i].parse().unwrap())) };
    assert_eq!(given("dimensions").unwrap(), dims.map(|n| n.to_string()));
    let kind = VoxelType::from_name(&given("type").unwrap()[0]).unwrap();
    io::read_raw(path, &RawSpec::new(dims, kind).with_spacing(triple("spacing", 1.0)).with_origin(triple("origin", 0.0)), limits).unwrap()
}

/// Whether two maps agree up to `error` of their largest number.
fn close(a: &DAffine3, b: &DAffine3, error: f64) -> bool {
    let largest = b.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    a.to_cols_array().iter().zip(b.to_cols_array()).all(|(a, b)| (a - b).abs() <= error * largest)
}

/// The map with the signs of x and y changed: from RAS to LPS and back.
fn flipped(grid: &Grid) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0)) * grid.index_to_world()
}

#[test]
fn what_is_written_is_read_again() {
    let dir = TempDir::new().unwrap();
    let dims = [5, 4, 3];
    let limits = Limits::default();
    let mut files = 0;
    for grid in grids(dims) {
        for kind in VoxelType::ALL {
            let v = volume(kind, grid.clone());
            for (name, compress) in NAMES {
                let path = dir.path().join(name);
                let written = put(&v, &path, compress);
                let again = get(&path, &written, dims, &limits);
                assert!(again.voxels() == v.voxels(), "{name} {kind}: voxels differ");
                assert_eq!((written.voxel_type, again.rescale()), (kind, (1.0, 0.0)), "{name}");
                let (got, space) = (again.grid(), grid.space());
                let same = grid.index_to_world();
                let fine = match name.split_once('.').unwrap().1 {
                    "nrrd" => got.space() == space && got.index_to_world() == same,
                    "nii" | "nii.gz" => {
                        let want = if space == Space::Lps { flipped(&grid) } else { same };
                        let steps = same.matrix3;
                        let upright = steps == DMat3::from_diagonal(steps.diagonal().abs()) && same.translation == DVec3::ZERO;
                        let told = if space == Space::Unknown && upright { Space::Unknown } else { Space::Ras };
                        got.space() == told && close(&got.index_to_world(), &want, 1e-7)
                    }
                    "mha" => {
                        let want = if space == Space::Ras { flipped(&grid) } else { same };
                        let upright = same.matrix3 == DMat3::from_diagonal(same.matrix3.diagonal().abs());
                        let told = if space == Space::Unknown && upright { Space::Unknown } else { Space::Lps };
                        got.space() == told && close(&got.index_to_world(), &want, 1e-14)
                    }
                    "npy" | "npy.gz" => {
                        let told = written.notes.iter().any(|n| n.contains("keeps no grid"));
                        told != (grid == Grid::with_spacing(dims, [1.0; 3]).unwrap())
                    }
                    _ if same.matrix3 == DMat3::from_diagonal(same.matrix3.diagonal()) => got.index_to_world() == same,
                    _ => written.notes.iter().any(|n| n.contains("keeps no grid")),
                };
                assert!(fine, "{name} {kind}: {got:?} for {grid:?}; {:?}", written.notes);
                files += 1;
            }
        }
    }
    assert_eq!(files, 14 * 8 * 10);
    // Nothing is left beside the files.
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 8);
}

#[test]
fn plain_files_are_mapped_and_bytes_are_the_same_each_time() {
    let dir = TempDir::new().unwrap();
    for grid in grids([7, 5, 3]) {
        for kind in VoxelType::ALL {
            let v = volume(kind, grid.clone()).with_modality(Modality::Mr);
            for name in ["v.nrrd", "v.nii", "v.mha", "v.npy", "v.raw"] {
                let path = dir.path().join(name);
                let written = put(&v, &path, false);
                let again = get(&path, &written, [7, 5, 3], &Limits::new().map_bytes(0));
                assert!(again.voxels().is_mapped() && again.voxels() == v.voxels(), "{name} {kind}");
                let format = WriteFormat::of_path(&path).unwrap().0;
                let mut bytes = Vec::new();
                io::write_to(&v, &mut bytes, format, &Writing::new()).unwrap();
                assert_eq!(bytes, std::fs::read(&path).unwrap(), "{name}");
                // Only where the format has a place for a mark.
                assert_eq!(format.wrote(&bytes[..bytes.len().min(1024)]), !matches!(name, "v.npy" | "v.raw"), "{name}");
                let mut packed = [Vec::new(), Vec::new()];
                for out in &mut packed {
                    io::write_to(&v, out, format, &Writing::new().compress(true)).unwrap();
                }
                // Whether the file's or a stream's, they are the same bytes.
                io::write(&v, dir.path().join("packed"), &Writing::new().format(format).compress(true)).unwrap();
                assert!(packed[0] == packed[1] && packed[0] == std::fs::read(dir.path().join("packed")).unwrap());
                if name == "v.mha" {
                    let behind = |key: &[u8]| packed[0].windows(key.len()).position(|w| w == key).unwrap() + key.len();
                    let size = &packed[0][behind(b"CompressedDataSize = ")..][..20];
                    let told: usize = std::str::from_utf8(size).unwrap().parse().unwrap();
                    assert_eq!(told, packed[0].len() - behind(b"ElementDataFile = LOCAL\n"));
                }
                assert!(format.wrote(&packed[0][..packed[0].len().min(1024)]), "{name}");
            }
        }
    }
    assert!(!WriteFormat::Nrrd.wrote(b"NRRD0004\ntype: short\n") && !WriteFormat::Nifti.wrote(&[0x5c, 1, 0, 0, 9]));
}

#[test]
fn slope_and_intercept_are_kept_or_applied() {
    let dir = TempDir::new().unwrap();
    let numbers = |kind| Sample::new(kind, [6, 5, 4]).voxels;
    let few = Voxels::from((0..120u16).map(|i| i * 34).collect::<Vec<_>>());
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    for (voxels, slope, intercept, kind) in [
        (few.clone(), 1.0, -1024.0, I16),
        (few.clone(), 10.0, 0.0, U16),
        (few.clone(), -1.0, 4046.0, U16),
        (few, 1.0, -1e6, I32),
        (numbers(U8), 1.0, -128.0, I8),
        (numbers(U8), 300.0, 0.0, U32),
        (numbers(U16), 1.0, -1024.0, I32),
        (numbers(I32), 2.0, 1.0, F64),
        (numbers(U32), 1e12, 1.0, F64),
        (numbers(I16), 0.5, 0.0, F32),
        (numbers(U8), 1.0 / 255.0, 0.25, F32),
        (numbers(I32), 0.1, 3.0, F64),
        (numbers(F32), 2.0, 1.0, F32),
        (numbers(F64), 2.0, 0.5, F64),
    ] {
        let was = voxels.voxel_type();
        let v = Volume::new(Grid::with_spacing([6, 5, 4], [1.0; 3]).unwrap(), voxels).unwrap().with_rescale(slope, intercept).unwrap();
        for (name, compress) in NAMES {
            let path = dir.path().join(name);
            let written = put(&v, &path, compress);
            let again = get(&path, &written, [6, 5, 4], &Limits::default());
            let nifti = name.contains("nii");
            assert_eq!(written.voxel_type, if nifti { was } else { kind }, "{name}: {was} x {slope} + {intercept}");
            assert_eq!(written.notes.iter().any(|n| n.contains("values that they stand for")), !nifti, "{name}: {:?}", written.notes);
            if nifti {
                assert!(again.voxels() == v.voxels());
                assert_eq!(again.rescale(), (f64::from(slope as f32), f64::from(intercept as f32)));
                let exact = again.rescale() == (slope, intercept);
                assert_ne!(exact, written.notes.iter().any(|n| n.contains("in f32, so as")), "{:?}", written.notes);
                continue;
            }
            assert_eq!(again.rescale(), (1.0, 0.0));
            for i in 0..120 {
                let want = slope * v.voxels().get(i) + intercept;
                let want = if kind == F32 { f64::from(want as f32) } else { want };
                assert_eq!(again.voxels().get(i), want, "{name}: {was} x {slope} + {intercept}");
            }
        }
    }
    // Stored numbers go out as they are where that is asked for, with what turns them back.
    let v = volume(U8, Grid::with_spacing([6, 5, 4], [1.0; 3]).unwrap()).with_rescale(0.3, -7.5).unwrap();
    for (name, compress) in NAMES {
        let path = dir.path().join(name);
        let written = io::write(&v, &path, &Writing::new().compress(compress).stored(true)).unwrap();
        let again = get(&path, &written, [6, 5, 4], &Limits::default());
        assert!(again.voxels() == v.voxels() && written.voxel_type == U8, "{name}");
        let told = written.notes.iter().any(|n| n.contains("give --volume.slope 0.3 --volume.intercept -7.5 where it is read"));
        let kept = if name.contains("mha") { (0.3, -7.5) } else { (f64::from(0.3f32), -7.5) };
        let expected = if name.contains("mha") || name.contains("nii") { (kept, false) } else { ((1.0, 0.0), true) };
        assert_eq!((again.rescale(), told), expected, "{name}");
    }
    // A slope that f32 cannot hold, or that NIfTI would take for none.
    for slope in [1e-50, 1e50] {
        let v = volume(U8, Grid::with_spacing([3, 3, 3], [1.0; 3]).unwrap()).with_rescale(slope, 0.0).unwrap();
        let path = dir.path().join("v.nii");
        let written = put(&v, &path, false);
        assert!(written.voxel_type == F32 && written.notes.iter().any(|n| n.contains("values that they stand for")));
    }
}

#[test]
fn kinds_of_values_segments_and_colours_follow_the_formats_rules() {
    let dir = TempDir::new().unwrap();
    let grid = Grid::with_spacing([3, 2, 2], [1.0; 3]).unwrap();
    for modality in [Modality::Ct, Modality::Mr, Modality::Other, Modality::Unknown] {
        let v = volume(VoxelType::I16, grid.clone()).with_modality(modality);
        for (name, kept) in [("v.nrrd", true), ("v.mha", true), ("v.nii", false), ("v.npy", false), ("v.raw", false)] {
            let path = dir.path().join(name);
            let written = put(&v, &path, false);
            let told = written.notes.iter().any(|n| n.contains("--volume.modality"));
            assert_eq!(told, !kept && modality != Modality::Unknown, "{name}");
            let read = get(&path, &written, [3, 2, 2], &Limits::default()).modality();
            assert_eq!(read, if kept { modality } else { Modality::Unknown }, "{name}");
        }
    }
    let segments = vec![Segment::new(1, "left\nlung").with_color([1.0, 0.5, 0.0]), Segment::new(7, "")];
    let v = volume(VoxelType::U8, grid.clone()).with_segments(segments).unwrap();
    let text = |name: &str| {
        let path = dir.path().join(name);
        let written = put(&v, &path, false);
        (String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned(), written.notes)
    };
    let (nrrd, notes) = text("s.nrrd");
    for line in ["Segment0_Name:=left\\nlung\n", "Segment0_LabelValue:=1\n", "Segment0_Color:=1 0.5 0\n", "Segment1_LabelValue:=7\n"] {
        assert!(nrrd.contains(line), "{line} in {nrrd}");
    }
    assert!(!nrrd.contains("Segment1_Color") && notes.is_empty());
    assert!(Volume::open(dir.path().join("s.nrrd")).unwrap().voxels() == v.voxels());
    for name in ["s.nii", "s.mha", "s.npy", "s.raw"] {
        assert!(text(name).1.iter().any(|n| n.contains("those of 2 labels are left out")), "{name}");
    }

    for (kind, descr, meta) in
        [(VoxelType::U8, "|u1", "MET_UCHAR"), (VoxelType::U16, "<u2", "MET_USHORT"), (VoxelType::F32, "<f4", "MET_FLOAT")]
    {
        let numbers = Sample::new(kind, [12, 2, 2]);
        let v = Volume::with_colors(grid.clone(), numbers.voxels.clone()).unwrap();
        let end = numbers.bytes(io::Endian::Little);
        for (name, says) in [
            (
                "c.nrrd",
                vec![
                    "dimension: 4\n".into(),
                    "sizes: 4 3 2 2\n".into(),
                    "kinds: RGBA-color domain domain domain\n".into(),
                    "none (1,0,0)".into(),
                ],
            ),
            ("c.mha", vec!["ElementNumberOfChannels = 4\n".to_owned(), format!("ElementType = {meta}\n")]),
            ("c.npy", vec![format!("'descr': '{descr}'"), "(2, 2, 3, 4)".into()]),
        ] {
            let path = dir.path().join(name);
            let written = put(&v, &path, false);
            let bytes = std::fs::read(&path).unwrap();
            assert!(written.voxel_type == kind && bytes.ends_with(&end), "{name}");
            let head = String::from_utf8_lossy(&bytes[..bytes.len() - end.len()]).into_owned();
            says.iter().for_each(|s| assert!(head.contains(s), "{s} in {head}"));
        }
        let path = dir.path().join("c.nii");
        if kind == VoxelType::U8 {
            put(&v, &path, false);
            let bytes = std::fs::read(&path).unwrap();
            assert!(bytes[70..74] == [0, 9, 32, 0] && bytes[352..] == end);
        } else {
            let line = io::write(&v, &path, &Writing::new()).unwrap_err().to_string();
            assert!(line.ends_with(&format!("c.nii: colours of {kind}: NIfTI-1 holds those of u8 alone")), "{line}");
        }
        let line = io::write(&v, dir.path().join("c.raw"), &Writing::new()).unwrap_err().to_string();
        assert!(line.ends_with("c.raw: colours cannot be read from raw files: write .nrrd instead"), "{line}");
    }
}

#[test]
fn what_cannot_be_written_is_told_in_a_line_and_leaves_nothing() {
    let dir = TempDir::new().unwrap();
    let small = volume(VoxelType::U8, Grid::with_spacing([2, 2, 2], [1.0; 3]).unwrap());
    let long = volume(VoxelType::U8, Grid::with_spacing([2, 40_000, 1], [1.0; 3]).unwrap());
    let fine = volume(VoxelType::U8, Grid::with_spacing([2, 2, 2], [1.0, 1e-60, 1.0]).unwrap());
    let plain = Writing::new();
    for (v, name, writing, says) in [
        (
            &small,
            "a.png",
            &plain,
            "a.png: no volumes of the extension \"png\" are written: use .nrrd, .nii, .mha, .npy, .raw, .nii.gz, .npy.gz or .raw.gz",
        ),
        (&small, "a", &plain, "a: no volumes of the extension \"\" are written"),
        (&small, "a.nrrd.gz", &plain, "a.nrrd.gz: NRRD is compressed inside the file: name it .nrrd"),
        (&small, "a.nii", &plain.clone().compress(true), "a.nii: NIfTI-1 is compressed as a whole: name it .nii.gz"),
        (&small, "no/a.nrrd", &plain, "No such file"),
        (&long, "a.nii", &plain, "a.nii: 40000 voxels along axis 1: NIfTI-1 holds 32767 at most"),
        (&fine, "a.nii", &plain, "a.nii: 1e-60 in origin or steps: NIfTI-1 keeps them in f32"),
    ] {
        let line = io::write(v, dir.path().join(name), writing).unwrap_err().to_string();
        assert!(line.contains(says) && !line.contains('\n'), "{line}");
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    // What the name does not tell may be given; then gzip is what is asked for.
    io::write(&small, dir.path().join("a"), &plain.clone().format(WriteFormat::Nifti).compress(true)).unwrap();
    assert!(Volume::open(dir.path().join("a")).unwrap().voxels() == small.voxels());
    for (name, gzip) in [("b.gz", true), ("b.bin", false)] {
        io::write(&small, dir.path().join(name), &plain.clone().format(WriteFormat::Npy)).unwrap();
        assert_eq!(std::fs::read(dir.path().join(name)).unwrap().starts_with(&[0x1f, 0x8b]), gzip, "{name}");
    }
}

/// Stops after some steps.
struct Stop(AtomicU64);

impl Progress for Stop {
    fn step(&self, what: &str, done: u64, total: u64) -> bool {
        assert!(done <= total && !what.is_empty());
        self.0.fetch_sub(1, Ordering::Relaxed) > 1
    }
}

fn stop(after: u64) -> Arc<Stop> {
    Arc::new(Stop(AtomicU64::new(after)))
}

#[test]
fn stopping_leaves_what_was_there() {
    let dir = TempDir::new().unwrap();
    let v = volume(VoxelType::U8, Grid::with_spacing([100, 100, 20], [1.0; 3]).unwrap());
    for (name, compress) in NAMES {
        let path = dir.path().join(name);
        std::fs::write(&path, "older").unwrap();
        let stopped = io::write(&v, &path, &Writing::new().compress(compress).progress(stop(3)));
        assert!(matches!(stopped, Err(Error::Stopped)));
        assert_eq!(std::fs::read(&path).unwrap(), b"older");
        std::fs::remove_file(&path).unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{name}");
    }
    let limits = Limits::default();
    assert!(matches!(resample(&v, Sampling::Dimensions([50, 50, 50]), &limits, Some(&*stop(4))), Err(Error::Stopped)));
    assert!(matches!(convert_type(&v, VoxelType::F32, None, &limits, Some(&*stop(2))), Err(Error::Stopped)));
    assert!(matches!(crop(&v, [1..9, 0..100, 0..20], Some(&*stop(5))), Err(Error::Stopped)));
}

#[cfg(unix)]
#[test]
fn links_stay_links() {
    let dir = TempDir::new().unwrap();
    let (target, link) = (dir.path().join("real.nrrd"), dir.path().join("link.nrrd"));
    std::fs::write(&target, "older").unwrap();
    std::os::unix::fs::symlink("real.nrrd", &link).unwrap();
    let v = volume(VoxelType::I16, Grid::with_spacing([3, 2, 2], [1.0; 3]).unwrap());
    io::write(&v, &link, &Writing::new()).unwrap();
    assert!(link.is_symlink() && !target.is_symlink());
    assert!(Volume::open(&target).unwrap().voxels() == v.voxels());
}

#[cfg(unix)]
#[test]
fn pipes_get_what_files_get() {
    let dir = TempDir::new().unwrap();
    let v = volume(VoxelType::I16, Grid::with_spacing([30, 20, 10], [1.0; 3]).unwrap());
    for (name, compress) in NAMES {
        let (pipe, file) = (dir.path().join(format!("pipe.{name}")), dir.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        io::write(&v, &pipe, &Writing::new().compress(compress)).unwrap();
        put(&v, &file, compress);
        assert!(reader.join().unwrap() == std::fs::read(&file).unwrap(), "{name}");
        std::fs::remove_file(&pipe).unwrap();
    }
}

#[test]
fn a_part_keeps_its_voxels_and_its_place() {
    let mut random = Random(7);
    for grid in grids([7, 6, 5]) {
        let v = volume(VoxelType::I16, grid).with_rescale(2.0, -3.0).unwrap().with_modality(Modality::Ct).with_note("a note");
        let ranges = v.grid().dims().map(|n| {
            let from = random.below(n);
            from..from + 1 + random.below(n - from)
        });
        let part = crop(&v, ranges.clone(), None).unwrap();
        assert_eq!(part.grid().dims(), ranges.clone().map(|r| r.len()));
        assert_eq!((part.rescale(), part.modality(), part.notes()), ((2.0, -3.0), Modality::Ct, v.notes()));
        assert_eq!((part.grid().space(), part.grid().index_to_world().matrix3), (v.grid().space(), v.grid().index_to_world().matrix3));
        let [nx, ny, nz] = part.grid().dims();
        for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
            let was = [ranges[0].start + i, ranges[1].start + j, ranges[2].start + k];
            assert_eq!(part.value([i, j, k]), v.value(was));
            let place = |grid: &Grid, at: [usize; 3]| grid.index_to_world().transform_point3(DVec3::from_array(at.map(|n| n as f64)));
            assert!(place(part.grid(), [i, j, k]).distance(place(v.grid(), was)) < 1e-11);
        }
    }
    let v = volume(VoxelType::U8, Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap());
    for (ranges, says) in
        [([0..4, 2..2, 0..4], "crop 2:2 along y"), ([0..4, 0..4, 1..5], "crop 1:5 along z"), ([5..9, 0..4, 0..4], "crop 5:9 along x")]
    {
        assert!(crop(&v, ranges, None).unwrap_err().to_string().starts_with(says));
    }
    // Labels and colours stay what they are.
    let labels = v.clone().with_segments(vec![Segment::new(3, "three")]).unwrap();
    assert_eq!(crop(&labels, [0..1, 0..2, 0..3], None).unwrap().channels(), labels.channels());
    let colors = Volume::with_colors(Grid::with_spacing([2, 1, 1], [1.0; 3]).unwrap(), vec![1u8, 2, 3, 4, 5, 6, 7, 8].into()).unwrap();
    let last = crop(&colors, [1..2, 0..1, 0..1], None).unwrap();
    assert_eq!(last.colors().unwrap().get(0), [5.0, 6.0, 7.0, 8.0].map(|c| c / 255.0));
}

/// Position of the centre of new cell `j` among old ones.
fn place(j: usize, old: usize, new: usize) -> f64 {
    (j as f64 + 0.5) * old as f64 / new as f64 - 0.5
}

/// The share of new cell `j` that old cell `i` covers.
fn share(i: usize, j: usize, old: usize, new: usize) -> f64 {
    let size = old as f64 / new as f64;
    let (from, to) = ((j as f64 * size).max(i as f64), ((j + 1) as f64 * size).min((i + 1) as f64));
    (to - from).max(0.0) / size
}

#[test]
fn more_voxels_are_interpolated_and_fewer_are_means() {
    let limits = Limits::default();
    let grid = grids([7, 5, 4]).swap_remove(6);
    let v = volume(VoxelType::F64, grid);
    let old = v.grid().dims();
    for new in [[14, 5, 4], [9, 8, 7], [7, 5, 1], [3, 2, 3], [1, 1, 1], [13, 2, 9], [6, 4, 4], [70, 1, 3]] {
        let r = resample(&v, Sampling::Dimensions(new), &limits, None).unwrap();
        assert_eq!(r.grid().dims(), new);
        assert_eq!(r.grid().space(), v.grid().space());
        let corners = r.grid().corners().into_iter().zip(v.grid().corners());
        corners.for_each(|(a, b)| assert!(a.distance(b) < 1e-9, "the box moved: {a} {b}"));
        // Along each axis: a mean where there are fewer, else two neighbours of the place, clamped.
        let weight = |axis: usize, i: usize, j: usize| {
            if new[axis] < old[axis] {
                return share(i, j, old[axis], new[axis]);
            }
            let at = place(j, old[axis], new[axis]).clamp(0.0, (old[axis] - 1) as f64);
            (1.0 - (at - i as f64).abs()).max(0.0)
        };
        for (n, got) in (0..r.voxels().len()).map(|n| (n, r.voxels().get(n))) {
            let j = [n % new[0], n / new[0] % new[1], n / new[0] / new[1]];
            let mut want = 0.0;
            let mut most = 0.0f64;
            for i in 0..v.voxels().len() {
                let at = [i % old[0], i / old[0] % old[1], i / old[0] / old[1]];
                want += (0..3).map(|a| weight(a, at[a], j[a])).product::<f64>() * v.voxels().get(i);
                most = most.max(v.voxels().get(i).abs());
            }
            assert!((got - want).abs() < 1e-13 * most, "{new:?} at {j:?}: {got} for {want}");
        }
    }
    // Where nothing is averaged it is what the volume says between its voxels, to the bit.
    let finer = resample(&v, Sampling::Dimensions([9, 8, 7]), &limits, None).unwrap();
    for (n, got) in (0..finer.voxels().len()).map(|n| (n, finer.voxels().get(n))) {
        let j = [n % 9, n / 9 % 8, n / 72];
        let at = DVec3::new(place(j[0], 7, 9), place(j[1], 5, 8), place(j[2], 4, 7));
        assert!((got - v.sample(at)).abs() <= 1e-9 * v.sample(at).abs().max(1.0), "{j:?}");
    }
    // As many as there are: the same volume.
    assert!(resample(&v, Sampling::Dimensions(old), &limits, None).unwrap().voxels() == v.voxels());
}

#[test]
fn resampling_keeps_constants_types_and_threads_out_of_it() {
    let limits = Limits::default();
    let grid = Grid::with_spacing([23, 19, 17], [0.5, 1.0, 2.0]).unwrap();
    for kind in VoxelType::ALL {
        let v = volume(kind, grid.clone());
        let sampling = Sampling::Spacing([0.9, 0.7, 5.0]);
        let with = |threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| resample(&v, sampling, &limits, None).unwrap())
        };
        let (one, many) = (with(1), with(4));
        assert!(one.voxels() == many.voxels() && one.voxels().voxel_type() == kind);
        // 11.5 / 0.9 = 12.8, 19 / 0.7 = 27.1, 34 / 5 = 6.8.
        assert_eq!(one.grid().dims(), [13, 27, 7]);
        let mut flat = Voxels::zeros(kind, 23 * 19 * 17);
        let first = v.voxels().get(2);
        for i in 0..flat.len() {
            match &mut flat {
                Voxels::F32(x) => x[i] = first as f32,
                Voxels::F64(x) => x[i] = first,
                Voxels::U8(x) => x[i] = first as u8,
                Voxels::I8(x) => x[i] = first as i8,
                Voxels::U16(x) => x[i] = first as u16,
                Voxels::I16(x) => x[i] = first as i16,
                Voxels::U32(x) => x[i] = first as u32,
                Voxels::I32(x) => x[i] = first as i32,
            }
        }
        let flat = resample(&Volume::new(grid.clone(), flat).unwrap(), sampling, &limits, None).unwrap();
        assert!((0..flat.voxels().len()).all(|i| flat.voxels().get(i) == first), "{kind}");
    }
    let v = volume(VoxelType::U8, grid);
    for (sampling, says) in [
        (Sampling::Spacing([1.0, 0.0, 1.0]), "spacing 0: must be finite and over 0"),
        (Sampling::Spacing([1.0, f64::NAN, 1.0]), "spacing NaN"),
        (Sampling::Dimensions([3, 0, 3]), "every dimension must be at least 1"),
        (Sampling::Spacing([1e-300; 3]), "overflows"),
        (Sampling::Dimensions([10_000, 10_000, 10_000]), "bytes of the resampled volume: 1000000000000 is over the limit of 17179869184"),
    ] {
        let line = resample(&v, sampling, &limits, None).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    }
}

#[test]
fn labels_are_not_mixed_and_colours_are_weighted_by_opacity() {
    let limits = Limits::default();
    let voxels: Vec<u16> = (0..6 * 5 * 4).map(|i| (i * i % 1009) as u16).collect();
    let v = Volume::new(Grid::with_spacing([6, 5, 4], [1.0; 3]).unwrap(), voxels.clone().into()).unwrap();
    let v = v.with_segments(vec![Segment::new(4, "four")]).unwrap();
    for new in [[3, 2, 9], [12, 10, 1], [1, 7, 4]] {
        let r = resample(&v, Sampling::Dimensions(new), &limits, None).unwrap();
        assert_eq!(r.channels(), v.channels());
        for n in 0..r.voxels().len() {
            let j = [n % new[0], n / new[0] % new[1], n / new[0] / new[1]];
            // The cell that the centre lies in.
            let at = [0, 1, 2].map(|a| ((j[a] as f64 + 0.5) * [6, 5, 4][a] as f64 / new[a] as f64 + 1e-9) as usize);
            assert_eq!(r.voxels().get(n), f64::from(voxels[(at[2] * 5 + at[1]) * 6 + at[0]]), "{new:?} {j:?}");
        }
    }
    let grid = Grid::with_spacing([2, 1, 1], [1.0; 3]).unwrap();
    let mean = |numbers: Vec<u8>| {
        let v = Volume::with_colors(grid.clone(), numbers.into()).unwrap();
        let r = resample(&v, Sampling::Dimensions([1, 1, 1]), &limits, None).unwrap();
        r.colors().unwrap().get(0).map(|c| (c * 255.0).round() as u8)
    };
    // A transparent voxel halves the opacity and leaves the colour.
    assert_eq!(mean(vec![200, 100, 0, 80, 9, 9, 9, 0]), [200, 100, 0, 40]);
    assert_eq!(mean(vec![200, 0, 0, 100, 0, 200, 40, 100]), [100, 100, 20, 100]);
    assert_eq!(mean(vec![1, 2, 3, 0, 4, 5, 6, 0]), [0, 0, 0, 0]);
}

#[test]
fn other_types_round_clip_and_count() {
    let limits = Limits::default();
    let line = |voxels: Voxels| Volume::new(Grid::with_spacing([voxels.len(), 1, 1], [1.0; 3]).unwrap(), voxels).unwrap();
    let floats = line(vec![-0.5f32, 0.5, 1.5, 2.5, 254.5, 255.5, -0.6, 300.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 7.0].into());
    let done = convert_type(&floats, VoxelType::U8, None, &limits, None).unwrap();
    assert!(*done.volume.voxels() == Voxels::from(vec![0u8, 0, 2, 2, 254, 255, 0, 255, 0, 255, 0, 7]));
    // 255.5 rounds to 256, which is too large; -0.5 to 0, which is not too small.
    assert_eq!((done.clipped, done.undefined, done.rounded, done.range), (5, 1, 5, (0.0, 255.0)));
    let wide = convert_type(&floats, VoxelType::F64, None, &limits, None).unwrap();
    assert_eq!((wide.clipped, wide.undefined, wide.rounded), (0, 0, 0));
    assert!((0..12).all(|i| wide.volume.voxels().get(i).to_bits() == floats.voxels().get(i).to_bits() || i == 8));
    let narrow = convert_type(&line(vec![1e300, -1e300, 0.1, 0.5].into()), VoxelType::F32, None, &limits, None).unwrap();
    assert!(*narrow.volume.voxels() == Voxels::from(vec![f32::MAX, f32::MIN, 0.1, 0.5]));
    assert_eq!((narrow.clipped, narrow.rounded), (2, 1));

    // Without a scale, values are what is converted.
    let ct = line(vec![0u16, 1024, 5000].into()).with_rescale(1.0, -1024.0).unwrap();
    let done = convert_type(&ct, VoxelType::I16, None, &limits, None).unwrap();
    assert!(*done.volume.voxels() == Voxels::from(vec![-1024i16, 0, 3976]) && done.volume.rescale() == (1.0, 0.0) && done.clipped == 0);

    // With one they mean the same afterwards, to half a step.
    for kind in [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16, VoxelType::U32, VoxelType::I32] {
        let done = convert_type(&ct, kind, Some((-1024.0, 1000.0)), &limits, None).unwrap();
        let (first, last) = kind.limits();
        let step = 2024.0 / (last - first);
        for (i, want) in [-1024.0, 0.0, 1000.0].into_iter().enumerate() {
            assert!((done.volume.value([i, 0, 0]) - want).abs() <= 0.5001 * step, "{kind} {i}");
        }
        assert_eq!((done.volume.voxels().get(0), done.volume.voxels().get(2), done.clipped), (first, last, 1), "{kind}");
    }
    let nan = convert_type(&floats, VoxelType::I16, Some((10.0, 20.0)), &limits, None).unwrap();
    assert_eq!((nan.volume.voxels().get(8), nan.undefined, nan.clipped), (-32768.0, 1, 11));

    let labels = line(vec![0u16, 1, 300].into()).with_segments(vec![Segment::new(300, "far")]).unwrap();
    let told = |v: &Volume, kind, scale| convert_type(v, kind, scale, &limits, None).unwrap_err().to_string();
    assert!(told(&labels, VoxelType::U8, None).contains("labels of 1 voxels are outside 0 to 255"));
    assert!(told(&labels, VoxelType::F32, None).contains("a label is an integer"));
    assert!(told(&labels, VoxelType::U8, Some((0.0, 9.0))).contains("labels are not scaled"));
    let more = convert_type(&labels, VoxelType::I32, None, &limits, None).unwrap().volume;
    assert!(more.channels() == labels.channels() && *more.voxels() == Voxels::from(vec![0, 1, 300]));
    assert!(told(&floats, VoxelType::F32, Some((0.0, 1.0))).contains("a scale is for integers"));
    for scale in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
        assert!(told(&floats, VoxelType::U8, Some(scale)).contains("the smaller one first"));
    }
    let none = convert_type(&floats, VoxelType::F64, None, &Limits::new().voxel_bytes(95), None).unwrap_err().to_string();
    assert_eq!(none, "bytes of the converted volume: 96 is over the limit of 95");

    let colors = Volume::with_colors(Grid::with_spacing([1, 1, 1], [1.0; 3]).unwrap(), vec![0.0f32, 0.5, 1.0, 2.0].into()).unwrap();
    let done = convert_type(&colors, VoxelType::U16, None, &limits, None).unwrap();
    assert_eq!(done.volume.colors().unwrap().get(0), [0.0, 32768.0 / 65535.0, 1.0, 1.0]);
    assert_eq!((done.volume.channels(), done.clipped), (&Channels::Rgba, 1));
    assert!(told(&colors, VoxelType::I16, None).contains("only u8, u16 and f32"));
}

#[cfg(feature = "cli")]
mod command {
    use super::*;
    use std::io::Read;
    use std::path::PathBuf;
    use std::process::{Command, Output, Stdio};

    fn run(dir: &Path, args: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_slicestack")).arg("convert").args(args).current_dir(dir).output().unwrap()
    }

    /// What is told on stderr by a command that does its work.
    fn done(dir: &Path, args: &[&str]) -> String {
        let out = run(dir, args);
        let told = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.success() && out.stdout.is_empty(), "{args:?}: {told}");
        told
    }

    fn files(dir: &Path) -> Vec<PathBuf> {
        let mut names: Vec<PathBuf> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
        names.sort();
        names
    }

    fn head(dir: &Path) -> Volume {
        let grid = Grid::with_spacing([20, 16, 12], [1.0, 1.0, 2.0]).unwrap().with_space(Space::Lps);
        let voxels: Vec<i16> = (0..20 * 16 * 12).map(|i| (i % 4001) as i16 - 1000).collect();
        let v = Volume::new(grid, voxels.into()).unwrap();
        put(&v, &dir.join("head.nrrd"), true);
        v
    }

    #[test]
    fn one_file_becomes_another() {
        let dir = TempDir::new().unwrap();
        let v = head(dir.path());
        let told = done(dir.path(), &["head.nrrd", "b.nii.gz"]);
        let last = told.lines().last().unwrap();
        let bytes = std::fs::metadata(dir.path().join("b.nii.gz")).unwrap().len();
        assert_eq!(last, format!("b.nii.gz: 20 x 16 x 12 voxels of i16 in {bytes} bytes of NIfTI-1"));
        assert!(told.starts_with("note: NIfTI-1 has axes to right, front and top"), "{told}");
        done(dir.path(), &["b.nii.gz", "c.mha", "--compress"]);
        assert!(Volume::open(dir.path().join("c.mha")).unwrap().voxels() == v.voxels());

        let told =
            done(dir.path(), &["head.nrrd", "d.nrrd", "--crop", "2:12,:,4:", "--spacing", "2", "--type", "u8", "--scale", "-1000,1000"]);
        let d = Volume::open(dir.path().join("d.nrrd")).unwrap();
        assert_eq!(d.grid().dims(), [5, 8, 8]);
        assert!(told.contains("outside -1000 to 1000 and were clipped to it") && told.contains("give --volume.slope"), "{told}");
        let part = crop(&v, [2..12, 0..16, 4..12], None).unwrap();
        let small = resample(&part, Sampling::Spacing([2.0; 3]), &Limits::default(), None).unwrap();
        let want = convert_type(&small, VoxelType::U8, Some((-1000.0, 1000.0)), &Limits::default(), None).unwrap().volume;
        assert!(d.grid() == want.grid() && d.voxels() == want.voxels());
    }

    #[test]
    fn stdout_gets_the_file_and_stderr_the_words() {
        let dir = TempDir::new().unwrap();
        let v = head(dir.path());
        let before = files(dir.path());
        let out = run(dir.path(), &["head.nrrd", "-", "--format", "npy"]);
        let mut bytes = Vec::new();
        io::write_to(&v, &mut bytes, WriteFormat::Npy, &Writing::new()).unwrap();
        assert!(out.status.success() && out.stdout == bytes);
        assert!(String::from_utf8(out.stderr).unwrap().ends_with("20 x 16 x 12 voxels of i16 in 7808 bytes of NumPy\n"));
        // A reader that goes away is no error.
        let mut child = Command::new(env!("CARGO_BIN_EXE_slicestack"))
            .args(["convert", "head.nrrd", "-", "--size", "200x200x200"])
            .current_dir(dir.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut first = [0; 4];
        child.stdout.take().unwrap().read_exact(&mut first).unwrap();
        let ended = child.wait_with_output().unwrap();
        assert!(first == *b"NRRD" && ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        assert_eq!(files(dir.path()), before);
    }

    #[test]
    fn inputs_and_files_of_others_are_never_replaced() {
        let dir = TempDir::new().unwrap();
        head(dir.path());
        let path = |name: &str| dir.path().join(name);
        std::fs::write(path("other.nrrd"), "NRRD0004\ntype: short\n").unwrap();
        std::fs::write(path("other.raw"), "voxels of somebody").unwrap();
        std::fs::hard_link(path("head.nrrd"), path("hard.nrrd")).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("head.nrrd", path("soft.nrrd")).unwrap();
        let all: Vec<Vec<u8>> = files(dir.path()).iter().map(|p| std::fs::read(p).unwrap()).collect();
        let input = "would overwrite the input";
        for (args, says, status) in [
            (&["head.nrrd", "head.nrrd"][..], "head.nrrd: would overwrite the input", 2),
            (&["head.nrrd", "head.nrrd", "--force"], input, 2),
            (&["head.nrrd", "hard.nrrd", "--force"], input, 2),
            #[cfg(unix)]
            (&["head.nrrd", "soft.nrrd", "--force"], input, 2),
            #[cfg(unix)]
            (&["soft.nrrd", "head.nrrd"], input, 2),
            (
                &["head.nrrd", "other.nrrd"],
                "other.nrrd: is there already and is no NRRD volume that slicestack is known to have written",
                2,
            ),
            (&["head.nrrd", "other.raw"], "other.raw: is there already", 2),
            (&["head.nrrd", "a.png"], "a.png: no volumes of the extension \"png\" are written", 2),
            (&["head.nrrd", "a.nrrd.gz"], "NRRD is compressed inside the file", 2),
            (&["head.nrrd", "no/a.nrrd"], "no/a.nrrd: there is no directory no", 1),
            (&["head.nrrd", "a.nii", "--compress"], "a.nii: NIfTI-1 is compressed as a whole", 2),
            (&["lost.nrrd", "a.nii"], "lost.nrrd: ", 1),
            (&["other.nrrd", "a.nii"], "other.nrrd: ", 1),
            (&["head.nrrd", "a.nii", "--crop", "1:2,3"], "--crop 1:2,3: write X0:X1,Y0:Y1,Z0:Z1", 2),
            (&["head.nrrd", "a.nii", "--crop", ":,:,5:90"], "--crop 5:90 along z: not empty and within 0:12", 2),
            (&["head.nrrd", "a.nii", "--size", "3x4"], "--size 3x4: write three numbers", 2),
            (&["head.nrrd", "a.nii", "--size", "3x0x4"], "--size: volume of 3 x 0 x 4 voxels", 2),
            (&["head.nrrd", "a.nii", "--spacing", "0"], "--spacing 0: must be finite and over 0", 2),
            (&["head.nrrd", "a.nii", "--type", "f32", "--scale", "0,1"], "--scale 0,1: f32 holds values as they are", 2),
            (&["head.nrrd", "a.nii", "--scale", "0"], "--scale 0: write two values", 2),
            (&["head.nrrd", "a.nii", "--type", "u9"], "invalid value 'u9'", 2),
            (&["head.nrrd", "-", "--size", "9000x9000x9000"], "is over the limit of", 1),
        ] {
            let before = files(dir.path());
            let out = run(dir.path(), args);
            let line = String::from_utf8(out.stderr).unwrap();
            assert!(line.starts_with("error: ") && line.lines().count() == 1 && line.contains(says), "{args:?}: {line}");
            assert_eq!((out.status.code(), files(dir.path())), (Some(status), before), "{args:?}");
            assert!(out.stdout.is_empty());
        }
        assert_eq!(files(dir.path()).iter().map(|p| std::fs::read(p).unwrap()).collect::<Vec<_>>(), all);
        // What the command wrote may be written again; the rest gives way when told so.
        for (name, force) in
            [("a.nrrd", false), ("a.nii.gz", false), ("a.mha", false), ("a.npy", true), ("other.nrrd", true), ("other.raw", true)]
        {
            for _ in 0..2 {
                let args = ["head.nrrd", name, "--force"];
                done(dir.path(), if force { &args } else { &args[..2] });
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn an_interrupt_stops_at_once_and_leaves_nothing() {
        use std::time::{Duration, Instant};
        let dir = TempDir::new().unwrap();
        let v = volume(VoxelType::F32, Grid::with_spacing([300, 300, 300], [1.0; 3]).unwrap());
        put(&v, &dir.path().join("noise.nrrd"), false);
        let before = files(dir.path());
        let mut child = Command::new(env!("CARGO_BIN_EXE_slicestack"))
            .args(["convert", "noise.nrrd", "out.nii.gz"])
            .current_dir(dir.path())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // The file in the making is there.
        let start = Instant::now();
        while files(dir.path()) == before {
            assert!(start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
            std::thread::sleep(Duration::from_millis(5));
        }
        let sent = Instant::now();
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let out = child.wait_with_output().unwrap();
        assert!(sent.elapsed() < Duration::from_secs(2), "{:?}", sent.elapsed());
        assert_eq!((out.status.code(), String::from_utf8(out.stderr).unwrap().as_str()), (Some(130), "error: stopped\n"));
        assert_eq!(files(dir.path()), before);
    }
}
