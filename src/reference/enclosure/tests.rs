//! Bounds against closed forms, and against the integrator, which shares no code with them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::super::{Integrator, closed};
use super::*;
use crate::scene::{Camera, ClipPlane, FogDistance, FogMode, Placement, Projection, Straight, TransferFunction};
use crate::volume::phantom::Phantom;
use crate::volume::{BoxConvention, Grid, Voxels};
use glam::{DMat3, DQuat};

/// Repeatable random numbers in `[0,1)`.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }

    fn direction(&mut self) -> DVec3 {
        let v = DVec3::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(-1.0, 1.0));
        if v.length() > 0.1 { v.normalize() } else { DVec3::new(0.6, 0.0, 0.8) }
    }
}

fn transfer(color: &[(f64, [f64; 3])], opacity: &[(f64, f64)]) -> TransferFunction {
    TransferFunction::new(color.to_vec(), opacity.to_vec()).unwrap()
}

fn gray(opacity: &[(f64, f64)]) -> TransferFunction {
    transfer(&[(0.0, [0.9, 0.5, 0.1])], opacity)
}

/// Values along x, the same for every y and z.
fn line(values: &[f64], convention: BoxConvention) -> Volume {
    let n = values.len();
    let grid = Grid::with_spacing([n, 3, 3], [1.0; 3]).unwrap().with_convention(convention);
    Volume::new(grid, Voxels::F64((0..9 * n).map(|i| values[i % n]).collect())).unwrap()
}

/// A picture of one pixel, seen along x through the middle.
fn scene(volume: &Volume, transfer: TransferFunction) -> Scene {
    let c = volume.grid().center();
    let placement = Placement::LookAt { eye: c - DVec3::X * 50.0, target: c, up: DVec3::Z };
    let camera = Camera::new(placement, Projection::Orthographic { height: Some(1.0) }).unwrap();
    Scene::new(transfer).with_camera(camera).with_size(1, 1).unwrap()
}

fn holds([lo, hi]: [f64; 2], x: f64, what: &str) {
    // The closed forms themselves are right to rounding alone.
    assert!(lo <= x + 1e-14 && x - 1e-14 <= hi, "{what}: {x} not within {lo} to {hi}");
}

/// The bounds of the one pixel, which are as close as asked.
fn close(scene: &Scene, volume: &Volume, width: f64) -> Enclosure {
    let found = Prover::new(scene, volume).unwrap().pixel(0, 0, width);
    assert!(found.width <= width, "{found:?}");
    found
}

#[test]
fn closed_forms_lie_within() {
    for width in [1e-3, 1e-6, 1e-10] {
        for (a, n) in [(0.1, 5), (0.5, 1), (0.999_999, 7), (1e-9, 4)] {
            let volume = line(&vec![0.3; n], BoxConvention::Cells);
            let found = close(&scene(&volume, gray(&[(0.3, a)])), &volume, width);
            let tau = closed::extinction(a, 1.0) * n as f64;
            holds(found.transmittance, 1.0 - closed::equal_slices(a, n as u64), "transmittance");
            holds(found.rgb[0], closed::constant_color(0.9, tau), "red");
        }
        // Extinction along a ramp of opacity, and to an opacity of exactly 1, where it is infinite.
        for (a0, a1) in [(0.0, 0.9), (0.7, 0.1), (0.2, 1.0), (1.0, 0.3)] {
            let volume = line(&[0.0, 2.0], BoxConvention::Nodes);
            let unit = scene(&volume, gray(&[(0.0, a0), (2.0, a1)])).with_opacity_unit(0.4).unwrap();
            let tau = closed::opacity_ramp_depth(a0, a1, 1.0 / 0.4);
            let found = close(&unit, &volume, width);
            holds(found.transmittance, libm::exp(-tau), "ramp");
            holds(found.rgb[2], closed::constant_color(0.1, tau), "ramp's blue");
        }
        // Colours along a constant extinction.
        for (a, unit) in [(1e-6, 1.0), (0.3, 1.0), (0.99, 1e-3), (0.5, 1e-7)] {
            let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
            let colors = transfer(&[(0.0, [0.1, 0.9, 0.5]), (1.0, [0.8, 0.2, 0.5])], &[(0.0, a)]);
            let found = close(&scene(&volume, colors).with_opacity_unit(unit).unwrap(), &volume, width);
            let tau = closed::extinction(a, unit);
            for (got, (c0, c1)) in found.rgb.iter().zip([(0.1, 0.8), (0.9, 0.2), (0.5, 0.5)]) {
                holds(*got, closed::linear_color(c0, c1, tau), "color");
            }
        }
    }
}

