//! Volume and scene in, picture and statistics out.
//!
//! ```text
//!  scene --> backend: slices --layer, block by block--> finish: background --+
//!              |  ^ plan    ^ cache: what depends on volume and transfer function|--> warnings, statistics --> picture
//!              +--> casting: ray by ray, each pixel over the background ---------+
//!              +--> opengl: a framebuffer cleared to the background -------------+
//! ```
//! A backend fills the caller's pixels and tells what it did ([`Drawn`]). Layers are finished while their block is in the cache, by the one
//! implementation of `raster::Finish` that the job asks for: over the background, or left as they are.

pub(crate) mod adaptive;
mod aov;
#[cfg(feature = "explain")]
mod block;
mod cache;
mod casting;
mod finish;
mod job;
mod layer;
mod opengl;
mod part;
mod partial;
mod progressive;
mod rectangle;
mod slices;

pub(crate) use finish::OverBackground;

use crate::lanes::Level;
use crate::picture::Picture;
use crate::proxy::{Stack, is_in_shells, shell_range};
use crate::raster::Observer;
use crate::scene::{Algorithm, Blend, MAX_SLICES, Method, Scene, Slicing, View};
use crate::settings::{Control, Stopper};
use crate::tally::{LeftOut, Tally};
use crate::volume::Grid;
use crate::{Error, Result, Settings, Volume};
pub use layer::Layer;
pub use part::halo;
pub use partial::{Kind as PartialKind, Partial};
pub use progressive::Pass;

use cache::Cache;
use job::{Clock, Output, RenderJob};
use rayon::ThreadPool;
use std::sync::Arc;

/// Sides of a tile when the settings leave it open: multiples of the block.
const TILES: [u32; 4] = [64, 32, 16, 8];
/// Fewest tiles of a picture, where it has room for them: enough that 64 threads share them out evenly.
const SHARED: u32 = 1024;

/// What a picture cost, and what was left out.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct RenderStats {
    /// Seconds spent on what depends on volume and transfer function only: packing, bricks, tables.
    pub prepare_seconds: f64,
    /// Seconds the frame cost once prepared: planning, any error estimate, geometry, pixels.
    pub render_seconds: f64,
    /// Slice planes of the stack; of the finest one, where a tolerance gave blocks different ones.
    pub slices: u64,
    /// How rays were integrated: the scene's method, or the one that a tolerance chose.
    pub method: Method,
    /// Fragments covered by slice polygons.
    pub fragments: u64,
    /// Voxel lookups (trilinear samples) really done.
    pub fetches: u64,
    /// Worker threads.
    pub threads: usize,
    /// Name of the vector level.
    pub simd: &'static str,
    /// Where fragments and lookups went.
    pub tally: Tally,
    /// Stages and work that this scene did not need, why, and what that saved.
    pub left_out: Vec<LeftOut>,
    /// The RMS error of the colours as estimated, where the scene asked for a tolerance.
    pub error_estimate: Option<f64>,
    /// Voxels that are NaN or infinite: they are transparent.
    pub non_finite_voxels: usize,
    /// Things the user should hear about, one line each.
    pub warnings: Vec<String>,
}

/// Who draws a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Backend {
    /// Slices, flat or in shells, through the stages, in tiles, with vectors.
    Slices,
    /// OpenGL's fixed functions, fragment by fragment.
    OpenGl,
    /// The other algorithms, ray by ray.
    Casting,
}

impl Backend {
    /// The one that `scene` asks for.
    fn of(scene: &Scene) -> Self {
        match scene.algorithm() {
            _ if scene.opengl().is_some() => Self::OpenGl,
            Algorithm::Slices | Algorithm::Shells => Self::Slices,
            Algorithm::Rays
            | Algorithm::Traversal(_)
            | Algorithm::Template(_)
            | Algorithm::ObjectSlices { .. }
            | Algorithm::Grid
            | Algorithm::CoinFlips { .. } => Self::Casting,
        }
    }
}

