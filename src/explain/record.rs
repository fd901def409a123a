//! The record in the form that the page and notebooks read: columns aligned with the slices of a pixel.
//!
//! f32 numbers are written with as many digits as it takes to read the same f32 again; `null` stands for nothing gathered yet, and
//! in a stage's columns for slices on which the stage did not run.

use super::by_gradient::ByGradientAt;
use super::gradient::GradientAt;
use super::light::{LightAt, Lit};
use super::recorder::{Journey, Skipped, Snapshot, Step, WHOLE};
use crate::Volume;
use crate::lanes::ToF32;
use crate::plan::Scaling;
use crate::proxy::Stack;
use crate::scene::{Fog, FogDistance, OptionalStage, Quantity, Scene, StageId};
use serde::Serialize;
use std::collections::BTreeMap;

/// A column: one entry a recorded slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Column {
    Flag(Vec<Option<bool>>),
    Number(Vec<Option<f32>>),
    Triple(Vec<Option<[f32; 3]>>),
    Voxel(Vec<Option<[u64; 3]>>),
}

/// What one stage changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct StageColumns {
    pub(super) name: String,
    /// What the stage does.
    pub(super) about: &'static str,
    /// covered, length, cell, weight, value, color, alpha, sum, transmittance: those that the stage is known to set or changed.
    pub(super) columns: BTreeMap<&'static str, Column>,
}

/// A pixel's way through the stack.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct PixelRecord {
    pub(super) x: u32,
    pub(super) y: u32,
    /// The picture's own pixel: premultiplied RGBA over the background.
    pub(super) picture: [f32; 4],
    /// First and last slice that covers it.
    pub(super) span: Option<(u64, u64)>,
    /// Depth at which its ray enters and leaves the box, clip planes left out.
    pub(super) through: Option<[f64; 2]>,
    /// The ray's points at the stack's near and far end, in the drawing.
    pub(super) drawn: [[f64; 2]; 2],
    /// Lengths of the first and the last piece of its ray, in slabs along the depth.
    pub(super) ends: [f32; 2],
    /// Length of the ray per unit of depth.
    pub(super) slant: f32,
    /// What it had gathered before the first slice recorded: colour, transmittance.
    pub(super) start: [f32; 4],
    pub(super) gathered: [f32; 4],
    /// What rounding has added to the transmittance: the picture's opacity is 1 - transmittance + this. 0 where sums are not compensated.
    pub(super) excess: f32,
    /// Runs of slices passed over: from, up to but without, and whether it was because the block was finished.
    pub(super) skipped: Vec<(u64, u64, bool)>,
    /// Recorded slices in the order they were blended.
    pub(super) slice: Vec<u64>,
    pub(super) depth: Vec<f32>,
    pub(super) covered: Vec<bool>,
    /// Covered fragments of the block, one bit each in hex, first pixel in the lowest; `null` where all 64 are.
    pub(super) mask: Vec<Option<String>>,
    /// Length of the piece of the ray, in slabs.
    pub(super) length: Vec<f32>,
    /// The number looked up.
    pub(super) value: Vec<f32>,
    /// The number on the slab's near side, where slabs lie between two values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) front: Vec<f32>,
    /// The eight voxels around, x fastest, as the numbers that are interpolated.
    pub(super) corners: Vec<[f32; 8]>,
    /// Four interpolations along x, two along y, one along z, in f32; `null` where the last is not the value looked up.
    pub(super) rounds: Vec<Option<[f32; 7]>>,
    /// The transfer function itself at the value: straight red, green, blue, and opacity per reference length.
    pub(super) exact: Vec<[f32; 4]>,
    /// Distance that fog is computed from, and the factor there.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) fog: Vec<[f32; 2]>,
    /// Gradients, colours by them, and light, worked out apart from the stages; `null` where there is nothing to compare.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) gradient: Vec<Option<GradientAt>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) by_gradient: Vec<Option<ByGradientAt>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) light: Vec<Option<LightAt>>,
    pub(super) stages: Vec<StageColumns>,
    /// Premultiplied colour and opacity that went into the blend.
    pub(super) color: Vec<[f32; 3]>,
    pub(super) alpha: Vec<f32>,
    /// What the pixel has gathered after the slice.
    pub(super) sum: Vec<[f32; 3]>,
    pub(super) transmittance: Vec<f32>,
    /// The same pixel rendered in other ways.
    pub(super) twins: BTreeMap<&'static str, Twin>,
}

