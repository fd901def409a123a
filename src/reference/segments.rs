//! The transfer function as straight segments between knots.

use crate::scene::TransferFunction;

/// Colour and opacity on values between two neighbouring knots: straight lines in (value - origin).
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// Value at which `color` and `opacity` hold.
    pub(super) origin: f64,
    /// Straight colour at the origin, and its change per unit of value.
    pub(super) color: [f64; 3],
    pub(super) color_slope: [f64; 3],
    /// Opacity per reference length at the origin, and its change per unit of value.
    pub(super) opacity: f64,
    pub(super) opacity_slope: f64,
    /// 1 less the opacity at both ends, and the value of the upper one: next to an opacity of 1 they keep the digits that a difference loses.
    clear: (f64, f64),
    end: f64,
    /// Largest opacity on the segment.
    pub(super) most: f64,
}

impl Segment {
    /// 1 less the opacity at a value on the segment.
    pub(super) fn clear(&self, value: f64) -> f64 {
        let (low, high) = self.clear;
        if low == high {
            return low;
        }
        ((low * (self.end - value) + high * (value - self.origin)) / (self.end - self.origin)).clamp(0.0, 1.0)
    }
}

/// All segments of a transfer function: below the first knot, between knots, above the last.
#[derive(Debug, Clone)]
pub(super) struct Segments {
    knots: Vec<f64>,
    segments: Vec<Segment>,
    /// How many of the first i segments are not transparent throughout.
    visible: Vec<usize>,
}

/// The limit of a piecewise-linear list at `value` from above, or from below.
fn limit<C: Copy>(points: &[(f64, C)], value: f64, above: bool, mix: impl Fn(C, C, f64) -> C) -> C {
    let after = points.partition_point(|p| if above { p.0 <= value } else { p.0 < value });
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(&(v0, a)), Some(&(v1, b))) => mix(a, b, (value - v0) / (v1 - v0)),
        (Some(&(_, only)), None) | (None, Some(&(_, only))) => only,
        (None, None) => unreachable!("a transfer function has at least one point"),
    }
}

impl Segments {
    pub(super) fn new(transfer: &TransferFunction) -> Self {
        let color = |v, above| limit(transfer.color(), v, above, |a, b, t| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t));
        let opacity = |v, above| limit(transfer.opacity(), v, above, |a, b, t| a + (b - a) * t);
        let rest: Vec<(f64, f64)> = transfer.opacity().iter().map(|&(v, a)| (v, 1.0 - a)).collect();
        let clear = |v, above| limit(&rest, v, above, |a, b, t| a + (b - a) * t);
        let constant = |v: f64, above: bool| {
            let (opacity, clear) = (opacity(v, above), clear(v, above));
            Segment {
                origin: v,
                color: color(v, above),
                color_slope: [0.0; 3],
                opacity,
                opacity_slope: 0.0,
                clear: (clear, clear),
                end: v,
                most: opacity,
            }
        };
        let knots = transfer.knots();
        let mut segments = Vec::with_capacity(knots.len() + 1);
        segments.push(constant(knots[0], false));
        for pair in knots.windows(2) {
            let (low, high) = (pair[0], pair[1]);
            let (c0, c1, a0, a1) = (color(low, true), color(high, false), opacity(low, true), opacity(high, false));
            let width = high - low;
            segments.push(Segment {
                origin: low,
                color: c0,
                color_slope: std::array::from_fn(|i| (c1[i] - c0[i]) / width),
                opacity: a0,
                opacity_slope: (a1 - a0) / width,
                clear: (clear(low, true), clear(high, false)),
                end: high,
                most: a0.max(a1),
            });
        }
        segments.push(constant(knots[knots.len() - 1], true));
        let mut visible = vec![0];
        for s in &segments {
            visible.push(visible[visible.len() - 1] + usize::from(s.most > 0.0));
        }
        Self { knots, segments, visible }
    }

    /// Position of the segment that `value` lies on; a knot belongs to the segment above it.
    pub(super) fn position(&self, value: f64) -> usize {
        self.knots.partition_point(|&k| k <= value)
    }

    pub(super) fn segment(&self, position: usize) -> &Segment {
        &self.segments[position]
    }

    /// Whether every value in [low, high] is transparent.
    pub(super) fn transparent(&self, low: usize, high: usize) -> bool {
        self.visible[high + 1] == self.visible[low]
    }

    /// Knots strictly between two values, rising.
    pub(super) fn knots_between(&self, low: f64, high: f64) -> &[f64] {
        let first = self.knots.partition_point(|&k| k <= low);
        let last = self.knots.partition_point(|&k| k < high);
        &self.knots[first..last.max(first)]
    }
}
