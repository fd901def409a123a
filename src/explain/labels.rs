//! Where the drawing's labels stand, so that none lies on another.
//!
//! A label looks for room on rings around what it names, outwards first. Those that stand still from slice to slice are placed before the
//! numbers of a slice's corners.

use super::geometry::{HEIGHT, WIDTH};
use serde::Serialize;

/// How large labels are, in pixels of the drawing: it is shown at about its own size where there is room, and at half of it on a telephone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct LabelSize {
    /// Height of letters and numbers.
    pub(super) text: f64,
    /// Height of the letters of axes.
    pub(super) letter: f64,
}

/// Sizes on wide and on narrow windows.
pub(super) const SIZES: [LabelSize; 2] = [LabelSize { text: 14.0, letter: 18.0 }, LabelSize { text: 26.0, letter: 30.0 }];

/// Width of a character at most, as a part of the text's height.
const ADVANCE: f64 = 0.62;
/// Height of a line, as a part of the text's height.
const LINE: f64 = 1.15;
/// How far from what it names a label may go to lie clear of lines.
const NEAR: f64 = 60.0;
/// Room that a corner's dot takes, across.
const DOT: f64 = 10.0;

/// A label that stands still.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Label {
    pub(super) text: &'static str,
    /// The axis that it names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) axis: Option<usize>,
    /// Its middle; none where there is no room.
    pub(super) at: Option<[f64; 2]>,
}

/// A rectangle in pixels of the drawing.
#[derive(Debug, Clone, Copy)]
struct Area {
    middle: [f64; 2],
    /// From the middle to the sides.
    half: [f64; 2],
}

impl Area {
    fn of_text(middle: [f64; 2], text: &str, size: f64) -> Self {
        Self { middle, half: [0.5 * ADVANCE * size * text.chars().count() as f64, 0.5 * LINE * size] }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..2).all(|c| (self.middle[c] - other.middle[c]).abs() < self.half[c] + other.half[c])
    }

    fn inside(&self) -> bool {
        let side = [f64::from(WIDTH), f64::from(HEIGHT)];
        (0..2).all(|c| self.middle[c] - self.half[c] >= 1.0 && self.middle[c] + self.half[c] <= side[c] - 1.0)
    }
}

/// The places that are taken, at one size of labels.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    size: LabelSize,
    taken: Vec<Area>,
    /// Lines that labels lie clear of where they can.
    lines: Vec<Area>,
}

impl Layout {
    pub(super) fn new(size: LabelSize) -> Self {
        Self { size, taken: Vec::new(), lines: Vec::new() }
    }

    /// Keeps labels off a line, where there is room beside it.
    pub(super) fn keep_clear(&mut self, a: [f64; 2], b: [f64; 2]) {
        let pieces = (length(b[0] - a[0], b[1] - a[1]) / 6.0).ceil().max(1.0);
        let at = |i: u32, c: usize| a[c] + (b[c] - a[c]) * f64::from(i) / pieces;
        self.lines.extend((0..=pieces as u32).map(|i| Area { middle: [at(i, 0), at(i, 1)], half: [3.0; 2] }));
    }

    /// Takes room for `text`, `height` high, beside the point `of`: away from `center` where that is free, else as near to it as can be.
    fn place(&mut self, text: &str, height: f64, of: [f64; 2], center: [f64; 2]) -> Option<[f64; 2]> {
        let label = Area::of_text([0.0; 2], text, height);
        let (x, y) = (of[0] - center[0], of[1] - center[1]);
        let l = length(x, y);
        let outwards = if l > 0.0 { [x / l, y / l] } else { [0.0, -1.0] };
        let far = length(f64::from(WIDTH), f64::from(HEIGHT));
        let rings = |last: f64| (0..).map(|ring| 0.5 * DOT + 1.0 + 5.0 * f64::from(ring)).take_while(move |&r| r < last);
        let at = |(r, [cos, sin]): (f64, [f64; 2])| {
            let [u, v] = [outwards[0] * cos - outwards[1] * sin, outwards[0] * sin + outwards[1] * cos];
            // So far out that the rectangle leaves the ring free.
            let out = r + u.abs() * label.half[0] + v.abs() * label.half[1];
            Area { middle: [of[0] + u * out, of[1] + v * out], ..label }
        };
        let free = |list: &[Area], place: &Area| !list.iter().any(|t| t.meets(place));
        let places = |last| rings(last).flat_map(|r| TURNS.map(|turn| (r, turn))).map(at).filter(|p| p.inside() && free(&self.taken, p));
        let clear = places(NEAR).find(|place| free(&self.lines, place));
        let found = clear.or_else(|| places(far).next())?;
        self.taken.push(found);
        Some(found.middle)
    }

    /// The labels that stand still: what the arrow means, the letters of the axes at the far ends of their edges, and where these begin. `corners`
    /// are the box's, x fastest.
    pub(super) fn still(&mut self, arrow: [[f64; 2]; 2], corners: &[[f64; 2]]) -> Vec<Label> {
        let mean = |c: usize| corners.iter().map(|p| p[c]).sum::<f64>() / corners.len() as f64;
        let center = [mean(0), mean(1)];
        let names = [("x", Some(0), 1), ("y", Some(1), 2), ("z", Some(2), 4), ("0", None, 0)];
        let names = names.map(|(text, axis, corner)| (text, axis, corners[corner]));
        let place = |(text, axis, of): (&'static str, Option<usize>, [f64; 2])| {
            let height = if axis.is_some() { self.size.letter } else { self.size.text };
            Label { text, axis, at: self.place(text, height, of, center) }
        };
        std::iter::once(("line of sight", None, arrow[0])).chain(names).map(place).collect()
    }

    /// Places of the numbers 1, 2, ... beside the corners of a slice's polygon.
    pub(super) fn numbers(&self, corners: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
        let mut layout = self.clone();
        layout.taken.extend(corners.iter().map(|&middle| Area { middle, half: [0.5 * DOT; 2] }));
        let mean = |c: usize| corners.iter().map(|p| p[c]).sum::<f64>() / corners.len().max(1) as f64;
        let center = [mean(0), mean(1)];
        (1..).zip(corners).map(|(n, &of)| layout.place(&n.to_string(), layout.size.text, of, center)).collect()
    }
}

fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Cosines and sines of turns by 0, 1/16, -1/16, 2/16, -2/16, ... of a circle.
const TURNS: [[f64; 2]; 16] = {
    const A: f64 = 0.923_879_532_511_286_7;
    const B: f64 = 0.382_683_432_365_089_8;
    const C: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [A, B],
        [A, -B],
        [C, C],
        [C, -C],
        [B, A],
        [B, -A],
        [0.0, 1.0],
        [0.0, -1.0],
        [-B, A],
        [-B, -A],
        [-C, C],
        [-C, -C],
        [-A, B],
        [-A, -B],
        [-1.0, 0.0],
    ]
};
