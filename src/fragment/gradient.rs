//! The gradient of the interpolated values at each fragment that shows: its direction and size, in world space.
//!
//! Fragments that show are few in many batches, a surface's for example: they are moved together first, so that vectors are full of them.
//!
//! Along an axis the central difference is half of (f one voxel ahead) - (f one voxel behind), both interpolated. Interpolation is linear in
//! the voxels, so that is the same as interpolating between differences taken at the cell's eight corners: 32 voxels, 24 of them beyond the
//! cell. Voxels beyond the volume are those at its edge, as in every lookup.
//!
//! Differences are those of voxels, whatever values are interpolated by; the analytic gradient is that of the interpolation, linear or spline.
//!
//! ```text
//!    seen along z:   . o o .        O: the cell's corners, at z and at z+1; the corners have neighbours at z-1 and z+2 as well
//!                    o O O o        o: their neighbours along x and y
//!                    o O O o
//!                    . o o .
//! ```

use super::Run;
use super::batch::{Batch, GradientBatch, PackedGradients};
use super::cubic::spline_gradient;
use super::fetch::lerp;
use super::frame::Frame;
use super::pair::BEHIND;
use crate::lanes::{BATCH, CellLoad, Kernel, Lanes, Level, Packing, SIDE, convert, for_rows, row, row_mut};
use crate::scene::Gradient;
use crate::volume::packed::PackedPairs;
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
    /// Pixels whose transmittance is below this take nothing more: their fragments need no gradient.
    live: f32,
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
        Self { kind, dims: grid.dims(), matrix, unit: scale.abs() * libm::scalbn(1.0, exponent), live: 0.0 }
    }

    /// For a volume that holds `dims` voxels of the grid.
    pub(crate) fn with_dims(self, dims: [usize; 3]) -> Self {
        Self { dims, ..self }
    }

    /// For pixels that take nothing more at a transmittance below `live`.
    pub(crate) fn with_live(self, live: f32) -> Self {
        Self { live, ..self }
    }

    /// A size in data units per world unit as a number of the batch; within f32.
    pub(crate) fn number(&self, size: f64) -> f32 {
        (size / self.unit).min(1e38) as f32
    }
}

/// The kernel.
pub(super) fn kernel<'v>(level: Level) -> Run<'v> {
    level.kernel::<TakeGradient, _, _>()
}

/// Gradients of the fragments that show.
pub(super) struct TakeGradient;

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

/// Of the four voxels along x from `at` on: twice the central difference, and the value, interpolated.
#[inline(always)]
fn edge<L: Lanes>(v: &[L::F; 32], at: usize, x: L::F) -> (L::F, L::F) {
    let [a, b, c, d] = [v[at], v[at + 1], v[at + 2], v[at + 3]];
    (lerp::<L>(L::sub(c, a), L::sub(d, b), x), lerp::<L>(b, c, x))
}

/// Twice the central difference along each axis, from voxels at [`CROSS`] and a place in the cell.
#[inline(always)]
fn central<L: Lanes>(v: &[L::F; 32], [x, y, z]: [L::F; 3]) -> [L::F; 3] {
    // Interpolated along x: an edge's differences, and its values; two neighbours alone; and those along y as well.
    let [(d00, e00), (d10, e10)] = [edge::<L>(v, 0, x), edge::<L>(v, 4, x)];
    let [(d01, e01), (d11, e11)] = [edge::<L>(v, 8, x), edge::<L>(v, 12, x)];
    let along_x = lerp::<L>(lerp::<L>(d00, d10, y), lerp::<L>(d01, d11, y), z);
    let [before, behind] = [lerp::<L>(v[16], v[17], x), lerp::<L>(v[18], v[19], x)];
    let near = lerp::<L>(L::sub(e10, before), L::sub(behind, e00), y);
    let [before, behind] = [lerp::<L>(v[20], v[21], x), lerp::<L>(v[22], v[23], x)];
    let far = lerp::<L>(L::sub(e11, before), L::sub(behind, e01), y);
    let along_y = lerp::<L>(near, far, z);
    let before = lerp::<L>(lerp::<L>(v[24], v[25], x), lerp::<L>(v[26], v[27], x), y);
    let behind = lerp::<L>(lerp::<L>(v[28], v[29], x), lerp::<L>(v[30], v[31], x), y);
    let (here, next) = (lerp::<L>(e00, e10, y), lerp::<L>(e01, e11, y));
    let along_z = lerp::<L>(L::sub(next, before), L::sub(behind, here), z);
    [along_x, along_y, along_z]
}

