//! What slabs between two values need besides their slices: the values where rays enter and leave, and those of slices that were
//! passed over.
//!
//! ```text
//!   entry    slice f    f+1     ...      slice l   exit
//!   --|---------|--------|--------|---------|-------|-->    pieces: entry to f, f to f+1, ..., l to exit
//! ```

use super::March;
use crate::fragment::{BEHIND, Batch, Frame};
use crate::lanes::{BATCH, SIDE};
use crate::lean::extra;
use crate::plan::{EndPieces, PairStages};
use crate::raster::block_transform::BlockTransform;
use crate::raster::observer::Observer;
use std::array;
use std::ops::Range;

/// Which values of earlier slices a block has at hand.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ValueHistory {
    /// The slice whose values were kept last.
    slice: i64,
    /// How many slices up to it follow each other.
    run: i64,
    /// Whether the values at the rays' entries are there.
    entries: bool,
}

impl ValueHistory {
    fn add(&mut self, k: i64) {
        self.run = if self.run > 0 && self.slice == k - 1 { self.run + 1 } else { 1 };
        self.slice = k;
    }
}

impl BlockTransform {
    /// As [`BlockTransform::place_each`], for a part of the volume: cells and weights are those of the whole, and so is the base voxel that light
    /// counts from; offsets count from a voxel of the part.
    fn place_each_part(&self, part: &[(u32, u32); 3], depths: &[f64; BATCH], frame: &Frame<'_>, batch: &mut Batch) {
        let places = batch.places.get_or_insert_with(|| Box::new([[0.0; BATCH]; 3]));
        let mut lowest = [i64::MAX; 3];
        for i in 0..BATCH {
            let d = depths[i];
            let scale = self.scale(d);
            let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
            let (mut voxel, mut corner) = (0, [0; 3]);
            for axis in 0..3 {
                let u = self.start[axis] + d * self.slope[axis] + scale * (x * self.across[axis] + y * self.down[axis]);
                let reach = if frame.sample.strides[axis] == 0 { 0.0 } else { self.top[axis] + 1.0 };
                let u = u.clamp(0.0, reach);
                let cell = (u as i64).min(self.top[axis] as i64);
                let weight = (u - cell as f64) as f32;
                batch.sample.weight[axis][i] = weight;
                places[axis][i] = cell as f64 + f64::from(weight);
                // Cells that the part does not hold are those of fragments that are not its own.
                let (first, last) = part[axis];
                voxel += (cell.clamp(first.into(), last.into()) - i64::from(first)) as u64 * frame.sample.strides[axis] as u64;
                corner[2 - axis] = cell;
            }
            // The lowest as voxels lie in memory: z before y before x.
            lowest = lowest.min(corner);
            batch.rare.far_offset[i] = voxel;
            batch.sample.offset[i] = i32::try_from(voxel).unwrap_or(0);
        }
        batch.geometry.cells.base = 0;
        batch.whole_base = [lowest[2], lowest[1], lowest[0]].map(|x| x as usize);
    }

    /// Sets where the fragments lie when each is at a depth of its own.
    fn place_each(&self, depths: &[f64; BATCH], frame: &Frame<'_>, batch: &mut Batch) {
        let mut at = [0u64; BATCH];
        let mut base = u64::MAX;
        for i in 0..BATCH {
            let d = depths[i];
            let scale = self.scale(d);
            let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
            let mut voxel = 0;
            for axis in 0..3 {
                let u = self.start[axis] + d * self.slope[axis] + scale * (x * self.across[axis] + y * self.down[axis]);
                let reach = if frame.sample.strides[axis] == 0 { 0.0 } else { self.top[axis] + 1.0 };
                let u = u.clamp(0.0, reach);
                // Truncation equals floor from 0 up; a lookup on the upper border belongs to the last cell.
                let cell = (u as i64).min(self.top[axis] as i64);
                batch.sample.weight[axis][i] = (u - cell as f64) as f32;
                voxel += cell as u64 * frame.sample.strides[axis] as u64;
            }
            at[i] = voxel;
            base = base.min(voxel);
        }
        batch.geometry.cells.base = base as usize;
        batch.rare.far_offset = array::from_fn(|i| at[i] - base);
        batch.sample.offset = array::from_fn(|i| i32::try_from(at[i] - base).unwrap_or(0));
    }
}

impl<'v, W: Observer> March<'_, '_, 'v, W> {
    /// Makes the values that slice `k` needs besides its own.
    pub(super) fn before_pair(&mut self, k: i64, stages: &PairStages<'v>) {
        if !self.history.entries && k < self.range.last_first + stages.lookback {
            self.history.entries = true;
            let depths = self.depths(|first, _, pixels, i| {
                // With whole slabs at the ends, a ray's first piece has the value of its first slice throughout.
                let piece = if self.work.ends == EndPieces::WholeBetween { 0.0 } else { f64::from(pixels.first_length[i]) };
                first - piece
            });
            self.fetch_each(&depths, stages);
            self.batch.pixels.entry = self.batch.sample.value;
            if stages.lookback > 1 {
                let whole = self.work.ends == EndPieces::WholeBetween;
                let first = self.depths(|first, _, pixels, i| first - if whole { 0.0 } else { 0.5 * f64::from(pixels.first_length[i]) });
                self.fetch_each(&first, stages);
                self.batch.pixels.middle[0] = self.batch.sample.value;
                let second = self.depths(|first, _, _, _| first + 0.5);
                self.fetch_each(&second, stages);
                self.batch.pixels.middle[1] = self.batch.sample.value;
            }
        }
        let earliest = (k - stages.lookback).max(self.range.any.0);
        let ValueHistory { slice, run, .. } = self.history;
        // What is at hand already, if it reaches back far enough.
        let from = if run > 0 && slice >= earliest && slice - run < earliest { slice + 1 } else { earliest };
        let live = self.live_rows();
        for j in from..k {
            self.batch.slice = j as i32;
            self.place(self.work.sampled(j), self.work.frame);
            // A ray that enters at this slice or later needs no earlier values.
            let rows = if j >= self.range.whole.0 && j <= self.range.whole.1 { live } else { live & self.covered_rows() };
            self.batch.rows = rows;
            self.counters.fetches += u64::from(rows.count_ones()) * SIDE as u64;
            for stage in &stages.keep {
                (stage.run)(self.work.frame, self.batch);
            }
            self.history.add(j);
        }
        self.history.add(k);
    }

