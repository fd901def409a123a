//! The stages of a frame one by one, for benches and for looking at their machine code. No part of the library's interface.

use crate::fragment::{BEHIND, Batch, Frame, Stage};
use crate::plan::FramePlan;
use crate::raster::Observer;
use crate::scene::StageId;
use crate::{Error, Renderer, Result, Scene};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Batches kept for each stage.
const KEPT: usize = 16;
/// One batch in so many is kept, so that they come from many places.
const EVERY: u64 = 29;

/// A stage and batches as a frame brought them to it.
pub struct StageRun<'r> {
    stage: Stage<'r>,
    everywhere: bool,
    frame: Rc<Frame<'r>>,
    inputs: Vec<Box<Batch>>,
    batch: Box<Batch>,
}

impl StageRun<'_> {
    /// Its name in the plan.
    pub fn name(&self) -> &'static str {
        self.stage.id.name()
    }

    /// Whether every batch goes through it; else those at the box's faces alone.
    pub fn is_everywhere(&self) -> bool {
        self.everywhere
    }

    /// Fragments that one [`StageRun::run`] takes through the stage.
    pub fn fragments(&self) -> u64 {
        64 * self.inputs.len() as u64
    }

    /// Takes each batch through the stage.
    pub fn run(&mut self) {
        for input in &self.inputs {
            self.batch.clone_from(input);
            (self.stage.run)(&self.frame, &mut self.batch);
            std::hint::black_box(&mut self.batch);
        }
    }

    /// What [`StageRun::run`] does besides the stage: to be taken off its time.
    pub fn copy(&mut self) {
        for input in &self.inputs {
            self.batch.clone_from(input);
            std::hint::black_box(&mut self.batch);
        }
    }
}

impl std::fmt::Debug for StageRun<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StageRun").field("stage", &self.stage.id.name()).field("batches", &self.inputs.len()).finish_non_exhaustive()
    }
}

/// The stages that batches of `scene` go through, in their order, with batches recorded before each of them.
///
/// # Errors
/// As [`Renderer::render`]; [`Error::Invalid`] for a scene whose slices are not counted.
pub fn stages<'r>(renderer: &'r mut Renderer, scene: &Scene) -> Result<Vec<StageRun<'r>>> {
    let (_, _, mut seen) = renderer.render_observed(scene, Recorder::default())?;
    let FramePlan { frame, stages, .. } = plan(renderer, scene)?;
    let frame = Rc::new(frame);
    let mut list: Vec<StageRun<'r>> = Vec::new();
    let always: Vec<StageId> = [stages.span].iter().chain(&stages.whole).map(|s| s.id).collect();
    for stage in [stages.span].into_iter().chain(stages.partial).chain(stages.whole) {
        if let Some(inputs) = seen.inputs.remove(&stage.id) {
            let everywhere = always.contains(&stage.id);
            list.push(StageRun {
                stage,
                everywhere,
                frame: frame.clone(),
                inputs,
                batch: Batch::new(frame.optional.gradient.is_some(), frame.surfaces.is_some()),
            });
        }
    }
    Ok(list)
}

/// Name and address of every stage in the plan of `scene`, those between its slices included.
///
/// # Errors
/// As [`stages`].
pub fn addresses(renderer: &mut Renderer, scene: &Scene) -> Result<Vec<(&'static str, usize)>> {
    renderer.render(scene)?;
    let FramePlan { frame, stages, .. } = plan(renderer, scene)?;
    // Where classification runs twice, what runs is this.
    let address = |stage: Stage<'_>| match &frame.pieces {
        Some(pieces) if stage.id == StageId::Classify => pieces.classify as usize,
        _ => stage.run as usize,
    };
    let mut all: Vec<Stage<'_>> = [stages.span].into_iter().chain(stages.partial).chain(stages.whole).collect();
    if let Some(pairs) = stages.pairs {
        all.extend(pairs.keep.into_iter().chain([pairs.fetch]).chain(pairs.exit));
    }
    let mut list: Vec<(&'static str, usize)> = Vec::new();
    for stage in all {
        let found = (stage.id.name(), address(stage));
        if !list.contains(&found) {
            list.push(found);
        }
    }
    Ok(list)
}

fn plan<'r>(renderer: &'r mut Renderer, scene: &Scene) -> Result<FramePlan<'r>> {
    renderer.plan(scene).ok_or_else(|| Error::invalid("stages of a scene whose slices are not counted"))
}

/// Keeps some batches as they come to each stage.
#[derive(Default)]
struct Recorder {
    count: u64,
    /// The batch that is looked at, as the last stage left it.
    last: Option<Box<Batch>>,
    inputs: BTreeMap<StageId, Vec<Box<Batch>>>,
}

impl Observer for Recorder {
    fn fresh(&self) -> Self {
        Self::default()
    }

    fn slice(&mut self, _: &Frame<'_>, batch: &Batch) {
        self.count += 1;
        // Pieces behind the last slices go another way.
        let wanted = self.count % EVERY == 1 && batch.slice != BEHIND;
        self.last = wanted.then(|| Box::new(batch.clone()));
    }

    fn stage(&mut self, id: StageId, _: &Frame<'_>, batch: &Batch) {
        if let Some(before) = self.last.take() {
            let inputs = self.inputs.entry(id).or_default();
            if inputs.len() < KEPT {
                inputs.push(before);
            }
            self.last = Some(Box::new(batch.clone()));
        }
    }

    fn merge(&mut self, other: Self) {
        for (name, more) in other.inputs {
            let inputs = self.inputs.entry(name).or_default();
            // Tiles of the picture's border come first: let later ones have their share.
            let room = KEPT.saturating_sub(inputs.len()).max(KEPT / 2).min(more.len());
            inputs.truncate(KEPT - room);
            inputs.extend(more.into_iter().take(room));
        }
    }
}
