//! Volume and scene in, picture and statistics out.

use crate::fragment::{Frame, FrameFog};
use crate::lanes::Level;
use crate::plan::{self, Classes, Needs, Scaling, Slab};
use crate::proxy::Stack;
use crate::raster::{BlockMask, Counters, Occupancy, Outer, Resolve, Watch, Work, render_tiles};
use crate::scene::{
    Blend, Ends, Fog, FogDistance, FogWeighting, Premultiplied, SampleAt, Scene, SlabForm, Slicing, TransferFunction, View,
};
use crate::target::Picture;
use crate::tolerance;
use crate::volume::bricks::Bricks;
use crate::volume::packed::Packed;
use crate::{Error, Result, Settings, Volume};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::Instant;

/// Side of a tile when the settings leave it open: a multiple of the block, small enough to share out on many cores.
const TILE: u32 = 32;

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
    /// Fragments covered by slice polygons.
    pub fragments: u64,
    /// Voxel lookups (trilinear samples) really done.
    pub fetches: u64,
    /// Worker threads.
    pub threads: usize,
    /// Name of the vector level.
    pub simd: &'static str,
    /// Stages and work that this scene did not need: (what, why).
    pub left_out: Vec<(String, String)>,
    /// The RMS error of the colours as estimated, where the scene asked for a tolerance.
    pub error_estimate: Option<f64>,
    /// Voxels that are NaN or infinite: they are transparent.
    pub non_finite_voxels: usize,
    /// Things the user should hear about, one line each.
    pub warnings: Vec<String>,
}

/// What depends on the volume alone.
struct VolumeData {
    bricks: Bricks,
    packed: Option<Packed>,
    scaling: Scaling,
}

/// What depends on the volume, the transfer function and the thickness of a slab.
struct TransferData {
    transfer: TransferFunction,
    slab: Slab,
    /// Whether the table is over pairs of values.
    pairs: bool,
    classes: Classes,
    table: crate::lanes::LookupTable,
    occupancy: Occupancy,
}

