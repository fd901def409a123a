//! Which part of a volume holds something, so that cuts need not be spent on its empty ends.

use super::frame::Frame;
use crate::scene::preset::Landmarks;
use crate::volume::Volume;
use rayon::prelude::*;

/// Bins along the axis.
const BINS: usize = 512;

/// Share of the object that may lie beyond each end: noise and tables.
const BEYOND: f64 = 2e-3;

/// The offsets between which the object of `volume` lies along [`Frame::axis`]: its voxels above the value that best splits the histogram into
/// background and object, but for 0.2 % of them at each end. The whole box where there is no such voxel.
pub fn occupied(volume: &Volume, frame: &Frame) -> (f64, f64) {
    let grid = volume.grid();
    let (low, high) = frame.extent(grid);
    let split = Landmarks::of(volume.statistics()).split;
    let [nx, ny, nz] = grid.dims();
    let to_world = grid.index_to_world();
    let scale = BINS as f64 / (high - low);
    if volume.scalars().is_none() || !(scale > 0.0 && scale.is_finite()) {
        return (low, high);
    }
    // The offset is linear in the voxel's position.
    let step = (to_world.matrix3.transpose() * frame.axis).to_array();
    let start = to_world.translation.dot(frame.axis);
    let layer = |k: usize| {
        let mut bins = vec![0u64; BINS];
        for j in 0..ny {
            for i in 0..nx {
                if volume.value([i, j, k]) > split {
                    let offset = start + step[0] * i as f64 + step[1] * j as f64 + step[2] * k as f64;
                    bins[(((offset - low) * scale) as usize).min(BINS - 1)] += 1;
                }
            }
        }
        bins
    };
    let add = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let bins = (0..nz).into_par_iter().map(layer).reduce(|| vec![0; BINS], add);
    let total: u64 = bins.iter().sum();
    let most = BEYOND * total as f64;
    let beyond = |sum: &mut u64, count: u64| {
        *sum += count;
        Some(*sum as f64 > most)
    };
    let first = bins.iter().scan(0, |sum, &count| beyond(sum, count)).position(|inside| inside);
    let last = bins.iter().rev().scan(0, |sum, &count| beyond(sum, count)).position(|inside| inside).map(|n| BINS - 1 - n);
    match (first, last) {
        (Some(first), Some(last)) if first <= last => (low + first as f64 / scale, low + (last + 1) as f64 / scale),
        _ => (low, high),
    }
}
