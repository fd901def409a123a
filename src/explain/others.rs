//! Other renderings of a scene, to compare with.

use crate::proxy::Stack;
use crate::scene::{Blend, Fog, FogMode, FogWeighting, Method, Order, Scene, SlabForm, Slicing, Straight};
use crate::{Error, Picture, Renderer, Result};

/// Largest side of a comparison's pictures on the page.
const SMALL: u32 = 288;

/// Fog to show with where a scene has none: from the box's nearest to beyond its farthest point.
pub(super) fn example_fog(stack: &Stack) -> Result<Fog> {
    let end = stack.far + 0.25 * (stack.far - stack.near);
    Fog::new(FogMode::Linear { start: stack.near, end }, [0.62, 0.7, 0.8])
}

/// The fog of the comparisons: the scene's, or the example where it has none. In black, which hides what they show, the example's colour.
fn compared(scene: &Scene, stack: &Stack) -> Result<Fog> {
    let example = example_fog(stack)?;
    match scene.fog() {
        Some(fog) if fog.color() == [0.0; 3] => Ok(Fog::new(fog.mode(), example.color())?.with_distance(fog.distance())),
        Some(fog) => Ok(*fog),
        None => Ok(example),
    }
}

/// Other scenes to record the same pixels of: name, what is different, scene.
pub(super) fn others(scene: &Scene, stack: &Stack) -> Result<Vec<(&'static str, String, Scene)>> {
    if scene.blend() != Blend::Over {
        return Ok(Vec::new());
    }
    let fog = compared(scene, stack)?;
    let fogged = |weighting| scene.clone().with_fog(Some(fog.with_weighting(weighting)));
    let to_the_end = scene.clone().with_order(Order::FrontToBack).with_terminate(0.0)?;
    let mut list = vec![
        ("front-to-back", "blended front to back, never ended early".to_owned(), to_the_end.clone()),
        ("fog-weighted", "in fog weighted by opacity".to_owned(), fogged(FogWeighting::Alpha)),
        ("fog-literal", "in fog by the literal formula".to_owned(), fogged(FogWeighting::Literal)),
    ];
    if !scene.method().is_pre_integrated() {
        list.push(("back-to-front", "blended back to front".to_owned(), scene.clone().with_order(Order::BackToFront)));
    }
    // Choices that exclude this form have no such twin.
    let riemann = Method { slab: SlabForm::Riemann, ..scene.method() };
    if let Ok(other) = to_the_end.with_method(riemann) {
        list.push(("riemann", "with slabs of opacity kappa L, the explicit Euler step".to_owned(), other));
    }
    Ok(list)
}

/// The picture in weighted and in literal fog over an opaque background, at most [`SMALL`] pixels a side.
pub(super) fn fogged_pictures(renderer: &mut Renderer, scene: &Scene, stack: &Stack) -> Result<[Picture; 2]> {
    let (width, height) = scene.size();
    let shrink = f64::from(SMALL) / f64::from(width.max(height).max(SMALL));
    let side = |n: u32| ((f64::from(n) * shrink) as u32).max(1);
    let fog = compared(scene, stack)?;
    // Light without opacity, which literal fog leaves in empty slices, shows over an opaque background alone.
    let background = Straight { alpha: 1.0, ..scene.background() };
    // As many slices as the small picture has use for.
    let small = scene
        .clone()
        .with_background(background)?
        .with_size(side(width), side(height))?
        .with_slices(Slicing::Count(stack.count.min(256)))?;
    let mut one = |weighting| Ok::<_, Error>(renderer.render(&small.clone().with_fog(Some(fog.with_weighting(weighting))))?.0);
    Ok([one(FogWeighting::Alpha)?, one(FogWeighting::Literal)?])
}
