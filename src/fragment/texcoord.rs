//! Texture coordinates: the cell a fragment lies in, and where in it.
//!
//! On a view-aligned slice index coordinates are affine in window x and y, in perspective too: three additions a fragment and
//! no division. They are taken relative to a base voxel near the block, so that their fraction keeps all bits of f32 however
//! large the volume.

use super::batch::{BATCH, Batch, Frame, SIDE, row_mut};
use crate::lanes::{Kernel, Lanes};

/// Fills `weight` and `offset`, for batches whose cells lie within 2^24 voxels of the base voxel.
pub(crate) struct Texcoord;

/// Fills `weight` and `far_offset`, for batches that span more.
pub(crate) struct TexcoordFar;

const COLUMNS: [f32; SIDE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Lower corners (in voxels from the base voxel) of one row's cells; their weights are stored.
#[inline(always)]
fn cells<L: Lanes>(batch: &mut Batch, across: &[L::F; 3], r: usize) -> [L::F; 3] {
    [cell::<L>(batch, across, r, 0), cell::<L>(batch, across, r, 1), cell::<L>(batch, across, r, 2)]
}

/// [`cells`] along one axis.
#[inline(always)]
fn cell<L: Lanes>(batch: &mut Batch, across: &[L::F; 3], r: usize, axis: usize) -> L::F {
    let start = batch.origin[axis] + r as f32 * batch.down[axis];
    let u = L::add(L::splat(start), across[axis]);
    // Clamp to edge: half a voxel at the border of a `cells` box has the border's value.
    let u = L::min(L::max(u, L::splat(0.0)), L::splat(batch.reach[axis]));
    // u is not negative, so truncation is floor; a lookup on the upper border belongs to the last cell.
    let cell = L::min(L::to_f(L::trunc(u)), L::splat(batch.top[axis]));
    L::store(L::sub(u, cell), row_mut(&mut batch.weight[axis], r));
    cell
}

/// Offsets of a row's columns from the first along each axis.
#[inline(always)]
fn columns<L: Lanes>(batch: &Batch) -> [L::F; 3] {
    let [x, y, z] = batch.across;
    let column = L::load(&COLUMNS);
    [L::mul(column, L::splat(x)), L::mul(column, L::splat(y)), L::mul(column, L::splat(z))]
}

impl<'v> Kernel<Frame<'v>, Batch> for Texcoord {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let across = columns::<L>(batch);
        let (sy, sz) = (L::splat(frame.strides[1] as f32), L::splat(frame.strides[2] as f32));
        for r in 0..SIDE {
            let [x, y, z] = cells::<L>(batch, &across, r);
            // Whole numbers below 2^24: exact in f32.
            let offset = L::add(L::add(x, L::mul(y, sy)), L::mul(z, sz));
            L::store_i(L::trunc(offset), row_mut(&mut batch.offset, r));
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for TexcoordFar {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let across = columns::<L>(batch);
        let mut lower = [[0.0f32; BATCH]; 3];
        for r in 0..SIDE {
            let cell = cells::<L>(batch, &across, r);
            for axis in 0..3 {
                L::store(cell[axis], row_mut(&mut lower[axis], r));
            }
        }
        let [sx, sy, sz] = frame.strides.map(|s| s as u64);
        for i in 0..BATCH {
            batch.far_offset[i] = lower[0][i] as u64 * sx + lower[1][i] as u64 * sy + lower[2][i] as u64 * sz;
        }
    }
}
