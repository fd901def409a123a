//! What an error looks like: one detail of the scene's picture, rendered so that the picture has one error after the other.

use super::clock::Clock;
use super::methods::NamedMethod;
use super::precision::{Truth, terminate};
use super::record::{Detail, Point};
use crate::reference::metrics::{self, Displayed};
use crate::reference::{Region, image};
use crate::scene::Slicing;
use crate::{Picture, Renderer, Result, Scene, Volume};

/// Errors that are shown.
pub(super) const ERRORS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];
/// A picture whose error is within this factor of one wanted has it.
pub(super) const NEAR: f64 = 1.25;
/// Side of the detail in pixels, at most.
const SIDE: u32 = 96;
/// Pictures made for an error with a method, at most.
const TRIES: u32 = 8;
/// Seconds that a picture may take though the budget is gone.
const LEAST: f64 = 0.25;
/// Most slices of a picture.
const MOST: u64 = 1 << 14;

/// What pictures are held against, and when to end.
pub(super) struct Search<'s> {
    pub(super) volume: &'s Volume,
    pub(super) scene: &'s Scene,
    pub(super) truth: &'s Truth,
    /// Seconds that the reference takes for a pixel.
    pub(super) reference_pixel: f64,
    pub(super) clock: &'s Clock,
    /// The part of the budget that may be gone when the details are there.
    pub(super) part: f64,
    /// The part that may be gone when their frames have been timed again.
    pub(super) timed: f64,
}

/// A picture that was tried: its error and time, and the detail of it.
struct Tried {
    method: &'static str,
    slices: u64,
    rms: f64,
    seconds: f64,
    scene: Scene,
    shown: Displayed,
}

impl Tried {
    /// How far its error is from `error`: 0 where it is the same, 1 where it is e times as large or as small.
    fn off(&self, error: f64) -> f64 {
        apart(self.rms, error)
    }
}

fn apart(a: f64, b: f64) -> f64 {
    if a > 0.0 { libm::log(a / b).abs() } else { f64::INFINITY }
}

/// The details at each of [`ERRORS`] and their pictures; and the detail as it should be, where there is time for its rays.
pub(super) fn measure(
    search: &Search<'_>,
    renderer: &mut Renderer,
    points: &[Point],
) -> Result<(Vec<Detail>, Vec<Displayed>, Option<Displayed>)> {
    let midpoint = NamedMethod::named("midpoint")?;
    // Where a picture of few slices errs most.
    let coarse = search.scene.clone().with_method(midpoint.method)?.with_slices(Slicing::Count(16))?;
    let window = search.window(&renderer.render(&coarse)?.0);
    let rays = f64::from(window.size.0) * f64::from(window.size.1);
    // Not more than half of the time.
    let truth = if search.reference_pixel * rays <= 0.5 * search.clock.left(search.part) {
        let whole = image(search.scene, search.volume, window)?;
        Some(Displayed::over_black(whole.size().0, whole.pixels())?)
    } else {
        None
    };
    let mut tried = Vec::new();
    let mut chosen: Vec<usize> = Vec::new();
    for error in ERRORS {
        let mut best = search.nearest(renderer, midpoint, error, window, points, &mut tried)?;
        // A single slice may be too good; Riemann's slabs are not.
        let riemann = NamedMethod::named("riemann")?;
        let possible = search.scene.clone().with_method(riemann.method).is_ok() && search.scene.blend() != crate::scene::Blend::Surfaces;
        if tried[best].rms * NEAR < error && possible {
            let other = search.nearest(renderer, riemann, error, window, &[], &mut tried)?;
            best = if tried[other].off(error) < tried[best].off(error) { other } else { best };
        }
        chosen.push(best);
    }
    let mut seconds: Vec<f64> = chosen.iter().map(|&i| tried[i].seconds).collect();
    let frames = chosen.iter().zip(&mut seconds).map(|(&i, s)| (&tried[i].scene, s)).collect();
    search.clock.shortest(search.timed, renderer, frames)?;
    let detail = |((&i, seconds), error): ((&usize, f64), f64)| {
        let t: &Tried = &tried[i];
        Detail {
            error,
            method: t.method.into(),
            slices: t.slices,
            rms: t.rms,
            seconds,
            column: window.origin.0,
            row: window.origin.1,
            width: window.size.0,
            height: window.size.1,
        }
    };
    let details = chosen.iter().zip(seconds).zip(ERRORS).map(detail).collect();
    let pictures = chosen.iter().map(|&i| tried[i].shown.clone()).collect();
    Ok((details, pictures, truth))
}

