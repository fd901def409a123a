//! Error against run time: pictures of every method with ever more slices, each timed and held against the reference.

use super::clock::Clock;
use super::methods::{METHODS, NamedMethod};
use super::record::{MethodRecord, Point, Record, Setting};
use super::{advice, algorithms, balance, cost, details, gradients, hits, stages};
use crate::reference::metrics::{self, Displayed};
use crate::reference::{ReferenceImage, Region, image};
use crate::scene::{Accumulation, Algorithm, Blend, Filter, Slicing};
use crate::{Error, Picture, Renderer, Result, Scene, Settings, Volume};
use rayon::ThreadPoolBuilder;
use std::time::Instant;

/// Seconds a study may take unless told.
const BUDGET: f64 = 60.0;
/// Parts of the budget that are gone when the reference is there, then that of the spline, the pictures, their SSIM and FLIP, the details at
/// several errors, their repetitions, those of the pictures, the stages, the kinds of gradient, the kinds of hit, the algorithms, the threads, the sizes.
const REFERENCE: f64 = 0.15;
const SPLINE: f64 = 0.22;
const FIRST: f64 = 0.55;
const JUDGED: f64 = 0.62;
const DETAILS: f64 = 0.66;
const DETAILS_TIMED: f64 = 0.7;
const PICTURES: f64 = 0.8;
const STAGES: f64 = 0.86;
const GRADIENTS: f64 = 0.885;
const HITS: f64 = 0.9;
const ALGORITHMS: f64 = 0.905;
const BALANCE: f64 = 0.91;
const COSTS: f64 = 0.97;
const MANY: u64 = Accumulation::MANY;
/// Most slices of a picture.
const MOST: u64 = 1 << 17;
/// Error below which nobody sees more slices.
const ENOUGH: f64 = 1e-5;
/// Change from half as many slices, as a part of the error, below which more slices lead nowhere.
const SETTLED: f64 = 0.05;
/// Most repetitions of each picture.
const REPEATS: u32 = 9;
/// Why there are no pictures of a method for level surfaces.
const NOT_FOR_SURFACES: &str = "level surfaces are met between slices: it changes nothing about them";
/// Errors asked for in tolerance mode.
const TOLERANCES: [f64; 8] = [2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4];

/// How a study is made.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Options {
    /// Seconds it may take, about; some seconds at least, whatever it says.
    pub budget: f64,
    /// The methods compared.
    pub methods: Vec<&'static NamedMethod>,
    /// Threads, vector level, progress.
    pub settings: Settings,
}

impl Options {
    /// All methods, 60 seconds, [`Settings::new`].
    pub fn new() -> Self {
        Self { budget: BUDGET, methods: METHODS.iter().collect(), settings: Settings::new() }
    }

    /// The options with another budget, in seconds; it must be positive and finite.
    #[must_use]
    pub fn budget(mut self, seconds: f64) -> Self {
        self.budget = seconds;
        self
    }

    /// The options with other methods to compare, at least one.
    #[must_use]
    pub fn methods(mut self, methods: Vec<&'static NamedMethod>) -> Self {
        self.methods = methods;
        self
    }

    /// The options with other settings.
    #[must_use]
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }
}

impl Default for Options {
    /// [`Options::new`].
    fn default() -> Self {
        Self::new()
    }
}

/// A study, and the pictures it shows.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Study {
    /// The numbers.
    pub record: Record,
    /// The reference on the pixels that were compared.
    pub reference: Displayed,
    /// Pictures at the scene's slice count on those pixels: method, slices, colours.
    pub pictures: Vec<(String, u64, Displayed)>,
    /// One detail of the picture with each of the errors of [`Record::details`].
    pub details: Vec<Displayed>,
    /// That detail as it should be, where there was time for its rays.
    pub detail_truth: Option<Displayed>,
}

