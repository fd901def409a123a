//! The loop over bands of the picture, slices, rows and fragments.

use super::blend::{Float, Framebuffer, Unorm, alpha_passes, blend, constant};
use super::coords::Coords;
use super::fog::{Mix, SliceFog};
use super::table::Table;
use super::texture::{Sampler, Texel, Texture};
use crate::proxy::{Edge, Stack};
use crate::scene::{Arithmetic, Environment, Filter, Fog, OpenGl, Order, Premultiplied, Target};
use crate::settings::Control;
use crate::{Error, Result};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Everything one picture is drawn with.
pub(crate) struct Pipeline<'a> {
    pub(crate) state: &'a OpenGl,
    pub(crate) texture: &'a Texture,
    /// Voxels along each axis of the texture.
    pub(crate) dims: [usize; 3],
    /// Filter where texels are larger than pixels.
    pub(crate) filter: Filter,
    /// What values are looked up in; not used by a texture of colours.
    pub(crate) table: &'a Table,
    pub(crate) stack: &'a Stack,
    pub(crate) fog: Option<&'a Fog>,
    pub(crate) order: Order,
    /// What the framebuffer is cleared to.
    pub(crate) clear: Premultiplied,
    pub(crate) target: Target,
}

impl Pipeline<'_> {
    /// Draws into `pixels`, in bands of `rows` rows, and gives the number of fragments.
    ///
    /// # Errors
    /// [`Error::Stopped`] when progress said so.
    pub(crate) fn draw(&self, pixels: &mut [[f32; 4]], rows: u32, control: Control<'_>) -> Result<u64> {
        match self.target {
            Target::F32 => self.draw_into::<Float>(pixels, rows, control),
            Target::Unorm8 => self.draw_into::<Unorm<255>>(pixels, rows, control),
            Target::Unorm16 => self.draw_into::<Unorm<65535>>(pixels, rows, control),
        }
    }

    fn draw_into<F: Framebuffer>(&self, pixels: &mut [[f32; 4]], rows: u32, control: Control<'_>) -> Result<u64> {
        match self.texture {
            Texture::R8(texels) => self.bands::<F, 1, u8>(texels, pixels, rows, control),
            Texture::R32F(texels) => self.bands::<F, 1, f32>(texels, pixels, rows, control),
            Texture::Rgba8(texels) => self.bands::<F, 4, [u8; 4]>(texels, pixels, rows, control),
            Texture::Rgba32F(texels) => self.bands::<F, 4, [f32; 4]>(texels, pixels, rows, control),
        }
    }

    /// Bands of rows in parallel; each owns its pixels and walks through all slices.
    fn bands<F: Framebuffer, const C: usize, T: Texel<C>>(
        &self,
        texels: &[T],
        pixels: &mut [[f32; 4]],
        rows: u32,
        control: Control<'_>,
    ) -> Result<u64> {
        let sampler = Sampler::new(texels, self.dims, self.state.wrap, self.state.border);
        let width = self.stack.view.width as usize;
        // Rows of a huge tile are one band.
        let band_length = width * (rows as usize).min(self.stack.view.height as usize);
        let total = pixels.len().div_ceil(band_length) as u64;
        let (done, stopped) = (AtomicU64::new(0), AtomicBool::new(false));
        let fragments = pixels
            .par_chunks_mut(band_length)
            .enumerate()
            .map(|(i, band)| {
                if stopped.load(Ordering::Relaxed) {
                    return 0;
                }
                let fragments = self.band::<F, C, T>(&sampler, i * (band_length / width), band, control);
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                if !control.step("rendering", done, total) {
                    stopped.store(true, Ordering::Relaxed);
                }
                fragments
            })
            .sum();
        if stopped.into_inner() { Err(Error::Stopped) } else { Ok(fragments) }
    }

    /// Every slice into the rows from `first` that `band` holds.
    fn band<F: Framebuffer, const C: usize, T: Texel<C>>(
        &self,
        sampler: &Sampler<'_, C, T>,
        first: usize,
        band: &mut [[f32; 4]],
        control: Control<'_>,
    ) -> u64 {
        let [r, g, b] = self.clear.rgb;
        band.fill([r, g, b, self.clear.alpha].map(F::store));
        let (columns, rows) = self.scissor();
        let width = self.stack.view.width as usize;
        let count = self.stack.count;
        let mut fragments = 0;
        for i in 0..count {
            // Whoever stops it does not want what is in the band.
            if control.is_stopped() {
                break;
            }
            let k = if self.order == Order::BackToFront { count - 1 - i } else { i };
            let slice = Slice::new(self, k);
            for (y, pixels) in (first..).zip(band.chunks_mut(width)).filter(|(y, _)| rows.contains(y)) {
                let span = slice.span(y, columns.clone());
                fragments += span.len() as u64;
                self.row::<F, C, T>(sampler, &slice, y, span.start, &mut pixels[span]);
            }
        }
        for pixel in band.iter_mut().flatten() {
            *pixel = F::finished(*pixel);
        }
        fragments
    }

    /// Columns and rows, from the top, that the scissor leaves.
    fn scissor(&self) -> (Range<usize>, Range<usize>) {
        let (width, height) = (self.stack.view.width as usize, self.stack.view.height as usize);
        let Some(s) = self.state.scissor else { return (0..width, 0..height) };
        // In u64: a rectangle may reach past the picture, and past u32.
        let clip = |from: u32, length: u32, size: usize| {
            let end = (u64::from(from) + u64::from(length)).min(size as u64) as usize;
            (from as usize).min(end)..end
        };
        let up = clip(s.y, s.height, height);
        (clip(s.x, s.width, width), height - up.end..height - up.start)
    }

    /// The fragments of one slice from column `x` of row `y`.
    fn row<F: Framebuffer, const C: usize, T: Texel<C>>(
        &self,
        sampler: &Sampler<'_, C, T>,
        slice: &Slice,
        y: usize,
        x: usize,
        pixels: &mut [[f32; 4]],
    ) {
        let state = self.state;
        let wy = y as f64 + 0.5;
        let coords = slice.coords.row(wy);
        let primary = state.primary.map(|c| c as f32);
        let constant = constant::<F>(state);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let wx = (x + i) as f64 + 0.5;
            let filter = match slice.minified {
                None => self.filter,
                Some(min) if slice.coords.texels_per_pixel(wx, wy, self.dims) > 1.0 => min,
                Some(_) => self.filter,
            };
            let at = coords.at(wx);
            let texel = match filter {
                Filter::Linear if state.filter_arithmetic == Arithmetic::Fixed => sampler.linear_fixed(at),
                // The spline is refused when the scene is made.
                Filter::Linear | Filter::Cubic { .. } => sampler.linear(at),
                Filter::Nearest => sampler.nearest(at),
            };
            let mut color = self.color(texel);
            if state.environment == Environment::Modulate {
                color = std::array::from_fn(|c| color[c] * primary[c]);
            }
            if let (Some(fog), Some((factor, mix))) = (self.fog, &slice.fog) {
                color = mix.apply(factor.factor(fog, &self.stack.view, wx, wy), color);
            }
            let fragment = color.map(|c| F::fragment(c, state.blend_arithmetic));
            if alpha_passes::<F>(state, fragment[3]) {
                *pixel = blend::<F>(state, &constant, fragment, pixel.map(F::load)).map(F::store);
            }
        }
    }

    /// A texel's colour: its own, or the table's at its value.
    #[inline(always)]
    fn color<const C: usize>(&self, texel: [f32; C]) -> [f32; 4] {
        if C == 4 { std::array::from_fn(|c| texel[c]) } else { self.table.lookup(texel[0]) }
    }
}