/// The derivative of linear interpolation, from voxels at [`CELL`] and a place in the cell.
#[inline(always)]
fn analytic<L: Lanes>(v: &[L::F; 8], [x, y, z]: [L::F; 3]) -> [L::F; 3] {
    [
        bilinear::<L>([L::sub(v[1], v[0]), L::sub(v[3], v[2]), L::sub(v[5], v[4]), L::sub(v[7], v[6])], y, z),
        bilinear::<L>([L::sub(v[2], v[0]), L::sub(v[3], v[1]), L::sub(v[6], v[4]), L::sub(v[7], v[5])], x, z),
        bilinear::<L>([L::sub(v[4], v[0]), L::sub(v[5], v[1]), L::sub(v[6], v[2]), L::sub(v[7], v[3])], x, y),
    ]
}

#[inline(always)]
fn bilinear<L: Lanes>([a, b, c, d]: [L::F; 4], s: L::F, t: L::F) -> L::F {
    lerp::<L>(lerp::<L>(a, b, s), lerp::<L>(c, d, s), t)
}

/// 1 2 1 along a line, at both corners of the cell, interpolated.
#[inline(always)]
fn smooth<L: Lanes>([a, b, c, d]: [L::F; 4], t: L::F) -> L::F {
    let near = L::add(L::add(a, c), L::add(b, b));
    let far = L::add(L::add(b, d), L::add(c, c));
    lerp::<L>(near, far, t)
}

/// -1 0 1 along a line, at both corners of the cell, interpolated.
#[inline(always)]
fn slope<L: Lanes>([a, b, c, d]: [L::F; 4], t: L::F) -> L::F {
    lerp::<L>(L::sub(c, a), L::sub(d, b), t)
}

/// 32 times Sobel's difference along each axis: 1 2 1 along both other axes, -1 0 1 along its own, interpolated; from voxels at [`CUBE`].
#[inline(always)]
fn sobel<L: Lanes>(v: &[L::F; 64], place: [L::F; 3]) -> [L::F; 3] {
    let [x, y, z] = place;
    let zero = L::splat(0.0);
    let (mut dx, mut sx) = ([[zero; 4]; 4], [[zero; 4]; 4]);
    for k in 0..4 {
        for j in 0..4 {
            let at = 16 * k + 4 * j;
            let line = [v[at], v[at + 1], v[at + 2], v[at + 3]];
            dx[k][j] = slope::<L>(line, x);
            sx[k][j] = smooth::<L>(line, x);
        }
    }
    let mut planes = [[zero; 4]; 3];
    for k in 0..4 {
        planes[0][k] = smooth::<L>(dx[k], y);
        planes[1][k] = slope::<L>(sx[k], y);
        planes[2][k] = smooth::<L>(sx[k], y);
    }
    [smooth::<L>(planes[0], z), smooth::<L>(planes[1], z), slope::<L>(planes[2], z)]
}

/// Index of voxel `offset` of the lookups' layout along x, y and z.
#[inline(always)]
pub(crate) fn index_of(offset: usize, strides: [usize; 3]) -> [usize; 3] {
    let (mut rest, mut index) = (offset, [0; 3]);
    // An offset below a layer's stride lies in the first layer, and so on; axes of one voxel have a stride of 0.
    for axis in [2, 1] {
        // Numbers of 32 bits divide several times as fast.
        let along = match (u32::try_from(rest), u32::try_from(strides[axis])) {
            (Ok(rest), Ok(stride)) => rest.checked_div(stride).map(|n| n as usize),
            _ => rest.checked_div(strides[axis]),
        };
        if let Some(along) = along {
            index[axis] = along;
            rest -= along * strides[axis];
        }
    }
    // Neighbours along x lie side by side.
    index[0] = if strides[0] == 0 { 0 } else { rest };
    index
}

