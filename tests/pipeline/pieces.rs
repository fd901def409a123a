//! Pieces of rays far shorter than slabs that are opaque: each has the opacity of its own length.

use super::oracle::Oracle;
use super::{constant, render};
use glam::DVec3;
use slicestack::reference::closed::{constant_color, opacity};
use slicestack::scene::{Camera, Classification, ClipPlane, Method, Order, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Scene, Volume};

const COLOR: [f64; 3] = [1.0, 0.5, 0.25];
/// Slices through a cube of [`SIDE`] units.
const SLICES: u64 = 8;
const SIDE: usize = 16;
const SLAB: f64 = SIDE as f64 / SLICES as f64;

const CLASSIFICATIONS: [Classification; 4] =
    [Classification::Post, Classification::Pre, Classification::PreIntegrated, Classification::SecondOrder];

fn method(classification: Classification) -> Method {
    let mut method = Method::default();
    method.classification = classification;
    method
}

fn cube() -> Volume {
    let grid = Grid::with_spacing([SIDE; 3], [1.0; 3]).unwrap();
    Volume::new(grid, Voxels::F32(vec![7.0; SIDE * SIDE * SIDE].into())).unwrap()
}

/// The cube from the front, cut to a layer `thick` from `z` on.
fn layer(transfer: TransferFunction, unit: f64, projection: Projection, (z, thick): (f64, f64)) -> Scene {
    let center = DVec3::splat(0.5 * (SIDE - 1) as f64);
    let camera = Camera::new(Placement::LookAt { eye: center.with_z(60.0), target: center, up: DVec3::Y }, projection).unwrap();
    let planes = vec![ClipPlane::new(DVec3::Z, z).unwrap(), ClipPlane::new(DVec3::NEG_Z, -(z + thick)).unwrap()];
    let scene = Scene::new(transfer).with_camera(camera).with_size(11, 9).unwrap().with_slices(Slicing::Count(SLICES)).unwrap();
    let scene = scene.with_opacity_unit(unit).unwrap().with_terminate(0.0).unwrap();
    scene.with_clip_planes(planes).unwrap()
}

/// The largest difference of a picture to the closed form of a medium of extinction `kappa`.
fn error(volume: &Volume, scene: &Scene, kappa: f64) -> f64 {
    let oracle = Oracle::new(volume, scene);
    let (picture, _) = render(volume, scene);
    let mut worst = 0.0f64;
    for y in 0..9 {
        for x in 0..11 {
            let window = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (entry, exit) = oracle.path(window.0, window.1);
            let depth = kappa * (exit - entry).max(0.0) * oracle.stack.view.ray(window.0, window.1).1.length();
            let want = [constant_color(COLOR[0], depth), constant_color(COLOR[1], depth), constant_color(COLOR[2], depth), opacity(depth)];
            for (got, want) in picture.pixel(x, y).iter().zip(want) {
                worst = worst.max((f64::from(*got) - want).abs());
            }
        }
    }
    worst
}

