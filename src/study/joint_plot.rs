//! A picture of a joint histogram: a cell for each bin, darker with the logarithm of its count.

use super::plot::{Anchor, Drawing, Ink, Panel, Shape, text};
use super::transfer_plot::Units;
use crate::Result;
use crate::scene::{ColorMap, TransferFunction};
use crate::volume::{JOINT_BINS, JointHistogram};

/// Shades between a bin of one voxel and the fullest one.
const SHADES: usize = 64;

/// Side of a bin in units of the drawing.
const SIDE: f64 = 2.0;

/// `joint` as a PNG file: values to the right over their range, sizes of the gradient upwards from 0 to the greatest, and what the shades mean.
///
/// # Errors
/// [`crate::Error::Invalid`] when the picture cannot be encoded.
pub fn joint_histogram_png(title: &str, joint: &JointHistogram, units: Units) -> Result<Vec<u8>> {
    let side = SIDE * JOINT_BINS as f64;
    let (left, top) = (72.0, 34.0);
    let span = |lo: f64, hi: f64| if lo < hi { [lo, hi] } else { [lo, lo + lo.abs().max(1.0)] };
    let [lo, hi] = joint.values();
    let panel = Panel { left, top, right: left + side, bottom: top + side, x: span(lo, hi), y: span(0.0, joint.greatest_gradient()) };
    let mut shapes = vec![text([left, 16.0], title, Ink::Text, Anchor::Start, true)];
    panel.left_axis(units.gradient(), &mut shapes);
    panel.lower_axis(units.value(), 0.0, &mut shapes);
    let most = (0..JOINT_BINS * JOINT_BINS).map(|i| joint.count(i % JOINT_BINS, i / JOINT_BINS)).max().unwrap_or(0);
    let top_log = (most.max(2) as f64).ln();
    let shades = TransferFunction::new(ColorMap::Viridis.spread(1.15, 0.0), vec![(0.0, 1.0)])?;
    let ink = |shade: usize| Ink::Exact(shades.eval(shade as f64 / (SHADES - 1) as f64).rgb.map(|c| (c * 255.0 + 0.5) as u8));
    let shade = |count: u64| (count > 0).then(|| ((count as f64).ln() / top_log * (SHADES - 1) as f64).round() as usize);
    for row in 0..JOINT_BINS {
        let shade_at = |column: usize| shade(joint.count(column, row));
        let bottom = panel.bottom - SIDE * row as f64;
        // Bins of one shade beside each other are one rectangle.
        let mut start = 0;
        for column in 1..=JOINT_BINS {
            if column < JOINT_BINS && shade_at(column) == shade_at(start) {
                continue;
            }
            if let Some(shade) = shade_at(start) {
                let (a, b) = (left + SIDE * start as f64, left + SIDE * column as f64);
                let points = vec![[a, bottom], [b, bottom], [b, bottom - SIDE], [a, bottom - SIDE]];
                shapes.push(Shape::Area { points, fill: ink(shade), edge: None });
            }
            start = column;
        }
    }
    panel.edges(&mut shapes);
    legend(&panel, most, &ink, &mut shapes);
    let drawing = Drawing { width: panel.right + 92.0, height: panel.bottom + 48.0, title: title.to_owned(), shapes };
    drawing.png()
}

/// The shades with their counts, right of the plot.
fn legend(panel: &Panel, most: u64, ink: &impl Fn(usize) -> Ink, shapes: &mut Vec<Shape>) {
    let (left, right, step) = (panel.right + 14.0, panel.right + 28.0, (panel.bottom - panel.top) / SHADES as f64);
    for shade in 0..SHADES {
        let bottom = panel.bottom - step * shade as f64;
        let points = vec![[left, bottom], [right, bottom], [right, bottom - step], [left, bottom - step]];
        shapes.push(Shape::Area { points, fill: ink(shade), edge: None });
    }
    let top_log = (most.max(2) as f64).log10();
    for power in 0..=top_log.floor() as i32 {
        let y = panel.bottom - f64::from(power) / top_log * (panel.bottom - panel.top);
        let label = if power < 4 { format!("{}", 10f64.powi(power)) } else { format!("1e{power}") };
        shapes.push(text([right + 6.0, y], &label, Ink::Muted, Anchor::Start, false));
    }
    let at = [right + 52.0, 0.5 * (panel.top + panel.bottom)];
    shapes.push(Shape::Text { at, text: "voxels (log scale)".into(), ink: Ink::Text, anchor: Anchor::Middle, bold: false, up: true });
}
