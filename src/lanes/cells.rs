//! Loading the eight voxels of a cell for every fragment of a batch.
//!
//! ```text
//!        y,z     x, x+1        offset of a fragment = cell's lowest corner relative to the batch's base voxel
//!   pair 0: 0,0   o--o         strides = distance to the next voxel along x, y, z; 0 where the axis has one voxel only
//!   pair 1: 1,0   o--o
//!   pair 2: 0,1   o--o
//!   pair 3: 1,1   o--o
//! ```

use super::{BATCH, Lanes, Number, WIDTH, for_rows, row, row_mut};

/// Eight corner values of every fragment's cell as f32; corner c has x + (c & 1), y + (c >> 1 & 1), z + (c >> 2).
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Corners(pub(crate) [[f32; BATCH]; 8]);

/// Corner values of 8- and 16-bit voxels as they lie in memory: two neighbours along x in one number, the nearer in the low half.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct CornerPairs<P>(pub(crate) [[P; BATCH]; 4]);

/// Where the voxels of a batch of cells lie.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CellLoad {
    /// Index of the batch's base voxel.
    pub(crate) base: usize,
    /// Distance in voxels to the next voxel along x, y and z.
    pub(crate) strides: [usize; 3],
    /// Distance in voxels from a fragment's cell to what the next slice's lookup reads and this one's does not, to within a voxel along
    /// each axis.
    pub(crate) ahead: isize,
    /// From there to the cells' other sides, where slices lie so far apart that those are new too.
    pub(crate) others: Option<isize>,
}

/// How stored values that f32 does not hold well are brought near zero and one: value * gain - bias, in f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToF32 {
    /// A power of two, or the negative of one.
    pub(crate) gain: f64,
    /// Subtracted after the gain.
    pub(crate) bias: f64,
}

/// A voxel as f32, through `map` where one is given.
#[inline(always)]
pub(crate) fn convert<T: Number>(voxel: T, map: Option<ToF32>) -> f32 {
    match map {
        Some(m) => (voxel.to_f64() * m.gain - m.bias) as f32,
        None => voxel.to_f32(),
    }
}

/// Asks for the memory at `at` to be brought near. Where it lies does not matter: what cannot be read is ignored.
#[inline(always)]
fn prefetch<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint that reads nothing; SSE is part of x86-64.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(at.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}

/// Asks for enough of a row's cells on the slice to come; for their other sides too, where those are new as well.
#[inline(always)]
fn prefetch_row<T>(next: *const T, others: Option<*const T>, offsets: &[i32; WIDTH]) {
    for i in [0, 2, 5, 7] {
        prefetch(next.wrapping_add(offsets[i] as usize));
        if let Some(others) = others {
            prefetch(others.wrapping_add(offsets[i] as usize));
        }
    }
}

impl CellLoad {
    /// Distance from a cell's lowest corner to its highest.
    #[inline(always)]
    fn reach(&self) -> Option<usize> {
        self.strides[0].checked_add(self.strides[1])?.checked_add(self.strides[2])
    }

    /// Whether all corners of all cells at `base + offsets` in `rows` lie within `len` voxels.
    #[inline(always)]
    fn fits<L: Lanes>(&self, offsets: &[i32; BATCH], rows: u8, len: usize) -> bool {
        // The largest offset whose cell has all its corners inside.
        let room = self.reach().and_then(|r| len.checked_sub(1)?.checked_sub(r)?.checked_sub(self.base));
        let Some(room) = room else { return false };
        let limit = L::splat_i(i32::try_from(room).unwrap_or(i32::MAX));
        let zero = L::splat_i(0);
        let (mut least, mut most) = (zero, zero);
        for_rows!(rows, r => {
            let o = L::load_i(row(offsets, r));
            (least, most) = (L::min_i(least, o), L::max_i(most, o));
        });
        L::bits(L::gt_i(zero, least)) | L::bits(L::gt_i(most, limit)) == 0
    }

