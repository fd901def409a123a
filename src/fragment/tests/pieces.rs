//! Twins of the stages that keep the optical depth of opaque slabs.

use super::classify::between_entries;
use super::*;

/// A slab of optical depth tau, opacity 1 - exp(-tau): its pieces have 1 - exp(-tau length), whatever is left of tau in the opacity.
#[test]
pub(super) fn correct() {
    let mut n = Numbers::new(71);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    let mut deep = 0;
    for _ in 0..300 {
        let mut before = batch(&mut n);
        let mut depths = [0.0; BATCH];
        let mut thinness = [0.0; BATCH];
        for i in 0..BATCH {
            let depth = [0.0, n.between(0.0, 3.0), n.between(2.0, 20.0), libm::exp(n.between(0.0, 40.0)), f64::INFINITY];
            depths[i] = depth[n.bits() as usize % 5];
            thinness[i] = (1.0 / (1.0 + depths[i])) as f32;
            before.slab.alpha[i] = -libm::expm1(-depths[i]) as f32;
            before.slab.length[i] = match n.bits() % 5 {
                0 => 1.0,
                1 => 1.0 + 2.0 * n.unit32(),
                2 => n.unit32(),
                3 => 0.0,
                _ => libm::exp(n.between(-40.0, 0.0)) as f32,
            };
            (0..3).for_each(|c| before.slab.color[c][i] = n.unit32() * before.slab.alpha[i]);
        }
        before.thinness = Some(Box::new(thinness));
        run::<CorrectPieces>(&frame, &before, &[Part::Color, Part::Alpha], |after, level| {
            for i in 0..BATCH {
                let (alpha, length) = (before.slab.alpha[i], before.slab.length[i]);
                let colors = |b: &Batch| [b.slab.color[0][i], b.slab.color[1][i], b.slab.color[2][i], b.slab.alpha[i]];
                let (got, old) = (colors(after), colors(&before));
                if !listed(before.shown, i) || length == 1.0 {
                    (0..4).for_each(|c| assert_same(got[c], old[c], level, i));
                    continue;
                }
                assert!(got.iter().all(|x| (0.0..=1.0).contains(x)), "{got:?} at {level}");
                if !bit(before.mask, i) {
                    continue;
                }
                let by_depth = length < 1.0 && alpha >= DEEP;
                deep += u32::from(by_depth && alpha == 1.0);
                // By the opacity its own rounding counts, of f32 below 1.
                let depth = if by_depth { depths[i] } else { -libm::log1p(-f64::from(alpha)) };
                let want = if length == 0.0 { 0.0 } else { -libm::expm1(-depth * f64::from(length)) };
                // An exact depth: what is left is the rounding of thinness, of the depth made of it, of the exponent and of the result.
                assert_near(got[3], want, 24.0 * ROUNDING * want, level, i);
                for c in 0..3 {
                    let color = if alpha > 0.0 { f64::from(old[c]) / f64::from(alpha) * want } else { 0.0 };
                    assert_near(got[c], color, 28.0 * ROUNDING * color, level, i);
                }
            }
        });
    }
    assert!(deep > 1000, "{deep} pieces of slabs whose opacity is rounded to 1");
}

/// A thinness that does not go with the opacity is one of those that round to it.
#[test]
fn thinness_beside_the_opacity_is_held_within_its_rounding() {
    let mut n = Numbers::new(72);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for thin in [0.0, 0.01, 0.99] {
        let mut before = batch(&mut n);
        (before.mask, before.shown) = (u64::MAX, u8::MAX);
        before.slab.length = [0.25; BATCH];
        before.slab.alpha = std::array::from_fn(|i| 0.9 + 0.0015 * i as f32);
        before.thinness = Some(Box::new([thin; BATCH]));
        run::<CorrectPieces>(&frame, &before, &[Part::Color, Part::Alpha], |after, level| {
            for i in 0..BATCH {
                let alpha = f64::from(before.slab.alpha[i]);
                let want = -libm::expm1(0.25 * libm::log1p(-alpha));
                let rounded = 0.25 * (1.0 - want) * 2.2e-7 / (1.0 - alpha);
                assert_near(after.slab.alpha[i], want, rounded + 16.0 * ROUNDING, level, i);
            }
        });
    }
}

/// The thinness of whole slabs is looked up beside their colours, where a covered piece is shorter than its slab; the colours are those of
/// classification alone.
#[test]
pub(super) fn thinness() {
    let mut n = Numbers::new(73);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let (mut short, mut long) = (0, 0);
    for round in 0..100 {
        let mut frame = frame(&none, &mut n);
        let mut thin = frame.clone();
        let entries: Vec<[f32; 4]> = (0..64).map(|_| [0.0, 0.0, 0.0, n.unit32()]).collect();
        thin.color.table = Arc::new(LookupTable::new(&entries));
        for level in Level::available() {
            let classify = level.kernel::<Classify<false>, Frame<'_>, Batch>();
            frame.pieces = Some(Box::new(PieceFrame { frame: thin.clone(), classify }));
            let mut before = batch(&mut n);
            if round % 2 == 0 {
                before.slab.length.iter_mut().for_each(|l| *l = l.max(1.0));
            }
            let (mut after, mut alone) = (before.clone(), before.clone());
            classify_pieces(&frame, &mut after);
            classify(&frame, &mut alone);
            for part in Part::ALL.into_iter().filter(|&part| part != Part::Thinness) {
                assert_eq!(part.bits(&after), part.bits(&alone), "{part:?} at {}", level.name());
            }
            let any = (0..BATCH).any(|i| bit(before.mask, i) && before.slab.length[i] < 1.0);
            (short, long) = (short + u32::from(any), long + u32::from(!any));
            let (old, new) = (before.thinness.as_deref().unwrap(), after.thinness.as_deref().unwrap());
            for i in 0..BATCH {
                if !any {
                    assert_same(new[i], old[i], level.name(), i);
                } else if listed(after.shown, i) {
                    let place = ((f64::from(before.sample.value[i]) - 3.0) * f64::from(0.21f32)).clamp(0.0, 63.0);
                    assert_near(new[i], between_entries(&entries, place)[3], 63.0 * 4.0 * ROUNDING * 4.0, level.name(), i);
                }
            }
        }
    }
    assert!(short > 100 && long > 100, "{short} {long}");
}

/// Slabs between two values find the values of earlier slices as if classification had run once.
#[test]
fn values_of_earlier_slices_are_kept_once() {
    let mut n = Numbers::new(74);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let mut frame = frame(&none, &mut n);
    let entries = colors(&mut n, 64 * 64, 0);
    frame.color.table = Arc::new(LookupTable::new(&entries));
    for level in Level::available() {
        let classify = level.kernel::<ClassifyPair<false, true, false>, Frame<'_>, Batch>();
        frame.pieces = None;
        frame.pieces = Some(Box::new(PieceFrame { frame: frame.clone(), classify }));
        let before = batch(&mut n);
        let (mut after, mut alone) = (before.clone(), before.clone());
        classify_pieces(&frame, &mut after);
        classify(&frame, &mut alone);
        for part in [Part::Previous, Part::Color, Part::Alpha, Part::Shown] {
            assert_eq!(part.bits(&after), part.bits(&alone), "{part:?} at {}", level.name());
        }
    }
}
