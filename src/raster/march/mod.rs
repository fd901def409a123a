//! A block's way through its slices: those that matter, in order, through the stages.

mod merge;
mod pairs;
mod peaks;

use super::block::CoarseRunClasses;
use super::block_transform::BlockTransform;
use super::observer::Observer;
use super::ray_intervals::{BlockRange, RayIntervals};
use super::work::Work;
use crate::fragment::{Batch, Frame};
use crate::lanes::{BATCH, SIDE, lanes_of, rows_of};
use crate::lean::extra;
use crate::scene::Order;
use crate::skip::{BOXES, Runs, SHOWN};
use crate::tally::Counters;
use pairs::ValueHistory;
use std::array;

/// Lanes in which nothing shows that make it worth looking for such in the next slice's batch before interpolation.
pub(super) const MOSTLY_HIDDEN: u64 = 2 * SIDE as u64;

/// What a block's pixels begin with.
#[inline(always)]
pub(super) fn begin(work: &Work<'_, '_>, transform: &BlockTransform, batch: &mut Batch) {
    let [red, green, blue, transmittance] = work.start;
    batch.pixels.color = [[red; BATCH], [green; BATCH], [blue; BATCH]];
    batch.pixels.transmittance = [transmittance; BATCH];
    if work.compensated {
        batch.pixels.excess = [[0.0; BATCH]; 4];
    }
    batch.pixels.alive = u64::MAX;
    ready(work, transform, batch);
}

/// What a march begins with, whatever its pixels have gathered.
#[inline(always)]
fn ready(work: &Work<'_, '_>, transform: &BlockTransform, batch: &mut Batch) {
    batch.mostly_hidden = false;
    transform.prepare(work.frame, batch);
    batch.slab.length = batch.pixels.slant;
}

/// The slices of a block of which something may show.
#[inline(never)]
pub(super) fn march<W: Observer>(
    work: &Work<'_, '_>,
    intervals: &RayIntervals<'_>,
    (x0, y0): (u32, u32),
    (range, transform, mut coarse): (BlockRange, BlockTransform, CoarseRunClasses),
    batch: &mut Batch,
    counters: &mut Counters,
    observer: &mut W,
) {
    if W::RESUMES {
        ready(work, &transform, batch);
    } else {
        begin(work, &transform, batch);
    }
    observer.block(work.stack, x0, y0, batch);
    let slices = observer.slices(range.any.0..range.any.1 + 1);
    let window = (f64::from(x0) + 0.5, f64::from(y0) + 0.5);
    let mut march = March {
        work,
        intervals,
        first_pixel: (x0, y0),
        range,
        transform,
        batch,
        counters,
        observer,
        whole_lengths: true,
        window,
        history: ValueHistory::default(),
        through: f32::NAN,
        ended: None,
    };
    if !slices.is_empty() {
        march.slices(slices.start, slices.end, &mut coarse);
        // Where only the first slices are rendered, the pieces up to the rays' exits are left out.
        if let (Some(pairs), true) = (extra(work.pairs), W::RESUMES || W::SELECTS || slices.end > range.any.1) {
            march.after_pairs(pairs, &slices);
        }
        if let Some(k) = march.ended {
            march.counters.finished_fragments +=
                if work.order == Order::FrontToBack { march.covered(k + 1, slices.end) } else { march.covered(slices.start, k) };
        }
    }
    observer.done(batch);
}

/// A block's way through its slices.
pub(super) struct March<'m, 'f, 'v, W> {
    pub(super) work: &'m Work<'f, 'v>,
    intervals: &'m RayIntervals<'m>,
    first_pixel: (u32, u32),
    pub(super) range: BlockRange,
    pub(super) transform: BlockTransform,
    pub(super) batch: &'m mut Batch,
    pub(super) counters: &'m mut Counters,
    pub(super) observer: &'m mut W,
    /// Whether `batch.slab.length` holds whole slabs.
    pub(super) whole_lengths: bool,
    /// Window position of the first pixel's centre.
    pub(super) window: (f64, f64),
    history: ValueHistory,
    /// Root mean square of the pixels' transmittance; NaN where it is to be found out.
    pub(super) through: f32,
    /// The slice after which every pixel was finished.
    ended: Option<i64>,
}

