//! Range of values in bricks of 4 x 4 x 4 cells: where nothing in the range shows, a renderer passes over the brick.

use super::Grid;
use super::voxels::{Voxel, VoxelType, Voxels, with_voxels};
use glam::DVec3;
use rayon::prelude::*;

/// Cells along a brick's side. With twice as many a fifth more batches have to be looked at.
pub(crate) const BRICK: usize = 4;

/// Voxels along a brick's side: the corners of its cells.
const CORNERS: usize = BRICK + 1;

/// Smallest and largest stored value of every brick, voxels that are NaN or infinite left out.
///
/// Brick (i,j,k) holds cells 4i .. 4i+3, that is voxels 4i .. 4i+4, along each axis; trilinear lookups inside it stay in its range.
#[derive(Debug, Clone)]
pub(crate) struct Bricks {
    /// Bricks along x, y, z.
    pub(crate) dims: [usize; 3],
    /// (smallest, largest) stored value, rounded outwards; (inf, -inf) where no voxel is finite.
    pub(crate) ranges: Vec<(f32, f32)>,
    /// (smallest, largest) stored value of all; (inf, -inf) where no voxel is finite.
    pub(crate) range: (f64, f64),
    /// Voxels that are NaN or infinite.
    pub(crate) non_finite: usize,
}

impl Bricks {
    /// The corners, in the world, of what lookups in brick `at` of a volume on `grid` reach: to the box's faces at its border.
    pub(crate) fn corners(&self, at: usize, grid: &Grid) -> [DVec3; 8] {
        let [nx, ny, _] = self.dims;
        let (first, last) = grid.index_bounds();
        let place = [at % nx, at / nx % ny, at / (nx * ny)];
        let ends: [[f64; 2]; 3] = std::array::from_fn(|axis| {
            let (n, count) = (place[axis], self.dims[axis]);
            let low = if n == 0 { first[axis] } else { (n * BRICK) as f64 };
            [low, if n + 1 == count { last[axis] } else { ((n + 1) * BRICK) as f64 }]
        });
        std::array::from_fn(|c| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| ends[axis][c >> axis & 1]);
            grid.index_to_world().transform_point3(DVec3::new(x, y, z))
        })
    }

    /// The bricks of `voxels` on a grid of `dims`.
    pub(crate) fn new(voxels: &Voxels, dims: [usize; 3]) -> Self {
        with_voxels!(voxels, v => build(v, dims))
    }
}

/// Bricks that n voxels make: one for each 4 cells begun, and at least one.
pub(super) fn count(n: usize) -> usize {
    n.saturating_sub(1).div_ceil(BRICK).max(1)
}

/// Smallest and largest of some voxels.
#[derive(Clone, Copy)]
struct Range<T>(T, T);

impl<T: Voxel> Range<T> {
    /// The range of no voxels: largest number first. For integers their ends, for floats the infinities.
    fn none() -> Self {
        Self(T::from_f64(f64::INFINITY), T::from_f64(f64::NEG_INFINITY))
    }

    /// In f32, rounded outwards where f32 does not hold every number of the type.
    #[inline(always)]
    fn outwards(self) -> (f32, f32) {
        match T::TYPE {
            VoxelType::U32 | VoxelType::I32 | VoxelType::F64 => (below(self.0.to_f64()), above(self.1.to_f64())),
            _ => (self.0.to_f32(), self.1.to_f32()),
        }
    }

    #[inline(always)]
    fn with(self, other: Self) -> Self {
        Self(if other.0 < self.0 { other.0 } else { self.0 }, if other.1 > self.1 { other.1 } else { self.1 })
    }
}

/// What the voxels of a layer of bricks are: their range, and how many of them are NaN or infinite.
type Layer<T> = (Range<T>, usize);

