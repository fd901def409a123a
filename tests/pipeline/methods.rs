//! Ways to integrate a ray: how fast the error of each falls, and what very many slices leave of it.

use super::convergence::{errors, order};
use super::{constant, render};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{
    Accumulation, Camera, Classification, Ends, Filter, Method, Order, Placement, Projection, SampleAt, SlabForm, Slicing, Target,
    TransferFunction,
};
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Renderer, Scene, Settings, Volume};

/// One cell between eight voxels: along a ray its value is a cubic without kinks, so nothing but the method is measured.
fn cell() -> (Volume, Scene) {
    let grid = Grid::with_spacing([2; 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid.clone(), Voxels::F32(vec![0.0, 130.0, 60.0, 200.0, 170.0, 40.0, 255.0, 100.0])).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.9, 0.3]), (255.0, [1.0, 0.2, 0.6])], vec![(0.0, 0.02), (255.0, 0.7)]).unwrap();
    let place = Placement::LookAt { eye: grid.center() + DVec3::new(4.0, 3.0, 2.5), target: grid.center(), up: DVec3::Z };
    let camera = Camera::new(place, Projection::Orthographic { height: Some(0.35) }).unwrap();
    let scene = Scene::new(transfer).with_camera(camera).with_size(24, 16).unwrap();
    (volume, scene.with_opacity_unit(0.5).unwrap().with_terminate(0.0).unwrap())
}

fn measured(method: Method, counts: &[u64]) -> (f64, Vec<f64>) {
    let (volume, scene) = cell();
    let errors = errors(&volume, &scene.with_method(method).unwrap(), counts);
    (order(counts, &errors), errors)
}

#[test]
fn every_method_has_its_order() {
    let base = Method::default();
    let pairs = Method { classification: Classification::PreIntegrated, ..base };
    let second = Method { classification: Classification::SecondOrder, ..base };
    for (what, method, counts) in [
        ("midpoint", base, [8, 12, 16, 24, 32]),
        ("end", Method { sample: SampleAt::End, ..base }, [32, 48, 64, 96, 128]),
        ("riemann", Method { slab: SlabForm::Riemann, ..base }, [32, 48, 64, 96, 128]),
        ("whole ends", Method { ends: Ends::Whole, ..base }, [33, 49, 67, 95, 131]),
        ("pre-integrated", pairs, [8, 12, 16, 24, 32]),
        ("second order", second, [6, 8, 10, 12, 16]),
        ("pre-integrated, whole ends", Method { ends: Ends::Whole, ..pairs }, [33, 49, 67, 95, 131]),
        ("8 bits", Method { target: Target::Unorm8, ..base }, [8, 12, 16, 24, 32]),
        ("richardson", Method { extrapolate: true, ..base }, [4, 6, 8, 12, 16]),
        ("pre richardson", Method { extrapolate: true, ..pairs }, [4, 6, 8, 12, 16]),
    ] {
        let (order, errors) = measured(method, &counts);
        println!("{what}: order {order:.3}, errors {errors:?}");
    }
}
