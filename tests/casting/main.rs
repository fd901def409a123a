//! The algorithms that go ray by ray: against slices where both are the same, against the reference, and against slow loops in f64.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod coins;
mod grid;
mod layers;
mod rays;
mod refusals;
#[path = "../scenes/mod.rs"]
mod scenes;
mod settings;
mod voxels;

use glam::DVec3;
use slicestack::scene::{Algorithm, Camera, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Renderer, Scene, Settings, Volume};

/// The picture of `scene`, pixel by pixel.
fn drawn(volume: &Volume, scene: &Scene) -> Vec<[f32; 4]> {
    Renderer::new(volume, Settings::new().threads(2)).render(scene).unwrap().0.pixels().to_vec()
}

fn with(scene: &Scene, algorithm: Algorithm) -> Scene {
    scene.clone().with_algorithm(algorithm).unwrap()
}

/// Largest difference of two pictures' components.
fn largest<T: Copy + Into<f64>>(a: &[[f32; 4]], b: &[[T; 4]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(&a, &b)| (f64::from(a) - b.into()).abs()).fold(0.0, f64::max)
}

/// Root mean square of the same.
fn rms<T: Copy + Into<f64>>(a: &[[f32; 4]], b: &[[T; 4]]) -> f64 {
    let squares = a.iter().flatten().zip(b.iter().flatten()).map(|(&a, &b)| (f64::from(a) - b.into()).powi(2)).sum::<f64>();
    (squares / (4 * a.len()) as f64).sqrt()
}

/// Whole numbers from 0 to 64 that have no order to them, and more 0 than others.
fn numbers(dims: [usize; 3]) -> Volume {
    let mut state = 12345u64;
    let values = (0..dims.iter().product::<usize>()).map(|_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) % 90).saturating_sub(25) as u8
    });
    let grid = Grid::with_spacing(dims, [1.0, 1.25, 0.75]).unwrap();
    Volume::new(grid, Voxels::U8(values.collect::<Vec<_>>().into())).unwrap()
}

/// Shows the numbers from 0 to 64; tables have entries at whole numbers.
fn telling() -> TransferFunction {
    TransferFunction::new(vec![(0.0, [0.1, 0.9, 0.3]), (64.0, [1.0, 0.2, 0.7])], vec![(0.0, 0.0), (64.0, 0.4)]).unwrap()
}

/// The same colour and opacity for every value.
fn constant(a: f64) -> TransferFunction {
    TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.25])], vec![(0.0, a)]).unwrap()
}

fn looking(eye: DVec3, volume: &Volume, projection: Projection) -> Camera {
    Camera::new(Placement::LookAt { eye: volume.grid().center() + eye, target: volume.grid().center(), up: DVec3::Z }, projection).unwrap()
}

fn plain(transfer: TransferFunction, size: u32, steps: u64) -> Scene {
    let scene = Scene::new(transfer).with_size(size, size).unwrap().with_slices(Slicing::Count(steps)).unwrap();
    scene.with_terminate(0.0).unwrap()
}

/// Parallel rays from all sides, and two that run along an axis.
fn directions() -> Vec<DVec3> {
    vec![
        DVec3::new(30.0, 17.0, 11.0),
        DVec3::new(-20.0, 25.0, 3.0),
        DVec3::new(5.0, -9.0, 31.0),
        DVec3::new(12.0, 8.0, -33.0),
        DVec3::new(0.0, -30.0, 0.0),
        DVec3::new(30.0, 0.0, 0.0),
    ]
}

const PARALLEL: Projection = Projection::Orthographic { height: None };