#[test]
fn layers_thinner_than_an_opaque_slab_have_the_opacity_of_their_thickness() {
    let volume = cube();
    // Where the layer lies in its slab, or in two of them.
    for z in [4.2, 4.9, 5.499, 5.6, 6.49] {
        for projection in [Projection::Orthographic { height: Some(10.0) }, Projection::Perspective { fov_y: 12.0 }] {
            for classification in CLASSIFICATIONS {
                for order in [Order::FrontToBack, Order::BackToFront] {
                    for (slab_depth, part) in [(3.0, 0.3), (18.0, 0.05), (40.0, 0.02), (1e3, 1e-3), (1e6, 1e-6), (1e9, 3e-8)] {
                        let kappa = slab_depth / SLAB;
                        // Opacity 0.9 per unit of length.
                        let scene = layer(constant(COLOR, 0.9), -libm::log1p(-0.9) / kappa, projection, (z, part * SLAB));
                        let scene = scene.with_method(method(classification)).unwrap().with_order(order);
                        let error = error(&volume, &scene, kappa);
                        // Ends of pieces this thin are known to 1e-14 of 60 units.
                        let bound = 1e-6 + kappa * 1e-13;
                        assert!(
                            error <= bound,
                            "{classification:?}, {projection:?}, {order:?}, depth {slab_depth}, {part} at {z}: {error:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn an_opacity_of_one_stays_opaque_in_the_thinnest_layer() {
    let volume = cube();
    for classification in CLASSIFICATIONS {
        let scene = layer(constant(COLOR, 1.0), 1.0, Projection::Orthographic { height: Some(10.0) }, (4.2, 1e-6));
        let scene = scene.with_method(method(classification)).unwrap();
        assert!(error(&volume, &scene, f64::INFINITY) <= 1e-7, "{classification:?}");
    }
}

/// Between an opacity of 0 and one of 1 each piece agrees with the whole slab that it is a piece of.
#[test]
fn pieces_of_a_ramp_add_up_to_their_slab() {
    let grid = Grid::with_spacing([SIDE, SIDE, 2], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let values = (0..2 * SIDE * SIDE).map(|i| (i % SIDE) as f32 / (SIDE - 1) as f32).collect::<Vec<f32>>();
    let volume = Volume::new(grid.clone(), Voxels::F32(values.into())).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, COLOR)], vec![(0.0, 0.0), (1.0, 1.0)]).unwrap();
    for (ratio, bound) in [(1.0, 2e-3), (3.0, 2e-3)] {
        let center = grid.center();
        let place = Placement::LookAt { eye: center.with_z(20.0), target: center, up: DVec3::Y };
        let camera = Camera::new(place, Projection::Orthographic { height: Some(0.875) }).unwrap();
        let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(128, 8).unwrap().with_slices(Slicing::Count(1)).unwrap();
        let scene = scene.with_opacity_unit(1.0 / ratio).unwrap().with_terminate(0.0).unwrap();
        let whole = render(&volume, &scene).0;
        // A tenth of the only slab.
        let scene = scene.with_clip_planes(vec![ClipPlane::new(DVec3::Z, 0.9).unwrap()]).unwrap();
        let part = render(&volume, &scene).0;
        let mut seen = 0;
        for x in 0..128 {
            let (all, tenth) = (f64::from(whole.pixel(x, 4)[3]), f64::from(part.pixel(x, 4)[3]));
            if (1e-3..0.9999).contains(&all) {
                let want = -libm::expm1(0.1 * libm::log1p(-all));
                assert!((tenth - want).abs() < bound, "ratio {ratio}, column {x}: {tenth} not {want}, of {all}");
                seen += 1;
            }
        }
        assert!(seen > 40, "{seen}");
    }
}

#[test]
fn a_field_that_passes_an_opacity_of_1_is_no_wall() {
    // A ramp along z through a peak; the more slices, the more of them lie next to it.
    let values: Vec<f32> = (0..SIDE * SIDE * SIDE).map(|i| (i / (SIDE * SIDE)) as f32).collect();
    let grid = Grid::with_spacing([SIDE; 3], [1.0; 3]).unwrap();
    let volume = Volume::new(grid, Voxels::F32(values.into())).unwrap();
    let transfer =
        TransferFunction::new(vec![(0.0, COLOR)], vec![(7.0, 0.0), (8.0, 1.0), (9.0, 0.0)]).and_then(|t| t.with_unit(4.0)).unwrap();
    let scene = Scene::new(transfer).with_size(4, 4).unwrap();
    let truth = slicestack::reference::image(&scene, &volume, slicestack::reference::Region::whole(&scene)).unwrap();
    let want = truth.pixels()[5][3];
    assert!(want < 0.8, "{want}");
    for count in [256, 4096, 65536] {
        let (picture, _) = render(&volume, &scene.clone().with_slices(Slicing::Count(count)).unwrap());
        let got = f64::from(picture.pixel(1, 1)[3]);
        assert!((got - want).abs() < 2e-3, "{count} slices: {got} of {want}");
    }
}
