//! One block of 8 x 8 pixels: whether anything shows in it, and then its march through the slices.

use super::block_transform::BlockTransform;
use super::march::march;
use super::observer::Observer;
use super::ray_intervals::{BlockRange, RayIntervals};
use super::work::Work;
use crate::fragment::Batch;
use crate::lean::extra;
use crate::scene::Order;
use crate::skip::{BOXES, BoxClasses, SHOWN, SkipTable};
use crate::tally::Counters;

/// Classes of up to [`BOXES`] neighbouring coarse runs of a block, kept from the last query.
pub(super) struct CoarseRunClasses {
    first: i64,
    known: usize,
    classes: BoxClasses,
}

impl Default for CoarseRunClasses {
    fn default() -> Self {
        Self { first: 0, known: 0, classes: [0; BOXES] }
    }
}

impl CoarseRunClasses {
    /// What coarse run `at` holds.
    pub(super) fn class<'f>(&mut self, work: &Work<'f, '_>, skip_table: &'f SkipTable, transform: &BlockTransform, at: i64) -> u8 {
        if !(self.first..self.first + self.known as i64).contains(&at) {
            // The aligned group of runs that holds it: that serves both orders.
            self.first = at / BOXES as i64 * BOXES as i64;
            self.known = BOXES;
            let slices = work.runs.slices * work.runs.coarse;
            work.query_boxes(transform, &skip_table.coarse, (self.first * slices, slices), BOXES, &mut self.classes);
        }
        self.classes[(at - self.first) as usize]
    }

    /// Whether anything may show on the slices of `range`.
    fn any_shown<'f>(&mut self, work: &Work<'f, '_>, skip_table: &'f SkipTable, transform: &BlockTransform, range: &BlockRange) -> bool {
        let slices = work.runs.slices * work.runs.coarse;
        // The piece behind the last slice counts to the last slice's run.
        let (first, last) = (range.any.0 / slices, (range.any.1 + work.runs.back) / slices);
        if last - first < BOXES as i64 {
            (self.first, self.known) = (first, (last - first + 1) as usize);
            work.query_boxes(transform, &skip_table.coarse, (first * slices, slices), self.known, &mut self.classes);
        }
        (first..=last).any(|at| self.class(work, skip_table, transform, at) & SHOWN > 0)
    }
}

/// Whether anything may show on the slices of `range` of a block.
pub(super) fn shows(work: &Work<'_, '_>, transform: &BlockTransform, range: &BlockRange, coarse: &mut CoarseRunClasses) -> bool {
    match work.skip_table {
        Some(skip_table) => skip_table.any && (skip_table.all || coarse.any_shown(work, skip_table, transform, range)),
        None => true,
    }
}

/// What became of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// No slice covers it.
    Missed,
    /// Nothing shows on the slices that cover it: its pixels are as they began.
    Empty,
    /// `batch.pixels` holds what its pixels have gathered.
    Rendered,
}

/// Renders the block at pixel (x0,y0) into `batch.pixels`. Bit i of `inside` tells whether lane i belongs to the picture and tile.
pub(crate) fn render<O: Observer>(
    work: &Work<'_, '_>,
    intervals: &RayIntervals<'_>,
    (x0, y0): (u32, u32),
    inside: u64,
    batch: &mut Batch,
    counters: &mut Counters,
    observer: &mut O,
) -> Outcome {
    // Observers see the rays' ends, and slabs between slices begin and end there.
    let range = if O::OBSERVES || extra(work.pairs).is_some() {
        if let Some(hits) = &mut batch.hits {
            hits.begin((x0, y0));
        }
        intervals.block(x0, y0, inside, &mut batch.pixels)
    } else {
        intervals.range(x0, y0, inside, &mut batch.pixels)
    };
    counters.blocks += 1;
    counters.fragments += range.fragments;
    counters.corners += range.corners;
    if range.any.0 > range.any.1 {
        counters.missed_blocks += 1;
        return Outcome::Missed;
    }
    let forward = if work.order == Order::FrontToBack { 1.0 } else { -1.0 };
    let transform = || {
        let whole = BlockTransform::new(work.stack, work.frame.sample.strides, forward, f64::from(x0) + 0.5, f64::from(y0) + 0.5);
        match work.part {
            Some(voxels) if O::SELECTS => whole.of_part(voxels),
            _ => whole,
        }
    };
    let mut coarse = CoarseRunClasses::default();
    let transform = match work.skip_table {
        Some(skip_table) if !O::OBSERVES => {
            let found =
                skip_table.any.then(transform).filter(|transform| skip_table.all || coarse.any_shown(work, skip_table, transform, &range));
            let Some(transform) = found else {
                counters.empty += (range.any.1 - range.any.0 + 1) as u64;
                return Outcome::Empty;
            };
            transform
        }
        _ => transform(),
    };
    intervals.plane(x0, y0, &mut batch.pixels);
    march(work, intervals, (x0, y0), (range, transform, coarse), batch, counters, observer);
    Outcome::Rendered
}
