//! Pictures with alpha as layers: composed exactly as they are stored.
#![cfg(all(feature = "scene-file", feature = "stacks"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::picture::Picture;
use slicestack::scene::{Overrides, SceneFile};
use slicestack::{Limits, Renderer, Settings};
use std::path::Path;

const SIZE: (u32, u32) = (13, 7);

/// Straight 8-bit colour of a pixel of layer `n`.
fn stored(n: u32, x: u32, y: u32) -> [u8; 4] {
    let number = |c: u32| ((n * 977 + x * 131 + y * 61 + c * 37).wrapping_mul(2_654_435_761) >> 24) as u8;
    let alpha = match number(3) {
        0..60 => 0,
        200.. => 255,
        other => other,
    };
    [number(0), number(1), number(2), alpha]
}

fn write(folder: &Path, n: u32) {
    let bytes: Vec<u8> = (0..SIZE.0 * SIZE.1).flat_map(|i| stored(n, i % SIZE.0, i / SIZE.0)).collect();
    image::save_buffer(folder.join(format!("{n}.png")), &bytes, SIZE.0, SIZE.1, image::ColorType::Rgba8).unwrap();
}

fn rendered(folder: &Path, text: &str) -> slicestack::Result<Picture> {
    let file = SceneFile::parse(text, folder, &Overrides::default())?;
    let volume = file.volume().load(&Limits::default())?;
    let (scene, _) = file.to_scene(&volume)?;
    Ok(Renderer::new(&volume, Settings::default()).render(&scene)?.0)
}

#[test]
fn layers_are_the_closed_sum_of_what_is_stored() {
    let dir = tempfile::tempdir().unwrap();
    // Ten of them: their numbers are sorted as numbers.
    (1..=10).for_each(|n| write(dir.path(), n));
    let picture = rendered(dir.path(), "[volume]\nlayers = \"*.png\"\nspacing = [1, 1, 7.5]\n").unwrap();
    assert_eq!((picture.width(), picture.height()), SIZE);
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            // The sum over k of C_k alpha_k times the product over j < k of (1 - alpha_j), term by term.
            let layer = |n: u32| {
                let [r, g, b, a] = stored(n, x, y).map(|c| f64::from(c) / 255.0);
                ([r, g, b], a)
            };
            let through = |n: u32| (1..n).map(|j| 1.0 - layer(j).1).product::<f64>();
            let sum = |c: usize| (1..=10).map(|n| layer(n).0[c] * layer(n).1 * through(n)).sum::<f64>();
            let found = picture.pixels()[(y * SIZE.0 + x) as usize];
            for c in 0..3 {
                assert!((f64::from(found[c]) - sum(c)).abs() < 1e-6, "({x},{y}) {c}: {} and {}", found[c], sum(c));
            }
            assert!((f64::from(found[3]) - (1.0 - through(11))).abs() < 1e-6, "({x},{y}): opacity {}", found[3]);
        }
    }
}

#[test]
fn what_are_no_layers_is_refused_in_a_line() {
    let dir = tempfile::tempdir().unwrap();
    for n in 0..2 {
        image::save_buffer(dir.path().join(format!("{n}.png")), &[90; 12], 2, 2, image::ColorType::Rgb8).unwrap();
    }
    let line = rendered(dir.path(), "[volume]\nlayers = \"*.png\"\n").unwrap_err().to_string();
    assert!(!line.contains('\n') && line.contains("alpha"), "{line}");
    // Another view is none of an axis.
    let line = rendered(dir.path(), "[volume]\nlayers = \"*.png\"\n[camera]\nazimuth = 30\n").unwrap_err().to_string();
    assert!(line.contains("camera: layers are drawn along an axis"), "{line}");
    let line = rendered(dir.path(), "[volume]\nlayers = \"*.png\"\npath = \"a.nrrd\"\n").unwrap_err().to_string();
    assert!(line.contains("volume.path") && line.contains("one volume"), "{line}");
}

#[test]
fn layers_given_beside_a_scene_take_the_place_of_its_volume() {
    let dir = tempfile::tempdir().unwrap();
    (1..=3).for_each(|n| write(dir.path(), n));
    let said = rendered(dir.path(), "[volume]\nlayers = \"*.png\"\n").unwrap();
    let mut overrides = Overrides::default();
    overrides.set("volume.layers", dir.path().join("*.png").to_str().unwrap());
    let file = SceneFile::parse("[volume]\nphantom = \"cloud\"\nsize = 9\n", "", &overrides).unwrap();
    let volume = file.volume().load(&Limits::default()).unwrap();
    let (scene, _) = file.to_scene(&volume).unwrap();
    let (picture, _) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
    assert_eq!(picture.sha256(), said.sha256());
}
