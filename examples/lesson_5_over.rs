//! Lesson 5, over: slabs are blended front to back or back to front, and both are the same sum.
//!
//! ```sh
//! cargo run --release --example lesson_5_over -- over.png
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Premultiplied, Straight};
use slicestack::{Picture, Result};
use std::path::{Path, PathBuf};

const SIDE: u32 = 40;

/// What has been gathered, and the transmittance that is left: kept as such, never as 1 - opacity.
type Gathered = ([f64; 3], f64);

fn front_to_back((sum, t): Gathered, slab: &Premultiplied) -> Gathered {
    ([0, 1, 2].map(|c| sum[c] + t * slab.rgb[c]), t * (1.0 - slab.alpha))
}

fn back_to_front((sum, t): Gathered, slab: &Premultiplied) -> Gathered {
    ([0, 1, 2].map(|c| slab.rgb[c] + (1.0 - slab.alpha) * sum[c]), t * (1.0 - slab.alpha))
}

pub(crate) fn run(out: &Path) -> Result<()> {
    // Nearest first: thin glasses of red, green and blue, thicker and thicker.
    let glass =
        |k: usize| Straight { rgb: [0, 1, 2].map(|c| if c == k % 3 { 1.0 } else { 0.15 }), alpha: 0.1 + 0.05 * k as f64 }.premultiply();
    let slabs: Vec<Premultiplied> = (0..9).map(glass).collect();
    let start = ([0.0; 3], 1.0);
    let front = slabs.iter().fold(start, front_to_back);
    let back = slabs.iter().rev().fold(start, back_to_front);
    let before = |k: usize| slabs[..k].iter().map(|s| 1.0 - s.alpha).product::<f64>();
    let closed = [0, 1, 2].map(|c| (0..slabs.len()).map(|k| slabs[k].rgb[c] * before(k)).sum::<f64>());
    println!("front to back {:.6?}, T = {:.6}", front.0, front.1);
    println!("back to front {:.6?}, T = {:.6}", back.0, back.1);
    println!("closed sum    {closed:.6?}, T = {:.6}", before(slabs.len()));
    for n in [1, 4, 16] {
        let opacity = 1.0 - (0..n).map(|_| 1.0 - 0.25f64).product::<f64>();
        println!("{n} slabs of opacity 0.25: {opacity:.4} = 1 - 0.75^{n}, not {}", 0.25 * f64::from(n));
    }
    if let Some(k) = (0..=slabs.len()).find(|&k| before(k) < 0.2) {
        println!("for an error below 0.2, {k} slabs of {} are enough: early termination", slabs.len());
    }

    // A square for each slab: alone, gathered so far from the front, gathered so far from the back; over white.
    let over_white = |(sum, t): Gathered| [sum[0] + t, sum[1] + t, sum[2] + t, 1.0].map(|x| x as f32);
    let pixel = |n: u32| {
        let (x, y) = (n % (9 * SIDE), n / (9 * SIDE));
        let k = (x / SIDE) as usize;
        match y / SIDE {
            0 => over_white(front_to_back(start, &slabs[k])),
            1 => over_white(slabs[..=k].iter().fold(start, front_to_back)),
            _ => over_white(slabs[k..].iter().rev().fold(start, back_to_front)),
        }
    };
    Picture::from_pixels(9 * SIDE, 3 * SIDE, (0..27 * SIDE * SIDE).map(pixel).collect())?.save(out, Depth::Eight)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "over.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
