//! How far a picture is off: some of its blocks against the same blocks of finer levels.
//!
//! Errors sit where a picture is rough, so blocks are drawn with a probability that grows with their second differences, and each stands for
//! 1 / probability of its like (as `renderer/adaptive/many.rs` does with numbers of slices). The block that judges is looked up two levels
//! below; detail that is finer still shows in neither. Where differences halve from level to level, as at edges, what two levels tell is
//! three quarters of all: hence [`REST`].

use super::run::Region;
use crate::lanes::SIDE;

/// Levels below its own at which a block is judged.
pub(super) const BELOW: usize = 2;
/// The whole error over what two levels tell of it.
const REST: f64 = 4.0 / 3.0;
/// Of so many blocks one judges.
const SHARE: usize = 256;
/// Blocks that judge, at least.
const FEWEST: usize = 16;

/// Blocks that judge.
pub(super) struct Judges {
    pub(super) regions: Vec<Region>,
    /// How many blocks each stands for.
    weights: Vec<f64>,
    /// Where each block's pixels are in the picture: first column and row, columns and rows.
    places: Vec<(usize, usize, usize, usize)>,
    width: usize,
    pixels: usize,
}

impl Judges {
    /// Those of a picture of `width` x `height` pixels.
    pub(super) fn of(pixels: &[[f32; 4]], (width, height): (u32, u32)) -> Self {
        let (width, height) = (width as usize, height as usize);
        let (columns, rows) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let place = |b: usize| {
            let (x, y) = (b % columns * SIDE, b / columns * SIDE);
            (x, y, (width - x).min(SIDE), (height - y).min(SIDE))
        };
        let rough: Vec<f64> = (0..columns * rows).map(|b| roughness(pixels, (width, height), place(b))).collect();
        let mean = rough.iter().sum::<f64>() / rough.len() as f64;
        // A block that looks smooth may hide what a finer level shows.
        let chances: Vec<f64> = rough.iter().map(|r| r + 0.25 * mean + f64::MIN_POSITIVE).collect();
        let total: f64 = chances.iter().sum();
        let count = (rough.len() / SHARE).max(FEWEST).min(rough.len());
        let step = total / count as f64;
        let mut judges = Self { regions: Vec::new(), weights: Vec::new(), places: Vec::new(), width, pixels: pixels.len() };
        let (mut before, mut n) = (0.0, 0);
        for (b, chance) in chances.iter().enumerate() {
            let mut drawn = 0;
            // Draws lie a step apart, the first one half a step from the start.
            while n < count && (n as f64 + 0.5) * step < before + chance {
                (drawn, n) = (drawn + 1, n + 1);
            }
            before += chance;
            if drawn > 0 {
                let (bx, by) = ((b % columns) as u32, (b / columns) as u32);
                judges.regions.push((bx..bx + 1, by..by + 1));
                judges.weights.push(f64::from(drawn) * step / chance);
                judges.places.push(place(b));
            }
        }
        judges
    }

    /// The pixels of its blocks in a picture.
    pub(super) fn cut(&self, pixels: &[[f32; 4]]) -> Vec<Vec<[f32; 4]>> {
        let row = |y: usize, x: usize, w: usize| &pixels[y * self.width + x..][..w];
        self.places.iter().map(|&(x, y, w, h)| (y..y + h).flat_map(|y| row(y, x, w)).copied().collect()).collect()
    }

    /// The RMS error of red, green and blue over the whole picture, from what the blocks' pixels `a` differ by from those that judge, `b`.
    pub(super) fn error(&self, a: &[Vec<[f32; 4]>], b: &[Vec<[f32; 4]>]) -> f64 {
        let squared = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).map(|d| d * d).sum::<f64>();
        let block = |(a, b): (&Vec<[f32; 4]>, &Vec<[f32; 4]>)| a.iter().zip(b).map(squared).sum::<f64>();
        let sum: f64 = a.iter().zip(b).map(block).zip(&self.weights).map(|(sum, weight)| sum * weight).sum();
        REST * (sum / (3 * self.pixels.max(1)) as f64).sqrt()
    }
}

/// Root of the mean squared second difference of red, green and blue in a block.
fn roughness(pixels: &[[f32; 4]], (width, height): (usize, usize), (x0, y0, w, h): (usize, usize, usize, usize)) -> f64 {
    let at = |x: usize, y: usize, c: usize| f64::from(pixels[y * width + x][c]);
    let mut sum = 0.0;
    for y in y0..y0 + h {
        for x in x0..x0 + w {
            for c in 0..3 {
                if x > 0 && x + 1 < width {
                    let d = at(x - 1, y, c) - 2.0 * at(x, y, c) + at(x + 1, y, c);
                    sum += d * d;
                }
                if y > 0 && y + 1 < height {
                    let d = at(x, y - 1, c) - 2.0 * at(x, y, c) + at(x, y + 1, c);
                    sum += d * d;
                }
            }
        }
    }
    (sum / (6 * w * h) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 96 x 64 pixels, of which block `rough` is noise.
    fn picture(rough: Option<usize>) -> Vec<[f32; 4]> {
        let value = |i: usize| {
            let (x, y) = (i % 96, i / 96);
            let noise = (i as u32).wrapping_mul(2_654_435_761) >> 24;
            if Some(y / 8 * 12 + x / 8) == rough { noise as f32 / 256.0 } else { x as f32 / 96.0 }
        };
        (0..96 * 64).map(|i| [value(i); 4]).collect()
    }

    #[test]
    fn an_error_everywhere_is_told_as_it_is() {
        let pixels = picture(None);
        let judges = Judges::of(&pixels, (96, 64));
        assert_eq!(judges.regions.len(), FEWEST);
        let off: Vec<_> = pixels.iter().map(|p| [p[0] + 0.01, p[1] + 0.01, p[2] + 0.01, p[3]]).collect();
        let told = judges.error(&judges.cut(&pixels), &judges.cut(&off));
        assert!((told / (0.01 * REST) - 1.0).abs() < 0.1, "{told}");
    }

    #[test]
    fn an_error_where_the_picture_is_rough_is_found() {
        for rough in [0, 37, 95] {
            let pixels = picture(Some(rough));
            let judges = Judges::of(&pixels, (96, 64));
            let mut off = pixels.clone();
            let inside = |i: usize| i / 96 / 8 * 12 + i % 96 / 8 == rough;
            (0..off.len()).filter(|&i| inside(i)).for_each(|i| off[i][1] += 0.3);
            let told = judges.error(&judges.cut(&pixels), &judges.cut(&off));
            let is = (64.0 * 0.3f64 * 0.3 / (3.0 * 96.0 * 64.0)).sqrt();
            assert!(told > 0.8 * is && told < 2.0 * is, "{rough}: {told}, {is}");
        }
    }
}
