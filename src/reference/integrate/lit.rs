#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
//! Light and gradient opacity: closed forms, and sums over many small steps that share nothing with the integrator.

use super::tests::{Random, random_case};
use super::*;
use crate::reference::closed;
use crate::scene::{Camera, Gradient, Light, LightSource, Lighting, Placement, Projection, Shading};
use crate::volume::{BoxConvention, Grid, Voxels};
use glam::DMat3;

/// The default material with other numbers.
fn material(change: impl Fn(&mut Lighting)) -> Lighting {
    let mut lighting = Lighting::default();
    change(&mut lighting);
    lighting
}

const KINDS: [Gradient; 3] = [Gradient::Central, Gradient::Analytic, Gradient::Sobel];

/// Differences per voxel at index `u`, written down anew: at the eight corners of its cell, each weighted by the part of the cell opposite.
fn differences(volume: &Volume, kind: Gradient, u: DVec3) -> [f64; 3] {
    let dims = volume.grid().dims();
    let value = |at: [i64; 3]| volume.value([0, 1, 2].map(|a: usize| at[a].clamp(0, dims[a] as i64 - 1) as usize));
    let (mut cell, mut part) = ([0; 3], [0.0; 3]);
    for a in 0..3 {
        let inside = u[a].clamp(0.0, (dims[a] - 1) as f64);
        cell[a] = (inside.floor() as i64).min((dims[a] as i64 - 2).max(0));
        part[a] = inside - cell[a] as f64;
    }
    [0, 1, 2].map(|axis: usize| {
        let mut sum = 0.0;
        for corner in 0..8_i64 {
            let bit = |a: usize| corner >> a & 1;
            let weight: f64 = (0..3).map(|a| if bit(a) == 1 { part[a] } else { 1.0 - part[a] }).product();
            let here = [0, 1, 2].map(|a: usize| cell[a] + bit(a));
            let moved = |steps: [i64; 3]| value([0, 1, 2].map(|a: usize| here[a] + steps[a]));
            let on_axis = |x: i64| [0, 1, 2].map(|a: usize| if a == axis { x } else { 0 });
            sum += weight
                * match kind {
                    Gradient::Central => (moved(on_axis(1)) - moved(on_axis(-1))) / 2.0,
                    Gradient::Analytic => moved(on_axis(1 - bit(axis))) - moved(on_axis(-bit(axis))),
                    Gradient::Sobel => {
                        let mut slope = 0.0;
                        for n in 0..27_i64 {
                            let steps = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
                            let beside: i64 = (0..3).filter(|&a| a != axis).map(|a| 2 - steps[a].abs()).product();
                            slope += (steps[axis] * beside) as f64 / 32.0 * moved(steps);
                        }
                        slope
                    }
                };
        }
        sum
    })
}

fn gradient(volume: &Volume, kind: Gradient, world: DVec3) -> DVec3 {
    let grid = volume.grid();
    let along = differences(volume, kind, grid.world_to_index().transform_point3(world));
    grid.index_to_world().matrix3.transpose().inverse() * DVec3::from_array(along)
}

/// The formula of `scene::lighting`, in vectors.
fn lit(lighting: &Lighting, color: [f64; 3], g: DVec3, to_eye: DVec3, world: DVec3) -> [f64; 3] {
    if !(g.length() > 0.0) {
        return color;
    }
    let n = -g.normalize();
    let facing = |cosine: f64| if lighting.two_sided { cosine.abs() } else { cosine.max(0.0) };
    let weight = g.length_squared() / (g.length_squared() + lighting.gradient_floor * lighting.gradient_floor);
    [0, 1, 2].map(|c: usize| {
        let mut glow = lighting.emission + lighting.ambient;
        let mut shine = 0.0;
        for light in lighting.lights() {
            let l = match light.source() {
                LightSource::Head => to_eye,
                LightSource::Direction(d) => d,
                LightSource::Position(p) => (p - world).normalize(),
            };
            let h = (l + to_eye).normalize();
            glow += lighting.diffuse * facing(n.dot(l)) * light.color()[c];
            shine += lighting.specular * libm::pow(facing(n.dot(h)), lighting.shininess) * light.color()[c];
        }
        let full = (color[c] * glow + shine).clamp(0.0, 1.0);
        color[c] + weight * (full - color[c])
    })
}

