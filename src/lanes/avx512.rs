//! Lanes on AVX-512, reached from a default build by run-time choice where the compiler knows these intrinsics (Rust 1.89).
//!
//! Eight lanes, as everywhere: a row of a block. What AVX-512 adds are masks in registers of their own instead of vectors of ones and zeros, eight f64 or
//! four table entries in one register, and shuffles of two registers, which put the entries of eight lanes in order in two steps. Every method is
//! compiled into a caller that has the features ([`run`]), so that vectors stay in registers.

#![allow(clippy::incompatible_msrv, reason = "compiled only where the compiler has these intrinsics: see build.rs")]

use super::table::LookupTable;
use super::ymm::{op, ymm_lanes};
use super::{Kernel, Lanes, WIDTH};
use std::arch::x86_64::*;

/// See [`Lanes`]. Exists only inside kernels that [`run`] started.
#[derive(Clone, Copy)]
pub(crate) struct Avx512;

/// Runs a kernel with AVX-512. Handed out by `Level::kernel` alone, and only for a level that detection has made.
pub(super) fn run<K: Kernel<C, B>, C: ?Sized, B: ?Sized>(context: &C, batch: &mut B) {
    #[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq")]
    unsafe fn with_feature<K: Kernel<C, B>, C: ?Sized, B: ?Sized>(context: &C, batch: &mut B) {
        K::run::<Avx512>(context, batch);
    }
    // SAFETY: a `Level` of this kind exists only where [`is_here`] held.
    unsafe { with_feature::<K, C, B>(context, batch) }
}

/// Whether this machine has the instructions, and is one that does not slow down for them: Ice Lake, Zen 4 and later, told by instructions that came
/// with these.
pub(super) fn is_here() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx2") && has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq") && has!("avx512vbmi2")
}

/// Table entries of lanes I to I + 3: the entries themselves and the next ones, four numbers each.
///
/// # Safety
/// `at[I]` to `at[I + 3]` are places of the table behind `from`.
#[inline(always)]
unsafe fn four<const I: usize>(from: *const f32, at: &[u32; WIDTH]) -> [__m512; 2] {
    // SAFETY: the caller's: an entry and the next one are eight numbers side by side.
    let (a, b, c, d) = unsafe {
        (
            _mm256_loadu_ps(from.add(at[I] as usize)),
            _mm256_loadu_ps(from.add(at[I + 1] as usize)),
            _mm256_loadu_ps(from.add(at[I + 2] as usize)),
            _mm256_loadu_ps(from.add(at[I + 3] as usize)),
        )
    };
    op!({
        let (ab, cd) = (_mm512_insertf32x8::<1>(_mm512_castps256_ps512(a), b), _mm512_insertf32x8::<1>(_mm512_castps256_ps512(c), d));
        [_mm512_shuffle_f32x4::<0b10_00_10_00>(ab, cd), _mm512_shuffle_f32x4::<0b11_01_11_01>(ab, cd)]
    })
}

/// Entries of lanes I to I + 3 plus the lanes' `fraction` times the step to the next ones.
#[inline(always)]
fn mixed<const I: i32>([value, next]: [__m512; 2], fraction: __m512) -> __m512 {
    op!({
        let (a, b, c, d) = (I, I + 1, I + 2, I + 3);
        let part = _mm512_permutexvar_ps(_mm512_setr_epi32(a, a, a, a, b, b, b, b, c, c, c, c, d, d, d, d), fraction);
        _mm512_add_ps(value, _mm512_mul_ps(_mm512_sub_ps(next, value), part))
    })
}

/// Numbers N and N + 1 of the entries of eight lanes, of which `low` holds the first four.
#[inline(always)]
fn two<const N: i32>(low: __m512, high: __m512) -> __m512 {
    let (a, b) = (N, N + 1);
    op!({
        let from = _mm512_setr_epi32(
            a,
            a + 4,
            a + 8,
            a + 12,
            a + 16,
            a + 20,
            a + 24,
            a + 28,
            b,
            b + 4,
            b + 8,
            b + 12,
            b + 16,
            b + 20,
            b + 24,
            b + 28,
        );
        _mm512_permutex2var_ps(low, from, high)
    })
}

impl Lanes for Avx512 {
    type M = __mmask8;
    type D = __m512d;

    ymm_lanes!();

