//! Fragments: what one slice leaves in an 8 x 8 block of pixels, computed stage by stage.
//!
//! Rules of this room:
//! - a stage is a short loop over a [`Batch`], written once over [`crate::lanes::Lanes`] as a kernel; it reads and writes the
//!   batch's arrays and what the [`Frame`] holds, and nothing else;
//! - no stage branches on what a scene might want: a stage that a scene does not need is not in its list;
//! - every lane is computed, covered or not; uncovered lanes are made transparent before blending.
//!
//! ```text
//!  span -> texcoord -> fetch -> [guard] -> classify -> [regions] -> [labels] -> [correct] -> [gradient] -> [gradient opacity] -> [light] -> [fog] -> [mask] -> blend
//! ```
//!
//! What is known of a stage besides its kernel stands in `scene::StageId`.

mod batch;
mod blend;
mod classify;
mod colors;
mod correct;
mod cubic;
mod fetch;
mod fog;
mod frame;
mod gradient;
mod gradient_opacity;
mod labels;
mod light;
mod pair;
mod pieces;
mod places;
pub(crate) mod project;
mod rays;
mod regions;
mod segments;
mod span;
mod surfaces;
mod texcoord;
mod transfer2d;

pub(crate) use batch::{Batch, PixelBlock, RaySummary};
pub(crate) use blend::{BlendBack, BlendFront, Compensated, MaskStage, Plain, Store, Unorm8};
pub(crate) use classify::{Classify, ClassifyCorners};
pub(crate) use colors::{ClassifyColors, ColorSource, FINE};
pub(crate) use correct::{Correct, CorrectRiemann};
pub(crate) use cubic::FetchCubic;
pub(crate) use fetch::{FetchAny, FetchCorners, FetchNearest, FetchPacked8, FetchPacked16, FetchPairs8, FetchPairs16, FetchPairs32, Guard};
pub(crate) use frame::{AttenuationFrame, BlendFrame, ColorFrame, FogFrame, Frame, SampleFrame};
pub(crate) use gradient::GradientFrame;
#[cfg(feature = "explain")]
pub(crate) use gradient::index_of;
pub(crate) use gradient_opacity::OpacityFrame;
pub(crate) use labels::{FetchLabels, LabelFrame, LabelPiece};
pub(crate) use light::LightingFrame;
pub(crate) use pair::{BEHIND, ClassifyPair, KeepValue};
pub(crate) use pieces::{CorrectPieces, DEEP, PieceFrame, classify_pieces};
pub(crate) use project::{ProjectAdd, ProjectAttenuated, ProjectAverage, ProjectIso, ProjectLmip, ProjectMax, ProjectMin};
pub(crate) use rays::{RayBatch, TexcoordRays};
pub(crate) use regions::{FocusFrame, RegionsFrame};
pub(crate) use segments::{Effect, SegmentsFrame};
pub(crate) use span::{Span, SpanPair};
pub(crate) use surfaces::{BlendSurfaces, SurfaceFrame};
pub(crate) use texcoord::{Texcoord, TexcoordFar, TexcoordPart};
pub(crate) use transfer2d::{Numbers, Transfer2dFrame};

use crate::lanes::Level;
use crate::proxy::Stack;
use crate::scene::{OptionalStage, Scene, StageId};
use crate::volume::Grid;

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
    /// At places of their own along their rays: see [`RayBatch`].
    AlongRays,
}

/// Constants of the stages that scenes may ask for.
#[derive(Debug, Clone)]
pub(crate) struct OptionalFrame<'v> {
    /// Regions with transfer functions of their own, if there are any.
    pub(crate) regions: Option<RegionsFrame>,
    /// Segments of a label map, where any is hidden, tinted or replaced.
    pub(crate) segments: Option<SegmentsFrame<'v>>,
    /// How gradients are taken, where anything depends on them.
    pub(crate) gradient: Option<GradientFrame>,
    /// How opacity depends on the gradient, if it does.
    pub(crate) opacity: Option<OpacityFrame>,
    /// A transfer function of value and gradient, if there is one.
    pub(crate) transfer2d: Option<Transfer2dFrame>,
    /// Light, if any.
    pub(crate) light: Option<LightingFrame>,
    /// Fog, if any.
    pub(crate) fog: Option<FogFrame>,
}

impl<'v> OptionalFrame<'v> {
    /// Those of `scene`, with `regions` and `segments` as they are prepared, in slices of `stack`, `ratio` reference lengths thick, through a volume on `grid`, which holds `dims` voxels of it, of such `numbers`; pixels whose
    /// transmittance is below `live` take nothing more.
    pub(crate) fn of(
        scene: &Scene,
        (regions, segments): (Option<RegionsFrame>, Option<SegmentsFrame<'v>>),
        (grid, dims, stack): (&Grid, [usize; 3], &Stack),
        (numbers, ratio): (Numbers, f64),
        live: f32,
    ) -> Self {
        let gradient =
            scene.needs_gradient().then(|| GradientFrame::new(scene.gradient(), grid, numbers.scale).with_dims(dims).with_live(live));
        Self {
            regions,
            segments,
            opacity: gradient.as_ref().and_then(|gradient| OpacityFrame::of(scene.transfer(), gradient)),
            transfer2d: gradient.as_ref().zip(scene.transfer2d()).map(|(g, transfer)| Transfer2dFrame::new(transfer, g, numbers, ratio)),
            light: scene.lighting().map(|lighting| LightingFrame::new(lighting, gradient.as_ref(), grid, stack)),
            gradient,
            fog: FogFrame::of(scene),
        }
    }
}

/// The kernel of a stage that scenes may ask for; `None` where `scene` does not.
/// `part` tells whether a part of a volume is looked up.
pub(crate) fn optional_kernel<'v>(stage: OptionalStage, scene: &Scene, pieces: Pieces, part: bool, level: Level) -> Option<Run<'v>> {
    let option = stage.option();
    match stage {
        OptionalStage::Regions => (option.wanted)(scene).then(|| regions::kernel(level)),
        OptionalStage::Labels => (option.wanted)(scene).then(|| segments::kernel(scene.blend().projects_values(), level)),
        OptionalStage::Gradient => scene.needs_gradient().then(|| gradient::kernel(level)),
        OptionalStage::GradientOpacity => (option.wanted)(scene).then(|| gradient_opacity::kernel(level)),
        OptionalStage::Transfer2d => scene.transfer2d().map(|_| transfer2d::kernel(level)),
        OptionalStage::Light => Some(light::kernel(scene.lighting()?.shading, pieces, part, level)),
        OptionalStage::Fog => Some(fog::kernel(scene.fog()?.distance(), pieces, level)),
    }
}

#[cfg(test)]
mod tests;
