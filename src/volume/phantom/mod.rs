//! Built-in volumes: formulas sampled at any size, the same bytes on every machine.
//!
//! ```text
//!   formula space                        voxel i of n along each axis
//!   -1 +-----------------+ +1            stands at (2 i - (n-1)) / (n-1); a single voxel at 0
//!      o---o---o---o---o                 world: voxel (0,0,0) at the origin, spacing 1
//! ```
//!
//! Voxels at opposite places have coordinates that are exact negatives, so the symmetries of a formula hold to the bit.

mod cloud;
mod head;
mod orbital;
mod rings;
mod signal;

use super::{Grid, Volume, Voxel, VoxelType};
use crate::{Error, Limits, Result};
use rayon::prelude::*;

/// A built-in volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Phantom {
    /// The Marschner-Lobb test signal, in `[0,1]`.
    MarschnerLobb,
    /// Electron density of a hydrogen atom's 4d orbital (m = 0), 1 where it is highest.
    Hydrogen,
    /// The Shepp-Logan head in three dimensions, higher contrast: ten ellipsoids, in `[0,1]`.
    SheppLogan,
    /// Signed distance to the Borromean rings, negative inside, in half sides of the box.
    DistanceField,
    /// A cumulus of value noise with soft edges, in `[0,1]`.
    Cloud,
}

impl Phantom {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::MarschnerLobb, Self::Hydrogen, Self::SheppLogan, Self::DistanceField, Self::Cloud];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::MarschnerLobb => "marschner-lobb",
            Self::Hydrogen => "hydrogen",
            Self::SheppLogan => "shepp-logan",
            Self::DistanceField => "distance-field",
            Self::Cloud => "cloud",
        }
    }

    /// The phantom called `name` in a scene file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// One line on what it is.
    pub fn about(self) -> &'static str {
        match self {
            Self::MarschnerLobb => "the Marschner-Lobb test signal: rings close to what the grid can hold (f_M = 6, alpha = 0.25)",
            Self::Hydrogen => "electron density of hydrogen's 4d orbital: lobes and collars, one inside the other",
            Self::SheppLogan => "the Shepp-Logan head in three dimensions: ten ellipsoids of constant value",
            Self::DistanceField => "signed distance to the Borromean rings: three rings, no two of them linked",
            Self::Cloud => "a cumulus of value noise with soft edges",
        }
    }

    /// The type its voxels have unless another is asked for: f32, and u8 for the cloud.
    pub fn voxel_type(self) -> VoxelType {
        if self == Self::Cloud { VoxelType::U8 } else { VoxelType::F32 }
    }

    /// Smallest and largest value the formula takes within the box.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::DistanceField => (-rings::TUBE, rings::FARTHEST),
            _ => (0.0, 1.0),
        }
    }

    /// The value at a point of formula space, where the box is `[-1,1]` along each axis.
    pub fn value(self, point: [f64; 3]) -> f64 {
        match self {
            Self::MarschnerLobb => signal::marschner_lobb(point),
            Self::Hydrogen => orbital::density(point),
            Self::SheppLogan => head::value(point, 0.0),
            Self::DistanceField => rings::distance(point),
            Self::Cloud => cloud::density(point),
        }
    }

    /// The phantom sampled with `size` voxels along each axis, in its own type.
    ///
    /// # Errors
    /// [`Error::Invalid`] for size 0, [`Error::Limit`] when the voxels would take more than the default [`Limits`].
    pub fn volume(self, size: usize) -> Result<Volume> {
        self.volume_as(size, self.voxel_type(), &Limits::default())
    }

    /// The phantom sampled with `size` voxels along each axis, as voxels of type `kind`.
    ///
    /// Integers use their whole range for [`Phantom::range`], and the volume's rescale brings the values back to it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for size 0, [`Error::Limit`] when the voxels would take more memory than `limits` or the machine has.
    pub fn volume_as(self, size: usize, kind: VoxelType, limits: &Limits) -> Result<Volume> {
        let bytes = (size as u128).saturating_pow(3).saturating_mul(kind.bytes() as u128);
        if bytes > u128::from(limits.voxel_bytes) {
            let what = format!("bytes of the {} phantom at size {size}", self.name());
            return Err(Error::Limit { what, needed: bytes, limit: u128::from(limits.voxel_bytes) });
        }
        let grid = Grid::with_spacing([size; 3], [1.0; 3])?;
        let volume = match kind {
            VoxelType::U8 => self.sample::<u8>(grid),
            VoxelType::I8 => self.sample::<i8>(grid),
            VoxelType::U16 => self.sample::<u16>(grid),
            VoxelType::I16 => self.sample::<i16>(grid),
            VoxelType::U32 => self.sample::<u32>(grid),
            VoxelType::I32 => self.sample::<i32>(grid),
            VoxelType::F32 => self.sample::<f32>(grid),
            VoxelType::F64 => self.sample::<f64>(grid),
        }?;
        Ok(volume.with_name(self.name()))
    }

    fn sample<T: Voxel>(self, grid: Grid) -> Result<Volume> {
        let (low, high) = self.range();
        let (first, last) = T::TYPE.limits();
        let slope = if is_float(T::TYPE) { 1.0 } else { (high - low) / (last - first) };
        let intercept = if is_float(T::TYPE) { 0.0 } else { low - slope * first };
        let [n, ..] = grid.dims();
        let at: Vec<f64> = (0..n).map(|i| coordinate(i, n)).collect();
        // Half a voxel: the width over which a sharp edge is spread.
        let soft = if n > 1 { 1.0 / (n - 1) as f64 } else { 1.0 };
        let mut voxels = Vec::new();
        if crate::memory::reserve(&mut voxels, grid.voxel_count()).is_err() {
            let needed = grid.voxel_count() as u128 * T::TYPE.bytes() as u128;
            return Err(Error::Limit { what: format!("bytes of free memory for the {} phantom", self.name()), needed, limit: 0 });
        }
        voxels.resize(grid.voxel_count(), T::from_f64(0.0));
        voxels.par_chunks_mut(n * n).zip(&at).for_each(|(slab, &z)| {
            for (row, &y) in slab.chunks_mut(n).zip(&at) {
                for (voxel, &x) in row.iter_mut().zip(&at) {
                    let value = if self == Self::SheppLogan { head::value([x, y, z], soft) } else { self.value([x, y, z]) };
                    *voxel = T::from_f64((value - intercept) / slope);
                }
            }
        });
        Volume::new(grid, T::wrap(voxels.into()))?.with_rescale(slope, intercept)
    }
}

fn is_float(kind: VoxelType) -> bool {
    matches!(kind, VoxelType::F32 | VoxelType::F64)
}

/// Where voxel `i` of `n` stands in `[-1,1]`.
fn coordinate(i: usize, n: usize) -> f64 {
    if n == 1 { 0.0 } else { (2.0 * i as f64 - (n - 1) as f64) / (n - 1) as f64 }
}

#[cfg(test)]
mod tests;
