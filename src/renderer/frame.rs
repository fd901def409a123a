//! One frame: so many slices of a scene, into pixels.

use super::dark::dark;
use super::{Renderer, tile_side};
use crate::fragment::batch::SIDE;
use crate::fragment::{Frame, FrameFog};
use crate::lanes::{Level, LookupTable};
use crate::plan::{self, ChangeClasses, Classes, Needs, Planned, Scaling, Slab, Stages};
use crate::proxy::Stack;
use crate::raster::{BlockMask, Contents, Counters, LookAt, Merging, Outer, Resolve, Runs, Sight, THICK, Watch, Work, render_tiles};
use crate::scene::{
    Blend, Ends, Fog, FogDistance, FogWeighting, Method, Premultiplied, SampleAt, Scene, SlabForm, Slicing, TransferFunction, View,
};
use crate::tally::{LeftOut, Tally};
use crate::volume::bricks::Bricks;
use crate::volume::packed::Packed;
use crate::{Error, Result, Volume};
use std::array;
use std::sync::Arc;
use std::time::Instant;

/// What depends on the volume alone.
pub(super) struct VolumeData {
    pub(super) bricks: Arc<Bricks>,
    pub(super) packed: Option<Packed>,
    pub(super) scaling: Scaling,
}

/// What depends on the volume, the transfer function and the thickness of a slab.
pub(super) struct TransferData {
    transfer: TransferFunction,
    slab: Slab,
    /// Whether the table is over pairs of values.
    pairs: bool,
    classes: Classes,
    table: Arc<LookupTable>,
    /// A table over values on their own, beside one over pairs.
    fine: Option<Arc<LookupTable>>,
    contents: Arc<Contents>,
    sight: Option<Sight>,
    thick: Option<ThickData>,
}

/// What slabs several times as thick need.
struct ThickData {
    tables: ThickTables,
    contents: Contents,
    sight: Option<Sight>,
}

/// Tables for slabs as thick as each of [`THICK`], and the opacity of the strongest plain slab.
type ThickTables = ([Arc<LookupTable>; 2], f32);

impl TransferData {
    /// What bricks hold, as a frame of `runs` looks at it; and the tables of slabs several times as thick, where they `merge`.
    fn sight(&mut self, runs: &Runs, merge: bool) -> (&Sight, Option<ThickTables>) {
        let (contents, sight, tables) = match &mut self.thick {
            Some(t) if merge => (&t.contents, &mut t.sight, Some(t.tables.clone())),
            _ => (&*self.contents, &mut self.sight, None),
        };
        if sight.as_ref().is_none_or(|s| s.sides() != runs.sides) {
            *sight = None;
        }
        (sight.get_or_insert_with(|| Sight::new(contents, runs.sides)), tables)
    }
}

/// Tables for so many thicknesses of slabs are kept.
const KEPT: usize = 8;

/// A picture in the making: what frames of it share.
pub(super) struct Shot<'s, W> {
    pub(super) scene: &'s Scene,
    pub(super) view: View,
    pub(super) clock: Clock,
    pub(super) watch: W,
}

