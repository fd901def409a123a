//! A picture that comes coarse at first and then finer, without memory of its own for each frame.

use super::{RenderStats, Renderer, check_size};
use crate::scene::{Method, Scene, Slicing};
use crate::{Error, Result};

/// A step on the way to a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Pass {
    /// Side of the squares of pixels that have one colour: 1 in the last pass.
    pub square: u32,
    /// Whether the picture is finished: it is then the one that [`Renderer::render`] makes, to the bit.
    pub last: bool,
}

/// Sides of squares of the coarse passes.
const SQUARES: [u32; 2] = [4, 2];
/// Slices of a coarse pass, where the scene asks for an error instead of a number.
const COARSE: u64 = 64;
/// Fewest slices of a coarse pass, unless the scene has fewer.
const FEWEST: u64 = 16;

impl Renderer {
    /// As [`Renderer::render_into`], coarse at first: `each` hears of every pass while `pixels` hold what it made. Where it returns
    /// `false`, no further pass is made, and `pixels` stay as they are.
    ///
    /// # Errors
    /// As [`Renderer::render_into`]; [`Error::Stopped`] also where `each` returns false before the last pass.
    pub fn render_progressive(
        &mut self,
        scene: &Scene,
        pixels: &mut [[f32; 4]],
        mut each: impl FnMut(Pass, &[[f32; 4]]) -> bool,
    ) -> Result<RenderStats> {
        check_size(scene, pixels)?;
        let width = scene.size().0 as usize;
        for square in SQUARES {
            let coarse = coarse(scene, square)?;
            let (w, h) = coarse.size();
            let mut scratch = std::mem::take(&mut self.scratch);
            scratch.resize(w as usize * h as usize, [0.0; 4]);
            let done = self.render_into(&coarse, &mut scratch);
            if done.is_ok() {
                spread(&scratch, w as usize, square as usize, pixels, width);
            }
            self.scratch = scratch;
            done?;
            if !each(Pass { square, last: false }, pixels) {
                return Err(Error::Stopped);
            }
        }
        let stats = self.render_into(scene, pixels)?;
        each(Pass { square: 1, last: true }, pixels);
        Ok(stats)
    }
}

/// The scene at a pixel for each square, in fewer slices.
fn coarse(scene: &Scene, square: u32) -> Result<Scene> {
    let (width, height) = scene.size();
    let slicing = match scene.slicing() {
        Slicing::Count(count) => Slicing::Count((count / u64::from(square)).max(FEWEST.min(count))),
        Slicing::Spacing(spacing) => Slicing::Spacing(spacing * f64::from(square)),
        Slicing::Tolerance(_) => Slicing::Count(COARSE),
    };
    let method = Method { extrapolate: false, ..scene.method() };
    scene.clone().with_method(method)?.with_slices(slicing)?.with_size(width.div_ceil(square), height.div_ceil(square))
}

/// Each of the `coarse` pixels into its square.
fn spread(coarse: &[[f32; 4]], columns: usize, square: usize, pixels: &mut [[f32; 4]], width: usize) {
    for (y, row) in pixels.chunks_mut(width).enumerate() {
        let from = &coarse[y / square * columns..][..columns];
        for (to, &color) in row.chunks_mut(square).zip(from) {
            to.fill(color);
        }
    }
}