/// A pixel rendered in another way, by the same pipeline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Twin {
    /// What it had gathered before the first slice recorded: colour, transmittance.
    pub(super) start: [f32; 4],
    pub(super) slice: Vec<u64>,
    pub(super) covered: Vec<bool>,
    pub(super) color: Vec<[f32; 3]>,
    pub(super) alpha: Vec<f32>,
    pub(super) sum: Vec<[f32; 3]>,
    pub(super) transmittance: Vec<f32>,
    pub(super) gathered: [f32; 4],
    /// The closed sum of the recorded fragments, in f64; for the order front to back alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) closed: Option<[f64; 4]>,
}

impl Twin {
    pub(super) fn new(journey: &Journey, closed: bool) -> Self {
        let after = || journey.steps.iter().map(Step::after);
        Self {
            start: start_of(journey),
            slice: journey.steps.iter().map(|s| s.slice).collect(),
            covered: after().map(|s| s.covered).collect(),
            color: after().map(|s| s.color).collect(),
            alpha: after().map(|s| s.alpha).collect(),
            sum: after().map(|s| s.sum).collect(),
            transmittance: after().map(|s| s.transmittance).collect(),
            gathered: journey.gathered,
            closed: closed.then_some(journey.closed),
        }
    }
}

/// What a pixel had gathered before the first slice recorded; what it starts from where none is.
fn start_of(journey: &Journey) -> [f32; 4] {
    journey.steps.first().map_or(journey.start, Step::gathered_before)
}

/// What all pixels of a record share.
#[derive(Clone, Copy)]
pub(super) struct Context<'c> {
    pub(super) volume: &'c Volume,
    pub(super) scene: &'c Scene,
    pub(super) to_f32: Option<ToF32>,
}

impl Context<'_> {
    /// (scale, offset): value in the data's units = scale * number + offset.
    pub(super) fn scale(&self) -> (f64, f64) {
        let scaling = Scaling::of(self.volume, self.to_f32);
        (scaling.scale, scaling.offset)
    }

    /// The eight voxels of the cell whose lowest is `lowest`, as the numbers that stages interpolate.
    fn corners(&self, lowest: [u64; 3]) -> [f32; 8] {
        let dims = self.volume.grid().dims();
        let low = lowest.map(|v| v as usize);
        std::array::from_fn(|c| {
            let [i, j, k] = [0, 1, 2].map(|axis: usize| (low[axis] + (c >> axis & 1)).min(dims[axis] - 1));
            let stored = self.volume.voxels().get((k * dims[1] + j) * dims[0] + i);
            match self.to_f32 {
                Some(m) => (stored * m.gain - m.bias) as f32,
                None => stored as f32,
            }
        })
    }
}

/// The rounds of trilinear interpolation between `c` at weights `w`, rounded as the stage rounds.
fn rounds(c: &[f32; 8], w: [f32; 3]) -> [f32; 7] {
    let lerp = |a: f32, b: f32, t: f32| a + t * (b - a);
    let x = [0, 2, 4, 6].map(|i: usize| lerp(c[i], c[i + 1], w[0]));
    let y = [lerp(x[0], x[1], w[1]), lerp(x[2], x[3], w[1])];
    [x[0], x[1], x[2], x[3], y[0], y[1], lerp(y[0], y[1], w[2])]
}

const QUANTITIES: [Quantity; 11] = [
    Quantity::Covered,
    Quantity::Length,
    Quantity::Cell,
    Quantity::Weight,
    Quantity::Value,
    Quantity::Normal,
    Quantity::Steepness,
    Quantity::Color,
    Quantity::Alpha,
    Quantity::Sum,
    Quantity::Transmittance,
];

fn same(quantity: Quantity, a: &Snapshot, b: &Snapshot) -> bool {
    match quantity {
        Quantity::Covered => a.covered == b.covered,
        Quantity::Length => a.length == b.length,
        Quantity::Cell => a.cell == b.cell,
        Quantity::Weight => a.weight == b.weight,
        Quantity::Value => a.value == b.value || (a.value.is_nan() && b.value.is_nan()),
        Quantity::Normal => a.normal == b.normal,
        Quantity::Steepness => a.steepness == b.steepness,
        Quantity::Color => a.color == b.color,
        Quantity::Alpha => a.alpha == b.alpha,
        Quantity::Sum => a.sum == b.sum,
        Quantity::Transmittance => a.transmittance == b.transmittance,
    }
}

