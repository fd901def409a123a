//! A label map beside a volume: the label of the segment that each voxel belongs to.
//!
//! ```text
//!  another volume of integers in the same box --nearest voxel--> a label for each voxel of this one
//! ```
//! Labels are kept as places in the list of labels that occur, so that lookups read one or two bytes whatever the labels are.

use super::bricks::{BRICK, count};
use super::voxels::{VoxelSlices, Voxels, with_slices, with_voxels};
use super::{Grid, Number, Segment, Volume};
use crate::{Error, Result};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Most different labels of one map.
pub const MAX_LABELS: usize = 1 << 16;

/// How far the corners of a label map's box may be from those of its volume's box, in voxels of the volume.
const APART: f64 = 0.01;

/// Integers up to here are told apart in f64.
const LARGEST: f64 = 9_007_199_254_740_992.0;

/// Voxels that are looked at together.
const PIECE: usize = 1 << 16;

/// The label of each voxel of a volume: see [`Volume::with_labels`].
///
/// # Guarantees
/// There are as many labels as the volume has voxels, and no more than [`MAX_LABELS`] different ones.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelMap {
    /// Labels that occur, rising.
    values: Vec<i64>,
    /// Place of each voxel's label among them, as u8 or u16.
    places: Voxels,
    segments: Vec<Segment>,
}

impl LabelMap {
    /// The labels that `labels` holds, on `grid`.
    fn new(labels: &Volume, grid: &Grid) -> Result<Self> {
        let Some(voxels) = labels.scalars() else {
            return Err(Error::invalid("labels of RGBA voxels: a label is one integer"));
        };
        let values = values(voxels, labels.rescale())?;
        let found = |to: &mut [u16], from: usize| {
            let mut last: Option<(f64, u16)> = None;
            let (slope, intercept) = labels.rescale();
            with_voxels!(voxels, v => for (to, from) in to.iter_mut().zip(&v[from..]) {
                let stored = Number::to_f64(*from);
                *to = match last {
                    Some((same, place)) if same == stored => place,
                    _ => values.binary_search(&((slope * stored + intercept) as i64)).map_or(0, |place| place as u16),
                };
                last = Some((stored, *to));
            });
        };
        let mut places = vec![0u16; voxels.len()];
        places.par_chunks_mut(PIECE).enumerate().for_each(|(n, to)| found(to, n * PIECE));
        if let Some(map) = map_between(labels.grid(), grid)? {
            places = nearest(&places, labels.grid().dims(), grid.dims(), map);
        }
        let places: Voxels = match u8::try_from(values.len() - 1) {
            Ok(_) => places.par_iter().map(|&place| place as u8).collect::<Vec<u8>>().into(),
            Err(_) => places.into(),
        };
        let segments = if let super::Channels::Label(segments) = labels.channels() { segments.clone() } else { Vec::new() };
        Ok(Self { values, places, segments })
    }

    /// The map of a part of its voxels, whose `places` in the list of labels are taken out of this one's.
    fn part(&self, places: impl FnOnce(&Voxels) -> Result<Voxels>) -> Result<Self> {
        Ok(Self { values: self.values.clone(), places: places(&self.places)?, segments: self.segments.clone() })
    }

    /// The labels that occur in the map as it was given, rising.
    pub fn values(&self) -> &[i64] {
        &self.values
    }

    /// Names and colours of segments, as far as the map has any. Not every label needs one, nor every one of these a voxel.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The label of the voxel at position `index`, x fastest.
    ///
    /// # Panics
    /// When there is no such voxel.
    pub fn label(&self, index: usize) -> i64 {
        self.values[self.places.get(index) as usize]
    }

    /// A fingerprint that changes with any voxel's label: SHA-256 in hexadecimal. Names and colours of segments are not part of it.
    pub fn sha256(&self) -> String {
        super::digest::of_labels(&self.values, &self.places)
    }

