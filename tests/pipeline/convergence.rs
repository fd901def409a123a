//! How fast the error falls with the number of slices.

use super::{PARALLEL, WIDE, fill, oblique, orbit, render};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{Camera, Fog, FogDistance, FogMode, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Scene, Volume};

/// Values of the test fields run from 0 to this, and points of their transfer function stand at whole numbers: a table adds nothing to
/// the error.
const TOP: f64 = 4096.0;

/// Smooth colours and opacities; `low` is the opacity at and below a tenth.
pub(super) fn smooth_transfer(low: f64) -> TransferFunction {
    let points = || (0..=4096).map(|i| (f64::from(i), f64::from(i) / TOP));
    let color = points().map(|(at, v)| (at, [0.5 + 0.5 * (5.0 * v).sin(), v * v, 0.5 + 0.4 * (4.0 * v).cos()]));
    let bump = |v: f64| ((v - 0.1).max(0.0) * 3.0).sin().powi(2);
    TransferFunction::new(color.collect(), points().map(|(at, v)| (at, low + 0.25 * bump(v))).collect()).unwrap()
}

/// A volume of `f` brought to exactly [0, TOP].
pub(super) fn spread(grid: Grid, f: &dyn Fn([f64; 3]) -> f64) -> Volume {
    let Voxels::F64(mut v) = fill::<f64>(grid.dims(), f) else { unreachable!() };
    let (lo, hi) = v.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &x| (lo.min(x), hi.max(x)));
    v.iter_mut().for_each(|x| *x = (*x - lo) / (hi - lo) * TOP);
    Volume::new(grid, Voxels::F64(v)).unwrap()
}

/// RMS errors against the reference for each number of slices.
pub(super) fn errors(volume: &Volume, scene: &Scene, counts: &[u64]) -> Vec<f64> {
    let want = image(scene, volume, Region::whole(scene)).unwrap();
    let mut list = Vec::new();
    for &n in counts {
        let (picture, _) = render(volume, &scene.clone().with_slices(Slicing::Count(n)).unwrap());
        let squares = picture.pixels().iter().zip(want.pixels()).flat_map(|(a, b)| (0..4).map(|c| (f64::from(a[c]) - b[c]).powi(2)));
        list.push((squares.sum::<f64>() / (4 * want.pixels().len()) as f64).sqrt());
    }
    list
}

/// Slope of a straight line through (ln n, -ln e).
pub(super) fn order(counts: &[u64], errors: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = counts.iter().zip(errors).map(|(&n, e)| ((n as f64).ln(), -e.ln())).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

fn expect_order_2(what: &str, volume: &Volume, scene: Scene, counts: &[u64]) {
    let scene = scene.with_terminate(0.0).unwrap().with_size(24, 20).unwrap();
    let errors = errors(volume, &scene, counts);
    let order = order(counts, &errors);
    println!("{what}: order {order:.3}, errors {errors:?}");
    assert!((order - 2.0).abs() < 0.15, "{what}: order {order}, errors {errors:?}");
}

/// A smooth field that sinks to 0 before the faces of the box, so that grazing rays meet nothing.
pub(super) fn island() -> Volume {
    let hill =
        |p: [f64; 3]| p.map(|x| (1.0 - x * x).max(0.0)).iter().product::<f64>() * (1.0 + 0.3 * (3.0 * p[0] + 2.0 * p[1]).sin()) / 1.3;
    spread(oblique([64, 60, 56]), &hill)
}

#[test]
pub(super) fn errors_fall_with_the_square_of_the_number_of_slices() {
    let volume = island();
    let scene = || Scene::new(smooth_transfer(0.0)).with_opacity_unit(4.0).unwrap();
    // Voxels are finer than slices: kinks between cells would only add noise.
    let counts = [24, 34, 48, 68, 96];
    expect_order_2("parallel", &volume, scene().with_camera(orbit(33.0, 21.0, 1.2, PARALLEL)), &counts);
    expect_order_2("perspective", &volume, scene().with_camera(orbit(110.0, -35.0, 1.2, WIDE)), &counts);
}

#[test]
fn partial_slabs_keep_the_order_where_the_box_ends_in_matter() {
    // Matter up to the faces, whose slabs the rays cut anywhere: no ray grazes.
    let field = |[x, y, z]: [f64; 3]| 0.5 + 0.4 * (1.5 * x + 0.4).sin() * (1.2 * y - z).cos();
    let grid = Grid::with_spacing([20, 20, 20], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = spread(grid.clone(), &field);
    let eye = grid.center() + DVec3::new(40.0, 9.0, 14.0);
    let place = |fov_y| Camera::new(Placement::LookAt { eye, target: grid.center(), up: DVec3::Z }, fov_y).unwrap();
    let scene = || Scene::new(smooth_transfer(0.01)).with_opacity_unit(1.0).unwrap();
    let counts = [24, 48, 96, 192];
    expect_order_2("parallel", &volume, scene().with_camera(place(Projection::Orthographic { height: Some(10.0) })), &counts);
    expect_order_2("perspective", &volume, scene().with_camera(place(Projection::Perspective { fov_y: 14.0 })), &counts);
    let fog = |mode, distance| Some(Fog::new(mode, [0.7, 0.8, 0.9]).unwrap().with_distance(distance));
    let exp2 = fog(FogMode::Exp2 { density: 0.015 }, FogDistance::Radial);
    expect_order_2("radial fog", &volume, scene().with_camera(place(Projection::Perspective { fov_y: 14.0 })).with_fog(exp2), &counts);
    let exp = fog(FogMode::Exp { density: 0.01 }, FogDistance::Planar);
    expect_order_2(
        "planar fog",
        &volume,
        scene().with_camera(place(Projection::Orthographic { height: Some(10.0) })).with_fog(exp),
        &counts,
    );
    // From inside.
    let eye = grid.center() + DVec3::new(2.0, 1.0, -1.5);
    let inside = Camera::new(
        Placement::LookAt { eye, target: grid.center() + DVec3::new(20.0, 3.0, 1.0), up: DVec3::Z },
        Projection::Perspective { fov_y: 30.0 },
    );
    expect_order_2("inside", &volume, scene().with_camera(inside.unwrap()), &counts);
}
