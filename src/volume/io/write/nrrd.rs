//! NRRD as it is written. Source of the format: <https://teem.sourceforge.net/nrrd/format.html>; of the keys of segments:
//! <https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html>.

use super::{AUTHOR, Page, grids};
use crate::volume::{Channels, Modality, Segment, Space, VoxelType};

/// The header, and the empty line behind it.
pub(super) fn header(page: &Page) -> Vec<u8> {
    let grid = page.volume.grid();
    let [x, y, z] = grid.dims();
    let kind = match page.kind {
        VoxelType::U8 => "uint8",
        VoxelType::I8 => "int8",
        VoxelType::U16 => "uint16",
        VoxelType::I16 => "int16",
        VoxelType::U32 => "uint32",
        VoxelType::I32 => "int32",
        VoxelType::F32 => "float",
        VoxelType::F64 => "double",
    };
    let colors = page.volume.channels().is_color();
    // The components of a colour are an axis of their own, the fastest.
    let [dimension, sizes, none, kinds] = if colors { ["4", "4 ", "none ", "RGBA-color "] } else { ["3", "", "", ""] };
    let space = match grid.space() {
        Space::Unknown => "space dimension: 3",
        Space::Ras => "space: right-anterior-superior",
        Space::Lps => "space: left-posterior-superior",
    };
    let steps = grid.index_to_world().matrix3;
    let vector = |v: glam::DVec3| format!("({})", grids::text(v.to_array(), ","));
    let directions = [steps.x_axis, steps.y_axis, steps.z_axis].map(vector).join(" ");
    let mut lines = vec![
        "NRRD0005".to_owned(),
        format!("# written by {AUTHOR}"),
        format!("type: {kind}"),
        format!("dimension: {dimension}"),
        space.to_owned(),
        format!("sizes: {sizes}{x} {y} {z}"),
        format!("space directions: {none}{directions}"),
        format!("kinds: {kinds}domain domain domain"),
        "endian: little".to_owned(),
        format!("encoding: {}", if page.compress { "gzip" } else { "raw" }),
        format!("space origin: {}", vector(grid.origin())),
    ];
    if let Some(unit) = page.volume.unit() {
        let axes = vec![format!("\"{}\"", unit.symbol()); 3];
        lines.push(format!("space units: {}", axes.join(" ")));
    }
    match page.volume.modality() {
        Modality::Ct => lines.push("modality:=CT".to_owned()),
        Modality::Mr => lines.push("modality:=MR".to_owned()),
        Modality::Other => lines.push("modality:=OT".to_owned()),
        Modality::Unknown => {}
    }
    if let Channels::Label(segments) = page.volume.channels() {
        lines.extend(segments.iter().enumerate().flat_map(|(n, segment)| keys(n, segment, [x, y, z])));
    }
    let mut text = lines.join("\n") + "\n";
    // A comment brings the voxels, behind an empty line, to a place where they can be mapped.
    let length = text.len() + 3;
    text += &format!("#{}\n\n", " ".repeat(length.next_multiple_of(32) - length));
    text.into_bytes()
}

/// The keys of segment number `n`, as 3D Slicer names them.
fn keys(n: usize, segment: &Segment, dims: [usize; 3]) -> Vec<String> {
    // A value stands on one line.
    let name = segment.name.replace('\\', "\\\\").replace('\n', "\\n");
    let [x, y, z] = dims.map(|n| n - 1);
    let mut keys = vec![
        format!("Segment{n}_ID:=Segment_{}", segment.value),
        format!("Segment{n}_Name:={name}"),
        format!("Segment{n}_LabelValue:={}", segment.value),
        format!("Segment{n}_Layer:=0"),
        format!("Segment{n}_Extent:=0 {x} 0 {y} 0 {z}"),
    ];
    if let Some(color) = segment.color {
        keys.push(format!("Segment{n}_Color:={}", grids::text(color, " ")));
    }
    keys
}
