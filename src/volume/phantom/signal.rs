//! The Marschner-Lobb test signal (Marschner and Lobb, "An evaluation of reconstruction filters for volume rendering", 1994).

use std::f64::consts::{FRAC_PI_2, PI};

/// Frequency of the rings.
const F_M: f64 = 6.0;
/// Height of the rings against the slope along z.
const ALPHA: f64 = 0.25;

/// The signal, in `[0,1]`:
/// rho = (1 - sin(pi z/2) + alpha (1 + rho_r(r))) / (2 (1 + alpha)) with rho_r(r) = cos(2 pi f_M cos(pi r/2)), r^2 = x^2 + y^2.
pub(super) fn marschner_lobb([x, y, z]: [f64; 3]) -> f64 {
    let r = (x * x + y * y).sqrt();
    let rings = libm::cos(2.0 * PI * F_M * libm::cos(FRAC_PI_2 * r));
    (1.0 - libm::sin(FRAC_PI_2 * z) + ALPHA * (1.0 + rings)) / (2.0 * (1.0 + ALPHA))
}
