//! Plots from a list of shapes, as SVG for pages and as PNG for everything else.
//!
//! ```text
//!  curves, axes --chart--> shapes --svg-->  text, in the page's own colours (light and dark)
//!  bars ---------bars-'          '--png-->  pixels, on white
//! ```
//! Curves differ by colour, by marker and by a label at their end, so that none of the three is needed alone.

mod axis;
mod bars;
mod chart;
mod panel;
mod png;
mod svg;

pub(super) use axis::{Axis, Ticks, seconds, short};
pub(super) use bars::{Bar, Bars};
pub(super) use chart::{Chart, Curve, Layout, text};
pub(super) use panel::{Panel, ticks};
pub(super) use svg::escape;

/// What a shape is drawn in. A page may give each another colour in the dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ink {
    Text,
    Muted,
    Grid,
    Paper,
    /// Curves that are not the ones to look at.
    Faint,
    /// One of the curves' colours, counted round.
    Curve(usize),
    /// A colour that means itself, on any page.
    Exact([u8; 3]),
}

/// Colours of curves on white: dark enough for it, told apart by people with common colour blindness (after Okabe and Ito).
const CURVES: [[u8; 3]; 7] = [[0, 96, 160], [196, 78, 0], [0, 128, 96], [150, 62, 128], [128, 100, 0], [44, 140, 190], [70, 70, 70]];

impl Ink {
    /// Red, green and blue on white.
    fn rgb(self) -> [u8; 3] {
        match self {
            Self::Text => [27, 31, 36],
            Self::Muted => [96, 104, 112],
            Self::Grid => [222, 226, 230],
            Self::Paper => [255, 255, 255],
            Self::Faint => [176, 182, 188],
            Self::Curve(i) => CURVES[i % CURVES.len()],
            Self::Exact(rgb) => rgb,
        }
    }

    /// What a faint curve is drawn in instead.
    fn faint(self) -> Self {
        if matches!(self, Self::Curve(_)) { Self::Faint } else { self }
    }

    /// The colour as a page's style says it.
    fn style(self) -> String {
        match self {
            Self::Exact([r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
            ink => format!("var(--{})", ink.class()),
        }
    }

    /// The class a page can style it by.
    fn class(self) -> String {
        match self {
            Self::Text => "k-text".into(),
            Self::Muted => "k-muted".into(),
            Self::Grid => "k-grid".into(),
            Self::Paper => "k-paper".into(),
            Self::Faint => "k-faint".into(),
            Self::Curve(i) => format!("k-{}", i % CURVES.len()),
            Self::Exact(_) => String::new(),
        }
    }
}

/// Which end of a text lies at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Something to draw; lengths in units of the drawing, y downwards.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A line through points; dashes as (on, off).
    Line { points: Vec<[f64; 2]>, ink: Ink, width: f64, dash: Option<[f64; 2]> },
    /// A closed outline, filled, and drawn round in `edge`.
    Area { points: Vec<[f64; 2]>, fill: Ink, edge: Option<Ink> },
    /// Text whose middle height lies at `at`; `up` reads from below to above.
    Text { at: [f64; 2], text: String, ink: Ink, anchor: Anchor, bold: bool, up: bool },
    /// A picture, a PNG file, whose upper left corner lies at `at`; its pixels are squares.
    Image { at: [f64; 2], size: [f64; 2], png: Vec<u8> },
    /// A curve with its marks and its name. A faint one is grey until it is pointed at.
    Curve { faint: bool, shapes: Vec<Shape> },
}

#[cfg(test)]
impl Shape {
    /// This shape, or those that it is made of.
    pub(super) fn parts(&self) -> &[Shape] {
        match self {
            Self::Curve { shapes, .. } => shapes,
            shape => std::slice::from_ref(shape),
        }
    }
}

/// A finished drawing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawing {
    pub(super) width: f64,
    pub(super) height: f64,
    /// What it shows, for those who cannot see it.
    pub(super) title: String,
    pub(super) shapes: Vec<Shape>,
}

/// Size of text, and the width of one of its characters at most.
pub(super) const FONT: f64 = 12.0;
pub(super) const ADVANCE: f64 = 7.2;

/// Marks of curves, told apart by shape; the second round is hollow.
pub(super) fn marker(curve: usize, [x, y]: [f64; 2], size: f64) -> Shape {
    let ring = |n: usize, turn: f64, r: f64| -> Vec<[f64; 2]> {
        let angle = |i: usize| (turn + i as f64 / n as f64) * std::f64::consts::TAU;
        (0..n).map(|i| [x + r * size * angle(i).sin(), y - r * size * angle(i).cos()]).collect()
    };
    let star = |n: usize, inner: f64| -> Vec<[f64; 2]> {
        let (tips, dents) = (ring(n, 0.0, 1.25), ring(n, 0.5 / n as f64, inner));
        tips.into_iter().zip(dents).flat_map(|(t, d)| [t, d]).collect()
    };
    // Past two rounds of seven, colours meet other shapes.
    let points = match (curve + 3 * (curve / 14)) % 7 {
        0 => ring(16, 0.0, 0.95),
        1 => ring(4, 0.125, 1.2),
        2 => ring(3, 0.0, 1.3),
        3 => ring(4, 0.0, 1.25),
        4 => ring(3, 0.5, 1.3),
        5 => star(5, 0.5),
        _ => star(4, 0.35),
    };
    let hollow = curve / 7 % 2 == 1;
    Shape::Area { points, fill: if hollow { Ink::Paper } else { Ink::Curve(curve) }, edge: Some(Ink::Curve(curve)) }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests;
#[cfg(test)]
pub(super) use tests::{no_text_on_another, read};