    /// Place in [`LabelMap::values`] of each voxel's label.
    pub(crate) fn places(&self) -> VoxelSlices<'_> {
        self.places.slices()
    }

    /// For each brick of a volume of `dims` voxels the kinds of labels that lookups of the nearest voxel find in it, joined bit by bit: `kinds`
    /// tells that of each label, in the order of [`LabelMap::values`].
    pub(crate) fn bricks(&self, [nx, ny, nz]: [usize; 3], kinds: &[u8]) -> Vec<u8> {
        let [bx, by, bz] = [nx, ny, nz].map(count);
        let mut found = vec![0u8; bx * by * bz];
        let reach = |b: usize, n: usize| b * BRICK..(b * BRICK + BRICK + 1).min(n);
        with_slices!(self.places(), places => found.par_chunks_mut(bx).enumerate().for_each(|(row, found)| {
            for z in reach(row / by, nz) {
                for y in reach(row % by, ny) {
                    let line = &places[(z * ny + y) * nx..][..nx];
                    for (b, found) in found.iter_mut().enumerate() {
                        *found = line[reach(b, nx)].iter().fold(*found, |all, &place| all | kinds[Number::to_f64(place) as usize]);
                    }
                }
            }
        }));
        found
    }
}

/// The different labels among `voxels`, rising.
fn values(voxels: &Voxels, (slope, intercept): (f64, f64)) -> Result<Vec<i64>> {
    let whole = |stored: f64| {
        let value = slope * stored + intercept;
        let fits = value.abs() <= LARGEST && libm::floor(value) == value;
        if fits { Ok(value as i64) } else { Err(Error::invalid(format!("labels: a voxel is {value}, and labels are whole numbers"))) }
    };
    let sets: Vec<Result<BTreeSet<i64>>> = with_voxels!(voxels, v => v.par_chunks(PIECE).map(|piece| {
        let (mut set, mut last) = (BTreeSet::new(), f64::NAN);
        for &voxel in piece {
            let stored = Number::to_f64(voxel);
            if stored != last {
                set.insert(whole(stored)?);
                last = stored;
            }
        }
        Ok(set)
    }).collect());
    let mut all = BTreeSet::new();
    for set in sets {
        all.extend(set?);
        if all.len() > MAX_LABELS {
            return Err(Error::invalid(format!("labels: more than {MAX_LABELS} different ones; these voxels are values")));
        }
    }
    Ok(all.into_iter().collect())
}

/// The way from a voxel of `grid` to index coordinates in the label map on `labels`; nothing where both have the same voxels.
///
/// # Errors
/// [`Error::Invalid`] that says how far apart the two boxes are.
fn map_between(labels: &Grid, grid: &Grid) -> Result<Option<DAffine3>> {
    let same = labels.dims() == grid.dims();
    // Files of bare numbers say no place.
    if same && labels.index_to_world() == DAffine3::IDENTITY {
        return Ok(None);
    }
    let (low, high) = grid.index_bounds();
    let here = labels.clone().with_convention(grid.convention());
    let corners = here.corners().map(|c| grid.world_to_index().transform_point3(c));
    // Each corner of a box that is the same stands on one of the other's, perhaps in another order of the axes.
    let off = |c: &DVec3| (*c - low).abs().min((*c - high).abs()).max_element();
    let most = corners.iter().map(off).fold(0.0, f64::max);
    if most > APART || most.is_nan() {
        return Err(Error::invalid(format!(
            "labels: their box is not the volume's: a corner of it is {most:.2} voxels from the nearest, and {APART} are allowed"
        )));
    }
    let map = labels.world_to_index() * grid.index_to_world();
    let last = DVec3::from_array(grid.dims().map(|n| (n - 1) as f64));
    let stays = |p: DVec3| (map.transform_point3(p) - p).abs().max_element() <= APART;
    if same && (0..8).all(|c| stays(DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)) * last)) {
        return Ok(None);
    }
    Ok(Some(map))
}

