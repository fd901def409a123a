//! Twins of what goes by the place of a fragment: regions, and segments of a label map.

use super::*;
use crate::fragment::regions::ClassifyRegions;
use crate::fragment::segments::{ApplySegments, HideSegments};
use crate::scene::{FocusRegion, FocusShape, TransferFunction};
use crate::volume::Grid;
use glam::{DMat3, DVec3};

/// Index coordinates of the base voxel of a batch, whose voxels lie in a grid of [`DIMS`].
fn base(batch: &Batch) -> [usize; 3] {
    let at = batch.geometry.cells.base;
    [at % DIMS[0], at / DIMS[0] % DIMS[1], at / (DIMS[0] * DIMS[1])]
}

/// Index coordinates of fragment `i` along `axis`.
fn place(batch: &Batch, i: usize, axis: usize) -> f64 {
    let g = &batch.geometry;
    let (column, row) = ((i % SIDE) as f64, (i / SIDE) as f64);
    base(batch)[axis] as f64 + f64::from(g.origin[axis]) + column * f64::from(g.across[axis]) + row * f64::from(g.down[axis])
}

#[test]
pub(super) fn regions() {
    let mut n = Numbers::new(131);
    let grid =
        Grid::new(DIMS, DVec3::new(3.0, -7.0, 11.0), DMat3::from_cols(DVec3::X, DVec3::new(0.2, -1.3, 0.0), DVec3::new(-0.1, 0.3, 0.8)));
    let grid = grid.expect("a grid");
    let (mut inside, mut outside) = (0, 0);
    for round in 0..60 {
        let voxels = voxels(VoxelType::U8, DIMS, &mut n);
        let mut frame = frame(&voxels, &mut n);
        let mut before = batch(&mut n);
        let any = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).expect("a transfer function");
        let list: Vec<FocusRegion> = (0..1 + round % 3)
            .map(|_| {
                let at: [f64; 3] = std::array::from_fn(|axis| place(&before, (n.bits() % 64) as usize, axis));
                let center = grid.index_to_world().transform_point3(DVec3::from_array(at));
                let size = [n.between(0.5, 8.0), n.between(0.5, 8.0), n.between(0.5, 8.0)];
                let shape = if n.bits() % 2 == 0 { FocusShape::Sphere { radius: size[0] } } else { FocusShape::Box { size } };
                FocusRegion::new(shape, center, any.clone()).expect("a region")
            })
            .collect();
        let tables: Vec<[Vec<[f32; 4]>; 2]> = list.iter().map(|_| [colors(&mut n, 32, 8), colors(&mut n, 32, 0)]).collect();
        let color = |table: &Vec<[f32; 4]>| ColorFrame {
            table: Arc::new(LookupTable::new(table)),
            low: 20.0,
            scale: [0.5, 0.25],
            last: 31.0,
            fine: None,
            first_visible: 0.0,
        };
        let leave_out = round % 2 == 0;
        let regions = list.iter().zip(&tables);
        let regions = regions.map(|(r, [own, thin])| FocusFrame::new(r, &grid, color(own), Some(Arc::new(LookupTable::new(thin)))));
        frame.optional.regions = Some(RegionsFrame { regions: regions.collect(), leave_out });
        before.shown &= some_rows(&mut n);
        run::<ClassifyRegions>(&frame, &before, &[Part::Shown, Part::Color, Part::Alpha, Part::Thinness], |after, level| {
            let mut doubtful = [false; SIDE];
            for i in (0..BATCH).filter(|&i| listed(before.rows, i)) {
                let at = DVec3::from_array(std::array::from_fn(|axis| place(&before, i, axis)));
                let point = grid.index_to_world().transform_point3(at);
                // Beside a face rounding decides.
                let near =
                    |r: &FocusRegion| [-1e-4, 1e-4].iter().any(|d| (0..3).any(|a| r.holds(point + DVec3::AXES[a] * *d) != r.holds(point)));
                if list.iter().any(near) {
                    doubtful[i / SIDE] = true;
                    continue;
                }
                let shown = listed(before.shown, i);
                let got = [after.slab.color[0][i], after.slab.color[1][i], after.slab.color[2][i], after.slab.alpha[i]];
                let thin = after.thinness.as_deref().expect("thinness")[i];
                match list.iter().position(|r| r.holds(point)) {
                    None => {
                        outside += 1;
                        let was = [before.slab.color[0][i], before.slab.color[1][i], before.slab.color[2][i], before.slab.alpha[i]];
                        let was = if shown || !listed(after.shown, i) { was } else { [0.0; 4] };
                        // Rows left out are nobody's.
                        let kept = shown || listed(after.shown, i);
                        assert!(!kept || got == was, "{got:?} not {was:?} at {level}");
                        assert_same(thin, before.thinness.as_deref().expect("thinness")[i], level, i);
                    }
                    Some(region) => {
                        inside += 1;
                        let x = ((f64::from(before.sample.value[i]) - 20.0) * 0.125).clamp(0.0, 31.0);
                        let between = |table: &[[f32; 4]], c: usize| {
                            let (low, high) = (f64::from(table[x as usize][c]), f64::from(table[(x as usize + 1).min(31)][c]));
                            low + (high - low) * x.fract()
                        };
                        for c in 0..4 {
                            assert_near(got[c], between(&tables[region][0], c), 60.0 * ROUNDING, level, i);
                        }
                        assert_near(thin, between(&tables[region][1], 3), 60.0 * ROUNDING, level, i);
                    }
                }
            }
            for r in (0..SIDE).filter(|&r| before.rows >> r & 1 == 1 && !doubtful[r]) {
                let lanes = r * SIDE..(r + 1) * SIDE;
                let held = lanes.clone().any(|i| {
                    let at = DVec3::from_array(std::array::from_fn(|axis| place(&before, i, axis)));
                    list.iter().any(|region| region.holds(grid.index_to_world().transform_point3(at)))
                });
                let some = lanes.clone().any(|i| after.slab.alpha[i] > 0.0);
                let was = before.shown >> r & 1 == 1;
                let want = if !held { was } else { some || !leave_out };
                assert_eq!(after.shown >> r & 1 == 1, want, "row {r} at {level}");
            }
        });
    }
    assert!(inside > 2000 && outside > 2000, "{inside} inside, {outside} outside");
}

