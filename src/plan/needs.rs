//! What a frame needs, decided before anything is prepared for it.

use super::scaling::Scaling;
use crate::lean::{LEAN, extra};
use crate::proxy::{RaySteps, Stack};
use crate::scene::{
    Accumulation, Blend, Classification, Ends, Filter, Fits, Fog, FogDistance, Method, OptionalStage, Order, Scene, SlabForm, Target,
};
use crate::volume::{Volume, VoxelType};

/// Range of stored values up to which a table of equal intervals tells neighbouring whole numbers apart: an interval is a quarter of their distance.
const LABELS: f64 = 16384.0;

/// What a frame needs, decided before the first pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Needs {
    pub(crate) blend: BlendKind,
    pub(crate) order: Order,
    /// Whether slices that come farthest first go under those behind them.
    pub(crate) under: bool,
    /// Whether pixels end early.
    pub(crate) terminate: bool,
    /// Whether values may be NaN or infinite.
    pub(crate) guard: bool,
    /// By which distance fog goes, if there is any.
    pub(crate) fog: Option<FogDistance>,
    /// Whether rays cross whole slabs at lengths that differ.
    pub(crate) slanted: bool,
    /// Whether samples lie at depths of their own along each ray.
    pub(crate) along_rays: bool,
    /// Whether a batch may span 2^24 voxels or more, so that offsets need more than an i32.
    pub(crate) far: bool,
    /// Whether empty space is passed over.
    pub(crate) skip: bool,
    /// Whether several slabs may become one.
    pub(crate) merge: bool,
    pub(crate) method: Method,
    /// Whether sums are compensated.
    pub(crate) compensated: bool,
    /// What the outermost pieces of rays are.
    pub(crate) ends: EndPieces,
    /// Whether classification gives optical depth, because opacity depends on more than the value.
    pub(crate) optical_depth: bool,
    /// Whether the nearest voxels' values are told apart exactly, because a table over their range, or f32, cannot.
    pub(crate) labels: bool,
}

/// [`Blend`] without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlendKind {
    Over,
    Add,
    Max,
    Min,
    Average,
    Attenuated,
    Lmip,
    Iso,
    Surfaces,
}

impl Needs {
    /// What `scene` needs of a frame of `stack`, whose samples may lie in `steps` of each ray's own, of a volume `with_holes` (some voxels are
    /// NaN or infinite) or without.
    pub(crate) fn new(scene: &Scene, stack: &Stack, steps: Option<&RaySteps>, with_holes: bool, terminate: f32) -> Self {
        let surfaces = scene.surfaces().is_some() && !LEAN;
        let blend = match scene.blend() {
            Blend::Over | Blend::Under => BlendKind::Over,
            Blend::Add => BlendKind::Add,
            Blend::Mip => BlendKind::Max,
            Blend::Min => BlendKind::Min,
            Blend::Average => BlendKind::Average,
            Blend::AttenuatedMip { .. } => BlendKind::Attenuated,
            Blend::Lmip { .. } => BlendKind::Lmip,
            Blend::Iso { .. } | Blend::Surfaces if surfaces => BlendKind::Surfaces,
            Blend::Iso { .. } | Blend::Surfaces => BlendKind::Iso,
        };
        let colors = matches!(blend, BlendKind::Over | BlendKind::Add);
        let method = method(scene);
        let order = scene.blending_order();
        let compensated = match method.accumulation {
            _ if method.slab == SlabForm::Riemann || method.target == Target::Unorm8 => false,
            Accumulation::Auto => stack.count >= Accumulation::MANY,
            Accumulation::Plain => false,
            Accumulation::Compensated => true,
        };
        let everywhere = OptionalStage::wanted(scene).any(|stage| (stage.option().shows_in_empty_space)(scene).is_some());
        let skip = colors && !everywhere || surfaces;
        let ends = match (method.is_pre_integrated(), method.ends) {
            (false, Ends::Partial) => EndPieces::Partial,
            (false, Ends::Whole) => EndPieces::Whole,
            (true, Ends::Partial) => EndPieces::Between,
            (true, Ends::Whole) => EndPieces::WholeBetween,
        };
        let ends = if surfaces { EndPieces::Between } else { ends };
        Self {
            blend,
            order,
            under: scene.blend() == Blend::Under,
            // Riemann's transmittance may pass below zero and come back.
            terminate: blend == BlendKind::Over && order == Order::FrontToBack && terminate > 0.0 && method.slab != SlabForm::Riemann,
            guard: with_holes,
            fog: extra(scene.fog()).filter(|_| colors).map(Fog::distance),
            slanted: stack.perspective && !steps.is_some_and(RaySteps::in_shells),
            along_rays: steps.is_some(),
            far: spans_far(stack, steps, method.filter.is_cubic()) || scene.algorithm().is_cast() && holds_far(stack),
            skip,
            // A stage that lights empty space does so once a slice, so their number counts; and where voxels are NaN, a brick's range does
            // not tell how values change.
            merge: method.merge && colors && skip && !with_holes,
            method,
            compensated: compensated && blend == BlendKind::Over,
            ends,
            optical_depth: colors && scene.opacity_by_gradient() && !LEAN,
            labels: false,
        }
    }

