//! The backend of OpenGL's fixed functions. It draws over the background, which its framebuffer is cleared to: there is no layer to keep.

use super::finish::background;
use super::{Drawn, RenderJob, Renderer, slice_count, tile_side};
use crate::opengl;
use crate::proxy::Stack;
use crate::raster::Observer;
use crate::scene::{Classification, Equation, Factor, FogWeighting, OpenGl, Scene, Slicing, TableColors, slab_ratio};
use crate::tally::Tally;
use crate::{Error, Result};
use std::sync::Arc;

impl Renderer {
    /// The job's scene through the fixed-function pipeline, into `pixels`.
    pub(super) fn draw_opengl<O: Observer>(&mut self, job: &mut RenderJob<'_, O>, pixels: &mut [[f32; 4]]) -> Result<Drawn> {
        let scene = job.scene;
        let Some(state) = scene.opengl() else { return Err(Error::invalid("the profile opengl without a state")) };
        if self.settings.estimate {
            return Err(Error::invalid("estimate: the profile opengl has the errors of OpenGL; estimate those of the profile accurate"));
        }
        let volume = Arc::clone(&self.volume);
        let volume = &*volume;
        opengl::check_matrix(state, volume)?;
        let count = match scene.slicing() {
            Slicing::Count(count) => count,
            Slicing::Spacing(spacing) => slice_count(spacing, scene, volume.grid(), &job.view)?,
            Slicing::Tolerance(_) => return Err(Error::invalid("slices tolerance: the profile opengl draws a given number of slices")),
        };
        let stack = Stack::new(volume.grid(), &job.view, scene.clip_planes(), count);
        let method = scene.method();
        let (table, kept) = job.clock.prepare(|| {
            let values = opengl::Values::of(volume);
            let ratio = if stack.is_empty() { 1.0 } else { slab_ratio(stack.spacing, scene.transfer().opacity_length(volume.grid())) };
            let table = opengl::Table::new(scene.transfer(), &values, ratio, state, method.target);
            let classified = method.classification == Classification::Pre;
            let key = opengl::TextureKey { format: state.texture, table: classified.then(|| table.clone()) };
            let kept = match self.cache.texture.take().filter(|t| t.0 == key) {
                Some(kept) => kept,
                None => {
                    let texture = opengl::Texture::new(volume, &values, &key)?;
                    (key, texture)
                }
            };
            Ok::<_, Error>((table, kept))
        })?;
        let pipeline = opengl::Pipeline {
            state,
            texture: &kept.1,
            dims: volume.grid().dims(),
            filter: method.filter,
            table: &table,
            stack: &stack,
            fog: scene.fog(),
            order: scene.blending_order(),
            clear: background(scene),
            target: method.target,
        };
        let (width, height) = scene.size();
        let drawn = pipeline.draw(pixels, self.settings.tile.unwrap_or_else(|| tile_side(width, height)), self.control());
        self.cache.texture = Some(kept);
        let fragments = drawn?;
        Ok(Drawn {
            slices: stack.count,
            method,
            tally: Tally { frames: 1, fragments, looked_up: fragments, ..Tally::default() },
            fetches: fragments,
            simd: "scalar",
            left_out: opengl::left_out(scene, state),
            error_estimate: None,
            non_finite: if volume.voxels().voxel_type().is_float() { volume.statistics().non_finite } else { 0 },
            non_finite_become: "texels of 0",
            warnings: Vec::new(),
            late_warnings: lit_up(scene, state).into_iter().chain(unlike_premultiplied(state, pixels)).collect(),
        })
    }
}

/// A warning where fog makes fragments of nothing visible.
fn lit_up(scene: &Scene, state: &OpenGl) -> Option<String> {
    let literal = scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal && f.color().iter().any(|&c| c > 0.0));
    let discarded = state.alpha_test.is_some_and(|t| !t.compare.passes(0.0, t.reference));
    // Factors of 0 where a fragment's alpha is.
    let times_alpha = !matches!(state.blend.equation, Equation::Min | Equation::Max)
        && matches!(state.blend.source, Factor::Zero | Factor::SrcAlpha | Factor::SrcAlphaSaturate);
    (literal && state.table_colors == TableColors::Premultiplied && !discarded && !times_alpha).then(|| {
        "fog is literal on premultiplied colours: empty slices add the fog's colour to the picture; set fog.weighting = \"alpha\", or \
         opengl.table_colors = \"straight\""
            .to_owned()
    })
}

/// A warning where what is in the framebuffer cannot be premultiplied colours.
fn unlike_premultiplied(state: &OpenGl, pixels: &[[f32; 4]]) -> Option<String> {
    // One step of 8 bits may come of rounding.
    const STEP: f32 = 1.001 / 255.0;
    let above = |&&[r, g, b, a]: &&[f32; 4]| r.max(g).max(b).min(1.0) > a + STEP;
    let count = pixels.iter().filter(above).count();
    let cure = if state.blend_alpha.source == Factor::SrcAlpha {
        "set opengl.blend_source_alpha = \"one\", or write .npy"
    } else {
        "write .npy to keep them"
    };
    (count > 0).then(|| {
        format!(
            "the framebuffer is no premultiplied picture: colours are above alpha in {count} of {} pixels, and a PNG, which divides by \
             alpha, shows other colours than glReadPixels; {cure}",
            pixels.len()
        )
    })
}
