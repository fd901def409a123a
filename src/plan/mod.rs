//! The plan: from scene and settings to slices, tables and stages, and to the list of what a scene does not need.

mod changes;
mod classes;
mod left_out;
mod pairs;
mod table;

pub(crate) use changes::{CHANGES, ChangeClasses, most as most_change, strongest};
pub(crate) use classes::Classes;
pub(crate) use left_out::{Planned, Saving, passed_over, planned, tally};
use pairs::Pairs;
use table::Layout;
pub(crate) use table::Slab;

use crate::fragment::*;
use crate::lanes::{Level, ToF32};
use crate::lean::{LEAN, extra};
use crate::proxy::Stack;
use crate::raster::PairWork;
use crate::scene::{Accumulation, Blend, Classification, Filter, Fog, FogDistance, FogWeighting, Method, Order, Scene, SlabForm, Target};
use crate::volume::bricks::Bricks;
use crate::volume::{Volume, VoxelType};

/// How stored values become the f32 numbers of the stages, and those the data's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaling {
    /// Conversion on load, where it takes more than a cast.
    pub(crate) to_f32: Option<ToF32>,
    /// Data value = `scale` * number + `offset`; positive, so that numbers rise with values.
    pub(crate) scale: f64,
    /// See `scale`.
    pub(crate) offset: f64,
}

impl Scaling {
    /// Chooses a conversion that keeps the values of `volume` within f32 and, for types wider than f32, their differences exact.
    pub(crate) fn new(volume: &Volume, bricks: &Bricks) -> Self {
        let (min, max) = bricks.range;
        let (slope, intercept) = volume.rescale();
        let range = max - min;
        let exact = min.abs().max(max.abs()) <= f64::from(1 << 24);
        // Where the slope is negative, numbers are turned around on load: first crossings and local maxima are the values' own.
        let sign = slope.signum();
        let map = |gain: f64, bias: f64| Some(ToF32 { gain: sign * gain, bias: sign * gain * bias });
        let plain = if slope < 0.0 { map(1.0, 0.0) } else { None };
        let to_f32 = match volume.voxels().voxel_type() {
            VoxelType::U8 | VoxelType::I8 | VoxelType::U16 | VoxelType::I16 => plain,
            VoxelType::U32 | VoxelType::I32 if exact => plain,
            VoxelType::U32 | VoxelType::I32 => map(1.0, min),
            // Differences of neighbours must not overflow, nor sums over a ray.
            VoxelType::F32 if min < max && range > 1e20 => map(libm::scalbn(1.0, -64), 0.0),
            VoxelType::F32 => plain,
            VoxelType::F64 if min > max => plain,
            VoxelType::F64 if min == max || (1e-20..1e20).contains(&range) => map(1.0, min),
            VoxelType::F64 => map(power_of_two_near(1.0 / (max * 0.5 - min * 0.5)), min),
        };
        let m = to_f32.unwrap_or(ToF32 { gain: 1.0, bias: 0.0 });
        Self { to_f32, scale: slope / m.gain, offset: slope * (m.bias / m.gain) + intercept }
    }

    /// The number that stands for a value in the data's units.
    pub(crate) fn number(&self, value: f64) -> f64 {
        (value - self.offset) / self.scale
    }
}

/// The power of two next below |x|, within the normal range of f64.
fn power_of_two_near(x: f64) -> f64 {
    let (_, exponent) = libm::frexp(x);
    libm::scalbn(1.0, exponent.clamp(-1000, 1000) - 1)
}

/// Stages of batches whose fragments are all covered by whole slabs, and of all others.
pub(crate) struct Stages<'v> {
    pub(crate) span: Stage<'v>,
    pub(crate) whole: Vec<Stage<'v>>,
    pub(crate) partial: Vec<Stage<'v>>,
    /// More lookups, where slabs lie between slices.
    pub(crate) pairs: Option<PairWork<'v>>,
}

/// What a frame needs, decided before the first pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Needs {
    pub(crate) blend: BlendKind,
    pub(crate) order: Order,
    pub(crate) terminate: bool,
    pub(crate) guard: bool,
    pub(crate) fog: Option<FogDistance>,
    pub(crate) perspective: bool,
    pub(crate) far: bool,
    pub(crate) split_scale: bool,
    /// Whether slabs within an interval of a table over pairs have a table of their own.
    pub(crate) fine: bool,
    pub(crate) skip: bool,
    /// Whether several slabs may become one.
    pub(crate) merge: bool,
    pub(crate) method: Method,
    /// Whether sums are compensated.
    pub(crate) compensated: bool,
}

/// [`Blend`] without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlendKind {
    Over,
    Add,
    Max,
    Min,
    Average,
    Lmip,
    Iso,
}

