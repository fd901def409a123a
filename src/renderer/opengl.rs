//! A picture by way of the fixed-function pipeline.

use super::frame::{Clock, background};
use super::{RenderStats, Renderer, canvas, slice_count, tile_side};
use crate::opengl;
use crate::picture::Picture;
use crate::proxy::Stack;
use crate::scene::{Classification, Equation, Factor, FogWeighting, OpenGl, Scene, Slicing, TableColors};
use crate::tally::Tally;
use crate::{Error, Result};

impl Renderer<'_> {
    /// One picture of `scene` through the fixed-function pipeline in `state`.
    pub(super) fn draw(&mut self, scene: &Scene, state: &OpenGl) -> Result<(Picture, RenderStats)> {
        if self.settings.estimate {
            return Err(Error::invalid("estimate: the profile opengl has the errors of OpenGL; estimate those of the profile accurate"));
        }
        let mut clock = Clock::default();
        let volume = self.volume;
        opengl::check_matrix(state, volume)?;
        let (width, height) = scene.size();
        let view = scene.camera().resolve(volume.grid(), width, height)?;
        let count = match scene.slicing() {
            Slicing::Count(count) => count,
            Slicing::Spacing(spacing) => slice_count(spacing, volume, &view)?,
            Slicing::Tolerance(_) => return Err(Error::invalid("slices tolerance: the profile opengl draws a given number of slices")),
        };
        let stack = Stack::new(volume.grid(), &view, scene.clip_planes(), count);
        let method = scene.method();
        let (table, kept) = clock.prepare(|| {
            let values = opengl::Values::of(volume);
            let unit = scene.transfer().opacity_length(volume.grid());
            let ratio = if stack.is_empty() { 1.0 } else { stack.spacing / unit };
            let table = opengl::Table::new(scene.transfer(), &values, ratio, state, method.target);
            let classified = method.classification == Classification::Pre;
            let key = opengl::TextureKey { format: state.texture, table: classified.then(|| table.clone()) };
            let kept = match self.texture.take().filter(|t| t.0 == key) {
                Some(kept) => kept,
                None => {
                    let texture = opengl::Texture::new(volume, &values, &key)?;
                    (key, texture)
                }
            };
            Ok::<_, Error>((table, self.texture.insert(kept)))
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
        let mut pixels = canvas(width, height)?;
        let fragments = pipeline.draw(
            &mut pixels,
            self.settings.tile.unwrap_or_else(|| tile_side(width, height)),
            self.settings.progress.as_deref(),
        )?;
        let non_finite = if volume.voxels().voxel_type().is_float() { volume.statistics().non_finite } else { 0 };
        let mut warnings = Vec::new();
        if stack.is_empty() {
            warnings.push("the whole box lies behind the eye: nothing to see".to_owned());
        } else if fragments > 0 && pixels.len() > 1 && pixels.iter().all(|p| *p == pixels[0]) {
            warnings.push("the picture is of one colour: nothing of the volume shows in it".to_owned());
        }
        if non_finite > 0 {
            warnings.push(format!("{non_finite} of {} voxels are NaN or infinite: texels of 0", volume.grid().voxel_count()));
        }
        warnings.extend(lit_up(scene, state));
        warnings.extend(unlike_premultiplied(state, &pixels));
        let stats = RenderStats {
            prepare_seconds: clock.prepare_seconds,
            render_seconds: clock.start.elapsed().as_secs_f64() - clock.prepare_seconds,
            slices: stack.count,
            method,
            fragments,
            fetches: fragments,
            threads: rayon::current_num_threads(),
            simd: "scalar",
            tally: Tally { frames: 1, fragments, looked_up: fragments, ..Tally::default() },
            left_out: opengl::left_out(scene, state),
            error_estimate: None,
            non_finite_voxels: non_finite,
            warnings,
        };
        Ok((Picture::new(width, height, pixels), stats))
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
