//! Lesson 4, transfer function: an opacity belongs to a length, so a slab's opacity is 1 - (1 - a)^(thickness / length).
//!
//! ```sh
//! cargo run --release --example lesson_4_transfer_function -- opacity.png
//! ```

use slicestack::picture::Depth;
use slicestack::scene::TransferFunction;
use slicestack::{Picture, Result};
use std::path::{Path, PathBuf};

const WIDTH: u32 = 384;
const ROW: u32 = 48;
/// Thickness of the material at the right end, in reference lengths.
const THICKEST: f64 = 5.0;

pub(crate) fn run(out: &Path) -> Result<()> {
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.2, 0.9]), (100.0, [1.0, 0.5, 0.1])], vec![(20.0, 0.0), (100.0, 0.5)])?;
    for value in [20.0, 60.0, 100.0] {
        let straight = transfer.eval(value);
        println!(
            "value {value}: straight {:.2?}, a = {:.2}, premultiplied {:.3?}",
            straight.rgb,
            straight.alpha,
            straight.premultiply().rgb
        );
    }

    let material = transfer.eval(100.0);
    let a = material.alpha;
    let half = 1.0 - (1.0 - a).sqrt();
    println!("a slab of half the length: 1 - sqrt(1 - a) = {half:.4}, not a / 2 = {:.4}", a / 2.0);
    // How thick one slab is, and its opacity: the first two rows agree, the others do not.
    let rows = [
        ("slabs of one length, a", 1.0, a),
        ("slabs of half a length, 1 - sqrt(1 - a)", 0.5, half),
        ("slabs of half a length, a", 0.5, a),
        ("slabs of half a length, a / 2", 0.5, a / 2.0),
    ];
    let seen = |thickness: f64, slab: f64, opacity: f64| 1.0 - (1.0 - opacity).powf(thickness / slab);
    for (name, slab, opacity) in rows {
        println!("{name:40} 4 lengths of it: {:.4}", seen(4.0, slab, opacity));
    }

    // The material grows thicker from left to right, over a chequered ground.
    let pixel = |n: u32| {
        let (x, y) = (n % WIDTH, n / WIDTH);
        let (_, slab, opacity) = rows[(y / ROW) as usize];
        let alpha = seen(THICKEST * f64::from(x) / f64::from(WIDTH), slab, opacity);
        let ground = match () {
            () if y % ROW < 3 => return [1.0; 4],
            () if (x / 8 + y / 8) % 2 == 0 => 0.9,
            () => 0.6,
        };
        let [r, g, b] = material.rgb.map(|c| (c * alpha + (1.0 - alpha) * ground) as f32);
        [r, g, b, 1.0]
    };
    let height = ROW * rows.len() as u32;
    Picture::from_pixels(WIDTH, height, (0..WIDTH * height).map(pixel).collect())?.save(out, Depth::Eight)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "opacity.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
