//! Twins of blending: premultiplied over, in both orders and in the numbers of three targets.

use super::*;

/// The numbers that sums are kept in.
#[derive(Clone, Copy, PartialEq)]
enum Kept {
    /// f32.
    Plain,
    /// f32, and what rounding has added to it.
    Compensated,
    /// Multiples of 1/255 from 0 to 1.
    Unorm8,
}

/// A batch whose pixels hold what earlier slices leave: sums as they are `kept`, and alive where light and slices are left.
fn gathered(n: &mut Numbers, frame: &Frame<'_>, kept: Kept) -> Box<Batch> {
    let mut b = batch(n);
    b.ends = n.bits() % 2 == 0;
    b.pixels.alive = 0;
    for i in 0..BATCH {
        if n.bits() % 6 == 0 {
            b.pixels.transmittance[i] = 1e-3 * n.unit32();
        }
        if kept == Kept::Unorm8 {
            b.pixels.transmittance[i] = (n.bits() % 256) as f32 / 255.0;
            (0..3).for_each(|c| b.pixels.color[c][i] = (n.bits() % 256) as f32 / 255.0);
        }
        if kept == Kept::Compensated {
            let mut excess = |sum: f32| (n.between(-0.9, 0.9) * ROUNDING * f64::from(sum)) as f32;
            for c in 0..3 {
                b.pixels.excess[c][i] = excess(b.pixels.color[c][i]);
            }
            b.pixels.excess[3][i] = excess(b.pixels.transmittance[i]);
        }
        // Without ends, slices follow for every pixel.
        b.pixels.last[i] = if b.ends { (n.bits() % 12) as i32 } else { b.slice + 1 + (n.bits() % 3) as i32 };
        let alive = b.pixels.transmittance[i] >= frame.blend.terminate && b.pixels.last[i] >= b.slice;
        b.pixels.alive |= u64::from(alive) << i;
    }
    b
}

/// Red, green, blue and transmittance of a pixel, and what rounding has added to each.
fn sums(b: &Batch, i: usize) -> ([f32; 4], [f32; 4]) {
    let [red, green, blue] = b.pixels.color.map(|c| c[i]);
    ([red, green, blue, b.pixels.transmittance[i]], b.pixels.excess.map(|e| e[i]))
}

/// A sum has become `want`, from `old` by parts of the size `more`.
fn hold_sum(kept: Kept, [old, old_excess]: [f32; 2], [got, got_excess]: [f32; 2], want: f64, more: f64, (level, i): (&str, usize)) {
    match kept {
        Kept::Plain => assert_near(got, want, 3.0 * ROUNDING * (f64::from(old) + more), level, i),
        Kept::Unorm8 => {
            // A multiple of 1/255, and the nearest one but for rounding beside the middle between two.
            let steps = (f64::from(got) * 255.0 + 0.5) as u32;
            assert_same(got, steps as f32 / 255.0, level, i);
            let off = (f64::from(steps) - 255.0 * want.clamp(0.0, 1.0)).abs();
            assert!(off <= 0.5 + 1e-4, "{got}: {off} steps from {want} at {level}, fragment {i}");
        }
        Kept::Compensated => {
            // Not only the sum itself: with what rounding has added taken off, no more is lost than rounding of the new parts.
            let exact = f64::from(got) - f64::from(got_excess);
            let bound = 5.0 * ROUNDING * (more + f64::from(old_excess).abs());
            let want = want - f64::from(old_excess);
            assert!((exact - want).abs() <= bound, "{exact} not {want} within {bound:e} at {level}, fragment {i}");
            assert_near(got, want, 2.0 * ROUNDING * (f64::from(old) + more), level, i);
        }
    }
}

fn parts(kept: Kept) -> Vec<Part> {
    let excess = (kept == Kept::Compensated).then_some(Part::Excess);
    [Part::Sum, Part::Transmittance].into_iter().chain(excess).collect()
}