/// A stage's run on a slice: the first, the second ...
type RunOf = (StageId, usize);

/// The column of `quantity` over `each` slice's snapshot, where there is one.
fn column<'s>(quantity: Quantity, each: impl Iterator<Item = Option<&'s Snapshot>>) -> Column {
    match quantity {
        Quantity::Covered => Column::Flag(each.map(|s| s.map(|s| s.covered)).collect()),
        Quantity::Length => Column::Number(each.map(|s| s.map(|s| s.length)).collect()),
        Quantity::Cell => Column::Voxel(each.map(|s| s.map(|s| s.cell)).collect()),
        Quantity::Weight => Column::Triple(each.map(|s| s.map(|s| s.weight)).collect()),
        Quantity::Value => Column::Number(each.map(|s| s.map(|s| s.value)).collect()),
        Quantity::Normal => Column::Triple(each.map(|s| s.map(|s| s.normal)).collect()),
        Quantity::Steepness => Column::Number(each.map(|s| s.map(|s| s.steepness)).collect()),
        Quantity::Color => Column::Triple(each.map(|s| s.map(|s| s.color)).collect()),
        Quantity::Alpha => Column::Number(each.map(|s| s.map(|s| s.alpha)).collect()),
        Quantity::Sum => Column::Triple(each.map(|s| s.map(|s| s.sum)).collect()),
        Quantity::Transmittance => Column::Number(each.map(|s| s.map(|s| s.transmittance)).collect()),
    }
}

/// Columns of every stage that ran on any of `steps`, in the order they ran.
fn stages(steps: &[Step]) -> Vec<StageColumns> {
    // A stage that runs twice on a slice is told apart by a number.
    let mut order: Vec<RunOf> = Vec::new();
    let mut runs: Vec<BTreeMap<RunOf, (Snapshot, Snapshot)>> = Vec::new();
    for step in steps {
        let (mut run, mut before) = (BTreeMap::new(), step.before);
        let mut place = 0;
        for (id, after) in &step.stages {
            let which = (*id, 1 + run.keys().filter(|(other, _)| other == id).count());
            place = match order.iter().position(|s| *s == which) {
                Some(at) => at + 1,
                None => {
                    order.insert(place, which);
                    place + 1
                }
            };
            run.insert(which, (before, *after));
            before = *after;
        }
        runs.push(run);
    }
    let columns = |which: &RunOf| {
        let info = which.0.info();
        let changed = |q: Quantity| runs.iter().filter_map(|r| r.get(which)).any(|(a, b)| !same(q, a, b));
        let wanted = QUANTITIES.into_iter().filter(|&q| info.sets.contains(&q) || changed(q));
        let columns = wanted.map(|q| (q.name(), column(q, runs.iter().map(|r| r.get(which).map(|(_, after)| after))))).collect();
        let name = if which.1 == 1 { info.name.to_owned() } else { format!("{} {}", info.name, which.1) };
        StageColumns { name, about: info.about, columns }
    };
    order.iter().map(columns).collect()
}

/// Distance that fog is computed from, and the factor there, on one slice of a pixel.
fn fogged(fog: &Fog, journey: &Journey, step: &Step) -> [f32; 2] {
    match fog.distance() {
        FogDistance::Planar => [step.depth, step.fog],
        FogDistance::Radial => {
            let along = f64::from(step.depth) * f64::from(journey.slant);
            let z = (along * along + f64::from(journey.plane_squared)).sqrt();
            [z as f32, fog.factor(z) as f32]
        }
    }
}