    #[inline(always)]
    fn lt(a: __m256, b: __m256) -> __mmask8 {
        op!(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b))
    }
    #[inline(always)]
    fn le(a: __m256, b: __m256) -> __mmask8 {
        op!(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b))
    }
    #[inline(always)]
    fn keep(m: __mmask8, a: __m256) -> __m256 {
        op!(_mm256_maskz_mov_ps(m, a))
    }
    #[inline(always)]
    fn select(m: __mmask8, a: __m256, b: __m256) -> __m256 {
        op!(_mm256_mask_blend_ps(m, b, a))
    }
    #[inline(always)]
    fn bits(m: __mmask8) -> u8 {
        m
    }
    #[inline(always)]
    fn and(a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> __mmask8 {
        bits
    }
    #[inline(always)]
    fn whole(x: __m256) -> __m256 {
        op!(_mm256_roundscale_ps::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(x))
    }
    #[inline(always)]
    fn set_pairs(x: [u64; WIDTH]) -> [__m256i; 2] {
        op!({
            let [a, b, c, d, e, f, g, h] = x;
            let all = _mm512_setr_epi64(a as i64, b as i64, c as i64, d as i64, e as i64, f as i64, g as i64, h as i64);
            [_mm512_cvtepi64_epi32(all), _mm512_cvtepi64_epi32(_mm512_srli_epi64::<32>(all))]
        })
    }
    #[inline(always)]
    fn select_i(m: __mmask8, a: __m256i, b: __m256i) -> __m256i {
        op!(_mm256_mask_blend_epi32(m, b, a))
    }
    #[inline(always)]
    fn apart(a: __m256, bits: u8) -> __m256 {
        op!(_mm256_maskz_expand_ps(bits, a))
    }
    #[inline(always)]
    fn eq_i(a: __m256i, b: __m256i) -> __mmask8 {
        op!(_mm256_cmpeq_epi32_mask(a, b))
    }
    #[inline(always)]
    fn gt_i(a: __m256i, b: __m256i) -> __mmask8 {
        op!(_mm256_cmpgt_epi32_mask(a, b))
    }
    #[inline(always)]
    fn splat_d(x: f64) -> __m512d {
        op!(_mm512_set1_pd(x))
    }
    #[inline(always)]
    fn load_d(from: &[f64; WIDTH]) -> __m512d {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe { _mm512_loadu_pd(from.as_ptr()) }
    }
    #[inline(always)]
    fn store_d(x: __m512d, to: &mut [f64; WIDTH]) {
        // SAFETY: eight f64 behind the reference; unaligned is allowed.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), x) }
    }
    #[inline(always)]
    fn add_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_add_pd(a, b))
    }
    #[inline(always)]
    fn sub_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_sub_pd(a, b))
    }
    #[inline(always)]
    fn mul_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_mul_pd(a, b))
    }
    #[inline(always)]
    fn div_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_div_pd(a, b))
    }
    #[inline(always)]
    fn min_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_min_pd(a, b))
    }
    #[inline(always)]
    fn max_d(a: __m512d, b: __m512d) -> __m512d {
        op!(_mm512_max_pd(a, b))
    }
    #[inline(always)]
    fn lt_d(a: __m512d, b: __m512d) -> u8 {
        op!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b))
    }
    #[inline(always)]
    fn le_d(a: __m512d, b: __m512d) -> u8 {
        op!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a, b))
    }
    #[inline(always)]
    fn trunc_d(x: __m512d) -> __m256i {
        op!(_mm512_cvttpd_epi32(x))
    }
    #[inline(always)]
    fn to_d(x: __m256i) -> __m512d {
        op!(_mm512_cvtepi32_pd(x))
    }
    #[inline(always)]
    fn narrow(x: __m512d) -> __m256 {
        op!(_mm512_cvtpd_ps(x))
    }
    #[inline(always)]
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: __m256) -> [__m256; 4] {
        let from = table.raw();
        // SAFETY: the caller's.
        let (low, high) = unsafe { (four::<0>(from, at), four::<4>(from, at)) };
        op!({
            let fraction = _mm512_castps256_ps512(fraction);
            let (low, high) = (mixed::<0>(low, fraction), mixed::<4>(high, fraction));
            let (rg, ba) = (two::<0>(low, high), two::<2>(low, high));
            [_mm512_castps512_ps256(rg), _mm512_extractf32x8_ps::<1>(rg), _mm512_castps512_ps256(ba), _mm512_extractf32x8_ps::<1>(ba)]
        })
    }
}
