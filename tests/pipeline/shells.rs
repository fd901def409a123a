//! Spherical shells about the eye: against a loop over shells in f64, closed forms, the reference, and flat slices.

use super::convergence::{errors, island, order, smooth_transfer};
use super::oracle::{Fragment, Oracle};
use super::{PARALLEL, WIDE, constant, difference, field, oblique, orbit, render, telling};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{
    Algorithm, Blend, Camera, Classification, ClipPlane, Fog, FogDistance, FogMode, Light, LightSource, Lighting, Method, Order, Placement,
    Projection, Slicing,
};
use slicestack::{Scene, Volume};

fn shells(scene: Scene) -> Scene {
    scene.with_algorithm(Algorithm::Shells).unwrap()
}

/// Pieces of a pixel's ray between shells, by the definition alone: all of one length but for those at the box's faces.
fn pieces(oracle: &Oracle<'_>, count: u64, x: u32, y: u32) -> Vec<Fragment> {
    let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
    let view = &oracle.stack.view;
    let corners = oracle.volume.grid().corners();
    let farthest = corners.iter().map(|c| c.distance(view.eye)).fold(0.0, f64::max);
    let step = (farthest - nearest(oracle)) / count as f64;
    let (entry, exit) = oracle.path(x, y);
    let slant = view.ray(x, y).1.length();
    let radius = |k: u64| nearest(oracle) + (k as f64 + 0.5) * step;
    let inside = |&k: &u64| radius(k) >= entry * slant && radius(k) <= exit * slant;
    let mut met: Vec<u64> = (0..count).filter(inside).collect();
    if met.is_empty() && exit > entry {
        let middle = (0.5 * (entry + exit) * slant - nearest(oracle)) / step;
        met.push((middle.max(0.0) as u64).min(count - 1));
    }
    let (first, last) = (met.first().copied(), met.last().copied());
    let piece = |&k: &u64| {
        let from = if Some(k) == first { entry * slant } else { radius(k) - 0.5 * step };
        let to = if Some(k) == last { exit * slant } else { radius(k) + 0.5 * step };
        Fragment { length: to - from, ..oracle.piece((x, y), radius(k) / slant, 0.0) }
    };
    met.iter().map(piece).collect()
}

/// Distance of the eye to the box, or the near plane's, by the faces' own coordinates: for boxes with right angles.
fn nearest(oracle: &Oracle<'_>) -> f64 {
    let (grid, eye) = (oracle.volume.grid(), oracle.stack.view.eye);
    let (low, high) = grid.index_bounds();
    let at = grid.world_to_index().transform_point3(eye);
    let foot = grid.index_to_world().transform_point3(at.clamp(low, high));
    foot.distance(eye).max(oracle.stack.view.near)
}

fn wide(volume: &Volume) -> Vec<Camera> {
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    let wide = Projection::Perspective { fov_y: 120.0 };
    let at = |eye: DVec3, target: DVec3| Placement::LookAt { eye: center + eye * radius, target: center + target * radius, up: DVec3::Z };
    vec![
        Camera::new(at(DVec3::new(1.3, 0.4, 0.3), DVec3::ZERO), wide).unwrap(),
        Camera::new(at(DVec3::new(0.1, 0.2, -0.1), DVec3::new(-1.0, 0.3, 0.2)), wide).unwrap(),
        Camera::new(at(DVec3::new(-0.3, 1.2, 0.9), DVec3::new(0.2, 0.0, 0.1)), WIDE).unwrap().with_near(0.8 * radius).unwrap(),
    ]
}

