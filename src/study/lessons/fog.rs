//! Lesson 6, fog: on premultiplied colours the fog's part is weighted by the opacity, or empty slices light up.

use super::super::plot::Drawing;
use super::figure::{centered, image, titled};
use crate::scene::{Camera, Fog, FogMode, FogWeighting, Slicing, Straight};
use crate::volume::phantom::Phantom;
use crate::{Renderer, Result, Scene, Settings};

const SIDE: u32 = 360;

pub(super) fn make() -> Result<(String, Drawing)> {
    let volume = Phantom::DistanceField.volume(64)?;
    let scene = Scene::new(Phantom::DistanceField.default_transfer(64))
        .with_camera(Camera::orbit(30.0, 25.0)?)
        .with_slices(Slicing::Count(128))?
        .with_background(Straight { rgb: [0.05, 0.05, 0.08], alpha: 1.0 })?
        .with_size(SIDE, SIDE)?;
    let view = scene.camera().resolve(volume.grid(), SIDE, SIDE)?;
    let middle = view.depth(volume.grid().center());
    let (start, end) = (middle - 0.7 * volume.grid().radius(), middle + 0.9 * volume.grid().radius());

    // Linear fog is (end - z) / (end - start): 1 where it starts, 0 where it ends. (1 - z is right for 0 and 1 alone.)
    let fog = Fog::new(FogMode::Linear { start, end }, [0.55, 0.65, 0.8])?;
    let mut told = String::new();
    for z in [start, middle, end] {
        told += &format!("z = {z:6.1}: f = {:.3}\n", fog.factor(z));
    }

    // Two fragments of one colour in the middle: one that shows, and one of opacity 0.
    let f = fog.factor(middle);
    for alpha in [0.5, 0.0] {
        let fragment = Straight { rgb: [1.0, 0.6, 0.2], alpha }.premultiply();
        let weighted = [0, 1, 2].map(|c| f * fragment.rgb[c] + (1.0 - f) * alpha * fog.color()[c]);
        let literal = [0, 1, 2].map(|c| f * fragment.rgb[c] + (1.0 - f) * fog.color()[c]);
        told += &format!("A = {alpha}: f C + (1 - f) A c_fog = {weighted:.3?}; without the A: {literal:.3?}\n");
    }

    // The same scene in no fog, weighted fog and literal fog, side by side.
    let mut renderer = Renderer::new(&volume, Settings::default());
    let mut shapes = Vec::new();
    let literal = fog.with_weighting(FogWeighting::Literal);
    let fogs = [("no fog", None), ("weighted by the opacity A", Some(fog)), ("A is missing: the box glows", Some(literal))];
    let side = f64::from(SIDE) / 2.0;
    for (n, (name, fog)) in fogs.into_iter().enumerate() {
        let picture = renderer.render(&scene.clone().with_fog(fog))?.0;
        let left = 20.0 + (side + 30.0) * n as f64;
        shapes.push(image([left, 54.0], [side; 2], [SIDE; 2], |x, y| {
            let [r, g, b, _] = picture.pixel(x, y).map(f64::from);
            [r, g, b]
        })?);
        shapes.push(centered([left + 0.5 * side, 42.0], name));
    }
    Ok((told, titled("Lesson 6: fog on premultiplied colours", [40.0 + 3.0 * side + 60.0, 66.0 + side], shapes)))
}
