//! What all blocks of a frame share: the plan, by reference, and the kernels of the geometry.

use super::block_transform::BlockTransform;
use super::ray_intervals::RayIntervals;
use crate::fragment::project::NOTHING;
use crate::fragment::{Batch, Frame, Stage};
use crate::lanes::{BATCH, Kernel, Lanes, Level, SIDE, row};
use crate::plan::{EndPieces, FramePlan, Merging, PairStages, Peaks, RayPlan};
use crate::proxy::{Domain, Stack};
use crate::scene::{Fog, Order};
use crate::skip::{BoxClasses, BoxQuery, QueryBoxes, Runs, SkipTable, Windows};
use std::ops::Range;

/// A plan at work.
pub(crate) struct Work<'f, 'v> {
    pub(super) frame: &'f Frame<'v>,
    pub(super) stack: &'f Stack,
    /// What depends on the slice alone.
    pub(super) fog: Option<&'f Fog>,
    pub(super) order: Order,
    pub(super) skip_table: Option<&'f SkipTable>,
    pub(super) runs: Runs,
    /// How far values reach where, in projections that go by that.
    pub(super) peaks: Option<&'f Peaks<'v>>,
    /// See [`OpenTo`].
    open_to: fn(&[f32; BATCH], &mut OpenTo),
    /// Asks about boxes of runs, and of coarse runs.
    query: [fn(&BoxQuery<'f>, &mut BoxClasses); 2],
    pub(super) span: Stage<'v>,
    pub(super) whole: &'f [Stage<'v>],
    pub(super) partial: &'f [Stage<'v>],
    pub(super) start: [f32; 4],
    pub(super) compensated: bool,
    pub(super) ends: EndPieces,
    pub(super) radial: bool,
    pub(super) pairs: Option<&'f PairStages<'v>>,
    pub(super) merging: Option<&'f Merging<'v>>,
    /// How single rays differ from those through flat slices, where they do.
    pub(super) rays: Option<&'f RayPlan<'v>>,
    /// See [`LetThrough`].
    pub(super) let_through: fn(&[f32; BATCH], &mut f32),
    /// Where in its slab a value is taken, in slabs from its middle.
    pub(super) sample: f64,
    /// Vectors of the geometry.
    level: Level,
    /// Where the volume is a part of a larger one: its voxels in that.
    pub(super) part: Option<&'f [Range<usize>; 3]>,
}

impl<'f, 'v> Work<'f, 'v> {
    /// `plan` at work.
    pub(crate) fn new(plan: &'f FramePlan<'v>) -> Self {
        let level = plan.level;
        Self {
            frame: &plan.frame,
            stack: &plan.stack,
            fog: plan.fog.as_ref(),
            order: plan.needs.order,
            skip_table: plan.skip_table.as_deref(),
            runs: plan.runs,
            peaks: plan.peaks.as_ref(),
            open_to: match &plan.peaks {
                Some(peaks) if peaks.table.falls => level.kernel::<Falling, _, _>(),
                _ => level.kernel::<Rising, _, _>(),
            },
            query: [level.kernel::<QueryBoxes<false>, _, _>(), level.kernel::<QueryBoxes<true>, _, _>()],
            span: plan.stages.span,
            whole: &plan.stages.whole,
            partial: &plan.stages.partial,
            start: plan.start,
            compensated: plan.needs.compensated,
            ends: plan.needs.ends,
            radial: plan.radial(),
            pairs: plan.stages.pairs.as_ref(),
            merging: plan.merging.as_ref(),
            rays: plan.rays.as_ref(),
            let_through: level.kernel::<LetThrough, _, _>(),
            sample: plan.sample,
            level,
            part: plan.domain.map(Domain::voxels),
        }
    }

    /// A batch for its stages.
    pub(crate) fn batch(&self) -> Box<Batch> {
        Batch::new(self.frame.optional.gradient.is_some(), self.frame.surfaces.is_some())
    }

    /// What pixels start from: colour channels, then transmittance.
    pub(crate) fn start_values(&self) -> [f32; 4] {
        self.start
    }

    /// Which slices come first.
    pub(crate) fn order(&self) -> Order {
        self.order
    }

    /// Where the rays of blocks enter and leave.
    pub(crate) fn ray_intervals(&self) -> RayIntervals<'f> {
        RayIntervals::new(self.stack, self.radial, self.ends, self.level)
    }

    /// Depth at which slice `k` takes its values.
    pub(super) fn sampled(&self, k: i64) -> f64 {
        self.stack.near + (k as f64 + 0.5 + self.sample) * self.stack.spacing
    }

    /// The pixels, one bit each, that have seen nothing as large as `bound` yet; or as small, where smallest values are looked for.
    pub(super) fn open_to(&self, bound: f32, seen: &[f32; BATCH]) -> u64 {
        let mut open = OpenTo { bound, pixels: 0 };
        (self.open_to)(seen, &mut open);
        open.pixels
    }

    /// Asks what `count` runs of `slices` slices can touch, the first of them from slice `first` on.
    pub(super) fn query_boxes(
        &self,
        transform: &BlockTransform,
        windows: &'f Windows,
        (first, slices): (i64, i64),
        count: usize,
        classes: &mut BoxClasses,
    ) {
        let near = self.sampled(first - self.runs.back);
        let far = self.sampled(first + slices - 1);
        let query = transform.boxes(windows, (near, far), slices as f64 * self.stack.spacing, count);
        (self.query[usize::from(windows.holds_flags())])(&query, classes);
    }
}

/// The pixels that a value up to a bound may change, one bit each.
struct OpenTo {
    bound: f32,
    pixels: u64,
}

/// Those that look for their largest value.
struct Rising;
/// Those that look for their smallest value.
struct Falling;

impl Kernel<[f32; BATCH], OpenTo> for Rising {
    #[inline(always)]
    fn run<L: Lanes>(seen: &[f32; BATCH], open: &mut OpenTo) {
        let bound = L::splat(open.bound);
        open.pixels = (0..SIDE).fold(0, |bits, r| bits | u64::from(L::bits(L::lt(L::load(row(seen, r)), bound))) << (8 * r));
    }
}

impl Kernel<[f32; BATCH], OpenTo> for Falling {
    #[inline(always)]
    fn run<L: Lanes>(seen: &[f32; BATCH], open: &mut OpenTo) {
        let (bound, nothing) = (L::splat(open.bound), L::splat(NOTHING));
        open.pixels = 0;
        for r in 0..SIDE {
            let seen = L::load(row(seen, r));
            let bits = L::bits(L::lt(bound, seen)) | L::bits(L::le(seen, nothing));
            open.pixels |= u64::from(bits) << (8 * r);
        }
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
