//! One block of a picture: what is behind one of its pixels can be told without the rest.

use super::job::{Clock, Output, RenderJob};
use super::{Renderer, canvas};
use crate::lanes::SIDE;
use crate::raster::{BlockMask, Observer};
use crate::scene::Scene;
use crate::{Error, Result};

impl Renderer {
    /// Pixel (x, y) of `scene` in `count` flat slices, while `observer` looks on as its block is rendered.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Invalid`] for a pixel outside the picture.
    pub(crate) fn render_block<O: Observer>(
        &mut self,
        scene: &Scene,
        count: u64,
        (x, y): (u32, u32),
        observer: O,
    ) -> Result<([f32; 4], O)> {
        let (width, height) = scene.size();
        if x >= width || y >= height {
            let (column, row) = (width - 1, height - 1);
            return Err(Error::invalid(format!("pixel {x},{y}: the picture has {width} x {height} pixels, from 0,0 to {column},{row}")));
        }
        let mut pixels = canvas(width, height)?;
        let mut mask = BlockMask::none(width as usize, height as usize);
        let (column, row) = (x as usize / SIDE, y as usize / SIDE);
        mask.set(row * (width as usize).div_ceil(SIDE) + column);
        let observer = self.pooled(|renderer| {
            scene.check_with(&renderer.volume)?;
            let scene = &scene.blended();
            let view = scene.camera().resolve(renderer.volume.grid(), width, height)?;
            let mut job = RenderJob { scene, view, clock: Clock::default(), observer, output: Output::Picture };
            renderer.frame(&mut job, count, scene.terminate(), Some(&mask), &mut pixels)?;
            Ok(job.observer)
        })?;
        Ok((pixels[y as usize * width as usize + x as usize], observer))
    }
}
