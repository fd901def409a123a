//! Lesson 6, fog: on premultiplied colours the fog's part is weighted by the opacity, or empty slices light up.
//!
//! ```sh
//! cargo run --release --example lesson_6_fog -- fog.png
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Camera, Fog, FogMode, FogWeighting, Slicing, Straight};
use slicestack::volume::phantom::Phantom;
use slicestack::{Picture, Renderer, Result, Scene, Settings};
use std::path::{Path, PathBuf};

const SIDE: u32 = 200;

pub(crate) fn run(out: &Path) -> Result<()> {
    let volume = Phantom::DistanceField.volume(64)?;
    let scene = Scene::new(Phantom::DistanceField.default_transfer(64))
        .with_camera(Camera::orbit(30.0, 25.0)?)
        .with_slices(Slicing::Count(128))?
        .with_background(Straight { rgb: [0.05, 0.05, 0.08], alpha: 1.0 })?
        .with_size(SIDE, SIDE)?;
    let view = scene.camera().resolve(volume.grid(), SIDE, SIDE)?;
    let middle = view.depth(volume.grid().center());
    let (start, end) = (middle - 0.7 * volume.grid().radius(), middle + 0.9 * volume.grid().radius());

    // Linear fog is (end - z) / (end - start): 1 where it starts, 0 where it ends. (1 - z is right for 0 and 1 alone.)
    let fog = Fog::new(FogMode::Linear { start, end }, [0.55, 0.65, 0.8])?;
    for z in [start, middle, end] {
        println!("z = {z:6.1}: f = {:.3}", fog.factor(z));
    }

    // Two fragments of one colour in the middle: one that shows, and one of opacity 0.
    let f = fog.factor(middle);
    for alpha in [0.5, 0.0] {
        let fragment = Straight { rgb: [1.0, 0.6, 0.2], alpha }.premultiply();
        let weighted = [0, 1, 2].map(|c| f * fragment.rgb[c] + (1.0 - f) * alpha * fog.color()[c]);
        let literal = [0, 1, 2].map(|c| f * fragment.rgb[c] + (1.0 - f) * fog.color()[c]);
        println!("A = {alpha}: f C + (1 - f) A c_fog = {weighted:.3?}; without the A: {literal:.3?}");
    }

    // The same scene in no fog, weighted fog and literal fog, side by side.
    let mut renderer = Renderer::new(&volume, Settings::default());
    let mut pictures = Vec::new();
    for fog in [None, Some(fog), Some(fog.with_weighting(FogWeighting::Literal))] {
        pictures.push(renderer.render(&scene.clone().with_fog(fog))?.0);
    }
    let pixel = |n: u32| pictures[(n % (3 * SIDE) / SIDE) as usize].pixel(n % SIDE, n / (3 * SIDE));
    Picture::from_pixels(3 * SIDE, SIDE, (0..3 * SIDE * SIDE).map(pixel).collect())?.save(out, Depth::Eight)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "fog.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
