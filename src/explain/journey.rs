//! One pixel's way through the volume, in plain columns: what a probe shows.

use super::check_stages;
use super::record::Context;
use super::recorder::{Recorder, Wanted};
use crate::proxy::Stack;
use crate::scene::{Method, Scene, Slicing};
use crate::{Error, Renderer, Result};
use std::sync::Arc;

/// Most slices of a journey.
const MOST: u64 = 4096;

/// What each slice adds to a pixel, front to back. All columns are equally long.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct PixelJourney {
    /// The pixel of the picture in these slices: premultiplied RGBA over the background.
    pub pixel: [f32; 4],
    /// Slices of the stack.
    pub slices: u64,
    /// Distance of two of them, world units along the view direction.
    pub spacing: f64,
    /// Depth of each slice that covers the pixel, world units along the view direction.
    pub depth: Vec<f64>,
    /// Value there, in the data's units.
    pub value: Vec<f64>,
    /// Opacity of the slab; 0 throughout where values are projected.
    pub opacity: Vec<f32>,
    /// Premultiplied colour of the slab.
    pub color: Vec<[f32; 3]>,
    /// What is left of the light behind the slab.
    pub transmittance: Vec<f64>,
    /// What is followed in the place of what the scene asks for, one line each.
    pub notes: Vec<String>,
}

/// What each slice of `scene` adds to `pixel` (column, row). Only the pixel's block is rendered.
///
/// Slices that were passed over because nothing shows in them are there with opacity 0; those behind the one that finishes the pixel are left out.
/// A scene with a tolerance is followed in slices half a voxel apart.
///
/// # Errors
/// [`Error::Invalid`] for scenes that [`super::explain`] refuses too, and for a pixel outside the picture; else as [`Renderer::render`].
pub fn journey(renderer: &mut Renderer, scene: &Scene, pixel: (u32, u32)) -> Result<PixelJourney> {
    let volume = Arc::clone(renderer.volume());
    volume.check_scalars("a pixel's journey")?;
    check_stages(scene)?;
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let mut notes = Vec::new();
    let spaced = |spacing: f64| {
        let (near, far) = Stack::depth_range(volume.grid(), &view).unwrap_or_default();
        (libm::ceil((far - near) / spacing) as u64).max(1)
    };
    let wanted = match scene.slicing() {
        Slicing::Count(count) => count,
        Slicing::Spacing(spacing) => spaced(spacing * (1.0 + 1e-12)),
        Slicing::Tolerance(_) => {
            notes.push("Blocks of pixels choose their slices themselves; the plot shows slices half a voxel apart.".to_owned());
            spaced(0.5 * volume.grid().smallest_spacing())
        }
    };
    let count = wanted.min(MOST);
    if count < wanted {
        notes.push(format!("The scene has {wanted} slices; the plot shows {count}."));
    }
    let method = scene.method();
    if method.merge || method.extrapolate {
        notes.push("The plot shows every slice, none of them merged or extrapolated.".to_owned());
    }
    let plain = scene.clone().with_method(Method { merge: false, extrapolate: false, ..method })?.with_slices(Slicing::Count(count))?;
    if renderer.plan(&plain).is_some_and(|plan| plan.labels().is_some() && !plan.needs.colors()) {
        return Err(Error::invalid("render.filter nearest: values are projected as places between the transfer function's points"));
    }
    let recorder = Recorder::new(Arc::new(Wanted::new(&[pixel], 0..count, count)));
    let (color, seen) = renderer.render_block(&plain, count, pixel, recorder)?;
    let stack = Stack::new(volume.grid(), &view, scene.clip_planes(), count);
    let mut found = PixelJourney { pixel: color, slices: count, spacing: stack.spacing, notes, ..PixelJourney::default() };
    let Some(journey) = seen.journeys.get(&0) else { return Ok(found) };
    let (scale, offset) = Context { volume: &volume, scene: &plain, to_f32: seen.to_f32 }.scale();
    let blends = scene.blend().blends_colors();
    // Nothing shows in what was passed over; values are there all the same.
    let mut slabs: Vec<(f64, f64, f32, [f32; 3])> = Vec::new();
    let (first, last) = journey.span.unwrap_or((1, 0));
    let window = (f64::from(pixel.0) + 0.5, f64::from(pixel.1) + 0.5);
    for run in journey.skipped.iter().filter(|run| !run.finished) {
        for k in run.from.max(first)..run.to.min(last + 1) {
            let depth = stack.depth(k);
            slabs.push((depth, volume.sample(stack.index_at(window.0, window.1, depth)), 0.0, [0.0; 3]));
        }
    }
    for step in &journey.steps {
        let after = step.after();
        if after.covered {
            let (alpha, color) = if blends { (after.alpha, after.color) } else { (0.0, [0.0; 3]) };
            slabs.push((f64::from(step.depth), scale * f64::from(after.value) + offset, alpha, color));
        }
    }
    slabs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = 1.0;
    for (depth, value, alpha, color) in slabs {
        left *= 1.0 - f64::from(alpha);
        found.depth.push(depth);
        found.value.push(value);
        found.opacity.push(alpha);
        found.color.push(color);
        found.transmittance.push(left);
    }
    Ok(found)
}
