//! Transfer functions: from a value in the data's units to a colour, and to an opacity per reference length.

use super::color::Straight;
use crate::volume::Grid;
use crate::{Error, Result};

/// A piecewise-linear transfer function.
///
/// Between points values are interpolated, beyond the ends they stay constant; two points at one value make a step, whose
/// right-hand side counts at the value itself.
///
/// An opacity belongs to a length: light that passes that much material of one value keeps the share 1 - opacity. Which length
/// it is, the function says itself: see [`TransferFunction::with_unit`].
///
/// # Guarantees
/// Both lists hold at least one point, values are finite and never fall, colours and opacities lie in `[0,1]`, and the length,
/// where one is given, is positive and finite. Points of the gradient opacity have gradients from 0 up.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    color: Vec<(f64, [f64; 3])>,
    opacity: Vec<(f64, f64)>,
    unit: Option<f64>,
    gradient_opacity: Vec<(f64, f64)>,
}

impl TransferFunction {
    /// A transfer function from its control points, in the data's units; opacities are per smallest voxel spacing of the volume.
    ///
    /// # Errors
    /// [`Error::Invalid`] that names the point which breaks the guarantees above.
    pub fn new(color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>) -> Result<Self> {
        check_order("color", color.iter().map(|p| p.0))?;
        check_order("opacity", opacity.iter().map(|p| p.0))?;
        let unit = |list: &str, value: f64, x: f64| {
            if (0.0..=1.0).contains(&x) {
                Ok(())
            } else {
                Err(Error::invalid(format!("transfer {list} at value {value}: {x} is outside [0,1]")))
            }
        };
        for &(v, rgb) in &color {
            rgb.iter().try_for_each(|&c| unit("color", v, c))?;
        }
        for &(v, a) in &opacity {
            unit("opacity", v, a)?;
        }
        Ok(Self { color, opacity, unit: None, gradient_opacity: Vec::new() })
    }

