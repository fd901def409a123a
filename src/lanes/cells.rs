//! Loading the eight voxels of a cell for every fragment of a batch.
//!
//! ```text
//!        y,z     x, x+1        offset of a fragment = cell's lowest corner relative to the batch's base voxel
//!   pair 0: 0,0   o--o         strides = distance to the next voxel along x, y, z; 0 where the axis has one voxel only
//!   pair 1: 1,0   o--o
//!   pair 2: 0,1   o--o
//!   pair 3: 1,1   o--o
//! ```

use crate::volume::Voxel;

/// Fragments of a batch.
const BATCH: usize = 64;

/// Eight corner values of every fragment's cell as f32; corner c has x + (c & 1), y + (c >> 1 & 1), z + (c >> 2).
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Corners(pub(crate) [[f32; BATCH]; 8]);

/// Corner values of 8- and 16-bit voxels as they lie in memory: two neighbours along x in one number, the nearer in the low half.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Pairs<P>(pub(crate) [[P; BATCH]; 4]);

/// Where the voxels of a batch of cells lie.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CellLoad {
    /// Index of the batch's base voxel.
    pub(crate) base: usize,
    /// Distance in voxels to the next voxel along x, y and z.
    pub(crate) strides: [usize; 3],
}

/// How stored values that f32 does not hold well are brought near zero and one: value * gain - bias, in f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToF32 {
    /// A power of two, or the negative of one.
    pub(crate) gain: f64,
    /// Subtracted after the gain.
    pub(crate) bias: f64,
}

/// A voxel as f32.
#[inline(always)]
fn convert<T: Voxel>(voxel: T, map: Option<ToF32>) -> f32 {
    match map {
        Some(m) => (voxel.to_f64() * m.gain - m.bias) as f32,
        None => voxel.to_f32(),
    }
}

impl CellLoad {
    /// Whether all corners of all cells at `base + offsets` lie within `len` voxels.
    #[inline(always)]
    fn fits(&self, offsets: &[i32; BATCH], len: usize) -> bool {
        let (mut low, mut high) = (i32::MAX, i32::MIN);
        for &o in offsets {
            low = low.min(o);
            high = high.max(o);
        }
        let reach = self.strides[0]
            .checked_add(self.strides[1])
            .and_then(|s| s.checked_add(self.strides[2]))
            .and_then(|s| s.checked_add(self.base));
        low >= 0 && reach.and_then(|r| r.checked_add(high as usize)).is_some_and(|last| last < len)
    }

