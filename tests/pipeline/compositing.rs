//! Ways to put slices together that are none of the two usual ones, and sums through a window.

use super::oracle::Oracle;
use super::{PARALLEL, WIDE, cameras, constant, difference, fill, orbit, render, simple, smooth, telling};
use glam::DVec3;
use slicestack::scene::{Blend, Camera, Classification, Method, Order, Placement, Projection, Slicing, Straight, TransferFunction};
use slicestack::volume::{BoxConvention, Grid};
use slicestack::{Scene, Volume};

fn scene(transfer: TransferFunction) -> Scene {
    Scene::new(transfer).with_size(19, 17).unwrap().with_slices(Slicing::Count(33)).unwrap().with_terminate(0.0).unwrap()
}

#[test]
fn under_is_over_front_to_back_and_a_scalar_loop_in_both_orders() {
    let volume = super::field([9, 11, 8]);
    for camera in cameras(volume.grid()) {
        let over = scene(simple(0.0, 1.0)).with_camera(camera).with_opacity_unit(0.2).unwrap();
        let under = over.clone().with_blend(Blend::Under).unwrap();
        assert_eq!(render(&volume, &over).0.sha256(), render(&volume, &under).0.sha256());
        let to_tolerance = |s: &Scene| render(&volume, &s.clone().with_slices(Slicing::Tolerance(0.01)).unwrap()).0.sha256();
        assert_eq!(to_tolerance(&over), to_tolerance(&under));
        for order in [Order::FrontToBack, Order::BackToFront] {
            let scene = under.clone().with_order(order);
            // Tables of thin slabs are a little off.
            let off = difference(&render(&volume, &scene).0, &Oracle::new(&volume, &scene).picture());
            assert!(off < 2e-3, "{order:?} from {camera:?}: {off}");
        }
    }
    // Far things hide near ones: an opaque far half is all that is seen.
    let halves =
        Volume::new(Grid::with_spacing([4, 4, 8], [1.0; 3]).unwrap(), fill::<f32>([4, 4, 8], &|p| if p[2] > 0.0 { 1.0 } else { 0.0 }))
            .unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.0, 0.0]), (1.0, [0.0, 0.0, 1.0])], vec![(0.0, 0.9999)]).unwrap();
    let seen = |blend: Blend, order: Order| {
        let placement = Placement::LookAt { eye: DVec3::new(1.5, 1.5, -20.0), target: DVec3::new(1.5, 1.5, 0.0), up: DVec3::Y };
        let camera = Camera::new(placement, Projection::Orthographic { height: Some(2.0) }).unwrap();
        let scene = scene(transfer.clone()).with_camera(camera).with_blend(blend).unwrap().with_order(order);
        render(&halves, &scene).0.pixel(9, 8)
    };
    let near = seen(Blend::Over, Order::BackToFront);
    let far = seen(Blend::Under, Order::BackToFront);
    assert!(near[0] > 0.99 && near[2] < 0.01, "{near:?}");
    assert!(far[2] > 0.99 && far[0] < 0.01, "{far:?}");
}

