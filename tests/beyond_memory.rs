//! Volumes larger than memory: levels of detail written and read again, pictures within a limit.

#![cfg(feature = "zarr")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

use slicestack::paged::PagedRenderer;
use slicestack::scene::{Camera, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::io::{self, Choice, Reading, Writing};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, LengthUnit, Levels, VoxelType, edit};
use slicestack::{Error, Limits, Picture, Progress, Renderer, Scene, Settings, Volume};
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

/// A volume whose voxels differ, of a type.
fn noise(kind: VoxelType, dims: [usize; 3], spacing: [f64; 3]) -> Volume {
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f32 % 100.0
    };
    let values: Vec<f32> = (0..dims.iter().product()).map(|_| next()).collect();
    let volume = Volume::new(Grid::with_spacing(dims, spacing).unwrap(), values.into()).unwrap();
    edit::convert_type(&volume, kind, None, &Limits::default(), None).unwrap().volume
}

fn level(path: &Path, n: usize) -> Volume {
    io::read_as(path, &Reading::new().choice(Choice::new().level(n))).unwrap()
}

fn voxels(volume: &Volume) -> Vec<f64> {
    (0..volume.voxels().len()).map(|i| volume.voxels().get(i)).collect()
}

/// The mean of the voxels of `fine` in the place of voxel (x,y,z) that is `factor` times as large, as the type holds it.
fn mean(fine: &Volume, [x, y, z]: [usize; 3], factor: [usize; 3]) -> f64 {
    let dims = fine.grid().dims();
    let range = |n: usize, axis: usize| n * factor[axis]..((n + 1) * factor[axis]).min(dims[axis]);
    let mut all = Vec::new();
    for k in range(z, 2) {
        for j in range(y, 1) {
            all.extend(range(x, 0).map(|i| fine.value([i, j, k])));
        }
    }
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    if fine.voxels().voxel_type().is_float() { mean } else { mean.round_ties_even() }
}

#[test]
fn pyramids_hold_the_voxels_and_their_means() {
    for (kind, dims, spacing) in [
        (VoxelType::U8, [150, 70, 131], [1.0; 3]),
        (VoxelType::I16, [65, 64, 200], [1.0; 3]),
        (VoxelType::F32, [130, 129, 40], [0.5, 0.5, 1.5]),
        (VoxelType::F64, [3, 140, 1], [1.0; 3]),
    ] {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("v.ome.zarr");
        let volume = noise(kind, dims, spacing).with_unit(LengthUnit::Micrometre);
        let written = io::write_pyramid(&volume, &path, &Writing::new()).unwrap();
        assert!(written.notes.is_empty(), "{:?}", written.notes);
        let mut fine = level(&path, 0);
        assert_eq!(fine.voxels(), volume.voxels(), "{kind}");
        assert_eq!(fine.grid(), volume.grid());
        assert_eq!(fine.unit(), volume.unit());
        let mut n = 1;
        while let Ok(coarse) = io::read_as(&path, &Reading::new().choice(Choice::new().level(n))) {
            let (from, to) = (fine.grid().dims(), coarse.grid().dims());
            let factor = [0, 1, 2].map(|axis| if from[axis] > to[axis] { 2 } else { 1 });
            for at in [[0; 3], to.map(|n| n - 1), to.map(|n| n / 2), [to[0] - 1, 0, to[2] / 3]] {
                let (is, want) = (coarse.value(at), mean(&fine, at, factor));
                assert!((is - want).abs() <= 1e-5 * want.abs(), "{kind} level {n} voxel {at:?}: {is}, {want}");
            }
            // Its voxels lie in the middle of those that they stand for.
            let corner = |v: &Volume| v.grid().index_to_world().transform_point3(glam::DVec3::splat(-0.5));
            assert!(corner(&coarse).abs_diff_eq(corner(&fine), 1e-9), "{kind} level {n}");
            (fine, n) = (coarse, n + 1);
        }
        assert!(fine.grid().dims().iter().all(|&n| n <= 64) && n > 1, "{kind}: {n} levels");
        // The chunks tell what is in them without being read.
        let levels = io::read_levels(&path, &Reading::new()).unwrap();
        assert_eq!(levels.levels().len(), n);
        assert_eq!(levels.part(1, [1, 0, 0], [1, 1, 1]).unwrap().voxels().get(0), level(&path, 1).value([1, 0, 0]));
    }
}

