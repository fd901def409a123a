//! Random scenes of all keys that there are: whatever is rendered is finite, in its range and premultiplied, the same bytes for any number of
//! threads, tile and vector level, and the same to 1e-5 in the other order; whatever is refused is refused in one line.

#![cfg(feature = "scene-file")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod random;

use random::{Draw, document, on_all_cores};
use slicestack::scene::{Algorithm, Blend, FogWeighting, Order, Overrides, SceneFile, SlabForm, Slicing, schema};
use slicestack::{Error, Level, Limits, Picture, Renderer, Scene, Settings, Volume};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Scenes of a usual run.
const SCENES: u64 = 1500;
/// Seconds to go on for beyond them, and the seed to begin with.
const SECONDS: &str = "SLICESTACK_SEARCH_SECONDS";
const FROM: &str = "SLICESTACK_SEARCH_FROM";

/// How far rounding may bring a colour above its opacity: the one is a sum, the other 1 minus a product.
const ABOVE: f32 = 1e-5;

/// Largest difference between both orders, colours up to 1.
const ORDERS: f32 = 1e-5;

fn rendered(volume: &Volume, scene: &Scene, settings: Settings) -> slicestack::Result<Picture> {
    Ok(Renderer::new(volume, settings).render(scene)?.0)
}

fn bits(picture: &Picture) -> Vec<[u32; 4]> {
    picture.pixels().iter().map(|p| p.map(f32::to_bits)).collect()
}

/// An error as all are: one line of a sane length.
fn is_line(error: &Error) -> bool {
    let text = error.to_string();
    !text.is_empty() && !text.contains('\n')
}

/// Whether pixels are premultiplied colours by promise: OpenGL's framebuffer holds what its states make of it, Riemann's slabs leave the range, and
/// literal fog lights up nothing.
fn is_bounded(scene: &Scene) -> bool {
    let literal = scene.fog().is_some_and(|fog| fog.weighting() == FogWeighting::Literal);
    scene.opengl().is_none() && scene.method().slab != SlabForm::Riemann && !literal
}

/// What is wrong with the scene of `seed`; `Ok(false)` where it is refused as it may be.
fn wrong(seed: u64) -> Result<bool, String> {
    let mut draw = Draw::of_seed(seed);
    let text = document(&schema(), &mut draw).to_string();
    let told = |what: String| format!("seed {seed}: {what}\n{text}");
    let refused = |e: Error| if is_line(&e) { Ok(false) } else { Err(told(format!("an error of several lines: {e}"))) };
    let file = match SceneFile::parse(&text, "", &Overrides::default()) {
        Err(e) => return refused(e),
        Ok(file) => file,
    };
    let volume = match file.volume().load(&Limits::default()) {
        Err(e) => return refused(e),
        Ok(volume) => volume,
    };
    let scene = match file.to_scene(&volume) {
        Err(e) => return refused(e),
        Ok((scene, _)) => scene,
    };
    let (width, height) = scene.size();
    if width * height > 40 * 40 || matches!(scene.slicing(), Slicing::Count(n) if n > 4096) {
        return Ok(false);
    }
    let usual = Settings::new().threads(1).level(Level::SCALAR);
    let picture = match rendered(&volume, &scene, usual.clone()) {
        Err(e) => return refused(e),
        Ok(picture) => picture,
    };
    for (i, &p) in picture.pixels().iter().enumerate() {
        if p.iter().any(|x| !x.is_finite()) {
            return Err(told(format!("pixel {i} is {p:?}")));
        }
        let [r, g, b, a] = p;
        if is_bounded(&scene) && !((0.0..=1.0).contains(&a) && [r, g, b].iter().all(|c| (0.0..=a + ABOVE).contains(c))) {
            return Err(told(format!("pixel {i} is no premultiplied colour: {p:?}")));
        }
    }
    let level = draw.one(&Level::available());
    let (threads, tile) = (1 + draw.below(3), draw.one(&[1_u32, 7, 8, 13, 64]));
    let other = rendered(&volume, &scene, Settings::new().threads(threads).tile(tile).level(level));
    let other = other.map_err(|e| told(format!("{threads} threads, tiles of {tile}, {}: {e}", level.name())))?;
    if bits(&other) != bits(&picture) {
        let at = (0..other.pixels().len()).find(|&i| other.pixels()[i] != picture.pixels()[i]).unwrap_or(0);
        let (a, b) = (picture.pixels()[at], other.pixels()[at]);
        return Err(told(format!("{threads} threads, tiles of {tile}, {}: pixel {at} is {b:?}, alone {a:?}", level.name())));
    }
    // Both orders, where the scene has two: one of them ends pixels early, which the scene may forbid.
    let sliced = scene.algorithm() == Algorithm::Slices && is_bounded(&scene) && scene.blend() == Blend::Over;
    if sliced && matches!(scene.slicing(), Slicing::Count(_)) {
        let full = scene.clone().with_terminate(0.0);
        let turn = |order: Order| full.as_ref().ok().map(|s| s.clone().with_order(order));
        if let (Some(front), Some(back)) = (turn(Order::FrontToBack), turn(Order::BackToFront)) {
            if let (Ok(front), Ok(back)) = (rendered(&volume, &front, usual.clone()), rendered(&volume, &back, usual)) {
                for (i, (a, b)) in front.pixels().iter().zip(back.pixels()).enumerate() {
                    if (0..4).any(|c| (a[c] - b[c]).abs() > ORDERS) {
                        return Err(told(format!("pixel {i} is {a:?} from the front, {b:?} from the back")));
                    }
                }
            }
        }
    }
    Ok(true)
}

#[test]
fn whatever_is_rendered_is_sound_and_whatever_is_refused_is_told() {
    let number = |name: &str| std::env::var(name).ok().map(|n| n.parse::<u64>().unwrap());
    let (from, until) = (number(FROM).unwrap_or(0), Instant::now() + Duration::from_secs(number(SECONDS).unwrap_or(0)));
    let (made, tried) = (AtomicU64::new(0), AtomicU64::new(0));
    let mut next = from;
    loop {
        let found = on_all_cores(next..next + SCENES, |seed| {
            tried.fetch_add(1, Ordering::Relaxed);
            match std::panic::catch_unwind(|| wrong(seed)) {
                Err(_) => Some(format!("seed {seed}: a panic")),
                Ok(Err(what)) => Some(what),
                Ok(Ok(is_made)) => {
                    made.fetch_add(u64::from(is_made), Ordering::Relaxed);
                    None
                }
            }
        });
        assert!(found.is_empty(), "{} of {SCENES} scenes:\n{}", found.len(), found[..found.len().min(6)].join("\n"));
        next += SCENES;
        if Instant::now() >= until {
            break;
        }
    }
    let (made, tried) = (made.into_inner(), tried.into_inner());
    println!("{tried} scenes, {made} of them rendered");
    assert!(made * 4 >= tried, "{made} of {tried} scenes are rendered: too few to tell anything");
}
