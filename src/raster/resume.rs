//! Blocks that go on: some slices of a block at a time, each time with another plan and other voxels, to the same sums as in one go.
//!
//! What a pixel gathers depends on the order of its slices alone. So a block may stop after any slice, keep what its pixels have gathered
//! ([`Gathered`]) and go on later with the next one: every fragment is blended as it would have been.

use super::block::{CoarseRunClasses, shows};
use super::block_transform::BlockTransform;
use super::march::march;
use super::observer::Observer;
use super::ray_intervals::{BlockRange, RayIntervals};
use super::work::Work;
use crate::fragment::{Batch, PixelBlock};
use crate::lanes::BATCH;
use crate::lean::extra;
use crate::scene::Order;
use crate::tally::Counters;
use std::ops::Range;

/// What the pixels of a block have gathered so far.
#[derive(Debug, Clone)]
pub(crate) struct Gathered {
    color: [[f32; BATCH]; 3],
    transmittance: [f32; BATCH],
    excess: [[f32; BATCH]; 4],
    alive: u64,
}

impl Gathered {
    /// Nothing yet: `start` is what pixels begin with, colour channels and transmittance.
    pub(crate) fn nothing([red, green, blue, transmittance]: [f32; 4]) -> Self {
        Self {
            color: [[red; BATCH], [green; BATCH], [blue; BATCH]],
            transmittance: [transmittance; BATCH],
            excess: [[0.0; BATCH]; 4],
            alive: u64::MAX,
        }
    }

    /// Whether no pixel takes light any more.
    pub(crate) fn is_finished(&self) -> bool {
        self.alive == 0
    }

    /// Lays it into a batch's pixels.
    pub(crate) fn put(&self, pixels: &mut PixelBlock) {
        pixels.color = self.color;
        pixels.transmittance = self.transmittance;
        pixels.excess = self.excess;
        pixels.alive = self.alive;
    }

    /// Takes it back from there.
    fn take(&mut self, pixels: &PixelBlock) {
        self.color = pixels.color;
        self.transmittance = pixels.transmittance;
        self.excess = pixels.excess;
        self.alive = pixels.alive;
    }
}

/// Asks for some slices of blocks that go on.
struct Resumed {
    slices: Range<i64>,
}

impl Observer for Resumed {
    const OBSERVES: bool = false;
    const RESUMES: bool = true;

    fn fresh(&self) -> Self {
        Self { slices: self.slices.clone() }
    }

    fn slices(&self, covered: Range<i64>) -> Range<i64> {
        self.slices.start.max(covered.start)..self.slices.end.min(covered.end)
    }

    fn merge(&mut self, _: Self) {}
}

/// The slices that cover the block at pixel `first`, none where the range is empty; what they cover is counted.
pub(crate) fn covered(
    intervals: &RayIntervals<'_>,
    first: (u32, u32),
    inside: u64,
    batch: &mut Batch,
    counters: &mut Counters,
) -> Range<i64> {
    let range = intervals.range(first.0, first.1, inside, &mut batch.pixels);
    counters.blocks += 1;
    counters.fragments += range.fragments;
    counters.corners += range.corners;
    if range.any.0 > range.any.1 {
        counters.missed_blocks += 1;
        return 0..0;
    }
    range.any.0..range.any.1 + 1
}

/// Goes on with the block at pixel (x0,y0) on `slices`. Bit i of `inside` tells whether lane i belongs to the picture.
pub(crate) fn resume(
    work: &Work<'_, '_>,
    intervals: &RayIntervals<'_>,
    (x0, y0): (u32, u32),
    inside: u64,
    slices: Range<i64>,
    gathered: &mut Gathered,
    (batch, counters): (&mut Batch, &mut Counters),
) {
    gathered.put(&mut batch.pixels);
    let range = if extra(work.pairs).is_some() {
        intervals.block(x0, y0, inside, &mut batch.pixels)
    } else {
        intervals.range(x0, y0, inside, &mut batch.pixels)
    };
    let (first, last) = (slices.start.max(range.any.0), (slices.end - 1).min(range.any.1));
    if first > last {
        return;
    }
    let forward = if work.order == Order::FrontToBack { 1.0 } else { -1.0 };
    let transform = BlockTransform::new(work.stack, work.frame.sample.strides, forward, f64::from(x0) + 0.5, f64::from(y0) + 0.5);
    let mut coarse = CoarseRunClasses::default();
    if !shows(work, &transform, &BlockRange { any: (first, last), ..range }, &mut coarse) {
        return;
    }
    intervals.plane(x0, y0, &mut batch.pixels);
    march(work, intervals, (x0, y0), (range, transform, coarse), batch, counters, &mut Resumed { slices });
    gathered.take(&batch.pixels);
}