impl Search<'_> {
    /// The part of the picture in which `picture` is farthest from the truth.
    fn window(&self, picture: &Picture) -> Region {
        let (width, height) = (picture.width(), picture.height());
        let size = (SIDE.min(width), SIDE.min(height));
        let step = self.truth.region.step;
        let columns = self.truth.shown.size().0;
        let off = |(i, truth): (usize, &[f64; 3])| {
            let (x, y) = ((i % columns) as u32 * step, (i / columns) as u32 * step);
            let p = picture.pixel(x, y);
            ((x, y), (0..3).map(|c| (f64::from(p[c]) - truth[c]) * (f64::from(p[c]) - truth[c])).sum::<f64>())
        };
        let list: Vec<((u32, u32), f64)> = self.truth.shown.rgb().iter().enumerate().map(off).collect();
        let inside = |(left, top): (u32, u32)| {
            let here = list.iter().filter(|((x, y), _)| (left..left + size.0).contains(x) && (top..top + size.1).contains(y));
            here.map(|p| p.1).sum::<f64>()
        };
        let starts = |all: u32, part: u32| (0..=all - part).step_by((part / 4).max(1) as usize);
        let mut best = ((0, 0), -1.0);
        for origin in starts(height, size.1).flat_map(|y| starts(width, size.0).map(move |x| (x, y))) {
            let sum = inside(origin);
            if sum > best.1 {
                best = (origin, sum);
            }
        }
        Region { origin: best.0, size, step: 1 }
    }

    /// The picture of `method` whose error is nearest to `error`: its place in `tried`, which it is added to where it is new.
    fn nearest(
        &self,
        renderer: &mut Renderer,
        method: &'static NamedMethod,
        error: f64,
        window: Region,
        points: &[Point],
        tried: &mut Vec<Tried>,
    ) -> Result<usize> {
        let mut tries = 0;
        loop {
            let mine = tried.iter().enumerate().filter(|(_, t)| t.method == method.name);
            let best = mine.clone().min_by(|a, b| a.1.off(error).total_cmp(&b.1.off(error))).map(|(i, t)| (i, t.off(error)));
            // Slices and error of all pictures known, also of those whose detail was not kept.
            let mut known: Vec<(u64, f64)> = mine.map(|(_, t)| (t.slices, t.rms)).collect();
            known.extend(points.iter().filter(|p| p.method == method.name && p.tolerance.is_none()).map(|p| (p.slices, p.rms)));
            known.sort_by_key(|k| k.0);
            let next = next_count(&known, error);
            // Few slices cost more than their share.
            let per_slice = tried.iter().max_by_key(|t| t.slices).map_or(0.0, |t| t.seconds / t.slices as f64);
            let new = !tried.iter().any(|t| t.method == method.name && t.slices == next);
            match best {
                Some((i, off)) if off <= libm::log(NEAR) || tries >= TRIES || !new => return Ok(i),
                Some((i, _)) if per_slice * next as f64 > self.clock.left(self.part).max(LEAST) => return Ok(i),
                _ => tried.push(self.picture(renderer, method, next, window)?),
            }
            tries += 1;
        }
    }

    fn picture(&self, renderer: &mut Renderer, method: &'static NamedMethod, slices: u64, window: Region) -> Result<Tried> {
        let slicing = Slicing::Count(slices);
        let base = self.scene.clone().with_method(method.method)?;
        let scene = base.clone().with_slices(slicing)?.with_terminate(terminate(base.terminate(), slicing))?;
        let (picture, stats) = renderer.render(&scene)?;
        let rms = metrics::difference(&self.truth.shown, &self.truth.sampled(&picture)?)?.rms;
        let ((left, top), (width, height)) = (window.origin, window.size);
        let pixels: Vec<[f32; 4]> =
            (top..top + height).flat_map(|y| (left..left + width).map(move |x| (x, y))).map(|(x, y)| picture.pixel(x, y)).collect();
        let shown = Displayed::over_black(width as usize, &pixels)?;
        Ok(Tried { method: method.name, slices, rms, seconds: stats.render_seconds, scene, shown })
    }
}

/// The number of slices to try next for `error`, from those known with their errors, in order of slices.
fn next_count(known: &[(u64, f64)], error: f64) -> u64 {
    let Some(&(first, _)) = known.first() else { return 16 };
    // The last that is not good enough before the first that is.
    let good = known.iter().position(|k| k.1 <= error);
    match good {
        Some(0) => (first / 2).max(1),
        None => {
            let (n, rms) = known[known.len() - 1];
            // As if the error fell with the square of the slices.
            ((n as f64 * (rms / error).sqrt().min(8.0)) as u64).max(n + 1).min(MOST.max(n))
        }
        Some(i) => {
            let ((a, high), (b, low)) = (known[i - 1], known[i]);
            if b - a < 2 {
                return if apart(high, error) < apart(low, error) { a } else { b };
            }
            // On the straight line between the two, both logarithmic.
            let part = if low > 0.0 { libm::log(high / error) / libm::log(high / low) } else { 0.5 };
            let between = a as f64 * libm::pow(b as f64 / a as f64, part.clamp(0.1, 0.9));
            (between.round() as u64).clamp(a + 1, b - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors that fall as theory says, at any order, are found from any start, and each is as near as a whole number of slices can be.
    #[test]
    fn counts_are_found_for_errors() {
        for order in [1.0, 2.0, 3.0] {
            for constant in [0.3, 5.0, 900.0] {
                let rms = |n: u64| constant / (n as f64).powf(order);
                for start in [1, 16, 4096] {
                    for error in ERRORS {
                        let mut known = vec![(start, rms(start))];
                        for _ in 0..60 {
                            let next = next_count(&known, error);
                            if known.iter().any(|k| k.0 == next) {
                                break;
                            }
                            known.push((next, rms(next)));
                            known.sort_by_key(|k| k.0);
                        }
                        let best = known.iter().map(|k| apart(k.1, error)).fold(f64::INFINITY, f64::min);
                        let exact = (constant / error).powf(1.0 / order);
                        let whole = |n: f64| apart(rms((n as u64).clamp(1, MOST)), error);
                        let want = whole(exact.floor()).min(whole(exact.ceil()));
                        assert!(best <= want + 1e-9, "order {order}, {constant}, from {start} to {error}: {best}, not {want}: {known:?}");
                    }
                }
            }
        }
    }
}
