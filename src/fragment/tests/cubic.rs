//! Twins of the lookup in a spline, and of its gradient: plain sums over 64 coefficients.

use super::fetch::{place, weight};
use super::*;
use crate::fragment::cubic::spline_gradient;
use crate::fragment::gradient::At;
use crate::lanes::{CellLoad, Lanes, for_rows, row_mut};
use crate::volume::spline::Coefficients;

/// Grids to look up in, with axes of one voxel and of two; rows of the last one have gaps behind them.
const GRIDS: [[usize; 3]; 8] = [DIMS, [9, 1, 7], [1, 11, 4], [6, 5, 1], [1, 1, 1], [2, 2, 2], [2, 5, 3], [510, 3, 2]];

/// The weights of four neighbours at `w` between the second and the third.
fn weights(w: f64) -> [f64; 4] {
    let r = 1.0 - w;
    [r * r * r, 3.0 * w * w * w - 6.0 * w * w + 4.0, -3.0 * w * w * w + 3.0 * w * w + 3.0 * w + 1.0, w * w * w].map(|x| x / 6.0)
}

/// Their derivatives by `w`.
fn slopes(w: f64) -> [f64; 4] {
    [-(1.0 - w) * (1.0 - w), 3.0 * w * w - 4.0 * w, -3.0 * w * w + 2.0 * w + 1.0, w * w].map(|x| x / 2.0)
}

/// The 64 coefficients around a cell, x fastest: those of one voxel alone stand for all four along its axis.
fn coefficients(spline: &Coefficients, dims: [usize; 3], cell: [usize; 3]) -> [f64; 64] {
    std::array::from_fn(|t| {
        let taps = [t & 3, t >> 2 & 3, t >> 4];
        let at = (0..3).map(|a| if dims[a] == 1 { 0 } else { (cell[a] + taps[a]) * spline.strides[a] }).sum::<usize>();
        f64::from(spline.values[at])
    })
}

/// The sum of `c` with the products of `x`, `y` and `z`.
fn sum(c: &[f64; 64], [x, y, z]: [[f64; 4]; 3]) -> f64 {
    c.iter().enumerate().map(|(t, c)| x[t & 3] * y[t >> 2 & 3] * z[t >> 4] * c).sum()
}

/// The sum of the spline at `w`, and its derivatives.
fn value(c: &[f64; 64], w: [f64; 3]) -> f64 {
    sum(c, w.map(weights))
}
fn gradient(c: &[f64; 64], w: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| sum(c, [0, 1, 2].map(|a| if a == axis { slopes(w[a]) } else { weights(w[a]) })))
}

/// Batches in splines over every type of voxel, on every grid.
fn each_spline(mut hold: impl FnMut(&Frame<'_>, &Batch, &[[f64; 64]; BATCH])) {
    let mut n = Numbers::new(71);
    for (kind, dims) in VoxelType::ALL.into_iter().flat_map(|kind| GRIDS.map(|dims| (kind, dims))) {
        let voxels = voxels(kind, dims, &mut n);
        let map = if n.bits() % 2 == 0 { ToF32 { gain: 1.0, bias: 0.0 } } else { ToF32 { gain: -0.5, bias: 20.0 } };
        let spline = Coefficients::new(&voxels, dims, map, n.bits() % 2 == 0).expect("small enough");
        let mut frame = frame(&voxels, &mut n);
        frame.sample.coefficients = Some(&spline);
        frame.sample.strides = [if dims[0] > 1 { 1 } else { 0 }, spline.strides[1], spline.strides[2]];
        for _ in 0..12 {
            let mut before = batch(&mut n);
            let cells = place(&mut n, &mut before, dims, frame.sample.strides);
            let around: [[f64; 64]; BATCH] = std::array::from_fn(|i| coefficients(&spline, dims, cells[i]));
            hold(&frame, &before, &around);
        }
    }
}

/// The size of the largest of some coefficients, and whether all are finite.
fn size(c: &[f64; 64]) -> (f64, bool) {
    (c.iter().fold(0.0, |a, c| f64::max(a, c.abs())), c.iter().all(|c| c.is_finite()))
}

fn hold_values<const FAR: bool>() {
    each_spline(|frame, before, around| {
        run::<FetchCubic<FAR>>(frame, before, &[Part::Value], |after, level| {
            for i in 0..BATCH {
                let (got, (largest, finite)) = (after.sample.value[i], size(&around[i]));
                if !listed(before.rows, i) {
                    assert_same(got, before.sample.value[i], level, i);
                } else if !finite {
                    assert!(got.is_nan(), "{got} from a coefficient that is NaN, at {level}");
                } else {
                    // Six interpolations after one another, each of which rounds three times, and their positions.
                    assert_near(got, value(&around[i], weight(before, i)), 20.0 * ROUNDING * largest, level, i);
                }
            }
        });
    });
}

#[test]
pub(super) fn values() {
    hold_values::<false>();
    hold_values::<true>();
}

/// A stage that leaves gradients where colours are.
struct Gradient<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for Gradient<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Batch { geometry, sample, rare, slab, rows, .. } = batch;
        let of = At { cells: &geometry.cells, offset: &sample.offset, far_offset: &rare.far_offset, weight: &sample.weight };
        for_rows!(*rows, r => {
            for (to, x) in slab.color.iter_mut().zip(spline_gradient::<L, FAR>(frame, of, r)) {
                L::store(x, row_mut(to, r));
            }
        });
    }
}

