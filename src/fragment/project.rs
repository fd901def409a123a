//! Projections: fragments of a pixel combine as values, and one classification follows at the end.
//!
//! The first colour channel of a pixel keeps the value so far, its transmittance falls to 0 once the result stands (local
//! maximum, surface). Slices come front to back.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::math::exp_negative;
use crate::lanes::{Kernel, Lanes, for_rows, row, row_mut, spread};

/// Stored value of pixels that no fragment has reached: below every finite value.
pub(crate) const NOTHING: f32 = f32::NEG_INFINITY;

/// Largest value.
pub(crate) struct ProjectMax;
/// Smallest value.
pub(crate) struct ProjectMin;
/// Sum of values by length, and sum of lengths (in the second channel).
pub(crate) struct ProjectAverage;
/// Sum of premultiplied slab colours and opacities, nothing hidden; the sum of opacities is in `transmittance`.
pub(crate) struct ProjectAdd;
/// Largest value, attenuated by those before it: n exp(-S), with n the value's place in the window; the second channel takes S. Pixels that no later
/// value can outdo are finished.
pub(crate) struct ProjectAttenuated;
/// First local maximum at or above the level; the second channel keeps the largest value of all, for rays without one.
pub(crate) struct ProjectLmip;
/// First crossing of the level; the second channel takes its position in slices.
pub(crate) struct ProjectIso;

impl<'v> Kernel<Frame<'v>, Batch> for ProjectMax {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let best = row_mut(&mut batch.pixels.color[0], r);
            let old = L::load(best);
            let new = L::max(L::load(row(&batch.sample.value, r)), old);
            L::store(L::select(covered, new, old), best);
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectMin {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let value = L::load(row(&batch.sample.value, r));
            let best = row_mut(&mut batch.pixels.color[0], r);
            let old = L::load(best);
            let unset = L::le(old, L::splat(NOTHING));
            let new = L::select(unset, value, L::min(value, old));
            L::store(L::select(covered, new, old), best);
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectAverage {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let low = L::splat(frame.color.low);
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let length = L::keep(covered, L::load(row(&batch.slab.length, r)));
            // Relative to the low end, so that an offset common to all values costs no digits.
            let value = L::sub(L::load(row(&batch.sample.value, r)), low);
            let sum = row_mut(&mut batch.pixels.color[0], r);
            L::store(L::add(L::load(sum), L::mul(length, value)), sum);
            let lengths = row_mut(&mut batch.pixels.color[1], r);
            L::store(L::add(L::load(lengths), length), lengths);
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectAdd {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.shown, r => {
            for (sum, channel) in batch.pixels.color.iter_mut().zip(&batch.slab.color).chain([(&mut batch.pixels.transmittance, &batch.slab.alpha)]) {
                let sum = row_mut(sum, r);
                L::store(L::add(L::load(sum), L::load(row(channel, r))), sum);
            }
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectAttenuated {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(by) = frame.attenuation.as_deref() else { return };
        let (low, per_unit, per_slab) = (L::splat(by.low), L::splat(by.per_unit), L::splat(by.per_slab));
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let slice = L::splat_i(batch.slice);
        let mut alive = batch.pixels.alive & !spread(batch.rows);
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let value = L::load(row(&batch.sample.value, r));
            let left = L::load(row(&batch.pixels.transmittance, r));
            let open = L::and(covered, L::lt(zero, left));
            let [best, before, _] = &mut batch.pixels.color;
            let (best, before) = (row_mut(best, r), row_mut(before, r));
            let old = L::load(best);
            let sum = L::load(before);
            let place = L::min(L::max(L::mul(L::sub(value, low), per_unit), zero), one);
            // Where nothing has been added yet, the factor is 1 to the bit.
            let shown = L::mul(place, exp_negative::<L>(L::sub(zero, sum)));
            let most = L::select(open, L::max(shown, old), old);
            L::store(most, best);
            let length = L::mul(per_slab, L::load(row(&batch.slab.length, r)));
            let sum = L::select(open, L::add(sum, L::mul(length, place)), sum);
            L::store(sum, before);
            // No value to come is larger than the window's.
            let done = L::le(exp_negative::<L>(L::sub(zero, sum)), most);
            let left = L::select(done, zero, left);
            L::store(left, row_mut(&mut batch.pixels.transmittance, r));
            let more = L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice);
            alive |= u64::from(L::bits(L::and(L::lt(zero, left), more))) << (8 * r);
        });
        batch.pixels.alive = alive;
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectLmip {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let level = L::splat(frame.blend.level);
        let zero = L::splat(0.0);
        let slice = L::splat_i(batch.slice);
        let mut alive = batch.pixels.alive & !spread(batch.rows);
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let value = L::load(row(&batch.sample.value, r));
            let left = L::load(row(&batch.pixels.transmittance, r));
            let open = L::and(covered, L::lt(zero, left));
            let last = L::load(row(&batch.pixels.color[0], r));
            let peak = L::and(open, L::and(L::lt(value, last), L::le(level, last)));
            let left = L::select(peak, zero, left);
            let go_on = L::and(open, L::lt(zero, left));
            L::store(left, row_mut(&mut batch.pixels.transmittance, r));
            L::store(L::select(go_on, value, last), row_mut(&mut batch.pixels.color[0], r));
            let most = row_mut(&mut batch.pixels.color[1], r);
            let old = L::load(most);
            L::store(L::select(go_on, L::max(value, old), old), most);
            let more = L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice);
            alive |= u64::from(L::bits(L::and(L::lt(zero, left), more))) << (8 * r);
        });
        batch.pixels.alive = alive;
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ProjectIso {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let level = L::splat(frame.blend.level);
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let slice = L::splat_i(batch.slice);
        let mut alive = batch.pixels.alive & !spread(batch.rows);
        for_rows!(batch.rows, r => {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            let value = L::load(row(&batch.sample.value, r));
            let left = L::load(row(&batch.pixels.transmittance, r));
            let open = L::and(covered, L::lt(zero, left));
            let before = L::load(row(&batch.pixels.color[0], r));
            let first = L::le(before, L::splat(NOTHING));
            let above = L::bits(L::le(level, value));
            let was_above = L::bits(L::le(level, before));
            // A ray that starts above the level has entered the surface at the box's face.
            let crossed = L::and(open, L::from_bits((above ^ was_above) & !L::bits(first) | above & L::bits(first)));
            // Only lanes that have crossed are used: there the step is not 0, and -inf before makes the distance back 0.
            let back = L::div(L::sub(value, level), L::sub(value, before));
            let back = L::min(L::max(back, zero), one);
            let at = row_mut(&mut batch.pixels.color[1], r);
            let hit = L::sub(L::to_f(slice), back);
            L::store(L::select(crossed, hit, L::load(at)), at);
            let left = L::select(crossed, zero, left);
            L::store(left, row_mut(&mut batch.pixels.transmittance, r));
            L::store(L::select(open, value, before), row_mut(&mut batch.pixels.color[0], r));
            let more = L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice);
            alive |= u64::from(L::bits(L::and(L::lt(zero, left), more))) << (8 * r);
        });
        batch.pixels.alive = alive;
    }
}
