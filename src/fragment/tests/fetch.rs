//! Twins of lookups, and of the stages that look after the values that were looked up.

use super::*;

/// Where a batch's fragments lie, as whole numbers of voxels along each axis.
pub(super) type Cells = [[usize; 3]; BATCH];

/// Sets offsets of random cells in a grid of `dims` whose voxels stand `strides` apart, and random weights. Returns the cells.
pub(super) fn place(n: &mut Numbers, b: &mut Batch, dims: [usize; 3], strides: [usize; 3]) -> Cells {
    let count = dims.map(|d| d.max(2) - 1);
    let base = count.map(|c| n.bits() as usize % c);
    let index = |cell: [usize; 3]| (0..3).map(|a| cell[a] * strides[a]).sum::<usize>();
    b.geometry.cells.base = index(base);
    b.geometry.cells.strides = strides;
    std::array::from_fn(|i| {
        let cell = std::array::from_fn(|a| base[a] + n.bits() as usize % (count[a] - base[a]));
        let offset = index(cell) - index(base);
        b.sample.offset[i] = i32::try_from(offset).expect("a small grid");
        b.rare.far_offset[i] = offset as u64;
        for a in 0..3 {
            let special = [0.0, 0.5, 1.0][n.bits() as usize % 3];
            b.sample.weight[a][i] = if dims[a] == 1 {
                0.0
            } else if n.bits() % 8 == 0 {
                special
            } else {
                n.unit32()
            };
        }
        cell
    })
}

/// A voxel `steps` from `cell` along each axis, as the number that stages compute with; neighbours beyond the grid are its border.
pub(super) fn number(frame: &Frame<'_>, dims: [usize; 3], cell: [usize; 3], steps: [usize; 3]) -> f64 {
    let [x, y, z] = std::array::from_fn(|a| (cell[a] + steps[a]).min(dims[a] - 1));
    let at = x + dims[0] * (y + dims[1] * z);
    let stored = crate::volume::with_slices!(frame.sample.voxels, v => crate::lanes::Number::to_f64(v[at]));
    frame.sample.to_f32.map_or(stored, |map| stored * map.gain - map.bias)
}

/// The eight voxels of a cell; corner c is c & 1 from it along x, c >> 1 & 1 along y, c >> 2 along z.
fn corners_of(frame: &Frame<'_>, dims: [usize; 3], cell: [usize; 3]) -> [f64; 8] {
    std::array::from_fn(|c| number(frame, dims, cell, [c & 1, c >> 1 & 1, c >> 2]))
}

/// The mean of eight corners, each weighted by the part of the cell that lies opposite to it.
pub(super) fn trilinear(corners: [f64; 8], weight: [f64; 3]) -> f64 {
    (0..8).map(|c| (0..3).map(|a| if c >> a & 1 == 1 { weight[a] } else { 1.0 - weight[a] }).product::<f64>() * corners[c]).sum()
}

/// Position of fragment `i` in its cell.
pub(super) fn weight(b: &Batch, i: usize) -> [f64; 3] {
    std::array::from_fn(|a| f64::from(b.sample.weight[a][i]))
}

/// Fragment `i` has the value between its cell's corners; none that is finite where a corner is NaN or infinite.
fn hold_value(got: f32, corners: [f64; 8], weight: [f64; 3], level: &str, i: usize) {
    if corners.iter().any(|c| !c.is_finite()) {
        assert!(!got.is_finite(), "{got} between {corners:?} at {level}");
        return;
    }
    let (least, most) = corners.iter().fold((f64::MAX, f64::MIN), |(a, b), &c| (a.min(c), b.max(c)));
    // Three interpolations, each of which rounds a difference, a product and a sum; and the corners themselves.
    let bound = ROUNDING * (6.0 * (most - least) + 4.0 * least.abs().max(most.abs()));
    assert_near(got, trilinear(corners, weight), bound, level, i);
}

/// Grids to look up in: with an axis of one voxel too, where lookups go by strides alone.
fn grids(any_strides: bool) -> Vec<[usize; 3]> {
    if any_strides { vec![DIMS, [9, 1, 7], [1, 11, 4], [6, 5, 1], [1, 1, 1]] } else { vec![DIMS, [6, 5, 4]] }
}

