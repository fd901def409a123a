//! One case: rendered, watched, held against the reference.

use super::Row;
use crate::fragment::{Batch, Frame};
use crate::lanes::BATCH;
use crate::proxy::Stack;
use crate::raster::Observer;
use crate::reference::{Region, closed, image};
use crate::scene::{Camera, Placement, Projection, Slicing, StageId, TransferFunction};
use crate::volume::{Grid, Voxels};
use crate::{Error, Picture, RenderStats, Renderer, Result, Scene, Settings, Volume};
use glam::DVec3;

/// Sees transmittances fall, or not.
#[derive(Debug)]
pub(super) struct Descent {
    before: [f32; BATCH],
    /// Transmittances that rose, left [0,1] or were NaN.
    pub(super) broken: u64,
    /// Transmittances looked at.
    pub(super) seen: u64,
}

impl Default for Descent {
    fn default() -> Self {
        Self { before: [1.0; BATCH], broken: 0, seen: 0 }
    }
}

impl Observer for Descent {
    fn fresh(&self) -> Self {
        Self::default()
    }

    fn block(&mut self, _: &Stack, _: u32, _: u32, batch: &Batch) {
        self.before = batch.pixels.transmittance;
    }

    fn stage(&mut self, id: StageId, _: &Frame<'_>, batch: &Batch) {
        if id == StageId::Blend {
            for (before, &t) in self.before.iter_mut().zip(&batch.pixels.transmittance) {
                // Also false for NaN.
                let falls = t <= *before && (0.0..=1.0).contains(&t);
                self.broken += u64::from(!falls);
                *before = t;
            }
            self.seen += BATCH as u64;
        }
    }

    fn merge(&mut self, other: Self) {
        self.broken += other.broken;
        self.seen += other.seen;
    }
}

/// How far a picture may be from the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Bound {
    /// It may be anything within [0,1]: the slices are far too coarse for the case.
    None,
    /// So far in any component.
    Absolute(f64),
    /// A uniform medium of optical depth `depth`: its colours to this part of the closed form, opacity, which is made from what is
    /// left of the light, to 2e-6.
    Part { part: f64, depth: f64 },
}

/// An extreme case.
pub(super) struct Case {
    pub(super) group: &'static str,
    pub(super) case: String,
    pub(super) volume: Volume,
    pub(super) scene: Scene,
    pub(super) bound: Bound,
}

/// Where cases are rendered.
pub(super) struct Bench<'s> {
    settings: &'s Settings,
}

impl<'s> Bench<'s> {
    pub(super) fn new(settings: &'s Settings) -> Self {
        Self { settings }
    }

    /// A renderer of `volume`, for several pictures of it.
    pub(super) fn renderer(&self, volume: &Volume) -> Renderer {
        Renderer::new(volume, self.settings.clone())
    }

    /// A picture, what it cost, and what became of transmittances on the way.
    pub(super) fn render(&self, volume: &Volume, scene: &Scene) -> Result<(Picture, RenderStats, Descent)> {
        self.renderer(volume).render_observed(scene, Descent::default())
    }