fn build<T: Voxel>(voxels: &[T], [nx, ny, nz]: [usize; 3]) -> Bricks {
    let dims = [count(nx), count(ny), count(nz)];
    let mut ranges = vec![(f32::INFINITY, f32::NEG_INFINITY); dims.iter().product()];
    let none = Range::<T>::none();
    let layers: Vec<Layer<T>> = ranges
        .par_chunks_mut(dims[0] * dims[1])
        .enumerate()
        .map_init(
            || [vec![none.0; nx], vec![none.1; nx]],
            |[low, high], (bz, ranges)| {
                let (mut all, mut non_finite) = (none, 0);
                for (by, ranges) in ranges.chunks_exact_mut(dims[0]).enumerate() {
                    // Across all rows of these bricks first, voxel by voxel; along each row once, at the end.
                    low.fill(none.0);
                    high.fill(none.1);
                    for z in bz * BRICK..(bz * BRICK + CORNERS).min(nz) {
                        let (first, end) = (by * BRICK, (by * BRICK + CORNERS).min(ny));
                        let rows = &voxels[(z * ny + first) * nx..(z * ny + end) * nx];
                        add_rows(low, high, rows, none);
                        // The upper layer and row of voxels are shared with the next brick: count them there.
                        if T::FLOAT && (z < bz * BRICK + BRICK || bz + 1 == dims[2]) {
                            let own = if by + 1 == dims[1] { end } else { first + BRICK };
                            non_finite += rows[..(own - first) * nx].chunks_exact(nx).map(count_non_finite).sum::<usize>();
                        }
                    }
                    for (bx, range) in ranges.iter_mut().enumerate() {
                        let found = match (low[bx * BRICK..].first_chunk::<CORNERS>(), high[bx * BRICK..].first_chunk::<CORNERS>()) {
                            (Some(low), Some(high)) => Range(least(low), greatest::<T>(high)),
                            _ => Range(least(&low[bx * BRICK..]), greatest(&high[bx * BRICK..])),
                        };
                        all = all.with(found);
                        if found.0 <= found.1 {
                            *range = found.outwards();
                        }
                    }
                }
                (all, non_finite)
            },
        )
        .collect();
    let non_finite = layers.iter().map(|l| l.1).sum();
    let range = layers.iter().fold(none, |range: Range<T>, layer| range.with(layer.0));
    let range = if range.0 > range.1 { (f64::INFINITY, f64::NEG_INFINITY) } else { (range.0.to_f64(), range.1.to_f64()) };
    Bricks { dims, ranges, range, non_finite }
}

/// The least of some numbers, at least one.
#[inline(always)]
fn least<T: Voxel>(values: &[T]) -> T {
    values.iter().fold(values[0], |a, &b| if b < a { b } else { a })
}

/// The greatest of some numbers, at least one.
#[inline(always)]
fn greatest<T: Voxel>(values: &[T]) -> T {
    values.iter().fold(values[0], |a, &b| if b > a { b } else { a })
}

fn count_non_finite<T: Voxel>(row: &[T]) -> usize {
    // 32 bits are as wide as f32: the sum stays in vectors.
    row.chunks(1 << 16).map(|part| part.iter().map(|v| u32::from(!v.is_finite())).sum::<u32>() as usize).sum()
}

/// Widens the range of every column, `low` to `high`, by up to five rows of voxels, each as long as `low`.
///
/// Plain loops without a branch: the compiler turns them into the least and greatest of whole vectors.
fn add_rows<T: Voxel>(low: &mut [T], high: &mut [T], rows: &[T], none: Range<T>) {
    let n = low.len();
    let high = &mut high[..n];
    let widen = |low: &mut T, high: &mut T, v: T| {
        let (down, up) = if T::FLOAT && !v.is_finite() { (none.0, none.1) } else { (v, v) };
        *low = if down < *low { down } else { *low };
        *high = if up > *high { up } else { *high };
    };
    if rows.len() == CORNERS * n {
        let (a, rest) = rows.split_at(n);
        let (b, rest) = rest.split_at(n);
        let (c, rest) = rest.split_at(n);
        let (d, e) = rest.split_at(n);
        let e = &e[..n];
        for x in 0..n {
            let (mut lo, mut hi) = (low[x], high[x]);
            for v in [a[x], b[x], c[x], d[x], e[x]] {
                widen(&mut lo, &mut hi, v);
            }
            (low[x], high[x]) = (lo, hi);
        }
        return;
    }
    for row in rows.chunks_exact(n) {
        for x in 0..n {
            widen(&mut low[x], &mut high[x], row[x]);
        }
    }
}

/// The largest f32 that is not above x.
pub(crate) fn below(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) <= x { near } else { -next_above(-near) }
}

/// The smallest f32 that is not below x.
pub(crate) fn above(x: f64) -> f32 {
    -below(-x)
}

