//! Orders of blending, clip planes, and what is before or behind the eye.

use super::oracle::{Oracle, slab};
use super::{PARALLEL, WIDE, cameras, difference, field, orbit, render, simple};
use glam::DVec3;
use slicestack::scene::{Camera, ClipPlane, Order, Placement, Slicing, Straight};
use slicestack::{Scene, Volume};

/// The scene with opacities meant for its slabs.
fn per_slab(volume: &Volume, scene: Scene) -> Scene {
    let unit = slab(volume, &scene);
    scene.with_opacity_unit(unit).unwrap()
}

#[test]
fn both_orders_are_the_closed_sum() {
    let volume = field([12, 9, 14]);
    for camera in cameras(volume.grid()) {
        for count in [1, 9, 40] {
            let scene = Scene::new(simple(0.0, 1.0)).with_camera(camera).with_size(21, 18).unwrap().with_terminate(0.0).unwrap();
            let scene = per_slab(&volume, scene.with_slices(Slicing::Count(count)).unwrap());
            let want = Oracle::new(&volume, &scene).picture();
            for order in [Order::FrontToBack, Order::BackToFront] {
                let (picture, _) = render(&volume, &scene.clone().with_order(order));
                let e = difference(&picture, &want);
                assert!(e < 1e-5, "{order:?}, {count} slices, {camera:?}: {e}");
            }
        }
    }
}

#[test]
fn early_termination_costs_no_more_than_its_threshold() {
    let volume = field([16, 16, 16]);
    for threshold in [1.0 / 1024.0, 0.1, 0.9] {
        let scene = Scene::new(simple(0.0, 1.0)).with_size(32, 32).unwrap().with_opacity_unit(0.1).unwrap();
        let (all, _) = render(&volume, &scene.clone().with_terminate(0.0).unwrap());
        let (some, stats) = render(&volume, &scene.with_terminate(threshold).unwrap());
        let worst = all.pixels().iter().zip(some.pixels()).flat_map(|(a, b)| (0..4).map(|c| (a[c] - b[c]).abs())).fold(0.0, f32::max);
        assert!(worst > 0.0 && worst <= threshold, "{worst} at threshold {threshold}");
        assert!(stats.left_out.iter().any(|l| l.what == "finished batches"));
    }
}

#[test]
fn clip_planes_cut_what_they_say() {
    let volume = field([11, 12, 13]);
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    let plane = |n: DVec3, at: f64| ClipPlane::new(n, n.dot(center) + at * radius * n.length()).unwrap();
    let sets = [
        vec![plane(DVec3::X, 0.0)],
        vec![plane(DVec3::new(1.0, -2.0, 0.5), -0.2), plane(DVec3::new(-1.0, 2.1, -0.4), -0.2)],
        vec![
            plane(DVec3::X, -0.3),
            plane(-DVec3::X, -0.3),
            plane(DVec3::Y, -0.2),
            plane(-DVec3::Y, -0.2),
            plane(DVec3::Z, -0.3),
            plane(-DVec3::Z, -0.4),
        ],
        vec![plane(DVec3::Y, 2.0)],
    ];
    for (i, planes) in sets.into_iter().enumerate() {
        for camera in [orbit(20.0, 30.0, 1.2, PARALLEL), orbit(-50.0, 10.0, 1.2, WIDE)] {
            let scene =
                Scene::new(simple(0.0, 1.0)).with_camera(camera).with_size(24, 24).unwrap().with_slices(Slicing::Count(33)).unwrap();
            let scene = per_slab(&volume, scene.with_clip_planes(planes.clone()).unwrap().with_terminate(0.0).unwrap());
            let (picture, stats) = render(&volume, &scene);
            let e = difference(&picture, &Oracle::new(&volume, &scene).picture());
            assert!(e < 1e-5, "set {i}: {e}");
            // The last set leaves nothing.
            assert_eq!(stats.fragments == 0, i == 3);
            assert_eq!(picture.pixels().iter().all(|p| *p == [0.0; 4]), i == 3);
        }
    }
}

#[test]
fn a_box_behind_the_eye_leaves_the_background() {
    let volume = field([5, 5, 5]);
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    for projection in [PARALLEL, WIDE] {
        let place = Placement::LookAt { eye: center + DVec3::X * 2.0 * radius, target: center + DVec3::X * 3.0 * radius, up: DVec3::Z };
        let back = Straight { rgb: [0.5, 0.25, 1.0], alpha: 0.5 };
        let scene = Scene::new(simple(0.0, 1.0)).with_camera(Camera::new(place, projection).unwrap()).with_size(9, 5).unwrap();
        let (picture, stats) = render(&volume, &scene.with_background(back).unwrap());
        assert!(picture.pixels().iter().all(|p| *p == [0.25, 0.125, 0.5, 0.5]));
        assert_eq!((stats.slices, stats.fragments, stats.fetches), (0, 0, 0));
        assert!(stats.warnings.iter().any(|w| w.contains("behind the eye")), "{:?}", stats.warnings);
    }
}

#[test]
fn spacing_counts_slices_by_the_depth_of_the_box() {
    let volume = field([10, 10, 10]);
    let scene = Scene::new(simple(0.0, 1.0)).with_size(8, 8).unwrap();
    let by_spacing = |s: f64| render(&volume, &scene.clone().with_slices(Slicing::Spacing(s)).unwrap());
    let one = scene.clone().with_slices(Slicing::Count(1)).unwrap();
    let depth = slab(&volume, &one);
    for (spacing, count) in [(depth, 1), (depth / 7.0, 7), (depth / 7.0 * 0.999, 8), (depth * 100.0, 1)] {
        let (picture, stats) = by_spacing(spacing);
        assert_eq!(stats.slices, count);
        let (same, _) = render(&volume, &scene.clone().with_slices(Slicing::Count(count)).unwrap());
        assert_eq!(picture.sha256(), same.sha256());
    }
}
