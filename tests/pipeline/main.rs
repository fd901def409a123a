//! The whole pipeline against closed forms, the reference, and a slow picture made slice by slice in f64.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod blending;
mod closed;
mod compositing;
mod convergence;
mod cubic;
mod cuts;
mod extremes;
mod fog;
mod jitter;
mod labels;
mod light;
mod lit;
mod local_maxima;
mod merged;
mod methods;
mod oracle;
mod pieces;
mod places;
mod projections;
#[cfg(feature = "scene-file")]
mod random_tolerance;
mod shells;
mod skipping;
mod tally;

use glam::{DMat3, DQuat, DVec3};
use slicestack::scene::{Camera, Placement, Projection, TransferFunction};
use slicestack::volume::{BoxConvention, Grid, Voxel, VoxelType, Voxels};
use slicestack::{Picture, RenderStats, Renderer, Scene, Settings, Volume};

fn render(volume: &Volume, scene: &Scene) -> (Picture, RenderStats) {
    Renderer::new(volume, Settings::default()).render(scene).unwrap()
}

/// The same colour and opacity for every value.
fn constant(rgb: [f64; 3], a: f64) -> TransferFunction {
    TransferFunction::new(vec![(0.0, rgb)], vec![(0.0, a)]).unwrap()
}

/// A transfer function over [lo, hi], transparent below a quarter. Colour and opacity never change at once, so that a table for
/// slabs of the reference length is exact.
fn simple(lo: f64, hi: f64) -> TransferFunction {
    let at = |t: f64| lo + (hi - lo) * t;
    TransferFunction::new(
        vec![(at(0.5), [0.1, 0.2, 1.0]), (at(0.625), [0.9, 0.8, 0.1]), (at(0.75), [1.0, 0.1, 0.3])],
        vec![(at(0.25), 0.0), (at(0.5), 0.1), (at(0.75), 0.1), (at(1.0), 0.5)],
    )
    .unwrap()
}

/// Shows differences of values between `lo` and `hi`: no part is transparent or flat. As exact as [`simple`].
fn telling(lo: f64, hi: f64) -> TransferFunction {
    let middle = 0.5 * lo + 0.5 * hi;
    TransferFunction::new(vec![(lo, [0.0, 0.3, 1.0]), (middle, [1.0, 0.2, 0.1])], vec![(middle, 0.05), (hi, 0.5)]).unwrap()
}

/// A smooth function of a place in [-1,1]^3, within [0,1].
fn smooth([x, y, z]: [f64; 3]) -> f64 {
    let waves = (2.1 * x + 0.3).sin() * (1.7 * y - 0.4).cos() + (1.3 * z + x * y).sin();
    let blob = (-2.0 * (x * x + 1.5 * y * y + z * z)).exp();
    // Both ends are reached: knots of a transfer function then fall on entries of its table.
    (0.3 + 0.2 * waves + 1.1 * blob).clamp(0.0, 1.0)
}

/// Voxels of type T from a function of their place in [-1,1]^3.
fn fill<T: Voxel>(dims: [usize; 3], f: &dyn Fn([f64; 3]) -> f64) -> Voxels {
    let at = |i: usize, n: usize| if n == 1 { 0.0 } else { 2.0 * i as f64 / (n - 1) as f64 - 1.0 };
    let mut values = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                values.push(T::from_f64(f([at(x, dims[0]), at(y, dims[1]), at(z, dims[2])])));
            }
        }
    }
    T::wrap(values.into())
}

fn fill_as(kind: VoxelType, dims: [usize; 3], f: &dyn Fn([f64; 3]) -> f64) -> Voxels {
    match kind {
        VoxelType::U8 => fill::<u8>(dims, f),
        VoxelType::I8 => fill::<i8>(dims, f),
        VoxelType::U16 => fill::<u16>(dims, f),
        VoxelType::I16 => fill::<i16>(dims, f),
        VoxelType::U32 => fill::<u32>(dims, f),
        VoxelType::I32 => fill::<i32>(dims, f),
        VoxelType::F32 => fill::<f32>(dims, f),
        VoxelType::F64 => fill::<f64>(dims, f),
    }
}

/// An oblique grid, mirrored along y.
fn oblique(dims: [usize; 3]) -> Grid {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7));
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, -1.3, 0.0), DVec3::new(-0.1, 0.3, 0.8));
    Grid::new(dims, DVec3::new(3.0, -7.0, 11.0), turn * shear).unwrap()
}

/// The smooth field on an oblique grid in f32.
fn field(dims: [usize; 3]) -> Volume {
    Volume::new(oblique(dims), fill::<f32>(dims, &smooth)).unwrap()
}

fn orbit(azimuth: f64, elevation: f64, zoom: f64, projection: Projection) -> Camera {
    Camera::new(Placement::Orbit { azimuth, elevation, roll: 10.0, zoom }, projection).unwrap()
}

const PARALLEL: Projection = Projection::Orthographic { height: None };
const WIDE: Projection = Projection::Perspective { fov_y: 70.0 };

/// Cameras of every kind around a volume: parallel, perspective, along an axis, from inside, cut by the near plane.
fn cameras(grid: &Grid) -> Vec<Camera> {
    let (center, radius) = (grid.center(), grid.radius());
    let inside = Placement::LookAt { eye: center + DVec3::new(0.1, 0.2, 0.05) * radius, target: center + DVec3::X * radius, up: DVec3::Z };
    vec![
        orbit(30.0, 20.0, 1.2, PARALLEL),
        orbit(0.0, 0.0, 1.0, PARALLEL),
        orbit(-90.0, 0.0, 1.5, Projection::Perspective { fov_y: 30.0 }),
        orbit(200.0, -50.0, 1.3, WIDE),
        orbit(70.0, 35.0, 1.1, WIDE).with_near(1.4 * radius).unwrap(),
        orbit(130.0, 10.0, 1.0, PARALLEL).with_near(1.7 * radius).unwrap(),
        Camera::new(inside, WIDE).unwrap(),
    ]
}

/// Boxes of several kinds.
fn grids() -> Vec<Grid> {
    vec![
        Grid::with_spacing([9, 9, 9], [1.0; 3]).unwrap(),
        Grid::with_spacing([5, 12, 3], [0.5, -0.2, 1.7]).unwrap().with_convention(BoxConvention::Nodes),
        oblique([6, 7, 8]),
    ]
}

/// Largest difference of any component.
fn difference(picture: &Picture, want: &[[f64; 4]]) -> f64 {
    assert_eq!(picture.pixels().len(), want.len());
    let pairs = picture.pixels().iter().zip(want);
    pairs
        .flat_map(|(a, b)| (0..4).map(|c| (f64::from(a[c]) - b[c]).abs()))
        .fold(0.0, |m, d| if d.is_nan() { f64::INFINITY } else { m.max(d) })
}
