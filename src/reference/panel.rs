//! One smooth piece of ray, integrated to a bound.
//!
//! With T' = -kappa T and C' = kappa c T, integration by parts gives C = c(a) T(a) - c(b) T(b) + integral of c' T: no kappa is left
//! under the integral, so an opacity that goes to 1 costs no accuracy. T comes from the optical depth at Gauss points, which
//! collocation gives at each point of the panel. Two rules of different order tell the error; panels are halved until it fits.

use super::field::Along;
use super::light::Lit;
use super::segments::Segment;
use std::f64::consts::PI;

/// Gauss-Legendre rule of M points on `[0,1]` with the matrix that integrates from 0 to each point.
#[derive(Debug, Clone)]
pub(super) struct Rule<const M: usize> {
    pub(super) points: [f64; M],
    pub(super) weights: [f64; M],
    partial: [[f64; M]; M],
}

impl<const M: usize> Rule<M> {
    pub(super) fn new() -> Self {
        // Legendre polynomial of degree M and its derivative, by the three-term recurrence.
        let legendre = |x: f64| {
            let (mut p0, mut p1) = (1.0, x);
            for k in 2..=M {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
            }
            (p1, M as f64 * (x * p1 - p0) / (x * x - 1.0))
        };
        let (mut points, mut weights) = ([0.0; M], [0.0; M]);
        for i in 0..M {
            let mut x = -libm::cos(PI * (i as f64 + 0.75) / (M as f64 + 0.5));
            for _ in 0..10 {
                let (p, slope) = legendre(x);
                x -= p / slope;
            }
            let slope = legendre(x).1;
            points[i] = 0.5 * (1.0 + x);
            weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
        }
        // The rule itself integrates the Lagrange polynomials, of degree M - 1, exactly.
        let lagrange =
            |j: usize, x: f64| -> f64 { (0..M).filter(|&k| k != j).map(|k| (x - points[k]) / (points[j] - points[k])).product() };
        let partial = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..M).map(|k| points[i] * weights[k] * lagrange(j, points[i] * points[k])).sum())
        });
        Self { points, weights, partial }
    }
}

/// What fog does on a smooth piece: a factor and its derivative, smooth in depth.
#[derive(Debug, Clone, Copy)]
pub(super) enum Haze {
    /// Factor 1.
    Clear,
    /// Factor 0.
    Full,
    /// (end - z) * scale.
    Linear { end: f64, scale: f64 },
    /// exp(-density z).
    Exp { density: f64 },
    /// exp(-(density z)^2).
    Exp2 { density: f64 },
}

/// The fog distance z along a ray: z^2 = aside^2 + (rate d)^2 at depth d.
#[derive(Debug, Clone, Copy)]
pub(super) struct Distance {
    pub(super) aside: f64,
    pub(super) rate: f64,
}

impl Distance {
    /// z and dz/dd at depth d.
    pub(super) fn at(&self, d: f64) -> (f64, f64) {
        let along = self.rate * d;
        if self.aside == 0.0 {
            return (along.abs(), self.rate.copysign(along));
        }
        let z = libm::hypot(self.aside, along);
        (z, self.rate * along / z)
    }
}

/// Fog on one piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct PieceFog {
    pub(super) haze: Haze,
    pub(super) color: [f64; 3],
    pub(super) distance: Distance,
    /// Depth at s = 0, and its change from s = 0 to 1.
    pub(super) depth: f64,
    pub(super) depth_step: f64,
}

impl PieceFog {
    /// The exponent x of a factor exp(-x), as far as the factor matters; 0 for fog of another form.
    fn exponent(&self, s: f64) -> f64 {
        let z = self.distance.at(self.depth + self.depth_step * s).0;
        let x = match self.haze {
            Haze::Exp { density } => density * z,
            Haze::Exp2 { density } => (density * z) * (density * z),
            Haze::Clear | Haze::Full | Haze::Linear { .. } => 0.0,
        };
        // exp(-50) is far below every tolerance.
        x.min(50.0)
    }

