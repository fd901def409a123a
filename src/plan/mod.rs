//! The plan: which stages, tables and slices a frame takes, and what it does without. Made once a frame, before the first pixel, by
//! [`FramePlan::new`]; the rooms above execute it and change nothing in it.
//!
//! ```text
//!  scene, stack --needs--> what the frame needs
//!                            |    prepared: tables and bricks' classes, kept between frames
//!                            v     v
//!                        frame's constants, stages, skip table, what was left out
//! ```

mod colors;
mod hidden_values;
mod left_out;
mod lookup;
mod merging;
mod needs;
mod peaks;
mod places;
mod prepared;
mod rays;
mod scaling;
mod stages;

pub(crate) use crate::classify::KnotTable;
pub(crate) use left_out::{Planned, Saving, passed_over};
pub(crate) use lookup::PointLookup;
pub(crate) use merging::Merging;
pub(crate) use needs::{EndPieces, Needs, method, order};
pub(crate) use peaks::Peaks;
pub(crate) use places::PlaceBricks;
pub(crate) use prepared::{MergedData, Prepared, SurfaceBricks, ThinnessData, TransferData, TransferKey, VolumeData, peak_classes};
pub(crate) use rays::RayPlan;
pub(crate) use scaling::Scaling;
pub(crate) use stages::{PairStages, Stages};

pub(crate) use crate::classify::Detail;
use crate::classify::{By, Classifier, Classify, KnotPiece, Measure, Slab};
use crate::fragment::project::NOTHING;
use crate::fragment::{
    AttenuationFrame, BlendFrame, ColorFrame, DEEP, Frame, LabelFrame, LabelPiece, Numbers, OptionalFrame, PieceFrame, SampleFrame,
    SurfaceFrame,
};
use crate::lanes::{Level, LookupTable};
use crate::proxy::{Domain, RaySteps, Stack};
use crate::scene::{Blend, Fog, FogDistance, SampleAt, Scene, slab_ratio};
use crate::skip::{Runs, SkipTable};
use crate::volume::Volume;
use hidden_values::hidden_up_to;
use needs::{BlendKind, Lookup};
use places::{Places, segments_frame};
pub(crate) use scaling::value_range;
use std::sync::Arc;

/// What a plan is made for.
pub(crate) struct Subject<'s, 'v> {
    pub(crate) scene: &'s Scene,
    pub(crate) volume: &'v Volume,
    pub(crate) data: &'v VolumeData,
    pub(crate) stack: Stack,
    /// Transmittance below which a pixel takes no more.
    pub(crate) terminate: f32,
    /// How fine tables may be.
    pub(crate) detail: Detail,
    pub(crate) level: Level,
    /// Whether an observer sees the frame: then nothing is left out that shows in no pixel.
    pub(crate) observed: bool,
    /// Where the volume is a part of a larger one: which.
    pub(crate) domain: Option<&'v Domain>,
}

/// Everything a frame's blocks share.
#[derive(Debug)]
pub(crate) struct FramePlan<'v> {
    /// Constants of the stages.
    pub(crate) frame: Frame<'v>,
    pub(crate) stack: Stack,
    pub(crate) needs: Needs,
    pub(crate) stages: Stages<'v>,
    /// What shows where, to pass over what does not; `None` where every fragment counts.
    pub(crate) skip_table: Option<Arc<SkipTable>>,
    /// How far values reach where, in projections of the largest or smallest value.
    pub(crate) peaks: Option<Peaks<'v>>,
    /// Slices that are asked about together.
    pub(crate) runs: Runs,
    /// What it takes to make one slab of several, where that may be.
    pub(crate) merging: Option<Merging<'v>>,
    /// How single rays differ from those through flat slices, where they do.
    pub(crate) rays: Option<RayPlan<'v>>,
    /// Fog, of which a factor depends on the slice alone.
    pub(crate) fog: Option<Fog>,
    /// Values pixels start from: colour channels, then transmittance.
    pub(crate) start: [f32; 4],
    /// Where in its slab a value is taken, in slabs from its middle.
    pub(crate) sample: f64,
    /// Vectors of the geometry.
    pub(crate) level: Level,
    /// What depends on the volume.
    pub(crate) data: &'v VolumeData,
    pub(crate) volume: &'v Volume,
    /// Where the volume is a part of a larger one: which.
    pub(crate) domain: Option<&'v Domain>,
    /// What the scene did not need.
    pub(crate) left_out: Vec<Planned>,
    /// What the tables were made of.
    pub(crate) transfer: Arc<TransferData>,
    /// Share of the bricks in which anything shows, where empty ones are passed over.
    pub(crate) visible_share: Option<f64>,
}

