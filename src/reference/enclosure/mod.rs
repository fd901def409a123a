//! The truth of one ray, proven: numbers that it lies between.
//!
//! [`Integrator`](super::Integrator) computes the integral to many digits and estimates its own error. Here every step is done in intervals
//! that are rounded outwards, so that what comes out is a theorem about the scene's numbers, as far as this code does what it says: colour and
//! transmittance lie between the bounds. The two share the scene, the volume and the view alone, and are held against each other in tests.
//!
//! ```text
//!  walk      ray -> pieces within one cell, slivers at faces       (depths that are known up to rounding)
//!  field     piece -> cubic of intervals, ranges                   (Bernstein's coefficients)
//!  table     range of values -> range of extinction, of colour     (exact lines between points; steps)
//!  piece     part of a piece -> T and colour                       (ranges, Taylor's series with remainder, change of variables)
//!  ray       parts -> pixel; halves the parts that widen it most
//! ```
//!
//! # What is enclosed
//! For the pixel's centre, C = integral of c kappa T over the ray's length and T, with straight colour c, extinction
//! kappa = -ln(1 - a) / L0 of the opacity a per reference length L0, and T = exp(-integral of kappa). The numbers of camera
//! ([`View`]: eye, axes, scale), grid (its map from world to index space), transfer function, clip planes, fog and voxels are
//! taken as exact, and the arithmetic between them as that of the real numbers.

mod field;
mod fog;
mod interval;
mod piece;
mod ray;
mod rounding;
mod series;
mod table;
#[cfg(test)]
mod tests;
mod walk;

use crate::scene::{Blend, Filter, Fog, FogWeighting, OptionalStage, Scene, View};
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;
use interval::Interval;
use table::Table;

/// Bounds that the truth of one pixel lies between, each a least and a greatest number.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Enclosure {
    /// Premultiplied red, green and blue of the volume alone, fog included, the background not; within `[0,1]`.
    pub rgb: [[f64; 2]; 3],
    /// How much of what lies behind the volume shines through, within `[0,1]`.
    pub transmittance: [f64; 2],
    /// Premultiplied red, green, blue and alpha over the scene's background.
    pub pixel: [[f64; 2]; 4],
    /// The largest width among all of these bounds.
    pub width: f64,
    /// Parts of the ray that were put together.
    pub parts: usize,
}

impl Enclosure {
    fn of(rgb: [Interval; 3], transmittance: Interval, pixel: [Interval; 3], alpha: Interval, parts: usize) -> Self {
        let alpha = (Interval::ONE - transmittance * (Interval::ONE - alpha)).clamp(0.0, 1.0);
        let pixel = [pixel[0], pixel[1], pixel[2], alpha];
        let width = rgb.iter().chain(&pixel).chain([&transmittance]).map(|x| x.width()).fold(0.0, f64::max);
        // Without the sign that rounding may leave to a 0.
        let bounds = |x: Interval| [x.lo() + 0.0, x.hi() + 0.0];
        Self { rgb: rgb.map(bounds), transmittance: bounds(transmittance), pixel: pixel.map(bounds), width, parts }
    }

    /// The largest distance of a pixel (premultiplied red, green, blue, alpha) from any pixel within the bounds, component by component.
    pub fn farthest(&self, pixel: [f32; 4]) -> [f64; 4] {
        std::array::from_fn(|i| {
            let [lo, hi] = self.pixel[i];
            let distance = |x: f64| rounding::add_up(x, -f64::from(pixel[i])).max(rounding::add_up(f64::from(pixel[i]), -x));
            distance(lo).max(distance(hi))
        })
    }

    /// The smallest distance of a pixel from the bounds, component by component: 0 within them.
    pub fn nearest(&self, pixel: [f32; 4]) -> [f64; 4] {
        std::array::from_fn(|i| {
            let [lo, hi] = self.pixel[i];
            let x = f64::from(pixel[i]);
            rounding::add_down(lo, -x).max(rounding::add_down(x, -hi)).max(0.0)
        })
    }
}

