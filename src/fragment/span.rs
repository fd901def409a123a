//! Which fragments of a batch are covered, and how long each one's piece of the ray is.

use super::batch::Batch;
use super::frame::Frame;
use crate::lanes::{Kernel, Lanes, SIDE, row, row_mut};

/// Compares the slice with every pixel's first and last slice; fills `mask` and `length`.
pub(crate) struct Span;

/// The same for slabs that end at their slice: what lies behind the last slice is a piece of its own.
pub(crate) struct SpanPair;

impl<'v> Kernel<Frame<'v>, Batch> for Span {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        span::<L, true>(batch);
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for SpanPair {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        span::<L, false>(batch);
    }
}

#[inline(always)]
fn span<L: Lanes, const LAST: bool>(batch: &mut Batch) {
    let slice = L::splat_i(batch.slice);
    let (mut outside, mut ended) = (0u64, 0u64);
    for r in 0..SIDE {
        let first = L::load_i(row(&batch.pixels.first, r));
        let last = L::load_i(row(&batch.pixels.last, r));
        let over = L::bits(L::gt_i(slice, last));
        ended |= u64::from(over) << (8 * r);
        outside |= u64::from(L::bits(L::gt_i(first, slice)) | over) << (8 * r);
        let mut length = L::splat(1.0);
        if LAST {
            length = L::select(L::eq_i(slice, last), L::load(row(&batch.pixels.last_length, r)), length);
        }
        let length = L::select(L::eq_i(slice, first), L::load(row(&batch.pixels.first_length, r)), length);
        L::store(L::mul(length, L::load(row(&batch.pixels.slant, r))), row_mut(&mut batch.slab.length, r));
    }
    batch.mask = !outside;
    batch.ended = ended;
}