    /// The factor and its derivative by s.
    pub(super) fn factor(&self, s: f64) -> (f64, f64) {
        let (z, rate) = self.distance.at(self.depth + self.depth_step * s);
        let dz = rate * self.depth_step;
        match self.haze {
            Haze::Clear => (1.0, 0.0),
            Haze::Full => (0.0, 0.0),
            Haze::Linear { end, scale } => ((end - z) * scale, -dz * scale),
            Haze::Exp { density } => {
                let f = libm::exp(-density * z);
                (f, -density * dz * f)
            }
            Haze::Exp2 { density } => {
                let f = libm::exp(-(density * z) * (density * z));
                // Squares of huge densities are infinite, and 0 times infinity is NaN.
                if f == 0.0 { (0.0, 0.0) } else { (f, -2.0 * density * density * z * dz * f) }
            }
        }
    }
}

/// A piece of ray on which everything is smooth: the value along it, its segment of the transfer function, its length.
#[derive(Clone, Copy)]
pub(super) struct Piece<'a> {
    pub(super) field: &'a dyn Along,
    pub(super) segment: &'a Segment,
    /// Length from s = 0 to 1 in reference lengths.
    pub(super) length: f64,
    pub(super) fog: Option<PieceFog>,
    /// Light, and the factor of the gradient on the extinction.
    pub(super) lit: Option<&'a Lit<'a>>,
}

