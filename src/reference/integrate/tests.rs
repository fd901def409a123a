#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::super::closed;
use super::*;
use crate::scene::{Camera, ClipPlane, Placement, Projection, Straight, TransferFunction};
use crate::volume::{BoxConvention, Grid, Voxels};
use glam::{DMat3, DQuat};

/// Repeatable random numbers in `[0,1)`.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        let v = DVec3::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(-1.0, 1.0));
        if v.length() > 0.1 { v.normalize() } else { DVec3::new(0.6, 0.0, 0.8) }
    }
}

fn gray(points: &[(f64, f64)]) -> TransferFunction {
    TransferFunction::new(vec![(0.0, [0.9, 0.5, 0.1])], points.to_vec()).unwrap()
}

/// A camera that looks along +x at the middle of the picture of a single pixel.
fn along_x(volume: &Volume) -> Camera {
    let c = volume.grid().center();
    let placement = Placement::LookAt { eye: c - DVec3::X * 50.0, target: c, up: DVec3::Z };
    Camera::new(placement, Projection::Orthographic { height: Some(1.0) }).unwrap()
}

fn scene(volume: &Volume, transfer: TransferFunction) -> Scene {
    Scene::new(transfer).with_camera(along_x(volume)).with_size(1, 1).unwrap()
}

fn pixel(scene: &Scene, volume: &Volume) -> RayResult {
    let ray = Integrator::new(scene, volume).unwrap().pixel(0, 0).1;
    assert!(ray.error_bound < 1e-10, "{ray:?}");
    ray
}

/// Values along x, the same for every y and z.
fn line(values: &[f64], convention: BoxConvention) -> Volume {
    let n = values.len();
    let grid = Grid::with_spacing([n, 3, 3], [1.0; 3]).unwrap().with_convention(convention);
    Volume::new(grid, Voxels::F64((0..9 * n).map(|i| values[i % n]).collect())).unwrap()
}

fn close(got: f64, want: f64, what: &str) {
    assert!((got - want).abs() < 1e-10, "{what}: {got} for {want}");
}

#[test]
fn constant_fields_meet_the_exponential() {
    for (a, n) in [(0.1, 5), (0.5, 1), (0.999_999, 7), (1e-9, 4)] {
        let volume = line(&vec![0.3; n], BoxConvention::Cells);
        let ray = pixel(&scene(&volume, gray(&[(0.3, a)])), &volume);
        let tau = closed::extinction(a, 1.0) * n as f64;
        close(ray.transmittance, 1.0 - closed::equal_slices(a, n as u64), "transmittance");
        close(ray.rgb[0], closed::constant_color(0.9, tau), "red");
        assert_eq!(ray.span, Some((50.0 - n as f64 / 2.0, 50.0 + n as f64 / 2.0)));
    }
    // Half the reference length is twice the way.
    let volume = line(&[0.3; 4], BoxConvention::Nodes);
    let halved = scene(&volume, gray(&[(0.3, 0.2)])).with_opacity_unit(0.5).unwrap();
    close(pixel(&halved, &volume).transmittance, 0.8f64.powi(6), "six half units of three");
}

#[test]
fn ramps_of_opacity_meet_their_closed_form() {
    for (a0, a1) in [(0.0, 0.9), (0.7, 0.1), (0.2, 1.0), (1.0, 0.3), (0.0, 1.0 - 1e-12)] {
        let volume = line(&[0.0, 2.0], BoxConvention::Nodes);
        let unit = scene(&volume, gray(&[(0.0, a0), (2.0, a1)])).with_opacity_unit(0.4).unwrap();
        let tau = closed::opacity_ramp_depth(a0, a1, 1.0 / 0.4);
        let ray = pixel(&unit, &volume);
        close(ray.transmittance, libm::exp(-tau), "transmittance");
        close(ray.rgb[2], closed::constant_color(0.1, tau), "blue");
        // By cells there is half a voxel of each end value more; opacity 1 there is a wall.
        let volume = line(&[0.0, 2.0], BoxConvention::Cells);
        let unit = scene(&volume, gray(&[(0.0, a0), (2.0, a1)])).with_opacity_unit(0.4).unwrap();
        let ends = closed::extinction(a0, 0.4) * 0.5 + closed::extinction(a1, 0.4) * 0.5;
        close(pixel(&unit, &volume).transmittance, libm::exp(-tau - ends), "with half cells");
    }
}

