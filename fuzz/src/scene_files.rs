//! Any text as a scene file: read and resolved, or refused in one line.

use super::check_line;
use slicestack::Volume;
use slicestack::scene::{Overrides, SceneFile};
use slicestack::volume::phantom::Phantom;
use std::sync::OnceLock;

fn volume() -> &'static Volume {
    static VOLUME: OnceLock<Volume> = OnceLock::new();
    VOLUME.get_or_init(|| Phantom::Cloud.volume(8).expect("a built-in volume"))
}

pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let resolved = SceneFile::parse(text, "/nowhere", &Overrides::default()).and_then(|file| file.resolve(volume()));
    if let Err(error) = resolved {
        check_line(&error);
    }
}
