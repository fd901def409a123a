//! Transfer functions of two variables: from a value and the size of its gradient to a colour, and to an opacity per reference length.
//!
//! ```text
//!   |g| ^            box: everything within two ranges
//!       |  \  |  /   triangle: apex at (value, 0), faintest at its sides (boundary emphasis: Kniss, Kindlmann, Hansen 2002)
//!       |   \ | /    gaussian: strongest at a point, by exp(-x^2/2) to both sides
//!       |    \|/     levoy: a surface of constant thickness around the values `value` (Levoy 1988)
//!       +-----v----> value
//! ```
//! Where regions overlap their extinctions add up, and colours weigh by extinction.

use super::TransferFunction;
use super::color::Straight;
use crate::volume::Grid;
use crate::{Error, Result};
use std::sync::Arc;

/// Most regions of a transfer function.
pub const MAX_REGIONS: usize = 32;
/// Most entries along each side of a table.
const MAX_ENTRIES: usize = 1024;
/// Standard deviations from its centre at which a Gaussian region ends.
pub(crate) const GAUSSIAN_END: f64 = 5.0;

/// Where a region is, in values (data units) and sizes of gradients (data units per world unit); and how strong, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// 1 within both ranges, ends included.
    Box {
        /// Least and greatest value.
        value: [f64; 2],
        /// Least and greatest size of the gradient.
        gradient: [f64; 2],
    },
    /// 1 on the line above the apex (`value`, 0), falling to 0 at the sides, which reach `width` to the left and right at `gradient`; 0 above that.
    Triangle {
        /// Value of the apex.
        value: f64,
        /// Half of the upper side, in values.
        width: f64,
        /// Size of the gradient at the upper side.
        gradient: f64,
    },
    /// exp(-((v - value) / width)^2 / 2 - ((|g| - gradient) / height)^2 / 2); 0 beyond five widths or heights.
    Gaussian {
        /// Value of the centre.
        value: f64,
        /// Standard deviation along values.
        width: f64,
        /// Size of the gradient at the centre.
        gradient: f64,
        /// Standard deviation along sizes of gradients.
        height: f64,
    },
    /// 1 - |value - v| / (thickness |g|) where that is positive, 1 where v is the value and |g| is 0.
    Levoy {
        /// Value of the surface.
        value: f64,
        /// Distance from the surface at which nothing is left, world units.
        thickness: f64,
    },
}

/// A region: a shape, a straight colour, and the opacity per reference length where the shape is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Where it is.
    pub shape: Shape,
    /// Straight red, green, blue, each 0 to 1.
    pub color: [f64; 3],
    /// 0 to 1.
    pub opacity: f64,
}

/// Entries over values and sizes of gradients, bilinear between them, constant beyond the ends: extinctions, and colours that weigh by them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entries {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) range: [f64; 2],
    pub(crate) gradient_range: [f64; 2],
    /// Straight colours and opacities, values fastest.
    pub(crate) colors: Arc<Vec<[f32; 4]>>,
    /// The largest of the opacities.
    strongest: f32,
}

/// A transfer function of two variables.
///
/// # Guarantees
/// It has regions, [`MAX_REGIONS`] at most, or a table of 2 to 1024 entries along each side; numbers are finite and in range.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer2d {
    regions: Vec<Region>,
    table: Option<Entries>,
    unit: Option<f64>,
}

impl Shape {
    /// Its strength at a value and a size of the gradient, 0 to 1.
    pub fn at(&self, v: f64, g: f64) -> f64 {
        match *self {
            Self::Box { value, gradient } => f64::from(u8::from(v >= value[0] && v <= value[1] && g >= gradient[0] && g <= gradient[1])),
            Self::Triangle { value, width, gradient } => {
                if g > 0.0 && g <= gradient {
                    (1.0 - (v - value).abs() * gradient / (width * g)).max(0.0)
                } else {
                    0.0
                }
            }
            Self::Gaussian { value, width, gradient, height } => {
                let (x, y) = ((v - value) / width, (g - gradient) / height);
                if x.abs() > GAUSSIAN_END || y.abs() > GAUSSIAN_END { 0.0 } else { libm::exp(-0.5 * (x * x + y * y)) }
            }
            Self::Levoy { value, thickness } => {
                let far = (value - v).abs();
                if far == 0.0 { 1.0 } else { (1.0 - far / (thickness * g)).max(0.0) }
            }
        }
    }

