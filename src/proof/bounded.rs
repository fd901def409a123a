//! How far pixels of a picture are from the true integral, proven.
//!
//! The pixels are drawn by lot from the scene itself: SHA-256 of its text and of a counter. So nobody can choose them, and one picture always
//! has the same ones. Each is enclosed by [`Prover`], and the distance is taken to the far end of the enclosure.

use super::provenance::Inputs;
use super::verify::{Carried, Verdict};
use crate::reference::{Enclosure, Prover};
use crate::scene::Slicing;
use crate::{Error, Picture, Progress, Result, Settings};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most pixels that are enclosed at once: as many as a megapixel picture has.
pub const MAX_PROOF: u64 = 1 << 20;

/// Enclosures that are kept before they are counted.
const CHUNK: usize = 4096;

/// The narrowest bounds that may be asked for: rounding leaves nothing narrower on most rays.
const NARROWEST: f64 = 1e-12;

/// How far some pixels of a picture are from the true integral: proven bounds, for these pixels and no others.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Bounded {
    /// Pixels that were enclosed.
    pub pixels: u64,
    /// All pixels of the picture.
    pub of: u64,
    /// How narrow the bounds of each pixel were to be.
    pub asked: f64,
    /// The width of the widest bounds; over `asked` where the work allowed for one pixel was not enough.
    pub width: f64,
    /// For the picture as it was rendered, in f32.
    pub rendered: Distance,
    /// For the picture as its file holds it; `None` where that is of another size than the scene's.
    pub stored: Option<Distance>,
    /// The RMS error that the scene asked for (`slices.tolerance`).
    pub tolerance: Option<f64>,
}

/// Distance of pixels from the truth, on premultiplied numbers from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Distance {
    /// No red, green, blue or alpha of these pixels is farther away than this.
    pub largest: f64,
    /// Column and row of the pixel that this was found at, the first such in reading order.
    pub worst: (u32, u32),
    /// Bounds on the root of the mean squared distance of red, green and blue over these pixels.
    pub rms: [f64; 2],
}

impl Bounded {
    /// Whether the scene's tolerance is proven to be missed by these pixels, as they are rendered.
    pub fn is_missed(&self) -> bool {
        self.tolerance.is_some_and(|tolerance| self.rendered.rms[0] > tolerance)
    }

    /// What is proven, one line each.
    pub fn lines(&self) -> Vec<String> {
        let told = |d: &Distance| {
            let (x, y) = d.worst;
            format!(
                "within {:.3e} of the true integral (farthest at {x},{y}); RMS of red, green, blue between {:.3e} and {:.3e}",
                d.largest, d.rms[0], d.rms[1]
            )
        };
        let mut lines = vec![format!("proven: each of these {} of {} pixels lies {}", self.pixels, self.of, told(&self.rendered))];
        lines.extend(self.stored.as_ref().map(|d| format!("proven: rounded as in the file, each lies {}", told(d))));
        let missed = if self.width <= self.asked { "" } else { ", missed: some rays need more work than a pixel is allowed" };
        lines.push(format!("bounds: at most {:.3e} wide (asked for: {:e}{missed})", self.width, self.asked));
        if let Some(tolerance) = self.tolerance {
            let [least, most] = self.rendered.rms;
            let what = if most <= tolerance {
                "proven: kept by these pixels"
            } else if least > tolerance {
                "proven: missed by these pixels"
            } else {
                "cannot be told from bounds of this width"
            };
            lines.push(format!("tolerance {tolerance:e}: {what}"));
        }
        lines
    }
}

/// As [`verify`](super::verify()), and encloses `count` pixels of the picture (all of them, where it has no more) down to bounds of `width`.
///
/// # Errors
/// As [`verify`](super::verify()) and [`Prover::new`], naming `path`; [`Error::Invalid`] for a width outside 1e-12 to 1 and a count of 0;
/// [`Error::Limit`] for more than [`MAX_PROOF`] pixels; [`Error::Stopped`].
pub fn verify_bounded(path: &Path, inputs: &Inputs, count: u64, width: f64, settings: &Settings) -> Result<(Verdict, Bounded)> {
    if !(NARROWEST..=1.0).contains(&width) {
        return Err(Error::invalid(format!("width {width} of proven bounds: must lie between {NARROWEST:e} and 1")));
    }
    if count == 0 {
        return Err(Error::invalid("a proof of 0 pixels says nothing"));
    }
    let carried = Carried::read(path, inputs, settings)?;
    let (w, h) = carried.scene.size();
    let of = u64::from(w) * u64::from(h);
    if count.min(of) > MAX_PROOF {
        let what = format!("{}: pixels to be proven", path.display());
        return Err(Error::Limit { what, needed: u128::from(count.min(of)), limit: u128::from(MAX_PROOF) });
    }
    let prover = Prover::new(&carried.scene, &carried.volume).map_err(|e| match e {
        Error::Invalid(what) => Error::format(path, what),
        other => other,
    })?;
    let (verdict, picture) = carried.render(path, settings)?;
    let chosen = chosen(&carried.provenance.scene, count, of);
    let (pixels, place) = (chosen.len() as u64, |i: u64| ((i % u64::from(w)) as u32, (i / u64::from(w)) as u32));
    let same_size = (carried.file.width(), carried.file.height()) == (w, h);
    let (mut rendered, mut stored, mut widest) = (Gathered::default(), Gathered::default(), 0.0);
    let done = AtomicU64::new(0);
    let progress = settings.progress.as_deref();
    let mut enclose = || -> Result<()> {
        for chunk in chosen.chunks(CHUNK) {
            let found: Vec<Enclosure> =
                chunk.par_iter().map(|&i| one(&prover, place(i), width, progress, (&done, pixels))).collect::<Result<_>>()?;
            for (&i, bounds) in chunk.iter().zip(&found) {
                widest = f64::max(widest, bounds.width);
                rendered.add(bounds, &picture, place(i));
                if same_size {
                    stored.add(bounds, &carried.file, place(i));
                }
            }
        }
        Ok(())
    };
    match settings.threads {
        None => enclose()?,
        Some(_) => settings.pool()?.install(enclose)?,
    }
    let tolerance = match carried.scene.slicing() {
        Slicing::Tolerance(t) => Some(t),
        _ => None,
    };
    let stored = same_size.then(|| stored.distance(pixels));
    let bounded = Bounded { pixels, of, asked: width, width: widest, rendered: rendered.distance(pixels), stored, tolerance };
    Ok((verdict, bounded))
}