/// What a backend has drawn, and has to say about it.
#[derive(Debug, Default)]
struct Drawn {
    slices: u64,
    method: Method,
    tally: Tally,
    fetches: u64,
    /// Name of the vector level.
    simd: &'static str,
    left_out: Vec<LeftOut>,
    error_estimate: Option<f64>,
    /// Voxels that are NaN or infinite, and what becomes of them.
    non_finite: usize,
    non_finite_become: &'static str,
    /// Warnings to be told before those that every backend's pictures may need, and after.
    warnings: Vec<String>,
    late_warnings: Vec<String>,
}

/// Makes pictures of one volume; keeps between frames what depends on volume and transfer function only.
///
/// ```
/// # fn main() -> slicestack::Result<()> {
/// use slicestack::volume::phantom::Phantom;
/// use slicestack::{Renderer, Scene, Settings};
///
/// let volume = Phantom::SheppLogan.volume(16)?;
/// let scene = Scene::new(Phantom::SheppLogan.default_transfer(16)).with_size(32, 24)?;
/// let mut renderer = Renderer::new(&volume, Settings::default());
/// let (picture, stats) = renderer.render(&scene)?;
/// let mut pixels = vec![[0.0; 4]; 32 * 24]; // of your own: the next frames need no memory
/// renderer.render_into(&scene, &mut pixels)?;
/// assert_eq!(picture.pixels(), pixels);
/// assert_eq!(stats.slices, 256);
/// # Ok(())
/// # }
/// ```
pub struct Renderer {
    volume: Arc<Volume>,
    settings: Settings,
    level: Level,
    stopper: Stopper,
    pool: Option<ThreadPool>,
    cache: Cache,
    /// Pixels of coarse passes.
    scratch: Vec<[f32; 4]>,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("volume", &self.volume.name()).field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Renderer {
    /// A renderer for `volume`: an `Arc<Volume>`, a `Volume`, or a `&Volume`, whose voxels it then shares.
    pub fn new(volume: impl Into<Arc<Volume>>, settings: Settings) -> Self {
        let level = settings.level.unwrap_or_else(Level::best);
        Self {
            volume: volume.into(),
            settings,
            level,
            stopper: Stopper::default(),
            pool: None,
            cache: Cache::default(),
            scratch: Vec::new(),
        }
    }

    /// Another renderer of the same volume and settings, to be used at the same time: it shares what depends on the volume alone, as far as that is
    /// there already.
    pub fn beside(&self) -> Self {
        Self {
            volume: Arc::clone(&self.volume),
            settings: self.settings.clone(),
            level: self.level,
            stopper: Stopper::default(),
            pool: None,
            cache: self.cache.beside(),
            scratch: Vec::new(),
        }
    }

    /// The volume that it renders.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// Stops its pictures from another thread.
    pub fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    /// One picture of `scene`, and what it cost.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene asks for what its volume does not have ([`Scene::check_with`]), its camera cannot be resolved for its box or the settings make no sense,
    /// [`Error::Stopped`] when progress or a [`Stopper`] said so.
    pub fn render(&mut self, scene: &Scene) -> Result<(Picture, RenderStats)> {
        let (picture, stats, ()) = self.render_observed(scene, ())?;
        Ok((picture, stats))
    }

    /// As [`Renderer::render`], into `pixels` of the caller's: row by row from the top, premultiplied RGBA.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Invalid`] when there are not as many pixels as the scene has. What is in `pixels` after an error
    /// is a part of the picture.
    pub fn render_into(&mut self, scene: &Scene, pixels: &mut [[f32; 4]]) -> Result<RenderStats> {
        check_size(scene, pixels)?;
        Ok(self.pooled(|r| r.render_here(scene, (), pixels))?.0)
    }

    /// As [`Renderer::render`], while `observer` looks on.
    pub(crate) fn render_observed<O: Observer>(&mut self, scene: &Scene, observer: O) -> Result<(Picture, RenderStats, O)> {
        let (width, height) = scene.size();
        let mut pixels = canvas(width, height)?;
        let (stats, observer) = self.pooled(|r| r.render_here(scene, observer, &mut pixels))?;
        Ok((Picture::new(width, height, pixels), stats, observer))
    }

    /// Does `work` on the renderer's own threads.
    fn pooled<R: Send>(&mut self, work: impl FnOnce(&mut Self) -> Result<R> + Send) -> Result<R> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => self.settings.pool()?,
        };
        let result = pool.install(|| work(self));
        self.pool = Some(pool);
        if matches!(result, Err(Error::Stopped)) {
            self.stopper.reset();
        }
        result
    }

    /// Who hears of the work, and who may stop it.
    fn control(&self) -> Control<'_> {
        Control { progress: self.settings.progress.as_deref(), stopper: &self.stopper }
    }

    /// Fills `pixels` with a picture of `scene`, on the current thread pool.
    fn render_here<O: Observer>(&mut self, scene: &Scene, observer: O, pixels: &mut [[f32; 4]]) -> Result<(RenderStats, O)> {
        if self.settings.tile == Some(0) {
            return Err(Error::invalid("tile 0: a tile has at least one pixel"));
        }
        let clock = Clock::default();
        scene.check_with(&self.volume)?;
        let scene = &scene.blended();
        let (width, height) = scene.size();
        let view = scene.camera().resolve(self.volume.grid(), width, height)?;
        let mut job = RenderJob { scene, view, clock, observer, output: Output::Picture };
        let drawn = match Backend::of(scene) {
            Backend::Slices => self.draw_slices(&mut job, pixels)?,
            Backend::OpenGl => self.draw_opengl(&mut job, pixels)?,
            Backend::Casting => self.draw_casting(&mut job, pixels)?,
        };
        let times = (job.clock.prepare_seconds, job.clock.start.elapsed().as_secs_f64());
        Ok((finish::statistics(drawn, times, &self.volume, pixels), job.observer))
    }

    /// What is told of colours outside 0 to 1.
    fn clamped(&self) -> Vec<String> {
        let (count, all) = (self.cache.clamped(), self.volume.grid().voxel_count());
        if count > 0 { vec![format!("{count} of {all} voxels have a colour or an alpha outside 0 to 1: clamped")] } else { Vec::new() }
    }

    /// The scene's slices, as many as it says or as an error takes.
    fn draw_slices<O: Observer>(&mut self, job: &mut RenderJob<'_, O>, pixels: &mut [[f32; 4]]) -> Result<Drawn> {
        let mut warnings = Vec::new();
        let (mut done, error_estimate) = match job.scene.slicing() {
            Slicing::Tolerance(tolerance) => {
                let (done, error) = self.reach(job, tolerance, pixels)?;
                if let Some(why) = doubt(job.scene.blend()) {
                    warnings.push(format!("tolerance {tolerance}: {why}, and the error may be several times the one estimated"));
                }
                if error > tolerance {
                    warnings.push(format!(
                        "tolerance {tolerance} is out of reach: {} slices leave an estimated error of {error:.2e}",
                        done.slices
                    ));
                }
                (done, Some(error))
            }
            Slicing::Count(count) => self.in_slices(job, count, pixels)?,
            Slicing::Spacing(spacing) => {
                let count = slice_count(spacing, job.scene, self.volume.grid(), &job.view)?;
                self.in_slices(job, count, pixels)?
            }
        };
        if job.scene.blend() == Blend::Add && job.scene.window().is_none() {
            warnings.extend(finish::saturation(&OverBackground::new(job.scene, &done.method), pixels));
        }
        Ok(Drawn {
            slices: done.slices,
            method: done.method,
            tally: done.tally(),
            fetches: done.counters.fetches,
            simd: self.level.name(),
            left_out: done.left_out(),
            error_estimate,
            non_finite: self.cache.non_finite(),
            non_finite_become: "transparent",
            warnings,
            late_warnings: self.clamped(),
        })
    }
}

