//! Twins of the stages of rays with samples of their own. Those of their fog and light stand with the other fogs and lights.

use super::*;

/// Index coordinates of sample `slice` of ray `i`, clamped to the volume, one ray at a time.
fn clamped(b: &Batch, axis: usize, i: usize) -> f64 {
    let rays = b.rays.as_deref().expect("the batch has rays");
    (rays.start[axis][i] + f64::from(b.slice) * rays.step[axis][i]).clamp(0.0, rays.last[axis])
}

/// Cell plus weight is the clamped index coordinate, counted from a base voxel at or below all of the block's cells; places count from it too.
fn hold_cells<const FAR: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    for round in 0..300 {
        let dims: [usize; 3] = std::array::from_fn(|_| if n.bits() % 5 == 0 { 1 } else { 2 + (n.bits() % 40) as usize });
        let mut frame = frame(&none, n);
        frame.sample.strides = strides(dims);
        frame.sample.far = FAR;
        let mut before = batch(n);
        let rays = before.rays.as_deref_mut().expect("the batch has rays");
        for axis in 0..3 {
            rays.top[axis] = dims[axis].saturating_sub(2) as f64;
            rays.last[axis] = (dims[axis] - 1) as f64;
            for i in 0..BATCH {
                // Within the volume and beyond it, and on voxels now and then.
                let last = rays.last[axis];
                rays.start[axis][i] = n.between(-0.3 * last - 1.0, 1.3 * last + 1.0);
                rays.step[axis][i] = n.between(-0.3, 0.3);
                if round % 4 == 0 {
                    (rays.start[axis][i], rays.step[axis][i]) = (libm::floor(rays.start[axis][i]), 0.0);
                }
            }
        }
        let sets = [if FAR { Part::FarOffset } else { Part::Offset }, Part::Weight, Part::Place];
        run::<TexcoordRays<FAR>>(&frame, &before, &sets, |after, level| {
            let base = after.geometry.cells.base as u64;
            for i in (0..BATCH).filter(|&i| FAR || listed(before.rows, i)) {
                let offset = if FAR { after.rare.far_offset[i] } else { after.sample.offset[i] as u64 };
                for axis in 0..3 {
                    let u = clamped(&before, axis, i);
                    let cell = libm::floor(u).min(dims[axis].saturating_sub(2) as f64);
                    let stride = frame.sample.strides[axis] as u64;
                    let (mut rest, mut low) = (base + offset, base);
                    for larger in (axis + 1..3).rev().filter(|&a| frame.sample.strides[a] > 0) {
                        rest %= frame.sample.strides[larger] as u64;
                        low %= frame.sample.strides[larger] as u64;
                    }
                    let [got, low] = [rest, low].map(|of| of.checked_div(stride).unwrap_or(0));
                    assert_eq!(got as f64, cell, "axis {axis}, ray {i} at {level}");
                    assert_near(after.sample.weight[axis][i], u - cell, ROUNDING, level, i);
                    let place = after.rays.as_deref().expect("the batch has rays").place[axis][i];
                    assert_near(place, u - low as f64, 2.0 * ROUNDING * dims[axis] as f64, level, i);
                    // What asks how far the batch reaches finds it.
                    assert!(f64::from(after.geometry.origin[axis]) + 1e-3 >= u - low as f64, "axis {axis}, ray {i} at {level}");
                }
            }
        });
    }
}

#[test]
pub(super) fn cells_along_rays() {
    let mut n = Numbers::new(91);
    hold_cells::<false>(&mut n);
    hold_cells::<true>(&mut n);
}

/// The base voxel and the places depend on the block's rays, not on the rows that take part: which pixels are finished changes no bit.
#[test]
fn rows_that_take_part_change_no_place() {
    let mut n = Numbers::new(92);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..50 {
        let mut all = batch(&mut n);
        let mut one = all.clone();
        (all.rows, one.rows) = (u8::MAX, 1 << (n.bits() % 8));
        let row = one.rows.trailing_zeros() as usize * SIDE..(one.rows.trailing_zeros() as usize + 1) * SIDE;
        let run = Level::best().kernel::<TexcoordRays<false>, Frame<'_>, Batch>();
        run(&frame, &mut all);
        run(&frame, &mut one);
        assert_eq!(one.geometry.cells.base, all.geometry.cells.base);
        assert_eq!(one.sample.offset[row.clone()], all.sample.offset[row.clone()]);
        let places = |b: &Batch| b.rays.as_deref().expect("the batch has rays").place.map(|p| p[row.clone()].to_vec());
        assert_eq!(places(&one), places(&all));
    }
}
