//! A bar of a round length in the world, in the lower right corner.

use super::canvas::{Area, Canvas};
use super::numbers::{round_below, said};
use super::text;
use crate::scene::View;
use crate::volume::{Grid, Space};

/// Share of the width that the bar takes at most.
const SHARE: f64 = 0.24;

/// The bar of a scene: in perspective its length holds at the depth of the box's centre.
pub(super) fn of_view(canvas: &mut Canvas<'_>, part: Area, view: &View, grid: &Grid) {
    let depth = view.depth(grid.center());
    if view.perspective && depth <= view.near {
        canvas.warn("annotate.scale_bar: the box's centre lies behind the eye, left out".to_owned());
        return;
    }
    let scale = if view.perspective { view.scale * depth } else { view.scale };
    let where_it_holds = if view.perspective { " at box centre" } else { "" };
    draw(canvas, part, scale, grid.space(), where_it_holds);
}

/// A bar where a pixel is `scale` world units wide.
pub(super) fn draw(canvas: &mut Canvas<'_>, part: Area, scale: f64, space: Space, where_it_holds: &str) {
    let height = canvas.text_height(part);
    let Some(length) = round_below(SHARE * part.width() * scale) else {
        canvas.warn(format!("annotate.scale_bar: a pixel of {scale} world units has no round number, left out"));
        return;
    };
    let bar = length / scale;
    let unit = if space == Space::Unknown { "units" } else { "mm" };
    let label = format!("{} {unit}{where_it_holds}", said(length, length));
    let label_width = text::width(&label, height);
    let (width, margin) = (bar.max(label_width), 0.7 * height);
    let wanted = Area::new(part.right - margin - width, part.bottom - 2.2 * height, width, 1.7 * height);
    let Some(area) = canvas.place("scale_bar", wanted, [-1.0, 0.0], part) else { return };
    let ink = canvas.ink(area);
    let left = area.right - 0.5 * width - 0.5 * bar;
    let right = left + bar;
    // In the middle of a row of pixels, so that a thin line is not spread over two.
    let (y, end) = ((area.bottom - 0.25 * height).floor() + 0.5, 0.25 * height);
    let points = [[left, y - end], [left, y], [right, y], [right, y - end]];
    canvas.line(&points, ink, Canvas::line_width(height), None, 1.0);
    canvas.text([area.left + 0.5 * (width - label_width), area.top], &label, height, false, ink);
}
