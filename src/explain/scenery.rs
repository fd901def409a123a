//! The scene in the numbers that the page tells.

use crate::Volume;
use crate::proxy::Stack;
use crate::scene::{
    Blend, Classification, Ends, Filter, Fog, FogDistance, FogMode, FogWeighting, Method, Order, SampleAt, Scene, SlabForm, Target,
};
use serde::Serialize;

/// Bins of the histogram on the transfer function's plot.
const BINS: usize = 128;

/// Fog.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct FogRecord {
    mode: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    start: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    density: Option<f64>,
    color: [f64; 3],
    distance: &'static str,
    weighting: &'static str,
    /// Distance and factor, over the stack's depth and a little more.
    curve: Vec<[f64; 2]>,
}

impl FogRecord {
    fn new(fog: &Fog, stack: &Stack) -> Self {
        let (mode, start, end, density) = match fog.mode() {
            FogMode::Linear { start, end } => ("linear", Some(start), Some(end), None),
            FogMode::Exp { density } => ("exp", None, None, Some(density)),
            FogMode::Exp2 { density } => ("exp2", None, None, Some(density)),
        };
        let margin = 0.15 * (stack.far - stack.near);
        let (low, high) = ((stack.near - margin).max(0.0), stack.far + margin);
        let at = |i: u32| low + (high - low) * f64::from(i) / 96.0;
        Self {
            mode,
            start,
            end,
            density,
            color: fog.color(),
            distance: if fog.distance() == FogDistance::Planar { "planar" } else { "radial" },
            weighting: if fog.weighting() == FogWeighting::Alpha { "alpha" } else { "literal" },
            curve: (0..=96).map(|i| [at(i), fog.factor(at(i))]).collect(),
        }
    }
}

/// How rays are integrated.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct MethodRecord {
    classification: &'static str,
    filter: &'static str,
    slab: &'static str,
    sample: &'static str,
    ends: &'static str,
    target: &'static str,
}

impl MethodRecord {
    fn new(method: Method) -> Self {
        Self {
            classification: match method.classification {
                Classification::Post => "post",
                Classification::Pre => "pre",
                Classification::PreIntegrated => "pre-integrated",
                Classification::SecondOrder => "second-order",
            },
            filter: match method.filter {
                Filter::Linear => "linear",
                Filter::Nearest => "nearest",
                Filter::Cubic { .. } => "cubic",
            },
            slab: if method.slab == SlabForm::Exponential { "exponential" } else { "riemann" },
            sample: if method.sample == SampleAt::Center { "center" } else { "end" },
            ends: if method.ends == Ends::Partial { "partial" } else { "whole" },
            target: if method.target == Target::F32 { "f32" } else { "unorm8" },
        }
    }
}

/// A scene and its volume.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SceneRecord {
    volume: String,
    dims: [usize; 3],
    spacing: [f64; 3],
    voxel_type: &'static str,
    /// Least and greatest value, data units.
    range: [f64; 2],
    /// Share of voxels in each of as many equal parts of the range.
    histogram: Vec<f64>,
    width: u32,
    height: u32,
    background: [f64; 4],
    blend: &'static str,
    /// Level or threshold of the projection.
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<f64>,
    /// Levels of surfaces, rising, with their straight colours: level, red, green, blue.
    levels: Vec<[f64; 4]>,
    order: &'static str,
    terminate: f32,
    /// Reference length of opacity, world units.
    opacity_unit: f64,
    /// Thickness of a slab in reference lengths.
    ratio: f64,
    /// Value, red, green, blue.
    color: Vec<[f64; 4]>,
    /// Value, opacity per reference length.
    opacity: Vec<[f64; 2]>,
    fog: Option<FogRecord>,
    /// The fog that the page shows with where the scene has none.
    example_fog: FogRecord,
    clip_planes: usize,
    method: MethodRecord,
}

impl SceneRecord {
    /// The volume's name without its folders.
    pub(super) fn name(&self) -> String {
        let last = self.volume.rsplit(['/', '\\']).next().unwrap_or_default();
        if last.is_empty() { "volume".to_owned() } else { last.to_owned() }
    }

    pub(super) fn new(volume: &Volume, scene: &Scene, stack: &Stack, example: Fog) -> Self {
        let statistics = volume.statistics();
        let total: u64 = statistics.histogram.iter().sum::<u64>().max(1);
        let parts = statistics.histogram.chunks(statistics.histogram.len().div_ceil(BINS));
        let (blend, level) = match scene.blend() {
            Blend::Over => ("over", None),
            Blend::Under => ("under", None),
            Blend::Mip => ("mip", None),
            Blend::Min => ("min", None),
            Blend::Average => ("average", None),
            Blend::Add => ("add", None),
            Blend::AttenuatedMip { .. } => ("attenuated-mip", None),
            Blend::Lmip { threshold } => ("lmip", Some(threshold)),
            Blend::Iso { level } if scene.surfaces().is_none() => ("iso", Some(level)),
            Blend::Iso { .. } | Blend::Surfaces => ("surfaces", None),
        };
        let unit = scene.opacity_length(volume.grid());
        let b = scene.background();
        Self {
            volume: volume.name().to_owned(),
            dims: volume.grid().dims(),
            spacing: volume.grid().spacing(),
            voxel_type: volume.voxels().voxel_type().name(),
            range: [statistics.min, statistics.max],
            histogram: parts.map(|p| p.iter().sum::<u64>() as f64 / total as f64).collect(),
            width: scene.size().0,
            height: scene.size().1,
            background: [b.rgb[0], b.rgb[1], b.rgb[2], b.alpha],
            blend,
            level,
            levels: scene.surfaces().map_or_else(Vec::new, |s| s.levels.iter().map(|&(v, c, _)| [v, c[0], c[1], c[2]]).collect()),
            order: if scene.blending_order() == Order::BackToFront { "back-to-front" } else { "front-to-back" },
            terminate: scene.terminate(),
            opacity_unit: unit,
            ratio: stack.spacing / unit,
            color: scene.transfer().color().iter().map(|&(v, c)| [v, c[0], c[1], c[2]]).collect(),
            opacity: scene.transfer().opacity().iter().map(|&(v, a)| [v, a]).collect(),
            fog: scene.fog().map(|f| FogRecord::new(f, stack)),
            example_fog: FogRecord::new(&example, stack),
            clip_planes: scene.clip_planes().len(),
            method: MethodRecord::new(scene.method()),
        }
    }
}
