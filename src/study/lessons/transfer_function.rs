//! Lesson 4, transfer function: an opacity belongs to a length, so a slab's opacity is 1 - (1 - a)^(thickness / length).

use super::super::plot::{Drawing, Panel};
use super::figure::{image, titled, words};
use crate::Result;
use crate::scene::TransferFunction;

const WIDTH: f64 = 480.0;
const ROW: f64 = 36.0;
/// Thickness of the material at the right end, in reference lengths.
const THICKEST: f64 = 5.0;

pub(super) fn make() -> Result<(String, Drawing)> {
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.2, 0.9]), (100.0, [1.0, 0.5, 0.1])], vec![(20.0, 0.0), (100.0, 0.5)])?;
    let mut told = String::new();
    for value in [20.0, 60.0, 100.0] {
        let straight = transfer.eval(value);
        let (rgb, premultiplied) = (straight.rgb, straight.premultiply().rgb);
        told += &format!("value {value}: straight {rgb:.2?}, a = {:.2}, premultiplied {premultiplied:.3?}\n", straight.alpha);
    }

    let material = transfer.eval(100.0);
    let a = material.alpha;
    let half = 1.0 - (1.0 - a).sqrt();
    told += &format!("a slab of half the length: 1 - sqrt(1 - a) = {half:.4}, not a / 2 = {:.4}\n", a / 2.0);
    // How thick one slab is, and its opacity: the first two rows agree, the others do not.
    let rows = [
        ("slabs of one length, a", 1.0, a, ""),
        ("slabs of half a length, 1 - sqrt(1 - a)", 0.5, half, ": the same"),
        ("slabs of half a length, a", 0.5, a, ": too dense"),
        ("slabs of half a length, a / 2", 0.5, a / 2.0, ": too clear"),
    ];
    let seen = |thickness: f64, slab: f64, opacity: f64| 1.0 - (1.0 - opacity).powf(thickness / slab);
    for (name, slab, opacity, _) in rows {
        told += &format!("{name:40} 4 lengths of it: {:.4}\n", seen(4.0, slab, opacity));
    }

    // The material grows thicker from left to right, over a chequered ground.
    let mut shapes = Vec::new();
    let (left, top, step) = (24.0, 36.0, ROW + 26.0);
    let bottom = top + step * rows.len() as f64;
    let panel = Panel { left, top, right: left + WIDTH, bottom, x: [0.0, THICKEST], y: [0.0, 1.0] };
    panel.lower_axis("thickness of the material, in the lengths that a belongs to", 0.0, &mut shapes);
    for (n, (name, slab, opacity, verdict)) in rows.into_iter().enumerate() {
        let row = top + step * n as f64;
        shapes.push(words([left, row + 12.0], &format!("{name}{verdict}")));
        let size = [2 * WIDTH as u32, 2 * ROW as u32];
        shapes.push(image([left, row + 22.0], [WIDTH, ROW], size, |x, y| {
            let alpha = seen(THICKEST * f64::from(x) / f64::from(size[0]), slab, opacity);
            let ground = if (x / 18 + y / 18) % 2 == 0 { 0.9 } else { 0.6 };
            material.rgb.map(|c| c * alpha + (1.0 - alpha) * ground)
        })?);
    }
    let title = format!("Lesson 4: the same material (a = {a}), cut in four ways");
    Ok((told, titled(&title, [left + WIDTH + 24.0, bottom + 46.0], shapes)))
}