    /// Loads every corner on its own, whatever the strides, as f32, through `map` where one is given.
    ///
    /// # Panics
    /// When a corner lies outside `voxels`: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn corners<T: Voxel>(&self, voxels: &[T], offsets: &[i32; BATCH], map: Option<ToF32>, out: &mut Corners) {
        assert!(self.fits(offsets, voxels.len()), "cell outside the volume");
        let [dx, dy, dz] = self.strides;
        let steps = [0, dx, dy, dy + dx, dz, dz + dx, dz + dy, dz + dy + dx];
        for i in 0..BATCH {
            let at = self.base + offsets[i] as usize;
            for (corner, step) in out.0.iter_mut().zip(steps) {
                // SAFETY: `fits` has shown that base + offset + dx + dy + dz, the largest index of all, is inside.
                corner[i] = convert(unsafe { *voxels.get_unchecked(at + step) }, map);
            }
        }
    }

    /// As [`CellLoad::corners`], for offsets that leave the range of i32; every index is checked.
    ///
    /// # Panics
    /// As [`CellLoad::corners`].
    #[inline(always)]
    pub(crate) fn far_corners<T: Voxel>(&self, voxels: &[T], offsets: &[u64; BATCH], map: Option<ToF32>, out: &mut Corners) {
        let [dx, dy, dz] = self.strides;
        let steps = [0, dx, dy, dy + dx, dz, dz + dx, dz + dy, dz + dy + dx];
        for i in 0..BATCH {
            let at = self.base + offsets[i] as usize;
            for (corner, step) in out.0.iter_mut().zip(steps) {
                corner[i] = convert(voxels[at + step], map);
            }
        }
    }

    /// Loads the voxel at `base + offset(i)` for fragment i; every index is checked.
    ///
    /// # Panics
    /// When a voxel lies outside `voxels`: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn each<T: Voxel>(&self, voxels: &[T], offset: impl Fn(usize) -> usize, map: Option<ToF32>, out: &mut [f32; BATCH]) {
        for i in 0..BATCH {
            out[i] = convert(voxels[self.base + offset(i)], map);
        }
    }

    /// Loads two neighbours along x at a time, for 8-bit voxels. Needs a stride of 1 along x.
    ///
    /// # Panics
    /// When a corner lies outside `voxels` or the stride along x is not 1: a bug of the caller's.
    #[inline(always)]
    pub(crate) fn pairs8(&self, voxels: &[u8], offsets: &[i32; BATCH], out: &mut Pairs<u16>) {
        assert!(self.strides[0] == 1 && self.fits(offsets, voxels.len()), "cell outside the volume");
        let [_, dy, dz] = self.strides;
        let from = voxels.as_ptr().wrapping_add(self.base);
        for i in 0..BATCH {
            let at = offsets[i] as usize;
            for (pair, step) in out.0.iter_mut().zip([0, dy, dz, dz + dy]) {
                // SAFETY: `fits` has shown that base + offset + 1 + dy + dz is inside, so both bytes are; the read may be unaligned.
                pair[i] = u16::from_le(unsafe { from.add(at + step).cast::<u16>().read_unaligned() });
            }
        }
    }

    /// Loads four corners at a time from 8-bit voxels packed with their neighbours along y: into the first row of `out` those at
    /// z, into the second those at z + 1. Bytes from the lowest: (x,y), (x,y+1), (x+1,y), (x+1,y+1).
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn quads8(&self, packed: &[u16], offsets: &[i32; BATCH], out: &mut Pairs<u32>) {
        assert!(self.strides[0] == 1 && self.fits(offsets, packed.len()), "cell outside the volume");
        let from = packed.as_ptr().wrapping_add(self.base);
        let dz = self.strides[2];
        for i in 0..BATCH {
            let at = offsets[i] as usize;
            for (quad, step) in out.0.iter_mut().zip([0, dz]) {
                // SAFETY: `fits` has shown that base + offset + 1 + dz is inside, so both pairs are; the read may be unaligned.
                let both = unsafe { from.add(at + step).cast::<u32>().read_unaligned() };
                quad[i] = if cfg!(target_endian = "big") { both.rotate_left(16) } else { both };
            }
        }
    }

    /// Loads two neighbours along x at a time, for 16-bit voxels. Needs a stride of 1 along x.
    ///
    /// # Panics
    /// As [`CellLoad::pairs8`].
    #[inline(always)]
    pub(crate) fn pairs16(&self, voxels: &[u16], offsets: &[i32; BATCH], out: &mut Pairs<u32>) {
        assert!(self.strides[0] == 1 && self.fits(offsets, voxels.len()), "cell outside the volume");
        let [_, dy, dz] = self.strides;
        let from = voxels.as_ptr().wrapping_add(self.base);
        for i in 0..BATCH {
            let at = offsets[i] as usize;
            for (pair, step) in out.0.iter_mut().zip([0, dy, dz, dz + dy]) {
                // SAFETY: as in `pairs8`, for two 16-bit voxels.
                let both = unsafe { from.add(at + step).cast::<u32>().read_unaligned() };
                // On a big-endian machine the nearer voxel comes in the high half.
                pair[i] = if cfg!(target_endian = "big") { both.rotate_left(16) } else { both };
            }
        }
    }
}