/// Fragments whose gradients are taken: where their cells' lowest corners lie, and where they lie in them.
#[derive(Clone, Copy)]
pub(super) struct At<'b> {
    /// Where offsets count from, and the distances to neighbours.
    pub(super) cells: &'b CellLoad,
    /// Offsets from there; and those of batches that span more voxels than these count.
    pub(super) offset: &'b [i32; BATCH],
    pub(super) far_offset: &'b [u64; BATCH],
    pub(super) weight: &'b [[f32; BATCH]; 3],
}

impl At<'_> {
    /// Positions of row `r` in its cells along x, y and z.
    #[inline(always)]
    pub(super) fn weights<L: Lanes>(&self, r: usize) -> [L::F; 3] {
        let [x, y, z] = self.weight;
        [L::load(row(x, r)), L::load(row(y, r)), L::load(row(z, r))]
    }
}

/// The voxels at `steps` from the cells of row `r`, one by one, those beyond the volume taken from its edge. Not inlined: it would not become
/// faster, and every kernel larger.
#[inline(never)]
fn gather<const N: usize>(frame: &Frame<'_>, dims: [usize; 3], of: At<'_>, r: usize, steps: &[[i8; 3]; N]) -> [[f32; SIDE]; N] {
    let sample = &frame.sample;
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut found = [[0.0f32; SIDE]; N];
    with_slices!(sample.voxels, v => {
        for i in 0..SIDE {
            let at = SIDE * r + i;
            let offset = if sample.far { of.far_offset[at] as usize } else { of.offset[at] as usize };
            let cell = index_of(of.cells.base + offset, sample.strides);
            // Voxels before, at, and one and two behind the cell's lowest corner, along each axis, within the volume.
            let mut near = [[0; 4]; 3];
            for axis in 0..3 {
                let (c, last) = (cell[axis], dims[axis] - 1);
                for (near, n) in near[axis].iter_mut().zip([c.saturating_sub(1), c, (c + 1).min(last), (c + 2).min(last)]) {
                    *near = n * strides[axis];
                }
            }
            for (found, &[x, y, z]) in found.iter_mut().zip(steps) {
                found[i] = convert(v[near[0][(x + 1) as usize] + near[1][(y + 1) as usize] + near[2][(z + 1) as usize]], sample.to_f32);
            }
        }
    });
    found
}

/// As vectors.
#[inline(always)]
fn loaded<L: Lanes, const N: usize>(found: &[[f32; SIDE]; N]) -> [L::F; N] {
    let mut voxels = [L::splat(0.0); N];
    for (to, from) in voxels.iter_mut().zip(found) {
        *to = L::load(from);
    }
    voxels
}

/// [`CROSS`] from packed voxels of 8 bits.
#[inline(always)]
fn cross8<L: Lanes, const SIGNED: bool>(packed: &[u16], of: At<'_>, r: usize) -> [L::F; 32] {
    let q = of.cells.around8::<L>(packed, of.offset, r);
    // Bytes of a vector: (x,y), (x,y+1), (x+1,y), (x+1,y+1).
    macro_rules! byte {
        ($at:literal, $n:literal) => {
            super::fetch::byte::<L, SIGNED, $n>(q[$at])
        };
    }
    #[rustfmt::skip]
    let voxels = [
        byte!(0, 0), byte!(0, 2), byte!(1, 0), byte!(1, 2), byte!(0, 1), byte!(0, 3), byte!(1, 1), byte!(1, 3),
        byte!(2, 0), byte!(2, 2), byte!(3, 0), byte!(3, 2), byte!(2, 1), byte!(2, 3), byte!(3, 1), byte!(3, 3),
        byte!(4, 0), byte!(4, 2), byte!(5, 1), byte!(5, 3), byte!(6, 0), byte!(6, 2), byte!(7, 1), byte!(7, 3),
        byte!(8, 0), byte!(8, 2), byte!(8, 1), byte!(8, 3), byte!(9, 0), byte!(9, 2), byte!(9, 1), byte!(9, 3),
    ];
    voxels
}

