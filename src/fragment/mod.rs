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

mod batch;
mod blend;
mod classify;
mod correct;
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
pub(crate) use fetch::{FetchAny, FetchCorners, FetchNearest, FetchPacked8, FetchPacked16, FetchPairs8, FetchPairs16, FetchPairs32, Guard};
pub(crate) use fog::{FogEach, FogPlanar, FogRadial};
pub(crate) use frame::{BlendFrame, ColorFrame, FogFrame, Frame, SampleFrame};
pub(crate) use pair::{BEHIND, ClassifyPair, KeepValue};
pub(crate) use project::{ProjectAdd, ProjectAverage, ProjectIso, ProjectLmip, ProjectMax, ProjectMin};
pub(crate) use span::{Span, SpanPair};
pub(crate) use texcoord::{Texcoord, TexcoordFar};

/// One stage, compiled for one instruction set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage<'v> {
    /// The stage's name: that of its place in the chain above.
    pub(crate) name: &'static str,
    /// Takes a batch through the stage.
    pub(crate) run: fn(&Frame<'v>, &mut Batch),
}

#[cfg(test)]
mod tests;
