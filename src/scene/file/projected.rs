//! What projections and surfaces look like where a scene says nothing about it.

use crate::scene::preset::Landmarks;
use crate::scene::{Blend, ColorMap, Lighting, TransferFunction, View};
use crate::{Result, Volume};

/// Colour of a surface, as of bone in warm light.
const SURFACE: [f64; 3] = [0.93, 0.87, 0.77];

/// Shares of what is seen of an object that a window leaves black and white.
const DARK: f64 = 0.1;
const WHITE: f64 = 0.98;

/// One colour for surfaces, and their light.
pub(super) fn surface() -> Result<(TransferFunction, Lighting)> {
    let mut lighting = Lighting::default();
    (lighting.ambient, lighting.diffuse, lighting.specular, lighting.shininess) = (0.25, 0.75, 0.2, 20.0);
    Ok((TransferFunction::new(vec![(0.0, SURFACE)], vec![(0.0, 1.0)])?, lighting))
}

/// A grey map over values from `low` to `high`: what is darker is black, and there.
pub(super) fn grey([low, high]: [f64; 2]) -> Result<TransferFunction> {
    TransferFunction::new(ColorMap::Gray.spread(low, high), vec![(low, 1.0)])
}

/// A grey map from the darkest to the brightest of what a projection by `blend` shows of `volume` in `view`; and where it begins and ends. `None`
/// where all of it is the same.
pub(super) fn window(volume: &Volume, view: &View, blend: Blend) -> Result<Option<(TransferFunction, [f64; 2])>> {
    // The first maxima of a ray lie anywhere among the object's values.
    if let Blend::Lmip { .. } = blend {
        let marks = Landmarks::of(volume.statistics());
        let (low, high) = (marks.split, marks.high);
        let opacity = vec![(low - 0.05 * (high - low), 0.0), (low, 1.0)];
        return Ok(Some((TransferFunction::new(ColorMap::Gray.spread(low, high), opacity)?, [low, high])));
    }
    let seen = seen(volume, view, blend);
    // The object alone: what is around it would fill the window's darker part with nothing.
    let split = Landmarks::of(volume.statistics()).split;
    let object: Vec<f64> = seen.iter().copied().filter(|&v| v >= split).collect();
    let greatest = matches!(blend, Blend::Mip | Blend::AttenuatedMip { .. }) && !object.is_empty();
    let of = if greatest { &object } else { &seen };
    let at = |share: f64| of.get(((of.len().max(1) - 1) as f64 * share) as usize).copied();
    let (Some(low), Some(high)) = (at(DARK), at(WHITE)) else { return Ok(None) };
    let width = high - low;
    if !(width > 0.0 && width.is_finite()) {
        return Ok(None);
    }
    // What is darker than the window is black, but there; what is no object is not.
    let edge = if greatest { split.min(low) } else { low };
    let opacity = vec![(edge - 0.05 * width, 0.0), (edge, 1.0)];
    Ok(Some((TransferFunction::new(ColorMap::Gray.spread(low, high), opacity)?, [low, high])))
}

/// Values that a projection along the voxel axis nearest to the view direction shows, about one for each column of bricks, in order.
fn seen(volume: &Volume, view: &View, blend: Blend) -> Vec<f64> {
    let bricks = volume.bricks();
    let along = volume.grid().world_to_index().matrix3 * view.forward;
    let axis = if along.x.abs() >= along.y.abs().max(along.z.abs()) {
        0
    } else if along.y.abs() >= along.z.abs() {
        1
    } else {
        2
    };
    let (slope, intercept) = volume.rescale();
    let [nx, ny, _] = bricks.dims;
    let stride = [1, nx, nx * ny];
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut values = Vec::with_capacity(bricks.dims[a] * bricks.dims[b]);
    for i in 0..bricks.dims[a] {
        for j in 0..bricks.dims[b] {
            let column = (0..bricks.dims[axis]).map(|k| bricks.ranges[i * stride[a] + j * stride[b] + k * stride[axis]]);
            let ends = column.filter(|(low, high)| low <= high).map(|(low, high)| {
                let (p, q) = (slope * f64::from(low) + intercept, slope * f64::from(high) + intercept);
                (p.min(q), p.max(q))
            });
            let (mut least, mut most, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
            for (low, high) in ends {
                (least, most, sum, count) = (low.min(least), high.max(most), sum + 0.5 * (low + high), count + 1.0);
            }
            if count > 0.0 {
                values.push(match blend {
                    Blend::Min => least,
                    Blend::Average => sum / count,
                    _ => most,
                });
            }
        }
    }
    values.sort_by(f64::total_cmp);
    values
}

/// As many decimals as a window of such a `width` needs.
pub(super) fn short(x: f64, width: f64) -> String {
    let digits = (2.0 - libm::floor(libm::log10(width))).clamp(0.0, 12.0) as usize;
    format!("{x:.digits$}")
}
