//! Levels of detail: one volume at several sizes of voxels, of which boxes of voxels are read when they are needed.
//!
//! ```text
//!   level 0   o o o o o o o o     the volume itself
//!   level 1    o   o   o   o      voxels twice as large along the axes whose voxels were the smallest
//!   level 2      o       o
//! ```
//!
//! A level is cut into bricks, boxes of voxels that are read as one piece. The levels of a single array ([`Levels::of_volume`]) are every
//! second, fourth, eighth ... voxel of it, and cost nothing to make; those of an OME-Zarr image lie in files of their own, and each voxel of
//! them usually is the mean of those in its place.

pub(crate) mod plain;

use super::{Modality, Volume, VoxelType, Voxels};
use crate::volume::{BoxConvention, Grid, LengthUnit};
use crate::{Error, Result};
use std::fmt;
use std::sync::Arc;

/// Largest side in voxels of the coarsest level that is made of a single array.
const COARSEST: usize = 32;

/// Where the bricks of a level come from.
pub(crate) trait Bricks: Send + Sync {
    /// The voxels of brick `at`, whose size is [`Level::brick`], x fastest, as bytes in this machine's order; and how many bytes were
    /// read for them.
    fn read(&self, at: [usize; 3]) -> Result<(Vec<u8>, u64)>;

    /// Bytes that [`Bricks::read`] takes besides what it returns, at most.
    fn besides(&self) -> u64 {
        0
    }

    /// Bytes of a file that stay in memory between reads, at most.
    fn held(&self) -> u64 {
        0
    }

    /// Least and greatest finite stored value of brick `at`, where that is known without reading it; least above greatest where none is
    /// finite.
    fn range(&self, at: [usize; 3]) -> Option<(f32, f32)> {
        let _ = at;
        None
    }
}

/// One volume at one size of voxels.
#[derive(Clone)]
pub struct Level {
    grid: Grid,
    /// Voxels along a brick's sides.
    sides: [usize; 3],
    bricks: Arc<dyn Bricks>,
}

impl fmt::Debug for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Level").field("dims", &self.grid.dims()).field("bricks", &self.sides).finish_non_exhaustive()
    }
}

impl Level {
    pub(crate) fn new(grid: Grid, sides: [usize; 3], bricks: Arc<dyn Bricks>) -> Self {
        let dims = grid.dims();
        Self { grid, sides: [0, 1, 2].map(|axis| sides[axis].clamp(1, dims[axis])), bricks }
    }

    /// Where its voxels are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Voxels along the sides of a brick; those at the upper border hold what is left.
    pub fn sides(&self) -> [usize; 3] {
        self.sides
    }

    /// First voxel and number of voxels of brick `at`, along x, y and z.
    pub(crate) fn brick(&self, at: [usize; 3]) -> ([usize; 3], [usize; 3]) {
        let first = [0, 1, 2].map(|axis| at[axis] * self.sides[axis]);
        (first, [0, 1, 2].map(|axis| self.sides[axis].min(self.grid.dims()[axis] - first[axis])))
    }

    pub(crate) fn bricks(&self) -> &dyn Bricks {
        &*self.bricks
    }
}

/// One volume at several sizes of voxels, finest first. See the module's page.
///
/// # Guarantees
/// There is at least one level; voxels are scalars; slope and intercept are finite, the slope not 0.
#[derive(Debug, Clone)]
pub struct Levels {
    levels: Vec<Level>,
    kind: VoxelType,
    rescale: (f64, f64),
    modality: Modality,
    unit: Option<LengthUnit>,
    name: String,
    notes: Vec<String>,
    /// Least and greatest finite stored value of the finest level, where they are known.
    range: Option<(f64, f64)>,
}

impl Levels {
    /// Levels that go with the properties of `like`, which need not hold voxels of theirs.
    pub(crate) fn new(levels: Vec<Level>, like: &Volume, range: Option<(f64, f64)>) -> Self {
        Self {
            levels,
            kind: like.voxels().voxel_type(),
            rescale: like.rescale(),
            modality: like.modality(),
            unit: like.unit(),
            name: like.name().to_owned(),
            notes: like.notes().to_vec(),
            range,
        }
    }

    /// The levels of a single array: every voxel of `volume`, every second, every fourth, and so on. Voxels of a mapped file are read
    /// from it box by box, and do not stay in memory.
    ///
    /// # Errors
    /// [`Error::Invalid`] for volumes of colours and of labels, which have no values between two voxels.
    pub fn of_volume(volume: &Volume) -> Result<Self> {
        if volume.colors().is_some() || volume.channels() != &super::Channels::Scalar || volume.labels().is_some() {
            return Err(Error::invalid("levels of detail: are of volumes of one number a voxel, neither colours nor labels"));
        }
        let grid = volume.grid();
        let (dims, spacing) = (grid.dims(), grid.spacing());
        let mut steps = [1; 3];
        let mut levels = vec![plain::level(volume, steps)?];
        while (0..3).any(|axis| dims[axis] / steps[axis] > COARSEST) {
            steps = coarser(steps, dims, spacing);
            levels.push(plain::level(volume, steps)?);
        }
        Ok(Self::new(levels, volume, None))
    }

    /// The same levels in a box of another convention.
    #[must_use]
    pub fn with_convention(mut self, convention: BoxConvention) -> Self {
        for level in &mut self.levels {
            level.grid = level.grid.clone().with_convention(convention);
        }
        self
    }

    /// The levels, the finest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The finest level's grid.
    pub fn grid(&self) -> &Grid {
        &self.levels[0].grid
    }

    /// Type of the voxels of every level.
    pub fn voxel_type(&self) -> VoxelType {
        self.kind
    }

