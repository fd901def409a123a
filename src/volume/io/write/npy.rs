//! NumPy arrays as they are written. Source of the format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use super::{Page, WriteFormat, grids};
use crate::volume::VoxelType;

/// The header of an array (z, y, x), or (z, y, x, 4) for colours.
pub(super) fn header(page: &mut Page) -> Vec<u8> {
    if page.volume.channels().is_color() && page.kind != VoxelType::U8 {
        page.note(format!("of NumPy files colours of bytes alone are read here again: these are {}", page.kind));
    }
    let [x, y, z] = page.volume.grid().dims();
    let descr = match page.kind {
        VoxelType::U8 => "|u1",
        VoxelType::I8 => "|i1",
        VoxelType::U16 => "<u2",
        VoxelType::I16 => "<i2",
        VoxelType::U32 => "<u4",
        VoxelType::I32 => "<i4",
        VoxelType::F32 => "<f4",
        VoxelType::F64 => "<f8",
    };
    let colors = if page.volume.channels().is_color() { ", 4" } else { "" };
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({z}, {y}, {x}{colors}), }}");
    // Magic, version and the length of the text come first; a line end is last, at a multiple of 64 bytes.
    let before = 10;
    let length = (before + text.len() + 1).next_multiple_of(64) - before;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // Three sizes of at most 20 digits keep the text far below 65536 bytes.
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.resize(before + length - 1, b' ');
    bytes.push(b'\n');

    if !grids::is_plain(page.volume.grid()) {
        let [a, b, c] = page.volume.grid().spacing();
        page.note(format!("NumPy keeps no grid: the spacing of {a} x {b} x {c}, the position and the directions are left out"));
    }
    page.lost_names(WriteFormat::Npy);
    bytes
}