/// Effects on `count` labels.
fn effects(n: &mut Numbers, count: usize) -> Vec<Effect> {
    (0..count)
        .map(|_| match n.bits() % 4 {
            0 => Effect::SHOW,
            1 => Effect::HIDE,
            2 => Effect { keep: n.unit32(), mix: [0; 3].map(|_| n.unit32()), ..Effect::SHOW },
            _ => Effect { add: [0; 3].map(|_| n.unit32()), add_alpha: 0.1 + n.unit32(), thinness: n.unit32(), ..Effect::HIDE },
        })
        .collect()
}

/// Hands a batch in a volume with labels to `check`, with the effect on each of its fragments; `None` next to where the nearest voxel changes.
fn with_labels(seed: u64, mut check: impl FnMut(&Frame<'_>, &Batch, &[Option<Effect>], bool)) {
    let mut n = Numbers::new(seed);
    for round in 0..60 {
        let values = voxels(VoxelType::U8, DIMS, &mut n);
        let few = Voxels::U8((0..values.len()).map(|_| (n.bits() % 9) as u8).collect());
        let wide = Voxels::U16((0..values.len()).map(|_| (n.bits() % 500) as u16).collect());
        let (places, count) = if round % 2 == 0 { (&few, 9) } else { (&wide, 500) };
        let effects = effects(&mut n, count);
        let mut frame = frame(&values, &mut n);
        let leave_out = round % 3 == 0;
        frame.optional.segments =
            Some(SegmentsFrame { places: places.slices(), strides: [DIMS[0], DIMS[0] * DIMS[1]], effects: effects.clone(), leave_out });
        let mut before = batch(&mut n);
        before.shown &= some_rows(&mut n);
        let own: Vec<Option<Effect>> = (0..BATCH)
            .map(|i| {
                let mut voxel = [0; 3];
                for axis in 0..3 {
                    // No lookup lies before the base voxel.
                    let at = place(&before, i, axis).clamp(base(&before)[axis] as f64, DIMS[axis] as f64 - 1.0);
                    if (at.fract() - 0.5).abs() < 1e-4 {
                        return None;
                    }
                    voxel[axis] = (at + 0.5) as usize;
                }
                Some(effects[places.get((voxel[2] * DIMS[1] + voxel[1]) * DIMS[0] + voxel[0]) as usize])
            })
            .collect();
        check(&frame, &before, &own, leave_out);
    }
}

#[test]
pub(super) fn segments() {
    let mut changed = 0;
    with_labels(132, |frame, before, effects, leave_out| {
        run::<ApplySegments>(frame, before, &[Part::Shown, Part::Color, Part::Alpha, Part::Thinness], |after, level| {
            for r in (0..SIDE).filter(|&r| before.rows >> r & 1 == 1) {
                let lanes = r * SIDE..(r + 1) * SIDE;
                let Some(of) = effects[lanes.clone()].iter().copied().collect::<Option<Vec<Effect>>>() else { continue };
                let shown = before.shown >> r & 1 == 1;
                if of.iter().all(|e| *e == Effect::SHOW) || !shown && of.iter().all(|e| e.add_alpha == 0.0) {
                    assert_eq!(after.shown >> r & 1 == 1, shown, "row {r} at {level}");
                    continue;
                }
                changed += 1;
                for (i, effect) in lanes.clone().zip(&of) {
                    // What an earlier slice left there counts for nothing.
                    let of = |x: f32| if shown { f64::from(x) } else { 0.0 };
                    let [red, green, blue] = [0, 1, 2].map(|c: usize| of(before.slab.color[c][i]));
                    let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
                    for (c, own) in [red, green, blue].into_iter().enumerate() {
                        let want = own * f64::from(effect.keep) + luminance * f64::from(effect.mix[c]) + f64::from(effect.add[c]);
                        assert_near(after.slab.color[c][i], want, 8.0 * ROUNDING, level, i);
                    }
                    let alpha = of(before.slab.alpha[i]) * f64::from(effect.keep_alpha) + f64::from(effect.add_alpha);
                    assert_near(after.slab.alpha[i], alpha, 2.0 * ROUNDING, level, i);
                    let thin = before.thinness.as_deref().expect("thinness")[i];
                    let want = if effect.keep_alpha == 0.0 { effect.thinness } else { thin };
                    assert_same(after.thinness.as_deref().expect("thinness")[i], want, level, i);
                }
                let some = lanes.clone().any(|i| after.slab.alpha[i] > 0.0);
                assert_eq!(after.shown >> r & 1 == 1, some || shown && !leave_out, "row {r} at {level}");
            }
        });
    });
    assert!(changed > 500, "{changed}");
}

#[test]
pub(super) fn hidden_segments_of_projections() {
    let mut hidden = 0;
    with_labels(133, |frame, before, effects, _| {
        run::<HideSegments>(frame, before, &[Part::Mask], |after, level| {
            for (i, effect) in effects.iter().enumerate() {
                let Some(effect) = effect else { continue };
                let hides = listed(before.rows, i) && *effect == Effect::HIDE;
                hidden += usize::from(hides);
                assert_eq!(bit(after.mask, i), bit(before.mask, i) && !hides, "fragment {i} at {level}");
            }
        });
    });
    assert!(hidden > 1000, "{hidden}");
}
