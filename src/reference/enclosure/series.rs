//! Taylor series with interval coefficients: what a smooth function is near a place, and how far it can be from that.
//!
//! Coefficient k is the k-th derivative over k!. A series at a point m holds the function's own coefficients there; a series over a range
//! holds those at every place of the range. Taylor's theorem (Lagrange's remainder): f(s) = sum over k < 4 of f_k(m) (s-m)^k + f_4(x) (s-m)^4
//! with x between m and s. The rules for products, quotients, exponentials and roots are those of automatic differentiation (R. E. Moore,
//! Interval Analysis, 1966, chapter 11).

use super::interval::Interval;

/// Number of coefficients: the last one is the remainder's.
pub(super) const TERMS: usize = 5;

/// Coefficients from the constant one on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Series(pub(super) [Interval; TERMS]);

impl Series {
    /// A function that is the same everywhere.
    pub(super) fn constant(c: Interval) -> Self {
        let mut out = [Interval::ZERO; TERMS];
        out[0] = c;
        Self(out)
    }

    pub(super) fn plus(&self, c: Interval) -> Self {
        let mut out = *self;
        out.0[0] = out.0[0] + c;
        out
    }

    pub(super) fn product(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|k| convolved(&self.0, &other.0, k)))
    }

    /// -ln of a positive function: u l' = u' gives k u0 l_k = k u_k - sum over 0 < j < k of j l_j u_(k-j).
    pub(super) fn minus_ln(&self) -> Self {
        let u = &self.0;
        let mut l = [Interval::ZERO; TERMS];
        l[0] = u[0].logarithm();
        for k in 1..TERMS {
            let mut sum = u[k].times(k as f64);
            for j in 1..k {
                sum = sum - l[j].times(j as f64) * u[k - j];
            }
            l[k] = sum / u[0].times(k as f64);
        }
        Self(l.map(|c| -c))
    }

    /// exp(-x): k f_k = - sum over 0 < j <= k of j x_j f_(k-j).
    pub(super) fn exp_minus(&self) -> Self {
        let x = &self.0;
        let mut f = [Interval::ZERO; TERMS];
        f[0] = (-x[0]).exponential();
        for k in 1..TERMS {
            let mut sum = Interval::ZERO;
            for j in 1..=k {
                sum = sum + x[j].times(j as f64) * f[k - j];
            }
            f[k] = -sum / Interval::point(k as f64);
        }
        Self(f)
    }

    /// Square root of a positive function: 2 z0 z_k = w_k - sum over 0 < j < k of z_j z_(k-j).
    pub(super) fn sqrt(&self) -> Self {
        let w = &self.0;
        let mut z = [Interval::ZERO; TERMS];
        z[0] = w[0].sqrt();
        for k in 1..TERMS {
            let mut sum = w[k];
            for j in 1..k {
                sum = sum - z[j] * z[k - j];
            }
            z[k] = sum / z[0].times(2.0);
        }
        Self(z)
    }
}

/// Coefficient k of a product.
pub(super) fn convolved(a: &[Interval; TERMS], b: &[Interval; TERMS], k: usize) -> Interval {
    (0..=k).fold(Interval::ZERO, |sum, j| sum + a[j] * b[k - j])
}

/// The integral over [m-r, m+r] of a function with the series `at` in m and `over` on that range: odd powers cancel.
pub(super) fn integral(at: &Series, over: &Series, r: f64) -> Interval {
    integral_of(at.0[0], at.0[2], over.0[4], r)
}

/// As [`integral`], from the coefficients that it needs.
pub(super) fn integral_of(at0: Interval, at2: Interval, over4: Interval, r: f64) -> Interval {
    let r = Interval::point(r);
    let (squared, third, fifth) = (r.squared(), Interval::ONE / Interval::point(3.0), Interval::ONE / Interval::point(5.0));
    (r.times(2.0)) * (at0 + squared * (at2 * third + squared * (over4 * fifth)))
}

/// The integral over [m-r, m] of a function with the series `at` in m and `over` on that range.
pub(super) fn integral_before(at: &Series, over: &Series, r: f64) -> Interval {
    let r = Interval::point(r);
    let term = |c: Interval, k: usize| (if k % 2 == 0 { c } else { -c }) / Interval::point((k + 1) as f64);
    r * (0..4).rev().fold(term(over.0[4], 4), |sum, k| term(at.0[k], k) + r * sum)
}
