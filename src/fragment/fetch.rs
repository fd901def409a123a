//! Trilinear lookup in the voxels' own type.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::{BATCH, CornerPairs, Kernel, Lanes, for_rows, row, row_mut, spread};
use crate::volume::packed::{self, Packed};
use crate::volume::{VoxelSlices, with_slices};

/// 8-bit voxels, two neighbours along x a load.
pub(crate) struct FetchPairs8;
/// 8-bit voxels packed with their neighbours along y, four corners a load.
pub(crate) struct FetchPacked8;
/// 16-bit voxels, two neighbours along x a load.
pub(crate) struct FetchPairs16;
/// 16-bit voxels packed with their neighbours along y, four corners a load.
pub(crate) struct FetchPacked16;
/// 32-bit voxels, two neighbours along x a load. Only for unsigned voxels below 2^31.
pub(crate) struct FetchPairs32;
/// Any type, a load a corner. `FAR` batches span more voxels than an i32 counts.
pub(crate) struct FetchAny<const FAR: bool>;

/// a + t (b - a).
#[inline(always)]
pub(super) fn lerp<L: Lanes>(a: L::F, b: L::F, t: L::F) -> L::F {
    L::add(a, L::mul(t, L::sub(b, a)))
}

/// Both voxels of a pair: the low and the high half, with or without sign.
#[inline(always)]
fn halves8<L: Lanes, const SIGNED: bool>(pairs: &CornerPairs<u16>, p: usize, r: usize) -> [L::F; 2] {
    let pair = L::load_u16(row(&pairs.0[p], r));
    if SIGNED {
        [L::to_f(L::sar::<24>(L::shl::<24>(pair))), L::to_f(L::sar::<24>(L::shl::<16>(pair)))]
    } else {
        [L::to_f(L::and_i(pair, L::splat_i(0xff))), L::to_f(L::sar::<8>(pair))]
    }
}

/// As [`halves8`].
#[inline(always)]
fn halves16<L: Lanes, const SIGNED: bool>(pairs: &CornerPairs<u32>, p: usize, r: usize) -> [L::F; 2] {
    let pair = L::load_i(bytemuck::cast_ref(row(&pairs.0[p], r)));
    let low = L::splat_i(0xffff);
    if SIGNED {
        [L::to_f(L::sar::<16>(L::shl::<16>(pair))), L::to_f(L::sar::<16>(pair))]
    } else {
        [L::to_f(L::and_i(pair, low)), L::to_f(L::and_i(L::sar::<16>(pair), low))]
    }
}

/// Byte `N` of each lane, with or without sign.
#[inline(always)]
pub(super) fn byte<L: Lanes, const SIGNED: bool, const N: i32>(quad: L::I) -> L::F {
    if !SIGNED {
        return L::byte::<N>(quad);
    }
    L::to_f(L::sar::<24>(match N {
        0 => L::shl::<24>(quad),
        1 => L::shl::<16>(quad),
        2 => L::shl::<8>(quad),
        _ => quad,
    }))
}

/// Packed 8-bit voxels, but for rows in which nothing shows.
#[inline(always)]
fn packed8<L: Lanes, const SIGNED: bool>(frame: &Frame<'_>, packed: &[u16], batch: &mut Batch) {
    let (cells, rows) = (batch.geometry.cells, batch.rows);
    let lit = match frame.sample.hidden_up_to.filter(|_| batch.mostly_hidden) {
        Some(hidden_up_to) => cells.quads8::<L, SIGNED, true>(packed, &batch.sample.offset, rows, hidden_up_to, &mut batch.sample.pairs16),
        None => cells.quads8::<L, SIGNED, false>(packed, &batch.sample.offset, rows, 0, &mut batch.sample.pairs16),
    };
    batch.shown &= lit;
    for_rows!(lit, r => {
        let near = L::load_i(bytemuck::cast_ref(row(&batch.sample.pairs16.0[0], r)));
        let far = L::load_i(bytemuck::cast_ref(row(&batch.sample.pairs16.0[1], r)));
        let edges = [
            [byte::<L, SIGNED, 0>(near), byte::<L, SIGNED, 2>(near)],
            [byte::<L, SIGNED, 1>(near), byte::<L, SIGNED, 3>(near)],
            [byte::<L, SIGNED, 0>(far), byte::<L, SIGNED, 2>(far)],
            [byte::<L, SIGNED, 1>(far), byte::<L, SIGNED, 3>(far)],
        ];
        trilinear::<L>(edges, batch, r);
    });
}

/// All rows of a batch of 8-bit pairs.
#[inline(always)]
fn rows8<L: Lanes, const SIGNED: bool>(batch: &mut Batch) {
    for_rows!(batch.rows, r => {
        let p = &batch.rare.pairs8;
        let edges =
            [halves8::<L, SIGNED>(p, 0, r), halves8::<L, SIGNED>(p, 1, r), halves8::<L, SIGNED>(p, 2, r), halves8::<L, SIGNED>(p, 3, r)];
        trilinear::<L>(edges, batch, r);
    });
}