impl Piece<'_> {
    fn opacity(&self, s: f64) -> f64 {
        if let Some((.., opacity)) = self.lit.and_then(|lit| lit.by_gradient(s, self.field)) {
            return opacity;
        }
        (self.segment.opacity + self.segment.opacity_slope * (self.field.at(s) - self.segment.origin)).clamp(0.0, 1.0)
    }

    /// ln(1 - opacity).
    fn log_clear(&self, s: f64, opacity: f64) -> f64 {
        if opacity <= 0.5 || self.lit.is_some_and(|lit| lit.by_gradient(s, self.field).is_some()) {
            return libm::log1p(-opacity);
        }
        libm::log(self.segment.clear(self.field.at(s)))
    }

    /// Straight colour as the eye sees it, fog included.
    fn color(&self, s: f64) -> [f64; 3] {
        let v = self.field.at(s) - self.segment.origin;
        let mut color: [f64; 3] = std::array::from_fn(|i| self.segment.color[i] + self.segment.color_slope[i] * v);
        if self.lit.is_some() {
            color = self.own(s).0;
        }
        match &self.fog {
            None => color,
            Some(fog) => {
                let (f, _) = fog.factor(s);
                std::array::from_fn(|i| f * color[i] + (1.0 - f) * fog.color[i])
            }
        }
    }

    /// Straight colour in the light, out of fog, and its derivative by s.
    fn own(&self, s: f64) -> ([f64; 3], [f64; 3]) {
        let v = self.field.at(s) - self.segment.origin;
        // Rounding may leave [0,1], and powers of light would not.
        let color = std::array::from_fn(|i| (self.segment.color[i] + self.segment.color_slope[i] * v).clamp(0.0, 1.0));
        let slope = self.segment.color_slope.map(|c| c * self.field.slope(s));
        let (color, slope) =
            self.lit.and_then(|lit| lit.by_gradient(s, self.field)).map_or((color, slope), |(color, slope, _)| (color, slope));
        self.lit.map_or((color, slope), |lit| lit.color(s, color, slope))
    }

    /// Derivative of [`Piece::color`] by s.
    fn color_slope(&self, s: f64) -> [f64; 3] {
        if self.lit.is_some() {
            let (color, slope) = self.own(s);
            return match &self.fog {
                None => slope,
                Some(fog) => {
                    let (f, df) = fog.factor(s);
                    std::array::from_fn(|i| df * (color[i] - fog.color[i]) + f * slope[i])
                }
            };
        }
        let own = self.segment.color_slope.map(|c| c * self.field.slope(s));
        match &self.fog {
            None => own,
            Some(fog) => {
                let (f, df) = fog.factor(s);
                let v = self.field.at(s) - self.segment.origin;
                std::array::from_fn(|i| df * (self.segment.color[i] + self.segment.color_slope[i] * v - fog.color[i]) + f * own[i])
            }
        }
    }

    /// The integral of (derivative of the colour by s) * T over [a,b], and the optical depth, by one rule.
    fn apply<const M: usize>(&self, rule: &Rule<M>, a: f64, b: f64) -> Sum {
        let h = b - a;
        let at: [f64; M] = std::array::from_fn(|i| a + h * rule.points[i]);
        let opacity = at.map(|s| self.opacity(s));
        let some = self.lit.is_none_or(|lit| at.iter().any(|&s| lit.factor(s) > 0.0));
        if some && opacity.iter().all(|&o| o >= 1.0) && self.may_be_wall() {
            return Sum { depth: f64::INFINITY, emitted: [0.0; 3], rise: [0.0; 3] };
        }
        // An opacity that rounds to 1 at a point of an otherwise lesser piece: the largest finite extinction.
        let mut rate = std::array::from_fn(|i| -self.log_clear(at[i], opacity[i]).max(-745.0) * self.length * h);
        if let Some(lit) = self.lit {
            rate.iter_mut().zip(at).for_each(|(rate, s)| *rate *= lit.factor(s));
        }
        let depth = dot(&rule.weights, &rate);
        let (mut emitted, mut rise) = ([0.0; 3], [0.0; 3]);
        for ((&s, w), partial) in at.iter().zip(&rule.weights).zip(&rule.partial) {
            let weight = h * w * libm::exp(-dot(partial, &rate));
            for ((sum, rise), slope) in emitted.iter_mut().zip(&mut rise).zip(self.color_slope(s)) {
                *sum += weight * slope;
                *rise += h * w * slope;
            }
        }
        Sum { depth, emitted, rise }
    }

    /// Whether opacity can be 1 for more than single places. Where it only passes 1 (a spike's peak, a ramp's end) the extinction is infinite
    /// there, its integral is not, and a panel can be so short that all of its points round to 1.
    fn may_be_wall(&self) -> bool {
        let by_gradient = self.lit.is_some_and(|lit| lit.by_gradient(0.5, self.field).is_some());
        by_gradient || self.segment.opacity_slope == 0.0 || !self.field.varies()
    }

    /// What rounding may change about a difference of two colours: values far from 0 leave few digits to what lies between them.
    fn noise(&self) -> f64 {
        let value = self.field.coefficients().iter().map(|c| c.abs()).sum::<f64>() + self.segment.origin.abs();
        let slope = self.segment.color_slope.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        16.0 * f64::EPSILON * (1.0 + value * slope)
    }

    /// Whether the colour is the same all along.
    fn one_color(&self) -> bool {
        let fog_varies = self.fog.is_some_and(|f| !matches!(f.haze, Haze::Clear | Haze::Full));
        let value_varies = self.field.varies() && self.segment.color_slope.iter().any(|&c| c != 0.0);
        !(fog_varies || value_varies || self.lit.is_some())
    }
}

fn dot<const M: usize>(a: &[f64; M], b: &[f64; M]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[derive(Debug, Clone, Copy)]
struct Sum {
    /// Optical depth.
    depth: f64,
    /// The integral of (derivative of the colour) * T.
    emitted: [f64; 3],
    /// The integral of the derivative of the colour.
    rise: [f64; 3],
}

/// Colour and transmittance gathered so far along a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gathered {
    pub(super) rgb: [f64; 3],
    pub(super) transmittance: f64,
    pub(super) error: f64,
    pub(super) panels: u32,
}

