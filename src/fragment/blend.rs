//! Premultiplied over, in both orders, in the numbers of three targets.
//!
//! Front to back: C += T c, T *= 1 - a. Back to front: C = c + (1 - a) C, and T alike. T is what is kept, never 1 - T.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::{Kernel, Lanes, SIDE, for_rows, row, row_mut, spread};

/// Makes uncovered fragments transparent.
pub(crate) struct MaskStage;

impl<'v> Kernel<Frame<'v>, Batch> for MaskStage {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.shown, r => {
            let bits = (batch.mask >> (8 * r)) as u8;
            if bits != u8::MAX {
                let covered = L::from_bits(bits);
                let [red, green, blue] = &mut batch.slab.color;
                for channel in [red, green, blue, &mut batch.slab.alpha] {
                    let c = row_mut(channel, r);
                    L::store(L::keep(covered, L::load(c)), c);
                }
            }
        });
    }
}

/// How a sum is stored.
pub(crate) trait Store {
    /// `old + more`, where `excess` is what earlier roundings have added to `old`.
    fn sum<L: Lanes>(old: L::F, more: L::F, excess: &mut [f32; SIDE]) -> L::F;
    /// What is left of transmittance `old` behind opacity `alpha`; never more than before.
    fn left<L: Lanes>(old: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F;
    /// `near + (1 - alpha) old`.
    fn over<L: Lanes>(old: L::F, near: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F;
}

/// f32.
pub(crate) struct Plain;
/// f32 with what rounding has added so far (Kahan 1965): for very many slices.
pub(crate) struct Compensated;
/// 8 bits, 0 to 1, rounded to nearest.
pub(crate) struct Unorm8;

impl Store for Plain {
    #[inline(always)]
    fn sum<L: Lanes>(old: L::F, more: L::F, _: &mut [f32; SIDE]) -> L::F {
        L::add(old, more)
    }
    #[inline(always)]
    fn left<L: Lanes>(old: L::F, alpha: L::F, _: &mut [f32; SIDE]) -> L::F {
        L::mul(old, L::sub(L::splat(1.0), alpha))
    }
    #[inline(always)]
    fn over<L: Lanes>(old: L::F, near: L::F, alpha: L::F, _: &mut [f32; SIDE]) -> L::F {
        L::add(near, L::mul(L::sub(L::splat(1.0), alpha), old))
    }
}

impl Store for Compensated {
    #[inline(always)]
    fn sum<L: Lanes>(old: L::F, more: L::F, excess: &mut [f32; SIDE]) -> L::F {
        let more = L::sub(more, L::load(excess));
        let new = L::add(old, more);
        L::store(L::sub(L::sub(new, old), more), excess);
        new
    }
    // T - T a, not T (1 - a): 1 - a would lose what is below 2^-25 in a.
    #[inline(always)]
    fn left<L: Lanes>(old: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F {
        let less = L::sub(L::sub(L::splat(0.0), L::mul(old, alpha)), L::load(excess));
        let new = L::min(L::max(L::add(old, less), L::splat(0.0)), old);
        L::store(L::sub(L::sub(new, old), less), excess);
        new
    }
    #[inline(always)]
    fn over<L: Lanes>(old: L::F, near: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F {
        Self::sum::<L>(old, L::sub(near, L::mul(alpha, old)), excess)
    }
}

impl Unorm8 {
    /// The nearest multiple of 1/255 of x in [0,1]: floor(255 x + 1/2) / 255.
    #[inline(always)]
    fn round<L: Lanes>(x: L::F) -> L::F {
        let x = L::min(L::max(x, L::splat(0.0)), L::splat(1.0));
        let steps = L::trunc(L::add(L::mul(x, L::splat(255.0)), L::splat(0.5)));
        L::div(L::to_f(steps), L::splat(255.0))
    }
}

impl Store for Unorm8 {
    #[inline(always)]
    fn sum<L: Lanes>(old: L::F, more: L::F, excess: &mut [f32; SIDE]) -> L::F {
        Self::round::<L>(Plain::sum::<L>(old, more, excess))
    }
    #[inline(always)]
    fn left<L: Lanes>(old: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F {
        Self::round::<L>(Plain::left::<L>(old, alpha, excess))
    }
    #[inline(always)]
    fn over<L: Lanes>(old: L::F, near: L::F, alpha: L::F, excess: &mut [f32; SIDE]) -> L::F {
        Self::round::<L>(Plain::over::<L>(old, near, alpha, excess))
    }
}

/// Nearest first. With `TERMINATE`, pixels below the threshold take no more.
pub(crate) struct BlendFront<S, const TERMINATE: bool>(std::marker::PhantomData<S>);

impl<'v, S: Store, const TERMINATE: bool> Kernel<Frame<'v>, Batch> for BlendFront<S, TERMINATE> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let threshold = L::splat(frame.blend.terminate);
        let slice = L::splat_i(batch.slice);
        // Where nothing shows pixels stay as they were, unless this is their last slice.
        let rows = if batch.ends { batch.rows } else { batch.shown };
        let mut alive = batch.pixels.alive & !spread(rows);
        for_rows!(rows, r => {
            let more = L::bits(L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice));
            let now = if batch.shown >> r & 1 == 0 {
                // Nothing shows: what was alive stays so.
                (batch.pixels.alive >> (8 * r)) as u8 & more
            } else {
                let [red, green, blue, lost] = &mut batch.pixels.excess;
                let t = row_mut(&mut batch.pixels.transmittance, r);
                let left = L::load(t);
                let alpha = L::load(row(&batch.slab.alpha, r));
                let (weight, alpha) = if TERMINATE {
                    let live = L::le(threshold, left);
                    (L::keep(live, left), L::keep(live, alpha))
                } else {
                    (left, alpha)
                };
                let next = S::left::<L>(left, alpha, row_mut(lost, r));
                L::store(next, t);
                for ((sum, channel), excess) in batch.pixels.color.iter_mut().zip(&batch.slab.color).zip([red, green, blue]) {
                    let sum = row_mut(sum, r);
                    let more = L::mul(weight, L::load(row(channel, r)));
                    L::store(S::sum::<L>(L::load(sum), more, row_mut(excess, r)), sum);
                }
                L::bits(L::le(threshold, next)) & more
            };
            alive |= u64::from(now) << (8 * r);
        });
        if TERMINATE {
            batch.pixels.alive = alive;
        }
    }
}

/// Farthest first.
pub(crate) struct BlendBack<S>(std::marker::PhantomData<S>);

impl<'v, S: Store> Kernel<Frame<'v>, Batch> for BlendBack<S> {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.shown, r => {
            let [red, green, blue, lost] = &mut batch.pixels.excess;
            let alpha = L::load(row(&batch.slab.alpha, r));
            let t = row_mut(&mut batch.pixels.transmittance, r);
            L::store(S::left::<L>(L::load(t), alpha, row_mut(lost, r)), t);
            for ((sum, channel), excess) in batch.pixels.color.iter_mut().zip(&batch.slab.color).zip([red, green, blue]) {
                let sum = row_mut(sum, r);
                L::store(S::over::<L>(L::load(sum), L::load(row(channel, r)), alpha, row_mut(excess, r)), sum);
            }
        });
    }
}
