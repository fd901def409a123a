//! What the pictures say: orders of convergence, the cheapest method for an error, and how pre-integration did.

use super::methods::NamedMethod;
use super::record::{Advice, Point, PreIntegration, SlicesFor};
use crate::proxy::Stack;
use crate::{Result, Scene, Volume};

/// Errors that methods are recommended for.
pub(super) const ERRORS: [f64; 7] = [1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4];
/// Errors below this are f32's own.
const FLOOR: f64 = 3e-6;
/// What an error falls by, twice the slices, where it has not come to rest.
const STILL_FALLS: f64 = 1.3;
/// Times the least error within which a method that came to rest is taken to be there.
const RESTING: f64 = 2.0;
/// Part of the default's time that another method must stay below to be recommended.
const WORTH: f64 = 0.9;
/// Points that a slope is fitted to at most: the finest.
const FITTED: usize = 4;

/// Slope of ln(error) over ln(slices) through the finest pictures of a method, turned around. Methods with another limit are
/// measured by the change from half as many slices.
pub(super) fn order(method: &NamedMethod, points: &[Point]) -> Option<f64> {
    if method.tolerance {
        return None;
    }
    let error = |p: &Point| if method.other_limit.is_some() { p.change } else { Some(p.rms) };
    let of_method = points.iter().filter(|p| p.method == method.name);
    let mut all: Vec<(f64, f64)> = of_method.filter_map(|p| Some((p.slices as f64, error(p)?))).filter(|p| p.1 > FLOOR).collect();
    // Where the error has come to rest (on the table's own, or that of 8 bits) it tells nothing about slabs.
    if all.windows(2).next_back().is_some_and(|w| w[1].1 > w[0].1 / STILL_FALLS) {
        let least = all.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        all.retain(|p| p.1 > RESTING * least);
    }
    let fine = &all[all.len().saturating_sub(FITTED)..];
    (fine.len() >= 3).then(|| -slope(fine))
}

/// Slope of the straight line that fits (ln x, ln y) best.
pub(super) fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|p| (p.0.ln(), p.1.ln())).collect();
    let n = logs.len() as f64;
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / logs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>()
}

/// For each of [`ERRORS`] the cheapest picture among those that reach it.
pub(super) fn advice(methods: &[&NamedMethod], points: &[Point]) -> Vec<Advice> {
    let cheapest = |error: f64, wanted: &dyn Fn(&NamedMethod) -> bool| {
        let fit = points.iter().filter(|p| p.rms <= error && methods.iter().any(|m| m.name == p.method && wanted(m)));
        fit.min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    };
    let row = |&error: &f64| {
        let default = cheapest(error, &|m| m.name == "midpoint");
        // A hair is not worth another method.
        let best = cheapest(error, &NamedMethod::is_a_choice);
        let best = match (best, default) {
            (Some(best), Some(default)) if best.seconds > WORTH * default.seconds => Some(default),
            (best, _) => best,
        };
        Advice {
            error,
            method: best.map(|p| p.method.clone()),
            slices: best.map(|p| p.slices),
            tolerance: best.and_then(|p| p.tolerance),
            seconds: best.map(|p| p.seconds),
            rms: best.map(|p| p.rms),
            default_seconds: default.map(|p| p.seconds),
            default_slices: default.map(|p| p.slices),
        }
    };
    ERRORS.iter().map(row).collect()
}

/// Slices and seconds at which a method's error falls to `error`, by straight lines between its pictures' logarithms.
fn cost_of(points: &[Point], method: &str, error: f64) -> Option<(f64, f64)> {
    let list: Vec<&Point> = points.iter().filter(|p| p.method == method).collect();
    list.windows(2).find(|w| w[0].rms > error && w[1].rms <= error).map(|w| {
        let t = (w[0].rms / error).ln() / (w[0].rms / w[1].rms).ln();
        let between = |a: f64, b: f64| a * (b / a).powf(t);
        (between(w[0].slices as f64, w[1].slices as f64), between(w[0].seconds, w[1].seconds))
    })
}

/// Rays on each side of the picture along which [`bend`] looks.
const RAYS: u32 = 48;