/// C += T c, T *= 1 - a for pixels of shown rows; where `TERMINATE` is set, for those alone that have not fallen below the threshold,
/// and a pixel stays alive while it has not and slices follow.
fn hold_front<S: Store, const TERMINATE: bool>(n: &mut Numbers, kept: Kept) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let mut frame = frame(&none, n);
    let mut finished = 0;
    for round in 0..200 {
        frame.blend.terminate = [0.01, 1.0 / 1024.0, 0.2][round % 3];
        let before = gathered(n, &frame, kept);
        let mut sets = parts(kept);
        sets.extend(TERMINATE.then_some(Part::Alive));
        run::<BlendFront<S, TERMINATE>>(&frame, &before, &sets, |after, level| {
            for i in 0..BATCH {
                let ((old, old_excess), (got, got_excess)) = (sums(&before, i), sums(after, i));
                let light = old[3];
                let takes = !TERMINATE || light >= frame.blend.terminate;
                let shown = listed(before.shown, i);
                let slab = [before.slab.color[0][i], before.slab.color[1][i], before.slab.color[2][i], before.slab.alpha[i]];
                for c in 0..4 {
                    if !shown || !takes && kept != Kept::Compensated {
                        assert_same(got[c], old[c], level, i);
                        continue;
                    }
                    let more = if takes { f64::from(light) * f64::from(slab[c]) } else { 0.0 };
                    let want = if c < 3 { f64::from(old[c]) + more } else { f64::from(old[c]) - more };
                    hold_sum(kept, [old[c], old_excess[c]], [got[c], got_excess[c]], want, more, (level, i));
                }
                assert!(kept == Kept::Unorm8 || got[3] <= light && got[3] >= 0.0, "{} behind {light} at {level}", got[3]);
                if TERMINATE {
                    let lives = got[3] >= frame.blend.terminate && before.pixels.last[i] > before.slice;
                    let want = bit(before.pixels.alive, i) && (lives || !listed(before.rows, i));
                    assert_eq!(bit(after.pixels.alive, i), want, "fragment {i} with {} left at {level}", got[3]);
                    finished += usize::from(bit(before.pixels.alive, i) && !want);
                }
            }
        });
    }
    assert!(finished > 100 || !TERMINATE, "{finished} pixels finished");
}

#[test]
pub(super) fn front_to_back() {
    let mut n = Numbers::new(71);
    hold_front::<Plain, true>(&mut n, Kept::Plain);
    hold_front::<Plain, false>(&mut n, Kept::Plain);
    hold_front::<Compensated, true>(&mut n, Kept::Compensated);
    hold_front::<Compensated, false>(&mut n, Kept::Compensated);
    hold_front::<Unorm8, true>(&mut n, Kept::Unorm8);
    hold_front::<Unorm8, false>(&mut n, Kept::Unorm8);
}

/// C = c + (1 - a) C, and T *= 1 - a, for pixels of shown rows.
fn hold_back<S: Store>(n: &mut Numbers, kept: Kept) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let frame = frame(&none, n);
    for _ in 0..200 {
        let before = gathered(n, &frame, kept);
        run::<BlendBack<S>>(&frame, &before, &parts(kept), |after, level| {
            for i in 0..BATCH {
                let ((old, old_excess), (got, got_excess)) = (sums(&before, i), sums(after, i));
                let alpha = f64::from(before.slab.alpha[i]);
                for c in 0..4 {
                    if !listed(before.shown, i) {
                        assert_same(got[c], old[c], level, i);
                        continue;
                    }
                    let near = if c < 3 { f64::from(before.slab.color[c][i]) } else { 0.0 };
                    let behind = f64::from(old[c]);
                    let want = near + (1.0 - alpha) * behind;
                    hold_sum(kept, [old[c], old_excess[c]], [got[c], got_excess[c]], want, near + alpha * behind, (level, i));
                }
            }
        });
    }
}

#[test]
pub(super) fn back_to_front() {
    let mut n = Numbers::new(72);
    hold_back::<Plain>(&mut n, Kept::Plain);
    hold_back::<Compensated>(&mut n, Kept::Compensated);
    hold_back::<Unorm8>(&mut n, Kept::Unorm8);
}
