//! The gradient of the interpolated values at each fragment that shows: its direction and size, in world space.
//!
//! Along an axis the central difference is half of (f one voxel ahead) - (f one voxel behind), both interpolated. Interpolation is linear in
//! the voxels, so that is the same as interpolating between differences taken at the cell's eight corners: 32 voxels, 24 of them beyond the
//! cell. Voxels beyond the volume are those at its edge, as in every lookup.
//!
//! ```text
//!    seen along z:   . o o .        O: the cell's corners, at z and at z+1; the corners have neighbours at z-1 and z+2 as well
//!                    o O O o        o: their neighbours along x and y
//!                    o O O o
//!                    . o o .
//! ```

use super::batch::Batch;
use super::fetch::lerp;
use super::frame::Frame;
use super::{Pieces, Run};
use crate::lanes::{Kernel, Lanes, Level, SIDE, convert, for_rows, lanes_of, row, row_mut};
use crate::scene::Gradient;
use crate::volume::packed::{Packed, PackedPairs};
use crate::volume::{Grid, VoxelSlices, with_slices};

/// What gradients need.
#[derive(Debug, Clone)]
pub(crate) struct GradientFrame {
    kind: Gradient,
    /// Voxels along x, y and z.
    dims: [usize; 3],
    /// From differences of the stages' numbers along the voxel axes to world space, in `unit`: rows are world x, y, z.
    matrix: [[f32; 3]; 3],
    /// A size of 1 in data units per world unit: a power of two near the largest entry of the matrix, so that no number leaves f32.
    pub(crate) unit: f64,
}

impl GradientFrame {
    /// For a volume on `grid` whose values are `scale` times the stages' numbers, plus something.
    pub(crate) fn new(kind: Gradient, grid: &Grid, scale: f64) -> Self {
        // A gradient is a covector: it goes through the transpose of the map from world to index.
        let to_world = grid.world_to_index().matrix3.transpose();
        let most = to_world.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (_, exponent) = libm::frexp(most);
        let least = libm::scalbn(1.0, -exponent);
        // What the kernels' sums are too large by.
        let share = match kind {
            Gradient::Central => 0.5,
            Gradient::Analytic => 1.0,
            Gradient::Sobel => 1.0 / 32.0,
        };
        let sign = scale.signum();
        let matrix = [0, 1, 2].map(|r: usize| to_world.row(r).to_array().map(|x| (x * least * share * sign) as f32));
        Self { kind, dims: grid.dims(), matrix, unit: scale.abs() * libm::scalbn(1.0, exponent) }
    }

    /// A size in data units per world unit as a number of the batch; within f32.
    pub(crate) fn number(&self, size: f64) -> f32 {
        (size / self.unit).min(1e38) as f32
    }
}

/// The kernel for batches of such pieces; `far` where offsets may leave i32.
pub(super) fn kernel<'v>(pieces: Pieces, far: bool, level: Level) -> Run<'v> {
    match (pieces, far) {
        // Fragments at depths of their own lie anywhere in the batch's part of the volume.
        (Pieces::BehindSlices, true) => level.kernel::<TakeGradient<true, true>, _, _>(),
        (Pieces::BehindSlices, false) => level.kernel::<TakeGradient<false, true>, _, _>(),
        (Pieces::OnSlice, true) => level.kernel::<TakeGradient<true, false>, _, _>(),
        (Pieces::OnSlice, false) => level.kernel::<TakeGradient<false, false>, _, _>(),
    }
}

/// Gradients of the rows in which something shows. `FAR` batches have offsets beyond i32; with `EACH` fragments have depths of their own.
pub(super) struct TakeGradient<const FAR: bool, const EACH: bool>;

/// Neighbours of a cell's lowest corner that central differences need, as steps along x, y, z.
const CROSS: [[i8; 3]; 32] = {
    let mut steps = [[0; 3]; 32];
    let mut i = 0;
    while i < 16 {
        // Four along x on each of the cell's four edges.
        steps[i] = [(i % 4) as i8 - 1, (i / 4 % 2) as i8, (i / 8) as i8];
        i += 1;
    }
    while i < 24 {
        // y-1, y+2: for each plane z, z+1, both columns.
        steps[i] = [(i % 2) as i8, if i / 2 % 2 == 0 { -1 } else { 2 }, ((i - 16) / 4) as i8];
        i += 1;
    }
    while i < 32 {
        // z-1, z+2: all four edges.
        steps[i] = [(i % 2) as i8, (i / 2 % 2) as i8, if i < 28 { -1 } else { 2 }];
        i += 1;
    }
    steps
};

/// The corners of a cell.
const CELL: [[i8; 3]; 8] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

