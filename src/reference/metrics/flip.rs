//! LDR-FLIP: the difference seen when two pictures are flipped back and forth (Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom,
//! Fairchild: "FLIP: a difference evaluator for alternating images", 2020).
//!
//! ```text
//!  colour:  sRGB -> YCxCz -> blur by contrast sensitivity -> clamp -> L*a*b*, Hunt -> HyAB^0.7 -> `[0,1]` --.
//!  feature: luma -> edges and points by Gaussian derivatives -> largest change -> sqrt(./sqrt 2) --------- colour^(1-feature)
//! ```

use super::{Displayed, Kernel, Plane};
use crate::Result;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Pixels per degree of sight at the paper's desk: a screen 0.7 m wide of 3840 pixels, seen from 0.7 m.
pub const DEFAULT_PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Exponent of the colour difference.
const Q_C: f64 = 0.7;
/// Where the colour difference's mapping has its knee, as a share of the largest difference, and the value there.
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
/// Width of the feature detectors in degrees, and the exponent of the feature difference.
const W: f64 = 0.082;
const Q_F: f64 = 0.5;

/// Contrast sensitivities as sums of Gaussians a sqrt(pi/b) exp(-(pi x)^2 / b), x in degrees: (a, b) for Y, Cx, Cz.
const SENSITIVITY: [[(f64, f64); 2]; 3] = [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// Linear sRGB to XYZ (IEC 61966-2-1, white D65).
const TO_XYZ: [[f64; 3]; 3] = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];

/// The FLIP map's mean over the pixels, in `[0,1]`: 0 for equal pictures. Colours are taken as sRGB.
///
/// # Errors
/// [`crate::Error::Invalid`] when the sizes differ or `pixels_per_degree` is not within 1 and 1000.
pub fn flip(reference: &Displayed, test: &Displayed, pixels_per_degree: f64) -> Result<f64> {
    let map = flip_map(reference, test, pixels_per_degree)?;
    Ok(map.iter().sum::<f64>() / map.len() as f64)
}

/// The FLIP map: for each pixel, row by row from the top, the difference that is seen there, in `[0,1]`. Colours are taken as sRGB.
///
/// # Errors
/// As [`flip`].
pub fn flip_map(reference: &Displayed, test: &Displayed, pixels_per_degree: f64) -> Result<Vec<f64>> {
    reference.same_size(test)?;
    if !(1.0..=1000.0).contains(&pixels_per_degree) {
        return Err(crate::Error::invalid(format!("FLIP at {pixels_per_degree} pixels per degree: must lie between 1 and 1000")));
    }
    let colors = color_difference(reference, test, pixels_per_degree);
    let features = feature_difference(reference, test, pixels_per_degree);
    Ok(colors.iter().zip(&features).map(|(&c, &f)| libm::pow(c, 1.0 - f)).collect())
}

fn apply(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cofactor = |i: usize, j: usize| {
        let (r, s, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[r][c] * m[s][d] - m[r][d] * m[s][c]
    };
    let det: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / det))
}

/// XYZ of linear sRGB white.
fn white() -> [f64; 3] {
    apply(&TO_XYZ, [1.0; 3])
}

/// sRGB's transfer curve undone.
fn linear(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
}

/// XYZ over white, from sRGB.
fn relative_xyz(srgb: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (apply(&TO_XYZ, srgb.map(linear)), white());
    std::array::from_fn(|i| xyz[i] / white[i])
}

/// CIELAB without its cube root.
fn ycxcz([x, y, z]: [f64; 3]) -> [f64; 3] {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// L*a*b* of linear sRGB, with chroma scaled by lightness (the Hunt effect).
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let (xyz, white) = (apply(&TO_XYZ, rgb), white());
    let [x, y, z]: [f64; 3] = std::array::from_fn(|i| {
        let t = xyz[i] / white[i];
        if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// Distance for large colour differences: lightness and chroma apart.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + libm::hypot(a[1] - b[1], a[2] - b[2])
}

fn color_difference(reference: &Displayed, test: &Displayed, ppd: f64) -> Vec<f64> {
    let (seen_a, seen_b) = (blurred(reference, ppd), blurred(test, ppd));
    let largest = libm::pow(hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])), Q_C);
    let knee = P_C * largest;
    seen_a
        .iter()
        .zip(&seen_b)
        .map(|(&a, &b)| {
            let off = libm::pow(hyab(hunt_lab(a), hunt_lab(b)), Q_C);
            let mapped = if off < knee { P_T / knee * off } else { P_T + (off - knee) / (largest - knee) * (1.0 - P_T) };
            mapped.clamp(0.0, 1.0)
        })
        .collect()
}