    /// The same for a volume whose stored values lie in `range`.
    pub(crate) fn with_values(self, scene: &Scene, volume: &Volume, (min, max): (f64, f64)) -> Self {
        let wide = volume.voxels().voxel_type() == VoxelType::F64 || max - min > LABELS;
        // Averages and crossings of a level go by the numbers themselves, slabs between two values and functions of two variables too.
        let shown = matches!(self.blend, BlendKind::Over | BlendKind::Add | BlendKind::Max | BlendKind::Min | BlendKind::Lmip);
        let by_value = shown && !self.method.is_pre_integrated() && scene.transfer2d().is_none();
        Self { labels: self.method.filter == Filter::Nearest && by_value && wide && !LEAN, ..self }
    }

    /// Whether fragments become colours before they are blended.
    pub(crate) fn colors(&self) -> bool {
        matches!(self.blend, BlendKind::Over | BlendKind::Add)
    }

    /// Whether bricks are passed over that reach no farther than what pixels have seen: not where an observer looks on, in parts of a volume, and
    /// where numbers are positions in a table.
    pub(crate) fn peaks(&self, observed: bool, part: bool) -> bool {
        matches!(self.blend, BlendKind::Max | BlendKind::Min | BlendKind::Lmip) && !self.labels && !observed && !part && !LEAN
    }

    /// Whether slabs lie between two values, or surfaces between two slices.
    pub(crate) fn pairs(&self) -> bool {
        (self.method.is_pre_integrated() && self.colors() || self.blend == BlendKind::Surfaces) && !LEAN
    }

    /// Whether sums are compensated in a frame of fewer slices than [`Accumulation::MANY`], whose strongest slab has an opacity of `strongest`.
    pub(crate) fn compensates_faint(&self, slices: u64, strongest: f64) -> bool {
        let may = self.blend == BlendKind::Over && self.method.slab != SlabForm::Riemann && self.method.target != Target::Unorm8;
        may && self.method.accumulation == Accumulation::Auto && Accumulation::is_faint(slices, strongest)
    }

    /// Whether pieces of rays may be shorter than a slab whose opacity is known, and not its optical depth.
    pub(crate) fn short_pieces(&self) -> bool {
        self.colors() && !self.ends.whole() && !self.optical_depth && self.method.slab == SlabForm::Exponential
    }

    /// How voxels are loaded.
    pub(crate) fn lookup(&self, volume: &Volume, packed: bool, scaling: &Scaling) -> Lookup {
        if volume.colors().is_some() {
            return Lookup::Colors;
        }
        match (self.method.filter, self.method.classification) {
            (Filter::Nearest, _) if self.labels => return Lookup::Labels,
            (Filter::Nearest, _) => return Lookup::Nearest,
            (Filter::Cubic { .. }, _) => return Lookup::Cubic,
            (Filter::Linear, Classification::Pre) => return Lookup::Corners,
            (Filter::Linear, _) => {}
        }
        // Pairs along x need two voxels there.
        let pairs = !self.far && scaling.to_f32.is_none() && volume.grid().dims()[0] > 1;
        match volume.voxels().voxel_type().bytes() {
            1 | 2 if pairs && packed => Lookup::Packed,
            1 | 2 | 4 if pairs => Lookup::Pairs,
            _ => Lookup::Single,
        }
    }
}

