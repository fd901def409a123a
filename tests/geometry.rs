//! Slice polygons against the box and the clip planes themselves, over thousands of random boxes and cameras.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod coverage;

use coverage::{Seen, Setup, check};
use glam::{DMat3, DQuat, DVec2, DVec3};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use slicestack::proxy::{Edge, Stack};
use slicestack::scene::{Camera, ClipPlane, Placement, Projection, View};
use slicestack::volume::{BoxConvention, Grid};
use std::cell::Cell;

fn run<S: Strategy>(cases: u32, strategy: S, check: impl Fn(S::Value)) {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let result = runner.run(&strategy, |value| {
        check(value);
        Ok(())
    });
    if let Err(e) = result {
        panic!("{e}");
    }
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_filter_map("too short", |(x, y, z)| {
        let v = DVec3::new(x, y, z);
        (v.length() > 0.2).then(|| v.normalize())
    })
}

fn grids() -> impl Strategy<Value = Grid> {
    let side = prop_oneof![1 => Just(1usize), 4 => 2usize..40];
    let dims = [side.clone(), side.clone(), side];
    let spacing = vec((-1.0..0.7f64, any::<bool>()), 3);
    let turn = prop_oneof![
        2 => Just(DMat3::IDENTITY),
        2 => (direction(), 0.0..6.3f64).prop_map(|(axis, angle)| DMat3::from_quat(DQuat::from_axis_angle(axis, angle))),
        // Oblique: axes that are not at right angles.
        2 => (direction(), 0.0..6.3f64, -0.5..0.5f64, -0.5..0.5f64).prop_map(|(axis, angle, s, t)| {
            DMat3::from_quat(DQuat::from_axis_angle(axis, angle)) * DMat3::from_cols(DVec3::X, DVec3::new(s, 1.0, 0.0), DVec3::new(t, s, 1.0))
        }),
    ];
    (dims, spacing, turn, vec(-50.0..50.0f64, 3), any::<bool>()).prop_map(|(dims, spacing, turn, origin, nodes)| {
        let length = |i: usize| 10f64.powf(spacing[i].0) * if spacing[i].1 { -1.0 } else { 1.0 };
        let steps = turn * DMat3::from_diagonal(DVec3::new(length(0), length(1), length(2)));
        // A single voxel has no extent between nodes.
        let dims = if nodes { dims.map(|n| n.max(2)) } else { dims };
        let grid = Grid::new(dims, DVec3::new(origin[0], origin[1], origin[2]), steps).unwrap();
        grid.with_convention(if nodes { BoxConvention::Nodes } else { BoxConvention::Cells })
    })
}

/// Directions along axes and diagonals of the world, and one unit in the last place off them.
fn special_direction() -> impl Strategy<Value = DVec3> {
    let component = prop_oneof![Just(0.0), Just(1.0), Just(-1.0), Just(f64::EPSILON), Just(1.0 + f64::EPSILON), Just(-f64::EPSILON)];
    [component.clone(), component.clone(), component]
        .prop_filter_map("no direction", |c| (DVec3::from_array(c).length() > 0.5).then(|| DVec3::from_array(c)))
}

fn setups() -> impl Strategy<Value = Setup> {
    let towards = prop_oneof![2 => direction(), 1 => special_direction()];
    let camera = (towards, any::<bool>(), 0.0..3.0f64, 0.3..3.0f64, 15.0..110.0f64, prop::option::of(0.0..1.5f64), any::<bool>());
    let planes = prop_oneof![2 => vec((direction(), -0.8..0.8f64), 0), 3 => vec((direction(), -0.8..0.8f64), 1..=6)];
    (grids(), camera, planes, (1u32..40, 1u32..40), 1u64..24).prop_map(|(grid, camera, planes, (width, height), count)| {
        let (towards, perspective, distance, zoom, fov_y, near, aim) = camera;
        let (center, radius) = (grid.center(), grid.radius());
        // From outside, from inside, and from anywhere between.
        let target = if aim { center } else { center + DVec3::new(0.3, -0.2, 0.1) * radius };
        let eye = target + towards * radius * distance.max(1e-3);
        let up = if towards.normalize().z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
        let projection =
            if perspective { Projection::Perspective { fov_y } } else { Projection::Orthographic { height: Some(2.0 * radius / zoom) } };
        let camera = Camera::new(Placement::LookAt { eye, target, up }, projection).unwrap();
        let camera = near.map_or(camera, |n| camera.with_near((n * radius).max(1e-3 * radius)).unwrap());
        let view = camera.resolve(&grid, width, height).unwrap();
        let planes = planes.iter().map(|&(n, at)| ClipPlane::new(n, n.dot(center) + at * radius).unwrap()).collect();
        Setup { grid, view, planes, count }
    })
}