/// All rows of a batch of 16-bit pairs.
#[inline(always)]
fn rows16<L: Lanes, const SIGNED: bool>(batch: &mut Batch) {
    for_rows!(batch.rows, r => {
        let p = &batch.sample.pairs16;
        let edges = [
            halves16::<L, SIGNED>(p, 0, r),
            halves16::<L, SIGNED>(p, 1, r),
            halves16::<L, SIGNED>(p, 2, r),
            halves16::<L, SIGNED>(p, 3, r),
        ];
        trilinear::<L>(edges, batch, r);
    });
}

/// Packed 16-bit voxels, but for rows in which nothing shows.
#[inline(always)]
fn packed16<L: Lanes, const SIGNED: bool>(frame: &Frame<'_>, packed: &[u32], batch: &mut Batch) {
    let (cells, rows) = (batch.geometry.cells, batch.rows);
    let lit = match frame.sample.hidden_up_to.filter(|_| batch.mostly_hidden) {
        Some(hidden_up_to) => cells.quads16::<L, SIGNED, true>(packed, &batch.sample.offset, rows, hidden_up_to, &mut batch.sample.pairs16),
        None => cells.quads16::<L, SIGNED, false>(packed, &batch.sample.offset, rows, 0, &mut batch.sample.pairs16),
    };
    batch.shown &= lit;
    for_rows!(lit, r => {
        let p = &batch.sample.pairs16;
        let [near_left, near_right] = [halves16::<L, SIGNED>(p, 0, r), halves16::<L, SIGNED>(p, 1, r)];
        let [far_left, far_right] = [halves16::<L, SIGNED>(p, 2, r), halves16::<L, SIGNED>(p, 3, r)];
        let edges = [
            [near_left[0], near_right[0]],
            [near_left[1], near_right[1]],
            [far_left[0], far_right[0]],
            [far_left[1], far_right[1]],
        ];
        trilinear::<L>(edges, batch, r);
    });
}

/// All rows of a batch whose corners are f32, or 32-bit integers as bits.
#[inline(always)]
fn rows32<L: Lanes, const INTEGER: bool>(batch: &mut Batch) {
    for_rows!(batch.rows, r => {
        let [c0, c1, c2, c3, c4, c5, c6, c7] = &batch.rare.corners.0;
        let edges = [
            [corner::<L, INTEGER>(c0, r), corner::<L, INTEGER>(c1, r)],
            [corner::<L, INTEGER>(c2, r), corner::<L, INTEGER>(c3, r)],
            [corner::<L, INTEGER>(c4, r), corner::<L, INTEGER>(c5, r)],
            [corner::<L, INTEGER>(c6, r), corner::<L, INTEGER>(c7, r)],
        ];
        trilinear::<L>(edges, batch, r);
    });
}

/// A row of corner values.
#[inline(always)]
fn corner<L: Lanes, const INTEGER: bool>(values: &[f32; BATCH], r: usize) -> L::F {
    let value = L::load(row(values, r));
    if INTEGER { L::to_f(L::to_bits(value)) } else { value }
}