/// Below this nothing behind can be told from rounding: the ray ends.
pub(super) const DARK: f64 = 1e-15;
/// Error of a panel that rounding alone may cause.
const ROUNDING: f64 = 1e-15;
/// Optical depth of a panel, or change of fog's exponent, up to which the rules resolve the exponential.
const DEEP: f64 = 4.0;
/// Share of a lit piece's tolerance that a panel may take, however short it is.
const KINK: f64 = 1e-2;
/// Most halvings of a piece.
const HALVINGS: u32 = 60;

/// The two rules whose difference tells the error.
#[derive(Debug, Clone)]
pub(super) struct Quadrature {
    coarse: Rule<5>,
    fine: Rule<8>,
}

impl Quadrature {
    pub(super) fn new() -> Self {
        Self { coarse: Rule::new(), fine: Rule::new() }
    }

    /// Adds the part [a,b] of `piece` to what is gathered, with an error of at most `tolerance` times (b - a).
    pub(super) fn gather(&self, piece: &Piece<'_>, a: f64, b: f64, tolerance: f64, so_far: &mut Gathered) {
        self.halve(piece, (a, b), tolerance, HALVINGS, so_far);
    }

    fn halve(&self, piece: &Piece<'_>, (a, b): (f64, f64), tolerance: f64, left: u32, g: &mut Gathered) {
        if g.transmittance <= DARK {
            return;
        }
        let (coarse, fine) = (piece.apply(&self.coarse, a, b), piece.apply(&self.fine, a, b));
        let (first, last) = (piece.color(a), piece.color(b));
        let through = [libm::exp(-coarse.depth), libm::exp(-fine.depth)];
        let color = |t: f64, sum: &Sum| -> [f64; 3] { std::array::from_fn(|i| first[i] - last[i] * t + sum.emitted[i]) };
        let (mut rough, mut good) = (color(through[0], &coarse), color(through[1], &fine));
        let mut unseen = 0.0;
        if piece.lit.is_some() && fine.depth.is_finite() {
            let hidden = -libm::expm1(-fine.depth);
            let noise = piece.noise();
            for (sum, found) in [(&coarse, &mut rough), (&fine, &mut good)] {
                let middle = libm::exp(-0.5 * sum.depth);
                for i in 0..3 {
                    // The colour's change is known from both ends. What a rule has missed of it, at a kink or a jump, is taken in by the
                    // middle transmittance, from which T differs by `hidden` at most.
                    let missed = last[i] - first[i] - sum.rise[i];
                    found[i] = (found[i] + middle * missed).clamp(0.0, hidden);
                    unseen = f64::max(unseen, (missed.abs() - noise).max(0.0) * hidden);
                }
            }
            unseen = unseen.min(hidden);
        }
        // What lies behind is at most 1, so an error of the transmittance counts once more.
        let off = (0..3).map(|i| (rough[i] - good[i]).abs()).fold(0.0, f64::max) + (through[0] - through[1]).abs() + unseen;
        let error = off * g.transmittance;
        let resolved = fine.depth <= DEEP || fine.depth == f64::INFINITY || piece.one_color();
        let resolved = resolved && piece.fog.is_none_or(|fog| (fog.exponent(b) - fog.exponent(a)).abs() <= DEEP);
        // A kink's part of the error does not fall with the length of the panel that holds it.
        let share = if piece.lit.is_some() { f64::max(b - a, KINK) } else { b - a };
        if left == 0 || (resolved && (error <= tolerance * share || error <= ROUNDING)) {
            g.rgb.iter_mut().zip(good).for_each(|(sum, c)| *sum += g.transmittance * c);
            g.error += error + 4.0 * f64::EPSILON * g.transmittance;
            g.transmittance *= through[1];
            g.panels += 1;
            return;
        }
        let middle = 0.5 * (a + b);
        self.halve(piece, (a, middle), tolerance, left - 1, g);
        self.halve(piece, (middle, b), tolerance, left - 1, g);
    }
}
