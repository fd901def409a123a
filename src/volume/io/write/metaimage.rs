//! MetaImage as it is written. Source of the format: <https://itk.org/Wiki/MetaIO/Documentation>.

use super::{AUTHOR, Page, WriteFormat, grids};
use crate::volume::{Modality, Space, VoxelType};

/// The key of the compressed voxels' bytes, without which ITK does not read them.
const SIZE: &str = "CompressedDataSize = ";

/// The number that belongs to [`SIZE`]: always as long, so that it can be put in when the voxels are written.
pub(super) fn size(bytes: u64) -> String {
    format!("{bytes:020}")
}

/// Where it stands in `header`.
pub(super) fn size_at(header: &[u8]) -> Option<u64> {
    let at = header.windows(SIZE.len()).position(|w| w == SIZE.as_bytes())?;
    Some((at + SIZE.len()) as u64)
}

/// The header, up to and with the line that says that the voxels follow.
pub(super) fn header(page: &mut Page) -> Vec<u8> {
    let grid = page.volume.grid();
    let [x, y, z] = grid.dims();
    let kind = match page.kind {
        VoxelType::U8 => "MET_UCHAR",
        VoxelType::I8 => "MET_CHAR",
        VoxelType::U16 => "MET_USHORT",
        VoxelType::I16 => "MET_SHORT",
        VoxelType::U32 => "MET_UINT",
        VoxelType::I32 => "MET_INT",
        VoxelType::F32 => "MET_FLOAT",
        VoxelType::F64 => "MET_DOUBLE",
    };
    let (origin, steps) = grids::in_space(grid, Space::Lps);
    let truth = |t: bool| if t { "True" } else { "False" };
    let mut lines = vec![
        "ObjectType = Image".to_owned(),
        "NDims = 3".to_owned(),
        "BinaryData = True".to_owned(),
        "BinaryDataByteOrderMSB = False".to_owned(),
        format!("CompressedData = {}", truth(page.compress)),
    ];
    if page.compress {
        lines.push(format!("{SIZE}{}", size(page.packed)));
    }
    // A file without a matrix says nothing about the world's axes.
    if grid.space() != Space::Unknown || !grids::is_upright(grid) {
        let columns = [steps.x_axis, steps.y_axis, steps.z_axis].map(glam::DVec3::normalize);
        lines.push(format!("TransformMatrix = {}", grids::text(columns.into_iter().flat_map(|c| c.to_array()), " ")));
    }
    lines.push(format!("Offset = {}", grids::text(origin.to_array(), " ")));
    lines.push(format!("ElementSpacing = {}", grids::text(grid.spacing(), " ")));
    lines.push(format!("DimSize = {x} {y} {z}"));
    match page.volume.modality() {
        Modality::Ct => lines.push("Modality = MET_MOD_CT".to_owned()),
        Modality::Mr => lines.push("Modality = MET_MOD_MR".to_owned()),
        Modality::Other => lines.push("Modality = MET_MOD_OTHER".to_owned()),
        Modality::Unknown => {}
    }
    if page.volume.channels().is_color() {
        lines.push("ElementNumberOfChannels = 4".to_owned());
    }
    if page.rescale != (1.0, 0.0) {
        let (slope, intercept) = page.rescale;
        lines.push(format!("ElementToIntensityFunctionSlope = {}", grids::text([slope], "")));
        lines.push(format!("ElementToIntensityFunctionOffset = {}", grids::text([intercept], "")));
        page.notes.push("few programs heed the slope and intercept of a MetaImage".to_owned());
    }
    lines.push(format!("ElementType = {kind}"));
    let last = "ElementDataFile = LOCAL\n";
    let comment = format!("Comment = written by {AUTHOR}");
    // Behind the comment, stops bring the voxels to a place where they can be mapped.
    let length = lines.iter().map(|l| l.len() + 1).sum::<usize>() + comment.len() + 1 + last.len();
    lines.insert(1, comment + &".".repeat(length.next_multiple_of(32) - length));
    let text = lines.join("\n") + "\n" + last;

    match grid.space() {
        Space::Ras => page.note("MetaImage has axes to left, back and top: the signs of x and y in origin and directions were changed"),
        Space::Unknown if !grids::is_upright(grid) => {
            page.note(
                "MetaImage takes a grid that is turned for one with axes to left, back and top; the volume does not say what its axes are",
            );
        }
        Space::Unknown | Space::Lps => {}
    }
    if !grids::is_rectangular(grid) {
        page.note("the axes are not at right angles to each other: not every program that reads MetaImage takes that");
    }
    page.lost_names(WriteFormat::MetaImage);
    text.into_bytes()
}