    /// Loads every corner of the cells in `rows` on its own, whatever the strides, as f32, through `map` where one is given.
    ///
    /// # Panics
    /// When a corner lies outside `voxels`: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn corners<L: Lanes, T: Number>(
        &self,
        voxels: &[T],
        offsets: &[i32; BATCH],
        rows: u8,
        map: Option<ToF32>,
        out: &mut Corners,
    ) {
        assert!(self.fits::<L>(offsets, rows, voxels.len()), "cell outside the volume");
        let [dx, dy, dz] = self.strides;
        let steps = [0, dx, dy, dy + dx, dz, dz + dx, dz + dy, dz + dy + dx];
        for_rows!(rows, r => {
            let offsets = row(offsets, r);
            for (i, &offset) in offsets.iter().enumerate() {
                let at = self.base + offset as usize;
                if i % 2 == 0 {
                    prefetch(voxels.as_ptr().wrapping_add(at).wrapping_offset(self.ahead));
                }
                for (corner, step) in out.0.iter_mut().zip(steps) {
                    // SAFETY: `fits` has shown that base + offset + dx + dy + dz, the largest index of all, is inside.
                    corner[WIDTH * r + i] = convert(unsafe { *voxels.get_unchecked(at + step) }, map);
                }
            }
        });
    }

    /// As [`CellLoad::corners`], for offsets that leave the range of i32; every index is checked.
    ///
    /// # Panics
    /// As [`CellLoad::corners`].
    #[inline(always)]
    pub(crate) fn far_corners<T: Number>(&self, voxels: &[T], offsets: &[u64; BATCH], map: Option<ToF32>, out: &mut Corners) {
        let [dx, dy, dz] = self.strides;
        let steps = [0, dx, dy, dy + dx, dz, dz + dx, dz + dy, dz + dy + dx];
        for i in 0..BATCH {
            let at = self.base + offsets[i] as usize;
            for (corner, step) in out.0.iter_mut().zip(steps) {
                corner[i] = convert(voxels[at + step], map);
            }
        }
    }

    /// Loads the voxel at `base + offset(i)` for each fragment i of `lanes`; every index is checked.
    ///
    /// # Panics
    /// When a voxel lies outside `voxels`: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn each<T: Number>(
        &self,
        voxels: &[T],
        lanes: u64,
        offset: impl Fn(usize) -> usize,
        map: Option<ToF32>,
        out: &mut [f32; BATCH],
    ) {
        for i in (0..BATCH).filter(|i| lanes >> i & 1 == 1) {
            out[i] = convert(voxels[self.base + offset(i)], map);
        }
    }

    /// Loads two neighbours along x at a time, for 8-bit voxels. Needs a stride of 1 along x.
    ///
    /// # Panics
    /// When a corner lies outside `voxels` or the stride along x is not 1: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn pairs8<L: Lanes>(&self, voxels: &[u8], offsets: &[i32; BATCH], rows: u8, out: &mut CornerPairs<u16>) {
        assert!(self.strides[0] == 1 && self.fits::<L>(offsets, rows, voxels.len()), "cell outside the volume");
        let [_, dy, dz] = self.strides;
        let from = voxels.as_ptr().wrapping_add(self.base);
        for_rows!(rows, r => {
            let offsets = row(offsets, r);
            for (i, &offset) in offsets.iter().enumerate() {
                let at = offset as usize;
                if i % 2 == 0 {
                    prefetch(from.wrapping_add(at).wrapping_offset(self.ahead));
                }
                for (pair, step) in out.0.iter_mut().zip([0, dy, dz, dz + dy]) {
                    // SAFETY: `fits` has shown that base + offset + 1 + dy + dz is inside, so both bytes are; the read may be unaligned.
                    pair[WIDTH * r + i] = u16::from_le(unsafe { from.add(at + step).cast::<u16>().read_unaligned() });
                }
            }
        });
    }

    /// Loads four corners at a time from 8-bit voxels packed with their neighbours along y: into the first row of `out` those at
    /// z, into the second those at z + 1. Bytes from the lowest: (x,y), (x,y+1), (x+1,y), (x+1,y+1).
    ///
    /// Returns the rows to go on with; with `HIDDEN` those in which a corner may be above `hidden_up_to`, and others are not kept.
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn quads8<L: Lanes, const SIGNED: bool, const HIDDEN: bool>(
        &self,
        packed: &[u16],
        offsets: &[i32; BATCH],
        rows: u8,
        hidden_up_to: i32,
        out: &mut CornerPairs<u32>,
    ) -> u8 {
        assert!(self.strides[0] == 1 && self.fits::<L>(offsets, rows, packed.len()), "cell outside the volume");
        let from = packed.as_ptr().wrapping_add(self.base);
        let next = from.wrapping_offset(self.ahead);
        let others = self.others.map(|other| next.wrapping_offset(other));
        let quad = |from: *const u16, at: i32| {
            // SAFETY: `at` is one of the offsets: `fits` has shown that base + at + 1 + dz is inside, so both pairs are; the read may be
            // unaligned.
            let both = unsafe { from.add(at as usize).cast::<i32>().read_unaligned() };
            if cfg!(target_endian = "big") { both.rotate_left(16) } else { both }
        };
        let far = from.wrapping_add(self.strides[2]);
        let limit = L::splat_i(i32::from_le_bytes([hidden_up_to as u8; 4]));
        let mut lit = if HIDDEN { 0 } else { rows };
        for_rows!(rows, r => {
            let o = row(offsets, r);
            prefetch_row(next, others, o);
            let near = L::set_i([
                quad(from, o[0]), quad(from, o[1]), quad(from, o[2]), quad(from, o[3]),
                quad(from, o[4]), quad(from, o[5]), quad(from, o[6]), quad(from, o[7]),
            ]);
            let far = L::set_i([
                quad(far, o[0]), quad(far, o[1]), quad(far, o[2]), quad(far, o[3]),
                quad(far, o[4]), quad(far, o[5]), quad(far, o[6]), quad(far, o[7]),
            ]);
            if !HIDDEN || L::any_above::<8, SIGNED>(&[near, far], limit) {
                if HIDDEN {
                    lit |= 1 << r;
                }
                L::store_i(near, bytemuck::cast_mut(row_mut(&mut out.0[0], r)));
                L::store_i(far, bytemuck::cast_mut(row_mut(&mut out.0[1], r)));
            }
        });
        lit
    }

    /// Loads four corners at a time from 16-bit voxels packed with their neighbours along y. A number of `out` holds a corner in its
    /// low half and the one at y + 1 in its high one; rows of `out`: (x,z), (x+1,z), (x,z+1), (x+1,z+1).
    ///
    /// Returns what [`CellLoad::quads8`] does.
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn quads16<L: Lanes, const SIGNED: bool, const HIDDEN: bool>(
        &self,
        packed: &[u32],
        offsets: &[i32; BATCH],
        rows: u8,
        hidden_up_to: i32,
        out: &mut CornerPairs<u32>,
    ) -> u8 {
        assert!(self.strides[0] == 1 && self.fits::<L>(offsets, rows, packed.len()), "cell outside the volume");
        let from = packed.as_ptr().wrapping_add(self.base);
        let next = from.wrapping_offset(self.ahead);
        let others = self.others.map(|other| next.wrapping_offset(other));
        let quad = |from: *const u32, at: i32| {
            // SAFETY: as in `quads8`.
            let both = unsafe { from.add(at as usize).cast::<u64>().read_unaligned() };
            if cfg!(target_endian = "big") { both.rotate_left(32) } else { both }
        };
        let far = from.wrapping_add(self.strides[2]);
        let limit = L::splat_i((hidden_up_to & 0xffff) | hidden_up_to << 16);
        let mut lit = if HIDDEN { 0 } else { rows };
        for_rows!(rows, r => {
            let o = row(offsets, r);
            prefetch_row(next, others, o);
            let [near_left, near_right] = L::set_pairs([
                quad(from, o[0]), quad(from, o[1]), quad(from, o[2]), quad(from, o[3]),
                quad(from, o[4]), quad(from, o[5]), quad(from, o[6]), quad(from, o[7]),
            ]);
            let [far_left, far_right] = L::set_pairs([
                quad(far, o[0]), quad(far, o[1]), quad(far, o[2]), quad(far, o[3]),
                quad(far, o[4]), quad(far, o[5]), quad(far, o[6]), quad(far, o[7]),
            ]);
            if !HIDDEN || L::any_above::<16, SIGNED>(&[near_left, near_right, far_left, far_right], limit) {
                if HIDDEN {
                    lit |= 1 << r;
                }
                L::store_i(near_left, bytemuck::cast_mut(row_mut(&mut out.0[0], r)));
                L::store_i(near_right, bytemuck::cast_mut(row_mut(&mut out.0[1], r)));
                L::store_i(far_left, bytemuck::cast_mut(row_mut(&mut out.0[2], r)));
                L::store_i(far_right, bytemuck::cast_mut(row_mut(&mut out.0[3], r)));
            }
        });
        lit
    }

    /// Loads what central differences need around the cells of row `r`, from 8-bit voxels packed with their neighbours along y: 32 voxels
    /// in ten vectors, whose bytes are those of [`CellLoad::quads8`].
    ///
    /// ```text
    ///   0, 1: x-1, x and x+1, x+2 at z     4: x, x+1 at y-1 (bytes 0, 2)       8: x, x+1 at z-1
    ///   2, 3: the same at z+1              5: x, x+1 at y+2 (bytes 1, 3)       9: x, x+1 at z+2
    ///                                      6, 7: the same at z+1
    /// ```
    ///
    /// # Panics
    /// When a voxel lies outside `packed` or the stride along x is not 1: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn around8<L: Lanes>(&self, packed: &[u16], offsets: &[i32; BATCH], r: usize) -> [L::I; 10] {
        let o = row(offsets, r);
        assert!(self.strides[0] == 1 && self.fits_around::<L>(o, packed.len()), "cells too near the volume's border");
        let [_, sy, sz] = self.strides;
        let from = packed.as_ptr().wrapping_add(self.base);
        let quad = |from: *const u16| {
            L::set_i(o.map(|at| {
                // SAFETY: `fits_around` has shown that all voxels around base + at are inside; the read may be unaligned.
                let both = unsafe { from.wrapping_add(at as usize).cast::<i32>().read_unaligned() };
                if cfg!(target_endian = "big") { both.rotate_left(16) } else { both }
            }))
        };
        let four = |from: *const u16| {
            L::set_pairs(o.map(|at| {
                // SAFETY: as above.
                let [a, b, c, d] = unsafe { from.wrapping_add(at as usize).cast::<[u16; 4]>().read_unaligned() }.map(u64::from);
                a | b << 16 | c << 32 | d << 48
            }))
        };
        let ([a, b], [c, d]) = (four(from.wrapping_sub(1)), four(from.wrapping_add(sz).wrapping_sub(1)));
        let far = from.wrapping_add(sz);
        [
            a,
            b,
            c,
            d,
            quad(from.wrapping_sub(sy)),
            quad(from.wrapping_add(sy)),
            quad(far.wrapping_sub(sy)),
            quad(far.wrapping_add(sy)),
            quad(from.wrapping_sub(sz)),
            quad(far.wrapping_add(sz)),
        ]
    }

    /// The same from 16-bit voxels: 32 voxels in twenty vectors, each a voxel in its low half and the one at y + 1 in its high one.
    ///
    /// ```text
    ///   0 to 3: x-1, x, x+1, x+2 at z      8, 9: x, x+1 at y-1 (low halves)          16, 17: x, x+1 at z-1
    ///   4 to 7: the same at z+1            10, 11: x, x+1 at y+2 (high halves)       18, 19: x, x+1 at z+2
    ///                                      12 to 15: the same at z+1
    /// ```
    ///
    /// # Panics
    /// As [`CellLoad::around8`].
    #[inline(always)]
    pub(crate) fn around16<L: Lanes>(&self, packed: &[u32], offsets: &[i32; BATCH], r: usize) -> [L::I; 20] {
        let o = row(offsets, r);
        assert!(self.strides[0] == 1 && self.fits_around::<L>(o, packed.len()), "cells too near the volume's border");
        let [_, sy, sz] = self.strides;
        let from = packed.as_ptr().wrapping_add(self.base);
        let quad = |from: *const u32| {
            L::set_pairs(o.map(|at| {
                // SAFETY: as in `around8`.
                let both = unsafe { from.wrapping_add(at as usize).cast::<u64>().read_unaligned() };
                if cfg!(target_endian = "big") { both.rotate_left(32) } else { both }
            }))
        };
        let far = from.wrapping_add(sz);
        let ([a, b], [c, d]) = (quad(from.wrapping_sub(1)), quad(from.wrapping_add(1)));
        let ([e, f], [g, h]) = (quad(far.wrapping_sub(1)), quad(far.wrapping_add(1)));
        let ([i, j], [k, l]) = (quad(from.wrapping_sub(sy)), quad(from.wrapping_add(sy)));
        let ([m, n], [p, q]) = (quad(far.wrapping_sub(sy)), quad(far.wrapping_add(sy)));
        let ([s, t], [u, v]) = (quad(from.wrapping_sub(sz)), quad(far.wrapping_add(sz)));
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, p, q, s, t, u, v]
    }

    /// Whether a voxel before and two voxels behind the lowest corner of each cell at `base + offsets` lie within `len` voxels, along
    /// every axis.
    #[inline(always)]
    fn fits_around<L: Lanes>(&self, offsets: &[i32; WIDTH], len: usize) -> bool {
        let [sx, sy, sz] = self.strides;
        let sum = |x: usize, y: usize, z: usize| sx.checked_mul(x)?.checked_add(sy.checked_mul(y)?)?.checked_add(sz.checked_mul(z)?);
        let (Some(before), Some(behind)) = (sum(1, 1, 1), sum(2, 1, 2)) else { return false };
        // The largest offset that fits; and the least, which may lie below the base voxel's own.
        let room = len.checked_sub(1).and_then(|last| last.checked_sub(behind)?.checked_sub(self.base));
        let Some(room) = room else { return false };
        let Ok(least) = i32::try_from(before.saturating_sub(self.base)) else { return false };
        let limit = L::splat_i(i32::try_from(room).unwrap_or(i32::MAX));
        let o = L::load_i(offsets);
        L::bits(L::gt_i(L::splat_i(least), o)) | L::bits(L::gt_i(o, limit)) == 0
    }

    /// Loads two neighbours along x at a time, for 32-bit voxels, into `out` as the bits they are. Needs a stride of 1 along x.
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn pairs32<L: Lanes>(&self, voxels: &[u32], offsets: &[i32; BATCH], rows: u8, out: &mut Corners) {
        assert!(self.strides[0] == 1 && self.fits::<L>(offsets, rows, voxels.len()), "cell outside the volume");
        let [_, dy, dz] = self.strides;
        let from = voxels.as_ptr().wrapping_add(self.base);
        let next = from.wrapping_offset(self.ahead);
        let others = self.others.map(|other| next.wrapping_offset(other));
        let pair = |from: *const u32, at: i32| {
            // SAFETY: as in `quads8`, for two 32-bit voxels and base + at + 1 + dy + dz.
            let both = unsafe { from.add(at as usize).cast::<u64>().read_unaligned() };
            if cfg!(target_endian = "big") { both.rotate_left(32) } else { both }
        };
        for_rows!(rows, r => {
            let o = row(offsets, r);
            prefetch_row(next, others, o);
            for (edge, step) in [0, dy, dz, dz + dy].into_iter().enumerate() {
                let from = from.wrapping_add(step);
                let [left, right] = L::set_pairs([
                    pair(from, o[0]), pair(from, o[1]), pair(from, o[2]), pair(from, o[3]),
                    pair(from, o[4]), pair(from, o[5]), pair(from, o[6]), pair(from, o[7]),
                ]);
                L::store_i(left, bytemuck::cast_mut(row_mut(&mut out.0[2 * edge], r)));
                L::store_i(right, bytemuck::cast_mut(row_mut(&mut out.0[2 * edge + 1], r)));
            }
        });
    }

    /// Loads two neighbours along x at a time, for 16-bit voxels. Needs a stride of 1 along x.
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn pairs16<L: Lanes>(&self, voxels: &[u16], offsets: &[i32; BATCH], rows: u8, out: &mut CornerPairs<u32>) {
        assert!(self.strides[0] == 1 && self.fits::<L>(offsets, rows, voxels.len()), "cell outside the volume");
        let [_, dy, dz] = self.strides;
        let from = voxels.as_ptr().wrapping_add(self.base);
        let next = from.wrapping_offset(self.ahead);
        let others = self.others.map(|other| next.wrapping_offset(other));
        let pair = |from: *const u16, at: i32| {
            // SAFETY: as in `quads8`, for two 16-bit voxels and base + at + 1 + dy + dz.
            let both = unsafe { from.add(at as usize).cast::<i32>().read_unaligned() };
            // On a big-endian machine the nearer voxel comes in the high half.
            if cfg!(target_endian = "big") { both.rotate_left(16) } else { both }
        };
        for_rows!(rows, r => {
            let o = row(offsets, r);
            prefetch_row(next, others, o);
            for (out, step) in out.0.iter_mut().zip([0, dy, dz, dz + dy]) {
                let from = from.wrapping_add(step);
                let pairs = L::set_i([
                    pair(from, o[0]), pair(from, o[1]), pair(from, o[2]), pair(from, o[3]),
                    pair(from, o[4]), pair(from, o[5]), pair(from, o[6]), pair(from, o[7]),
                ]);
                L::store_i(pairs, bytemuck::cast_mut(row_mut(out, r)));
            }
        });
    }
}
