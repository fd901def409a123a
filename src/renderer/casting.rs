//! The backend of the algorithms that go ray by ray. Their pictures are finished pixel by pixel: there are no layers of parts of a volume.

use super::finish::OverBackground;
use super::{Drawn, RenderJob, Renderer, slice_count, steps_of};
use crate::casting::{Cast, Caster, Grid, SurfaceRays, slabs};
use crate::plan::{Detail, FramePlan, Subject, method};
use crate::raster::{Observer, Resolve};
use crate::scene::{Algorithm, Blend, OptionalStage, Scene, Slicing};
use crate::tally::LeftOut;
use crate::{Error, Result};
use std::sync::Arc;

impl Renderer {
    /// The job's scene ray by ray, into `pixels`.
    pub(super) fn draw_casting<O: Observer>(&mut self, job: &mut RenderJob<'_, O>, pixels: &mut [[f32; 4]]) -> Result<Drawn> {
        let scene = job.scene;
        scene.check()?;
        let algorithm = scene.algorithm();
        let name = algorithm.name();
        let no = |what: String| Err(Error::invalid(what));
        if O::OBSERVES {
            return no(format!("render algorithm {name}: goes ray by ray, and has no slices to look at; choose slices"));
        }
        if self.settings.estimate {
            return no(format!("estimate: render algorithm {name} has errors of its own; estimate those of slices"));
        }
        if matches!(algorithm, Algorithm::Template(_)) && job.view.perspective {
            return no(format!("camera projection perspective: render algorithm {name} moves one ray, and rays of it are not parallel"));
        }
        let volume = Arc::clone(&self.volume);
        let (cast, slices) = match (algorithm, scene.blend()) {
            (Algorithm::Grid, _) => {
                let grid = Grid::new(scene, &volume, &job.view)?;
                (grid.draw(&OverBackground::new(scene, &method(scene)), self.control(), pixels)?, grid.samples())
            }
            (_, Blend::Iso { .. } | Blend::Surfaces) => {
                let stack = slabs(scene, &volume, &job.view, self.steps(job)?);
                let rays = SurfaceRays::new(scene, &volume, &stack)?;
                (rays.draw(&OverBackground::new(scene, &method(scene)), self.control(), pixels)?, stack.count)
            }
            _ => self.cast(job, pixels)?,
        };
        let tally = cast.counters.tally(1);
        Ok(Drawn {
            slices,
            method: method(scene),
            tally,
            fetches: cast.counters.fetches,
            simd: self.level.name(),
            left_out: left_out(scene, cast.counters.fragments, tally.empty),
            error_estimate: None,
            non_finite: if volume.voxels().voxel_type().is_float() { volume.statistics().non_finite } else { 0 },
            non_finite_become: "transparent",
            warnings: Vec::new(),
            late_warnings: Vec::new(),
        })
    }

    /// Steps along rays that go by a number of them; 1 for others.
    fn steps<O: Observer>(&self, job: &RenderJob<'_, O>) -> Result<u64> {
        match job.scene.slicing() {
            _ if !job.scene.algorithm().has_steps() => Ok(1),
            Slicing::Count(count) => Ok(count),
            Slicing::Spacing(spacing) if job.view.perspective => {
                steps_of(spacing, crate::casting::distances(self.volume.grid(), &job.view))
            }
            Slicing::Spacing(spacing) => slice_count(spacing, job.scene, self.volume.grid(), &job.view),
            Slicing::Tolerance(_) => Err(Error::invalid("slices tolerance: rays have a given number of steps")),
        }
    }

    /// A frame whose samples go through the stages: what was done, and the samples of a ray.
    fn cast<O: Observer>(&mut self, job: &mut RenderJob<'_, O>, pixels: &mut [[f32; 4]]) -> Result<(Cast, u64)> {
        let (scene, volume) = (job.scene, Arc::clone(&self.volume));
        let stack = slabs(scene, &volume, &job.view, self.steps(job)?);
        let lookups = (scene.method().filter, scene.color_opacity(&volume), self.settings.limits.voxel_bytes);
        let data = self.cache.volume_data(&volume, lookups, None, &mut job.clock)?;
        crate::lean::check(scene, data.bricks.non_finite)?;
        let subject = Subject {
            scene,
            volume: &volume,
            data: &data,
            stack,
            terminate: scene.terminate(),
            detail: Detail::Usual,
            level: self.level,
            observed: false,
            domain: None,
        };
        let plan = FramePlan::new(subject, &mut self.cache.keeper(&volume, &data, &mut job.clock));
        let resolve = Resolve::new(scene, &plan);
        let finish = OverBackground::new(scene, &plan.needs.method);
        let cast = Caster::new(scene, &plan, &resolve).draw(&finish, self.control(), pixels)?;
        let stepped = matches!(scene.algorithm(), Algorithm::Rays | Algorithm::CoinFlips { .. });
        Ok((cast, if stepped || cast.most == 0 { plan.stack.count } else { cast.most }))
    }
}

/// What a scene did without: stages that it does not ask for, and samples near which nothing shows.
fn left_out(scene: &Scene, samples: u64, empty: u64) -> Vec<LeftOut> {
    let absent = OptionalStage::ALL.into_iter().filter(|stage| !(stage.option().wanted)(scene));
    let mut list: Vec<LeftOut> = absent.map(|stage| LeftOut::uncounted(stage.info().name, stage.option().absent)).collect();
    if empty > 0 {
        list.push(LeftOut::counted("empty samples", "nothing shows of the values in their bricks", (empty, samples), "samples"));
    }
    list
}
