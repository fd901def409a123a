//! What is drawn on a finished picture: a colour bar, a scale bar, orientation letters or axes, a title, the box's edges.
//!
//! ```text
//!  Picture ---------------------------------------------+
//!  Scene, Volume --> shapes, text --> 8-bit layer --over--> annotated picture
//! ```
//! The layer is drawn by tiny-skia with 8 bits a component and then laid over the picture's premultiplied f32 numbers as they are: sRGB numbers
//! for a scene in linear light too, because pictures always hold those. So a picture keeps its 16 bits or its floats wherever nothing is drawn,
//! to the bit. Each text and line has an edge in the opposite brightness, and is light where the picture under it is dark.
//!
//! Sizes follow the picture: text is 12 pixels high in small pictures, and about a fortieth of the side in large ones. What does not fit is left
//! out, and said.

mod axes;
mod box_edges;
mod canvas;
mod colorbar;
mod cuts;
mod numbers;
mod scale_bar;
#[cfg(test)]
mod tests;
mod text;

pub use cuts::annotate_cuts;

use crate::picture::Picture;
use crate::scene::{Annotations, Scene};
use crate::volume::Volume;
use crate::{Error, Result};
use canvas::{Area, Canvas};

/// Why volumes of colours have no colour bar.
const NO_VALUES: &str = "annotate.colorbar: voxels that are colours have no values, which a bar would show";

/// Refuses what cannot be drawn for `scene`, before it is rendered.
///
/// # Errors
/// [`Error::Invalid`] for a colour bar where colours do not follow from the value alone.
pub fn check(annotations: &Annotations, scene: &Scene) -> Result<()> {
    if annotations.colorbar && scene.transfer2d().is_some() {
        return Err(Error::invalid("annotate.colorbar: the colours follow from value and gradient, which no bar of values can show"));
    }
    if annotations.colorbar && scene.opacity_from().is_some() {
        return Err(Error::invalid(NO_VALUES));
    }
    if annotations.colorbar && scene.levels().iter().any(|level| level.color().is_some()) {
        return Err(Error::invalid(
            "annotate.colorbar: surfaces have colours of their own, which the transfer function's bar does not show",
        ));
    }
    Ok(())
}

/// `picture`, which `scene` shows of `volume`, with `annotations` drawn on it; and what the user should hear about them, one line each.
///
/// # Errors
/// As [`check`]; [`Error::Invalid`] when the picture has not the scene's size or this machine does not give the memory.
pub fn annotate(picture: &Picture, annotations: &Annotations, scene: &Scene, volume: &Volume) -> Result<(Picture, Vec<String>)> {
    check(annotations, scene)?;
    if annotations.colorbar && volume.colors().is_some() {
        return Err(Error::invalid(NO_VALUES));
    }
    let (width, height) = scene.size();
    if (picture.width(), picture.height()) != (width, height) {
        let given = (picture.width(), picture.height());
        return Err(Error::invalid(format!("annotate: a picture of {} x {} for a scene of {width} x {height}", given.0, given.1)));
    }
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let mut canvas = Canvas::new(picture)?;
    let all = canvas.all();
    if annotations.box_edges {
        box_edges::draw(&mut canvas, volume.grid(), &view);
    }
    if let Some(title) = &annotations.title {
        title_at_the_top(&mut canvas, title);
    }
    if annotations.colorbar {
        colorbar::draw(&mut canvas, all, scene, volume);
    }
    if annotations.scale_bar {
        scale_bar::of_view(&mut canvas, all, &view, volume.grid());
    }
    if annotations.axes {
        axes::draw(&mut canvas, all, volume.grid().space(), view.right, view.up);
    }
    Ok(canvas.finish())
}

/// A line of text in the middle of the upper side, made smaller and then cut where it is too long.
fn title_at_the_top(canvas: &mut Canvas<'_>, title: &str) {
    let title: String = title.trim().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let all = canvas.all();
    let full = 1.25 * canvas.text_height(all);
    let room = all.width() - full;
    let height = (full * room / text::width(&title, full)).clamp(12.0f64.min(full), full);
    let fits = (room / text::width("x", height)) as usize;
    let shown = if title.chars().count() <= fits {
        title.clone()
    } else {
        let cut: String = title.chars().take(fits.saturating_sub(3)).collect();
        canvas.warn(format!("annotate.title: only {} of its {} letters fit", cut.chars().count(), title.chars().count()));
        cut + "..."
    };
    if let Some(strange) = title.chars().find(|c| !text::has(*c)) {
        canvas.warn(format!("annotate.title: the font has no {strange:?}, a question mark stands there"));
    }
    let width = text::width(&shown, height);
    let wanted = Area::new(0.5 * (all.width() - width), 0.4 * height, width, height);
    if let Some(area) = canvas.place("title", wanted, [0.0, 1.0], all) {
        let ink = canvas.ink(area);
        canvas.text([area.left, area.top], &shown, height, true, ink);
    }
}
