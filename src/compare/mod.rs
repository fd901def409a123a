//! How far one picture is from another: numbers, and pictures of the differences.
//!
//! | number | of what | range | source |
//! |---|---|---|---|
//! | RMS, largest difference, PSNR | premultiplied red, green, blue and alpha as they are stored, not clamped | 0 and up; PSNR in dB, peak 1 | - |
//! | SSIM | luma of the colours over black, window 11 x 11, sigma 1.5 | 1 for equal pictures | Wang, Bovik, Sheikh, Simoncelli 2004 |
//! | FLIP | colours over black, taken for sRGB, at so many pixels per degree of sight | 0 to 1, 0 for equal pictures | Andersson et al. 2020 (LDR-FLIP) |
//!
//! SSIM and FLIP are those of [`crate::reference::metrics`], on colours clamped to `[0,1]`. FLIP of black against white is 0.967, not 1: 1 is the
//! distance of green and blue.

#[cfg(feature = "encoders")]
mod golden;
mod maps;

#[cfg(feature = "encoders")]
pub use golden::{Golden, golden};
pub use maps::{DIFFERENCE_SCALE, difference_map, flip_map};

use crate::reference::metrics::{DEFAULT_PIXELS_PER_DEGREE, Displayed, flip, ssim};
use crate::{Error, Picture, Result};

/// Differences of two pictures of one size.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Root of the mean squared difference over the four components of all pixels.
    pub rms: f64,
    /// Largest difference of a component.
    pub max: f64,
    /// Peak signal-to-noise ratio in decibels, peak 1: -20 log10(rms); infinite where nothing differs.
    pub psnr: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// Mean of the FLIP map.
    pub flip: f64,
    /// Pixels per degree of sight that FLIP was computed for.
    pub pixels_per_degree: f64,
    /// Pixels of which a component differs, be it by the last bit.
    pub differing: u64,
    /// Pixels of each picture.
    pub pixels: u64,
    /// Column and row of the largest difference, the first such in reading order; `None` where nothing differs.
    pub worst: Option<(u32, u32)>,
}

impl Comparison {
    /// Compares two pictures for a viewer at the FLIP paper's desk, 67 pixels per degree.
    ///
    /// # Errors
    /// As [`Comparison::at`].
    pub fn of(a: &Picture, b: &Picture) -> Result<Self> {
        Self::at(a, b, DEFAULT_PIXELS_PER_DEGREE)
    }

    /// Compares two pictures for a viewer who sees so many pixels in a degree.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the sizes differ, a component is NaN, or `pixels_per_degree` is not within 1 and 1000.
    pub fn at(a: &Picture, b: &Picture, pixels_per_degree: f64) -> Result<Self> {
        check(a, b)?;
        let (seen_a, seen_b) = (displayed(a)?, displayed(b)?);
        let (mut squares, mut max, mut differing, mut worst) = (0.0, 0.0, 0, None);
        for (i, (x, y)) in a.pixels().iter().zip(b.pixels()).enumerate() {
            let mut most: f64 = 0.0;
            for off in differences(x, y) {
                squares += off * off;
                most = most.max(off);
            }
            differing += u64::from(most > 0.0);
            if most > max {
                let width = a.width() as usize;
                (max, worst) = (most, Some(((i % width) as u32, (i / width) as u32)));
            }
        }
        let pixels = a.pixels().len() as u64;
        let rms = (squares / (4 * pixels) as f64).sqrt();
        let flip = flip(&seen_a, &seen_b, pixels_per_degree)?;
        let ssim = ssim(&seen_a, &seen_b)?;
        Ok(Self { rms, max, psnr: -20.0 * libm::log10(rms), ssim, flip, pixels_per_degree, differing, pixels, worst })
    }
}

/// How far pictures may be apart. What is not given is not looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Tolerance {
    /// Largest [`Comparison::rms`].
    pub max_rms: Option<f64>,
    /// Largest [`Comparison::flip`].
    pub max_flip: Option<f64>,
    /// Most [`Comparison::differing`] pixels.
    pub max_diff: Option<u64>,
}

