//! The picture building up, slab by slab.

use super::{plain, steady};
use crate::picture::png::Animation;
use crate::raster::Observer;
use crate::scene::{Order, Scene};
use crate::{Error, Picture, Renderer, Result, Settings, Volume};
use std::ops::Range;

/// Asks for the first slices of the stack only, in the scene's order.
struct Upto {
    slices: Range<i64>,
}

impl Observer for Upto {
    fn fresh(&self) -> Self {
        Self { slices: self.slices.clone() }
    }

    fn slices(&self, covered: Range<i64>) -> Range<i64> {
        covered.start.max(self.slices.start)..covered.end.min(self.slices.end)
    }

    fn merge(&mut self, _: Self) {}
}

/// Renders `scene` building up in at most `frames` pictures: each with more slices than the one before, the last with all of them
/// and equal to the picture itself (but for scenes that extrapolate or ask for a tolerance: see [`super::explain`]). Hands each to `each`, with its number, and returns them all as an animated PNG that runs without
/// end: 12 pictures a second, the last for two seconds.
///
/// # Errors
/// As [`Renderer::render`]; [`Error::Invalid`] when the whole box lies behind the eye or the scene is of the profile `opengl`; whatever `each` says.
pub fn build_up(
    volume: &Volume,
    scene: &Scene,
    settings: &Settings,
    frames: u32,
    mut each: impl FnMut(u32, &Picture) -> Result<()>,
) -> Result<Vec<u8>> {
    let mut renderer = Renderer::new(volume, plain(settings));
    let steady = steady(&mut renderer, scene, None)?;
    let scene = &steady.scene;
    let count = steady.stats.slices;
    if count == 0 {
        return Err(Error::invalid("the whole box lies behind the eye: there is nothing to build up"));
    }
    let n = u64::from(frames.max(1)).min(count);
    let back = scene.blending_order() == Order::BackToFront;
    let mut bytes = Vec::new();
    let mut animation = Animation::begin(&mut bytes, scene.size().0, scene.size().1, n as u32, 12)?;
    for i in 1..=n {
        let done = (count * i / n) as i64;
        let slices = if back { count as i64 - done..count as i64 } else { 0..done };
        let frame = renderer.render_observed(scene, Upto { slices })?.0;
        each(i as u32 - 1, &frame)?;
        if i == n {
            animation.slow(2)?;
        }
        animation.frame(&frame)?;
    }
    animation.finish()?;
    Ok(bytes)
}