impl<'v> FramePlan<'v> {
    /// The plan for one frame of `subject`, with what is `kept` between frames.
    pub(crate) fn new(subject: Subject<'_, 'v>, kept: &mut impl Prepared) -> Self {
        let Subject { scene, volume, data, stack, terminate, detail, level, observed, domain } = subject;
        let whole = domain.map_or(volume.grid(), Domain::whole);
        let steps = RaySteps::of(scene, volume.grid(), &stack);
        let thickness = steps.map_or(stack.spacing, |steps| steps.thickness(&stack));
        // Colours are looked at one by one.
        let with_holes = data.bricks.non_finite > 0 && data.colors.is_none();
        let mut needs = Needs::new(scene, &stack, steps.as_ref(), with_holes, terminate).with_values(scene, volume, data.bricks.range);
        let lookup = needs.lookup(volume, data.packed.is_some(), &data.scaling);
        let ratio = if stack.is_empty() { 1.0 } else { slab_ratio(thickness, scene.opacity_length(whole)) };
        let measure = if needs.optical_depth { Measure::OpticalDepth } else { Measure::Opacity };
        let slab = Slab { ratio, form: needs.method.slab, measure, detail };
        let by = match (&data.colors, needs.method.is_pre_integrated()) {
            (Some(colors), _) => colors.by(volume),
            (None, true) => By::Pair,
            _ if needs.labels => By::Label,
            _ if matches!(lookup, Lookup::Nearest | Lookup::Corners) => By::Voxel,
            _ => By::Value,
        };
        let transfer = kept.transfer(TransferKey {
            transfer: prepared::classified_by(scene, volume, data),
            slab,
            by,
            transfer2d: scene.transfer2d().cloned(),
        });
        let places = if needs.colors() { Places::new(scene, volume, (slab, stack.spacing), by, kept) } else { Places::default() };
        // No slab's opacity is larger than its optical depth.
        let strongest = scene.transfer2d().map_or(f64::from(transfer.strongest), |transfer2d| transfer2d.most_extinction() * ratio);
        let strongest = strongest.max(f64::from(places.strongest()));
        needs.compensated |= needs.compensates_faint(stack.count, strongest);
        // Where empty slices count, or are looked at, all rows do.
        let leave_out = needs.skip && needs.colors() && !observed;
        let (color, split) = color_frame(&data.scaling, &transfer, leave_out);
        let labels = if let Classifier::Label(table) = &transfer.classifier { Some(Arc::new(label_frame(table, volume))) } else { None };
        let surfaces = scene.surfaces().filter(|_| needs.blend == BlendKind::Surfaces);
        let deep = needs.short_pieces() && transfer.strongest.max(places.strongest()) >= DEEP;
        let by_place =
            (places.regions_frame(scene, volume, &data.scaling, (deep, leave_out), kept), segments_frame(scene, volume, slab, leave_out));
        let numbers = Numbers { scale: data.scaling.scale, offset: data.scaling.offset };
        let live = if needs.terminate { terminate } else { 0.0 };
        let mut sample = SampleFrame { labels: labels.clone(), ..sample_frame(volume, data, &needs, lookup, &color) };
        // What shows nothing by the main transfer function may show in a region.
        sample.hidden_up_to = sample.hidden_up_to.filter(|_| by_place.0.is_none());
        let mut frame = Frame {
            sample,
            color,
            blend: BlendFrame { terminate, level: level_of(scene, &data.scaling, labels.as_deref()) },
            optional: OptionalFrame::of(scene, by_place, (whole, volume.grid().dims(), &stack), (numbers, ratio), live),
            surfaces: surfaces.as_ref().map(|s| Box::new(SurfaceFrame::new(s, scene, volume, &stack, |value| data.scaling.number(value)))),
            pieces: None,
            colors: colors::source((volume, data), transfer.alphas.as_ref(), scene, leave_out),
            attenuation: attenuation(scene, volume, data, &stack),
        };
        // Two more tables of that size would cost more than they save.
        needs.merge &= !matches!(&transfer.classifier, Classifier::Value(table) if table.is_finer());
        let merged = if needs.merge { kept.merged(&transfer) } else { None };
        let runs = Runs::new(&stack, needs.ends.between(), needs.merge);
        let (skip_table, visible_share) = match &surfaces {
            _ if !needs.skip => (None, None),
            Some(surfaces) => {
                let (table, share) = kept.surface_table(surfaces, &runs);
                (Some(table), Some(share))
            }
            None if !places.is_empty(scene) => {
                let data: Vec<Arc<TransferData>> = std::iter::once(&transfer).chain(&places.regions).cloned().collect();
                let (table, share) = kept.place_table(scene, &data, &runs);
                (Some(table), Some(share))
            }
            None => (Some(kept.skip_table(&transfer, merged.as_deref(), &runs)), Some(transfer.bricks.share())),
        };
        let peaks = needs.peaks(observed, domain.is_some()).then(|| {
            let to_the_end = (needs.blend == BlendKind::Lmip).then(|| {
                let blend = BlendFrame { level: f32::INFINITY, ..frame.blend.clone() };
                Box::new(Frame { blend, ..frame.clone() })
            });
            Peaks::new(kept.peak_table(needs.blend == BlendKind::Min, &runs), to_the_end, scene.transfer(), &data.scaling)
        });
        let kernels = stages::Kernels {
            scene,
            needs: &needs,
            lookup,
            voxels: volume.voxels().voxel_type(),
            split,
            fine: frame.color.fine.is_some(),
            level,
            pieces: deep,
            part: domain.is_some(),
        };
        if kernels.pieces {
            let thin = kept.thinness(&transfer);
            let fine = frame.color.fine.as_ref().zip(thin.fine.clone()).map(|((_, map), table)| (table, *map));
            let color = ColorFrame { table: thin.table.clone(), fine, ..frame.color.clone() };
            let colors = colors::source((volume, data), thin.alphas.as_ref(), scene, false);
            frame.pieces = Some(Box::new(PieceFrame { frame: Frame { color, colors, ..frame.clone() }, classify: kernels.classify() }));
        }
        let stages = Stages::new(kernels);
        Self {
            rays: RayPlan::new((scene, &stack), steps, (volume, data), stages.cut.clone()),
            stages,
            merging: merged.map(|merged| Merging::new(&frame, &merged)),
            frame,
            skip_table,
            peaks,
            runs,
            fog: scene.fog().filter(|_| needs.fog.is_some()).copied(),
            start: start_values(scene),
            sample: if needs.method.sample == SampleAt::End { 0.5 } else { 0.0 },
            level,
            data,
            volume,
            domain,
            left_out: left_out::planned(scene, volume, &needs, lookup.loads()),
            visible_share,
            transfer,
            needs,
            stack,
        }
    }

