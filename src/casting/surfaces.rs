//! Level surfaces along rays: crossings between samples at equal steps, in f64.
//!
//! ```text
//!   entry    sample f    f+1   ...   sample l   exit    a level between the values at both ends of a piece is crossed in it
//!   --|---------|---------|------------|---------|-->   and found by bisection
//! ```
//! The pieces are those of slices along parallel rays, so crossings are the same; in perspective they are of one length on every ray.

use super::rays::{Steps, StepsAlong};
use super::sight::{Ray, Sight};
use super::{Cast, Scratch, rows};
use crate::proxy::Stack;
use crate::raster::Finish;
use crate::scene::{Blend, Filter, Hit, LitPoint, Scene, Surfaces, unit};
use crate::settings::Control;
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;

/// Share of a surface's colour that does not depend on its direction, where the scene has no light.
const AMBIENT: f64 = 0.2;
/// Halvings of the piece that holds a crossing.
const HALVINGS: u32 = 30;

/// `color` where a surface of this unit normal (0: none) is lit from the eye.
pub(super) fn headlight(color: [f64; 3], normal: DVec3, to_eye: DVec3) -> [f64; 3] {
    let facing = if normal == DVec3::ZERO { 1.0 } else { normal.dot(to_eye).abs() };
    color.map(|c| c * (AMBIENT + (1.0 - AMBIENT) * facing))
}

/// Rays of a scene of level surfaces.
pub(crate) struct SurfaceRays<'s> {
    scene: &'s Scene,
    volume: &'s Volume,
    stack: &'s Stack,
    sight: Sight<'s>,
    steps: Steps,
    surfaces: Surfaces,
    /// Depths at which the box begins and ends.
    depths: (f64, f64),
}

/// What is counted of a row of pixels.
#[derive(Default)]
struct Count(Cast);

impl Scratch for Count {
    fn done(&mut self) -> Cast {
        std::mem::take(&mut self.0)
    }
}

impl<'s> SurfaceRays<'s> {
    /// Those of `scene` through `volume`, at the steps of `stack`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scene without surfaces.
    pub(crate) fn new(scene: &'s Scene, volume: &'s Volume, stack: &'s Stack) -> Result<Self> {
        let surfaces = match (scene.surfaces(), scene.blend()) {
            (Some(surfaces), _) => surfaces,
            (None, Blend::Iso { level }) => Surfaces { levels: vec![(level, scene.transfer().eval(level).rgb, 1.0)], capped: true },
            _ => return Err(Error::invalid("render levels: none are given")),
        };
        Ok(Self {
            scene,
            volume,
            stack,
            sight: Sight::new(stack, volume.grid()),
            steps: Steps::plain(stack),
            surfaces,
            depths: Stack::depth_range(volume.grid(), &stack.view).unwrap_or((stack.near, stack.far)),
        })
    }

    /// Fills `pixels`, on the current thread pool.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `control` says so.
    pub(crate) fn draw(&self, finish: &impl Finish, control: Control<'_>, pixels: &mut [[f32; 4]]) -> Result<Cast> {
        if self.stack.is_empty() {
            pixels.fill(finish.nothing());
            return Ok(Cast::default());
        }
        rows(pixels, self.stack.view.width as usize, control, Count::default, |count, x, y| {
            let Some(ray) = self.sight.ray(f64::from(x) + 0.5, f64::from(y) + 0.5) else { return finish.nothing() };
            finish.pixel(self.pixel(&ray, &mut count.0))
        })
    }

    /// The value at depth `d` of `ray`, data units.
    fn value(&self, ray: &Ray, d: f64) -> f64 {
        let index = ray.at(d);
        match self.scene.method().filter {
            Filter::Nearest => {
                let dims = self.volume.grid().dims();
                self.volume.value([0, 1, 2].map(|a: usize| libm::floor(index[a] + 0.5).clamp(0.0, (dims[a] - 1) as f64) as usize))
            }
            _ => self.volume.sample(DVec3::from_array(index)),
        }
    }

    /// Premultiplied colour of the surfaces that `ray` meets, and the transmittance left.
    fn pixel(&self, ray: &Ray, cast: &mut Cast) -> [f32; 4] {
        let (mut sum, mut left) = ([0.0; 3], 1.0);
        let (mut near, mut front) = (ray.entry, self.value(ray, ray.entry));
        let mut meet = |d: f64, (_, color, opacity): (f64, [f64; 3], f64), left: &mut f64| {
            for (sum, c) in sum.iter_mut().zip(self.color(ray, d, color)) {
                *sum += *left * (opacity * c);
            }
            *left *= 1.0 - opacity;
        };
        if let Some(&level) = self.surfaces.levels.first().filter(|l| self.surfaces.capped && front >= l.0) {
            meet(near, level, &mut left);
        }
        let samples = StepsAlong::new(&self.steps, &self.sight, ray).map(|piece| piece.depth).chain([ray.exit]);
        let mut met = 0;
        for far in samples {
            if left == 0.0 || left < f64::from(self.scene.terminate()) {
                break;
            }
            let back = self.value(ray, far);
            met += 1;
            if far > near && front.is_finite() && back.is_finite() {
                let crossed = |l: &&(f64, [f64; 3], f64)| (front >= l.0) != (back >= l.0);
                let hits = self.surfaces.levels.iter().filter(crossed).map(|l| (self.crossing(ray, l.0, (near, far), front < back), *l));
                let mut hits: Vec<_> = hits.collect();
                hits.sort_by(|a, b| a.0.total_cmp(&b.0));
                hits.into_iter().for_each(|(at, level)| meet(at, level, &mut left));
            }
            (near, front) = (far.max(near), back);
        }
        cast.counters.fragments += met;
        cast.counters.looked_up += met;
        cast.counters.fetches += met;
        cast.counters.lanes += met;
        cast.most = cast.most.max(met);
        let [r, g, b] = sum.map(|c| c as f32);
        [r, g, b, left as f32]
    }

    /// Depth at which the value crosses `level` between two samples.
    fn crossing(&self, ray: &Ray, level: f64, (mut near, mut far): (f64, f64), rising: bool) -> f64 {
        if self.scene.hit() == Hit::FirstSample {
            return far;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if (self.value(ray, middle) >= level) == rising { far = middle } else { near = middle }
        }
        0.5 * (near + far)
    }

    /// A surface's `color` at depth `d` of `ray`, as it is lit.
    fn color(&self, ray: &Ray, d: f64, color: [f64; 3]) -> [f64; 3] {
        let index = DVec3::from_array(ray.at(d));
        let to_eye = -unit(self.stack.view.ray(ray.window.0, ray.window.1).1);
        let gradient = || self.scene.gradient().at(self.volume, index);
        match self.scene.lighting() {
            Some(lighting) => {
                let gradient = if lighting.needs_gradient() { gradient() } else { DVec3::ZERO };
                let position = self.volume.grid().index_to_world().transform_point3(index);
                let deep = ((d - self.depths.0) / (self.depths.1 - self.depths.0)).clamp(0.0, 1.0);
                lighting.shade(color, &LitPoint { position, gradient, to_eye, deep })
            }
            None if self.scene.flat_surfaces() => color,
            None => headlight(color, unit(gradient()), to_eye),
        }
    }
}
