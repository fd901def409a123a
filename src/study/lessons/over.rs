//! Lesson 5, over: slabs are blended front to back or back to front, and both are the same sum.

use super::super::plot::Drawing;
use super::figure::{centered, color, rectangle, titled, words};
use crate::Result;
use crate::scene::{Premultiplied, Straight};

const SIDE: f64 = 44.0;

/// What has been gathered, and the transmittance that is left: kept as such, never as 1 - opacity.
type Gathered = ([f64; 3], f64);

fn front_to_back((sum, t): Gathered, slab: &Premultiplied) -> Gathered {
    ([0, 1, 2].map(|c| sum[c] + t * slab.rgb[c]), t * (1.0 - slab.alpha))
}

fn back_to_front((sum, t): Gathered, slab: &Premultiplied) -> Gathered {
    ([0, 1, 2].map(|c| slab.rgb[c] + (1.0 - slab.alpha) * sum[c]), t * (1.0 - slab.alpha))
}

pub(super) fn make() -> Result<(String, Drawing)> {
    // Nearest first: thin glasses of red, green and blue, thicker and thicker.
    let glass =
        |k: usize| Straight { rgb: [0, 1, 2].map(|c| if c == k % 3 { 1.0 } else { 0.15 }), alpha: 0.1 + 0.05 * k as f64 }.premultiply();
    let slabs: Vec<Premultiplied> = (0..9).map(glass).collect();
    let start = ([0.0; 3], 1.0);
    let front = slabs.iter().fold(start, front_to_back);
    let back = slabs.iter().rev().fold(start, back_to_front);
    let before = |k: usize| slabs[..k].iter().map(|s| 1.0 - s.alpha).product::<f64>();
    let closed = [0, 1, 2].map(|c| (0..slabs.len()).map(|k| slabs[k].rgb[c] * before(k)).sum::<f64>());
    let mut told = format!("front to back {:.6?}, T = {:.6}\n", front.0, front.1);
    told += &format!("back to front {:.6?}, T = {:.6}\n", back.0, back.1);
    told += &format!("closed sum    {closed:.6?}, T = {:.6}\n", before(slabs.len()));
    for n in [1, 4, 16] {
        let opacity = 1.0 - (0..n).map(|_| 1.0 - 0.25f64).product::<f64>();
        told += &format!("{n} slabs of opacity 0.25: {opacity:.4} = 1 - 0.75^{n}, not {}\n", 0.25 * f64::from(n));
    }
    if let Some(k) = (0..=slabs.len()).find(|&k| before(k) < 0.2) {
        told += &format!("for an error below 0.2, {k} slabs of {} are enough: early termination\n", slabs.len());
    }

    // A square for each slab: alone, gathered so far from the front, gathered so far from the back; over white.
    let over_white = |(sum, t): Gathered| color(sum.map(|c| c + t));
    let names = ["each slab alone", "from the front, so far", "from the back, so far"];
    let (left, top) = (190.0, 62.0);
    let mut shapes = vec![words([10.0, top - 12.0], "slab, 0 the nearest")];
    for (k, slab) in slabs.iter().enumerate() {
        let x = left + SIDE * k as f64;
        shapes.push(centered([x + 0.5 * SIDE, top - 12.0], &k.to_string()));
        let gathered =
            [front_to_back(start, slab), slabs[..=k].iter().fold(start, front_to_back), slabs[k..].iter().rev().fold(start, back_to_front)];
        for (row, gathered) in gathered.into_iter().enumerate() {
            let y = top + SIDE * row as f64;
            shapes.push(rectangle([x, y], [x + SIDE, y + SIDE], over_white(gathered)));
        }
    }
    for (row, name) in names.into_iter().enumerate() {
        shapes.push(words([10.0, top + SIDE * (row as f64 + 0.5)], name));
    }
    let bottom = top + 3.0 * SIDE;
    shapes.push(words([10.0, bottom + 16.0], "All slabs: the second row's last square and the third row's first. They are the same."));
    let size = [(left + 9.0 * SIDE).max(620.0) + 10.0, bottom + 32.0];
    Ok((told, titled("Lesson 5: nine slabs put together with over, on white", size, shapes)))
}