/// Studies `scene` over `volume`.
///
/// Whatever the scene's own filter is, methods are held against the reference of theirs: the trilinear field's, or the spline's. Level surfaces
/// ([`Scene::with_levels`]) are held against the exact crossings of the rays; methods that change nothing about them are told as missing.
///
/// Errors are measured on red, green and blue over black, on every k-th column and row where the reference of all pixels would
/// take too long; times are for the whole picture, the shortest of several after a first one. Pixels end at a transmittance
/// of the scene's own times (256 / N)^2 at N slices above 256, so that ending early never sets the error.
///
/// # Errors
/// [`Error::Invalid`] for volumes of colours, for a budget that is not positive, no methods, or scenes without a reference; [`Error::Stopped`] when progress
/// said so; as [`Renderer::render`].
pub fn study(volume: &Volume, scene: &Scene, options: &Options) -> Result<Study> {
    volume.check_scalars("a report")?;
    if !(options.budget > 0.0 && options.budget.is_finite()) {
        return Err(Error::invalid(format!("budget {}: must be a positive number of seconds", options.budget)));
    }
    if scene.opengl().is_some() {
        return Err(Error::invalid("render profile opengl: a report is for the profile accurate, whose pictures have a limit"));
    }
    if scene.algorithm() != Algorithm::Slices {
        let name = scene.algorithm().name();
        return Err(Error::invalid(format!(
            "render algorithm {name}: a report compares ways to integrate slices, and draws the other algorithms beside them; choose slices"
        )));
    }
    if options.methods.is_empty() {
        return Err(Error::invalid("no methods to compare"));
    }
    let surfaces = scene.blend() == Blend::Surfaces;
    let clock = Clock::new(options.budget, options.settings.progress.clone());
    let settings = Settings { progress: clock.progress(), ..options.settings.clone() };
    clock.now("reference")?;
    let filtered = |filter| scene.clone().with_method(scene.method().with_filter(filter));
    let (reference, reference_seconds) = make_reference(volume, &filtered(Filter::Linear)?, &settings, || clock.left(REFERENCE))?;
    let region = reference.region();
    let drawn: Vec<&NamedMethod> = options.methods.iter().copied().filter(|m| !surfaces || m.is_for_surfaces()).collect();
    let spline = if drawn.iter().any(|m| m.method.filter.is_cubic()) {
        let (spline, _) = make_reference(volume, &filtered(Filter::CUBIC)?, &settings, || clock.left(SPLINE))?;
        Some(Truth::new(&spline)?)
    } else {
        None
    };
    let bench = Bench { reference: Truth::new(&reference)?, spline, clock: &clock };
    let mut renderer = Renderer::new(volume, settings);
    let (_, stats) = renderer.render(scene)?;
    let slices = if matches!(scene.slicing(), Slicing::Tolerance(_)) { 256 } else { stats.slices.max(1) };
    let quality = bench.quality_fits(options.methods.len())?;
    let mut found = Found { points: Vec::new(), scenes: Vec::new(), pictures: Vec::new(), slices, quality };
    let mut missing = Vec::new();
    for (i, method) in options.methods.iter().enumerate() {
        clock.now(method.name)?;
        if surfaces && !method.is_for_surfaces() {
            missing.push(Some(NOT_FOR_SURFACES.into()));
            continue;
        }
        // Those that a user would choose get more of the time.
        let weight =
            |m: &NamedMethod| if m.expected_order().is_none_or(|p| p > 1) && m.other_limit.is_none() && m.first < MANY { 3.0 } else { 1.0 };
        let share = clock.left(FIRST) * weight(method) / options.methods[i..].iter().map(|m| weight(m)).sum::<f64>();
        missing.push(match bench.series(&mut renderer, scene, method, share, &mut found) {
            Ok(()) => None,
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(e) => Some(e.to_string()),
        });
    }
    bench.judge_pictures(&mut found)?;
    clock.now("details")?;
    let linear = filtered(Filter::Linear)?;
    let search = details::Search {
        volume,
        scene: &linear,
        truth: &bench.reference,
        reference_pixel: reference_seconds / reference.pixels().len().max(1) as f64,
        clock: &clock,
        part: DETAILS,
        timed: DETAILS_TIMED,
    };
    let (details, shown, detail_truth) = details::measure(&search, &mut renderer, &found.points)?;
    clock.now("times")?;
    bench.repeat(&mut renderer, &mut found)?;
    let methods = options.methods.iter().zip(missing).map(|(method, missing)| MethodRecord {
        name: method.name.into(),
        about: method.about.into(),
        expected_order: method.expected_order().filter(|_| !surfaces),
        measured_order: advice::order(method, &found.points),
        other_limit: method.other_limit.map(Into::into),
        missing,
    });
    let methods = methods.collect();
    clock.now("stages")?;
    let stages = stages::measure(&mut renderer, scene, &drawn, slices, || clock.left(STAGES))?;
    clock.now("gradients")?;
    let gradients = gradients::measure(volume, &mut renderer, scene, slices, &clock, GRADIENTS)?;
    clock.now("hits")?;
    let hits = hits::measure(volume, &mut renderer, scene, slices, &clock, HITS)?;
    clock.now("algorithms")?;
    let algorithms = algorithms::measure(volume, &mut renderer, scene, slices, &clock, ALGORITHMS)?;
    clock.now("balance")?;
    let balance = balance::measure(volume, scene, &options.settings, slices, || clock.left(BALANCE))?;
    clock.now("sizes")?;
    let costs = cost::measure(volume, scene, &options.settings, slices, &clock, COSTS)?;
    let advice = advice::advice(&options.methods, &found.points);
    let bend = advice::bend(volume, scene, slices)?;
    let pre_integration = advice::pre_integration(&found.points, bend);
    let (width, height) = scene.size();
    let setting = Setting {
        name: volume.name().into(),
        dimensions: volume.grid().dims(),
        voxel_type: volume.voxels().voxel_type().name().into(),
        image: [width, height],
        slices,
        threads: stats.threads,
        simd: stats.simd.into(),
        budget: options.budget,
        seconds: clock.gone(),
        reference_step: region.step,
        reference_pixels: reference.pixels().len(),
        reference_bound: reference.error_bound(),
        reference_seconds,
        version: env!("CARGO_PKG_VERSION").into(),
    };
    let record = Record {
        setting,
        details,
        methods,
        points: found.points,
        stages,
        costs,
        gradients,
        hits,
        algorithms,
        balance,
        advice,
        pre_integration,
    };
    Ok(Study { record, reference: bench.reference.shown, pictures: found.pictures, details: shown, detail_truth })
}