/// Linear sRGB in `[0,1]` as the eye resolves it.
fn blurred(picture: &Displayed, ppd: f64) -> Vec<[f64; 3]> {
    // Three standard deviations of the widest Gaussian, sigma^2 = b / (2 pi^2).
    let widest = SENSITIVITY.iter().flatten().map(|g| g.1).fold(0.0, f64::max);
    let radius = libm::ceil(3.0 * (widest / (2.0 * PI * PI)).sqrt() * ppd) as usize;
    let channels: [Plane; 3] = std::array::from_fn(|channel| {
        let plane = Plane::of(picture, |c| ycxcz(relative_xyz(c))[channel]);
        let mut sum = vec![0.0; plane.values.len()];
        let mut total = 0.0;
        for (a, b) in SENSITIVITY[channel].into_iter().filter(|g| g.0 > 0.0) {
            let kernel: Kernel = taps(radius).map(|x| libm::exp(-(PI * x / ppd) * (PI * x / ppd) / b)).collect();
            let height = a * (PI / b).sqrt();
            total += height * kernel.iter().sum::<f64>() * kernel.iter().sum::<f64>();
            plane.filter(&kernel, &kernel).values.iter().zip(&mut sum).for_each(|(v, s)| *s += height * v);
        }
        Plane { values: sum.iter().map(|v| v / total).collect(), ..plane }
    });
    let (back, white) = (inverse(&TO_XYZ), white());
    (0..picture.rgb.len())
        .map(|i| {
            let y = (channels[0].values[i] + 16.0) / 116.0;
            let xyz = [y + channels[1].values[i] / 500.0, y, y - channels[2].values[i] / 200.0];
            apply(&back, std::array::from_fn(|c| xyz[c] * white[c])).map(|c| c.clamp(0.0, 1.0))
        })
        .collect()
}

fn taps(radius: usize) -> impl Iterator<Item = f64> {
    (0..=2 * radius).map(move |i| i as f64 - radius as f64)
}

fn feature_difference(reference: &Displayed, test: &Displayed, ppd: f64) -> Vec<f64> {
    let sigma = 0.5 * W * ppd;
    let radius = libm::ceil(3.0 * sigma) as usize;
    let gauss: Kernel = taps(radius).map(|x| libm::exp(-x * x / (2.0 * sigma * sigma))).collect();
    let shaped = |shape: &dyn Fn(f64) -> f64| -> Kernel { taps(radius).zip(&gauss).map(|(x, g)| shape(x) * g).collect() };
    let edge = balanced(&shaped(&|x| -x));
    let point = balanced(&shaped(&|x| x * x / (sigma * sigma) - 1.0));
    let total: f64 = gauss.iter().sum();
    let smooth: Kernel = gauss.iter().map(|g| g / total).collect();
    let strengths = |picture: &Displayed| -> [Vec<f64>; 2] {
        let luma = Plane::of(picture, |c| relative_xyz(c)[1]);
        [&edge, &point].map(|kernel| {
            let (across, down) = (luma.filter(kernel, &smooth), luma.filter(&smooth, kernel));
            across.values.iter().zip(&down.values).map(|(&x, &y)| libm::hypot(x, y)).collect()
        })
    };
    let (a, b) = (strengths(reference), strengths(test));
    (0..reference.rgb.len())
        .map(|i| {
            let off = (a[0][i] - b[0][i]).abs().max((a[1][i] - b[1][i]).abs());
            libm::pow(off * FRAC_1_SQRT_2, Q_F).clamp(0.0, 1.0)
        })
        .collect()
}

/// The kernel with its positive weights scaled to sum 1 and its negative ones to -1.
fn balanced(kernel: &[f64]) -> Kernel {
    let positive: f64 = kernel.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|w| **w < 0.0).sum::<f64>();
    kernel.iter().map(|&w| if w > 0.0 { w / positive } else { w / negative }).collect()
}
