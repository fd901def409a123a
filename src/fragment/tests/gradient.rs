//! Twins of gradients, and of opacity that depends on them.

use super::fetch::{Cells, number, place};
use super::*;
use crate::fragment::gradient::TakeGradient;
use crate::fragment::gradient_opacity::WeighByGradient;
use crate::lanes::Lanes;
use crate::scene::{Gradient, TransferFunction};
use crate::volume::{Grid, VoxelSlices};
use glam::{DMat3, DQuat, DVec3};

const KINDS: [Gradient; 3] = [Gradient::Central, Gradient::Analytic, Gradient::Sobel];

/// An oblique, anisotropic grid, mirrored every other time.
fn grid(n: &mut Numbers, dims: [usize; 3]) -> Grid {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), n.between(0.0, 6.0)));
    let sign = if n.bits() % 2 == 0 { 1.0 } else { -1.0 };
    let [x, y, z] = [0; 3].map(|_| n.between(0.2, 3.0));
    let shear = DMat3::from_cols(DVec3::new(x, 0.0, 0.0), DVec3::new(0.2 * y, sign * y, 0.0), DVec3::new(-0.1 * z, 0.3 * z, z));
    Grid::new(dims, DVec3::new(3.0, -7.0, 11.0), turn * shear).expect("a grid")
}

/// A gradient in world space, and how far f32 numbers may be off it.
struct Want {
    gradient: DVec3,
    off: f64,
}

/// The gradient at a place in a cell: differences at the cell's corners, each weighted by the part of the cell opposite. `None` where a voxel
/// that it needs is NaN or infinite.
fn want(frame: &Frame<'_>, grid: &Grid, kind: Gradient, scale: f64, cell: [usize; 3], part: [f64; 3]) -> Option<Want> {
    let dims = grid.dims();
    // Voxels from the one before the cell to the one behind it; beyond the grid they are those at its edge.
    let voxel = |at: [i64; 3]| {
        let inside = [0, 1, 2].map(|a: usize| (cell[a] as i64 + at[a]).clamp(0, dims[a] as i64 - 1) as usize);
        number(frame, dims, inside, [0; 3])
    };
    let (mut along, mut most) = ([0.0; 3], 0.0);
    for axis in 0..3 {
        for corner in 0..8_i64 {
            let bit = |a: usize| corner >> a & 1;
            let weight: f64 = (0..3).map(|a| if bit(a) == 1 { part[a] } else { 1.0 - part[a] }).product();
            let mut difference = |steps: [i64; 3], factor: f64| {
                let v = voxel([0, 1, 2].map(|a: usize| bit(a) + steps[a]));
                most = f64::max(most, if v.is_finite() { v.abs() } else { f64::INFINITY });
                along[axis] += if v.is_finite() { weight * factor * v } else { f64::NAN };
            };
            let on_axis = |x: i64| [0, 1, 2].map(|a: usize| if a == axis { x } else { 0 });
            match kind {
                Gradient::Central => {
                    difference(on_axis(1), 0.5);
                    difference(on_axis(-1), -0.5);
                }
                Gradient::Analytic => {
                    difference(on_axis(1 - bit(axis)), 1.0);
                    difference(on_axis(-bit(axis)), -1.0);
                }
                Gradient::Sobel => {
                    for k in 0..27_i64 {
                        let steps = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                        let beside: i64 = (0..3).filter(|&a| a != axis).map(|a| 2 - steps[a].abs()).product();
                        difference(steps, (steps[axis] * beside) as f64 / 32.0);
                    }
                }
            }
        }
    }
    if !most.is_finite() {
        return None;
    }
    // A covector: through the inverse of the transposed map from index to world.
    let inverse = grid.index_to_world().matrix3.transpose().inverse();
    let entries = inverse.to_cols_array().iter().map(|x| x.abs()).fold(0.0, f64::max);
    // A voxel's own rounding, and that of differences and interpolations, three times each; nine products of the matrix.
    let off = scale.abs() * entries * 9.0 * 40.0 * ROUNDING * most;
    Some(Want { gradient: inverse * DVec3::from_array(along) * scale, off })
}

