//! What is drawn on cut pictures.

use super::canvas::{Area, Canvas};
use super::{axes, scale_bar, text, title_at_the_top};
use crate::cut::Drawn;
use crate::picture::Picture;
use crate::scene::Annotations;
use crate::{Error, Result};

/// The picture of `drawn` with `annotations` on it: the title over all, letters or axes in the first cut, the scale bar in the last one, the
/// position in each. With it, what the user should hear, one line each.
///
/// # Errors
/// [`Error::Invalid`] for a colour bar or the box's edges, which cut pictures do not have, and where this machine does not give the memory.
pub fn annotate_cuts(drawn: &Drawn, annotations: &Annotations) -> Result<(Picture, Vec<String>)> {
    for (name, wanted) in [("colorbar", annotations.colorbar), ("box", annotations.box_edges)] {
        if wanted {
            return Err(Error::invalid(format!("annotate.{name}: cut pictures have none")));
        }
    }
    let (layout, mut canvas) = (&drawn.layout, Canvas::new(&drawn.picture)?);
    let frame = layout.frame();
    let cell = |n: usize| {
        let [left, top, width, height] = layout.cell(n).map(f64::from);
        Area::new(left, top, width, height)
    };
    if let Some(title) = &annotations.title {
        title_at_the_top(&mut canvas, title);
    }
    if annotations.position {
        for (n, &offset) in layout.offsets().iter().enumerate() {
            let (part, said) = (cell(n), frame.position(offset));
            let height = canvas.text_height(part);
            let wanted = Area::new(part.left + 0.4 * height, part.top + 0.3 * height, text::width(&said, height), height);
            if let Some(area) = canvas.place("position", wanted, [0.0, 1.0], part) {
                let ink = canvas.ink(area);
                canvas.text([area.left, area.top], &said, height, false, ink);
            }
        }
    }
    if annotations.scale_bar {
        scale_bar::draw(&mut canvas, cell(layout.offsets().len() - 1), layout.scale(), frame.space, "");
    }
    if annotations.axes {
        axes::draw(&mut canvas, cell(0), frame.space, frame.right, frame.up);
    }
    Ok(canvas.finish())
}
