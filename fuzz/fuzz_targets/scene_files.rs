//! Any text as a scene file: read and resolved, or refused in one line.
#![no_main]

use libfuzzer_sys::fuzz_target;
use slicestack::scene::{Overrides, SceneFile};
use slicestack::volume::phantom::Phantom;
use slicestack::Volume;
use std::sync::OnceLock;

fn volume() -> &'static Volume {
    static VOLUME: OnceLock<Volume> = OnceLock::new();
    VOLUME.get_or_init(|| Phantom::Cloud.volume(8).expect("a built-in volume"))
}

fuzz_target!(|text: &str| {
    let resolved = SceneFile::parse(text, "/nowhere", &Overrides::default()).and_then(|file| file.resolve(volume()));
    if let Err(error) = resolved {
        let text = error.to_string();
        assert!(!text.is_empty() && !text.contains('\n'), "{text:?}");
    }
});
