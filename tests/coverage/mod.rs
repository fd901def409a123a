//! Slice polygons of a box against the box and the clip planes themselves.

use glam::{DVec2, DVec3};
use slicestack::proxy::{Edge, SlicePolygon, Stack};
use slicestack::scene::{ClipPlane, View};
use slicestack::volume::Grid;

/// A box, a view of it, and planes that cut it.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) grid: Grid,
    pub(crate) view: View,
    pub(crate) planes: Vec<ClipPlane>,
    pub(crate) count: u64,
}

/// What a check has looked at: pixels on slices, and those too close to an edge to tell.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Seen {
    pub(crate) centres: u64,
    pub(crate) left_out: u64,
    pub(crate) covered: u64,
    pub(crate) polygons: u64,
}

/// The section of the box and the clip planes by the plane at depth `d`, in the window: edges of the box cut one by one, put in
/// order around their middle, then clipped in the world.
fn section(s: &Setup, d: f64) -> Vec<DVec2> {
    let corners = s.grid.corners();
    let depth = corners.map(|c| s.view.depth(c) - d);
    let mut points = Vec::new();
    for a in 0..8usize {
        for bit in [1, 2, 4] {
            let b = a | bit;
            if b != a && (depth[a] < 0.0) != (depth[b] < 0.0) {
                points.push(corners[a] + (corners[b] - corners[a]) * (depth[a] / (depth[a] - depth[b])));
            }
        }
    }
    let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let angle = |p: &DVec3| f64::atan2((*p - middle).dot(s.view.up), (*p - middle).dot(s.view.right));
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    for plane in &s.planes {
        let n = points.len();
        let mut kept = Vec::new();
        for i in 0..n {
            let (p, q) = (points[i], points[(i + 1) % n]);
            let (hp, hq) = (plane.distance(p), plane.distance(q));
            if hp >= 0.0 {
                kept.push(p);
            }
            if (hp >= 0.0) != (hq >= 0.0) {
                kept.push(p + (q - p) * (hp / (hp - hq)));
            }
        }
        points = kept;
    }
    points.iter().map(|&p| DVec2::from(s.view.window(p))).collect()
}

/// Twice the area, positive where the corners go around counter-clockwise with y up.
fn signed_area(points: &[DVec2]) -> f64 {
    let n = points.len();
    let Some(&first) = points.first() else { return 0.0 };
    -0.5 * (0..n).map(|i| (points[i] - first).perp_dot(points[(i + 1) % n] - first)).sum::<f64>()
}

/// Signed slack of a world point: how far inside the nearest face or plane it is, in shares of the size of the box.
fn slack(s: &Setup, world: DVec3) -> f64 {
    let index = s.grid.world_to_index().transform_point3(world);
    let (lo, hi) = s.grid.index_bounds();
    let size = (hi - lo).max_element();
    let faces = (index - lo).min(hi - index).min_element() / size;
    s.planes.iter().map(|p| p.distance(world) / s.grid.radius()).fold(faces, f64::min)
}

