//! The layer that annotations are drawn on, and which parts of it are taken.

use super::text::Mask;
use crate::picture::Picture;
use crate::{Error, Result};
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, PixmapMut, Stroke, StrokeDash, Transform};

/// A rectangle in pixels from the upper left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    pub(super) fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self { left, top, right: left + width, bottom: top + height }
    }

    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    fn meets(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    fn within(&self, other: &Self) -> bool {
        self.left >= other.left && self.right <= other.right && self.top >= other.top && self.bottom <= other.bottom
    }

    fn moved(&self, [x, y]: [f64; 2]) -> Self {
        Self { left: self.left + x, right: self.right + x, top: self.top + y, bottom: self.bottom + y }
    }
}

/// A colour to draw in, and the colour of the edge around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ink {
    pub(super) rgb: [u8; 3],
    pub(super) edge: [u8; 3],
}

const LIGHT: Ink = Ink { rgb: [244; 3], edge: [12; 3] };
const DARK: Ink = Ink { rgb: [16; 3], edge: [250; 3] };

/// Opacity of the edges of text and of lines.
const TEXT_EDGE: f32 = 0.8;
const LINE_EDGE: f32 = 0.5;

/// How bright a transparent pixel counts, where inks are chosen: most pages are light.
const PAGE: f32 = 0.7;

/// A layer over a picture.
pub(super) struct Canvas<'p> {
    picture: &'p Picture,
    /// Premultiplied RGBA.
    layer: Vec<u8>,
    taken: Vec<Area>,
    warnings: Vec<String>,
}

impl<'p> Canvas<'p> {
    /// An empty layer over `picture`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when this machine does not give the memory.
    pub(super) fn new(picture: &'p Picture) -> Result<Self> {
        let bytes = 4 * picture.pixels().len();
        let mut layer = Vec::new();
        if crate::memory::reserve(&mut layer, bytes).is_err() {
            return Err(Error::invalid(format!("annotate: {bytes} bytes, this machine does not give that much memory")));
        }
        layer.resize(bytes, 0);
        Ok(Self { picture, layer, taken: Vec::new(), warnings: Vec::new() })
    }

    /// The whole picture.
    pub(super) fn all(&self) -> Area {
        Area::new(0.0, 0.0, f64::from(self.picture.width()), f64::from(self.picture.height()))
    }

    /// How high text is in a part of the picture, pixels.
    pub(super) fn text_height(&self, part: Area) -> f64 {
        (0.024 * (part.width() * part.height()).sqrt()).max(12.0)
    }

    /// How thick lines are beside text of this height.
    pub(super) fn line_width(height: f64) -> f64 {
        (height / 10.0).max(1.2)
    }

    pub(super) fn warn(&mut self, text: String) {
        self.warnings.push(text);
    }

    /// Takes `wanted` for an annotation, or the first place from there in direction `step` where it lies clear of the others. `None`, with a
    /// warning, where there is none inside `part`.
    pub(super) fn place(&mut self, name: &str, wanted: Area, step: [f64; 2], part: Area) -> Option<Area> {
        let mut area = wanted;
        while area.within(&part) {
            if !self.taken.iter().any(|t| t.meets(&area)) {
                self.taken.push(area);
                return Some(area);
            }
            area = area.moved([2.0 * step[0], 2.0 * step[1]]);
        }
        let (width, height) = (part.width(), part.height());
        self.warn(format!("annotate.{name}: no room for it in {width} x {height} pixels, left out"));
        None
    }

    /// The ink that shows on what the picture holds in `area`.
    pub(super) fn ink(&self, area: Area) -> Ink {
        let (width, height) = (self.picture.width(), self.picture.height());
        let column = |x: f64| (x.max(0.0) as u32).min(width - 1);
        let row = |y: f64| (y.max(0.0) as u32).min(height - 1);
        let (mut sum, mut count) = (0.0f64, 0u32);
        for y in row(area.top)..=row(area.bottom) {
            for x in column(area.left)..=column(area.right) {
                let [r, g, b, alpha] = self.picture.pixel(x, y);
                let light = 0.2126 * r + 0.7152 * g + 0.0722 * b + (1.0 - alpha) * PAGE;
                sum += f64::from(light.clamp(0.0, 1.0));
                count += 1;
            }
        }
        if sum < 0.55 * f64::from(count) { LIGHT } else { DARK }
    }

