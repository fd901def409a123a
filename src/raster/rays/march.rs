//! A block's way through its rays' samples, and to the planes at which rays end.

use super::distance;
use crate::fragment::{BEHIND, Batch};
use crate::lanes::{BATCH, lanes_of, rows_of};
use crate::plan::RayPlan;
use crate::raster::block_transform::BlockTransform;
use crate::raster::march::MOSTLY_HIDDEN;
use crate::raster::observer::Observer;
use crate::raster::ray_intervals::BlockRange;
use crate::raster::work::Work;
use crate::scene::Order;
use crate::tally::Counters;

/// See the module.
pub(super) struct RayMarch<'m, 'f, 'v, W> {
    work: &'m Work<'f, 'v>,
    plan: &'m RayPlan<'v>,
    range: BlockRange,
    transform: BlockTransform,
    batch: &'m mut Batch,
    counters: &'m mut Counters,
    observer: &'m mut W,
    /// Whether `batch.slab.length` holds whole slabs.
    whole_lengths: bool,
    /// Least and greatest depth at which slabs of the block's rays begin, and of their distance.
    near: (f64, f64),
    spacing: (f64, f64),
}

impl<'m, 'f, 'v, W: Observer> RayMarch<'m, 'f, 'v, W> {
    pub(super) fn new(
        (work, plan): (&'m Work<'f, 'v>, &'m RayPlan<'v>),
        range: BlockRange,
        transform: BlockTransform,
        batch: &'m mut Batch,
        counters: &'m mut Counters,
        observer: &'m mut W,
    ) -> Self {
        let bounds = |of: &[f64; BATCH]| of.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (a.min(x), b.max(x)));
        let (near, spacing) = batch.rays.as_deref().map_or(((0.0, 0.0), (0.0, 0.0)), |rays| (bounds(&rays.near), bounds(&rays.spacing)));
        Self { work, plan, range, transform, batch, counters, observer, whole_lengths: true, near, spacing }
    }

    /// Samples `from..to` of all rays in the scene's order, but for those of which nothing shows.
    pub(super) fn slices(&mut self, from: i64, to: i64) {
        if from >= to {
            return;
        }
        let ahead = self.work.order == Order::FrontToBack;
        let runs = self.work.runs;
        // Coarse runs, and the runs in them.
        let sizes = [runs.slices * runs.coarse, runs.slices];
        let groups = from / sizes[0]..(to - 1) / sizes[0] + 1;
        for n in 0..groups.end - groups.start {
            let at = if ahead { groups.start + n } else { groups.end - 1 - n };
            let (first, end) = ((at * sizes[0]).max(from), ((at + 1) * sizes[0]).min(to));
            if !self.shows(first, end) {
                self.pass_over(first, end);
                continue;
            }
            let inner = first / sizes[1]..(end - 1) / sizes[1] + 1;
            for n in 0..inner.end - inner.start {
                let at = if ahead { inner.start + n } else { inner.end - 1 - n };
                let (run, end_run) = ((at * sizes[1]).max(first), ((at + 1) * sizes[1]).min(end));
                if !self.shows(run, end_run) {
                    self.pass_over(run, end_run);
                } else if let Some(k) = self.run(run, end_run) {
                    // After sample k every pixel is finished.
                    let rest = if ahead { (k + 1, to) } else { (from, k) };
                    self.counters.finished += (rest.1 - rest.0) as u64;
                    self.counters.finished_fragments += self.covered(rest);
                    self.observer.skipped(rest.0, rest.1, true);
                    return;
                }
            }
        }
    }

    /// Whether anything may show of samples `from..to`.
    fn shows(&self, from: i64, to: i64) -> bool {
        let Some(skip_table) = self.work.skip_table.filter(|table| !table.all) else { return true };
        let at = |k: i64| k as f64 + 0.5 + self.work.sample;
        let (low, high) = self.transform.bounds(self.near.0 + at(from) * self.spacing.0, self.near.1 + at(to - 1) * self.spacing.1);
        skip_table.class(low, high) != 0
    }

    /// Nothing shows of samples `from..to`.
    fn pass_over(&mut self, from: i64, to: i64) {
        self.counters.empty += (to - from) as u64;
        self.observer.skipped(from, to, false);
    }