/// All neighbours up to one voxel from a corner of the cell, x fastest.
const CUBE: [[i8; 3]; 64] = {
    let mut steps = [[0; 3]; 64];
    let mut i = 0;
    while i < 64 {
        steps[i] = [(i % 4) as i8 - 1, (i / 4 % 4) as i8 - 1, (i / 16) as i8 - 1];
        i += 1;
    }
    steps
};

/// Twice the central difference along each axis, from voxels at [`CROSS`] and a place in the cell.
#[inline(always)]
fn central<L: Lanes>(v: &[L::F; 32], [x, y, z]: [L::F; 3]) -> [L::F; 3] {
    let edge = |e: usize| {
        let [a, b, c, d] = [v[4 * e], v[4 * e + 1], v[4 * e + 2], v[4 * e + 3]];
        (lerp::<L>(L::sub(c, a), L::sub(d, b), x), lerp::<L>(b, c, x))
    };
    let [(d00, e00), (d10, e10), (d01, e01), (d11, e11)] = [edge(0), edge(1), edge(2), edge(3)];
    let along_x = lerp::<L>(lerp::<L>(d00, d10, y), lerp::<L>(d01, d11, y), z);
    let beside = |at: usize| lerp::<L>(v[at], v[at + 1], x);
    let slope_y = |before: usize, here: L::F, next: L::F| lerp::<L>(L::sub(next, beside(before)), L::sub(beside(before + 2), here), y);
    let along_y = lerp::<L>(slope_y(16, e00, e10), slope_y(20, e01, e11), z);
    let plane = |at: usize| lerp::<L>(beside(at), beside(at + 2), y);
    let (here, next) = (lerp::<L>(e00, e10, y), lerp::<L>(e01, e11, y));
    let along_z = lerp::<L>(L::sub(next, plane(24)), L::sub(plane(28), here), z);
    [along_x, along_y, along_z]
}

/// The derivative of linear interpolation, from voxels at [`CELL`] and a place in the cell.
#[inline(always)]
fn analytic<L: Lanes>(v: &[L::F; 8], [x, y, z]: [L::F; 3]) -> [L::F; 3] {
    let step = |a: usize, b: usize| L::sub(v[b], v[a]);
    let plane = |a: L::F, b: L::F, c: L::F, d: L::F, s: L::F, t: L::F| lerp::<L>(lerp::<L>(a, b, s), lerp::<L>(c, d, s), t);
    [
        plane(step(0, 1), step(2, 3), step(4, 5), step(6, 7), y, z),
        plane(step(0, 2), step(1, 3), step(4, 6), step(5, 7), x, z),
        plane(step(0, 4), step(1, 5), step(2, 6), step(3, 7), x, y),
    ]
}

/// 32 times Sobel's difference along each axis: 1 2 1 along both other axes, -1 0 1 along its own, interpolated; from voxels at [`CUBE`].
#[inline(always)]
fn sobel<L: Lanes>(v: &[L::F; 64], place: [L::F; 3]) -> [L::F; 3] {
    // Smoothed and differenced at both corners along one axis, then interpolated.
    let smooth = |[a, b, c, d]: [L::F; 4], t: L::F| {
        let at = |a, b, c| L::add(L::add(a, c), L::add(b, b));
        lerp::<L>(at(a, b, c), at(b, c, d), t)
    };
    let slope = |[a, b, c, d]: [L::F; 4], t: L::F| lerp::<L>(L::sub(c, a), L::sub(d, b), t);
    let [x, y, z] = place;
    let zero = L::splat(0.0);
    let (mut dx, mut sx) = ([[zero; 4]; 4], [[zero; 4]; 4]);
    for k in 0..4 {
        for j in 0..4 {
            let line = [0, 1, 2, 3].map(|i: usize| v[16 * k + 4 * j + i]);
            dx[k][j] = slope(line, x);
            sx[k][j] = smooth(line, x);
        }
    }
    let along_x = smooth([0, 1, 2, 3].map(|k: usize| smooth(dx[k], y)), z);
    let along_y = smooth([0, 1, 2, 3].map(|k: usize| slope(sx[k], y)), z);
    let along_z = slope([0, 1, 2, 3].map(|k: usize| smooth(sx[k], y)), z);
    [along_x, along_y, along_z]
}

/// Index of voxel `offset` of the lookups' layout along x, y and z.
pub(super) fn index_of(offset: usize, strides: [usize; 3]) -> [usize; 3] {
    let (mut rest, mut index) = (offset, [0; 3]);
    // An offset below a layer's stride lies in the first layer, and so on; axes of one voxel have a stride of 0.
    for axis in [2, 1, 0] {
        if let Some(along) = rest.checked_div(strides[axis]) {
            index[axis] = along;
            rest -= along * strides[axis];
        }
    }
    index
}