impl Renderer<'_> {
    /// Fills `pixels` with the scene in `count` slices, pixels ending at transmittance `terminate`; with a mask, its blocks alone.
    pub(super) fn frame<W: Watch>(
        &mut self,
        shot: &mut Shot<'_, W>,
        count: u64,
        terminate: f32,
        blocks: Option<&BlockMask>,
        pixels: &mut [[f32; 4]],
    ) -> Result<Finished> {
        let (scene, view) = (shot.scene, &shot.view);
        let volume = self.volume;
        let Some(prepared) = &self.volume_data else {
            return Err(Error::invalid("a frame before the volume is prepared"));
        };
        let VolumeData { bricks, scaling, .. } = prepared;
        let stack = Stack::new(volume.grid(), view, scene.clip_planes(), count);
        let transfer_data = shot.clock.prepare(|| {
            let unit = scene.transfer().opacity_length(volume.grid());
            let ratio = if stack.is_empty() { 1.0 } else { stack.spacing / unit };
            let method = plan::method(scene);
            let slab = Slab { ratio, form: method.slab };
            let pairs = method.is_pre_integrated();
            let list = &mut self.transfer_data;
            list.retain(|t| t.transfer == *scene.transfer());
            let at = list.iter().position(|t| t.slab == slab && t.pairs == pairs).unwrap_or_else(|| {
                list.push(prepare_transfer(scene.transfer(), (slab, pairs), volume, bricks, list));
                list.len() - 1
            });
            list[..=at].rotate_right(1);
            list.truncate(KEPT);
            if method.merge && list[0].thick.is_none() {
                list[0].thick = prepare_thick(&list[0], volume, bricks);
            }
            &mut list[0]
        });
        let Parts { mut frame, needs, stages } = Parts::new(scene, volume, prepared, transfer_data, &stack, terminate, self.level);
        // Where empty slices count, or are looked at, all rows do.
        if needs.skip && !W::SEES {
            frame.clear = clear(transfer_data);
            if !needs.method.is_pre_integrated() {
                frame.dark = dark(frame.voxels.voxel_type(), frame.table_low, frame.table_scale, frame.clear);
            }
        }
        let outer = match (needs.method.is_pre_integrated(), needs.method.ends) {
            (false, Ends::Partial) => Outer::Partial,
            (false, Ends::Whole) => Outer::Whole,
            (true, Ends::Partial) => Outer::Between,
            (true, Ends::Whole) => Outer::WholeBetween,
        };
        let runs = Runs::new(&stack, outer.between(), needs.merge);
        let (sight, thick) = if needs.skip {
            let (sight, thick) = transfer_data.sight(&runs, needs.merge);
            (Some(sight), thick)
        } else {
            (None, None)
        };
        let thick = thick.map(|(tables, strongest)| (tables.map(|table| Frame { table, ..frame.clone() }), strongest));
        let work = Work {
            frame: &frame,
            stack: &stack,
            fog: scene.fog().filter(|_| needs.fog.is_some()),
            order: needs.order,
            sight,
            runs,
            look: [self.level.kernel::<LookAt<false>, _, _>(), self.level.kernel::<LookAt<true>, _, _>()],
            span: stages.span,
            whole: stages.whole,
            partial: stages.partial,
            start: start_values(scene.blend()),
            compensated: needs.compensated,
            level: self.level,
            radial: needs.fog == Some(FogDistance::Radial),
            outer,
            pairs: stages.pairs,
            merging: thick
                .as_ref()
                .map(|(frames, strongest)| Merging::new(frames, |class| plan::most_change(class as u8) as f32, *strongest, self.level)),
            sample: if needs.method.sample == SampleAt::End { 0.5 } else { 0.0 },
        };
        let resolve = Resolve {
            blend: scene.blend(),
            background: background(scene),
            transfer: scene.transfer(),
            volume,
            stack: &stack,
            scale: scaling.scale,
            offset: scaling.offset,
            low: f64::from(frame.table_low),
            bounded: needs.method.slab == SlabForm::Exponential,
            most: if scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal) { f32::INFINITY } else { 1.0 },
        };
        let mut counters = Counters::default();
        if stack.is_empty() {
            pixels.fill(resolve.background());
        } else {
            let tile = self.settings.tile.unwrap_or_else(|| tile_side(stack.view.width, stack.view.height));
            // What becomes one depends on all of a block's pixels: no tile may cut one.
            let tile = if needs.merge { tile.next_multiple_of(SIDE as u32) } else { tile };
            let seen;
            (counters, seen) = render_tiles(&work, &resolve, tile, pixels, blocks, self.settings.progress.as_deref(), &shot.watch)?;
            shot.watch.merge(seen);
        }
        let loads = needs.loads(volume, prepared.packed.is_some(), scaling);
        let planned = plan::planned(scene, volume, &needs, loads);
        let visible_share = needs.skip.then(|| transfer_data.contents.share());
        Ok(Finished { counters, frames: 1, slices: stack.count, planned, method: scene.method(), visible_share })
    }
}

/// What batches of a frame go through, and by which constants.
pub(crate) struct Parts<'v> {
    pub(crate) frame: Frame<'v>,
    pub(crate) needs: Needs,
    pub(crate) stages: Stages<'v>,
}

