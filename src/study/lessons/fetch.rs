//! Lesson 3, fetch: a texture coordinate becomes an index, the index a cell and weights, and eight voxels become one value.

use super::super::plot::{Drawing, Panel};
use super::figure::{centered, image, titled};
use crate::Result;
use crate::volume::phantom::Phantom;
use glam::DVec3;

const SIZE: usize = 8;
/// Side of each of the two pictures, in units of the drawing; a unit is two pixels.
const SIDE: f64 = 240.0;

pub(super) fn make() -> Result<(String, Drawing)> {
    let volume = Phantom::MarschnerLobb.volume(SIZE)?;

    // Voxel centres lie at whole numbers: u = s n - 1/2. Round down, not towards zero, or s < 1/2n would read from the wrong side.
    let mut told = String::new();
    for s in [0.02, 0.40, 0.98] {
        let u: f64 = s * SIZE as f64 - 0.5;
        told += &format!("s = {s:.2}: u = {u:+.2}, cell {}, weight {:.2} (truncated: {})\n", u.floor(), u - u.floor(), u.trunc());
    }

    let at = DVec3::new(2.30, 4.65, 3.75);
    let cell = at.floor();
    let w = at - cell;
    let [i, j, k] = cell.to_array().map(|c| c as usize);
    let v = |c: usize| volume.value([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]);
    told += &format!("index {at}: cell {cell}, weights {w:.2}\n");
    for c in 0..8 {
        let part = |axis: usize| if c >> axis & 1 == 1 { w[axis] } else { 1.0 - w[axis] };
        let voxel = format!("{} {} {}", i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        told += &format!("  voxel {voxel}: {:.4} x {:.4}\n", v(c), part(0) * part(1) * part(2));
    }
    let lerp = |a: f64, b: f64, t: f64| a + t * (b - a);
    let x = [lerp(v(0), v(1), w.x), lerp(v(2), v(3), w.x), lerp(v(4), v(5), w.x), lerp(v(6), v(7), w.x)];
    let y = [lerp(x[0], x[1], w.y), lerp(x[2], x[3], w.y)];
    let z = lerp(y[0], y[1], w.z);
    told += &format!("along x: {x:.4?}\nalong y: {y:.4?}\nalong z: {z:.4}; the library finds {:.4}\n", volume.sample(at));

    // A plane through the volume: the nearest voxel on the left, all eight on the right.
    let mut shapes = Vec::new();
    let ends = [-0.5, SIZE as f64 - 0.5];
    for (n, name) in ["the nearest voxel", "eight voxels, trilinear"].into_iter().enumerate() {
        let (left, top) = (64.0 + 300.0 * n as f64, 56.0);
        let panel = Panel { left, top, right: left + SIDE, bottom: top + SIDE, x: ends, y: ends };
        // Both have the same rows.
        if n == 0 {
            panel.left_axis("index along y", &mut shapes);
        }
        panel.lower_axis("index along x", 0.0, &mut shapes);
        let pixels = 2 * SIDE as u32;
        let index = |p: u32| (f64::from(p) + 0.5) / f64::from(pixels) * SIZE as f64 - 0.5;
        shapes.push(image([left, top], [SIDE; 2], [pixels; 2], |column, row| {
            // Upwards, as the axis says.
            let at = DVec3::new(index(column), index(pixels - 1 - row), 3.5);
            [volume.sample(if n == 0 { (at + 0.5).floor() } else { at }); 3]
        })?);
        panel.edges(&mut shapes);
        shapes.push(centered([left + 0.5 * SIDE, top - 12.0], name));
    }
    Ok((told, titled("Lesson 3: the plane at index z = 3.5, looked up in two ways", [624.0, 56.0 + SIDE + 46.0], shapes)))
}
