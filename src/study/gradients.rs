//! What each kind of gradient costs, and how near its pictures come to their own limit.

use super::clock::Clock;
use super::precision::sampled;
use super::record::GradientKind;
use crate::reference::metrics::{self, Displayed};
use crate::reference::{Region, image};
use crate::scene::{Gradient, Slicing};
use crate::{Renderer, Result, Scene, Volume};

/// The kinds, under the names that scene files give them.
const KINDS: [(&str, Gradient); 3] = [("central", Gradient::Central), ("analytic", Gradient::Analytic), ("sobel", Gradient::Sobel)];
/// Rows and columns that a picture's reference has at most.
const SIDE: u32 = 40;

/// Pictures of `scene` in `slices` slices with each kind of gradient, against the reference with the same kind. Nothing where the scene
/// depends on no gradient. Frames are repeated until `part` of the budget is gone.
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
) -> Result<Vec<GradientKind>> {
    if !scene.needs_gradient() {
        return Ok(Vec::new());
    }
    let scene = scene.clone().with_slices(Slicing::Count(slices))?;
    let (width, height) = scene.size();
    let region = Region::every(&scene, width.max(height).div_ceil(SIDE));
    let (mut list, mut scenes) = (Vec::new(), Vec::new());
    for (kind, gradient) in KINDS {
        let scene = scene.clone().with_gradient(gradient);
        let truth = image(&scene, volume, region)?;
        let (picture, stats) = renderer.render(&scene)?;
        let found = metrics::difference(&Displayed::over_black(truth.size().0, truth.pixels())?, &sampled(&picture, region.step)?)?;
        list.push(GradientKind {
            kind: kind.into(),
            slices,
            seconds: stats.render_seconds,
            rms: found.rms,
            max: found.max,
            reference_bound: truth.error_bound(),
            reference_pixels: truth.pixels().len(),
        });
        scenes.push(scene);
    }
    clock.shortest(part, renderer, scenes.iter().zip(list.iter_mut().map(|row| &mut row.seconds)).collect())?;
    Ok(list)
}
