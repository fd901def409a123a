//! The enclosure of a part of a piece of ray: its transmittance, and the colour that it adds.
//!
//! A part [a,b] of a piece adds C = integral of c kappa T to the colour and lets T through. Each is enclosed in more than one way, and what
//! all of them allow is kept:
//!
//! - by ranges: the optical depth is the part's length times the range of the extinction; C = c (1 - T) for some c in the range of the
//!   straight colour (the mean value theorem, with the weight kappa T, which is not negative). Right everywhere, of the first order;
//! - by series, where the values stay on one segment of the transfer function: Taylor's series of the extinction, of T (from
//!   T' = -kappa T) and of (c - m) kappa T about the middle, with the fourth coefficient's range as the remainder; m is the colour in the middle,
//!   so C = m (1 - T) + integral of (c - m) kappa T, and a constant colour adds no width. Of the fourth order;
//! - by values, where the field rises or falls throughout: see `Table::depth_over`. Steps, spikes and an opacity of 1 lie within a part then.

use super::field::{CellField, Field};
use super::fog::RayFog;
use super::interval::Interval;
use super::series::{Series, convolved, integral, integral_before, integral_of};
use super::table::Table;

/// A piece of ray within a cell, or within one of a few.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// The field; `None` where nothing is known of it.
    pub(super) field: Option<Field>,
    /// Whether parts of it may lie outside the box, or in a cell that is transparent because a voxel is NaN or infinite.
    pub(super) maybe_clear: bool,
    /// Depth of its start, and from there to its end.
    pub(super) near: f64,
    pub(super) far: f64,
    /// Its length in reference lengths.
    pub(super) length: Interval,
}

/// What a part of a piece does to light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub(super) transmittance: Interval,
    /// C = c (1 - T) for a c in here.
    pub(super) color: [Interval; 3],
    /// C = m (1 - T) + e for an e in the interval.
    pub(super) mean: Option<[(f64, Interval); 3]>,
}

/// What parts are computed with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Medium<'a> {
    pub(super) table: &'a Table,
    pub(super) fog: Option<&'a RayFog>,
}

