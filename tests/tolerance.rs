//! Error asked for is error delivered: against the f64 reference, and with the same bytes however it runs.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::lanes::Level;
use slicestack::reference::{Region, image, metrics};
use slicestack::scene::Slicing;
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Scene, Settings};

const SIZE: usize = 48;

fn scene(phantom: Phantom, tolerance: f64) -> Scene {
    Scene::new(phantom.default_transfer())
        .with_opacity_unit(Phantom::opacity_unit(SIZE))
        .and_then(|s| s.with_size(72, 60))
        .and_then(|s| s.with_slices(Slicing::Tolerance(tolerance)))
        .unwrap()
}

#[test]
fn the_true_error_stays_below_the_tolerance() {
    for phantom in Phantom::ALL {
        let volume = phantom.volume(SIZE).unwrap();
        let truth = image(&scene(phantom, 1.0), &volume, Region::whole(&scene(phantom, 1.0))).unwrap();
        let truth = metrics::Displayed::over_black(72, truth.pixels()).unwrap();
        let mut lookups = 0;
        for tolerance in [1e-2, 3e-3, 1e-3, 3e-4] {
            let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene(phantom, tolerance)).unwrap();
            let ours = metrics::Displayed::over_black(72, picture.pixels()).unwrap();
            let rms = metrics::difference(&ours, &truth).unwrap().rms;
            let estimate = stats.error_estimate.unwrap();
            assert!(rms <= tolerance, "{} at {tolerance}: error {rms:.2e}, estimated {estimate:.2e}", phantom.name());
            assert!(estimate <= tolerance, "{} at {tolerance}: estimated {estimate:.2e}", phantom.name());
            assert!(stats.fetches >= lookups, "{} at {tolerance}: less work than for a larger tolerance", phantom.name());
            lookups = stats.fetches;
        }
    }
}

#[test]
fn refinement_does_not_depend_on_how_it_runs() {
    let volume = Phantom::DistanceField.volume(SIZE).unwrap();
    let scene = scene(Phantom::DistanceField, 5e-4);
    let run = |threads: usize, tile: u32, level: Level| {
        let settings = Settings { threads: Some(threads), tile: Some(tile), level: Some(level), ..Settings::default() };
        let (picture, stats) = Renderer::new(&volume, settings).render(&scene).unwrap();
        (picture.sha256(), stats.slices, stats.error_estimate)
    };
    let want = run(1, 64, Level::SCALAR);
    for level in Level::available() {
        for (threads, tile) in [(1, 8), (2, 13), (3, 16), (8, 1)] {
            assert_eq!(run(threads, tile, level), want, "{threads} threads, tiles of {tile}, {}", level.name());
        }
    }
}