/// Covered fragments with an opacity, of pixels that still take light, get gradients; others in their rows none; other rows stay.
fn hold<K: for<'v> Kernel<Frame<'v>, Batch>>(
    frame: &Frame<'_>,
    grid: &Grid,
    kind: Gradient,
    scale: f64,
    before: &Batch,
    cells: &Cells,
) -> u64 {
    let unit = frame.optional.gradient.as_ref().expect("there are gradients").unit;
    // A quarter of the pixels, and none.
    let live = if before.slice % 2 == 0 { 0.05 } else { 0.0 };
    let mut frame = frame.clone();
    frame.optional.gradient = frame.optional.gradient.map(|g| g.with_live(live));
    let frame = &frame;
    let takes = |i: usize| before.pixels.transmittance[i] >= live;
    let visible = |i: usize| bit(before.mask, i) && before.slab.alpha[i] > 0.0 && takes(i) && listed(before.shown, i);
    let lanes = (0..BATCH).filter(|&i| visible(i)).fold(0, |m, i| m | 1 << i);
    let rows = rows_of(lanes);
    let mut held = 0;
    run::<K>(frame, before, &[Part::Normal, Part::Size, Part::GradientLanes, Part::GradientsTaken], |after, level| {
        assert_eq!(after.gradient().lanes, lanes, "at {level}");
        assert_eq!(after.gradient().taken, before.gradient().taken + u64::from(lanes.count_ones()), "at {level}");
        for i in 0..BATCH {
            let [normal, old] = [after, before].map(|b| [0, 1, 2].map(|a: usize| b.gradient().normal[a][i]));
            let size = after.gradient().size[i];
            if !listed(rows, i) {
                (0..3).for_each(|a| assert_same(normal[a], old[a], level, i));
                assert_same(size, before.gradient().size[i], level, i);
                continue;
            }
            if !bit(lanes, i) {
                assert_eq!((size, normal), (0.0, [0.0; 3]), "at {level}, fragment {i}");
                continue;
            }
            let part = [0, 1, 2].map(|a: usize| f64::from(before.sample.weight[a][i]));
            let want = want(frame, grid, kind, scale, cells[i], part).filter(|w| w.gradient != DVec3::ZERO || w.off > 0.0);
            let Some(Want { gradient, off }) = want else {
                assert_eq!((size, normal), (0.0, [0.0; 3]), "at {level}, fragment {i}");
                continue;
            };
            let length = gradient.length();
            let got = f64::from(size) * unit;
            assert!(
                (got - length).abs() <= 2.0 * off + 8.0 * ROUNDING * length,
                "{got} not {length} within {off}, at {level}, fragment {i}"
            );
            assert!(size > 0.0 || normal == [0.0; 3], "{normal:?} without a gradient, at {level}, fragment {i}");
            if off < 0.1 * length {
                held += 1;
                for a in 0..3 {
                    assert_near(normal[a], -gradient[a] / length, 3.0 * off / length + 8.0 * ROUNDING, level, i);
                }
            }
        }
    });
    held
}

/// The cells of a batch whose offsets are set, read back from them.
fn cells_of(frame: &Frame<'_>, b: &Batch, far: bool) -> Cells {
    let strides = frame.sample.strides;
    std::array::from_fn(|i| {
        let offset = if far { b.rare.far_offset[i] as usize } else { b.sample.offset[i] as usize };
        let mut rest = b.geometry.cells.base + offset;
        let mut cell = [0; 3];
        for axis in (0..3).rev() {
            if let Some(along) = rest.checked_div(strides[axis]) {
                (cell[axis], rest) = (along, rest - along * strides[axis]);
            }
        }
        cell
    })
}

/// Where batches lie.
#[derive(Clone, Copy, PartialEq)]
enum Where {
    /// Anywhere around the volume, clamped.
    Anywhere,
    /// A voxel and more inside.
    Deep,
}

/// A batch on a slice through voxels that stand as `frame` says.
fn on_slice(n: &mut Numbers, frame: &Frame<'_>, at: Where) -> (Box<Batch>, Cells) {
    let mut b = batch(n);
    b.geometry.cells.strides = frame.sample.strides;
    let low: [usize; 3] =
        if at == Where::Deep { [2, 3, 1] } else { [n.bits() as usize % 10, n.bits() as usize % 9, n.bits() as usize % 8] };
    b.geometry.cells.base = (0..3).map(|a| low[a] * frame.sample.strides[a]).sum();
    for a in 0..3 {
        b.geometry.top[a] = (DIMS[a] - 2 - low[a]) as f32;
        b.geometry.reach[a] = b.geometry.top[a] + 1.0;
        if at == Where::Deep {
            b.geometry.across[a] = n.unit32() * 0.8;
            b.geometry.down[a] = n.unit32() * 0.8;
            b.geometry.origin[a] = n.unit32();
        }
    }
    Level::SCALAR.kernel::<Texcoord, Frame<'_>, Batch>()(frame, &mut b);
    let cells = cells_of(frame, &b, false);
    (b, cells)
}

