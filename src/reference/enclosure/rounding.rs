//! Sums, products and quotients of f64, rounded towards minus or plus infinity.
//!
//! Rust rounds to nearest, so the exact result lies between the neighbours of the rounded one. Where the rounded result is known to be exact it
//! is kept as it is: zeros stay zeros, and sums and products of small whole numbers stay points. For sums an exact test exists (Knuth's two-sum
//! gives what rounding has taken away); for products the lengths of the two mantissas tell.
//!
//! Results never lie strictly between 0 and the smallest normal number: there the bound moves on to 0 or to that number, which is
//! sound, and fast on processors that compute slowly with subnormal numbers.

/// The greatest f64 below `x`, but for subnormal numbers, which are passed over. Infinities stay.
pub(super) fn step_down(x: f64) -> f64 {
    -step_up(-x)
}

/// The least f64 above `x`, but for subnormal numbers, which are passed over. Infinities stay.
pub(super) fn step_up(x: f64) -> f64 {
    if x >= f64::MIN_POSITIVE {
        // From the greatest finite number on to infinity, and no farther.
        if x == f64::INFINITY { x } else { f64::from_bits(x.to_bits() + 1) }
    } else if x <= -f64::MIN_POSITIVE {
        if x == f64::NEG_INFINITY {
            x
        } else if x == -f64::MIN_POSITIVE {
            0.0
        } else {
            f64::from_bits(x.to_bits() - 1)
        }
    } else if x >= 0.0 {
        f64::MIN_POSITIVE
    } else {
        0.0
    }
}

/// Sizes up to which two-sum's own steps cannot overflow.
const SAFE: f64 = 1e300;

/// The greatest f64 at or below a + b; minus infinity where that is no number.
pub(super) fn add_down(a: f64, b: f64) -> f64 {
    let s = a + b;
    if s.abs() > SAFE || s.is_nan() {
        return far_down(s, a.is_finite() && b.is_finite());
    }
    let part = s - a;
    let lost = (a - (s - part)) + (b - part);
    if lost < 0.0 { step_down(s) } else { s }
}

/// The least f64 at or above a + b; infinity where that is no number.
pub(super) fn add_up(a: f64, b: f64) -> f64 {
    -add_down(-a, -b)
}

/// A lower bound of a product; 0 times anything is 0.
pub(super) fn mul_down(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    let p = a * b;
    if p.abs() > SAFE || p.is_nan() {
        return far_down(p, a.is_finite() && b.is_finite());
    }
    if p.abs() < f64::MIN_POSITIVE {
        return if (a > 0.0) == (b > 0.0) { 0.0 } else { -f64::MIN_POSITIVE };
    }
    if exact_product(a, b) { p } else { step_down(p) }
}

/// An upper bound of a product.
pub(super) fn mul_up(a: f64, b: f64) -> f64 {
    -mul_down(-a, b)
}

/// A lower bound of a quotient; `b` is not 0.
pub(super) fn div_down(a: f64, b: f64) -> f64 {
    let q = a / b;
    if q.abs() > SAFE || q.is_nan() {
        return far_down(q, a.is_finite() && b.is_finite());
    }
    let back = q * b;
    if a == 0.0 || (back == a && back.abs() >= f64::MIN_POSITIVE && exact_product(q, b)) { q } else { step_down(q) }
}

/// An upper bound of a quotient; `b` is not 0.
pub(super) fn div_up(a: f64, b: f64) -> f64 {
    -div_down(-a, b)
}

/// A lower bound where the rounded result `x` is large, infinite or NaN; `finite` where the operands are finite.
fn far_down(x: f64, finite: bool) -> f64 {
    if x.is_nan() {
        f64::NEG_INFINITY
    } else if x == f64::INFINITY {
        // An overflow of finite numbers, or truly infinite.
        if finite { f64::MAX } else { x }
    } else {
        step_down(x)
    }
}

/// Whether a product that is neither too large nor too small is known to be exact: the two mantissas together have no more than 53 bits.
fn exact_product(a: f64, b: f64) -> bool {
    const MANTISSA: u64 = (1 << 52) - 1;
    // Half of 53 bits each, the implicit first one included.
    const HALF: u64 = (1 << 27) - 1;
    let (a, b) = (a.to_bits(), b.to_bits());
    (a | b) & HALF == 0 || a & MANTISSA == 0 || b & MANTISSA == 0
}