    /// Values beyond which it is 0 for every gradient.
    fn values(&self) -> [f64; 2] {
        match *self {
            Self::Box { value, .. } => value,
            Self::Triangle { value, width, .. } => [value - width, value + width],
            Self::Gaussian { value, width, .. } => [value - GAUSSIAN_END * width, value + GAUSSIAN_END * width],
            // As far as the gradient is steep.
            Self::Levoy { .. } => [f64::MIN, f64::MAX],
        }
    }

    /// Whether it may be above 0 at a value from `low` to `high` and a gradient up to this size. Never a false no.
    fn may_show(&self, low: f64, high: f64, steepest: f64) -> bool {
        // Wider by what the stages may round.
        let slack = 1e-5 * (low.abs().max(high.abs()) + (high - low));
        let overlaps = |from: f64, to: f64| from <= high + slack && to >= low - slack;
        match *self {
            Self::Box { value: [from, to], gradient: [least, _] } => least <= steepest && overlaps(from, to),
            Self::Triangle { value, width, gradient } => {
                let reach = width * (steepest / gradient).min(1.0);
                overlaps(value - reach, value + reach)
            }
            Self::Gaussian { value, width, gradient, height } => {
                gradient - GAUSSIAN_END * height <= steepest && overlaps(value - GAUSSIAN_END * width, value + GAUSSIAN_END * width)
            }
            Self::Levoy { value, thickness } => overlaps(value - thickness * steepest, value + thickness * steepest),
        }
    }

    fn check(&self, n: usize) -> Result<()> {
        let fail = |what: String| Err(Error::invalid(format!("transfer2d region {n}: {what}")));
        let positive = [
            (
                "width",
                match *self {
                    Self::Triangle { width, .. } | Self::Gaussian { width, .. } => width,
                    _ => 1.0,
                },
            ),
            (
                "height",
                match *self {
                    Self::Gaussian { height, .. } => height,
                    _ => 1.0,
                },
            ),
            (
                "gradient",
                match *self {
                    Self::Triangle { gradient, .. } => gradient,
                    _ => 1.0,
                },
            ),
            (
                "thickness",
                match *self {
                    Self::Levoy { thickness, .. } => thickness,
                    _ => 1.0,
                },
            ),
        ];
        if let Some((key, x)) = positive.into_iter().find(|(_, x)| !(*x > 0.0 && x.is_finite())) {
            return fail(format!("{key} {x}: must be positive and finite"));
        }
        match *self {
            Self::Box { value, gradient } => {
                for (key, [low, high], least) in [("value", value, f64::MIN), ("gradient", gradient, 0.0)] {
                    if !(low >= least && low <= high && high.is_finite()) {
                        return fail(format!(
                            "{key} [{low}, {high}]: must be two finite numbers, the lower first{}",
                            if least == 0.0 { ", not negative" } else { "" }
                        ));
                    }
                }
            }
            Self::Triangle { value, .. } | Self::Levoy { value, .. } if !value.is_finite() => {
                return fail(format!("value {value}: must be finite"));
            }
            Self::Gaussian { value, gradient, .. } if !(value.is_finite() && gradient >= 0.0 && gradient.is_finite()) => {
                return fail(format!("value {value}, gradient {gradient}: must be finite, the gradient not negative"));
            }
            _ => {}
        }
        Ok(())
    }
}

impl Transfer2d {
    /// A transfer function of regions; opacities are per smallest voxel spacing of the volume.
    ///
    /// # Errors
    /// [`Error::Invalid`] that names the region and the number out of range; for no region, and for more than [`MAX_REGIONS`].
    pub fn regions(regions: Vec<Region>) -> Result<Self> {
        if regions.is_empty() || regions.len() > MAX_REGIONS {
            return Err(Error::invalid(format!("transfer2d: {} regions, there can be 1 to {MAX_REGIONS}", regions.len())));
        }
        for (n, region) in regions.iter().enumerate() {
            region.shape.check(n)?;
            if let Some(c) = region.color.iter().chain([&region.opacity]).find(|c| !(0.0..=1.0).contains(*c)) {
                return Err(Error::invalid(format!("transfer2d region {n}: color or opacity {c} is outside [0,1]")));
            }
        }
        Ok(Self { regions, table: None, unit: None })
    }

