//! Twins of the stages between classification and blending: correction for length, fog, mask.

use super::*;

/// A frame without voxels: these stages read none.
fn with_fog<'v>(n: &mut Numbers, none: &'v Voxels, mode: FogMode, weighted: bool) -> Frame<'v> {
    let mut frame = frame(none, n);
    frame.optional.fog = Some(FogFrame { mode, color: [0.2, 0.5, 0.9], weighted });
    frame
}

/// A slab of opacity A, `length` times as long: A' = 1 - (1 - A)^length, its colour scaled with it. Fragments that are not covered come to
/// nothing later: where `some` slabs are whole, their row may be left as it is for them.
fn hold_correct<const SOME: bool>(n: &mut Numbers) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, n);
    for _ in 0..300 {
        let mut before = batch(n);
        for i in 0..BATCH {
            let u = n.unit32();
            let alpha = [0.0, 1.0, u, u * u * u * u, 1e-6 * u, 1.0 - 1e-3 * u][n.bits() as usize % 6];
            before.slab.alpha[i] = alpha;
            (0..3).for_each(|c| before.slab.color[c][i] = n.unit32() * alpha);
            if n.bits() % 8 == 0 {
                before.slab.length[i] = n.between(1.0, 30.0) as f32;
            }
        }
        // Rows of whole slabs.
        for lanes in lanes_of_rows(n, 3) {
            before.slab.length[lanes].iter_mut().for_each(|l| *l = if n.bits() % 16 == 0 { 0.5 } else { 1.0 });
        }
        run::<Correct<SOME>>(&frame, &before, &[Part::Color, Part::Alpha], |after, level| {
            for i in 0..BATCH {
                let (alpha, length) = (before.slab.alpha[i], before.slab.length[i]);
                let whole = length == 1.0;
                let colors = |b: &Batch| [b.slab.color[0][i], b.slab.color[1][i], b.slab.color[2][i], b.slab.alpha[i]];
                let (got, old) = (colors(after), colors(&before));
                if !listed(before.shown, i) || whole {
                    (0..4).for_each(|c| assert_same(got[c], old[c], level, i));
                } else if SOME && !bit(before.mask, i) {
                    assert!(got.iter().all(|x| x.is_finite()), "{got:?} at {level}");
                } else {
                    let corrected = -libm::expm1(f64::from(length) * libm::log1p(-f64::from(alpha)));
                    let factor = if alpha > 0.0 { corrected / f64::from(alpha) } else { 0.0 };
                    // Logarithm and exponential are good to 3 and 2 units in the last place, each of them two roundings.
                    assert_near(got[3], corrected, 16.0 * ROUNDING * corrected, level, i);
                    for c in 0..3 {
                        let want = f64::from(old[c]) * factor;
                        assert_near(got[c], want, 18.0 * ROUNDING * want, level, i);
                    }
                }
            }
        });
    }
}

#[test]
pub(super) fn correct() {
    let mut n = Numbers::new(61);
    hold_correct::<false>(&mut n);
    hold_correct::<true>(&mut n);
}

/// Explicit Euler: opacity and colour are proportional to length.
#[test]
pub(super) fn correct_riemann() {
    let mut n = Numbers::new(62);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let before = batch(&mut n);
        run::<CorrectRiemann>(&frame, &before, &[Part::Color, Part::Alpha], |after, level| {
            for i in 0..BATCH {
                let length = if listed(before.shown, i) { f64::from(before.slab.length[i]) } else { 1.0 };
                let want = |old: f32| f64::from(old) * length;
                let alpha = want(before.slab.alpha[i]);
                assert_near(after.slab.alpha[i], alpha, ROUNDING * alpha, level, i);
                for c in 0..3 {
                    let color = want(before.slab.color[c][i]);
                    assert_near(after.slab.color[c][i], color, ROUNDING * color, level, i);
                }
            }
        });
    }
}

