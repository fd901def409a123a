//! A drawing as pixels, two to a unit.

use super::{Anchor, Drawing, Ink, Shape};
use crate::picture::png::rgb8;
use crate::{Error, Picture, Result};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

/// Pixels to a unit: [`super::FONT`] is then the size that the bitmap font has.
const SCALE: f64 = 2.0;
const HEIGHT: RasterHeight = RasterHeight::Size24;

impl Drawing {
    /// The drawing on white, as a PNG file.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a drawing without area.
    pub(in crate::study) fn png(&self) -> Result<Vec<u8>> {
        let (width, height) = ((self.width * SCALE).ceil() as u32, (self.height * SCALE).ceil() as u32);
        let refused = || Error::invalid(format!("a plot of {width} x {height} pixels"));
        let mut pixels = Pixmap::new(width, height).ok_or_else(refused)?;
        pixels.fill(Color::WHITE);
        for shape in &self.shapes {
            draw(&mut pixels, shape, false)?;
        }
        // Everything lies on opaque white.
        let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        rgb8(width, height, &rgb)
    }
}

/// Draws `shape`, grey where it is part of a faint curve.
fn draw(pixels: &mut Pixmap, shape: &Shape, faint: bool) -> Result<()> {
    let view = Transform::from_scale(SCALE as f32, SCALE as f32);
    let shade = |ink: Ink| if faint { ink.faint() } else { ink };
    match shape {
        Shape::Line { points, ink, width, dash } => {
            let Some(path) = path(points, false) else { return Ok(()) };
            let dash = dash.and_then(|[on, off]| StrokeDash::new(vec![on as f32, off as f32], 0.0));
            let stroke = Stroke { width: *width as f32, dash, line_join: LineJoin::Round, line_cap: LineCap::Butt, ..Stroke::default() };
            pixels.stroke_path(&path, &paint(shade(*ink)), &stroke, view, None);
        }
        Shape::Area { points, fill, edge } => {
            let Some(path) = path(points, true) else { return Ok(()) };
            pixels.fill_path(&path, &paint(shade(*fill)), FillRule::Winding, view, None);
            if let Some(edge) = edge {
                pixels.stroke_path(&path, &paint(shade(*edge)), &Stroke { width: 1.3, ..Stroke::default() }, view, None);
            }
        }
        Shape::Text { at, text, ink, anchor, bold, up } => write(pixels, *at, text, shade(*ink), *anchor, *bold, *up),
        Shape::Image { at, size, png } => paste(pixels, *at, *size, &Picture::decode(png, "a picture of a drawing")?),
        Shape::Curve { faint: grey, shapes } => {
            for shape in shapes {
                draw(pixels, shape, faint || *grey)?;
            }
        }
    }
    Ok(())
}

/// Lays an opaque picture into the drawing; each of its pixels becomes a rectangle.
fn paste(pixels: &mut Pixmap, at: [f64; 2], size: [f64; 2], picture: &Picture) {
    let [left, top, right, bottom] = [at[0], at[1], at[0] + size[0], at[1] + size[1]].map(|x| (x * SCALE).round().max(0.0) as u32);
    let (columns, rows) = (u64::from(picture.width()), u64::from(picture.height()));
    let width = pixels.width();
    for y in top..bottom.min(pixels.height()) {
        for x in left..right.min(width) {
            let column = u64::from(x - left) * columns / u64::from(right - left);
            let row = u64::from(y - top) * rows / u64::from(bottom - top);
            let rgb = picture.pixel(column as u32, row as u32);
            let to = 4 * (y * width + x) as usize;
            for (byte, c) in pixels.data_mut()[to..to + 3].iter_mut().zip(rgb) {
                *byte = (c * 255.0 + 0.5) as u8;
            }
        }
    }
}

fn paint(ink: Ink) -> Paint<'static> {
    let [r, g, b] = ink.rgb();
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

fn path(points: &[[f64; 2]], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (i, &[x, y]) in points.iter().enumerate() {
        if i == 0 { builder.move_to(x as f32, y as f32) } else { builder.line_to(x as f32, y as f32) }
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

/// Writes `text` in the bitmap font; what it does not have becomes a question mark.
fn write(pixels: &mut Pixmap, [x, y]: [f64; 2], text: &str, ink: Ink, anchor: Anchor, bold: bool, up: bool) {
    let weight = if bold { FontWeight::Bold } else { FontWeight::Regular };
    let advance = get_raster_width(weight, HEIGHT);
    let length = advance * text.chars().count();
    let before = match anchor {
        Anchor::Start => 0,
        Anchor::Middle => length / 2,
        Anchor::End => length,
    };
    let rgb = ink.rgb();
    let (width, height) = (pixels.width() as i64, pixels.height() as i64);
    let (x, y) = ((x * SCALE).round() as i64, (y * SCALE).round() as i64);
    let half = HEIGHT.val() as i64 / 2;
    for (i, c) in text.chars().enumerate() {
        let Some(glyph) = get_raster(c, weight, HEIGHT).or_else(|| get_raster('?', weight, HEIGHT)) else { continue };
        for (row, line) in glyph.rows().enumerate() {
            for (column, &strength) in line.iter().enumerate() {
                let (along, across) = ((i * advance + column) as i64 - before as i64, row as i64 - half);
                let (px, py) = if up { (x + across, y - along) } else { (x + along, y + across) };
                if strength == 0 || px < 0 || py < 0 || px >= width || py >= height {
                    continue;
                }
                let at = 4 * (py * width + px) as usize;
                for (channel, &ink) in pixels.data_mut()[at..at + 3].iter_mut().zip(&rgb) {
                    let (a, b) = (u16::from(strength), 255 - u16::from(strength));
                    *channel = ((u16::from(ink) * a + u16::from(*channel) * b + 127) / 255) as u8;
                }
            }
        }
    }
}