/// The place of the label nearest to each of `to` voxels, of which `map` leads into the grid of `from` voxels. Halfway the upper one is taken.
fn nearest(places: &[u16], from: [usize; 3], to: [usize; 3], map: DAffine3) -> Vec<u16> {
    let [nx, ny, _] = to;
    let mut found = vec![0; to.iter().product()];
    found.par_chunks_mut(nx).enumerate().for_each(|(row, found)| {
        for (x, found) in found.iter_mut().enumerate() {
            let at = map.transform_point3(DVec3::new(x as f64, (row % ny) as f64, (row / ny) as f64));
            let [i, j, k] = [0, 1, 2].map(|axis: usize| (libm::floor(at[axis] + 0.5).max(0.0) as usize).min(from[axis] - 1));
            *found = places[(k * from[1] + j) * from[0] + i];
        }
    });
    found
}

impl Volume {
    /// The same volume with a label map beside it: a volume of whole numbers that fills the same box, with its segments' names and colours
    /// where it has any.
    ///
    /// Its grid may be another one. Then each voxel here takes the label of the voxel of `labels` that is nearest to its centre; halfway between
    /// two, that of the upper one. A map of as many voxels whose grid says no place (spacing 1, origin 0) lies on this volume's grid. What is
    /// made of the volume later, a part of it or one of other voxels, has no label map.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the voxels are colours or no whole numbers, when more than [`MAX_LABELS`] different ones occur, or when the boxes
    /// are farther apart than a hundredth of a voxel.
    pub fn with_labels(mut self, labels: &Self) -> Result<Self> {
        self.labels = Some(std::sync::Arc::new(LabelMap::new(labels, &self.grid)?));
        Ok(self)
    }

    /// The label map beside it, if there is one.
    pub fn labels(&self) -> Option<&LabelMap> {
        self.labels.as_deref()
    }

    /// The same volume with voxels of the label map beside `other`, where there is one: those whose `places` in its list of labels are taken out.
    pub(crate) fn with_labels_of(mut self, other: &Self, places: impl FnOnce(&Voxels) -> Result<Voxels>) -> Result<Self> {
        self.labels = other.labels.as_ref().map(|map| map.part(places)).transpose()?.map(std::sync::Arc::new);
        Ok(self)
    }

    /// The labels that its own voxels are, where they are such.
    ///
    /// # Errors
    /// As [`Volume::with_labels`].
    pub fn own_labels(&self) -> Result<Option<LabelMap>> {
        if matches!(self.channels, super::Channels::Label(_)) { LabelMap::new(self, &self.grid).map(Some) } else { Ok(None) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn volume(dims: [usize; 3], spacing: [f64; 3]) -> Volume {
        // Boxes whose lower corner is the world's origin.
        let origin = DVec3::from_array(spacing) * 0.5;
        let grid = Grid::new(dims, origin, glam::DMat3::from_diagonal(DVec3::from_array(spacing))).unwrap();
        Volume::new(grid, Voxels::U8(vec![0; dims.iter().product()].into())).unwrap()
    }

    fn labels(dims: [usize; 3], spacing: [f64; 3], of: impl Fn(usize) -> i32) -> Volume {
        let blank = volume(dims, spacing);
        Volume::new(blank.grid().clone(), (0..blank.voxels().len()).map(of).collect::<Vec<i32>>().into()).unwrap()
    }

    #[test]
    fn labels_of_the_same_grid_are_each_voxels_own() {
        let of = |i: usize| (i as i32 * 37 % 11 - 3) * 1_000_000;
        let map = labels([5, 4, 3], [1.0, 2.0, 0.5], of);
        let both = volume([5, 4, 3], [1.0, 2.0, 0.5]).with_labels(&map).unwrap();
        let found = both.labels().unwrap();
        assert!((0..60).all(|i| found.label(i) == i64::from(of(i))));
        assert!(found.values().windows(2).all(|w| w[0] < w[1]) && found.values().len() == 11);
        // Bare numbers say no place, and are taken for those of the volume's grid.
        let bare = Volume::new(Grid::with_spacing([5, 4, 3], [1.0; 3]).unwrap(), map.voxels().clone()).unwrap();
        assert_eq!(volume([5, 4, 3], [1.0, 2.0, 0.5]).with_labels(&bare).unwrap().labels(), Some(found));
        assert!(both.with_grid(bare.grid().clone()).unwrap().labels().is_some());
    }

    #[test]
    fn labels_of_other_grids_are_those_of_the_nearest_voxels() {
        // Twice as fine along y, three times as coarse along x, the same along z.
        let of = |i: usize| i as i32;
        let map = labels([3, 8, 2], [3.0, 0.5, 1.0], of);
        let both = volume([9, 4, 2], [1.0; 3]).with_labels(&map).unwrap();
        for (z, y, x) in (0..2).flat_map(|z| (0..4).flat_map(move |y| (0..9).map(move |x| (z, y, x)))) {
            // Centres along y lie halfway between two voxels: the upper one.
            assert_eq!(both.labels().unwrap().label((z * 4 + y) * 9 + x), (z * 24 + (2 * y + 1) * 3 + x / 3) as i64, "{x} {y} {z}");
        }
        // An axis that runs the other way.
        let turned = Grid::new([9, 4, 2], DVec3::new(8.5, 0.5, 0.5), glam::DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))).unwrap();
        let turned = Volume::new(turned, (0..72).collect::<Vec<i32>>().into()).unwrap();
        let both = volume([9, 4, 2], [1.0; 3]).with_labels(&turned).unwrap();
        assert!((0..72).all(|i| both.labels().unwrap().label(i) == (i / 9 * 9 + 8 - i % 9) as i64));
    }

