//! Whole reference pictures, or every n-th pixel of a part of one.

use super::{Integrator, SurfaceTracer};
use crate::scene::{Blend, Premultiplied, Scene};
use crate::volume::Volume;
use crate::{Error, Result};
use rayon::prelude::*;

/// Which pixels to compute: every `step`-th column and row of a rectangle, from its upper left corner on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// Column and row of the first pixel.
    pub origin: (u32, u32),
    /// Width and height of the rectangle in pixels.
    pub size: (u32, u32),
    /// Columns and rows from one computed pixel to the next.
    pub step: u32,
}

impl Region {
    /// Every `step`-th column and row of the whole picture.
    pub fn every(scene: &Scene, step: u32) -> Self {
        Self { origin: (0, 0), size: scene.size(), step }
    }

    /// The whole picture.
    pub fn whole(scene: &Scene) -> Self {
        Self::every(scene, 1)
    }
}

/// A picture as it should be.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceImage {
    region: Region,
    columns: usize,
    pixels: Vec<[f64; 4]>,
    error_bound: f64,
    pieces: u64,
}

impl ReferenceImage {
    /// Which pixels these are.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Computed columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.pixels.len() / self.columns)
    }

    /// Premultiplied red, green, blue and alpha over the scene's background, row by row from the top.
    pub fn pixels(&self) -> &[[f64; 4]] {
        &self.pixels
    }

    /// Column and row in the scene's picture of the pixel at `position` in [`ReferenceImage::pixels`].
    pub fn place(&self, position: usize) -> (u32, u32) {
        let Region { origin, step, .. } = self.region;
        (origin.0 + (position % self.columns) as u32 * step, origin.1 + (position / self.columns) as u32 * step)
    }

    /// The largest error bound of any pixel. 0 for level surfaces: nothing is integrated there, and crossings are exact but for the rounding
    /// of f64.
    pub fn error_bound(&self) -> f64 {
        self.error_bound
    }

    /// Smooth panels integrated in all; 0 for level surfaces.
    pub fn pieces(&self) -> u64 {
        self.pieces
    }
}

/// What computes pixels of a scene.
enum Rays<'a> {
    Integrated(Integrator<'a>),
    Surfaces(SurfaceTracer<'a>),
}

impl<'a> Rays<'a> {
    fn new(scene: &Scene, volume: &'a Volume) -> Result<Self> {
        Ok(match scene.blend() {
            Blend::Surfaces => Self::Surfaces(SurfaceTracer::new(scene, volume)?),
            _ => Self::Integrated(Integrator::new(scene, volume)?),
        })
    }

    /// A pixel over the scene's background, the bound on its error, and the panels integrated for it.
    fn pixel(&self, x: u32, y: u32) -> (Premultiplied, f64, u32) {
        match self {
            Self::Integrated(integrator) => {
                let (color, ray) = integrator.pixel(x, y);
                (color, ray.error_bound, ray.pieces)
            }
            Self::Surfaces(tracer) => (tracer.pixel(x, y), 0.0, 0),
        }
    }
}

/// Computes the pixels of `region`, in parallel, the same for any number of threads: by an [`Integrator`], or by a [`SurfaceTracer`] where the
/// scene draws level surfaces.
///
/// # Errors
/// As [`Integrator::new`] and [`SurfaceTracer::new`]; [`Error::Invalid`] for a region that is empty, leaves the picture or has step 0.
pub fn image(scene: &Scene, volume: &Volume, region: Region) -> Result<ReferenceImage> {
    let (width, height) = scene.size();
    let Region { origin: (x0, y0), size: (w, h), step } = region;
    let inside = |from: u32, size: u32, whole: u32| size > 0 && from.checked_add(size).is_some_and(|end| end <= whole);
    if !inside(x0, w, width) || !inside(y0, h, height) || step == 0 {
        return Err(Error::invalid(format!("region {w} x {h} at ({x0},{y0}), step {step}: not within a picture of {width} x {height}")));
    }
    let rays = Rays::new(scene, volume)?;
    let (columns, rows) = (w.div_ceil(step) as usize, h.div_ceil(step) as usize);
    let mut pixels = Vec::new();
    if crate::memory::reserve(&mut pixels, columns * rows).is_err() {
        let needed = columns as u128 * rows as u128 * size_of::<[f64; 4]>() as u128;
        return Err(Error::Limit { what: "bytes of free memory for a reference picture".into(), needed, limit: 0 });
    }
    pixels.resize(columns * rows, [0.0; 4]);
    let (error_bound, pieces) = pixels
        .par_chunks_mut(columns)
        .enumerate()
        .map(|(row, line)| {
            let (mut bound, mut pieces) = (0.0, 0);
            for (column, pixel) in line.iter_mut().enumerate() {
                let (color, off, panels) = rays.pixel(x0 + column as u32 * step, y0 + row as u32 * step);
                let [r, g, b] = color.rgb;
                *pixel = [r, g, b, color.alpha];
                bound = f64::max(bound, off);
                pieces += u64::from(panels);
            }
            (bound, pieces)
        })
        .reduce(|| (0.0, 0), |a, b| (f64::max(a.0, b.0), a.1 + b.1));
    Ok(ReferenceImage { region, columns, pixels, error_bound, pieces })
}