/// The reference on as many pixels as its part of the budget pays for, and the seconds it took.
fn make_reference(volume: &Volume, scene: &Scene, settings: &Settings, left: impl Fn() -> f64) -> Result<(ReferenceImage, f64)> {
    let mut builder = ThreadPoolBuilder::new();
    if let Some(threads) = settings.threads {
        builder = builder.num_threads(threads);
    }
    let pool = builder.build().map_err(|e| Error::invalid(format!("threads: {e}")))?;
    let (width, height) = scene.size();
    let coarse = (width.max(height) / 24).max(1);
    let start = Instant::now();
    let probe = pool.install(|| image(scene, volume, Region::every(scene, coarse)))?;
    let probed = start.elapsed().as_secs_f64();
    let per_pixel = probed / probe.pixels().len() as f64;
    // Every step-th column and row of so many pixels as there is time for.
    let affordable = left() / per_pixel;
    let step = libm::ceil((f64::from(width) * f64::from(height) / affordable.max(1.0)).sqrt()).clamp(1.0, f64::from(coarse)) as u32;
    if step == coarse {
        return Ok((probe, probed));
    }
    let start = Instant::now();
    let whole = pool.install(|| image(scene, volume, Region::every(scene, step)))?;
    Ok((whole, start.elapsed().as_secs_f64()))
}

/// What was found so far.
struct Found {
    points: Vec<Point>,
    /// The scene of each point.
    scenes: Vec<Scene>,
    pictures: Vec<(String, u64, Displayed)>,
    /// Slices the scene itself asks for.
    slices: u64,
    /// Whether there is time for SSIM and FLIP of every picture.
    quality: bool,
}

/// A reference, on every so many columns and rows.
pub(super) struct Truth {
    pub(super) shown: Displayed,
    pub(super) region: Region,
}

impl Truth {
    fn new(reference: &ReferenceImage) -> Result<Self> {
        Ok(Self { shown: Displayed::over_black(reference.size().0, reference.pixels())?, region: reference.region() })
    }

    /// A picture on the pixels that the reference has.
    pub(super) fn sampled(&self, picture: &Picture) -> Result<Displayed> {
        sampled(picture, self.region.step)
    }

    /// SSIM and FLIP.
    fn quality(&self, shown: &Displayed) -> Result<(f64, f64)> {
        let (ssim, flip) =
            rayon::join(|| metrics::ssim(&self.shown, shown), || metrics::flip(&self.shown, shown, metrics::DEFAULT_PIXELS_PER_DEGREE));
        Ok((ssim?, flip?))
    }
}

/// What pictures are held against.
struct Bench<'c> {
    /// The trilinear field's.
    reference: Truth,
    /// The spline's, where a method looks that up.
    spline: Option<Truth>,
    clock: &'c Clock,
}

