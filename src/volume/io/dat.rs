//! Volumes as VolVis and the visualization group of TU Wien wrote them, `.dat`: three little-endian u16 with the dimensions x, y and z,
//! then as many voxels of little-endian u16, x fastest, and nothing else. Of a voxel's 16 bits 12 are used as a rule.
//!
//! Source of the format: the description that TU Wien gives with its data sets. There is no magic number, so it takes the name's
//! extension and a length that agrees to the byte to recognise such a file.

use super::Endian;
use super::field::named;
use super::reader::{Certainty, Clues, Reader};
use super::reading::Reading;
use super::source::Tail;
use super::store::Store;
use crate::Result;
use crate::volume::{Grid, Volume, VoxelType};

pub(super) const READER: Reader = Reader {
    name: "VolVis",
    extensions: &["dat"],
    reads: "three dimensions, then little-endian u16 voxels; known by its exact length",
    parts: &[],
    probe,
    read,
    list: None,
};

const HEADER: usize = 6;

fn dims(header: &[u8]) -> [usize; 3] {
    [0, 2, 4].map(|at| Endian::Little.u16(&header[at..]).into())
}

/// Bytes of a whole file. Three numbers of 16 bits cannot make this overflow.
fn length(dims: [usize; 3]) -> u64 {
    HEADER as u64 + 2 * dims.iter().map(|&n| n as u64).product::<u64>()
}

fn probe(clues: &Clues) -> Certainty {
    let by_name = clues.by_name(READER.extensions);
    let Some(header) = clues.head.get(..HEADER).filter(|_| by_name > Certainty::No) else { return by_name };
    let dims = dims(header);
    if !dims.contains(&0) && clues.is_long(length(dims)) { Certainty::Length } else { by_name }
}

fn read(store: Store, _: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let dims = dims(&source.header(HEADER, "the header of a .dat file")?);
    let total = HEADER as u64 + source.left();
    if dims.contains(&0) || (!source.is_packed() && total != length(dims)) {
        let ([x, y, z], wanted) = (dims, length(dims));
        // How much a gzip file holds is not known before it is inflated.
        let held = if source.is_packed() { String::new() } else { format!(", not {total}") };
        let what =
            format!("a .dat file starts with its dimensions, here {x} x {y} x {z}: with voxels of u16 it takes {wanted} bytes{held}");
        return Err(source.fault(format!("{what} (a raw file needs its dimensions and type)")));
    }
    let grid = named(source.path(), Grid::with_spacing(dims, [1.0; 3]))?;
    let voxels = source.voxels(dims, VoxelType::U16.into(), Endian::Little, Tail::Exact)?;
    named(source.path(), Volume::new(grid, voxels))
}
