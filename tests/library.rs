//! A scene made in a few lines of Rust is the scene that the command makes of the same volume: the pictures are equal to the bit.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::picture::Depth;
use slicestack::scene::{Preset, Slicing};
use slicestack::volume::VoxelType;
use slicestack::volume::io::{RawSpec, read_raw};
use slicestack::volume::phantom::Phantom;
use slicestack::{Limits, Scene, Volume, render};
use std::fs;
use std::path::Path;
use std::process::Command;

const DIMS: [usize; 3] = [12, 10, 8];
/// Not 1, so that no length of opacities is right by chance.
const SPACING: [f64; 3] = [1.5, 2.0, 2.5];

/// The picture that the command makes, as the bytes of a NumPy file.
fn command(dir: &Path, args: &[&str]) -> Vec<u8> {
    let fixed = ["render", "-o", "command.npy", "--size", "40x32"];
    let out = Command::new(env!("CARGO_BIN_EXE_slicestack")).args(fixed).args(args).current_dir(dir).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    fs::read(dir.join("command.npy")).unwrap()
}

/// The picture that the library makes of a transfer function in what the command begins with: what shows fills the picture, in slices to a tolerance. As
/// the bytes of a NumPy file.
fn library(dir: &Path, volume: &Volume, scene: Scene) -> Vec<u8> {
    let scene = scene.with_size(40, 32).unwrap().with_slices(Slicing::Tolerance(0.004)).unwrap().framed(volume, 1.0);
    let picture = render(volume, &scene).unwrap();
    assert!(picture.pixels().iter().any(|p| p[3] > 0.01), "something is to be seen");
    picture.save(dir.join("library.npy"), Depth::Eight).unwrap();
    fs::read(dir.join("library.npy")).unwrap()
}

#[test]
fn a_preset_gives_the_same_picture() {
    let dir = tempfile::tempdir().unwrap();
    // A ball that grows brighter towards its middle.
    let value = |i: usize| {
        let at = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / DIMS[0] / DIMS[1]];
        let square: f64 = (0..3).map(|a| ((at[a] as f64 + 0.5) / DIMS[a] as f64 - 0.5).powi(2)).sum();
        (255.0 * (1.0 - 4.0 * square).max(0.0)) as u8
    };
    let bytes: Vec<u8> = (0..DIMS.iter().product()).map(value).collect();
    fs::write(dir.path().join("ball.raw"), bytes).unwrap();
    let spec = RawSpec::new(DIMS, VoxelType::U8).with_spacing(SPACING);
    let volume = read_raw(dir.path().join("ball.raw"), &spec, &Limits::new()).unwrap();
    let file = ["ball.raw", "--volume.dimensions", "12,10,8", "--volume.type", "u8", "--volume.spacing", "1.5,2,2.5"];

    let lit = |preset: Preset, transfer| Scene::new(transfer).with_lighting(preset.lighting(&volume)).unwrap();
    let suggested = Preset::suggest(&volume)[0];
    let best = lit(suggested, suggested.transfer(&volume).unwrap());
    assert!(library(dir.path(), &volume, best) == command(dir.path(), &file), "without a preset");
    // Opacities per hundredth of the box's diagonal, and per smallest voxel spacing.
    for preset in [Preset::XRay, Preset::MrBrain] {
        let transfer = preset.transfer(&volume).unwrap();
        assert_eq!(transfer.unit().is_some(), preset == Preset::XRay);
        let ours = library(dir.path(), &volume, lit(preset, transfer.clone()));
        let named = [&file[..], &["--preset", preset.name()]].concat();
        assert!(ours == command(dir.path(), &named), "{}", preset.name());
        // A length that is given wins on both sides, and is seen.
        let other = library(dir.path(), &volume, lit(preset, transfer.with_unit(7.0).unwrap()));
        assert!(other != ours, "{}: no other picture", preset.name());
        let given = [&named[..], &["--transfer.opacity_unit", "7"]].concat();
        assert!(other == command(dir.path(), &given), "{}: opacities per 7 units", preset.name());
    }
}

#[test]
fn a_phantom_gives_the_same_picture() {
    let dir = tempfile::tempdir().unwrap();
    for phantom in Phantom::ALL {
        let volume = phantom.volume(20).unwrap();
        let ours = library(dir.path(), &volume, Scene::new(phantom.default_transfer(20)));
        let theirs = command(dir.path(), &["--volume.phantom", phantom.name(), "--volume.size", "20"]);
        assert!(ours == theirs, "{}", phantom.name());
    }
}
