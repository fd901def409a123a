//! What is large: a volume that is mapped costs no copy, a hundred thousand slices are as good as a few.
//! Memory is measured of the whole process, so the tests take turns.

#![cfg(all(feature = "formats", feature = "encoders", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

// The example's own file: what is tested is what the reader runs.
#[path = "../examples/large_volume.rs"]
#[allow(dead_code, reason = "an example's main is not called here")]
mod large_volume;

use slicestack::scene::{Camera, Placement, Preset, Projection, Scene, Slicing, TransferFunction};
use slicestack::volume::{Grid, VoxelType, Voxels};
use slicestack::{Limits, Renderer, Settings, Volume};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

static TURN: Mutex<()> = Mutex::new(());

/// A line of this process's memory, in bytes: `VmHWM` is the peak, `RssAnon` what it has for itself now, `RssFile` what of files.
fn memory(line: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with(line)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

fn body(path: &Path, limits: &Limits) -> Volume {
    slicestack::volume::io::read(path, limits).unwrap().with_rescale(1.0, -1024.0).unwrap()
}

fn scene(volume: &Volume, azimuth: f64) -> Scene {
    let transfer = Preset::CtSkinBone.transfer(volume).unwrap().with_unit(10.0).unwrap();
    let placement = Placement::Orbit { azimuth, elevation: 10.0, roll: 0.0, zoom: 1.0 };
    let camera = Camera::new(placement, Projection::Orthographic { height: None }).unwrap();
    Scene::new(transfer).with_size(256, 256).unwrap().with_slices(Slicing::Count(256)).unwrap().with_camera(camera)
}

#[test]
fn a_mapped_volume_is_not_copied() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("body.nrrd");
    // Just too large for a packed copy.
    large_volume::write(&path, [256, 256, 520], VoxelType::U16).unwrap();
    let bytes = 256 * 256 * 520 * 2;

    let own = memory("RssAnon:");
    let volume = body(&path, &Limits::default());
    assert!(volume.voxels().is_mapped(), "68 MB are worth mapping");
    assert!(memory("RssAnon:") < own + (1 << 20), "opening takes next to nothing");
    let mut renderer = Renderer::new(&volume, Settings::default());
    let (first, _) = renderer.render(&scene(&volume, 30.0)).unwrap();
    let (_, stats) = renderer.render(&scene(&volume, 90.0)).unwrap();
    assert_eq!(stats.prepare_seconds.round(), 0.0);
    let grown = memory("RssAnon:") - own;
    // Bricks and their sums: 9.4 % of u16. The rest is pictures, stacks and what the allocator keeps.
    assert!(grown < bytes / 8 + (16 << 20), "{grown} bytes beside {bytes} of the file");
    assert!(memory("RssFile:") > bytes / 2, "the voxels are the file's");
    drop(renderer);

    let read = body(&path, &Limits::new().map_bytes(u64::MAX));
    assert!(!read.voxels().is_mapped());
    let (again, _) = Renderer::new(&read, Settings::default()).render(&scene(&read, 30.0)).unwrap();
    assert!(first == again, "the picture does not depend on how the file came in");
    let seen = first.pixels().iter().filter(|p| p[3] > 0.2).count();
    assert!(seen > 2000, "the body shows: {seen} pixels");
}

#[test]
fn two_hundred_thousand_slices() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let (side, slices) = (16u64, 200_000);
    let volume = Volume::new(Grid::with_spacing([8; 3], [1.0; 3]).unwrap(), Voxels::U8(vec![100; 512].into())).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.25, 0.5, 1.0])], vec![(0.0, 0.1)]).unwrap();
    let camera = Camera::new(
        Placement::Orbit { azimuth: 0.0, elevation: 0.0, roll: 0.0, zoom: 1.0 },
        Projection::Orthographic { height: Some(7.9) },
    );
    let scene = Scene::new(transfer).with_size(16, 16).unwrap().with_slices(Slicing::Count(slices)).unwrap().with_camera(camera.unwrap());
    let before = memory("VmHWM:");
    let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
    assert_eq!((stats.slices, stats.fragments), (slices, slices * side * side));
    // Opacity 0.1 a unit, 8 units deep.
    let want = 1.0 - 0.9f64.powi(8);
    for p in picture.pixels() {
        assert!((f64::from(p[3]) - want).abs() < 1e-6 && (f64::from(p[1]) - 0.5 * want).abs() < 1e-6, "{p:?}, opacity {want}");
    }
    assert!(memory("VmHWM:") < before + (16 << 20), "slices are not kept");
}

#[test]
fn memory_of_a_large_picture_is_its_pixels() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let volume = Volume::new(Grid::with_spacing([8; 3], [1.0; 3]).unwrap(), Voxels::U8(vec![100; 512].into())).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.25, 0.5, 1.0])], vec![(0.0, 0.1)]).unwrap();
    let scene = |side| Scene::new(transfer.clone()).with_size(side, side).unwrap().with_slices(Slicing::Count(8)).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    renderer.render(&scene(64)).unwrap();
    let own = memory("VmRSS:");
    let (picture, _) = renderer.render(&scene(4096)).unwrap();
    let pixels = picture.pixels().len() as u64 * 16;
    assert_eq!(pixels, 268_435_456);
    let grown = memory("VmHWM:") - own;
    assert!(grown >= pixels && grown < pixels + pixels / 8, "{grown} bytes for {pixels} bytes of pixels");
}

/// `cargo test --release --test scale -- --ignored`: takes a gigabyte of disk and memory.
#[test]
#[ignore = "takes a gigabyte of disk, and is about time"]
fn the_visible_human_s_size() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("body.nrrd");
    large_volume::write(&path, [512, 512, 1871], VoxelType::U16).unwrap();
    let file = std::fs::metadata(&path).unwrap().len();
    let (start, own) = (Instant::now(), memory("RssAnon:"));
    let volume = body(&path, &Limits::default());
    let mut renderer = Renderer::new(&volume, Settings::default());
    renderer.render(&scene(&volume, 30.0).with_size(512, 512).unwrap().with_slices(Slicing::Count(512)).unwrap()).unwrap();
    let first = start.elapsed().as_secs_f64();
    let again = Instant::now();
    renderer.render(&scene(&volume, 90.0).with_size(512, 512).unwrap().with_slices(Slicing::Count(512)).unwrap()).unwrap();
    let second = again.elapsed().as_secs_f64();
    let most = memory("VmHWM:") - own;
    assert!(first < 6.0 && second < 1.0, "first picture after {first:.2} s, the next took {second:.2} s");
    assert!(most * 10 < file * 13, "{most} bytes in memory for a file of {file}");
}