impl Tolerance {
    /// No limit at all.
    pub const fn new() -> Self {
        Self { max_rms: None, max_flip: None, max_diff: None }
    }

    /// No pixel may differ.
    pub const fn exact() -> Self {
        Self { max_diff: Some(0), ..Self::new() }
    }

    /// The same with a largest RMS difference.
    #[must_use]
    pub const fn max_rms(mut self, most: f64) -> Self {
        self.max_rms = Some(most);
        self
    }

    /// The same with a largest FLIP.
    #[must_use]
    pub const fn max_flip(mut self, most: f64) -> Self {
        self.max_flip = Some(most);
        self
    }

    /// The same with a most for the number of pixels that differ.
    #[must_use]
    pub const fn max_diff(mut self, most: u64) -> Self {
        self.max_diff = Some(most);
        self
    }

    /// Whether a limit is given.
    pub fn is_given(&self) -> bool {
        *self != Self::new()
    }

    /// What of `found` is beyond a limit, in words: "RMS 0.1 is over 0.05". `None` where all is within.
    pub fn exceeded(&self, found: &Comparison) -> Option<String> {
        let mut beyond = Vec::new();
        for (what, value, most) in [("RMS", found.rms, self.max_rms), ("FLIP", found.flip, self.max_flip)] {
            if let Some(most) = most.filter(|&most| !(value <= most)) {
                beyond.push(format!("{what} {value:.3e} is over {most}"));
            }
        }
        if let Some(most) = self.max_diff.filter(|&most| found.differing > most) {
            beyond.push(format!("{} pixels differ, over {most}", found.differing));
        }
        (!beyond.is_empty()).then(|| beyond.join(", "))
    }
}

/// # Errors
/// [`Error::Invalid`] when the sizes differ or a component is NaN.
fn check(a: &Picture, b: &Picture) -> Result<()> {
    let size = |p: &Picture| (p.width(), p.height());
    if size(a) != size(b) {
        let ((w, h), (v, g)) = (size(a), size(b));
        return Err(Error::invalid(format!("pictures of {w} x {h} and {v} x {g} pixels cannot be compared")));
    }
    for (which, picture) in [("first", a), ("second", b)] {
        if let Some(i) = picture.pixels().iter().position(|p| p.iter().any(|c| c.is_nan())) {
            let (x, y) = (i % a.width() as usize, i / a.width() as usize);
            return Err(Error::invalid(format!("pixel {x},{y} of the {which} picture is NaN")));
        }
    }
    Ok(())
}

fn displayed(picture: &Picture) -> Result<Displayed> {
    Displayed::over_black(picture.width() as usize, picture.pixels())
}

