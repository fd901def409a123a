//! Volumes: typed voxels on a grid in the world, and the files and formulas they come from.

pub(crate) mod bricks;
mod buffer;
mod grid;
#[cfg(feature = "formats")]
pub mod io;
pub(crate) mod packed;
pub mod phantom;
#[cfg(feature = "formats")]
mod source;
mod stats;
mod voxels;

pub use buffer::Buffer;
pub use grid::{BoxConvention, Grid, Space};
#[cfg(feature = "formats")]
pub use source::{Origin, VolumeSource};
pub use stats::{HISTOGRAM_BINS, Statistics};
pub(crate) use voxels::with_voxels;
pub use voxels::{Voxel, VoxelType, Voxels};

use crate::{Error, Result};
use bricks::Bricks;
use glam::DVec3;
use std::sync::{Arc, OnceLock};

/// What kind of numbers the voxels are, where the file or the caller says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Modality {
    /// Nobody says.
    #[default]
    Unknown,
    /// Computed tomography in Hounsfield units: air -1000, water 0, bone above about 300.
    Ct,
    /// Magnetic resonance: arbitrary units, 0 and up.
    Mr,
}

impl Modality {
    /// The name used in scene files: `ct`, `mr`; `None` where nobody says.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Unknown => None,
            Self::Ct => Some("ct"),
            Self::Mr => Some("mr"),
        }
    }
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
    bricks: OnceLock<Arc<Bricks>>,
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
        Ok(Self {
            grid,
            voxels,
            slope: 1.0,
            intercept: 0.0,
            modality: Modality::Unknown,
            name: String::new(),
            statistics: OnceLock::new(),
            bricks: OnceLock::new(),
        })
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

    /// The same voxels on another grid.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the number of voxels is not the grid's.
    pub fn with_grid(self, grid: Grid) -> Result<Self> {
        let volume = Self::new(grid, self.voxels)?;
        let statistics = self.statistics;
        Ok(Self { slope: self.slope, intercept: self.intercept, modality: self.modality, name: self.name, statistics, ..volume })
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

    /// Trilinear value at index coordinates `p` in the data's units, in f64, clamped to the edge.
    pub fn sample(&self, p: DVec3) -> f64 {
        let mut low = [0usize; 3];
        let mut high = [0usize; 3];
        let mut t = [0.0; 3];
        for axis in 0..3 {
            let last = self.grid.dims()[axis] - 1;
            let u = p[axis].clamp(0.0, last as f64);
            low[axis] = (u as usize).min(last.saturating_sub(1));
            high[axis] = (low[axis] + 1).min(last);
            t[axis] = u - low[axis] as f64;
        }
        let at = |c: usize| {
            let pick = |axis: usize| if c >> axis & 1 == 1 { high[axis] } else { low[axis] };
            self.value([pick(0), pick(1), pick(2)])
        };
        let lerp = |a: f64, b: f64, t: f64| a + t * (b - a);
        let along_x = [0, 2, 4, 6].map(|c: usize| lerp(at(c), at(c + 1), t[0]));
        lerp(lerp(along_x[0], along_x[1], t[1]), lerp(along_x[2], along_x[3], t[1]), t[2])
    }

    /// Gradient at index coordinates `p` by central differences one voxel wide, per world unit, in world directions.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let difference = |axis: usize| {
            let mut step = DVec3::ZERO;
            step[axis] = 1.0;
            0.5 * (self.sample(p + step) - self.sample(p - step))
        };
        // The gradient is a covector: it goes through the transpose of the map from world to index.
        self.grid.world_to_index().matrix3.transpose() * DVec3::new(difference(0), difference(1), difference(2))
    }

    /// Range, mean and histogram, computed once.
    pub fn statistics(&self) -> &Statistics {
        self.statistics.get_or_init(|| Statistics::of(&self.voxels, self.slope, self.intercept))
    }

    /// Range of stored values brick by brick, computed once.
    pub(crate) fn bricks(&self) -> &Arc<Bricks> {
        self.bricks.get_or_init(|| Arc::new(Bricks::new(&self.voxels, self.grid.dims())))
    }

    /// Smallest and largest finite value in the data's units; zeros when there is none. The voxels are looked at once, for all that
    /// [`Volume::bricks`] tells.
    #[cfg(feature = "scene-file")]
    pub(crate) fn range(&self) -> (f64, f64) {
        if let Some(s) = self.statistics.get() {
            return (s.min, s.max);
        }
        let (low, high) = self.bricks().range;
        let value = |stored: f64| self.slope * stored + self.intercept;
        match (value(low), value(high)) {
            _ if low > high => (0.0, 0.0),
            (a, b) if a > b => (b, a),
            range => range,
        }
    }
}