/// Encloses one pixel and tells of it.
fn one(
    prover: &Prover<'_>,
    (x, y): (u32, u32),
    width: f64,
    progress: Option<&dyn Progress>,
    (done, all): (&AtomicU64, u64),
) -> Result<Enclosure> {
    let stopped = || progress.is_some_and(Progress::is_stopped);
    let found = prover.pixel_unless(x, y, width, &stopped).ok_or(Error::Stopped)?;
    let done = done.fetch_add(1, Ordering::Relaxed) + 1;
    if progress.is_none_or(|p| p.step("proving pixels", done, all)) { Ok(found) } else { Err(Error::Stopped) }
}

/// `count` different numbers below `of`, rising, that depend on the text alone: all of them where there are no more.
fn chosen(text: &str, count: u64, of: u64) -> Vec<u64> {
    if count >= of {
        return (0..of).collect();
    }
    let seed = Sha256::digest(text);
    let below = |counter: u64, limit: u64| {
        let hash = Sha256::new().chain_update(seed).chain_update(counter.to_le_bytes()).finalize();
        let number = hash.iter().take(16).fold(0u128, |n, &b| n << 8 | u128::from(b));
        (number % u128::from(limit)) as u64
    };
    // R. W. Floyd's way to draw a set: each set of `count` numbers is as likely as any other.
    let mut drawn = BTreeSet::new();
    for last in of - count..of {
        let number = below(last, last + 1);
        if !drawn.insert(number) {
            drawn.insert(last);
        }
    }
    drawn.into_iter().collect()
}

/// Distances, summed up in the order of the pixels.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    largest: f64,
    worst: (u32, u32),
    least_squares: f64,
    most_squares: f64,
}

impl Gathered {
    fn add(&mut self, bounds: &Enclosure, picture: &Picture, (x, y): (u32, u32)) {
        let pixel = picture.pixel(x, y);
        let (near, far) = (bounds.nearest(pixel), bounds.farthest(pixel));
        let most = far.iter().fold(0.0, |a: f64, &b| a.max(b));
        if most > self.largest {
            (self.largest, self.worst) = (most, (x, y));
        }
        self.least_squares += near[..3].iter().map(|d| d * d).sum::<f64>();
        self.most_squares += far[..3].iter().map(|d| d * d).sum::<f64>();
    }

    fn distance(&self, pixels: u64) -> Distance {
        let numbers = 3.0 * pixels as f64;
        // A sum of n squares, its mean and its root are right to n + 3 roundings.
        let off = (numbers + 8.0) * f64::EPSILON;
        let rms = [(self.least_squares / numbers).sqrt() * (1.0 - off), (self.most_squares / numbers).sqrt() * (1.0 + off)];
        Distance { largest: self.largest, worst: self.worst, rms }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_drawn_once_and_by_the_text() {
        for (count, of) in [(1, 2), (10, 1000), (999, 1000), (1000, 1000), (5000, 1000), (1, 1)] {
            let drawn = chosen("a scene", count, of);
            assert_eq!(drawn.len() as u64, count.min(of));
            assert!(drawn.windows(2).all(|w| w[0] < w[1]) && drawn.iter().all(|&i| i < of), "{drawn:?}");
            assert_eq!(drawn, chosen("a scene", count, of));
        }
        assert_ne!(chosen("a scene", 10, 1000), chosen("another scene", 10, 1000));
        // Evenly: of 100 numbers drawn from 1000 about half lie in each half.
        let low = chosen("a scene", 100, 1000).iter().filter(|&&i| i < 500).count();
        assert!((30..70).contains(&low), "{low}");
    }
}