/// What the fragments of one slice share.
struct Slice {
    edges: Vec<Edge>,
    coords: Coords,
    fog: Option<(SliceFog, Mix)>,
    /// The filter where texels are smaller than pixels, where it is another one.
    minified: Option<Filter>,
}

impl Slice {
    fn new(pipeline: &Pipeline<'_>, k: u64) -> Self {
        let (stack, state) = (pipeline.stack, pipeline.state);
        let d = stack.depth(k);
        Self {
            edges: stack.half_spaces.iter().map(|h| Edge::new(h.at_depth(stack.perspective, d))).collect(),
            coords: Coords::new(stack, d, &state.texture_matrix),
            fog: pipeline.fog.map(|fog| (SliceFog::new(fog, state, stack, k), Mix::new(fog, state))),
            minified: state.min_filter.filter(|&f| f != pipeline.filter),
        }
    }

    /// The columns of row `y`, among `columns`, whose pixel centres the polygon covers.
    ///
    /// Along a row each edge function rises or falls, rounded as it is: covered columns end where a search by halves finds.
    fn span(&self, y: usize, columns: Range<usize>) -> Range<usize> {
        let y = y as f64 + 0.5;
        let Range { mut start, mut end } = columns;
        for edge in &self.edges {
            let covers = |x: usize| edge.contains(x as f64 + 0.5, y);
            if edge.b > 0.0 {
                start = first(start, end, covers);
            } else if edge.b < 0.0 {
                end = first(start, end, |x| !covers(x));
            } else if start < end && !covers(start) {
                end = start;
            }
        }
        start..end.max(start)
    }
}

