//! Integrals that have a closed form: what code is checked against.
//!
//! Lengths in world units, extinction per world unit, opacity in `[0,1]`.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

/// Extinction of opacity `a` per reference length: -ln(1-a) / `unit`; infinite for a = 1.
pub fn extinction(a: f64, unit: f64) -> f64 {
    -libm::log1p(-a) / unit
}

/// Opacity of optical depth `tau`: 1 - exp(-tau).
pub fn opacity(tau: f64) -> f64 {
    -libm::expm1(-tau)
}

/// Premultiplied colour of constant straight colour `c` over any extinction of optical depth `tau`: c (1 - exp(-tau)).
pub fn constant_color(c: f64, tau: f64) -> f64 {
    c * opacity(tau)
}

/// Premultiplied colour where the straight colour goes evenly from `c0` to `c1` through constant extinction of optical depth `tau`:
/// c0 - c1 exp(-tau) + (c1 - c0) (1 - exp(-tau)) / tau.
pub fn linear_color(c0: f64, c1: f64, tau: f64) -> f64 {
    c0 * opacity(tau) + (c1 - c0) * (phi1(-tau) - libm::exp(-tau))
}

/// Optical depth of extinction k0 + k1 x over x from 0 to `length`.
pub fn ramp_depth(k0: f64, k1: f64, length: f64) -> f64 {
    k0 * length + 0.5 * k1 * length * length
}

/// Optical depth of a Gaussian k exp(-(x-center)^2 / (2 sigma^2)) over x from `from` to `to`.
pub fn gaussian_depth(k: f64, center: f64, sigma: f64, from: f64, to: f64) -> f64 {
    let erf = |x: f64| libm::erf((x - center) / sigma * FRAC_1_SQRT_2);
    k * sigma * FRAC_PI_2.sqrt() * (erf(to) - erf(from))
}

/// Optical depth where the opacity per reference length goes evenly from `a0` to `a1` over `lengths` reference lengths:
/// the mean of -ln(1-a), with u ln u - u as the antiderivative of ln u.
pub fn opacity_ramp_depth(a0: f64, a1: f64, lengths: f64) -> f64 {
    let (u0, u1) = (1.0 - a0, 1.0 - a1);
    if (u1 - u0).abs() < 1e-6 {
        // The antiderivative's difference would cancel: the mean of ln over a narrow range, by Simpson's rule.
        let middle = libm::log(0.5 * (u0 + u1));
        return -lengths * (libm::log(u0) + 4.0 * middle + libm::log(u1)) / 6.0;
    }
    let whole = |u: f64| if u == 0.0 { 0.0 } else { u * libm::log(u) - u };
    -lengths * (whole(u1) - whole(u0)) / (u1 - u0)
}

/// Opacity of `n` slices of opacity `a`: 1 - (1-a)^n.
pub fn equal_slices(a: f64, n: u64) -> f64 {
    if n == 0 { 0.0 } else { -libm::expm1(n as f64 * libm::log1p(-a)) }
}

/// Colour of constant emission `q` per length through constant extinction `kappa`: q L phi1(-kappa L).
pub fn emission(q: f64, kappa: f64, length: f64) -> f64 {
    if kappa.is_infinite() {
        return 0.0;
    }
    q * length * phi1(-kappa * length)
}

/// phi1(x) = (exp(x) - 1) / x, continued by 1 at 0.
pub fn phi1(x: f64) -> f64 {
    if x.abs() < 1e-5 {
        // The next term is below x^3/24 < 1e-16.
        return 1.0 + 0.5 * x + x * x / 6.0;
    }
    libm::expm1(x) / x
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// Midpoint sums with one Richardson step: order 4.
    fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
        let sum = |n: u32| (0..n).map(|i| f(a + (b - a) * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() * (b - a) / f64::from(n);
        (4.0 * sum(2000) - sum(1000)) / 3.0
    }

    #[test]
    fn closed_forms_are_their_integrals() {
        assert!((ramp_depth(0.3, -0.1, 2.0) - integral(|x| 0.3 - 0.1 * x, 0.0, 2.0)).abs() < 1e-12);
        let gauss = |x: f64| 0.7 * libm::exp(-(x - 1.0) * (x - 1.0) / (2.0 * 0.3 * 0.3));
        assert!((gaussian_depth(0.7, 1.0, 0.3, -0.5, 1.4) - integral(gauss, -0.5, 1.4)).abs() < 1e-11);
        for (a0, a1) in [(0.1, 0.7), (0.7, 0.1), (0.4, 0.4), (0.4, 0.4 + 2e-7), (0.0, 0.95)] {
            let direct = integral(|x| -libm::log1p(-(a0 + (a1 - a0) * x)), 0.0, 1.0) * 3.0;
            assert!((opacity_ramp_depth(a0, a1, 3.0) - direct).abs() < 1e-9, "{a0} {a1}");
        }
        // The mean of -ln(1-a) up to 1 is finite: 1.
        assert!((opacity_ramp_depth(0.0, 1.0, 1.0) - 1.0).abs() < 1e-15);
        for tau in [1e-9, 1e-5, 0.3, 5.0, 40.0] {
            let direct = integral(|s| (0.2 + 0.6 * s) * tau * libm::exp(-tau * s), 0.0, 1.0);
            assert!((linear_color(0.2, 0.8, tau) - direct).abs() < 1e-8, "{tau}");
            assert!((linear_color(0.4, 0.4, tau) - constant_color(0.4, tau)).abs() < 1e-16, "{tau}");
        }
    }

    #[test]
    fn emission_has_its_limits() {
        assert_eq!(emission(0.5, 0.0, 3.0), 1.5);
        assert!((emission(0.5, 1e9, 3.0) - 0.5e-9).abs() < 1e-24);
        assert_eq!(emission(0.5, f64::INFINITY, 3.0), 0.0);
        for x in [-1.001e-5, -0.999e-5, 0.999e-5, 1.001e-5] {
            assert!((phi1(x) - (1.0 + 0.5 * x + x * x / 6.0)).abs() < 1e-15);
        }
        // Emission q = kappa c is the constant colour.
        assert!((emission(0.3 * 0.8, 0.8, 2.0) - constant_color(0.3, 1.6)).abs() < 1e-15);
    }

    #[test]
    fn slices_and_extinction_agree() {
        assert!((equal_slices(0.25, 3) - (1.0 - 0.75 * 0.75 * 0.75)).abs() < 1e-15);
        assert_eq!(equal_slices(1.0, 4), 1.0);
        assert_eq!(equal_slices(1.0, 0), 0.0);
        assert!((opacity(extinction(0.25, 2.0) * 6.0) - equal_slices(0.25, 3)).abs() < 1e-15);
        assert_eq!(extinction(1.0, 1.0), f64::INFINITY);
        assert_eq!(opacity(f64::INFINITY), 1.0);
    }
}