/// Makes pictures of one volume; keeps between frames what depends on volume and transfer function only.
pub struct Renderer<'v> {
    volume: &'v Volume,
    settings: Settings,
    level: Level,
    pool: Option<ThreadPool>,
    volume_data: Option<VolumeData>,
    transfer_data: Option<TransferData>,
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
        Self { volume, settings, level, pool: None, volume_data: None, transfer_data: None }
    }

    /// One picture of `scene`, and what it cost.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene's camera cannot be resolved for the volume's box or the settings make no sense,
    /// [`Error::Stopped`] when progress said so.
    pub fn render(&mut self, scene: &Scene) -> Result<(Picture, RenderStats)> {
        let (picture, stats, ()) = self.render_watched(scene)?;
        Ok((picture, stats))
    }

    /// As [`Renderer::render`], while `W` looks on.
    pub(crate) fn render_watched<W: Watch>(&mut self, scene: &Scene) -> Result<(Picture, RenderStats, W)> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => make_pool(self.settings.threads)?,
        };
        let result = pool.install(|| self.render_here(scene));
        self.pool = Some(pool);
        result
    }

    /// As [`Renderer::render_watched`], on the current thread pool.
    fn render_here<W: Watch>(&mut self, scene: &Scene) -> Result<(Picture, RenderStats, W)> {
        if scene.method().extrapolate {
            return Err(Error::invalid("this method is not offered yet"));
        }
        if self.settings.tile == Some(0) {
            return Err(Error::invalid("tile 0: a tile has at least one pixel"));
        }
        let mut clock = Clock { start: Instant::now(), prepare_seconds: 0.0 };
        let volume = self.volume;
        clock.prepare(|| {
            self.volume_data.get_or_insert_with(|| {
                let bricks = Bricks::new(volume.voxels(), volume.grid().dims());
                let scaling = Scaling::new(volume, &bricks);
                // Lookups that convert do not read packed voxels.
                let packed = if scaling.to_f32.is_none() { Packed::new(volume.voxels(), volume.grid().dims()) } else { None };
                VolumeData { bricks, packed, scaling }
            });
        });
        let (width, height) = scene.size();
        let view = scene.camera().resolve(volume.grid(), width, height)?;
        let mut warnings = Vec::new();
        let mut estimate = None;
        let mut watch = W::default();
        let mut pixels = canvas(width, height)?;
        let mut done = match scene.slicing() {
            Slicing::Tolerance(tolerance) => {
                let (done, error) = self.adapt(tolerance, scene, &view, &mut pixels, &mut clock, &mut watch)?;
                if error > tolerance {
                    warnings.push(format!(
                        "tolerance {tolerance} is out of reach: {} slices leave an estimated error of {error:.2e}",
                        done.slices
                    ));
                }
                estimate = Some(error);
                done
            }
            slicing => {
                let count = slice_count(slicing, volume, &view)?;
                self.frame(scene, &view, count, scene.terminate(), None, &mut pixels, &mut clock, &mut watch)?
            }
        };
        if done.slices == 0 {
            warnings.push("the whole box lies behind the eye: nothing to see".to_owned());
        } else if let Some(&first) = pixels.first() {
            if warnings.is_empty() && pixels.iter().all(|&p| p == first) && done.counters.fragments > 0 && pixels.len() > 1 {
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
            fragments: done.counters.fragments,
            fetches: done.counters.fetches,
            threads: rayon::current_num_threads(),
            simd: self.level.name(),
            left_out: done.left_out(width, height),
            error_estimate: estimate,
            non_finite_voxels: non_finite,
            warnings,
        };
        Ok((Picture::new(width, height, pixels), stats, watch))
    }

    /// `pixels` to `tolerance`, each block in as many slices as it needs; and the error estimated.
    fn adapt<W: Watch>(
        &mut self,
        tolerance: f64,
        scene: &Scene,
        view: &View,
        pixels: &mut Vec<[f32; 4]>,
        clock: &mut Clock,
        watch: &mut W,
    ) -> Result<(Finished, f64)> {
        let grid = self.volume.grid();
        let depth = Stack::depth_range(grid, view).map_or(0.0, |(near, far)| far - near);
        let first = tolerance::first_count(depth, grid.smallest_spacing());
        let terminate = tolerance::terminate(scene.terminate(), tolerance);
        let mut done: Option<Finished> = None;
        let reached = tolerance::refine(tolerance, first, view.width as usize, pixels, |count, blocks, pixels| {
            let part = self.frame(scene, view, count, terminate, blocks, pixels, clock, watch)?;
            match &mut done {
                Some(done) => done.add(&part),
                None => done = Some(part),
            }
            Ok(())
        })?;
        let mut done = done.ok_or_else(|| Error::invalid("a picture without a frame"))?;
        let all: usize = reached.levels.iter().map(|l| l.1).sum();
        let levels: Vec<String> = reached.levels.iter().map(|(slices, blocks)| format!("{blocks} in {slices}")).collect();
        done.planned.push(("finer slices where coarse ones do".to_owned(), format!("of {all} blocks: {} slices", levels.join(", "))));
        Ok((done, reached.error))
    }

    /// Fills `pixels` with `scene` in `count` slices; with a mask, its blocks alone.
    #[allow(
        clippy::too_many_arguments,
        reason = "what one frame is of, how fine, where it goes; a struct would be made and taken apart at once"
    )]
    fn frame<W: Watch>(
        &mut self,
        scene: &Scene,
        view: &View,
        count: u64,
        terminate: f32,
        blocks: Option<&BlockMask>,
        pixels: &mut [[f32; 4]],
        clock: &mut Clock,
        watch: &mut W,
    ) -> Result<Finished> {
        let volume = self.volume;
        let Some(VolumeData { bricks, packed, scaling }) = &self.volume_data else {
            return Err(Error::invalid("a frame before the volume is prepared"));
        };
        let stack = Stack::new(volume.grid(), view, scene.clip_planes(), count);
        let transfer_data = clock.prepare(|| {
            let unit = scene.opacity_unit().unwrap_or_else(|| volume.grid().smallest_spacing());
            let ratio = if stack.is_empty() { 1.0 } else { stack.spacing / unit };
            let method = plan::method(scene);
            let slab = Slab { ratio, form: method.slab };
            let pairs = method.is_pre_integrated();
            let kept = self.transfer_data.take().filter(|t| t.transfer == *scene.transfer());
            self.transfer_data.insert(match kept {
                Some(kept) if kept.slab == slab && kept.pairs == pairs => kept,
                kept => prepare_transfer(scene.transfer(), (slab, pairs), volume, bricks, kept),
            })
        });
        let (frame, split) = make_frame(scene, volume, packed.as_ref(), scaling, transfer_data, terminate);
        let needs = Needs::new(scene, &stack, bricks, split, terminate);
        let stages = needs.stages(volume, packed.is_some(), scaling, self.level);
        let work = Work {
            frame: &frame,
            stack: &stack,
            fog: scene.fog().filter(|_| needs.fog.is_some()),
            order: needs.order,
            occupancy: needs.skip.then_some(&transfer_data.occupancy),
            span: stages.span,
            whole: stages.whole,
            partial: stages.partial,
            start: start_values(scene.blend()),
            radial: needs.fog == Some(FogDistance::Radial),
            outer: match (needs.method.is_pre_integrated(), needs.method.ends) {
                (false, Ends::Partial) => Outer::Partial,
                (false, Ends::Whole) => Outer::Whole,
                (true, Ends::Partial) => Outer::Between,
                (true, Ends::Whole) => Outer::WholeBetween,
            },
            pairs: stages.pairs,
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
        };
        let mut counters = Counters::default();
        if stack.is_empty() {
            pixels.fill(resolve.background());
        } else {
            let tile = self.settings.tile.unwrap_or(TILE);
            let seen;
            (counters, seen) = render_tiles(&work, &resolve, tile, pixels, blocks, self.settings.progress.as_deref())?;
            watch.merge(seen);
        }
        let planned = plan::planned(scene, volume, &needs);
        let visible_share = needs.skip.then(|| transfer_data.occupancy.share());
        Ok(Finished { counters, slices: stack.count, planned, visible_share })
    }
}

