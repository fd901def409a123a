//! The stages of a plan, compiled for a vector level.

use super::needs::{BlendKind, Lookup, Needs};
use crate::fragment::*;
use crate::lanes::Level;
use crate::lean::LEAN;
use crate::scene::{Classification, Filter, InProjections, OptionalStage, Order, Scene, SlabForm, StageId, Target};
use crate::volume::VoxelType;

/// Stages of batches whose fragments are all covered by whole slabs, and of all others.
#[derive(Debug, Clone)]
pub(crate) struct Stages<'v> {
    /// Sets coverage and lengths of batches that are not whole.
    pub(crate) span: Stage<'v>,
    /// Stages of batches in which every fragment is covered by a whole slab.
    pub(crate) whole: Vec<Stage<'v>>,
    /// Stages of all other batches.
    pub(crate) partial: Vec<Stage<'v>>,
    /// More lookups, where slabs lie between slices.
    pub(crate) pairs: Option<PairStages<'v>>,
    /// From places, already there, to what is blended, for batches of samples that each lie at a depth of their own; none in frames of slices.
    pub(crate) each: Vec<Stage<'v>>,
    /// Stages of the opaque planes that end rays, whose colours are there already, where there are any.
    pub(crate) cut: Vec<Stage<'v>>,
}

/// Stages of the lookups besides the slices', where slabs lie between two values.
#[derive(Debug, Clone)]
pub(crate) struct PairStages<'v> {
    /// Slices before its own that a slab's classification looks at: 1, or 2 of second order.
    pub(crate) lookback: i64,
    /// From texture coordinates to values that the next slice finds.
    pub(crate) keep: Vec<Stage<'v>>,
    /// From texture coordinates, already there, to values.
    pub(crate) fetch: Stage<'v>,
    /// From values to pixels, for the pieces behind the last slices.
    pub(crate) exit: Vec<Stage<'v>>,
}

/// Which batches a list of stages is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum For {
    /// Those covered by whole slabs throughout.
    Whole,
    /// All others.
    Partial,
    /// Those of pieces behind the last slices, whose texture coordinates are there already.
    Behind,
    /// Those whose values alone are kept for the next slice.
    Keep,
    /// Those of samples at depths of their own, which are blended elsewhere.
    Each,
    /// Those of opaque planes: nothing is looked up, classified or lit.
    Cut,
}

/// What a stage's kernel depends on besides what a frame [`Needs`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernels<'s> {
    pub(super) scene: &'s Scene,
    pub(super) needs: &'s Needs,
    pub(super) lookup: Lookup,
    pub(super) voxels: VoxelType,
    /// Whether values are scaled to the table in two steps.
    pub(super) split: bool,
    /// Whether slabs within an interval of a table over pairs have a table of their own.
    pub(super) fine: bool,
    pub(super) level: Level,
    /// Whether pieces are shorter than slabs that may be opaque: see [`PieceFrame`].
    pub(super) pieces: bool,
    /// Whether a part of a volume is looked up.
    pub(super) part: bool,
}

impl<'v> Stages<'v> {
    /// Every list of stages that a frame goes through.
    pub(super) fn new(k: Kernels<'_>) -> Self {
        let list = |of: For| StageId::ALL.iter().filter_map(|&id| Some(Stage { id, run: k.kernel(id, of)? })).collect::<Vec<_>>();
        let span = Stage { id: StageId::Span, run: k.span() };
        let pairs = k.needs.pairs().then(|| PairStages {
            lookback: if k.needs.method.classification == Classification::SecondOrder { 2 } else { 1 },
            keep: list(For::Keep),
            fetch: Stage { id: StageId::Fetch, run: k.fetch() },
            exit: list(For::Behind),
        });
        let each = if k.scene.algorithm().is_cast() { list(For::Each) } else { Vec::new() };
        let cut: Vec<Stage<'v>> = if k.scene.cuts().is_empty() { Vec::new() } else { list(For::Cut) };
        Self { span, whole: list(For::Whole), partial: list(For::Partial), pairs, each, cut }
    }
}

