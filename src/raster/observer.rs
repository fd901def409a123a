//! Looking on while batches go through the stages: to record what each stage did, or to time it.
//!
//! The march over slices is compiled once for each kind of observer; for `()`, which sees nothing, the calls vanish.

use crate::fragment::{Batch, Frame};
use crate::lanes::BATCH;
use crate::proxy::Stack;
use crate::scene::StageId;
use std::ops::Range;

/// Someone who looks on. Each tile has its own, made by [`Observer::fresh`] from the one that was sent; they are merged at the end.
///
/// An observer sees the picture being made and cannot touch it, but may ask for a part of it: blocks, and slices.
pub(crate) trait Observer: Send + Sync {
    /// Whether it sees batches: then work that changes no pixel is done as well, so that it sees all of it.
    const OBSERVES: bool = true;

    /// Whether it asks for some of the fragments only: see [`Observer::fragments`].
    const SELECTS: bool = false;

    /// Whether blocks go on from what their pixels have gathered on other slices: see `resume.rs`.
    const RESUMES: bool = false;

    /// An empty observer with the same settings, for another tile.
    fn fresh(&self) -> Self;

    /// Whether the block whose first pixel is (x,y) is to be rendered at all.
    fn wants(&self, x: u32, y: u32) -> bool {
        let _ = (x, y);
        true
    }

    /// The slices to render of those that cover a block.
    fn slices(&self, covered: Range<i64>) -> Range<i64> {
        covered
    }

    /// The fragments to render of the block whose first pixel is (x,y), on the slice whose samples lie at depth `d`: one bit each. Asked
    /// where [`Observer::SELECTS`].
    fn fragments(&self, stack: &Stack, first: (u32, u32), d: f64) -> u64 {
        let _ = (stack, first, d);
        u64::MAX
    }

    /// As [`Observer::fragments`], of samples that each lie at a depth of their own.
    fn fragments_each(&self, stack: &Stack, first: (u32, u32), depths: &[f64; BATCH]) -> u64 {
        let _ = (stack, first, depths);
        u64::MAX
    }

    /// A block begins: its first pixel is (x,y), `batch.pixels` holds its rays and nothing gathered yet.
    fn block(&mut self, stack: &Stack, x: u32, y: u32, batch: &Batch) {
        let _ = (stack, x, y, batch);
    }

    /// A slice begins: `batch.slice`, `batch.depth` and `batch.fog.slice` are set, no stage has run.
    fn slice(&mut self, frame: &Frame<'_>, batch: &Batch) {
        let _ = (frame, batch);
    }

    /// Stage `id` has run.
    fn stage(&mut self, id: StageId, frame: &Frame<'_>, batch: &Batch) {
        let _ = (id, frame, batch);
    }

    /// Slices `from..to` of the block are passed over: nothing in them shows, or (`finished`) every pixel is done.
    fn skipped(&mut self, from: i64, to: i64, finished: bool) {
        let _ = (from, to, finished);
    }

    /// The block that began is over: `batch.pixels` holds what its pixels have gathered.
    fn done(&mut self, batch: &Batch) {
        let _ = batch;
    }

    /// The tile is over.
    fn over(&mut self) {}

    /// Takes in what the observer of a tile further on saw: tiles come row by row.
    fn merge(&mut self, other: Self);
}

/// Nobody looks on.
impl Observer for () {
    const OBSERVES: bool = false;

    fn fresh(&self) -> Self {}

    fn merge(&mut self, (): Self) {}
}
