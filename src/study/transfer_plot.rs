//! A picture of a transfer function: its opacity, its colours, its gradient opacity, over the data's histogram.

use super::plot::{Anchor, Drawing, Ink, Panel, Shape, text, ticks};
use crate::Result;
use crate::scene::TransferFunction;
use crate::volume::Statistics;

/// What the axes are named by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Units {
    /// Data units and world units, whatever they are.
    #[default]
    Unknown,
    /// Hounsfield units and millimetres.
    Hounsfield,
}

impl Units {
    pub(super) fn value(self) -> &'static str {
        if self == Self::Hounsfield { "value (HU)" } else { "value (data units)" }
    }

    pub(super) fn gradient(self) -> &'static str {
        if self == Self::Hounsfield { "size of the gradient (HU per mm)" } else { "size of the gradient (data units per world unit)" }
    }

    fn length(self) -> &'static str {
        if self == Self::Hounsfield { "mm" } else { "world unit" }
    }
}

const WIDTH: f64 = 900.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = WIDTH - 64.0;
const BARS: [u8; 3] = [208, 216, 226];

/// `transfer` as a PNG file: opacity over values with its points, a bar of its colours below, and the gradient opacity in a plot of its own where
/// there is one. Behind the curve stands the histogram of `statistics`, on a logarithmic scale; the plot then spans the data's range, otherwise
/// that of the points.
///
/// # Errors
/// [`crate::Error::Invalid`] when the picture cannot be encoded.
pub fn transfer_png(title: &str, transfer: &TransferFunction, statistics: Option<&Statistics>, units: Units) -> Result<Vec<u8>> {
    drawing(title, transfer, statistics, units).png()
}

fn drawing(title: &str, transfer: &TransferFunction, statistics: Option<&Statistics>, units: Units) -> Drawing {
    let statistics = statistics.filter(|s| s.histogram.iter().any(|&c| c > 0));
    let x = range(transfer, statistics);
    let curve = curve(transfer, x);
    let most = curve.iter().map(|p| p[1]).fold(0.0, f64::max);
    let most = if most > 0.0 { most } else { 1.0 };
    // Up to the first round number at or above the greatest opacity.
    let (_, step) = ticks([0.0, most], 5);
    let panel = Panel { left: LEFT, top: 34.0, right: RIGHT, bottom: 334.0, x, y: [0.0, ((most / step - 1e-9).ceil() * step).min(1.0)] };
    let mut shapes = vec![text([LEFT, 16.0], title, Ink::Text, Anchor::Start, true)];
    if let Some(statistics) = statistics {
        histogram(&panel, statistics, &mut shapes);
    }
    let length = transfer.unit().map_or("smallest voxel spacing".to_owned(), |l| match l {
        1.0 => format!("1 {}", units.length()),
        l => format!("{} {}", short(l), units.length()),
    });
    panel.left_axis(&format!("opacity per {length}"), &mut shapes);
    panel.lower_axis(units.value(), 34.0, &mut shapes);
    panel.edges(&mut shapes);
    let points = curve.iter().map(|p| panel.place(p[0], p[1])).collect();
    shapes.push(Shape::Line { points, ink: Ink::Curve(0), width: 2.0, dash: None });
    // So many points that they touch would hide the curve.
    if transfer.opacity().len() <= 100 {
        let seen = transfer.opacity().iter().filter(|p| p.0 >= x[0] && p.0 <= x[1]);
        shapes.extend(seen.map(|&(v, a)| dot(panel.place(v, a))));
    }
    color_bar(&panel, transfer, &mut shapes);
    let mut height = panel.bottom + 80.0;
    if let Some(&(last, _)) = transfer.gradient_opacity().last() {
        let end = if last > 0.0 { last * 1.1 } else { 1.0 };
        let small = Panel { left: LEFT, top: height + 14.0, right: RIGHT, bottom: height + 114.0, x: [0.0, end], y: [0.0, 1.0] };
        small.left_axis("factor", &mut shapes);
        small.lower_axis(units.gradient(), 0.0, &mut shapes);
        small.edges(&mut shapes);
        let list = transfer.gradient_opacity();
        let ends = [(0.0, transfer.gradient_factor(0.0)), (end, transfer.gradient_factor(end))];
        let all = ends[..1].iter().chain(list).chain(&ends[1..]);
        let points = all.map(|&(g, f)| small.place(g, f)).collect();
        shapes.push(Shape::Line { points, ink: Ink::Curve(1), width: 2.0, dash: None });
        shapes.extend(list.iter().take(100).map(|&(g, f)| dot(small.place(g, f))));
        height = small.bottom + 46.0;
    }
    Drawing { width: WIDTH, height, title: title.to_owned(), shapes }
}

