//! All regions of a frame, in threads.

use super::frame::{Common, Frame, PieceCounts, Worker, around};
use crate::lanes::SIDE;
use crate::plan::{FramePlan, Planned, value_range};
use crate::raster::{Resolve, Work};
use crate::renderer::OverBackground;
use crate::tally::Counters;
use crate::{Error, Result};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Columns and rows of blocks.
pub(super) type Region = (Range<u32>, Range<u32>);

/// Side of a region in blocks, in large pictures and in small ones.
const SIDES: [u32; 2] = [8, 4];
/// Pixels of a large picture.
const LARGE: u64 = 512 * 512;

/// What became of the regions of a frame.
pub(super) struct Done {
    /// The pixels of each region, row by row.
    pub(super) pixels: Vec<Vec<[f32; 4]>>,
    pub(super) counters: Counters,
    pub(super) counts: PieceCounts,
    pub(super) planned: Vec<Planned>,
}

impl Frame<'_> {
    /// Renders `regions` on the current thread pool; `what` is told of the progress.
    pub(super) fn run(&self, regions: &[Region], what: &str) -> Result<Done> {
        let blank = self.blank()?;
        let held = ([0; 3], self.levels.grid().dims().map(|n| n.min(2)));
        let plan: FramePlan<'_> = self.plan(&blank, 0, held);
        let work = Work::new(&plan);
        let intervals = work.ray_intervals();
        let resolve = Resolve::new(self.scene, &plan);
        let finish = OverBackground::new(self.scene, &plan.needs.method);
        let like = self.levels.like();
        let shows = |low: f64, high: f64| {
            let (low, high) = value_range(&like, low, high);
            plan.transfer.classifier.may_show(low, high)
        };
        let common = Common {
            work: &work,
            intervals: &intervals,
            resolve: &resolve,
            finish: &finish,
            around: around(&plan),
            skips: plan.needs.skip,
            shows: &shows,
        };
        let total = regions.len() as u64;
        let (done, stopped) = (AtomicU64::new(0), AtomicBool::new(false));
        let queue = Mutex::new(regions.iter().enumerate());
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let parts = rayon::broadcast(|_| {
            let mut worker = Worker::new(&work);
            let mut made = Vec::new();
            while let Some((at, region)) = next() {
                if stopped.load(Ordering::Relaxed) {
                    break;
                }
                let pixels = self.render(&common, region.clone(), &mut worker);
                let failed = pixels.is_err();
                made.push((at, pixels));
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                if failed || !self.control.step(what, done, total) {
                    stopped.store(true, Ordering::Relaxed);
                    break;
                }
            }
            (made, worker.end())
        });
        let (mut counters, mut counts) = (Counters::default(), PieceCounts::default());
        let mut all = Vec::with_capacity(regions.len());
        for (made, (counter, count)) in parts {
            counters.add(&counter);
            counts.add(&count);
            all.extend(made);
        }
        // In the order of regions, whoever rendered them; the first fault is told.
        all.sort_unstable_by_key(|part| part.0);
        let pixels = all.into_iter().map(|part| part.1).collect::<Result<Vec<_>>>()?;
        if stopped.into_inner() {
            return Err(Error::Stopped);
        }
        let planned = plan.left_out.clone();
        Ok(Done { pixels, counters, counts, planned })
    }
}

/// The regions of a picture, row by row.
pub(super) fn regions((width, height): (u32, u32)) -> Vec<Region> {
    let side = SIDES[usize::from(u64::from(width) * u64::from(height) < LARGE)];
    let (columns, rows) = (width.div_ceil(SIDE as u32), height.div_ceil(SIDE as u32));
    let starts = |n: u32| (0..n).step_by(side as usize);
    starts(rows).flat_map(|y| starts(columns).map(move |x| (x..(x + side).min(columns), y..(y + side).min(rows)))).collect()
}

/// Lays the pixels of regions into the picture's.
pub(super) fn put(regions: &[Region], parts: &[Vec<[f32; 4]>], pixels: &mut [[f32; 4]], (width, height): (u32, u32)) {
    let side = SIDE as u32;
    for ((columns, rows), part) in regions.iter().zip(parts) {
        let (left, right) = (columns.start * side, (columns.end * side).min(width));
        let top = rows.start * side;
        let bottom = (rows.end * side).min(height);
        for (y, row) in (top..bottom).zip(part.chunks_exact((right - left) as usize)) {
            pixels[y as usize * width as usize + left as usize..][..row.len()].copy_from_slice(row);
        }
    }
}