/// What a frame took, or several frames that make up one picture.
struct Finished {
    counters: Counters,
    slices: u64,
    planned: Vec<(String, String)>,
    visible_share: Option<f64>,
}

impl Finished {
    /// Adds a further frame of the same picture.
    fn add(&mut self, other: &Self) {
        self.counters.add(&other.counters);
        self.slices = self.slices.max(other.slices);
    }

    /// Everything that was left out of a picture of `width` x `height` pixels.
    fn left_out(&mut self, width: u32, height: u32) -> Vec<(String, String)> {
        let blocks = u64::from(width.div_ceil(8)) * u64::from(height.div_ceil(8));
        let mut list = std::mem::take(&mut self.planned);
        list.extend(plan::counted(&self.counters, self.visible_share, blocks));
        list
    }
}

/// Seconds since a frame began, and those of them that went into what depends on volume and transfer function only.
struct Clock {
    start: Instant,
    prepare_seconds: f64,
}

impl Clock {
    fn prepare<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.prepare_seconds += start.elapsed().as_secs_f64();
        result
    }
}

/// Pixels of a picture, all zero. Memory is refused here with a message, not in the allocator with an abort.
fn canvas(width: u32, height: u32) -> Result<Vec<[f32; 4]>> {
    let count = width as usize * height as usize;
    let mut pixels = Vec::new();
    // Twice the pixels: an encoder needs about as much again.
    if pixels.try_reserve_exact(2 * count).is_err() {
        return Err(Error::invalid(format!(
            "image {width} x {height}: {} bytes of pixels, this machine does not give that much memory",
            count as u64 * 16
        )));
    }
    pixels.shrink_to(count);
    pixels.resize(count, [0.0; 4]);
    Ok(pixels)
}

fn make_pool(threads: Option<usize>) -> Result<ThreadPool> {
    if threads == Some(0) {
        return Err(Error::invalid("threads 0: at least one is needed"));
    }
    let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| Error::invalid(format!("{threads} threads: {e}")))
}

