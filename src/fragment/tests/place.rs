//! Twins of the stages that find out which fragments a slice covers, and where in the volume they lie.

use super::batch::Geometry;
use super::*;

/// Slices from a pixel's first to its last cover it. A piece is one slab long, but for the first and the last of a ray, which have
/// lengths of their own; `between` slabs lie before their slices, and have no last piece here. All lengths are stretched by the slant.
fn hold_spans<K: for<'v> Kernel<Frame<'v>, Batch>>(between: bool) {
    let mut n = Numbers::new(21);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..300 {
        let before = batch(&mut n);
        run::<K>(&frame, &before, &[Part::Mask, Part::Ended, Part::Length], |after, level| {
            for i in 0..BATCH {
                let (first, last, slice) = (before.pixels.first[i], before.pixels.last[i], before.slice);
                assert_eq!(bit(after.mask, i), first <= slice && slice <= last, "{slice} of {first} to {last} at {level}");
                assert_eq!(bit(after.ended, i), last < slice, "{slice} of {first} to {last} at {level}");
                let piece = if slice == first {
                    before.pixels.first_length[i]
                } else if slice == last && !between {
                    before.pixels.last_length[i]
                } else {
                    1.0
                };
                let want = f64::from(piece) * f64::from(before.pixels.slant[i]);
                if bit(after.mask, i) {
                    assert_near(after.slab.length[i], want, ROUNDING * want, level, i);
                } else {
                    assert!(after.slab.length[i].is_finite(), "at {level}");
                }
            }
        });
    }
}

#[test]
pub(super) fn spans() {
    hold_spans::<Span>(false);
}

#[test]
pub(super) fn spans_of_slabs_between_slices() {
    hold_spans::<SpanPair>(true);
}

/// Spreads a block's index coordinates between three random points, along each axis between `least` and `most`.
fn spread_block(n: &mut Numbers, g: &mut Geometry, least: [f64; 3], most: [f64; 3]) {
    for axis in 0..3 {
        let [start, right, below] = std::array::from_fn(|_| n.between(least[axis], most[axis]));
        // Columns and rows up to 7: weights of the three points that add up to 1.
        g.origin[axis] = start as f32;
        g.across[axis] = ((right - start) / 14.0) as f32;
        g.down[axis] = ((below - start) / 14.0) as f32;
    }
}

/// A random block in and around a grid of `dims`, or `inner`: inside of it. Returns its base cell too.
fn place_block(n: &mut Numbers, dims: [usize; 3], inner: bool) -> (Box<Batch>, [usize; 3]) {
    let mut b = batch(n);
    let base = dims.map(|d| if d > 2 { n.bits() as usize % (d - 1) } else { 0 });
    let g = &mut b.geometry;
    g.inner = inner;
    g.top = std::array::from_fn(|a| (dims[a].saturating_sub(2) - base[a]) as f32);
    g.reach = std::array::from_fn(|a| if dims[a] > 1 { g.top[a] + 1.0 } else { 0.0 });
    let reach = g.reach.map(f64::from);
    if inner {
        spread_block(n, g, [0.01; 3], reach.map(|r| r - 0.01));
    } else {
        spread_block(n, g, reach.map(|r| -0.4 * r - 1.0), reach.map(|r| 1.4 * r + 1.0));
    }
    (b, base)
}

/// Index coordinate of fragment `i` along `axis`, relative to the base voxel, and the roundings of an f32 that computes it.
fn coordinate(g: &Geometry, axis: usize, i: usize) -> (f64, f64) {
    let [origin, across, down] = [g.origin, g.across, g.down].map(|v| f64::from(v[axis]));
    let (column, row) = ((i % SIDE) as f64, (i / SIDE) as f64);
    let size = origin.abs() + column * across.abs() + row * down.abs();
    (origin + column * across + row * down, 4.0 * ROUNDING * size)
}

/// The cell of an offset, counted along each axis from the one at offset 0.
fn cell_of(offset: u64, strides: [usize; 3]) -> [f64; 3] {
    let mut rest = offset;
    let mut cell = [0.0; 3];
    for axis in [2, 1, 0] {
        if strides[axis] > 0 {
            cell[axis] = (rest / strides[axis] as u64) as f64;
            rest %= strides[axis] as u64;
        }
    }
    assert_eq!(rest, 0, "offset {offset} lies in no cell of strides {strides:?}");
    cell
}

/// Cell plus weight is the index coordinate, clamped to the grid from `floor` on. The cell is the whole number at or below it, or the last cell,
/// whose upper border belongs to it.
fn hold_cell(before: &Batch, after: &Batch, (offset, strides): (u64, [usize; 3]), floor: [f32; 3], level: &str, i: usize) {
    let g = &before.geometry;
    let from_floor = cell_of(offset, strides);
    for axis in 0..3 {
        let [floor, top, reach] = [floor, g.top, g.reach].map(|v| f64::from(v[axis]));
        let (mut u, bound) = coordinate(g, axis, i);
        if !g.inner {
            u = u.clamp(floor, reach);
        }
        let cell = floor + from_floor[axis];
        let weight = f64::from(after.sample.weight[axis][i]);
        assert!((cell + weight - u).abs() <= bound, "{cell} + {weight} not {u}, axis {axis}, fragment {i} at {level}");
        // An axis of one voxel has one cell, in which nothing is interpolated.
        let last = cell == top;
        assert!(cell <= top && weight >= 0.0 && (weight < 1.0 || weight == 1.0 && last), "{cell} + {weight} of {top} at {level}");
    }
}

