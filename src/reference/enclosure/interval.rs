//! Intervals of real numbers, every operation rounded outwards.

use super::rounding::{add_down, add_up, div_down, div_up, mul_down, mul_up, step_down, step_up};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All real numbers from `lo` to `hi`. A bound may be infinite: nothing is known on that side.
///
/// # Guarantees
/// `lo <= hi`, neither is NaN. An operation's result holds the exact result of that operation on all numbers of its operands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    lo: f64,
    hi: f64,
}

/// How many numbers a result of `libm` may be away from the exact one. Its `exp`, `log` and `log1p` are FreeBSD's (msun), whose sources
/// state an error below 1 ulp each; the rest is margin.
const LIBM: u32 = 4;

impl Interval {
    pub(super) const ZERO: Self = Self { lo: 0.0, hi: 0.0 };
    pub(super) const ONE: Self = Self { lo: 1.0, hi: 1.0 };
    pub(super) const UNIT: Self = Self { lo: 0.0, hi: 1.0 };
    pub(super) const WHOLE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// From `lo` to `hi`; everything where these are no bounds.
    pub(super) fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::WHOLE }
    }

    /// The number itself.
    pub(super) fn point(x: f64) -> Self {
        Self::new(x, x)
    }

    /// From -x to x.
    pub(super) fn around_zero(x: f64) -> Self {
        Self::new(-x, x)
    }

    pub(super) fn lo(self) -> f64 {
        self.lo
    }

    pub(super) fn hi(self) -> f64 {
        self.hi
    }

    /// Its width, rounded up.
    pub(super) fn width(self) -> f64 {
        add_up(self.hi, -self.lo)
    }

    /// A number in it, near its middle; 0 where it has no bounds.
    pub(super) fn middle(self) -> f64 {
        let middle = 0.5 * self.lo + 0.5 * self.hi;
        if middle.is_finite() { middle.clamp(self.lo, self.hi) } else { 0.0_f64.clamp(self.lo, self.hi) }
    }

    /// The largest absolute value.
    pub(super) fn most(self) -> f64 {
        self.hi.max(-self.lo)
    }

    /// The smallest absolute value.
    pub(super) fn least(self) -> f64 {
        self.lo.max(-self.hi).max(0.0)
    }

    pub(super) fn holds(self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// The least interval that holds both.
    pub(super) fn hull(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// What both hold. Both are known to hold the same number; where they do not meet the first is kept.
    pub(super) fn meet(self, other: Self) -> Self {
        let (lo, hi) = (self.lo.max(other.lo), self.hi.min(other.hi));
        if lo <= hi { Self { lo, hi } } else { self }
    }

    /// Each number moved to the nearest one within `lo` and `hi`.
    pub(super) fn clamp(self, lo: f64, hi: f64) -> Self {
        Self { lo: self.lo.clamp(lo, hi), hi: self.hi.clamp(lo, hi) }
    }

    /// Squares.
    pub(super) fn squared(self) -> Self {
        let (least, most) = (self.least(), self.most());
        Self { lo: mul_down(least, least).max(0.0), hi: mul_up(most, most) }
    }

    /// Square roots of what is not negative. IEEE 754 rounds them to nearest.
    pub(super) fn sqrt(self) -> Self {
        let root = |x: f64| x.max(0.0).sqrt();
        Self { lo: step_down(root(self.lo)).max(0.0), hi: step_up(root(self.hi)) }
    }

    /// exp(x).
    pub(super) fn exponential(self) -> Self {
        let hi = if self.hi == f64::NEG_INFINITY { 0.0 } else { widen(libm::exp(self.hi), step_up) };
        Self { lo: widen(libm::exp(self.lo), step_down).max(0.0), hi }
    }

    /// exp(-x) of x from 0 up: within `[0,1]`.
    pub(super) fn exp_minus(self) -> Self {
        let all = (-self).exponential();
        Self { lo: all.lo.min(1.0), hi: all.hi.min(1.0) }
    }

    /// -ln(1 - x) of x within `[0,1]`; infinite at 1.
    pub(super) fn extinction(self) -> Self {
        let of = |x: f64| -libm::log1p(-x.clamp(0.0, 1.0));
        let lo = if self.lo <= 0.0 { 0.0 } else { widen(of(self.lo), step_down).max(0.0) };
        let hi = if self.hi <= 0.0 { 0.0 } else { widen(of(self.hi), step_up) };
        Self { lo, hi }
    }

    /// Natural logarithms of positive numbers; of 0 and less, nothing is known below.
    pub(super) fn logarithm(self) -> Self {
        let lo = if self.lo > 0.0 { widen(libm::log(self.lo), step_down) } else { f64::NEG_INFINITY };
        let hi = if self.hi > 0.0 { widen(libm::log(self.hi), step_up) } else { f64::INFINITY };
        Self { lo, hi }
    }

    /// The product with a number.
    pub(super) fn times(self, x: f64) -> Self {
        self * Self::point(x)
    }
}

/// `x` moved by [`LIBM`] steps; infinities are exact.
fn widen(x: f64, step: impl Fn(f64) -> f64) -> f64 {
    if x.is_infinite() { x } else { (0..LIBM).fold(x, |x, _| step(x)) }
}

impl Neg for Interval {
    type Output = Self;

    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { lo: add_down(self.lo, other.lo), hi: add_up(self.hi, other.hi) }
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (a, b) = (self, other);
        // By signs: which bounds make the least and the greatest product.
        let (lo, hi) = if a.lo >= 0.0 {
            if b.lo >= 0.0 {
                ((a.lo, b.lo), (a.hi, b.hi))
            } else if b.hi <= 0.0 {
                ((a.hi, b.lo), (a.lo, b.hi))
            } else {
                ((a.hi, b.lo), (a.hi, b.hi))
            }
        } else if a.hi <= 0.0 {
            if b.lo >= 0.0 {
                ((a.lo, b.hi), (a.hi, b.lo))
            } else if b.hi <= 0.0 {
                ((a.hi, b.hi), (a.lo, b.lo))
            } else {
                ((a.lo, b.hi), (a.lo, b.lo))
            }
        } else if b.lo >= 0.0 {
            ((a.lo, b.hi), (a.hi, b.hi))
        } else if b.hi <= 0.0 {
            ((a.hi, b.lo), (a.lo, b.lo))
        } else {
            let lo = mul_down(a.lo, b.hi).min(mul_down(a.hi, b.lo));
            return Self { lo, hi: mul_up(a.lo, b.lo).max(mul_up(a.hi, b.hi)) };
        };
        Self { lo: mul_down(lo.0, lo.1), hi: mul_up(hi.0, hi.1) }
    }
}

impl Div for Interval {
    type Output = Self;

    /// Everything where the divisor holds 0.
    fn div(self, other: Self) -> Self {
        let (a, b) = (self, other);
        if b.holds(0.0) {
            return Self::WHOLE;
        }
        if b.hi < 0.0 {
            return -a / -b;
        }
        let lo = div_down(a.lo, if a.lo >= 0.0 { b.hi } else { b.lo });
        let hi = div_up(a.hi, if a.hi >= 0.0 { b.lo } else { b.hi });
        Self { lo, hi }
    }
}

#[cfg(test)]
mod tests;
