//! Texture coordinates along rays that each have samples of their own: on shells about the eye, or on slices shifted pixel by pixel.
//!
//! Sample k of a ray lies at index coordinates start + k step, both of the ray's own: a product and a sum a coordinate, in f64, and no
//! division.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::{BATCH, Kernel, Lanes, SIDE, for_rows, row, row_mut};

/// Where a block's fragments lie along its rays.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct RayBatch {
    /// Depth at which each ray's first slab begins, and the slabs' distance along the depth, world units.
    pub(crate) near: [f64; BATCH],
    pub(crate) spacing: [f64; BATCH],
    /// Index coordinates of each ray's first sample, and the way to the next.
    pub(crate) start: [[f64; BATCH]; 3],
    pub(crate) step: [[f64; BATCH]; 3],
    /// Largest index of a cell's lower corner, and of a voxel, along each axis.
    pub(crate) top: [f64; 3],
    pub(crate) last: [f64; 3],
    /// Index coordinates of the fragments, within the volume; and those relative to the base voxel.
    at: [[f64; BATCH]; 3],
    pub(crate) place: [[f32; BATCH]; 3],
    /// The distance that fog goes by in the middle of slab k: the root of (along + k along_step)^2 + aside_squared, world units.
    pub(crate) along: [f32; BATCH],
    pub(crate) along_step: [f32; BATCH],
    pub(crate) aside_squared: [f32; BATCH],
    /// Depth at which a cut plane ends each ray, world units, infinite where none does; and its colour there.
    pub(crate) cut: [f64; BATCH],
    pub(crate) cut_color: [[f32; BATCH]; 3],
}

impl RayBatch {
    /// Of no rays.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self {
            near: [0.0; BATCH],
            spacing: [0.0; BATCH],
            start: [[0.0; BATCH]; 3],
            step: [[0.0; BATCH]; 3],
            top: [0.0; 3],
            last: [0.0; 3],
            at: [[0.0; BATCH]; 3],
            place: [[0.0; BATCH]; 3],
            along: [0.0; BATCH],
            along_step: [0.0; BATCH],
            aside_squared: [0.0; BATCH],
            cut: [f64::INFINITY; BATCH],
            cut_color: [[0.0; BATCH]; 3],
        })
    }
}

/// Fills `weight`, and `offset` or `far_offset`, of sample `slice` of every ray; the base voxel is the lowest corner of all their cells.
pub(crate) struct TexcoordRays<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for TexcoordRays<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(rays) = batch.rays.as_deref_mut() else { return };
        let slice = L::splat_d(f64::from(batch.slice));
        // Far lookups read every lane.
        let rows = if FAR { u8::MAX } else { batch.rows };
        let (mut low, mut base) = ([0i32; 3], 0);
        for axis in 0..3 {
            let (zero, last) = (L::splat_d(0.0), L::splat_d(rays.last[axis]));
            let (mut least, mut most) = (last, zero);
            // Of all rows: the base voxel, and with it rounding, must not depend on which pixels still take light.
            for r in 0..SIDE {
                let (start, step) = (L::load_d(row(&rays.start[axis], r)), L::load_d(row(&rays.step[axis], r)));
                // Clamp to edge.
                let u = L::min_d(L::max_d(L::add_d(start, L::mul_d(slice, step)), zero), last);
                (least, most) = (L::min_d(u, least), L::max_d(u, most));
                L::store_d(u, row_mut(&mut rays.at[axis], r));
            }
            let (mut from, mut to) = ([0.0; SIDE], [0.0; SIDE]);
            L::store_d(least, &mut from);
            L::store_d(most, &mut to);
            let (from, to) = (from.into_iter().fold(rays.last[axis], f64::min), to.into_iter().fold(0.0, f64::max));
            // Truncation equals floor from 0 up; a lookup on the upper border belongs to the last cell.
            low[axis] = from.min(rays.top[axis]) as i32;
            base += low[axis] as usize * frame.sample.strides[axis];
            // For stages that ask how far a batch reaches.
            batch.geometry.origin[axis] = (to - f64::from(low[axis])) as f32;
            (batch.geometry.across[axis], batch.geometry.down[axis]) = (0.0, 0.0);
        }
        batch.geometry.cells.base = base;
        batch.geometry.inner = false;
        let strides = frame.sample.strides.map(|s| L::splat_i(s as i32));
        for_rows!(rows, r => {
            let mut offset = L::splat_i(0);
            let mut cells = [[0; SIDE]; 3];
            for axis in 0..3 {
                let u = L::load_d(row(&rays.at[axis], r));
                let cell = L::trunc_d(L::min_d(u, L::splat_d(rays.top[axis])));
                L::store(L::narrow(L::sub_d(u, L::to_d(cell))), row_mut(&mut batch.sample.weight[axis], r));
                L::store(L::narrow(L::sub_d(u, L::splat_d(f64::from(low[axis])))), row_mut(&mut rays.place[axis], r));
                let cell = L::sub_i(cell, L::splat_i(low[axis]));
                if FAR {
                    L::store_i(cell, &mut cells[axis]);
                } else {
                    offset = L::add_i(offset, L::mul_i(cell, strides[axis]));
                }
            }
            if FAR {
                let [sx, sy, sz] = frame.sample.strides.map(|s| s as u64);
                for (i, to) in row_mut(&mut batch.rare.far_offset, r).iter_mut().enumerate() {
                    *to = cells[0][i] as u64 * sx + cells[1][i] as u64 * sy + cells[2][i] as u64 * sz;
                }
            } else {
                L::store_i(offset, row_mut(&mut batch.sample.offset, r));
            }
        });
    }
}
