//! A scene file from code: read it, override keys of it, and see what the renderer did not have to do.
//!
//! ```sh
//! cargo run --release --example scene_file -- scene.png [SCENE.toml]
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Overrides, SceneFile};
use slicestack::{LeftOut, Renderer, Result, Settings};
use std::path::{Path, PathBuf};

const SCENE: &str = r#"
[volume]
phantom = "cloud"
size = 96

[camera]
azimuth = 60

[image]
background = [0.36, 0.55, 0.80, 1]
"#;

pub(crate) fn run(out: &Path, file: Option<&Path>) -> Result<()> {
    // What a flag of the command does: these win over the file's keys.
    let mut overrides = Overrides::default();
    overrides.set("image.width", "320");
    overrides.set("image.height", "320");
    let file = match file {
        Some(path) => SceneFile::read(path, &overrides)?,
        None => SceneFile::parse(SCENE, ".", &overrides)?,
    };

    // A file names its volume; presets and the camera's defaults need the volume itself.
    let settings = Settings::default();
    let volume = file.volume().load(&settings.limits)?;
    let (scene, warnings) = file.to_scene(&volume)?;
    let (picture, stats) = Renderer::new(&volume, settings).render(&scene)?;
    picture.save(out, Depth::Eight)?;

    for line in warnings.iter().chain(&stats.warnings) {
        println!("warning: {line}");
    }
    for LeftOut { what, why, .. } in &stats.left_out {
        println!("left out: {what}: {why}");
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let out = arguments.next().map_or_else(|| "scene.png".into(), PathBuf::from);
    run(&out, arguments.next().map(PathBuf::from).as_deref())
}
