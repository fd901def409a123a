#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use crate::volume::VoxelType;

const PLAIN: ToF32 = ToF32 { gain: 1.0, bias: 0.0 };

/// The spline's four weights at `w` between its two middle voxels.
fn weights(w: f64) -> [f64; 4] {
    let r = 1.0 - w;
    [r * r * r, 3.0 * w * w * w - 6.0 * w * w + 4.0, -3.0 * w * w * w + 3.0 * w * w + 3.0 * w + 1.0, w * w * w].map(|x| x / 6.0)
}

/// The coefficient `taps` from the first one that `cell` mixes.
fn coefficient(c: &Coefficients, dims: [usize; 3], cell: [usize; 3], taps: [usize; 3]) -> f64 {
    let [x, y, z]: [usize; 3] = std::array::from_fn(|a| if dims[a] == 1 && a > 0 { 0 } else { cell[a] + taps[a] });
    f64::from(c.values[x + y * c.strides[1] + z * c.strides[2]])
}

/// The spline at index coordinates `at`, by all 64 terms of its sum.
fn value(c: &Coefficients, dims: [usize; 3], at: [f64; 3]) -> f64 {
    let cell = std::array::from_fn(|a| (at[a] as usize).min(dims[a].saturating_sub(2)));
    let [x, y, z]: [[f64; 4]; 3] = std::array::from_fn(|a| weights(at[a] - cell[a] as f64));
    let mut sum = 0.0;
    for t in 0..64 {
        let taps = [t & 3, t >> 2 & 3, t >> 4];
        sum += x[taps[0]] * y[taps[1]] * z[taps[2]] * coefficient(c, dims, cell, taps);
    }
    sum
}

fn each_voxel([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nx * ny * nz).map(move |i| [i % nx, i / nx % ny, i / (nx * ny)])
}

fn field(dims: [usize; 3], f: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
    each_voxel(dims).map(|v| f(v.map(|x| x as f64))).collect()
}

/// Numbers between -1 and 1 without a pattern.
fn noise(i: usize) -> f64 {
    (i.wrapping_mul(2_654_435_761) >> 8) as f64 % 2001.0 / 1000.0 - 1.0
}

/// Grids with axes of one voxel and of two, one with gaps behind its rows, and one longer than the prefilter's horizon.
const GRIDS: [[usize; 3]; 9] = [[9, 8, 7], [1, 6, 5], [6, 1, 5], [6, 5, 1], [1, 1, 1], [2, 2, 2], [2, 1, 3], [510, 2, 3], [3, 50, 4]];

#[test]
fn the_prefiltered_spline_goes_through_every_voxel_of_every_type() {
    fn check<T: Voxel>(scale: f64, offset: f64, map: ToF32) {
        for dims in GRIDS {
            let values: Vec<T> = (0..dims.iter().product()).map(|i| T::from_f64(offset + scale * noise(i))).collect();
            let numbers: Vec<f64> = values.iter().map(|v| v.to_f64() * map.gain - map.bias).collect();
            let range = numbers.iter().fold(f64::MIN, |a, &b| a.max(b)) - numbers.iter().fold(f64::MAX, |a, &b| a.min(b));
            let spline = Coefficients::new(&values.into(), dims, map, true).unwrap();
            for (i, v) in each_voxel(dims).enumerate() {
                let off = value(&spline, dims, v.map(|x| x as f64)) - numbers[i];
                assert!(off.abs() <= 1e-6 * range + 1e-7 * numbers[i].abs(), "{} {dims:?} {v:?}: off by {off:e} of {range:e}", T::TYPE);
            }
        }
    }
    let from = |min: f64| ToF32 { gain: 1.0, bias: min };
    check::<u8>(127.0, 127.0, PLAIN);
    check::<i8>(127.0, 0.0, from(-127.0));
    check::<u16>(30_000.0, 32_000.0, PLAIN);
    check::<i16>(1000.0, 0.0, from(-1000.0));
    check::<u32>(2e9, 2e9, from(0.0));
    check::<i32>(2e9, 0.0, from(-2e9));
    check::<f32>(1.0, 0.0, PLAIN);
    check::<f32>(10.0, 1e6, from(1e6 - 10.0));
    check::<f32>(3e38, 0.0, ToF32 { gain: libm::scalbn(1.0, -64), bias: 0.0 });
    check::<f64>(1e-3, 1e9, from(1e9));
    check::<f64>(8e307, 0.0, ToF32 { gain: libm::scalbn(1.0, -1000), bias: 0.0 });
}

