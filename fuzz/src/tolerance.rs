//! Any scene of all keys to a tolerance: the true error is no larger than what is asked for, unless it is told to be out of reach.

use super::scenes;
use slicestack::reference::{Region, image};
use slicestack::scene::{Classification, Filter, Slicing};
use slicestack::{Renderer, Settings};

pub fn run(bytes: &[u8]) {
    let Some((volume, scene, mut draw)) = scenes::drawn(bytes) else { return };
    let integrated = scene.method().filter == Filter::Linear && scene.method().classification != Classification::Pre;
    let tolerance = draw.one(&[0.01, 0.003, 0.001]);
    let Ok(scene) = scene.with_slices(Slicing::Tolerance(tolerance)) else { return };
    if !integrated {
        return;
    }
    let (width, height) = scene.size();
    let Ok(truth) = image(&volume, &scene, Region::whole(width, height), 1e-6) else { return };
    let Ok((picture, stats)) = Renderer::new(&volume, Settings::new().threads(1)).render(&scene) else { return };
    let sum: f64 = picture.pixels().iter().zip(truth.pixels()).flat_map(|(p, t)| (0..3).map(|c| (f64::from(p[c]) - t[c]).powi(2))).sum();
    let error = (sum / (3 * picture.pixels().len()) as f64).sqrt();
    let told = stats.error_estimate.unwrap_or(0.0);
    assert!(error <= tolerance.max(told), "error {error:.3e} of {tolerance}, told {told:.3e}");
}