/// A random material in one to four lights, or darkness by depth; a random gradient opacity half of the time.
fn random_light(r: &mut Random, volume: &Volume, scene: Scene) -> Scene {
    let mut lighting = Lighting::default();
    lighting.shading = if r.next() < 0.1 { Shading::Depth } else { Shading::BlinnPhong };
    (lighting.ambient, lighting.diffuse) = (r.within(0.0, 0.4), r.within(0.0, 1.3));
    (lighting.specular, lighting.emission) = (r.within(0.0, 0.6), r.within(0.0, 0.1));
    lighting.shininess = if r.next() < 0.2 { r.within(100.0, 1000.0) } else { r.within(1.0, 40.0) };
    lighting.two_sided = r.next() < 0.5;
    lighting.gradient_floor = if r.next() < 0.5 { 0.0 } else { r.within(1.0, 50.0) };
    let (center, radius) = (volume.grid().center(), volume.grid().radius().max(1.0));
    let mut lights = Vec::new();
    for _ in 0..1 + (r.next() * 4.0) as usize {
        let source = match (r.next() * 3.0) as u32 {
            0 => LightSource::Head,
            1 => LightSource::Direction(r.direction()),
            // Sometimes inside the box.
            _ => LightSource::Position(center + r.direction() * radius * r.within(0.3, 3.0)),
        };
        lights.push(Light::new(source, [r.next(), r.next(), r.next()]).unwrap());
    }
    let mut transfer = scene.transfer().clone();
    if r.next() < 0.5 {
        let points = vec![(r.within(0.0, 8.0), r.next()), (20.0, r.next()), (20.0, r.next()), (r.within(25.0, 60.0), r.next())];
        transfer = transfer.with_gradient_opacity(points).unwrap();
    }
    let scene = scene.with_transfer(transfer).with_gradient(KINDS[(r.next() * 3.0) as usize]);
    scene.with_lighting(Some(lighting.with_lights(lights).unwrap())).unwrap()
}

/// Midpoint sums with the exponential of each step.
fn brute_force(scene: &Scene, volume: &Volume, (x, y): (f64, f64), span: (f64, f64), steps: u32) -> [f64; 4] {
    let view = scene.camera().resolve(volume.grid(), scene.size().0, scene.size().1).unwrap();
    let (origin, direction) = view.ray(x, y);
    let corners = volume.grid().corners().map(|c| view.depth(c));
    let d0 = corners.iter().copied().fold(f64::INFINITY, f64::min).max(view.near);
    let d1 = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let step = (span.1 - span.0) / f64::from(steps);
    let (mut rgb, mut through) = ([0.0; 3], 1.0);
    for i in 0..steps {
        let d = span.0 + step * (f64::from(i) + 0.5);
        let world = origin + direction * d;
        let value = volume.sample(volume.grid().world_to_index().transform_point3(world));
        let look = scene.transfer().eval(value);
        let g = gradient(volume, scene.gradient(), world);
        let lighting = scene.lighting().unwrap();
        let color = if lighting.shading == Shading::Depth {
            look.rgb.map(|c| c * (1.0 - (d - d0) / (d1 - d0)))
        } else {
            lit(lighting, look.rgb, g, -direction.normalize(), world)
        };
        let factor = scene.transfer().gradient_factor(g.length());
        let alpha = -libm::expm1(factor * libm::log1p(-look.alpha) * step * direction.length() / volume.grid().smallest_spacing());
        let (f, fog) = scene.fog().map_or((1.0, [0.0; 3]), |fog| {
            let z = if fog.distance() == FogDistance::Planar { view.depth(world) } else { world.distance(view.eye) };
            (fog.factor(z), fog.color())
        });
        for c in 0..3 {
            rgb[c] += through * alpha * (f * color[c] + (1.0 - f) * fog[c]);
        }
        through *= 1.0 - alpha;
    }
    [rgb[0], rgb[1], rgb[2], through]
}

fn numbers(ray: &RayResult) -> [f64; 4] {
    [ray.rgb[0], ray.rgb[1], ray.rgb[2], ray.transmittance]
}

