//! Segments of a label map: hidden, tinted or replaced, by the label of the voxel nearest to each fragment.
//!
//! Each effect is one affine map of premultiplied colour C and opacity A of a slab: C' = keep C + Y(C) mix + add, A' = keep_alpha A + add_alpha, with the
//! luminance Y. It comes before the correction for the length of a piece: what replaces a segment is a whole slab too.

use super::Run;
use super::batch::Batch;
use super::frame::Frame;
use super::gradient::index_of;
use super::regions::{clear, shown};
use super::texcoord::{Steps, nearest, steps};
use crate::lanes::{Kernel, Lanes, Level, Number, SIDE, for_rows, row, row_mut};
use crate::scene::LUMINANCE;
use crate::volume::{VoxelSlices, with_slices};

/// What becomes of a label's fragments: see the module.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effect {
    pub(crate) keep: f32,
    pub(crate) mix: [f32; 3],
    pub(crate) add: [f32; 3],
    pub(crate) keep_alpha: f32,
    pub(crate) add_alpha: f32,
    /// Thinness of the slab that replaces them: see `pieces.rs`.
    pub(crate) thinness: f32,
}

impl Effect {
    /// Nothing changes.
    pub(crate) const SHOW: Self = Self { keep: 1.0, mix: [0.0; 3], add: [0.0; 3], keep_alpha: 1.0, add_alpha: 0.0, thinness: 1.0 };
    /// Nothing is left.
    pub(crate) const HIDE: Self = Self { keep: 0.0, keep_alpha: 0.0, ..Self::SHOW };
}

/// The label map of a frame's volume, and what becomes of each label.
#[derive(Debug, Clone)]
pub(crate) struct SegmentsFrame<'v> {
    /// For each voxel the place of its label.
    pub(crate) places: VoxelSlices<'v>,
    /// Distances between voxels along y and z.
    pub(crate) strides: [usize; 2],
    /// By the places of labels.
    pub(crate) effects: Vec<Effect>,
    /// Whether rows in which nothing shows may be left out of what follows.
    pub(crate) leave_out: bool,
}

impl SegmentsFrame<'_> {
    /// The effects on the fragments of row `r` of a batch whose base voxel is at position `base` of the map.
    #[inline(always)]
    fn effects<L: Lanes>(&self, batch: &Batch, steps: &Steps<L>, base: usize, r: usize) -> [&Effect; SIDE] {
        let mut at = [[0i32; SIDE]; 3];
        for (at, voxel) in at.iter_mut().zip(nearest::<L>(batch, steps, r)) {
            L::store_i(voxel, at);
        }
        let [x, y, z] = at;
        // Positions are clamped to the volume, and never before the base voxel.
        let voxel = |i: usize| base + x[i] as usize + y[i] as usize * self.strides[0] + z[i] as usize * self.strides[1];
        with_slices!(self.places, places => std::array::from_fn(|i| &self.effects[Number::to_f64(places[voxel(i)]) as usize]))
    }

    /// Position in the map of the batch's base voxel.
    fn base(&self, frame: &Frame<'_>, batch: &Batch) -> usize {
        let [x, y, z] = index_of(batch.geometry.cells.base, frame.sample.strides);
        x + y * self.strides[0] + z * self.strides[1]
    }
}

/// A number of each of some effects.
#[inline(always)]
fn each(effects: &[&Effect; SIDE], of: impl Fn(&Effect) -> f32) -> [f32; SIDE] {
    std::array::from_fn(|i| of(effects[i]))
}

/// The kernel: of colours, or where values are `projected`.
pub(super) fn kernel<'v>(projected: bool, level: Level) -> Run<'v> {
    if projected { level.kernel::<HideSegments, _, _>() } else { level.kernel::<ApplySegments, _, _>() }
}

/// Colours and opacities of fragments by their labels.
pub(super) struct ApplySegments;

impl<'v> Kernel<Frame<'v>, Batch> for ApplySegments {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(segments) = &frame.optional.segments else { return };
        let (steps, base) = (steps::<L>(batch), segments.base(frame, batch));
        let rows = batch.rows;
        for_rows!(rows, r => {
            let effects = segments.effects::<L>(batch, &steps, base, r);
            if effects.iter().all(|e| **e == Effect::SHOW) {
                continue;
            }
            // Rows that are not shown hold what an earlier slice left.
            if batch.shown >> r & 1 == 0 {
                if effects.iter().all(|e| e.add_alpha == 0.0) {
                    continue;
                }
                clear::<L>(&mut batch.slab, r);
            }
            let color = [0, 1, 2].map(|c: usize| L::load(row(&batch.slab.color[c], r)));
            let share = |c: usize| L::mul(color[c], L::splat(LUMINANCE[c] as f32));
            let luminance = L::add(L::add(share(0), share(1)), share(2));
            let keep = L::load(&each(&effects, |e| e.keep));
            for c in 0..3 {
                let (mix, add) = (L::load(&each(&effects, |e| e.mix[c])), L::load(&each(&effects, |e| e.add[c])));
                let mixed = L::add(L::mul(color[c], keep), L::mul(luminance, mix));
                L::store(L::add(mixed, add), row_mut(&mut batch.slab.color[c], r));
            }
            let alpha = row_mut(&mut batch.slab.alpha, r);
            let kept = L::mul(L::load(alpha), L::load(&each(&effects, |e| e.keep_alpha)));
            L::store(L::add(kept, L::load(&each(&effects, |e| e.add_alpha))), alpha);
            if let Some(thinness) = batch.thinness.as_deref_mut() {
                for (to, effect) in row_mut(thinness, r).iter_mut().zip(effects) {
                    if effect.keep_alpha == 0.0 {
                        *to = effect.thinness;
                    }
                }
            }
            batch.shown = shown::<L>(&batch.slab, r, batch.shown, segments.leave_out);
        });
    }
}

/// Fragments of hidden labels are not covered: where values are projected.
pub(super) struct HideSegments;

impl<'v> Kernel<Frame<'v>, Batch> for HideSegments {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(segments) = &frame.optional.segments else { return };
        let (steps, base) = (steps::<L>(batch), segments.base(frame, batch));
        for_rows!(batch.rows, r => {
            let effects = segments.effects::<L>(batch, &steps, base, r);
            for (i, effect) in effects.into_iter().enumerate() {
                if *effect == Effect::HIDE {
                    batch.mask &= !(1 << (8 * r + i));
                }
            }
        });
    }
}
