//! Voxels that are NaN or infinite, or numbers at the ends of their type.

use super::oracle::{Oracle, slab};
use super::{PARALLEL, WIDE, difference, fill, oblique, orbit, render, smooth, telling};
use slicestack::scene::{Blend, Slicing, TransferFunction};
use slicestack::volume::Voxels;
use slicestack::{Scene, Volume};

const BLENDS: [Blend; 5] = [Blend::Over, Blend::Mip, Blend::Min, Blend::Average, Blend::Add];

fn scene(volume: &Volume, transfer: TransferFunction, blend: Blend) -> Scene {
    let camera = if blend == Blend::Over { orbit(25.0, 35.0, 1.2, WIDE) } else { orbit(65.0, -25.0, 1.2, PARALLEL) };
    let scene = Scene::new(transfer).with_camera(camera).with_size(18, 16).unwrap().with_blend(blend).unwrap();
    let scene = scene.with_slices(Slicing::Count(90)).unwrap().with_terminate(0.0).unwrap();
    let unit = slab(volume, &scene);
    scene.with_opacity_unit(unit).unwrap()
}

#[test]
fn voxels_that_are_no_numbers_are_transparent_counted_and_told() {
    let dims = [12, 10, 11];
    let holes = [(5, f64::NAN), (400, f64::INFINITY), (401, f64::NEG_INFINITY), (777, f64::NAN), (1319, f64::INFINITY)];
    let mut single: Vec<f32> = match fill::<f32>(dims, &smooth) {
        Voxels::F32(v) => v.into_vec(),
        _ => unreachable!("filled as f32"),
    };
    let mut double: Vec<f64> = single.iter().map(|&v| f64::from(v)).collect();
    for (i, v) in holes {
        single[i] = v as f32;
        double[i] = v;
    }
    for voxels in [Voxels::F32(single.into()), Voxels::F64(double.into())] {
        let volume = Volume::new(oblique(dims), voxels).unwrap();
        for blend in BLENDS {
            let scene = scene(&volume, telling(0.0, 1.0), blend);
            let (picture, stats) = render(&volume, &scene);
            let want = Oracle::new(&volume, &scene).picture();
            let e = difference(&picture, &want);
            assert!(e < 3e-5, "{blend:?}: {e}");
            assert_eq!(stats.non_finite_voxels, holes.len());
            assert!(stats.warnings.iter().any(|w| w.contains("5 of 1320 voxels are NaN or infinite")), "{:?}", stats.warnings);
        }
    }
    let nothing = Volume::new(oblique([3, 3, 3]), Voxels::F32(vec![f32::NAN; 27].into())).unwrap();
    for blend in BLENDS {
        let (picture, stats) = render(&nothing, &scene(&nothing, telling(0.0, 1.0), blend));
        assert!(picture.pixels().iter().all(|p| *p == [0.0; 4]), "{blend:?}");
        assert_eq!(stats.non_finite_voxels, 27);
    }
}

/// Values in [low, high] as f32 or f64, through every blend.
fn check_range(what: &str, volume: &Volume, low: f64, high: f64) {
    let all = BLENDS.iter().copied().chain([Blend::Iso { level: low + (high - low) * 0.52 }]);
    for blend in all {
        let scene = scene(volume, telling(low, high), blend);
        let (picture, _) = render(volume, &scene);
        let want = Oracle::new(volume, &scene).picture();
        let off = picture.pixels().iter().zip(&want).filter(|(a, b)| !(0..4).all(|c| (f64::from(a[c]) - b[c]).abs() < 5e-5)).count();
        let allowed = if matches!(blend, Blend::Iso { .. }) { 2 } else { 0 };
        assert!(off <= allowed, "{what}, {blend:?}: {off} pixels off, by {}", difference(&picture, &want));
        assert!(picture.pixels().iter().filter(|p| p[3] > 0.01).count() > 20, "{what}, {blend:?}: nothing to see");
    }
}

#[test]
fn numbers_at_the_ends_of_f32() {
    let dims = [9, 8, 10];
    for (low, high) in [(0.0, 1e-38), (-1e-38, 1e-38), (0.0, 1e38), (0.0, 9e37), (-3.4e38, 3.4e38), (1e20, 3e20), (0.0, 1e30)] {
        let stored = |p: [f64; 3]| low * (1.0 - smooth(p)) + high * smooth(p);
        let volume = Volume::new(oblique(dims), fill::<f32>(dims, &stored)).unwrap();
        check_range(&format!("f32 from {low} to {high}"), &volume, low, high);
    }
}

