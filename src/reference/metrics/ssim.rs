//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli: "Image quality assessment: from error visibility to structural
//! similarity", 2004).

use super::{Displayed, Plane};
use crate::Result;

/// Standard deviation of the window in pixels.
const SIGMA: f64 = 1.5;
/// The window is 11 x 11 pixels.
const HALF: usize = 5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity of two pictures' luma (0.299 R + 0.587 G + 0.114 B): 1 for equal ones, about 0 for unrelated ones.
///
/// The mean is over the pixels whose 11 x 11 window lies within the picture; along a side shorter than that, over all pixels, with
/// the edge pixels going on outside.
///
/// # Errors
/// [`crate::Error::Invalid`] when the sizes differ.
pub fn ssim(a: &Displayed, b: &Displayed) -> Result<f64> {
    a.same_size(b)?;
    let raw: Vec<f64> = (0..=2 * HALF)
        .map(|i| {
            let x = i as f64 - HALF as f64;
            libm::exp(-x * x / (2.0 * SIGMA * SIGMA))
        })
        .collect();
    let total: f64 = raw.iter().sum();
    let window: Vec<f64> = raw.iter().map(|w| w / total).collect();
    let luma = |c: [f64; 3]| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
    let (x, y) = (Plane::of(a, luma), Plane::of(b, luma));
    let product = |p: &Plane, q: &Plane| Plane { values: p.values.iter().zip(&q.values).map(|(u, v)| u * v).collect(), ..*p };
    let mean = |p: &Plane| p.filter(&window, &window).values;
    let (mx, my) = (mean(&x), mean(&y));
    let (xx, yy, xy) = (mean(&product(&x, &x)), mean(&product(&y, &y)), mean(&product(&x, &y)));
    let inner = |side: usize| if side > 2 * HALF { HALF..side - HALF } else { 0..side };
    let (mut sum, mut count) = (0.0, 0.0);
    for row in inner(a.height) {
        for column in inner(a.width) {
            let i = row * a.width + column;
            let (vx, vy, cov) = (xx[i] - mx[i] * mx[i], yy[i] - my[i] * my[i], xy[i] - mx[i] * my[i]);
            let same = (2.0 * mx[i] * my[i] + C1) * (2.0 * cov + C2);
            sum += same / ((mx[i] * mx[i] + my[i] * my[i] + C1) * (vx + vy + C2));
            count += 1.0;
        }
    }
    Ok(sum / count)
}