/// How far values in the middle of slabs lie from the mean of the values at the slabs' sides, over how far the sides lie apart; both RMS,
/// over the slabs of `slices` in which something shows. `None` where nothing does.
///
/// # Errors
/// [`crate::Error::Invalid`] when the camera cannot be resolved.
pub(super) fn bend(volume: &Volume, scene: &Scene, slices: u64) -> Result<Option<f64>> {
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let stack = Stack::new(volume.grid(), &view, scene.clip_planes(), slices);
    if stack.is_empty() {
        return Ok(None);
    }
    let (low, high) = volume.grid().index_bounds();
    let (mut off, mut apart) = (0.0, 0.0);
    for j in 0..RAYS {
        for i in 0..RAYS {
            let at = |n: u32, i: u32| (f64::from(i) + 0.5) * f64::from(n) / f64::from(RAYS);
            let (origin, direction) = view.ray(at(width, i), at(height, j));
            let to_index = volume.grid().world_to_index();
            let value = |d: f64| {
                let p = to_index.transform_point3(origin + direction * d);
                (p.cmpge(low).all() && p.cmple(high).all()).then(|| volume.sample(p)).filter(|v| v.is_finite())
            };
            // No more slabs of a ray than tell: evenly spread ones.
            let every = (slices / 512).max(1);
            for k in (0..slices).step_by(every as usize) {
                let near = stack.near + k as f64 * stack.spacing;
                let (Some(a), Some(m), Some(b)) = (value(near), value(near + 0.5 * stack.spacing), value(near + stack.spacing)) else {
                    continue;
                };
                if scene.transfer().opaque_within(a.min(m).min(b), a.max(m).max(b)) {
                    off += (m - 0.5 * (a + b)) * (m - 0.5 * (a + b));
                    apart += (b - a) * (b - a);
                }
            }
        }
    }
    Ok((apart > 0.0).then(|| (off / apart).sqrt()))
}

