//! Pictures of volumes that memory does not hold: of a file's voxels those are read that the picture needs, as fine as it needs them.
//!
//! ```text
//!   picture --regions of 64 x 64 pixels--> slices, as many at a time as touch a box of bounded size, of one level of detail
//!                                             |
//!              Levels --bricks--> Pages --box of voxels--> Piece: a small volume --plan, stages--> the region's pixels go on
//!                                 (latest used, within a limit)
//! ```
//!
//! A part of the picture and a few slices make a piece of the view: what lies in it fits into a box of voxels ([`frame`](self)), which is put
//! together from bricks and rendered as a volume of its own by the plan, the tables and the stages of every other picture. Its pixels keep
//! what they have gathered and go on with the next piece (`raster/resume.rs`), so that no slab is cut and no sum is made twice.
//!
//! - **Which level.** The one whose voxels are nearest to a pixel in size at the slice's depth, or one a number of levels finer. The number
//!   grows until the picture is as near to one of two levels finer as the scene's tolerance asks (1/256 where it gives none): some blocks
//!   judge, drawn where the picture is rough ([`PageStats::level_error`]).
//! - **How many slices.** As the scene says. To a tolerance, the blocks that judge have four times as many, and what is worse, levels or
//!   slices, is refined.
//! - **What is not read.** Bricks behind pixels that let no more light through; boxes of whose bricks the range of values is known, from
//!   an earlier read or from the file, where nothing in it shows.
//! - **The same bytes.** How the view is cut depends on scene and volume alone, each piece is rendered by one thread, pieces of a region
//!   follow each other by depth. The limit decides what is kept, hence how often a brick is read, and nothing else.
//!
//! A picture of the finest level equals that of [`Renderer`](crate::Renderer) up to rounding: the same samples, from a box whose coordinates
//! begin elsewhere, through tables that may begin at other values.

mod frame;
mod judge;
mod pages;
mod run;
mod sight;
mod tables;
#[cfg(test)]
mod tests;

use crate::lanes::Level as Vectors;
use crate::picture::Picture;
use crate::plan::{Detail, Planned, passed_over};
use crate::proxy::Stack;
use crate::raster::Finish;
use crate::renderer::{OverBackground, RenderStats, adaptive, canvas, slice_count};
use crate::scene::{Algorithm, Blend, Scene, Slicing, View};
use crate::settings::{Control, Stopper};
use crate::tally::Counters;
use crate::volume::levels::Levels;
use crate::{Error, Result, Settings};
use frame::{Frame, PIECE, PieceCounts};
use judge::{BELOW, Judges};
use pages::Pages;
use run::{Done, put, regions};
use sight::Sight;
use std::time::Instant;
use tables::Tables;

/// The error that levels may leave where the scene asks for none: one of 256 levels.
const USUAL_TOLERANCE: f64 = 1.0 / 256.0;
/// Part of the tolerance aimed at: what judges is a sample.
const AIM: f64 = 0.9;
/// Transmittance at which pixels that judge end, as a share of the picture's own.
const LATER: f32 = 1.0 / 64.0;
/// Bytes for what does not depend on the picture: tables, the program itself.
const BASE: u64 = 24 << 20;
/// Least bytes of bricks that are kept.
const LEAST: u64 = 4 << 20;

/// What a picture took of a volume.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct PageStats {
    /// Most bytes of bricks in memory at a time, and the most that the limit leaves them.
    pub peak_bytes: u64,
    /// See [`PageStats::peak_bytes`].
    pub limit_bytes: u64,
    /// Times that a brick was needed.
    pub bricks_asked: u64,
    /// Times that a brick was read.
    pub bricks_read: u64,
    /// Bytes read for them.
    pub bytes_read: u64,
    /// Pieces rendered of each level, the finest first; those that judge are among them.
    pub pieces: Vec<u64>,
    /// Pieces passed over, because nothing shows in the values of their bricks.
    pub empty_pieces: u64,
    /// Levels by which slices are finer than one voxel a pixel.
    pub finer: usize,
    /// The RMS error of red, green and blue that coarser levels leave, as judged; 0 where every slice is of the finest.
    pub level_error: f64,
}

