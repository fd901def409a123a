//! The same curve in other points: opacities of another length, and colour and opacity at common values.

use super::{Points, VolumeProperty};

/// How far a straight line may lie from the curve that it stands for.
const CLOSE: f64 = 1.0 / 2000.0;

/// How often a piece and its halves are halved at most.
const DEPTH: u32 = 10;

/// Most points that halving may add to.
const MOST: usize = super::MAX_POINTS / 2;

/// `property` with opacities per one world unit; those without a length are taken to have that one.
pub(super) fn per_unit_length(property: &VolumeProperty) -> VolumeProperty {
    let length = property.opacity_unit.unwrap_or(1.0);
    let mut out = VolumeProperty { opacity_unit: Some(1.0), ..property.clone() };
    if length != 1.0 {
        out.opacity = bent(&property.opacity, |a| -libm::expm1(libm::log1p(-a) / length));
    }
    out
}

/// Points of the curve `turn` over the piecewise-linear one through `points`: each piece is halved, and its halves again, until the line between
/// the ends lies close to the curve at its middle and its quarters.
pub(super) fn bent(points: &[(f64, f64)], turn: impl Fn(f64) -> f64) -> Points {
    let mut out: Points = Vec::with_capacity(points.len());
    for (i, &(x, y)) in points.iter().enumerate() {
        if let Some(&(x0, y0)) = i.checked_sub(1).map(|i| &points[i]).filter(|b| b.0 < x && b.1 != y) {
            let curve = |t: f64| (x0 + (x - x0) * t, turn(y0 + (y - y0) * t));
            halve(&curve, [0.0, 1.0], DEPTH, &mut out);
        }
        out.push((x, turn(y)));
    }
    out
}

/// The points inside the piece from `t0` to `t1` that it takes.
fn halve(curve: &impl Fn(f64) -> (f64, f64), [t0, t1]: [f64; 2], depth: u32, out: &mut Points) {
    let (a, b) = (curve(t0).1, curve(t1).1);
    let off = |t: f64| (curve(t0 + (t1 - t0) * t).1 - (a + (b - a) * t)).abs();
    if depth == 0 || out.len() >= MOST || [0.25, 0.5, 0.75].into_iter().all(|t| off(t) <= CLOSE) {
        return;
    }
    let middle = 0.5 * (t0 + t1);
    halve(curve, [t0, middle], depth - 1, out);
    out.push(curve(middle));
    halve(curve, [middle, t1], depth - 1, out);
}

/// Rows [value, red, green, blue, opacity] at all values of both lists; two where one of them has a step.
pub(super) fn rows(property: &VolumeProperty) -> Vec<[f64; 5]> {
    let mut values: Vec<f64> = property.color.iter().map(|p| p.0).chain(property.opacity.iter().map(|p| p.0)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let mut rows = Vec::with_capacity(values.len());
    for x in values {
        let side = |above: bool| {
            let rgb: [f64; 3] = std::array::from_fn(|c| at(&property.color, x, above, |p| p[c]));
            [x, rgb[0], rgb[1], rgb[2], at(&property.opacity, x, above, |a| a)]
        };
        let (below, above) = (side(false), side(true));
        rows.push(below);
        if above != below {
            rows.push(above);
        }
    }
    rows
}

/// A component of the piecewise-linear curve at `x`, as seen from below or from above where it has a step.
fn at<T: Copy>(points: &[(f64, T)], x: f64, above: bool, of: impl Fn(T) -> f64) -> f64 {
    let after = points.partition_point(|p| if above { p.0 <= x } else { p.0 < x });
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some((x0, a)), Some(&(x1, b))) if x0 < x1 => {
            let (a, b, t) = (of(a), of(b), (x - x0) / (x1 - x0));
            // Exact at both ends.
            if t >= 1.0 { b } else { (a + (b - a) * t).clamp(0.0, 1.0) }
        }
        (Some((_, a)), _) => of(a),
        (None, Some(&(_, b))) => of(b),
        (None, None) => 0.0,
    }
}
