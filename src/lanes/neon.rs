//! Lanes on NEON intrinsics, which are part of aarch64: two vectors of four f32 or i32, four of two f64.
//!
//! No operation is fused: LLVM joins a multiplication and an addition only where it is told to.

use super::table::LookupTable;
use super::{Lanes, WIDTH};
use std::arch::aarch64::*;

/// See [`Lanes`].
#[derive(Clone, Copy)]
pub(crate) struct Neon;

type F = [float32x4_t; 2];
type I = [int32x4_t; 2];
type M = [uint32x4_t; 2];
type D = [float64x2_t; 4];

/// Wraps intrinsics that only compute on registers.
macro_rules! op {
    ($e:expr) => {
        // SAFETY: register-only intrinsics of NEON, without which there is no aarch64 with the standard library.
        unsafe { $e }
    };
}

/// An operation on both vectors of its arguments.
macro_rules! both {
    ($op:path, $($x:ident),+) => {
        op!([$op($($x[0]),+), $op($($x[1]),+)])
    };
}

/// An operation on all four vectors of its arguments.
macro_rules! four {
    ($op:path, $($x:ident),+) => {
        op!([$op($($x[0]),+), $op($($x[1]),+), $op($($x[2]),+), $op($($x[3]),+)])
    };
}

/// Masks of f64 as those of f32: the lower half of each.
#[inline(always)]
fn halves(m: [uint64x2_t; 4]) -> M {
    op!([
        vuzp1q_u32(vreinterpretq_u32_u64(m[0]), vreinterpretq_u32_u64(m[1])),
        vuzp1q_u32(vreinterpretq_u32_u64(m[2]), vreinterpretq_u32_u64(m[3])),
    ])
}

/// Interpolated entry of lane `LANE` of a vector.
///
/// # Safety
/// `at[LANE]` is a place of the table behind `from`.
#[inline(always)]
unsafe fn row<const LANE: i32>(from: *const f32, at: &[u32; 4], fraction: float32x4_t) -> float32x4_t {
    // SAFETY: the caller's; unaligned is allowed.
    let (value, next) = unsafe {
        let entry = from.add(at[LANE as usize] as usize);
        (vld1q_f32(entry), vld1q_f32(entry.add(4)))
    };
    op!(vaddq_f32(value, vmulq_laneq_f32::<LANE>(vsubq_f32(next, value), fraction)))
}

/// Interpolated entries of four lanes, transposed: red, green, blue, alpha.
///
/// # Safety
/// As [`row`], for all of `at`.
#[inline(always)]
unsafe fn four_rows(from: *const f32, at: &[u32; 4], fraction: float32x4_t) -> [float32x4_t; 4] {
    // SAFETY: the caller's.
    let (a, b, c, d) =
        unsafe { (row::<0>(from, at, fraction), row::<1>(from, at, fraction), row::<2>(from, at, fraction), row::<3>(from, at, fraction)) };
    op!({
        // a0 b0 a2 b2, a1 b1 a3 b3, and the same of c and d.
        let (ab_even, ab_odd) = (vreinterpretq_f64_f32(vtrn1q_f32(a, b)), vreinterpretq_f64_f32(vtrn2q_f32(a, b)));
        let (cd_even, cd_odd) = (vreinterpretq_f64_f32(vtrn1q_f32(c, d)), vreinterpretq_f64_f32(vtrn2q_f32(c, d)));
        [
            vreinterpretq_f32_f64(vzip1q_f64(ab_even, cd_even)),
            vreinterpretq_f32_f64(vzip1q_f64(ab_odd, cd_odd)),
            vreinterpretq_f32_f64(vzip2q_f64(ab_even, cd_even)),
            vreinterpretq_f32_f64(vzip2q_f64(ab_odd, cd_odd)),
        ]
    })
}

impl Lanes for Neon {
    type F = F;
    type I = I;
    type M = M;
    type D = D;

