//! Opacity for the true length of a fragment's piece of the ray: A' = 1 - (1 - A)^length, colour scaled with it.

use super::batch::{Batch, SlabBatch};
use super::frame::Frame;
use crate::lanes::math::opacity_for_ratio;
use crate::lanes::{Kernel, Lanes, for_rows, row, row_mut};

/// Runs where pieces are not all one slab long: at the box's border, and everywhere in perspective. `SOME` batches have rows of whole slabs.
pub(crate) struct Correct<const SOME: bool>;

/// Pieces of a slab's length. They keep their bits, so that a batch's other pixels do not matter.
#[inline(always)]
pub(super) fn whole_slabs<L: Lanes>(length: L::F) -> L::M {
    let one = L::splat(1.0);
    L::and(L::le(length, one), L::le(one, length))
}

/// Gives row `r` the `corrected` opacity, and colours in proportion, but for `whole` slabs.
#[inline(always)]
pub(super) fn factored<L: Lanes>(slab: &mut SlabBatch, r: usize, whole: L::M, corrected: L::F) {
    let one = L::splat(1.0);
    let alpha = L::load(row(&slab.alpha, r));
    let corrected = L::select(whole, alpha, corrected);
    // Where alpha is 0 the colour is 0 too: any finite factor serves.
    let opaque = L::lt(L::splat(0.0), alpha);
    let factor = L::select(whole, one, L::div(L::keep(opaque, corrected), L::select(opaque, alpha, one)));
    L::store(corrected, row_mut(&mut slab.alpha, r));
    for channel in &mut slab.color {
        let c = row_mut(channel, r);
        L::store(L::mul(L::load(c), factor), c);
    }
}

impl<'v, const SOME: bool> Kernel<Frame<'v>, Batch> for Correct<SOME> {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.shown, r => {
            let length = L::load(row(&batch.slab.length, r));
            let whole = whole_slabs::<L>(length);
            // Fragments that are not covered are masked out next.
            if SOME && !L::bits(whole) & (batch.mask >> (8 * r)) as u8 == 0 {
                continue;
            }
            let corrected = opacity_for_ratio::<L>(L::load(row(&batch.slab.alpha, r)), length);
            factored::<L>(&mut batch.slab, r, whole, corrected);
        });
    }
}

/// The same for Riemann's slabs: opacity and colour grow with length, whatever they come to.
pub(crate) struct CorrectRiemann;

impl<'v> Kernel<Frame<'v>, Batch> for CorrectRiemann {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.shown, r => {
            let length = L::load(row(&batch.slab.length, r));
            for channel in batch.slab.color.iter_mut().chain([&mut batch.slab.alpha]) {
                let c = row_mut(channel, r);
                L::store(L::mul(L::load(c), length), c);
            }
        });
    }
}
