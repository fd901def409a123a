//! Readers of volume files.

use crate::volume::{Grid, VoxelType, Voxels};
use crate::{Error, Limits, Result, Volume};
use std::path::Path;

/// What a raw file holds.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "shim")]
pub struct RawSpec {
    pub dimensions: [usize; 3],
    pub voxel_type: VoxelType,
    pub endian: Endian,
    pub spacing: [f64; 3],
    pub origin: [f64; 3],
    pub offset: u64,
}

/// Byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "shim")]
pub enum Endian {
    Little,
    Big,
}

/// Reads a file.
///
/// # Errors
/// Always.
pub fn read(path: impl AsRef<Path>, _: &Limits) -> Result<Volume> {
    let path = path.as_ref();
    std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    Err(Error::format(path, "not a volume file that is known here"))
}

/// Reads a raw file.
///
/// # Errors
/// When it cannot be read.
pub fn read_raw(path: impl AsRef<Path>, spec: &RawSpec, _: &Limits) -> Result<Volume> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let grid = Grid::with_spacing(spec.dimensions, spec.spacing)?;
    let mut voxels = Voxels::zeros(spec.voxel_type, grid.voxel_count());
    let into = voxels.as_bytes_mut();
    let Some(from) = bytes.get(spec.offset as usize..).filter(|b| b.len() >= into.len()) else {
        return Err(Error::format(path, format!("{} bytes, too short for {}", bytes.len(), into.len())));
    };
    into.copy_from_slice(&from[..into.len()]);
    if spec.endian == Endian::Big {
        voxels.swap_bytes();
    }
    Volume::new(grid, voxels)
}
