//! Lesson 2, coverage: a pixel belongs to a polygon if its centre does, and a centre on a shared side belongs to exactly one of two.
//!
//! ```sh
//! cargo run --release --example lesson_2_coverage -- coverage.png
//! ```

use slicestack::picture::Depth;
use slicestack::proxy::{SlicePolygon, Stack};
use slicestack::scene::{Camera, ClipPlane, Placement, Projection};
use slicestack::volume::Grid;
use slicestack::{Error, Picture, Result};
use std::path::{Path, PathBuf};

const SIDE: u32 = 16;
/// Each pixel is drawn this large.
const SCALE: u32 = 24;

pub(crate) fn run(out: &Path) -> Result<()> {
    let grid = Grid::with_spacing([4, 6, 8], [1.0; 3])?;
    let around = Placement::Orbit { azimuth: 35.0, elevation: 30.0, roll: 0.0, zoom: 0.9 };
    let view = Camera::new(around, Projection::Orthographic { height: None })?.resolve(&grid, SIDE, SIDE)?;
    let polygon = Stack::new(&grid, &view, &[], 9).polygon(4).ok_or_else(|| Error::invalid("the plane misses the box"))?;
    for (edge, side) in polygon.edges.iter().zip(&polygon.sides) {
        println!("side {side}: {:+.3} {:+.3} x {:+.3} y; 9.5, 7.5 gives {:+.3}", edge.a, edge.b, edge.c, edge.eval(9.5, 7.5));
    }
    for y in 0..SIDE {
        let mark = |x: u32| if polygon.covers(f64::from(x) + 0.5, f64::from(y) + 0.5) { "#" } else { "." };
        println!("{}", (0..SIDE).map(mark).collect::<String>());
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
    println!("looking along {direction}, cut through the centres of column 8: {both} pixels in both halves, {lost} lost");

    Picture::from_pixels(SIDE * SCALE, SIDE * SCALE, magnified(&polygon))?.save(out, Depth::Eight)
}

/// Covered pixels blue, their centres dark, the polygon's sides red.
fn magnified(polygon: &SlicePolygon) -> Vec<[f32; 4]> {
    let draw = |i: u32| {
        let (px, py) = (i % (SIDE * SCALE), i / (SIDE * SCALE));
        let (x, y) = ((f64::from(px) + 0.5) / f64::from(SCALE), (f64::from(py) + 0.5) / f64::from(SCALE));
        let (cx, cy) = (x.floor() + 0.5, y.floor() + 0.5);
        // An edge function over the length of its gradient is a distance in pixels.
        let nearest = polygon.edges.iter().map(|e| e.eval(x, y) / e.b.hypot(e.c)).fold(f64::INFINITY, f64::min);
        let covered = polygon.covers(cx, cy);
        match () {
            () if nearest.abs() < 0.06 => [0.8, 0.1, 0.1, 1.0],
            () if (x - cx).hypot(y - cy) < 0.12 => [0.1, 0.2, 0.4, 1.0],
            () if px % SCALE == 0 || py % SCALE == 0 => [0.8, 0.82, 0.85, 1.0],
            () if covered => [0.7, 0.82, 1.0, 1.0],
            () => [1.0; 4],
        }
    };
    (0..SIDE * SCALE * SIDE * SCALE).map(draw).collect()
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "coverage.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