#[test]
fn steps_spikes_walls_and_touches_are_enclosed() {
    let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
    let step = close(&scene(&volume, gray(&[(0.25, 0.0), (0.25, 0.6)])), &volume, 1e-9);
    holds(step.transmittance, libm::pow(0.4, 0.75), "step");
    // The spike's own place is known to rounding alone, which its opacity unit makes a million times as much.
    let spike = scene(&volume, gray(&[(0.7 - 1e-6, 0.0), (0.7, 0.8), (0.7 + 1e-6, 0.0)])).with_opacity_unit(1e-6).unwrap();
    let want = libm::exp(-2.0 * closed::opacity_ramp_depth(0.0, 0.8, 1.0));
    let [lo, hi] = close(&spike, &volume, 1e-4).transmittance;
    assert!(lo <= want + 1e-9 && want <= hi + 1e-9, "{want}: {lo} {hi}");
    // A wall shows its first colour and hides what is behind it.
    let wall = transfer(&[(0.0, [0.0, 0.2, 0.4]), (1.0, [1.0, 0.2, 0.9])], &[(0.5, 0.0), (0.5, 1.0)]);
    let found = close(&scene(&volume, wall), &volume, 1e-9);
    assert_eq!(found.transmittance, [0.0, 0.0]);
    for (got, want) in found.rgb.iter().zip([0.5, 0.2, 0.65]) {
        holds(*got, want, "wall");
    }
    // Fields that only touch an opacity of 1: at the box's face, and within it at a voxel's plane.
    let touch = scene(&volume, gray(&[(0.0, 0.0), (1.0, 1.0)]));
    holds(close(&touch, &volume, 1e-9).transmittance, libm::exp(-1.0), "touch");
    let tent = line(&[0.0, 1.0, 0.0], BoxConvention::Nodes);
    holds(close(&scene(&tent, gray(&[(0.0, 0.0), (1.0, 1.0)])), &tent, 1e-9).transmittance, libm::exp(-2.0), "tent");
    let step = scene(&tent, gray(&[(1.0, 0.0), (1.0, 1.0)]));
    assert_eq!(close(&step, &tent, 1e-9).transmittance, [1.0, 1.0], "a step that is touched at one place");
    // A field that stays at the step is on its right-hand side.
    let flat = line(&[1.0, 1.0], BoxConvention::Nodes);
    assert_eq!(close(&scene(&flat, gray(&[(1.0, 0.0), (1.0, 1.0)])), &flat, 1e-9).transmittance, [0.0, 0.0]);
}

#[test]
fn voxels_without_a_number_are_transparent() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let volume = line(&[1.0, 1.0, bad, 1.0, 1.0, 1.0], BoxConvention::Cells);
        holds(close(&scene(&volume, gray(&[(0.0, 0.3)])), &volume, 1e-9).transmittance, 0.7f64.powi(4), "around a bad voxel");
    }
    let volume = line(&[f64::NAN], BoxConvention::Cells);
    assert_eq!(close(&scene(&volume, gray(&[(0.0, 1.0)])), &volume, 1e-9).transmittance, [1.0, 1.0]);
}

