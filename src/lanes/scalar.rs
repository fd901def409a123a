//! One lane after the other in plain Rust: the reference every other implementation must equal to the bit.

use super::doubles::doubles_as_arrays;
use super::table::LookupTable;
use super::{Lanes, WIDTH};
use std::array::from_fn;
use std::convert::identity;

/// See [`Lanes`].
#[derive(Clone, Copy)]
pub(crate) struct Scalar;

type F = [f32; WIDTH];
type I = [i32; WIDTH];
type M = [bool; WIDTH];

impl Lanes for Scalar {
    type F = F;
    type I = I;
    type M = M;
    doubles_as_arrays!(identity, identity, identity);

    #[inline(always)]
    fn splat(x: f32) -> F {
        [x; WIDTH]
    }
    #[inline(always)]
    fn load(from: &[f32; WIDTH]) -> F {
        *from
    }
    #[inline(always)]
    fn store(x: F, to: &mut [f32; WIDTH]) {
        *to = x;
    }
    #[inline(always)]
    fn add(a: F, b: F) -> F {
        from_fn(|i| a[i] + b[i])
    }
    #[inline(always)]
    fn sub(a: F, b: F) -> F {
        from_fn(|i| a[i] - b[i])
    }
    #[inline(always)]
    fn mul(a: F, b: F) -> F {
        from_fn(|i| a[i] * b[i])
    }
    #[inline(always)]
    fn div(a: F, b: F) -> F {
        from_fn(|i| a[i] / b[i])
    }
    #[inline(always)]
    fn sqrt(a: F) -> F {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn min(a: F, b: F) -> F {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn max(a: F, b: F) -> F {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn lt(a: F, b: F) -> M {
        from_fn(|i| a[i] < b[i])
    }
    #[inline(always)]
    fn le(a: F, b: F) -> M {
        from_fn(|i| a[i] <= b[i])
    }
    #[inline(always)]
    fn keep(m: M, a: F) -> F {
        from_fn(|i| if m[i] { a[i] } else { 0.0 })
    }
    #[inline(always)]
    fn select(m: M, a: F, b: F) -> F {
        from_fn(|i| if m[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn bits(m: M) -> u8 {
        (0..WIDTH).fold(0, |bits, i| bits | u8::from(m[i]) << i)
    }
    #[inline(always)]
    fn and(a: M, b: M) -> M {
        from_fn(|i| a[i] && b[i])
    }
    #[inline(always)]
    fn from_bits(bits: u8) -> M {
        from_fn(|i| bits >> i & 1 == 1)
    }
    #[inline(always)]
    fn trunc(x: F) -> I {
        x.map(|v| v as i32)
    }
    #[inline(always)]
    fn to_f(x: I) -> F {
        x.map(|v| v as f32)
    }
    #[inline(always)]
    fn splat_i(x: i32) -> I {
        [x; WIDTH]
    }
    #[inline(always)]
    fn load_i(from: &[i32; WIDTH]) -> I {
        *from
    }
    #[inline(always)]
    fn store_i(x: I, to: &mut [i32; WIDTH]) {
        *to = x;
    }
    #[inline(always)]
    fn add_i(a: I, b: I) -> I {
        from_fn(|i| a[i].wrapping_add(b[i]))
    }
    #[inline(always)]
    fn sub_i(a: I, b: I) -> I {
        from_fn(|i| a[i].wrapping_sub(b[i]))
    }
    #[inline(always)]
    fn mul_i(a: I, b: I) -> I {
        from_fn(|i| a[i].wrapping_mul(b[i]))
    }
    #[inline(always)]
    fn and_i(a: I, b: I) -> I {
        from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or_i(a: I, b: I) -> I {
        from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn shl<const N: i32>(a: I) -> I {
        a.map(|v| v << N)
    }
    #[inline(always)]
    fn sar<const N: i32>(a: I) -> I {
        a.map(|v| v >> N)
    }
    #[inline(always)]
    fn min_i(a: I, b: I) -> I {
        from_fn(|i| a[i].min(b[i]))
    }
    #[inline(always)]
    fn max_i(a: I, b: I) -> I {
        from_fn(|i| a[i].max(b[i]))
    }
    #[inline(always)]
    fn select_i(m: M, a: I, b: I) -> I {
        from_fn(|i| if m[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn eq_i(a: I, b: I) -> M {
        from_fn(|i| a[i] == b[i])
    }
    #[inline(always)]
    fn gt_i(a: I, b: I) -> M {
        from_fn(|i| a[i] > b[i])
    }
    #[inline(always)]
    fn to_bits(x: F) -> I {
        x.map(|v| v.to_bits() as i32)
    }
    #[inline(always)]
    fn of_bits(x: I) -> F {
        x.map(|v| f32::from_bits(v as u32))
    }
    #[inline(always)]
    fn load_u16(from: &[u16; WIDTH]) -> I {
        from.map(i32::from)
    }
    #[inline(always)]
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: F) -> [F; 4] {
        let rows: [[f32; 4]; WIDTH] = from_fn(|i| {
            // SAFETY: the caller's.
            let [value, next] = unsafe { table.pair(at[i]) };
            from_fn(|c| value[c] + (next[c] - value[c]) * fraction[i])
        });
        from_fn(|c| from_fn(|i| rows[i][c]))
    }
}