/// The next f32 above x, where x is neither NaN nor positive infinity.
fn next_above(x: f32) -> f32 {
    match x.to_bits() {
        // 0 and -0.
        0 | 0x8000_0000 => f32::from_bits(1),
        bits if x > 0.0 => f32::from_bits(bits + 1),
        bits => f32::from_bits(bits - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_lies_in_the_range_of_its_brick() {
        let dims = [17, 9, 10];
        let values: Vec<f32> = (0..dims.iter().product()).map(|i: usize| ((i * 2_654_435_761) % 1000) as f32).collect();
        let bricks = Bricks::new(&Voxels::F32(values.clone().into()), dims);
        assert_eq!(bricks.dims, [4, 2, 3]);
        for z in 0..dims[2] - 1 {
            for y in 0..dims[1] - 1 {
                for x in 0..dims[0] - 1 {
                    let (lo, hi) = bricks.ranges[(z / 4 * bricks.dims[1] + y / 4) * bricks.dims[0] + x / 4];
                    for c in 0..8 {
                        let v = f64::from(values[((z + (c >> 2)) * dims[1] + y + (c >> 1 & 1)) * dims[0] + x + (c & 1)]);
                        assert!(f64::from(lo) <= v && v <= f64::from(hi));
                    }
                }
            }
        }
    }

    #[test]
    fn numbers_that_are_none_are_counted_once_and_left_out() {
        let mut values = vec![1.0f64; 9 * 9 * 17];
        values[9 * 9 * 8 + 9 * 8 + 8] = f64::NAN;
        values[0] = f64::INFINITY;
        let bricks = Bricks::new(&Voxels::F64(values.into()), [9, 9, 17]);
        assert_eq!(bricks.non_finite, 2);
        assert_eq!(bricks.range, (1.0, 1.0));
    }

    #[test]
    fn ranges_are_those_of_each_voxel_looked_at_alone() {
        fn check<T: Voxel>(dims: [usize; 3], value: impl Fn(usize) -> f64) {
            let [nx, ny, nz] = dims;
            let values: Vec<T> = (0..nx * ny * nz).map(|i| T::from_f64(value(i))).collect();
            let bricks = Bricks::new(&values.clone().into(), dims);
            let reach = |b: usize, n: usize| b * BRICK..(b * BRICK + CORNERS).min(n);
            for (b, &range) in bricks.ranges.iter().enumerate() {
                let at = [b % bricks.dims[0], b / bricks.dims[0] % bricks.dims[1], b / bricks.dims[0] / bricks.dims[1]];
                let mut want = (f64::INFINITY, f64::NEG_INFINITY);
                for z in reach(at[2], nz) {
                    for y in reach(at[1], ny) {
                        for v in reach(at[0], nx).map(|x| values[(z * ny + y) * nx + x].to_f64()).filter(|v| v.is_finite()) {
                            want = (want.0.min(v), want.1.max(v));
                        }
                    }
                }
                let want = if want.0 > want.1 { (f32::INFINITY, f32::NEG_INFINITY) } else { (below(want.0), above(want.1)) };
                assert_eq!(range, want, "{} {dims:?} brick {at:?}", T::TYPE);
            }
            assert_eq!(bricks.non_finite, values.iter().filter(|v| !v.to_f64().is_finite()).count(), "{} {dims:?}", T::TYPE);
        }
        for dims in [[1, 1, 1], [2, 5, 9], [37, 6, 5], [5, 13, 21], [70, 1, 4]] {
            let number = |i: usize| (i.wrapping_mul(2_654_435_761) >> 7) as f64 % 70_000.0 - 35_000.0;
            let odd = |i: usize| [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].get(i * 7919 % 23).copied().unwrap_or(number(i) * 1e3);
            check::<u8>(dims, number);
            check::<i8>(dims, number);
            check::<u16>(dims, number);
            check::<i16>(dims, number);
            check::<u32>(dims, number);
            check::<i32>(dims, number);
            check::<f32>(dims, odd);
            check::<f64>(dims, odd);
            check::<f32>(dims, |_| f64::NAN);
        }
    }

    #[test]
    fn ranges_round_outwards() {
        for x in [0.0, 1.0, -1.0, 0.1, -0.1, 1e-46, -1e-46, 16_777_217.0, -16_777_217.0, 1e300, -1e300, f64::from(f32::MAX)] {
            let (lo, hi) = (below(x), above(x));
            assert!(f64::from(lo) <= x && x <= f64::from(hi), "{x}: {lo} {hi}");
            assert!(lo == hi || f64::from(next_above(lo)) >= x, "{x}: {lo} is not the nearest");
            assert_eq!(lo == hi, f64::from(x as f32) == x, "{x}");
        }
    }
}
