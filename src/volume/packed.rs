//! 8-bit voxels side by side with their neighbours along y, so that one load brings four corners of a cell.

use super::voxels::Voxels;
use rayon::prelude::*;

/// Most bytes a packed copy may take. It comes on top of the voxels, so a small volume may need three times its size, a large one
/// is looked up as it is.
pub(crate) const PACKED_LIMIT: usize = 128 << 20;

/// For each 8-bit voxel, itself in the low byte and its neighbour along y in the high one; signs are kept as bits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Packed {
    /// In the order of the voxels. The last row along y is paired with itself; no cell starts there.
    pub(crate) pairs: Vec<u16>,
}

impl Packed {
    /// Packs 8-bit voxels on a grid of `dims`; `None` for other types, for rows of one voxel, and past [`PACKED_LIMIT`].
    pub(crate) fn new(voxels: &Voxels, [nx, ny, _]: [usize; 3]) -> Option<Self> {
        let bytes: &[u8] = match voxels {
            Voxels::U8(v) => v,
            Voxels::I8(v) => bytemuck::cast_slice(v),
            _ => return None,
        };
        if nx < 2 || 2 * bytes.len() > PACKED_LIMIT {
            return None;
        }
        let layer = nx * ny;
        let mut pairs = vec![0u16; bytes.len()];
        pairs.par_chunks_mut(layer).zip(bytes.par_chunks(layer)).for_each(|(pairs, bytes)| {
            let next = bytes[nx.min(layer)..].iter().chain(&bytes[layer - nx..]);
            for ((pair, &here), &below) in pairs.iter_mut().zip(bytes).zip(next) {
                *pair = u16::from_le_bytes([here, below]);
            }
        });
        Some(Self { pairs })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_voxel_is_paired_with_its_neighbour_along_y() {
        for dims in [[3, 4, 2], [2, 1, 3], [5, 2, 1]] {
            let [nx, ny, nz] = dims;
            let voxels: Vec<u8> = (0..nx * ny * nz).map(|i| (i * 37) as u8).collect();
            let packed = Packed::new(&Voxels::U8(voxels.clone().into()), dims).unwrap();
            for i in 0..voxels.len() {
                let below = if i / nx % ny + 1 < ny { i + nx } else { i };
                assert_eq!(packed.pairs[i], u16::from_le_bytes([voxels[i], voxels[below]]), "{dims:?} voxel {i}");
            }
        }
    }

    #[test]
    fn other_types_and_single_columns_are_left_alone() {
        assert_eq!(Packed::new(&Voxels::U16(vec![0; 8].into()), [2, 2, 2]), None);
        assert_eq!(Packed::new(&Voxels::U8(vec![0; 4].into()), [1, 2, 2]), None);
    }
}
