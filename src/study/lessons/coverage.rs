//! Lesson 2, coverage: a pixel belongs to a polygon if its centre does, and a centre on a shared side belongs to exactly one of two.

use super::super::plot::{Anchor, Drawing, Ink, Shape, text};
use super::figure::{LINE, color, line, rectangle, titled, words};
use crate::proxy::{SlicePolygon, Stack};
use crate::scene::{Camera, ClipPlane, Placement, Projection};
use crate::volume::Grid;
use crate::{Error, Result};

const SIDE: u32 = 16;
/// Each pixel is drawn this large.
const SCALE: f64 = 22.0;
const LEFT: f64 = 48.0;
const TOP: f64 = 52.0;

pub(super) fn make() -> Result<(String, Drawing)> {
    let grid = Grid::with_spacing([4, 6, 8], [1.0; 3])?;
    let around = Placement::Orbit { azimuth: 35.0, elevation: 30.0, roll: 0.0, zoom: 0.9 };
    let view = Camera::new(around, Projection::Orthographic { height: None })?.resolve(&grid, SIDE, SIDE)?;
    let polygon = Stack::new(&grid, &view, &[], 9).polygon(4).ok_or_else(|| Error::invalid("the plane misses the box"))?;
    let mut told = String::new();
    for (edge, side) in polygon.edges.iter().zip(&polygon.sides) {
        told +=
            &format!("side {side}: {:+.3} {:+.3} column {:+.3} row; 9.5, 7.5 gives {:+.3}\n", edge.a, edge.b, edge.c, edge.eval(9.5, 7.5));
    }
    for y in 0..SIDE {
        let mark = |x: u32| if polygon.covers(f64::from(x) + 0.5, f64::from(y) + 0.5) { "#" } else { "." };
        told += &format!("{}\n", (0..SIDE).map(mark).collect::<String>());
    }

    // The box cut in two by a plane through pixel centres, both halves on one slice: no pixel is lost, none is in both.
    let upright = Camera::orbit(0.0, 0.0)?.resolve(&grid, SIDE, SIDE)?;
    let (centre, direction) = upright.ray(8.5, 8.5);
    let across = ClipPlane::new(upright.right, upright.right.dot(centre))?;
    let back = ClipPlane::new(-across.normal(), -across.offset())?;
    let halves = [across, back].map(|plane| Stack::new(&grid, &upright, &[plane], 1));
    let whole = Stack::new(&grid, &upright, &[], 1);
    let centres = || (0..SIDE * SIDE).map(|i| (f64::from(i % SIDE) + 0.5, f64::from(i / SIDE) + 0.5));
    let times = |(x, y): (f64, f64)| halves.iter().filter(|half| half.covers(0, x, y)).count();
    let both = centres().filter(|&c| times(c) > 1).count();
    let lost = centres().filter(|&c| whole.covers(0, c.0, c.1) && times(c) == 0).count();
    told += &format!("looking along {direction}, cut through the centres of column 8: {both} pixels in both halves, {lost} lost\n");
    Ok((told, magnified(&polygon)))
}

/// Covered pixels blue, their centres dark, the polygon's sides red.
fn magnified(polygon: &SlicePolygon) -> Drawing {
    let at = |x: f64, y: f64| [LEFT + SCALE * x, TOP + SCALE * y];
    let (covered, dark, red) = (color([0.7, 0.82, 1.0]), color([0.1, 0.2, 0.4]), color([0.8, 0.1, 0.1]));
    let dot = |[x, y]: [f64; 2]| rectangle([x - 2.5, y - 2.5], [x + 2.5, y + 2.5], dark);
    let n = f64::from(SIDE);
    let mut shapes = Vec::new();
    for (x, y) in (0..SIDE * SIDE).map(|i| (f64::from(i % SIDE), f64::from(i / SIDE))) {
        if polygon.covers(x + 0.5, y + 0.5) {
            shapes.push(rectangle(at(x, y), at(x + 1.0, y + 1.0), covered));
        }
    }
    for i in (0..=SIDE).map(f64::from) {
        shapes.extend([line(at(i, 0.0), at(i, n), Ink::Grid, 1.0), line(at(0.0, i), at(n, i), Ink::Grid, 1.0)]);
    }
    shapes.extend((0..SIDE * SIDE).map(|i| dot(at(f64::from(i % SIDE) + 0.5, f64::from(i / SIDE) + 0.5))));
    let corners = polygon.vertices.iter().chain(&polygon.vertices[..1]).map(|v| at(v.window.x, v.window.y)).collect();
    shapes.push(Shape::Line { points: corners, ink: red, width: 2.5, dash: None });
    for i in 0..SIDE {
        let along = f64::from(i) + 0.5;
        shapes.push(text([at(along, 0.0)[0], TOP - 9.0], &i.to_string(), Ink::Muted, Anchor::Middle, false));
        shapes.push(text([LEFT - 6.0, at(0.0, along)[1]], &i.to_string(), Ink::Muted, Anchor::End, false));
    }
    shapes.push(text([LEFT - 38.0, TOP - 9.0], "row", Ink::Text, Anchor::Start, false));
    let legend = LEFT + SCALE * n + 14.0;
    shapes.push(words([legend, TOP - 9.0], "column"));
    let row = |i: u32| TOP + 20.0 + LINE * f64::from(i);
    shapes.extend([line([legend, row(0)], [legend + 18.0, row(0)], red, 2.5), words([legend + 26.0, row(0)], "sides of the polygon")]);
    shapes.extend([dot([legend + 9.0, row(1)]), words([legend + 26.0, row(1)], "centres of pixels")]);
    shapes.push(rectangle([legend, row(2) - 7.0], [legend + 18.0, row(2) + 7.0], covered));
    shapes.push(words([legend + 26.0, row(2)], "covered pixels"));
    titled("Lesson 2: a pixel is covered if its centre is", [legend + 190.0, TOP + SCALE * n + 12.0], shapes)
}