#[test]
fn pixels_are_covered_as_often_as_their_rays_meet_planes_inside() {
    let total = Cell::new(Seen::default());
    run(1500, setups(), |s| {
        let (mut t, seen) = (total.get(), check(&s));
        t.centres += seen.centres;
        t.left_out += seen.left_out;
        t.covered += seen.covered;
        t.polygons += seen.polygons;
        total.set(t);
    });
    let t = total.get();
    assert!(t.covered > 200_000 && t.polygons > 5_000, "{t:?} is no test");
    assert!(t.left_out * 10_000 < t.centres, "{t:?}: too many left out");
}

fn look(grid: &Grid, towards: DVec3, up: DVec3, projection: Projection, size: (u32, u32)) -> View {
    let eye = grid.center() + towards;
    let camera = Camera::new(Placement::LookAt { eye, target: grid.center(), up }, projection).unwrap();
    camera.resolve(grid, size.0, size.1).unwrap()
}

#[test]
fn planes_through_corners_and_edges_of_the_box() {
    let parallel = Projection::Orthographic { height: Some(40.0) };
    let mut seen = 0;
    for convention in [BoxConvention::Cells, BoxConvention::Nodes] {
        for dims in [[8, 8, 8], [5, 5, 9], [2, 2, 2]] {
            let grid = Grid::with_spacing(dims, [1.0; 3]).unwrap().with_convention(convention);
            // Along a diagonal of the box, of a face, and along an axis: for an odd number of slices the middle one passes through
            // edges or corners, for multiples of three others do.
            for (towards, up) in [
                (DVec3::splat(32.0), DVec3::Z),
                (DVec3::new(32.0, 32.0, 0.0), DVec3::Z),
                (DVec3::new(0.0, -32.0, 0.0), DVec3::Z),
                (DVec3::new(0.0, f64::EPSILON, 32.0), DVec3::Y),
            ] {
                for projection in [parallel, Projection::Perspective { fov_y: 50.0 }] {
                    for count in [1, 2, 3, 5, 6, 9] {
                        let view = look(&grid, towards, up, projection, (41, 40));
                        seen += check(&Setup { grid: grid.clone(), view, planes: Vec::new(), count }).covered;
                    }
                }
            }
        }
    }
    assert!(seen > 10_000);
}

#[test]
fn clip_planes_through_corners_of_the_box_and_along_its_faces() {
    let grid = Grid::with_spacing([6, 6, 6], [1.0; 3]).unwrap();
    let (center, corner) = (grid.center(), grid.corners()[7]);
    let through = |n: DVec3, p: DVec3| ClipPlane::new(n, ClipPlane::new(n, 0.0).unwrap().normal().dot(p) * n.length()).unwrap();
    let sets = [
        vec![through(DVec3::splat(1.0), center)],
        vec![through(DVec3::new(1.0, -1.0, 0.0), center), through(DVec3::new(1.0, 1.0, 0.0), center)],
        // Only a corner, or nothing, is left.
        vec![through(DVec3::splat(1.0), corner)],
        // Faces of the box again, and the same plane twice.
        vec![through(DVec3::NEG_X, corner), through(DVec3::NEG_Y, corner), through(DVec3::NEG_Z, corner)],
        vec![through(DVec3::Z, center), through(DVec3::Z, center)],
        // Nothing but the plane itself is left.
        vec![through(DVec3::Z, center), through(DVec3::NEG_Z, center)],
    ];
    for planes in sets {
        for towards in [DVec3::splat(20.0), DVec3::new(20.0, 0.0, 0.0), DVec3::new(13.0, -17.0, 5.0)] {
            for count in [1, 3, 4] {
                let view = look(&grid, towards, DVec3::Z, Projection::Orthographic { height: Some(16.0) }, (33, 32));
                check(&Setup { grid: grid.clone(), view, planes: planes.clone(), count });
            }
        }
    }
}

#[test]
fn single_voxels_and_rows_of_voxels() {
    for dims in [[1, 1, 1], [1, 1, 30], [30, 1, 1], [1, 7, 4]] {
        for spacing in [[1.0, 1.0, 1.0], [0.01, 1.0, 30.0], [-2.0, 0.5, -1.0]] {
            let grid = Grid::with_spacing(dims, spacing).unwrap();
            let r = grid.radius();
            for towards in [DVec3::Z, DVec3::NEG_X, DVec3::new(0.3, 0.5, -0.7)] {
                let up = if towards.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
                for projection in [Projection::Orthographic { height: Some(2.0 * r) }, Projection::Perspective { fov_y: 40.0 }] {
                    let view = look(&grid, towards * (3.0 * r), up, projection, (32, 31));
                    let setup = Setup { grid: grid.clone(), view, planes: Vec::new(), count: 7 };
                    let seen = check(&setup);
                    assert_eq!(seen.polygons, 7, "{dims:?} {spacing:?}");
                    // Between its nodes a single voxel has no extent: nothing is covered, and nothing fails.
                    let flat = grid.clone().with_convention(BoxConvention::Nodes);
                    let stack = Stack::new(&flat, &view, &[], 5);
                    for k in 0..stack.count {
                        assert!((0..31).all(|y| (0..32).all(|x| !stack.covers(k, f64::from(x) + 0.5, f64::from(y) + 0.5))));
                        stack.polygon(k);
                    }
                }
            }
        }
    }
}