fn short(x: f64) -> String {
    let text = format!("{x:.4}");
    if x.abs() < 1e-3 { format!("{x:.3e}") } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

/// The values at the ends of the plot.
fn range(transfer: &TransferFunction, statistics: Option<&Statistics>) -> [f64; 2] {
    let knots = transfer.knots();
    let [lo, hi] = match statistics {
        Some(s) => [s.min, s.max],
        None => [knots[0], knots[knots.len() - 1]],
    };
    let air = if statistics.is_some() { 0.0 } else { 0.02 * (hi - lo) };
    match [lo - air, hi + air] {
        [a, b] if a < b && a.is_finite() && b.is_finite() => [a, b],
        // A single value, or numbers at the ends of f64.
        _ if lo < hi => [lo, hi],
        _ => [lo - lo.abs().max(1.0), lo + lo.abs().max(1.0)],
    }
}

/// Value and opacity along the curve.
fn curve(transfer: &TransferFunction, [lo, hi]: [f64; 2]) -> Vec<[f64; 2]> {
    let inside = transfer.opacity().iter().filter(|p| p.0 > lo && p.0 < hi).map(|&(v, a)| [v, a]);
    let end = |v: f64| [v, transfer.eval(v).alpha];
    std::iter::once(end(lo)).chain(inside).chain([end(hi)]).collect()
}

fn dot([x, y]: [f64; 2]) -> Shape {
    super::plot::marker(0, [x, y], 3.5)
}

/// Bars of log counts, and powers of ten along the right side.
fn histogram(panel: &Panel, s: &Statistics, shapes: &mut Vec<Shape>) {
    let most = s.histogram.iter().copied().max().unwrap_or(1) as f64;
    let top = (most * 1.2).log10().max(0.5);
    let height = |count: f64| panel.bottom - (count.log10() / top).clamp(0.0, 1.0) * (panel.bottom - panel.top);
    let bins = s.histogram.len() as f64;
    for (i, &count) in s.histogram.iter().enumerate().filter(|b| *b.1 > 0) {
        let at = |k: f64| panel.left + k / bins * (panel.right - panel.left);
        // One voxel shows as a low bar.
        let (left, right, y) = (at(i as f64), at(i as f64 + 1.0), height(count as f64).min(panel.bottom - 2.0));
        let points = vec![[left, panel.bottom], [left, y], [right, y], [right, panel.bottom]];
        shapes.push(Shape::Area { points, fill: Ink::Exact(BARS), edge: None });
    }
    let every = (top / 5.0).ceil().max(1.0) as usize;
    for power in (0..=top.floor() as i32).step_by(every) {
        let label = if power < 4 { format!("{}", 10f64.powi(power)) } else { format!("1e{power}") };
        shapes.push(text([panel.right + 7.0, height(10f64.powi(power))], &label, Ink::Muted, Anchor::Start, false));
    }
    let at = [WIDTH - 11.0, 0.5 * (panel.top + panel.bottom)];
    shapes.push(Shape::Text { at, text: "voxels (log scale)".into(), ink: Ink::Text, anchor: Anchor::Middle, bold: false, up: true });
}

/// The colours under the plot, straight.
fn color_bar(panel: &Panel, transfer: &TransferFunction, shapes: &mut Vec<Shape>) {
    let (top, bottom) = (panel.bottom + 8.0, panel.bottom + 30.0);
    let cells = (panel.right - panel.left) as usize;
    for i in 0..cells {
        let part = (i as f64 + 0.5) / cells as f64;
        let rgb = transfer.eval(panel.x[0] * (1.0 - part) + panel.x[1] * part).rgb.map(|c| (c * 255.0 + 0.5) as u8);
        let (left, right) = (panel.left + i as f64, panel.left + i as f64 + 1.0);
        let points = vec![[left, top], [right, top], [right, bottom], [left, bottom]];
        shapes.push(Shape::Area { points, fill: Ink::Exact(rgb), edge: None });
    }
    let corners = [[panel.left, top], [panel.right, top], [panel.right, bottom], [panel.left, bottom], [panel.left, top]];
    shapes.push(Shape::Line { points: corners.to_vec(), ink: Ink::Muted, width: 1.0, dash: None });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, Voxels};

    fn picture(transfer: &TransferFunction, statistics: Option<&Statistics>) -> crate::Picture {
        let bytes = transfer_png("a title", transfer, statistics, Units::Hounsfield).expect("a picture");
        crate::Picture::decode(&bytes, "plot").expect("a PNG file")
    }

    #[test]
    fn bars_curve_and_colours_are_in_the_picture() {
        let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.0, 0.0]), (100.0, [0.0, 0.0, 1.0])], vec![(20.0, 0.0), (80.0, 0.05)])
            .expect("transfer");
        let values: Vec<u8> = (0..=100).chain([50; 900]).collect();
        let grid = Grid::with_spacing([values.len(), 1, 1], [1.0; 3]).expect("grid");
        let volume = crate::Volume::new(grid, Voxels::U8(values.into())).expect("volume");
        let plain = picture(&transfer, Some(volume.statistics()));
        let near = |p: [f32; 4], rgb: [f32; 3]| (0..3).all(|c| (p[c] - rgb[c]).abs() < 0.03);
        // The ends of the colour bar, two pixels to a unit.
        assert!(near(plain.pixel(2 * 66, 2 * 352), [0.99, 0.0, 0.01]), "{:?}", plain.pixel(2 * 66, 2 * 352));
        assert!(near(plain.pixel(2 * 834, 2 * 352), [0.0, 0.0, 0.99]));
        let bars = plain.pixels().iter().filter(|p| near(**p, BARS.map(|c| f32::from(c) / 255.0))).count();
        assert!(bars > 1000, "{bars} pixels of bars");
        // A gradient opacity takes a plot of its own.
        let more = transfer.clone().with_gradient_opacity(vec![(0.0, 0.0), (50.0, 1.0)]).expect("points");
        assert!(picture(&more, None).height() > plain.height() + 200);
    }

    #[test]
    fn extreme_ranges_are_drawn() {
        let of = |points: Vec<(f64, f64)>| TransferFunction::new(vec![(points[0].0, [0.5; 3])], points).expect("transfer");
        for points in [vec![(7.0, 0.5)], vec![(0.0, 0.0)], vec![(-f64::MAX, 0.0), (f64::MAX, 1.0)], vec![(0.0, 0.0), (5e-324, 1e-300)]] {
            let drawing = drawing("x", &of(points), None, Units::Unknown);
            let finite = |p: &[f64; 2]| p[0].is_finite() && p[1].is_finite();
            for shape in drawing.shapes.iter().flat_map(Shape::parts) {
                assert!(match shape {
                    Shape::Line { points, .. } | Shape::Area { points, .. } => points.iter().all(finite),
                    Shape::Text { at, .. } | Shape::Image { at, .. } => finite(at),
                    Shape::Curve { .. } => false,
                });
            }
        }
    }
}
