//! Error asked for: how many slices keep the RMS error of the colours below a tolerance.
//!
//! As a solver of differential equations does, the scene itself is tried at a coarse and a finer step, here on a sample of the
//! picture's blocks. With a method of order p the error at N slices is about diff(N, 2N) / (1 - 2^-p).

use crate::Result;
use crate::raster::Sample;
use crate::scene::{MAX_SLICES, Scene};

/// Slices tried first.
const FIRST: u64 = 32;
/// Slices beyond which nothing is tried.
const MOST: u64 = 1 << 16;
/// Part of the tolerance aimed at: the sample is not the picture, and neighbouring counts differ.
const AIM: f64 = 0.7;
/// Part of the tolerance that ending pixels early may use up.
const TERMINATE: f64 = 0.25;
/// Blocks that make a sample worth trusting, where the picture has that many.
const BLOCKS: usize = 192;

/// What was chosen.
pub(crate) struct Choice {
    /// Slices.
    pub(crate) count: u64,
    /// Transmittance at which pixels are finished.
    pub(crate) terminate: f32,
    /// Estimated RMS error of the colours over black.
    pub(crate) error: f64,
}

/// Chooses for `scene`. `render(count, terminate, sample)` gives the picture with the sample's blocks filled in.
pub(crate) fn choose(tolerance: f64, scene: &Scene, mut render: impl FnMut(u64, f32, Sample) -> Result<Vec<[f32; 4]>>) -> Result<Choice> {
    let (width, height) = scene.size();
    let blocks = width.div_ceil(8) as usize * height.div_ceil(8) as usize;
    let side = (1..=4).rev().find(|s| blocks / (s * s) >= BLOCKS).unwrap_or(1);
    let sample = Sample { side };
    let terminate = scene.terminate().min((TERMINATE * tolerance) as f32);
    let mut coarse = render(FIRST, terminate, sample)?;
    let mut count = FIRST;
    let mut last: Option<(u64, f64)> = None;
    loop {
        let fine = render(2 * count, terminate, sample)?;
        let difference = rms(&coarse, &fine, width as usize, sample);
        // Order 2 on smooth scenes, less where the transfer function is sharp: taken from the two last steps, within reason.
        let order = last.map_or(1.0, |(_, e)| libm::log2(e / difference.max(1e-30)).clamp(0.7, 2.0));
        let error = difference / (1.0 - libm::exp2(-order));
        if error <= AIM * tolerance || 2 * count >= MOST {
            let chosen = between(last.map(|(n, d)| (n, d / (1.0 - libm::exp2(-order)))), (count, error), AIM * tolerance);
            return Ok(Choice { count: chosen.0.clamp(1, MAX_SLICES), terminate, error: chosen.1 });
        }
        last = Some((count, difference));
        coarse = fine;
        count *= 2;
    }
}

/// The count between two tried ones whose error, on a straight line in logarithms, is `aim`.
fn between(coarse: Option<(u64, f64)>, (count, error): (u64, f64), aim: f64) -> (u64, f64) {
    match coarse {
        Some((n, e)) if e > aim && error < aim && error > 0.0 => {
            let t = libm::log(e / aim) / libm::log(e / error);
            let chosen = libm::ceil(n as f64 * libm::pow(count as f64 / n as f64, t));
            (chosen as u64, aim)
        }
        _ => (count, error),
    }
}

/// Root of the mean squared difference of red, green and blue over the sample's pixels.
fn rms(a: &[[f32; 4]], b: &[[f32; 4]], width: usize, sample: Sample) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0u64);
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        if sample.takes(i % width / 8, i / width / 8) {
            pixels += 1;
            sum += (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).map(|d| d * d).sum::<f64>();
        }
    }
    (sum / (3 * pixels.max(1)) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TransferFunction;

    #[test]
    fn a_method_of_known_error_gets_the_count_that_meets_the_tolerance() {
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.5)]).unwrap();
        let scene = Scene::new(transfer).with_size(64, 64).unwrap();
        for order in [1.0, 2.0] {
            for tolerance in [1e-2, 1e-3, 1e-4] {
                // A picture whose error is exactly N^-order everywhere.
                let truth = |n: u64| libm::pow(n as f64, -order);
                let choice = choose(tolerance, &scene, |n, _, _| Ok(vec![[(0.5 + truth(n)) as f32; 4]; 64 * 64])).unwrap();
                let error = truth(choice.count);
                assert!(
                    error <= tolerance && error > tolerance / 10.0,
                    "order {order}, {tolerance}: {} slices, error {error}",
                    choice.count
                );
            }
        }
    }

    #[test]
    fn out_of_reach_is_told() {
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.5)]).unwrap();
        let scene = Scene::new(transfer).with_size(8, 8).unwrap();
        let choice = choose(1e-3, &scene, |n, _, _| Ok(vec![[if n.trailing_zeros() % 2 == 0 { 0.1 } else { 0.2 }; 4]; 64])).unwrap();
        assert!(choice.error > 1e-3);
    }
}