fn slices(at: Where) {
    let mut n = Numbers::new(91);
    let mut held = 0;
    for kind in VoxelType::ALL {
        let voxels = voxels(kind, DIMS, &mut n);
        let packed = Packed::new(&voxels, DIMS);
        for round in 0..36 {
            let mut frame = frame(&voxels, &mut n);
            if let Some(packed) = packed.as_ref().filter(|_| round % 2 == 0) {
                frame.sample.packed = Some(packed);
                frame.sample.strides = [1, packed.strides[0], packed.strides[1]];
            } else if round % 4 == 1 {
                frame.sample.to_f32 = Some(ToF32 { gain: -0.25, bias: 3.5 });
            }
            let (grid, scale) = (grid(&mut n, DIMS), if round % 3 == 0 { -2.5 } else { 0.75 });
            let gradient = KINDS[round % 3];
            frame.optional.gradient = Some(GradientFrame::new(gradient, &grid, scale));
            let (before, cells) = on_slice(&mut n, &frame, at);
            held += hold::<TakeGradient>(&frame, &grid, gradient, scale, &before, &cells);
        }
    }
    assert!(held > 5000, "{held} gradients");
}

#[test]
pub(super) fn of_slices() {
    slices(Where::Anywhere);
}

#[test]
pub(super) fn of_slices_deep_inside() {
    slices(Where::Deep);
}

/// Each fragment in a cell of its own, and offsets of both kinds, in volumes with axes of one voxel.
#[test]
pub(super) fn of_pieces_at_depths_of_their_own() {
    let mut n = Numbers::new(92);
    for kind in VoxelType::ALL {
        for dims in [DIMS, [9, 1, 7], [1, 11, 4], [6, 5, 1], [2, 2, 2], [1, 1, 1]] {
            let voxels = voxels(kind, dims, &mut n);
            let grid = grid(&mut n, dims);
            let packed = Packed::new(&voxels, dims);
            for gradient in KINDS {
                let mut frame = frame(&voxels, &mut n);
                frame.sample.strides = strides(dims);
                if let Some(packed) = packed.as_ref().filter(|_| dims.iter().all(|&d| d > 1) && n.bits() % 2 == 0) {
                    frame.sample.packed = Some(packed);
                    frame.sample.strides = [1, packed.strides[0], packed.strides[1]];
                }
                frame.optional.gradient = Some(GradientFrame::new(gradient, &grid, 1.0));
                let mut before = batch(&mut n);
                let cells = place(&mut n, &mut before, dims, frame.sample.strides);
                // Offsets that an earlier batch left, far beyond this volume.
                before.gradient_mut().packed.far_offset = [1 << 40; BATCH];
                before.gradient_mut().packed.offset = [i32::MAX; BATCH];
                // An axis of one voxel has no gradient along it.
                let flat: Vec<usize> = (0..3).filter(|&a| dims[a] == 1).collect();
                for (far, slice) in [(false, BEHIND), (true, BEHIND), (true, 3)] {
                    (frame.sample.far, before.slice) = (far, slice);
                    hold::<TakeGradient>(&frame, &grid, gradient, 1.0, &before, &cells);
                }
                run::<TakeGradient>(
                    &frame,
                    &before,
                    &[Part::Normal, Part::Size, Part::GradientLanes, Part::GradientsTaken],
                    |after, level| {
                        for i in (0..BATCH).filter(|&i| bit(after.gradient().lanes, i)) {
                            let normal = DVec3::from_array([0, 1, 2].map(|a: usize| f64::from(after.gradient().normal[a][i])));
                            for &axis in &flat {
                                let along = grid.index_to_world().matrix3.col(axis).normalize().dot(normal);
                                assert!(along.abs() < 40.0 * ROUNDING, "{along} along axis {axis}, at {level}");
                            }
                        }
                    },
                );
            }
        }
    }
}

