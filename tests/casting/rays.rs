//! Equal steps along each ray.

use crate::{PARALLEL, constant, drawn, largest, looking, numbers, plain, rms, scenes, telling, with};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{Algorithm, Blend, Camera, Hit, LevelSurface, Lighting, Projection, Shading, Slicing};
use slicestack::volume::phantom::Phantom;
use slicestack::{Scene, Volume};

#[test]
fn along_parallel_rays_they_draw_what_slices_draw() {
    let mut compared = Vec::new();
    let mut samples = scenes::samples();
    // A depth cue goes by where samples are, also beyond the outermost voxels' centres.
    let mut cued = samples.iter().find(|s| s.name == "2x3x5").unwrap().clone();
    let mut cue = Lighting::default();
    cue.shading = Shading::Depth;
    (cued.name, cued.scene) = ("lit by a depth cue", cued.scene.with_lighting(Some(cue)).unwrap());
    samples.push(cued);
    for scenes::Sample { name, volume, scene } in samples {
        // Level surfaces have a test of their own.
        if scene.algorithm() != Algorithm::Slices || matches!(scene.blend(), Blend::Iso { .. } | Blend::Surfaces) {
            continue;
        }
        let parallel = Camera::new(scene.camera().placement(), PARALLEL).unwrap();
        let scene = if matches!(scene.camera().projection(), Projection::Perspective { .. }) { scene.with_camera(parallel) } else { scene };
        let Ok(cast) = scene.clone().with_algorithm(Algorithm::Rays) else { continue };
        // Rays look values up.
        if cast.check_with(&volume).is_err() {
            continue;
        }
        // Both end early, each at a sample of its own.
        let (scene, cast) = (scene.with_terminate(0.0).unwrap(), cast.with_terminate(0.0).unwrap());
        let difference = largest(&drawn(&volume, &scene), &drawn(&volume, &cast));
        println!("{name}: {difference:.1e}");
        assert!(difference < 2e-5, "{name}: {difference}");
        compared.push(name);
    }
    for wanted in [
        "mip",
        "average",
        "add",
        "lmip",
        "fog-linear-radial",
        "clip-one",
        "nodes",
        "oblique",
        "holes",
        "lit",
        "nearest",
        "cubic",
        "transfer2d",
        "whole-ends",
        "pre-classified",
        "gradient-opacity",
        "lit by a depth cue",
    ] {
        assert!(compared.contains(&wanted), "{wanted} is not compared: {compared:?}");
    }
    assert!(compared.len() > 50, "{compared:?}");
}

/// Distance of `eye` to the box of a volume with axes along the world's.
fn nearest(volume: &Volume, eye: DVec3) -> f64 {
    let corners = volume.grid().corners();
    let low = corners.iter().copied().reduce(DVec3::min).unwrap();
    let high = corners.iter().copied().reduce(DVec3::max).unwrap();
    eye.distance(eye.clamp(low, high))
}

/// What the definition says, loop by loop: samples at r0 + (k + 1/2) D of every ray, each for what it has of its slab in the box, the outermost for what
/// is left.
fn by_hand(volume: &Volume, scene: &Scene, count: u64) -> Vec<[f64; 4]> {
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height).unwrap();
    let corners = volume.grid().corners();
    let r0 = nearest(volume, view.eye).max(view.near);
    let r1 = corners.iter().map(|c| c.distance(view.eye)).fold(0.0, f64::max);
    let step = (r1 - r0) / count as f64;
    let (low, high) = (corners.iter().copied().reduce(DVec3::min).unwrap(), corners.iter().copied().reduce(DVec3::max).unwrap());
    let unit = volume.grid().smallest_spacing();
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (_, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let stretch = direction.length();
            let direction = direction / stretch;
            let (mut entry, mut exit) = (view.near * stretch, f64::INFINITY);
            for axis in 0..3 {
                let (a, b) = ((low[axis] - view.eye[axis]) / direction[axis], (high[axis] - view.eye[axis]) / direction[axis]);
                (entry, exit) = (entry.max(a.min(b)), exit.min(a.max(b)));
            }
            let inside: Vec<f64> = (0..count).map(|k| r0 + (k as f64 + 0.5) * step).filter(|r| (entry..=exit).contains(r)).collect();
            let (mut rgb, mut left) = ([0.0; 3], 1.0);
            let mut add = |r: f64, length: f64| {
                let index = volume.grid().world_to_index().transform_point3(view.eye + direction * r);
                let color = scene.transfer().eval(volume.sample(index));
                let alpha = 1.0 - (1.0 - color.alpha).powf(length / unit);
                (0..3).for_each(|c| rgb[c] += left * alpha * color.rgb[c]);
                left *= 1.0 - alpha;
            };
            for (n, &r) in inside.iter().enumerate() {
                let near = if n == 0 { entry } else { r - 0.5 * step };
                let far = if n + 1 == inside.len() { exit } else { r + 0.5 * step };
                add(r, far - near);
            }
            if inside.is_empty() && exit > entry {
                let k = ((0.5 * (entry + exit) - r0) / step - 0.5).round().clamp(0.0, count as f64 - 1.0);
                add(r0 + (k + 0.5) * step, exit - entry);
            }
            pixels.push([rgb[0], rgb[1], rgb[2], 1.0 - left]);
        }
    }
    pixels
}

