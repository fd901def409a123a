//! The transfer function over ranges of values.
//!
//! Between two neighbouring points of a list the function is a straight line between the points' numbers, taken as exact. Two points at one
//! value make a step; what happens at the value itself counts only where the field stays at it.

use super::interval::Interval;
use super::series::Series;
use crate::scene::TransferFunction;

/// A straight line through a point of the table: number + slope (value - origin).
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    origin: f64,
    number: Interval,
    pub(super) slope: Interval,
    /// The other point.
    last: (f64, f64),
    /// The least and the greatest number between the two points of the table.
    low: f64,
    high: f64,
}

impl Line {
    fn constant(number: f64) -> Self {
        Self { origin: 0.0, number: Interval::point(number), slope: Interval::ZERO, last: (0.0, number), low: number, high: number }
    }

    fn between((v0, a): (f64, f64), (v1, b): (f64, f64)) -> Self {
        if a == b {
            return Self::constant(a);
        }
        let slope = (Interval::point(b) - Interval::point(a)) / (Interval::point(v1) - Interval::point(v0));
        Self { origin: v0, number: Interval::point(a), slope, last: (v1, b), low: a.min(b), high: a.max(b) }
    }

    /// 1 less this line, through the point where that is least: it keeps the digits that a difference of rounded numbers would lose.
    fn rest(&self) -> Self {
        let rest = |x: f64| Interval::ONE - Interval::point(x);
        let (low, high) = (rest(self.high).lo(), rest(self.low).hi());
        let (origin, number) =
            if self.last.1 == self.high { (self.last.0, rest(self.last.1)) } else { (self.origin, Interval::ONE - self.number) };
        Self { origin, number, slope: -self.slope, last: self.last, low, high }
    }

    /// Numbers at values between the points of the table.
    pub(super) fn at(&self, values: Interval) -> Interval {
        self.extended(values).clamp(self.low, self.high)
    }

    /// Numbers at any values, the line going on beyond its points.
    pub(super) fn extended(&self, values: Interval) -> Interval {
        self.number + self.slope * (values - Interval::point(self.origin))
    }

    /// The line that goes on, of a series of values.
    pub(super) fn series(&self, values: &Series) -> Series {
        let mut out = values.0.map(|c| self.slope * c);
        out[0] = self.extended(values.0[0]);
        Series(out)
    }
}

/// Colour and opacity between two neighbouring knots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// The knots; infinite before the first and behind the last.
    low: f64,
    high: f64,
    pub(super) opacity: Line,
    /// 1 less the opacity.
    pub(super) clear: Line,
    pub(super) color: [Line; 3],
}

impl Segment {
    fn visible(&self) -> bool {
        self.opacity.high > 0.0
    }

    /// Opacities of those of the values that lie on the segment, of which there are some, and 1 less these.
    fn opacities(&self, values: Interval) -> Opacities {
        let values = values.clamp(self.low, self.high);
        Opacities { opacity: self.opacity.at(values), clear: self.clear.at(values) }
    }
}

/// Opacities, and 1 less these: each keeps digits where the other one does not.
#[derive(Debug, Clone, Copy)]
struct Opacities {
    opacity: Interval,
    clear: Interval,
}

impl Opacities {
    fn extinction(&self) -> Interval {
        let own = self.opacity.extinction();
        if self.opacity.hi() > 0.5 { own.meet((-self.clear.logarithm()).clamp(0.0, f64::INFINITY)) } else { own }
    }
}

/// What values of a range look like.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// Extinction times the reference length.
    pub(super) extinction: Interval,
    /// Straight colour of the values that are not transparent.
    pub(super) color: [Interval; 3],
    /// The one segment that all of the values lie on.
    pub(super) segment: Option<usize>,
}

/// All segments: below the first knot, between knots, above the last.
#[derive(Debug, Clone)]
pub(super) struct Table {
    knots: Vec<f64>,
    segments: Vec<Segment>,
    /// How many of the first i segments are visible.
    visible: Vec<usize>,
}

