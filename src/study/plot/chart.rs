//! Curves over two logarithmic axes.

use super::axis::{Span, Ticks};
use super::{ADVANCE, Anchor, Axis, Drawing, FONT, Ink, Shape, marker};

/// A curve and its name.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Curve {
    pub(in crate::study) name: String,
    /// (x, y); what is not positive cannot be shown and is left out.
    pub(in crate::study) points: Vec<[f64; 2]>,
    /// Which colour and marker.
    pub(in crate::study) look: usize,
    /// A plain thin dashed line without marks: a prediction, not a measurement.
    pub(in crate::study) guide: bool,
    /// Not one of those to look at: grey, behind the others.
    pub(in crate::study) faint: bool,
}

/// What is plotted.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Chart {
    pub(in crate::study) title: String,
    pub(in crate::study) x: Axis,
    pub(in crate::study) y: Axis,
    pub(in crate::study) curves: Vec<Curve>,
}

/// How much room there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::study) enum Layout {
    /// Names beside the ends of the curves.
    Wide,
    /// Names below the plot, for a telephone.
    Narrow,
}

const ROW: f64 = 16.0;

impl Chart {
    /// The chart as shapes.
    pub(in crate::study) fn draw(&self, layout: Layout) -> Drawing {
        let longest = self.curves.iter().map(|c| c.name.chars().count()).max().unwrap_or(0) as f64;
        let names = longest * ADVANCE + 34.0;
        let wide = layout == Layout::Wide;
        let width = if wide { 900.0 } else { 360.0 };
        let per_row = if wide { 1.0 } else { ((width - 10.0) / names).floor().max(1.0) };
        let legend = if wide { 0.0 } else { (self.curves.len() as f64 / per_row).ceil() * ROW + 6.0 };
        let plot_height = if wide { (self.curves.len() as f64 * ROW).max(400.0) } else { 320.0 };
        let frame = Frame { left: 64.0, top: 34.0, right: width - if wide { names } else { 12.0 }, bottom: 34.0 + plot_height };
        let mut shapes = Vec::new();
        shapes.push(text([if wide { frame.left } else { 8.0 }, 16.0], &self.title, Ink::Text, Anchor::Start, true));
        let points = || self.curves.iter().flat_map(|c| &c.points).filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite()));
        let spans = [Span::of(points().map(|p| p[0])), Span::of(points().map(|p| p[1]))];
        frame.axes(self, spans, &mut shapes);
        let place = |p: &[f64; 2]| {
            let (x, y) = (spans[0].place(p[0]), spans[1].place(p[1]));
            [frame.left + x * (frame.right - frame.left), frame.bottom - y * (frame.bottom - frame.top)]
        };
        let shown: Vec<Vec<[f64; 2]>> = self
            .curves
            .iter()
            .map(|c| c.points.iter().filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite())).map(place).collect())
            .collect();
        let mut parts: Vec<Vec<Shape>> = self.curves.iter().zip(&shown).map(|(curve, points)| drawn(curve, points)).collect();
        if wide {
            frame.names_beside(&self.curves, &shown, &mut parts);
        } else {
            for (i, (curve, parts)) in self.curves.iter().zip(&mut parts).enumerate() {
                let (column, row) = (i as f64 % per_row, (i as f64 / per_row).floor());
                let at = [14.0 + column * names, frame.bottom + 48.0 + row * ROW];
                parts.extend(sign(curve, at));
                parts.push(text([at[0] + 12.0, at[1]], &curve.name, ink(curve), Anchor::Start, false));
            }
        }
        let mut curves: Vec<Shape> =
            self.curves.iter().zip(parts).map(|(curve, shapes)| Shape::Curve { faint: curve.faint, shapes }).collect();
        // Those to look at lie on top.
        curves.sort_by_key(|curve| !matches!(curve, Shape::Curve { faint: true, .. }));
        shapes.extend(curves);
        Drawing { width, height: frame.bottom + 42.0 + legend, title: self.title.clone(), shapes }
    }
}

/// A curve's line and marks.
fn drawn(curve: &Curve, points: &[[f64; 2]]) -> Vec<Shape> {
    let (dash, width) = (curve.guide.then_some([5.0, 4.0]), if curve.guide || curve.faint { 1.0 } else { 1.8 });
    let mut shapes = vec![Shape::Line { points: points.to_vec(), ink: ink(curve), width, dash }];
    if !curve.guide {
        shapes.extend(points.iter().map(|&p| marker(curve.look, p, if curve.faint { 3.0 } else { 4.0 })));
    }
    shapes
}

fn ink(curve: &Curve) -> Ink {
    if curve.guide { Ink::Muted } else { Ink::Curve(curve.look) }
}

/// What stands before a curve's name.
fn sign(curve: &Curve, at: [f64; 2]) -> Option<Shape> {
    if curve.guide {
        return Some(Shape::Line {
            points: vec![[at[0] - 6.0, at[1]], [at[0] + 7.0, at[1]]],
            ink: Ink::Muted,
            width: 1.0,
            dash: Some([4.0, 3.0]),
        });
    }
    Some(marker(curve.look, at, 4.0))
}