#[test]
fn colors_along_a_constant_extinction_meet_their_closed_form() {
    for a in [1e-6, 0.3, 0.99, 1.0 - 1e-13] {
        let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
        let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.9, 0.5]), (1.0, [0.8, 0.2, 0.5])], vec![(0.0, a)]).unwrap();
        for unit in [1.0, 1e-3, 1e-7] {
            let ray = pixel(&scene(&volume, transfer.clone()).with_opacity_unit(unit).unwrap(), &volume);
            let tau = closed::extinction(a, unit);
            for (got, (c0, c1)) in ray.rgb.iter().zip([(0.1, 0.8), (0.9, 0.2), (0.5, 0.5)]) {
                close(*got, closed::linear_color(c0, c1, tau), "color");
            }
        }
    }
}

#[test]
fn steps_spikes_and_walls() {
    // A step at 0.25: the ray of slope 1 is clear up to there.
    let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
    let step = pixel(&scene(&volume, gray(&[(0.25, 0.0), (0.25, 0.6)])), &volume);
    close(step.transmittance, libm::pow(0.4, 0.75), "step");
    // A triangle of width 2e-6 around 0.7: twice the ramp from 0 to 0.8 over 1e-6.
    let spike = scene(&volume, gray(&[(0.7 - 1e-6, 0.0), (0.7, 0.8), (0.7 + 1e-6, 0.0)])).with_opacity_unit(1e-6).unwrap();
    let want = libm::exp(-2.0 * closed::opacity_ramp_depth(0.0, 0.8, 1.0));
    // The spike's own place is only known to 1e-16 of 0.7.
    assert!((pixel(&spike, &volume).transmittance - want).abs() < 1e-9);
    // A rise and fall in one cell's length crosses the spike twice.
    let volume = line(&[0.0, 1.0, 0.0], BoxConvention::Nodes);
    assert!((pixel(&spike, &volume).transmittance - want * want).abs() < 1e-9);
    // One whose peak is opaque, or next to it, lets light through: its extinction is infinite at a single place.
    let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
    for most in [1.0, 1.0 - 1e-12] {
        let peak = scene(&volume, gray(&[(0.7 - 1e-6, 0.0), (0.7, most), (0.7 + 1e-6, 0.0)])).with_opacity_unit(1e-6).unwrap();
        // Where the peak is, and with it the extinction next to it, is known to rounding alone: more than the bound that `pixel` asks for.
        let ray = Integrator::new(&peak, &volume).unwrap().pixel(0, 0).1;
        assert!((ray.transmittance - libm::exp(-2.0)).abs() < 1e-7, "{most}: {ray:?}");
    }
    // A wall shows its first colour, whatever is behind it, and hides it.
    let volume = line(&[0.0, 1.0], BoxConvention::Nodes);
    let colors = vec![(0.0, [0.0, 0.2, 0.4]), (1.0, [1.0, 0.2, 0.9])];
    let wall = TransferFunction::new(colors, vec![(0.5, 0.0), (0.5, 1.0)]).unwrap();
    let ray = pixel(&scene(&volume, wall), &volume);
    assert_eq!(ray.transmittance, 0.0);
    for (got, want) in ray.rgb.iter().zip([0.5, 0.2, 0.65]) {
        close(*got, want, "wall");
    }
    // A single opacity of 1 inside a field that only touches it does not hide what is behind.
    let touch = pixel(&scene(&volume, gray(&[(0.0, 0.0), (1.0, 1.0)])), &volume);
    close(touch.transmittance, libm::exp(-1.0), "touch");
}

#[test]
fn numbers_that_are_none_are_transparent() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let volume = line(&[1.0, 1.0, bad, 1.0, 1.0, 1.0], BoxConvention::Cells);
        // Two cells of six are lost.
        close(pixel(&scene(&volume, gray(&[(0.0, 0.3)])), &volume).transmittance, 0.7f64.powi(4), "around a bad voxel");
    }
    let volume = line(&[f64::NAN], BoxConvention::Cells);
    assert_eq!(pixel(&scene(&volume, gray(&[(0.0, 1.0)])), &volume).transmittance, 1.0);
}