impl<'f, 'v, W: Observer> March<'_, 'f, 'v, W> {
    /// Slices `from..to` in the scene's order, but for those on which nothing shows.
    fn slices(&mut self, from: i64, to: i64, coarse: &mut CoarseRunClasses) {
        // Where something shows in every brick no query is needed, unless slabs may be merged.
        let Some(skip_table) = self.work.skip_table.filter(|skip_table| !skip_table.all || extra(self.work.merging).is_some()) else {
            match extra(self.work.peaks) {
                Some(peaks) if !W::OBSERVES && !W::SELECTS => self.peaks(peaks, from, to),
                _ => {
                    self.run(from, to);
                }
            }
            return;
        };
        let Runs { slices, coarse: group, .. } = self.work.runs;
        let ahead = self.work.order == Order::FrontToBack;
        let groups = from / (slices * group)..(to - 1) / (slices * group) + 1;
        for n in 0..groups.end - groups.start {
            let at = if ahead { groups.start + n } else { groups.end - 1 - n };
            let (first, end) = ((at * slices * group).max(from), ((at + 1) * slices * group).min(to));
            let held = coarse.class(self.work, skip_table, &self.transform, at);
            if held & SHOWN == 0 {
                self.pass_over(first, end);
                continue;
            }
            let runs = first / slices..(end - 1) / slices + 1;
            let count = (runs.end - runs.start) as usize;
            let merging = extra(self.work.merging);
            // Where something shows in every brick, it does on every run.
            let mut classes = [1; BOXES];
            if held != SHOWN || merging.is_some() {
                self.work.query_boxes(&self.transform, &skip_table.fine, (runs.start * slices, slices), count, &mut classes);
            }
            if let Some(merging) = merging {
                if !self.merging(merging, (first, end), &classes[..count]) {
                    self.count_finished(end, to);
                    return;
                }
                continue;
            }
            // Runs that follow each other in one go. There are no more than eight of them in a coarse run.
            let mut shown = rows_of(u64::from_le_bytes(array::from_fn(|n| if n < count { classes[n] } else { 0 })));
            let (mut before, mut after) = (first, end);
            while shown != 0 {
                let (lowest, highest) = (i64::from(shown.trailing_zeros()), i64::from(shown.ilog2()));
                let (from_run, to_run) = if ahead {
                    (lowest, lowest + i64::from((!(shown >> lowest)).trailing_zeros()))
                } else {
                    (highest + 1 - i64::from((shown << (7 - highest)).leading_ones()), highest + 1)
                };
                shown &= !((1u16 << to_run) - (1u16 << from_run)) as u8;
                let (run, end_run) = (((runs.start + from_run) * slices).max(from), ((runs.start + to_run) * slices).min(to));
                if ahead {
                    self.pass_over(before, run)
                } else {
                    self.pass_over(end_run, after)
                }
                if !self.run(run, end_run) {
                    let (first, end) = if ahead { (end_run, to) } else { (from, run) };
                    self.count_finished(first, end);
                    return;
                }
                (before, after) = (end_run, run);
            }
            if ahead { self.pass_over(before, end) } else { self.pass_over(first, after) }
        }
    }

    /// Slices `from..to` are not needed: every pixel is finished.
    fn count_finished(&mut self, from: i64, to: i64) {
        self.counters.finished += (to - from) as u64;
        self.observer.skipped(from, to, true);
    }

    /// Nothing shows on slices `from..to`.
    pub(super) fn pass_over(&mut self, from: i64, to: i64) {
        if from == to {
            return;
        }
        self.counters.empty += (to - from) as u64;
        self.observer.skipped(from, to, false);
    }

    /// Slices `from..to`, on which something may show; false when every pixel is finished.
    fn run(&mut self, from: i64, to: i64) -> bool {
        for k in from..to {
            let (slice, rest) = match self.work.order {
                Order::FrontToBack => (k, (k + 1, to)),
                Order::BackToFront => (from + to - 1 - k, (from, from + to - 1 - k)),
            };
            self.slice(slice, self.work.frame);
            if self.batch.pixels.alive == 0 {
                self.stop(slice, rest);
                return false;
            }
        }
        true
    }

    /// As [`March::slice`], but not inlined: for callers off the plain march, which alone has it inlined.
    #[inline(never)]
    pub(super) fn slice_not_inlined(&mut self, k: i64, frame: &'f Frame<'v>) {
        self.slice(k, frame);
    }

    /// After `slice` every pixel is finished: slices `rest` of its run are not needed.
    pub(super) fn stop(&mut self, slice: i64, rest: (i64, i64)) {
        self.ended = Some(slice);
        self.count_finished(rest.0, rest.1);
    }

    /// Makes sure that the pixels hold where their rays enter and leave.
    #[inline]
    fn settle(&mut self) {
        if !self.range.settled {
            let (x0, y0) = self.first_pixel;
            self.intervals.block(x0, y0, u64::MAX, &mut self.batch.pixels);
            self.range.settled = true;
        }
    }

    /// Fragments of slices `from..to`.
    fn covered(&mut self, from: i64, to: i64) -> u64 {
        // Behind the last of the pixels' first slices, up to the first of their last ones, every pixel is covered.
        if !self.range.settled && from >= self.range.last_first && from <= self.range.whole.1 + 1 && to > self.range.any.1 {
            return (self.range.lasts - BATCH as i64 * (from - 1)).unsigned_abs();
        }
        self.settle();
        let pixels = &self.batch.pixels;
        let mut count = 0;
        for i in 0..BATCH {
            let (first, last) = (i64::from(pixels.first[i]).max(from), i64::from(pixels.last[i]).min(to - 1));
            if pixels.doubt >> i & 1 == 0 {
                count += (last - first + 1).max(0) as u64;
            } else {
                let (x, y) = (self.window.0 + (i % SIDE) as f64, self.window.1 + (i / SIDE) as f64);
                count += (first..=last).filter(|&k| self.work.stack.covers(k as u64, x, y)).count() as u64;
            }
        }
        count
    }

    /// Rows in which a pixel still takes light. Observers see all of them.
    pub(super) fn live_rows(&self) -> u8 {
        if W::OBSERVES { u8::MAX } else { rows_of(self.batch.pixels.alive) }
    }

    /// Rows with pixels that the batch's slice covers; sets the batch's mask and lengths.
    pub(super) fn covered_rows(&mut self) -> u8 {
        (self.work.span.run)(self.work.frame, self.batch);
        self.whole_lengths = false;
        rows_of(self.batch.mask)
    }

    /// One slice through the stages, by the numbers of `frame`.
    #[inline(always)]
    fn slice(&mut self, k: i64, frame: &'f Frame<'v>) {
        let sampled = self.work.sampled(k);
        let asked = if W::SELECTS { self.observer.fragments(self.work.stack, self.first_pixel, sampled) } else { u64::MAX };
        if W::SELECTS && asked == 0 {
            self.counters.empty += 1;
            return;
        }
        if let Some(pairs) = extra(self.work.pairs) {
            self.before_pair(k, pairs);
        }
        let (work, live) = (self.work, self.live_rows());
        let batch = &mut *self.batch;
        // Where the slab has its middle.
        let depth = work.stack.near + (k as f64 + if work.ends.between() { 0.0 } else { 0.5 }) * work.stack.spacing;
        batch.slice = k as i32;
        batch.depth = depth as f32;
        if let Some(fog) = extra(work.fog) {
            batch.fog.slice = fog.factor(depth) as f32;
        }
        self.counters.batches += 1;
        if k >= self.range.whole.0 && k <= self.range.whole.1 && (!W::SELECTS || asked == u64::MAX) {
            self.place(sampled, frame);
            let batch = &mut *self.batch;
            self.observer.slice(frame, batch);
            (batch.mask, batch.rows, batch.shown) = (u64::MAX, live, live);
            batch.ends = k >= self.range.whole.1;
            self.counters.whole(live);
            if !self.whole_lengths {
                batch.slab.length = batch.pixels.slant;
                self.whole_lengths = true;
            }
            for stage in work.whole {
                (stage.run)(frame, batch);
                self.observer.stage(stage.id, frame, batch);
            }
            self.hidden(live & !self.batch.shown);
            return;
        }
        self.observer.slice(frame, batch);
        self.settle();
        let batch = &mut *self.batch;
        (work.span.run)(frame, batch);
        self.whole_lengths = false;
        if work.order == Order::FrontToBack {
            batch.pixels.alive &= !batch.ended;
        }
        // The next slab finds the values of this slice, whoever owns its fragments.
        let wanted = if W::SELECTS && extra(work.pairs).is_some() { batch.mask } else { batch.mask & asked };
        batch.mask &= asked;
        let rows = if W::OBSERVES { live } else { live & rows_of(wanted) };
        (batch.rows, batch.shown) = (rows, rows);
        batch.ends = true;
        let mut doubt = batch.pixels.doubt & batch.mask;
        while doubt != 0 {
            let i = doubt.trailing_zeros() as usize;
            doubt &= doubt - 1;
            let (x, y) = (self.window.0 + (i % SIDE) as f64, self.window.1 + (i / SIDE) as f64);
            if !work.stack.covers(k as u64, x, y) {
                batch.mask &= !(1 << i);
            }
        }
        self.observer.stage(work.span.id, frame, batch);
        self.counters.part(batch.rows, batch.mask);
        if rows == 0 {
            return;
        }
        self.place(sampled, frame);
        let batch = &mut *self.batch;
        for stage in work.partial {
            (stage.run)(frame, batch);
            self.observer.stage(stage.id, frame, batch);
        }
        self.hidden(rows & !self.batch.shown);
    }

    /// Sets where the batch's fragments lie at depth `d`.
    #[inline(always)]
    fn place(&mut self, d: f64, frame: &Frame<'v>) {
        match &self.transform.part {
            Some(part) if W::SELECTS => self.transform.place_part(part, d, frame, self.batch),
            _ => self.transform.place(d, frame, self.batch),
        }
    }

    /// Nothing shows in `rows` of a batch.
    #[inline(always)]
    fn hidden(&mut self, rows: u8) {
        let lanes = lanes_of(rows);
        self.counters.hidden += lanes;
        self.batch.mostly_hidden = lanes >= MOSTLY_HIDDEN;
        if self.batch.shown != 0 {
            self.through = f32::NAN;
        }
    }
}