/// How pre-integration did against the default, and why; `None` where no error was reached by both.
pub(super) fn pre_integration(points: &[Point], bend: Option<f64>) -> Option<PreIntegration> {
    let row = |&error: &f64| {
        let ((midpoint, midpoint_seconds), (pre_integrated, pre_integrated_seconds)) =
            (cost_of(points, "midpoint", error)?, cost_of(points, "pre-integrated", error)?);
        Some(SlicesFor { error, midpoint, pre_integrated, midpoint_seconds, pre_integrated_seconds })
    };
    let slices_for: Vec<SlicesFor> = ERRORS.iter().filter_map(row).collect();
    let (first, last) = (slices_for.first()?, slices_for.last()?);
    let least_and_most =
        |f: &dyn Fn(&SlicesFor) -> f64| slices_for.iter().map(f).fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r), b.max(r)));
    let said = |(least, most): (f64, f64)| if most - least < 0.005 { format!("{most:.2}") } else { format!("{least:.2} to {most:.2}") };
    let slices = least_and_most(&|s| s.pre_integrated / s.midpoint);
    let time = least_and_most(&|s| s.pre_integrated_seconds / s.midpoint_seconds);
    let range = if first.error == last.error { format!("{:e}", first.error) } else { format!("{:e} to {:e}", first.error, last.error) };
    // A straight line's middle is the mean of its ends: 0.
    let bent = bend.map_or(String::new(), |b| {
        format!(
            " At the scene's own slice count the value in the middle of a slab lies off the straight line by {:.0} % of the slab's whole change.",
            100.0 * b
        )
    });
    let why = if time.1 < 0.95 {
        "It pays: the transfer function changes more within a slab than one sample in its middle can tell, and the field is straight enough."
    } else if time.0 > 1.05 && slices.0 > 0.8 {
        "It loses: it takes the field for straight between a slab's two sides, but here the field bends within a slab, so that fewer slices \
         would not do; and each of its slices costs more, with a table over pairs of values to look up."
    } else if time.0 > 1.05 {
        "It saves slices and still loses time: each of its slices costs more, with a table over pairs of values to look up."
    } else if slices.1 < 0.8 {
        "It saves slices, but each costs more: in time neither is clearly better."
    } else {
        "Neither is clearly better here."
    };
    let verdict = format!(
        "For RMS errors of {range} pre-integration takes {} times the slices and {} times the time of the default. {why}{bent}",
        said(slices),
        said(time)
    );
    Some(PreIntegration { slices_for, bend, verdict })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::Settings;
    use crate::scene::{Camera, Projection, TransferFunction};
    use crate::study::{METHODS, Options, study};
    use crate::volume::{Grid, Voxels};

    fn point(method: &str, slices: u64, rms: f64, seconds: f64) -> Point {
        Point {
            method: method.into(),
            slices,
            tolerance: None,
            seconds,
            prepare_seconds: 0.0,
            repeats: 3,
            fetches: 0,
            rms,
            max: rms,
            p999: rms,
            psnr: None,
            visible: 0.0,
            ssim: None,
            flip: None,
            change: None,
            estimate: None,
        }
    }

    fn series(method: &str, order: f64, factor: f64, cost: f64) -> Vec<Point> {
        (5..12).map(|e| 1u64 << e).map(|n| point(method, n, factor * (n as f64).powf(-order), cost * n as f64)).collect()
    }

    #[test]
    fn orders_are_slopes() {
        for want in [1.0, 2.0] {
            let points = series("midpoint", want, 10.0, 1e-4);
            let got = order(NamedMethod::named("midpoint").unwrap(), &points).unwrap();
            assert!((got - want).abs() < 1e-9, "{got}");
        }
        // An error that comes to rest on another one.
        let mut points = series("midpoint", 2.0, 10.0, 1e-4);
        points.iter_mut().for_each(|p| p.rms += 2e-4);
        let got = order(NamedMethod::named("midpoint").unwrap(), &points).unwrap();
        assert!((got - 2.0).abs() < 0.3, "{got}");
        assert_eq!(order(NamedMethod::named("riemann").unwrap(), &series("midpoint", 1.0, 1.0, 1.0)), None);
    }

    #[test]
    fn the_cheapest_that_reaches_an_error_is_named() {
        let mut points = series("midpoint", 2.0, 100.0, 1e-4);
        points.extend(series("pre-integrated", 2.0, 1.0, 2e-4));
        points.extend(series("nearest", 2.0, 1e-3, 1e-9));
        let all: Vec<&NamedMethod> = METHODS.iter().collect();
        for a in advice(&all, &points) {
            let method = a.method.unwrap();
            assert_eq!(method, "pre-integrated", "{}", a.error);
            assert!(a.rms.unwrap() <= a.error && a.default_seconds.is_none_or(|d| d > a.seconds.unwrap()));
        }
        let p = pre_integration(&points, Some(0.01)).unwrap();
        for s in &p.slices_for {
            assert!((s.pre_integrated / s.midpoint - 0.1).abs() < 1e-9);
        }
        assert!(p.verdict.contains("takes 0.10 times the slices and 0.20 times the time of the default. It pays"), "{}", p.verdict);
        // As good slice for slice, and dearer.
        let mut points = series("midpoint", 2.0, 10.0, 1e-4);
        points.extend(series("pre-integrated", 2.0, 10.0, 2e-4));
        let p = pre_integration(&points, None).unwrap();
        assert!(p.verdict.contains("1.00 times the slices and 2.00 times the time of the default. It loses"), "{}", p.verdict);
    }

    #[test]
    fn a_straight_field_does_not_bend() {
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.5)]).unwrap();
        let camera = Camera::orbit(20.0, 10.0).unwrap();
        assert!(matches!(camera.projection(), Projection::Orthographic { .. } | Projection::Perspective { .. }));
        let scene = Scene::new(transfer).with_camera(camera).with_size(16, 16).unwrap();
        let of = |f: &dyn Fn(usize) -> f32| {
            let voxels = Voxels::F32((0..4096).map(|i| f(i % 16)).collect());
            let volume = Volume::new(Grid::with_spacing([16; 3], [1.0; 3]).unwrap(), voxels).unwrap();
            bend(&volume, &scene, 64).unwrap().unwrap()
        };
        // Only at the clamped outermost half voxels has it a kink.
        assert!(of(&|x| x as f32) < 0.05);
        assert!(of(&|x| (x % 2) as f32) > 0.05);
    }

    #[test]
    fn senseless_options_are_told() {
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.5)]).unwrap();
        let volume = Volume::new(Grid::with_spacing([4; 3], [1.0; 3]).unwrap(), Voxels::U8(vec![3; 64].into())).unwrap();
        let scene = Scene::new(transfer).with_size(8, 8).unwrap();
        for budget in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let said = study(&volume, &scene, &Options { budget, ..Options::default() }).unwrap_err().to_string();
            assert!(said.starts_with("budget "), "{said}");
        }
        let none = Options { budget: 1.0, methods: Vec::new(), settings: Settings::default() };
        assert_eq!(study(&volume, &scene, &none).unwrap_err().to_string(), "no methods to compare");
    }
}