    /// Fragments of samples `from..to`.
    fn covered(&self, (from, to): (i64, i64)) -> u64 {
        let pixels = &self.batch.pixels;
        let of = |i: usize| (i64::from(pixels.last[i]).min(to - 1) - i64::from(pixels.first[i]).max(from) + 1).max(0) as u64;
        (0..BATCH).map(of).sum()
    }

    /// Samples `from..to`, of which something may show; the one after which every pixel was finished, if one was.
    fn run(&mut self, from: i64, to: i64) -> Option<i64> {
        (0..to - from).map(|n| if self.work.order == Order::FrontToBack { from + n } else { to - 1 - n }).find(|&k| {
            self.slice(k);
            self.batch.pixels.alive == 0
        })
    }

    /// Sample `k` of every ray through the stages.
    fn slice(&mut self, k: i64) {
        let (work, frame) = (self.work, self.work.frame);
        let live = if W::OBSERVES { u8::MAX } else { rows_of(self.batch.pixels.alive) };
        let batch = &mut *self.batch;
        let depth = work.stack.near + (k as f64 + 0.5) * work.stack.spacing;
        (batch.slice, batch.depth) = (k as i32, depth as f32);
        if let (Some(fog), None) = (work.fog, self.plan.steps) {
            batch.fog.slice = fog.factor(depth) as f32;
        }
        self.counters.batches += 1;
        self.observer.slice(frame, batch);
        let whole = k >= self.range.whole.0 && k <= self.range.whole.1;
        let rows = if whole {
            (batch.mask, batch.ends) = (u64::MAX, k >= self.range.whole.1);
            self.counters.whole(live);
            if !self.whole_lengths {
                batch.slab.length = batch.pixels.slant;
            }
            live
        } else {
            (work.span.run)(frame, batch);
            if work.order == Order::FrontToBack {
                batch.pixels.alive &= !batch.ended;
            }
            batch.ends = true;
            self.observer.stage(work.span.id, frame, batch);
            let rows = if W::OBSERVES { live } else { live & rows_of(batch.mask) };
            self.counters.part(rows, batch.mask);
            rows
        };
        self.whole_lengths = whole;
        (batch.rows, batch.shown) = (rows, rows);
        if rows == 0 {
            return;
        }
        if self.plan.steps.is_none() {
            self.transform.place(work.sampled(k), frame, batch);
        }
        for stage in if whole { work.whole } else { work.partial } {
            (stage.run)(frame, batch);
            self.observer.stage(stage.id, frame, batch);
        }
        let lanes = lanes_of(rows & !batch.shown);
        self.counters.hidden += lanes;
        batch.mostly_hidden = lanes >= MOSTLY_HIDDEN;
    }

    /// The opaque planes at which the rays of `lanes` end.
    pub(super) fn planes(&mut self, lanes: u64) {
        let (work, batch) = (self.work, &mut *self.batch);
        // Pixels that never end take the plane, whatever Riemann's slabs have made of their transmittance.
        let ends = work.order == Order::FrontToBack && work.frame.blend.terminate > 0.0;
        let seen = |i: usize| !ends || batch.pixels.transmittance[i] >= work.frame.blend.terminate;
        if !(0..BATCH).any(|i| lanes >> i & 1 == 1 && seen(i)) {
            return;
        }
        let Some(rays) = batch.rays.as_deref() else { return };
        batch.slab.color = rays.cut_color;
        (batch.slab.alpha, batch.slab.length) = ([1.0; BATCH], [1.0; BATCH]);
        self.whole_lengths = false;
        if let Some(fog) = work.fog {
            for i in (0..BATCH).filter(|i| lanes >> i & 1 == 1) {
                batch.fog.each[i] = fog.factor(distance(work, rays, i, rays.cut[i])) as f32;
            }
        }
        (batch.mask, batch.ends, batch.slice) = (lanes, true, BEHIND);
        (batch.rows, batch.shown) = (rows_of(lanes), rows_of(lanes));
        self.counters.batches += 1;
        self.counters.exits += 1;
        self.counters.fetches += u64::from(lanes.count_ones());
        self.observer.slice(work.frame, batch);
        for stage in &self.plan.stages {
            (stage.run)(work.frame, batch);
            self.observer.stage(stage.id, work.frame, batch);
        }
    }
}
