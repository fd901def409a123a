//! Signed distance to the Borromean rings: three round-cornered rectangles in the three coordinate planes, bent from one tube.
//!
//! The distance is exact. A point's distance to a plane curve is the hypotenuse of its height over the plane and its distance to
//! the curve within the plane; the three tubes are disjoint, so the nearest of them decides inside and outside.

/// Half the long side of a ring's axis.
const LONG: f64 = 0.8;
/// Half its short side.
const SHORT: f64 = 0.42;
/// Radius of its corners.
const CORNER: f64 = 0.3;
/// Radius of the tube: less than half of LONG - SHORT, so that no two rings touch.
pub(super) const TUBE: f64 = 0.14;

/// A bound on the distance within the box: just over what its corners have.
pub(super) const FARTHEST: f64 = 1.1;

/// Signed distance to the rings, negative inside; between -[`TUBE`] and [`FARTHEST`] within the box.
pub(super) fn distance([x, y, z]: [f64; 3]) -> f64 {
    to_axis(x, y, z).min(to_axis(y, z, x)).min(to_axis(z, x, y)) - TUBE
}

/// Distance to the ring's axis that lies in the plane of `long` and `short`, `height` away from it.
fn to_axis(long: f64, short: f64, height: f64) -> f64 {
    let (u, v) = (long.abs() - (LONG - CORNER), short.abs() - (SHORT - CORNER));
    let outside = (u.max(0.0) * u.max(0.0) + v.max(0.0) * v.max(0.0)).sqrt();
    let in_plane = outside + u.max(v).min(0.0) - CORNER;
    (in_plane * in_plane + height * height).sqrt()
}
