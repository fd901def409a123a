//! Any scene of all keys: pixels are finite, in their range and premultiplied.

use super::scenes;
use slicestack::Settings;

pub fn run(bytes: &[u8]) {
    let Some((volume, scene, _)) = scenes::drawn(bytes) else { return };
    let Some(picture) = scenes::rendered(&volume, &scene, Settings::new().threads(1)) else { return };
    for (i, &[r, g, b, a]) in picture.pixels().iter().enumerate() {
        assert!([r, g, b, a].iter().all(|x| x.is_finite()), "pixel {i}: {r} {g} {b} {a}");
        let is_premultiplied = (0.0..=1.0).contains(&a) && [r, g, b].iter().all(|c| (0.0..=a + 1e-6).contains(c));
        assert!(scene.opengl().is_some() || is_premultiplied, "pixel {i}: {r} {g} {b} {a}");
    }
}