/// NaN and infinities around a cell leave no gradient, nor do equal voxels: exactly none.
#[test]
pub(super) fn around_holes_and_on_plateaus() {
    let mut n = Numbers::new(93);
    let (mut without, mut with) = (0, 0);
    for round in 0..60 {
        let voxels = Voxels::F32(
            (0..DIMS.iter().product::<usize>())
                .map(|i| match n.bits() % 200 {
                    0 => f32::NAN,
                    1 => f32::INFINITY,
                    2 => f32::NEG_INFINITY,
                    // Plateaus of many voxels.
                    _ => [7.25, 1e-3, -40.0][(i / DIMS[0] / DIMS[1] / 5) % 3],
                })
                .collect(),
        );
        let mut frame = frame(&voxels, &mut n);
        let (grid, kind) = (grid(&mut n, DIMS), KINDS[round % 3]);
        frame.optional.gradient = Some(GradientFrame::new(kind, &grid, 1.0));
        let (mut before, cells) = on_slice(&mut n, &frame, Where::Anywhere);
        (before.mask, before.shown, before.slab.alpha) = (u64::MAX, u8::MAX, [0.5; BATCH]);
        run::<TakeGradient>(&frame, &before, &[Part::Normal, Part::Size, Part::GradientLanes, Part::GradientsTaken], |after, level| {
            for i in 0..BATCH {
                let part = [0, 1, 2].map(|a: usize| f64::from(before.sample.weight[a][i]));
                let found = want(&frame, &grid, kind, 1.0, cells[i], part);
                let normal = [0, 1, 2].map(|a: usize| after.gradient().normal[a][i]);
                // Differences of equal voxels are exact.
                if found.is_none_or(|w| w.gradient.length() < 1e-12) {
                    without += 1;
                    assert_eq!((after.gradient().size[i], normal), (0.0, [0.0; 3]), "at {level}, fragment {i}");
                } else {
                    with += 1;
                    assert!(after.gradient().size[i] > 0.0, "at {level}, fragment {i}");
                }
            }
        });
    }
    assert!(without > 1000 && with > 1000, "{without} without, {with} with");
}

/// The largest and the smallest numbers have directions as well, up to where differences leave f32 or its normal numbers.
#[test]
pub(super) fn of_numbers_at_the_ends_of_f32() {
    let mut n = Numbers::new(94);
    for (exponent, there) in [(-126, false), (-110, true), (-60, true), (-20, true), (20, true), (60, true), (118, true)] {
        let size = libm::scalbn(1.0, exponent);
        let voxels = Voxels::F32((0..DIMS.iter().product::<usize>()).map(|_| ((1.0 + n.unit()) * size) as f32).collect());
        for kind in KINDS {
            let mut frame = frame(&voxels, &mut n);
            // A grid whose units are no numbers of f32 either.
            let spacing = [1e-30, 1.0, 1e30][n.bits() as usize % 3];
            let grid = Grid::with_spacing(DIMS, [spacing; 3]).expect("a grid");
            frame.optional.gradient = Some(GradientFrame::new(kind, &grid, 1.0));
            let (mut before, cells) = on_slice(&mut n, &frame, Where::Anywhere);
            (before.mask, before.shown, before.slab.alpha) = (u64::MAX, u8::MAX, [0.5; BATCH]);
            before.pixels.transmittance = [1.0; BATCH];
            if there {
                assert!(hold::<TakeGradient>(&frame, &grid, kind, 1.0, &before, &cells) > 100, "2^{exponent}, {kind:?}");
            } else {
                run::<TakeGradient>(
                    &frame,
                    &before,
                    &[Part::Normal, Part::Size, Part::GradientLanes, Part::GradientsTaken],
                    |after, level| {
                        for i in 0..BATCH {
                            let length = (0..3).map(|a| after.gradient().normal[a][i].powi(2)).sum::<f32>();
                            let none = after.gradient().size[i] == 0.0 && length == 0.0;
                            assert!(none || (length - 1.0).abs() < 0.1, "normal of length^2 {length} at {level}, fragment {i}");
                        }
                    },
                );
            }
        }
    }
}

