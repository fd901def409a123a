//! The vector type the stages are written in, and the choice of instruction set at run time.
//!
//! Rules of this room:
//! - an operation gives the same bits in every implementation: IEEE add, subtract, multiply, divide, square root and
//!   comparisons only; nothing fused, nothing approximate, no reduction but bit masks and minimum or maximum;
//! - operations whose results differ between instruction sets outside a range (conversion to integer) state the range; NaN is quiet,
//!   as every operation makes it, and only which NaN it is may differ;
//! - this is the only room with `unsafe`, and what it exports is safe to call with any argument.
#![allow(unsafe_code, reason = "vector intrinsics, unchecked loads, mapped files and the allocator live here and nowhere else")]

mod allocator;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(all(target_arch = "x86_64", slicestack_avx512))]
mod avx512;
mod cells;
#[cfg(feature = "formats")]
mod cut_short;
mod doubles;
#[cfg(feature = "formats")]
mod mapped;
pub(crate) mod math;
#[cfg(all(target_arch = "aarch64", target_endian = "little"))]
mod neon;
mod number;
mod pack;
mod rows;
mod scalar;
mod table;
mod wide;
#[cfg(target_arch = "x86_64")]
mod ymm;

pub use allocator::{OrOneLine, give_back_memory};
pub(crate) use cells::{Blocks, CellLoad, CornerPairs, Corners, ToF32, convert};
#[cfg(feature = "formats")]
pub(crate) use cut_short::look_for_cut;
#[cfg(feature = "formats")]
pub use cut_short::{cut_file, survive_cut_files};
#[cfg(feature = "formats")]
pub(crate) use mapped::Mapped;
pub use number::Number;
pub(crate) use pack::Packing;
pub(crate) use rows::{BATCH, SIDE, for_rows, lanes_of, row, row_mut, rows_of, spread};
pub(crate) use table::{LookupTable, Places};

/// Lanes of a vector, in every implementation.
pub(crate) const WIDTH: usize = 8;

