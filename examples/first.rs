//! The smallest render: a volume, a scene, a picture.
//!
//! ```sh
//! cargo run --release --example first -- first.png
//! ```

use slicestack::Scene;
use slicestack::picture::Depth;
use slicestack::volume::phantom::Phantom;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> slicestack::Result<()> {
    // For a file: `Volume::open("head.nrrd")?`.
    let volume = Phantom::Hydrogen.volume(96)?;
    // 512 x 512 pixels, 256 slices, a three-quarter view: everything has a default but the transfer function.
    let scene = Scene::new(Phantom::Hydrogen.default_transfer(96));
    let picture = slicestack::render(&volume, &scene)?;
    picture.save(out, Depth::Eight)
}

fn main() -> slicestack::Result<()> {
    run(&std::env::args_os().nth(1).map_or_else(|| "first.png".into(), PathBuf::from))
}