#[test]
fn polynomials_up_to_the_third_degree_are_reproduced_far_from_the_border() {
    let dims = [44, 44, 44];
    let at = |x: f64| (x - 21.0) / 10.0;
    let cubic = |[x, y, z]: [f64; 3]| {
        let (x, y, z) = (at(x), at(y), at(z));
        1.0 + x - 2.0 * y + x * y + z * z - x * x * x + 0.5 * y * y * z + x * y * z
    };
    let linear = |[x, y, z]: [f64; 3]| 3.0 + at(x) - 2.0 * at(y) + 0.7 * at(z) + 0.3 * at(x) * at(y);
    let spline = |f: &dyn Fn([f64; 3]) -> f64, prefilter| {
        let values: Vec<f64> = field(dims, f);
        Coefficients::new(&values.into(), dims, PLAIN, prefilter).unwrap()
    };
    let (through, smooth) = (spline(&cubic, true), spline(&linear, false));
    for i in 0..200 {
        let p = [0, 1, 2].map(|a| 20.0 + 1.5 * noise(3 * i + a));
        assert!((value(&through, dims, p) - cubic(p)).abs() < 1e-5, "{p:?}");
        assert!((value(&smooth, dims, p) - linear(p)).abs() < 1e-5, "{p:?}");
    }
    // Smoothing adds a sixth of the second derivative, a third of a quadratic's coefficient.
    let square = spline(&|[x, _, _]: [f64; 3]| (x - 21.0) * (x - 21.0), false);
    assert!((value(&square, dims, [21.0, 20.0, 20.0]) - 1.0 / 3.0).abs() < 1e-5);
}

#[test]
fn an_impulse_is_smoothed_to_the_products_of_the_weights() {
    let dims = [9, 9, 9];
    let values = field(dims, |p| if p == [4.0, 4.0, 4.0] { 1.0 } else { 0.0 });
    let spline = Coefficients::new(&Voxels::F64(values.into()), dims, PLAIN, false).unwrap();
    // The distance from the impulse tells the weight: 0 to 1 the inner ones, 1 to 2 the outer ones.
    let weight = |d: f64| {
        if d < 1.0 {
            weights(d)[1]
        } else if d < 2.0 {
            weights(d - 1.0)[0]
        } else {
            0.0
        }
    };
    for i in 0..500 {
        let p = [0, 1, 2].map(|a| 4.0 + 2.5 * noise(3 * i + a));
        let want: f64 = p.map(|x| weight((x - 4.0).abs())).iter().product();
        assert!((value(&spline, dims, p) - want).abs() < 1e-12, "{p:?}");
    }
    assert!((value(&spline, dims, [4.0; 3]) - 8.0 / 27.0).abs() < 1e-15);
}

#[test]
fn a_constant_is_the_same_number_everywhere_and_slopes_are_zero_at_the_border() {
    for (dims, prefilter) in GRIDS.into_iter().flat_map(|dims| [(dims, true), (dims, false)]) {
        let values: Vec<f32> = vec![42.5; dims.iter().product()];
        let spline = Coefficients::new(&values.into(), dims, ToF32 { gain: 1.0, bias: 42.5 }, prefilter).unwrap();
        assert!(each_voxel(dims).all(|v| value(&spline, dims, v.map(|x| x as f64 * 0.9)) == 0.0));
    }
    let dims = [6, 5, 4];
    let values: Vec<f64> = (0..120).map(noise).collect();
    let spline = Coefficients::new(&values.into(), dims, PLAIN, true).unwrap();
    for (axis, at) in [(0, 0.0), (0, 5.0), (1, 0.0), (1, 4.0), (2, 0.0), (2, 3.0)] {
        let near = |step: f64| {
            let mut p = [2.3, 1.7, 1.2];
            p[axis] = if at == 0.0 { step } else { at - step };
            value(&spline, dims, p)
        };
        // Of second order in the distance.
        assert!((near(1e-4) - near(0.0)).abs() < 1e-7, "axis {axis} at {at}");
    }
}

#[test]
fn threads_change_no_bit() {
    let dims = [37, 29, 23];
    let values: Vec<f32> = (0..dims.iter().product()).map(|i| if i % 1009 == 3 { f32::NAN } else { noise(i) as f32 }).collect();
    let bits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let spline = pool.install(|| Coefficients::new(&values.clone().into(), dims, PLAIN, true).unwrap());
        spline.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let want = bits(1);
    for threads in [2, 3, 7] {
        assert!(bits(threads) == want, "{threads} threads");
    }
}

