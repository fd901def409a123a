//! Texture coordinates: the cell a fragment lies in, and where in it.
//!
//! On a view-aligned slice index coordinates are affine in window x and y, in perspective too: three additions a fragment and
//! no division. They are taken relative to a base voxel near the block, so that their fraction keeps all bits of f32 however
//! large the volume.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::{BATCH, Kernel, Lanes, SIDE, for_rows, row_mut};

/// Fills `weight` and `offset`, for batches whose cells lie within 2^24 voxels of the base voxel.
pub(crate) struct Texcoord;

/// Fills `weight` and `far_offset` of every lane, for batches that span more: far lookups read all of them.
pub(crate) struct TexcoordFar;

const NUMBERS: [f32; SIDE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Lower corners (in voxels from the base voxel) of one row's cells; their weights are stored. `INNER` rows have nothing to clamp.
#[inline(always)]
fn cells<L: Lanes, const INNER: bool>(batch: &mut Batch, steps: &Steps<L>, r: usize) -> [L::F; 3] {
    [cell::<L, INNER>(batch, steps, r, 0), cell::<L, INNER>(batch, steps, r, 1), cell::<L, INNER>(batch, steps, r, 2)]
}

/// [`cells`] along one axis.
#[inline(always)]
fn cell<L: Lanes, const INNER: bool>(batch: &mut Batch, steps: &Steps<L>, r: usize, axis: usize) -> L::F {
    let (cell, weight) = split::<L, INNER>(batch, steps, r, axis);
    L::store(weight, row_mut(&mut batch.sample.weight[axis], r));
    cell
}

/// The lower corner of one row's cells along one axis, in voxels from the base voxel, and where in them its fragments lie.
#[inline(always)]
fn split<L: Lanes, const INNER: bool>(batch: &Batch, steps: &Steps<L>, r: usize, axis: usize) -> (L::F, L::F) {
    let mut u = L::add(L::splat(steps.rows[axis][r]), steps.across[axis]);
    if !INNER {
        // Clamp to edge: half a voxel at the border of a `cells` box has the border's value.
        u = L::min(L::max(u, L::splat(0.0)), L::splat(batch.geometry.reach[axis]));
    }
    // u is not negative, so truncation is floor; a lookup on the upper border belongs to the last cell.
    let mut cell = L::whole(u);
    if !INNER {
        cell = L::min(cell, L::splat(batch.geometry.top[axis]));
    }
    (cell, L::sub(u, cell))
}

/// The voxels nearest to one row's fragments, in voxels from the base voxel, along each axis: those that lookups of the nearest voxel find.
#[inline(always)]
pub(super) fn nearest<L: Lanes>(batch: &Batch, steps: &Steps<L>, r: usize) -> [L::I; 3] {
    [0, 1, 2].map(|axis: usize| {
        let inner = batch.geometry.inner;
        let (cell, weight) = if inner { split::<L, true>(batch, steps, r, axis) } else { split::<L, false>(batch, steps, r, axis) };
        L::trunc(L::add(cell, L::keep(L::le(L::splat(0.5), weight), L::splat(1.0))))
    })
}

/// Index coordinates of rows' first fragments, and offsets of columns from them, along each axis.
pub(super) struct Steps<L: Lanes> {
    rows: [[f32; SIDE]; 3],
    across: [L::F; 3],
}

/// The steps of a batch.
#[inline(always)]
pub(super) fn steps<L: Lanes>(batch: &Batch) -> Steps<L> {
    let numbers = L::load(&NUMBERS);
    let [x, y, z] = batch.geometry.across;
    let mut rows = [[0.0; SIDE]; 3];
    for axis in 0..3 {
        L::store(L::add(L::splat(batch.geometry.origin[axis]), L::mul(numbers, L::splat(batch.geometry.down[axis]))), &mut rows[axis]);
    }
    Steps { rows, across: [L::mul(numbers, L::splat(x)), L::mul(numbers, L::splat(y)), L::mul(numbers, L::splat(z))] }
}

#[inline(always)]
fn near<L: Lanes, const INNER: bool>(frame: &Frame<'_>, batch: &mut Batch) {
    let steps = steps::<L>(batch);
    let (sy, sz) = (L::splat(frame.sample.strides[1] as f32), L::splat(frame.sample.strides[2] as f32));
    for_rows!(batch.rows, r => {
        let [x, y, z] = cells::<L, INNER>(batch, &steps, r);
        // Whole numbers below 2^24: exact in f32.
        let offset = L::add(L::add(x, L::mul(y, sy)), L::mul(z, sz));
        L::store_i(L::trunc(offset), row_mut(&mut batch.sample.offset, r));
    });
}

impl<'v> Kernel<Frame<'v>, Batch> for Texcoord {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        if batch.geometry.inner {
            near::<L, true>(frame, batch);
        } else {
            near::<L, false>(frame, batch);
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for TexcoordFar {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let steps = steps::<L>(batch);
        let mut lower = [[0.0f32; BATCH]; 3];
        for r in 0..SIDE {
            let cell = cells::<L, false>(batch, &steps, r);
            for axis in 0..3 {
                L::store(cell[axis], row_mut(&mut lower[axis], r));
            }
        }
        let [sx, sy, sz] = frame.sample.strides.map(|s| s as u64);
        for i in 0..BATCH {
            batch.rare.far_offset[i] = lower[0][i] as u64 * sx + lower[1][i] as u64 * sy + lower[2][i] as u64 * sz;
        }
    }
}

/// Fills `weight`, and `offset` or `far_offset`, for a part of a volume: positions are those of the whole, to the bit; lanes whose cells the
/// part does not hold look up its border instead, and are masked out. Fills every lane.
pub(crate) struct TexcoordPart<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for TexcoordPart<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let steps = steps::<L>(batch);
        let mut lower = [[0.0f32; BATCH]; 3];
        for r in 0..SIDE {
            for axis in 0..3 {
                let g = &batch.geometry;
                let (floor, reach, top) = (L::splat(g.floor[axis]), L::splat(g.reach[axis]), L::splat(g.top[axis]));
                let u = L::add(L::splat(steps.rows[axis][r]), steps.across[axis]);
                let u = L::min(L::max(u, floor), reach);
                // From the floor on, so that truncation is floor; whole numbers of voxels are exact in f32.
                let cell = L::min(L::add(L::whole(L::sub(u, floor)), floor), top);
                L::store(L::sub(u, cell), row_mut(&mut batch.sample.weight[axis], r));
                L::store(L::sub(cell, floor), row_mut(&mut lower[axis], r));
            }
        }
        let [sx, sy, sz] = frame.sample.strides.map(|s| s as u64);
        for i in 0..BATCH {
            let offset = lower[0][i] as u64 * sx + lower[1][i] as u64 * sy + lower[2][i] as u64 * sz;
            if FAR {
                batch.rare.far_offset[i] = offset;
            } else {
                // The plan takes this kernel where batches span fewer voxels.
                batch.sample.offset[i] = offset as i32;
            }
        }
    }
}