/// Number of slices that the scene asks for.
fn slice_count(slicing: Slicing, volume: &Volume, view: &View) -> Result<u64> {
    Ok(match slicing {
        Slicing::Count(n) => n,
        Slicing::Spacing(spacing) => {
            let depth = Stack::depth_range(volume.grid(), view).map_or(0.0, |(near, far)| far - near);
            // A hair less, so that a spacing that divides the depth is not rounded up past it.
            let n = libm::ceil(depth / spacing * (1.0 - 1e-12));
            if n > crate::scene::MAX_SLICES as f64 {
                return Err(Error::Limit {
                    what: format!("slices of spacing {spacing}"),
                    needed: n as u128,
                    limit: u128::from(crate::scene::MAX_SLICES),
                });
            }
            (n as u64).max(1)
        }
        // Chosen block by block in `adapt`.
        Slicing::Tolerance(_) => 1,
    })
}

/// Table and occupancy of a transfer function for slabs like `slab`.
///
/// What `kept` holds for another thickness serves again where it does not depend on it.
fn prepare_transfer(
    transfer: &TransferFunction,
    (slab, pairs): (Slab, bool),
    volume: &Volume,
    bricks: &Bricks,
    kept: Option<TransferData>,
) -> TransferData {
    let (slope, intercept) = volume.rescale();
    let value = |stored: f64| stored * slope + intercept;
    // In the order of the data's units, whatever the sign of the slope.
    let sorted = |lo: f64, hi: f64| if slope < 0.0 { (value(hi), value(lo)) } else { (value(lo), value(hi)) };
    let (min, max) = bricks.range;
    let range = if min <= max { sorted(min, max) } else { (0.0, 0.0) };
    let classes = Classes::new(transfer, range, slab, pairs);
    let table = classes.table(transfer, slab);
    let occupancy = match kept.filter(|k| k.classes == classes) {
        Some(kept) => kept.occupancy,
        None => Occupancy::new(bricks, volume.grid().dims(), |lo, hi| {
            let (lo, hi) = sorted(lo, hi);
            classes.opaque_within(lo, hi)
        }),
    };
    TransferData { transfer: transfer.clone(), slab, pairs, classes, table, occupancy }
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
    let level = match scene.blend() {
        Blend::Lmip { threshold: x } | Blend::Iso { level: x } => scaling.number(x),
        _ => 0.0,
    };
    let frame = Frame {
        voxels: volume.voxels(),
        packed,
        strides: [stride(nx, 1), stride(ny, nx), stride(nz, nx * ny)],
        to_f32: scaling.to_f32,
        table: data.table.clone(),
        table_low: low as f32,
        table_scale,
        table_last: last as f32,
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

/// What pixels start from: colour channels, then transmittance.
fn start_values(blend: Blend) -> [f32; 4] {
    let nothing = crate::fragment::project::NOTHING;
    match blend {
        Blend::Over => [0.0, 0.0, 0.0, 1.0],
        Blend::Add | Blend::Average => [0.0; 4],
        Blend::Mip | Blend::Min => [nothing, 0.0, 0.0, 1.0],
        Blend::Lmip { .. } | Blend::Iso { .. } => [nothing, nothing, 0.0, 1.0],
    }
}

/// The background, fogged as from infinitely far where the scene asks for it.
fn background(scene: &Scene) -> Premultiplied {
    let color = scene.background();
    let straight = match scene.fog().filter(|_| scene.fogged_background()) {
        Some(fog) => fogged(color, fog),
        None => color,
    };
    straight.premultiply()
}

fn fogged(color: crate::scene::Straight, fog: &Fog) -> crate::scene::Straight {
    let f = fog.factor(f64::MAX);
    let rgb = std::array::from_fn(|c| f * color.rgb[c] + (1.0 - f) * fog.color()[c]);
    crate::scene::Straight { rgb, alpha: color.alpha }
}

/// One picture of `volume` as `scene` describes it, made with default settings.
///
/// # Errors
/// As [`Renderer::render`].
pub fn render(volume: &Volume, scene: &Scene) -> Result<Picture> {
    Ok(Renderer::new(volume, Settings::default()).render(scene)?.0)
}
