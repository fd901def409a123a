//! What the drawings of the lessons share.

use super::super::plot::{Anchor, Drawing, Ink, Shape, text};
use crate::Result;
use crate::picture::png::rgb8;

/// Height of a line of text, in units of the drawing.
pub(super) const LINE: f64 = 18.0;

/// A drawing with its title above it.
pub(super) fn titled(title: &str, [width, height]: [f64; 2], mut shapes: Vec<Shape>) -> Drawing {
    shapes.push(text([10.0, 16.0], title, Ink::Text, Anchor::Start, true));
    Drawing { width, height, title: title.to_owned(), shapes }
}

/// Words that begin at a place.
pub(super) fn words(at: [f64; 2], said: &str) -> Shape {
    text(at, said, Ink::Text, Anchor::Start, false)
}

/// Words around a place.
pub(super) fn centered(at: [f64; 2], said: &str) -> Shape {
    text(at, said, Ink::Text, Anchor::Middle, false)
}

/// A letter or number around a place, in a colour.
pub(super) fn letter(at: [f64; 2], said: &str, ink: Ink) -> Shape {
    text(at, said, ink, Anchor::Middle, true)
}

/// A straight line.
pub(super) fn line(a: [f64; 2], b: [f64; 2], ink: Ink, width: f64) -> Shape {
    Shape::Line { points: vec![a, b], ink, width, dash: None }
}

/// A filled rectangle between two corners.
pub(super) fn rectangle([left, top]: [f64; 2], [right, bottom]: [f64; 2], fill: Ink) -> Shape {
    Shape::Area { points: vec![[left, top], [right, top], [right, bottom], [left, bottom]], fill, edge: None }
}

/// A colour of 0 to 1 as ink.
pub(super) fn color(rgb: [f64; 3]) -> Ink {
    Ink::Exact(rgb.map(byte))
}

/// Opaque pixels, row by row, as a picture in the drawing.
pub(super) fn image(at: [f64; 2], size: [f64; 2], [width, height]: [u32; 2], pixel: impl Fn(u32, u32) -> [f64; 3]) -> Result<Shape> {
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let bytes: Vec<u8> = places.flat_map(|(x, y)| pixel(x, y).map(byte)).collect();
    Ok(Shape::Image { at, size, png: rgb8(width, height, &bytes)? })
}

fn byte(c: f64) -> u8 {
    (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}
