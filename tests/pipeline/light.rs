//! Blending as amounts of light: closed forms, and the reference.

use super::{PARALLEL, constant, orbit};
use slicestack::reference::{Region, image};
use slicestack::scene::{Blend, Fog, FogMode, OpenGl, Slicing, Straight};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, VoxelType, Voxels};
use slicestack::{Renderer, Scene, Settings, Volume};

/// sRGB's curve and its inverse, from the standard's text (IEC 61966-2-1).
fn light(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn number(l: f64) -> f64 {
    if l <= 0.0031308 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 }
}

#[test]
fn half_a_light_over_another_has_the_mean_of_both_lights() {
    // A slab of opacity 1/2 over an opaque background, seen along z: the mean of two lights, not of two numbers.
    let grid = Grid::with_spacing([4, 4, 1], [1.0; 3]).unwrap();
    let volume = Volume::new(grid.clone(), Voxels::zeros(VoxelType::U8, grid.voxel_count())).unwrap();
    let (front, back) = ([0.9, 0.2, 0.0], [0.1, 0.8, 0.5]);
    let scene = Scene::new(constant(front, 0.5)).with_opacity_unit(1.0).unwrap().with_size(9, 9).unwrap();
    let scene = scene.with_camera(orbit(0.0, 90.0, 1.0, PARALLEL)).with_slices(Slicing::Count(8)).unwrap();
    let scene = scene.with_background(Straight { rgb: back, alpha: 1.0 }).unwrap().with_terminate(0.0).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    let plain = renderer.render(&scene).unwrap().0.pixel(4, 4);
    let lit = renderer.render(&scene.clone().with_linear_light(true).unwrap()).unwrap().0;
    for c in 0..3 {
        assert!((f64::from(plain[c]) - 0.5 * (front[c] + back[c])).abs() < 1e-5, "{plain:?}");
        let want = number(0.5 * (light(front[c]) + light(back[c])));
        assert!((f64::from(lit.pixel(4, 4)[c]) - want).abs() < 1e-5, "{:?}, not {want} in channel {c}", lit.pixel(4, 4));
        // Beside the volume the background stays what it is.
        assert!((f64::from(lit.pixel(0, 0)[c]) - back[c]).abs() < 1e-6);
    }
}

#[test]
fn light_converges_to_the_reference_with_fog_and_background() {
    let volume = Phantom::SheppLogan.volume(24).unwrap();
    let fog = Fog::new(FogMode::Exp { density: 0.01 }, [0.7, 0.2, 0.5]).unwrap();
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(40, 32).unwrap().with_terminate(0.0).unwrap();
    for background in [Straight::default(), Straight { rgb: [0.3, 0.6, 0.1], alpha: 0.8 }] {
        for fogged in [false, true] {
            let scene = scene.clone().with_linear_light(true).unwrap().with_fog(Some(fog)).with_fogged_background(fogged);
            let scene = scene.with_background(background).unwrap();
            let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
            let error = |scene: &Scene, count: u64| {
                let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap();
                let picture = Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0;
                let each = picture.pixels().iter().zip(truth.pixels()).flat_map(|(a, b)| (0..4).map(|c| (f64::from(a[c]) - b[c]).powi(2)));
                (each.sum::<f64>() / (4.0 * 40.0 * 32.0)).sqrt()
            };
            let (coarse, fine) = (error(&scene, 64), error(&scene, 1024));
            assert!(fine < 2e-4 && fine < 0.1 * coarse, "{coarse:.2e} {fine:.2e}");
            // Blended as numbers it is another picture.
            assert!(error(&scene.clone().with_linear_light(false).unwrap(), 1024) > 1e-2);
        }
    }
}

#[test]
fn light_and_tolerances_and_projections_go_together_and_opengl_does_not() {
    let volume = Phantom::SheppLogan.volume(16).unwrap();
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(16)).with_size(64, 48).unwrap().with_linear_light(true).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    let (_, stats) = renderer.render(&scene.clone().with_slices(Slicing::Tolerance(0.01)).unwrap()).unwrap();
    assert!(stats.error_estimate.unwrap() <= 0.01);
    // One colour in front of nothing: the same in both.
    let mip = |linear: bool| {
        let scene = scene.clone().with_blend(Blend::Mip).unwrap().with_linear_light(linear).unwrap();
        Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0
    };
    let (light, numbers) = (mip(true), mip(false));
    for (a, b) in light.pixels().iter().zip(numbers.pixels()) {
        // Between points the transfer function is linear in light, so colours there differ; opacities do not.
        assert!((a[3] - b[3]).abs() < 1e-6);
    }
    assert!(scene.with_opengl(OpenGl::default()).unwrap_err().to_string().contains("linear_light"));
}
