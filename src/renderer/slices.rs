//! The backend of slices: one frame, so many slices of a scene, into pixels.

use super::finish::{AsGathered, AsLayer, OverBackground};
use super::job::{FrameResult, Output, RenderJob};
use super::{Renderer, tile_side};
use crate::Result;
use crate::lanes::SIDE;
use crate::plan::{Detail, FramePlan, Subject};
use crate::proxy::{Domain, Stack};
use crate::raster::{BlockMask, Finish, Job, Observer, Resolve, Work, render_tiles};
use crate::scene::{Scene, Slicing};
use crate::tally::Counters;
use std::sync::Arc;

/// Least side of a tile where some of a picture's blocks are rendered.
const MASKED: u32 = 64;

/// What a frame is to hold.
#[derive(Debug, Clone)]
pub(super) struct Request<'r> {
    pub(super) stack: Stack,
    /// Transmittance at which pixels end.
    pub(super) terminate: f32,
    /// How fine tables may be.
    pub(super) detail: Detail,
    /// Blocks of the picture, all of them without a mask.
    pub(super) blocks: Option<&'r BlockMask>,
    /// Where the volume is a part of a larger one: which.
    pub(super) domain: Option<&'r Domain>,
}

impl Renderer {
    /// Fills `pixels` with the scene in `count` slices, pixels ending at transmittance `terminate`; with a mask, its blocks alone.
    pub(super) fn frame<O: Observer>(
        &mut self,
        job: &mut RenderJob<'_, O>,
        count: u64,
        terminate: f32,
        blocks: Option<&BlockMask>,
        pixels: &mut [[f32; 4]],
    ) -> Result<FrameResult> {
        self.detailed(job, (count, terminate, Detail::Usual), blocks, pixels)
    }

    /// As [`Renderer::frame`], with tables of a `detail`.
    pub(super) fn detailed<O: Observer>(
        &mut self,
        job: &mut RenderJob<'_, O>,
        (count, terminate, detail): (u64, f32, Detail),
        blocks: Option<&BlockMask>,
        pixels: &mut [[f32; 4]],
    ) -> Result<FrameResult> {
        let stack = Stack::new(self.volume.grid(), &job.view, job.scene.clip_planes(), count);
        self.requested(job, Request { stack, terminate, detail, blocks, domain: None }, pixels)
    }

    /// Fills `pixels` with what `request` asks for.
    pub(super) fn requested<O: Observer>(
        &mut self,
        job: &mut RenderJob<'_, O>,
        request: Request<'_>,
        pixels: &mut [[f32; 4]],
    ) -> Result<FrameResult> {
        let (scene, volume) = (job.scene, Arc::clone(&self.volume));
        let Request { stack, terminate, detail, blocks, domain } = request;
        let lookups = (scene.method().filter, scene.color_opacity(&volume), self.settings.limits.voxel_bytes);
        let data = self.cache.volume_data(&volume, lookups, domain, &mut job.clock)?;
        crate::lean::check(scene, data.bricks.non_finite)?;
        scene.check_labels(&volume)?;
        let (level, observed) = (self.level, O::OBSERVES);
        let subject = Subject { scene, volume: &volume, data: &data, stack, terminate, detail, level, observed, domain };
        let plan = FramePlan::new(subject, &mut self.cache.keeper(&volume, &data, &mut job.clock));
        let planned = plan.left_out.clone();
        let counters = match job.output {
            Output::Picture => self.execute(job, &plan, blocks, &OverBackground::new(scene, &plan.needs.method), pixels)?,
            Output::Layer => self.execute(job, &plan, blocks, &AsLayer, pixels)?,
            Output::Gathered => self.execute(job, &plan, blocks, &AsGathered { nothing: plan.start }, pixels)?,
        };
        let (visible_share, peaks) = (plan.visible_share, plan.peaks.is_some());
        let scaling = &plan.data.scaling;
        let numbers = [scaling.scale, scaling.offset, f64::from(plan.frame.color.low)];
        Ok(FrameResult { counters, frames: 1, slices: plan.stack.count, planned, method: scene.method(), visible_share, peaks, numbers })
    }

    /// Executes `plan`.
    fn execute<O: Observer>(
        &self,
        job: &mut RenderJob<'_, O>,
        plan: &FramePlan<'_>,
        blocks: Option<&BlockMask>,
        finish: &impl Finish,
        pixels: &mut [[f32; 4]],
    ) -> Result<Counters> {
        if plan.stack.is_empty() {
            pixels.fill(finish.nothing());
            return Ok(Counters::default());
        }
        let side = self.settings.tile.unwrap_or_else(|| tile_side(plan.stack.view.width, plan.stack.view.height));
        // Of some blocks a few large tiles: cutting the picture up must not take longer than rendering them.
        let side = if blocks.is_some() && self.settings.tile.is_none() { side.max(MASKED) } else { side };
        // What becomes one depends on all of a block's pixels: no tile may cut one.
        let side = if plan.needs.merge { side.next_multiple_of(SIDE as u32) } else { side };
        let resolve = Resolve::new(job.scene, plan);
        let resolve = if job.output == Output::Gathered { resolve.gathered() } else { resolve };
        let tiles = Job { resolve: &resolve, finish, side, blocks, control: self.control(), observer: &job.observer };
        let (counters, seen) = render_tiles(&Work::new(plan), &tiles, pixels)?;
        job.observer.merge(seen);
        Ok(counters)
    }

    /// The plan of a frame of `scene`, which has to count its slices, as an observer sees it.
    pub(crate) fn plan(&mut self, scene: &Scene) -> Option<FramePlan<'_>> {
        let Slicing::Count(count) = scene.slicing() else { return None };
        let (width, height) = scene.size();
        let view = scene.camera().resolve(self.volume.grid(), width, height).ok()?;
        let stack = Stack::new(self.volume.grid(), &view, scene.clip_planes(), count);
        scene.check_labels(&self.volume).ok()?;
        let mut clock = super::job::Clock::default();
        let lookups = (scene.method().filter, scene.color_opacity(&self.volume), self.settings.limits.voxel_bytes);
        self.cache.volume_data(&self.volume, lookups, None, &mut clock).ok()?;
        let (data, kept) = self.cache.kept();
        let data = data?;
        let subject = Subject {
            scene,
            volume: &self.volume,
            data,
            stack,
            terminate: scene.terminate(),
            detail: Detail::Usual,
            level: self.level,
            observed: true,
            domain: None,
        };
        let mut keeper = super::cache::Keeper { kept, volume: &self.volume, data, clock: &mut clock };
        Some(FramePlan::new(subject, &mut keeper))
    }
}