impl<'v> Parts<'v> {
    fn new(
        scene: &Scene,
        volume: &'v Volume,
        VolumeData { bricks, packed, scaling }: &'v VolumeData,
        transfer_data: &TransferData,
        stack: &Stack,
        terminate: f32,
        level: Level,
    ) -> Self {
        let (mut frame, split) = make_frame(scene, volume, packed.as_ref(), scaling, transfer_data, terminate);
        let needs = Needs::new(scene, stack, bricks, (split, frame.fine.is_some()), terminate);
        frame.far = needs.far;
        if let (true, Some(packed)) = (needs.reads_packed(volume, packed.is_some(), scaling), packed) {
            for (stride, packed) in frame.strides[1..].iter_mut().zip(packed.strides).filter(|(stride, _)| **stride > 0) {
                *stride = packed;
            }
        }
        let stages = needs.stages(volume, packed.is_some(), scaling, level);
        Self { frame, needs, stages }
    }
}

impl Renderer<'_> {
    /// The parts of the frame of `scene` that was rendered last.
    pub(crate) fn parts(&self, scene: &Scene) -> Option<Parts<'_>> {
        let Slicing::Count(count) = scene.slicing() else { return None };
        let (width, height) = scene.size();
        let view = scene.camera().resolve(self.volume.grid(), width, height).ok()?;
        let stack = Stack::new(self.volume.grid(), &view, scene.clip_planes(), count);
        let transfer_data = self.transfer_data.first()?;
        Some(Parts::new(scene, self.volume, self.volume_data.as_ref()?, transfer_data, &stack, scene.terminate(), self.level))
    }
}

/// What a frame took, or several frames that make up one picture.
pub(super) struct Finished {
    pub(super) counters: Counters,
    pub(super) frames: u64,
    pub(super) slices: u64,
    pub(super) planned: Vec<Planned>,
    /// How its rays were integrated.
    pub(super) method: Method,
    visible_share: Option<f64>,
}

impl Finished {
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
        plan::tally(&self.counters, self.frames)
    }

    /// Everything that was left out of the picture.
    pub(super) fn left_out(&mut self) -> Vec<LeftOut> {
        let tally = self.tally();
        let planned = std::mem::take(&mut self.planned).into_iter();
        planned.map(|p| p.counted(&self.counters)).chain(plan::passed_over(&tally, self.visible_share)).collect()
    }
}

/// Seconds since a frame began, and those of them that went into what depends on volume and transfer function only.
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

/// Table of a transfer function for slabs like `slab`, and what bricks hold.
///
/// What `kept` holds for another thickness serves again where it does not depend on it.
fn prepare_transfer(
    transfer: &TransferFunction,
    (slab, pairs): (Slab, bool),
    volume: &Volume,
    bricks: &Bricks,
    kept: &[TransferData],
) -> TransferData {
    let (slope, intercept) = volume.rescale();
    let value = |stored: f64| stored * slope + intercept;
    // In the order of the data's units, whatever the sign of the slope.
    let sorted = |lo: f64, hi: f64| if slope < 0.0 { (value(hi), value(lo)) } else { (value(lo), value(hi)) };
    let (min, max) = bricks.range;
    let range = if min <= max { sorted(min, max) } else { (0.0, 0.0) };
    let classes = Classes::new(transfer, range, slab, pairs);
    let table = Arc::new(classes.table(transfer, slab));
    let fine = classes.fine().map(|layout| Arc::new(layout.table(transfer, slab)));
    let contents = match kept.iter().find(|k| k.classes == classes) {
        Some(kept) => kept.contents.clone(),
        None => Arc::new(Contents::new(bricks, |lo, hi| {
            let (lo, hi) = sorted(lo, hi);
            u8::from(classes.opaque_within(lo, hi))
        })),
    };
    TransferData { transfer: transfer.clone(), slab, pairs, classes, table, fine, contents, sight: None, thick: None }
}

/// What it takes to make one slab of several like those of `data`; nothing where values come in pairs.
fn prepare_thick(data: &TransferData, volume: &Volume, bricks: &Bricks) -> Option<ThickData> {
    let Classes::Values(layout) = &data.classes else { return None };
    let classes = ChangeClasses::new(&data.table, data.classes.range(), data.classes.last());
    let (slope, intercept) = volume.rescale();
    let contents = Contents::new(bricks, |lo, hi| {
        let (a, b) = (lo * slope + intercept, hi * slope + intercept);
        let (a, b) = (a.min(b), a.max(b));
        // Classes are too coarse to tell what shows from what does not.
        if data.classes.opaque_within(a, b) { classes.class(a, b).max(1) } else { 0 }
    });
    let tables = THICK.map(|(count, _)| {
        let slab = Slab { ratio: count as f64 * data.slab.ratio, ..data.slab };
        Arc::new(layout.table(&data.transfer, slab))
    });
    Some(ThickData { tables: (tables, plan::strongest(&data.table)), contents, sight: None })
}