    /// The ink that shows on the picture's rim.
    pub(super) fn ink_of_rim(&self) -> Ink {
        let all = self.all();
        let rows = [Area { bottom: 0.0, ..all }, Area { top: all.bottom, ..all }];
        let columns = [Area { right: 0.0, ..all }, Area { left: all.right, ..all }];
        let light = rows.into_iter().chain(columns).filter(|side| self.ink(*side) == LIGHT).count();
        if light >= 2 { LIGHT } else { DARK }
    }

    /// A line through `points`, with dashes as (on, off); `strength` is its opacity.
    pub(super) fn line(&mut self, points: &[[f64; 2]], ink: Ink, width: f64, dash: Option<[f64; 2]>, strength: f32) {
        let Some(path) = path(points, false) else { return };
        let dash = || dash.and_then(|[on, off]| StrokeDash::new(vec![on as f32, off as f32], 0.0));
        let edge = (width * 0.5).max(1.0);
        for (rgb, width, alpha) in [(ink.edge, width + 2.0 * edge, LINE_EDGE * strength), (ink.rgb, width, strength)] {
            let stroke =
                Stroke { width: width as f32, dash: dash(), line_cap: LineCap::Butt, line_join: LineJoin::Miter, ..Stroke::default() };
            if let Some(mut pixmap) = self.pixmap() {
                pixmap.stroke_path(&path, &paint(rgb, alpha), &stroke, Transform::identity(), None);
            }
        }
    }

    /// A filled outline.
    pub(super) fn fill(&mut self, points: &[[f64; 2]], rgb: [u8; 3], strength: f32) {
        let Some(path) = path(points, true) else { return };
        if let Some(mut pixmap) = self.pixmap() {
            pixmap.fill_path(&path, &paint(rgb, strength), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Text whose upper left corner lies at `at`, `height` pixels high.
    pub(super) fn text(&mut self, at: [f64; 2], text: &str, height: f64, bold: bool, ink: Ink) {
        let radius = (height / 12.0).round().max(1.0) as usize;
        let mask = Mask::new(text, height, bold, radius);
        let [x, y] = at.map(|p| p.round() as i64 - radius as i64);
        self.stamp(&mask.grown(radius), [x, y], ink.edge, TEXT_EDGE);
        self.stamp(&mask, [x, y], ink.rgb, 1.0);
    }

    /// Lays a colour over the layer where `mask` covers it.
    fn stamp(&mut self, mask: &Mask, [left, top]: [i64; 2], rgb: [u8; 3], strength: f32) {
        let (width, height) = (i64::from(self.picture.width()), i64::from(self.picture.height()));
        for (n, &cover) in mask.cover.iter().enumerate().filter(|c| *c.1 > 0.0) {
            let (x, y) = (left + (n % mask.width) as i64, top + (n / mask.width) as i64);
            if x < 0 || y < 0 || x >= width || y >= height {
                continue;
            }
            let a = (cover * strength).min(1.0);
            let at = 4 * (y * width + x) as usize;
            let color = [f32::from(rgb[0]), f32::from(rgb[1]), f32::from(rgb[2]), 255.0];
            for (to, c) in self.layer[at..at + 4].iter_mut().zip(color) {
                *to = (c * a + f32::from(*to) * (1.0 - a) + 0.5) as u8;
            }
        }
    }

    fn pixmap(&mut self) -> Option<PixmapMut<'_>> {
        PixmapMut::from_bytes(&mut self.layer, self.picture.width(), self.picture.height())
    }

    /// The picture under the layer, and the warnings. Pixels on which nothing is drawn keep their bits.
    pub(super) fn finish(self) -> (Picture, Vec<String>) {
        let over = |(pixel, layer): (&[f32; 4], &[u8])| {
            if layer[3] == 0 {
                return *pixel;
            }
            let mut out = *pixel;
            let rest = 1.0 - f32::from(layer[3]) / 255.0;
            out.iter_mut().zip(layer).for_each(|(to, &c)| *to = f32::from(c) / 255.0 + rest * *to);
            out
        };
        let pixels = self.picture.pixels().iter().zip(self.layer.chunks_exact(4)).map(over).collect();
        (Picture::new(self.picture.width(), self.picture.height(), pixels), self.warnings)
    }
}

fn paint([r, g, b]: [u8; 3], alpha: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (alpha * 255.0 + 0.5) as u8);
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
