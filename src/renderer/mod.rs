//! Volume and scene in, picture and statistics out.

mod approach;
mod dark;
mod frame;
mod opengl;
pub(crate) mod refine;
mod survey;

use crate::fragment::batch::SIDE;
use crate::lanes::Level;
use crate::opengl::{Texture, TextureKey};
use crate::picture::Picture;
use crate::plan::Scaling;
use crate::proxy::Stack;
use crate::raster::Watch;
use crate::scene::{Blend, MAX_SLICES, Method, Scene, Slicing, View};
use crate::tally::{LeftOut, Tally};
use crate::volume::packed::Packed;
use crate::{Error, Result, Settings, Volume};
pub(crate) use frame::Parts;
#[cfg(feature = "explain")]
pub(crate) use frame::start_values;
use frame::{Clock, Shot, TransferData, VolumeData};
use rayon::{ThreadPool, ThreadPoolBuilder};

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

/// Makes pictures of one volume; keeps between frames what depends on volume and transfer function only.
pub struct Renderer<'v> {
    volume: &'v Volume,
    settings: Settings,
    level: Level,
    pool: Option<ThreadPool>,
    volume_data: Option<VolumeData>,
    /// Latest first: a picture to a tolerance takes several thicknesses of slabs.
    transfer_data: Vec<TransferData>,
    /// The profile opengl's texture, and what it was made for.
    texture: Option<(TextureKey, Texture)>,
}

impl std::fmt::Debug for Renderer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("volume", &self.volume.name()).field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl<'v> Renderer<'v> {
    /// A renderer for `volume`.
    pub fn new(volume: &'v Volume, settings: Settings) -> Self {
        let level = settings.level.unwrap_or_else(Level::best);
        Self { volume, settings, level, pool: None, volume_data: None, transfer_data: Vec::new(), texture: None }
    }

    /// One picture of `scene`, and what it cost.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the volume holds colours, the scene's camera cannot be resolved for its box or the settings make no sense,
    /// [`Error::Stopped`] when progress said so.
    pub fn render(&mut self, scene: &Scene) -> Result<(Picture, RenderStats)> {
        let (picture, stats, ()) = self.render_watched(scene, ())?;
        Ok((picture, stats))
    }

