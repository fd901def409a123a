//! Error asked for is error delivered: against the f64 reference, and with the same bytes however it runs.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::reference::{Region, image, metrics};
use slicestack::scene::{Accumulation, Blend, Method, Slicing, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::{Level, Renderer, Scene, Settings};

const SIZE: usize = 48;

fn scene(phantom: Phantom, tolerance: f64) -> Scene {
    Scene::new(phantom.default_transfer(SIZE)).with_size(72, 60).and_then(|s| s.with_slices(Slicing::Tolerance(tolerance))).unwrap()
}

#[test]
fn the_true_error_is_what_was_asked_for() {
    let (mut all, mut paid_too_much) = (0, Vec::new());
    for phantom in Phantom::ALL {
        let volume = phantom.volume(SIZE).unwrap();
        let truth = image(&scene(phantom, 1.0), &volume, Region::whole(&scene(phantom, 1.0))).unwrap();
        let truth = metrics::Displayed::over_black(72, truth.pixels()).unwrap();
        for tolerance in [5e-3, 1e-3, 2e-4] {
            let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene(phantom, tolerance)).unwrap();
            let ours = metrics::Displayed::over_black(72, picture.pixels()).unwrap();
            let rms = metrics::difference(&ours, &truth).unwrap().rms;
            let (estimate, name) = (stats.error_estimate.unwrap(), phantom.name());
            println!("{name} at {tolerance}: error {rms:.2e}, estimated {estimate:.2e}, {} lookups", stats.fetches);
            assert!(rms <= tolerance, "{name} at {tolerance}: error {rms:.2e}, estimated {estimate:.2e}");
            assert!(estimate <= tolerance, "{name} at {tolerance}: estimated {estimate:.2e}");
            all += 1;
            if rms < 0.1 * tolerance {
                paid_too_much.push((name, tolerance, rms));
            }
        }
    }
    assert!(10 * paid_too_much.len() <= all, "more was paid than asked for: {paid_too_much:?}");
}

#[test]
fn some_blocks_tell_how_many_slices_a_large_picture_takes() {
    for phantom in [Phantom::MarschnerLobb, Phantom::SheppLogan] {
        let volume = phantom.volume(SIZE).unwrap();
        let large = |tolerance| scene(phantom, tolerance).with_size(360, 320).unwrap();
        let truth = image(&large(1.0), &volume, Region::whole(&large(1.0))).unwrap();
        let truth = metrics::Displayed::over_black(360, truth.pixels()).unwrap();
        for tolerance in [5e-3, 1e-3] {
            let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&large(tolerance)).unwrap();
            let ours = metrics::Displayed::over_black(360, picture.pixels()).unwrap();
            let rms = metrics::difference(&ours, &truth).unwrap().rms;
            let told = stats.error_estimate.unwrap();
            println!("{} at {tolerance}: {rms:.2e}, told {told:.2e}, {} frames", phantom.name(), stats.tally.frames);
            assert!(rms <= tolerance && told <= tolerance && rms > 0.2 * tolerance, "at {tolerance}: error {rms:.2e}, told {told:.2e}");
            assert!(stats.tally.frames > 4);
        }
    }
}

#[test]
fn spikes_are_met_by_slabs_of_second_order() {
    let spikes = TransferFunction::new(
        vec![(0.0, [1.0, 0.3, 0.1]), (1.0, [0.2, 0.6, 1.0])],
        vec![(0.3, 0.0), (0.305, 0.9), (0.31, 0.0), (0.6, 0.0), (0.603, 0.5), (0.606, 0.0)],
    )
    .and_then(|t| t.with_unit(SIZE as f64 / 128.0));
    let volume = Phantom::MarschnerLobb.volume(SIZE).unwrap();
    let scene = scene(Phantom::MarschnerLobb, 1e-3).with_transfer(spikes.unwrap()).with_size(48, 40).unwrap();
    let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let truth = metrics::Displayed::over_black(48, truth.pixels()).unwrap();
    let chosen = |method: Method| {
        let scene = scene.clone().with_method(method).unwrap();
        let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
        let ours = metrics::Displayed::over_black(48, picture.pixels()).unwrap();
        let rms = metrics::difference(&ours, &truth).unwrap().rms;
        assert!(rms <= 1e-3 && stats.error_estimate.unwrap() <= 1e-3, "error {rms:.2e}, estimated {:?}", stats.error_estimate);
        (stats.fetches, stats.left_out.iter().any(|l| l.what == "midpoint slabs"))
    };
    let (free, switched) = chosen(Method::default());
    assert!(switched);
    // Asked for by name, midpoint slabs of plain sums stay what they are, and take longer.
    let (bound, kept) = chosen(Method::default().with_accumulation(Accumulation::Plain));
    assert!(!kept && bound > free, "{bound} lookups, {free} with the choice free");
}

#[test]
fn a_tolerance_out_of_reach_ends_and_says_so() {
    let volume = Phantom::Cloud.volume(16).unwrap();
    let scene = scene(Phantom::Cloud, 1e-12).with_size(24, 16).unwrap();
    let (_, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
    assert!(stats.warnings.iter().any(|w| w.starts_with("tolerance 0.000000000001 is out of reach: ")), "{:?}", stats.warnings);
    assert!(stats.error_estimate.unwrap() < 1e-4);
}

#[test]
fn where_the_estimate_is_no_bound_it_is_said() {
    let volume = Phantom::Cloud.volume(16).unwrap();
    let scene = scene(Phantom::Cloud, 0.02);
    let warned = |blend: Blend, side: u32| {
        let scene = scene.clone().with_size(side, side).unwrap().with_blend(blend).unwrap();
        let (_, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
        stats.warnings.iter().any(|w| w.contains("several times the one estimated"))
    };
    assert!(warned(Blend::Iso { level: 0.3 }, 64) && warned(Blend::Lmip { threshold: 0.3 }, 64));
    assert!(!warned(Blend::Over, 64) && !warned(Blend::Mip, 64) && !warned(Blend::Add, 64));
}

#[test]
fn a_tolerance_does_not_depend_on_how_it_runs() {
    let volume = Phantom::DistanceField.volume(SIZE).unwrap();
    // Compared whole, and by blocks that judge.
    for (width, height, tolerance) in [(72, 60, 5e-4), (260, 208, 2e-3)] {
        let scene = scene(Phantom::DistanceField, tolerance).with_size(width, height).unwrap();
        let run = |threads: usize, tile: Option<u32>, level: Level| {
            let settings = Settings::new().threads(threads).level(level);
            let settings = tile.map_or(settings.clone(), |tile| settings.tile(tile));
            let (picture, stats) = Renderer::new(&volume, settings).render(&scene).unwrap();
            (picture.sha256(), stats.slices, stats.error_estimate)
        };
        let want = run(1, Some(64), Level::SCALAR);
        for level in Level::available() {
            for (threads, tile) in [(1, Some(8)), (2, Some(13)), (3, Some(16)), (8, Some(1)), (2, None)] {
                assert_eq!(run(threads, tile, level), want, "{width} x {height}, {threads} threads, tiles of {tile:?}, {}", level.name());
            }
        }
        // Nor on what was rendered before.
        let mut renderer = Renderer::new(&volume, Settings::default());
        renderer.render(&scene.clone().with_slices(Slicing::Tolerance(0.02)).unwrap()).unwrap();
        let (picture, stats) = renderer.render(&scene).unwrap();
        assert_eq!((picture.sha256(), stats.slices, stats.error_estimate), want);
    }
}
