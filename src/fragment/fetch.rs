//! Trilinear lookup in the voxels' own type.

use super::batch::{Batch, Frame, SIDE, row, row_mut};
use crate::lanes::{Kernel, Lanes};
use crate::volume::{Voxels, with_voxels};

/// 8-bit voxels, two neighbours along x a load.
pub(crate) struct FetchPairs8;
/// 16-bit voxels, two neighbours along x a load.
pub(crate) struct FetchPairs16;
/// Any type, a load a corner. `FAR` batches span more voxels than an i32 counts.
pub(crate) struct FetchAny<const FAR: bool>;

/// Three rounds of linear interpolation between the corners [x, x+1] of the four edges along x.
#[inline(always)]
fn trilinear<L: Lanes>(edges: [[L::F; 2]; 4], batch: &mut Batch, r: usize) {
    let lerp = |a: L::F, b: L::F, t: L::F| L::add(a, L::mul(t, L::sub(b, a)));
    let [x, y, z] = [0, 1, 2].map(|axis: usize| L::load(row(&batch.weight[axis], r)));
    let [e00, e10, e01, e11] = edges.map(|[a, b]| lerp(a, b, x));
    let value = lerp(lerp(e00, e10, y), lerp(e01, e11, y), z);
    L::store(value, row_mut(&mut batch.value, r));
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPairs8 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        match frame.voxels {
            Voxels::U8(v) => {
                batch.cells.pairs8(v, &batch.offset, &mut batch.pairs8);
                for r in 0..SIDE {
                    let low = L::splat_i(0xff);
                    let edges = [0, 1, 2, 3].map(|p: usize| {
                        let pair = L::load_u16(row(&batch.pairs8.0[p], r));
                        [L::to_f(L::and_i(pair, low)), L::to_f(L::sar::<8>(pair))]
                    });
                    trilinear::<L>(edges, batch, r);
                }
            }
            Voxels::I8(v) => {
                batch.cells.pairs8(bytemuck::cast_slice(v), &batch.offset, &mut batch.pairs8);
                for r in 0..SIDE {
                    let edges = [0, 1, 2, 3].map(|p: usize| {
                        let pair = L::load_u16(row(&batch.pairs8.0[p], r));
                        [L::to_f(L::sar::<24>(L::shl::<24>(pair))), L::to_f(L::sar::<24>(L::shl::<16>(pair)))]
                    });
                    trilinear::<L>(edges, batch, r);
                }
            }
            _ => unreachable!("the plan chose 8-bit lookups for other voxels"),
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPairs16 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        match frame.voxels {
            Voxels::U16(v) => {
                batch.cells.pairs16(v, &batch.offset, &mut batch.pairs16);
                for r in 0..SIDE {
                    let low = L::splat_i(0xffff);
                    let edges = [0, 1, 2, 3].map(|p: usize| {
                        let pair = L::load_i(bytemuck::cast_ref(row(&batch.pairs16.0[p], r)));
                        [L::to_f(L::and_i(pair, low)), L::to_f(L::and_i(L::sar::<16>(pair), low))]
                    });
                    trilinear::<L>(edges, batch, r);
                }
            }
            Voxels::I16(v) => {
                batch.cells.pairs16(bytemuck::cast_slice(v), &batch.offset, &mut batch.pairs16);
                for r in 0..SIDE {
                    let edges = [0, 1, 2, 3].map(|p: usize| {
                        let pair = L::load_i(bytemuck::cast_ref(row(&batch.pairs16.0[p], r)));
                        [L::to_f(L::sar::<16>(L::shl::<16>(pair))), L::to_f(L::sar::<16>(pair))]
                    });
                    trilinear::<L>(edges, batch, r);
                }
            }
            _ => unreachable!("the plan chose 16-bit lookups for other voxels"),
        }
    }
}

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchAny<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        with_voxels!(frame.voxels, v => {
            if FAR {
                batch.cells.far_corners(v, &batch.far_offset, frame.to_f32, &mut batch.corners);
            } else {
                batch.cells.corners(v, &batch.offset, frame.to_f32, &mut batch.corners);
            }
        });
        for r in 0..SIDE {
            let edges = [0, 2, 4, 6].map(|c: usize| [L::load(row(&batch.corners.0[c], r)), L::load(row(&batch.corners.0[c + 1], r))]);
            trilinear::<L>(edges, batch, r);
        }
    }
}

/// Fragments whose value is NaN or infinite are not covered: for volumes that hold such voxels.
pub(crate) struct Guard;

impl<'v> Kernel<Frame<'v>, Batch> for Guard {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        for r in 0..SIDE {
            let v = L::load(row(&batch.value, r));
            let finite = L::and(L::le(v, L::splat(f32::MAX)), L::le(L::splat(f32::MIN), v));
            L::store(L::select(finite, v, L::splat(frame.table_low)), row_mut(&mut batch.value, r));
            batch.mask &= !(0xff << (8 * r)) | u64::from(L::bits(finite)) << (8 * r);
        }
    }
}