#[test]
fn attenuated_values_against_closed_forms() {
    let camera = |eye: DVec3| {
        Camera::new(
            Placement::LookAt { eye, target: DVec3::new(1.5, 1.5, 0.0), up: DVec3::Y },
            Projection::Orthographic { height: Some(2.0) },
        )
        .unwrap()
    };
    let transfer = TransferFunction::new(vec![(0.0, [0.0; 3]), (1.0, [1.0, 0.5, 0.25])], vec![(0.0, 1.0)]).unwrap();
    let seen = |volume: &Volume, attenuation: f64, slices: u64, window: Option<[f64; 2]>| {
        let scene = scene(transfer.clone()).with_camera(camera(DVec3::new(1.5, 1.5, -100.0)));
        let scene = scene.with_blend(Blend::AttenuatedMip { attenuation }).unwrap().with_slices(Slicing::Count(slices)).unwrap();
        f64::from(render(volume, &scene.with_window(window).unwrap()).0.pixel(9, 8)[0])
    };
    let dims = [4, 4, 65];
    let grid = Grid::with_spacing(dims, [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    // A constant is seen at the front, where nothing is before it.
    let flat = Volume::new(grid.clone(), fill::<f32>(dims, &|_| 0.6)).unwrap();
    for attenuation in [0.0, 1.0, 50.0] {
        assert!((seen(&flat, attenuation, 64, Some([0.5, 1.0])) - 0.6).abs() < 1e-6);
        assert!((seen(&flat, attenuation, 64, None) - 0.6).abs() < 1e-6);
    }
    // Along a ramp n = s the factor is exp(-k s^2 / 2), and s times that is greatest at s = 1 / sqrt(k).
    let ramp = Volume::new(grid, fill::<f32>(dims, &|p| 0.5 * (p[2] + 1.0))).unwrap();
    for attenuation in [2.0f64, 9.0, 30.0] {
        let want = (-0.5f64).exp() / attenuation.sqrt();
        let got = [1000, 4000].map(|slices| (seen(&ramp, attenuation, slices, None) - want).abs());
        assert!(got[0] < 3e-2 && got[1] < 0.3 * got[0] + 1e-5, "{attenuation}: {got:?} off {want}");
    }
    // Without attenuation, or where nothing can fade any more: the largest value.
    assert!((seen(&ramp, 0.0, 4000, None) - 1.0).abs() < 2e-4);
    assert!((seen(&ramp, 0.3, 4000, None) - f64::exp(-0.15)).abs() < 1e-3);
}

#[test]
fn sums_are_seen_through_their_window() {
    let volume = super::field([9, 11, 8]);
    for window in [None, Some([0.5, 1.0]), Some([3.0, 4.0]), Some([1.0, 0.5])] {
        for projection in [PARALLEL, WIDE] {
            let scene = scene(telling(0.0, 1.0)).with_camera(orbit(25.0, -15.0, 1.2, projection)).with_opacity_unit(0.4).unwrap();
            let scene = scene.with_blend(Blend::Add).unwrap().with_window(window).unwrap();
            let unit = super::oracle::slab(&volume, &scene);
            let scene = scene.with_opacity_unit(unit).unwrap();
            let off = difference(&render(&volume, &scene).0, &Oracle::new(&volume, &scene).picture());
            assert!(off < 1e-4, "{window:?}: {off}");
        }
    }
    // What has no sum stays as it was, and a window of 0 to 1 is none.
    let plain = scene(telling(0.0, 1.0)).with_blend(Blend::Add).unwrap();
    let windowed = plain.clone().with_window(Some([0.5, 1.0])).unwrap();
    assert!(
        difference(&render(&volume, &plain).0, &render(&volume, &windowed).0.pixels().iter().map(|p| p.map(f64::from)).collect::<Vec<_>>())
            < 1e-7
    );
}

#[test]
fn a_picture_of_sums_that_saturates_is_told() {
    let volume = super::field([9, 11, 8]);
    let added = |opacity: f64| scene(constant([1.0, 0.5, 0.2], opacity)).with_blend(Blend::Add).unwrap();
    let told = |scene: &Scene| render(&volume, scene).1.warnings.iter().any(|w| w.contains("saturates"));
    assert!(told(&added(0.5)));
    assert!(!told(&added(1e-4)));
    assert!(!told(&added(0.5).with_window(Some([20.0, 40.0])).unwrap()));
    // White behind a faint sum is no sum.
    let white = Straight { rgb: [1.0; 3], alpha: 1.0 };
    assert!(!told(&added(1e-4).with_background(white).unwrap()));
}

/// An opaque background is a last sample of opacity 1: the closed sum over all samples, with that one behind them.
#[test]
fn an_opaque_background_is_the_last_sample() {
    let volume = super::field([9, 11, 8]);
    let background = Straight { rgb: [0.9, 0.3, 0.6], alpha: 1.0 };
    for order in [Order::FrontToBack, Order::BackToFront] {
        for projection in [PARALLEL, WIDE] {
            let scene = scene(telling(0.0, 1.0)).with_camera(orbit(-65.0, 35.0, 1.3, projection)).with_order(order);
            let unit = super::oracle::slab(&volume, &scene);
            let scene = scene.with_opacity_unit(unit).unwrap().with_background(background).unwrap();
            let (picture, oracle) = (render(&volume, &scene).0, Oracle::new(&volume, &scene));
            let (width, height) = scene.size();
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let mut samples: Vec<([f64; 3], f64)> = oracle.fragments(x, y).iter().map(|f| oracle.fogged(f)).collect();
                samples.push((background.rgb, 1.0));
                // Sum over k of C_k times the product over j < k of 1 - A_j.
                let closed: [f64; 3] = std::array::from_fn(|c| {
                    (0..samples.len()).map(|k| samples[k].0[c] * samples[..k].iter().map(|s| 1.0 - s.1).product::<f64>()).sum()
                });
                let got = picture.pixel(x, y);
                let off = (0..3).map(|c| (f64::from(got[c]) - closed[c]).abs()).fold(0.0, f64::max);
                assert!(off < 3e-5 && (got[3] - 1.0).abs() < 1e-6, "{order:?} {x},{y}: {got:?}, not {closed:?}");
            }
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_in_one_line() {
    let plain = scene(simple(0.0, 1.0));
    let said = |result: slicestack::Result<Scene>| {
        let line = result.unwrap_err().to_string();
        assert!(!line.contains('\n'), "{line}");
        line
    };
    assert!(said(plain.clone().with_window(Some([0.5, 1.0]))).contains("add and attenuated-mip"));
    let added = plain.clone().with_blend(Blend::Add).unwrap();
    assert!(said(added.clone().with_window(Some([0.2, 1.0]))).contains("begin at 0"));
    for bad in [[f64::NAN, 1.0], [1.0, 0.0], [1.0, -1.0], [1.0, f64::INFINITY]] {
        assert!(said(added.clone().with_window(Some(bad))).contains("positive width"));
    }
    assert!(said(added.with_window(Some([0.5, 1.0])).unwrap().with_blend(Blend::Over)).contains("window"));
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(said(plain.clone().with_blend(Blend::AttenuatedMip { attenuation: bad })).contains("attenuation"));
    }
    let pairs = plain.with_order(Order::BackToFront).with_method(Method::default().with_classification(Classification::PreIntegrated));
    assert!(said(pairs.unwrap().with_blend(Blend::Under)).contains("under"));
    // The truth follows rays front to back, through colours alone.
    let volume = Volume::new(Grid::with_spacing([5, 5, 5], [1.0; 3]).unwrap(), fill::<f32>([5, 5, 5], &smooth)).unwrap();
    for blend in [Blend::AttenuatedMip { attenuation: 1.0 }, Blend::Under] {
        let asked = scene(simple(0.0, 1.0)).with_blend(blend).unwrap().with_order(Order::BackToFront);
        let line = slicestack::reference::Integrator::new(&asked, &volume).unwrap_err().to_string();
        assert!(line.contains("over"), "{line}");
    }
}
