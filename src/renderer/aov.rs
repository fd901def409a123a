//! Planes beside the picture: depth, normal, value and opacity of each pixel.
//!
//! An observer looks on while the picture is made and notes where each ray ends up; that changes no pixel. Pictures of several frames, of
//! merged slabs and from back to front have no such place while they are made: there a frame of plain slabs, front to back and as many as the
//! picture's, is rendered after it.

use super::{Backend, RenderStats, Renderer};
use crate::picture::{Aov, Picture, Plane};
use crate::proxy::Stack;
use crate::raster::{Looker, Surface, Told};
use crate::scene::{Blend, Method, Order, Scene, Slicing, unit};
use crate::{Error, Result};

impl Renderer {
    /// As [`Renderer::render`], with `planes` beside the picture, in their order. The picture is the same with and without them.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Invalid`] for scenes whose rays end up nowhere: of the profile `opengl`, and of blends other than
    /// [`Blend::Over`], [`Blend::Iso`] and [`Blend::Surfaces`]; and where there is no memory for the planes.
    pub fn render_with(&mut self, scene: &Scene, planes: &[Aov]) -> Result<(Picture, RenderStats, Vec<Plane>)> {
        if planes.is_empty() {
            let (picture, stats) = self.render(scene)?;
            return Ok((picture, stats, Vec::new()));
        }
        check(scene, planes[0])?;
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
        for seen in looker.seen.iter().filter(|seen| seen.pixel.0 < width && seen.pixel.1 < height) {
            let (x, y) = seen.pixel;
            let window = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (depth, level) = match scene.blend() {
                Blend::Iso { level } if looker.told == Told::FirstCrossing && seen.at.is_finite() => {
                    (stack.near + (first.refined(level, seen.at, window.0, window.1) + 0.5) * stack.spacing, Some(level))
                }
                _ => (seen.at, seen.level),
            };
            let index = depth.is_finite().then(|| stack.index_at(window.0, window.1, depth));
            for (&aov, numbers) in planes.iter().zip(&mut numbers) {
                let at = (y as usize * width as usize + x as usize) * aov.channels();
                match (aov, index) {
                    (Aov::Alpha, _) => numbers[at] = 1.0 - seen.left,
                    (_, None) => {}
                    (Aov::Depth, _) => numbers[at] = depth as f32,
                    (Aov::Value, Some(index)) => numbers[at] = level.unwrap_or_else(|| self.volume.sample(index)) as f32,
                    (Aov::Normal, Some(index)) => {
                        let normal = -unit(scene.gradient().at(&self.volume, index));
                        numbers[at..at + 3].copy_from_slice(&normal.as_vec3().to_array());
                    }
                }
            }
        }
        Ok(planes.iter().zip(numbers).map(|(&aov, numbers)| Plane::new(aov, width, height, numbers)).collect())
    }
}

/// A plane of pixels whose rays end up nowhere. Memory is refused with a message, not in the allocator with an abort.
fn empty(aov: Aov, width: u32, height: u32) -> Result<Vec<f32>> {
    let count = width as usize * height as usize * aov.channels();
    let mut numbers = Vec::new();
    // Twice: an encoder needs about as much again.
    numbers.try_reserve_exact(2 * count).map_err(|_| {
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
    if !matches!(scene.blend(), Blend::Over | Blend::Iso { .. } | Blend::Surfaces) {
        return Err(Error::invalid(format!(
            "aov {name}: is for render.blend \"over\" and \"iso\"; other blends end at no place of the ray"
        )));
    }
    Ok(())
}