    /// The table that lookups give positions in, where they tell labels apart exactly.
    pub(crate) fn labels(&self) -> Option<&KnotTable> {
        if let Classifier::Label(table) = &self.transfer.classifier { Some(table) } else { None }
    }

    /// Whether fog goes by the distance from the eye.
    pub(crate) fn radial(&self) -> bool {
        self.needs.fog == Some(FogDistance::Radial)
    }
}

/// What lookups need.
fn sample_frame<'v>(volume: &'v Volume, data: &'v VolumeData, needs: &Needs, lookup: Lookup, color: &ColorFrame) -> SampleFrame<'v> {
    let [nx, ny, nz] = volume.grid().dims();
    let stride = |n: usize, stride: usize| if n > 1 { stride } else { 0 };
    if let Some(coefficients) = &data.coefficients {
        let [sx, sy, sz] = coefficients.strides;
        return SampleFrame {
            voxels: volume.voxels().slices(),
            packed: None,
            coefficients: Some(coefficients),
            strides: [stride(nx, sx), sy, sz],
            far: needs.far,
            to_f32: data.scaling.to_f32,
            hidden_up_to: None,
            labels: None,
        };
    }
    let packed = data.packed.as_ref().filter(|_| lookup == Lookup::Packed);
    let [row, layer] = packed.map_or([nx, nx * ny], |p| p.strides);
    let kind = volume.voxels().voxel_type();
    SampleFrame {
        voxels: volume.voxels().slices(),
        packed,
        coefficients: None,
        strides: [stride(nx, 1), stride(ny, row), stride(nz, layer)],
        far: needs.far,
        to_f32: data.scaling.to_f32,
        // Slabs between two values are classified by more than the value at hand.
        hidden_up_to: if needs.method.is_pre_integrated() { None } else { hidden_up_to(kind, color.low, color.scale, color.first_visible) },
        labels: None,
    }
}

