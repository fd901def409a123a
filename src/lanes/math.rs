//! Transcendentals on lanes, built from IEEE operations only, so that every instruction set gives the same bits.

use super::Lanes;
use std::f32::consts::LN_2;

/// Upper part of ln 2, exact in few bits, so that its small multiples are exact.
const LN2_HI: f32 = 0.693_359_4;
/// The rest of ln 2.
const LN2_LO: f32 = -2.121_944_4e-4;

/// 2^n and expm1(r) of x = n ln 2 + r with |r| <= ln(2)/2, for x in [-87, 0]: r by a subtraction in two parts, expm1(r) by its
/// Taylor series to r^8 (remainder below 1e-9 relative).
#[inline(always)]
fn reduced<L: Lanes>(x: L::F) -> (L::F, L::F) {
    let n = L::trunc(L::sub(L::mul(x, L::splat(1.0 / LN_2)), L::splat(0.5)));
    let nf = L::to_f(n);
    let r = L::sub(L::sub(x, L::mul(nf, L::splat(LN2_HI))), L::mul(nf, L::splat(LN2_LO)));
    let mut p = L::splat(1.0 / 40320.0);
    for c in [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5] {
        p = L::add(L::mul(p, r), L::splat(c));
    }
    // r + r^2 p keeps the leading term exact.
    let e = L::add(r, L::mul(L::mul(r, r), p));
    (L::of_bits(L::shl::<23>(L::add_i(n, L::splat_i(127)))), e)
}

/// expm1(x) for x <= 0 (-inf gives -1); NaN gives NaN or -1. Error below 2 units in the last place.
///
/// 2^n expm1(r) + (2^n - 1), with x = n ln 2 + r.
#[inline(always)]
pub(crate) fn expm1_negative<L: Lanes>(x: L::F) -> L::F {
    // Below -87 the result is -1 to the last bit; the bound keeps 2^n normal.
    let (two_n, e) = reduced::<L>(L::max(x, L::splat(-87.0)));
    L::add(L::mul(two_n, e), L::sub(two_n, L::splat(1.0)))
}

/// exp(x) for x <= 0, through the same reduction: error below 2 units in the last place, 0 below -87.
#[inline(always)]
pub(crate) fn exp_negative<L: Lanes>(x: L::F) -> L::F {
    let alive = L::le(L::splat(-87.0), x);
    let (two_n, e) = reduced::<L>(L::max(x, L::splat(-87.0)));
    L::keep(alive, L::mul(two_n, L::add(L::splat(1.0), e)))
}

/// log1p(-a) for a in `[0,1]`; a = 1 gives a number below -1e30 that stands for minus infinity.
///
/// 1 - a = 2^e (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)); log1p(f) = 2 atanh(f / (2 + f)). Where e = 0, f is -a itself: small
/// opacities keep their relative accuracy. Error below 3 units in the last place of the result for the rounded 1 - a.
#[inline(always)]
pub(crate) fn log1p_negated<L: Lanes>(a: L::F) -> L::F {
    logarithm::<L>(L::sub(L::splat(1.0), a), L::sub(L::splat(0.0), a))
}

/// ln(y) for y in `[0,1]`, within 3 units in the last place; y = 0 gives a number below -1e30 that stands for minus infinity.
#[inline(always)]
pub(crate) fn ln_below_one<L: Lanes>(y: L::F) -> L::F {
    // Exact where it counts: from a half on.
    logarithm::<L>(y, L::sub(y, L::splat(1.0)))
}

/// ln(y), where y is 1 + `above_one` but for the rounding of y.
#[inline(always)]
fn logarithm<L: Lanes>(y: L::F, above_one: L::F) -> L::F {
    let bits = L::to_bits(y);
    // Adding the distance from sqrt(1/2) to 1 moves the split between exponents to sqrt(1/2).
    let shifted = L::add_i(bits, L::splat_i(0x3f80_0000 - 0x3f35_04f3));
    let e = L::sub_i(L::sar::<23>(shifted), L::splat_i(127));
    let m = L::of_bits(L::sub_i(bits, L::shl::<23>(e)));
    let near = L::eq_i(e, L::splat_i(0));
    let f = L::select(near, above_one, L::sub(m, L::splat(1.0)));
    let s = L::div(f, L::add(L::splat(2.0), f));
    let z = L::mul(s, s);
    let mut p = L::splat(2.0 / 9.0);
    for c in [2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0] {
        p = L::add(L::mul(p, z), L::splat(c));
    }
    let log = L::add(L::add(s, s), L::mul(L::mul(s, z), p));
    let ef = L::to_f(e);
    let sum = L::add(L::mul(ef, L::splat(LN2_HI)), L::add(log, L::mul(ef, L::splat(LN2_LO))));
    // y = 0 has no logarithm.
    L::select(L::lt(L::splat(0.0), y), sum, L::splat(-1e38))
}

/// The opacity of a slab `ratio` times as thick: 1 - (1 - a)^ratio, for a in `[0,1]` and ratio > 0.
#[inline(always)]
pub(crate) fn opacity_for_ratio<L: Lanes>(a: L::F, ratio: L::F) -> L::F {
    let exponent = L::mul(log1p_negated::<L>(a), ratio);
    L::sub(L::splat(0.0), expm1_negative::<L>(exponent))
}
