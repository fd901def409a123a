//! What the other algorithms cost, and how near their pictures come to the reference.

use super::clock::Clock;
use super::record::AlgorithmRow;
use crate::reference::metrics::{self, Displayed};
use crate::reference::{Region, image};
use crate::scene::{Algorithm, Blend, Connectivity, Filter, Method, Order, Slicing, TemplatePlane};
use crate::{Renderer, Result, Scene, Volume};

/// Columns and rows of the picture at most: it is compared pixel by pixel.
const SIDE: u32 = 96;
/// Games of each pixel.
const GAMES: u32 = 64;

/// All that draw what slices draw, under the names that scene files give them; those that may be left out where a scene's camera is not for them.
const COMPARED: [(&str, Algorithm); 8] = [
    ("slices", Algorithm::Slices),
    ("rays", Algorithm::Rays),
    ("traversal, connectivity 6", Algorithm::Traversal(Connectivity::Six)),
    ("traversal, connectivity 26", Algorithm::Traversal(Connectivity::TwentySix)),
    ("template", Algorithm::Template(TemplatePlane::Base)),
    ("object-slices", Algorithm::ObjectSlices { spacing_correction: true }),
    ("object-slices, spacing_correction false", Algorithm::ObjectSlices { spacing_correction: false }),
    ("coin-flips, 64 games", Algorithm::CoinFlips { games: GAMES, seed: 0 }),
];

/// A small picture of `scene` by each algorithm, in `slices` slices or steps where it has any, against the reference. Nothing where the scene's
/// blend is not "over". Frames are repeated until `part` of the budget is gone.
///
/// # Errors
/// As [`Renderer::render`] and [`image`].
pub(super) fn measure(
    volume: &Volume,
    renderer: &mut Renderer,
    scene: &Scene,
    slices: u64,
    clock: &Clock,
    part: f64,
) -> Result<Vec<AlgorithmRow>> {
    if scene.blend() != Blend::Over {
        return Ok(Vec::new());
    }
    let (width, height) = scene.size();
    let smaller = width.max(height).div_ceil(SIDE);
    let scene = scene.clone().with_method(Method::default().with_filter(Filter::Linear))?.with_order(Order::FrontToBack);
    let scene = scene.with_slices(Slicing::Count(slices))?.with_size(width.div_ceil(smaller), height.div_ceil(smaller))?;
    let truth = image(&scene, volume, Region::whole(&scene))?;
    let shown = Displayed::over_black(truth.size().0, truth.pixels())?;
    let (mut list, mut scenes) = (Vec::new(), Vec::new());
    for (name, algorithm) in COMPARED {
        // A scene may ask for what one of them does not have.
        let Ok(scene) = scene.clone().with_algorithm(algorithm) else { continue };
        let parallel = !scene.camera().resolve(volume.grid(), 1, 1)?.perspective;
        if !parallel && matches!(algorithm, Algorithm::Template(_)) {
            continue;
        }
        let (picture, stats) = renderer.render(&scene)?;
        let found = metrics::difference(&shown, &Displayed::over_black(picture.width() as usize, picture.pixels())?)?;
        list.push(AlgorithmRow {
            algorithm: name.into(),
            samples: stats.slices,
            seconds: stats.render_seconds,
            fetches: stats.fetches,
            rms: found.rms,
            max: found.max,
            reference_pixels: truth.pixels().len(),
        });
        scenes.push(scene);
    }
    clock.shortest(part, renderer, scenes.iter().zip(list.iter_mut().map(|row| &mut row.seconds)).collect())?;
    Ok(list)
}