/// What classification by `data` needs, and whether the table's scale is applied in two steps. Where nothing may be `hidden`, every row
/// counts as visible.
fn color_frame(scaling: &Scaling, data: &TransferData, hidden: bool) -> (ColorFrame, bool) {
    let last = data.classifier.last();
    if let Classifier::Label(_) = data.classifier {
        // Lookups give positions.
        let first_visible = if hidden { first_visible(&data.table, last, false) } else { 0.0 };
        return (
            ColorFrame { table: data.table.clone(), low: 0.0, scale: [1.0, 1.0], last: last as f32, fine: None, first_visible },
            false,
        );
    }
    let (from, to) = data.classifier.range();
    let (low, high) = (scaling.number(from), scaling.number(to));
    let scale = if last == 0 { 0.0 } else { last as f64 / (high - low) };
    let split = scale != 0.0 && !(1e-30..1e30).contains(&scale.abs());
    let factors = if split {
        let (mantissa, exponent) = libm::frexp(scale);
        let half = exponent / 2;
        [libm::scalbn(mantissa, half) as f32, libm::scalbn(1.0, exponent - half) as f32]
    } else {
        [scale as f32, 1.0]
    };
    let fine = data.classifier.fine().zip(data.fine.as_ref()).map(|(layout, table)| {
        let (low, high) = layout.range();
        let per_unit = last as f64 / (to - from);
        let factor = if high > low { layout.last() as f64 / ((high - low) * per_unit) } else { 0.0 };
        (table.clone(), [((low - from) * per_unit) as f32, factor as f32, layout.last() as f32])
    });
    let first_visible = if hidden { first_visible(&data.table, last, fine.is_some()) } else { 0.0 };
    (ColorFrame { table: data.table.clone(), low: low as f32, scale: factors, last: last as f32, fine, first_visible }, split)
}

/// The table position up to which slabs show nothing.
fn first_visible(table: &LookupTable, last: usize, fine: bool) -> f32 {
    let hidden = table.hidden_intervals(last + 1);
    // Entries of the finer table may reach into the next interval.
    (if fine { hidden.saturating_sub(1) } else { hidden }) as f32
}

/// How the values of `volume` become positions in `table`.
fn label_frame(table: &KnotTable, volume: &Volume) -> LabelFrame {
    let piece = |p: &KnotPiece| LabelPiece { from: p.from, width: p.width, first: p.first as f64, intervals: p.intervals as f64 };
    LabelFrame { rescale: volume.rescale(), pieces: table.pieces().iter().map(piece).collect() }
}

/// How values fade behind others, where `scene` lets them.
fn attenuation(scene: &Scene, volume: &Volume, data: &VolumeData, stack: &Stack) -> Option<Box<AttenuationFrame>> {
    let Blend::AttenuatedMip { attenuation } = scene.blend() else { return None };
    let (min, max) = data.bricks.range;
    let (min, max) = if min <= max { value_range(volume, min, max) } else { (0.0, 0.0) };
    let [low, width] = match scene.window() {
        Some([center, width]) => [center - 0.5 * width, width],
        None if max > min => [min, max - min],
        // One value is the largest there is.
        None => [min - 1.0, 1.0],
    };
    let grid = volume.grid();
    let ((from, to), spacing) = (grid.index_bounds(), grid.spacing());
    let longest = (0..3).map(|axis| (to[axis] - from[axis]) * spacing[axis].abs()).fold(0.0, f64::max);
    Some(Box::new(AttenuationFrame {
        low: data.scaling.number(low) as f32,
        per_unit: (data.scaling.scale / width) as f32,
        per_slab: if longest > 0.0 { (attenuation * (stack.spacing / longest)) as f32 } else { 0.0 },
        window: [low, width],
    }))
}

/// Threshold or level of a projection, as the number or the position that it is compared with.
fn level_of(scene: &Scene, scaling: &Scaling, labels: Option<&LabelFrame>) -> f32 {
    match scene.blend() {
        Blend::Lmip { threshold: x } | Blend::Iso { level: x } => labels.map_or(scaling.number(x) as f32, |labels| labels.position(x)),
        _ => 0.0,
    }
}

/// What pixels start from: colour channels, then transmittance.
pub(crate) fn start_values(scene: &Scene) -> [f32; 4] {
    match scene.blend() {
        _ if scene.surfaces().is_some() => [0.0, 0.0, 0.0, 1.0],
        Blend::Over | Blend::Under | Blend::Surfaces => [0.0, 0.0, 0.0, 1.0],
        Blend::Add | Blend::Average => [0.0; 4],
        Blend::Mip | Blend::Min | Blend::AttenuatedMip { .. } => [NOTHING, 0.0, 0.0, 1.0],
        Blend::Lmip { .. } | Blend::Iso { .. } => [NOTHING, NOTHING, 0.0, 1.0],
    }
}