/// The first of `start..end` for which `holds`, which holds from there on; `end` if there is none.
fn first(mut start: usize, mut end: usize, holds: impl Fn(usize) -> bool) -> usize {
    while start < end {
        let middle = start + (end - start) / 2;
        if holds(middle) { end = middle } else { start = middle + 1 }
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, ClipPlane, Placement, Projection};
    use crate::volume::Grid;
    use glam::DVec3;

    #[test]
    fn spans_are_the_pixels_that_the_stack_covers() {
        let grid = Grid::with_spacing([9, 5, 7], [1.0, 2.0, 0.5]).expect("grid");
        let clip = [ClipPlane::new(DVec3::new(1.0, 0.3, -0.2), 2.0).expect("plane")];
        let mut covered = 0;
        for projection in [Projection::Orthographic { height: Some(16.0) }, Projection::Perspective { fov_y: 50.0 }] {
            // At 0 degrees edges run along rows and columns of pixels.
            for azimuth in [0.0, 30.0, 77.0] {
                let camera = Camera::new(Placement::Orbit { azimuth, elevation: azimuth / 3.0, roll: 0.0, zoom: 1.0 }, projection);
                let view = camera.expect("camera").resolve(&grid, 32, 24).expect("view");
                for planes in [&[][..], &clip[..]] {
                    let stack = Stack::new(&grid, &view, planes, 6);
                    for k in 0..6 {
                        let d = stack.depth(k);
                        let edges = stack.half_spaces.iter().map(|h| Edge::new(h.at_depth(stack.perspective, d))).collect();
                        let coords = Coords::new(&stack, d, &glam::DMat4::IDENTITY);
                        let slice = Slice { edges, coords, fog: None, minified: None };
                        for y in 0..24 {
                            let span = slice.span(y, 0..32);
                            for x in 0..32 {
                                let covers = stack.covers(k, x as f64 + 0.5, y as f64 + 0.5);
                                assert_eq!(span.contains(&x), covers, "slice {k} pixel {x},{y}");
                                covered += u32::from(covers);
                            }
                            assert_eq!(slice.span(y, 7..20), span.start.clamp(7, 20)..span.end.clamp(7, 20).max(span.start.clamp(7, 20)));
                        }
                    }
                }
            }
        }
        assert!(covered > 4000, "{covered}");
    }
}
