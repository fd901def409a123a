use super::geometry::{Side, StackRecord};
use super::tests::{PARALLEL, WIDE};
use crate::proxy::Stack;
use crate::scene::{Camera, ClipPlane, Placement};
use crate::volume::Grid;
use glam::{DMat3, DVec3};

/// A rectangle: left, right, top, bottom.
type Rectangle = [f64; 4];

/// What a browser needs for `text` around `[x, y]`: letters of 0.6 of their height on average, and a little more than a capital's height.
fn rectangle([x, y]: [f64; 2], text: &str, height: f64) -> Rectangle {
    let (half, tall) = (0.3 * height * text.len() as f64, 0.55 * height);
    [x - half, x + half, y - tall, y + tall]
}

fn meet(a: &Rectangle, b: &Rectangle) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}

fn grids() -> Vec<Grid> {
    let sheared = DMat3::from_cols(DVec3::new(1.0, 0.1, 0.0), DVec3::new(0.4, 1.3, 0.2), DVec3::new(-0.3, 0.1, 2.0));
    let plain = [
        ([40, 60, 80], [1.0; 3]),
        ([64, 64, 64], [1.0; 3]),
        ([200, 200, 2], [1.0; 3]),
        ([2, 3, 150], [1.0; 3]),
        ([9, 9, 9], [1.0, 4.0, 0.2]),
    ];
    let mut grids: Vec<Grid> = plain.iter().map(|&(dims, spacing)| Grid::with_spacing(dims, spacing).unwrap()).collect();
    grids.push(Grid::new([20, 30, 25], DVec3::new(3.0, -5.0, 1.0), sheared).unwrap());
    grids
}

/// Labels of all drawings, for many cameras and boxes: every one has a place inside the drawing, and no two lie on each other or on a corner's dot.
#[test]
fn no_two_labels_of_the_drawing_overlap() {
    let mut seen = 0;
    let mut check = |grid: &Grid, azimuth: f64, elevation: f64, roll: f64, projection, clip: &[ClipPlane]| {
        let case = format!("{:?}, {azimuth} {elevation} {roll} {projection:?}, {} planes", grid.dims(), clip.len());
        let camera = Camera::new(Placement::Orbit { azimuth, elevation, roll, zoom: 1.0 }, projection).unwrap();
        let view = camera.resolve(grid, 96, 80).unwrap();
        let stack = Stack::new(grid, &view, clip, 23);
        let side = Side::new(grid, &view).unwrap();
        let record = StackRecord::new(&stack, grid, &side, 0..stack.count, None);
        let [width, height] = record.drawing.map(f64::from);
        for (at, size) in record.sizes.iter().enumerate() {
            let height_of = |axis: Option<usize>| if axis.is_some() { size.letter } else { size.text };
            let still: Vec<Rectangle> = record.labels[at]
                .iter()
                .map(|l| rectangle(l.at.unwrap_or_else(|| panic!("{case}: no room for {}", l.text)), l.text, height_of(l.axis)))
                .collect();
            assert_eq!(
                record.labels[at].iter().filter_map(|l| l.axis.map(|a| (l.text, a))).collect::<Vec<_>>(),
                [("x", 0), ("y", 1), ("z", 2)]
            );
            for slice in &record.slices {
                let mut all = still.clone();
                for (i, v) in slice.vertices.iter().enumerate() {
                    let place = v.labels[at].unwrap_or_else(|| panic!("{case}: slice {}: no room for {}", slice.slice, i + 1));
                    all.push(rectangle(place, &(i + 1).to_string(), size.text));
                }
                for (i, a) in all.iter().enumerate() {
                    assert!(a[0] >= 0.0 && a[1] <= width && a[2] >= 0.0 && a[3] <= height, "{case}: slice {}: {a:?} outside", slice.slice);
                    assert!(!all[..i].iter().any(|b| meet(a, b)), "{case}: slice {}: label {i} on another", slice.slice);
                }
                // A dot has a radius of 4.
                let dots = slice.vertices.iter().map(|v| [v.drawn[0] - 4.0, v.drawn[0] + 4.0, v.drawn[1] - 4.0, v.drawn[1] + 4.0]);
                let numbers = &all[still.len()..];
                assert!(
                    !dots.into_iter().any(|dot| numbers.iter().any(|n| meet(n, &dot))),
                    "{case}: slice {}: a number on a dot",
                    slice.slice
                );
                seen += numbers.len();
            }
        }
    };
    for grid in grids() {
        for azimuth in (0..360).step_by(45).map(|a| f64::from(a) + 7.0).chain([0.0, 90.0]) {
            for elevation in [-90.0, -64.0, -20.0, 0.0, 35.0, 80.0] {
                check(&grid, azimuth, elevation, 0.0, PARALLEL, &[]);
                check(&grid, azimuth, elevation, 30.0, WIDE, &[]);
            }
        }
        // As many clip planes as there can be cut all corners off.
        let middle = grid.center();
        let planes: Vec<ClipPlane> =
            [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]]
                .iter()
                .map(|n| {
                    let normal = DVec3::from_array(*n).normalize();
                    ClipPlane::new(normal, normal.dot(middle) - 0.5 * grid.radius()).unwrap()
                })
                .collect();
        check(&grid, 25.0, 20.0, 5.0, WIDE, &planes);
    }
    assert!(seen > 10_000, "{seen}");
}

/// The letters stand at the ends of the edges along which s, t and p grow, nearer to them than to any other corner of the box.
#[test]
fn letters_stand_at_the_ends_of_their_axes() {
    let grid = &grids()[0];
    let view = Camera::orbit(25.0, 20.0).unwrap().resolve(grid, 96, 80).unwrap();
    let stack = Stack::new(grid, &view, &[], 23);
    let side = Side::new(grid, &view).unwrap();
    let record = StackRecord::new(&stack, grid, &side, 0..stack.count, None);
    let away = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    for label in record.labels[0].iter().filter(|l| l.axis.is_some()) {
        let nearest =
            (0..8).min_by(|&a, &b| away(record.corners[a], label.at.unwrap()).total_cmp(&away(record.corners[b], label.at.unwrap())));
        assert_eq!(nearest, label.axis.map(|a| 1 << a), "{}", label.text);
    }
    for (axis, far) in [1, 2, 4].into_iter().enumerate() {
        // Index -1/2 is the lower face, so the corner's texture coordinate is 1 along its axis alone.
        let texture = grid.index_to_world().inverse().transform_point3(grid.corners()[far]) + 0.5;
        let want = DVec3::AXES[axis] * grid.dims()[axis] as f64;
        assert!((texture - want).length() < 1e-9, "{texture}");
    }
}
