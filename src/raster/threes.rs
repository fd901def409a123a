//! Three slabs as one, where colour and opacity hardly change or hardly any light comes from: a third of the lookups.
//!
//! ```text
//!   slices   0   1   2 | 3   4   5 | 6   7   8 |     threes lie at fixed places of the stack; the middle slice of one
//!            .   o   . | o   o   o | .   o   . |     stands for a slab three times as thick, with a table of its own
//! ```

use super::block::March;
use super::contents::LOOKS;
use super::watch::Watch;
use crate::fragment::Frame;
use crate::fragment::batch::{BATCH, SIDE};
use crate::plan::CHANGES;

/// Largest change of a slab's colour and opacity in three slabs that become one, times the root mean square of what the block's pixels let
/// through. On CT scans, from a hundred slices to a thousand, values from 0.03 to 0.1 take about the same number of lookups for the same
/// error; much smaller ones find fewer places, much larger ones cost more in error than they save.
const MOST: f32 = 0.04;

/// Slabs that become one.
pub(crate) const THREE: i64 = 3;

/// What a frame needs to take three slabs for one.
pub(crate) struct Threes<'f, 'v> {
    /// The frame with a table for slabs three times as thick.
    pub(crate) frame: &'f Frame<'v>,
    /// The largest change of a slab's colour and opacity in bricks of each class.
    pub(crate) changes: [f32; CHANGES],
}

impl<'f, 'v, W: Watch> March<'_, 'f, 'v, W> {
    /// Slices `from..to`, nearest first, on which something of `class` shows; in threes where that will do. False when every pixel is
    /// finished.
    pub(super) fn in_threes(&mut self, threes: &Threes<'f, 'v>, from: i64, to: i64, class: u8) -> bool {
        let change = threes.changes.get(usize::from(class)).copied().unwrap_or(f32::INFINITY);
        let mut k = from;
        while k < to {
            let end = ((k / THREE + 1) * THREE).min(to);
            let whole = end - k == THREE && k >= self.range.whole.0 && end - 1 <= self.range.whole.1;
            if whole && change * self.let_through() <= MOST {
                self.one(k + 1, threes.frame);
                // The two others' fragments, of the rows that went through the stages and of the rest.
                let inside = u64::from(self.batch.rows.count_ones()) * SIDE as u64;
                self.counters.merged += 2;
                self.counters.merged_fragments += 2 * inside;
                self.counters.finished_fragments += 2 * (BATCH as u64 - inside);
                if self.batch.pixels.alive == 0 {
                    self.stop(end - 1, (end, to));
                    return false;
                }
            } else if !self.one_by_one(k, end, to) {
                return false;
            }
            k = end;
        }
        true
    }

    /// Slices `from..end` of a run that ends before `to`, each on its own.
    fn one_by_one(&mut self, from: i64, end: i64, to: i64) -> bool {
        let mut classes = [u8::MAX; LOOKS];
        // A look at thick slabs three at a time tells little of each.
        if let (Some(sight), true) = (self.work.sight, self.work.runs.thick) {
            self.work.look_at(&self.placing, &sight.fine, (from, 1), (end - from) as usize, &mut classes);
        }
        for k in from..end {
            if classes[(k - from) as usize] == 0 {
                self.pass_over(k, k + 1);
                continue;
            }
            self.one(k, self.work.frame);
            if self.batch.pixels.alive == 0 {
                self.stop(k, (k + 1, to));
                return false;
            }
        }
        true
    }

    /// Root mean square of the pixels' transmittance.
    fn let_through(&self) -> f32 {
        let mut sums = [0.0f32; SIDE];
        for row in self.batch.pixels.transmittance.chunks_exact(SIDE) {
            for (sum, t) in sums.iter_mut().zip(row) {
                *sum += t * t;
            }
        }
        (sums.iter().sum::<f32>() / BATCH as f32).sqrt()
    }
}