fn most_apart(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn brute_force_converges_to_it() {
    let mut r = Random(17);
    let (mut compared, mut factors) = (0, 0.0);
    for case in 0..100 {
        let (volume, scene) = random_case(&mut r);
        let scene = random_light(&mut r, &volume, scene);
        let integrator = Integrator::new(&scene, &volume).unwrap();
        for _ in 0..3 {
            let at = (r.within(0.0, 8.0), r.within(0.0, 8.0));
            let ray = integrator.ray(at.0, at.1);
            assert!(ray.error_bound < 1e-10, "case {case}: {ray:?}");
            let Some(span) = ray.span else { continue };
            let off = |steps| most_apart(&brute_force(&scene, &volume, at, span, steps), &numbers(&ray));
            let (rough, fine) = (off(400), off(6400));
            // Jumps, of the gradient at cell faces and of its opacity, leave an error of the first order: a step's part of the ray.
            assert!(fine < 1e-4, "case {case}: {fine} at {at:?}, {ray:?}");
            if rough > 1e-8 {
                compared += 1;
                factors += libm::log2(rough / fine.max(1e-12)) / 4.0;
            }
        }
    }
    let order = factors / f64::from(compared);
    assert!(compared > 60 && (1.3..2.3).contains(&order), "order {order} over {compared} rays");
}

#[test]
fn bounds_hold_against_ten_times_finer_cuts() {
    let mut r = Random(23);
    let mut seen = 0;
    for case in 0..120 {
        let (volume, scene) = random_case(&mut r);
        let scene = random_light(&mut r, &volume, scene);
        let integrator = Integrator::new(&scene, &volume).unwrap();
        let at = (r.within(2.0, 6.0), r.within(2.0, 6.0));
        let ray = integrator.ray(at.0, at.1);
        let Some((entry, exit)) = ray.span else { continue };
        let (origin, direction) = integrator.view.ray(at.0, at.1);
        let mut parts = Gathered { rgb: [0.0; 3], transmittance: 1.0, error: 0.0, panels: 0 };
        let cuts: Vec<f64> = (0..=83).map(|i| entry + (exit - entry) * f64::from(i) / 83.0).collect();
        cuts.windows(2).for_each(|w| integrator.march(origin, direction, w[0], w[1], &mut parts));
        let bound = ray.error_bound + parts.error + 1e-13;
        let fine = [parts.rgb[0], parts.rgb[1], parts.rgb[2], parts.transmittance];
        assert!(most_apart(&fine, &numbers(&ray)) <= bound, "case {case}: {parts:?} {ray:?}");
        assert!(ray.error_bound < 1e-10, "case {case}: {ray:?}");
        seen += usize::from(parts.panels > 0);
    }
    assert!(seen > 40, "{seen}");
}

/// f = a + b . index on an oblique, anisotropic, mirrored grid: its gradient is one vector.
fn slope() -> (Volume, DVec3) {
    let steps = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.3, -1.2, 0.2), DVec3::new(-0.2, 0.4, 2.0));
    let grid = Grid::new([6, 7, 8], DVec3::new(3.0, 1.0, -2.0), steps).unwrap().with_convention(BoxConvention::Nodes);
    let b = DVec3::new(1.0, -2.0, 0.5);
    let values = (0..6 * 7 * 8).map(|i| (i % 6) as f64 * b.x + (i / 6 % 7) as f64 * b.y + (i / 42) as f64 * b.z).collect();
    let volume = Volume::new(grid, Voxels::F64(values)).unwrap();
    (volume, steps.transpose().inverse() * b)
}