    /// A transfer function by a table of straight red, green, blue and opacity, each 0 to 1: `columns` values spread over `range`, for each of
    /// `rows` sizes of the gradient spread over `gradient_range`, the least size first.
    ///
    /// # Errors
    /// [`Error::Invalid`] for fewer than 2 or more than 1024 columns or rows, a list of another length, numbers outside `[0,1]`, and ranges that
    /// are empty or not finite.
    pub fn table((columns, rows): (usize, usize), colors: &[[f32; 4]], range: [f64; 2], gradient_range: [f64; 2]) -> Result<Self> {
        if ![columns, rows].iter().all(|n| (2..=MAX_ENTRIES).contains(n)) {
            return Err(Error::invalid(format!(
                "transfer2d table of {columns} values x {rows} gradients: must have 2 to {MAX_ENTRIES} of each"
            )));
        }
        if colors.len() != columns * rows {
            return Err(Error::invalid(format!("transfer2d table of {columns} x {rows}: {} colours are given", colors.len())));
        }
        for (key, [low, high], least) in [("range", range, f64::MIN), ("gradient_range", gradient_range, 0.0)] {
            if !(low >= least && low < high && (high - low).is_finite()) {
                return Err(Error::invalid(format!("transfer2d {key} [{low}, {high}]: must be two finite numbers that rise")));
            }
        }
        if let Some(at) = colors.iter().position(|p| p.iter().any(|c| !(0.0..=1.0).contains(c))) {
            let (value, gradient) = (at % columns, at / columns);
            return Err(Error::invalid(format!("transfer2d table, gradient {gradient}, value {value}: {:?} is outside [0,1]", colors[at])));
        }
        let strongest = colors.iter().fold(0.0, |most: f32, c| most.max(c[3]));
        let entries = Entries { columns, rows, range, gradient_range, colors: Arc::new(colors.to_vec()), strongest };
        Ok(Self { regions: Vec::new(), table: Some(entries), unit: None })
    }

