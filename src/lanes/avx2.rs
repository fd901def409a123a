//! Lanes on AVX2 intrinsics, reached from a default build by run-time choice.
//!
//! Every method is compiled into a caller that has the `avx2` feature ([`run`]), so that vectors stay in registers.

use super::table::LookupTable;
use super::{Kernel, Lanes, WIDTH};
use std::arch::x86_64::*;

/// See [`Lanes`]. Exists only inside kernels that [`run`] started.
#[derive(Clone, Copy)]
pub(crate) struct Avx2;

/// Runs a kernel with AVX2. Handed out by `Level::kernel` alone, and only for a level that detection has made.
pub(super) fn run<K: Kernel<C, B>, C: ?Sized, B: ?Sized>(context: &C, batch: &mut B) {
    #[target_feature(enable = "avx2")]
    unsafe fn with_feature<K: Kernel<C, B>, C: ?Sized, B: ?Sized>(context: &C, batch: &mut B) {
        K::run::<Avx2>(context, batch);
    }
    // SAFETY: a `Level` of this kind exists only where `is_x86_feature_detected!("avx2")` held.
    unsafe { with_feature::<K, C, B>(context, batch) }
}

/// Wraps intrinsics that only compute on registers.
macro_rules! op {
    ($e:expr) => {
        // SAFETY: register-only intrinsics of AVX2, which this machine has: `Avx2` is used inside `run` alone.
        unsafe { $e }
    };
}

/// Interpolated entries of lanes I and I + 4, which share a register, so that a transposition stays within 128-bit halves.
///
/// # Safety
/// `at[I]` and `at[I + 4]` are places of the table behind `from`.
#[inline(always)]
unsafe fn row<const I: usize, const SPREAD: i32>(from: *const f32, at: &[u32; WIDTH], frac: __m256) -> __m256 {
    // SAFETY: the caller's.
    let (value, next) = unsafe {
        let (low, high) = (from.add(at[I] as usize), from.add(at[I + 4] as usize));
        (_mm256_loadu2_m128(high, low), _mm256_loadu2_m128(high.add(4), low.add(4)))
    };
    // Lane I of either half, four times.
    let frac = op!(_mm256_permute_ps::<SPREAD>(frac));
    Avx2::add(value, Avx2::mul(Avx2::sub(next, value), frac))
}

impl Lanes for Avx2 {
    type F = __m256;
    type I = __m256i;
    type M = __m256;
    type D = [__m256d; 2];

