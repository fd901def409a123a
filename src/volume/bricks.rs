//! Range of values in bricks of 8 x 8 x 8 cells: what lets empty space cost next to nothing.

use super::voxels::{Voxel, Voxels, with_voxels};
use rayon::prelude::*;

/// Cells along a brick's side.
pub(crate) const BRICK: usize = 8;

/// Smallest and largest stored value of every brick, non-finite voxels left out.
///
/// Brick (i,j,k) holds cells 8i .. 8i+7, that is voxels 8i .. 8i+8, along each axis; trilinear lookups inside it stay in its range.
#[derive(Debug, Clone)]
pub(crate) struct Bricks {
    /// Bricks along x, y, z.
    pub(crate) dims: [usize; 3],
    /// (smallest, largest) stored value; (inf, -inf) where no voxel is finite.
    pub(crate) ranges: Vec<(f64, f64)>,
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

/// Bricks that n voxels make: one for each 8 cells begun, and at least one.
fn count(n: usize) -> usize {
    n.saturating_sub(1).div_ceil(BRICK).max(1)
}

fn build<T: Voxel>(voxels: &[T], [nx, ny, nz]: [usize; 3]) -> Bricks {
    let dims = [count(nx), count(ny), count(nz)];
    let layers: Vec<(Vec<(f64, f64)>, usize)> = (0..dims[2])
        .into_par_iter()
        .map(|bz| {
            let mut ranges: Vec<Option<(T, T)>> = vec![None; dims[0] * dims[1]];
            let mut non_finite = 0;
            let z_end = (bz * BRICK + BRICK + 1).min(nz);
            for z in bz * BRICK..z_end {
                // The upper layer of voxels is shared with the next brick: count it there.
                let counted = z < bz * BRICK + BRICK || bz + 1 == dims[2];
                for by in 0..dims[1] {
                    for y in by * BRICK..(by * BRICK + BRICK + 1).min(ny) {
                        let row = &voxels[(z * ny + y) * nx..][..nx];
                        if T::FLOAT && counted && (y < by * BRICK + BRICK || by + 1 == dims[1]) {
                            non_finite += row.iter().filter(|v| !v.to_f64().is_finite()).count();
                        }
                        for (bx, range) in ranges[by * dims[0]..][..dims[0]].iter_mut().enumerate() {
                            for &v in &row[bx * BRICK..(bx * BRICK + BRICK + 1).min(nx)] {
                                if T::FLOAT && !v.to_f64().is_finite() {
                                    continue;
                                }
                                let (lo, hi) = range.get_or_insert((v, v));
                                if v < *lo {
                                    *lo = v;
                                }
                                if v > *hi {
                                    *hi = v;
                                }
                            }
                        }
                    }
                }
            }
            let ranges = ranges.iter().map(|r| r.map_or((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi)| (lo.to_f64(), hi.to_f64())));
            (ranges.collect(), non_finite)
        })
        .collect();
    let non_finite = layers.iter().map(|l| l.1).sum();
    let ranges: Vec<(f64, f64)> = layers.into_iter().flat_map(|l| l.0).collect();
    let range = ranges.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), r| (lo.min(r.0), hi.max(r.1)));
    Bricks { dims, ranges, range, non_finite }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_lies_in_the_range_of_its_brick() {
        let dims = [17, 9, 10];
        let values: Vec<f32> = (0..dims.iter().product()).map(|i: usize| ((i * 2_654_435_761) % 1000) as f32).collect();
        let bricks = Bricks::new(&Voxels::F32(values.clone()), dims);
        assert_eq!(bricks.dims, [2, 1, 2]);
        for z in 0..dims[2] - 1 {
            for y in 0..dims[1] - 1 {
                for x in 0..dims[0] - 1 {
                    let (lo, hi) = bricks.ranges[(z / 8 * bricks.dims[1] + y / 8) * bricks.dims[0] + x / 8];
                    for c in 0..8 {
                        let v = f64::from(values[((z + (c >> 2)) * dims[1] + y + (c >> 1 & 1)) * dims[0] + x + (c & 1)]);
                        assert!(lo <= v && v <= hi);
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
}
