//! What AVX2 and AVX-512 do alike: eight f32 and eight i32 in a ymm register each.

/// Wraps intrinsics that only compute on registers.
macro_rules! op {
    ($e:expr) => {
        // SAFETY: register-only intrinsics, which this machine has: the types of lanes are used by the kernels that their `run` starts, and by no other.
        unsafe { $e }
    };
}
pub(super) use op;

/// The part of [`super::Lanes`] that is the same for both, with `F` and `I` in ymm registers.
macro_rules! ymm_lanes {
    () => {
        type F = __m256;
        type I = __m256i;

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
        fn trunc(x: __m256) -> __m256i {
            op!(_mm256_cvttps_epi32(x))
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
        fn permuted(a: __m256i, from: &[u8; WIDTH]) -> __m256i {
            op!(_mm256_permutevar8x32_epi32(a, _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(i64::from_le_bytes(*from)))))
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
    };
}
pub(super) use ymm_lanes;
