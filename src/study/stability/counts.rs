//! One to a million slices of a uniform medium, in the numbers of three targets.

use super::look::{Bench, COLOR, number};
use super::stiff::{cube, uniform};
use super::{CountPoint, Row};
use crate::scene::{Accumulation, Method, Target};
use crate::{Result, Volume};

const COUNTS: [u64; 7] = [1, 10, 100, 1000, 10_000, 100_000, 1_000_000];
/// Opacities of the whole medium.
const OPACITIES: [f64; 8] = [1e-9, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99, 0.999];
/// What f32 promises by itself, however many slices there are: an error, and a part of each component.
const BOUND: f64 = 1e-5;
const PART: f64 = 1e-3;

pub(super) fn rows(bench: &Bench<'_>) -> Result<(Vec<Row>, Vec<CountPoint>)> {
    let volume = cube()?;
    let mut rows = Vec::new();
    let mut points = Vec::new();
    let targets = [
        ("f32", Method::default()),
        ("plain f32", Method { accumulation: Accumulation::Plain, ..Method::default() }),
        ("8 bits", Method { target: Target::Unorm8, ..Method::default() }),
    ];
    for (target, method) in targets {
        for opacity in OPACITIES {
            let mut all = Vec::new();
            let mut falls = true;
            for slices in COUNTS {
                let (point, fell) = point(bench, &volume, target, method, opacity, slices)?;
                falls &= fell;
                all.push(point);
            }
            rows.push(row(target, opacity, &all, falls));
            points.extend(all);
        }
    }
    let time = |target: &str| {
        points.iter().filter(|p| p.target == target && p.slices == 1_000_000).map(|p| p.seconds).fold(f64::INFINITY, f64::min)
    };
    let (kept, plain) = (time("f32"), time("plain f32"));
    // More in one of the stages of a frame, on a machine that may do other things.
    rows.push(Row {
        group: "many slices".into(),
        case: "cost of compensated sums, a million slices".into(),
        promise: "at most three times the time of plain sums".into(),
        measured: format!("{:.2} times: {:.0} ms against {:.0} ms for one block", kept / plain, 1e3 * kept, 1e3 * plain),
        error: Some(kept / plain),
        bound: Some(3.0),
        holds: kept <= 3.0 * plain,
    });
    Ok((rows, points))
}

/// One picture, and whether transmittances only fell on the way.
fn point(bench: &Bench<'_>, volume: &Volume, target: &str, method: Method, opacity: f64, slices: u64) -> Result<(CountPoint, bool)> {
    let depth = -libm::log1p(-opacity) / slices as f64;
    let scene = uniform(depth, slices)?.with_size(8, 8)?.with_method(method)?;
    let (picture, stats, descent) = bench.render(volume, &scene)?;
    let want = [COLOR[0] * opacity, COLOR[1] * opacity, COLOR[2] * opacity, opacity];
    let off = picture.pixels().iter().flat_map(|p| (0..4).map(move |c| (f64::from(p[c]) - want[c]).abs()));
    let error = off.fold(0.0, |m: f64, d| if d.is_nan() { f64::INFINITY } else { m.max(d) });
    let parts = picture.pixels().iter().flat_map(|p| (0..4).map(move |c| (f64::from(p[c]) / want[c] - 1.0).abs()));
    let part = parts.fold(0.0, |m: f64, d| if d.is_nan() { f64::INFINITY } else { m.max(d) });
    let slab = -libm::expm1(-depth);
    let predicted = match target {
        "8 bits" => eight_bits(slab, slices, want),
        "f32" => BOUND,
        _ => plain(slices),
    };
    let point = CountPoint { target: target.into(), opacity, slices, error, part, predicted, seconds: stats.render_seconds };
    Ok((point, descent.broken == 0))
}

/// Bound for plain sums: 1 - a and T (1 - a) are each rounded by at most 2^-25, and so is each sum, slice after slice; 2^-22 for the
/// first of all.
fn plain(slices: u64) -> f64 {
    slices as f64 * 1.5 * libm::exp2(-24.0) + libm::exp2(-22.0)
}

/// The error of `slices` slabs of opacity `slab` whose sums are rounded to 8 bits after each of them.
fn eight_bits(slab: f64, slices: u64, want: [f64; 4]) -> f64 {
    let round = |x: f64| (x * 255.0 + 0.5).floor() / 255.0;
    let (mut colors, mut left) = ([0.0; 3], 1.0);
    for _ in 0..slices {
        let before = (colors, left);
        for (sum, color) in colors.iter_mut().zip(COLOR) {
            *sum = round(*sum + left * slab * color);
        }
        left = round(left * (1.0 - slab));
        if (colors, left) == before {
            break;
        }
    }
    let got = [colors[0], colors[1], colors[2], 1.0 - left];
    got.iter().zip(want).map(|(g, w)| (g - w).abs()).fold(0.0, f64::max)
}

fn row(target: &str, opacity: f64, points: &[CountPoint], falls: bool) -> Row {
    let worst = points.iter().map(|p| p.error).fold(0.0, f64::max);
    let part = points.iter().map(|p| p.part).fold(0.0, f64::max);
    let at = points.iter().max_by(|a, b| a.error.total_cmp(&b.error)).map_or(0, |p| p.slices);
    let (promise, bound, kept) = match target {
        // A rounding that falls on the other side is a step of 1/255, and shifts where the sum comes to rest by another.
        "8 bits" => ("error as predicted to 2/255".to_owned(), None, points.iter().all(|p| (p.error - p.predicted).abs() <= 2.0 / 255.0)),
        "plain f32" => ("error <= N 1.5 2^-24".to_owned(), None, points.iter().all(|p| p.error <= p.predicted)),
        _ => {
            let promise = format!("error <= {BOUND:.0e}, and <= {PART:.0e} of each component");
            (promise, Some(BOUND), points.iter().all(|p| p.error <= p.predicted && p.part <= PART))
        }
    };
    Row {
        group: "many slices".into(),
        case: format!("{target}, opacity {} in 1 to 1000000 slices", number(opacity)),
        promise: format!("{promise}, transmittance never rises"),
        measured: format!(
            "error {worst:.1e} at {at} slices, {part:.1e} of a component{}",
            if falls { "" } else { ", transmittance rises" }
        ),
        error: Some(worst),
        bound,
        holds: kept && falls,
    }
}