    /// As [`Renderer::render`], while `watch` looks on.
    pub(crate) fn render_watched<W: Watch>(&mut self, scene: &Scene, watch: W) -> Result<(Picture, RenderStats, W)> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => make_pool(self.settings.threads)?,
        };
        let result = pool.install(|| self.render_here(scene, watch));
        self.pool = Some(pool);
        result
    }

    /// As [`Renderer::render_watched`], on the current thread pool.
    fn render_here<W: Watch>(&mut self, scene: &Scene, watch: W) -> Result<(Picture, RenderStats, W)> {
        if self.settings.tile == Some(0) {
            return Err(Error::invalid("tile 0: a tile has at least one pixel"));
        }
        self.volume.check_scalars()?;
        if let Some(state) = scene.opengl() {
            let (picture, stats) = self.draw(scene, state)?;
            return Ok((picture, stats, watch));
        }
        let mut clock = Clock::default();
        let volume = self.volume;
        clock.prepare(|| {
            self.volume_data.get_or_insert_with(|| {
                let bricks = volume.bricks().clone();
                let scaling = Scaling::new(volume, &bricks);
                // Lookups that convert do not read packed voxels.
                let packed = if scaling.to_f32.is_none() { Packed::new(volume.voxels(), volume.grid().dims()) } else { None };
                VolumeData { bricks, packed, scaling }
            });
        });
        crate::lean::check(scene, self.volume_data.as_ref().map_or(0, |d| d.bricks.non_finite))?;
        let (width, height) = scene.size();
        let view = scene.camera().resolve(volume.grid(), width, height)?;
        let mut warnings = Vec::new();
        let mut pixels = canvas(width, height)?;
        let mut shot = Shot { scene, view, clock, watch };
        let (mut done, mut estimate) = match scene.slicing() {
            Slicing::Tolerance(tolerance) => {
                let (done, error) = self.reach(&mut shot, tolerance, &mut pixels)?;
                if let Some(why) = doubt(scene.blend(), (width.div_ceil(SIDE as u32) * height.div_ceil(SIDE as u32)).into()) {
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
            Slicing::Count(count) => self.in_slices(&mut shot, count, &mut pixels)?,
            Slicing::Spacing(spacing) => {
                let count = slice_count(spacing, volume, &shot.view)?;
                self.in_slices(&mut shot, count, &mut pixels)?
            }
        };
        let Shot { clock, watch, .. } = shot;
        if done.slices == 0 {
            warnings.push("the whole box lies behind the eye: nothing to see".to_owned());
        } else if done.counters.fragments + done.counters.corners == 0 {
            warnings.push("no ray through a pixel meets what camera and clip planes leave of the box: the picture is empty".to_owned());
        } else if let Some(&first) = pixels.first() {
            if pixels.iter().all(|&p| p == first) && done.counters.fragments > 0 && pixels.len() > 1 {
                warnings.push("the picture is of one colour: nothing of the volume shows in it".to_owned());
            }
        }
        let non_finite = self.volume_data.as_ref().map_or(0, |d| d.bricks.non_finite);
        if non_finite > 0 {
            warnings.push(format!("{non_finite} of {} voxels are NaN or infinite: transparent", volume.grid().voxel_count()));
        }
        let stats = RenderStats {
            prepare_seconds: clock.prepare_seconds,
            render_seconds: clock.start.elapsed().as_secs_f64() - clock.prepare_seconds,
            slices: done.slices,
            method: done.method,
            fragments: done.counters.fragments,
            fetches: done.counters.fetches,
            threads: rayon::current_num_threads(),
            simd: self.level.name(),
            tally: done.tally(),
            left_out: done.left_out(),
            error_estimate: estimate.take(),
            non_finite_voxels: non_finite,
            warnings,
        };
        Ok((Picture::new(width, height, pixels), stats, watch))
    }
}

/// Fewest blocks of a picture whose error can be told from their differences.
const TELLING: u64 = 48;

/// Why an error asked for may be missed, in a picture of so many blocks.
fn doubt(blend: Blend, blocks: u64) -> Option<String> {
    match blend {
        Blend::Iso { .. } => Some("with the blend iso a pixel jumps from one surface to another".into()),
        Blend::Lmip { .. } => Some("with the blend lmip a pixel jumps from one surface to another".into()),
        // Up to three times the estimate has been seen.
        Blend::Add => Some("with the blend add no slice hides another's error".into()),
        _ if blocks < TELLING => Some(format!("{blocks} blocks of {SIDE} x {SIDE} pixels are few to tell an error from")),
        Blend::Over | Blend::Mip | Blend::Min | Blend::Average => None,
    }
}

/// The largest side of tiles that makes enough of them of a picture of `width` x `height` pixels.
fn tile_side(width: u32, height: u32) -> u32 {
    let enough = |side: &u32| u64::from(width.div_ceil(*side)) * u64::from(height.div_ceil(*side)) >= u64::from(SHARED);
    TILES.into_iter().find(enough).unwrap_or(TILES[TILES.len() - 1])
}

/// Pixels of a picture, all zero. Memory is refused here with a message, not in the allocator with an abort.
fn canvas(width: u32, height: u32) -> Result<Vec<[f32; 4]>> {
    let count = width as usize * height as usize;
    // Twice the pixels: an encoder needs about as much again.
    if Vec::<[f32; 4]>::new().try_reserve_exact(2 * count).is_err() {
        return Err(Error::invalid(format!(
            "image {width} x {height}: {} bytes of pixels, this machine does not give that much memory",
            count as u64 * 16
        )));
    }
    // Zero from the system: the threads that fill the pixels are the first to touch them.
    Ok(vec![[0.0; 4]; count])
}

fn make_pool(threads: Option<usize>) -> Result<ThreadPool> {
    if threads == Some(0) {
        return Err(Error::invalid("threads 0: at least one is needed"));
    }
    let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| Error::invalid(format!("{threads} threads: {e}")))
}

/// Number of slices `spacing` apart at most.
fn slice_count(spacing: f64, volume: &Volume, view: &View) -> Result<u64> {
    let depth = Stack::depth_range(volume.grid(), view).map_or(0.0, |(near, far)| far - near);
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
