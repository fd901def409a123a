//! Which way the picture's sides lie: letters of the body at its four sides, or a cross of the world's axes in a corner.

use super::canvas::{Area, Canvas, Ink};
use super::text;
use crate::volume::Space;
use glam::DVec3;

/// Colours of the axes x, y and z, as most programs have them.
const AXES: [[u8; 3]; 3] = [[235, 84, 72], [88, 190, 84], [92, 148, 255]];

/// Letters or a cross for a picture whose right and up are these unit vectors of the world.
pub(super) fn draw(canvas: &mut Canvas<'_>, part: Area, space: Space, right: DVec3, up: DVec3) {
    if space == Space::Unknown { cross(canvas, part, right, up) } else { letters(canvas, part, space, right, up) }
}

fn letters(canvas: &mut Canvas<'_>, part: Area, space: Space, right: DVec3, up: DVec3) {
    let height = 1.15 * canvas.text_height(part);
    let margin = 0.5 * height;
    let (middle, center) = (0.5 * (part.left + part.right), 0.5 * (part.top + part.bottom));
    // Direction in the world, direction in the picture.
    for (direction, [x, y]) in [(right, [1.0, 0.0]), (-right, [-1.0, 0.0]), (up, [0.0, -1.0]), (-up, [0.0, 1.0])] {
        let Some(letters) = space.letters(direction) else { continue };
        let width = text::width(&letters, height);
        let at_x = middle + x * (0.5 * part.width() - margin - 0.5 * width) - 0.5 * width;
        let at_y = center + y * (0.5 * part.height() - margin - 0.5 * height) - 0.5 * height;
        // From its side inwards, past what stands there.
        let Some(area) = canvas.place("axes", Area::new(at_x, at_y, width, height), [-x, -y], part) else { continue };
        let ink = canvas.ink(area);
        canvas.text([area.left, area.top], &letters, height, true, ink);
    }
}

fn cross(canvas: &mut Canvas<'_>, part: Area, right: DVec3, up: DVec3) {
    let height = canvas.text_height(part);
    let length = 2.2 * height;
    let towards = right.cross(up);
    let letter = text::width("x", height);
    let mut axes = [0, 1, 2].map(|n| {
        let axis = DVec3::AXES[n];
        (n, [axis.dot(right), -axis.dot(up)], axis.dot(towards))
    });
    // The farthest first.
    axes.sort_by(|a, b| a.2.total_cmp(&b.2));
    // The way out between the axes, for the letter of one that points at the eye or away from it.
    let sum = axes.iter().fold([0.0, 0.0], |s, a| [s[0] + a.1[0], s[1] + a.1[1]]);
    let out = 0.85 * height / (sum[0] * sum[0] + sum[1] * sum[1]).sqrt().max(1e-9);
    // As large as what is drawn: the ends of the axes, and letters beyond them.
    let reach = |[x, y]: [f64; 2]| {
        let short = x * x + y * y < 0.1;
        if short { [-sum[0] * out, -sum[1] * out] } else { [x * (length + 0.75 * height), y * (length + 0.75 * height)] }
    };
    let bounds = axes.iter().map(|a| reach(a.1)).fold([0.0; 4], |b: [f64; 4], [x, y]| {
        [b[0].min(x - 0.5 * letter), b[1].min(y - 0.5 * height), b[2].max(x + 0.5 * letter), b[3].max(y + 0.5 * height)]
    });
    let (width, tall) = (bounds[2] - bounds[0], bounds[3] - bounds[1]);
    let wanted = Area::new(part.left + 0.5 * height, part.bottom - 0.5 * height - tall, width, tall);
    let Some(area) = canvas.place("axes", wanted, [0.0, -1.0], part) else { return };
    let ink = canvas.ink(area);
    let from = [area.left - bounds[0], area.top - bounds[1]];
    for (n, direction, _) in axes {
        let end = [from[0] + direction[0] * length, from[1] + direction[1] * length];
        canvas.line(&[from, end], Ink { rgb: AXES[n], edge: ink.edge }, 1.5 * Canvas::line_width(height), None, 1.0);
    }
    for (n, direction, _) in axes {
        let [x, y] = reach(direction);
        let at = [from[0] + x - 0.5 * letter, from[1] + y - 0.5 * height];
        let ink = canvas.ink(Area::new(at[0], at[1], letter, height));
        canvas.text(at, ["x", "y", "z"][n], height, true, ink);
    }
}
