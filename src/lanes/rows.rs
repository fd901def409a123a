//! The shape of a batch: 64 fragments in eight rows of eight, and ways to its rows.

use super::WIDTH;

/// Side of a block of pixels: a row of it is a vector.
pub(crate) const SIDE: usize = WIDTH;
/// Fragments of a batch: lane `i` is the pixel in column `i % 8`, row `i / 8` of its block.
pub(crate) const BATCH: usize = SIDE * SIDE;

/// Runs a block of statements for each row of eight fragments whose bit is set, first row first.
macro_rules! for_rows {
    ($rows:expr, $r:ident => $body:block) => {{
        let mut left: u8 = $rows;
        if left == u8::MAX {
            // Most often: a plain loop.
            for $r in 0..8usize {
                $body
            }
        } else {
            while left != 0 {
                let $r = (left.trailing_zeros() & 7) as usize;
                left &= left - 1;
                $body
            }
        }
    }};
}
pub(crate) use for_rows;

/// The eight lanes of row `r` of an array over a batch.
#[inline(always)]
pub(crate) fn row<T: bytemuck::Pod>(array: &[T; BATCH], r: usize) -> &[T; SIDE] {
    &bytemuck::cast_ref::<[T; BATCH], [[T; SIDE]; SIDE]>(array)[r]
}

/// As [`row`], to write.
#[inline(always)]
pub(crate) fn row_mut<T: bytemuck::Pod>(array: &mut [T; BATCH], r: usize) -> &mut [T; SIDE] {
    &mut bytemuck::cast_mut::<[T; BATCH], [[T; SIDE]; SIDE]>(array)[r]
}

/// The bits of all lanes of `rows`.
#[inline(always)]
pub(crate) fn spread(rows: u8) -> u64 {
    // Bit r moves to byte r in three steps, and fills it.
    let x = u64::from(rows);
    let x = (x | (x << 28)) & 0x0000_000f_0000_000f;
    let x = (x | (x << 14)) & 0x0003_0003_0003_0003;
    let x = (x | (x << 7)) & 0x0101_0101_0101_0101;
    x * 0xff
}

/// The rows that hold any of `lanes`.
#[inline(always)]
pub(crate) fn rows_of(lanes: u64) -> u8 {
    const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let highest = (((lanes & LOW) + LOW) | lanes) & !LOW;
    // The top bit of byte r moves to bit r of the top byte.
    ((highest >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// Number of lanes in `rows`.
#[inline(always)]
pub(crate) fn lanes_of(rows: u8) -> u64 {
    u64::from(rows.count_ones()) * SIDE as u64
}

const _: () = assert!(BATCH == 8 * SIDE, "a row's bits fill a byte");
