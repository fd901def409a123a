//! The twelve edges of the volume's box; those that only its far faces share are dashed and faint.

use super::canvas::Canvas;
use crate::scene::View;
use crate::volume::Grid;
use glam::DVec3;

/// An edge as the numbers of its two corners, and whether the box hides it.
fn edges(grid: &Grid, view: &View) -> Vec<([usize; 2], bool)> {
    let corners = grid.corners();
    let normals = grid.world_to_index().matrix3.transpose();
    let seen = |axis: usize, upper: bool| {
        let outwards = normals * DVec3::AXES[axis] * if upper { 1.0 } else { -1.0 };
        let on_face = corners[if upper { 1 << axis } else { 0 }];
        let towards_eye = if view.perspective { view.eye - on_face } else { -view.forward };
        outwards.dot(towards_eye) > 0.0
    };
    let mut list = Vec::new();
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in 0..4 {
            let (upper_b, upper_c) = (side & 1 == 1, side & 2 == 2);
            let from = usize::from(upper_b) << b | usize::from(upper_c) << c;
            list.push(([from, from | 1 << axis], !seen(b, upper_b) && !seen(c, upper_c)));
        }
    }
    list
}

/// Draws the edges, the hidden ones first.
pub(super) fn draw(canvas: &mut Canvas<'_>, grid: &Grid, view: &View) {
    let corners = grid.corners();
    let height = canvas.text_height(canvas.all());
    let ink = canvas.ink_of_rim();
    let width = 0.8 * Canvas::line_width(height);
    let mut list = edges(grid, view);
    list.sort_by_key(|edge| !edge.1);
    for ([a, b], hidden) in list {
        let Some([a, b]) = before_the_eye(view, corners[a], corners[b]) else { continue };
        let points = [a, b].map(|p| {
            let (x, y) = view.window(p);
            [x, y]
        });
        let Some(points) = within(points, f64::from(view.width), f64::from(view.height)) else { continue };
        let dash = hidden.then_some([0.45 * height, 0.35 * height]);
        canvas.line(&points, ink, width, dash, if hidden { 0.45 } else { 0.9 });
    }
}

/// The part of an edge that a perspective eye has before it; all of it in parallel views.
fn before_the_eye(view: &View, a: DVec3, b: DVec3) -> Option<[DVec3; 2]> {
    if !view.perspective {
        return Some([a, b]);
    }
    let (da, db) = (view.depth(a) - view.near, view.depth(b) - view.near);
    let crossing = || a + (b - a) * (da / (da - db));
    match (da > 0.0, db > 0.0) {
        (true, true) => Some([a, b]),
        (true, false) => Some([a, crossing()]),
        (false, true) => Some([crossing(), b]),
        (false, false) => None,
    }
}

/// The part of a line inside the picture and a rim of a tenth around it: lines that go on for ever would be dashed for ever.
fn within([a, b]: [[f64; 2]; 2], width: f64, height: f64) -> Option<[[f64; 2]; 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (axis, side) in [width, height].into_iter().enumerate() {
        let (low, high) = (-0.1 * side, 1.1 * side);
        let step = b[axis] - a[axis];
        if step == 0.0 {
            if a[axis] < low || a[axis] > high {
                return None;
            }
            continue;
        }
        let (s, t) = ((low - a[axis]) / step, (high - a[axis]) / step);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    (from < to).then(|| [at(from), at(to)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Placement, Projection};

    #[test]
    fn a_box_hides_the_edges_that_only_its_far_faces_share() {
        let grid = Grid::with_spacing([10, 12, 14], [1.0, 2.0, -0.5]).expect("grid");
        for projection in [Projection::Orthographic { height: None }, Projection::Perspective { fov_y: 40.0 }] {
            for (azimuth, elevation) in [(30.0, 20.0), (200.0, -40.0), (110.0, 60.0)] {
                let placement = Placement::Orbit { azimuth, elevation, roll: 0.0, zoom: 1.0 };
                let view = Camera::new(placement, projection).and_then(|c| c.resolve(&grid, 100, 80)).expect("view");
                let list = edges(&grid, &view);
                let hidden: Vec<[usize; 2]> = list.iter().filter(|e| e.1).map(|e| e.0).collect();
                // A near eye may see two faces alone, or one: then more edges belong to hidden faces.
                let eye = grid.world_to_index().transform_point3(view.eye);
                let (low, high) = grid.index_bounds();
                let beside = (0..3).filter(|&axis| eye[axis] < low[axis] || eye[axis] > high[axis]).count();
                let faces = if view.perspective { beside } else { 3 };
                assert_eq!((list.len(), hidden.len()), (12, [12, 8, 5, 3][faces]), "{azimuth} {elevation}");
                // The hidden edges of three visible faces meet in the farthest corner.
                let corners = grid.corners();
                let distance = |c: usize| if view.perspective { corners[c].distance(view.eye) } else { view.depth(corners[c]) };
                let far = (0..8).max_by(|&a, &b| distance(a).total_cmp(&distance(b))).expect("corner");
                assert!(faces < 3 || hidden.iter().all(|e| e.contains(&far)), "{hidden:?} {far}");
            }
        }
    }

    #[test]
    fn long_lines_are_cut_to_the_picture() {
        let line = within([[-1e9, 50.0], [1e9, 50.0]], 100.0, 100.0).expect("crosses");
        assert!((line[0][0] + 10.0).abs() < 1e-6 && (line[1][0] - 110.0).abs() < 1e-6);
        assert_eq!(within([[-50.0, -50.0], [200.0, -50.0]], 100.0, 100.0), None);
        assert_eq!(within([[5.0, 6.0], [7.0, 8.0]], 100.0, 100.0), Some([[5.0, 6.0], [7.0, 8.0]]));
    }
}
