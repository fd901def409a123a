//! Any scene of all keys: pixels are finite, in their range and premultiplied.

use super::scenes;
use slicestack::Settings;
use slicestack::scene::{FogWeighting, SlabForm};

pub fn run(bytes: &[u8]) {
    let Some((volume, scene, _)) = scenes::drawn(bytes) else { return };
    let Some(picture) = scenes::rendered(&volume, &scene, Settings::new().threads(1)) else { return };
    // OpenGL's framebuffer holds what its states make of it, Riemann's slabs leave the range, and literal fog lights up nothing.
    let literal = scene.fog().is_some_and(|fog| fog.weighting() == FogWeighting::Literal);
    let bounded = scene.opengl().is_none() && scene.method().slab != SlabForm::Riemann && !literal;
    for (i, &[r, g, b, a]) in picture.pixels().iter().enumerate() {
        assert!([r, g, b, a].iter().all(|x| x.is_finite()), "pixel {i}: {r} {g} {b} {a}");
        let is_premultiplied = (0.0..=1.0).contains(&a) && [r, g, b].iter().all(|c| (0.0..=a + 1e-5).contains(c));
        assert!(!bounded || is_premultiplied, "pixel {i}: {r} {g} {b} {a}");
    }
}