#[test]
fn chunks_that_are_all_zero_are_not_stored() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("v.ome.zarr");
    let mut values = vec![0u16; 200 * 100 * 100];
    values[150] = 9;
    let volume = Volume::new(Grid::with_spacing([200, 100, 100], [1.0; 3]).unwrap(), values.into()).unwrap();
    io::write_pyramid(&volume, &path, &Writing::new()).unwrap();
    let chunks = walk(&path.join("0"));
    assert_eq!(chunks, 2, "one chunk and the metadata");
    assert_eq!(voxels(&level(&path, 0)), voxels(&volume));
    let levels = || io::read_levels(&path, &Reading::new()).unwrap();
    assert_eq!(levels().part(0, [0; 3], [200, 100, 100]).unwrap().voxels(), volume.voxels());
    // By the ranges that are noted, chunks in which nothing shows are not even asked for.
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(2.0, 0.0), (9.0, 0.9)]).unwrap();
    let camera = Camera::new(Placement::Along { axis: 2, backwards: false }, Projection::Orthographic { height: None }).unwrap();
    let scene = Scene::new(transfer).with_size(200, 100).unwrap().with_camera(camera);
    let (picture, _, pages) = PagedRenderer::new(levels(), Settings::new().threads(2), 128 << 20).render(&scene).unwrap();
    assert!(picture.pixels().iter().any(|p| p[3] > 0.1));
    assert!(pages.empty_pieces > 0 && pages.bricks_read < 16, "{pages:?}");
    assert_eq!(pages.bytes_read, 2 * 64 * 64 * 64, "one chunk is there to be read");
}

/// Files in a folder and below it.
fn walk(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.map(|path| if path.is_dir() { walk(&path) } else { 1 }).sum()
}

fn farthest(a: &Picture, b: &Picture) -> f32 {
    a.pixels().iter().zip(b.pixels()).flat_map(|(a, b)| (0..4).map(move |c| (a[c] - b[c]).abs())).fold(0.0, f32::max)
}

#[test]
fn a_pyramid_is_rendered_as_its_volume() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("v.ome.zarr");
    let size = 150;
    let volume = Phantom::SheppLogan.volume(size).unwrap().with_rescale(2.0, 0.0).unwrap();
    let written = io::write_pyramid(&volume, &path, &Writing::new()).unwrap();
    assert!(written.notes.iter().any(|note| note.contains("slope")), "{:?}", written.notes);
    let levels = || io::read_levels(&path, &Reading::new()).unwrap();
    assert_eq!(levels().rescale(), (2.0, 0.0));
    let transfer = Phantom::SheppLogan.default_transfer(size);
    let doubled = TransferFunction::new(
        transfer.color().iter().map(|&(v, c)| (2.0 * v, c)).collect(),
        transfer.opacity().iter().map(|&(v, a)| (2.0 * v, a)).collect(),
    );
    let scene = Scene::new(doubled.unwrap()).with_camera(Camera::orbit(30.0, 25.0).unwrap());
    // Pixels smaller than voxels: the finest level.
    let close = scene.clone().with_size(300, 260).unwrap();
    let (plain, _) = Renderer::new(&volume, Settings::default()).render(&close).unwrap();
    let (picture, _, pages) = PagedRenderer::new(levels(), Settings::new().threads(2), 128 << 20).render(&close).unwrap();
    assert!(farthest(&plain, &picture) < 2e-6, "{:e}", farthest(&plain, &picture));
    assert_eq!(pages.pieces.len(), 1);
    // And larger ones: a coarser level, within a tolerance, the same bytes for every limit.
    let far = scene.with_size(64, 60).unwrap().with_slices(Slicing::Tolerance(0.004)).unwrap();
    let truth = far.clone().with_slices(Slicing::Count(3000)).unwrap();
    let (truth, _) = Renderer::new(&volume, Settings::default()).render(&truth).unwrap();
    let (picture, stats, pages) = PagedRenderer::new(levels(), Settings::new().threads(2), 128 << 20).render(&far).unwrap();
    let squares = truth.pixels().iter().zip(picture.pixels()).flat_map(|(a, b)| (0..3).map(move |c| f64::from(a[c] - b[c])));
    let rms = (squares.map(|d| d * d).sum::<f64>() / (3 * 64 * 60) as f64).sqrt();
    assert!(rms < 0.004, "{rms:e}, told {:?}", stats.error_estimate);
    assert!(pages.peak_bytes <= pages.limit_bytes, "{pages:?}");
    let (again, ..) = PagedRenderer::new(levels(), Settings::new().threads(1), 64 << 20).render(&far).unwrap();
    assert_eq!(picture.sha256(), again.sha256());
}

