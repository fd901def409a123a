//! Layers: what a volume, or a part of one, puts before whatever is behind it.

use super::job::{Clock, Output, RenderJob};
use super::slices::Request;
use super::{Backend, Renderer, canvas, finish, slice_count};
use crate::picture::Picture;
use crate::plan::Detail;
use crate::proxy::{Domain, Stack};
use crate::raster::{Finish, Observer};
use crate::scene::{Algorithm, Blend, Scene, Slicing};
use crate::{Error, Result};

/// A rectangle of a picture: premultiplied red, green and blue, and the transmittance that is left to what lies behind, 0 to 1.
///
/// "Over" is associative: layers of the parts of a volume, nearest first, make up the layer of the whole.
///
/// # Guarantees
/// There are `width * height` pixels, row by row from the top; the rectangle lies in the picture. Pixels beside it are nothing: no colour,
/// transmittance 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Columns and rows of the whole picture.
    picture: (u32, u32),
    /// First column and row of the rectangle.
    first: (u32, u32),
    size: (u32, u32),
    pixels: Vec<[f32; 4]>,
}

/// A pixel without anything in it.
const NOTHING: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

impl Layer {
    /// The smallest rectangle of a picture's pixels that holds all that is something.
    fn cropped(picture: (u32, u32), pixels: &[[f32; 4]]) -> Self {
        let width = picture.0 as usize;
        let some = |row: &[[f32; 4]]| row.iter().any(|p| *p != NOTHING);
        let rows: Vec<usize> = pixels.chunks(width).enumerate().filter(|(_, row)| some(row)).map(|(y, _)| y).collect();
        let (Some(&top), Some(&bottom)) = (rows.first(), rows.last()) else {
            return Self { picture, first: (0, 0), size: (0, 0), pixels: Vec::new() };
        };
        let inside = &pixels[top * width..(bottom + 1) * width];
        let column = |x: &usize| inside.iter().skip(*x).step_by(width).any(|p| *p != NOTHING);
        let left = (0..width).find(column).unwrap_or(0);
        let right = (0..width).rev().find(column).unwrap_or(0);
        let pixels = inside.chunks(width).flat_map(|row| &row[left..=right]).copied().collect();
        let size = ((right + 1 - left) as u32, (bottom + 1 - top) as u32);
        Self { picture, first: (left as u32, top as u32), size, pixels }
    }

    /// Columns and rows of the whole picture.
    pub fn picture_size(&self) -> (u32, u32) {
        self.picture
    }

    /// First column and row of the rectangle, and its columns and rows.
    pub fn rectangle(&self) -> ((u32, u32), (u32, u32)) {
        (self.first, self.size)
    }

    /// The rectangle's pixels, row by row from the top: premultiplied red, green, blue, and transmittance.
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.pixels
    }

    /// This layer before `back`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the two are of pictures of different sizes.
    pub fn over(&self, back: &Self) -> Result<Self> {
        if self.picture != back.picture {
            let ((w, h), (v, g)) = (self.picture, back.picture);
            return Err(Error::invalid(format!("a layer of {w} x {h} pixels over one of {v} x {g}")));
        }
        let mut all = back.spread();
        self.put(&mut all, |[r, g, b, t], back| [r + t * back[0], g + t * back[1], b + t * back[2], t * back[3]]);
        Ok(Self::cropped(self.picture, &all))
    }

    /// The whole picture's pixels.
    fn spread(&self) -> Vec<[f32; 4]> {
        let mut all = vec![NOTHING; self.picture.0 as usize * self.picture.1 as usize];
        self.put(&mut all, |front, _| front);
        all
    }

    /// Each pixel of the rectangle becomes what `join` makes of it and the one there.
    fn put(&self, all: &mut [[f32; 4]], join: impl Fn([f32; 4], [f32; 4]) -> [f32; 4]) {
        let (width, left, columns) = (self.picture.0 as usize, self.first.0 as usize, self.size.0 as usize);
        for (y, row) in (self.first.1 as usize..).zip(self.pixels.chunks(columns.max(1))) {
            for (to, &front) in all[y * width + left..][..columns].iter_mut().zip(row) {
                *to = join(front, *to);
            }
        }
    }

    /// The layer over the background of `scene`: a finished picture.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene's picture is of another size.
    pub fn finish(&self, scene: &Scene) -> Result<Picture> {
        if self.picture != scene.size() {
            let ((w, h), (v, g)) = (self.picture, scene.size());
            return Err(Error::invalid(format!("a layer of {w} x {h} pixels in a picture of {v} x {g}")));
        }
        let over = finish::OverBackground::new(&scene.blended(), &crate::plan::method(scene));
        let mut all = vec![over.nothing(); self.picture.0 as usize * self.picture.1 as usize];
        self.put(&mut all, |front, there| if front == NOTHING { there } else { over.pixel(front) });
        Ok(Picture::new(self.picture.0, self.picture.1, all))
    }
}