/// C' = f C + (1 - f) A C_fog in shown rows, without A where fog is not weighted; f by fragment, with how far it may be off, or nothing where
/// rounding decides between two factors.
fn hold_fog<K>(frame: &Frame<'_>, before: &Batch, factor: impl Fn(usize) -> Option<(f64, f64)>)
where
    K: for<'v> Kernel<Frame<'v>, Batch>,
{
    run::<K>(frame, before, &[Part::Color], |after, level| {
        for i in 0..BATCH {
            for c in 0..3 {
                let (got, old) = (after.slab.color[c][i], before.slab.color[c][i]);
                let Some(fog) = frame.optional.fog.filter(|_| listed(before.shown, i)) else {
                    assert_same(got, old, level, i);
                    continue;
                };
                let Some((f, off)) = factor(i) else { continue };
                let amount = if fog.weighted { f64::from(before.slab.alpha[i]) } else { 1.0 };
                let (object, fog) = (f64::from(old), amount * f64::from(fog.color[c]));
                let want = f * object + (1.0 - f) * fog;
                assert_near(got, want, (object + fog) * off + 4.0 * ROUNDING * want, level, i);
            }
        }
    });
}

#[test]
pub(super) fn fog_of_a_slice() {
    let mut n = Numbers::new(63);
    let none = Voxels::zeros(VoxelType::U8, 1);
    for round in 0..100 {
        let mut frame = with_fog(&mut n, &none, FogMode::Exp { density: 0.3 }, round % 2 == 0);
        if round % 10 == 9 {
            frame.optional.fog = None;
        }
        let before = batch(&mut n);
        hold_fog::<FogPlanar>(&frame, &before, |_| Some((f64::from(before.fog.slice), 0.0)));
    }
}

#[test]
pub(super) fn fog_of_each_fragment() {
    let mut n = Numbers::new(64);
    let none = Voxels::zeros(VoxelType::U8, 1);
    for round in 0..100 {
        let mut frame = with_fog(&mut n, &none, FogMode::Exp { density: 0.3 }, round % 2 == 0);
        if round % 10 == 9 {
            frame.optional.fog = None;
        }
        let before = batch(&mut n);
        hold_fog::<FogEach>(&frame, &before, |i| Some((f64::from(before.fog.each[i]), 0.0)));
    }
}

/// OpenGL's factor at distance z from the eye, where z is off by three roundings; with how far an f32 may be off it.
fn factor(mode: FogMode, z: f64) -> Option<(f64, f64)> {
    let exponential = |exponent: f64, roundings: f64| {
        let f = libm::exp(-exponent);
        // An f32 has no smaller number than e^-87 to give.
        (f, (roundings * exponent + 4.0) * ROUNDING * f + 1e-37)
    };
    Some(match mode {
        FogMode::Linear { start, end } if start == end => {
            if (z - end).abs() <= 4.0 * ROUNDING * (z + end.abs()) {
                return None;
            }
            (f64::from(u8::from(z < end)), 0.0)
        }
        FogMode::Linear { start, end } => {
            let f = (end - z) / (end - start);
            (f.clamp(0.0, 1.0), 5.0 * ROUNDING * ((end.abs() + z) / (end - start).abs()) + 4.0 * ROUNDING * f.abs().min(2.0))
        }
        FogMode::Exp { density } => exponential(density * z, 5.0),
        FogMode::Exp2 { density } => exponential((density * z) * (density * z), 12.0),
    })
}

#[test]
pub(super) fn fog_by_distance() {
    let mut n = Numbers::new(65);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let modes = [
        FogMode::Linear { start: 1.0, end: 9.0 },
        FogMode::Linear { start: 8.0, end: 2.0 },
        FogMode::Linear { start: 5.0, end: 5.0 },
        FogMode::Linear { start: 3.0, end: 1e200 },
        FogMode::Exp { density: 0.3 },
        FogMode::Exp { density: 0.0 },
        FogMode::Exp { density: 1e30 },
        FogMode::Exp2 { density: 0.2 },
        FogMode::Exp2 { density: 1e30 },
    ];
    for round in 0..30 * modes.len() {
        let mode = modes[round % modes.len()];
        let frame = with_fog(&mut n, &none, mode, round / modes.len() % 2 == 0);
        let mut before = batch(&mut n);
        before.depth += 0.1;
        hold_fog::<FogRadial>(&frame, &before, |i| {
            let along = f64::from(before.depth) * f64::from(before.pixels.slant[i]);
            factor(mode, (along * along + f64::from(before.pixels.plane_squared[i])).sqrt())
        });
    }
}

#[test]
pub(super) fn fog_along_rays() {
    let mut n = Numbers::new(67);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let modes = [
        FogMode::Linear { start: 1.0, end: 9.0 },
        FogMode::Linear { start: 5.0, end: 5.0 },
        FogMode::Exp { density: 0.3 },
        FogMode::Exp2 { density: 0.2 },
    ];
    for round in 0..30 * modes.len() {
        let mode = modes[round % modes.len()];
        let frame = with_fog(&mut n, &none, mode, round / modes.len() % 2 == 0);
        let before = batch(&mut n);
        hold_fog::<FogAlong>(&frame, &before, |i| {
            let rays = before.rays.as_deref().expect("the batch has rays");
            let along = f64::from(rays.along[i]) + f64::from(before.slice) * f64::from(rays.along_step[i]);
            factor(mode, (along * along + f64::from(rays.aside_squared[i])).sqrt())
        });
    }
}

/// Fragments of shown rows that are not covered have neither colour nor opacity; others stay as they are.
#[test]
pub(super) fn mask() {
    let mut n = Numbers::new(66);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, &mut n);
    for _ in 0..200 {
        let mut before = batch(&mut n);
        // Whole rows too.
        before.mask |= (0..SIDE).map(|row| if n.bits() % 3 == 0 { 0xff << (SIDE * row) } else { 0 }).sum::<u64>();
        run::<MaskStage>(&frame, &before, &[Part::Color, Part::Alpha], |after, level| {
            for i in 0..BATCH {
                let cleared = listed(before.shown, i) && !bit(before.mask, i);
                let want = |old: f32| if cleared { 0.0 } else { old };
                assert_same(after.slab.alpha[i], want(before.slab.alpha[i]), level, i);
                (0..3).for_each(|c| assert_same(after.slab.color[c][i], want(before.slab.color[c][i]), level, i));
            }
        });
    }
}
