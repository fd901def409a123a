//! Raw files as they are written: voxels alone.

use super::{Page, WriteFormat, grids};
use crate::volume::Space;
use crate::{Error, Result};
use glam::DVec3;

/// No bytes at all; but what is to be given where the file is read is told.
///
/// # Errors
/// For colours, which cannot be read from raw files.
pub(super) fn header(page: &mut Page) -> Result<Vec<u8>> {
    if page.volume.channels().is_color() {
        return Err(Error::invalid("colours cannot be read from raw files: write .nrrd instead"));
    }
    let grid = page.volume.grid();
    let [x, y, z] = grid.dims();
    let mut flags = format!("--volume.dimensions {x},{y},{z} --volume.type {}", page.kind);
    let steps = grid.index_to_world().matrix3;
    if grids::is_straight(grid) {
        let spacing = steps.diagonal();
        if spacing != DVec3::ONE {
            flags += &format!(" --volume.spacing {}", grids::text(spacing.to_array(), ","));
        }
        if grid.origin() != DVec3::ZERO {
            flags += &format!(" --volume.origin {}", grids::text(grid.origin().to_array(), ","));
        }
    } else {
        let (spacing, origin) = (grid.spacing(), grid.origin().to_array());
        flags += &format!(" --volume.spacing {} --volume.origin {}", grids::text(spacing, ","), grids::text(origin, ","));
        page.note("a raw file keeps no grid: the directions of the axes are left out");
    }
    if page.volume.grid().space() != Space::Unknown {
        page.note("a raw file does not say how the axes lie in the body");
    }
    page.note(format!("to read it again, give {flags}"));
    page.lost_names(WriteFormat::Raw);
    Ok(Vec::new())
}