#[test]
fn even_slopes_have_one_color() {
    let (volume, g) = slope();
    let transfer = TransferFunction::new(vec![(0.0, [0.9, 0.5, 0.1])], vec![(0.0, 0.3)]).unwrap();
    let c = volume.grid().center();
    let ways = [(DVec3::X, DVec3::Z), (DVec3::new(1.0, -2.0, 0.7).normalize(), DVec3::Y)];
    let axis = |way: DVec3, up: DVec3| {
        let placement = Placement::LookAt { eye: c - way * 9.0, target: c, up };
        Camera::new(placement, Projection::Orthographic { height: Some(0.5) }).unwrap()
    };
    for (way, up) in ways {
        // Analytic differences are exact everywhere; others are one-sided at the grid's faces, and so halved there.
        let mut lighting = material(|m| {
            m.specular = 0.4;
            m.shininess = 3.5;
            m.gradient_floor = 2.0;
        });
        let lights =
            [LightSource::Head, LightSource::Direction(DVec3::new(0.3, -1.0, 0.2))].map(|l| Light::new(l, [0.8, 0.5, 0.2]).unwrap());
        lighting = lighting.with_lights(lights.to_vec()).unwrap();
        for two_sided in [false, true] {
            lighting.two_sided = two_sided;
            let scene = Scene::new(transfer.clone()).with_camera(axis(way, up)).with_size(1, 1).unwrap().with_gradient(Gradient::Analytic);
            let scene = scene.with_lighting(Some(lighting.clone())).unwrap();
            let ray = Integrator::new(&scene, &volume).unwrap().pixel(0, 0).1;
            let (entry, exit) = ray.span.unwrap();
            let kappa = closed::extinction(0.3, volume.grid().smallest_spacing());
            let want = lit(&lighting, [0.9, 0.5, 0.1], g, -way, DVec3::ZERO);
            for (got, want) in ray.rgb.iter().zip(want) {
                let want = closed::constant_color(want, kappa * (exit - entry));
                assert!((got - want).abs() < 1e-10, "{got} for {want} along {way}");
            }
            // A factor at one size of the gradient is a factor on the extinction.
            let half = transfer.clone().with_gradient_opacity(vec![(0.0, 0.0), (2.0 * g.length(), 1.0)]).unwrap();
            let ray = Integrator::new(&scene.with_transfer(half), &volume).unwrap().pixel(0, 0).1;
            let want = libm::exp(-0.5 * kappa * (exit - entry));
            assert!((ray.transmittance - want).abs() < 1e-10, "{} for {want}", ray.transmittance);
        }
    }
}

