//! How far one picture is from another, on displayed colours over black, in f64.

mod flip;
mod ssim;

pub use flip::{DEFAULT_PIXELS_PER_DEGREE, flip, flip_map};
pub use ssim::ssim;

use crate::{Error, Result};

/// Displayed colours: red, green, blue in `[0,1]`, row by row from the top.
///
/// # Guarantees
/// Width times height colours, at least one, each component in `[0,1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Displayed {
    width: usize,
    height: usize,
    rgb: Vec<[f64; 3]>,
}

impl Displayed {
    /// A picture of premultiplied red, green, blue and alpha, `width` pixels wide, as a screen shows it over black: clamped to `[0,1]`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the pixels do not fill whole rows, or there are none, or one is NaN.
    pub fn over_black<T: Copy + Into<f64>>(width: usize, pixels: &[[T; 4]]) -> Result<Self> {
        if width == 0 || pixels.is_empty() || pixels.len() % width != 0 {
            return Err(Error::invalid(format!("{} pixels do not fill rows of {width}", pixels.len())));
        }
        let rgb: Vec<[f64; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b].map(|c| c.into().clamp(0.0, 1.0))).collect();
        if let Some(at) = rgb.iter().position(|p| p.iter().any(|c| c.is_nan())) {
            return Err(Error::invalid(format!("pixel {},{} is NaN", at % width, at / width)));
        }
        Ok(Self { width, height: rgb.len() / width, rgb })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The colours.
    pub fn rgb(&self) -> &[[f64; 3]] {
        &self.rgb
    }

    fn same_size(&self, other: &Self) -> Result<()> {
        if self.size() == other.size() {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "pictures of {} x {} and {} x {} cannot be compared",
            self.width, self.height, other.width, other.height
        )))
    }
}

/// Differences of two pictures over all components of all pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rms: f64,
    /// Largest difference.
    pub max: f64,
    /// The difference that 99.9 % of the components do not exceed (nearest rank).
    pub p999: f64,
    /// Peak signal-to-noise ratio in decibels, peak 1: -20 log10(rms); infinite for equal pictures.
    pub psnr: f64,
    /// How many components differ by how many steps of 1/255 once both are rounded to 8 bits: entry i counts i steps.
    pub steps: Vec<u64>,
}

/// Compares two pictures of one size.
///
/// # Errors
/// [`Error::Invalid`] when the sizes differ.
pub fn difference(a: &Displayed, b: &Displayed) -> Result<Difference> {
    a.same_size(b)?;
    let to_8_bits = |x: f64| libm::floor(x * 255.0 + 0.5) as i64;
    let mut steps = vec![0; 256];
    let mut off = Vec::with_capacity(3 * a.rgb.len());
    for (x, y) in a.rgb.iter().flatten().zip(b.rgb.iter().flatten()) {
        off.push((x - y).abs());
        steps[to_8_bits(*x).abs_diff(to_8_bits(*y)) as usize] += 1;
    }
    let last = steps.iter().rposition(|&n| n > 0).unwrap_or(0);
    steps.truncate(last + 1);
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    off.sort_by(f64::total_cmp);
    // Nearest rank, in whole numbers: the smallest difference that at least 999 of 1000 do not exceed.
    let rank = (off.len() * 999).div_ceil(1000);
    let (max, p999) = (off[off.len() - 1], off[rank - 1]);
    Ok(Difference { rms, max, p999, psnr: -20.0 * libm::log10(rms), steps })
}

/// One channel of a picture, to be filtered.
#[derive(Debug, Clone)]
struct Plane {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

/// A filter along one axis: odd length, the middle weight at the pixel itself.
type Kernel = Vec<f64>;

impl Plane {
    fn of(picture: &Displayed, f: impl Fn([f64; 3]) -> f64) -> Self {
        Self { width: picture.width, height: picture.height, values: picture.rgb.iter().map(|&c| f(c)).collect() }
    }

    /// Filtered along x, then along y; beyond the picture its edge pixels go on.
    fn filter(&self, across: &Kernel, down: &Kernel) -> Self {
        self.along(across, 1, self.width, self.width).along(down, self.width, self.height, 1)
    }

    /// Filtered along lines of `count` pixels, `stride` from one to the next; lines start at multiples of `next`.
    fn along(&self, kernel: &Kernel, stride: usize, count: usize, next: usize) -> Self {
        let half = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        for line in 0..self.values.len() / count {
            let start = line * next;
            for i in 0..count {
                let sum: f64 = kernel
                    .iter()
                    .enumerate()
                    .map(|(k, w)| w * self.values[start + (i + k).saturating_sub(half).min(count - 1) * stride])
                    .sum();
                values[start + i * stride] = sum;
            }
        }
        Self { width: self.width, height: self.height, values }
    }
}

#[cfg(test)]
mod tests;
