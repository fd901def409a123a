//! Vectors as their magnitude: the numbers of a voxel read one channel after the other, and the square root of the sum of their squares.

use super::reading::{Part, Reading};
use super::store::Store;
use super::{list, read_as};
use crate::volume::{Number, Volume, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// The magnitudes of the vectors in the file or folder `path`: in f64 where the file's numbers are f64, else in f32. Slope and intercept of each number
/// are applied first.
///
/// # Errors
/// As [`read_as`]; where voxels have one number only, and where the file cannot be read once for each of them.
pub(super) fn read(path: &Path, reading: &Reading) -> Result<Volume> {
    if Store::comes_once(path) {
        return Err(Error::format(
            path,
            "volume.channel is magnitude: reads a file once for each number of a voxel, and this one comes once",
        ));
    }
    let mut plain = reading.clone();
    plain.choice.magnitude = false;
    // Where several numbers may be several frames, asking for one tells.
    plain.choice.channel = Some(0);
    let items = list(path, &plain)?;
    let count: usize = items.iter().filter(|item| item.part == Part::Channel).map(|item| item.count).sum();
    if count < 2 {
        return Err(Error::format(path, "volume.channel is magnitude: its voxels have one number each, which is no vector"));
    }
    let mut one = |n: usize| {
        plain.choice.channel = Some(n);
        read_as(path, &plain)
    };
    let first = one(0)?;
    let voxels = first.grid().voxel_count();
    let (needed, limit) = (voxels as u128 * size_of::<f64>() as u128, u128::from(reading.limits.voxel_bytes));
    if needed > limit {
        return Err(Error::Limit { what: format!("{}: bytes of sums of squares", path.display()), needed, limit });
    }
    let mut sums = vec![0.0; voxels];
    add(&mut sums, &first);
    for n in 1..count {
        add(&mut sums, &one(n)?);
    }
    let magnitudes = match first.voxels().voxel_type() {
        VoxelType::F64 => {
            sums.par_iter_mut().for_each(|sum| *sum = sum.sqrt());
            Voxels::from(sums)
        }
        _ => Voxels::from(sums.par_iter().map(|sum| sum.sqrt() as f32).collect::<Vec<f32>>()),
    };
    let volume =
        Volume::new(first.grid().clone(), magnitudes)?.with_name(first.name()).with_unit(first.unit()).with_modality(first.modality());
    let volume = first.notes().iter().fold(volume, |volume, note| volume.with_note(note));
    let volume = first.details().iter().fold(volume, |volume, detail| volume.with_detail(detail));
    Ok(volume.with_note(format!("the magnitude of {count} numbers a voxel is read: the square root of the sum of their squares")))
}

/// Adds the squares of the values of `volume`.
fn add(sums: &mut [f64], volume: &Volume) {
    let (slope, intercept) = volume.rescale();
    with_voxels!(volume.voxels(), v => sums.par_iter_mut().zip(v.par_iter()).for_each(|(sum, &stored)| {
        let value = slope * stored.to_f64() + intercept;
        *sum += value * value;
    }));
}