/// Random sides, one voxel long now and then unless the block lies `inside`.
fn sides(n: &mut Numbers, most: u64, inside: bool) -> [usize; 3] {
    std::array::from_fn(|_| if !inside && n.bits() % 5 == 0 { 1 } else { 2 + (n.bits() % (most - 1)) as usize })
}

#[test]
pub(super) fn cells() {
    let mut n = Numbers::new(22);
    let none = Voxels::zeros(VoxelType::U8, 1);
    for round in 0..400 {
        let inner = round % 3 == 0;
        let dims = sides(&mut n, 40, inner);
        let mut frame = frame(&none, &mut n);
        frame.sample.strides = strides(dims);
        let (before, _) = place_block(&mut n, dims, inner);
        run::<Texcoord>(&frame, &before, &[Part::Offset, Part::Weight], |after, level| {
            for i in 0..BATCH {
                if listed(before.rows, i) {
                    let offset = u64::try_from(after.sample.offset[i]).expect("offsets are not negative");
                    hold_cell(&before, after, (offset, frame.sample.strides), [0.0; 3], level, i);
                } else {
                    assert_eq!(after.sample.offset[i], before.sample.offset[i], "a row that is not listed, at {level}");
                    (0..3).for_each(|a| assert_same(after.sample.weight[a][i], before.sample.weight[a][i], level, i));
                }
            }
        });
    }
}

/// Lookups at far offsets read every lane, so that all of them have to lie in the volume.
#[test]
pub(super) fn cells_of_large_volumes() {
    let mut n = Numbers::new(23);
    let none = Voxels::zeros(VoxelType::U8, 1);
    for _ in 0..200 {
        let dims = sides(&mut n, 3000, false);
        let mut frame = frame(&none, &mut n);
        frame.sample.strides = strides(dims);
        let (before, _) = place_block(&mut n, dims, false);
        run::<TexcoordFar>(&frame, &before, &[Part::FarOffset, Part::Weight], |after, level| {
            for i in 0..BATCH {
                hold_cell(&before, after, (after.rare.far_offset[i], frame.sample.strides), [0.0; 3], level, i);
            }
        });
    }
}

/// A part of a volume, its voxels and its cells, as far as the stage knows of it.
fn hold_parts<const FAR: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let mut inside = 0;
    for _ in 0..300 {
        let dims = sides(n, 40, false);
        let (mut before, base) = place_block(n, dims, false);
        // The base voxel lies below all fragments, unless the volume ends there.
        for axis in (0..3).filter(|&axis| base[axis] > 0) {
            let least = [0, 7, 56, 63].map(|i| coordinate(&before.geometry, axis, i).0).into_iter().fold(f64::MAX, f64::min);
            before.geometry.origin[axis] += (0.01 - least.min(0.0)) as f32;
        }
        let whole = before.clone();
        let mut held = [0; 3];
        for axis in 0..3 {
            // First and last cell of the part; offsets count from the one of them that is nearest to the base.
            let cells = dims[axis].saturating_sub(1).max(1) as u64;
            let mut some_or = |end: u64| if n.bits() % 2 == 0 { end as usize } else { (n.bits() % cells) as usize };
            let (a, b) = (some_or(0), some_or(cells - 1));
            let (first, last) = (a.min(b), a.max(b));
            let own = base[axis].clamp(first, last);
            let g = &mut before.geometry;
            g.floor[axis] = own as f32 - base[axis] as f32;
            g.top[axis] = last as f32 - base[axis] as f32;
            g.reach[axis] = if dims[axis] > 1 { g.top[axis] + 1.0 } else { g.floor[axis] };
            held[axis] = if dims[axis] > 1 { last - first + 2 } else { 1 };
        }
        let mut frame = frame(&none, n);
        frame.sample.strides = strides(held);
        let sets = [if FAR { Part::FarOffset } else { Part::Offset }, Part::Weight];
        run::<TexcoordPart<FAR>>(&frame, &before, &sets, |after, level| {
            let mut of_whole = whole.clone();
            of_whole.rows = u8::MAX;
            Level::SCALAR.kernel::<Texcoord, Frame<'_>, Batch>()(&frame, &mut of_whole);
            for i in 0..BATCH {
                let offset = if FAR { after.rare.far_offset[i] } else { after.sample.offset[i] as u64 };
                hold_cell(&before, after, (offset, frame.sample.strides), before.geometry.floor, level, i);
                // Where the part holds the cell, positions are those of the whole, to the bit.
                let g = &before.geometry;
                let holds = |a: usize| {
                    let (u, _) = coordinate(g, a, i);
                    f64::from(g.floor[a]) + 1e-3 < u && u < f64::from(g.reach[a]) - 1e-3
                };
                if (0..3).all(holds) {
                    inside += 1;
                    (0..3).for_each(|a| assert_same(after.sample.weight[a][i], of_whole.sample.weight[a][i], level, i));
                }
            }
        });
    }
    assert!(inside > 1000, "{inside} fragments inside parts");
}

#[test]
pub(super) fn cells_of_parts() {
    let mut n = Numbers::new(24);
    hold_parts::<false>(&mut n);
    hold_parts::<true>(&mut n);
}
