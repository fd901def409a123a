#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use crate::reference::Integrator;
use crate::scene::{Camera, Method, Placement, Projection, TransferFunction};
use crate::volume::{Grid, Voxels};
use glam::DVec3;

fn noise(i: usize) -> f64 {
    (i.wrapping_mul(2_654_435_761) >> 8) as f64 % 2001.0 / 1000.0 - 1.0
}

fn volume(dims: [usize; 3], value: impl Fn(usize) -> f64) -> Volume {
    let values: Vec<f64> = (0..dims.iter().product()).map(value).collect();
    Volume::new(Grid::with_spacing(dims, [1.0, 0.7, 1.3]).unwrap(), Voxels::F64(values.into())).unwrap()
}

fn transfer() -> TransferFunction {
    TransferFunction::new(
        vec![(-1.0, [0.1, 0.2, 1.0]), (0.0, [0.2, 0.9, 0.4]), (1.0, [1.0, 0.3, 0.1])],
        vec![(-0.8, 0.0), (-0.2, 0.3), (0.1, 0.05), (0.9, 0.6)],
    )
    .unwrap()
}

fn scene(filter: Filter) -> Scene {
    Scene::new(transfer()).with_size(9, 7).unwrap().with_method(Method::default().with_filter(filter)).unwrap()
}

fn spline(volume: &Volume, filter: Filter) -> Spline {
    Spline::of(&scene(filter), volume).unwrap().unwrap()
}

/// The spline at index coordinates `p`, clamped, by its sum over all voxels: a basis function for each, mirrored at both ends.
fn direct(spline: &Spline, p: [f64; 3]) -> f64 {
    let bump = |d: f64| {
        let d = d.abs();
        if d < 1.0 { (4.0 - 6.0 * d * d + 3.0 * d * d * d) / 6.0 } else { (2.0 - d).max(0.0).powi(3) / 6.0 }
    };
    let weight = |axis: usize, k: usize| {
        let last = (spline.dims[axis] - 1) as f64;
        let (x, k) = (p[axis].clamp(0.0, last), k as f64);
        if last == 0.0 {
            return 1.0;
        }
        let before = if k > 0.0 { bump(x + k) } else { 0.0 };
        bump(x - k) + before + if k < last { bump(x - (2.0 * last - k)) } else { 0.0 }
    };
    let [nx, ny, _] = spline.dims;
    let each = spline.coefficients.iter().enumerate();
    each.map(|(i, c)| c * weight(0, i % nx) * weight(1, i / nx % ny) * weight(2, i / (nx * ny))).sum()
}

#[test]
fn polynomials_along_pieces_are_the_sum_over_all_voxels() {
    for (dims, filter) in [([7, 6, 5], Filter::CUBIC), ([2, 1, 4], Filter::CUBIC), ([5, 4, 3], Filter::Cubic { prefilter: false })] {
        let spline = spline(&volume(dims, noise), filter);
        for i in 0..60usize {
            let low: [i64; 3] = std::array::from_fn(|a| (i * (7 + 3 * a)) as i64 % (dims[a] as i64 + 1) - 1);
            let place = [0, 1, 2].map(|a| 0.5 + 0.5 * noise(6 * i + a));
            let step = [0, 1, 2].map(|a| (0.5 + 0.5 * noise(6 * i + 3 + a)) - place[a]);
            let (field, least, most) = spline.along(low, place, step, None).unwrap();
            for s in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let p: [f64; 3] = std::array::from_fn(|a| low[a] as f64 + place[a] + s * step[a]);
                let want = direct(&spline, p);
                assert!((field.at(s) - want).abs() < 1e-12, "{dims:?} {p:?}: {} not {want}", field.at(s));
                assert!(least - 1e-12 <= want && want <= most + 1e-12);
                let h = 1e-6;
                if s > 0.0 && s < 1.0 {
                    assert!(((field.at(s + h) - field.at(s - h)) / (2.0 * h) - field.slope(s)).abs() < 1e-7);
                }
                for axis in 0..3 {
                    let (slope, ..) = spline.along(low, place, step, Some(axis)).unwrap();
                    let moved = |h: f64| direct(&spline, std::array::from_fn(|a| if a == axis { p[a] + h } else { p[a] }));
                    let difference = (moved(h) - moved(-h)) / (2.0 * h);
                    assert!((slope.at(s) - difference).abs() < 1e-5, "{dims:?} {p:?} axis {axis}: {} not {difference}", slope.at(s));
                }
            }
        }
    }
}

#[test]
fn prefiltered_coefficients_go_through_the_voxels() {
    for dims in [[9, 8, 7], [1, 2, 3], [3, 1, 1], [40, 2, 2]] {
        let spline = spline(&volume(dims, noise), Filter::CUBIC);
        for i in 0..dims.iter().product() {
            let p = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])].map(|x| x as f64);
            assert!((direct(&spline, p) - noise(i)).abs() < 1e-12, "{dims:?} {p:?}");
        }
    }
}

