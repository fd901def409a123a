//! Three slabs as one, or nine, where colour and opacity hardly change or hardly any light comes from: fewer lookups.
//!
//! ```text
//!   slices   0   1   2 | 3   4   5 | 6   7   8 |     threes and nines lie at fixed places of the stack; the middle slice of
//!            .   o   . | o   o   o | .   o   . |     one stands for a slab so many times as thick, with a table of its own
//! ```

use super::March;
use crate::lanes::{BATCH, SIDE};
use crate::plan::Merging;
use crate::raster::observer::Observer;
use crate::skip::{BOXES, MERGED};

/// The fewest slabs that become one.
const THREE: i64 = MERGED[0];
/// The most.
const NINE: i64 = MERGED[1];

impl<'f, 'v, W: Observer> March<'_, 'f, 'v, W> {
    /// Slices `from..to` of a coarse run, nearest first, several as one where that will do; `classes` tells what shows in its runs. False
    /// when every pixel is finished.
    pub(super) fn merging(&mut self, merging: &'f Merging<'v>, (from, to): (i64, i64), classes: &[u8]) -> bool {
        let slices = self.work.runs.slices;
        let run = |k: i64| (k / slices - from / slices) as usize;
        let mut k = from;
        while k < to {
            let class = classes[run(k)];
            // Nine slices lie in a run or in three.
            let nine = k % NINE == 0 && k + NINE <= to;
            let most = if nine { classes[run(k)..=run(k + NINE - 1)].iter().copied().fold(0, u8::max) } else { 0 };
            if most > 0 && self.merged::<1>(merging, k, most) {
                k += NINE;
            } else if class == 0 {
                let end = ((k / slices + 1) * slices).min(to);
                self.pass_over(k, end);
                k = end;
            } else {
                let end = ((k / THREE + 1) * THREE).min(to);
                let merged = end - k == THREE && self.merged::<0>(merging, k, class);
                if !merged && !self.one_by_one(k, end, to) {
                    return false;
                }
                k = end;
            }
            if self.batch.pixels.alive == 0 {
                self.stop(k - 1, (k, to));
                return false;
            }
        }
        true
    }

    /// Slices from `k` on, as many as [`MERGED`] says at place `N`, as one, if that will do where something of `class` shows.
    fn merged<const N: usize>(&mut self, merging: &'f Merging<'v>, k: i64, class: u8) -> bool {
        let (count, most) = (MERGED[N], merging.most[N]);
        let whole = k >= self.range.whole.0 && k + count - 1 <= self.range.whole.1;
        if !(whole && self.hardly_shows(merging.change(class), most)) {
            return false;
        }
        self.slice_not_inlined(k + count / 2, &merging.frames[N]);
        // The others' fragments, of the rows that went through the stages and of the rest.
        let (others, inside) = (count as u64 - 1, u64::from(self.batch.rows.count_ones()) * SIDE as u64);
        self.counters.merged += others;
        self.counters.merged_fragments += others * inside;
        self.counters.finished_fragments += others * (BATCH as u64 - inside);
        true
    }

    /// Slices `from..end` of a coarse run that ends before `to`, each on its own.
    fn one_by_one(&mut self, from: i64, end: i64, to: i64) -> bool {
        let mut classes = [u8::MAX; BOXES];
        // The class of a run of three thick slabs says little about one of them, so each is asked about.
        if let (Some(skip_table), true) = (self.work.skip_table, self.work.runs.thick) {
            self.work.query_boxes(&self.transform, &skip_table.fine, (from, 1), (end - from) as usize, &mut classes);
        }
        for k in from..end {
            if classes[(k - from) as usize] == 0 {
                self.pass_over(k, k + 1);
                continue;
            }
            self.slice_not_inlined(k, self.work.frame);
            if self.batch.pixels.alive == 0 {
                self.stop(k, (k + 1, to));
                return false;
            }
        }
        true
    }

    /// Whether a change of colour and opacity is below `most` behind what the block's pixels have gathered.
    fn hardly_shows(&mut self, change: f32, most: f32) -> bool {
        // Transmittance is at most 1, so a change below the limit needs no weighting.
        if change <= most {
            return true;
        }
        if change == f32::INFINITY {
            return false;
        }
        if self.through.is_nan() {
            (self.work.let_through)(&self.batch.pixels.transmittance, &mut self.through);
        }
        change * self.through <= most
    }
}
