//! Opaque planes inside the picture: the nearest that a ray meets in what there is of the box ends it, and shows its colour there.

use super::field::{corners, cubic};
use super::spline::Spline;
use crate::scene::{Scene, TransferFunction};
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;

/// The planes of a scene.
#[derive(Debug, Clone)]
pub(super) struct Cuts(Vec<Cut>);

#[derive(Debug, Clone)]
struct Cut {
    normal: DVec3,
    offset: f64,
    /// Colours of values, straight lines between points.
    map: TransferFunction,
}

impl Cuts {
    /// Those of `scene`, over the data of `volume`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a colour map that cannot be laid over the values.
    pub(super) fn new(scene: &Scene, volume: &Volume) -> Result<Self> {
        let cut = |plane: &crate::scene::CutPlane| {
            let (low, high) = plane.values(volume.range());
            let map = TransferFunction::new(plane.colors().spread(low, high), vec![(low, 1.0)])
                .map_err(|e| Error::invalid(format!("cut window from {low} to {high}: {e}")))?;
            Ok(Cut { normal: plane.normal(), offset: plane.offset(), map })
        };
        Ok(Self(scene.cuts().iter().map(cut).collect::<Result<_>>()?))
    }

    /// The depth and the straight colour where the ray from `origin` along `direction` meets the nearest plane between depths `entry` and `exit`.
    pub(super) fn nearest(
        &self,
        (volume, spline): (&Volume, Option<&Spline>),
        (origin, direction): (DVec3, DVec3),
        (entry, exit): (f64, f64),
    ) -> Option<(f64, [f64; 3])> {
        // A plane on a face of the box counts as inside, whatever rounding makes of it.
        let margin = 1e-12 * (exit.abs() + (exit - entry));
        let met = |cut: &Cut| {
            let depth = (cut.offset - cut.normal.dot(origin)) / cut.normal.dot(direction);
            let inside = depth >= entry - margin && depth <= exit + margin;
            let value = value(volume, spline, origin + direction * depth);
            // No plane where there is no data.
            (inside && value.is_finite()).then(|| (depth, cut.map.eval(value).rgb))
        };
        self.0.iter().filter_map(met).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The field at a place of the world; NaN where a voxel that it needs is not finite.
fn value(volume: &Volume, spline: Option<&Spline>, place: DVec3) -> f64 {
    let (grid, at) = (volume.grid(), volume.grid().world_to_index().transform_point3(place));
    if !at.is_finite() {
        return f64::NAN;
    }
    let low: [i64; 3] = std::array::from_fn(|axis| (at[axis].floor() as i64).clamp(-1, grid.dims()[axis] as i64 - 1));
    let place: [f64; 3] = std::array::from_fn(|axis| at[axis] - low[axis] as f64);
    match spline {
        Some(spline) => spline.along(low, place, [0.0; 3], None).map_or(f64::NAN, |(field, ..)| super::field::Along::at(&field, 0.0)),
        None => cubic(&corners(volume, low), place, [0.0; 3]).at(0.0),
    }
}