impl Bench<'_> {
    /// Pictures of one method: ever more slices, or ever smaller tolerances, for about `share` seconds. Each is made twice.
    fn series(&self, renderer: &mut Renderer, scene: &Scene, method: &NamedMethod, share: f64, found: &mut Found) -> Result<()> {
        let end = self.clock.gone() + share;
        let base = method.of(scene)?;
        let truth = self.truth(method);
        let steps: Vec<(Slicing, Option<f64>)> = if method.tolerance {
            TOLERANCES.iter().map(|&t| (Slicing::Tolerance(t), Some(t))).collect()
        } else {
            let counts = std::iter::successors(Some(method.first), |n| Some(2 * n)).take_while(|&n| n <= MOST);
            counts.map(|n| (Slicing::Count(n), None)).collect()
        };
        let mut before: Option<Displayed> = None;
        let mut last_seconds = 0.0;
        for (i, (slicing, tolerance)) in steps.into_iter().enumerate() {
            // The next takes about twice the last, and is made twice. Fewer than three pictures show no order.
            let least = if method.first < MANY { 3 } else { 1 };
            if i >= least && 4.0 * last_seconds > end - self.clock.gone() {
                break;
            }
            let scene = base.clone().with_slices(slicing)?.with_terminate(terminate(base.terminate(), slicing))?;
            let (picture, stats) = renderer.render(&scene)?;
            let seconds = stats.render_seconds.min(renderer.render(&scene)?.1.render_seconds);
            let shown = truth.sampled(&picture)?;
            let slices = match slicing {
                Slicing::Count(n) => n,
                _ => stats.slices,
            };
            let difference = metrics::difference(&truth.shown, &shown)?;
            let compared = difference.steps.iter().sum::<u64>().max(1);
            let at_scene = slices == found.slices.next_power_of_two() && tolerance.is_none();
            let quality = found.quality.then(|| truth.quality(&shown)).transpose()?;
            let change = match (&before, tolerance) {
                (Some(before), None) => Some(metrics::difference(before, &shown)?.rms),
                _ => None,
            };
            // The spline's pictures show another field than the reference beside them.
            if at_scene && !method.method.filter.is_cubic() {
                found.pictures.push((method.name.into(), slices, shown.clone()));
            }
            found.points.push(Point {
                method: method.name.into(),
                slices,
                tolerance,
                seconds,
                prepare_seconds: stats.prepare_seconds,
                repeats: 1,
                fetches: stats.fetches,
                rms: difference.rms,
                max: difference.max,
                p999: difference.p999,
                psnr: difference.psnr.is_finite().then_some(difference.psnr),
                visible: 1.0 - difference.steps.first().copied().unwrap_or(0) as f64 / compared as f64,
                ssim: quality.map(|q| q.0),
                flip: quality.map(|q| q.1),
                change,
                estimate: stats.error_estimate,
            });
            found.scenes.push(scene);
            last_seconds = seconds + stats.prepare_seconds;
            let settled = change.is_some_and(|c| c < SETTLED * difference.rms);
            if difference.rms < ENOUGH || settled {
                break;
            }
            before = Some(shown);
        }
        Ok(())
    }

    /// What pictures of `method` are held against.
    fn truth(&self, method: &NamedMethod) -> &Truth {
        self.spline.as_ref().filter(|_| method.method.filter.is_cubic()).unwrap_or(&self.reference)
    }

    /// SSIM and FLIP of the pictures at the scene's slice count at least, while there is time.
    fn judge_pictures(&self, found: &mut Found) -> Result<()> {
        for (method, slices, shown) in &found.pictures {
            let Some(point) = found.points.iter_mut().find(|p| p.method == *method && p.slices == *slices && p.ssim.is_none()) else {
                continue;
            };
            if self.clock.left(JUDGED) <= 0.0 {
                break;
            }
            self.clock.now("SSIM and FLIP")?;
            let (ssim, flip) = self.reference.quality(shown)?;
            (point.ssim, point.flip) = (Some(ssim), Some(flip));
        }
        Ok(())
    }

    /// Makes all pictures again, one after the other and round after round: whatever else the machine does for a while
    /// then falls on all of them alike. The shortest time of each counts.
    fn repeat(&self, renderer: &mut Renderer, found: &mut Found) -> Result<()> {
        for _ in 0..REPEATS {
            for (point, scene) in found.points.iter_mut().zip(&found.scenes) {
                if self.clock.left(PICTURES) < point.seconds + point.prepare_seconds {
                    continue;
                }
                let (_, stats) = renderer.render(scene)?;
                point.seconds = point.seconds.min(stats.render_seconds);
                point.repeats += 1;
            }
        }
        Ok(())
    }

    /// Whether SSIM and FLIP of about ten pictures of each method would take a small part of the time that is left.
    fn quality_fits(&self, methods: usize) -> Result<bool> {
        let start = Instant::now();
        self.reference.quality(&self.reference.shown)?;
        Ok(start.elapsed().as_secs_f64() * 10.0 * (methods as f64) < 0.15 * self.clock.left(FIRST))
    }
}

/// A picture on the pixels that a reference of every `step`-th column and row has.
pub(super) fn sampled(picture: &Picture, step: u32) -> Result<Displayed> {
    let (step, width) = (step as usize, picture.width() as usize);
    let rows = picture.pixels().chunks(width).step_by(step);
    let pixels: Vec<[f32; 4]> = rows.flat_map(|row| row.iter().step_by(step).copied()).collect();
    Displayed::over_black(width.div_ceil(step), &pixels)
}

/// The transmittance at which pixels end: the scene's, and less for finer slices.
pub(super) fn terminate(scene: f32, slicing: Slicing) -> f32 {
    match slicing {
        Slicing::Count(n) if n > 256 => scene * (256.0 / n as f32) * (256.0 / n as f32),
        _ => scene,
    }
}