/// What the lengths of a ray's outermost pieces are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndPieces {
    /// From the box's face to the far side of the first slab; likewise at the other end.
    Partial,
    /// Whole slabs.
    Whole,
    /// From the box's face to the first slice, and from the last slice to the box's face: slabs lie between slices.
    Between,
    /// Whole slabs that end at their slices.
    WholeBetween,
}

impl EndPieces {
    /// Whether the outermost pieces are as long as any other.
    pub(crate) fn whole(self) -> bool {
        matches!(self, Self::Whole | Self::WholeBetween)
    }

    /// Whether slabs end at their slices.
    pub(crate) fn between(self) -> bool {
        matches!(self, Self::Between | Self::WholeBetween)
    }
}

/// How the voxels around a fragment are loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lookup {
    /// The nearest voxel alone.
    Nearest,
    /// The same, as its position in a table: see [`Needs::labels`].
    Labels,
    /// Eight voxels one by one, to be classified before they are interpolated.
    Corners,
    /// Voxels packed with their neighbours along y: two loads bring all eight.
    Packed,
    /// Neighbours along x together: four loads.
    Pairs,
    /// Eight voxels one by one.
    Single,
    /// Voxels that are colours, eight or the nearest: classified as they are looked up.
    Colors,
    /// The 64 coefficients of the spline around, four neighbours along x at a time.
    Cubic,
}

impl Lookup {
    /// Loads for the eight voxels around a fragment; `None` where it is not eight that are looked up.
    pub(crate) fn loads(self) -> Option<u64> {
        match self {
            Self::Packed => Some(2),
            Self::Pairs => Some(4),
            Self::Nearest | Self::Labels | Self::Corners | Self::Single => Some(8),
            Self::Cubic | Self::Colors => None,
        }
    }
}

/// The scene's method where it matters: projections of values have no slabs.
pub(crate) fn method(scene: &Scene) -> Method {
    let method = scene.method();
    match scene.blend() {
        // From back to front the transmittance before a slab is not known yet; and a stage may need every slab.
        Blend::Over | Blend::Under => {
            let fits = OptionalStage::wanted(scene).all(|stage| stage.option().merging == Fits::Yes);
            Method { merge: method.merge && fits && scene.blending_order() == Order::FrontToBack, ..method }
        }
        // Nothing is hidden, so nothing is rounded on the way.
        Blend::Add => Method { target: Target::F32, merge: false, ..method },
        Blend::Iso { .. } | Blend::Surfaces if scene.surfaces().is_some() => Method { filter: method.filter, ..Method::default() },
        _ => Method { filter: method.filter, ends: method.ends, sample: method.sample, ..Method::default() },
    }
}

/// Order of a picture's error in the thickness of slabs, on smooth scenes. Light is taken at one sample of a slab, which is its far side where
/// slabs lie between two values: that leaves them the first order, as the faces of regions and segments do.
pub(crate) fn order(scene: &Scene) -> u32 {
    let method = method(scene);
    let lit = method.is_pre_integrated() && scene.lighting().is_some();
    if lit || scene.uses_labels() || !scene.regions().is_empty() { 1 } else { method.order() }
}

/// Whether two voxels may lie further apart than an i32 counts, in any layout that lookups read: samples of one ray lie anywhere.
fn holds_far(stack: &Stack) -> bool {
    stack.dims.iter().map(|&n| (n + 2) as f64).product::<f64>() * 1.0625 >= f64::from(i32::MAX)
}

/// Whether the cells of one batch may lie 2^24 voxels apart or more: the batch's extent in the worst place of the picture. With a `border` rows
/// and layers are two voxels longer.
fn spans_far(stack: &Stack, steps: Option<&RaySteps>, border: bool) -> bool {
    let scale = if stack.perspective { stack.far.abs().max(stack.near.abs()) } else { 1.0 };
    let reach = steps.map(|steps| steps.reach(stack));
    let mut voxels = 0.0;
    let mut stride = 1.0;
    for axis in 0..3 {
        let f = stack.index[axis];
        let extent = reach.map_or(7.0 * (f.b.abs() + f.c.abs()) * scale, |reach| reach[axis]);
        let extent = (extent + 3.0).min(stack.dims[axis] as f64);
        voxels += extent * stride;
        stride *= (stack.dims[axis] + if border { 2 } else { 0 }) as f64;
    }
    // Packed voxels lie up to a sixteenth further apart.
    voxels * 1.0625 >= f64::from(1 << 24)
}