/// Many batches in voxels of each type of `kinds`, as they lie; some of them rescaled on the way where `single` voxels are looked up.
fn each_unpacked(kinds: &[VoxelType], single: bool, far: bool, mut hold: impl FnMut(&Frame<'_>, [usize; 3], &Batch, &Cells)) {
    let mut n = Numbers::new(31);
    for &kind in kinds {
        for dims in grids(single) {
            let voxels = voxels(kind, dims, &mut n);
            let mut frame = frame(&voxels, &mut n);
            (frame.sample.strides, frame.sample.far) = (strides(dims), far);
            for round in 0..30 {
                let maps = [None, Some(ToF32 { gain: 0.125, bias: 17.3 }), Some(ToF32 { gain: -1.0, bias: -40.0 })];
                frame.sample.to_f32 = if single { maps[round % 3] } else { None };
                let mut before = batch(&mut n);
                let cells = place(&mut n, &mut before, dims, frame.sample.strides);
                hold(&frame, dims, &before, &cells);
            }
        }
    }
}

/// Values of listed rows are interpolated, those of others stay.
fn hold_unpacked<K: for<'v> Kernel<Frame<'v>, Batch>>(kinds: &[VoxelType], single: bool, far: bool) {
    each_unpacked(kinds, single, far, |frame, dims, before, cells| {
        // Corners are only on their way to the value.
        run::<K>(frame, before, &[Part::Value, Part::Corners], |after, level| {
            for i in 0..BATCH {
                if listed(before.rows, i) {
                    hold_value(after.sample.value[i], corners_of(frame, dims, cells[i]), weight(before, i), level, i);
                } else if !far {
                    assert_same(after.sample.value[i], before.sample.value[i], level, i);
                }
            }
        });
    });
}

#[test]
pub(super) fn pairs_of_8_bits() {
    hold_unpacked::<FetchPairs8>(&[VoxelType::U8, VoxelType::I8], false, false);
}

#[test]
pub(super) fn pairs_of_16_bits() {
    hold_unpacked::<FetchPairs16>(&[VoxelType::U16, VoxelType::I16], false, false);
}

#[test]
pub(super) fn pairs_of_32_bits() {
    hold_unpacked::<FetchPairs32>(&[VoxelType::U32, VoxelType::I32, VoxelType::F32], false, false);
}

#[test]
pub(super) fn single_voxels() {
    hold_unpacked::<FetchAny<false>>(&VoxelType::ALL, true, false);
    hold_unpacked::<FetchAny<true>>(&VoxelType::ALL, true, true);
}

/// Packed voxels give the values that they stand for. Rows around which no voxel lies above `hidden_up_to` may be left out, if little of the
/// batch before showed; a row with such a voxel never is.
fn hold_packed<K: for<'v> Kernel<Frame<'v>, Batch>>(kinds: &[VoxelType]) {
    let mut n = Numbers::new(32);
    // Layers of the last grid and rows of the one before it have gaps behind them.
    for (&kind, dims) in kinds.iter().flat_map(|kind| [DIMS, [2, 5, 4], [1024, 3, 2], [256, 40, 5]].map(|dims| (kind, dims))) {
        let voxels = voxels(kind, dims, &mut n);
        let packed = Packed::new(&voxels, dims).expect("small enough");
        let mut frame = frame(&voxels, &mut n);
        frame.sample.packed = Some(&packed);
        frame.sample.strides = [1, packed.strides[0], packed.strides[1]];
        let (least, most) = kind.limits();
        // About every second row has nothing above it.
        let limit = (least + 0.992 * (most - least)) as i32;
        for round in 0..60 {
            frame.sample.hidden_up_to = if round % 3 == 0 { None } else { Some(limit) };
            let mut before = batch(&mut n);
            (before.shown, before.mostly_hidden) = (before.rows, n.bits() % 2 == 0);
            let cells = place(&mut n, &mut before, dims, frame.sample.strides);
            let may_hide = before.mostly_hidden && frame.sample.hidden_up_to.is_some();
            run::<K>(&frame, &before, &[Part::Value, Part::Shown], |after, level| {
                assert_eq!(after.shown & !before.rows, 0, "rows that are not listed, at {level}");
                for i in 0..BATCH {
                    let corners = corners_of(&frame, dims, cells[i]);
                    if listed(after.shown, i) {
                        hold_value(after.sample.value[i], corners, weight(&before, i), level, i);
                    } else if listed(before.rows, i) {
                        let dark = corners.iter().all(|&c| c <= f64::from(limit));
                        assert!(may_hide && dark, "row of fragment {i} with {corners:?} left out at {level}");
                    } else {
                        assert_same(after.sample.value[i], before.sample.value[i], level, i);
                    }
                }
            });
        }
    }
}

#[test]
pub(super) fn packed_8_bits() {
    hold_packed::<FetchPacked8>(&[VoxelType::U8, VoxelType::I8]);
}

#[test]
pub(super) fn packed_16_bits() {
    hold_packed::<FetchPacked16>(&[VoxelType::U16, VoxelType::I16]);
}

/// The voxel that each fragment lies nearest to; the upper one of two at the same distance.
fn hold_nearest<const FAR: bool>() {
    each_unpacked(&VoxelType::ALL, true, FAR, |frame, dims, before, cells| {
        run::<FetchNearest<FAR>>(frame, before, &[Part::Value], |after, level| {
            for i in 0..BATCH {
                let steps = weight(before, i).map(|w| if w < 0.5 { 0 } else { 1 });
                let want = if listed(before.rows, i) { number(frame, dims, cells[i], steps) as f32 } else { before.sample.value[i] };
                assert_same(after.sample.value[i], want, level, i);
            }
        });
    });
}

#[test]
pub(super) fn nearest_voxels() {
    hold_nearest::<false>();
    hold_nearest::<true>();
}

/// The nearest voxel's place between the knots of a transfer function, and its number beside it.
fn hold_labels<const FAR: bool>() {
    each_unpacked(&VoxelType::ALL, true, FAR, |frame, dims, before, cells| {
        let piece = |from, width, first, intervals| LabelPiece { from, width, first, intervals };
        let pieces = vec![
            piece(-40.0, f64::INFINITY, 0.0, 0.0),
            piece(-40.0, 120.5, 1.0, 8.0),
            piece(80.5, 0.25, 10.0, 1.0),
            piece(80.75, 5e6, 12.0, 64.0),
            piece(80.75 + 5e6, f64::INFINITY, 77.0, 0.0),
        ];
        let mut frame = frame.clone();
        frame.sample.labels = Some(Arc::new(LabelFrame { rescale: (0.5, 3.0), pieces: pieces.clone() }));
        run::<FetchLabels<FAR>>(&frame, before, &[Part::Value], |after, level| {
            for i in (0..BATCH).filter(|&i| listed(before.rows, i)) {
                let steps = weight(before, i).map(|w| if w < 0.5 { 0 } else { 1 });
                let number = number(&frame, dims, cells[i], steps);
                assert_same(after.numbers.as_deref().unwrap()[i], number as f32, level, i);
                // Of frames without a conversion the number is the stored value.
                let value = 0.5 * number + 3.0;
                let want = match pieces.iter().skip(1).rev().find(|p| p.from <= value) {
                    _ if !value.is_finite() => f64::NAN,
                    None => 0.0,
                    Some(p) => p.first + p.intervals * ((value - p.from) / p.width).min(1.0),
                };
                if frame.sample.to_f32.is_none() && (want.is_nan() || number == f64::from(number as f32)) {
                    assert!(after.sample.value[i].is_nan() == want.is_nan(), "{value} at {level}");
                    if !want.is_nan() {
                        assert_near(after.sample.value[i], want, ROUNDING * want, level, i);
                    }
                }
            }
        });
    });
}

#[test]
pub(super) fn labels() {
    hold_labels::<false>();
    hold_labels::<true>();
}

fn hold_corners<const FAR: bool>() {
    each_unpacked(&VoxelType::ALL, true, FAR, |frame, dims, before, cells| {
        run::<FetchCorners<FAR>>(frame, before, &[Part::Corners], |after, level| {
            for i in 0..BATCH {
                let want = corners_of(frame, dims, cells[i]);
                for c in 0..8 {
                    if listed(before.rows, i) {
                        assert_same(after.rare.corners.0[c][i], want[c] as f32, level, i);
                    } else if !FAR {
                        assert_same(after.rare.corners.0[c][i], before.rare.corners.0[c][i], level, i);
                    }
                }
            }
        });
    });
}

#[test]
pub(super) fn corners() {
    hold_corners::<false>();
    hold_corners::<true>();
}

/// Fragments whose value is NaN or infinite are not covered, and get a finite value in its place.
#[test]
pub(super) fn guard() {
    let mut n = Numbers::new(33);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let mut before = batch(&mut n);
        for i in 0..BATCH {
            let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN];
            if n.bits() % 4 == 0 {
                before.sample.value[i] = special[n.bits() as usize % special.len()];
            }
        }
        run::<Guard>(&frame, &before, &[Part::Value, Part::Mask], |after, level| {
            for i in 0..BATCH {
                let value = before.sample.value[i];
                let taken_out = listed(before.rows, i) && !value.is_finite();
                assert_eq!(bit(after.mask, i), bit(before.mask, i) && !taken_out, "{value} at {level}");
                if taken_out {
                    assert!(after.sample.value[i].is_finite(), "{} at {level}", after.sample.value[i]);
                } else {
                    assert_same(after.sample.value[i], value, level, i);
                }
            }
        });
    }
}

/// The values of the slice before move one place on, and those of this slice take theirs.
#[test]
pub(super) fn keep() {
    let mut n = Numbers::new(34);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..100 {
        let before = batch(&mut n);
        run::<KeepValue>(&frame, &before, &[Part::Previous], |after, level| {
            for i in 0..BATCH {
                let old = [before.pixels.previous[0][i], before.pixels.previous[1][i]];
                let want = if listed(before.rows, i) { [before.sample.value[i], old[0]] } else { old };
                (0..2).for_each(|k| assert_same(after.pixels.previous[k][i], want[k], level, i));
            }
        });
    }
}