/// Eight f32, eight i32 and eight-bit masks.
///
/// Every method is one operation per lane, rounded to nearest as IEEE 754 has it.
pub(crate) trait Lanes: Copy + 'static {
    /// Eight f32.
    type F: Copy;
    /// Eight i32.
    type I: Copy;
    /// Eight truth values.
    type M: Copy;
    /// Eight f64.
    type D: Copy;

    fn splat(x: f32) -> Self::F;
    fn load(from: &[f32; WIDTH]) -> Self::F;
    fn store(x: Self::F, to: &mut [f32; WIDTH]);
    fn add(a: Self::F, b: Self::F) -> Self::F;
    fn sub(a: Self::F, b: Self::F) -> Self::F;
    fn mul(a: Self::F, b: Self::F) -> Self::F;
    fn div(a: Self::F, b: Self::F) -> Self::F;
    fn sqrt(a: Self::F) -> Self::F;
    /// `if a < b { a } else { b }`: the second when either is NaN.
    fn min(a: Self::F, b: Self::F) -> Self::F;
    /// `if a > b { a } else { b }`: the second when either is NaN.
    fn max(a: Self::F, b: Self::F) -> Self::F;
    fn lt(a: Self::F, b: Self::F) -> Self::M;
    fn le(a: Self::F, b: Self::F) -> Self::M;
    /// `a` where the mask holds, +0.0 elsewhere.
    fn keep(m: Self::M, a: Self::F) -> Self::F;
    /// `a` where the mask holds, `b` elsewhere.
    fn select(m: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// Bit i is lane i.
    fn bits(m: Self::M) -> u8;
    fn and(a: Self::M, b: Self::M) -> Self::M;
    /// Lane i holds where bit i does.
    fn from_bits(bits: u8) -> Self::M;

    /// Toward zero. Only for values in the range of i32.
    fn trunc(x: Self::F) -> Self::I;
    /// The whole number at or below x, for x from 0 up in the range of i32.
    #[inline(always)]
    fn whole(x: Self::F) -> Self::F {
        Self::to_f(Self::trunc(x))
    }
    /// Byte `N` of each lane without sign, as a number: 0 is the lowest.
    #[inline(always)]
    fn byte<const N: i32>(x: Self::I) -> Self::F {
        let low = Self::splat_i(0xff);
        Self::to_f(match N {
            0 => Self::and_i(x, low),
            1 => Self::and_i(Self::sar::<8>(x), low),
            2 => Self::and_i(Self::sar::<16>(x), low),
            _ => Self::and_i(Self::sar::<24>(x), low),
        })
    }
    /// Rounded to nearest.
    fn to_f(x: Self::I) -> Self::F;
    fn splat_i(x: i32) -> Self::I;
    fn load_i(from: &[i32; WIDTH]) -> Self::I;
    fn store_i(x: Self::I, to: &mut [i32; WIDTH]);
    /// Eight numbers, each from a place of its own.
    #[inline(always)]
    fn set_i(x: [i32; WIDTH]) -> Self::I {
        Self::load_i(&x)
    }
    /// The lower and the upper halves of eight numbers, each from a place of its own.
    #[inline(always)]
    fn set_pairs(x: [u64; WIDTH]) -> [Self::I; 2] {
        let [a, b, c, d, e, f, g, h] = x;
        let high = |x: u64| (x >> 32) as i32;
        [
            Self::load_i(&[a as i32, b as i32, c as i32, d as i32, e as i32, f as i32, g as i32, h as i32]),
            Self::load_i(&[high(a), high(b), high(c), high(d), high(e), high(f), high(g), high(h)]),
        ]
    }
    fn add_i(a: Self::I, b: Self::I) -> Self::I;
    fn sub_i(a: Self::I, b: Self::I) -> Self::I;
    /// The lower half of the product.
    fn mul_i(a: Self::I, b: Self::I) -> Self::I;
    fn and_i(a: Self::I, b: Self::I) -> Self::I;
    fn or_i(a: Self::I, b: Self::I) -> Self::I;
    fn shl<const N: i32>(a: Self::I) -> Self::I;
    /// Copies of the sign move in.
    fn sar<const N: i32>(a: Self::I) -> Self::I;
    fn min_i(a: Self::I, b: Self::I) -> Self::I;
    fn max_i(a: Self::I, b: Self::I) -> Self::I;
    /// `a` where the mask holds, `b` elsewhere.
    fn select_i(m: Self::M, a: Self::I, b: Self::I) -> Self::I;
    /// The lanes whose bits are set, in order from lane 0 on; behind them copies of the first. For `bits` other than 0.
    #[inline(always)]
    fn together(a: Self::I, bits: u8) -> Self::I {
        Self::permuted(a, &pack::TOGETHER[bits as usize])
    }
    /// The way back of [`Lanes::together`]: where bit i is set lane i gets lane n, n of the bits below it being set; others are 0.
    #[inline(always)]
    fn apart(a: Self::F, bits: u8) -> Self::F {
        Self::keep(Self::from_bits(bits), Self::of_bits(Self::permuted(Self::to_bits(a), &pack::APART[bits as usize])))
    }
    /// Lane i gets lane `from[i]`, modulo 8.
    #[inline(always)]
    fn permuted(a: Self::I, from: &[u8; WIDTH]) -> Self::I {
        let mut lanes = [0; WIDTH];
        Self::store_i(a, &mut lanes);
        let mut to = [0; WIDTH];
        for (to, &from) in to.iter_mut().zip(from) {
            *to = lanes[from as usize % WIDTH];
        }
        Self::load_i(&to)
    }
    fn eq_i(a: Self::I, b: Self::I) -> Self::M;
    fn gt_i(a: Self::I, b: Self::I) -> Self::M;
    /// The same bits read as integers.
    fn to_bits(x: Self::F) -> Self::I;
    /// The same bits read as floats.
    fn of_bits(x: Self::I) -> Self::F;
    /// Whether any of the numbers of `BITS` 8 or 16 in `x` is greater than the one in the same place of `limit`, with or without sign;
    /// true as well where that costs more to find out than it may save.
    #[inline(always)]
    fn any_above<const BITS: u32, const SIGNED: bool>(_x: &[Self::I], _limit: Self::I) -> bool {
        true
    }
    /// The bytes at eight places of `from`, as numbers without sign, each with the byte behind it in the upper half of 16 bits.
    ///
    /// # Panics
    /// When one of them lies outside `from`: a bug of the caller's.
    #[inline(always)]
    fn byte_pairs(from: &[u8], at: Self::I) -> Self::I {
        let last = i32::try_from(from.len()).unwrap_or(i32::MAX) - 2;
        let outside = Self::bits(Self::gt_i(Self::splat_i(0), at)) | Self::bits(Self::gt_i(at, Self::splat_i(last)));
        assert!(outside == 0, "bytes outside the table");
        let mut places = [0; WIDTH];
        Self::store_i(at, &mut places);
        Self::set_i(places.map(|place| {
            // SAFETY: every place is from 0 to the last byte's but one; the read may be unaligned.
            let pair = unsafe { from.as_ptr().add(place as usize).cast::<u16>().read_unaligned() };
            i32::from(u16::from_le(pair))
        }))
    }
    /// Eight unsigned 16-bit numbers.
    fn load_u16(from: &[u16; WIDTH]) -> Self::I;

    fn splat_d(x: f64) -> Self::D;
    fn load_d(from: &[f64; WIDTH]) -> Self::D;
    fn store_d(x: Self::D, to: &mut [f64; WIDTH]);
    fn add_d(a: Self::D, b: Self::D) -> Self::D;
    fn sub_d(a: Self::D, b: Self::D) -> Self::D;
    fn mul_d(a: Self::D, b: Self::D) -> Self::D;
    fn div_d(a: Self::D, b: Self::D) -> Self::D;
    /// `if a < b { a } else { b }`.
    fn min_d(a: Self::D, b: Self::D) -> Self::D;
    /// `if a > b { a } else { b }`.
    fn max_d(a: Self::D, b: Self::D) -> Self::D;
    /// Bit i tells whether a < b in lane i.
    fn lt_d(a: Self::D, b: Self::D) -> u8;
    /// Bit i tells whether a <= b in lane i.
    fn le_d(a: Self::D, b: Self::D) -> u8;
    /// Toward zero. Only for values in the range of i32.
    fn trunc_d(x: Self::D) -> Self::I;
    /// Exact.
    fn to_d(x: Self::I) -> Self::D;
    /// Rounded to nearest.
    fn narrow(x: Self::D) -> Self::F;

    /// Entries of `table` plus `fraction` times the step to the next: red, green, blue, alpha.
    ///
    /// # Safety
    /// `at` holds places of `table`: see [`LookupTable::places`].
    unsafe fn entries(table: &LookupTable, at: &[u32; WIDTH], fraction: Self::F) -> [Self::F; 4];

    /// Entries `index` of `table`, modulo its length, plus `fraction` times the step to the next: red, green, blue, alpha.
    #[inline(always)]
    fn lookup(table: &LookupTable, index: Self::I, fraction: Self::F) -> [Self::F; 4] {
        let at = table.places::<Self>(index);
        // SAFETY: places of this table.
        unsafe { Self::entries(table, &at, fraction) }
    }
}

