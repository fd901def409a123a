//! Frames into the caller's pixels take no memory of a picture's size. Alone in its process: it measures the whole of it.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod peak;

use peak::peak;
use slicestack::scene::{Scene, Slicing};
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Settings};

#[test]
fn frames_into_the_same_pixels_take_no_picture_of_their_own() {
    const SIDE: u32 = 2048;
    const PICTURE: u64 = 16 * (SIDE as u64) * (SIDE as u64);
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(32)).with_size(SIDE, SIDE).unwrap();
    let scene = scene.with_slices(Slicing::Count(24)).unwrap();
    let mut renderer = Renderer::new(Phantom::SheppLogan.volume(32).unwrap(), Settings::default());
    let mut pixels = vec![[0.0; 4]; SIDE as usize * SIDE as usize];
    renderer.render_into(&scene, &mut pixels).unwrap();
    let first = peak();
    renderer.render_into(&scene, &mut pixels).unwrap();
    let again = peak() - first;
    assert!(again < PICTURE / 16, "{again} bytes for a second frame");
    // Coarse passes keep a quarter of the pixels once.
    renderer.render_progressive(&scene, &mut pixels, |_, _| true).unwrap();
    let passes = peak() - first;
    assert!(passes < PICTURE / 4 + PICTURE / 16, "{passes} bytes for passes of a picture of {PICTURE}");
    let second = peak();
    for _ in 0..3 {
        renderer.render_progressive(&scene, &mut pixels, |_, _| true).unwrap();
    }
    let more = peak() - second;
    assert!(more < PICTURE / 16, "{more} bytes for three more pictures");
    assert!(pixels[SIDE as usize * (SIDE as usize / 2) + SIDE as usize / 2][3] > 0.1);
}
