//! Where cuts lie in their picture, and pixels in the world.

use super::frame::{Frame, along};
use crate::picture::MAX_SIDE;
use crate::volume::Grid;
use crate::{Error, Result};
use glam::DVec3;

/// Most cuts of one picture.
pub const MAX_CUTS: usize = 1024;

/// Pixels of the longer side of a single cut, and of each of several, where no size is given.
const LONG_SIDE: u32 = 512;
const LONG_SIDE_OF_MANY: u32 = 192;

/// Pixels between two cuts.
const GAP: u32 = 2;

/// Cells of one picture, each with a cut in its middle; pixels are squares of one size in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    frame: Frame,
    offsets: Vec<f64>,
    columns: u32,
    rows: u32,
    /// Of a cell, without the gap.
    cell: (u32, u32),
    size: (u32, u32),
    scale: f64,
    /// World position of a cell's middle, in the plane through the world's origin.
    middle: DVec3,
}

impl Layout {
    /// Cells for cuts at `offsets` through the box of `grid`, as large as `size` allows.
    pub(super) fn new(grid: &Grid, frame: Frame, offsets: &[f64], columns: u32, size: Option<(u32, u32)>) -> Result<Self> {
        let columns = columns.min(offsets.len() as u32);
        let rows = (offsets.len() as u32).div_ceil(columns);
        let (across, upwards) = (along(grid, frame.right), along(grid, frame.up));
        let extent = [across.1 - across.0, upwards.1 - upwards.0];
        // A box without extent, such as one voxel between nodes, is shown as a point of no size.
        let longest = extent[0].max(extent[1]);
        let longest = if longest > 0.0 { longest } else { grid.smallest_spacing() };
        let gaps = |n: u32| GAP * (n - 1);
        let size = match size {
            Some(size) => size,
            None => {
                let long = if offsets.len() > 1 { LONG_SIDE_OF_MANY } else { LONG_SIDE };
                let side = |e: f64| (libm::ceil(f64::from(long) * (e / longest) - 1e-9) as u32).max(1);
                (columns * side(extent[0]) + gaps(columns), rows * side(extent[1]) + gaps(rows))
            }
        };
        let cell = (size.0.saturating_sub(gaps(columns)) / columns, size.1.saturating_sub(gaps(rows)) / rows);
        if cell.0 == 0 || cell.1 == 0 {
            return Err(Error::invalid(format!("image {} x {}: too small for {columns} x {rows} cuts", size.0, size.1)));
        }
        if size.0 > MAX_SIDE || size.1 > MAX_SIDE {
            return Err(Error::invalid(format!(
                "image {} x {} for {columns} x {rows} cuts: sides must be 1 to {MAX_SIDE} pixels",
                size.0, size.1
            )));
        }
        let scale = (extent[0] / f64::from(cell.0)).max(extent[1] / f64::from(cell.1));
        let scale = if scale > 0.0 { scale } else { longest / f64::from(cell.0.max(cell.1)) };
        let middle = frame.right * (0.5 * across.0 + 0.5 * across.1) + frame.up * (0.5 * upwards.0 + 0.5 * upwards.1);
        if !(scale.is_finite() && middle.is_finite()) {
            return Err(Error::invalid(format!("cut: a picture {longest} world units wide cannot be computed")));
        }
        Ok(Self { frame, offsets: offsets.to_vec(), columns, rows, cell, size, scale, middle })
    }

    /// Columns and rows of pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Columns and rows of cuts.
    pub fn cells(&self) -> (u32, u32) {
        (self.columns, self.rows)
    }

    /// Side of a pixel, world units.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Where right and up of the picture point.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The offset of each cut.
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Left, top, width and height of cut `n`'s cell, pixels.
    pub fn cell(&self, n: usize) -> [u32; 4] {
        let (column, row) = (n as u32 % self.columns, n as u32 / self.columns);
        [column * (self.cell.0 + GAP), row * (self.cell.1 + GAP), self.cell.0, self.cell.1]
    }

    /// The world position of window position (x,y), pixels from the upper left; `None` between cells and in those without a cut.
    pub fn world(&self, x: f64, y: f64) -> Option<DVec3> {
        let place = |p: f64, side: u32| {
            let pitch = f64::from(side + GAP);
            let cell = libm::floor(p / pitch);
            (cell, p - cell * pitch)
        };
        let ((column, x), (row, y)) = (place(x, self.cell.0), place(y, self.cell.1));
        let (width, height) = (f64::from(self.cell.0), f64::from(self.cell.1));
        if column >= f64::from(self.columns) || x >= width || y >= height {
            return None;
        }
        let offset = self.offsets.get((row * f64::from(self.columns) + column) as usize)?;
        let (right, up) = ((x - 0.5 * width) * self.scale, (0.5 * height - y) * self.scale);
        Some(self.middle + self.frame.right * right + self.frame.up * up + self.frame.axis * *offset)
    }
}