/// One polygon's shape.
fn check_polygon(s: &Setup, stack: &Stack, polygon: &SlicePolygon, want: &[DVec2]) {
    let n = polygon.vertices.len();
    assert!((3..=6 + s.planes.len()).contains(&n), "{n} vertices");
    assert_eq!((polygon.edges.len(), polygon.sides.len()), (n, n));
    let window: Vec<DVec2> = polygon.vertices.iter().map(|v| v.window).collect();
    let scale = window.iter().chain(want).map(|p| p.abs().max_element()).fold(1.0, f64::max);
    let area = signed_area(&window);
    assert!(area > -1e-11 * scale * scale, "clockwise: {area} at scale {scale}");
    assert!((area.abs() - polygon.area()).abs() <= 1e-10 * scale * scale);
    assert!((polygon.area() - signed_area(want)).abs() <= 1e-9 * scale * scale, "area {} not {}", polygon.area(), signed_area(want));
    for i in 0..n {
        let (a, b, c) = (window[(i + n - 1) % n], window[i], window[(i + 1) % n]);
        assert!((b - a).perp_dot(c - b) <= 1e-11 * scale * scale, "not convex at vertex {i}");
        for j in 0..i {
            assert_ne!(window[i], window[j], "vertices {i} and {j}");
        }
        let v = &polygon.vertices[i];
        let world = s.grid.index_to_world().transform_point3(v.index);
        let size = s.grid.radius() + s.view.eye.length() + world.length();
        assert!((s.view.depth(world) - polygon.depth).abs() <= 1e-11 * size, "vertex {i} off the plane");
        for side in [i, (i + n - 1) % n] {
            let e = polygon.edges[side];
            let steep = e.b.hypot(e.c);
            assert!(e.eval(b.x, b.y).abs() <= 1e-10 * steep * scale, "vertex {i} is {} off side {side}", e.eval(b.x, b.y) / steep);
            let half = stack.half_spaces[polygon.sides[side]];
            assert_eq!(e, Edge::new(half.at_depth(stack.perspective, polygon.depth)));
        }
        let (lo, hi) = s.grid.index_bounds();
        let slack = 1e-9 * (hi - lo).max_element();
        assert!(v.index.cmpge(lo - slack).all() && v.index.cmple(hi + slack).all(), "vertex {i} at index {}", v.index);
        assert!(v.texture.cmpge(DVec3::splat(-1e-8)).all() && v.texture.cmple(DVec3::splat(1.0 + 1e-8)).all(), "texture {}", v.texture);
        let dims = DVec3::from_array(s.grid.dims().map(|n| n as f64));
        assert!((v.texture - (v.index + 0.5) / dims).abs().max_element() < 1e-12);
    }
}

/// Everything that must hold of one setup.
///
/// # Panics
/// Where something does not.
pub(crate) fn check(s: &Setup) -> Seen {
    let stack = Stack::new(&s.grid, &s.view, &s.planes, s.count);
    let mut seen = Seen::default();
    if stack.is_empty() {
        assert!(s.grid.corners().iter().all(|&c| s.view.depth(c) <= s.view.near));
        return seen;
    }
    let polygons: Vec<_> = (0..s.count).map(|k| stack.polygon(k)).collect();
    for (k, polygon) in polygons.iter().enumerate() {
        let d = stack.depth(k as u64);
        let want = section(s, d);
        match polygon {
            Some(polygon) => {
                seen.polygons += 1;
                check_polygon(s, &stack, polygon, &want);
            }
            None => {
                let scale = want.iter().map(|p| p.abs().max_element()).fold(1.0, f64::max);
                assert!(signed_area(&want) <= 1e-9 * scale * scale, "slice {k}: a section of {} square pixels lost", signed_area(&want));
            }
        }
    }
    for y in 0..s.view.height {
        for x in 0..s.view.width {
            let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (origin, direction) = s.view.ray(x, y);
            let (mut planes_inside, mut covered, mut sure) = (0, 0, true);
            for (k, polygon) in polygons.iter().enumerate() {
                let slack = slack(s, origin + direction * stack.depth(k as u64));
                let by_polygon = polygon.as_ref().is_some_and(|p| p.covers(x, y));
                seen.centres += 1;
                assert_eq!(stack.covers(k as u64, x, y), by_polygon, "slice {k} at ({x},{y}): slack {slack}");
                if slack.abs() <= 1e-9 {
                    seen.left_out += 1;
                    sure = false;
                    continue;
                }
                assert_eq!(by_polygon, slack > 0.0, "slice {k} at ({x},{y}): slack {slack}");
                planes_inside += u64::from(slack > 0.0);
                covered += u64::from(by_polygon);
            }
            assert!(!sure || covered == planes_inside);
            seen.covered += covered;
        }
    }
    seen
}
