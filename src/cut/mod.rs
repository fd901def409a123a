//! Cut pictures: a plane through a volume, its values shown through a window of grey or a colour map.
//!
//! ```text
//!  Orientation --frame--> Frame: where right and up of the picture point in the world
//!  offsets, size -------> Layout: cells of one picture, square pixels in world units
//!                            |
//!  Volume --lookup--> values of all pixels --> Window --> colours --> Picture
//! ```
//! Values come from the pipeline's own lookups: trilinear, the nearest voxel, or the cubic spline, in f64. Outside the box, and where a value is
//! NaN or infinite, the background shows. Voxels that are colours are shown as such, through no window. Each pixel is computed by itself, so the number of threads changes no bit.

mod colors;
mod extent;
mod frame;
mod layout;
#[cfg(test)]
mod tests;
mod window;

pub use extent::occupied;
pub use frame::{Frame, Orientation};
pub use layout::{Layout, MAX_CUTS};
pub use window::Window;

use crate::picture::{MAX_SIDE, Picture};
use crate::plan::{PointLookup, VolumeData};
use crate::scene::{ColorMap, Filter, Premultiplied, Straight, TransferFunction};
use crate::volume::Volume;
use crate::{Error, Result};
use colors::ColorLookup;
use glam::DVec3;
use rayon::prelude::*;

/// What to cut, and how to show it: one cut, or several of one orientation beside each other.
///
/// ```
/// use slicestack::cut::{Orientation, Sheet};
/// use slicestack::volume::phantom::Phantom;
///
/// fn main() -> slicestack::Result<()> {
///     let volume = Phantom::SheppLogan.volume(32)?;
///     let drawn = Sheet::new(volume.grid(), Orientation::Axial, vec![0.0])?.with_size(64, 64)?.draw(&volume)?;
///     assert_eq!((drawn.picture.width(), drawn.picture.height()), (64, 64));
///     Ok(())
/// }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    frame: Frame,
    offsets: Vec<f64>,
    columns: u32,
    size: Option<(u32, u32)>,
    filter: Filter,
    window: Option<Window>,
    colors: Option<ColorMap>,
    background: Straight,
}

/// A picture of cuts, and what was chosen for it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Drawn {
    /// The cuts.
    pub picture: Picture,
    /// Where they lie in it, and in the world.
    pub layout: Layout,
    /// What their values are seen through; `None` where they are colours.
    pub window: Option<Window>,
}

impl Sheet {
    /// Cuts of `orientation` through the box of `grid`, at `offsets`: for each plane the dot product of its points with [`Frame::axis`], world
    /// units. One picture without background, trilinear, in grey.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no offset, one that is not finite, and a normal that is none; [`Error::Limit`] for more than [`MAX_CUTS`].
    pub fn new(grid: &crate::volume::Grid, orientation: Orientation, offsets: Vec<f64>) -> Result<Self> {
        if offsets.is_empty() {
            return Err(Error::invalid("cuts: there must be at least one"));
        }
        if offsets.len() > MAX_CUTS {
            return Err(Error::Limit { what: "cuts of one picture".into(), needed: offsets.len() as u128, limit: MAX_CUTS as u128 });
        }
        if let Some(offset) = offsets.iter().find(|o| !o.is_finite()) {
            return Err(Error::invalid(format!("cut at {offset}: must be finite")));
        }
        Ok(Self {
            frame: Frame::new(grid, orientation)?,
            offsets,
            columns: 1,
            size: None,
            filter: Filter::Linear,
            window: None,
            colors: None,
            background: Straight::default(),
        })
    }

    /// The same cuts side by side, so many in a row, from the upper left on.
    ///
    /// # Errors
    /// [`Error::Invalid`] for 0 columns.
    pub fn with_columns(mut self, columns: u32) -> Result<Self> {
        if columns == 0 {
            return Err(Error::invalid("cuts: 0 columns, there must be at least one"));
        }
        self.columns = columns;
        Ok(self)
    }