#[test]
fn fog_has_its_closed_forms() {
    let volume = line(&[0.0; 10], BoxConvention::Cells);
    let plain = scene(&volume, gray(&[(0.0, 0.2)]));
    let kappa = closed::extinction(0.2, 1.0);
    let fogged = |mode| {
        let fog = Fog::new(mode, [0.2, 0.4, 0.6]).unwrap();
        pixel(&plain.clone().with_fog(Some(fog)), &volume)
    };
    // The box reaches from depth 45 to 55. Exponential fog: the integral of kappa exp(-kappa x) exp(-rho (45 + x)).
    let rho = 0.03;
    let shown = libm::exp(-45.0 * rho) * kappa / (kappa + rho) * closed::opacity((kappa + rho) * 10.0);
    let all = closed::opacity(kappa * 10.0);
    let ray = fogged(FogMode::Exp { density: rho });
    for (got, (own, fog)) in ray.rgb.iter().zip([(0.9, 0.2), (0.5, 0.4), (0.1, 0.6)]) {
        close(*got, own * shown + fog * (all - shown), "exp");
    }
    close(ray.transmittance, 1.0 - all, "fog leaves the opacity alone");
    // Linear fog from 47 to 50: clear, then a falling ramp, then nothing but fog.
    let ray = fogged(FogMode::Linear { start: 47.0, end: 50.0 });
    let (t2, t5) = (libm::exp(-2.0 * kappa), libm::exp(-5.0 * kappa));
    let shown = 1.0 - t2 + t2 * closed::linear_color(1.0, 0.0, 3.0 * kappa);
    close(ray.rgb[0], 0.9 * shown + 0.2 * (all - shown), "linear");
    // start = end is a step.
    let ray = fogged(FogMode::Linear { start: 50.0, end: 50.0 });
    close(ray.rgb[0], 0.9 * (1.0 - t5) + 0.2 * (all - (1.0 - t5)), "step");
    // No fog at all.
    assert_eq!(fogged(FogMode::Exp2 { density: 0.0 }).rgb, pixel(&plain, &volume).rgb);
}

#[test]
fn fog_thicker_than_a_cell_is_resolved() {
    let volume = line(&[0.0; 10], BoxConvention::Cells);
    let c = volume.grid().center();
    let placement = Placement::LookAt { eye: c, target: c + DVec3::X, up: DVec3::Z };
    let camera = Camera::new(placement, Projection::Orthographic { height: Some(1.0) }).unwrap();
    let plain = scene(&volume, gray(&[(0.0, 0.2)])).with_camera(camera);
    let kappa = closed::extinction(0.2, 1.0);
    for rho in [0.5, 20.0, 500.0, 1e5] {
        let red = |mode| pixel(&plain.clone().with_fog(Some(Fog::new(mode, [0.0; 3]).unwrap())), &volume).rgb[0];
        let exp = kappa / (kappa + rho) * closed::opacity((kappa + rho) * 5.0);
        close(red(FogMode::Exp { density: rho }), 0.9 * exp, "exp");
        // Completing the square: exp(-kappa x - (rho x)^2) is a Gaussian about -kappa / (2 rho^2).
        let about = -kappa / (2.0 * rho * rho);
        let sigma = std::f64::consts::FRAC_1_SQRT_2 / rho;
        let exp2 = closed::gaussian_depth(kappa * libm::exp(0.25 * kappa * kappa / (rho * rho)), about, sigma, 0.0, 5.0);
        close(red(FogMode::Exp2 { density: rho }), 0.9 * exp2, "exp2");
    }
}

#[test]
fn what_has_no_limit_is_refused() {
    let volume = line(&[0.0], BoxConvention::Cells);
    let plain = scene(&volume, gray(&[(0.0, 0.2)]));
    let literal = Fog::new(FogMode::Exp { density: 1.0 }, [0.5; 3]).unwrap().with_weighting(FogWeighting::Literal);
    assert!(Integrator::new(&plain.clone().with_fog(Some(literal)), &volume).is_err());
    assert!(Integrator::new(&plain.with_blend(Blend::Mip).unwrap(), &volume).is_err());
}

