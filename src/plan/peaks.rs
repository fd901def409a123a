//! What a frame needs to pass over bricks that cannot change a projection of the largest, the smallest or the first large value.

use super::scaling::Scaling;
use crate::fragment::Frame;
use crate::scene::TransferFunction;
use crate::skip::PeakTable;
use std::sync::Arc;

/// What a frame needs to pass over bricks that cannot change a projection.
#[derive(Debug)]
pub(crate) struct Peaks<'v> {
    /// How far values reach where.
    pub(crate) table: Arc<PeakTable>,
    /// Where first local maxima are looked for: the frame with a level that no value reaches, for rays that have none.
    pub(crate) to_the_end: Option<Box<Frame<'v>>>,
    /// The numbers up to which, and from which on, all look alike.
    alike: [f32; 2],
}

impl<'v> Peaks<'v> {
    /// Of values that `transfer` makes colours of and that are `scaling` numbers.
    pub(super) fn new(table: Arc<PeakTable>, to_the_end: Option<Box<Frame<'v>>>, transfer: &TransferFunction, scaling: &Scaling) -> Self {
        let [low, high] = flat_ends(transfer);
        // As a number is turned into a value where pixels get their colours: that never falls as numbers rise.
        let value = |number: f32| scaling.scale * f64::from(number) + scaling.offset;
        let slack = |value: f64| 1e-6 * scaling.number(value).abs() + f64::from(f32::MIN_POSITIVE);
        let (below, above) = ((scaling.number(low) - slack(low)) as f32, (scaling.number(high) + slack(high)) as f32);
        let below = if value(below) < low { below } else { f32::NEG_INFINITY };
        let above = if value(above) >= high { above } else { f32::INFINITY };
        Self { table, to_the_end, alike: [below, above] }
    }

    /// What a pixel has to have seen so that values up to `bound` (or down to it) do not change its colour; one value at least.
    pub(crate) fn enough(&self, bound: f32) -> f32 {
        let [below, above] = self.alike;
        match self.table.falls {
            false if bound <= below => f32::MIN,
            false => bound.min(above),
            true if bound >= above => f32::MAX,
            true => bound.max(below),
        }
    }
}

/// The value below which all look alike, and the one from which on they do.
fn flat_ends(transfer: &TransferFunction) -> [f64; 2] {
    let ([color_low, color_high], [low, high]) = (flat(transfer.color()), flat(transfer.opacity()));
    let clear = |point: Option<&(f64, f64)>| point.is_some_and(|point| point.1 == 0.0);
    [
        if clear(transfer.opacity().first()) { low } else { low.min(color_low) },
        if clear(transfer.opacity().last()) { high } else { high.max(color_high) },
    ]
}

/// The value below which the function through `points` is what it is at its first point, and the one from which on it is what it is at its last.
fn flat<C: PartialEq>(points: &[(f64, C)]) -> [f64; 2] {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return [f64::NEG_INFINITY, f64::INFINITY] };
    let low = points.iter().take_while(|p| p.1 == first.1).count();
    let high = points.iter().rev().take_while(|p| p.1 == last.1).count();
    if low == points.len() {
        return [f64::INFINITY, f64::NEG_INFINITY];
    }
    [points[low - 1].0, points[points.len() - high].0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_transfer_function_are_flat() {
        let all = [0.5; 3];
        let of = |color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>| flat_ends(&TransferFunction::new(color, opacity).expect("points"));
        // A window.
        assert_eq!(of(vec![(10.0, [0.0; 3]), (20.0, [1.0; 3])], vec![(0.0, 1.0)]), [10.0, 20.0]);
        // What is transparent has no colour.
        assert_eq!(of(vec![(0.0, [0.0; 3]), (90.0, [1.0; 3])], vec![(40.0, 0.0), (50.0, 0.0), (60.0, 0.2), (70.0, 0.0)]), [50.0, 70.0]);
        // Points that repeat the last one; a step at the end.
        assert_eq!(of(vec![(0.0, all)], vec![(5.0, 0.1), (6.0, 0.1), (6.0, 0.7), (8.0, 0.7), (9.0, 0.7)]), [6.0, 6.0]);
        assert_eq!(of(vec![(0.0, all)], vec![(5.0, 0.3)]), [f64::INFINITY, f64::NEG_INFINITY]);
        // Looked at from outside, value by value.
        let transfer = TransferFunction::new(vec![(1.0, all), (4.0, [1.0; 3])], vec![(2.0, 0.0), (3.0, 0.5), (5.0, 0.5)]).expect("points");
        let [low, high] = flat_ends(&transfer);
        let shown = |value: f64| transfer.eval(value).premultiply();
        for i in 0..800 {
            let value = f64::from(i) * 0.01;
            assert!(value >= low || shown(value) == shown(-7.0), "{value}");
            assert!(value < high || shown(value) == shown(99.0), "{value}");
        }
        assert_eq!([low, high], [2.0, 4.0]);
    }
}