    /// The same cuts in a picture of `width` x `height` pixels. Otherwise a picture of one cut is 512 pixels long, and each of several 192.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a side is 0 or more than [`MAX_SIDE`].
    pub fn with_size(mut self, width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::invalid(format!("image {width} x {height}: sides must be 1 to {MAX_SIDE} pixels")));
        }
        self.size = Some((width, height));
        Ok(self)
    }

    /// The same cuts looked up by another filter.
    #[must_use]
    pub fn with_filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    /// The same cuts seen through `window` instead of one chosen by what is seen: see [`Window::of_seen`].
    #[must_use]
    pub fn with_window(mut self, window: Window) -> Self {
        self.window = Some(window);
        self
    }

    /// The same cuts in other colours.
    #[must_use]
    pub fn with_colors(mut self, colors: ColorMap) -> Self {
        self.colors = Some(colors);
        self
    }

    /// The same cuts before a background; transparent unless given.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a component is outside `[0,1]`.
    pub fn with_background(mut self, background: Straight) -> Result<Self> {
        let [r, g, b] = background.rgb;
        if let Some(c) = [r, g, b, background.alpha].into_iter().find(|c| !(0.0..=1.0).contains(c)) {
            return Err(Error::invalid(format!("background: {c} is outside [0,1]")));
        }
        self.background = background;
        Ok(self)
    }

    /// Where right and up of the picture point.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The picture of `volume`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a volume of colours with a window, a colour map or the cubic filter, a picture too small for its cuts, and where this machine does not give the memory.
    pub fn draw(&self, volume: &Volume) -> Result<Drawn> {
        let layout = Layout::new(volume.grid(), self.frame, &self.offsets, self.columns, self.size)?;
        let (width, height) = layout.size();
        let count = width as usize * height as usize;
        // Values, pixels, and about as much again for an encoder.
        if crate::memory::reserve(&mut Vec::<[f32; 4]>::new(), 3 * count).is_err() {
            return Err(Error::invalid(format!("image {width} x {height}: this machine does not give the memory for its pixels")));
        }
        if let Some(lookup) = ColorLookup::new(volume, self.filter) {
            self.check_colors()?;
            let mut pixels = vec![self.behind(); count];
            pixels.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
                let [r, g, b, alpha] = self.behind();
                each(volume, &layout, y as u32, row, |at| {
                    let color = lookup.color(at).map(|c| c as f32);
                    let through = 1.0 - color[3];
                    [color[0] + through * r, color[1] + through * g, color[2] + through * b, color[3] + through * alpha]
                });
            });
            return Ok(Drawn { picture: Picture::new(width, height, pixels), layout, window: None });
        }
        let spline = match self.filter {
            Filter::Cubic { prefilter } => {
                let refused = || Error::invalid("filter cubic: this machine does not give the memory for its coefficients");
                Some(VolumeData::of_spline(volume, prefilter).ok_or_else(refused)?)
            }
            Filter::Linear | Filter::Nearest => None,
        };
        let lookup = PointLookup::new(volume, self.filter, spline.as_ref());
        let mut values = vec![f64::NAN; count];
        values.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| each(volume, &layout, y as u32, row, |at| lookup.value(at)));
        let window = match self.window {
            Some(window) => window,
            None => Window::of_seen(values.iter().copied()),
        };
        let (low, high) = window.range();
        let colors = TransferFunction::new(self.colors.unwrap_or(ColorMap::Gray).spread(low, high), vec![(low, 1.0)])?;
        let behind = self.behind();
        let pixel = |&value: &f64| {
            if !value.is_finite() {
                return behind;
            }
            let [r, g, b] = colors.eval(value).rgb;
            [r as f32, g as f32, b as f32, 1.0]
        };
        let mut pixels = vec![[0.0f32; 4]; count];
        pixels.par_iter_mut().zip(&values).for_each(|(to, value)| *to = pixel(value));
        Ok(Drawn { picture: Picture::new(width, height, pixels), layout, window: Some(window) })
    }

    /// The background, premultiplied.
    fn behind(&self) -> [f32; 4] {
        let Premultiplied { rgb: [r, g, b], alpha } = self.background.premultiply();
        [r as f32, g as f32, b as f32, alpha as f32]
    }

    /// Refuses what is for values.
    fn check_colors(&self) -> Result<()> {
        let refused = [
            (self.window.is_some(), "window: is for values, and these voxels are colours"),
            (self.colors.is_some(), "colors: a colour map is for values, and these voxels are colours"),
            (self.filter.is_cubic(), "filter cubic: the spline is one of values, and these voxels are colours; choose linear"),
        ];
        refused.into_iter().find(|r| r.0).map_or(Ok(()), |r| Err(Error::invalid(r.1)))
    }
}

/// Sets the pixels of row `y` of the picture to what `look` finds at their index coordinates, where they lie in the box.
fn each<T>(volume: &Volume, layout: &Layout, y: u32, row: &mut [T], look: impl Fn(DVec3) -> T) {
    let to_index = volume.grid().world_to_index();
    let (low, high) = volume.grid().index_bounds();
    // Positions on a face of the box count as inside, whatever rounding makes of them.
    let margin = DVec3::splat(1e-9) * (high - low + 1.0);
    for (x, pixel) in row.iter_mut().enumerate() {
        let Some(world) = layout.world(f64::from(x as u32) + 0.5, f64::from(y) + 0.5) else { continue };
        let at = to_index.transform_point3(world);
        if at.cmpge(low - margin).all() && at.cmple(high + margin).all() {
            *pixel = look(at);
        }
    }
}