/// A = 1 - exp(-tau f l), and the colour with it, in rows that have gradients; rows without any are no longer shown.
#[test]
pub(super) fn opacity() {
    let mut n = Numbers::new(95);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let grid = Grid::with_spacing([2; 3], [0.5; 3]).expect("a grid");
    let lists: [&[(f64, f64)]; 7] = [
        &[(0.0, 0.0), (40.0, 1.0)],
        &[(5.0, 0.7)],
        &[(10.0, 0.2), (10.0, 0.9), (30.0, 0.4), (60.0, 0.4), (60.0, 0.0)],
        &[(0.0, 1.0), (0.0, 0.0), (1e-30, 0.5), (3.0, 1.0)],
        &[(0.0, 0.3), (1e300, 1.0)],
        &[(1e-310, 0.0), (2e-310, 1.0)],
        &[(20.0, 0.1), (20.0 + 1e-14, 0.6)],
    ];
    let mut dark = 0;
    for round in 0..40 * lists.len() {
        let points = lists[round % lists.len()].to_vec();
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).expect("a function");
        let transfer = transfer.with_gradient_opacity(points.clone()).expect("points in order");
        let mut frame = frame(&none, &mut n);
        let gradient = GradientFrame::new(Gradient::Central, &grid, 3.0);
        frame.optional.opacity = OpacityFrame::of(&transfer, &gradient);
        let mut before = batch(&mut n);
        let unit = gradient.unit;
        for i in 0..BATCH {
            let u = n.unit32();
            let depth = [0.0, crate::scene::DEEPEST as f32, 1e6 * u, 1e-7 * u, 20.0 * u, 1e-30 * u][n.bits() as usize % 6];
            before.slab.alpha[i] = depth;
            (0..3).for_each(|c| before.slab.color[c][i] = n.unit32() * depth);
            if n.bits() % 5 == 0 {
                before.gradient_mut().size[i] = [0.0, 1e30, 1e-30, (10.0 / unit) as f32, (60.0 / unit) as f32][n.bits() as usize % 5];
            }
        }
        frame.optional.gradient = Some(gradient);
        run::<WeighByGradient>(&frame, &before, &[Part::Color, Part::Alpha, Part::Shown], |after, level| {
            assert_eq!(after.shown, before.shown & rows_of(before.gradient().lanes), "at {level}");
            for i in 0..BATCH {
                let colors = |b: &Batch| [b.slab.color[0][i], b.slab.color[1][i], b.slab.color[2][i], b.slab.alpha[i]];
                let (got, old) = (colors(after), colors(&before));
                if !listed(after.shown, i) {
                    (0..4).for_each(|c| assert_same(got[c], old[c], level, i));
                    continue;
                }
                let size = f64::from(before.gradient().size[i]) * unit;
                // Where the rounding of a point's place decides, or it lies below f32's numbers, any factor between both sides will do.
                let around = |g: f64| transfer.gradient_factor((g).max(0.0));
                let near = 8.0 * ROUNDING * size + 1e-37 * unit;
                let sides = [around(size - near), around(size), around(size + near)];
                let lowest = sides.iter().copied().fold(1.0, f64::min) - 8.0 * ROUNDING;
                let highest = sides.iter().copied().fold(0.0, f64::max) + 8.0 * ROUNDING;
                let tau = f64::from(old[3]) * f64::from(before.slab.length[i]);
                let alpha = |factor: f64| -libm::expm1(-tau * factor.clamp(0.0, 1.0));
                let (least, most) = (alpha(lowest) * (1.0 - 12.0 * ROUNDING), alpha(highest) * (1.0 + 12.0 * ROUNDING));
                let got_alpha = f64::from(got[3]);
                // Below the least normal number nothing is promised.
                assert!(
                    got_alpha >= least - 1e-37 && got_alpha <= most + 1e-37,
                    "{got_alpha} not in [{least}, {most}], at {level}, fragment {i}"
                );
                dark += u32::from(got[3] == 0.0);
                for c in 0..3 {
                    let share = if old[3] > 0.0 { f64::from(old[c]) / f64::from(old[3]) } else { 0.0 };
                    assert_near(got[c], share * got_alpha, 6.0 * ROUNDING * share * got_alpha + 1e-37, level, i);
                }
            }
        });
    }
    assert!(dark > 100, "{dark}");
}

/// Voxels of both loads, written out one after the other.
#[derive(Default)]
struct Loaded(Vec<i64>);

struct Around<'a> {
    packed: &'a Packed,
    batch: &'a Batch,
    signed: bool,
}

/// The loads of packed neighbours, taken apart: voxels in the order of their documentation.
struct LoadAround;