    #[inline(always)]
    fn splat(x: f32) -> __m256 {
        op!(_mm256_set1_ps(x))
    }
    #[inline(always)]
    fn load(from: &[f32; WIDTH]) -> __m256 {
        // SAFETY: eight f32 behind the reference; unaligned is allowed.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(x: __m256, to: &mut [f32; WIDTH]) {
        // SAFETY: eight f32 behind the reference; unaligned is allowed.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), x) }
    }
    #[inline(always)]
    fn add(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_add_ps(a, b))
    }
    #[inline(always)]
    fn sub(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_sub_ps(a, b))
    }
    #[inline(always)]
    fn mul(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_mul_ps(a, b))
    }
    #[inline(always)]
    fn div(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_div_ps(a, b))
    }
    #[inline(always)]
    fn sqrt(a: __m256) -> __m256 {
        op!(_mm256_sqrt_ps(a))
    }
    #[inline(always)]
    fn min(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_min_ps(a, b))
    }
    #[inline(always)]
    fn max(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_max_ps(a, b))
    }
    #[inline(always)]
    fn lt(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b))
    }
    #[inline(always)]
    fn le(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b))
    }
    #[inline(always)]
    fn keep(m: __m256, a: __m256) -> __m256 {
        op!(_mm256_and_ps(m, a))
    }
    #[inline(always)]
    fn select(m: __m256, a: __m256, b: __m256) -> __m256 {
        op!(_mm256_blendv_ps(b, a, m))
    }
    #[inline(always)]
    fn bits(m: __m256) -> u8 {
        op!(_mm256_movemask_ps(m) as u8)
    }
    #[inline(always)]
    fn and(a: __m256, b: __m256) -> __m256 {
        op!(_mm256_and_ps(a, b))
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> __m256 {
        op!({
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let bits = _mm256_set1_epi32(i32::from(bits));
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(bits, lane), lane))
        })
    }
    #[inline(always)]
    fn trunc(x: __m256) -> __m256i {
        op!(_mm256_cvttps_epi32(x))
    }
    #[inline(always)]
    fn whole(x: __m256) -> __m256 {
        op!(_mm256_round_ps::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(x))
    }
    #[inline(always)]
    fn byte<const N: i32>(x: __m256i) -> __m256 {
        op!(_mm256_cvtepi32_ps(match N {
            0 => _mm256_and_si256(x, _mm256_set1_epi32(0xff)),
            3 => _mm256_srli_epi32::<24>(x),
            // The byte goes to the lowest place of its lane, zeros to the others.
            _ => {
                let from = |lane: i32| (lane * 4 + N) | i32::from_le_bytes([0, 0x80, 0x80, 0x80]);
                let (a, b, c, d) = (from(0), from(1), from(2), from(3));
                _mm256_shuffle_epi8(x, _mm256_setr_epi32(a, b, c, d, a, b, c, d))
            }
        }))
    }
    #[inline(always)]
    fn to_f(x: __m256i) -> __m256 {
        op!(_mm256_cvtepi32_ps(x))
    }
    #[inline(always)]
    fn splat_i(x: i32) -> __m256i {
        op!(_mm256_set1_epi32(x))
    }
    #[inline(always)]
    fn load_i(from: &[i32; WIDTH]) -> __m256i {
        // SAFETY: eight i32 behind the reference; unaligned is allowed.
        unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store_i(x: __m256i, to: &mut [i32; WIDTH]) {
        // SAFETY: eight i32 behind the reference; unaligned is allowed.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), x) }
    }
    #[inline(always)]
    fn set_i(x: [i32; WIDTH]) -> __m256i {
        op!(_mm256_setr_epi32(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]))
    }
    #[inline(always)]
    fn set_pairs(x: [u64; WIDTH]) -> [__m256i; 2] {
        op!({
            // Neighbours share a half, so that one shuffle within halves puts all in order.
            let a = _mm256_castsi256_ps(_mm256_setr_epi64x(x[0] as i64, x[1] as i64, x[4] as i64, x[5] as i64));
            let b = _mm256_castsi256_ps(_mm256_setr_epi64x(x[2] as i64, x[3] as i64, x[6] as i64, x[7] as i64));
            [_mm256_castps_si256(_mm256_shuffle_ps::<0b10_00_10_00>(a, b)), _mm256_castps_si256(_mm256_shuffle_ps::<0b11_01_11_01>(a, b))]
        })
    }
    #[inline(always)]
    fn add_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_add_epi32(a, b))
    }
    #[inline(always)]
    fn sub_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_sub_epi32(a, b))
    }
    #[inline(always)]
    fn mul_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_mullo_epi32(a, b))
    }
    #[inline(always)]
    fn and_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_and_si256(a, b))
    }
    #[inline(always)]
    fn or_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_or_si256(a, b))
    }
    #[inline(always)]
    fn shl<const N: i32>(a: __m256i) -> __m256i {
        op!(_mm256_slli_epi32::<N>(a))
    }
    #[inline(always)]
    fn sar<const N: i32>(a: __m256i) -> __m256i {
        op!(_mm256_srai_epi32::<N>(a))
    }
    #[inline(always)]
    fn min_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_min_epi32(a, b))
    }
    #[inline(always)]
    fn max_i(a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_max_epi32(a, b))
    }
    #[inline(always)]
    fn select_i(m: __m256, a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_blendv_epi8(b, a, _mm256_castps_si256(m)))
    }
    #[inline(always)]
    fn permuted(a: __m256i, from: &[u8; WIDTH]) -> __m256i {
        op!(_mm256_permutevar8x32_epi32(a, _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(i64::from_le_bytes(*from)))))
    }
    #[inline(always)]
    fn eq_i(a: __m256i, b: __m256i) -> __m256 {
        op!(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)))
    }
    #[inline(always)]
    fn gt_i(a: __m256i, b: __m256i) -> __m256 {
        op!(_mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b)))
    }
    #[inline(always)]
    fn to_bits(x: __m256) -> __m256i {
        op!(_mm256_castps_si256(x))
    }
    #[inline(always)]
    fn of_bits(x: __m256i) -> __m256 {
        op!(_mm256_castsi256_ps(x))
    }
    #[inline(always)]
    fn any_above<const BITS: u32, const SIGNED: bool>(x: &[__m256i], limit: __m256i) -> bool {
        op!({
            let most = x.iter().copied().fold(limit, |a, b| match (BITS, SIGNED) {
                (8, false) => _mm256_max_epu8(a, b),
                (8, true) => _mm256_max_epi8(a, b),
                (_, false) => _mm256_max_epu16(a, b),
                (_, true) => _mm256_max_epi16(a, b),
            });
            let more = _mm256_xor_si256(most, limit);
            _mm256_testz_si256(more, more) == 0
        })
    }
    #[inline(always)]
    fn load_u16(from: &[u16; WIDTH]) -> __m256i {
        // SAFETY: sixteen bytes behind the reference; unaligned is allowed.
        unsafe { _mm256_cvtepu16_epi32(_mm_loadu_si128(from.as_ptr().cast())) }
    }
    #[inline(always)]
    fn splat_d(x: f64) -> Self::D {
        op!([_mm256_set1_pd(x); 2])
    }
    #[inline(always)]
    fn load_d(from: &[f64; WIDTH]) -> Self::D {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe { [_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from.as_ptr().add(4))] }
    }
    #[inline(always)]
    fn store_d(x: Self::D, to: &mut [f64; WIDTH]) {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), x[0]);
            _mm256_storeu_pd(to.as_mut_ptr().add(4), x[1]);
        }
    }
    #[inline(always)]
    fn add_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn sub_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn mul_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn div_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn min_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn max_d(a: Self::D, b: Self::D) -> Self::D {
        op!([_mm256_max_pd(a[0], b[0]), _mm256_max_pd(a[1], b[1])])
    }
    #[inline(always)]
    fn lt_d(a: Self::D, b: Self::D) -> u8 {
        op!({
            let (low, high) = (_mm256_cmp_pd::<_CMP_LT_OQ>(a[0], b[0]), _mm256_cmp_pd::<_CMP_LT_OQ>(a[1], b[1]));
            (_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4) as u8
        })
    }
    #[inline(always)]
    fn le_d(a: Self::D, b: Self::D) -> u8 {
        op!({
            let (low, high) = (_mm256_cmp_pd::<_CMP_LE_OQ>(a[0], b[0]), _mm256_cmp_pd::<_CMP_LE_OQ>(a[1], b[1]));
            (_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4) as u8
        })
    }
    #[inline(always)]
    fn trunc_d(x: Self::D) -> __m256i {
        op!(_mm256_set_m128i(_mm256_cvttpd_epi32(x[1]), _mm256_cvttpd_epi32(x[0])))
    }
    #[inline(always)]
    fn to_d(x: __m256i) -> Self::D {
        op!([_mm256_cvtepi32_pd(_mm256_castsi256_si128(x)), _mm256_cvtepi32_pd(_mm256_extracti128_si256::<1>(x))])
    }
    #[inline(always)]
    fn narrow(x: Self::D) -> __m256 {
        op!(_mm256_set_m128(_mm256_cvtpd_ps(x[1]), _mm256_cvtpd_ps(x[0])))
    }
    #[inline(always)]
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: __m256) -> [__m256; 4] {
        let from = table.raw();
        // SAFETY: the caller's.
        let (a, b, c, d) = unsafe {
            (
                row::<0, 0b00_00_00_00>(from, at, fraction),
                row::<1, 0b01_01_01_01>(from, at, fraction),
                row::<2, 0b10_10_10_10>(from, at, fraction),
                row::<3, 0b11_11_11_11>(from, at, fraction),
            )
        };
        op!({
            let (ab_lo, ab_hi) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (cd_lo, cd_hi) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            [
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_lo, cd_lo),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_lo, cd_lo),
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_hi, cd_hi),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_hi, cd_hi),
            ]
        })
    }
}