/// A volume to be shared: its voxels are not copied.
impl From<&Volume> for Arc<Volume> {
    fn from(volume: &Volume) -> Self {
        Self::new(volume.clone())
    }
}

/// # Errors
/// [`Error::Invalid`] when `pixels` are not as many as `scene` has.
fn check_size(scene: &Scene, pixels: &[[f32; 4]]) -> Result<()> {
    let (width, height) = scene.size();
    if pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(Error::invalid(format!("{} pixels given for a picture of {width} x {height}", pixels.len())));
    }
    Ok(())
}

/// Why an error asked for may be missed.
fn doubt(blend: Blend) -> Option<&'static str> {
    match blend {
        Blend::Iso { .. } | Blend::Surfaces => Some("with the blend iso a pixel jumps from one surface to another"),
        Blend::Lmip { .. } => Some("with the blend lmip a pixel jumps from one surface to another"),
        Blend::AttenuatedMip { .. } => Some("with the blend attenuated-mip a pixel jumps from one value to another"),
        Blend::Add | Blend::Over | Blend::Under | Blend::Mip | Blend::Min | Blend::Average => None,
    }
}

/// The largest side of tiles that makes enough of them of a picture of `width` x `height` pixels.
fn tile_side(width: u32, height: u32) -> u32 {
    let enough = |side: &u32| u64::from(width.div_ceil(*side)) * u64::from(height.div_ceil(*side)) >= u64::from(SHARED);
    TILES.into_iter().find(enough).unwrap_or(TILES[TILES.len() - 1])
}