impl PixelRecord {
    /// The record of pixel (x,y); without a journey, of a pixel that no slice covers.
    pub(super) fn new((x, y): (u32, u32), picture: [f32; 4], start: [f32; 4], journey: Option<&Journey>, context: Context<'_>) -> Self {
        let mut record = Self {
            x,
            y,
            picture,
            span: None,
            through: None,
            drawn: [[0.0; 2]; 2],
            ends: [0.0; 2],
            slant: 1.0,
            start,
            gathered: start,
            excess: 0.0,
            skipped: Vec::new(),
            slice: Vec::new(),
            depth: Vec::new(),
            covered: Vec::new(),
            mask: Vec::new(),
            length: Vec::new(),
            value: Vec::new(),
            front: Vec::new(),
            corners: Vec::new(),
            rounds: Vec::new(),
            exact: Vec::new(),
            fog: Vec::new(),
            gradient: Vec::new(),
            by_gradient: Vec::new(),
            light: Vec::new(),
            stages: Vec::new(),
            color: Vec::new(),
            alpha: Vec::new(),
            sum: Vec::new(),
            transmittance: Vec::new(),
            twins: BTreeMap::new(),
        };
        let Some(journey) = journey else { return record };
        record.span = journey.span;
        record.ends = journey.ends;
        record.slant = journey.slant;
        record.start = start_of(journey);
        record.gathered = journey.gathered;
        record.excess = journey.excess;
        record.skipped = journey.skipped.iter().map(|&Skipped { from, to, finished }| (from, to, finished)).collect();
        let (scale, offset) = context.scale();
        for step in &journey.steps {
            let s = step.after();
            let corners = context.corners(s.cell);
            let looked_up = rounds(&corners, s.weight);
            let value = step.stages.iter().rev().find(|(id, _)| *id == StageId::Fetch).map_or(s.value, |(_, s)| s.value);
            let data = scale * f64::from(s.value) + offset;
            let exact = match context.scene.transfer2d() {
                Some(transfer) => transfer.eval(data, s.steepness.into()),
                None => context.scene.transfer().eval(data),
            };
            let [r, g, b] = exact.rgb.map(|c| c as f32);
            record.slice.push(step.slice);
            record.depth.push(step.depth);
            record.covered.push(s.covered);
            record.mask.push((step.mask != WHOLE).then(|| format!("{:016x}", step.mask)));
            record.length.push(s.length);
            record.value.push(s.value);
            if context.scene.method().is_pre_integrated() {
                record.front.push(step.front);
            }
            record.corners.push(corners);
            record.rounds.push((looked_up[6] == value).then_some(looked_up));
            record.exact.push([r, g, b, exact.alpha as f32]);
            record.fog.extend(context.scene.fog().map(|fog| fogged(fog, journey, step)));
            record.color.push(s.color);
            record.alpha.push(s.alpha);
            record.sum.push(s.sum);
            record.transmittance.push(s.transmittance);
        }
        record.stages = stages(&journey.steps);
        record
    }

    /// Works out the gradients, colours by them and light of the recorded fragments a second time.
    pub(super) fn compare(&mut self, journey: &Journey, context: Context<'_>, stack: &Stack) {
        let pixel = (self.x, self.y);
        let ran = |stage: OptionalStage| journey.steps.iter().any(|s| s.around(StageId::Optional(stage)).is_some());
        let steps = || journey.steps.iter();
        if ran(OptionalStage::Gradient) {
            let at = |step: &Step| {
                let [_, seen] = step.around(StageId::Optional(OptionalStage::Gradient))?;
                (seen.sloped && step.after().covered).then(|| GradientAt::new(context, stack, pixel, step.slice, seen))
            };
            self.gradient = steps().map(at).collect();
        }
        let gradient = |i: usize| self.gradient.get(i).and_then(Option::as_ref);
        if let Some(stage) = [OptionalStage::GradientOpacity, OptionalStage::Transfer2d].into_iter().find(|&s| ran(s)) {
            let at = |(i, step): (usize, &Step)| {
                let [before, after] = step.around(StageId::Optional(stage))?.map(|s| [s.color[0], s.color[1], s.color[2], s.alpha]);
                Some(ByGradientAt::new(context, stack, gradient(i)?, before, after, step.after().length))
            };
            self.by_gradient = steps().enumerate().map(at).collect();
        }
        if let Some(light) = context.scene.lighting().filter(|_| ran(OptionalStage::Light)) {
            let at = |(i, step): (usize, &Step)| {
                let [before, after] = step.around(StageId::Optional(OptionalStage::Light))?;
                let [r, g, b] = before.color;
                let before = [r, g, b, before.alpha];
                let lit = Lit { light, context, stack, pixel, slice: step.slice, gradient: gradient(i), before, left: after.color };
                if step.after().covered { lit.shade() } else { None }
            };
            self.light = steps().enumerate().map(at).collect();
        }
    }
}