/// Three rounds of linear interpolation between the corners [x, x+1] of the four edges along x.
#[inline(always)]
fn trilinear<L: Lanes>(edges: [[L::F; 2]; 4], batch: &mut Batch, r: usize) {
    let x = L::load(row(&batch.sample.weight[0], r));
    let y = L::load(row(&batch.sample.weight[1], r));
    let z = L::load(row(&batch.sample.weight[2], r));
    let [e00, e10, e01, e11] = edges;
    let near = lerp::<L>(lerp::<L>(e00[0], e00[1], x), lerp::<L>(e10[0], e10[1], x), y);
    let far = lerp::<L>(lerp::<L>(e01[0], e01[1], x), lerp::<L>(e11[0], e11[1], x), y);
    let value = lerp::<L>(near, far, z);
    L::store(value, row_mut(&mut batch.sample.value, r));
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPairs8 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        match frame.sample.voxels {
            VoxelSlices::U8(v) => {
                batch.geometry.cells.pairs8::<L>(v, &batch.sample.offset, batch.rows, &mut batch.rare.pairs8);
                rows8::<L, false>(batch);
            }
            VoxelSlices::I8(v) => {
                batch.geometry.cells.pairs8::<L>(bytemuck::cast_slice(v), &batch.sample.offset, batch.rows, &mut batch.rare.pairs8);
                rows8::<L, true>(batch);
            }
            _ => unreachable!("the plan chose 8-bit lookups for other voxels"),
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPacked8 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(Packed { pairs: packed::PackedPairs::Of8(packed), .. }) = frame.sample.packed else {
            unreachable!("the plan chose packed lookups for voxels that are not");
        };
        if matches!(frame.sample.voxels, VoxelSlices::I8(_)) {
            packed8::<L, true>(frame, packed, batch);
        } else {
            packed8::<L, false>(frame, packed, batch);
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPairs16 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        match frame.sample.voxels {
            VoxelSlices::U16(v) => {
                batch.geometry.cells.pairs16::<L>(v, &batch.sample.offset, batch.rows, &mut batch.sample.pairs16);
                rows16::<L, false>(batch);
            }
            VoxelSlices::I16(v) => {
                batch.geometry.cells.pairs16::<L>(bytemuck::cast_slice(v), &batch.sample.offset, batch.rows, &mut batch.sample.pairs16);
                rows16::<L, true>(batch);
            }
            _ => unreachable!("the plan chose 16-bit lookups for other voxels"),
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPacked16 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(Packed { pairs: packed::PackedPairs::Of16(packed), .. }) = frame.sample.packed else {
            unreachable!("the plan chose packed lookups for voxels that are not");
        };
        if matches!(frame.sample.voxels, VoxelSlices::I16(_)) {
            packed16::<L, true>(frame, packed, batch);
        } else {
            packed16::<L, false>(frame, packed, batch);
        }
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FetchPairs32 {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let bits: &[u32] = match frame.sample.voxels {
            VoxelSlices::F32(v) => bytemuck::cast_slice(v),
            VoxelSlices::I32(v) => bytemuck::cast_slice(v),
            VoxelSlices::U32(v) => v,
            _ => unreachable!("the plan chose 32-bit lookups for other voxels"),
        };
        batch.geometry.cells.pairs32::<L>(bits, &batch.sample.offset, batch.rows, &mut batch.rare.corners);
        if matches!(frame.sample.voxels, VoxelSlices::F32(_)) {
            rows32::<L, false>(batch);
        } else {
            rows32::<L, true>(batch);
        }
    }
}

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchAny<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        FetchCorners::<FAR>::run::<L>(frame, batch);
        rows32::<L, false>(batch);
    }
}

/// The voxel nearest to each fragment, any type.
pub(crate) struct FetchNearest<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchNearest<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let lanes = spread(batch.rows);
        let step = nearest_steps(frame, batch, lanes);
        with_slices!(frame.sample.voxels, v => {
            let offset = |i: usize| if FAR { batch.rare.far_offset[i] as usize } else { batch.sample.offset[i] as usize };
            batch.geometry.cells.each(v, lanes, |i| offset(i) + step[i], frame.sample.to_f32, &mut batch.sample.value);
        });
    }
}

/// Distance from each fragment's lower corner to its nearest voxel, in voxels, of fragments of `lanes`.
#[inline(always)]
pub(super) fn nearest_steps(frame: &Frame<'_>, batch: &Batch, lanes: u64) -> [usize; BATCH] {
    let upper = |weight: &[f32; BATCH], i: usize, stride: usize| if weight[i] >= 0.5 { stride } else { 0 };
    let mut step = [0; BATCH];
    for i in (0..BATCH).filter(|i| lanes >> i & 1 == 1) {
        let [sx, sy, sz] = frame.sample.strides;
        step[i] = upper(&batch.sample.weight[0], i, sx) + upper(&batch.sample.weight[1], i, sy) + upper(&batch.sample.weight[2], i, sz);
    }
    step
}

/// The eight voxels around each fragment, any type, not interpolated yet.
pub(crate) struct FetchCorners<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchCorners<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        with_slices!(frame.sample.voxels, v => {
            if FAR {
                batch.geometry.cells.far_corners(v, &batch.rare.far_offset, frame.sample.to_f32, &mut batch.rare.corners);
            } else {
                batch.geometry.cells.corners::<L, _>(v, &batch.sample.offset, batch.rows, frame.sample.to_f32, &mut batch.rare.corners);
            }
        });
    }
}

/// Neither NaN nor infinite.
#[inline(always)]
pub(super) fn finite<L: Lanes>(x: L::F) -> L::M {
    L::and(L::le(x, L::splat(f32::MAX)), L::le(L::splat(f32::MIN), x))
}

/// Fragments whose value is NaN or infinite are not covered: for volumes that hold such voxels.
pub(crate) struct Guard;

impl<'v> Kernel<Frame<'v>, Batch> for Guard {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.rows, r => {
            let v = L::load(row(&batch.sample.value, r));
            let finite = finite::<L>(v);
            L::store(L::select(finite, v, L::splat(frame.color.low)), row_mut(&mut batch.sample.value, r));
            batch.mask &= !(0xff << (8 * r)) | u64::from(L::bits(finite)) << (8 * r);
        });
    }
}