    /// Renders a case and says whether it holds.
    ///
    /// # Errors
    /// [`Error::Stopped`] alone: everything else is the row's.
    pub(super) fn judge(&self, case: Case) -> Result<Row> {
        let Case { group, case, volume, scene, bound } = case;
        let promise = match bound {
            Bound::None => "finite, in [0,1], transmittance never rises".to_owned(),
            Bound::Absolute(b) => format!("finite, in [0,1], transmittance never rises, error <= {b:.0e}"),
            Bound::Part { part, .. } => format!("finite, in [0,1], transmittance never rises, error <= {part:.0e} of the colour"),
        };
        let row = |measured: String, error: Option<f64>, bound: Option<f64>, holds: bool| Row {
            group: group.into(),
            case: case.clone(),
            promise: promise.clone(),
            measured,
            error,
            bound,
            holds,
        };
        let failed = |e: Error| match e {
            Error::Stopped => Err(Error::Stopped),
            e => Ok(row(format!("failed: {e}"), None, None, false)),
        };
        let (picture, stats, descent) = match self.render(&volume, &scene) {
            Ok(done) => done,
            Err(e) => return failed(e),
        };
        let components = || picture.pixels().iter().flatten().copied();
        let odd = components().filter(|c| !c.is_finite()).count();
        let (low, high) = components().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), c| (a.min(c), b.max(c)));
        let mut holds = odd == 0 && low >= 0.0 && high <= 1.0 && descent.broken == 0;
        let mut measured = format!("{} to {}", number(f64::from(low)), number(f64::from(high)));
        if odd > 0 {
            measured += &format!(", {odd} not finite");
        }
        measured += &match (descent.broken, stats.fragments) {
            (0, 0) => ", no fragments".to_owned(),
            (0, _) => ", transmittance falls".to_owned(),
            (n, _) => format!(", transmittance rises or leaves [0,1] {n} times"),
        };
        let most = match bound {
            Bound::None => return Ok(row(measured, None, None, holds)),
            Bound::Absolute(most) => most,
            Bound::Part { part, .. } => part,
        };
        let largest = |m: f64, d: f64| if d.is_nan() { f64::INFINITY } else { m.max(d) };
        let worst = match bound {
            Bound::Part { depth, .. } => {
                let part = |p: &[f32; 4]| {
                    (0..3).map(|c| f64::from(p[c]) / closed::constant_color(COLOR[c], depth) - 1.0).map(f64::abs).fold(0.0, largest)
                };
                holds &= picture.pixels().iter().all(|p| (f64::from(p[3]) - closed::opacity(depth)).abs() <= 2e-6);
                picture.pixels().iter().map(part).fold(0.0, largest)
            }
            _ => {
                let want = match image(&scene, &volume, Region::whole(&scene)) {
                    Ok(want) => want,
                    Err(e) => return failed(e),
                };
                let pairs = picture.pixels().iter().zip(want.pixels());
                pairs.flat_map(|(a, b)| (0..4).map(move |c| (f64::from(a[c]) - b[c]).abs())).fold(0.0, largest)
            }
        };
        measured += &format!(", error {}", if worst == 0.0 { "0".into() } else { format!("{worst:.1e}") });
        holds &= worst <= most;
        Ok(row(measured, Some(worst), Some(most), holds))
    }
}

/// A number in few letters.
pub(super) fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e4).contains(&x.abs()) {
        format!("{:.4}", x).trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{x:.1e}")
    }
}

/// Straight colour of uniform media.
pub(super) const COLOR: [f64; 3] = [0.9, 0.5, 0.25];

/// The same colour and opacity for every value.
pub(super) fn constant(opacity: f64) -> Result<TransferFunction> {
    TransferFunction::new(vec![(0.0, COLOR)], vec![(0.0, opacity)])
}

/// Colours that go evenly from one end of the values to the other through constant opacity.
pub(super) fn fade(low: f64, high: f64, opacity: f64) -> Result<TransferFunction> {
    TransferFunction::new(vec![(low, [0.1, 0.4, 1.0]), (high, [1.0, 0.5, 0.2])], vec![(low, opacity)])
}

/// A volume of f32 voxels from a function of their place in [0,1]^3.
pub(super) fn filled(grid: Grid, f: impl Fn([f64; 3]) -> f64) -> Result<Volume> {
    let [nx, ny, nz] = grid.dims();
    let at = |i: usize, n: usize| if n > 1 { i as f64 / (n - 1) as f64 } else { 0.5 };
    let mut values = Vec::with_capacity(nx * ny * nz);
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                values.push(f([at(x, nx), at(y, ny), at(z, nz)]) as f32);
            }
        }
    }
    Volume::new(grid, Voxels::F32(values.into()))
}

/// A camera at `eye` that looks at `target`.
pub(super) fn looking(eye: DVec3, target: DVec3, up: DVec3, projection: Projection) -> Result<Camera> {
    Camera::new(Placement::LookAt { eye, target, up }, projection)
}

/// A small scene of `slices` slices whose pixels never end early.
pub(super) fn scene(transfer: TransferFunction, camera: Camera, slices: u64) -> Result<Scene> {
    Scene::new(transfer).with_camera(camera).with_size(18, 14)?.with_slices(Slicing::Count(slices))?.with_terminate(0.0)
}
