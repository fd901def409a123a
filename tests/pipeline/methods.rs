//! Ways to integrate a ray: how fast the error of each falls, and what very many slices leave of it.

use super::convergence::{errors, order};
use super::{PARALLEL, constant, orbit, render};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{
    Accumulation, Camera, Classification, Ends, Filter, Method, Order, Placement, Projection, SampleAt, SlabForm, Slicing, Target,
    TransferFunction,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Renderer, Scene, Settings, Volume};

/// One cell between eight voxels: along a ray its value is a cubic without kinks, so nothing but the method is measured.
pub(super) fn cell() -> (Volume, Scene) {
    let grid = Grid::with_spacing([2; 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid.clone(), Voxels::F32(vec![0.0, 130.0, 60.0, 200.0, 170.0, 40.0, 255.0, 100.0].into())).unwrap();
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
    let pairs = base.with_classification(Classification::PreIntegrated);
    let second = base.with_classification(Classification::SecondOrder);
    for (what, method, counts) in [
        ("midpoint", base, [16, 24, 32, 48, 64]),
        ("sampled at the end", base.with_sample(SampleAt::End), [32, 48, 64, 96, 128]),
        ("riemann", base.with_slab(SlabForm::Riemann), [32, 48, 64, 96, 128]),
        ("whole ends", base.with_ends(Ends::Whole), [33, 49, 67, 95, 131]),
        ("pre-integrated", pairs, [8, 12, 16, 24, 32]),
        ("pre-integrated, whole ends", pairs.with_ends(Ends::Whole), [33, 49, 67, 95, 131]),
        ("second order", second, [6, 8, 10, 12, 16]),
    ] {
        let (order, errors) = measured(method, &counts);
        println!("{what}: order {order:.3}, errors {errors:?}");
        assert!((order - f64::from(method.order())).abs() < 0.15, "{what}: order {order}, errors {errors:?}");
    }
}

#[test]
fn extrapolation_gains_an_order_where_the_error_is_a_smooth_series() {
    let pairs = Method::default().with_classification(Classification::PreIntegrated);
    let counts = [4, 6, 8, 12];
    let (order, errors) = measured(pairs.with_extrapolate(true), &counts);
    let (_, plain) = measured(pairs, &[8, 12, 16, 24]);
    assert!(order > 2.85, "order {order}, errors {errors:?}");
    assert!(errors.iter().zip(&plain).all(|(e, p)| e < &(0.3 * p)), "{errors:?} after {plain:?}");
}

/// RMS differences to the picture of very many slices: for methods whose limit is not the reference's.
fn distances(method: Method, counts: &[u64]) -> Vec<f64> {
    let (volume, scene) = cell();
    let scene = scene.with_method(method).unwrap();
    let of = |n: u64| render(&volume, &scene.clone().with_slices(Slicing::Count(n)).unwrap()).0;
    let limit = of(60_000);
    let distance = |n: u64| {
        let squares = of(n)
            .pixels()
            .iter()
            .zip(limit.pixels())
            .map(|(a, b)| (0..4).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>())
            .sum::<f64>();
        (squares / (4 * limit.pixels().len()) as f64).sqrt()
    };
    counts.iter().map(|&n| distance(n)).collect()
}

#[test]
fn nearest_voxels_and_classified_voxels_have_limits_of_their_own() {
    let (volume, scene) = cell();
    let exact = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let base = Method::default();
    for (what, method, counts) in [
        ("nearest", base.with_filter(Filter::Nearest), [64, 96, 160, 224, 352, 512]),
        ("pre-classified", base.with_classification(Classification::Pre), [32, 48, 64, 96, 128, 192]),
    ] {
        let distances = distances(method, &counts);
        let order = order(&counts, &distances);
        println!("{what}: order {order:.3}, {distances:?}");
        assert!((order - f64::from(method.order())).abs() < 0.15, "{what}: order {order}, {distances:?}");
        let limit = errors(&volume, &scene.clone().with_method(method).unwrap(), &[20_000])[0];
        assert!(limit > 3e-3, "{what} ends at the reference after all: {limit}, {} pixels", exact.pixels().len());
    }
}

/// One pixel through a uniform medium `count` slices deep, of opacity `a` per slice.
fn uniform(a: f64, count: u64) -> (Volume, Scene) {
    let grid = Grid::with_spacing([2; 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid.clone(), Voxels::U8(vec![7; 8].into())).unwrap();
    let place = Placement::LookAt { eye: grid.center() - 3.0 * DVec3::X, target: grid.center(), up: DVec3::Z };
    let camera = Camera::new(place, Projection::Orthographic { height: Some(0.5) }).unwrap();
    let scene = Scene::new(constant([1.0, 0.5, 0.25], a)).with_camera(camera).with_size(1, 1).unwrap().with_terminate(0.0).unwrap();
    (volume, scene.with_slices(Slicing::Count(count)).unwrap().with_opacity_unit(1.0 / count as f64).unwrap())
}

/// Largest error of colour and opacity against c (1 - (1-a)^N).
fn uniform_error(a: f64, count: u64, order: Order, method: Method) -> f64 {
    let (volume, scene) = uniform(a, count);
    let (picture, _) = render(&volume, &scene.with_order(order).with_method(method).unwrap());
    let whole = -(count as f64 * (-a).ln_1p()).exp_m1();
    let want = [whole, 0.5 * whole, 0.25 * whole, whole];
    picture.pixel(0, 0).iter().zip(want).map(|(&p, w)| (f64::from(p) - w).abs()).fold(0.0, f64::max)
}

#[test]
fn a_million_slices_keep_every_opacity() {
    let opacities = [1e-9, 1e-8, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 0.9, 0.999];
    let mut plain: f64 = 0.0;
    for a in opacities {
        for order in [Order::FrontToBack, Order::BackToFront] {
            let error = uniform_error(a, 1_000_000, order, Method::default());
            assert!(error < 1e-5, "opacity {a}, {order:?}: {error}");
        }
        plain = plain.max(uniform_error(a, 1_000_000, Order::FrontToBack, Method::default().with_accumulation(Accumulation::Plain)));
    }
    assert!(plain > 1e-3, "plain sums are good enough: {plain}");
}

#[test]
fn eight_bits_lose_what_is_below_half_a_step() {
    // 1 / 510 is half a step: a slice of a thousandth never leaves a trace, however many there are.
    let eight = Method::default().with_target(Target::Unorm8);
    for order in [Order::FrontToBack, Order::BackToFront] {
        let (volume, scene) = uniform(0.001, 1000);
        let (picture, _) = render(&volume, &scene.clone().with_order(order).with_method(eight).unwrap());
        assert_eq!(picture.pixel(0, 0), [0.0; 4], "{order:?}");
        assert!(render(&volume, &scene).0.pixel(0, 0)[3] > 0.63);
        // Every stored number is a multiple of 1/255.
        let (volume, scene) = uniform(0.1, 20);
        let pixel = render(&volume, &scene.with_order(order).with_method(eight).unwrap()).0.pixel(0, 0);
        assert!(pixel.iter().all(|c| (c * 255.0 - (c * 255.0).round()).abs() < 1e-4), "{pixel:?}");
    }
    let errors: Vec<f64> =
        [16u64, 64, 256, 1024].iter().map(|&n| uniform_error(-(-(1.0 / n as f64)).exp_m1(), n, Order::BackToFront, eight)).collect();
    assert!(errors[3] > 10.0 * errors[0] && errors[3] > 0.2, "{errors:?}");
}

#[test]
fn riemann_slabs_diverge_past_their_limit_and_stay_numbers() {
    // Extinction times thickness: below 1 all is well, up to 2 weights change sign, beyond they grow without bound.
    let riemann = Method::default().with_slab(SlabForm::Riemann);
    let alpha = |depth: f64| {
        let (volume, scene) = uniform(-(-depth).exp_m1(), 400);
        render(&volume, &scene.with_method(riemann).unwrap()).0.pixel(0, 0)[3]
    };
    assert!((alpha(0.5) - 1.0).abs() < 1e-6);
    assert!((alpha(1.5) - 1.0).abs() < 1e-6);
    assert!(alpha(2.5).abs() > 1e30, "{}", alpha(2.5));
    let (volume, scene) = uniform(1.0, 400);
    assert!(render(&volume, &scene.with_method(riemann).unwrap()).0.pixel(0, 0).iter().all(|c| c.is_finite()));
}

#[test]
fn pre_integration_needs_a_quarter_of_the_slices_on_spikes() {
    let (volume, scene) = cell();
    let spike = TransferFunction::new(
        vec![(0.0, [0.2, 0.9, 0.3]), (255.0, [1.0, 0.2, 0.6])],
        vec![(99.0, 0.0), (100.0, 0.9), (101.0, 0.0), (139.0, 0.0), (140.0, 0.6), (141.0, 0.0)],
    );
    let scene = scene.with_transfer(spike.unwrap()).with_opacity_unit(0.05).unwrap();
    for classification in [Classification::PreIntegrated, Classification::SecondOrder] {
        let pairs = scene.clone().with_method(Method::default().with_classification(classification)).unwrap();
        for n in [16, 32, 64, 128] {
            let few = errors(&volume, &pairs, &[n])[0];
            let many = errors(&volume, &scene, &[4 * n])[0];
            println!("{classification:?} {n}: {few:.2e}, midpoint {}: {many:.2e}", 4 * n);
            assert!(few < many, "{classification:?}: {few} in {n} slices, midpoint {many} in {}", 4 * n);
        }
    }
}

#[test]
fn an_estimate_is_near_the_error() {
    let (volume, scene) = cell();
    for method in [Method::default(), Method::default().with_ends(Ends::Whole)] {
        let scene = scene.clone().with_method(method).unwrap().with_slices(Slicing::Count(24)).unwrap();
        let settings = Settings::new().estimate(true);
        let (picture, stats) = Renderer::new(&volume, settings).render(&scene).unwrap();
        assert_eq!(picture.sha256(), render(&volume, &scene).0.sha256(), "an estimate changes no byte");
        let (estimate, error) = (stats.error_estimate.unwrap(), errors(&volume, &scene, &[24])[0]);
        assert!((0.5..2.0).contains(&(estimate / error)), "{estimate} for {error}");
        assert_eq!(stats.slices, 24);
    }
}

/// Colours and opacity are extrapolated each on its own: where the series is not smooth they would not fit together.
#[test]
fn extrapolated_colors_stay_below_their_opacity() {
    let volume = Phantom::MarschnerLobb.volume(3).unwrap();
    let transfer = TransferFunction::new(
        vec![(-0.8, [0.0, 0.0, 0.9]), (-0.34, [1.0, 0.0, 1.0]), (0.2, [1.0, 0.43, 1.0]), (0.69, [1.0; 3]), (0.76, [0.0, 1.0, 0.8])],
        vec![(-0.64, 0.9999999), (-0.1, 0.48), (0.04, 0.47), (0.43, 1.0), (0.89, 0.9)],
    )
    .unwrap();
    for projection in [Projection::Perspective { fov_y: 27.0 }, PARALLEL] {
        for count in [2, 5] {
            let scene = Scene::new(transfer.clone()).with_camera(orbit(45.0, 10.0, 1.0, projection)).with_size(64, 64).unwrap();
            let method = Method::default().with_classification(Classification::Pre).with_extrapolate(true);
            let scene = scene.with_slices(Slicing::Count(count)).unwrap().with_method(method).unwrap();
            let picture = render(&volume, &scene).0;
            for p in picture.pixels() {
                assert!(p[..3].iter().all(|&c| (0.0..=p[3]).contains(&c)) && p[3] <= 1.0, "{count} slices: {p:?}");
            }
        }
    }
}