impl Medium<'_> {
    /// The part [a,b] of a piece; `None` where it is transparent.
    pub(super) fn part(&self, piece: &Piece, a: f64, b: f64) -> Option<Part> {
        let values = piece.field.as_ref().map_or(Interval::WHOLE, |f| f.range(a, b));
        let stays = piece.field.as_ref().is_none_or(|f| f.may_stay_at(values.hi()));
        let look = self.table.look(values, stays)?;
        let length = piece.length.times(b - a);
        let mut depth = positive(length * look.extinction);
        let mut color = look.color;
        if let Some(fog) = self.fog {
            // Depths of the part's ends, outwards.
            let (from, to) = (depth_at(piece, a).lo().max(0.0), depth_at(piece, b).hi().max(0.0));
            let factor = fog.factors(from.min(to), to);
            color = [0, 1, 2].map(|i: usize| fogged(color[i], factor, fog.color[i]));
        }
        let mut mean = None;
        if let Some(field) = &piece.field {
            match look.segment {
                Some(segment) if !piece.maybe_clear && look.extinction.hi().is_finite() => {
                    if let Some((better, found)) = self.by_series(piece, field, segment, (a, b), depth) {
                        depth = depth.meet(better);
                        mean = Some(found);
                    }
                }
                _ if look.extinction.width() > 0.0 => depth = depth.meet(self.by_values(piece, field, values, a, b)),
                _ => {}
            }
        }
        if piece.maybe_clear {
            depth = depth.hull(Interval::ZERO);
        }
        Some(Part { transmittance: positive(depth).exp_minus(), color, mean })
    }

    /// The optical depth from the values that the part crosses.
    fn by_values(&self, piece: &Piece, field: &Field, values: Interval, a: f64, b: f64) -> Interval {
        // Each cell's part is crossed at that cell's rate, and shows values between that cell's corners alone.
        let most = |cell: &CellField| {
            let slopes = cell.cubic.slopes(a, b);
            let shown = cell.cubic.range(a, b).meet(cell.corners);
            if slopes.least() > 0.0 {
                (self.table.depth_over(shown.lo(), shown.hi()) / Interval::point(slopes.least())).hi()
            } else {
                f64::INFINITY
            }
        };
        let cells = std::iter::once(&field.main).chain(&field.others);
        let most = cells.map(most).fold(Interval::ZERO, |sum, m| sum + Interval::new(0.0, m)).hi();
        let mut least = 0.0;
        let slopes = field.main.cubic.slopes(a, b);
        if field.others.is_empty() && slopes.least() > 0.0 {
            let (first, last) = (field.at(a), field.at(b));
            let (from, to) = if slopes.lo() > 0.0 { (first.hi(), last.lo()) } else { (last.hi(), first.lo()) };
            let (from, to) = (from.max(values.lo()), to.min(values.hi()));
            if from < to {
                least = (self.table.depth_over(from, to) / Interval::point(slopes.most())).lo();
            }
        }
        positive(piece.length * Interval::new(least.max(0.0).min(most), most))
    }

    /// The optical depth, and colours in the middle with what is to be added to them; by series.
    fn by_series(
        &self,
        piece: &Piece,
        field: &Field,
        segment: usize,
        (a, b): (f64, f64),
        depth: Interval,
    ) -> Option<(Interval, [(f64, Interval); 3])> {
        let r = 0.5 * (b - a);
        let segment = self.table.segment(segment);
        let (at, over) = field.main.cubic.series(a, b);
        // What is left of light, a straight line in the value.
        let (clear_at, clear_over) = (segment.clear.series(&at), segment.clear.series(&over));
        // Where the field is not quite the cubic it may be off by `apart`, and the extinction by `apart` times its slope.
        let off = Interval::around_zero(field.apart);
        let off_clear = clear_over.0[0] + segment.opacity.slope * off;
        if !(off_clear.lo() > 0.0 && clear_at.0[0].lo() > 0.0 && clear_over.0[0].lo() > 0.0) {
            return None;
        }
        let off_extinction = if field.apart == 0.0 { Interval::ZERO } else { segment.opacity.slope * off / off_clear };
        let off_depth = piece.length.times(b - a) * off_extinction;
        // Extinction of the whole piece's length, for derivatives by s.
        let scaled = |series: Series| Series(series.0.map(|c| c * piece.length));
        let (kappa_at, kappa_over) = (scaled(clear_at.minus_ln()), scaled(clear_over.minus_ln()));
        let exact = field.apart == 0.0;
        // The field's own extinction is not negative; that of a cubic which is not quite the field may be.
        let depths = |x: Interval| if exact { positive(x) } else { x };
        let own = depths(integral(&kappa_at, &kappa_over, r));
        let before = depths(integral_before(&kappa_at, &kappa_over, r));
        // Up to a place within the part.
        let within =
            if exact { Interval::new(0.0, own.meet(depth).hi()) } else { Interval::around_zero(kappa_over.0[0].times(b - a).most()) };
        let through = |kappa: &Series, first: Interval| {
            // T' = -kappa T: T and kappa T, coefficient by coefficient.
            let (mut t, mut hidden) = ([Interval::ZERO; 5], [Interval::ZERO; 5]);
            t[0] = first;
            for k in 0..5 {
                hidden[k] = convolved(&kappa.0, &t, k);
                if k < 4 {
                    t[k + 1] = -hidden[k] / Interval::point((k + 1) as f64);
                }
            }
            Series(hidden)
        };
        let hidden_at = through(&kappa_at, (-before).exponential());
        let hidden_over = through(&kappa_over, (-within).exponential());
        let haze = match self.fog {
            Some(fog) => {
                let way = Interval::point(piece.far) - Interval::point(piece.near);
                Some((fog.series(piece.near, way, (a, b))?, fog.color))
            }
            None => None,
        };
        // Below, e^x - 1 of the depth's error x is put as at most 2 x, and colours differ by at most 2.
        let total = off_depth.most();
        let color_off = segment.color.iter().map(|line| (line.slope * off).most()).fold(0.0, f64::max);
        if !(total <= 0.01 && color_off <= 0.1) {
            return None;
        }
        let found = std::array::from_fn(|i| {
            let line = &segment.color[i];
            let (mut color_at, mut color_over) = (line.series(&at), line.series(&over));
            if let Some(((fog_at, fog_over), fog_color)) = &haze {
                let fog_color = Interval::point(fog_color[i]);
                let mix = |factor: &Series, color: &Series| factor.product(&color.plus(-fog_color)).plus(fog_color);
                (color_at, color_over) = (mix(fog_at, &color_at), mix(fog_over, &color_over));
            }
            let middle = color_at.0[0].middle().clamp(0.0, 1.0);
            let (at, over) = (color_at.plus(-Interval::point(middle)), color_over.plus(-Interval::point(middle)));
            let product = |a: &Series, b: &Series, k: usize| convolved(&a.0, &b.0, k);
            let mut rest = integral_of(product(&at, &hidden_at, 0), product(&at, &hidden_at, 2), product(&over, &hidden_over, 4), r);
            // An extinction that is off changes what hides, and through T what is seen of it: by its depth's error each, times a difference
            // of colours. A colour that is off counts once, the weights adding up to 1 at most.
            rest = rest + Interval::around_zero(color_off) + Interval::around_zero(total).times(6.0);
            (middle, rest)
        });
        Some((positive(own + off_depth), found))
    }
}

/// The depth at `s` of a piece.
fn depth_at(piece: &Piece, s: f64) -> Interval {
    let (near, far) = (Interval::point(piece.near), Interval::point(piece.far));
    near + (far - near).times(s)
}

/// What of it is not negative.
fn positive(x: Interval) -> Interval {
    x.clamp(0.0, f64::INFINITY)
}

/// f c + (1-f) g for colours c and factors f within `[0,1]`: between c and g, so that least and greatest lie at ends of both.
fn fogged(color: Interval, factor: Interval, fog: f64) -> Interval {
    let fog = Interval::point(fog);
    let mix = |c: f64, f: f64| fog + Interval::point(f) * (Interval::point(c) - fog);
    let ends = |c: f64| mix(c, factor.lo()).hull(mix(c, factor.hi()));
    Interval::new(ends(color.lo()).lo(), ends(color.hi()).hi())
}