#[test]
fn pictures_are_those_of_a_loop_over_shells() {
    let dims = [13, 11, 12];
    let grid = slicestack::volume::Grid::with_spacing(dims, [1.0, -0.7, 1.4]).unwrap();
    let volume = field(dims).with_grid(grid).unwrap();
    let fog = |mode, distance| Some(Fog::new(mode, [0.7, 0.8, 0.9]).unwrap().with_distance(distance));
    let hazes = [
        None,
        fog(FogMode::Exp { density: 0.04 }, FogDistance::Radial),
        fog(FogMode::Linear { start: 5.0, end: 30.0 }, FogDistance::Planar),
    ];
    let clip = vec![ClipPlane::new(DVec3::new(0.3, 0.5, 1.0), 3.0).unwrap()];
    for camera in wide(&volume) {
        for (n, haze) in hazes.into_iter().enumerate() {
            for blend in [Blend::Over, Blend::Add, Blend::Mip, Blend::Min, Blend::Average, Blend::Lmip { threshold: 0.5 }] {
                let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(21, 18).unwrap().with_terminate(0.0).unwrap();
                let scene = scene.with_slices(Slicing::Count(17)).unwrap().with_fog(haze).with_blend(blend).unwrap();
                let scene = shells(scene.with_clip_planes(if n == 1 { clip.clone() } else { Vec::new() }).unwrap());
                let oracle = Oracle::new(&volume, &scene);
                let pixels = (0..18 * 21).map(|i| oracle.blended(&pieces(&oracle, 17, i % 21, i / 21)));
                let want: Vec<[f64; 4]> = pixels.collect();
                for order in [Order::FrontToBack, Order::BackToFront] {
                    let (picture, stats) = render(&volume, &scene.clone().with_order(order));
                    let off = difference(&picture, &want);
                    // Tables of colours are off by up to 1/16384, as for slices.
                    assert!(off < 1.5e-4, "{blend:?} {haze:?} {order:?} {camera:?}: {off:.2e}");
                    assert!(stats.fragments > 0 && picture.pixels().iter().any(|p| p[3] > 0.1));
                }
            }
        }
    }
}

#[test]
fn along_parallel_rays_shells_are_slices_to_the_bit() {
    let volume = field([20, 18, 16]);
    let light = Lighting::default().with_lights(vec![Light::new(LightSource::Head, [1.0; 3]).unwrap()]).unwrap();
    let scene = Scene::new(telling(0.0, 1.0)).with_camera(orbit(30.0, 20.0, 1.2, PARALLEL)).with_size(40, 33).unwrap();
    let scene = scene.with_slices(Slicing::Count(30)).unwrap();
    let fog = Fog::new(FogMode::Exp2 { density: 0.02 }, [0.7; 3]).unwrap().with_distance(FogDistance::Radial);
    for scene in [scene.clone(), scene.clone().with_lighting(Some(light)).unwrap(), scene.with_fog(Some(fog))] {
        let (flat, _) = render(&volume, &scene);
        assert_eq!(render(&volume, &shells(scene)).0.sha256(), flat.sha256());
    }
}

