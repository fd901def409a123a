//! Lanes on AVX2 intrinsics, reached from a default build by run-time choice.
//!
//! Every method is compiled into a caller that has the `avx2` feature ([`run`]), so that vectors stay in registers.

use super::table::LookupTable;
use super::ymm::{op, ymm_lanes};
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
    type M = __m256;
    type D = [__m256d; 2];

    ymm_lanes!();

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
    fn whole(x: __m256) -> __m256 {
        op!(_mm256_round_ps::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(x))
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
    fn select_i(m: __m256, a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_blendv_epi8(b, a, _mm256_castps_si256(m)))
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
