//! Three slabs as one, or nine: fewer lookups for the same error, and the same pictures however they are made.

use super::{PARALLEL, WIDE, constant, fill, oblique, orbit, render};
use slicestack::reference::{Region, image, metrics};
use slicestack::scene::{Blend, Classification, Method, Order, Slicing, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Scene, Settings, Volume};

fn merged() -> Method {
    Method::default().with_merge(true)
}

#[test]
fn nothing_changes_where_everything_is_the_same() {
    let dims = [40, 33, 28];
    let volume = Volume::new(oblique(dims), fill::<u8>(dims, &|_| 100.0)).unwrap();
    for camera in [orbit(30.0, 20.0, 1.3, PARALLEL), orbit(45.0, 60.0, 0.9, WIDE)] {
        let scene =
            Scene::new(constant([1.0, 0.5, 0.2], 0.05)).with_camera(camera).with_size(300, 250).unwrap().with_terminate(0.0).unwrap();
        // Runs of three slices, and of nine. Threes alone would leave half of the lookups.
        for (count, share) in [(60, 0.6), (90, 0.55), (250, 0.42), (900, 0.42)] {
            let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap();
            let (plain, all) = render(&volume, &scene);
            let (merged, some) = render(&volume, &scene.with_method(merged()).unwrap());
            println!("{count} slices: {} of {} lookups", some.fetches, all.fetches);
            assert!((some.fetches as f64) < share * all.fetches as f64, "{count}: {} lookups, {} without", some.fetches, all.fetches);
            assert!(some.tally.merged > 0 && all.tally.merged == 0);
            for (a, b) in plain.pixels().iter().flatten().zip(merged.pixels().iter().flatten()) {
                assert!((a - b).abs() < 2e-5, "{count}: {a} {b}");
            }
        }
    }
}

#[test]
fn the_same_error_takes_fewer_lookups() {
    for phantom in [Phantom::DistanceField, Phantom::MarschnerLobb, Phantom::Cloud] {
        let volume = phantom.volume(64).unwrap();
        let scene = Scene::new(phantom.default_transfer(64));
        let scene = scene.with_size(80, 72).unwrap().with_camera(orbit(25.0, 15.0, 1.2, PARALLEL));
        let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
        let truth = metrics::Displayed::over_black(80, truth.pixels()).unwrap();
        let made = |count: u64, method: Method| {
            let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap().with_method(method).unwrap();
            let (picture, stats) = render(&volume, &scene);
            let ours = metrics::Displayed::over_black(80, picture.pixels()).unwrap();
            (metrics::difference(&ours, &truth).unwrap().rms, stats.fetches)
        };
        let (rms, fetches) = made(150, Method::default());
        let (merged_rms, merged_fetches) = made(150, merged());
        let name = phantom.name();
        println!("{name}: error {rms:.2e} with {fetches} lookups, merged {merged_rms:.2e} with {merged_fetches}");
        // The error falls with the square of the number of slices.
        let worth = merged_fetches as f64 / fetches as f64 * (merged_rms / rms).sqrt();
        assert!(worth < 0.95, "{name}: lookups for the same error {worth:.2}");
    }
}

#[test]
fn what_shows_nothing_is_still_passed_over() {
    let dims = [64, 60, 56];
    let ball = |[x, y, z]: [f64; 3]| if x * x + y * y + z * z < 0.2 { 200.0 } else { 0.0 };
    let volume = Volume::new(oblique(dims), fill::<u8>(dims, &ball)).unwrap();
    // The table begins where something shows, above the values of most bricks.
    let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.8, 0.5])], vec![(100.0, 0.0), (120.0, 0.3), (255.0, 0.4)]).unwrap();
    let scene = Scene::new(transfer).with_camera(orbit(30.0, 20.0, 1.3, PARALLEL)).with_size(96, 80).unwrap();
    let scene = scene.with_slices(Slicing::Count(120)).unwrap();
    let (_, plain) = render(&volume, &scene);
    let (_, merged) = render(&volume, &scene.with_method(merged()).unwrap());
    assert!(merged.fetches <= plain.fetches, "{} lookups, {} without", merged.fetches, plain.fetches);
    assert!(plain.tally.empty > plain.fragments / 2 && 10 * merged.tally.empty > 9 * plain.tally.empty, "{:?}", merged.tally);
}

#[test]
fn how_it_runs_does_not_matter() {
    let volume = Phantom::Cloud.volume(48).unwrap();
    let scene = Scene::new(Phantom::Cloud.default_transfer(48));
    let scene = scene.with_size(91, 77).unwrap().with_camera(orbit(25.0, 15.0, 0.9, WIDE)).with_method(merged()).unwrap();
    let run = |threads: usize, tile: u32| {
        let settings = Settings::new().threads(threads).tile(tile);
        let (picture, stats) = Renderer::new(&volume, settings).render(&scene).unwrap();
        (picture.sha256(), stats.fetches, stats.tally)
    };
    let want = run(1, 64);
    assert!(want.2.merged > 0);
    for (threads, tile) in [(2, 8), (3, 13), (2, 1), (1, 100)] {
        assert_eq!(run(threads, tile), want, "{threads} threads, tiles of {tile}");
    }
}

#[test]
fn what_it_cannot_do_is_refused_or_left_alone() {
    let scene = Scene::new(constant([1.0; 3], 0.1));
    let second = merged().with_classification(Classification::SecondOrder);
    let said = scene.clone().with_method(second).unwrap_err().to_string();
    assert!(said.starts_with("slices merge: "), "{said}");
    let volume = Phantom::Cloud.volume(20).unwrap();
    for scene in [
        scene.clone().with_order(Order::BackToFront),
        scene.clone().with_blend(Blend::Add).unwrap(),
        scene.clone().with_blend(Blend::Mip).unwrap(),
    ] {
        let (plain, _) = render(&volume, &scene);
        let (merged, stats) = render(&volume, &scene.with_method(merged()).unwrap());
        assert_eq!(plain.sha256(), merged.sha256());
        assert_eq!(stats.tally.merged, 0);
    }
}