/// Makes pictures of one volume within a limit of memory. See the module's page.
///
/// ```
/// # fn main() -> slicestack::Result<()> {
/// use slicestack::paged::PagedRenderer;
/// use slicestack::volume::{Levels, phantom::Phantom};
/// use slicestack::{Renderer, Scene, Settings};
///
/// let volume = Phantom::SheppLogan.volume(24)?; // or a mapped file
/// let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(48, 48)?;
/// let mut paged = PagedRenderer::new(Levels::of_volume(&volume)?, Settings::new().threads(1), 64 << 20);
/// let (picture, stats, pages) = paged.render(&scene)?;
/// let (plain, _) = Renderer::new(&volume, Settings::default()).render(&scene)?;
/// assert!(picture.pixels().iter().zip(plain.pixels()).all(|(a, b)| (0..4).all(|c| (a[c] - b[c]).abs() < 1e-5)));
/// assert_eq!(stats.slices, 256);
/// assert!(pages.peak_bytes <= pages.limit_bytes);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct PagedRenderer {
    levels: Levels,
    settings: Settings,
    memory: u64,
    vectors: Vectors,
    stopper: Stopper,
}

/// A picture in the making.
struct Job<'j> {
    scene: &'j Scene,
    view: View,
    pages: Pages<'j>,
    tables: Tables,
    range: (f64, f64),
    most: usize,
    counters: Counters,
    counts: PieceCounts,
    frames: u64,
}

impl PagedRenderer {
    /// A renderer for the volume of `levels` that takes about `memory` bytes at most, the picture among them.
    pub fn new(levels: Levels, settings: Settings, memory: u64) -> Self {
        let vectors = settings.level.unwrap_or_else(Vectors::best);
        Self { levels, settings, memory, vectors, stopper: Stopper::default() }
    }

    /// The volume that it renders.
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    /// Stops its pictures from another thread.
    pub fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    /// One picture of `scene`, what it cost, and what it took of the volume.
    ///
    /// # Errors
    /// [`Error::Invalid`] for what is not rendered in pieces (see [`PagedRenderer::check`]) and where the memory does not do for this
    /// picture; [`Error::Limit`] where a few pixels need more voxels than that; whatever reading says; [`Error::Stopped`].
    pub fn render(&mut self, scene: &Scene) -> Result<(Picture, RenderStats, PageStats)> {
        Self::check(scene)?;
        let pool = self.settings.pool()?;
        let result = pool.install(|| self.render_here(scene));
        if matches!(result, Err(Error::Stopped)) {
            self.stopper.reset();
        }
        result
    }

    /// Whether scenes like `scene` are rendered in pieces: slices through one number a voxel, colours laid over each other.
    ///
    /// # Errors
    /// [`Error::Invalid`] for what is not, one line that says why.
    pub fn check(scene: &Scene) -> Result<()> {
        let refuse = |what: &str| Err(Error::invalid(format!("a volume within a limit of memory: {what}")));
        let method = scene.method();
        if scene.opengl().is_some() {
            return refuse("the profile opengl draws from one texture that holds all of the volume");
        }
        if scene.algorithm() != Algorithm::Slices || scene.jitter().is_some() {
            return refuse("pieces are made of flat slices without jitter; choose the algorithm slices");
        }
        if !matches!(scene.blend(), Blend::Over | Blend::Under) {
            return refuse("levels of detail keep means and not extremes, so the blend is over or under alone");
        }
        if method.filter.is_cubic() {
            return refuse("the filter cubic depends on voxels all around, of which a piece has not all");
        }
        if method.merge || method.extrapolate {
            return refuse("slices merge and extrapolate go by pictures or bricks of the whole");
        }
        if !scene.cuts().is_empty() || scene.uses_labels() || !scene.regions().is_empty() {
            return refuse("cut planes, labels and regions are looked up in the whole");
        }
        Ok(())
    }