pub(in crate::study) fn text(at: [f64; 2], text: &str, ink: Ink, anchor: Anchor, bold: bool) -> Shape {
    Shape::Text { at, text: text.to_owned(), ink, anchor, bold, up: false }
}

/// The rectangle that curves are drawn in.
struct Frame {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

/// A tick of the lower axis: where it stands, its label, and where the label's middle is.
struct Tick {
    at: f64,
    label: Option<String>,
    middle: f64,
}

impl Tick {
    /// Half of the label's width.
    fn half(&self) -> f64 {
        self.label.as_ref().map_or(0.0, |l| 0.5 * ADVANCE * l.chars().count() as f64)
    }
}

/// Whether no label lies on another, with a little air between them.
fn apart(ticks: &[Tick]) -> bool {
    let mut named: Vec<&Tick> = ticks.iter().filter(|t| t.label.is_some()).collect();
    named.sort_by(|a, b| a.middle.total_cmp(&b.middle));
    named.windows(2).all(|w| w[1].middle - w[0].middle >= w[0].half() + w[1].half() + 4.0)
}

impl Frame {
    /// The ticks of the lower axis with `most` labels. Labels at its ends are moved into the drawing.
    fn ticks_below(&self, ticks: Ticks, span: Span, most: usize) -> Vec<Tick> {
        let place = |(value, label)| {
            let at = self.left + span.place(value) * (self.right - self.left);
            let tick = Tick { at, label, middle: at };
            let middle = at.min(self.right + 10.0 - tick.half()).max(tick.half());
            Tick { middle, ..tick }
        };
        span.ticks(ticks, most).into_iter().map(place).collect()
    }

    fn axes(&self, chart: &Chart, [x, y]: [Span; 2], shapes: &mut Vec<Shape>) {
        let line = |a: [f64; 2], b: [f64; 2], ink| Shape::Line { points: vec![a, b], ink, width: 1.0, dash: None };
        // As many labels as lie beside each other.
        let most = ((self.right - self.left) / 56.0) as usize;
        let ticks = (1..=most).rev().map(|most| self.ticks_below(chart.x.ticks, x, most)).find(|t| apart(t));
        for Tick { at, label, middle } in ticks.unwrap_or_else(|| self.ticks_below(chart.x.ticks, x, 1)) {
            shapes.push(line([at, self.top], [at, self.bottom], Ink::Grid));
            if let Some(label) = label {
                shapes.push(text([middle, self.bottom + 13.0], &label, Ink::Muted, Anchor::Middle, false));
            }
        }
        for (value, label) in y.ticks(chart.y.ticks, ((self.bottom - self.top) / 26.0) as usize) {
            let at = self.bottom - y.place(value) * (self.bottom - self.top);
            shapes.push(line([self.left, at], [self.right, at], Ink::Grid));
            if let Some(label) = label {
                shapes.push(text([self.left - 7.0, at], &label, Ink::Muted, Anchor::End, false));
            }
        }
        shapes.push(Shape::Line {
            points: vec![[self.left, self.top], [self.left, self.bottom], [self.right, self.bottom]],
            ink: Ink::Muted,
            width: 1.0,
            dash: None,
        });
        let middle = [0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)];
        shapes.push(text([middle[0], self.bottom + 31.0], &chart.x.label, Ink::Text, Anchor::Middle, false));
        shapes.push(Shape::Text {
            at: [11.0, middle[1]],
            text: chart.y.label.clone(),
            ink: Ink::Text,
            anchor: Anchor::Middle,
            bold: false,
            up: true,
        });
    }

    /// Names beside the last points, moved apart where they would lie on each other.
    fn names_beside(&self, curves: &[Curve], shown: &[Vec<[f64; 2]>], parts: &mut [Vec<Shape>]) {
        let mut list: Vec<(usize, [f64; 2])> =
            shown.iter().enumerate().filter_map(|(i, points)| Some((i, *points.iter().max_by(|a, b| a[0].total_cmp(&b[0]))?))).collect();
        list.sort_by(|a, b| a.1[1].total_cmp(&b.1[1]).then(a.0.cmp(&b.0)));
        let mut heights: Vec<f64> = list.iter().map(|l| l.1[1]).collect();
        // Down past the one above, then up again from the bottom.
        for i in 1..heights.len() {
            heights[i] = heights[i].max(heights[i - 1] + ROW);
        }
        let mut floor = self.bottom;
        for h in heights.iter_mut().rev() {
            *h = h.min(floor);
            floor = *h - ROW;
        }
        for (&(i, end), &h) in list.iter().zip(&heights) {
            let (curve, shapes, at) = (&curves[i], &mut parts[i], [self.right + 18.0, h]);
            let points = vec![[end[0] + 6.0, end[1]], [self.right + 4.0, h], [at[0] - 7.0, h]];
            shapes.push(Shape::Line { points, ink: Ink::Grid, width: 1.0, dash: None });
            shapes.extend(sign(curve, at));
            shapes.push(text([at[0] + FONT, at[1]], &curve.name, ink(curve), Anchor::Start, false));
        }
    }
}