    /// The same function with opacities meant per `length` (world units) instead of per smallest voxel spacing.
    ///
    /// # Errors
    /// [`Error::Invalid`] when `length` is not positive and finite.
    pub fn with_unit(mut self, length: f64) -> Result<Self> {
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::invalid(format!("transfer2d opacity_unit {length}: must be positive and finite")));
        }
        self.unit = Some(length);
        Ok(self)
    }

    /// The length (world units) that opacities refer to; `None` = the smallest voxel spacing of the volume that is shown.
    pub fn unit(&self) -> Option<f64> {
        self.unit
    }

    /// The length (world units) that opacities refer to in a volume on `grid`.
    pub fn opacity_length(&self, grid: &Grid) -> f64 {
        self.unit.unwrap_or_else(|| grid.smallest_spacing())
    }

    /// Its regions; none where it is a table.
    pub fn region_list(&self) -> &[Region] {
        &self.regions
    }

    pub(crate) fn entries(&self) -> Option<&Entries> {
        self.table.as_ref()
    }

    /// Exact straight colour and opacity per reference length at a value and a size of the gradient. NaN and infinities are transparent.
    pub fn eval(&self, value: f64, gradient: f64) -> Straight {
        if !(value.is_finite() && gradient.is_finite()) {
            return Straight::default();
        }
        let (mut rgb, mut depth) = ([0.0; 3], 0.0);
        let mut add = |color: [f64; 3], opacity: f64, share: f64| {
            // Opacity 1 has no finite extinction; the largest below it has.
            let extinction = -libm::log1p(-opacity.min(1.0 - f64::EPSILON / 2.0)) * share;
            depth += extinction;
            for (sum, c) in rgb.iter_mut().zip(color) {
                *sum += extinction * c;
            }
        };
        for region in &self.regions {
            add(region.color, region.opacity * region.shape.at(value, gradient), 1.0);
        }
        if let Some(t) = &self.table {
            let place = |x: f64, [low, high]: [f64; 2], n: usize| {
                let at = ((x - low) / (high - low) * (n - 1) as f64).clamp(0.0, (n - 1) as f64);
                let first = (at as usize).min(n - 2);
                (first, at - first as f64)
            };
            let ((i, x), (j, y)) = (place(value, t.range, t.columns), place(gradient, t.gradient_range, t.rows));
            for (di, dj, share) in [(0, 0, (1.0 - x) * (1.0 - y)), (1, 0, x * (1.0 - y)), (0, 1, (1.0 - x) * y), (1, 1, x * y)] {
                let [r, g, b, a] = t.colors[(j + dj) * t.columns + i + di].map(f64::from);
                add([r, g, b], a, share);
            }
        }
        let rgb = if depth > 0.0 { rgb.map(|c| c / depth) } else { [0.0; 3] };
        Straight { rgb, alpha: -libm::expm1(-depth) }
    }

    /// Whether anything may show of values from `low` to `high` with gradients up to this size. Never a false no.
    pub(crate) fn may_show(&self, low: f64, high: f64, steepest: f64) -> bool {
        let steepest = steepest * (1.0 + 1e-5);
        self.table.is_some() || self.regions.iter().any(|r| r.opacity > 0.0 && r.shape.may_show(low, high, steepest))
    }

    /// The largest extinction times reference length that it gives anywhere, or more.
    pub(crate) fn most_extinction(&self) -> f64 {
        let extinction = |opacity: f64| -libm::log1p(-opacity.min(1.0 - f64::EPSILON / 2.0));
        let regions: f64 = self.regions.iter().map(|region| extinction(region.opacity)).sum();
        regions + self.table.as_ref().map_or(0.0, |table| extinction(f64::from(table.strongest)))
    }

    /// A function of the value alone that shows something wherever this one may, at some size of the gradient, for data from `min` to `max`:
    /// what is passed over as empty goes by it.
    pub(crate) fn shown(&self, min: f64, max: f64) -> Result<TransferFunction> {
        let mut shown: Vec<[f64; 2]> = self.regions.iter().filter(|r| r.opacity > 0.0).map(|r| r.shape.values()).collect();
        if let Some(t) = &self.table {
            let visible = |column: usize| (0..t.rows).any(|row| t.colors[row * t.columns + column][3] > 0.0);
            let value = |column: usize| t.range[0] + (t.range[1] - t.range[0]) * column as f64 / (t.columns - 1) as f64;
            for column in (0..t.columns).filter(|&column| visible(column)) {
                // Beyond the ends the last columns go on.
                let low = if column == 0 { f64::MIN } else { value(column - 1) };
                let high = if column + 1 == t.columns { f64::MAX } else { value(column + 1) };
                shown.push([low, high]);
            }
        }
        // Within the data, wider by what a table over it may round.
        let slack = ((max - min) / 2048.0).max(1e-6 * min.abs().max(max.abs())).max(f64::MIN_POSITIVE);
        let mut points: Vec<(f64, f64)> = Vec::new();
        shown.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut open: Option<[f64; 2]> = None;
        let clamp = |x: f64| x.clamp(min - 4.0 * slack, max + 4.0 * slack);
        let mut close = |[low, high]: [f64; 2]| points.extend([(low - slack, 0.0), (low, 1.0), (high, 1.0), (high + slack, 0.0)]);
        for [low, high] in shown {
            let next = [clamp(low) - slack, clamp(high) + slack];
            open = match open {
                Some([from, to]) if next[0] - slack <= to + slack => Some([from, to.max(next[1])]),
                Some(done) => {
                    close(done);
                    Some(next)
                }
                None => Some(next),
            };
        }
        open.into_iter().for_each(close);
        if points.is_empty() {
            points.push((min, 0.0));
        }
        let transfer = TransferFunction::new(vec![(min, [1.0; 3])], points)?;
        match self.unit {
            Some(length) => transfer.with_unit(length),
            None => Ok(transfer),
        }
    }

    /// The same function with every colour's components turned into others within `[0,1]`.
    pub(crate) fn with_colors(&self, turn: impl Fn(f64) -> f64) -> Self {
        let turned = |c: f64| turn(c).clamp(0.0, 1.0);
        let mut other = self.clone();
        for region in &mut other.regions {
            region.color = region.color.map(turned);
        }
        if let Some(table) = &mut other.table {
            let colors =
                table.colors.iter().map(|&[r, g, b, a]| [turned(r.into()) as f32, turned(g.into()) as f32, turned(b.into()) as f32, a]);
            table.colors = Arc::new(colors.collect());
        }
        other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(shape: Shape) -> Transfer2d {
        Transfer2d::regions(vec![Region { shape, color: [1.0, 0.5, 0.0], opacity: 0.5 }]).expect("valid")
    }

    #[test]
    fn shapes_are_where_they_say() {
        let levoy = Shape::Levoy { value: 100.0, thickness: 2.0 };
        assert_eq!((levoy.at(100.0, 0.0), levoy.at(101.0, 0.0), levoy.at(110.0, 10.0), levoy.at(120.0, 10.0)), (1.0, 0.0, 0.5, 0.0));
        let triangle = Shape::Triangle { value: 10.0, width: 4.0, gradient: 8.0 };
        assert_eq!((triangle.at(10.0, 4.0), triangle.at(11.0, 4.0), triangle.at(12.0, 4.0), triangle.at(10.0, 9.0)), (1.0, 0.5, 0.0, 0.0));
        let gaussian = Shape::Gaussian { value: 0.0, width: 2.0, gradient: 5.0, height: 1.0 };
        assert!((gaussian.at(2.0, 5.0) - libm::exp(-0.5)).abs() < 1e-15 && gaussian.at(0.0, 10.1) == 0.0);
    }

    #[test]
    fn a_brick_that_may_show_nothing_shows_nothing() {
        let shapes = [
            Shape::Box { value: [30.0, 40.0], gradient: [5.0, 9.0] },
            Shape::Triangle { value: 50.0, width: 10.0, gradient: 8.0 },
            Shape::Gaussian { value: 80.0, width: 1.0, gradient: 6.0, height: 0.5 },
            Shape::Levoy { value: 60.0, thickness: 1.5 },
        ];
        let mut hidden = 0;
        for shape in shapes {
            for (low, width, most) in
                (0..100).flat_map(|l| (0..6).flat_map(move |w| (0..12).map(move |g| (f64::from(l), f64::from(w), f64::from(g)))))
            {
                if shape.may_show(low, low + width, most) {
                    continue;
                }
                hidden += 1;
                for (i, j) in (0..=8).flat_map(|i| (0..=8).map(move |j| (f64::from(i) / 8.0, f64::from(j) / 8.0))) {
                    assert_eq!(shape.at(low + i * width, j * most), 0.0, "{shape:?} at {low} + {width}, {most}");
                }
            }
        }
        assert!(hidden > 5000, "{hidden}");
    }

    #[test]
    fn extinctions_of_overlapping_regions_add_up() {
        let shape = Shape::Box { value: [0.0, 10.0], gradient: [0.0, 1e9] };
        let region = |color, opacity| Region { shape, color, opacity };
        let both = Transfer2d::regions(vec![region([1.0, 0.0, 0.0], 0.5), region([0.0, 1.0, 0.0], 0.75)]).expect("valid").eval(5.0, 1.0);
        assert!((both.alpha - (1.0 - 0.5 * 0.25)).abs() < 1e-15);
        // ln 4 is twice ln 2.
        assert!((both.rgb[0] - 1.0 / 3.0).abs() < 1e-15 && (both.rgb[1] - 2.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn what_shows_of_values_covers_every_region() {
        let shapes = [
            Shape::Box { value: [3.0, 3.0], gradient: [0.0, 1.0] },
            Shape::Triangle { value: 50.0, width: 10.0, gradient: 8.0 },
            Shape::Gaussian { value: 80.0, width: 1.0, gradient: 5.0, height: 1.0 },
        ];
        for shape in shapes {
            let shown = one(shape).shown(0.0, 100.0).expect("a function");
            for i in 0..=100_000 {
                let v = f64::from(i) / 1000.0;
                let here = (0..=40).any(|g| shape.at(v, f64::from(g) / 4.0) > 0.0);
                assert!(!here || shown.eval(v).alpha > 0.0, "{shape:?} at {v}");
            }
            assert_eq!(shown.eval(20.0).alpha, 0.0);
        }
    }

    #[test]
    fn tables_are_bilinear_in_extinction() {
        let pixels = vec![[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.75], [0.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
        let t = Transfer2d::table((2, 2), &pixels, [0.0, 10.0], [0.0, 1.0]).expect("valid");
        assert!((t.eval(5.0, 0.0).alpha - 0.5).abs() < 1e-12);
        assert!((t.eval(10.0, 0.5).alpha - 0.5).abs() < 1e-12);
        assert_eq!(t.eval(10.0, 0.5).rgb, [1.0, 0.0, 0.0]);
        assert_eq!(t.eval(99.0, 9.0).alpha, 0.0);
    }

    #[test]
    fn bad_numbers_are_named() {
        let bad = [
            (Shape::Levoy { value: 1.0, thickness: 0.0 }, "thickness 0"),
            (Shape::Box { value: [2.0, 1.0], gradient: [0.0, 1.0] }, "value [2, 1]"),
            (Shape::Box { value: [1.0, 2.0], gradient: [-1.0, 1.0] }, "gradient [-1, 1]"),
            (Shape::Triangle { value: f64::NAN, width: 1.0, gradient: 1.0 }, "value NaN"),
            (Shape::Gaussian { value: 0.0, width: f64::INFINITY, gradient: 1.0, height: 1.0 }, "width inf"),
        ];
        for (shape, named) in bad {
            let error = Transfer2d::regions(vec![Region { shape, color: [0.0; 3], opacity: 0.5 }]).expect_err("refused").to_string();
            assert!(error.contains(named) && error.contains("region 0"), "{error}");
        }
        assert!(Transfer2d::regions(Vec::new()).is_err());
    }
}
