//! Volumes: typed voxels on a grid in the world, and the files and formulas they come from.

mod grid;
#[cfg(feature = "formats")]
pub mod io;
pub mod phantom;
mod stats;
mod voxels;

pub use grid::{BoxConvention, Grid, Space};
pub use stats::{HISTOGRAM_BINS, Statistics};
pub(crate) use voxels::with_voxels;
pub use voxels::{Voxel, VoxelType, Voxels};

use crate::{Error, Result};
use std::sync::OnceLock;

/// What kind of numbers the voxels are, where the file or the caller says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Modality {
    /// Nobody says.
    #[default]
    Unknown,
    /// Computed tomography in Hounsfield units: air -1000, water 0, bone above about 300.
    Ct,
    /// Magnetic resonance: arbitrary units, 0 and up.
    Mr,
}

/// A scalar volume: a [`Grid`] and its voxels, with the linear map to the data's units.
///
/// # Guarantees
/// - there are exactly as many voxels as the grid has points;
/// - slope and intercept are finite and the slope is not 0.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Grid,
    voxels: Voxels,
    slope: f64,
    intercept: f64,
    modality: Modality,
    name: String,
    statistics: OnceLock<Statistics>,
}

impl Volume {
    /// A volume of `voxels` (x fastest) on `grid`, values as stored.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the number of voxels is not the grid's.
    pub fn new(grid: Grid, voxels: Voxels) -> Result<Self> {
        if voxels.len() != grid.voxel_count() {
            let [x, y, z] = grid.dims();
            return Err(Error::invalid(format!("{} voxels given for a grid of {x} x {y} x {z} = {}", voxels.len(), grid.voxel_count())));
        }
        Ok(Self { grid, voxels, slope: 1.0, intercept: 0.0, modality: Modality::Unknown, name: String::new(), statistics: OnceLock::new() })
    }

    /// The same volume with value = slope * stored + intercept (NIfTI `scl_slope`, DICOM rescale).
    ///
    /// # Errors
    /// [`Error::Invalid`] when either is not finite or the slope is 0.
    pub fn with_rescale(mut self, slope: f64, intercept: f64) -> Result<Self> {
        if !slope.is_finite() || !intercept.is_finite() || slope == 0.0 {
            return Err(Error::invalid(format!("rescale slope {slope}, intercept {intercept}: both must be finite and the slope not 0")));
        }
        self.slope = slope;
        self.intercept = intercept;
        self.statistics = OnceLock::new();
        Ok(self)
    }

    /// The same volume with its kind of values stated.
    #[must_use]
    pub fn with_modality(mut self, modality: Modality) -> Self {
        self.modality = modality;
        self
    }

    /// The same volume with a name for messages: usually the file's path.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The same voxels filling their box by another convention.
    #[must_use]
    pub fn with_convention(mut self, convention: BoxConvention) -> Self {
        self.grid = self.grid.with_convention(convention);
        self
    }

    /// Where the voxels are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The voxels as stored.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// (slope, intercept) of value = slope * stored + intercept.
    pub fn rescale(&self) -> (f64, f64) {
        (self.slope, self.intercept)
    }

    /// Kind of values.
    pub fn modality(&self) -> Modality {
        self.modality
    }

    /// Name for messages; may be empty.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The value at voxel (i,j,k) in the data's units.
    ///
    /// # Panics
    /// When the voxel is outside the grid.
    pub fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny, nz] = self.grid.dims();
        assert!(i < nx && j < ny && k < nz, "voxel {i},{j},{k} outside {nx} x {ny} x {nz}");
        self.slope * self.voxels.get((k * ny + j) * nx + i) + self.intercept
    }

    /// Range, mean and histogram, computed once.
    pub fn statistics(&self) -> &Statistics {
        self.statistics.get_or_init(|| Statistics::of(&self.voxels, self.slope, self.intercept))
    }
}
