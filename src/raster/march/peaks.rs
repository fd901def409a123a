//! The slices of a projection of the largest value (or the smallest), those of the highest bricks first: what is left then cannot change a pixel, mostly.
//!
//! ```text
//!   runs of slices     2   7   3   9   9   1       9 first: a pixel that has seen more than 7 stands for needs no 7 and nothing lower; once
//!   by class                       ^   ^           that holds for all pixels of the block all the rest is passed over
//! ```
//! The largest of some numbers is the same whatever order they come in, so the bytes are those of all slices one after the other.

use super::March;
use crate::lanes::BATCH;
use crate::raster::observer::Observer;
use crate::skip::{BOXES, PeakTable};

/// Runs that are put in order together.
const TOGETHER: usize = 16 * BOXES;

impl<'f, 'v, W: Observer> March<'_, 'f, 'v, W> {
    /// Slices `from..to`, but for those on which no value can be larger than what pixels have seen.
    #[inline(never)]
    pub(super) fn peaks(&mut self, peaks: &'f PeakTable, from: i64, to: i64) {
        self.settle();
        let pixels = &self.batch.pixels;
        let covered = (0..BATCH).fold(0, |bits, i| bits | u64::from(pixels.first[i] <= pixels.last[i]) << i);
        let slices = self.work.runs.slices;
        let (mut at, end) = (from / slices, (to - 1) / slices + 1);
        while at < end {
            let count = ((end - at) as usize).min(TOGETHER);
            self.highest_first(peaks, (at, count), (from, to), covered);
            at += count as i64;
        }
        self.batch.pixels.alive = u64::MAX;
    }

    /// Slices of `from..to` in `count` runs from `first` on, the runs that reach highest first.
    fn highest_first(&mut self, peaks: &'f PeakTable, (first, count): (i64, usize), (from, to): (i64, i64), covered: u64) {
        let (work, slices) = (self.work, self.work.runs.slices);
        // One more than a run's class; 0 once it is done.
        let mut marks = [0u8; TOGETHER];
        let marks = &mut marks[..count];
        for (n, marks) in marks.chunks_mut(BOXES).enumerate() {
            let mut classes = [0; BOXES];
            let run = first + (n * BOXES) as i64;
            work.query_boxes(&self.transform, &peaks.windows, (run * slices, slices), marks.len(), &mut classes);
            marks.iter_mut().zip(classes).for_each(|(mark, class)| *mark = class.saturating_add(1));
        }
        let ends = |run: usize| {
            let run = first + run as i64;
            ((run * slices).max(from), ((run + 1) * slices).min(to))
        };
        while let Some(highest) = marks.iter().copied().max().filter(|&highest| highest > 0) {
            // The last mark stands for two classes, neither of which has a bound.
            let bound = peaks.bound(if highest == u8::MAX { u8::MAX } else { highest - 1 });
            if work.open_to(bound, &self.batch.pixels.color[0]) & covered == 0 {
                for run in (0..count).filter(|&run| marks[run] > 0) {
                    let (first, end) = ends(run);
                    self.pass_over(first, end);
                }
                return;
            }
            for run in 0..count {
                if marks[run] != highest {
                    continue;
                }
                marks[run] = 0;
                let (first, end) = ends(run);
                for k in first..end {
                    let open = work.open_to(bound, &self.batch.pixels.color[0]) & covered;
                    if open == 0 {
                        self.pass_over(k, end);
                        break;
                    }
                    // Rows of pixels that have seen as much are left out.
                    self.batch.pixels.alive = open;
                    self.slice_not_inlined(k, work.frame);
                }
            }
        }
    }
}