fn hold_gradients<const FAR: bool>() {
    each_spline(|frame, before, around| {
        run::<Gradient<FAR>>(frame, before, &[Part::Color], |after, level| {
            for i in 0..BATCH {
                let (largest, finite) = size(&around[i]);
                let want = gradient(&around[i], weight(before, i));
                for axis in 0..3 {
                    let got = after.slab.color[axis][i];
                    if !listed(before.rows, i) {
                        assert_same(got, before.slab.color[axis][i], level, i);
                    } else if !finite {
                        assert!(got.is_nan(), "{got} from a coefficient that is NaN, at {level}");
                    } else {
                        assert_near(got, want[axis], 40.0 * ROUNDING * largest, level, i);
                    }
                }
            }
        });
    });
}

#[test]
fn gradients() {
    hold_gradients::<false>();
    hold_gradients::<true>();
}

/// The twin's derivative weights are those of its weights.
#[test]
fn slopes_are_the_differences_of_values() {
    let mut n = Numbers::new(72);
    for _ in 0..200 {
        let c = std::array::from_fn(|_| f64::from(n.unit32()));
        let w = [0; 3].map(|_| 0.01 + 0.98 * f64::from(n.unit32()));
        let (slope, h) = (gradient(&c, w), 1e-4);
        for axis in 0..3 {
            let at = |step: f64| value(&c, std::array::from_fn(|a| if a == axis { w[a] + step } else { w[a] }));
            assert!(((at(h) - at(-h)) / (2.0 * h) - slope[axis]).abs() < 1e-7);
        }
    }
}

/// What both kernels make of a batch at a vector level, as bits.
fn results<'v>(level: Level, frame: &Frame<'v>, before: &Batch) -> [Vec<u64>; 4] {
    let runs: [Run<'v>; 4] = [
        level.kernel::<FetchCubic<false>, _, _>(),
        level.kernel::<FetchCubic<true>, _, _>(),
        level.kernel::<Gradient<false>, _, _>(),
        level.kernel::<Gradient<true>, _, _>(),
    ];
    runs.map(|run| {
        let mut b = before.clone();
        run(frame, &mut b);
        Part::ALL.into_iter().flat_map(|part| part.bits(&b)).collect()
    })
}

#[test]
fn levels_give_the_same_bits() {
    each_spline(|frame, before, _| {
        let want = results(Level::SCALAR, frame, before);
        for level in Level::available() {
            assert!(results(level, frame, before) == want, "{}", level.name());
        }
    });
}

/// Coefficients that are all alike give that number, to the bit, and no slope.
#[test]
fn a_constant_is_no_other_number() {
    let mut n = Numbers::new(73);
    let voxels = Voxels::F32(vec![0.1; DIMS.iter().product()].into());
    let spline = Coefficients::new(&voxels, DIMS, ToF32 { gain: 1.0, bias: 0.0 }, false).expect("small enough");
    let mut frame = frame(&voxels, &mut n);
    frame.sample.coefficients = Some(&spline);
    frame.sample.strides = spline.strides;
    for _ in 0..20 {
        let mut before = batch(&mut n);
        place(&mut n, &mut before, DIMS, frame.sample.strides);
        run::<FetchCubic<false>>(&frame, &before, &[Part::Value], |after, level| {
            (0..BATCH).filter(|&i| listed(before.rows, i)).for_each(|i| assert_same(after.sample.value[i], 0.1, level, i));
        });
        run::<Gradient<false>>(&frame, &before, &[Part::Color], |after, level| {
            for i in (0..BATCH).filter(|&i| listed(before.rows, i)) {
                (0..3).for_each(|axis| assert_near(after.slab.color[axis][i], 0.0, 0.0, level, i));
            }
        });
    }
}

#[test]
#[should_panic(expected = "block outside the numbers")]
fn blocks_that_leave_the_numbers_are_refused() {
    let cells = CellLoad { base: 1, strides: [1, 4, 16], ..CellLoad::default() };
    cells.blocks(&[0.0; 64], 0, |_| 0);
}