/// The low half of each number, with or without sign.
#[inline(always)]
fn low<L: Lanes, const SIGNED: bool>(pair: L::I) -> L::F {
    if SIGNED { L::to_f(L::sar::<16>(L::shl::<16>(pair))) } else { L::to_f(L::and_i(pair, L::splat_i(0xffff))) }
}

/// The high half.
#[inline(always)]
fn high<L: Lanes, const SIGNED: bool>(pair: L::I) -> L::F {
    if SIGNED { L::to_f(L::sar::<16>(pair)) } else { L::to_f(L::and_i(L::sar::<16>(pair), L::splat_i(0xffff))) }
}

/// [`CROSS`] from packed voxels of 16 bits.
#[inline(always)]
fn cross16<L: Lanes, const SIGNED: bool>(packed: &[u32], of: At<'_>, r: usize) -> [L::F; 32] {
    let q = of.cells.around16::<L>(packed, of.offset, r);
    // Halves of a vector: y, y+1.
    macro_rules! low {
        ($at:literal) => {
            low::<L, SIGNED>(q[$at])
        };
    }
    macro_rules! high {
        ($at:literal) => {
            high::<L, SIGNED>(q[$at])
        };
    }
    #[rustfmt::skip]
    let voxels = [
        low!(0), low!(1), low!(2), low!(3), high!(0), high!(1), high!(2), high!(3),
        low!(4), low!(5), low!(6), low!(7), high!(4), high!(5), high!(6), high!(7),
        low!(8), low!(9), high!(10), high!(11), low!(12), low!(13), high!(14), high!(15),
        low!(16), low!(17), high!(16), high!(17), low!(18), low!(19), high!(18), high!(19),
    ];
    voxels
}

/// Whether every cell of the batch has a voxel before it and two behind its lowest corner, along every axis.
fn is_deep(frame: &Frame<'_>, dims: [usize; 3], batch: &Batch) -> bool {
    // Fragments behind the last slices have depths of their own: they lie anywhere.
    if frame.sample.far || batch.slice == BEHIND {
        return false;
    }
    let g = &batch.geometry;
    let base = index_of(g.cells.base, frame.sample.strides);
    (0..3).all(|axis| {
        let far = (SIDE - 1) as f32;
        let most = g.origin[axis] + far * (g.across[axis].max(0.0) + g.down[axis].max(0.0));
        // Well inside: f32 coordinates are off by less.
        base[axis] >= 1 && f64::from(most) + 1e-3 + (base[axis] as f64) < dims[axis] as f64 - 2.0
    })
}

/// |x|
#[inline(always)]
fn abs<L: Lanes>(x: L::F) -> L::F {
    L::max(x, L::sub(L::splat(0.0), x))
}

/// A row of a matrix times a vector.
#[inline(always)]
pub(super) fn weighted<L: Lanes>(m: &[f32; 3], v: [L::F; 3]) -> L::F {
    L::add(L::add(L::mul(L::splat(m[0]), v[0]), L::mul(L::splat(m[1]), v[1])), L::mul(L::splat(m[2]), v[2]))
}

/// Gradients beyond this, or below its inverse, are scaled before they are squared: 2^40.
const LARGE: f32 = 1_099_511_627_776.0;
/// By this: 2^80.
const RESCALE: f32 = 1.208_925_8e24;

