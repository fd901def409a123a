//! Lesson 3, fetch: a texture coordinate becomes an index, the index a cell and weights, and eight voxels become one value.
//!
//! ```sh
//! cargo run --release --example lesson_3_fetch -- fetch.png
//! ```

use glam::DVec3;
use slicestack::picture::Depth;
use slicestack::volume::phantom::Phantom;
use slicestack::{Picture, Result};
use std::path::{Path, PathBuf};

const SIZE: usize = 8;
/// Side of each of the two pictures in pixels.
const SIDE: u32 = 192;

pub(crate) fn run(out: &Path) -> Result<()> {
    let volume = Phantom::MarschnerLobb.volume(SIZE)?;

    // Voxel centres lie at whole numbers: u = s n - 1/2. Round down, not towards zero, or s < 1/2n would read from the wrong side.
    for s in [0.02, 0.40, 0.98] {
        let u: f64 = s * SIZE as f64 - 0.5;
        println!("s = {s:.2}: u = {u:+.2}, cell {}, weight {:.2} (truncated: {})", u.floor(), u - u.floor(), u.trunc());
    }

    let at = DVec3::new(2.30, 4.65, 3.75);
    let cell = at.floor();
    let w = at - cell;
    let [i, j, k] = cell.to_array().map(|c| c as usize);
    let v = |c: usize| volume.value([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]);
    println!("index {at}: cell {cell}, weights {w:.2}");
    for c in 0..8 {
        let part = |axis: usize| if c >> axis & 1 == 1 { w[axis] } else { 1.0 - w[axis] };
        println!("  voxel {} {} {}: {:.4} x {:.4}", i + (c & 1), j + (c >> 1 & 1), k + (c >> 2), v(c), part(0) * part(1) * part(2));
    }
    let lerp = |a: f64, b: f64, t: f64| a + t * (b - a);
    let x = [lerp(v(0), v(1), w.x), lerp(v(2), v(3), w.x), lerp(v(4), v(5), w.x), lerp(v(6), v(7), w.x)];
    let y = [lerp(x[0], x[1], w.y), lerp(x[2], x[3], w.y)];
    let z = lerp(y[0], y[1], w.z);
    println!("along x: {x:.4?}\nalong y: {y:.4?}\nalong z: {z:.4}; the library finds {:.4}", volume.sample(at));

    // A plane through the volume: the nearest voxel on the left, all eight on the right.
    let pixel = |n: u32| {
        let (column, row) = (n % (2 * SIDE), n / (2 * SIDE));
        let index = |p: u32| (f64::from(p) + 0.5) / f64::from(SIDE) * SIZE as f64 - 0.5;
        let at = DVec3::new(index(column % SIDE), index(row), 3.5);
        let value = if column < SIDE { volume.sample((at + 0.5).floor()) } else { volume.sample(at) } as f32;
        [value, value, value, 1.0]
    };
    Picture::from_pixels(2 * SIDE, SIDE, (0..2 * SIDE * SIDE).map(pixel).collect())?.save(out, Depth::Eight)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "fetch.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
