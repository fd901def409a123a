//! Range of values in bricks of 4 x 4 x 4 cells: what lets empty space cost next to nothing.

use super::voxels::{Voxel, Voxels, with_voxels};
use rayon::prelude::*;

/// Cells along a brick's side. Of twice this a fifth more batches have to be looked at.
pub(crate) const BRICK: usize = 4;

/// Smallest and largest stored value of every brick, non-finite voxels left out.
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
    /// The bricks of `voxels` on a grid of `dims`.
    pub(crate) fn new(voxels: &Voxels, dims: [usize; 3]) -> Self {
        with_voxels!(voxels, v => build(v, dims))
    }
}

/// Bricks that n voxels make: one for each 4 cells begun, and at least one.
fn count(n: usize) -> usize {
    n.saturating_sub(1).div_ceil(BRICK).max(1)
}

/// Smallest and largest of some voxels.
#[derive(Clone, Copy)]
struct Range<T>(T, T);

impl<T: Voxel> Range<T> {
    fn none() -> Self {
        Self(T::from_f64(f64::INFINITY), T::from_f64(f64::NEG_INFINITY))
    }

    /// The range of this one's voxels and `v`, unless that is NaN or infinite.
    #[inline(always)]
    fn with(self, v: T) -> Self {
        let counts = !T::FLOAT || v.to_f64().is_finite();
        Self(if counts && v < self.0 { v } else { self.0 }, if counts && v > self.1 { v } else { self.1 })
    }
}

/// A layer of bricks: ranges of each, voxels that are NaN or infinite.
type Layer<T> = (Vec<Range<T>>, usize);

fn build<T: Voxel>(voxels: &[T], [nx, ny, nz]: [usize; 3]) -> Bricks {
    let dims = [count(nx), count(ny), count(nz)];
    let layers: Vec<Layer<T>> = (0..dims[2])
        .into_par_iter()
        .map(|bz| {
            let mut ranges = vec![Range::none(); dims[0] * dims[1]];
            let mut non_finite = 0;
            for z in bz * BRICK..(bz * BRICK + BRICK + 1).min(nz) {
                // The upper layer of voxels is shared with the next brick: count it there.
                let counted = z < bz * BRICK + BRICK || bz + 1 == dims[2];
                for by in 0..dims[1] {
                    for y in by * BRICK..(by * BRICK + BRICK + 1).min(ny) {
                        let row = &voxels[(z * ny + y) * nx..][..nx];
                        if T::FLOAT && counted && (y < by * BRICK + BRICK || by + 1 == dims[1]) {
                            non_finite += row.iter().filter(|v| !v.to_f64().is_finite()).count();
                        }
                        add_row(&mut ranges[by * dims[0]..][..dims[0]], row);
                    }
                }
            }
            (ranges, non_finite)
        })
        .collect();
    let non_finite = layers.iter().map(|l| l.1).sum();
    let all = layers.iter().flat_map(|l| &l.0);
    let range = all.clone().fold(Range::none(), |range: Range<T>, r| range.with(r.0).with(r.1));
    let range = if range.0 > range.1 { (f64::INFINITY, f64::NEG_INFINITY) } else { (range.0.to_f64(), range.1.to_f64()) };
    let rounded = |r: &Range<T>| if r.0 > r.1 { (f32::INFINITY, f32::NEG_INFINITY) } else { (below(r.0.to_f64()), above(r.1.to_f64())) };
    Bricks { dims, ranges: all.map(rounded).collect(), range, non_finite }
}

/// Adds a row of voxels to the ranges of a row of bricks.
fn add_row<T: Voxel>(ranges: &mut [Range<T>], row: &[T]) {
    // Whole bricks first, whose number of voxels the compiler knows.
    let whole = ranges.len().min(row.len().saturating_sub(1) / BRICK);
    let (full, rest) = ranges.split_at_mut(whole);
    for (bx, range) in full.iter_mut().enumerate() {
        if let Some(voxels) = row[bx * BRICK..].first_chunk::<{ BRICK + 1 }>() {
            *range = voxels.iter().fold(*range, |range, &v| range.with(v));
        }
    }
    for (i, range) in rest.iter_mut().enumerate() {
        *range = row[(whole + i) * BRICK..].iter().fold(*range, |range, &v| range.with(v));
    }
}

/// The largest f32 that is not above x.
fn below(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) <= x { near } else { -next_above(-near) }
}

/// The smallest f32 that is not below x.
fn above(x: f64) -> f32 {
    -below(-x)
}

/// The next f32 above x, where x is no NaN and not the largest infinity.
fn next_above(x: f32) -> f32 {
    match x.to_bits() {
        // Both zeros.
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
        let bricks = Bricks::new(&Voxels::F32(values.clone()), dims);
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
        let bricks = Bricks::new(&Voxels::F64(values), [9, 9, 17]);
        assert_eq!(bricks.non_finite, 2);
        assert_eq!(bricks.range, (1.0, 1.0));
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