#[test]
fn backgrounds_shine_through_and_take_fog() {
    let volume = line(&[0.0], BoxConvention::Cells);
    let back = Straight { rgb: [0.2, 0.6, 1.0], alpha: 0.5 };
    let plain = scene(&volume, gray(&[(0.0, 0.25)])).with_background(back).unwrap();
    let (color, _) = Integrator::new(&plain, &volume).unwrap().pixel(0, 0);
    close(color.rgb[0], 0.9 * 0.25 + 0.75 * 0.1, "red");
    close(color.alpha, 1.0 - 0.75 * 0.5, "alpha");
    for mode in [FogMode::Exp { density: 0.1 }, FogMode::Exp2 { density: 0.1 }, FogMode::Linear { start: 90.0, end: 91.0 }] {
        let fog = Fog::new(mode, [1.0, 0.0, 0.0]).unwrap();
        let far = plain.clone().with_fog(Some(fog)).with_fogged_background(true);
        let integrator = Integrator::new(&far, &volume).unwrap();
        close(integrator.background.rgb[0], 0.5, "fog only");
        close(integrator.background.rgb[2], 0.0, "fog only");
    }
    let none = Fog::new(FogMode::Exp { density: 0.0 }, [1.0, 0.0, 0.0]).unwrap();
    let clear = plain.clone().with_fog(Some(none)).with_fogged_background(true);
    assert_eq!(Integrator::new(&clear, &volume).unwrap().background, plain.background().premultiply());
}

#[test]
fn spans_are_cut() {
    let volume = line(&[0.0; 10], BoxConvention::Cells);
    let plain = scene(&volume, gray(&[(0.0, 0.2)]));
    let way = |scene: &Scene| pixel(scene, &volume).span;
    assert_eq!(way(&plain), Some((45.0, 55.0)));
    let plane = |x: f64, offset: f64| ClipPlane::new(DVec3::new(x, 0.0, 0.0), offset).unwrap();
    // World x of the box: -0.5 to 9.5, the eye at -45.5.
    assert_eq!(way(&plain.clone().with_clip_planes(vec![plane(1.0, 2.5), plane(-1.0, -4.5)]).unwrap()), Some((48.0, 50.0)));
    assert_eq!(way(&plain.clone().with_clip_planes(vec![plane(1.0, 5.0), plane(-1.0, -4.0)]).unwrap()), None);
    // A plane along the ray keeps all of it or nothing.
    let along = |offset: f64| ClipPlane::new(DVec3::Z, offset).unwrap();
    assert_eq!(way(&plain.clone().with_clip_planes(vec![along(0.5)]).unwrap()), Some((45.0, 55.0)));
    assert_eq!(way(&plain.clone().with_clip_planes(vec![along(1.5)]).unwrap()), None);
    let near = along_x(&volume).with_near(51.0).unwrap();
    assert_eq!(way(&plain.clone().with_camera(near)), Some((51.0, 55.0)));
    // An eye inside sees what is before it.
    let c = volume.grid().center();
    let placement = Placement::LookAt { eye: c, target: c + DVec3::X, up: DVec3::Z };
    let inside = Camera::new(placement, Projection::Perspective { fov_y: 40.0 }).unwrap();
    let (entry, exit) = way(&plain.with_camera(inside)).unwrap();
    assert!(entry > 0.0 && entry < 1e-4 && (exit - 5.0).abs() < 1e-12, "{entry} {exit}");
}