/// Asks for the fragments that a part of a volume owns.
struct Owned<'d>(&'d Domain);

impl Observer for Owned<'_> {
    const OBSERVES: bool = false;
    const SELECTS: bool = true;

    fn fresh(&self) -> Self {
        Self(self.0)
    }

    fn fragments(&self, stack: &Stack, first: (u32, u32), d: f64) -> u64 {
        self.0.fragments(stack, first, d)
    }

    fn merge(&mut self, _: Self) {}
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
        Ok(Layer::cropped(size, &pixels))
    }

    /// The share of a scene's picture that comes from this renderer's volume, where that is a part of a larger one: the fragments that
    /// `domain` says it owns, on the slices of the whole. Shares of all parts, put over one another in the order of their depth, make up
    /// the layer of the whole; each fragment has the very bits that it has there. Pixels do not end early.
    ///
    /// # Errors
    /// As [`Renderer::render_layer`]; [`Error::Invalid`] where the volume has not as many voxels as `domain` says, and for what can't be
    /// shared out slice by slice: pre-integrated slabs, merged slabs, projections of values.
    pub fn render_part(&mut self, scene: &Scene, domain: &Domain) -> Result<Layer> {
        check(scene, "a part of a volume")?;
        self.volume.check_scalars("a part of a volume")?;
        scene.check_with(&self.volume)?;
        let method = scene.method();
        if method.is_pre_integrated() {
            return Err(Error::invalid(
                "transfer classification: a part of a volume is rendered by post or pre, slabs of which have one value",
            ));
        }
        if method.filter.is_cubic() {
            return Err(Error::invalid(
                "render filter cubic: a spline depends on voxels all around, of which a part of a volume has not all",
            ));
        }
        if method.merge {
            return Err(Error::invalid("slices merge: a part of a volume is rendered slice by slice"));
        }
        if scene.blend() != Blend::Over {
            return Err(Error::invalid("render blend: parts of a volume combine by \"over\" alone"));
        }
        if scene.algorithm() == Algorithm::Shells || scene.jitter().is_some() {
            return Err(Error::invalid(
                "a part of a volume: its fragments lie on the flat slices of the whole; choose slices without jitter",
            ));
        }
        if !scene.cuts().is_empty() {
            return Err(Error::invalid("cut: a part of a volume does not know which planes rays meet in other parts"));
        }
        if scene.uses_labels() || !scene.regions().is_empty() {
            return Err(Error::invalid("labels and regions: a part of a volume is rendered without them"));
        }
        if scene.needs_gradient() {
            return Err(Error::invalid("light: a part of a volume does not hold the voxels around it that gradients take"));
        }
        let (held, told) = (self.volume.grid().dims(), domain.voxels().clone().map(|v| v.len()));
        if held != told {
            return Err(Error::invalid(format!("domain: voxels {told:?} along x, y, z: the volume has {held:?}")));
        }
        let scene = &scene.blended();
        let size = scene.size();
        let pixels = self.pooled(|r| {
            let mut pixels = canvas(size.0, size.1)?;
            let view = scene.camera().resolve(domain.whole(), size.0, size.1)?;
            let count = count(scene, |spacing| slice_count(spacing, scene, domain.whole(), &view))?;
            let stack = Stack::new(domain.whole(), &view, scene.clip_planes(), count);
            let mut job = RenderJob { scene, view, clock: Clock::default(), observer: Owned(domain), output: Output::Layer };
            r.requested(
                &mut job,
                Request { stack, terminate: 0.0, detail: Detail::Usual, blocks: None, domain: Some(domain) },
                &mut pixels,
            )?;
            Ok(pixels)
        })?;
        Ok(Layer::cropped(size, &pixels))
    }
}

/// # Errors
/// [`Error::Invalid`] for scenes without layers.
fn check(scene: &Scene, what: &str) -> Result<()> {
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
fn count(scene: &Scene, of_spacing: impl FnOnce(f64) -> Result<u64>) -> Result<u64> {
    match scene.slicing() {
        Slicing::Count(count) => Ok(count),
        Slicing::Spacing(spacing) => of_spacing(spacing),
        Slicing::Tolerance(t) => Err(Error::invalid(format!("slices tolerance {t}: a layer is rendered in a given number of slices"))),
    }
}