impl Needs {
    pub(crate) fn new(scene: &Scene, stack: &Stack, bricks: &Bricks, (split_scale, fine): (bool, bool), terminate: f32) -> Self {
        let blend = match scene.blend() {
            Blend::Over => BlendKind::Over,
            Blend::Add => BlendKind::Add,
            Blend::Mip => BlendKind::Max,
            Blend::Min => BlendKind::Min,
            Blend::Average => BlendKind::Average,
            Blend::Lmip { .. } => BlendKind::Lmip,
            Blend::Iso { .. } => BlendKind::Iso,
        };
        let colors = matches!(blend, BlendKind::Over | BlendKind::Add);
        let fog = extra(scene.fog()).filter(|_| colors);
        let literal = fog.is_some_and(|f| f.weighting() == FogWeighting::Literal);
        let method = method(scene);
        let order = scene.blending_order();
        let compensated = match method.accumulation {
            _ if method.slab == SlabForm::Riemann || method.target == Target::Unorm8 => false,
            Accumulation::Auto => stack.count >= Accumulation::MANY,
            Accumulation::Plain => false,
            Accumulation::Compensated => true,
        };
        // Literal fog lights up empty slices: that is its mistake, and it is reproduced.
        let skip = colors && !literal;
        let guard = bricks.non_finite > 0;
        Self {
            blend,
            order,
            // Riemann's transmittance may pass below zero and come back.
            terminate: blend == BlendKind::Over && order == Order::FrontToBack && terminate > 0.0 && method.slab != SlabForm::Riemann,
            guard,
            fog: fog.map(Fog::distance),
            perspective: stack.perspective,
            far: spans_far(stack),
            split_scale,
            fine,
            skip,
            // It adds light slice by slice; and what is no number changes any way.
            merge: method.merge && skip && !guard,
            method,
            compensated: compensated && blend == BlendKind::Over,
        }
    }