    #[inline(always)]
    fn splat(x: f32) -> F {
        op!([vdupq_n_f32(x); 2])
    }
    #[inline(always)]
    fn load(from: &[f32; WIDTH]) -> F {
        // SAFETY: eight f32 behind the reference; unaligned is allowed.
        unsafe { [vld1q_f32(from.as_ptr()), vld1q_f32(from.as_ptr().add(4))] }
    }
    #[inline(always)]
    fn store(x: F, to: &mut [f32; WIDTH]) {
        // SAFETY: eight f32 behind the reference; unaligned is allowed.
        unsafe {
            vst1q_f32(to.as_mut_ptr(), x[0]);
            vst1q_f32(to.as_mut_ptr().add(4), x[1]);
        }
    }
    #[inline(always)]
    fn add(a: F, b: F) -> F {
        both!(vaddq_f32, a, b)
    }
    #[inline(always)]
    fn sub(a: F, b: F) -> F {
        both!(vsubq_f32, a, b)
    }
    #[inline(always)]
    fn mul(a: F, b: F) -> F {
        both!(vmulq_f32, a, b)
    }
    #[inline(always)]
    fn div(a: F, b: F) -> F {
        both!(vdivq_f32, a, b)
    }
    #[inline(always)]
    fn sqrt(a: F) -> F {
        both!(vsqrtq_f32, a)
    }
    #[inline(always)]
    fn min(a: F, b: F) -> F {
        // FMIN gives NaN when either is.
        Self::select(Self::lt(a, b), a, b)
    }
    #[inline(always)]
    fn max(a: F, b: F) -> F {
        Self::select(Self::lt(b, a), a, b)
    }
    #[inline(always)]
    fn lt(a: F, b: F) -> M {
        both!(vcltq_f32, a, b)
    }
    #[inline(always)]
    fn le(a: F, b: F) -> M {
        both!(vcleq_f32, a, b)
    }
    #[inline(always)]
    fn keep(m: M, a: F) -> F {
        op!({
            let kept = |m, a| vreinterpretq_f32_u32(vandq_u32(m, vreinterpretq_u32_f32(a)));
            [kept(m[0], a[0]), kept(m[1], a[1])]
        })
    }
    #[inline(always)]
    fn select(m: M, a: F, b: F) -> F {
        both!(vbslq_f32, m, a, b)
    }
    #[inline(always)]
    fn bits(m: M) -> u8 {
        op!({
            let low = vandq_u32(m[0], vld1q_u32([1, 2, 4, 8].as_ptr()));
            let high = vandq_u32(m[1], vld1q_u32([16, 32, 64, 128].as_ptr()));
            vaddvq_u32(vorrq_u32(low, high)) as u8
        })
    }
    #[inline(always)]
    fn and(a: M, b: M) -> M {
        both!(vandq_u32, a, b)
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> M {
        op!({
            let bits = vdupq_n_u32(u32::from(bits));
            [vtstq_u32(bits, vld1q_u32([1, 2, 4, 8].as_ptr())), vtstq_u32(bits, vld1q_u32([16, 32, 64, 128].as_ptr()))]
        })
    }
    #[inline(always)]
    fn trunc(x: F) -> I {
        both!(vcvtq_s32_f32, x)
    }
    #[inline(always)]
    fn whole(x: F) -> F {
        both!(vrndq_f32, x)
    }
    #[inline(always)]
    fn to_f(x: I) -> F {
        both!(vcvtq_f32_s32, x)
    }
    #[inline(always)]
    fn splat_i(x: i32) -> I {
        op!([vdupq_n_s32(x); 2])
    }
    #[inline(always)]
    fn load_i(from: &[i32; WIDTH]) -> I {
        // SAFETY: eight i32 behind the reference; unaligned is allowed.
        unsafe { [vld1q_s32(from.as_ptr()), vld1q_s32(from.as_ptr().add(4))] }
    }
    #[inline(always)]
    fn store_i(x: I, to: &mut [i32; WIDTH]) {
        // SAFETY: eight i32 behind the reference; unaligned is allowed.
        unsafe {
            vst1q_s32(to.as_mut_ptr(), x[0]);
            vst1q_s32(to.as_mut_ptr().add(4), x[1]);
        }
    }
    #[inline(always)]
    fn set_pairs(x: [u64; WIDTH]) -> [I; 2] {
        let [a, b, c, d]: [[i32; 4]; 4] = bytemuck::cast(x);
        // SAFETY: four i32 behind each reference.
        let [a, b, c, d] = unsafe { [vld1q_s32(a.as_ptr()), vld1q_s32(b.as_ptr()), vld1q_s32(c.as_ptr()), vld1q_s32(d.as_ptr())] };
        op!([[vuzp1q_s32(a, b), vuzp1q_s32(c, d)], [vuzp2q_s32(a, b), vuzp2q_s32(c, d)]])
    }
    #[inline(always)]
    fn add_i(a: I, b: I) -> I {
        both!(vaddq_s32, a, b)
    }
    #[inline(always)]
    fn sub_i(a: I, b: I) -> I {
        both!(vsubq_s32, a, b)
    }
    #[inline(always)]
    fn mul_i(a: I, b: I) -> I {
        both!(vmulq_s32, a, b)
    }
    #[inline(always)]
    fn and_i(a: I, b: I) -> I {
        both!(vandq_s32, a, b)
    }
    #[inline(always)]
    fn or_i(a: I, b: I) -> I {
        both!(vorrq_s32, a, b)
    }
    #[inline(always)]
    fn shl<const N: i32>(a: I) -> I {
        both!(vshlq_n_s32::<N>, a)
    }
    #[inline(always)]
    fn sar<const N: i32>(a: I) -> I {
        both!(vshrq_n_s32::<N>, a)
    }
    #[inline(always)]
    fn min_i(a: I, b: I) -> I {
        both!(vminq_s32, a, b)
    }
    #[inline(always)]
    fn max_i(a: I, b: I) -> I {
        both!(vmaxq_s32, a, b)
    }
    #[inline(always)]
    fn select_i(m: M, a: I, b: I) -> I {
        both!(vbslq_s32, m, a, b)
    }
    #[inline(always)]
    fn eq_i(a: I, b: I) -> M {
        both!(vceqq_s32, a, b)
    }
    #[inline(always)]
    fn gt_i(a: I, b: I) -> M {
        both!(vcgtq_s32, a, b)
    }
    #[inline(always)]
    fn to_bits(x: F) -> I {
        both!(vreinterpretq_s32_f32, x)
    }
    #[inline(always)]
    fn of_bits(x: I) -> F {
        both!(vreinterpretq_f32_s32, x)
    }
    #[inline(always)]
    fn load_u16(from: &[u16; WIDTH]) -> I {
        // SAFETY: eight u16 behind the reference; unaligned is allowed.
        let x = unsafe { vld1q_u16(from.as_ptr()) };
        op!([vreinterpretq_s32_u32(vmovl_u16(vget_low_u16(x))), vreinterpretq_s32_u32(vmovl_high_u16(x))])
    }
    #[inline(always)]
    fn splat_d(x: f64) -> D {
        op!([vdupq_n_f64(x); 4])
    }
    #[inline(always)]
    fn load_d(from: &[f64; WIDTH]) -> D {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe {
            let at = from.as_ptr();
            [vld1q_f64(at), vld1q_f64(at.add(2)), vld1q_f64(at.add(4)), vld1q_f64(at.add(6))]
        }
    }
    #[inline(always)]
    fn store_d(x: D, to: &mut [f64; WIDTH]) {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe {
            let at = to.as_mut_ptr();
            vst1q_f64(at, x[0]);
            vst1q_f64(at.add(2), x[1]);
            vst1q_f64(at.add(4), x[2]);
            vst1q_f64(at.add(6), x[3]);
        }
    }
    #[inline(always)]
    fn add_d(a: D, b: D) -> D {
        four!(vaddq_f64, a, b)
    }
    #[inline(always)]
    fn sub_d(a: D, b: D) -> D {
        four!(vsubq_f64, a, b)
    }
    #[inline(always)]
    fn mul_d(a: D, b: D) -> D {
        four!(vmulq_f64, a, b)
    }
    #[inline(always)]
    fn div_d(a: D, b: D) -> D {
        four!(vdivq_f64, a, b)
    }
    #[inline(always)]
    fn min_d(a: D, b: D) -> D {
        let m = four!(vcltq_f64, a, b);
        four!(vbslq_f64, m, a, b)
    }
    #[inline(always)]
    fn max_d(a: D, b: D) -> D {
        let m = four!(vcgtq_f64, a, b);
        four!(vbslq_f64, m, a, b)
    }
    #[inline(always)]
    fn lt_d(a: D, b: D) -> u8 {
        Self::bits(halves(four!(vcltq_f64, a, b)))
    }
    #[inline(always)]
    fn le_d(a: D, b: D) -> u8 {
        Self::bits(halves(four!(vcleq_f64, a, b)))
    }
    #[inline(always)]
    fn trunc_d(x: D) -> I {
        let x = four!(vcvtq_s64_f64, x);
        op!([vmovn_high_s64(vmovn_s64(x[0]), x[1]), vmovn_high_s64(vmovn_s64(x[2]), x[3])])
    }
    #[inline(always)]
    fn to_d(x: I) -> D {
        let x = op!([vmovl_s32(vget_low_s32(x[0])), vmovl_high_s32(x[0]), vmovl_s32(vget_low_s32(x[1])), vmovl_high_s32(x[1])]);
        four!(vcvtq_f64_s64, x)
    }
    #[inline(always)]
    fn narrow(x: D) -> F {
        op!([vcvt_high_f32_f64(vcvt_f32_f64(x[0]), x[1]), vcvt_high_f32_f64(vcvt_f32_f64(x[2]), x[3])])
    }
    #[inline(always)]
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: F) -> [F; 4] {
        let (from, at): (_, &[[u32; 4]; 2]) = (table.raw(), bytemuck::cast_ref(at));
        // SAFETY: the caller's.
        let (low, high) = unsafe { (four_rows(from, &at[0], fraction[0]), four_rows(from, &at[1], fraction[1])) };
        [[low[0], high[0]], [low[1], high[1]], [low[2], high[2]], [low[3], high[3]]]
    }
}