#[test]
fn fog_and_background_have_their_closed_forms() {
    let volume = line(&[0.0; 10], BoxConvention::Cells);
    let back = Straight { rgb: [0.2, 0.6, 1.0], alpha: 0.5 };
    let plain = scene(&volume, gray(&[(0.0, 0.2)])).with_background(back).unwrap();
    let kappa = closed::extinction(0.2, 1.0);
    let all = closed::opacity(kappa * 10.0);
    let fogged = |mode| {
        let fog = Fog::new(mode, [0.2, 0.4, 0.6]).unwrap();
        close(&plain.clone().with_fog(Some(fog)), &volume, 1e-8)
    };
    // The box reaches from depth 45 to 55.
    let rho = 0.03;
    let shown = libm::exp(-45.0 * rho) * kappa / (kappa + rho) * closed::opacity((kappa + rho) * 10.0);
    let found = fogged(FogMode::Exp { density: rho });
    for (got, (own, fog)) in found.rgb.iter().zip([(0.9, 0.2), (0.5, 0.4), (0.1, 0.6)]) {
        holds(*got, own * shown + fog * (all - shown), "exp");
    }
    holds(found.pixel[2], 0.1 * shown + 0.6 * (all - shown) + (1.0 - all) * 0.5, "blue over the background");
    holds(found.pixel[3], 1.0 - 0.5 * (1.0 - all), "alpha over the background");
    let found = fogged(FogMode::Linear { start: 47.0, end: 50.0 });
    let t2 = libm::exp(-2.0 * kappa);
    let shown = 1.0 - t2 + t2 * closed::linear_color(1.0, 0.0, 3.0 * kappa);
    holds(found.rgb[0], 0.9 * shown + 0.2 * (all - shown), "linear");
    let t5 = 1.0 - libm::exp(-5.0 * kappa);
    holds(fogged(FogMode::Linear { start: 50.0, end: 50.0 }).rgb[0], 0.9 * t5 + 0.2 * (all - t5), "start = end");
}

#[test]
fn what_has_no_bounds_is_refused_in_one_line() {
    let volume = line(&[0.0], BoxConvention::Cells);
    let plain = scene(&volume, gray(&[(0.0, 0.2)]));
    let refused = |scene: &Scene, want: &str| {
        let line = Prover::new(scene, &volume).unwrap_err().to_string();
        assert!(line.starts_with(want) && line.lines().count() == 1, "{line}");
    };
    let literal = Fog::new(FogMode::Exp { density: 1.0 }, [0.5; 3]).unwrap().with_weighting(FogWeighting::Literal);
    refused(&plain.clone().with_fog(Some(literal)), "fog weighting literal");
    refused(&plain.clone().with_blend(Blend::Mip).unwrap(), "render blend");
    refused(&plain.clone().with_linear_light(true).unwrap(), "render linear_light");
    refused(&plain.clone().with_lighting(Some(crate::scene::Lighting::default())).unwrap(), "light");
    refused(&plain.clone().with_method(crate::scene::Method::default().with_filter(Filter::CUBIC)).unwrap(), "render filter");
    refused(&plain.clone().with_opengl(crate::scene::OpenGl::default()).unwrap(), "render profile opengl");
    let by_gradient = gray(&[(0.0, 0.2)]).with_gradient_opacity(vec![(0.0, 0.0), (1.0, 1.0)]).unwrap();
    refused(&plain.with_transfer(by_gradient), "transfer gradient_opacity");
}