    /// The stages, compiled for `level`.
    pub(crate) fn stages<'v>(&self, volume: &Volume, packed: bool, scaling: &Scaling, level: Level) -> Stages<'v> {
        let stage = |name: &'static str, run: fn(&Frame<'v>, &mut Batch)| Stage { name, run };
        let mut middle: Vec<Stage<'v>> = Vec::new();
        middle.push(stage("texcoord", if self.far { level.kernel::<TexcoordFar, _, _>() } else { level.kernel::<Texcoord, _, _>() }));
        let colors = matches!(self.blend, BlendKind::Over | BlendKind::Add);
        let nearest = self.method.filter == Filter::Nearest;
        let before = self.method.classification == Classification::Pre && !nearest;
        middle.push(stage("fetch", self.fetch(volume, packed, scaling, level)));
        let pairs = self.method.is_pre_integrated() && colors && !LEAN;
        if self.guard && !before && !pairs && !LEAN {
            middle.push(stage("guard", level.kernel::<Guard, _, _>()));
        }
        if pairs {
            middle.push(stage("classify", self.classify_pairs(self.method.classification == Classification::SecondOrder, level)));
        } else if colors {
            middle.push(stage(
                "classify",
                match (before, self.split_scale) {
                    (false, false) => level.kernel::<Classify<false>, _, _>(),
                    (false, true) => level.kernel::<Classify<true>, _, _>(),
                    (true, false) => level.kernel::<ClassifyCorners<false>, _, _>(),
                    (true, true) => level.kernel::<ClassifyCorners<true>, _, _>(),
                },
            ));
        }
        let fog: Option<Stage<'v>> = extra(self.fog).map(|distance| {
            stage(
                "fog",
                match distance {
                    FogDistance::Planar => level.kernel::<FogPlanar, _, _>(),
                    FogDistance::Radial => level.kernel::<FogRadial, _, _>(),
                },
            )
        });
        let blend = stage(
            "blend",
            match self.blend {
                BlendKind::Over if self.method.target == Target::Unorm8 => self.over::<Unorm8>(level),
                BlendKind::Over if self.compensated => self.over::<Compensated>(level),
                BlendKind::Over => self.over::<Plain>(level),
                BlendKind::Add => level.kernel::<ProjectAdd, _, _>(),
                BlendKind::Max => level.kernel::<ProjectMax, _, _>(),
                BlendKind::Min => level.kernel::<ProjectMin, _, _>(),
                BlendKind::Average => level.kernel::<ProjectAverage, _, _>(),
                BlendKind::Lmip => level.kernel::<ProjectLmip, _, _>(),
                BlendKind::Iso => level.kernel::<ProjectIso, _, _>(),
            },
        );
        let finish = |correct: bool, mask: bool| {
            let mut list = middle.clone();
            if correct && colors {
                list.push(stage(
                    "correct",
                    match (self.method.slab, self.perspective) {
                        (SlabForm::Riemann, _) => level.kernel::<CorrectRiemann, _, _>(),
                        (_, true) => level.kernel::<Correct<false>, _, _>(),
                        (_, false) => level.kernel::<Correct<true>, _, _>(),
                    },
                ));
            }
            list.extend(fog);
            if mask && colors {
                list.push(stage("mask", level.kernel::<MaskStage, _, _>()));
            }
            list.push(blend);
            list
        };
        let whole = finish(self.perspective, self.guard);
        let partial = finish(true, true);
        let pairs = pairs.then(|| {
            // Texture coordinates are set ray by ray, and each ray leaves at a depth of its own.
            let after = partial.iter().position(|s| s.name == "classify").map_or(1, |i| i + 1);
            let mut exit = vec![partial[after - 1]];
            exit.extend(&partial[after..]);
            if let Some(fog) = exit.iter_mut().find(|s| s.name == "fog") {
                fog.run = level.kernel::<FogEach, _, _>();
            }
            PairWork {
                lookback: if self.method.classification == Classification::SecondOrder { 2 } else { 1 },
                keep: vec![middle[0], middle[1], stage("keep", level.kernel::<KeepValue, _, _>())],
                fetch: middle[1],
                exit,
            }
        });
        let span = if pairs.is_some() { level.kernel::<SpanPair, _, _>() } else { level.kernel::<Span, _, _>() };
        Stages { span: stage("span", span), whole, partial, pairs }
    }

    fn classify_pairs<'v>(&self, second: bool, level: Level) -> fn(&Frame<'v>, &mut Batch) {
        match (self.split_scale, second, self.fine) {
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

    /// Whether lookups read packed voxels, where there are any.
    pub(crate) fn reads_packed(&self, volume: &Volume, packed: bool, scaling: &Scaling) -> bool {
        self.loads(volume, packed, scaling) == 2
    }

    /// Loads of a lookup for the eight voxels around it.
    pub(crate) fn loads(&self, volume: &Volume, packed: bool, scaling: &Scaling) -> u64 {
        let pairs = !self.far && scaling.to_f32.is_none() && volume.grid().dims()[0] > 1;
        let linear = self.method.filter == Filter::Linear && self.method.classification != Classification::Pre;
        match volume.voxels().voxel_type().bytes() {
            1 | 2 if pairs && linear && packed => 2,
            1 | 2 | 4 if pairs && linear => 4,
            _ => 8,
        }
    }

    fn fetch<'v>(&self, volume: &Volume, packed: bool, scaling: &Scaling, level: Level) -> fn(&Frame<'v>, &mut Batch) {
        // Pairs along x need two voxels there.
        let pairs = !self.far && scaling.to_f32.is_none() && volume.grid().dims()[0] > 1;
        match (self.method.filter, self.method.classification) {
            (Filter::Nearest, _) if self.far => return level.kernel::<FetchNearest<true>, _, _>(),
            (Filter::Nearest, _) => return level.kernel::<FetchNearest<false>, _, _>(),
            (Filter::Linear, Classification::Pre) if self.far => return level.kernel::<FetchCorners<true>, _, _>(),
            (Filter::Linear, Classification::Pre) => return level.kernel::<FetchCorners<false>, _, _>(),
            (Filter::Linear, _) => {}
        }
        match volume.voxels().voxel_type() {
            VoxelType::U8 | VoxelType::I8 if pairs && packed => level.kernel::<FetchPacked8, _, _>(),
            VoxelType::U8 | VoxelType::I8 if pairs => level.kernel::<FetchPairs8, _, _>(),
            VoxelType::U16 | VoxelType::I16 if pairs && packed => level.kernel::<FetchPacked16, _, _>(),
            VoxelType::U16 | VoxelType::I16 if pairs => level.kernel::<FetchPairs16, _, _>(),
            VoxelType::U32 | VoxelType::I32 | VoxelType::F32 if pairs => level.kernel::<FetchPairs32, _, _>(),
            _ if self.far => level.kernel::<FetchAny<true>, _, _>(),
            _ => level.kernel::<FetchAny<false>, _, _>(),
        }
    }

    fn over<'v, S: Store>(&self, level: Level) -> fn(&Frame<'v>, &mut Batch) {
        match self.order {
            Order::FrontToBack if self.terminate => level.kernel::<BlendFront<S, true>, _, _>(),
            Order::FrontToBack => level.kernel::<BlendFront<S, false>, _, _>(),
            Order::BackToFront => level.kernel::<BlendBack<S>, _, _>(),
        }
    }
}

/// The scene's method where it matters: projections of values have no slabs.
pub(crate) fn method(scene: &Scene) -> Method {
    let method = scene.method();
    match scene.blend() {
        // Farthest first, nobody knows how much light a slab's comes through.
        Blend::Over => Method { merge: method.merge && scene.blending_order() == Order::FrontToBack, ..method },
        // Nothing is hidden, so nothing is rounded on the way.
        Blend::Add => Method { target: Target::F32, merge: false, ..method },
        _ => Method { filter: method.filter, ends: method.ends, sample: method.sample, ..Method::default() },
    }
}

/// Whether the cells of one batch may lie 2^24 voxels apart or more: the batch's extent in the worst place of the picture.
fn spans_far(stack: &Stack) -> bool {
    let scale = if stack.perspective { stack.far.abs().max(stack.near.abs()) } else { 1.0 };
    let mut voxels = 0.0;
    let mut stride = 1.0;
    for axis in 0..3 {
        let f = stack.index[axis];
        let extent = (7.0 * (f.b.abs() + f.c.abs()) * scale + 3.0).min(stack.dims[axis] as f64);
        voxels += extent * stride;
        stride *= stack.dims[axis] as f64;
    }
    // Packed voxels lie up to a sixteenth further apart.
    voxels * 1.0625 >= f64::from(1 << 24)
}