impl Table {
    pub(super) fn new(transfer: &TransferFunction) -> Self {
        let knots = transfer.knots();
        let bounds = |i: usize| {
            let low = i.checked_sub(1).map_or(f64::NEG_INFINITY, |i| knots[i]);
            (low, knots.get(i).copied().unwrap_or(f64::INFINITY))
        };
        let segments: Vec<Segment> = (0..=knots.len())
            .map(|i| {
                let (low, high) = bounds(i);
                let opacity = line(transfer.opacity(), low, high, |a| a);
                let color = [0, 1, 2].map(|c: usize| line(transfer.color(), low, high, |rgb| rgb[c]));
                Segment { low, high, opacity, clear: opacity.rest(), color }
            })
            .collect();
        let mut visible = vec![0];
        for s in &segments {
            visible.push(visible[visible.len() - 1] + usize::from(s.visible()));
        }
        Self { knots, segments, visible }
    }

    pub(super) fn segment(&self, position: usize) -> &Segment {
        &self.segments[position]
    }

    /// Positions of the first and the last segment that these values lie on for more than single places of a ray; `stays` says whether the
    /// field may stay at the greatest of them.
    fn span(&self, values: Interval, stays: bool) -> (usize, usize) {
        let first = self.knots.partition_point(|&k| k <= values.lo());
        let last = self.knots.partition_point(|&k| if stays { k <= values.hi() } else { k < values.hi() });
        (first, last.max(first))
    }

    /// Whether all of these values are transparent.
    pub(super) fn transparent(&self, values: Interval) -> bool {
        let (first, last) = self.span(values, true);
        self.visible[last + 1] == self.visible[first]
    }

    /// What these values look like; `None` where all are transparent.
    pub(super) fn look(&self, values: Interval, stays: bool) -> Option<Look> {
        let (first, last) = self.span(values, stays);
        if self.visible[last + 1] == self.visible[first] {
            return None;
        }
        let mut found: Option<([Interval; 3], Interval)> = None;
        let mut clear = false;
        for segment in &self.segments[first..=last] {
            if !segment.visible() {
                clear = true;
                continue;
            }
            let extinction = segment.opacities(values).extinction();
            let values = values.clamp(segment.low, segment.high);
            let color = segment.color.map(|line| line.at(values));
            found = Some(match found {
                None => (color, extinction),
                Some((c, e)) => ([0, 1, 2].map(|i: usize| c[i].hull(color[i])), e.hull(extinction)),
            });
        }
        let (color, extinction) = found?;
        let extinction = if clear { extinction.hull(Interval::ZERO) } else { extinction };
        Some(Look { extinction, color, segment: (first == last).then_some(first) })
    }

    /// The integral of the extinction (times the reference length) over the values from `low` to `high`.
    ///
    /// A field that rises or falls at a rate between m and M crosses these values with an optical depth between this integral over M and over
    /// m: steps, spikes and an opacity that reaches 1 need not be resolved along the ray.
    pub(super) fn depth_over(&self, low: f64, high: f64) -> Interval {
        if !(low < high && low.is_finite() && high.is_finite()) {
            return if low == high { Interval::ZERO } else { Interval::new(0.0, f64::INFINITY) };
        }
        let (first, last) = self.span(Interval::new(low, high), false);
        let mut sum = Interval::ZERO;
        for segment in self.segments[first..=last].iter().filter(|s| s.visible()) {
            let (a, b) = (low.max(segment.low), high.min(segment.high));
            let length = Interval::point(b) - Interval::point(a);
            let [from, to] = [a, b].map(|v| segment.opacities(Interval::point(v)));
            let mean = mean_extinction(from, to);
            sum = sum + length * mean;
        }
        sum
    }
}

