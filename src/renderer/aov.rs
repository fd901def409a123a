//! Planes beside the picture: depth, normal, value and opacity of each pixel.
//!
//! An observer looks on while the picture is made and notes where each ray ends up; that changes no pixel. Pictures of several frames, of
//! merged slabs and from back to front have no such place while they are made: there a frame of plain slabs, front to back and as many as the
//! picture's, is rendered after it.

use super::{Backend, RenderStats, Renderer};
use crate::picture::{Aov, Picture, Plane};
use crate::proxy::Stack;
use crate::raster::{Looker, Seen, Surface, Told};
use crate::scene::{Blend, Method, Order, Scene, Slicing, unit};
use crate::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;

/// Pixels between two looks at whether somebody wants to stop.
const AT_A_TIME: usize = 1 << 14;

impl Renderer {
    /// As [`Renderer::render`], with `planes` beside the picture, in their order. The picture is the same with and without them.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Invalid`] for scenes whose rays end up nowhere: of the profile `opengl`, of algorithms that go ray by ray, and of blends other than
    /// [`Blend::Over`], [`Blend::Iso`] and [`Blend::Surfaces`]; and where there is no memory for the planes.
    pub fn render_with(&mut self, scene: &Scene, planes: &[Aov]) -> Result<(Picture, RenderStats, Vec<Plane>)> {
        if planes.is_empty() {
            let (picture, stats) = self.render(scene)?;
            return Ok((picture, stats, Vec::new()));
        }
        check(scene, planes[0])?;
        if let Some(aov) = planes.iter().find(|aov| matches!(aov, Aov::Value | Aov::Normal)) {
            self.volume.check_scalars(&format!("aov {}", aov.name()))?;
        }
        let told = match scene.blend() {
            Blend::Over => Told::Transmittance { between: scene.method().is_pre_integrated() },
            _ if scene.surfaces().is_some() => Told::Surfaces,
            _ => Told::FirstCrossing,
        };
        let method = scene.method();
        let counted = !matches!(scene.slicing(), Slicing::Tolerance(_));
        let (picture, stats, looker) = if counted && !method.merge && !method.extrapolate && scene.blending_order() == Order::FrontToBack {
            self.render_observed(scene, Looker::new(told))?
        } else {
            let (picture, stats) = self.render(scene)?;
            let plain = scene.clone().with_slices(Slicing::Count(stats.slices.max(1)))?.with_order(Order::FrontToBack);
            let plain = plain.with_method(Method { merge: false, extrapolate: false, ..method })?;
            let (_, _, looker) = self.render_observed(&plain, Looker::new(told))?;
            (picture, stats, looker)
        };
        let made = self.planes(scene, planes, stats.slices, &looker)?;
        Ok((picture, stats, made))
    }

    /// `planes` from what was seen in `slices` slices.
    fn planes(&self, scene: &Scene, planes: &[Aov], slices: u64, looker: &Looker) -> Result<Vec<Plane>> {
        let (width, height) = scene.size();
        let view = scene.camera().resolve(self.volume.grid(), width, height)?;
        let stack = Stack::new(self.volume.grid(), &view, scene.clip_planes(), slices.max(1));
        let first = Surface { volume: &self.volume, stack: &stack, transfer: scene.transfer() };
        let mut numbers = planes.iter().map(|&aov| empty(aov, width, height)).collect::<Result<Vec<_>>>()?;
        let inside: Vec<&Seen> = looker.seen.iter().filter(|seen| seen.pixel.0 < width && seen.pixel.1 < height).collect();
        let control = self.control();
        for (n, some) in inside.chunks(AT_A_TIME).enumerate() {
            let found: Vec<[f32; 6]> = some.par_iter().map(|seen| self.found(scene, &first, seen, planes)).collect();
            for (seen, [depth, value, alpha, normal @ ..]) in some.iter().zip(found) {
                let at = seen.pixel.1 as usize * width as usize + seen.pixel.0 as usize;
                for (&aov, numbers) in planes.iter().zip(&mut numbers) {
                    match aov {
                        Aov::Depth => numbers[at] = depth,
                        Aov::Value => numbers[at] = value,
                        Aov::Alpha => numbers[at] = alpha,
                        Aov::Normal => numbers[3 * at..3 * at + 3].copy_from_slice(&normal),
                    }
                }
            }
            if !control.step("planes", (n * AT_A_TIME + some.len()) as u64, inside.len() as u64) {
                return Err(Error::Stopped);
            }
        }
        Ok(planes.iter().zip(numbers).map(|(&aov, numbers)| Plane::new(aov, width, height, numbers)).collect())
    }

    /// Depth, value, opacity and normal where the ray of `seen` ends up, as far as `planes` ask for them.
    fn found(&self, scene: &Scene, first: &Surface<'_>, seen: &Seen, planes: &[Aov]) -> [f32; 6] {
        let stack = first.stack;
        let window = (f64::from(seen.pixel.0) + 0.5, f64::from(seen.pixel.1) + 0.5);
        let (depth, level) = match scene.blend() {
            // Levels of one colour have been refined on their way.
            Blend::Iso { level } if seen.level.is_none() && seen.at.is_finite() => {
                (stack.near + (first.refined(level, seen.at, window.0, window.1) + 0.5) * stack.spacing, Some(level))
            }
            _ => (seen.at, seen.level),
        };
        let alpha = seen.alpha;
        if !depth.is_finite() {
            return [f32::INFINITY, f32::NAN, alpha, 0.0, 0.0, 0.0];
        }
        let index = stack.index_at(window.0, window.1, depth);
        let value = if planes.contains(&Aov::Value) { level.unwrap_or_else(|| self.volume.sample(index)) } else { f64::NAN };
        let normal = if planes.contains(&Aov::Normal) { -unit(scene.gradient().at(&self.volume, index)) } else { DVec3::ZERO };
        let [x, y, z] = normal.as_vec3().to_array();
        [depth as f32, value as f32, alpha, x, y, z]
    }
}

/// A plane of pixels whose rays end up nowhere. Memory is refused with a message, not in the allocator with an abort.
fn empty(aov: Aov, width: u32, height: u32) -> Result<Vec<f32>> {
    let count = width as usize * height as usize * aov.channels();
    let mut numbers = Vec::new();
    // Twice: an encoder needs about as much again.
    crate::memory::reserve(&mut numbers, 2 * count).map_err(|_| {
        Error::invalid(format!("aov {}: {width} x {height} pixels: this machine does not give that much memory", aov.name()))
    })?;
    let nothing = match aov {
        Aov::Depth => f32::INFINITY,
        Aov::Value => f32::NAN,
        Aov::Normal | Aov::Alpha => 0.0,
    };
    numbers.resize(count, nothing);
    Ok(numbers)
}

/// # Errors
/// [`Error::Invalid`] for scenes whose rays end up nowhere.
fn check(scene: &Scene, aov: Aov) -> Result<()> {
    let name = aov.name();
    if Backend::of(scene) == Backend::OpenGl {
        return Err(Error::invalid(format!("aov {name}: the profile opengl draws a framebuffer alone; choose accurate")));
    }
    if scene.algorithm().is_cast() {
        let algorithm = scene.algorithm().name();
        return Err(Error::invalid(format!("aov {name}: render algorithm {algorithm} makes pictures alone; choose slices")));
    }
    if !matches!(scene.blend(), Blend::Over | Blend::Iso { .. } | Blend::Surfaces) {
        return Err(Error::invalid(format!(
            "aov {name}: is for render.blend \"over\" and \"iso\"; other blends end at no place of the ray"
        )));
    }
    Ok(())
}