    #[test]
    fn boxes_that_differ_and_numbers_that_are_no_labels_are_refused() {
        let line = |map: &Volume| volume([4, 4, 4], [1.0; 3]).with_labels(map).unwrap_err().to_string();
        assert!(line(&labels([4, 4, 4], [1.5, 1.0, 1.0], |_| 0)).contains("is 2.00 voxels from the nearest"));
        assert!(line(&labels([8, 8, 8], [0.5, 0.5, 0.505], |_| 0)).contains("is 0.04 voxels"));
        assert!(volume([4, 4, 4], [1.0; 3]).with_labels(&labels([8, 8, 8], [0.5, 0.5, 0.501], |_| 0)).is_ok());
        let floats = |x: f32| Volume::new(volume([4, 4, 4], [1.0; 3]).grid().clone(), Voxels::F32(vec![x; 64].into())).unwrap();
        assert!(line(&floats(1.5)).contains("a voxel is 1.5") && line(&floats(f32::NAN)).contains("NaN"));
        assert!(volume([4, 4, 4], [1.0; 3]).with_labels(&floats(7.0)).is_ok());
        let many = labels([64, 64, 32], [1.0; 3], |i| i as i32);
        assert!(many.clone().with_labels(&many).unwrap_err().to_string().contains("65536"));
    }

    #[test]
    fn bricks_know_the_labels_of_every_voxel_that_lookups_in_them_find() {
        let dims = [11, 6, 9];
        let map = labels(dims, [1.0; 3], |i| (i as i32).wrapping_mul(0x9E37) >> 9 & 7);
        let both = map.clone().with_labels(&map).unwrap();
        let found = both.labels().unwrap();
        let kinds: Vec<u8> = found.values().iter().map(|&v| if v < 3 { 1 << v } else { 0 }).collect();
        let bricks = found.bricks(dims, &kinds);
        let [bx, by, bz] = dims.map(count);
        assert_eq!(bricks.len(), bx * by * bz);
        for (b, &bits) in bricks.iter().enumerate() {
            let at = [b % bx, b / bx % by, b / (bx * by)];
            let within = |axis: usize, x: usize| (at[axis] * 4..=at[axis] * 4 + 4).contains(&x);
            let all = (0..map.voxels().len()).filter(|i| within(0, i % 11) && within(1, i / 11 % 6) && within(2, i / 66));
            let want = all.map(|i| map.voxels().get(i)).filter(|&v| v < 3.0).fold(0, |bits, v| bits | 1u8 << v as u32);
            assert_eq!(bits, want, "brick {at:?}");
        }
    }
}