/// The voxels at `steps` from the cells of row `r`, one by one, those beyond the volume taken from its edge.
#[inline(always)]
fn gather<L: Lanes, const FAR: bool, const N: usize>(
    frame: &Frame<'_>,
    dims: [usize; 3],
    batch: &Batch,
    r: usize,
    steps: &[[i8; 3]; N],
) -> [L::F; N] {
    let sample = &frame.sample;
    let mut found = [[0.0f32; SIDE]; N];
    with_slices!(sample.voxels, v => {
        for i in 0..SIDE {
            let at = SIDE * r + i;
            let offset = if FAR { batch.rare.far_offset[at] as usize } else { batch.sample.offset[at] as usize };
            let cell = index_of(batch.geometry.cells.base + offset, sample.strides);
            // Voxels before, at, and one and two behind the cell's lowest corner, along each axis, within the volume.
            let near = [0, 1, 2].map(|axis: usize| {
                let last = dims[axis] - 1;
                let c = cell[axis];
                let step: usize = if axis == 0 { 1 } else if axis == 1 { dims[0] } else { dims[0] * dims[1] };
                [c.saturating_sub(1), c, (c + 1).min(last), (c + 2).min(last)].map(|n| n * step)
            });
            for (found, step) in found.iter_mut().zip(steps) {
                let [x, y, z] = [0, 1, 2].map(|axis: usize| near[axis][(step[axis] + 1) as usize]);
                found[i] = convert(v[x + y + z], sample.to_f32);
            }
        }
    });
    found.map(|lane| L::load(&lane))
}

/// [`CROSS`] from packed voxels of 8 bits.
#[inline(always)]
fn cross8<L: Lanes, const SIGNED: bool>(packed: &[u16], batch: &Batch, r: usize) -> [L::F; 32] {
    use super::fetch::byte;
    let q = batch.geometry.cells.around8::<L>(packed, &batch.sample.offset, r);
    let low = |at: usize| byte::<L, SIGNED, 0>(q[at]);
    let next = |at: usize| byte::<L, SIGNED, 1>(q[at]);
    let right = |at: usize| byte::<L, SIGNED, 2>(q[at]);
    let right_next = |at: usize| byte::<L, SIGNED, 3>(q[at]);
    [
        low(0),
        right(0),
        low(1),
        right(1),
        next(0),
        right_next(0),
        next(1),
        right_next(1),
        low(2),
        right(2),
        low(3),
        right(3),
        next(2),
        right_next(2),
        next(3),
        right_next(3),
        low(4),
        right(4),
        next(5),
        right_next(5),
        low(6),
        right(6),
        next(7),
        right_next(7),
        low(8),
        right(8),
        next(8),
        right_next(8),
        low(9),
        right(9),
        next(9),
        right_next(9),
    ]
}

/// [`CROSS`] from packed voxels of 16 bits.
#[inline(always)]
fn cross16<L: Lanes, const SIGNED: bool>(packed: &[u32], batch: &Batch, r: usize) -> [L::F; 32] {
    let q = batch.geometry.cells.around16::<L>(packed, &batch.sample.offset, r);
    let here = |at: usize| {
        if SIGNED { L::to_f(L::sar::<16>(L::shl::<16>(q[at]))) } else { L::to_f(L::and_i(q[at], L::splat_i(0xffff))) }
    };
    let next = |at: usize| {
        if SIGNED { L::to_f(L::sar::<16>(q[at])) } else { L::to_f(L::and_i(L::sar::<16>(q[at]), L::splat_i(0xffff))) }
    };
    [
        here(0),
        here(1),
        here(2),
        here(3),
        next(0),
        next(1),
        next(2),
        next(3),
        here(4),
        here(5),
        here(6),
        here(7),
        next(4),
        next(5),
        next(6),
        next(7),
        here(8),
        here(9),
        next(10),
        next(11),
        here(12),
        here(13),
        next(14),
        next(15),
        here(16),
        here(17),
        next(16),
        next(17),
        here(18),
        here(19),
        next(18),
        next(19),
    ]
}

/// Whether every cell of the batch has a voxel before it and two behind its lowest corner, along every axis.
fn is_deep(frame: &Frame<'_>, dims: [usize; 3], batch: &Batch) -> bool {
    let g = &batch.geometry;
    let base = index_of(g.cells.base, frame.sample.strides);
    (0..3).all(|axis| {
        let far = (SIDE - 1) as f32;
        let most = g.origin[axis] + far * (g.across[axis].max(0.0) + g.down[axis].max(0.0));
        // Well inside: f32 coordinates are off by less.
        base[axis] >= 1 && f64::from(most) + 1e-3 + (base[axis] as f64) < dims[axis] as f64 - 2.0
    })
}