/// A random small volume on an oblique grid, seen by a random camera through a random transfer function in random fog.
pub(super) fn random_case(r: &mut Random) -> (Volume, Scene) {
    let dims: [usize; 3] = std::array::from_fn(|_| 1 + (r.next() * 5.0) as usize);
    let turn = DMat3::from_quat(DQuat::from_axis_angle(r.direction(), r.within(0.0, 3.0)));
    let shear = DMat3::from_cols(DVec3::new(r.within(0.5, 2.0), 0.0, 0.0), DVec3::new(0.3, -1.2, 0.0), DVec3::new(-0.2, 0.4, 0.9));
    let convention = if r.next() < 0.5 { BoxConvention::Cells } else { BoxConvention::Nodes };
    let origin = DVec3::new(r.within(-5.0, 5.0), r.within(-5.0, 5.0), 3.0);
    let grid = Grid::new(dims, origin, turn * shear).unwrap().with_convention(convention);
    let bytes = (0..dims.iter().product()).map(|_| (r.next() * 256.0) as u8).collect();
    let volume = Volume::new(grid, Voxels::U8(bytes)).unwrap().with_rescale(0.5, -20.0).unwrap();
    let mut values: Vec<f64> = (0..4).map(|_| r.within(-20.0, 100.0)).collect();
    values.sort_by(f64::total_cmp);
    let color = values.iter().map(|&v| (v + 3.0, [r.next(), r.next(), r.next()])).collect();
    let opacity = values.iter().map(|&v| (v, if r.next() < 0.3 { 0.0 } else { 0.7 * r.next() })).collect();
    // A single voxel by nodes is a point.
    let (center, radius) = (volume.grid().center(), volume.grid().radius().max(1.0));
    let target = center + r.direction() * 0.2 * radius;
    let (distance, projection) = if r.next() < 0.5 {
        (radius * 2.0, Projection::Orthographic { height: Some(radius) })
    } else {
        // Sometimes inside the box.
        (radius * r.within(0.2, 2.5), Projection::Perspective { fov_y: 40.0 })
    };
    let placement = Placement::LookAt { eye: target + r.direction() * distance, target, up: DVec3::new(0.123, 0.456, 0.7) };
    let mut scene = Scene::new(TransferFunction::new(color, opacity).unwrap())
        .with_camera(Camera::new(placement, projection).unwrap())
        .with_size(8, 8)
        .unwrap();
    if r.next() < 0.5 {
        let normal = r.direction();
        scene = scene.with_clip_planes(vec![ClipPlane::new(normal, normal.dot(center) - 0.2 * radius).unwrap()]).unwrap();
    }
    let mode = match (r.next() * 4.0) as u32 {
        0 => return (volume, scene),
        1 => FogMode::Linear { start: 0.8 * distance, end: 1.3 * distance },
        2 => FogMode::Exp { density: 0.5 / distance },
        _ => FogMode::Exp2 { density: 0.7 / distance },
    };
    let kind = if r.next() < 0.5 { FogDistance::Planar } else { FogDistance::Radial };
    let fog = Fog::new(mode, [r.next(), r.next(), r.next()]).unwrap().with_distance(kind);
    (volume, scene.with_fog(Some(fog)))
}

/// The trilinear value at a world point, written down anew: the brute force shares nothing with the code above.
fn sample(volume: &Volume, world: DVec3) -> f64 {
    let u = volume.grid().world_to_index().transform_point3(world).to_array();
    let dims = volume.grid().dims();
    let mut sum = 0.0;
    for corner in 0..8 {
        let (mut weight, mut at) = (1.0, [0; 3]);
        for axis in 0..3 {
            let floor = u[axis].floor();
            let high = corner >> axis & 1;
            weight *= if high == 1 { u[axis] - floor } else { 1.0 - (u[axis] - floor) };
            at[axis] = (floor as i64 + high).clamp(0, dims[axis] as i64 - 1) as usize;
        }
        sum += weight * volume.value(at);
    }
    sum
}

/// Midpoint sums with the exponential of each step: error of order 2 in the step.
fn brute_force(scene: &Scene, volume: &Volume, (x, y): (f64, f64), span: (f64, f64), steps: u32) -> [f64; 4] {
    let view = scene.camera().resolve(volume.grid(), scene.size().0, scene.size().1).unwrap();
    let (origin, direction) = view.ray(x, y);
    let step = (span.1 - span.0) / f64::from(steps);
    let (mut rgb, mut through) = ([0.0; 3], 1.0);
    for i in 0..steps {
        let d = span.0 + step * (f64::from(i) + 0.5);
        let world = origin + direction * d;
        let look = scene.transfer().eval(sample(volume, world));
        let alpha = -libm::expm1(libm::log1p(-look.alpha) * step * direction.length() / volume.grid().smallest_spacing());
        let (f, fog) = scene.fog().map_or((1.0, [0.0; 3]), |fog| {
            let z = match fog.distance() {
                FogDistance::Planar => view.depth(world),
                FogDistance::Radial => world.distance(view.eye),
            };
            (fog.factor(z), fog.color())
        });
        for c in 0..3 {
            rgb[c] += through * alpha * (f * look.rgb[c] + (1.0 - f) * fog[c]);
        }
        through *= 1.0 - alpha;
    }
    [rgb[0], rgb[1], rgb[2], through]
}

