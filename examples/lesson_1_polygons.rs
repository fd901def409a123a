//! Lesson 1, polygons: planes of constant depth cut a box, and each cut is a convex polygon of 3 to 6 corners.
//!
//! ```sh
//! cargo run --release --example lesson_1_polygons -- polygons.png
//! ```

use slicestack::picture::Depth;
use slicestack::proxy::Stack;
use slicestack::scene::{Camera, Placement, Projection};
use slicestack::volume::Grid;
use slicestack::{Error, Picture, Result};
use std::path::{Path, PathBuf};
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Stroke, Transform};

const SIDE: u32 = 360;

pub(crate) fn run(out: &Path) -> Result<()> {
    // A box of 40 x 60 x 80 voxels, seen past one of its corners, in parallel rays.
    let grid = Grid::with_spacing([40, 60, 80], [1.0; 3])?;
    let around = Placement::Orbit { azimuth: 35.0, elevation: 30.0, roll: 0.0, zoom: 0.9 };
    let view = Camera::new(around, Projection::Orthographic { height: None })?.resolve(&grid, SIDE, SIDE)?;
    let stack = Stack::new(&grid, &view, &[], 9);
    println!("depth {:.1} to {:.1}, {} planes {:.2} apart", stack.near, stack.far, stack.count, stack.spacing);

    let faces = ["x low", "x high", "y low", "y high", "z low", "z high"];
    let mut map = Pixmap::new(SIDE, SIDE).ok_or_else(|| Error::invalid("no memory for the drawing"))?;
    map.fill(Color::WHITE);
    for k in 0..stack.count {
        let Some(polygon) = stack.polygon(k) else { continue };
        println!("plane {k} at depth {:.1}: {} corners", polygon.depth, polygon.vertices.len());
        let mut path = PathBuilder::new();
        for (i, corner) in polygon.vertices.iter().enumerate() {
            // A corner lies where the plane meets an edge of the box: on two of its faces.
            let before = polygon.sides[(i + polygon.sides.len() - 1) % polygon.sides.len()];
            let (window, texture) = (corner.window, corner.texture.abs());
            println!("  window {window:.1}, texture {texture:.3}, edge of {} and {}", faces[before], faces[polygon.sides[i]]);
            let (x, y) = (window.x as f32, window.y as f32);
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        path.close();
        let Some(path) = path.finish() else { continue };
        // Near planes orange, far ones blue.
        let far = k as f32 / (stack.count - 1) as f32;
        let mut paint = Paint::default();
        paint.set_color(Color::from_rgba(0.9 - 0.8 * far, 0.45, 0.1 + 0.8 * far, 1.0).unwrap_or(Color::BLACK));
        map.stroke_path(&path, &paint, &Stroke { width: 2.0, ..Stroke::default() }, Transform::identity(), None);
    }
    let channels = |p: &tiny_skia::PremultipliedColorU8| [p.red(), p.green(), p.blue(), p.alpha()].map(|c| f32::from(c) / 255.0);
    Picture::from_pixels(SIDE, SIDE, map.pixels().iter().map(channels).collect())?.save(out, Depth::Eight)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "polygons.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