    /// See [`PagedRenderer::render`]; on the current thread pool.
    fn render_here(&self, scene: &Scene) -> Result<(Picture, RenderStats, PageStats)> {
        let start = Instant::now();
        let levels = &self.levels;
        let scene = scene.blended();
        let scene = scene.clone().with_opacity_unit(scene.opacity_length(levels.grid()))?;
        let size = scene.size();
        let view = scene.camera().resolve(levels.grid(), size.0, size.1)?;
        let range = self.range(&scene)?;
        scene.check_with(&levels.like())?;
        let limit = self.room(size)?;
        let mut job = Job {
            scene: &scene,
            view,
            pages: Pages::new(levels, limit),
            tables: Tables::default(),
            range,
            most: (limit / (8 * levels.voxel_type().bytes() as u64)).max(PIECE as u64) as usize,
            counters: Counters::default(),
            counts: PieceCounts::default(),
            frames: 0,
        };
        let mut pixels = canvas(size.0, size.1)?;
        let made = self.search(&mut job, &mut pixels)?;
        let Job { pages, counters, counts, frames, .. } = job;
        let tally = counters.tally(frames);
        let mut left_out: Vec<_> = made.planned.into_iter().map(|p| p.counted(&counters)).collect();
        left_out.extend(passed_over(&tally, None, false));
        let mut warnings = Vec::new();
        if let (Some(error), Some(tolerance)) = (made.error, made.tolerance) {
            if error > tolerance {
                warnings.push(format!(
                    "tolerance {tolerance} is out of reach: the finest level in {} slices leaves an estimated error of {error:.2e}",
                    made.count
                ));
            }
        }
        if tally.fragments + tally.corners == 0 {
            warnings.push("no ray through a pixel meets what camera and clip planes leave of the box: the picture is empty".to_owned());
        }
        let seen = pages.counts();
        let stats = RenderStats {
            prepare_seconds: 0.0,
            render_seconds: start.elapsed().as_secs_f64(),
            slices: made.count,
            method: crate::plan::method(&scene),
            fragments: tally.fragments,
            fetches: counters.fetches,
            threads: rayon::current_num_threads(),
            simd: self.vectors.name(),
            tally,
            left_out,
            error_estimate: made.error,
            non_finite_voxels: 0,
            warnings,
        };
        let page_stats = PageStats {
            peak_bytes: seen.peak,
            limit_bytes: limit,
            bricks_asked: seen.asked,
            bricks_read: seen.read,
            bytes_read: seen.bytes_read,
            pieces: counts.pieces,
            empty_pieces: counts.empty,
            finer: made.finer,
            level_error: made.level_error,
        };
        Ok((Picture::new(size.0, size.1, pixels), stats, page_stats))
    }

    /// Bytes that are left for bricks.
    fn room(&self, (width, height): (u32, u32)) -> Result<u64> {
        let threads = rayon::current_num_threads() as u64;
        let each = self.levels.voxel_type().bytes() as u64;
        // A piece, and 8- and 16-bit voxels packed with their neighbours; bricks and their windows are a share of that.
        let piece = PIECE as u64 * (each + if each <= 2 { 2 * each } else { 0 } + 1);
        let held = self.levels.levels()[0].bricks().held();
        let needed = BASE + held + 3 * 16 * u64::from(width) * u64::from(height) + threads * (piece + Pages::largest(&self.levels));
        match self.memory.checked_sub(needed).filter(|&left| left >= LEAST) {
            Some(left) => Ok(left),
            None => Err(Error::invalid(format!(
                "{} bytes of memory: a picture of {width} x {height} in {threads} threads takes {} at least",
                self.memory,
                needed + LEAST
            ))),
        }
    }