#[test]
fn voxels_that_are_not_finite_take_the_cells_that_mix_them_and_no_others() {
    let dims = [11, 9, 8];
    let whole: Vec<f64> = (0..dims.iter().product()).map(noise).collect();
    for (hole, prefilter) in [([5, 4, 4], true), ([5, 4, 4], false), ([0, 0, 0], true), ([10, 8, 7], true)] {
        let mut values = whole.clone();
        values[(hole[2] * 9 + hole[1]) * 11 + hole[0]] = f64::INFINITY;
        let spline = Coefficients::new(&values.into(), dims, PLAIN, prefilter).unwrap();
        for v in each_voxel([10, 8, 7]) {
            // Cell v mixes the voxels from v - 1 to v + 2.
            let mixes = (0..3).all(|a| v[a] <= hole[a] + 1 && hole[a] <= v[a] + 2);
            let got = value(&spline, dims, v.map(|x| x as f64 + 0.5));
            assert_eq!(got.is_nan(), mixes, "hole {hole:?}, cell {v:?}");
            assert!(mixes || got.abs() < 20.0);
        }
    }
    // A row of none at all counts as 0 for its neighbours, a hole at the beginning of a row as the first number after it.
    let mut values = vec![7.0f32; 5 * 4 * 3];
    values[5 * 4..5 * 5].fill(f32::NAN);
    (values[0], values[1]) = (f32::NAN, f32::NEG_INFINITY);
    let spline = Coefficients::new(&values.into(), [5, 4, 3], ToF32 { gain: 1.0, bias: 7.0 }, true).unwrap();
    assert!(spline.values.iter().all(|&c| c.is_nan() || c == 0.0));
    assert!(spline.values.iter().filter(|c| c.is_nan()).count() >= 7);
    let none = Coefficients::new(&Voxels::F32(vec![f32::NAN; 8].into()), [2, 2, 2], PLAIN, true).unwrap();
    let bricks = none.bricks([2, 2, 2], PLAIN, 8);
    assert_eq!((bricks.range, &bricks.ranges[..]), ((f64::INFINITY, f64::NEG_INFINITY), &[(f32::INFINITY, f32::NEG_INFINITY)][..]));
}

#[test]
fn bricks_bound_the_spline_in_stored_values() {
    let maps = [PLAIN, ToF32 { gain: -1.0, bias: 100.0 }, ToF32 { gain: 0.25, bias: -3.0 }];
    for (dims, map) in GRIDS.into_iter().chain([[21, 17, 13]]).zip(maps.into_iter().cycle()) {
        let values: Vec<f64> = (0..dims.iter().product()).map(|i| if i % 97 == 5 { f64::NAN } else { 100.0 * noise(i) }).collect();
        let spline = Coefficients::new(&values.into(), dims, map, true).unwrap();
        let bricks = spline.bricks(dims, map, 0);
        let mut loosest = 0.0f64;
        for (i, v) in each_voxel(dims.map(|n| n.saturating_sub(1).max(1))).enumerate() {
            let at: [f64; 3] = std::array::from_fn(|a| if dims[a] == 1 { 0.0 } else { v[a] as f64 + 0.5 + 0.5 * noise(3 * i + a) });
            let got = (value(&spline, dims, at) + map.bias) / map.gain;
            let [x, y, z] = v.map(|c| c / BRICK);
            let (low, high) = bricks.ranges[(z * bricks.dims[1] + y) * bricks.dims[0] + x];
            assert!(got.is_nan() || f64::from(low) <= got && got <= f64::from(high), "{dims:?} {at:?}: {got} not in {low}..{high}");
            assert!(low > high || bricks.range.0 <= f64::from(high) && f64::from(low) <= bricks.range.1);
            loosest = loosest.max(f64::from(high - low));
        }
        assert!(loosest.is_finite() && loosest < 3000.0, "bounds that say nothing: {loosest}");
    }
}

#[test]
fn the_memory_is_told_before_it_is_taken() {
    assert_eq!(Coefficients::bytes([1, 1, 1]), 16);
    assert_eq!(Coefficients::bytes([2, 2, 2]), 256);
    assert!(Coefficients::bytes([510, 510, 510]) < 512 * 512 * 512 * 4 * 17 / 16);
    assert_eq!(Coefficients::bytes([usize::MAX / 2, 3, 3]), u128::MAX);
    for dims in GRIDS {
        let voxels = Voxels::zeros(VoxelType::U8, dims.iter().product());
        let made = Coefficients::new(&voxels, dims, PLAIN, true).unwrap();
        assert_eq!(made.values.len() as u128 * 4, Coefficients::bytes(dims));
    }
}