/// The differences of the components of two pixels. Equal infinities do not differ.
fn differences(a: &[f32; 4], b: &[f32; 4]) -> [f64; 4] {
    std::array::from_fn(|i| if a[i] == b[i] { 0.0 } else { (f64::from(a[i]) - f64::from(b[i])).abs() })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn picture(width: u32, height: u32, f: impl Fn(u32, u32) -> [f32; 4]) -> Picture {
        Picture::from_pixels(width, height, (0..width * height).map(|i| f(i % width, i / width)).collect()).unwrap()
    }

    #[test]
    fn equal_pictures_are_at_no_distance() {
        let a = picture(40, 30, |x, y| [0.01 * x as f32, 0.02 * y as f32, 7.0, f32::INFINITY]);
        let same = Comparison::of(&a, &a).unwrap();
        assert_eq!((same.rms, same.max, same.flip, same.differing, same.pixels, same.worst), (0.0, 0.0, 0.0, 0, 1200, None));
        assert!(same.psnr == f64::INFINITY && (same.ssim - 1.0).abs() < 1e-12);
        assert!((same.pixels_per_degree - 67.0).abs() < 0.1);
        assert_eq!(Tolerance::exact().max_rms(0.0).max_flip(0.0).exceeded(&same), None);
    }

    #[test]
    fn one_pixel_is_counted_and_found() {
        let a = picture(20, 10, |_, _| [0.25, 0.5, 0.75, 1.0]);
        let b = picture(20, 10, |x, y| if (x, y) == (7, 3) { [0.25, 0.5, 0.75, 0.5] } else { [0.25, 0.5, 0.75, 1.0] });
        // Alpha alone: nothing over black, but not the same picture.
        let d = Comparison::of(&a, &b).unwrap();
        assert_eq!((d.max, d.differing, d.worst, d.flip), (0.5, 1, Some((7, 3)), 0.0));
        assert!((d.rms - (0.25f64 / 800.0).sqrt()).abs() < 1e-15 && (d.psnr + 10.0 * libm::log10(0.25 / 800.0)).abs() < 1e-9);
        assert_eq!(Tolerance::exact().exceeded(&d).unwrap(), "1 pixels differ, over 0");
        assert_eq!(Tolerance::new().max_rms(0.01).exceeded(&d).unwrap(), "RMS 1.768e-2 is over 0.01");
        assert!(Tolerance::new().max_rms(f64::NAN).exceeded(&d).is_some() && !Tolerance::new().is_given());
    }

    #[test]
    fn black_against_white_is_almost_the_largest_difference() {
        let (a, b) = (picture(64, 64, |_, _| [0.0, 0.0, 0.0, 1.0]), picture(64, 64, |_, _| [1.0; 4]));
        let d = Comparison::of(&a, &b).unwrap();
        // HyAB 100, on the upper branch of the mapping.
        let (off, largest) = (libm::pow(100.0, 0.7), libm::pow(203.3, 0.7));
        let want = 0.95 + 0.05 * (off - 0.4 * largest) / (0.6 * largest);
        assert!((want - 0.967).abs() < 1e-3 && (d.flip - want).abs() < 1e-4 && d.flip_of_every_pixel_is_the_mean(&a, &b), "{}", d.flip);
        assert!((d.rms - 0.75f64.sqrt()).abs() < 1e-15 && d.max == 1.0);
        // A constant picture: the pipeline by hand, without blur (L of the paper's L*a*b*, HyAB^0.7 over the largest).
        let grey = |srgb: f32| {
            let linear = libm::pow((f64::from(srgb) + 0.055) / 1.055, 2.4);
            116.0 * libm::cbrt(linear) - 16.0
        };
        let (x, y) = (0.4f32, 0.5f32);
        let (a, b) = (picture(64, 64, |_, _| [x, x, x, 1.0]), picture(64, 64, |_, _| [y, y, y, 1.0]));
        let off = libm::pow(grey(y) - grey(x), 0.7) / (0.4 * libm::pow(203.3, 0.7)) * 0.95;
        let d = Comparison::of(&a, &b).unwrap();
        assert!((d.flip - off).abs() < 2e-4, "{} {off}", d.flip);
    }

    impl Comparison {
        fn flip_of_every_pixel_is_the_mean(&self, a: &Picture, b: &Picture) -> bool {
            let map = crate::reference::metrics::flip_map(&displayed(a).unwrap(), &displayed(b).unwrap(), 67.0).unwrap();
            map.iter().all(|f| (f - self.flip).abs() < 1e-6)
        }
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_refused() {
        let (a, b) = (picture(3, 4, |_, _| [0.0; 4]), picture(4, 3, |_, _| [0.0; 4]));
        let line = |a: &Picture, b: &Picture| Comparison::of(a, b).unwrap_err().to_string();
        assert_eq!(line(&a, &b), "pictures of 3 x 4 and 4 x 3 pixels cannot be compared");
        let nan = picture(3, 4, |x, y| if (x, y) == (2, 1) { [0.0, 0.0, 0.0, f32::NAN] } else { [0.0; 4] });
        assert_eq!(line(&a, &nan), "pixel 2,1 of the second picture is NaN");
        assert!(Comparison::at(&a, &a, 0.5).is_err());
    }
}
