//! Threads, tiles and vector levels never change a byte.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scenes;

use slicestack::{Level, Renderer, Settings};

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
