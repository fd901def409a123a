//! A volume's fingerprint.

use super::{BoxConvention, Channels, Space, Volume, Voxels, with_voxels};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

/// Bytes of voxels that are hashed together: pieces are hashed at the same time.
const PIECE: usize = 1 << 20;

impl Volume {
    /// SHA-256 of all that a picture of the volume may depend on, in hex: the same on every machine. Name and modality do not count.
    ///
    /// It is taken of one line of text, `slicestack volume 1: ` and what follows separated by spaces: the dimensions along x, y and z; the type
    /// of the numbers; how many of them a voxel has, of colours without an alpha 3; slope and intercept; the map from index to world space, column by column, then its
    /// translation; `cells` or `nodes`; `ras`, `lps` or `unknown`. Floats are written as their 64 bits in hex. Behind the line's end the SHA-256
    /// of each MiB of the voxels as they are in memory (little-endian, x fastest; of every colour four numbers) follow one another, 32 bytes each.
    pub fn sha256(&self) -> String {
        let voxels = self.colors.as_ref().unwrap_or(&self.voxels);
        let grid = self.grid();
        let [x, y, z] = grid.dims();
        let hex = |number: &f64| format!(" {:016x}", number.to_bits());
        let numbers: String = [self.slope, self.intercept].iter().chain(&grid.index_to_world().to_cols_array()).map(hex).collect();
        let convention = match grid.convention() {
            BoxConvention::Cells => "cells",
            BoxConvention::Nodes => "nodes",
        };
        let space = match grid.space() {
            Space::Ras => "ras",
            Space::Lps => "lps",
            Space::Unknown => "unknown",
        };
        let channels = if self.channels == Channels::Rgb { 3 } else { self.channels.count() };
        let kind = voxels.voxel_type().name();
        let mut hash = Sha256::new();
        hash.update(format!("slicestack volume 1: {x} {y} {z} {kind} {channels}{numbers} {convention} {space}\n"));
        for piece in pieces(voxels) {
            hash.update(piece);
        }
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

/// SHA-256 of a line of text, `slicestack labels 1: ` and the labels that occur, rising, and behind its end of the place of each voxel's label among
/// them, as [`Volume::sha256`] takes voxels.
pub(super) fn of_labels(values: &[i64], places: &Voxels) -> String {
    let values: Vec<String> = values.iter().map(i64::to_string).collect();
    let mut hash = Sha256::new();
    hash.update(format!("slicestack labels 1: {}\n", values.join(" ")));
    pieces(places).iter().for_each(|piece| hash.update(piece));
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// The SHA-256 of each piece of the voxels.
fn pieces(voxels: &Voxels) -> Vec<[u8; 32]> {
    if cfg!(target_endian = "big") {
        let mut turned = voxels.clone();
        turned.swap_bytes();
        return of_bytes(turned.as_bytes_mut());
    }
    with_voxels!(voxels, v => of_bytes(bytemuck::cast_slice(v)))
}

fn of_bytes(bytes: &[u8]) -> Vec<[u8; 32]> {
    bytes.par_chunks(PIECE).map(|piece| Sha256::digest(piece).into()).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::volume::Grid;
    use crate::volume::phantom::Phantom;

    #[test]
    fn whatever_shows_counts() {
        let volume = |values: Vec<u16>| Volume::new(Grid::with_spacing([4, 3, 2], [1.0; 3]).unwrap(), values.into()).unwrap();
        let values: Vec<u16> = (0..24).collect();
        let plain = volume(values.clone());
        let mut changed = values.clone();
        changed[17] += 1;
        let moved = Grid::with_spacing([4, 3, 2], [1.0, 1.0, 1.0 + f64::EPSILON]).unwrap();
        let others = [
            volume(changed),
            volume(values.clone()).with_rescale(1.0, 0.5).unwrap(),
            volume(values.clone()).with_grid(moved).unwrap(),
            volume(values.clone()).with_grid(plain.grid().clone().with_space(Space::Ras)).unwrap(),
            volume(values.clone()).with_convention(BoxConvention::Nodes),
            Volume::new(plain.grid().clone(), values.iter().map(|&v| v as i16).collect::<Vec<_>>().into()).unwrap(),
            volume(values.clone()).with_segments(Vec::new()).unwrap(),
        ];
        for (n, other) in others.iter().enumerate().take(6) {
            assert_ne!(other.sha256(), plain.sha256(), "{n}");
        }
        // Labels without names are the same numbers; a name says where a file lies.
        assert_eq!(others[6].sha256(), plain.sha256());
        assert_eq!(plain.clone().with_name("/home/somebody/a.nrrd").sha256(), plain.sha256());
    }

    #[test]
    fn the_layout_is_the_one_described() {
        let volume = Phantom::Cloud.volume(72).unwrap();
        let bytes: Vec<u8> = match volume.voxels() {
            Voxels::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Voxels::U8(v) => v.to_vec(),
            Voxels::U16(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            other => unreachable!("{other:?}"),
        };
        let map = volume.grid().index_to_world();
        let (slope, intercept) = volume.rescale();
        let floats: Vec<f64> = [slope, intercept].into_iter().chain(map.to_cols_array()).collect();
        let floats: Vec<String> = floats.iter().map(|x| format!("{:016x}", x.to_bits())).collect();
        let kind = volume.voxels().voxel_type().name();
        let mut all = format!("slicestack volume 1: 72 72 72 {kind} 1 {} cells unknown\n", floats.join(" ")).into_bytes();
        bytes.chunks(1 << 20).for_each(|piece| all.extend(Sha256::digest(piece)));
        let want: String = Sha256::digest(&all).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(volume.sha256(), want);
    }
}