/// Constants of the frame, and whether the table's scale has to be applied in two steps.
fn make_frame<'v>(
    scene: &Scene,
    volume: &'v Volume,
    packed: Option<&'v Packed>,
    scaling: &Scaling,
    data: &TransferData,
    terminate: f32,
) -> (Frame<'v>, bool) {
    let [nx, ny, nz] = volume.grid().dims();
    let stride = |n: usize, stride: usize| if n > 1 { stride } else { 0 };
    let (low, high) = data.classes.range();
    let (low, high) = (scaling.number(low), scaling.number(high));
    let last = data.classes.last();
    let scale = if last == 0 { 0.0 } else { last as f64 / (high - low) };
    let split = scale != 0.0 && !(1e-30..1e30).contains(&scale.abs());
    let table_scale = if split {
        let (mantissa, exponent) = libm::frexp(scale);
        let half = exponent / 2;
        [libm::scalbn(mantissa, half) as f32, libm::scalbn(1.0, exponent - half) as f32]
    } else {
        [scale as f32, 1.0]
    };
    let fine = data.classes.fine().zip(data.fine.as_ref()).map(|(layout, table)| {
        let ((low, high), (from, to)) = (data.classes.range(), (layout.low, layout.high));
        let per_unit = last as f64 / (high - low);
        let factor = if to > from { layout.last() as f64 / ((to - from) * per_unit) } else { 0.0 };
        (table.clone(), [((from - low) * per_unit) as f32, factor as f32, layout.last() as f32])
    });
    let level = match scene.blend() {
        Blend::Lmip { threshold: x } | Blend::Iso { level: x } => scaling.number(x),
        _ => 0.0,
    };
    let frame = Frame {
        voxels: volume.voxels(),
        packed,
        strides: [stride(nx, 1), stride(ny, nx), stride(nz, nx * ny)],
        far: false,
        to_f32: scaling.to_f32,
        table: data.table.clone(),
        table_low: low as f32,
        table_scale,
        table_last: last as f32,
        clear: 0.0,
        dark: None,
        fine,
        terminate,
        fog: scene.fog().map(|f| FrameFog {
            mode: f.mode(),
            color: f.color().map(|c| c as f32),
            weighted: f.weighting() == FogWeighting::Alpha,
        }),
        level: level as f32,
    };
    (frame, split)
}

/// The table position up to which slabs show nothing.
fn clear(data: &TransferData) -> f32 {
    let clear = data.table.clear(data.classes.last() + 1);
    // Entries of the finer table may reach into the next interval.
    (if data.fine.is_some() { clear.saturating_sub(1) } else { clear }) as f32
}

/// What pixels start from: colour channels, then transmittance.
pub(crate) fn start_values(blend: Blend) -> [f32; 4] {
    let nothing = crate::fragment::project::NOTHING;
    match blend {
        Blend::Over => [0.0, 0.0, 0.0, 1.0],
        Blend::Add | Blend::Average => [0.0; 4],
        Blend::Mip | Blend::Min => [nothing, 0.0, 0.0, 1.0],
        Blend::Lmip { .. } | Blend::Iso { .. } => [nothing, nothing, 0.0, 1.0],
    }
}

/// The background, fogged as from infinitely far where the scene asks for it.
pub(super) fn background(scene: &Scene) -> Premultiplied {
    let color = scene.background();
    let straight = match scene.fog().filter(|_| scene.fogged_background()) {
        Some(fog) => fogged(color, fog),
        None => color,
    };
    straight.premultiply()
}

fn fogged(color: crate::scene::Straight, fog: &Fog) -> crate::scene::Straight {
    let f = fog.factor(f64::MAX);
    let rgb = array::from_fn(|c| f * color.rgb[c] + (1.0 - f) * fog.color()[c]);
    crate::scene::Straight { rgb, alpha: color.alpha }
}