impl Kernels<'_> {
    /// The kernel of stage `id` in a list; `None` where it is not in it.
    fn kernel<'v>(&self, id: StageId, of: For) -> Option<Run<'v>> {
        let (level, colors) = (self.level, self.needs.colors());
        let shades = colors && of != For::Keep;
        if of == For::Cut && !matches!(id, StageId::Optional(OptionalStage::Fog) | StageId::Mask | StageId::Blend) {
            return None;
        }
        match id {
            StageId::Texcoord if matches!(of, For::Behind | For::Each) => None,
            StageId::Texcoord if self.needs.along_rays && self.needs.far => Some(level.kernel::<TexcoordRays<true>, _, _>()),
            StageId::Texcoord if self.needs.along_rays => Some(level.kernel::<TexcoordRays<false>, _, _>()),
            StageId::Texcoord if self.part && self.needs.far => Some(level.kernel::<TexcoordPart<true>, _, _>()),
            StageId::Texcoord if self.part => Some(level.kernel::<TexcoordPart<false>, _, _>()),
            StageId::Texcoord if self.needs.far => Some(level.kernel::<TexcoordFar, _, _>()),
            StageId::Texcoord => Some(level.kernel::<Texcoord, _, _>()),
            // Colours are looked up as they are classified.
            StageId::Fetch => (of != For::Behind && self.lookup != Lookup::Colors).then(|| self.fetch()),
            // Classification looks after NaN by itself where it sees several values.
            StageId::Guard => (self.needs.guard
                && !matches!(self.lookup, Lookup::Corners | Lookup::Colors)
                && !self.needs.pairs()
                && of != For::Keep
                && !LEAN)
                .then(|| level.kernel::<Guard, _, _>()),
            StageId::Keep => (of == For::Keep).then(|| level.kernel::<KeepValue, _, _>()),
            StageId::Classify if shades && self.has_pieces(of) => Some(classify_pieces),
            StageId::Classify => shades.then(|| self.classify()),
            // Where opacity depends on the gradient that stage knows the length too.
            StageId::Correct if shades && self.has_pieces(of) => Some(level.kernel::<CorrectPieces, _, _>()),
            StageId::Correct => (shades && !self.needs.optical_depth && (of != For::Whole || self.needs.slanted)).then(|| self.correct()),
            StageId::Mask => (shades && (of != For::Whole || self.needs.guard)).then(|| level.kernel::<MaskStage, _, _>()),
            StageId::Blend => (!matches!(of, For::Keep | For::Each)).then(|| self.blend()),
            // Runs before the lists.
            StageId::Span => None,
            StageId::Optional(stage) => {
                let pieces = match of {
                    For::Behind | For::Each | For::Cut => Pieces::BehindSlices,
                    _ if self.needs.along_rays => Pieces::AlongRays,
                    _ => Pieces::OnSlice,
                };
                let runs = of != For::Keep && (colors || stage.option().projections == InProjections::Runs);
                if runs && !LEAN { optional_kernel(stage, self.scene, pieces, self.part, level) } else { None }
            }
        }
    }

    /// Whether a list's batches may have pieces shorter than slabs that may be opaque.
    fn has_pieces(&self, of: For) -> bool {
        self.pieces && matches!(of, For::Partial | For::Behind | For::Each)
    }

    fn span<'v>(&self) -> Run<'v> {
        if self.needs.pairs() { self.level.kernel::<SpanPair, _, _>() } else { self.level.kernel::<Span, _, _>() }
    }

    fn fetch<'v>(&self) -> Run<'v> {
        let (level, far) = (self.level, self.needs.far);
        match (self.lookup, self.voxels) {
            (Lookup::Labels, _) if far => level.kernel::<FetchLabels<true>, _, _>(),
            (Lookup::Labels, _) => level.kernel::<FetchLabels<false>, _, _>(),
            (Lookup::Nearest, _) if far => level.kernel::<FetchNearest<true>, _, _>(),
            (Lookup::Nearest, _) => level.kernel::<FetchNearest<false>, _, _>(),
            (Lookup::Corners, _) if far => level.kernel::<FetchCorners<true>, _, _>(),
            (Lookup::Corners, _) => level.kernel::<FetchCorners<false>, _, _>(),
            (Lookup::Packed, VoxelType::U8 | VoxelType::I8) => level.kernel::<FetchPacked8, _, _>(),
            (Lookup::Packed, _) => level.kernel::<FetchPacked16, _, _>(),
            (Lookup::Pairs, VoxelType::U8 | VoxelType::I8) => level.kernel::<FetchPairs8, _, _>(),
            (Lookup::Pairs, VoxelType::U16 | VoxelType::I16) => level.kernel::<FetchPairs16, _, _>(),
            (Lookup::Pairs, _) => level.kernel::<FetchPairs32, _, _>(),
            (Lookup::Cubic, _) if far => level.kernel::<FetchCubic<true>, _, _>(),
            (Lookup::Cubic, _) => level.kernel::<FetchCubic<false>, _, _>(),
            (Lookup::Single | Lookup::Colors, _) if far => level.kernel::<FetchAny<true>, _, _>(),
            (Lookup::Single | Lookup::Colors, _) => level.kernel::<FetchAny<false>, _, _>(),
        }
    }

    pub(super) fn classify<'v>(&self) -> Run<'v> {
        let level = self.level;
        if self.needs.pairs() {
            return self.classify_pairs(self.needs.method.classification == Classification::SecondOrder);
        }
        match self.lookup {
            Lookup::Colors if self.needs.method.filter == Filter::Nearest => return level.kernel::<ClassifyColors<true>, _, _>(),
            Lookup::Colors => return level.kernel::<ClassifyColors<false>, _, _>(),
            _ => {}
        }
        match (self.lookup == Lookup::Corners, self.split) {
            (false, false) => level.kernel::<Classify<false>, _, _>(),
            (false, true) => level.kernel::<Classify<true>, _, _>(),
            (true, false) => level.kernel::<ClassifyCorners<false>, _, _>(),
            (true, true) => level.kernel::<ClassifyCorners<true>, _, _>(),
        }
    }

    fn classify_pairs<'v>(&self, second: bool) -> Run<'v> {
        let level = self.level;
        match (self.split, second, self.fine) {
            (false, false, false) => level.kernel::<ClassifyPair<false, false, false>, _, _>(),
            (false, false, true) => level.kernel::<ClassifyPair<false, false, true>, _, _>(),
            (false, true, false) => level.kernel::<ClassifyPair<false, true, false>, _, _>(),
            (false, true, true) => level.kernel::<ClassifyPair<false, true, true>, _, _>(),
            (true, false, false) => level.kernel::<ClassifyPair<true, false, false>, _, _>(),
            (true, false, true) => level.kernel::<ClassifyPair<true, false, true>, _, _>(),
            (true, true, false) => level.kernel::<ClassifyPair<true, true, false>, _, _>(),
            (true, true, true) => level.kernel::<ClassifyPair<true, true, true>, _, _>(),
        }
    }

    fn correct<'v>(&self) -> Run<'v> {
        match (self.needs.method.slab, self.needs.slanted) {
            (SlabForm::Riemann, _) => self.level.kernel::<CorrectRiemann, _, _>(),
            (_, true) => self.level.kernel::<Correct<false>, _, _>(),
            (_, false) => self.level.kernel::<Correct<true>, _, _>(),
        }
    }

    fn blend<'v>(&self) -> Run<'v> {
        let level = self.level;
        match self.needs.blend {
            BlendKind::Over if self.needs.method.target == Target::Unorm8 => self.over::<Unorm8>(),
            BlendKind::Over if self.needs.compensated => self.over::<Compensated>(),
            BlendKind::Over => self.over::<Plain>(),
            BlendKind::Add => level.kernel::<ProjectAdd, _, _>(),
            BlendKind::Max => level.kernel::<ProjectMax, _, _>(),
            BlendKind::Min => level.kernel::<ProjectMin, _, _>(),
            BlendKind::Average => level.kernel::<ProjectAverage, _, _>(),
            BlendKind::Attenuated => level.kernel::<ProjectAttenuated, _, _>(),
            BlendKind::Lmip => level.kernel::<ProjectLmip, _, _>(),
            BlendKind::Iso => level.kernel::<ProjectIso, _, _>(),
            BlendKind::Surfaces => level.kernel::<BlendSurfaces, _, _>(),
        }
    }

    fn over<'v, S: Store>(&self) -> Run<'v> {
        match self.needs.order {
            Order::FrontToBack if self.needs.terminate => self.level.kernel::<BlendFront<S, true>, _, _>(),
            Order::FrontToBack => self.level.kernel::<BlendFront<S, false>, _, _>(),
            Order::BackToFront if self.needs.under => self.level.kernel::<BlendFront<S, false>, _, _>(),
            Order::BackToFront => self.level.kernel::<BlendBack<S>, _, _>(),
        }
    }
}