impl Kernel<Around<'_>, Loaded> for LoadAround {
    #[inline(always)]
    fn run<L: Lanes>(Around { packed, batch, signed }: &Around<'_>, out: &mut Loaded) {
        let cells = &batch.geometry.cells;
        for r in 0..SIDE {
            let mut add = |vector: L::I, bits: u32, parts: &[u32]| {
                let mut lanes = [0; SIDE];
                L::store_i(vector, &mut lanes);
                for &part in parts {
                    out.0.extend(lanes.iter().map(|&lane| {
                        let number = i64::from((lane as u32) >> (bits * part) & ((1 << bits) - 1));
                        if *signed && number >> (bits - 1) == 1 { number - (1 << bits) } else { number }
                    }));
                }
            };
            match &packed.pairs {
                PackedPairs::Of8(v) => {
                    let q = cells.around8::<L>(v, &batch.sample.offset, r);
                    for (at, &vector) in q.iter().enumerate() {
                        add(
                            vector,
                            8,
                            if !(4..=7).contains(&at) {
                                &[0, 1, 2, 3]
                            } else if at % 2 == 0 {
                                &[0, 2]
                            } else {
                                &[1, 3]
                            },
                        );
                    }
                }
                PackedPairs::Of16(v) => {
                    let q = cells.around16::<L>(v, &batch.sample.offset, r);
                    for (at, &vector) in q.iter().enumerate() {
                        let above = matches!(at, 8 | 9 | 12 | 13);
                        add(
                            vector,
                            16,
                            if !(8..=15).contains(&at) {
                                &[0, 1]
                            } else if above {
                                &[0]
                            } else {
                                &[1]
                            },
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn loads_of_packed_neighbours_bring_the_voxels_they_name() {
    let mut n = Numbers::new(96);
    for kind in [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16] {
        let voxels = voxels(kind, DIMS, &mut n);
        let packed = Packed::new(&voxels, DIMS).expect("small enough");
        let mut frame = frame(&voxels, &mut n);
        frame.sample.strides = [1, packed.strides[0], packed.strides[1]];
        let signed = matches!(frame.sample.voxels, VoxelSlices::I8(_) | VoxelSlices::I16(_));
        // Pairs along x (of 8 bits: with both of y), then what lies beside, as the loads' pictures have it.
        let line = |z: i64| [-1, 1].map(move |x| [x, 0, z]);
        let steps: Vec<[i64; 3]> = if kind.bytes() == 1 {
            let quad = |[x, y, z]: [i64; 3]| [[x, y, z], [x, y + 1, z], [x + 1, y, z], [x + 1, y + 1, z]];
            let inner = line(0).into_iter().chain(line(1)).flat_map(quad);
            let beside = [0, 1].into_iter().flat_map(|z| [[0, -1, z], [1, -1, z], [0, 2, z], [1, 2, z]]);
            inner.chain(beside).chain(quad([0, 0, -1])).chain(quad([0, 0, 2])).collect()
        } else {
            let pair = |[x, y, z]: [i64; 3]| [[x, y, z], [x, y + 1, z]];
            let inner = [0, 1].into_iter().flat_map(|z| (-1..3).map(move |x| [x, 0, z])).flat_map(pair);
            let beside = [0, 1].into_iter().flat_map(|z| [[0, -1, z], [1, -1, z], [0, 2, z], [1, 2, z]]);
            let ends = [-1, 2].into_iter().flat_map(|z| [[0, 0, z], [1, 0, z]]).flat_map(pair);
            inner.chain(beside).chain(ends).collect()
        };
        for _ in 0..10 {
            let (batch, cells) = on_slice(&mut n, &frame, Where::Deep);
            for level in Level::available() {
                let mut out = Loaded::default();
                level.kernel::<LoadAround, _, _>()(&Around { packed: &packed, batch: &batch, signed }, &mut out);
                let mut got = out.0.iter();
                for r in 0..SIDE {
                    for &[x, y, z] in &steps {
                        for cell in &cells[SIDE * r..SIDE * r + SIDE] {
                            let at = [cell[0] as i64 + x, cell[1] as i64 + y, cell[2] as i64 + z].map(|i| i as usize);
                            let want = number(&frame, DIMS, at, [0; 3]);
                            assert_eq!(got.next().map(|&v| v as f64), Some(want), "{kind} at {}, {x} {y} {z}", level.name());
                        }
                    }
                }
                assert_eq!(got.next(), None);
            }
        }
    }
}

#[test]
#[should_panic(expected = "cells too near the volume's border")]
fn loads_of_packed_neighbours_stay_inside() {
    let mut n = Numbers::new(97);
    let voxels = voxels(VoxelType::U8, DIMS, &mut n);
    let packed = Packed::new(&voxels, DIMS).expect("small enough");
    let mut batch = batch(&mut n);
    batch.geometry.cells.strides = [1, packed.strides[0], packed.strides[1]];
    // The first voxel of all has none before it.
    (batch.geometry.cells.base, batch.sample.offset) = (0, [0; BATCH]);
    Level::SCALAR.kernel::<LoadAround, _, _>()(&Around { packed: &packed, batch: &batch, signed: false }, &mut Loaded::default());
}
