//! 8- and 16-bit voxels side by side with their neighbours along y, so that one load brings four corners of a cell.

use super::voxels::Voxels;
use rayon::prelude::*;

/// Most bytes a packed copy may take. It comes on top of the voxels, so a small volume may need three times its size, a large one
/// is looked up as it is.
pub(crate) const PACKED_LIMIT: usize = 128 << 20;

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// For each voxel, itself in the lower half and its neighbour along y in the upper one; signs are kept as bits.
///
/// They stand in the order of the voxels, with gaps after rows and layers (see [`strides`]). The last row along y is paired with itself,
/// because no cell starts there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Packed {
    pub(crate) pairs: PackedPairs,
    /// Distance in pairs to the next voxel along y and along z.
    pub(crate) strides: [usize; 2],
}

/// What is packed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PackedPairs {
    /// 8-bit voxels.
    Of8(Vec<u16>),
    /// 16-bit voxels.
    Of16(Vec<u32>),
}

impl Packed {
    /// Packs 8- and 16-bit voxels on a grid of `dims`; `None` for other types, for rows of one voxel, and past [`PACKED_LIMIT`].
    pub(crate) fn new(voxels: &Voxels, dims: [usize; 3]) -> Option<Self> {
        if dims[0] < 2 || 2 * voxels.bytes() > PACKED_LIMIT {
            return None;
        }
        let bytes = |voxels: &[u8]| {
            let strides = strides(dims, size_of::<u16>());
            let pair = |here, below| u16::from(here) | u16::from(below) << 8;
            Self { pairs: PackedPairs::Of8(paired(voxels, dims, strides, pair)), strides }
        };
        let words = |voxels: &[u16]| {
            let strides = strides(dims, size_of::<u32>());
            let pair = |here, below| u32::from(here) | u32::from(below) << 16;
            Self { pairs: PackedPairs::Of16(paired(voxels, dims, strides, pair)), strides }
        };
        Some(match voxels {
            Voxels::U8(v) => bytes(v),
            Voxels::I8(v) => bytes(bytemuck::cast_slice(v)),
            Voxels::U16(v) => words(v),
            Voxels::I16(v) => words(bytemuck::cast_slice(v)),
            _ => return None,
        })
    }
}

/// Distances from row to row and from layer to layer, in elements of so many `bytes`.
///
/// The sides of most volumes are powers of two. A cache keeps lines whose addresses are a power of two apart in the same few places, so the
/// lookups of a block, which are spread over rows and layers, would drive each other out of it. Gaps prevent that.
pub(super) fn strides([nx, ny, _]: [usize; 3], bytes: usize) -> [usize; 2] {
    let line = LINE / bytes;
    let row = if nx * bytes % (32 * LINE) == 0 { nx + line } else { nx };
    let layer = row * ny;
    let lines = layer.div_ceil(line);
    // An odd number of lines that is not close to a power of two, at most a thirty-second more than the layer needs.
    let odd = lines + (9 + 16 - lines % 16) % 16;
    [row, if 32 * (odd - lines) <= lines { odd * line } else { layer }]
}

/// `pair` of each voxel and its neighbour along y.
fn paired<T: Copy + Sync, P: Copy + Default + Send>(
    voxels: &[T],
    [nx, ny, nz]: [usize; 3],
    [row, layer]: [usize; 2],
    pair: impl Fn(T, T) -> P + Sync,
) -> Vec<P> {
    let mut pairs = vec![P::default(); layer * (nz - 1) + row * (ny - 1) + nx];
    pairs.par_chunks_mut(layer).zip(voxels.par_chunks(nx * ny)).for_each(|(pairs, voxels)| {
        for (y, (to, here)) in pairs.chunks_mut(row).zip(voxels.chunks_exact(nx)).enumerate() {
            let below = &voxels[(y + 1).min(ny - 1) * nx..][..nx];
            for ((to, &here), &below) in to.iter_mut().zip(here).zip(below) {
                *to = pair(here, below);
            }
        }
    });
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_voxel_is_paired_with_its_neighbour_along_y() {
        for dims in [[3, 4, 2], [2, 1, 3], [5, 2, 1], [64, 64, 3], [1024, 33, 2], [512, 20, 2]] {
            let [nx, ny, nz] = dims;
            let below = |i: usize| if i / nx % ny + 1 < ny { i + nx } else { i };
            let bytes: Vec<u8> = (0..nx * ny * nz).map(|i| (i * 37) as u8).collect();
            let packed = Packed::new(&Voxels::U8(bytes.clone().into()), dims).unwrap();
            let PackedPairs::Of8(pairs) = packed.pairs else { panic!("{dims:?}") };
            let at = |i: usize, [row, layer]: [usize; 2]| i % nx + i / nx % ny * row + i / (nx * ny) * layer;
            for i in 0..bytes.len() {
                assert_eq!(pairs[at(i, packed.strides)].to_le_bytes(), [bytes[i], bytes[below(i)]], "{dims:?} {i}");
            }
            assert_eq!(pairs.len(), at(bytes.len() - 1, packed.strides) + 1);
            let words: Vec<i16> = (0..nx * ny * nz).map(|i| (i * 3700) as i16).collect();
            let bits = |i: usize| u32::from(words[i] as u16);
            let packed = Packed::new(&Voxels::I16(words.clone().into()), dims).unwrap();
            let PackedPairs::Of16(pairs) = packed.pairs else { panic!("{dims:?}") };
            for i in 0..words.len() {
                assert_eq!(pairs[at(i, packed.strides)], bits(below(i)) << 16 | bits(i), "{dims:?} {i}");
            }
        }
    }

    #[test]
    fn lines_of_neighbours_do_not_share_a_place_and_gaps_are_small() {
        for dims in [[256, 256, 256], [512, 512, 100], [1024, 1024, 30], [64, 64, 64], [256, 256, 113], [128, 100, 50], [100, 90, 80]] {
            for bytes in [2, 4] {
                let [row, layer] = strides(dims, bytes);
                let [nx, ny, _] = dims;
                assert!(row >= nx && layer >= row * ny, "{dims:?}");
                assert!(16 * (layer - nx * ny) <= nx * ny, "{dims:?}: {row} {layer}");
                let layers = layer * bytes / LINE;
                assert!(nx * ny * bytes < 32 * 1024 || layers % 2 == 1, "{dims:?}: {layers} lines");
                assert!((row * bytes) % (32 * LINE) != 0);
            }
        }
    }

    #[test]
    fn other_types_and_single_columns_are_left_alone() {
        assert_eq!(Packed::new(&Voxels::F32(vec![0.0; 8].into()), [2, 2, 2]), None);
        assert_eq!(Packed::new(&Voxels::U8(vec![0; 4].into()), [1, 2, 2]), None);
    }
}
