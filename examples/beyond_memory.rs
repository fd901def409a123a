//! Volumes larger than memory: writes them, and measures pictures of them.
//!
//! ```text
//! cargo run --release --example beyond_memory -- body 2048 body.nrrd         8 GiB of voxels: a body of shells, ripples and noise
//! cargo run --release --example beyond_memory -- sparse 4096 sparse.nrrd     64 GiB, of which the file holds a hundredth: balls in a hole
//! cargo run --release --example beyond_memory -- measure 1GiB 512 FILE       one row of the table in docs/beyond-memory.md
//! ```
//! `slicestack convert body.nrrd body.ome.zarr` makes the levels of detail.

use slicestack::paged::PagedRenderer;
use slicestack::scene::{Camera, Slicing, TransferFunction};
use slicestack::volume::io::{Reading, read_levels};
use slicestack::{Limits, Scene, Settings};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};

type Anything = Box<dyn std::error::Error>;

fn header(n: u64) -> String {
    format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {n} {n} {n}\nencoding: raw\nspacings: 1 1 1\n\n")
}

/// Each number becomes the mean of those around it.
fn smoothed(values: &[f64], reach: usize) -> Vec<f64> {
    let around = |i: usize| &values[i.saturating_sub(reach)..(i + reach + 1).min(values.len())];
    (0..values.len()).map(|i| around(i).iter().sum::<f64>() / around(i).len() as f64).collect()
}

/// Shells around a core, as smooth as a scanner leaves them, finer ripples on them, and noise of three steps.
fn body(n: usize, path: &str) -> Result<(), Anything> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    out.write_all(header(n as u64).as_bytes())?;
    let square = |i: usize| {
        let t = (2 * i + 1) as f64 / n as f64 - 1.0;
        (t * t * 4096.0) as usize
    };
    let squares: Vec<usize> = (0..n).map(square).collect();
    // By the distance from the middle, squared: 4096 is the face of the box.
    let sharp: Vec<f64> = (0..=3 * 4096)
        .map(|r| match r {
            0..600 => 200.0 - f64::from(r) / 12.0,
            600..1500 => 60.0,
            1500..1900 => 150.0,
            1900..3000 => 70.0,
            3000..3200 => 110.0,
            _ => 8.0,
        })
        .collect();
    let shells: Vec<u8> = smoothed(&smoothed(&sharp, 18), 18).into_iter().map(|v| v as u8).collect();
    let ripples: Vec<u8> = (0..256).map(|i: i32| (12 - (i % 128 - 64).abs() * 12 / 64) as u8).collect();
    let step = (8 * 256 / n).max(1);
    let mut row = vec![0u8; n];
    for z in 0..n {
        for y in 0..n {
            let (far, wave) = (squares[z] + squares[y], (z + 2 * y) * step);
            let mut noise = (z * n + y) as u32;
            for (x, v) in row.iter_mut().enumerate() {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *v = shells[far + squares[x]] + ripples[(wave + x * step) & 255] + (noise >> 30) as u8;
            }
            out.write_all(&row)?;
        }
    }
    Ok(out.flush()?)
}

/// Balls, each in a block of its own; everything else is a hole in the file.
fn sparse(n: u64, path: &str) -> Result<(), Anything> {
    const SIDE: u64 = 256;
    let mut file = File::create(path)?;
    let text = header(n);
    file.write_all(text.as_bytes())?;
    file.set_len(text.len() as u64 + n * n * n)?;
    for ball in 0..40u64 {
        let place = |axis: u64| (ball.wrapping_mul(2_654_435_761) >> (9 + 6 * axis)) % (n / SIDE) * SIDE;
        let (x0, y0, z0) = (place(0), place(1), place(2));
        for z in 0..SIDE {
            for y in 0..SIDE {
                let value = |x: u64| {
                    let d = [x, y, z].map(|v| v as f64 - 0.5 * SIDE as f64).iter().map(|d| d * d).sum::<f64>().sqrt();
                    (255.0 - 2.0 * d).clamp(0.0, 255.0) as u8
                };
                let row: Vec<u8> = (0..SIDE).map(value).collect();
                file.seek(SeekFrom::Start(text.len() as u64 + ((z0 + z) * n + y0 + y) * n + x0))?;
                file.write_all(&row)?;
            }
        }
    }
    Ok(())
}

/// Most bytes that this process has had in memory at a time, where the system tells.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
}

fn measure(memory: &str, size: u32, path: &str) -> Result<(), Anything> {
    let (number, unit) = memory.split_at(memory.find(|c: char| !c.is_ascii_digit()).unwrap_or(memory.len()));
    let unit = match unit {
        "GiB" => 1 << 30,
        "MiB" => 1 << 20,
        _ => return Err("write a size such as 1GiB or 256MiB".into()),
    };
    let memory = number.parse::<u64>()? * unit;
    let levels = read_levels(path, &Reading::new().limits(Limits::within(memory)))?;
    let gib = levels.bytes() as f64 / f64::from(1 << 30);
    let transfer = TransferFunction::new(
        vec![(20.0, [0.2, 0.4, 0.9]), (110.0, [0.9, 0.7, 0.5]), (160.0, [1.0, 0.95, 0.85]), (220.0, [0.9, 0.2, 0.1])],
        vec![(85.0, 0.0), (110.0, 0.002), (130.0, 0.001), (150.0, 0.02), (220.0, 0.03)],
    )?;
    let scene = Scene::new(transfer).with_size(size, size)?.with_camera(Camera::orbit(35.0, 25.0)?);
    let scene = scene.with_slices(Slicing::Tolerance(1.0 / 256.0))?;
    let mut renderer = PagedRenderer::new(levels, Settings::default(), memory);
    let (_, first, _) = renderer.render(&scene)?;
    let (picture, stats, pages) = renderer.render(&scene)?;
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    println!(
        "| {path} | {gib:.1} GiB | {size} x {size} | {:.2} s | {:.2} s | {} | {:?} | {:.0} MiB | {:.0} MiB | {:.4} | {} |",
        first.render_seconds,
        stats.render_seconds,
        stats.slices,
        pages.pieces,
        mib(pages.bytes_read),
        peak().map_or(f64::NAN, mib),
        stats.error_estimate.unwrap_or(0.0),
        &picture.sha256()[..8]
    );
    picture.save(format!("{path}.{size}.png"), slicestack::Depth::Eight)?;
    Ok(())
}

fn main() -> Result<(), Anything> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["body", n, path] => body(n.parse()?, path),
        ["sparse", n, path] => sparse(n.parse()?, path),
        ["measure", memory, size, path] => measure(memory, size.parse()?, path),
        _ => Err("give body N FILE, sparse N FILE, or measure SIZE PIXELS FILE".into()),
    }
}
