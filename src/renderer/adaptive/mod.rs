//! Ways to a picture that take more than one frame: extrapolation, an error estimated, an error asked for.

mod few;
mod many;
pub(crate) mod search;

use super::Renderer;
use super::finish::OverBackground;
use super::job::{FrameResult, RenderJob};
use crate::plan::{Detail, Planned, Saving};
use crate::proxy::Stack;
use crate::raster::{BlockMask, Finish, Observer};
use crate::scene::{Blend, Classification, Fits, MAX_SLICES, Method, OptionalStage, Scene};
use crate::{Error, Result};
use search::{Ask, Goal};

impl Renderer {
    /// `pixels` in `count` slices as the scene's method says; and the RMS error of red, green and blue, where settings ask for it.
    pub(super) fn in_slices<W: Observer>(
        &mut self,
        job: &mut RenderJob<'_, W>,
        count: u64,
        pixels: &mut [[f32; 4]],
    ) -> Result<(FrameResult, Option<f64>)> {
        let method = crate::plan::method(job.scene);
        let terminate = job.scene.terminate();
        let finer = |count: u64| {
            (2 * count <= MAX_SLICES).then_some(2 * count).ok_or(Error::Limit {
                what: format!("twice {count} slices, for extrapolation or an estimate"),
                needed: u128::from(2 * count),
                limit: u128::from(MAX_SLICES),
            })
        };
        let mut done = self.frame(job, count, terminate, None, pixels)?;
        if method.extrapolate {
            let before = pixels.to_vec();
            let mut coarse = before.clone();
            done.add(&self.frame(job, finer(count)?, terminate, None, pixels)?);
            extrapolate(&mut coarse, pixels, crate::plan::order(job.scene), super::finish::is_bounded(job.scene, &method));
            // On real data the series is not smooth, and what is extrapolated may be no better than the pictures it came from.
            let error = self.settings.estimate.then(|| rms(&before, pixels));
            pixels.copy_from_slice(&coarse);
            return Ok((done, error));
        }
        if !self.settings.estimate {
            return Ok((done, None));
        }
        let mut fine = pixels.to_vec();
        // Ending pixels early is an error too.
        done.cost(&self.frame(job, finer(count)?, terminate * LATER, None, &mut fine)?);
        Ok((done, Some(rms(pixels, &fine) * share(crate::plan::order(job.scene)))))
    }

    /// `pixels` to `tolerance`, each block in as many slices as it needs; and the error estimated.
    ///
    /// Where the scene leaves the method open, slabs of second order are tried on some blocks.
    pub(super) fn reach<W: Observer>(
        &mut self,
        job: &mut RenderJob<'_, W>,
        tolerance: f64,
        pixels: &mut [[f32; 4]],
    ) -> Result<(FrameResult, f64)> {
        let second = Method { classification: Classification::SecondOrder, ..job.scene.method() };
        // Light and opacity by gradient are taken at one sample a slab, which leaves slabs between two values of the first order.
        // Colours have no values that slabs could lie between.
        let colors = self.volume.colors().is_some();
        let pairs = OptionalStage::wanted(job.scene).all(|stage| stage.option().pairs == Fits::Yes);
        let free =
            job.scene.method() == Method::default() && job.scene.blend() == Blend::Over && !job.scene.needs_gradient() && !colors && pairs;
        // And there are no such slabs between shells, beside opaque planes, and so on.
        let free = free && job.scene.clone().with_method(second).is_ok();
        // What an error is asked for, slabs may become one wherever the method lets them.
        let method = Method { merge: true, ..job.scene.method() };
        let merging = job.scene.clone().with_method(method).ok().filter(|s| crate::plan::method(s).merge && !colors);
        if let Some(found) = self.in_stead(job, merging.as_ref(), |r, job| r.refined(job, tolerance, pixels, free.then_some(second)))? {
            return Ok(found);
        }
        let scene = job.scene.clone().with_method(second)?;
        let found = self.in_stead(job, Some(&scene), |r, job| r.refined(job, tolerance, pixels, None));
        let (mut done, error) = found?.ok_or_else(|| Error::invalid("a picture without a frame"))?;
        done.planned.push(Planned::new(
            "midpoint slabs",
            "pre-integrated ones of second order leave much smaller differences here",
            Saving::Unknown,
        ));
        Ok((done, error))
    }