/// Sets normals and sizes of row `r` from its gradients in world space.
#[inline(always)]
fn finish<L: Lanes>(normal: &mut [[f32; BATCH]; 3], size: &mut [f32; BATCH], r: usize) {
    let [x, y, z] = &*normal;
    let world = [L::load(row(x, r)), L::load(row(y, r)), L::load(row(z, r))];
    let [x, y, z] = [abs::<L>(world[0]), abs::<L>(world[1]), abs::<L>(world[2])];
    let (sum, most) = (L::add(L::add(x, y), z), L::max(L::max(x, y), z));
    // The sum is NaN or infinite where any part is. What is below the smallest normal number counts as none.
    let there = L::and(L::le(L::splat(f32::MIN_POSITIVE), most), L::le(sum, L::splat(f32::MAX)));
    // Squares of very large and very small numbers would leave f32.
    let (large, small) = (L::lt(L::splat(LARGE), most), L::lt(most, L::splat(1.0 / LARGE)));
    let scale = L::select(large, L::splat(1.0 / RESCALE), L::select(small, L::splat(RESCALE), L::splat(1.0)));
    let back = L::select(large, L::splat(RESCALE), L::select(small, L::splat(1.0 / RESCALE), L::splat(1.0)));
    let [x, y, z] = [L::mul(world[0], scale), L::mul(world[1], scale), L::mul(world[2], scale)];
    let length = L::sqrt(L::add(L::add(L::mul(x, x), L::mul(y, y)), L::mul(z, z)));
    let per = L::div(L::splat(-1.0), L::select(there, length, L::splat(1.0)));
    let [nx, ny, nz] = normal;
    L::store(L::keep(there, L::mul(x, per)), row_mut(nx, r));
    L::store(L::keep(there, L::mul(y, per)), row_mut(ny, r));
    L::store(L::keep(there, L::mul(z, per)), row_mut(nz, r));
    let length = L::min(L::mul(length, back), L::splat(f32::MAX));
    L::store(L::keep(there, length), row_mut(size, r));
}

/// A way to differences along the voxel axes. (A trait and no closures: those are not inlined into the vector level's copy of a kernel.)
trait Differences {
    fn along<L: Lanes>(&self, frame: &Frame<'_>, dims: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3];
}

/// Central differences of packed voxels, away from the volume's border.
struct Central8<'v, const SIGNED: bool>(&'v [u16]);
struct Central16<'v, const SIGNED: bool>(&'v [u32]);
/// Differences of voxels that are loaded one by one.
struct CentralEach;
struct AnalyticEach;
struct SobelEach;
/// The slope of the spline.
struct Spline;

impl<const SIGNED: bool> Differences for Central8<'_, SIGNED> {
    #[inline(always)]
    fn along<L: Lanes>(&self, _: &Frame<'_>, _: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        central::<L>(&cross8::<L, SIGNED>(self.0, of, r), of.weights::<L>(r))
    }
}

impl<const SIGNED: bool> Differences for Central16<'_, SIGNED> {
    #[inline(always)]
    fn along<L: Lanes>(&self, _: &Frame<'_>, _: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        central::<L>(&cross16::<L, SIGNED>(self.0, of, r), of.weights::<L>(r))
    }
}

impl Differences for CentralEach {
    #[inline(always)]
    fn along<L: Lanes>(&self, frame: &Frame<'_>, dims: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        central::<L>(&loaded::<L, 32>(&gather::<32>(frame, dims, of, r, &CROSS)), of.weights::<L>(r))
    }
}

impl Differences for AnalyticEach {
    #[inline(always)]
    fn along<L: Lanes>(&self, frame: &Frame<'_>, dims: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        analytic::<L>(&loaded::<L, 8>(&gather::<8>(frame, dims, of, r, &CELL)), of.weights::<L>(r))
    }
}

impl Differences for SobelEach {
    #[inline(always)]
    fn along<L: Lanes>(&self, frame: &Frame<'_>, dims: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        sobel::<L>(&loaded::<L, 64>(&gather::<64>(frame, dims, of, r, &CUBE)), of.weights::<L>(r))
    }
}

impl Differences for Spline {
    #[inline(always)]
    fn along<L: Lanes>(&self, frame: &Frame<'_>, _: [usize; 3], of: At<'_>, r: usize) -> [L::F; 3] {
        if frame.sample.far { spline_gradient::<L, true>(frame, of, r) } else { spline_gradient::<L, false>(frame, of, r) }
    }
}

