//! Fragments: what one slice leaves in an 8 x 8 block of pixels, computed stage by stage.
//!
//! Rules of this room:
//! - a stage is a short loop over a [`Batch`], written once over [`crate::lanes::Lanes`] as a kernel; it reads and writes the
//!   batch's arrays and what the [`Frame`] holds, and nothing else;
//! - no stage branches on what a scene might want: a stage that a scene does not need is not in its list;
//! - every lane is computed, covered or not; uncovered lanes are made transparent before blending.
//!
//! ```text
//!  span -> texcoord -> fetch -> [guard] -> classify -> [correct] -> [fog] -> [mask] -> blend
//! ```
//!
//! What is known of a stage besides its kernel stands in `scene::StageId`.

mod batch;
mod blend;
mod classify;
mod correct;
mod cubic;
mod fetch;
mod fog;
mod frame;
mod pair;
pub(crate) mod project;
mod span;
mod texcoord;

pub(crate) use batch::{Batch, PixelBlock, RaySummary};
pub(crate) use blend::{BlendBack, BlendFront, Compensated, MaskStage, Plain, Store, Unorm8};
pub(crate) use classify::{Classify, ClassifyCorners};
pub(crate) use correct::{Correct, CorrectRiemann};
pub(crate) use cubic::FetchCubic;
pub(crate) use fetch::{FetchAny, FetchCorners, FetchNearest, FetchPacked8, FetchPacked16, FetchPairs8, FetchPairs16, FetchPairs32, Guard};
pub(crate) use frame::{BlendFrame, ColorFrame, FogFrame, Frame, SampleFrame};
pub(crate) use pair::{BEHIND, ClassifyPair, KeepValue};
pub(crate) use project::{ProjectAdd, ProjectAverage, ProjectIso, ProjectLmip, ProjectMax, ProjectMin};
pub(crate) use span::{Span, SpanPair};
pub(crate) use texcoord::{Texcoord, TexcoordFar, TexcoordPart};

use crate::lanes::Level;
use crate::scene::{OptionalStage, Scene, StageId};

/// What a stage does to a batch, compiled for one instruction set.
pub(crate) type Run<'v> = fn(&Frame<'v>, &mut Batch);

/// One stage of a plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage<'v> {
    /// Which one.
    pub(crate) id: StageId,
    /// Takes a batch through the stage.
    pub(crate) run: Run<'v>,
}

/// Where the pieces of a batch lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pieces {
    /// All on one slice.
    OnSlice,
    /// Behind the last slices of their rays, each at a depth of its own.
    BehindSlices,
}

/// Constants of the stages that scenes may ask for.
#[derive(Debug, Clone)]
pub(crate) struct OptionalFrame {
    /// Fog, if any.
    pub(crate) fog: Option<FogFrame>,
}

impl OptionalFrame {
    /// Those of `scene`.
    pub(crate) fn of(scene: &Scene) -> Self {
        Self { fog: FogFrame::of(scene) }
    }
}

/// The kernel of a stage that scenes may ask for; `None` where `scene` does not.
pub(crate) fn optional_kernel<'v>(stage: OptionalStage, scene: &Scene, pieces: Pieces, level: Level) -> Option<Run<'v>> {
    match stage {
        OptionalStage::Fog => Some(fog::kernel(scene.fog()?.distance(), pieces, level)),
    }
}

#[cfg(test)]
mod tests;
