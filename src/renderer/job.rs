//! A picture in the making: what its frames share, and what they took.

use crate::plan::{Planned, passed_over};
use crate::scene::{Method, Scene, View};
use crate::tally::{Counters, LeftOut, Tally};
use std::time::Instant;

/// What frames of a picture share.
pub(super) struct RenderJob<'s, O> {
    pub(super) scene: &'s Scene,
    pub(super) view: View,
    pub(super) clock: Clock,
    pub(super) observer: O,
    /// What is made of the layers.
    pub(super) output: Output,
}

/// What is made of layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Output {
    /// Pictures over the scene's background.
    Picture,
    /// Nothing: the layers themselves are wanted.
    Layer,
    /// Nothing: what pixels have gathered is wanted.
    Gathered,
}

/// What a frame took, or several frames that make up one picture.
pub(super) struct FrameResult {
    pub(super) counters: Counters,
    pub(super) frames: u64,
    pub(super) slices: u64,
    pub(super) planned: Vec<Planned>,
    /// How its rays were integrated.
    pub(super) method: Method,
    /// Share of the bricks in which anything shows, where empty ones are passed over.
    pub(super) visible_share: Option<f64>,
    /// Whether bricks are passed over by how far their values reach.
    pub(super) peaks: bool,
    /// What gathered values stand for: `numbers[0]` times one, plus `numbers[1]`, is the value in the data's units; averages are relative to
    /// `numbers[2]`.
    pub(super) numbers: [f64; 3],
}

impl FrameResult {
    /// Adds a further frame of the same picture.
    pub(super) fn add(&mut self, other: &Self) {
        self.cost(other);
        self.slices = self.slices.max(other.slices);
    }

    /// Adds what another frame took that is not part of the picture.
    pub(super) fn cost(&mut self, other: &Self) {
        self.counters.add(&other.counters);
        self.frames += other.frames;
    }

    /// Where the work went.
    pub(super) fn tally(&self) -> Tally {
        self.counters.tally(self.frames)
    }

    /// Everything that was left out of the picture.
    pub(super) fn left_out(&mut self) -> Vec<LeftOut> {
        let tally = self.tally();
        let planned = std::mem::take(&mut self.planned).into_iter();
        planned.map(|p| p.counted(&self.counters)).chain(passed_over(&tally, self.visible_share, self.peaks)).collect()
    }
}

/// Seconds since a picture was begun, and those of them that went into what depends on volume and transfer function only.
#[derive(Debug)]
pub(super) struct Clock {
    pub(super) start: Instant,
    pub(super) prepare_seconds: f64,
}

impl Default for Clock {
    fn default() -> Self {
        Self { start: Instant::now(), prepare_seconds: 0.0 }
    }
}

impl Clock {
    pub(super) fn prepare<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.prepare_seconds += start.elapsed().as_secs_f64();
        result
    }
}
