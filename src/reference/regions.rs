//! Transfer functions of value and gradient along a piece of ray: extinction and colour with their derivatives, and where they have kinks.

use super::field::Along;
use super::light::Dual;
use super::roots::{add, product, sign_changes};
use crate::scene::{Shape, Transfer2d};

/// Standard deviations at which a Gaussian region ends.
const END: f64 = 5.0;

/// Straight colour, and opacity per reference length, at a value and a size of the gradient.
pub(super) fn at(transfer: &Transfer2d, v: Dual, g: Dual) -> ([Dual; 3], Dual) {
    let (mut sums, mut depth) = ([Dual::fixed(0.0); 3], Dual::fixed(0.0));
    let mut gather = |color: [f64; 3], extinction: Dual| {
        depth = depth + extinction;
        for (sum, c) in sums.iter_mut().zip(color) {
            *sum = *sum + extinction.times(c);
        }
    };
    for region in transfer.region_list() {
        let opacity = strength(&region.shape, v, g).times(region.opacity);
        let left = 1.0 - opacity.v.min(1.0 - f64::EPSILON / 2.0);
        gather(region.color, Dual { v: -libm::log(left), d: opacity.d / left });
    }
    if let Some(table) = transfer.entries() {
        let (i, x) = entry(v, table.range, table.columns);
        let (j, y) = entry(g, table.gradient_range, table.rows);
        let one = Dual::fixed(1.0);
        for (di, along) in [(0, one - x), (1, x)] {
            for (dj, up) in [(0, one - y), (1, y)] {
                let [r, g, b, a] = table.colors[(j + dj) * table.columns + i + di].map(f64::from);
                gather([r, g, b], (along * up).times(-libm::log1p(-a.min(1.0 - f64::EPSILON / 2.0))));
            }
        }
    }
    if depth.v <= 0.0 {
        return ([Dual::fixed(0.0); 3], Dual::fixed(0.0));
    }
    (sums.map(|sum| sum / depth), Dual { v: -libm::expm1(-depth.v), d: depth.d * libm::exp(-depth.v) })
}

/// The entry of a table before `x`, and how far it is from there to the next.
fn entry(x: Dual, [low, high]: [f64; 2], n: usize) -> (usize, Dual) {
    let at = (x - Dual::fixed(low)).times((n - 1) as f64 / (high - low));
    if at.v <= 0.0 {
        (0, Dual::fixed(0.0))
    } else if at.v >= (n - 1) as f64 {
        (n - 2, Dual::fixed(1.0))
    } else {
        let first = (at.v as usize).min(n - 2);
        (first, at - Dual::fixed(first as f64))
    }
}

/// How far apart, with the derivative.
fn distance(x: Dual, to: f64) -> Dual {
    let way = x - Dual::fixed(to);
    if way.v < 0.0 { way.times(-1.0) } else { way }
}

/// A shape's strength.
fn strength(shape: &Shape, v: Dual, g: Dual) -> Dual {
    let (none, all) = (Dual::fixed(0.0), Dual::fixed(1.0));
    let falling = |share: Dual| if share.v < 1.0 { all - share } else { none };
    match *shape {
        Shape::Box { value: [a, b], gradient: [c, d] } => {
            if (a..=b).contains(&v.v) && (c..=d).contains(&g.v) {
                all
            } else {
                none
            }
        }
        Shape::Triangle { value, width, gradient } if g.v > 0.0 && g.v <= gradient => {
            falling(distance(v, value).times(gradient / width) / g)
        }
        Shape::Triangle { .. } => none,
        Shape::Gaussian { value, width, gradient, height } => {
            let (x, y) = (distance(v, value).times(1.0 / width), distance(g, gradient).times(1.0 / height));
            if x.v > END || y.v > END {
                return none;
            }
            let power = (x * x + y * y).times(-0.5);
            let strength = libm::exp(power.v);
            Dual { v: strength, d: strength * power.d }
        }
        Shape::Levoy { value, thickness } => {
            let away = distance(v, value);
            if away.v == 0.0 {
                all
            } else if g.v > 0.0 {
                falling(away.times(1.0 / thickness) / g)
            } else {
                none
            }
        }
    }
}

/// Adds the places in (0,1) at which something has a kink or a jump, of values along `field` and squared sizes of gradients (in units of
/// `scale` squared) along the polynomial `squared`.
pub(super) fn cuts(transfer: &Transfer2d, field: &dyn Along, squared: &[f64], scale: f64, found: &mut Vec<f64>) {
    const NOISE: f64 = 1e-14;
    let largest = field.coefficients().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let at_value = |level: f64, found: &mut Vec<f64>| {
        let mut beyond = field.coefficients().to_vec();
        beyond[0] -= level;
        sign_changes(&beyond, NOISE * largest.max(level.abs()), found);
    };
    let at_size = |size: f64, found: &mut Vec<f64>| {
        let size = size / scale;
        // No size on the piece comes near sqrt(3) times 4.
        if scale > 0.0 && (0.0..10.0).contains(&size) {
            let mut beyond = squared.to_vec();
            beyond[0] -= size * size;
            sign_changes(&beyond, NOISE, found);
        }
    };
    // Where |v - level| = per_size |g|.
    let at_side = |level: f64, per_size: f64, found: &mut Vec<f64>| {
        let mut away = field.coefficients().to_vec();
        away[0] -= level;
        let mut beyond = vec![0.0; (2 * away.len() - 1).max(squared.len())];
        add(&mut beyond, &product(&away, &away));
        let unit = (per_size * scale) * (per_size * scale);
        let most = largest.max(level.abs());
        if unit.is_finite() && most.is_finite() {
            add(&mut beyond, &squared.iter().map(|c| -unit * c).collect::<Vec<_>>());
            sign_changes(&beyond, NOISE * (most * most).max(unit), found);
        }
    };
    for region in transfer.region_list() {
        match region.shape {
            Shape::Box { value, gradient } => {
                value.into_iter().for_each(|v| at_value(v, found));
                gradient.into_iter().for_each(|g| at_size(g, found));
            }
            Shape::Triangle { value, width, gradient } => {
                at_value(value, found);
                at_size(gradient, found);
                at_side(value, width / gradient, found);
            }
            Shape::Gaussian { value, width, gradient, height } => {
                [-1.0, 1.0].into_iter().for_each(|side| at_value(value + side * END * width, found));
                // The distance to the centre is squared, so that it has no kink there.
                [-1.0, 1.0].into_iter().for_each(|side| at_size(gradient + side * END * height, found));
            }
            Shape::Levoy { value, thickness } => {
                at_value(value, found);
                at_side(value, thickness, found);
            }
        }
    }
    if let Some(table) = transfer.entries() {
        let line = |n: usize, count: usize, [low, high]: [f64; 2]| low + (high - low) * n as f64 / (count - 1) as f64;
        (0..table.columns).for_each(|n| at_value(line(n, table.columns, table.range), found));
        (0..table.rows).for_each(|n| at_size(line(n, table.rows, table.gradient_range), found));
    }
}