/// Encloses pixels of one scene over one volume, one ray at a time.
///
/// ```
/// # fn main() -> slicestack::Result<()> {
/// use slicestack::reference::{Integrator, Prover};
/// use slicestack::volume::phantom::Phantom;
/// use slicestack::Scene;
///
/// let volume = Phantom::MarschnerLobb.volume(16)?;
/// let scene = Scene::new(Phantom::MarschnerLobb.default_transfer(16)).with_size(32, 32)?;
/// let bounds = Prover::new(&scene, &volume)?.pixel(16, 16, 1e-4);
/// assert!(bounds.width <= 1e-4);
/// let (color, _) = Integrator::new(&scene, &volume)?.pixel(16, 16);
/// assert!(bounds.pixel[0][0] <= color.rgb[0] && color.rgb[0] <= bounds.pixel[0][1]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Prover<'a> {
    volume: &'a Volume,
    view: View,
    table: Table,
    /// Half-spaces normal . p >= offset.
    planes: Vec<(DVec3, f64)>,
    fog: Option<Fog>,
    /// Premultiplied colour behind the volume, and its alpha.
    background: [Interval; 3],
    background_alpha: Interval,
    opacity_unit: f64,
}

impl<'a> Prover<'a> {
    /// A prover for `scene` over `volume`. The way a scene classifies and slices plays no part: the truth is that of values interpolated
    /// linearly, then classified.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the volume holds colours, when the camera cannot be resolved, and for what is not enclosed: blends other than
    /// over, filters other than linear, light, opacity by gradient, functions of value and gradient, regions, labels, linear light, fog of literal weighting, the
    /// profile `opengl`.
    pub fn new(scene: &Scene, volume: &'a Volume) -> Result<Self> {
        volume.check_scalars("bounds of rays")?;
        if let Some(what) = refused(scene) {
            return Err(Error::invalid(format!("{what}: no bounds can be proven for it")));
        }
        let (width, height) = scene.size();
        let straight = scene.background();
        let alpha = Interval::point(straight.alpha);
        let fog = scene.fog().copied();
        let background = std::array::from_fn(|i| {
            let plain = alpha * Interval::point(straight.rgb[i]);
            match fog.filter(|_| scene.fogged_background()) {
                Some(fog) => {
                    // As everywhere the farthest distance is the greatest f64.
                    let f = fog::factor(fog.mode(), Interval::point(f64::MAX));
                    (f * plain + (Interval::ONE - f) * alpha * Interval::point(fog.color()[i])).clamp(0.0, 1.0)
                }
                None => plain,
            }
        });
        Ok(Self {
            volume,
            view: scene.camera().resolve(volume.grid(), width, height)?,
            table: Table::new(scene.transfer()),
            planes: scene.clip_planes().iter().map(|p| (p.normal(), p.offset())).collect(),
            fog,
            background,
            background_alpha: alpha,
            opacity_unit: scene.opacity_length(volume.grid()),
        })
    }

    /// Bounds of the pixel in column `x` and row `y` that are not farther apart than `width`, where that can be reached within a fixed amount
    /// of work; [`Enclosure::width`] tells. The same on every machine and for every number of threads.
    pub fn pixel(&self, x: u32, y: u32, width: f64) -> Enclosure {
        // Nobody stops it.
        self.pixel_unless(x, y, width, &|| false).unwrap_or_else(|| self.unknown())
    }

    /// As [`Prover::pixel`]; `None` as soon as `stop`, asked often, says so.
    pub fn pixel_unless(&self, x: u32, y: u32, width: f64, stop: &dyn Fn() -> bool) -> Option<Enclosure> {
        ray::enclose(self, (f64::from(x) + 0.5, f64::from(y) + 0.5), width, stop)
    }

    /// Bounds that hold for every ray.
    fn unknown(&self) -> Enclosure {
        Enclosure::of([Interval::UNIT; 3], Interval::UNIT, [Interval::UNIT; 3], self.background_alpha, 0)
    }
}

/// What of a scene has no bounds here.
fn refused(scene: &Scene) -> Option<&'static str> {
    if scene.blend() != Blend::Over {
        return Some("render blend other than over");
    }
    if scene.method().filter != Filter::Linear {
        return Some("render filter other than linear");
    }
    if scene.opengl().is_some() {
        return Some("render profile opengl");
    }
    if !scene.cuts().is_empty() {
        return Some("cut planes inside the picture");
    }
    if scene.linear_light() {
        return Some("render linear_light");
    }
    // No wildcard: a stage without an answer here does not compile.
    OptionalStage::wanted(scene).find_map(|stage| match stage {
        OptionalStage::Fog if scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal) => Some("fog weighting literal"),
        OptionalStage::Fog | OptionalStage::Gradient => None,
        OptionalStage::Regions => Some("region"),
        OptionalStage::Labels => Some("labels"),
        OptionalStage::Light => Some("light"),
        OptionalStage::GradientOpacity => Some("transfer gradient_opacity"),
        OptionalStage::Transfer2d => Some("a transfer function of value and gradient (transfer2d)"),
    })
}
