//! A renderer's ways to a picture: into memory of the caller's, coarse and then finer, as a layer, stopped.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::scene::{Blend, ClipPlane, Fog, FogMode, Method, OpenGl, Order, Slicing, Straight};
use slicestack::volume::phantom::Phantom;
use slicestack::{Error, Renderer, Scene, Settings, Volume, render};
use std::sync::Arc;

fn head(size: usize) -> Volume {
    Phantom::SheppLogan.volume(size).unwrap()
}

fn scene() -> Scene {
    let background = Straight { rgb: [0.3, 0.5, 0.1], alpha: 0.7 };
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(75, 61).unwrap();
    scene.with_slices(Slicing::Count(120)).unwrap().with_background(background).unwrap()
}

fn bits(pixels: &[[f32; 4]]) -> Vec<u32> {
    pixels.iter().flatten().map(|c| c.to_bits()).collect()
}

#[test]
fn a_callers_memory_gets_the_same_bytes_again_and_again() {
    let volume = Arc::new(head(24));
    let mut renderer = Renderer::new(Arc::clone(&volume), Settings::default());
    let want = render(&volume, &scene()).unwrap();
    let mut pixels = vec![[9.0; 4]; 75 * 61];
    for _ in 0..3 {
        let stats = renderer.render_into(&scene(), &mut pixels).unwrap();
        assert_eq!(stats.slices, 120);
        assert_eq!(bits(&pixels), bits(want.pixels()));
    }
    let said = renderer.render_into(&scene(), &mut pixels[1..]).unwrap_err().to_string();
    assert_eq!(said, "4574 pixels given for a picture of 75 x 61");
    // The renderer lives on without the volume's first owner.
    drop(volume);
    assert_eq!(renderer.render(&scene()).unwrap().0, want);
}

#[test]
fn passes_grow_finer_and_the_last_is_the_picture() {
    let mut renderer = Renderer::new(head(24), Settings::default());
    let want = renderer.render(&scene()).unwrap().0;
    let error = |pixels: &[[f32; 4]]| pixels.iter().zip(want.pixels()).map(|(a, b)| (a[3] - b[3]).abs()).sum::<f32>();
    let mut pixels = vec![[0.0; 4]; 75 * 61];
    let mut seen = Vec::new();
    renderer
        .render_progressive(&scene(), &mut pixels, |pass, pixels| {
            seen.push((pass.square, pass.last, error(pixels)));
            true
        })
        .unwrap();
    assert_eq!(bits(&pixels), bits(want.pixels()));
    assert_eq!(seen.iter().map(|s| (s.0, s.1)).collect::<Vec<_>>(), [(4, false), (2, false), (1, true)]);
    assert!(seen[0].2 > seen[1].2 && seen[1].2 > 0.0 && seen[2].2 == 0.0, "{seen:?}");
    let stopped = renderer.render_progressive(&scene(), &mut pixels, |pass, _| pass.square > 2);
    assert!(matches!(stopped, Err(Error::Stopped)));
    for other in [scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), scene().with_opengl(OpenGl::default()).unwrap()] {
        let want = renderer.render(&other).unwrap().0;
        renderer.render_progressive(&other, &mut pixels, |_, _| true).unwrap();
        assert_eq!(bits(&pixels), bits(want.pixels()));
    }
}

#[test]
fn a_picture_in_the_making_is_stopped() {
    let mut renderer = Renderer::new(head(48), Settings::default());
    let slow = scene().with_slices(Slicing::Count(1 << 20)).unwrap().with_terminate(0.0).unwrap();
    let stopper = renderer.stopper();
    let asked = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(300));
        stopper.stop();
        std::time::Instant::now()
    });
    let found = renderer.render(&slow);
    let ended = std::time::Instant::now();
    assert!(matches!(found, Err(Error::Stopped)), "{:?}", found.map(|f| f.1));
    let asked = asked.join().unwrap();
    assert!(ended.duration_since(asked).as_secs_f64() < 2.0);
    // The next one is made.
    renderer.render(&scene()).unwrap();
}

#[test]
fn a_layer_over_the_background_is_the_picture() {
    let mut renderer = Renderer::new(head(24), Settings::default());
    let fog = Fog::new(FogMode::Exp { density: 0.02 }, [0.7; 3]).unwrap();
    let plane = ClipPlane::new(glam::DVec3::new(1.0, 0.4, 0.2), 8.0).unwrap();
    for scene in [
        scene(),
        scene().with_fog(Some(fog)),
        scene().with_order(Order::BackToFront),
        scene().with_clip_planes(vec![plane]).unwrap(),
        scene().with_blend(Blend::Mip).unwrap(),
    ] {
        let layer = renderer.render_layer(&scene).unwrap();
        let (picture, _) = renderer.render(&scene).unwrap();
        let finished = layer.finish(&scene).unwrap();
        for (a, b) in finished.pixels().iter().zip(picture.pixels()) {
            // Pixels without anything in them take the background as it is.
            assert!((0..4).all(|c| (a[c] - b[c]).abs() <= 1e-7), "{a:?} {b:?}");
        }
        let ((x, y), (w, h)) = layer.rectangle();
        assert!(w > 20 && h > 20 && x + w <= 75 && y + h <= 61 && layer.pixels().len() == (w * h) as usize);
    }
    let said = |scene: Scene, words: &str| {
        let mut renderer = Renderer::new(head(8), Settings::default());
        let error = renderer.render_layer(&scene).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    said(scene().with_opengl(OpenGl::default()).unwrap(), "the profile opengl draws over its background");
    said(scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), "slices tolerance 0.01");
    said(scene().with_method(Method::default().with_extrapolate(true)).unwrap(), "slices extrapolate");
}