#[test]
fn gradients_are_those_of_small_differences_and_of_the_same_sums() {
    let mut r = Random(5);
    for _ in 0..60 {
        let (volume, _) = random_case(&mut r);
        let dims = volume.grid().dims();
        for kind in KINDS {
            let gradients = crate::reference::gradient::Gradients::new(&volume, kind);
            let low: [i64; 3] = [0, 1, 2].map(|a: usize| (r.next() * (dims[a] + 1) as f64) as i64 - 1);
            let place = [r.next(), r.next(), r.next()];
            let step = [0, 1, 2].map(|a: usize| r.within(-place[a], 1.0 - place[a]));
            let along = gradients.along(low, place, step, None).unwrap();
            for s in [0.0, 0.3, 1.0] {
                let index = DVec3::from_array([0, 1, 2].map(|a: usize| low[a] as f64 + place[a] + s * step[a]));
                let want = gradient(&volume, kind, volume.grid().index_to_world().transform_point3(index));
                let got = DVec3::from_array(along.map(|c| c.at(s)));
                assert!((got - want).length() < 1e-9 * (1.0 + want.length()), "{kind:?} {dims:?} {low:?}: {got} for {want}");
                // Within a cell the analytic gradient is what the value changes by.
                let inside =
                    (0..3).all(|a| low[a] >= 0 && low[a] < dims[a] as i64 - 1 && (0.01..0.99).contains(&(index[a] - low[a] as f64)));
                if kind == Gradient::Analytic && inside {
                    let to_world = volume.grid().index_to_world();
                    for axis in 0..3 {
                        let mut e = DVec3::ZERO;
                        e[axis] = 1e-4;
                        let slope = (volume.sample(index + e) - volume.sample(index - e)) / 2e-4;
                        assert!((to_world.matrix3.col(axis).dot(got) - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{axis}");
                    }
                }
            }
        }
    }
}

#[test]
fn without_a_gradient_colors_stay_unlit() {
    let placement = |c: DVec3| Placement::LookAt { eye: c - DVec3::X * 50.0, target: c, up: DVec3::Z };
    let transfer = TransferFunction::new(vec![(0.0, [0.9, 0.5, 0.1])], vec![(0.0, 0.3)]).unwrap();
    let dark = material(|m| {
        m.ambient = 0.0;
        m.diffuse = 0.0;
        m.specular = 0.0;
    });
    let red = |values: &[f64], scene: &dyn Fn(Scene) -> Scene| {
        let grid = Grid::with_spacing([values.len(), 1, 1], [1.0; 3]).unwrap();
        let volume = Volume::new(grid.clone(), Voxels::F64(values.to_vec().into())).unwrap();
        let camera = Camera::new(placement(grid.center()), Projection::Orthographic { height: Some(0.5) }).unwrap();
        let plain = Scene::new(transfer.clone()).with_camera(camera).with_size(1, 1).unwrap();
        let ray = Integrator::new(&scene(plain), &volume).unwrap().pixel(0, 0).1;
        assert!(ray.error_bound < 1e-10, "{ray:?}");
        (ray.rgb[0], ray.transmittance)
    };
    let lit = |lighting: &Lighting| {
        let lighting = lighting.clone();
        move |scene: Scene| scene.with_lighting(Some(lighting.clone())).unwrap()
    };
    let flat = red(&[1.0; 6], &lit(&dark));
    assert_eq!(flat, red(&[1.0; 6], &|scene| scene));
    // A slope is black in this light.
    assert!(red(&[1.0, 2.0, 3.0, 4.0], &lit(&dark)).0.abs() < 1e-12);
    // Central differences around the cells from 2 to 3 and from 5 to 6 meet the NaN at 4: those keep their colour, up to the box's end.
    // What lies before them is black, and what lies between them transparent.
    let t = 0.7;
    let holed = red(&[1.0, 2.0, 3.0, 4.0, f64::NAN, 6.0, 7.0], &lit(&dark));
    let want = 0.9 * (libm::pow(t, 2.5) * (1.0 - t) + libm::pow(t, 3.5) * (1.0 - libm::pow(t, 1.5)));
    assert!((holed.0 - want).abs() < 1e-10, "{holed:?}");
    // A step in the gradient opacity: gradient 1 shows, gradient 0 does not.
    let step = |scene: Scene| {
        let transfer = scene.transfer().clone().with_gradient_opacity(vec![(0.7, 0.0), (0.7, 1.0)]).unwrap();
        scene.with_transfer(transfer)
    };
    assert_eq!(red(&[1.0; 6], &step).1, 1.0);
    // From 0 at the first voxel to 1 at the second the central difference rises from 0.5, and falls likewise at the other end.
    let shown = red(&[0.0, 1.0, 2.0, 3.0], &step).1;
    assert!((shown - libm::pow(t, 1.0 + 2.0 * 0.6)).abs() < 1e-10, "{shown}");
}

#[test]
fn lights_without_effect_change_nothing() {
    let mut r = Random(29);
    for _ in 0..30 {
        let (volume, scene) = random_case(&mut r);
        let none = material(|m| {
            m.ambient = 1.0;
            m.diffuse = 0.0;
            m.specular = 0.0;
        });
        let lit = scene.clone().with_lighting(Some(none)).unwrap();
        let at = (r.within(2.0, 6.0), r.within(2.0, 6.0));
        let [a, b] = [&lit, &scene].map(|scene| numbers(&Integrator::new(scene, &volume).unwrap().ray(at.0, at.1)));
        assert!(most_apart(&a, &b) < 1e-10, "{a:?} {b:?}");
    }
}

#[test]
fn lights_are_turned_into_amounts_too() {
    let (volume, _) = slope();
    let transfer = TransferFunction::new(vec![(0.0, [0.9, 0.5, 0.1])], vec![(0.0, 1.0)]).unwrap();
    let color = [0.6, 0.3, 1.0];
    let lighting = material(|m| {
        (m.ambient, m.diffuse, m.specular, m.shininess) = (0.0, 0.0, 0.5, 1.0);
    });
    let shiny = lighting.with_lights(vec![Light::new(LightSource::Head, color).unwrap()]).unwrap();
    let c = volume.grid().center();
    let placement = Placement::LookAt { eye: c - DVec3::X * 50.0, target: c, up: DVec3::Z };
    let camera = Camera::new(placement, Projection::Orthographic { height: Some(0.5) }).unwrap();
    let scene = Scene::new(transfer).with_camera(camera).with_size(1, 1).unwrap().with_gradient(Gradient::Analytic);
    let scene = scene.with_lighting(Some(shiny.clone())).unwrap().with_linear_light(true).unwrap();
    let (pixel, _) = Integrator::new(&scene, &volume).unwrap().pixel(0, 0);
    let g = gradient(&volume, Gradient::Analytic, c);
    let cosine = g.normalize().x.abs();
    for (got, number) in pixel.rgb.iter().zip(color) {
        let want = in_srgb(Premultiplied { rgb: [0.5 * cosine * light_of(number); 3], alpha: 1.0 }).rgb[0];
        assert!((got - want).abs() < 1e-10, "{got} for {want}");
    }
}
