//! Eight f64 as an array, for instruction sets whose registers hold no more than two: loops this short become vectors by themselves.

/// The f64 part of [`super::Lanes`] over `[f64; 8]`; integers and floats go through arrays by the two conversions given.
macro_rules! doubles_as_arrays {
    ($to_i:expr, $from_i:expr, $to_f:expr) => {
        type D = [f64; WIDTH];

        #[inline(always)]
        fn splat_d(x: f64) -> Self::D {
            [x; WIDTH]
        }
        #[inline(always)]
        fn load_d(from: &[f64; WIDTH]) -> Self::D {
            *from
        }
        #[inline(always)]
        fn store_d(x: Self::D, to: &mut [f64; WIDTH]) {
            *to = x;
        }
        #[inline(always)]
        fn add_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| a[i] + b[i])
        }
        #[inline(always)]
        fn sub_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| a[i] - b[i])
        }
        #[inline(always)]
        fn mul_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| a[i] * b[i])
        }
        #[inline(always)]
        fn div_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| a[i] / b[i])
        }
        #[inline(always)]
        fn min_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
        }
        #[inline(always)]
        fn max_d(a: Self::D, b: Self::D) -> Self::D {
            std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
        }
        #[inline(always)]
        fn lt_d(a: Self::D, b: Self::D) -> u8 {
            (0..WIDTH).fold(0, |bits, i| bits | u8::from(a[i] < b[i]) << i)
        }
        #[inline(always)]
        fn le_d(a: Self::D, b: Self::D) -> u8 {
            (0..WIDTH).fold(0, |bits, i| bits | u8::from(a[i] <= b[i]) << i)
        }
        #[inline(always)]
        fn trunc_d(x: Self::D) -> Self::I {
            $to_i(std::array::from_fn::<i32, WIDTH, _>(|i| x[i] as i32))
        }
        #[inline(always)]
        fn to_d(x: Self::I) -> Self::D {
            let x: [i32; WIDTH] = $from_i(x);
            x.map(f64::from)
        }
        #[inline(always)]
        fn narrow(x: Self::D) -> Self::F {
            $to_f(std::array::from_fn::<f32, WIDTH, _>(|i| x[i] as f32))
        }
    };
}
pub(super) use doubles_as_arrays;