    /// The pieces between the last slices and the rays' exits; where a march goes on from others, of the rays whose last slice is one of `slices`.
    pub(super) fn after_pairs(&mut self, stages: &PairStages<'v>, slices: &Range<i64>) {
        let frame = self.work.frame;
        let ends_here = |last: i32| !W::RESUMES || slices.contains(&i64::from(last));
        if W::RESUMES && !self.batch.pixels.last.iter().any(|&last| ends_here(last)) {
            return;
        }
        let left = &self.batch.pixels.transmittance;
        if self.work.ends == EndPieces::WholeBetween || !left.iter().any(|&t| t >= frame.blend.terminate) {
            return;
        }
        let lasts = self.depths(|_, last, _, _| last);
        let asked = if W::SELECTS { self.observer.fragments_each(self.work.stack, self.first_pixel, &lasts) } else { u64::MAX };
        if W::SELECTS && asked == 0 {
            return;
        }
        let exits = self.depths(|_, last, pixels, i| last + f64::from(pixels.last_length[i]));
        if let Some(skip_table) = self.work.skip_table {
            let near = lasts.iter().copied().fold(f64::INFINITY, f64::min);
            let far = exits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let (mut lo, mut hi) = self.transform.bounds(near, far);
            if W::SELECTS {
                // Bricks are those of the part.
                for axis in 0..3 {
                    let first = self.transform.first(axis);
                    (lo[axis], hi[axis]) = (lo[axis] - first, hi[axis] - first);
                }
            }
            if skip_table.class(lo, hi) == 0 {
                return;
            }
        }
        self.fetch_each(&lasts, stages);
        self.batch.pixels.previous[0] = self.batch.sample.value;
        if stages.lookback > 1 {
            let middles = array::from_fn(|i| 0.5 * (lasts[i] + exits[i]));
            self.fetch_each(&middles, stages);
            self.batch.pixels.middle[1] = self.batch.sample.value;
        }
        self.fetch_each(&exits, stages);
        let mut mask = 0u64;
        for i in 0..BATCH {
            let (first, last) = (self.batch.pixels.first[i], self.batch.pixels.last[i]);
            self.batch.slab.length[i] = self.batch.pixels.last_length[i].max(0.0) * self.batch.pixels.slant[i];
            let (x, y) = (self.window.0 + (i % SIDE) as f64, self.window.1 + (i / SIDE) as f64);
            let sure = self.batch.pixels.doubt >> i & 1 == 0;
            mask |= u64::from(first <= last && ends_here(last) && (sure || self.work.stack.covers(last as u64, x, y))) << i;
            if let Some(fog) = extra(self.work.fog) {
                let middle = 0.5 * (lasts[i] + exits[i]);
                let along = middle * f64::from(self.batch.pixels.slant[i]);
                let z = if self.work.radial { (along * along + f64::from(self.batch.pixels.plane_squared[i])).sqrt() } else { middle };
                self.batch.fog.each[i] = fog.factor(z) as f32;
            }
        }
        self.whole_lengths = false;
        self.batch.mask = mask & asked;
        (self.batch.rows, self.batch.shown, self.batch.ends) = (u8::MAX, u8::MAX, true);
        self.batch.slice = BEHIND;
        self.counters.batches += 1;
        self.counters.exits += 1;
        self.observer.slice(frame, self.batch);
        for stage in &stages.exit {
            (stage.run)(frame, self.batch);
            self.observer.stage(stage.id, frame, self.batch);
        }
    }

    /// A depth for each ray from its first and last slice; that of the nearest slice for rays that miss.
    fn depths(&self, at: impl Fn(f64, f64, &crate::fragment::PixelBlock, usize) -> f64) -> [f64; BATCH] {
        let pixels = &self.batch.pixels;
        array::from_fn(|i| {
            let (first, last) = (pixels.first[i], pixels.last[i]);
            let slice = if first <= last { at(f64::from(first), f64::from(last), pixels, i) } else { self.range.any.0 as f64 };
            self.work.stack.near + (slice + 0.5) * self.work.stack.spacing
        })
    }

    fn fetch_each(&mut self, depths: &[f64; BATCH], stages: &PairStages<'v>) {
        match &self.transform.part {
            Some(part) if W::SELECTS => self.transform.place_each_part(part, depths, self.work.frame, self.batch),
            _ => self.transform.place_each(depths, self.work.frame, self.batch),
        }
        self.batch.rows = u8::MAX;
        self.counters.fetches += BATCH as u64;
        (stages.fetch.run)(self.work.frame, self.batch);
    }
}