/// Stops a task of this name at its first step.
struct Stops(&'static str);

impl Progress for Stops {
    fn step(&self, what: &str, _: u64, _: u64) -> bool {
        what != self.0
    }
}

#[test]
fn what_is_stopped_or_refused_leaves_nothing() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("v.ome.zarr");
    let volume = noise(VoxelType::U8, [80; 3], [1.0; 3]);
    let stopped = io::write_pyramid(&volume, &path, &Writing::new().progress(Arc::new(Stops("writing"))));
    assert!(matches!(stopped, Err(Error::Stopped)));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let labels = volume.clone().with_segments(Vec::new()).unwrap();
    assert!(io::write_pyramid(&labels, &path, &Writing::new()).unwrap_err().to_string().contains("labels"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    io::write_pyramid(&volume, &path, &Writing::new()).unwrap();
    let twice = io::write_pyramid(&volume, &path, &Writing::new()).unwrap_err().to_string();
    assert!(twice.contains("v.ome.zarr: is there already"), "{twice}");
    let settings = Settings::new().threads(2).progress(Arc::new(Stops("rendering")));
    let levels = io::read_levels(&path, &Reading::new()).unwrap();
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(80)).with_size(64, 64).unwrap();
    assert!(matches!(PagedRenderer::new(levels, settings, 128 << 20).render(&scene), Err(Error::Stopped)));
}

#[test]
fn damaged_pyramids_get_one_line() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("v.ome.zarr");
    io::write_pyramid(&noise(VoxelType::U8, [100, 80, 70], [1.0; 3]), &path, &Writing::new()).unwrap();
    let said = |path: &Path| {
        let line = io::read_levels(path, &Reading::new()).and_then(|levels| levels.part(0, [0; 3], [100, 80, 70])).unwrap_err().to_string();
        assert!(!line.contains('\n') && line.len() < 400, "{line}");
        line
    };
    let chunk = path.join("0/1/0/1");
    let whole = std::fs::read(&chunk).unwrap();
    std::fs::write(&chunk, &whole[..1000]).unwrap();
    assert!(said(&path).contains("0/1/0/1"), "{}", said(&path));
    std::fs::write(&chunk, &whole).unwrap();
    let ranges = path.join("slicestack-ranges/0/0/0/0/0");
    std::fs::write(&ranges, [0; 12]).unwrap();
    assert!(said(&path).contains("12 bytes of ranges: 8 chunks take 64"), "{}", said(&path));
}

#[test]
fn levels_of_other_files_are_mapped_whatever_their_size() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("huge.npy");
    // 20 GiB that are not there: a file with a hole.
    let text = "{'descr': '|u1', 'fortran_order': False, 'shape': (2048, 2048, 5120), }";
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend(118u16.to_le_bytes());
    header.extend(format!("{text:<117}\n").bytes());
    std::fs::write(&path, &header).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(128 + 2048 * 2048 * 5120).unwrap();
    let refused = io::read(&path, &Limits::default()).unwrap_err();
    assert!(matches!(refused, Error::Limit { .. }), "{refused}");
    let levels = io::read_levels(&path, &Reading::new().limits(Limits::within(64 << 20))).unwrap();
    assert_eq!(levels.grid().dims(), [5120, 2048, 2048]);
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(80)).with_size(40, 40).unwrap();
    let (picture, _, pages) = PagedRenderer::new(levels, Settings::new().threads(2), 128 << 20).render(&scene).unwrap();
    assert!(picture.pixels().iter().all(|p| *p == picture.pixels()[0]));
    assert!(pages.bytes_read < 1 << 30, "{pages:?}");
    // What is compressed has to fit into the limit.
    let packed = folder.path().join("v.nrrd");
    io::write(&noise(VoxelType::U16, [64; 3], [1.0; 3]), &packed, &Writing::new().compress(true)).unwrap();
    let refused = io::read_levels(&packed, &Reading::new().limits(Limits::within(1 << 16))).unwrap_err();
    assert!(matches!(refused, Error::Limit { .. }), "{refused}");
    assert!(Levels::of_volume(&io::read(&packed, &Limits::default()).unwrap()).is_ok());
}

