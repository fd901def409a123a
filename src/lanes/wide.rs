//! Lanes on the `wide` crate: two vectors of four, SSE2 on x86-64 and NEON on aarch64 in a default build.
//!
//! Four lanes each rather than `f32x8`, whose conversions fall back to single numbers where AVX is not compiled in.

use super::doubles::doubles_as_arrays;
use super::table::LookupTable;
use super::{Lanes, WIDTH};
use bytemuck::cast;
use wide::{CmpEq, CmpGt, CmpLe, CmpLt, f32x4, i32x4};

/// See [`Lanes`].
#[derive(Clone, Copy)]
pub(crate) struct Wide;

type F = [f32x4; 2];
type I = [i32x4; 2];

#[inline(always)]
fn both<T: Copy, R>(a: [T; 2], b: [T; 2], op: impl Fn(T, T) -> R) -> [R; 2] {
    [op(a[0], b[0]), op(a[1], b[1])]
}

#[inline(always)]
fn each<T: Copy, R>(a: [T; 2], op: impl Fn(T) -> R) -> [R; 2] {
    [op(a[0]), op(a[1])]
}

// MINPS and MAXPS are "second when either is NaN"; other instruction sets need it spelt out.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn min4(a: f32x4, b: f32x4) -> f32x4 {
    a.fast_min(b)
}
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn max4(a: f32x4, b: f32x4) -> f32x4 {
    a.fast_max(b)
}
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn min4(a: f32x4, b: f32x4) -> f32x4 {
    a.cmp_lt(b).blend(a, b)
}
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn max4(a: f32x4, b: f32x4) -> f32x4 {
    a.cmp_gt(b).blend(a, b)
}

impl Lanes for Wide {
    type F = F;
    type I = I;
    type M = F;
    doubles_as_arrays!(cast, cast, cast);

    #[inline(always)]
    fn splat(x: f32) -> F {
        [f32x4::splat(x); 2]
    }
    #[inline(always)]
    fn load(from: &[f32; WIDTH]) -> F {
        cast(*from)
    }
    #[inline(always)]
    fn store(x: F, to: &mut [f32; WIDTH]) {
        *to = cast(x);
    }
    #[inline(always)]
    fn add(a: F, b: F) -> F {
        both(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(a: F, b: F) -> F {
        both(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(a: F, b: F) -> F {
        both(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(a: F, b: F) -> F {
        both(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn sqrt(a: F) -> F {
        each(a, f32x4::sqrt)
    }
    #[inline(always)]
    fn min(a: F, b: F) -> F {
        both(a, b, min4)
    }
    #[inline(always)]
    fn max(a: F, b: F) -> F {
        both(a, b, max4)
    }
    #[inline(always)]
    fn lt(a: F, b: F) -> F {
        both(a, b, |a, b| a.cmp_lt(b))
    }
    #[inline(always)]
    fn le(a: F, b: F) -> F {
        both(a, b, |a, b| a.cmp_le(b))
    }
    #[inline(always)]
    fn keep(m: F, a: F) -> F {
        both(m, a, |m, a| m & a)
    }
    #[inline(always)]
    fn select(m: F, a: F, b: F) -> F {
        [m[0].blend(a[0], b[0]), m[1].blend(a[1], b[1])]
    }
    #[inline(always)]
    fn bits(m: F) -> u8 {
        (m[0].move_mask() | m[1].move_mask() << 4) as u8
    }
    #[inline(always)]
    fn and(a: F, b: F) -> F {
        both(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> F {
        let lane: I = [i32x4::new([1, 2, 4, 8]), i32x4::new([16, 32, 64, 128])];
        let bits = i32x4::splat(i32::from(bits));
        each(lane, |lane| cast((bits & lane).cmp_eq(lane)))
    }
    #[inline(always)]
    fn trunc(x: F) -> I {
        each(x, f32x4::fast_trunc_int)
    }
    #[inline(always)]
    fn to_f(x: I) -> F {
        each(x, f32x4::from_i32x4)
    }
    #[inline(always)]
    fn splat_i(x: i32) -> I {
        [i32x4::splat(x); 2]
    }
    #[inline(always)]
    fn load_i(from: &[i32; WIDTH]) -> I {
        cast(*from)
    }
    #[inline(always)]
    fn store_i(x: I, to: &mut [i32; WIDTH]) {
        *to = cast(x);
    }
    #[inline(always)]
    fn add_i(a: I, b: I) -> I {
        both(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub_i(a: I, b: I) -> I {
        both(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul_i(a: I, b: I) -> I {
        both(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn and_i(a: I, b: I) -> I {
        both(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or_i(a: I, b: I) -> I {
        both(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn shl<const N: i32>(a: I) -> I {
        each(a, |a| a << N)
    }
    #[inline(always)]
    fn sar<const N: i32>(a: I) -> I {
        each(a, |a| a >> N)
    }
    #[inline(always)]
    fn min_i(a: I, b: I) -> I {
        both(a, b, |a, b| a.cmp_gt(b).blend(b, a))
    }
    #[inline(always)]
    fn max_i(a: I, b: I) -> I {
        both(a, b, |a, b| a.cmp_gt(b).blend(a, b))
    }
    #[inline(always)]
    fn select_i(m: F, a: I, b: I) -> I {
        let m: I = [cast(m[0]), cast(m[1])];
        [m[0].blend(a[0], b[0]), m[1].blend(a[1], b[1])]
    }
    #[inline(always)]
    fn eq_i(a: I, b: I) -> F {
        both(a, b, |a, b| cast(a.cmp_eq(b)))
    }
    #[inline(always)]
    fn gt_i(a: I, b: I) -> F {
        both(a, b, |a, b| cast(a.cmp_gt(b)))
    }
    #[inline(always)]
    fn to_bits(x: F) -> I {
        cast(x)
    }
    #[inline(always)]
    fn of_bits(x: I) -> F {
        cast(x)
    }
    #[inline(always)]
    fn load_u16(from: &[u16; WIDTH]) -> I {
        // Little-endian halves of 32-bit lanes: interleaving with zeros widens.
        cast(from.map(i32::from))
    }
    #[inline(always)]
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: F) -> [F; 4] {
        let fraction: [f32; WIDTH] = cast(fraction);
        let row = |i: usize| {
            // SAFETY: the caller's.
            let [value, next] = unsafe { table.pair(at[i]) }.map(|entry| f32x4::new(*entry));
            value + (next - value) * f32x4::splat(fraction[i])
        };
        let a = f32x4::transpose([row(0), row(1), row(2), row(3)]);
        let b = f32x4::transpose([row(4), row(5), row(6), row(7)]);
        std::array::from_fn(|c| [a[c], b[c]])
    }
}