    /// Stored values that tables are made for: all that there are, as far as that is known, else all that differ for `scene`.
    fn range(&self, scene: &Scene) -> Result<(f64, f64)> {
        let kind = self.levels.voxel_type();
        if let Some(range) = self.levels.range() {
            return Ok(range);
        }
        if kind.bytes() <= 2 {
            return Ok(kind.limits());
        }
        let (slope, intercept) = self.levels.rescale();
        let (min, max) = kind.limits();
        let stored = |value: f64| ((value - intercept) / slope).clamp(min, max);
        let knots = scene.transfer().knots();
        let overview = self.levels.overview(PIECE)?;
        let (low, high) = overview.range();
        // Beyond its outer knots a transfer function is constant; a function of two variables ends with the data.
        let ends = [knots[0], knots[knots.len() - 1], low, high].map(stored);
        let fold = |f: fn(f64, f64) -> f64, from: f64| ends.into_iter().fold(from, f);
        Ok((fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)))
    }

    fn frame<'f>(&'f self, job: &'f Job<'f>, count: u64, finer: usize, judge: bool, tolerance: Option<f64>) -> Frame<'f> {
        let sight = Sight::new(&self.levels, &job.view, job.scene.clip_planes(), count);
        let terminate = match tolerance {
            Some(tolerance) => adaptive::search::terminate(job.scene.terminate(), tolerance),
            None => job.scene.terminate(),
        };
        Frame {
            scene: job.scene,
            levels: &self.levels,
            pages: &job.pages,
            tables: &job.tables,
            runs: sight.runs(finer),
            sight,
            terminate: if judge && tolerance.is_some() { terminate * LATER } else { terminate },
            detail: if judge && tolerance.is_some() { Detail::Finer } else { Detail::Usual },
            vectors: self.vectors,
            range: job.range,
            most: job.most,
            control: Control { progress: self.settings.progress.as_deref(), stopper: &self.stopper },
        }
    }

    /// The picture of `job` into `pixels`, at the levels and in the slices that it takes.
    ///
    /// The first picture, of the coarsest levels, tells where to judge. From there on the blocks that judge are rendered alone, until their error
    /// does, and the picture once more.
    fn search(&self, job: &mut Job<'_>, pixels: &mut [[f32; 4]]) -> Result<Made> {
        let size = job.scene.size();
        let tolerance = if let Slicing::Tolerance(tolerance) = job.scene.slicing() { Some(tolerance) } else { None };
        let mut count = self.first_count(job)?;
        // A scene's own number of slices is kept; then it is the levels alone that are judged.
        let several = tolerance.is_some() || self.settings.estimate;
        let goal = AIM * tolerance.unwrap_or(USUAL_TOLERANCE);
        let mut finer = 0;
        let regions = regions(size);
        let mut made = Made { count, finer, planned: Vec::new(), error: None, level_error: 0.0, tolerance };
        if Sight::new(&self.levels, &job.view, &[], 1).stack.is_empty() {
            pixels.fill(OverBackground::new(job.scene, &crate::plan::method(job.scene)).nothing());
            return Ok(Made { count: 0, ..made });
        }
        let done = self.frame(job, count, finer, false, tolerance).run(&regions, "rendering")?;
        put(&regions, &done.pixels, pixels, size);
        made.planned = job.take(done);
        let mut at_finest = Sight::new(&self.levels, &job.view, &[], count).is_finest(finer);
        if at_finest && !several {
            return Ok(made);
        }
        let judges = Judges::of(pixels, size);
        let mut own = judges.cut(pixels);
        loop {
            let level_error = if at_finest { 0.0 } else { self.judged(job, &judges, &own, (count, finer), tolerance)? };
            let error = match several {
                true => self.judged(job, &judges, &own, ((4 * count).min(MOST), finer), tolerance)?,
                false => level_error,
            };
            (made.level_error, made.error) = (level_error, (several || !at_finest).then_some(error));
            let slices_may = tolerance.is_some() && 2 * count <= MOST;
            // A number of slices that the scene gives is not changed for an error.
            let decides = if tolerance.is_some() { error } else { level_error };
            if decides <= goal || at_finest && !slices_may {
                break;
            }
            // What is worse is refined.
            if slices_may && (at_finest || 2.0 * level_error * level_error < error * error) {
                count *= 2;
            } else {
                finer += 1;
            }
            at_finest = Sight::new(&self.levels, &job.view, &[], count).is_finest(finer);
            let done = self.frame(job, count, finer, false, tolerance).run(&judges.regions, "judging")?;
            own.clone_from(&done.pixels);
            job.take(done);
        }
        if (made.count, made.finer) != (count, finer) {
            let done = self.frame(job, count, finer, false, tolerance).run(&regions, "rendering")?;
            put(&regions, &done.pixels, pixels, size);
            made.planned = job.take(done);
        }
        Ok(Made { count, finer, ..made })
    }

    /// What the pixels `own` of `judges` differ by from those of finer levels, in `count` slices.
    fn judged(
        &self,
        job: &mut Job<'_>,
        judges: &Judges,
        own: &[Vec<[f32; 4]>],
        (count, finer): (u64, usize),
        tolerance: Option<f64>,
    ) -> Result<f64> {
        let done = self.frame(job, count, finer + BELOW, true, tolerance).run(&judges.regions, "judging")?;
        let error = judges.error(own, &done.pixels);
        job.take(done);
        Ok(error)
    }

    /// Slices to begin with: as many as the scene says; to a tolerance, as many as voxels of the coarsest level take.
    fn first_count(&self, job: &Job<'_>) -> Result<u64> {
        match job.scene.slicing() {
            Slicing::Count(count) => Ok(count),
            Slicing::Spacing(spacing) => slice_count(spacing, job.scene, self.levels.grid(), &job.view),
            Slicing::Tolerance(_) => {
                let (near, far) = Stack::depth_range(self.levels.grid(), &job.view).unwrap_or((0.0, 0.0));
                let sight = Sight::new(&self.levels, &job.view, &[], 1);
                let level = sight.runs(0).first().map_or(0, |run| run.1);
                let spacing = self.levels.levels()[level].grid().smallest_spacing();
                Ok(adaptive::search::first_count(far - near, spacing))
            }
        }
    }
}

/// Most slices that a tolerance leads to.
const MOST: u64 = 1 << 16;

/// A picture that was made.
struct Made {
    count: u64,
    finer: usize,
    planned: Vec<Planned>,
    error: Option<f64>,
    level_error: f64,
    tolerance: Option<f64>,
}

impl Job<'_> {
    /// Counts what was done; what it left out.
    fn take(&mut self, done: Done) -> Vec<Planned> {
        self.counters.add(&done.counters);
        self.counts.add(&done.counts);
        self.frames += 1;
        done.planned
    }
}