/// Gradients of every row of `rows` in world space, kept where their normals come to lie.
#[inline(always)]
fn each_row<L: Lanes>(
    (frame, gradient): (&Frame<'_>, &GradientFrame),
    of: At<'_>,
    rows: u8,
    differences: &impl Differences,
    normal: &mut [[f32; BATCH]; 3],
) {
    for_rows!(rows, r => {
        let along = differences.along::<L>(frame, gradient.dims, of, r);
        for (m, to) in gradient.matrix.iter().zip(&mut *normal) {
            L::store(weighted::<L>(m, along), row_mut(to, r));
        }
    });
}

/// Fragments of a batch whose gradient changes what is seen: covered, with an opacity, of pixels that still take light.
#[inline(always)]
fn visible<L: Lanes>(gradient: &GradientFrame, batch: &Batch) -> u64 {
    let (zero, live) = (L::splat(0.0), L::splat(gradient.live));
    let mut lanes = 0;
    for_rows!(batch.shown, r => {
        let shows = L::lt(zero, L::load(row(&batch.slab.alpha, r)));
        let takes = L::le(live, L::load(row(&batch.pixels.transmittance, r)));
        lanes |= u64::from(L::bits(L::and(shows, takes))) << (8 * r);
    });
    lanes & batch.mask
}

impl<'v> Kernel<Frame<'v>, Batch> for TakeGradient {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(gradient) = &frame.optional.gradient else { return };
        let lanes = visible::<L>(gradient, batch);
        let deep = lanes != 0 && is_deep(frame, gradient.dims, batch);
        let Some(found) = batch.gradient.as_deref_mut() else { return };
        found.lanes = lanes;
        if lanes == 0 {
            return;
        }
        let packing = Packing::new(lanes);
        let (sample, rare) = (&batch.sample, &batch.rare);
        let GradientBatch { taken, packed, .. } = &mut *found;
        let PackedGradients { offset, far_offset, weight, normal, size } = packed;
        *taken += packing.count();
        {
            let ([x, y, z], [to_x, to_y, to_z]) = (&sample.weight, &mut *weight);
            let bits = bytemuck::cast_mut::<[f32; BATCH], [i32; BATCH]>;
            let from = [&sample.offset, bytemuck::cast_ref(x), bytemuck::cast_ref(y), bytemuck::cast_ref(z)];
            packing.pack::<L, 4>(from, [&mut *offset, bits(to_x), bits(to_y), bits(to_z)]);
        }
        if frame.sample.far {
            let listed = (0..BATCH).filter(|i| lanes >> i & 1 == 1);
            // What is behind them in their last row is looked up too: one of them, and no offset of an earlier batch.
            far_offset.fill(rare.far_offset[lanes.trailing_zeros() as usize]);
            far_offset.iter_mut().zip(listed).for_each(|(to, i)| *to = rare.far_offset[i]);
        }
        let of = At { cells: &batch.geometry.cells, offset, far_offset, weight };
        let (rows, both) = (packing.packed_rows(), (frame, gradient));
        match gradient.kind {
            Gradient::Analytic if frame.sample.coefficients.is_some() => each_row::<L>(both, of, rows, &Spline, normal),
            Gradient::Analytic => each_row::<L>(both, of, rows, &AnalyticEach, normal),
            Gradient::Sobel => each_row::<L>(both, of, rows, &SobelEach, normal),
            Gradient::Central => {
                let signed = matches!(frame.sample.voxels, VoxelSlices::I8(_) | VoxelSlices::I16(_));
                match frame.sample.packed.filter(|_| deep).map(|p| &p.pairs) {
                    Some(PackedPairs::Of8(v)) if signed => each_row::<L>(both, of, rows, &Central8::<true>(v), normal),
                    Some(PackedPairs::Of8(v)) => each_row::<L>(both, of, rows, &Central8::<false>(v), normal),
                    Some(PackedPairs::Of16(v)) if signed => each_row::<L>(both, of, rows, &Central16::<true>(v), normal),
                    Some(PackedPairs::Of16(v)) => each_row::<L>(both, of, rows, &Central16::<false>(v), normal),
                    None => each_row::<L>(both, of, rows, &CentralEach, normal),
                }
            }
        }
        // In a loop of its own: roots and quotients of several rows are under way at a time.
        for_rows!(rows, r => {
            finish::<L>(normal, size, r);
        });
        let GradientBatch { normal: [x, y, z], size, packed, .. } = found;
        let [from_x, from_y, from_z] = &packed.normal;
        packing.unpack::<L, 4>([from_x, from_y, from_z, &packed.size], [x, y, z, size]);
    }
}
