//! Threads, tiles and vector levels never change a byte.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scenes;

use slicestack::scene::{Blend, Camera, Placement, Projection, Slicing, Straight};
use slicestack::volume::phantom::Phantom;
use slicestack::{Level, Renderer, Scene, Settings};

#[test]
fn settings_never_change_a_byte() {
    let samples = scenes::samples();
    assert!(samples.len() >= 40);
    for sample in &samples {
        let sha = |threads: usize, tile: u32, level: Level| {
            let settings = Settings::new().threads(threads).tile(tile).level(level);
            let (picture, stats) = Renderer::new(&sample.volume, settings).render(&sample.scene).unwrap();
            // The profile opengl has no vector code.
            let level = if sample.scene.opengl().is_some() { Level::SCALAR } else { level };
            assert_eq!((stats.threads, stats.simd), (threads, level.name()));
            (picture.sha256(), stats.fragments)
        };
        let want = sha(1, 64, Level::SCALAR);
        for level in Level::available() {
            for (threads, tile) in [(1, 16), (2, 8), (3, 64), (8, 13), (2, 1), (3, 1 << 20)] {
                assert_eq!(sha(threads, tile, level), want, "{} at {threads} threads, tiles of {tile}, {}", sample.name, level.name());
            }
        }
    }
}

/// Which pixels no block covers depends on the tiles, where these are no multiple of a block: they come out as those that a block covers in vain.
#[test]
fn a_translucent_background_is_the_same_for_every_tile() {
    let volume = Phantom::Hydrogen.volume(8).unwrap();
    for alpha in [0.1, 0.3, 0.7] {
        let scene = Scene::new(Phantom::Hydrogen.default_transfer(8)).with_size(24, 24).unwrap();
        let scene = scene.with_background(Straight { rgb: [1.0, 0.0, 0.0], alpha }).unwrap();
        let placement = Placement::Orbit { azimuth: 30.0, elevation: 20.0, roll: 0.0, zoom: 0.5 };
        let camera = Camera::new(placement, Projection::Orthographic { height: None }).unwrap();
        for blend in [Blend::Over, Blend::Add, Blend::Mip] {
            let scene = scene.clone().with_camera(camera).with_blend(blend).unwrap();
            // Of 4096 slices sums are compensated.
            for count in [64, 4096] {
                let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap();
                let sha = |tile: u32| Renderer::new(&volume, Settings::new().tile(tile)).render(&scene).unwrap().0.sha256();
                let want = sha(8);
                for tile in [1, 3, 7, 13, 64] {
                    assert_eq!(sha(tile), want, "alpha {alpha}, {blend:?}, {count} slices, tiles of {tile}");
                }
            }
        }
    }
}

#[test]
fn what_a_renderer_keeps_never_changes_a_byte() {
    // One renderer, scene after scene over the same volume, and each scene again: tables and bricks are kept or made anew.
    let samples = scenes::samples();
    for name in ["axis", "colors-u8"] {
        let volume = &samples.iter().find(|s| s.name == name).unwrap().volume;
        let volume = &if name == "axis" { volume.clone().with_labels(&scenes::sectors(volume.grid())).unwrap() } else { volume.clone() };
        let mut kept = Renderer::new(volume, Settings::default());
        let of_it = || samples.iter().filter(|s| s.scene.check_with(volume).is_ok());
        assert!(of_it().count() > 4);
        for sample in of_it().chain(of_it().rev()) {
            let fresh = Renderer::new(volume, Settings::default()).render(&sample.scene).unwrap().0;
            assert_eq!(kept.render(&sample.scene).unwrap().0.sha256(), fresh.sha256(), "{name}: {}", sample.name);
        }
    }
}