/// The places that the search finds are those that a fine comb finds.
#[test]
fn every_turn_is_found() {
    let mut most = 0;
    for case in 0..400usize {
        let mut c = [0.0; DEGREE + 1];
        if case % 2 == 0 {
            // The product of factors with known zeros, as the derivative.
            let mut slope = [0.0; DEGREE + 1];
            slope[0] = 1.0 + case as f64;
            for root in 0..1 + case / 2 % 8 {
                let zero = 0.04 + 0.115 * root as f64 + 0.02 * noise(8 * case + root);
                for i in (0..=DEGREE).rev() {
                    slope[i] = if i > 0 { slope[i - 1] } else { 0.0 } - zero * slope[i];
                }
            }
            (1..=DEGREE).for_each(|i| c[i] = slope[i - 1] / i as f64);
        } else {
            c.iter_mut().enumerate().for_each(|(i, c)| *c = noise(10 * case + i) * if i % 2 == 0 { 1.0 } else { -2.0 });
        }
        let field = Nonic(c);
        let found: Vec<f64> = field.turns().iter().collect();
        most = most.max(found.len());
        assert!(found.windows(2).all(|w| w[0] <= w[1]));
        const COMB: usize = 2000;
        let sign = |i: usize| field.slope((i as f64 + 0.5) / COMB as f64) < 0.0;
        let comb: Vec<f64> = (1..COMB).filter(|&i| sign(i) != sign(i - 1)).map(|i| i as f64 / COMB as f64).collect();
        for at in &comb {
            assert!(found.iter().any(|s| (s - at).abs() <= 1.0 / COMB as f64), "case {case}: turn near {at}, found {found:?}");
        }
        assert!(found.len() <= comb.len() + 2, "case {case}: {found:?}, not {comb:?}");
    }
    assert_eq!(most, 8, "the hardest case was in it");
    assert_eq!(Nonic([3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).turns().iter().count(), 0);
}

/// The integral is the limit of sums over very many short pieces of the directly summed spline.
#[test]
fn integrals_are_the_limit_of_sums() {
    let volume = volume([6, 5, 4], noise);
    let place = Placement::LookAt { eye: DVec3::new(20.0, 7.0, 9.0), target: volume.grid().center(), up: DVec3::Z };
    let camera = Camera::new(place, Projection::Perspective { fov_y: 15.0 }).unwrap();
    for filter in [Filter::CUBIC, Filter::Cubic { prefilter: false }] {
        let scene = scene(filter).with_camera(camera);
        let (integrator, spline) = (Integrator::new(&scene, &volume).unwrap(), spline(&volume, filter));
        let linear = Integrator::new(&scene.clone().with_method(Method::default()).unwrap(), &volume).unwrap();
        for (x, y) in [(4.5, 3.5), (2.1, 2.9)] {
            let ray = integrator.ray(x, y);
            assert!(ray.error_bound < 1e-10, "{}", ray.error_bound);
            let (entry, exit) = ray.span.unwrap();
            let (origin, direction) = integrator.view().ray(x, y);
            let sum = |pieces: usize| {
                let length = (exit - entry) / pieces as f64;
                let (mut rgb, mut left) = ([0.0; 3], 1.0);
                for i in 0..pieces {
                    let at = origin + direction * (entry + (i as f64 + 0.5) * length);
                    let value = direct(&spline, volume.grid().world_to_index().transform_point3(at).to_array());
                    let straight = transfer().eval(value);
                    let reference = scene.transfer().opacity_length(volume.grid());
                    let alpha = 1.0 - libm::pow(1.0 - straight.alpha, length * direction.length() / reference);
                    (0..3).for_each(|c| rgb[c] += left * alpha * straight.rgb[c]);
                    left *= 1.0 - alpha;
                }
                [rgb[0], rgb[1], rgb[2], left]
            };
            let (coarse, fine) = (sum(1000), sum(2000));
            let mut apart = 0.0f64;
            for (c, got) in [ray.rgb[0], ray.rgb[1], ray.rgb[2], ray.transmittance].into_iter().enumerate() {
                // The error falls with the square of the number.
                let limit = fine[c] + (fine[c] - coarse[c]) / 3.0;
                assert!((got - limit).abs() < 2e-6, "{filter:?} ({x},{y}) {c}: {got} not {limit}");
                apart = apart.max(
                    (got - [linear.ray(x, y).rgb[0], linear.ray(x, y).rgb[1], linear.ray(x, y).rgb[2], linear.ray(x, y).transmittance][c])
                        .abs(),
                );
            }
            assert!(apart > 1e-3, "the trilinear field would do as well");
        }
    }
}

#[test]
fn cells_that_mix_a_voxel_that_is_not_finite_are_left_out() {
    let dims = [9, 8, 7];
    for filter in [Filter::CUBIC, Filter::Cubic { prefilter: false }] {
        let spline = spline(&volume(dims, |i| if i == (3 * 8 + 4) * 9 + 4 { f64::NAN } else { noise(i) }), filter);
        for i in 0..dims.iter().product::<usize>() {
            let low = [i % 9, i / 9 % 8, i / 72].map(|x| x as i64 - 1);
            let mixes = low.iter().zip([4, 4, 3]).zip(dims).all(|((&low, hole), n)| {
                let cell = low.clamp(0, n as i64 - 2);
                (cell - 1..=cell + 2).contains(&hole)
            });
            assert_eq!(spline.along(low, [0.5; 3], [0.1; 3], None).is_none(), mixes, "{low:?}");
        }
        assert!(spline.coefficients.iter().all(|c| c.is_nan() || c.abs() < 30.0));
    }
}
