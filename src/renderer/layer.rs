//! Layers: what a volume, or a part of one, puts before whatever is behind it.

use super::job::{Clock, Output, RenderJob};
use super::rectangle::Rectangle;
use super::{Backend, Renderer, canvas, finish, slice_count};
use crate::picture::Picture;
use crate::raster::Finish;
use crate::scene::{Scene, Slicing};
use crate::{Error, Result};

/// A rectangle of a picture: premultiplied red, green and blue, and the transmittance that is left to what lies behind, 0 to 1.
///
/// "Over" is associative: layers of the parts of a volume, nearest first, make up the layer of the whole.
///
/// # Guarantees
/// There are `width * height` pixels, row by row from the top; the rectangle lies in the picture. Pixels beside it are nothing: no colour,
/// transmittance 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer(pub(super) Rectangle);

/// A pixel without anything in it.
pub(super) const NOTHING: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

impl Layer {
    /// Columns and rows of the whole picture.
    pub fn picture_size(&self) -> (u32, u32) {
        self.0.picture
    }

    /// First column and row of the rectangle, and its columns and rows.
    pub fn rectangle(&self) -> ((u32, u32), (u32, u32)) {
        (self.0.first, self.0.size)
    }

    /// The rectangle's pixels, row by row from the top: premultiplied red, green, blue, and transmittance.
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.0.pixels
    }

    /// This layer before `back`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the two are of pictures of different sizes.
    pub fn over(&self, back: &Self) -> Result<Self> {
        if self.0.picture != back.0.picture {
            let ((w, h), (v, g)) = (self.0.picture, back.0.picture);
            return Err(Error::invalid(format!("a layer of {w} x {h} pixels over one of {v} x {g}")));
        }
        Ok(Self(self.0.joined(&back.0, NOTHING, before)))
    }

    /// The layer over the background of `scene`: a finished picture.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene's picture is of another size.
    pub fn finish(&self, scene: &Scene) -> Result<Picture> {
        let (width, height) = self.0.picture;
        if self.0.picture != scene.size() {
            let ((w, h), (v, g)) = (self.0.picture, scene.size());
            return Err(Error::invalid(format!("a layer of {w} x {h} pixels in a picture of {v} x {g}")));
        }
        let over = finish::OverBackground::new(&scene.blended(), &crate::plan::method(scene));
        let mut all = vec![over.nothing(); width as usize * height as usize];
        self.0.put((0, 0), width, &mut all, |front, there| if front == NOTHING { there } else { over.pixel(front) });
        Ok(Picture::new(width, height, all))
    }
}

/// A layer's pixel before another one's: each rounded once.
#[inline]
pub(super) fn before(front: [f32; 4], back: [f32; 4]) -> [f32; 4] {
    let left = f64::from(front[3]);
    std::array::from_fn(|c| {
        let (front, back) = (f64::from(front[c]), f64::from(back[c]));
        (if c == 3 { front * back } else { front + left * back }) as f32
    })
}

impl Renderer {
    /// The layer of `scene`: its picture without a background.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Invalid`] for scenes without layers: of the profile `opengl`, to a tolerance, extrapolated.
    pub fn render_layer(&mut self, scene: &Scene) -> Result<Layer> {
        check(scene, "a layer")?;
        scene.check_with(&self.volume)?;
        let scene = &scene.blended();
        let size = scene.size();
        let pixels = self.pooled(|r| {
            let mut pixels = canvas(size.0, size.1)?;
            let view = scene.camera().resolve(r.volume.grid(), size.0, size.1)?;
            let count = count(scene, |spacing| slice_count(spacing, scene, r.volume.grid(), &view))?;
            let mut job = RenderJob { scene, view, clock: Clock::default(), observer: (), output: Output::Layer };
            r.frame(&mut job, count, scene.terminate(), None, &mut pixels)?;
            Ok(pixels)
        })?;
        Ok(Layer(Rectangle::cropped(size, &pixels, NOTHING)))
    }
}

/// # Errors
/// [`Error::Invalid`] for scenes without layers.
pub(super) fn check(scene: &Scene, what: &str) -> Result<()> {
    match Backend::of(scene) {
        Backend::Slices => {}
        Backend::Casting => {
            let name = scene.algorithm().name();
            return Err(Error::invalid(format!("{what}: the algorithm {name} makes whole pictures; choose slices")));
        }
        Backend::OpenGl => return Err(Error::invalid(format!("{what}: the profile opengl draws over its background; choose accurate"))),
    }
    if scene.method().extrapolate {
        return Err(Error::invalid(format!("{what}: slices extrapolate needs finished pictures")));
    }
    Ok(())
}

/// How many slices `scene` asks for, where they do not depend on its pictures.
pub(super) fn count(scene: &Scene, of_spacing: impl FnOnce(f64) -> Result<u64>) -> Result<u64> {
    match scene.slicing() {
        Slicing::Count(count) => Ok(count),
        Slicing::Spacing(spacing) => of_spacing(spacing),
        Slicing::Tolerance(t) => Err(Error::invalid(format!("slices tolerance {t}: a layer is rendered in a given number of slices"))),
    }
}
