//! Stacks of 2D textures.

use crate::{PARALLEL, constant, drawn, looking, numbers, plain, rms, with};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{Algorithm, Camera, Placement, Projection, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Scene, Volume};

const CORRECTED: Algorithm = Algorithm::ObjectSlices { spacing_correction: true };
const UNCORRECTED: Algorithm = Algorithm::ObjectSlices { spacing_correction: false };

/// A smooth bump in a cube of side 24, sampled at `n` voxels along each axis; nothing near its faces.
fn bump(n: usize) -> Volume {
    let spacing = 24.0 / n as f64;
    let at = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let value = |i: usize| {
        let (x, y, z) = (at(i % n), at(i / n % n), at(i / n / n));
        (1.3 * (-3.0 * (x * x + 1.4 * y * y + 0.8 * z * z) + 0.8 * x * y).exp() * (1.0 + 0.2 * (3.0 * z + x).sin())) as f32
    };
    let grid = Grid::new([n; 3], DVec3::splat(0.5 * spacing), glam::DMat3::from_diagonal(DVec3::splat(spacing))).unwrap();
    Volume::new(grid, Voxels::F32((0..n * n * n).map(value).collect::<Vec<_>>().into())).unwrap()
}

fn fading() -> TransferFunction {
    let color = vec![(0.0, [0.1, 0.3, 1.0]), (1.3, [1.0, 0.4, 0.1])];
    TransferFunction::new(color, vec![(0.15, 0.0), (1.5, 0.25)]).unwrap().with_unit(1.0).unwrap()
}

fn turned(azimuth: f64) -> Scene {
    let placement = Placement::Orbit { azimuth, elevation: 12.0, roll: 0.0, zoom: 1.0 };
    plain(fading(), 48, 256).with_camera(Camera::new(placement, PARALLEL).unwrap())
}

#[test]
fn finer_volumes_lead_to_the_reference() {
    let finest = bump(96);
    for projection in [PARALLEL, Projection::Perspective { fov_y: 45.0 }] {
        let scene = plain(fading(), 40, 1).with_camera(looking(DVec3::new(33.0, 21.0, 9.0), &finest, projection));
        let truth = image(&scene, &finest, Region::whole(&scene)).unwrap();
        let errors = [12, 24, 48].map(|n| rms(&drawn(&bump(n), &with(&scene, CORRECTED)), truth.pixels()));
        let orders = [0, 1].map(|i| (errors[i] / errors[i + 1]).log2());
        println!("{errors:?}: orders {orders:?}");
        assert!(orders.iter().all(|&p| p > 1.6), "{errors:?}: {orders:?}");
        // Without the correction another picture is the limit.
        let wrong = rms(&drawn(&bump(48), &with(&scene, UNCORRECTED)), truth.pixels());
        assert!(wrong > 20.0 * errors[2], "{wrong} for {}", errors[2]);
    }
}

#[test]
fn without_the_correction_a_volume_is_too_thin_by_the_cosine() {
    let n = 33;
    let grid = Grid::with_spacing([n; 3], [1.0; 3]).unwrap();
    let volume = Volume::new(grid, Voxels::U8(vec![1; n * n * n].into())).unwrap();
    let camera = looking(DVec3::new(40.0, 40.0001, 0.0), &volume, PARALLEL);
    let scene = plain(constant(0.02), 1, 1).with_camera(camera);
    let depth = |algorithm| -f64::from(1.0 - drawn(&volume, &with(&scene, algorithm))[0][3]).ln() / -(0.98f64.ln());
    let (right, wrong) = (depth(CORRECTED), depth(UNCORRECTED));
    // Through the middle at 45 degrees: 33 layers, each sqrt(2) along the ray.
    println!("optical depth in voxels: {right:.4} corrected, {wrong:.4} without, the diagonal is {:.4}", 33.0 * 2f64.sqrt());
    assert!((right / (33.0 * 2f64.sqrt()) - 1.0).abs() < 1e-4, "{right}");
    assert!((wrong - 33.0).abs() < 1e-2, "{wrong}");
}

#[test]
fn the_picture_jumps_where_the_stack_changes() {
    let volume = bump(12);
    let jump = |change: &dyn Fn(Scene) -> Scene| {
        let [left, right] = [44.99, 45.01].map(|azimuth| drawn(&volume, &change(turned(azimuth))));
        rms(&left, &right)
    };
    let (layers, slices) = (jump(&|s| with(&s, CORRECTED)), jump(&|s| s));
    println!("from 44.99 to 45.01 degrees: {layers:.1e} with object slices, {slices:.1e} with view-aligned ones");
    assert!(layers > 10.0 * slices, "{layers} for {slices}");
    // Elsewhere it does not.
    let away = rms(&drawn(&volume, &with(&turned(39.99), CORRECTED)), &drawn(&volume, &with(&turned(40.01), CORRECTED)));
    assert!(layers > 5.0 * away, "{layers} for {away}");
}

#[test]
fn layers_are_those_of_voxels() {
    // Along an axis of the volume a ray through voxels meets their own values: what the grid's loops give.
    let volume = numbers([9, 7, 5]);
    let camera = Camera::new(Placement::Along { axis: 2, backwards: false }, PARALLEL).unwrap();
    let scene = plain(crate::telling(), 9, 1).with_size(9, 7).unwrap().with_camera(camera);
    // Pixels are as high as wide, so rows of voxels that are further apart fall between them: look at those that do not.
    let square = volume.with_grid(Grid::with_spacing([9, 7, 5], [1.0; 3]).unwrap()).unwrap();
    let difference = crate::largest(&drawn(&square, &with(&scene, CORRECTED)), &drawn(&square, &with(&scene, Algorithm::Grid)));
    assert!(difference < 2e-6, "{difference}");
}
