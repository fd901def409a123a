//! The recorder: an observer that copies down what every stage did to chosen pixels.

use crate::fragment::{BEHIND, Batch, Frame, index_of};
use crate::lanes::{BATCH, SIDE, ToF32};
use crate::proxy::Stack;
use crate::raster::Observer;
use crate::scene::StageId;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// What to record.
#[derive(Debug)]
pub(super) struct Wanted {
    /// Lanes to record, with the pixel's place in the list they came from, by the first pixel of their block.
    blocks: BTreeMap<(u32, u32), Vec<(usize, usize)>>,
    /// Slices to record step by step.
    slices: Range<i64>,
    /// Whether they reach to the end of the stack, and what lies behind it is recorded too.
    whole: bool,
}

impl Wanted {
    /// Pixels (x,y) and slices to record, of `count`.
    pub(super) fn new(pixels: &[(u32, u32)], slices: Range<u64>, count: u64) -> Self {
        let whole = slices.end == count;
        let mut blocks: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (at, &(x, y)) in pixels.iter().enumerate() {
            let side = SIDE as u32;
            let lane = (y % side * side + x % side) as usize;
            blocks.entry((x / side * side, y / side * side)).or_default().push((lane, at));
        }
        Self { blocks, slices: slices.start as i64..slices.end as i64, whole }
    }

    fn takes(&self, slice: i64) -> bool {
        slice >= self.slices.start && (slice < self.slices.end || self.whole)
    }
}

/// How offsets of a frame's batches name voxels.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// Whether they are in `far_offset`.
    far: bool,
    /// From one voxel to the next along x, y and z, in the unit of offsets: packed voxels have gaps behind rows and layers. 0 along axes of
    /// one voxel.
    strides: [usize; 3],
    /// Size of a gradient of 1 in the batch's numbers, data units per world unit.
    gradient_unit: f32,
}

impl Place {
    fn of(frame: &Frame<'_>) -> Self {
        let gradient_unit = frame.optional.gradient.as_ref().map_or(0.0, |g| g.unit as f32);
        Self { far: frame.sample.far, strides: frame.sample.strides, gradient_unit }
    }

    /// The voxel at offset `at`.
    fn voxel(self, at: u64) -> [u64; 3] {
        index_of(at as usize, self.strides).map(|n| n as u64)
    }
}

/// One fragment's numbers, and its pixel's, at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Snapshot {
    pub(super) covered: bool,
    /// Length of the piece of the ray, in slabs.
    pub(super) length: f32,
    /// Index of the cell's lowest voxel along x, y and z.
    pub(super) cell: [u64; 3],
    pub(super) weight: [f32; 3],
    /// The number looked up.
    pub(super) value: f32,
    /// Direction against the gradient, and the gradient's size in data units per world unit.
    pub(super) normal: [f32; 3],
    pub(super) steepness: f32,
    /// Whether its gradient was taken.
    pub(super) sloped: bool,
    /// Premultiplied colour and opacity of the slab.
    pub(super) color: [f32; 3],
    pub(super) alpha: f32,
    /// What the pixel has gathered, and the transmittance left to it.
    pub(super) sum: [f32; 3],
    pub(super) transmittance: f32,
}

impl Snapshot {
    fn of(batch: &Batch, place: Place, i: usize) -> Self {
        let gradient = batch.gradient.as_deref().filter(|g| g.lanes >> i & 1 == 1);
        let offset = if place.far { batch.rare.far_offset[i] } else { batch.sample.offset[i] as u64 };
        Self {
            covered: batch.mask >> i & 1 == 1,
            length: batch.slab.length[i],
            cell: place.voxel((batch.geometry.cells.base as u64).wrapping_add(offset)),
            weight: [0, 1, 2].map(|axis: usize| batch.sample.weight[axis][i]),
            value: batch.numbers.as_deref().unwrap_or(&batch.sample.value)[i],
            normal: gradient.map_or([0.0; 3], |g| [g.normal[0][i], g.normal[1][i], g.normal[2][i]]),
            steepness: gradient.map_or(0.0, |g| g.size[i] * place.gradient_unit),
            sloped: gradient.is_some(),
            color: [0, 1, 2].map(|c: usize| batch.slab.color[c][i]),
            alpha: batch.slab.alpha[i],
            sum: [0, 1, 2].map(|c: usize| batch.pixels.color[c][i]),
            transmittance: batch.pixels.transmittance[i],
        }
    }
}

