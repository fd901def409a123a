//! Any scene of all keys to a tolerance: the true error is no larger than what is asked for, unless it is told to be out of reach.

use super::scenes;
use slicestack::reference::{Region, image};
use slicestack::scene::{Algorithm, Blend, Classification, Filter, Scene, Slicing};
use slicestack::{Renderer, Settings};

/// Whether a tolerance is promised for the scene, and the integrator knows its truth.
fn is_promised(scene: &Scene) -> bool {
    let method = scene.method();
    let integrated = method.filter == Filter::Linear && method.classification != Classification::Pre;
    let sliced = scene.algorithm() == Algorithm::Slices && scene.opengl().is_none() && scene.blend() == Blend::Over;
    let by_value = scene.transfer2d().is_none() && scene.transfer().gradient_opacity().is_empty() && scene.lighting().is_none();
    integrated && sliced && by_value && scene.regions().is_empty() && scene.cuts().is_empty()
}

pub fn run(bytes: &[u8]) {
    let Some((volume, scene, mut draw)) = scenes::drawn(bytes) else { return };
    let tolerance = draw.one(&[0.01, 0.003, 0.001]);
    let Ok(scene) = scene.with_slices(Slicing::Tolerance(tolerance)) else { return };
    if !is_promised(&scene) {
        return;
    }
    let Ok(truth) = image(&scene, &volume, Region::whole(&scene)) else { return };
    let Ok((picture, stats)) = Renderer::new(&volume, Settings::new().threads(1)).render(&scene) else { return };
    let squares = picture.pixels().iter().zip(truth.pixels()).flat_map(|(p, t)| (0..3).map(|c| f64::from(p[c]) - t[c])).map(|d| d * d);
    let error = (squares.sum::<f64>() / (3 * truth.pixels().len()) as f64).sqrt();
    let told = stats.error_estimate.unwrap_or(0.0);
    assert!(error <= tolerance.max(told), "error {error:.3e} of {tolerance}, told {told:.3e}");
}
