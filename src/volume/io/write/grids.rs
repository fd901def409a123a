//! The grid of a volume as formats tell it.

use crate::volume::{Grid, Space};
use glam::{DMat3, DVec3};

/// Origin and steps of `grid` with world axes as in `space`: those of RAS and LPS differ in the signs of x and y. An unknown space is left
/// as it is.
pub(super) fn in_space(grid: &Grid, space: Space) -> (DVec3, DMat3) {
    let (origin, steps) = (grid.origin(), grid.index_to_world().matrix3);
    if grid.space() == Space::Unknown || grid.space() == space {
        return (origin, steps);
    }
    let turn = DVec3::new(-1.0, -1.0, 1.0);
    // Adding 0 turns -0 into 0.
    (origin * turn + DVec3::ZERO, DMat3::from_diagonal(turn) * steps)
}

/// Whether the axes run along the world's, in its directions.
pub(super) fn is_upright(grid: &Grid) -> bool {
    let steps = grid.index_to_world().matrix3;
    steps == DMat3::from_diagonal(DVec3::from_array(grid.spacing()))
}

/// Whether the axes run along the world's, in its directions or against them.
pub(super) fn is_straight(grid: &Grid) -> bool {
    let steps = grid.index_to_world().matrix3;
    steps == DMat3::from_diagonal(steps.diagonal())
}

/// Whether the axes are at right angles to each other, up to rounding.
pub(super) fn is_rectangular(grid: &Grid) -> bool {
    let d = grid.directions();
    [d.x_axis.dot(d.y_axis), d.y_axis.dot(d.z_axis), d.z_axis.dot(d.x_axis)].iter().all(|c| c.abs() < 1e-6)
}

/// Whether nothing is to be told about the grid: voxels one unit apart from the origin on.
pub(super) fn is_plain(grid: &Grid) -> bool {
    is_upright(grid) && grid.spacing() == [1.0; 3] && grid.origin() == DVec3::ZERO && grid.space() == Space::Unknown
}

/// Numbers as text that gives them back to the bit, with `between` between them.
pub(super) fn text(numbers: impl IntoIterator<Item = f64>, between: &str) -> String {
    // Adding 0 turns -0 into 0.
    let one = |x: f64| match x + 0.0 {
        x if x != 0.0 && !(1e-6..1e15).contains(&x.abs()) => format!("{x:e}"),
        x => format!("{x}"),
    };
    numbers.into_iter().map(one).collect::<Vec<_>>().join(between)
}
