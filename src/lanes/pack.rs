//! Some fragments of a batch moved together, so that vectors are full of them, and back.
//!
//! ```text
//!   lanes   . A . . B C . .      packed   A B C D E F . .
//!           . . D . . . . .      (one vector instead of three: each row's lanes are stored behind those of the rows before,
//!           E . . F . . . .       and what its vector holds beyond them the next row stores over)
//! ```

use super::{BATCH, Lanes, WIDTH, for_rows, row, row_mut, rows_of};

/// For every byte of bits: the places of those that are set, lowest first, then the first of them again and again.
pub(super) const TOGETHER: [[u8; WIDTH]; 256] = {
    let mut all = [[0; WIDTH]; 256];
    let mut bits = 1usize;
    while bits < 256 {
        let (mut place, mut n) = (0, 0);
        while place < WIDTH {
            if bits >> place & 1 == 1 {
                all[bits][n] = place as u8;
                n += 1;
            }
            place += 1;
        }
        while n < WIDTH {
            all[bits][n] = all[bits][0];
            n += 1;
        }
        bits += 1;
    }
    all
};

/// For every byte of bits: how many of those below each place are set.
pub(super) const APART: [[u8; WIDTH]; 256] = {
    let mut all = [[0; WIDTH]; 256];
    let mut bits = 0usize;
    while bits < 256 {
        let (mut place, mut n) = (0, 0);
        while place < WIDTH {
            all[bits][place] = n;
            n += (bits >> place & 1) as u8;
            place += 1;
        }
        bits += 1;
    }
    // The place above eight set bits is asked for by nobody.
    all
};

/// Which fragments of a batch are moved together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Packing {
    lanes: u64,
    /// Byte r: how many of the rows before r.
    starts: u64,
    /// How many.
    count: usize,
}

impl Packing {
    /// For `lanes`, one bit each; at least one.
    #[inline(always)]
    pub(crate) fn new(lanes: u64) -> Self {
        debug_assert!(lanes != 0, "nothing to pack");
        // How many are set in each pair of bits, in each four, in each byte.
        let x = lanes - (lanes >> 1 & 0x5555_5555_5555_5555);
        let x = (x & 0x3333_3333_3333_3333) + (x >> 2 & 0x3333_3333_3333_3333);
        let x = (x + (x >> 4)) & 0x0f0f_0f0f_0f0f_0f0f;
        // Byte r: the sum of bytes 0 to r. It is 64 at most.
        let sums = x.wrapping_mul(0x0101_0101_0101_0101);
        Self { lanes, starts: sums << 8, count: (sums >> 56) as usize }
    }

    /// How many fragments.
    #[inline(always)]
    pub(crate) fn count(&self) -> u64 {
        self.count as u64
    }

    /// Rows that hold any of them.
    #[inline(always)]
    pub(crate) fn rows(&self) -> u8 {
        rows_of(self.lanes)
    }

    /// Rows that they fill together.
    #[inline(always)]
    pub(crate) fn packed_rows(&self) -> u8 {
        u8::MAX >> (WIDTH - self.count.div_ceil(WIDTH))
    }

    /// Where row `r` begins among those packed.
    #[inline(always)]
    fn start(&self, r: usize) -> usize {
        // No row begins behind the seven before it.
        ((self.starts >> (8 * r)) as usize & 0xff).min(BATCH - WIDTH)
    }

    /// The bits of row `r`.
    #[inline(always)]
    fn bits(&self, r: usize) -> u8 {
        (self.lanes >> (8 * r)) as u8
    }

    /// The numbers of these fragments in each array of `from`, together in those of `to`. What lies behind them in their last row are others of them.
    #[inline(always)]
    pub(crate) fn pack<L: Lanes, const N: usize>(&self, from: [&[i32; BATCH]; N], mut to: [&mut [i32; BATCH]; N]) {
        let first = (self.lanes.trailing_zeros() as usize) & (BATCH - 1);
        let last = (self.count.wrapping_sub(1) / WIDTH) & (WIDTH - 1);
        for (from, to) in from.iter().zip(&mut to) {
            L::store_i(L::splat_i(from[first]), row_mut(to, last));
        }
        for_rows!(self.rows(), r => {
            let (bits, start) = (self.bits(r), self.start(r));
            for (from, to) in from.iter().zip(&mut to) {
                let packed = L::together(L::load_i(row(from, r)), bits);
                if let Some(to) = to[start..].first_chunk_mut() {
                    L::store_i(packed, to);
                }
            }
        });
    }

    /// Packed numbers back to where they were; in the same rows others become 0.
    #[inline(always)]
    pub(crate) fn unpack<L: Lanes, const N: usize>(&self, from: [&[f32; BATCH]; N], mut to: [&mut [f32; BATCH]; N]) {
        let zero = L::splat(0.0);
        for_rows!(self.rows(), r => {
            let (bits, start) = (self.bits(r), self.start(r));
            for (from, to) in from.iter().zip(&mut to) {
                let packed = from[start..].first_chunk().map_or(zero, L::load);
                L::store(L::apart(packed, bits), row_mut(to, r));
            }
        });
    }
}
