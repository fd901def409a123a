//! 8- and 16-bit voxels side by side with their neighbours along y, so that one load brings four corners of a cell.

use super::voxels::Voxels;
use rayon::prelude::*;

/// Most bytes a packed copy may take. It comes on top of the voxels, so a small volume may need three times its size, a large one
/// is looked up as it is.
pub(crate) const PACKED_LIMIT: usize = 128 << 20;

/// For each voxel, itself in the lower half and its neighbour along y in the upper one; signs are kept as bits.
///
/// In the order of the voxels. The last row along y is paired with itself; no cell starts there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Packed {
    /// 8-bit voxels.
    Pairs8(Vec<u16>),
    /// 16-bit voxels.
    Pairs16(Vec<u32>),
}

impl Packed {
    /// Packs 8- and 16-bit voxels on a grid of `dims`; `None` for other types, for rows of one voxel, and past [`PACKED_LIMIT`].
    pub(crate) fn new(voxels: &Voxels, dims: [usize; 3]) -> Option<Self> {
        if dims[0] < 2 || 2 * voxels.bytes() > PACKED_LIMIT {
            return None;
        }
        let bytes = |voxels: &[u8]| Self::Pairs8(paired(voxels, dims, |here, below| u16::from(here) | u16::from(below) << 8));
        let words = |voxels: &[u16]| Self::Pairs16(paired(voxels, dims, |here, below| u32::from(here) | u32::from(below) << 16));
        Some(match voxels {
            Voxels::U8(v) => bytes(v),
            Voxels::I8(v) => bytes(bytemuck::cast_slice(v)),
            Voxels::U16(v) => words(v),
            Voxels::I16(v) => words(bytemuck::cast_slice(v)),
            _ => return None,
        })
    }
}

/// `pair` of each voxel and its neighbour along y.
fn paired<T: Copy + Sync, P: Copy + Default + Send>(voxels: &[T], [nx, ny, _]: [usize; 3], pair: impl Fn(T, T) -> P + Sync) -> Vec<P> {
    let layer = nx * ny;
    let mut pairs = vec![P::default(); voxels.len()];
    pairs.par_chunks_mut(layer).zip(voxels.par_chunks(layer)).for_each(|(pairs, voxels)| {
        let next = voxels[nx.min(layer)..].iter().chain(&voxels[layer - nx..]);
        for ((to, &here), &below) in pairs.iter_mut().zip(voxels).zip(next) {
            *to = pair(here, below);
        }
    });
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_voxel_is_paired_with_its_neighbour_along_y() {
        for dims in [[3, 4, 2], [2, 1, 3], [5, 2, 1]] {
            let [nx, ny, nz] = dims;
            let below = |i: usize| if i / nx % ny + 1 < ny { i + nx } else { i };
            let bytes: Vec<u8> = (0..nx * ny * nz).map(|i| (i * 37) as u8).collect();
            let want = (0..bytes.len()).map(|i| u16::from_le_bytes([bytes[i], bytes[below(i)]])).collect();
            assert_eq!(Packed::new(&Voxels::U8(bytes.clone().into()), dims), Some(Packed::Pairs8(want)), "{dims:?}");
            let words: Vec<i16> = (0..nx * ny * nz).map(|i| (i * 3700) as i16).collect();
            let bits = |i: usize| u32::from(words[i] as u16);
            let want = (0..words.len()).map(|i| bits(below(i)) << 16 | bits(i)).collect();
            assert_eq!(Packed::new(&Voxels::I16(words.clone().into()), dims), Some(Packed::Pairs16(want)), "{dims:?}");
        }
    }

    #[test]
    fn other_types_and_single_columns_are_left_alone() {
        assert_eq!(Packed::new(&Voxels::F32(vec![0.0; 8].into()), [2, 2, 2]), None);
        assert_eq!(Packed::new(&Voxels::U8(vec![0; 4].into()), [1, 2, 2]), None);
    }
}
