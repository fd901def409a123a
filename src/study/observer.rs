//! Where a frame's time goes: some of the batches are timed from stage to stage.

use crate::fragment::{Batch, Frame};
use crate::raster::Observer;
use crate::scene::StageId;
use std::time::{Duration, Instant};

/// One batch in so many is timed: a clock takes about as long to read as a short stage to run.
const EVERY: u64 = 32;
/// The batch of those that is: not the first, which meets cold caches.
const WHICH: u64 = 17;

/// Time spent in stages, of the batches that were timed.
#[derive(Debug, Default)]
pub(super) struct StageClock {
    batches: u64,
    last: Option<Instant>,
    timed: u64,
    /// Stage, time, how often.
    stages: Vec<(StageId, Duration, u64)>,
}

impl StageClock {
    /// Batches seen.
    pub(super) fn batches(&self) -> u64 {
        self.batches
    }

    /// Batches timed.
    pub(super) fn timed(&self) -> u64 {
        self.timed
    }

    /// Each stage's mean seconds per batch, batches that do not run it counted in; the clock's own time taken off.
    pub(super) fn per_batch(&self) -> Vec<(&'static str, f64)> {
        let tick = tick();
        let mean = |&(id, time, runs): &(StageId, Duration, u64)| {
            let seconds = time.as_secs_f64() - runs as f64 * tick;
            (id.name(), (seconds / self.timed.max(1) as f64).max(0.0))
        };
        self.stages.iter().map(mean).collect()
    }
}

/// Seconds it takes to read the clock.
fn tick() -> f64 {
    const READS: u32 = 1000;
    let runs = (0..5).map(|_| {
        let start = Instant::now();
        let mut last = start;
        for _ in 0..READS {
            last = Instant::now();
        }
        (last - start).as_secs_f64() / f64::from(READS)
    });
    runs.fold(f64::INFINITY, f64::min)
}

impl Observer for StageClock {
    fn fresh(&self) -> Self {
        Self::default()
    }

    fn slice(&mut self, _: &Frame<'_>, _: &Batch) {
        self.batches += 1;
        if self.batches % EVERY == WHICH {
            self.timed += 1;
            self.last = Some(Instant::now());
        } else {
            self.last = None;
        }
    }

    fn stage(&mut self, id: StageId, _: &Frame<'_>, _: &Batch) {
        let Some(last) = self.last else { return };
        let spent = last.elapsed();
        match self.stages.iter_mut().find(|s| s.0 == id) {
            Some(stage) => {
                stage.1 += spent;
                stage.2 += 1;
            }
            None => self.stages.push((id, spent, 1)),
        }
        self.last = Some(Instant::now());
    }

    fn merge(&mut self, other: Self) {
        self.batches += other.batches;
        self.timed += other.timed;
        for (id, time, runs) in other.stages {
            match self.stages.iter_mut().find(|s| s.0 == id) {
                Some(stage) => {
                    stage.1 += time;
                    stage.2 += runs;
                }
                None => self.stages.push((id, time, runs)),
            }
        }
    }
}
