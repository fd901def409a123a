//! Raw files: voxels without a header. The caller describes them.

use super::Endian;
use super::field::{grid, named};
use super::source::{Source, Tail};
use super::store::STDIN;
use crate::settings::Limits;
use crate::volume::{Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::Path;

/// What a raw file holds.
///
/// ```
/// use slicestack::volume::VoxelType;
/// use slicestack::volume::io::{Endian, RawSpec};
///
/// let spec = RawSpec::new([256, 256, 113], VoxelType::I16).with_endian(Endian::Big).with_spacing([1.0, 1.0, 2.0]);
/// assert_eq!(spec.offset, 0);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RawSpec {
    /// Voxels along x, y and z; x varies fastest in the file.
    pub dimensions: [usize; 3],
    /// Type of a voxel.
    pub voxel_type: VoxelType,
    /// Byte order of a voxel.
    pub endian: Endian,
    /// World units from voxel to voxel along each axis; negative mirrors.
    pub spacing: [f64; 3],
    /// World position of the first voxel's centre.
    pub origin: [f64; 3],
    /// Bytes of header to pass over; in a gzip file, after inflation.
    pub offset: u64,
}

impl RawSpec {
    /// Little-endian voxels one unit apart, from the file's first byte on.
    pub fn new(dimensions: [usize; 3], voxel_type: VoxelType) -> Self {
        Self { dimensions, voxel_type, endian: Endian::Little, spacing: [1.0; 3], origin: [0.0; 3], offset: 0 }
    }

    /// Voxels of another byte order.
    #[must_use]
    pub fn with_endian(mut self, endian: Endian) -> Self {
        self.endian = endian;
        self
    }

    /// Voxels another distance apart along x, y and z, world units; negative mirrors.
    #[must_use]
    pub fn with_spacing(mut self, spacing: [f64; 3]) -> Self {
        self.spacing = spacing;
        self
    }

    /// Voxels whose first has its centre at another world position.
    #[must_use]
    pub fn with_origin(mut self, origin: [f64; 3]) -> Self {
        self.origin = origin;
        self
    }

    /// Voxels behind so many bytes of header.
    #[must_use]
    pub fn with_offset(mut self, offset: u64) -> Self {
        self.offset = offset;
        self
    }
}

/// Reads a file of bare voxels, as it is or inside gzip.
///
/// `-` is standard input. A file that starts like gzip but has exactly the length described is taken as it is.
///
/// # Errors
/// When the file cannot be read, is shorter or longer than `spec` says, is over
/// `limits`, or when `spec` describes no valid grid.
pub fn read_raw(path: impl AsRef<Path>, spec: &RawSpec, limits: &Limits) -> Result<Volume> {
    let path = path.as_ref();
    let (origin, steps) = (DVec3::from_array(spec.origin), DMat3::from_diagonal(DVec3::from_array(spec.spacing)));
    let grid = grid(path, spec.dimensions, origin, steps, Space::Unknown)?;
    let mut source = if path == Path::new(STDIN) { Source::open_stdin(limits)? } else { Source::open_plain(path, limits)? };
    let path = source.path().to_path_buf();
    let path = path.as_path();
    if source.left() == 0 {
        return Err(Error::format(path, "the file is empty (0 bytes)"));
    }
    let bytes = (grid.voxel_count() as u64).saturating_mul(spec.voxel_type.bytes() as u64);
    if source.left() != bytes.saturating_add(spec.offset) && source.is_gzip()? {
        source = source.gunzip();
    }
    source.skip(spec.offset)?;
    let voxels = source.voxels(spec.dimensions, spec.voxel_type.into(), spec.endian, Tail::Exact)?;
    Ok(named(path, Volume::new(grid, voxels))?.with_name(path.display().to_string()))
}
