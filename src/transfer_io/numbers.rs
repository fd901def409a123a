//! Numbers and lists of them, checked as they are read.

use super::{ColorPoints, MAX_POINTS, Parsed, Points};

/// How far a colour or an opacity may lie outside `[0,1]` and still count as rounded.
const SLACK: f64 = 1e-3;

/// The number that `text` is; `what` says which one, for the message.
pub(super) fn number(text: &str, what: &str) -> Parsed<f64> {
    let text = text.trim();
    let x: f64 = text.parse().map_err(|_| format!("{what}: {:?} is no number", shortened(text)))?;
    if x.is_finite() { Ok(x) } else { Err(format!("{what}: {:?} is not finite", shortened(text))) }
}

/// The start of `text`, fit for a message.
pub(super) fn shortened(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST { text.to_owned() } else { text.chars().take(LONGEST).chain("...".chars()).collect() }
}

/// A list that begins with its count: `4 0 1 255 1`, the count being that of all numbers behind it.
pub(super) fn counted(text: &str, what: &str) -> Parsed<Vec<f64>> {
    let mut words = text.split_whitespace();
    let Some(first) = words.next() else { return Ok(Vec::new()) };
    let count: usize = first.parse().map_err(|_| format!("{what}: the count {:?} is no whole number", shortened(first)))?;
    // The words are there already, so what is kept follows from the file and not from its claim.
    let list: Vec<f64> = words.map(|w| number(w, what)).collect::<Parsed<_>>()?;
    if list.len() != count {
        return Err(format!("{what}: {count} numbers are announced and {} follow", list.len()));
    }
    Ok(list)
}

/// Groups of `N` numbers.
pub(super) fn groups<const N: usize>(list: &[f64], what: &str, each: &str) -> Parsed<Vec<[f64; N]>> {
    if list.len() % N != 0 {
        return Err(format!("{what}: {} numbers are not a multiple of {N} ({each})", list.len()));
    }
    let count = list.len() / N;
    if count > MAX_POINTS {
        return Err(format!("{what}: {count} points are over the limit of {MAX_POINTS}"));
    }
    Ok(list.chunks_exact(N).map(|chunk| std::array::from_fn(|i| chunk[i])).collect())
}

/// The points of a curve, checked: positions never fall, numbers lie in `[0,1]`.
pub(super) fn curve(points: Vec<[f64; 2]>, what: &str) -> Parsed<Points> {
    rising(points.iter().map(|p| p[0]), what)?;
    points.into_iter().map(|[x, y]| Ok((x, unit(y, x, what)?))).collect()
}

/// The points of a colour map, checked as those of a curve.
pub(super) fn colors(points: Vec<[f64; 4]>, what: &str) -> Parsed<ColorPoints> {
    rising(points.iter().map(|p| p[0]), what)?;
    points.into_iter().map(|[x, r, g, b]| Ok((x, [unit(r, x, what)?, unit(g, x, what)?, unit(b, x, what)?]))).collect()
}

/// Refuses a curve without points.
pub(super) fn some<T>(points: Vec<T>, what: &str) -> Parsed<Vec<T>> {
    if points.is_empty() { Err(format!("{what}: no points")) } else { Ok(points) }
}

/// Gradient opacity, checked: positions are magnitudes, and a curve that is 1 everywhere is none.
pub(super) fn gradient(points: Vec<[f64; 2]>, what: &str) -> Parsed<Points> {
    let points = curve(points, what)?;
    if let Some((x, _)) = points.iter().find(|p| p.0 < 0.0) {
        return Err(format!("{what}: the magnitude {x} is negative"));
    }
    Ok(if points.iter().all(|p| p.1 == 1.0) { Vec::new() } else { points })
}

fn rising(positions: impl Iterator<Item = f64>, what: &str) -> Parsed<()> {
    let mut last = f64::NEG_INFINITY;
    for x in positions {
        if x < last {
            return Err(format!("{what}: {x} comes after {last}; points must rise"));
        }
        last = x;
    }
    Ok(())
}

/// `y`, clamped to `[0,1]` where rounding took it out.
fn unit(y: f64, x: f64, what: &str) -> Parsed<f64> {
    if (-SLACK..=1.0 + SLACK).contains(&y) { Ok(y.clamp(0.0, 1.0)) } else { Err(format!("{what}: {y} at {x} is outside [0,1]")) }
}