/// Pixels of a picture, all zero. Memory is refused here with a message, not in the allocator with an abort.
pub(crate) fn canvas(width: u32, height: u32) -> Result<Vec<[f32; 4]>> {
    let count = width as usize * height as usize;
    // Twice the pixels: an encoder needs about as much again.
    if crate::memory::reserve(&mut Vec::<[f32; 4]>::new(), 2 * count).is_err() {
        return Err(Error::invalid(format!(
            "image {width} x {height}: {} bytes of pixels, this machine does not give that much memory",
            count as u64 * 16
        )));
    }
    // Zero from the system: the threads that fill the pixels are the first to touch them.
    Ok(vec![[0.0; 4]; count])
}

/// Number of slices or shells of `scene`, `spacing` apart at most.
pub(crate) fn slice_count(spacing: f64, scene: &Scene, grid: &Grid, view: &View) -> Result<u64> {
    steps_of(spacing, Stack::depth_range(grid, view).map(|range| if is_in_shells(scene, view) { shell_range(grid, view) } else { range }))
}

/// Number of steps of `spacing` at most from one end of `range` to the other.
fn steps_of(spacing: f64, range: Option<(f64, f64)>) -> Result<u64> {
    let depth = range.map_or(0.0, |(near, far)| far - near);
    // A hair less, so that a spacing that divides the depth is not rounded up past it.
    let n = libm::ceil(depth / spacing * (1.0 - 1e-12));
    if n > MAX_SLICES as f64 {
        return Err(Error::Limit { what: format!("slices of spacing {spacing}"), needed: n as u128, limit: u128::from(MAX_SLICES) });
    }
    Ok((n as u64).max(1))
}

/// One picture of `volume` as `scene` describes it, made with default settings.
///
/// # Errors
/// As [`Renderer::render`].
pub fn render(volume: &Volume, scene: &Scene) -> Result<Picture> {
    Ok(Renderer::new(volume, Settings::default()).render(scene)?.0)
}

#[cfg(test)]
mod tests {
    use super::tile_side;

    #[test]
    fn tiles_are_many_and_large() {
        for (width, height, side) in
            [(512, 512, 16), (1024, 1024, 32), (2048, 1024, 32), (2048, 2048, 64), (8192, 8192, 64), (100, 50, 8), (1, 9000, 8)]
        {
            assert_eq!(tile_side(width, height), side, "{width} x {height}");
        }
    }
}