/// Holds the bounds of a pixel against the integrator's number with its own bound, and against wider bounds. The width reached.
fn held(scene: &Scene, volume: &Volume, (x, y): (u32, u32), (widths, rounding): ([f64; 2], f64), what: &str) -> f64 {
    let prover = Prover::new(scene, volume).unwrap();
    let (_, ray) = Integrator::new(scene, volume).unwrap().pixel(x, y);
    let [wide, narrow] = widths.map(|width| prover.pixel(x, y, width));
    // The integrator's bound is for the integral of the values that it has, which are right to the rounding of f64.
    let off = ray.error_bound + rounding;
    for found in [&wide, &narrow] {
        for (bounds, number) in found.rgb.iter().chain([&found.transmittance]).zip(ray.rgb.iter().chain([&ray.transmittance])) {
            assert!(bounds[0] <= number + off && number - off <= bounds[1], "{what}, pixel {x},{y}: {number} +- {off}, {found:?}");
        }
    }
    for (a, b) in wide
        .rgb
        .iter()
        .chain(&wide.pixel)
        .chain([&wide.transmittance])
        .zip(narrow.rgb.iter().chain(&narrow.pixel).chain([&narrow.transmittance]))
    {
        assert!(a[0] <= b[1] && b[0] <= a[1], "{what}, pixel {x},{y}: {a:?} {b:?}");
    }
    narrow.width
}

#[test]
fn phantoms_meet_the_integrator() {
    for phantom in Phantom::ALL {
        let volume = phantom.volume(24).unwrap();
        let plain = Scene::new(phantom.default_transfer(24)).with_size(9, 9).unwrap();
        for (azimuth, elevation) in [(0.0, 0.0), (30.0, 20.0), (45.0, 0.0), (90.0, 90.0)] {
            let scene = plain.clone().with_camera(Camera::orbit(azimuth, elevation).unwrap());
            for y in [1, 4, 6] {
                for x in [2, 4, 7] {
                    let width = held(&scene, &volume, (x, y), ([1e-2, 1e-5], 1e-12), phantom.name());
                    assert!(width <= 1e-5, "{} from {azimuth}, {elevation}: {width} at {x},{y}", phantom.name());
                }
            }
        }
    }
}

/// A table that is hard on quadrature: steps, spikes, opacities of 0 and of 1 and next to both.
fn stiff(r: &mut Random, low: f64, high: f64) -> TransferFunction {
    let mut opacity = Vec::new();
    let mut value = low;
    let number = |r: &mut Random| match r.below(7) {
        0 | 1 => 0.0,
        2 => 1.0,
        3 => 1.0 - 1e-12,
        4 => 1e-9,
        _ => r.next(),
    };
    for _ in 0..2 + r.below(4) {
        value += (high - low) * 0.25 * r.next();
        match r.below(3) {
            0 => {
                let (before, after) = (number(r), number(r));
                opacity.extend([(value, before), (value, after)]);
            }
            1 => {
                let most = number(r);
                opacity.extend([(value, 0.0), (value + 5e-7, most), (value + 1e-6, 0.0)]);
            }
            _ => opacity.push((value, number(r))),
        }
    }
    opacity.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut color: Vec<(f64, [f64; 3])> = (0..4).map(|_| (r.within(low, high), [r.next(), r.next(), r.next()])).collect();
    if r.below(2) == 0 {
        color[1].0 = color[0].0;
    }
    color.sort_by(|a, b| a.0.total_cmp(&b.0));
    TransferFunction::new(color, opacity).unwrap()
}

/// A small volume of whole numbers, some of its voxels equal, sometimes one of them NaN.
fn small_volume(r: &mut Random) -> Volume {
    let dims: [usize; 3] = std::array::from_fn(|_| 1 + r.below(5));
    let convention = if r.below(2) == 0 { BoxConvention::Cells } else { BoxConvention::Nodes };
    let grid = if r.below(2) == 0 {
        Grid::with_spacing(dims, [1.0, 1.0, 2.0]).unwrap()
    } else {
        let turn = DMat3::from_quat(DQuat::from_axis_angle(r.direction(), r.within(0.0, 3.0)));
        Grid::new(dims, DVec3::new(r.within(-5.0, 5.0), 1.0, 3.0), turn).unwrap()
    };
    let mut values: Vec<f64> = (0..dims.iter().product()).map(|_| if r.below(3) == 0 { 50.0 } else { r.below(101) as f64 }).collect();
    if r.below(4) == 0 {
        values[0] = f64::NAN;
    }
    let volume = Volume::new(grid.with_convention(convention), Voxels::F64(values.into())).unwrap();
    if r.below(2) == 0 { volume } else { volume.with_rescale(0.5, -20.0).unwrap() }
}

