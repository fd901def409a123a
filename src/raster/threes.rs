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
use crate::fragment::batch::{BATCH, SIDE, row};
use crate::lanes::{Kernel, Lanes, Level};
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
    changes: [f32; CHANGES],
    /// See [`LetThrough`].
    let_through: fn(&[f32; BATCH], &mut f32),
}

impl<'f, 'v> Threes<'f, 'v> {
    /// `change` tells the largest change of a slab's colour and opacity in bricks of a class.
    pub(crate) fn new(frame: &'f Frame<'v>, change: impl Fn(usize) -> f32, level: Level) -> Self {
        Self { frame, changes: std::array::from_fn(change), let_through: level.kernel::<LetThrough, _, _>() }
    }
}

/// Root mean square of the transmittance of a block's pixels.
struct LetThrough;

impl Kernel<[f32; BATCH], f32> for LetThrough {
    #[inline(always)]
    fn run<L: Lanes>(transmittance: &[f32; BATCH], mean: &mut f32) {
        let mut squares = L::splat(0.0);
        for r in 0..SIDE {
            let t = L::load(row(transmittance, r));
            squares = L::add(squares, L::mul(t, t));
        }
        let mut sums = [0.0; SIDE];
        L::store(squares, &mut sums);
        *mean = (sums.iter().sum::<f32>() / BATCH as f32).sqrt();
    }
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
            if whole && self.hardly(threes, change) {
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

    /// Whether a change of colour and opacity hardly shows behind what the block's pixels have gathered.
    fn hardly(&mut self, threes: &Threes<'f, 'v>, change: f32) -> bool {
        // No pixel lets more than all light through.
        if change <= MOST {
            return true;
        }
        if change == f32::INFINITY {
            return false;
        }
        if self.through.is_nan() {
            (threes.let_through)(&self.batch.pixels.transmittance, &mut self.through);
        }
        change * self.through <= MOST
    }
}
