//! Classification of pre-integrated slabs: by the values at both sides, one of them kept from the slice before.

use super::batch::Batch;
use super::classify::{keep, lerp, position};
use super::fetch::finite;
use super::frame::Frame;
use crate::lanes::{Kernel, Lanes, for_rows, row, row_mut};

/// A lookup linear in both values; the slab between the slice before (or the ray's entry) and this slice.
///
/// With `SECOND` the value between the two bends as the parabola through them and the slice before: v(t) = v0 (1-t) + v1 t - (b/2) t (1-t),
/// where b is the second difference of the three. On average that is b/12 below the straight line; the larger value is moved down by
/// twice as much (or the smaller one up), which gives the line the parabola's mean and leaves errors of the third order. The two
/// values never leave the range between them, so what is known to be empty stays empty. Where no two slices lie before the slab, its
/// middle is looked up instead (Simpson's rule: the mean lies two thirds of the middle's distance beside the line).
/// With `FINE` slabs within an interval of the table are classified by their mean value.
pub(crate) struct ClassifyPair<const SPLIT: bool, const SECOND: bool, const FINE: bool>;

/// The slice index of the pieces behind the last slices.
pub(crate) const BEHIND: i32 = i32::MAX;

/// Takes in values, without colours: what a slice leaves for the next one.
pub(crate) struct KeepValue;

/// Values that the next slice finds: those of this one.
#[inline(always)]
pub(super) fn remember<L: Lanes>(batch: &mut Batch, r: usize) {
    let value = L::load(row(&batch.sample.value, r));
    let previous = row_mut(&mut batch.pixels.previous[0], r);
    let old = L::load(previous);
    L::store(value, previous);
    L::store(old, row_mut(&mut batch.pixels.previous[1], r));
}

impl<'v> Kernel<Frame<'v>, Batch> for KeepValue {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.rows, r => {
            remember::<L>(batch, r);
        });
    }
}

impl<'v, const SPLIT: bool, const SECOND: bool, const FINE: bool> Kernel<Frame<'v>, Batch> for ClassifyPair<SPLIT, SECOND, FINE> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let slice = L::splat_i(batch.slice);
        let (side, last) = (L::splat(frame.color.last + 1.0), L::splat(frame.color.last - 1.0));
        let side_i = L::trunc(side);
        let first_visible = L::splat(frame.color.first_visible);
        let mut shown = 0;
        for_rows!(batch.rows, r => {
            let back = L::load(row(&batch.sample.value, r));
            let first = L::load_i(row(&batch.pixels.first, r));
            let previous = L::load(row(&batch.pixels.previous[0], r));
            let entered = L::eq_i(slice, first);
            let front = L::select(entered, L::load(row(&batch.pixels.entry, r)), previous);
            // A slab with NaN or infinity on either side is transparent.
            let whole = L::and(finite::<L>(front), finite::<L>(back));
            let (mut a, mut b) = (L::select(whole, front, L::splat(0.0)), L::select(whole, back, L::splat(0.0)));
            if SECOND {
                // Three slices at equal distances, or both sides and the middle of a slab that has no two slices before it.
                let next = L::eq_i(slice, L::add_i(first, L::splat_i(1)));
                let uneven = L::from_bits(L::bits(entered) | L::bits(next) | L::bits(L::eq_i(slice, L::splat_i(BEHIND))));
                let middle = L::select(entered, L::load(row(&batch.pixels.middle[0], r)), L::load(row(&batch.pixels.middle[1], r)));
                let before = L::load(row(&batch.pixels.previous[1], r));
                let bend = L::mul(L::sub(L::add(L::sub(before, a), b), a), L::splat(1.0 / 12.0));
                let sag = L::mul(L::sub(L::mul(L::add(a, b), L::splat(0.5)), middle), L::splat(2.0 / 3.0));
                let shift = L::select(uneven, sag, bend);
                let zero = L::splat(0.0);
                let (low, high) = (L::min(a, b), L::max(a, b));
                let twice = L::sub(zero, L::add(shift, shift));
                // Where the third value is NaN, max and min return their second operand, 0.
                let (up, down) = (L::max(twice, zero), L::min(twice, zero));
                let rising = L::le(a, b);
                let (from, to) = (L::add(a, L::select(rising, up, down)), L::add(b, L::select(rising, down, up)));
                a = L::min(L::max(from, low), high);
                b = L::min(L::max(to, low), high);
            }
            let (x, y) = (position::<L, SPLIT>(frame, a), position::<L, SPLIT>(frame, b));
            // Nothing shows between two values below the first that does.
            if L::bits(L::le(first_visible, L::max(x, y))) != 0 {
                shown |= 1 << r;
                let (i, j) = (L::min(L::to_f(L::trunc(x)), last), L::trunc(y));
                let u = L::sub(x, i);
                let v = L::sub(y, L::to_f(j));
                // Whole numbers below 2^24: exact in f32.
                let index = L::add_i(L::trunc(L::mul(i, side)), j);
                let mut color = lerp::<L>(L::lookup(&frame.color.table, index, v), L::lookup(&frame.color.table, L::add_i(index, side_i), v), u);
                if let (true, Some((table, [offset, factor, end]))) = (FINE, &frame.color.fine) {
                    let mean = L::mul(L::add(x, y), L::splat(0.5));
                    let at = L::mul(L::sub(mean, L::splat(*offset)), L::splat(*factor));
                    let at = L::min(L::max(at, L::splat(0.0)), L::splat(*end));
                    let entry = L::trunc(at);
                    let one = L::lookup(table, entry, L::sub(at, L::to_f(entry)));
                    let apart = L::min(L::max(L::sub(x, y), L::sub(y, x)), L::splat(1.0));
                    color = lerp::<L>(one, color, apart);
                }
                let [red, green, blue, alpha] = color;
                keep::<L>(batch, r, [L::keep(whole, red), L::keep(whole, green), L::keep(whole, blue), L::keep(whole, alpha)]);
            }
            remember::<L>(batch, r);
        });
        batch.shown = shown;
    }
}
