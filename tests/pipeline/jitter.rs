//! Stacks shifted pixel by pixel: rings become noise, and nothing else changes.

use super::convergence::spread;
use super::{PARALLEL, WIDE, constant, difference, field, oblique, orbit, render, telling};
use glam::DVec3;
use slicestack::proxy::Stack;
use slicestack::reference::{Region, image};
use slicestack::scene::{Algorithm, Blend, Camera, Classification, Ends, Method, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::{BoxConvention, Grid};
use slicestack::{Picture, Scene, Volume};

fn jittered(scene: Scene, seed: u32) -> Scene {
    scene.with_jitter(Some(seed)).unwrap()
}

/// Values that rise across the picture and along the rays, through thin layers of opacity: few slices draw wood grain.
fn ramp() -> (Volume, Scene) {
    let grid = Grid::with_spacing([24, 24, 24], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = spread(grid.clone(), &|[x, _, z]| 0.2 * x + 0.8 * z);
    let mut opacity = Vec::new();
    for n in 0..16 {
        let at = 256.0 * f64::from(n);
        opacity.extend([(at, 0.0), (at + 96.0, 0.0), (at + 128.0, 0.3), (at + 160.0, 0.0)]);
    }
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], opacity).unwrap();
    let eye = Placement::LookAt { eye: grid.center() + DVec3::Z * 60.0, target: grid.center(), up: DVec3::Y };
    let camera = Camera::new(eye, Projection::Orthographic { height: Some(22.0) }).unwrap();
    let scene = Scene::new(transfer).with_camera(camera).with_size(64, 64).unwrap().with_terminate(0.0).unwrap();
    (volume, scene.with_slices(Slicing::Count(24)).unwrap())
}