/// The edge from `p` to `q` with `inside` on its inner side.
fn edge(p: DVec2, q: DVec2, inside: DVec2) -> Edge {
    let (b, c) = (p.y - q.y, q.x - p.x);
    let e = Edge::new([-(b * p.x + c * p.y), b, c]);
    if e.eval(inside.x, inside.y) > 0.0 { e } else { Edge::new([-e.a, -e.b, -e.c]) }
}

fn polygon_edges(corners: &[DVec2]) -> Vec<Edge> {
    let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
    (0..corners.len()).map(|i| edge(corners[i], corners[(i + 1) % corners.len()], middle)).collect()
}

/// The convex hull of points, by the gift-wrapping of a sorted list; no corner lies on a side.
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while chain.len() > 1 && (chain[chain.len() - 1] - chain[chain.len() - 2]).perp_dot(p - chain[chain.len() - 1]) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}

#[test]
fn triangles_of_a_fan_share_no_pixel_and_lose_none() {
    // Corners at pixel centres, edges and corners of pixels: every tie there is. All arithmetic is exact.
    let points = vec((0i32..24, 0i32..24), 3..10);
    let ties = Cell::new(0u32);
    run(1500, points, |points| {
        let corners = hull(points.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y)) * 0.5).collect());
        if corners.len() < 3 {
            return;
        }
        let whole = polygon_edges(&corners);
        let fan: Vec<Vec<Edge>> = (1..corners.len() - 1).map(|i| polygon_edges(&[corners[0], corners[i], corners[i + 1]])).collect();
        for y in 0..13 {
            for x in 0..13 {
                let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                let inside = |edges: &[Edge]| edges.iter().all(|e| e.contains(x, y));
                let triangles = fan.iter().filter(|t| inside(t)).count();
                assert_eq!(triangles, usize::from(inside(&whole)), "({x},{y}) of {corners:?}");
                ties.set(ties.get() + u32::from(fan.iter().flatten().any(|e| e.eval(x, y) == 0.0)));
            }
        }
    });
    assert!(ties.get() > 10_000, "only {} centres lie on a line", ties.get());
}

#[test]
fn both_sides_of_a_clip_plane_make_the_whole_box() {
    let ties = Cell::new(0u32);
    let strategy = (setups(), direction(), prop_oneof![Just(0.0), -0.5..0.5f64], any::<bool>());
    run(300, strategy, |(mut s, normal, at, exact)| {
        let mut normal = normal;
        if exact {
            // A pixel is a quarter of a unit and the plane goes through pixel centres.
            s.grid = Grid::with_spacing([9, 7, 8], [1.0; 3]).unwrap();
            s.view = look(&s.grid, DVec3::new(0.0, -32.0, 0.0), DVec3::Z, Projection::Orthographic { height: Some(8.25) }, (33, 33));
            normal = DVec3::new(f64::from((normal.x * 2.5) as i32), 0.0, f64::from((normal.z * 2.5) as i32));
            if normal == DVec3::ZERO {
                normal = DVec3::X;
            }
        }
        let offset = if exact { normal.dot(s.grid.center()) } else { normal.dot(s.grid.center()) + at * s.grid.radius() };
        let stack = |planes: &[ClipPlane]| Stack::new(&s.grid, &s.view, planes, s.count);
        let halves = [stack(&[ClipPlane::new(normal, offset).unwrap()]), stack(&[ClipPlane::new(-normal, -offset).unwrap()])];
        let whole = stack(&[]);
        for k in 0..whole.count {
            for y in 0..s.view.height {
                for x in 0..s.view.width {
                    let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let both = halves.each_ref().map(|h| u32::from(h.covers(k, x, y)));
                    assert_eq!(both[0] + both[1], u32::from(whole.covers(k, x, y)), "slice {k} at ({x},{y})");
                    let on = Edge::new(halves[0].half_spaces[6].at_depth(halves[0].perspective, whole.depth(k))).eval(x, y);
                    ties.set(ties.get() + u32::from(on == 0.0));
                }
            }
        }
    });
    assert!(ties.get() > 1000, "only {} centres lie on the plane", ties.get());
}
