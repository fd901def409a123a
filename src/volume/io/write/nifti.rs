//! NIfTI-1 as it is written: header and voxels in one file. Source of the format: `nifti1.h`, <https://nifti.nimh.nih.gov/nifti-1>.

use super::{AUTHOR, Page, WriteFormat, grids};
use crate::volume::{Channels, LengthUnit, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DQuat, DVec3};

/// Where the voxels start: behind the header and the four bytes that say that nothing else comes between.
const VOXELS: usize = 352;

/// Most voxels along an axis.
const LONGEST: usize = i16::MAX as usize;

/// Code of a transform to a scanner's coordinates.
const SCANNER: i16 = 1;

/// Intent of voxels that are labels.
const LABELS: i16 = 1002;

/// Whether slope and intercept can be kept in the file, which has f32 for them and takes a slope of 0 for none.
pub(super) fn keeps_rescale(volume: &Volume) -> bool {
    let (slope, intercept) = volume.rescale();
    let (slope, intercept) = (slope as f32, intercept as f32);
    slope.is_normal() && intercept.is_finite()
}

/// A header that is filled field by field.
struct Bytes(Vec<u8>);

impl Bytes {
    fn put(&mut self, at: usize, bytes: &[u8]) {
        self.0[at..at + bytes.len()].copy_from_slice(bytes);
    }

    fn i16(&mut self, at: usize, value: i16) {
        self.put(at, &value.to_le_bytes());
    }

    fn f32s(&mut self, at: usize, values: impl IntoIterator<Item = f64>) {
        for (n, value) in values.into_iter().enumerate() {
            // Adding 0 turns -0 into 0.
            self.put(at + 4 * n, &(value as f32 + 0.0).to_le_bytes());
        }
    }
}

/// The header.
///
/// # Errors
/// When an axis is too long for the format, when colours are not u8, when the grid's numbers overflow f32.
pub(super) fn header(page: &mut Page) -> Result<Vec<u8>> {
    let grid = page.volume.grid();
    let dims = grid.dims();
    if let Some(axis) = dims.iter().position(|&n| n > LONGEST) {
        return Err(Error::invalid(format!(
            "{} voxels along axis {axis}: NIfTI-1 holds {LONGEST} at most, write .nrrd instead",
            dims[axis]
        )));
    }
    let (code, bits) = datatype(page)?;
    let mut bytes = Bytes(vec![0; VOXELS]);
    bytes.put(0, &348i32.to_le_bytes());
    bytes.put(38, b"r");
    for (n, size) in [3, dims[0], dims[1], dims[2], 1, 1, 1, 1].into_iter().enumerate() {
        bytes.i16(40 + 2 * n, size as i16);
    }
    if matches!(page.volume.channels(), Channels::Label(_)) {
        bytes.i16(68, LABELS);
    }
    bytes.i16(70, code);
    bytes.i16(72, bits);
    bytes.f32s(108, [VOXELS as f64]);
    let (slope, intercept) = page.rescale;
    bytes.f32s(112, [slope, intercept]);
    // A world that is a body is measured in millimetres, unless something else is said.
    let body = grid.space() != Space::Unknown;
    let unit = match page.volume.unit() {
        Some(LengthUnit::Metre) => 1,
        Some(LengthUnit::Millimetre) => 2,
        Some(LengthUnit::Micrometre) => 3,
        Some(other) => {
            page.note(format!("NIfTI-1 has no {}: the unit of lengths is left out", other.name()));
            0
        }
        None => {
            if body {
                2
            } else {
                0
            }
        }
    };
    bytes.put(123, &[unit]);
    bytes.put(148, AUTHOR.as_bytes());
    geometry(page, &mut bytes)?;
    bytes.put(344, b"n+1\0");

    if f64::from(slope as f32) != slope || f64::from(intercept as f32) != intercept {
        page.note(format!("NIfTI-1 keeps slope {slope} and intercept {intercept} in f32, so as {} and {}", slope as f32, intercept as f32));
    }
    page.lost_names(WriteFormat::Nifti);
    Ok(bytes.0)
}

/// Code of the type, and its bits.
fn datatype(page: &Page) -> Result<(i16, i16)> {
    let code = match page.kind {
        kind if page.volume.channels().is_color() => {
            if kind != VoxelType::U8 {
                return Err(Error::invalid(format!("colours of {kind}: NIfTI-1 holds those of u8 alone")));
            }
            return Ok((2304, 32));
        }
        VoxelType::U8 => 2,
        VoxelType::I16 => 4,
        VoxelType::I32 => 8,
        VoxelType::F32 => 16,
        VoxelType::F64 => 64,
        VoxelType::I8 => 256,
        VoxelType::U16 => 512,
        VoxelType::U32 => 768,
    };
    Ok((code, 8 * page.kind.bytes() as i16))
}

/// Fills in where the voxels are.
fn geometry(page: &mut Page, bytes: &mut Bytes) -> Result<()> {
    let grid = page.volume.grid();
    let (origin, steps) = grids::in_space(grid, Space::Ras);
    let spacing = grid.spacing();
    let fits = |x: f64| (x as f32).is_finite() && (x == 0.0 || (x as f32) != 0.0);
    if let Some(bad) = steps.to_cols_array().into_iter().chain(origin.to_array()).chain(spacing).find(|&x| !fits(x)) {
        return Err(Error::invalid(format!("{bad:?} in origin or steps: NIfTI-1 keeps them in f32, which cannot hold it")));
    }
    let mirrored = steps.determinant() < 0.0;
    bytes.f32s(76, [if mirrored { -1.0 } else { 1.0 }, spacing[0], spacing[1], spacing[2], 1.0, 1.0, 1.0, 1.0]);
    match grid.space() {
        Space::Unknown if grids::is_upright(grid) && grid.origin() == DVec3::ZERO => {
            // Both transforms have the code 0: the voxels' sizes are all that is known.
            page.note("the volume does not say how its axes lie in the body, and neither does the file: other programs may take them for right, front and top");
            return Ok(());
        }
        Space::Unknown => page.note("NIfTI-1 takes the axes of the world for right, front and top; the volume does not say what they are"),
        Space::Lps => page.note("NIfTI-1 has axes to right, front and top: the signs of x and y in origin and directions were changed"),
        Space::Ras => {}
    }
    bytes.i16(254, SCANNER);
    for row in 0..3 {
        let r = steps.row(row);
        bytes.f32s(280 + 16 * row, [r.x, r.y, r.z, origin[row]]);
    }
    if grids::is_rectangular(grid) {
        bytes.i16(252, SCANNER);
        let mut turn = DMat3::from_cols(steps.x_axis.normalize(), steps.y_axis.normalize(), steps.z_axis.normalize());
        if mirrored {
            turn.z_axis = -turn.z_axis;
        }
        // The quaternion's first number is left out of the file, and taken for positive.
        let q = DQuat::from_mat3(&turn).normalize();
        let q = if q.w < 0.0 { -q } else { q };
        bytes.f32s(256, [q.x, q.y, q.z, origin.x, origin.y, origin.z]);
    } else {
        page.note("the axes are not at right angles to each other: the file has a matrix (sform) and no quaternion (qform), which some programs refuse");
    }
    Ok(())
}
