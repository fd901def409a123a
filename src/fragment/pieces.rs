//! Pieces of rays that are shorter than a slab, where a whole slab may be so opaque that its opacity has no digits left to tell how deep it is.
//!
//! Classification runs twice there: once with tables of thinness (see [`crate::classify::Measure`]), which keep a slab's optical depth, and
//! once with the frame's own. The correction for length then starts from the optical depth.

use super::Run;
use super::batch::Batch;
use super::correct::{factored, whole_slabs};
use super::frame::Frame;
use crate::lanes::math::{expm1_negative, log1p_negated, opacity_for_ratio};
use crate::lanes::{BATCH, Kernel, Lanes, for_rows, row};

/// Opacity of a slab from which on its optical depth is looked up. Below it an f32 tells the depth to 1e-6.
pub(crate) const DEEP: f32 = 0.96875;
/// How far an opacity between [`DEEP`] and 1 may be from the one that was meant: rounding of two entries of a table, and of what lies between.
const ROUNDED: f32 = f32::EPSILON;

/// What it takes to look thinness up.
#[derive(Debug, Clone)]
pub(crate) struct PieceFrame<'v> {
    /// The frame with tables of thinness.
    pub(crate) frame: Frame<'v>,
    /// Classification, of the frame's vector level.
    pub(crate) classify: Run<'v>,
}

/// Classification of batches in which pieces may be shorter than a slab: thinness of the slabs first where one is, then colour and opacity.
pub(crate) fn classify_pieces<'v>(frame: &Frame<'v>, batch: &mut Batch) {
    let Some(pieces) = &frame.pieces else { return };
    let short = |batch: &Batch| batch.slab.length.iter().enumerate().any(|(i, &length)| length < 1.0 && batch.mask >> i & 1 == 1);
    if short(batch) {
        // What classification changes besides colours, which it sets again.
        let (shown, previous) = (batch.shown, batch.pixels.previous);
        (pieces.classify)(&pieces.frame, batch);
        (batch.shown, batch.pixels.previous) = (shown, previous);
        **batch.thinness.get_or_insert_with(|| Box::new([1.0; BATCH])) = batch.slab.alpha;
    }
    (pieces.classify)(frame, batch);
}

/// As [`super::Correct`], but for the opacity of covered pieces shorter than a slab whose opacity is at least [`DEEP`].
pub(crate) struct CorrectPieces;

/// Optical depth of slabs of opacity `alpha` and of `thinness`: what the thinness says, within what rounds to such an opacity. Between two
/// entries of a table thinness may say something else than opacity does, and whole slabs go by their opacity.
#[inline(always)]
fn optical_depth<L: Lanes>(alpha: L::F, thinness: L::F) -> L::F {
    let (zero, one, off) = (L::splat(0.0), L::splat(1.0), L::splat(ROUNDED));
    let least = L::sub(zero, log1p_negated::<L>(L::sub(alpha, off)));
    // Of 1 and more: a number over 1e30, and never infinity, so that no piece of length 0 becomes NaN.
    let most = L::sub(zero, log1p_negated::<L>(L::add(alpha, off)));
    L::max(L::min(L::sub(L::div(one, thinness), one), most), least)
}

impl<'v> Kernel<Frame<'v>, Batch> for CorrectPieces {
    #[inline(always)]
    fn run<L: Lanes>(_: &Frame<'v>, batch: &mut Batch) {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        for_rows!(batch.shown, r => {
            let length = L::load(row(&batch.slab.length, r));
            let covered = (batch.mask >> (8 * r)) as u8;
            let whole = whole_slabs::<L>(length);
            if !L::bits(whole) & covered == 0 {
                continue;
            }
            let alpha = L::load(row(&batch.slab.alpha, r));
            let mut corrected = opacity_for_ratio::<L>(alpha, length);
            let deep = L::bits(L::le(L::splat(DEEP), alpha)) & L::bits(L::lt(length, one)) & covered;
            if let Some(thinness) = batch.thinness.as_deref().filter(|_| deep != 0) {
                let depth = optical_depth::<L>(alpha, L::load(row(thinness, r)));
                let opacity = L::sub(zero, expm1_negative::<L>(L::sub(zero, L::mul(depth, length))));
                corrected = L::select(L::from_bits(deep), opacity, corrected);
            }
            factored::<L>(&mut batch.slab, r, whole, corrected);
        });
    }
}