/// The value found before the one at hand.
fn front(batch: &Batch, i: usize) -> f32 {
    if batch.slice == batch.pixels.first[i] { batch.pixels.entry[i] } else { batch.pixels.previous[0][i] }
}

/// A slice on a pixel's way.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) slice: u64,
    /// Depth of the plane as the stages have it.
    pub(super) depth: f32,
    /// Fog factor of the whole slice, where fog is planar.
    pub(super) fog: f32,
    /// Covered fragments of the block.
    pub(super) mask: u64,
    /// The value at the slab's near side, for slabs between two values.
    pub(super) front: f32,
    /// Before any stage.
    pub(super) before: Snapshot,
    /// After each stage, in order.
    pub(super) stages: Vec<(StageId, Snapshot)>,
}

impl Step {
    /// What the pixel had gathered before: colour, transmittance.
    pub(super) fn gathered_before(&self) -> [f32; 4] {
        let [r, g, b] = self.before.sum;
        [r, g, b, self.before.transmittance]
    }

    /// Before and after stage `id`; nothing where it did not run.
    pub(super) fn around(&self, id: StageId) -> Option<[&Snapshot; 2]> {
        let at = self.stages.iter().position(|(stage, _)| *stage == id)?;
        let before = if at == 0 { &self.before } else { &self.stages[at - 1].1 };
        Some([before, &self.stages[at].1])
    }

    /// After the last stage.
    pub(super) fn after(&self) -> &Snapshot {
        self.stages.last().map_or(&self.before, |(_, s)| s)
    }
}

/// A run of slices that was passed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Skipped {
    pub(super) from: u64,
    pub(super) to: u64,
    /// Every pixel of the block was done; else nothing in these slices shows.
    pub(super) finished: bool,
}

/// A pixel's way through the stack.
#[derive(Debug, Clone)]
pub(super) struct Journey {
    /// Which of the wanted pixels.
    at: usize,
    lane: usize,
    /// First and last slice that covers it.
    pub(super) span: Option<(u64, u64)>,
    /// Lengths of the first and the last piece of its ray, in slabs along the depth.
    pub(super) ends: [f32; 2],
    /// Length of the ray per unit of depth.
    pub(super) slant: f32,
    /// Squared distance from the picture's middle, for radial fog of parallel rays.
    pub(super) plane_squared: f32,
    /// What it starts from: colour, transmittance.
    pub(super) start: [f32; 4],
    /// Recorded slices in the order they were blended.
    pub(super) steps: Vec<Step>,
    pub(super) skipped: Vec<Skipped>,
    /// What it has gathered in the end.
    pub(super) gathered: [f32; 4],
    /// What rounding has added to the transmittance, where sums are compensated.
    pub(super) excess: f32,
    /// The sum over k of C_k prod_{j<k} (1 - A_j), and that product over all, in f64: nearest slice first.
    pub(super) closed: [f64; 4],
}

/// Records pixels.
#[derive(Debug)]
pub(super) struct Recorder {
    wanted: Arc<Wanted>,
    /// By place in the list of wanted pixels.
    pub(super) journeys: BTreeMap<usize, Journey>,
    /// How stored values become numbers.
    pub(super) to_f32: Option<ToF32>,
    current: Vec<Journey>,
    /// The slice that has begun.
    slice: Option<i64>,
    /// Planes of the stack at hand.
    count: u64,
    /// How offsets name voxels.
    place: Place,
}

impl Recorder {
    pub(super) fn new(wanted: Arc<Wanted>) -> Self {
        Self { wanted, journeys: BTreeMap::new(), to_f32: None, current: Vec::new(), slice: None, count: 0, place: Place::default() }
    }