/// A camera in a place that is hard on geometry: rays along axes and through voxels, an eye in a corner, on a face, or anywhere.
fn hard_camera(r: &mut Random, volume: &Volume) -> Option<Camera> {
    let grid = volume.grid();
    let (center, radius) = (grid.center(), grid.radius().max(1.0));
    let axes = grid.index_to_world().matrix3;
    let (target, eye) = match r.below(4) {
        // Along an index axis.
        0 => {
            let axis = [axes.x_axis, axes.y_axis, axes.z_axis][r.below(3)];
            let voxel = grid.index_to_world().transform_point3(DVec3::new(r.below(2) as f64, r.below(2) as f64, r.below(2) as f64));
            (voxel, voxel - axis * 8.0)
        }
        // In a corner of the box.
        1 => (center, grid.corners()[r.below(8)]),
        // On a voxel.
        2 => (center + r.direction(), grid.origin()),
        _ => (center + r.direction() * 0.3, center + r.direction() * radius * r.within(0.2, 3.0)),
    };
    let up = if r.below(2) == 0 { axes.z_axis } else { DVec3::new(0.3, 0.5, 0.8) };
    let projection = if r.below(2) == 0 {
        // Pixels a whole voxel, or half of one, apart.
        Projection::Orthographic { height: Some([8.0, 4.0, radius][r.below(3)]) }
    } else {
        Projection::Perspective { fov_y: [90.0, 40.0][r.below(2)] }
    };
    Camera::new(Placement::LookAt { eye, target, up }, projection).ok()
}

#[test]
fn hard_scenes_meet_the_integrator() {
    let mut r = Random(99);
    let (mut seen, mut reached) = (0, 0);
    for case in 0..600 {
        let volume = small_volume(&mut r);
        let Some(camera) = hard_camera(&mut r, &volume) else { continue };
        let (low, high) = (volume.rescale().1, 100.0 * volume.rescale().0 + volume.rescale().1);
        let mut scene = Scene::new(stiff(&mut r, low, high)).with_camera(camera).with_size(8, 8).unwrap();
        scene = scene.with_opacity_unit([1.0, 0.1, 1e-4, 30.0][r.below(4)]).unwrap();
        if r.below(3) == 0 {
            let normal = if r.below(2) == 0 { DVec3::X } else { r.direction() };
            let through = volume.grid().index_to_world().transform_point3(DVec3::ONE);
            scene = scene.with_clip_planes(vec![ClipPlane::new(normal, normal.dot(through)).unwrap()]).unwrap();
        }
        if r.below(2) == 0 {
            let mode = match r.below(3) {
                0 => FogMode::Linear { start: r.within(0.0, 8.0), end: r.within(0.0, 12.0) },
                1 => FogMode::Exp { density: r.next() },
                _ => FogMode::Exp2 { density: r.next() },
            };
            let distance = [FogDistance::Planar, FogDistance::Radial][r.below(2)];
            scene = scene.with_fog(Some(Fog::new(mode, [r.next(), 0.5, 0.1]).unwrap().with_distance(distance)));
        }
        for _ in 0..2 {
            let at = (r.below(8) as u32, r.below(8) as u32);
            // Steps and spikes 1e-6 wide make a million times of what rounding does to a value.
            let width = held(&scene, &volume, at, ([1e-1, 1e-4], 1e-8), &format!("case {case}"));
            seen += 1;
            reached += u32::from(width <= 1e-4);
        }
    }
    // The rest lies along faces where steps, walls or NaN begin, which rounding hides.
    assert!(seen > 1000 && reached * 100 > seen * 95, "{reached} of {seen}");
}
