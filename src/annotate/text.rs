//! Text of any height from a font of bitmaps 24 pixels high.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

const HEIGHT: RasterHeight = RasterHeight::Size24;

/// How much of each pixel a text covers, 0 to 1.
#[derive(Debug, Clone)]
pub(super) struct Mask {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cover: Vec<f32>,
}

fn weight(bold: bool) -> FontWeight {
    if bold { FontWeight::Bold } else { FontWeight::Regular }
}

/// Whether the font has this character.
pub(super) fn has(c: char) -> bool {
    get_raster(c, FontWeight::Regular, HEIGHT).is_some()
}

/// How wide `text` is when it is `height` pixels high, bold or not.
pub(super) fn width(text: &str, height: f64) -> f64 {
    (text.chars().count() * get_raster_width(FontWeight::Regular, HEIGHT)) as f64 * height / HEIGHT.val() as f64
}

impl Mask {
    /// `text` as the font holds it; what it does not have becomes a question mark.
    fn plain(text: &str, bold: bool) -> Self {
        let advance = get_raster_width(weight(bold), HEIGHT);
        let (width, height) = (advance * text.chars().count(), HEIGHT.val());
        let mut cover = vec![0.0; width * height];
        for (i, c) in text.chars().enumerate() {
            let Some(glyph) = get_raster(c, weight(bold), HEIGHT).or_else(|| get_raster('?', weight(bold), HEIGHT)) else { continue };
            for (row, line) in glyph.rows().enumerate() {
                for (column, &strength) in line.iter().enumerate() {
                    cover[row * width + i * advance + column] = f32::from(strength) / 255.0;
                }
            }
        }
        Self { width, height, cover }
    }

    /// `text`, `height` pixels high, with `border` empty pixels around it.
    pub(super) fn new(text: &str, height: f64, bold: bool, border: usize) -> Self {
        let font = Self::plain(text, bold);
        let scale = height / font.height as f64;
        let inner = [(font.width as f64 * scale).ceil() as usize, height.ceil() as usize];
        let (width, height) = (inner[0] + 2 * border, inner[1] + 2 * border);
        // Strokes thinner than a pixel would be pale.
        let stronger = (1.0 + 0.7 * (1.0 - scale).max(0.0)) as f32;
        let mut cover = vec![0.0; width * height];
        for y in 0..inner[1] {
            for x in 0..inner[0] {
                let at = |p: usize| (p as f64 / scale, (p + 1) as f64 / scale);
                cover[(y + border) * width + x + border] =
                    if scale < 1.0 { (stronger * font.mean(at(x), at(y))).min(1.0) } else { font.enlarged([x, y], scale) };
            }
        }
        Self { width, height, cover }
    }

    fn at(&self, x: i64, y: i64) -> f32 {
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        if inside { self.cover[y as usize * self.width + x as usize] } else { 0.0 }
    }

    /// The mean over a rectangle of the font's pixels.
    fn mean(&self, (left, right): (f64, f64), (top, bottom): (f64, f64)) -> f32 {
        let mut sum = 0.0;
        for y in top as i64..=bottom as i64 {
            let high = bottom.min(y as f64 + 1.0) - top.max(y as f64);
            for x in left as i64..=right as i64 {
                let wide = right.min(x as f64 + 1.0) - left.max(x as f64);
                sum += high.max(0.0) * wide.max(0.0) * f64::from(self.at(x, y));
            }
        }
        (sum / ((right - left) * (bottom - top))) as f32
    }

    /// Interpolated at a pixel of a text `scale` times as large, and as steep there as the font is: edges stay one pixel wide.
    fn enlarged(&self, pixel: [usize; 2], scale: f64) -> f32 {
        let [u, v] = pixel.map(|p| (p as f64 + 0.5) / scale - 0.5);
        let (x, y) = (u.floor(), v.floor());
        let (s, t) = ((u - x) as f32, (v - y) as f32);
        let (x, y) = (x as i64, y as i64);
        let row = |y: i64| self.at(x, y) * (1.0 - s) + self.at(x + 1, y) * s;
        let mixed = row(y) * (1.0 - t) + row(y + 1) * t;
        ((mixed - 0.5) * scale as f32 + 0.5).clamp(0.0, 1.0)
    }

    /// The same mask grown by `radius` pixels all around.
    pub(super) fn grown(&self, radius: usize) -> Self {
        let r = radius as i64;
        let disk: Vec<(i64, i64)> =
            (-r..=r).flat_map(|y| (-r..=r).map(move |x| (x, y))).filter(|(x, y)| x * x + y * y <= r * r + r / 2).collect();
        let mut cover = vec![0.0; self.cover.len()];
        for (n, to) in cover.iter_mut().enumerate() {
            let (x, y) = ((n % self.width) as i64, (n / self.width) as i64);
            *to = disk.iter().map(|(dx, dy)| self.at(x + dx, y + dy)).fold(0.0, f32::max);
        }
        Self { cover, ..*self }
    }
}