#[test]
fn in_perspective_steps_are_equal_along_each_ray() {
    let volume = numbers([9, 7, 11]);
    for (eye, fov_y, steps) in [
        (DVec3::new(14.0, 9.0, 5.0), 60.0, 40),
        (DVec3::new(-3.0, 11.0, -9.0), 110.0, 25),
        (DVec3::new(0.4, -0.3, 0.2), 100.0, 31),
        (DVec3::new(30.0, 2.0, 1.0), 25.0, 7),
    ] {
        let camera = looking(eye, &volume, Projection::Perspective { fov_y });
        let scene = with(&plain(telling(), 36, steps).with_camera(camera), Algorithm::Rays);
        let difference = largest(&drawn(&volume, &scene), &by_hand(&volume, &scene, steps));
        println!("eye {eye}: {difference:.1e}");
        // Slabs of the table are exact to 1/16384 of the strongest.
        assert!(difference < 1e-4, "eye {eye}: {difference}");
    }
}

#[test]
fn constant_volumes_have_the_exact_opacity_at_any_number_of_steps() {
    let volume = numbers([6, 8, 5]);
    for (eye, projection) in [(DVec3::new(14.0, 9.0, 5.0), Projection::Perspective { fov_y: 70.0 }), (DVec3::new(-9.0, 9.0, 5.0), PARALLEL)]
    {
        for steps in [1, 2, 7, 100] {
            let scene = with(&plain(constant(0.3), 24, steps).with_camera(looking(eye, &volume, projection)), Algorithm::Rays);
            let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
            let difference = largest(&drawn(&volume, &scene), truth.pixels());
            assert!(difference < 1e-6, "{steps} steps from {eye}: {difference}");
        }
    }
}

#[test]
fn they_converge_to_the_reference_at_second_order() {
    let volume = Phantom::Cloud.volume(24).unwrap();
    let transfer =
        slicestack::scene::TransferFunction::new(vec![(0.0, [0.1, 0.3, 1.0]), (1.0, [1.0, 0.4, 0.1])], vec![(0.0, 0.0), (1.0, 0.3)]);
    let camera = looking(DVec3::new(30.0, 20.0, 14.0), &volume, Projection::Perspective { fov_y: 70.0 });
    let scene = with(&plain(transfer.unwrap(), 40, 1).with_camera(camera), Algorithm::Rays);
    let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let error = |steps: u64| rms(&drawn(&volume, &scene.clone().with_slices(Slicing::Count(steps)).unwrap()), truth.pixels());
    let errors = [32, 64, 128, 256].map(error);
    println!("{errors:?}");
    assert!(errors[3] < 2e-5 && errors[0] / errors[3] > 20.0, "{errors:?}");
}

#[test]
fn level_surfaces_are_those_between_slices() {
    let volume = Phantom::Cloud.volume(24).unwrap();
    let camera = looking(DVec3::new(30.0, 20.0, 14.0), &volume, PARALLEL);
    let scene = plain(telling(), 48, 60).with_camera(camera);
    let surface = |level, color, opacity| LevelSurface::new(level, Some(color), opacity).unwrap();
    let two = vec![surface(0.2, [1.0, 0.3, 0.2], 0.4), surface(0.4, [0.2, 0.4, 1.0], 1.0)];
    let several = scene.clone().with_levels(two).unwrap();
    for (name, scene) in [
        ("one level", scene.with_blend(Blend::Iso { level: 0.3 }).unwrap()),
        ("two", several.clone()),
        ("lit", several.clone().with_lighting(Some(Lighting::default())).unwrap()),
        ("first samples", several.with_hit(Hit::FirstSample)),
    ] {
        let (slices, rays) = (drawn(&volume, &scene), drawn(&volume, &with(&scene, Algorithm::Rays)));
        // Where a ray hardly touches a surface, one of them may miss it.
        let apart = slices.iter().zip(&rays).filter(|(a, b)| largest(&[**a], &[**b]) > 1e-3).count();
        println!("{name}: {apart} of {} pixels", rays.len());
        assert!(apart < rays.len() / 200, "{name}: {apart} of {} pixels", rays.len());
        assert!(rays.iter().filter(|p| p[3] > 0.5).count() > 200, "{name}");
    }
}
