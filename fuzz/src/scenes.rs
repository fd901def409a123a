//! Small scenes drawn from bytes.

use super::random::{Draw, document};
use slicestack::scene::{Overrides, SceneFile, Slicing, schema};
use slicestack::{Limits, Picture, Renderer, Scene, Settings, Volume};
use std::sync::OnceLock;

/// A volume and a scene of it, told where the environment has `SLICESTACK_FUZZ_SHOW`; `None` where the scene is refused, or large.
pub(crate) fn drawn(bytes: &[u8]) -> Option<(Volume, Scene, Draw<'_>)> {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    let mut draw = Draw::of_bytes(bytes);
    let text = document(SCHEMA.get_or_init(schema), &mut draw).to_string();
    if std::env::var_os("SLICESTACK_FUZZ_SHOW").is_some() {
        eprintln!("{text}");
    }
    let file = SceneFile::parse(&text, "", &Overrides::default()).ok()?;
    let volume = file.volume().load(&Limits::default()).ok()?;
    let (scene, _) = file.to_scene(&volume).ok()?;
    let (width, height) = scene.size();
    let large = width * height > 40 * 40 || matches!(scene.slicing(), Slicing::Count(n) if n > 4096);
    (!large).then_some((volume, scene, draw))
}

/// The picture, unless the scene cannot be rendered so.
#[allow(dead_code)]
pub(crate) fn rendered(volume: &Volume, scene: &Scene, settings: Settings) -> Option<Picture> {
    Renderer::new(volume, settings).render(scene).ok().map(|done| done.0)
}
