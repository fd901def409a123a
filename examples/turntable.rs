//! A turntable: one renderer kept between frames, so that only the first pays for what depends on the volume.
//!
//! ```sh
//! cargo run --release --example turntable -- FOLDER 36      # frame-000.png to frame-035.png
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Camera, Placement, Projection};
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Result, Scene, Settings};
use std::path::{Path, PathBuf};

pub(crate) fn run(folder: &Path, frames: u32) -> Result<()> {
    let volume = Phantom::DistanceField.volume(96)?;
    let scene = Scene::new(Phantom::DistanceField.default_transfer(96)).with_size(320, 320)?;
    // A height given once: every frame has the same scale, whatever the box looks like from there.
    let projection = Projection::Orthographic { height: Some(1.5 * volume.grid().radius()) };

    let mut renderer = Renderer::new(&volume, Settings::default());
    for frame in 0..frames {
        let azimuth = 360.0 * f64::from(frame) / f64::from(frames);
        let camera = Camera::new(Placement::Orbit { azimuth, elevation: 20.0, roll: 0.0, zoom: 1.0 }, projection)?;
        let (picture, stats) = renderer.render(&scene.clone().with_camera(camera))?;
        let path = folder.join(format!("frame-{frame:03}.png"));
        picture.save(&path, Depth::Eight)?;
        println!("{}: prepared {:.4} s, rendered {:.4} s", path.display(), stats.prepare_seconds, stats.render_seconds);
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map_or_else(std::env::temp_dir, PathBuf::from);
    let frames = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(12);
    run(&folder, frames)
}
