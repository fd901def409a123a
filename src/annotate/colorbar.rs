//! The transfer function beside the picture: its colours from low values to high ones, and its opacity as a curve beside them.

use super::canvas::{Area, Canvas};
use super::numbers::{roughly, said, ticks};
use super::text;
use crate::scene::{Scene, TransferFunction};
use crate::volume::{Modality, Volume};

/// The values that the bar spans: those of the data that the transfer function shows, and a twentieth more on both sides.
fn range(transfer: &TransferFunction, volume: &Volume) -> (f64, f64) {
    let s = volume.statistics();
    let (min, max) = (s.min, s.max);
    let shown = |v: f64| transfer.eval(v).alpha > 0.0;
    let points = transfer.opacity();
    let last = points.len() - 1;
    // Up to the points between which opacity rises from 0 and falls to it.
    let low = if shown(min) { min } else { points.iter().position(|p| p.1 > 0.0).map_or(min, |n| points[n.saturating_sub(1)].0) };
    let high = if shown(max) { max } else { points.iter().rposition(|p| p.1 > 0.0).map_or(max, |n| points[(n + 1).min(last)].0) };
    let (low, high) = (low.clamp(min, max), high.clamp(min, max));
    let air = 0.05 * (high - low);
    match ((low - air).max(min), (high + air).min(max)) {
        (low, high) if low < high && (high - low).is_finite() => (low, high),
        _ => {
            let half = 0.5f64.max(min.abs() * 1e-6);
            (min - half, min + half)
        }
    }
}

/// Draws the bar at the right side of `part`.
pub(super) fn draw(canvas: &mut Canvas<'_>, part: Area, scene: &Scene, volume: &Volume) {
    let transfer = scene.transfer();
    let (low, high) = range(transfer, volume);
    let height = canvas.text_height(part);
    let length = (0.5 * part.height()).round();
    let (list, step) = ticks(low, high, ((length / (1.9 * height)) as usize).clamp(1, 8));
    let labels: Vec<(f64, String)> = list.iter().map(|&v| (v, said(v, step))).collect();
    let longest = labels.iter().map(|l| text::width(&l.1, height)).fold(0.0, f64::max);
    let bar_width = (1.1 * height).round();
    let (curve_width, gap) = (2.2 * height, 0.5 * height);
    let small = (0.85 * height).max(11.0);
    let alphas: Vec<f64> = (0..=length as usize).map(|n| transfer.eval(high + (low - high) * (n as f64 / length.max(1.0))).alpha).collect();
    let most = alphas.iter().copied().fold(0.0, f64::max);
    let caption = if most > 0.0 { format!("opacity to {}", roughly(most)) } else { String::new() };
    let unit = if volume.modality() == Modality::Ct { "HU" } else { "" };
    let width = (curve_width + bar_width + gap + longest).max(text::width(&caption, small));
    let (above, below) = (if unit.is_empty() { 0.5 * height } else { 1.5 * height }, 0.6 * height + small);
    let wanted =
        Area::new(part.right - 0.7 * height - width, part.top + 0.5 * (part.height() - length) - above, width, above + length + below);
    let Some(area) = canvas.place("colorbar", wanted, [0.0, 1.0], part) else { return };
    let ink = canvas.ink(area);
    let right = (area.right - gap - longest).round();
    let (left, top) = (right - bar_width, (area.top + above).round());
    // The curve: opaque is left.
    let at = |n: usize| [left - curve_width * if most > 0.0 { alphas[n] / most } else { 0.0 }, top + n as f64];
    if most > 0.0 {
        let curve: Vec<[f64; 2]> = (0..alphas.len()).map(at).collect();
        let outline: Vec<[f64; 2]> = [[left, top]].into_iter().chain(curve.iter().copied()).chain([[left, top + length]]).collect();
        canvas.fill(&outline, ink.rgb, 0.3);
        canvas.line(&curve, ink, 0.8 * Canvas::line_width(height), None, 1.0);
    }
    for n in 0..length as usize {
        let value = high + (low - high) * ((n as f64 + 0.5) / length);
        let rgb = transfer.eval(value).rgb.map(|c| (c * 255.0 + 0.5) as u8);
        let (y, z) = (top + n as f64, top + n as f64 + 1.0);
        canvas.fill(&[[left, y], [right, y], [right, z], [left, z]], rgb, 1.0);
    }
    let line = 0.7 * Canvas::line_width(height);
    let corners = [[left, top], [right, top], [right, top + length], [left, top + length], [left, top]];
    canvas.line(&corners, ink, line, None, 1.0);
    for (value, label) in &labels {
        let y = place(*value, low, high, top, length);
        canvas.line(&[[right, y], [right + 0.3 * height, y]], ink, line, None, 1.0);
        canvas.text([right + gap, y - 0.5 * height], label, height, false, ink);
    }
    if !unit.is_empty() {
        canvas.text([right + gap, area.top], unit, height, false, ink);
    }
    canvas.text([area.right - text::width(&caption, small), area.bottom - small], &caption, small, false, ink);
}

/// The height at which a bar from `top` on, `length` long, shows `value`.
pub(super) fn place(value: f64, low: f64, high: f64, top: f64, length: f64) -> f64 {
    top + length * (high - value) / (high - low)
}
