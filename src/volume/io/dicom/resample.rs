//! Slices where none are: linear interpolation along the stack.

use super::geometry::Plan;
use crate::volume::{Voxel, Voxels, with_voxels};
use rayon::prelude::*;

/// `out` = `a` + t (`b` - `a`), rounded where voxels are integers.
fn between<T: Voxel>(out: &mut [T], a: &[T], b: &[T], t: f64) {
    out.par_chunks_mut(1 << 14).zip(a.par_chunks(1 << 14)).zip(b.par_chunks(1 << 14)).for_each(|((out, a), b)| {
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            let (a, b) = (a.to_f64(), b.to_f64());
            *out = T::from_f64(a + t * (b - a));
        }
    });
}

/// Fills the slices of `each` numbers that lie between those at `places`.
fn fill<T: Voxel>(all: &mut [T], each: usize, places: &[usize]) {
    for pair in places.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        let (before, rest) = all[low * each..(high + 1) * each].split_at_mut(each);
        let (middle, after) = rest.split_at_mut((high - low - 1) * each);
        for (i, out) in middle.chunks_mut(each).enumerate() {
            between(out, before, after, (i + 1) as f64 / (high - low) as f64);
        }
    }
}

/// Makes the slices that `plan` asks for; `voxels` has those that are there, `out` has room for all.
pub(super) fn apply(plan: &Plan, each: usize, voxels: Voxels, room: impl FnOnce() -> crate::Result<Voxels>) -> crate::Result<Voxels> {
    match plan {
        Plan::Direct => Ok(voxels),
        Plan::Fill { places, .. } => {
            let mut voxels = voxels;
            with_voxels!(&mut voxels, v => fill(v, each, places));
            Ok(voxels)
        }
        Plan::Resample { places } => {
            let mut out = room()?;
            with_voxels!(&mut out, to => resampled(to, &voxels, each, places));
            Ok(out)
        }
    }
}

fn resampled<T: Voxel>(out: &mut [T], from: &Voxels, each: usize, places: &[f64]) {
    let Some(from) = T::slice(from) else { return };
    let last = from.len() / each - 1;
    for (out, &place) in out.chunks_mut(each).zip(places) {
        let low = (place as usize).min(last.saturating_sub(1));
        let high = (low + 1).min(last);
        between(out, &from[low * each..][..each], &from[high * each..][..each], place - low as f64);
    }
}