    /// (slope, intercept) of value = slope * stored + intercept.
    pub fn rescale(&self) -> (f64, f64) {
        self.rescale
    }

    /// Name for messages; usually the file's path.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What was chosen or repaired, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Bytes of the finest level's voxels.
    pub fn bytes(&self) -> u128 {
        self.grid().dims().iter().fold(self.kind.bytes() as u128, |a, &n| a.saturating_mul(n as u128))
    }

    /// A volume of one voxel with the properties of the whole, to be asked about these.
    pub(crate) fn like(&self) -> Volume {
        let (slope, intercept) = self.rescale;
        let one = Voxels::zeros(self.kind, 1);
        let made =
            Grid::with_spacing([1; 3], [1.0; 3]).and_then(|grid| Volume::new(grid, one)).and_then(|v| v.with_rescale(slope, intercept));
        made.unwrap_or_else(|e| unreachable!("one voxel, rescaled as a volume was: {e}"))
    }

    /// Least and greatest finite stored value of the finest level, where they are known without reading it.
    pub(crate) fn range(&self) -> Option<(f64, f64)> {
        self.range
    }

    /// The voxels of `first .. first + size` of level `level` as a volume, on the part of the level's grid.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a box that is empty or not in the level; whatever reading says.
    pub fn part(&self, level: usize, first: [usize; 3], size: [usize; 3]) -> Result<Volume> {
        let Some(from) = self.levels.get(level) else {
            return Err(Error::invalid(format!("level {level}: there are {}", self.levels.len())));
        };
        let dims = from.grid.dims();
        if (0..3).any(|axis| size[axis] == 0 || first[axis].checked_add(size[axis]).is_none_or(|end| end > dims[axis])) {
            return Err(Error::invalid(format!("box of {size:?} voxels from {first:?} on: level {level} has {dims:?}")));
        }
        let mut voxels = Voxels::zeros(self.kind, size.iter().product());
        for_bricks(from, first, size, |at| {
            let (bytes, _) = from.bricks.read(at)?;
            copy_brick(from, at, &bytes, (first, size), voxels.as_bytes_mut(), self.kind.bytes());
            Ok(())
        })?;
        self.volume(level, first, size, voxels)
    }

    /// `voxels` as the volume of a box of level `level`, with the properties of the whole.
    pub(crate) fn volume(&self, level: usize, first: [usize; 3], size: [usize; 3], voxels: Voxels) -> Result<Volume> {
        let grid = &self.levels[level].grid;
        let steps = grid.directions() * glam::DMat3::from_diagonal(grid.spacing().into());
        let origin = grid.index_to_world().transform_point3(glam::DVec3::from_array(first.map(|n| n as f64)));
        let part = Grid::new(size, origin, steps)?.with_space(grid.space()).with_convention(grid.convention());
        let (slope, intercept) = self.rescale;
        let volume = Volume::new(part, voxels)?.with_rescale(slope, intercept)?;
        Ok(volume.with_modality(self.modality).with_name(self.name.clone()).with_unit(self.unit))
    }

    /// A volume to look at in the place of the whole: the finest level of at most `voxels` voxels, or the coarsest there is.
    ///
    /// # Errors
    /// Whatever reading says.
    pub fn overview(&self, voxels: usize) -> Result<Volume> {
        let count = |level: &Level| level.grid.dims().iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
        let level = self.levels.iter().position(|level| count(level) <= voxels as u128).unwrap_or(self.levels.len() - 1);
        self.part(level, [0; 3], self.levels[level].grid.dims())
    }
}

/// The steps of the next coarser level: doubled along the axes whose voxels are the smallest, as long as there are several.
pub(crate) fn coarser(steps: [usize; 3], dims: [usize; 3], spacing: [f64; 3]) -> [usize; 3] {
    let size = |axis: usize| spacing[axis] * steps[axis] as f64;
    let several = |axis: usize| dims[axis] > steps[axis];
    let least = (0..3).filter(|&axis| several(axis)).map(size).fold(f64::INFINITY, f64::min);
    // A voxel half as long again as the smallest is as near to twice its size as to the same.
    [0, 1, 2].map(|axis| if several(axis) && size(axis) < 1.5 * least { 2 * steps[axis] } else { steps[axis] })
}

/// Tells `see` each brick of `level` that holds a voxel of the box, in their order in the file.
pub(crate) fn for_bricks(level: &Level, first: [usize; 3], size: [usize; 3], mut see: impl FnMut([usize; 3]) -> Result<()>) -> Result<()> {
    let range = |axis: usize| first[axis] / level.sides[axis]..(first[axis] + size[axis] - 1) / level.sides[axis] + 1;
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                see([x, y, z])?;
            }
        }
    }
    Ok(())
}

/// Copies what a brick's `bytes` hold of a box into the box's own, `out`; voxels have `each` bytes.
pub(crate) fn copy_brick(
    level: &Level,
    at: [usize; 3],
    bytes: &[u8],
    (first, size): ([usize; 3], [usize; 3]),
    out: &mut [u8],
    each: usize,
) {
    let (from, held) = level.brick(at);
    let low = [0, 1, 2].map(|axis| first[axis].max(from[axis]));
    let high = [0, 1, 2].map(|axis| (first[axis] + size[axis]).min(from[axis] + held[axis]));
    if (0..3).any(|axis| low[axis] >= high[axis]) {
        return;
    }
    let row = (high[0] - low[0]) * each;
    for z in low[2]..high[2] {
        for y in low[1]..high[1] {
            let source = (((z - from[2]) * held[1] + y - from[1]) * held[0] + low[0] - from[0]) * each;
            let target = (((z - first[2]) * size[1] + y - first[1]) * size[0] + low[0] - first[0]) * each;
            out[target..target + row].copy_from_slice(&bytes[source..source + row]);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests;
