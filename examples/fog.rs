//! Fog: OpenGL's three modes, as depth cue. Its distances are world units from the eye.
//!
//! ```sh
//! cargo run --release --example fog -- FOLDER      # fog-none.png, fog-linear.png, fog-exp.png, fog-exp2.png
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Camera, Fog, FogMode, Placement, Projection, Straight};
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Result, Scene, Settings};
use std::path::{Path, PathBuf};

pub(crate) fn run(folder: &Path) -> Result<()> {
    let volume = Phantom::DistanceField.volume(96)?;
    let color = [0.75, 0.78, 0.82];
    let camera =
        Camera::new(Placement::Orbit { azimuth: 30.0, elevation: 25.0, roll: 0.0, zoom: 1.7 }, Projection::Perspective { fov_y: 30.0 })?;
    let scene = Scene::new(Phantom::DistanceField.default_transfer(96))
        .with_camera(camera)
        .with_size(384, 384)?
        // The fog's own colour behind the volume, so that what is far away fades into it.
        .with_background(Straight { rgb: color, alpha: 1.0 })?;

    // How far away the box begins and ends: the eye's distance to its centre, less and more its radius.
    let grid = volume.grid();
    let distance = camera.resolve(grid, 384, 384)?.eye.distance(grid.center());
    let (near, far) = (distance - grid.radius(), distance + grid.radius());
    let modes = [
        ("none", None),
        ("linear", Some(FogMode::Linear { start: near, end: far })),
        // e^-1 = 37 % of the colour is left at the box's centre.
        ("exp", Some(FogMode::Exp { density: 1.0 / distance })),
        // The square keeps the foreground clearer and closes faster behind.
        ("exp2", Some(FogMode::Exp2 { density: 1.0 / distance })),
    ];

    // One renderer: bricks and tables are made once, each picture costs a frame only.
    let mut renderer = Renderer::new(&volume, Settings::default());
    for (name, mode) in modes {
        let fog = mode.map(|mode| Fog::new(mode, color)).transpose()?;
        let (picture, _) = renderer.render(&scene.clone().with_fog(fog))?;
        picture.save(folder.join(format!("fog-{name}.png")), Depth::Eight)?;
    }
    Ok(())
}

fn main() -> Result<()> {
    run(&std::env::args_os().nth(1).map_or_else(|| ".".into(), PathBuf::from))
}