/// Sets normals and sizes of row `r` from the differences along the voxel axes.
#[inline(always)]
fn finish<L: Lanes>(gradient: &GradientFrame, along: [L::F; 3], batch: &mut Batch, r: usize) {
    let zero = L::splat(0.0);
    let world = gradient
        .matrix
        .map(|m| L::add(L::add(L::mul(L::splat(m[0]), along[0]), L::mul(L::splat(m[1]), along[1])), L::mul(L::splat(m[2]), along[2])));
    let abs = |x: L::F| L::max(x, L::sub(zero, x));
    let sum = L::add(L::add(abs(world[0]), abs(world[1])), abs(world[2]));
    let most = L::max(L::max(abs(world[0]), abs(world[1])), abs(world[2]));
    // The sum is NaN or infinite where any part is. What is below the smallest normal number counts as none.
    let there = L::and(L::le(L::splat(f32::MIN_POSITIVE), most), L::le(sum, L::splat(f32::MAX)));
    // Scaled first: squares may leave f32.
    let most = L::select(there, most, L::splat(1.0));
    let q = world.map(|x| L::div(L::keep(there, x), most));
    let length = L::sqrt(L::add(L::add(L::mul(q[0], q[0]), L::mul(q[1], q[1])), L::mul(q[2], q[2])));
    let length_or_one = L::select(there, length, L::splat(1.0));
    for (normal, q) in batch.gradient.normal.iter_mut().zip(q) {
        L::store(L::div(L::sub(zero, q), length_or_one), row_mut(normal, r));
    }
    L::store(L::keep(there, L::min(L::mul(most, length), L::splat(f32::MAX))), row_mut(&mut batch.gradient.size, r));
}

/// Every row of `rows` through `around`, which gives the differences along the voxel axes.
#[inline(always)]
fn each_row<L: Lanes>(gradient: &GradientFrame, batch: &mut Batch, rows: u8, around: impl Fn(&Batch, usize, [L::F; 3]) -> [L::F; 3]) {
    for_rows!(rows, r => {
        let place = [0, 1, 2].map(|axis: usize| L::load(row(&batch.sample.weight[axis], r)));
        let along = around(batch, r, place);
        finish::<L>(gradient, along, batch, r);
    });
}

impl<'v, const FAR: bool, const EACH: bool> Kernel<Frame<'v>, Batch> for TakeGradient<FAR, EACH> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(gradient) = &frame.optional.gradient else { return };
        let mut rows = 0;
        for_rows!(batch.shown, r => {
            // Light and gradient change nothing where there is no opacity.
            let visible = L::bits(L::lt(L::splat(0.0), L::load(row(&batch.slab.alpha, r)))) & (batch.mask >> (8 * r)) as u8;
            rows |= u8::from(visible != 0) << r;
        });
        batch.gradient.rows = rows;
        if rows == 0 {
            return;
        }
        batch.gradient.taken += lanes_of(rows);
        let dims = gradient.dims;
        match gradient.kind {
            Gradient::Analytic => {
                each_row::<L>(gradient, batch, rows, |b, r, p| analytic::<L>(&gather::<L, FAR, 8>(frame, dims, b, r, &CELL), p))
            }
            Gradient::Sobel => {
                each_row::<L>(gradient, batch, rows, |b, r, p| sobel::<L>(&gather::<L, FAR, 64>(frame, dims, b, r, &CUBE), p))
            }
            Gradient::Central => {
                let packed = frame.sample.packed.filter(|_| !FAR && !EACH && is_deep(frame, dims, batch));
                let signed = matches!(frame.sample.voxels, VoxelSlices::I8(_) | VoxelSlices::I16(_));
                match packed {
                    Some(Packed { pairs: PackedPairs::Of8(v), .. }) if signed => {
                        each_row::<L>(gradient, batch, rows, |b, r, p| central::<L>(&cross8::<L, true>(v, b, r), p));
                    }
                    Some(Packed { pairs: PackedPairs::Of8(v), .. }) => {
                        each_row::<L>(gradient, batch, rows, |b, r, p| central::<L>(&cross8::<L, false>(v, b, r), p));
                    }
                    Some(Packed { pairs: PackedPairs::Of16(v), .. }) if signed => {
                        each_row::<L>(gradient, batch, rows, |b, r, p| central::<L>(&cross16::<L, true>(v, b, r), p));
                    }
                    Some(Packed { pairs: PackedPairs::Of16(v), .. }) => {
                        each_row::<L>(gradient, batch, rows, |b, r, p| central::<L>(&cross16::<L, false>(v, b, r), p));
                    }
                    None => {
                        each_row::<L>(gradient, batch, rows, |b, r, p| central::<L>(&gather::<L, FAR, 32>(frame, dims, b, r, &CROSS), p))
                    }
                }
            }
        }
    }
}