#[test]
fn numbers_at_the_ends_of_f64() {
    let dims = [9, 8, 10];
    for (low, high) in [(0.0, 1e300), (-1e300, 1e300), (-1.7e308, 1.7e308), (0.0, 1e-300), (1e300, 1.0001e300), (1e9, 1e9 + 1.0)] {
        if high - low == f64::INFINITY {
            // Wider than f64 itself: the slow picture overflows, but the fast one must not fail.
            let stored = |p: [f64; 3]| low * (1.0 - smooth(p)) + high * smooth(p);
            let volume = Volume::new(oblique(dims), fill::<f64>(dims, &stored)).unwrap();
            let (picture, _) = render(&volume, &scene(&volume, telling(low, high), Blend::Over));
            assert!(picture.pixels().iter().flatten().all(|c| c.is_finite()));
            continue;
        }
        let stored = |p: [f64; 3]| low * (1.0 - smooth(p)) + high * smooth(p);
        let volume = Volume::new(oblique(dims), fill::<f64>(dims, &stored)).unwrap();
        check_range(&format!("f64 from {low} to {high}"), &volume, low, high);
    }
}

#[test]
fn a_constant_volume_has_its_value_whatever_its_size() {
    for value in [0.0, 1e38, -3e38, 1e300, -1e300, 16_777_217.25, 1e-310] {
        let transfer = TransferFunction::new(vec![(value, [0.25, 0.5, 0.75])], vec![(value, 0.5)]).unwrap();
        let volume = Volume::new(oblique([4, 4, 4]), Voxels::F64(vec![value; 64].into())).unwrap();
        for blend in BLENDS {
            let scene = scene(&volume, transfer.clone(), blend);
            let e = difference(&render(&volume, &scene).0, &Oracle::new(&volume, &scene).picture());
            assert!(e < 3e-5, "{value}, {blend:?}: {e}");
        }
    }
}

#[test]
fn a_step_in_opacity_is_one_wherever_it_stands() {
    // Steps at the first and last point of all, at one point alone, in the middle; data on both sides.
    let dims = [8, 8, 8];
    let half = |[x, ..]: [f64; 3]| if x < 0.0 { -1.0 } else { 2.0 };
    let volume = Volume::new(oblique(dims), fill::<f32>(dims, &half)).unwrap();
    let color = |at: f64| vec![(at, [1.0, 0.5, 0.2])];
    for (what, color, opacity) in [
        ("alone", color(0.0), vec![(0.0, 0.0), (0.0, 0.4)]),
        ("first", color(0.5), vec![(0.0, 0.0), (0.0, 0.4), (1.0, 0.1)]),
        ("last", color(-0.5), vec![(-0.5, 0.1), (1.0, 0.4), (1.0, 0.0)]),
        ("middle", vec![(-1.0, [0.0; 3]), (2.0, [1.0; 3])], vec![(0.0, 0.0), (0.0, 0.4)]),
    ] {
        let transfer = TransferFunction::new(color, opacity).unwrap();
        let scene = scene(&volume, transfer, Blend::Over);
        let e = difference(&render(&volume, &scene).0, &Oracle::new(&volume, &scene).picture());
        // A table rises over an interval where the function steps.
        assert!(e < 0.02, "step {what}: {e}");
    }
}

#[test]
fn a_narrow_spike_is_kept_in_slabs_of_any_thickness() {
    // One value in 500 is faintly opaque; thousands of thin slabs, each next to nothing, add up.
    let dims = [20, 20, 20];
    let volume = Volume::new(oblique(dims), fill::<f32>(dims, &|[x, ..]| 500.0 + 500.0 * x)).unwrap();
    let spike = vec![(399.5, 0.0), (400.2, 0.9), (400.9, 0.0)];
    let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.2]), (1000.0, [1.0, 0.5, 0.2])], spike).unwrap();
    for count in [20_000, 2000] {
        let scene = Scene::new(transfer.clone()).with_camera(orbit(65.0, -25.0, 1.2, PARALLEL)).with_size(4, 4).unwrap();
        let scene = scene.with_slices(Slicing::Count(count)).unwrap().with_opacity_unit(0.1).unwrap().with_terminate(0.0).unwrap();
        let want = Oracle::new(&volume, &scene).picture();
        let e = difference(&render(&volume, &scene).0, &want);
        assert!(e < 2e-3 && want.iter().any(|p| p[3] > 0.02), "{count} slices: {e}, {want:?}");
    }
}
