//! Lesson 1, polygons: planes of constant depth cut a box, and each cut is a convex polygon of 3 to 6 corners.

use super::super::plot::{Drawing, Ink, Shape};
use super::figure::{LINE, color, letter, line, rectangle, titled, words};
use crate::Result;
use crate::proxy::Stack;
use crate::scene::{Camera, Placement, Projection};
use crate::volume::Grid;

const SIDE: u32 = 360;
/// Where the window lies in the drawing.
const LEFT: f64 = 10.0;
const TOP: f64 = 30.0;

pub(super) fn make() -> Result<(String, Drawing)> {
    // A box of 40 x 60 x 80 voxels, seen past one of its corners, in parallel rays.
    let grid = Grid::with_spacing([40, 60, 80], [1.0; 3])?;
    let around = Placement::Orbit { azimuth: 35.0, elevation: 30.0, roll: 0.0, zoom: 0.9 };
    let view = Camera::new(around, Projection::Orthographic { height: None })?.resolve(&grid, SIDE, SIDE)?;
    let stack = Stack::new(&grid, &view, &[], 9);
    let mut told = format!("depth {:.1} to {:.1}, {} planes {:.2} apart\n", stack.near, stack.far, stack.count, stack.spacing);

    // The edges that begin at the box's first corner are its axes: along them s, t and p grow from 0 to 1.
    let corners = grid.corners().map(|corner| {
        let (x, y) = view.window(corner);
        [LEFT + x, TOP + y]
    });
    let mut shapes = Vec::new();
    for (a, b) in (0..8).flat_map(|c| [1, 2, 4].map(|bit| (c, c | bit))).filter(|(a, b)| a != b) {
        shapes.push(line(corners[a], corners[b], if a == 0 { Ink::Text } else { Ink::Grid }, 1.2));
    }

    let faces = ["x low", "x high", "y low", "y high", "z low", "z high"];
    let legend = LEFT + f64::from(SIDE) + 20.0;
    shapes.push(words([legend, TOP + 20.0], "plane, its depth, its corners"));
    for k in 0..stack.count {
        let Some(polygon) = stack.polygon(k) else { continue };
        let count = polygon.vertices.len();
        told += &format!("plane {k} at depth {:.1}: {count} corners\n", polygon.depth);
        let mut points = Vec::new();
        for (i, corner) in polygon.vertices.iter().enumerate() {
            // A corner lies where the plane meets an edge of the box: on two of its faces.
            let before = polygon.sides[(i + count - 1) % count];
            let (window, texture) = (corner.window, corner.texture.abs());
            told += &format!("  window {window:.1}, texture {texture:.3}, edge of {} and {}\n", faces[before], faces[polygon.sides[i]]);
            points.push([LEFT + window.x, TOP + window.y]);
        }
        points.push(points[0]);
        // Near planes orange, far ones blue.
        let far = k as f64 / (stack.count - 1) as f64;
        let ink = color([0.9 - 0.8 * far, 0.45, 0.1 + 0.8 * far]);
        shapes.push(Shape::Line { points, ink, width: 1.5, dash: None });
        let row = TOP + 20.0 + LINE * (k + 1) as f64;
        shapes.push(line([legend, row], [legend + 22.0, row], ink, 3.0));
        shapes.push(words([legend + 30.0, row], &format!("{k}   {:6.1}   {count}", polygon.depth)));
    }
    // Letters a little beyond the ends of the axes, on paper of their own.
    for (name, [x, y]) in [("x", corners[1]), ("y", corners[2]), ("z", corners[4])] {
        let (dx, dy) = (x - corners[0][0], y - corners[0][1]);
        let out = 12.0 / dx.hypot(dy);
        let at = [x + dx * out, y + dy * out];
        shapes.push(rectangle([at[0] - 5.0, at[1] - 7.0], [at[0] + 5.0, at[1] + 7.0], Ink::Paper));
        shapes.push(letter(at, name, Ink::Text));
    }
    shapes.push(letter([corners[0][0] - 8.0, corners[0][1] + 10.0], "0", Ink::Text));
    shapes.push(words([legend, TOP + 20.0 + LINE * (stack.count + 2) as f64], "orange is near, blue is far"));
    let size = [legend + 230.0, TOP + f64::from(SIDE) + 10.0];
    Ok((told, titled("Lesson 1: planes of constant depth cut the box of a volume", size, shapes)))
}