#[test]
fn a_constant_volume_is_exact_at_any_number_of_shells() {
    let opacity = 0.07;
    let kappa = -f64::ln_1p(-opacity) / 2.0;
    for grid in [oblique([9, 8, 7]), slicestack::volume::Grid::with_spacing([8, 9, 10], [1.0, 0.6, 1.2]).unwrap()] {
        let volume = field([9, 8, 7]).with_grid(grid.clone()).or_else(|_| field([8, 9, 10]).with_grid(grid)).unwrap();
        for camera in wide(&volume) {
            for count in [1, 2, 7, 40] {
                let scene = Scene::new(constant([0.9, 0.5, 0.2], opacity)).with_opacity_unit(2.0).unwrap().with_terminate(0.0).unwrap();
                let scene = shells(scene.with_camera(camera).with_size(24, 20).unwrap().with_slices(Slicing::Count(count)).unwrap());
                let oracle = Oracle::new(&volume, &scene);
                let (picture, _) = render(&volume, &scene);
                for (i, pixel) in picture.pixels().iter().enumerate() {
                    let (x, y) = ((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5);
                    let (entry, exit) = oracle.path(x, y);
                    let chord = (exit - entry).max(0.0) * oracle.stack.view.ray(x, y).1.length();
                    let want = -f64::exp_m1(-kappa * chord);
                    assert!((f64::from(pixel[3]) - want).abs() < 2e-6, "pixel {i} in {count}: {} not {want}", pixel[3]);
                }
            }
        }
    }
}

#[test]
fn errors_fall_with_the_square_of_the_number_of_shells() {
    let volume = island();
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    let eye = Placement::LookAt { eye: center + DVec3::new(1.4, -0.5, 0.6) * radius, target: center, up: DVec3::Z };
    let camera = Camera::new(eye, Projection::Perspective { fov_y: 100.0 }).unwrap();
    let scene = Scene::new(smooth_transfer(0.0)).with_opacity_unit(4.0).unwrap().with_camera(camera);
    let scene = shells(scene.with_terminate(0.0).unwrap().with_size(24, 20).unwrap());
    let counts = [24, 34, 48, 68, 96];
    let errors = errors(&volume, &scene, &counts);
    let order = order(&counts, &errors);
    println!("shells: order {order:.3}, errors {errors:?}");
    assert!((order - 2.0).abs() < 0.2 && errors[4] < 2e-4, "order {order}, errors {errors:?}");
}

/// At the edge of a wide picture flat slices lie far apart along the rays: 1 / cos of 67 degrees, in the corners, is 2.6.
#[test]
fn at_the_edge_of_a_wide_picture_shells_are_better_than_slices() {
    let volume = island();
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    let eye = Placement::LookAt { eye: center - DVec3::X * 0.15 * radius, target: center + DVec3::X * radius, up: DVec3::Z };
    let camera = Camera::new(eye, Projection::Perspective { fov_y: 120.0 }).unwrap();
    let scene = Scene::new(smooth_transfer(0.0)).with_opacity_unit(4.0).unwrap().with_camera(camera).with_terminate(0.0).unwrap();
    let scene = scene.with_size(48, 48).unwrap();
    let want = image(&scene, &volume, Region::whole(&scene)).unwrap();
    // Both with the same distance from sample to sample in the middle of the picture.
    let error = |scene: Scene| {
        let (picture, stats) = render(&volume, &scene);
        let square = |i: usize| (0..4).map(|c| (f64::from(picture.pixels()[i][c]) - want.pixels()[i][c]).powi(2)).sum::<f64>();
        let is_edge = |i: &usize| (i % 48).min(47 - i % 48).min(i / 48).min(47 - i / 48) < 6;
        let rms = |all: Vec<usize>| (all.iter().map(|&i| square(i)).sum::<f64>() / (4 * all.len()) as f64).sqrt();
        (stats.slices, rms((0..48 * 48).filter(is_edge).collect()), rms((0..48 * 48).filter(|i| !is_edge(i)).collect()))
    };
    let count = |n| scene.clone().with_slices(Slicing::Count(n)).unwrap();
    let (flat, round) = (error(count(48)), error(shells(count(48))));
    println!("48 slices: edge {:.2e}, inside {:.2e}; 48 shells: edge {:.2e}, inside {:.2e}", flat.1, flat.2, round.1, round.2);
    assert!(round.1 < 0.8 * flat.1, "at the edge {:.2e}, flat slices {:.2e}", round.1, flat.1);
    // A spacing means the same in both: so far apart at most.
    let spaced = |scene: Scene| render(&volume, &scene.with_slices(Slicing::Spacing(1.0)).unwrap()).1.slices;
    assert!(spaced(shells(count(1))) > spaced(count(1)), "shells reach to the farthest corner");
}

#[test]
fn a_tolerance_is_kept_in_shells() {
    let volume = field([40, 36, 32]);
    for camera in &wide(&volume)[..2] {
        let scene = Scene::new(telling(0.0, 1.0)).with_camera(*camera).with_size(64, 48).unwrap();
        let scene = shells(scene.with_slices(Slicing::Tolerance(0.004)).unwrap());
        let want = image(&scene, &volume, Region::every(&scene, 2)).unwrap();
        let (picture, stats) = render(&volume, &scene);
        let mut sum = 0.0;
        for (n, truth) in want.pixels().iter().enumerate() {
            let (x, y) = want.place(n);
            sum += (0..3).map(|c| (f64::from(picture.pixel(x, y)[c]) - truth[c]).powi(2)).sum::<f64>();
        }
        let rms = (sum / (3 * want.pixels().len()) as f64).sqrt();
        assert!(rms <= 0.004 && stats.error_estimate.unwrap() <= 0.004, "{rms:.2e} in {} shells", stats.slices);
        assert!(!stats.method.is_pre_integrated() && !stats.method.merge);
    }
}

#[test]
fn what_shells_do_not_have_is_refused() {
    let scene = || Scene::new(telling(0.0, 1.0));
    let said = |scene: slicestack::Result<Scene>| scene.unwrap_err().to_string();
    let pairs = Method::default().with_classification(Classification::PreIntegrated);
    assert!(said(shells(scene()).with_method(pairs)).contains("render algorithm shells: slabs between two slices"));
    assert!(said(shells(scene()).with_method(Method::default().with_merge(true))).contains("render algorithm shells: slabs merge"));
    assert!(said(shells(scene()).with_blend(Blend::Iso { level: 0.5 })).contains("render algorithm shells: level surfaces"));
}
