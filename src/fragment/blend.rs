//! Premultiplied over, in both orders.
//!
//! Front to back: C += T c, T *= 1 - a. Back to front: C = c + (1 - a) C, and T alike. T is what is kept, never 1 - T.

use super::batch::{Batch, Frame, SIDE, row, row_mut};
use crate::lanes::{Kernel, Lanes};

/// Makes uncovered fragments transparent.
pub(crate) struct MaskStage;

impl<'v> Kernel<Frame<'v>, Batch> for MaskStage {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for r in 0..SIDE {
            let covered = L::from_bits((batch.mask >> (8 * r)) as u8);
            for channel in batch.color.iter_mut().chain([&mut batch.alpha]) {
                let c = row_mut(channel, r);
                L::store(L::keep(covered, L::load(c)), c);
            }
        }
    }
}

/// Nearest first. With `TERMINATE`, pixels below the threshold take no more.
pub(crate) struct BlendFront<const TERMINATE: bool>;

impl<'v, const TERMINATE: bool> Kernel<Frame<'v>, Batch> for BlendFront<TERMINATE> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let one = L::splat(1.0);
        let threshold = L::splat(frame.terminate);
        let slice = L::splat_i(batch.slice);
        let mut alive = 0;
        for r in 0..SIDE {
            let t = row_mut(&mut batch.pixels.transmittance, r);
            let left = L::load(t);
            let alpha = L::load(row(&batch.alpha, r));
            let (weight, alpha) = if TERMINATE {
                let live = L::le(threshold, left);
                (L::keep(live, left), L::keep(live, alpha))
            } else {
                (left, alpha)
            };
            let next = L::mul(left, L::sub(one, alpha));
            L::store(next, t);
            for (sum, channel) in batch.pixels.color.iter_mut().zip(&batch.color) {
                let sum = row_mut(sum, r);
                L::store(L::add(L::load(sum), L::mul(weight, L::load(row(channel, r)))), sum);
            }
            if TERMINATE {
                let more = L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice);
                alive |= L::bits(L::and(L::le(threshold, next), more));
            }
        }
        if TERMINATE {
            batch.pixels.alive = alive != 0;
        }
    }
}

/// Farthest first.
pub(crate) struct BlendBack;

impl<'v> Kernel<Frame<'v>, Batch> for BlendBack {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        let one = L::splat(1.0);
        for r in 0..SIDE {
            let rest = L::sub(one, L::load(row(&batch.alpha, r)));
            let t = row_mut(&mut batch.pixels.transmittance, r);
            L::store(L::mul(L::load(t), rest), t);
            for (sum, channel) in batch.pixels.color.iter_mut().zip(&batch.color) {
                let sum = row_mut(sum, r);
                L::store(L::add(L::load(row(channel, r)), L::mul(rest, L::load(sum))), sum);
            }
        }
    }
}