#[test]
fn brute_force_converges_to_it() {
    let mut r = Random(7);
    let (mut compared, mut factors) = (0, 0.0);
    for case in 0..60 {
        let (volume, scene) = random_case(&mut r);
        let integrator = Integrator::new(&scene, &volume).unwrap();
        for _ in 0..4 {
            let at = (r.within(0.0, 8.0), r.within(0.0, 8.0));
            let ray = integrator.ray(at.0, at.1);
            assert!(ray.error_bound < 1e-10, "case {case}: {ray:?}");
            let Some(span) = ray.span else {
                assert_eq!((ray.rgb, ray.transmittance), ([0.0; 3], 1.0));
                continue;
            };
            let truth = [ray.rgb[0], ray.rgb[1], ray.rgb[2], ray.transmittance];
            let off = |steps| {
                let sum = brute_force(&scene, &volume, at, span, steps);
                sum.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let (rough, fine) = (off(400), off(6400));
            assert!(fine < 1e-6, "case {case}: {fine} at {at:?}, {ray:?}");
            if rough > 1e-9 {
                compared += 1;
                factors += libm::log2(rough / fine) / 4.0;
            }
        }
    }
    // Sixteen times the steps, 256 times less error: order 2 on average, kinks falling at random between the samples.
    let order = factors / f64::from(compared);
    assert!(compared > 100 && (1.8..2.3).contains(&order), "order {order} over {compared} rays");
}

#[test]
fn bounds_hold() {
    // Rules of lower tolerance are not to be had; cutting the way into parts is: the clip plane moves every panel's ends.
    let mut r = Random(11);
    let mut seen = 0;
    for case in 0..200 {
        let (volume, scene) = random_case(&mut r);
        let integrator = Integrator::new(&scene, &volume).unwrap();
        let at = (r.within(2.0, 6.0), r.within(2.0, 6.0));
        let ray = integrator.ray(at.0, at.1);
        let Some((entry, exit)) = ray.span else { continue };
        let (origin, direction) = integrator.view.ray(at.0, at.1);
        let mut parts = Gathered { rgb: [0.0; 3], transmittance: 1.0, error: 0.0, panels: 0 };
        let cuts: Vec<f64> = (0..=7).map(|i| entry + (exit - entry) * f64::from(i) / 7.0).collect();
        cuts.windows(2).for_each(|w| integrator.march(origin, direction, w[0], w[1], &mut parts));
        let bound = ray.error_bound + parts.error + 1e-13;
        for i in 0..3 {
            assert!((parts.rgb[i] - ray.rgb[i]).abs() <= bound, "case {case}: {parts:?} {ray:?}");
        }
        assert!((parts.transmittance - ray.transmittance).abs() <= bound, "case {case}: {parts:?} {ray:?}");
        seen += usize::from(parts.panels > 0);
    }
    assert!(seen > 60, "{seen}");
}

#[test]
fn a_picture_is_its_pixels() {
    let mut r = Random(3);
    let (volume, scene) = random_case(&mut r);
    let region = super::super::Region { origin: (1, 2), size: (6, 5), step: 2 };
    let picture = super::super::image(&scene, &volume, region).unwrap();
    assert_eq!(picture.size(), (3, 3));
    let integrator = Integrator::new(&scene, &volume).unwrap();
    for (i, got) in picture.pixels().iter().enumerate() {
        let (x, y) = picture.place(i);
        let (color, ray) = integrator.pixel(x, y);
        assert_eq!(*got, [color.rgb[0], color.rgb[1], color.rgb[2], color.alpha]);
        assert!(ray.error_bound <= picture.error_bound());
    }
    assert_eq!(picture.place(8), (5, 6));
    for bad in [((0, 0), (9, 1), 1), ((8, 0), (1, 1), 1), ((0, 0), (0, 1), 1), ((0, 0), (1, 1), 0), ((u32::MAX, 0), (2, 1), 1)] {
        let (origin, size, step) = bad;
        assert!(super::super::image(&scene, &volume, super::super::Region { origin, size, step }).is_err(), "{bad:?}");
    }
}