/// A loop over a batch, written once for all vector types.
///
/// Implementations of `run` are `#[inline(always)]`, so that each instruction set gets its own copy.
pub(crate) trait Kernel<C: ?Sized, B: ?Sized> {
    fn run<L: Lanes>(context: &C, batch: &mut B);
}

/// An instruction set the stages can run on. One that exists can be run by this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Scalar,
    Wide,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(all(target_arch = "x86_64", slicestack_avx512))]
    Avx512,
    #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
    Neon,
}

impl Level {
    /// One number at a time: the reference that owns the golden pictures.
    pub const SCALAR: Self = Self(Kind::Scalar);
    /// The portable vectors of the `wide` crate, at the width the crate was compiled for.
    pub const WIDE: Self = Self(Kind::Wide);

    /// Levels this machine can run, slowest first: `scalar` and `wide` always, then what the processor adds.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut, reason = "only some targets add levels")]
        let mut levels = vec![Self::SCALAR, Self::WIDE];
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            levels.push(Self(Kind::Avx2));
        }
        #[cfg(all(target_arch = "x86_64", slicestack_avx512))]
        if avx512::is_here() {
            levels.push(Self(Kind::Avx512));
        }
        #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
        levels.push(Self(Kind::Neon));
        levels
    }

    /// The name used on the command line: `scalar`, `wide`, `avx2`, `avx512`, `neon`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Scalar => "scalar",
            Kind::Wide => "wide",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(all(target_arch = "x86_64", slicestack_avx512))]
            Kind::Avx512 => "avx512",
            #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
            Kind::Neon => "neon",
        }
    }

    /// The level called `name`, if this machine can run it.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::available().into_iter().find(|l| l.name() == name)
    }

    /// The fastest level of this machine.
    pub fn best() -> Self {
        let mut best = Self::WIDE;
        for level in Self::available() {
            best = level;
        }
        best
    }

    /// The copy of kernel `K` that is compiled for this level.
    pub(crate) fn kernel<K: Kernel<C, B>, C: ?Sized, B: ?Sized>(self) -> fn(&C, &mut B) {
        match self.0 {
            Kind::Scalar => K::run::<scalar::Scalar>,
            Kind::Wide => K::run::<wide::Wide>,
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => avx2::run::<K, C, B>,
            #[cfg(all(target_arch = "x86_64", slicestack_avx512))]
            Kind::Avx512 => avx512::run::<K, C, B>,
            #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
            Kind::Neon => K::run::<neon::Neon>,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