#[cfg(feature = "cli")]
mod command {
    use super::*;
    use std::process::{Command, Output};

    fn slicestack(folder: &Path, args: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_slicestack")).current_dir(folder).args(args).output().unwrap()
    }

    fn stats(folder: &Path) -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.join("s.json")).unwrap()).unwrap()
    }

    #[test]
    fn the_command_renders_within_a_limit_and_writes_levels() {
        let folder = TempDir::new().unwrap();
        let dir = folder.path();
        let volume = Phantom::SheppLogan.volume(100).unwrap();
        io::write(&volume, dir.join("v.nrrd"), &Writing::new()).unwrap();
        let made = slicestack(dir, &["convert", "v.nrrd", "v.ome.zarr"]);
        assert!(made.status.success(), "{made:?}");
        let render = ["--size", "120x110", "--azimuth", "30", "--stats", "s.json", "-o", "p.png"];
        let mut sums = Vec::new();
        for (input, memory) in [("v.nrrd", "100MiB"), ("v.nrrd", "1GiB"), ("v.ome.zarr", "64MiB"), ("v.ome.zarr", "1GiB")] {
            let done = slicestack(dir, &[&["render", input, "--memory", memory][..], &render].concat());
            assert!(done.status.success(), "{done:?}");
            let told = stats(dir);
            assert!(told["pages"]["bytes_read"].as_u64().unwrap() > 0 && told["error_estimate"].as_f64().unwrap() > 0.0, "{told}");
            assert_eq!(told["volume"]["dimensions"], serde_json::json!([100, 100, 100]));
            sums.push(told["sha256"].clone());
        }
        assert!(sums[0] == sums[1] && sums[2] == sums[3], "{sums:?}");
    }

    #[test]
    fn the_command_refuses_in_one_line_what_needs_the_whole() {
        let folder = TempDir::new().unwrap();
        let dir = folder.path();
        io::write(&Phantom::SheppLogan.volume(20).unwrap(), dir.join("v.nrrd"), &Writing::new()).unwrap();
        for (args, status, word) in [
            (&["turntable", "v.nrrd", "--memory", "1GiB", "-o", "t.gif"][..], 2, "`render` alone"),
            (&["explain", "v.nrrd", "--memory", "1GiB", "-o", "page"], 2, "`render` alone"),
            (&["report", "v.nrrd", "--memory", "1GiB", "-o", "page"], 2, "`render` alone"),
            (&["render", "v.nrrd", "--memory", "1GiB", "--render.blend", "mip"], 2, "blend is over"),
            (&["render", "v.nrrd", "--memory", "1GiB", "--aov", "depth"], 2, "planes"),
            (&["render", "v.nrrd", "--memory", "1GiB", "--annotate.box", "true"], 2, "annotations"),
            (&["render", "v.nrrd", "--memory", "5 apples"], 2, "such as 1GiB"),
            (&["render", "v.nrrd", "--memory", "2MiB"], 1, "bytes of memory"),
            (&["convert", "v.nrrd", "w.ome.zarr", "--compress"], 2, "--compress"),
        ] {
            let refused = slicestack(dir, args);
            let said = String::from_utf8(refused.stderr).unwrap();
            assert_eq!(refused.status.code(), Some(status), "{args:?}: {said}");
            assert!(said.contains(word), "{args:?}: {said}");
            assert_eq!(said.lines().filter(|line| line.starts_with("error")).count(), 1, "{args:?}: {said}");
        }
        let left: Vec<_> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["v.nrrd"]);
    }
}
