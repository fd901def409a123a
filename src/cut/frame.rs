//! Where a cut's right and up point in the world.

use crate::volume::{Grid, Space};
use crate::{Error, Result};
use glam::DVec3;

/// Which way a cut goes through the box.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Orientation {
    /// Across the body: seen from the feet, front (anterior) up, the subject's right at the left.
    Axial,
    /// Along the body from right to left: seen from the front, superior up, the subject's right at the left.
    Coronal,
    /// Along the body from front to back: seen from the left, superior up, front (anterior) at the left.
    Sagittal,
    /// Across this world vector of any length but 0: seen from where it points to, superior up, or anterior up where it is within about 25
    /// degrees of superior or inferior.
    Oblique(DVec3),
}

impl Orientation {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Axial => "axial",
            Self::Coronal => "coronal",
            Self::Sagittal => "sagittal",
            Self::Oblique(_) => "oblique",
        }
    }
}

/// The directions of a cut in the world. A volume of unknown space is cut as one of [`Space::Lps`]: axial across z, coronal across y, sagittal
/// across x.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Frame {
    /// Unit vector to the picture's right.
    pub right: DVec3,
    /// Unit vector to the picture's top.
    pub up: DVec3,
    /// Unit vector across the cut, along which offsets are measured: the world's z, y or x axis, or the oblique normal.
    pub axis: DVec3,
    /// Where several cuts go: `axis`, or against it. In a known space superior, anterior, left; otherwise along the axis.
    pub onward: DVec3,
    /// What the world's axes mean.
    pub space: Space,
}

impl Frame {
    /// The directions of `orientation` in the world of `grid`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an oblique normal that is 0 or not finite.
    pub fn new(grid: &Grid, orientation: Orientation) -> Result<Self> {
        let space = grid.space();
        let (front, superior) = space.front_and_up();
        let left = superior.cross(front);
        let known = |axis: DVec3, onward: DVec3| (axis, if space == Space::Unknown { axis } else { onward });
        let (right, up, (axis, onward)) = match orientation {
            Orientation::Axial => (left, front, known(DVec3::Z, superior)),
            Orientation::Coronal => (left, superior, known(DVec3::Y, front)),
            Orientation::Sagittal => (-front, superior, known(DVec3::X, left)),
            Orientation::Oblique(normal) => {
                let refused = || Error::invalid(format!("cut normal {normal}: it must be finite and not 0"));
                let normal = Some(normal).filter(|n| n.is_finite()).and_then(DVec3::try_normalize).ok_or_else(refused)?;
                let steep = normal.dot(superior).abs() > 0.9;
                let towards = if steep { front } else { superior };
                let up = (towards - normal * normal.dot(towards)).normalize();
                (up.cross(normal), up, (normal, normal))
            }
        };
        Ok(Self { right, up, axis, onward, space })
    }

    /// Smallest and largest offset of the box of `grid` along [`Frame::axis`], world units.
    pub fn extent(&self, grid: &Grid) -> (f64, f64) {
        along(grid, self.axis)
    }

    /// The offset so much of the way through the box: 0 where [`Frame::onward`] comes in, 1 where it leaves.
    pub fn offset_at(&self, grid: &Grid, share: f64) -> f64 {
        let (low, high) = self.extent(grid);
        let share = if self.onward.dot(self.axis) < 0.0 { 1.0 - share } else { share };
        low + share * (high - low)
    }

    /// The offset of the plane through the middle of layer `index` of voxels: of the index axis that runs nearest to [`Frame::axis`].
    ///
    /// # Errors
    /// [`Error::Invalid`] when the volume has no such layer.
    pub fn offset_of_layer(&self, grid: &Grid, index: usize) -> Result<f64> {
        let directions = grid.directions();
        let nearness = [0, 1, 2].map(|axis| directions.col(axis).dot(self.axis).abs());
        let axis = (1..3).fold(0, |best, axis| if nearness[axis] > nearness[best] { axis } else { best });
        let layers = grid.dims()[axis];
        if index >= layers {
            let name = ["x", "y", "z"][axis];
            return Err(Error::invalid(format!("layer {index}: the volume has {layers} along its {name} axis, counted from 0")));
        }
        let dims = grid.dims();
        let mut middle = DVec3::new(dims[0] as f64 - 1.0, dims[1] as f64 - 1.0, dims[2] as f64 - 1.0) * 0.5;
        middle[axis] = index as f64;
        Ok(grid.index_to_world().transform_point3(middle).dot(self.axis))
    }

    /// How an offset reads: with the letter of the side it lies on, or the axis it is measured along: "S 12.5 mm", "x 3.0"; "offset -4.0"
    /// along an oblique normal.
    pub fn position(&self, offset: f64) -> String {
        let along = (0..3).find(|&i| self.axis[i] == 1.0);
        let unit = if self.space == Space::Unknown { "" } else { " mm" };
        let number = |x: f64| {
            let text = format!("{x:.1}");
            if text == "-0.0" { "0.0".to_owned() } else { text }
        };
        match (along, self.space.letters(self.axis * if offset < 0.0 { -1.0 } else { 1.0 })) {
            (Some(_), Some(letter)) => format!("{letter} {}{unit}", number(offset.abs())),
            (Some(axis), None) => format!("{} {}{unit}", ["x", "y", "z"][axis], number(offset)),
            (None, _) => format!("offset {}{unit}", number(offset)),
        }
    }
}

/// Smallest and largest dot product of the box's corners with `direction`.
pub(super) fn along(grid: &Grid, direction: DVec3) -> (f64, f64) {
    let products = grid.corners().map(|c| c.dot(direction));
    products.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