/// Errors of opacity, pixel by pixel.
fn off(picture: &Picture, want: &[[f64; 4]]) -> Vec<f64> {
    picture.pixels().iter().zip(want).map(|(p, w)| f64::from(p[3]) - w[3]).collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// How far the errors of a pixel and of the one above it go together, -1 to 1.
fn grain(errors: &[f64]) -> f64 {
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let e: Vec<f64> = errors.iter().map(|e| e - mean).collect();
    let products = |step: usize| (0..e.len() - step).map(|i| e[i] * e[i + step]).sum::<f64>() / (e.len() - step) as f64;
    products(64) / products(0)
}

#[test]
fn rings_become_noise_and_the_mean_over_seeds_is_better_than_any_picture() {
    let (volume, scene) = ramp();
    let want = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let plain = off(&render(&volume, &scene).0, want.pixels());
    let (mut sum, mut rough) = (vec![0.0; 64 * 64], 0.0);
    const SEEDS: u32 = 64;
    for seed in 0..SEEDS {
        let errors = off(&render(&volume, &jittered(scene.clone(), seed)).0, want.pixels());
        rough = f64::max(rough, grain(&errors).abs());
        sum.iter_mut().zip(&errors).for_each(|(s, e)| *s += e / f64::from(SEEDS));
    }
    println!("plain {:.2e}, mean of {SEEDS} seeds {:.2e}; grain {:.3}, jittered at most {rough:.3}", rms(&plain), rms(&sum), grain(&plain));
    assert!(rms(&sum) < 0.35 * rms(&plain), "{:.2e}, one picture {:.2e}", rms(&sum), rms(&plain));
    // Errors of whole columns are the same without jitter; with it those of neighbours have nothing in common.
    assert!(grain(&plain) > 0.95 && rough < 0.15, "grain {} and {rough}", grain(&plain));
}

#[test]
fn a_constant_volume_does_not_change() {
    let volume = field([9, 8, 7]);
    let base = Scene::new(constant([0.9, 0.5, 0.2], 0.08)).with_terminate(0.0).unwrap().with_size(31, 26).unwrap();
    for camera in [orbit(30.0, 20.0, 1.2, PARALLEL), orbit(0.0, 0.0, 1.0, PARALLEL), orbit(200.0, -40.0, 1.1, WIDE)] {
        for count in [1, 2, 9, 40] {
            let scene = base.clone().with_camera(camera).with_slices(Slicing::Count(count)).unwrap();
            let (plain, _) = render(&volume, &scene);
            let want: Vec<[f64; 4]> = plain.pixels().iter().map(|p| p.map(f64::from)).collect();
            for seed in [0, 7, u32::MAX] {
                let off = difference(&render(&volume, &jittered(scene.clone(), seed)).0, &want);
                assert!(off < 3e-6, "{count} slices, seed {seed}, {camera:?}: {off:.2e}");
            }
        }
    }
}

/// Every pixel's pieces add up to its way through the box: mean values of a ramp along the ray are those of the pieces' own middle.
#[test]
fn pieces_add_up_and_samples_lie_where_they_are_said_to() {
    // Opaque where the depth passes a level: the picture tells the shift of each pixel.
    let grid = Grid::with_spacing([8, 8, 8], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = spread(grid.clone(), &|[_, _, z]| -z);
    let eye = Placement::LookAt { eye: grid.center() + DVec3::Z * 20.0, target: grid.center(), up: DVec3::Y };
    let camera = Camera::new(eye, Projection::Orthographic { height: Some(6.5) }).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.0; 3]), (4096.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let scene = Scene::new(transfer).with_camera(camera).with_size(32, 32).unwrap().with_slices(Slicing::Count(4)).unwrap();
    let shifts = |seed: u32| -> Vec<f64> {
        let (picture, _) = render(&volume, &jittered(scene.clone(), seed));
        // The first sample is opaque: its value is (1/2 + j) / 4 of all.
        picture.pixels().iter().map(|p| f64::from(p[0]) * 4.0 - 0.5).collect()
    };
    let (one, two) = (shifts(1), shifts(2));
    assert!(one.iter().chain(&two).all(|j| (-0.5001..0.5001).contains(j)));
    let (mean, square) = (one.iter().sum::<f64>() / 1024.0, one.iter().map(|j| j * j).sum::<f64>() / 1024.0);
    assert!(mean.abs() < 0.04 && (square - 1.0 / 12.0).abs() < 0.01, "mean {mean}, mean square {square}");
    let same = one.iter().zip(&two).filter(|(a, b)| (*a - *b).abs() < 0.02).count();
    assert!(same < 100, "{same} pixels of 1024 have the shift of another seed");
    let stack = Stack::new(&grid, &camera.resolve(&grid, 32, 32).unwrap(), &[], 4);
    assert_eq!(stack.count, 4);
}

#[test]
fn jitter_goes_with_other_ways_to_draw_and_tells_what_it_does_not() {
    let volume = field([20, 18, 16]).with_grid(oblique([20, 18, 16])).unwrap();
    let scene = || Scene::new(telling(0.0, 1.0)).with_camera(orbit(40.0, 25.0, 1.2, WIDE)).with_size(40, 36).unwrap();
    let want = |scene: &Scene| -> Vec<[f64; 4]> { render(&volume, scene).0.pixels().iter().map(|p| p.map(f64::from)).collect() };
    let many = |s: Scene| s.with_slices(Slicing::Count(600)).unwrap();
    for scene in [
        scene(),
        scene().with_blend(Blend::Mip).unwrap(),
        scene().with_blend(Blend::Add).unwrap(),
        scene().with_algorithm(Algorithm::Shells).unwrap(),
        scene().with_method(Method::default().with_ends(Ends::Whole)).unwrap(),
    ] {
        let scene = many(scene);
        let off = difference(&render(&volume, &jittered(scene.clone(), 3)).0, &want(&scene));
        assert!(off > 0.0 && off < 0.02, "{:?} {:?}: {off:.2e}", scene.blend(), scene.algorithm());
    }
    let tolerant = jittered(scene().with_slices(Slicing::Tolerance(0.004)).unwrap(), 3);
    let (_, stats) = render(&volume, &tolerant);
    assert!(stats.error_estimate.unwrap() <= 0.004);
    let said = |scene: slicestack::Result<Scene>| scene.unwrap_err().to_string();
    let pairs = Method::default().with_classification(Classification::SecondOrder);
    assert!(said(jittered(scene(), 1).with_method(pairs)).contains("slices jitter: slabs between two slices"));
    assert!(said(jittered(scene(), 1).with_method(Method::default().with_extrapolate(true))).contains("noise of jitter"));
    assert!(said(jittered(scene(), 1).with_algorithm(Algorithm::Rays)).contains("render algorithm rays: it has no slices to shift"));
    assert!(said(jittered(scene(), 1).with_blend(Blend::Iso { level: 0.5 })).contains("slices jitter: level surfaces"));
}