    /// Does `work` with another scene in the place of the job's own, where there is one.
    fn in_stead<W: Observer, R>(
        &mut self,
        job: &mut RenderJob<'_, W>,
        scene: Option<&Scene>,
        work: impl FnOnce(&mut Self, &mut RenderJob<'_, W>) -> R,
    ) -> R {
        let scene = scene.unwrap_or(job.scene);
        let mut other =
            RenderJob { scene, view: job.view, clock: std::mem::take(&mut job.clock), observer: job.observer.fresh(), output: job.output };
        let result = work(self, &mut other);
        job.clock = other.clock;
        job.observer.merge(other.observer);
        result
    }

    /// `pixels` by the scene's method; `None` when `other` is worth beginning again for.
    fn refined<W: Observer>(
        &mut self,
        job: &mut RenderJob<'_, W>,
        tolerance: f64,
        pixels: &mut [[f32; 4]],
        other: Option<Method>,
    ) -> Result<Option<(FrameResult, f64)>> {
        let grid = self.volume.grid();
        let depth = Stack::depth_range(grid, &job.view).map_or(0.0, |(near, far)| far - near);
        let terminate = search::terminate(job.scene.terminate(), tolerance);
        let size = (job.view.width as usize, job.view.height as usize);
        // Values that are projected are no sums over slabs: their errors fall with the slices' number at best.
        let values = !job.scene.blend().blends_colors();
        let first_order = values || crate::plan::order(job.scene) == 1;
        let goal = Goal { tolerance, size, first: search::first_count(depth, grid.smallest_spacing()), first_order };
        let nothing = OverBackground::new(job.scene, &crate::plan::method(job.scene)).nothing();
        let mut scratch = std::mem::take(&mut self.scratch);
        let parts = std::cell::RefCell::new((self, job));
        // Frames that make up the picture, and others.
        let (mut done, besides) = (None::<FrameResult>, std::cell::RefCell::new(None::<FrameResult>));
        let cost = |part: FrameResult| match &mut *besides.borrow_mut() {
            Some(all) => all.cost(&part),
            none => *none = Some(part),
        };
        let mut frames = |ask: Ask<'_>, pixels: &mut [[f32; 4]]| {
            let (renderer, job) = &mut *parts.borrow_mut();
            let terminate = if ask.judge { terminate * LATER } else { terminate };
            let detail = if ask.judge { Detail::Finer } else { Detail::Usual };
            if ask.kept {
                let part = renderer.detailed(job, (ask.count, terminate, detail), ask.blocks, pixels)?;
                match &mut done {
                    Some(done) => done.add(&part),
                    None => done = Some(part),
                }
                return Ok(());
            }
            let clock = std::mem::take(&mut job.clock);
            let mut beside = RenderJob { scene: job.scene, view: job.view, clock, observer: (), output: job.output };
            let part = renderer.detailed(&mut beside, (ask.count, terminate, detail), ask.blocks, pixels);
            job.clock = beside.clock;
            cost(part?);
            Ok(())
        };
        let tried = std::cell::Cell::new(false);
        let mut worth = |count: u64, blocks: &BlockMask| {
            let Some(method) = other else { return Ok(None) };
            tried.set(true);
            let (renderer, job) = &mut *parts.borrow_mut();
            let scene = job.scene.clone().with_method(method)?;
            let mut fine = vec![[0.0; 4]; size.0 * size.1];
            let mut coarse = fine.clone();
            let mut trial =
                RenderJob { scene: &scene, view: job.view, clock: std::mem::take(&mut job.clock), observer: (), output: job.output };
            let frames = renderer
                .frame(&mut trial, count / 2, terminate, Some(blocks), &mut coarse)
                .and_then(|a| Ok([a, renderer.frame(&mut trial, count, terminate, Some(blocks), &mut fine)?]));
            job.clock = trial.clock;
            frames?.into_iter().for_each(&cost);
            Ok(Some(search::squared(&coarse, &fine)))
        };
        let blocks = BlockMask::none(size.0, size.1).len();
        let reached = if blocks <= FEW {
            few::few(goal, blocks, pixels, &mut frames, &mut worth)?
        } else {
            scratch.resize(pixels.len(), [0.0; 4]);
            many::many(goal, nothing, (pixels, &mut scratch), &mut frames, &mut worth)?
        };
        parts.into_inner().0.scratch = scratch;
        let Some((mut done, reached)) = done.zip(reached) else { return Ok(None) };
        besides.into_inner().iter().for_each(|b| done.cost(b));
        if tried.into_inner() {
            let why = "tried on some blocks: their differences are not so much smaller that they pay";
            done.planned.push(Planned::new("pre-integrated slabs of second order", why, Saving::Unknown));
        }
        let all: usize = reached.levels.iter().map(|l| l.1).sum();
        let levels: Vec<String> = reached.levels.iter().map(|(slices, blocks)| format!("{blocks} in {slices}")).collect();
        let why = match reached.levels.as_slice() {
            [(slices, _)] => format!("{slices} do, as pictures of more of them tell"),
            _ => format!("of {all} blocks: {} slices", levels.join(", ")),
        };
        done.planned.push(Planned::new("more slices than blocks need", why, Saving::Unknown));
        Ok(Some((done, reached.error)))
    }
}

/// Blocks of a picture up to which whole pictures are compared.
const FEW: usize = 640;
/// Transmittance at which pixels of an estimate's second picture end, as a share of the picture's own.
const LATER: f32 = 1.0 / 64.0;

/// Error of N slices over their difference to 2 N, when the error falls with order p: 2^p / (2^p - 1).
fn share(order: u32) -> f64 {
    let power = f64::from(1u32 << order);
    power / (power - 1.0)
}

/// Turns `coarse` into what a series of pictures leads to (Richardson 1911): fine + (fine - coarse) / (2^p - 1), within [0,1].
fn extrapolate(coarse: &mut [[f32; 4]], fine: &[[f32; 4]], order: u32, bounded: bool) {
    let rest = 1.0 / (f64::from(1u32 << order) - 1.0);
    for (coarse, fine) in coarse.iter_mut().zip(fine) {
        for (c, &f) in coarse.iter_mut().zip(fine) {
            let f = f64::from(f);
            *c = (f + (f - f64::from(*c)) * rest).clamp(0.0, 1.0) as f32;
        }
        if bounded {
            // Colours and opacity are extrapolated each on its own, and have to fit together again.
            let [colors @ .., alpha] = coarse;
            colors.iter_mut().for_each(|c| *c = c.min(*alpha));
        }
    }
}

/// Root of the mean squared difference of red, green and blue.
fn rms(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let sum: f64 = a.iter().zip(b).flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c]) - f64::from(b[c]))).map(|d| d * d).sum();
    (sum / (3 * a.len()).max(1) as f64).sqrt()
}