    /// Ends the slice at hand: its fragment enters the closed sum.
    fn settle(&mut self, batch: &Batch) {
        if self.slice.take().is_none() {
            return;
        }
        for journey in &mut self.current {
            let s = Snapshot::of(batch, self.place, journey.lane);
            if s.covered {
                for c in 0..3 {
                    journey.closed[c] += journey.closed[3] * f64::from(s.color[c]);
                }
                journey.closed[3] *= 1.0 - f64::from(s.alpha);
            }
        }
    }
}

impl Observer for Recorder {
    fn fresh(&self) -> Self {
        Self::new(Arc::clone(&self.wanted))
    }

    fn wants(&self, x: u32, y: u32) -> bool {
        self.wanted.blocks.contains_key(&(x, y))
    }

    fn block(&mut self, stack: &Stack, x: u32, y: u32, batch: &Batch) {
        self.slice = None;
        self.count = stack.count;
        let lanes = self.wanted.blocks.get(&(x, y)).map_or(&[][..], Vec::as_slice);
        let p = &batch.pixels;
        let journey = |&(i, at): &(usize, usize)| {
            let start = [p.color[0][i], p.color[1][i], p.color[2][i], p.transmittance[i]];
            Journey {
                at,
                lane: i,
                span: (p.first[i] <= p.last[i]).then_some((p.first[i] as u64, p.last[i] as u64)),
                ends: [p.first_length[i], p.last_length[i]],
                slant: p.slant[i],
                plane_squared: p.plane_squared[i],
                start,
                steps: Vec::new(),
                skipped: Vec::new(),
                gathered: start,
                excess: 0.0,
                closed: [0.0, 0.0, 0.0, 1.0],
            }
        };
        self.current = lanes.iter().map(journey).collect();
    }

    fn slice(&mut self, frame: &Frame<'_>, batch: &Batch) {
        self.settle(batch);
        // Pieces behind the last slice come as a slice behind all of them.
        let behind = batch.slice == BEHIND;
        let slice = if behind { self.count as i64 } else { i64::from(batch.slice) };
        self.slice = Some(slice);
        self.to_f32 = frame.sample.to_f32;
        self.place = Place::of(frame);
        if !self.wanted.takes(slice) {
            return;
        }
        for journey in &mut self.current {
            journey.steps.push(Step {
                slice: slice as u64,
                depth: batch.depth,
                fog: batch.fog.slice,
                mask: 0,
                front: front(batch, journey.lane),
                before: Snapshot::of(batch, self.place, journey.lane),
                stages: Vec::new(),
            });
        }
    }

    fn stage(&mut self, id: StageId, _: &Frame<'_>, batch: &Batch) {
        if !self.slice.is_some_and(|k| self.wanted.takes(k)) {
            return;
        }
        let place = self.place;
        for journey in &mut self.current {
            if let Some(step) = journey.steps.last_mut() {
                step.mask = batch.mask;
                if id == StageId::Fetch {
                    step.front = front(batch, journey.lane);
                }
                step.stages.push((id, Snapshot::of(batch, place, journey.lane)));
            }
        }
    }

    fn skipped(&mut self, from: i64, to: i64, finished: bool) {
        for journey in &mut self.current {
            journey.skipped.push(Skipped { from: from as u64, to: to as u64, finished });
        }
    }

    fn done(&mut self, batch: &Batch) {
        self.settle(batch);
        let p = &batch.pixels;
        for mut journey in self.current.drain(..) {
            let i = journey.lane;
            journey.gathered = [p.color[0][i], p.color[1][i], p.color[2][i], p.transmittance[i]];
            journey.excess = p.excess[3][i];
            self.journeys.insert(journey.at, journey);
        }
    }

    fn merge(&mut self, other: Self) {
        self.journeys.extend(other.journeys);
        self.to_f32 = self.to_f32.or(other.to_f32);
    }
}

/// Most fragments a block can have on a slice; masks are written in hex.
pub(super) const WHOLE: u64 = u64::MAX >> (64 - BATCH);