/// The mean of -ln u over u going evenly from 1 - a to 1 - b.
///
/// -ln is convex, so the mean lies between its value in the middle and the mean of its ends (Hermite and Hadamard). Where the two ends are
/// far apart the integral's closed form is closer: (G(u) - G(w)) / (u - w) with G(u) = u - u ln u.
fn mean_extinction(a: Opacities, b: Opacities) -> Interval {
    let half = |x: Interval, y: Interval| (x + y).times(0.5).clamp(0.0, 1.0);
    let middle = Opacities { opacity: half(a.opacity, b.opacity), clear: half(a.clear, b.clear) }.extinction();
    let ends = (a.extinction() + b.extinction()).times(0.5);
    let bounds = Interval::new(middle.lo(), ends.hi().max(middle.lo()));
    let (u, w) = if a.clear.lo() > b.clear.lo() { (a.clear, b.clear) } else { (b.clear, a.clear) };
    let apart = u - w;
    if !(apart.lo() > 0.1 * u.hi()) {
        return bounds;
    }
    // u ln u goes to 0 with u.
    let whole = |u: Interval| if u.hi() <= 0.0 { Interval::ZERO } else { u - product_with_ln(u) };
    bounds.meet((whole(u) - whole(w)) / apart)
}

/// u ln u of numbers within [0,1]: falls to -1/e at 1/e and rises again.
fn product_with_ln(u: Interval) -> Interval {
    let at = |u: f64| if u <= 0.0 { Interval::ZERO } else { Interval::point(u) * Interval::point(u).logarithm() };
    let ends = at(u.lo()).hull(at(u.hi()));
    // 1/e lies between these two numbers.
    if u.hi() < 0.367 || u.lo() > 0.368 { ends } else { ends.hull(Interval::new(-0.368, -0.367)) }
}

/// The line of a list on values between two neighbouring knots.
fn line<C: Copy>(points: &[(f64, C)], low: f64, high: f64, part: impl Fn(C) -> f64) -> Line {
    let point = |i: usize| (points[i].0, part(points[i].1));
    // Points up to the lower knot, and from the upper one on: no point lies between them.
    let before = points.partition_point(|p| p.0 <= low);
    let after = points.partition_point(|p| p.0 < high);
    match (before.checked_sub(1), after < points.len()) {
        (Some(i), true) => Line::between(point(i), point(after)),
        (Some(i), false) => Line::constant(point(i).1),
        (None, _) => Line::constant(point(0).1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_belong_to_the_side_that_is_touched() {
        let transfer = TransferFunction::new(vec![(0.0, [0.0; 3]), (1.0, [1.0; 3])], vec![(0.5, 0.0), (0.5, 1.0)]);
        let table = Table::new(&transfer.unwrap_or_else(|e| panic!("{e}")));
        let look = |lo, hi, stays| table.look(Interval::new(lo, hi), stays);
        assert!(look(0.1, 0.5, false).is_none(), "a field that only touches the step is clear");
        let at = look(0.1, 0.5, true).map(|l| (l.extinction.lo(), l.extinction.hi()));
        assert_eq!(at, Some((0.0, f64::INFINITY)), "one that stays at it may be a wall");
        let wall = look(0.5, 0.7, false).map(|l| (l.extinction.lo(), l.segment));
        assert_eq!(wall, Some((f64::INFINITY, Some(2))));
    }

    #[test]
    fn means_of_extinction_have_their_closed_form() {
        for (a, b) in [(0.0, 1.0), (0.2, 0.7), (0.4, 0.41), (0.3, 0.3), (0.9, 0.0), (1.0, 0.5)] {
            let ends = |a: f64| Opacities { opacity: Interval::point(a), clear: Interval::ONE - Interval::point(a) };
            let got = mean_extinction(ends(a), ends(b));
            let want = crate::reference::closed::opacity_ramp_depth(a, b, 1.0);
            assert!(got.lo() <= want + 1e-12 && want <= got.hi() + 1e-12, "{a} {b}: {got:?} {want}");
            assert!(got.width() < 1e-3, "{a} {b}: {got:?}");
        }
        let wall = Opacities { opacity: Interval::ONE, clear: Interval::ZERO };
        assert_eq!(mean_extinction(wall, wall).lo(), f64::INFINITY);
    }
}