    /// The same function with opacities meant per `length` (world units) instead of per smallest voxel spacing.
    ///
    /// # Errors
    /// [`Error::Invalid`] when `length` is not positive and finite.
    pub fn with_unit(mut self, length: f64) -> Result<Self> {
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::invalid(format!("transfer opacity_unit {length}: must be positive and finite")));
        }
        self.unit = Some(length);
        Ok(self)
    }

    /// The same function with opacities that depend on the size of the gradient too: points of the gradient's size (data units per world
    /// unit) and of a factor, 0 to 1, on the extinction, so on the opacity per unit length. Piecewise linear, constant beyond the ends; no
    /// points: no factor.
    ///
    /// # Errors
    /// [`Error::Invalid`] that names the point which is out of order or range.
    pub fn with_gradient_opacity(mut self, points: Vec<(f64, f64)>) -> Result<Self> {
        if !points.is_empty() {
            check_order("gradient_opacity", points.iter().map(|p| p.0))?;
        }
        for &(g, factor) in &points {
            if g < 0.0 {
                return Err(Error::invalid(format!("transfer gradient_opacity: gradient {g} is negative")));
            }
            if !(0.0..=1.0).contains(&factor) {
                return Err(Error::invalid(format!("transfer gradient_opacity at gradient {g}: {factor} is outside [0,1]")));
            }
        }
        self.gradient_opacity = points;
        Ok(self)
    }

    /// Points of the factor on the extinction: the gradient's size (data units per world unit), then the factor. None: no factor.
    pub fn gradient_opacity(&self) -> &[(f64, f64)] {
        &self.gradient_opacity
    }

    /// The exact factor on the extinction where the gradient has this size (data units per world unit).
    pub fn gradient_factor(&self, size: f64) -> f64 {
        if self.gradient_opacity.is_empty() { 1.0 } else { interpolate(&self.gradient_opacity, size, |a, b, t| a + (b - a) * t) }
    }

    /// The largest factor on the extinction of gradients up to this size.
    pub(crate) fn most_gradient_factor(&self, size: f64) -> f64 {
        let points = self.gradient_opacity.iter().filter(|p| p.0 <= size).map(|p| p.1);
        points.fold(self.gradient_factor(0.0).max(self.gradient_factor(size)), f64::max)
    }

    /// The length (world units) that opacities refer to; `None` = the smallest voxel spacing of the volume that is shown.
    pub fn unit(&self) -> Option<f64> {
        self.unit
    }

    /// The length (world units) that opacities refer to in a volume on `grid`: [`TransferFunction::unit`], or else the grid's
    /// smallest spacing.
    pub fn opacity_length(&self, grid: &Grid) -> f64 {
        self.unit.unwrap_or_else(|| grid.smallest_spacing())
    }

    /// The same function with every colour point's red, green and blue turned into others within `[0,1]`.
    pub(super) fn with_colors(&self, turn: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let color = self.color.iter().map(|&(value, rgb)| (value, turn(rgb).map(|c| c.clamp(0.0, 1.0)))).collect();
        Self { color, ..self.clone() }
    }

    /// White, with the value itself as its opacity, per the same length.
    pub(crate) fn with_own_alpha(&self) -> Self {
        Self { color: vec![(0.0, [1.0; 3])], opacity: vec![(0.0, 0.0), (1.0, 1.0)], unit: self.unit, gradient_opacity: Vec::new() }
    }

    /// Colour points: value, then red, green and blue.
    pub fn color(&self) -> &[(f64, [f64; 3])] {
        &self.color
    }

    /// Opacity points: value, then opacity per reference length.
    pub fn opacity(&self) -> &[(f64, f64)] {
        &self.opacity
    }

    /// Exact straight colour and opacity per reference length at `value`. NaN and infinities are transparent black.
    pub fn eval(&self, value: f64) -> Straight {
        if !value.is_finite() {
            return Straight::default();
        }
        let rgb = interpolate(&self.color, value, |a, b, t| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t));
        let alpha = interpolate(&self.opacity, value, |a, b, t| a + (b - a) * t);
        Straight { rgb, alpha }
    }

    /// Every value at which colour or opacity has a kink or a step, rising, without repeats.
    pub fn knots(&self) -> Vec<f64> {
        let mut knots: Vec<f64> = self.color.iter().map(|p| p.0).chain(self.opacity.iter().map(|p| p.0)).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        knots
    }

    /// Whether colour or opacity jumps at `value`.
    pub fn has_step(&self, value: f64) -> bool {
        fn is_twice<T>(points: &[(f64, T)], value: f64) -> bool {
            let first = points.partition_point(|p| p.0 < value);
            points.get(first + 1).is_some_and(|p| p.0 == value)
        }
        is_twice(&self.color, value) || is_twice(&self.opacity, value)
    }

    /// Whether some value in [lo, hi] has an opacity above 0.
    pub fn opaque_within(&self, lo: f64, hi: f64) -> bool {
        let inside = self.opacity.iter().any(|&(v, a)| v >= lo && v <= hi && a > 0.0);
        inside || self.eval(lo).alpha > 0.0 || self.eval(hi).alpha > 0.0
    }
}

/// `thickness` of a slab over `length`, to which opacities refer; both in world units. Within what can still be multiplied: a length of 5e-324 makes
/// slabs of any opacity opaque, and those of none no numbers.
pub(crate) fn slab_ratio(thickness: f64, length: f64) -> f64 {
    const MOST: f64 = 1e300;
    (thickness / length).min(MOST)
}

fn check_order(list: &str, values: impl Iterator<Item = f64>) -> Result<()> {
    let mut last: Option<f64> = None;
    for v in values {
        if !v.is_finite() {
            return Err(Error::invalid(format!("transfer {list}: value {v} is not finite")));
        }
        if let Some(l) = last.filter(|&l| v < l) {
            return Err(Error::invalid(format!("transfer {list}: value {v} comes after {l}; points must rise")));
        }
        last = Some(v);
    }
    if last.is_none() {
        return Err(Error::invalid(format!("transfer {list}: no points")));
    }
    Ok(())
}

fn interpolate<C: Copy>(points: &[(f64, C)], value: f64, mix: impl Fn(C, C, f64) -> C) -> C {
    let after = points.partition_point(|p| p.0 <= value);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some((v0, a)), Some(&(v1, b))) => mix(a, b, (value - v0) / (v1 - v0)),
        (Some((_, a)), None) => a,
        (None, Some(&(_, b))) => b,
        (None, None) => unreachable!("a transfer function has at least one point"),
    }
}
