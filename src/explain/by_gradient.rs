//! Colour and opacity that depend on the gradient, worked out a second time at recorded fragments: in f64, from the volume's own values.

use super::gradient::GradientAt;
use super::record::Context;
use crate::picture::png;
use crate::proxy::Stack;
use crate::scene::{DEEPEST, Region, Scene, Shape, Transfer2d};
use crate::{Result, Volume};
use serde::Serialize;

/// Size of the picture of a plane of values and gradients.
const PLANE: [u32; 2] = [192, 128];

/// A region by its name and numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct RegionRecord {
    shape: &'static str,
    value: f64,
    color: [f64; 3],
    opacity: f64,
}

impl RegionRecord {
    fn new(region: &Region) -> Self {
        let (shape, value) = match region.shape {
            Shape::Box { value: [low, high], .. } => ("box", 0.5 * (low + high)),
            Shape::Triangle { value, .. } => ("triangle", value),
            Shape::Gaussian { value, .. } => ("gaussian", value),
            Shape::Levoy { value, .. } => ("levoy", value),
        };
        Self { shape, value, color: region.color, opacity: region.opacity }
    }
}

/// How opacity depends on the gradient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ByGradientRecord {
    /// Size of the gradient, factor.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    points: Vec<[f64; 2]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    regions: Vec<RegionRecord>,
    /// Values and sizes of gradients that the picture of the plane covers.
    plane: [[f64; 2]; 2],
}

impl ByGradientRecord {
    /// Where opacity of `scene` depends on the gradient; `steepest` is the greatest that was recorded.
    pub(super) fn new(scene: &Scene, volume: &Volume, steepest: f64) -> Option<Self> {
        if !scene.opacity_by_gradient() {
            return None;
        }
        let statistics = volume.statistics();
        let points: Vec<[f64; 2]> = match scene.transfer2d() {
            Some(_) => Vec::new(),
            None => scene.transfer().gradient_opacity().iter().map(|&(g, f)| [g, f]).collect(),
        };
        let tops = scene.transfer2d().map_or(&[][..], Transfer2d::region_list).iter().map(|r| match r.shape {
            Shape::Box { gradient: [low, _], .. } => 2.0 * low,
            Shape::Triangle { gradient, .. } => gradient,
            Shape::Gaussian { gradient, height, .. } => gradient + 2.0 * height,
            Shape::Levoy { .. } => 0.0,
        });
        let table = scene.transfer2d().and_then(Transfer2d::entries).map_or(0.0, |t| t.gradient_range[1]);
        let most = tops.chain(points.iter().map(|p| p[0])).chain([steepest, table]).fold(0.0, f64::max);
        let (low, high) = (statistics.min, if statistics.max > statistics.min { statistics.max } else { statistics.min + 1.0 });
        Some(Self {
            points,
            regions: scene.transfer2d().map_or_else(Vec::new, |t| t.region_list().iter().map(RegionRecord::new).collect()),
            plane: [[low, high], [0.0, if most > 0.0 { 1.05 * most } else { 1.0 }]],
        })
    }

    /// The plane as a PNG, opacities as square roots; nothing where the transfer function depends on the value alone.
    ///
    /// # Errors
    /// As encoding a picture.
    pub(super) fn draw(&self, transfer: Option<&Transfer2d>) -> Result<Option<Vec<u8>>> {
        let Some(transfer) = transfer else { return Ok(None) };
        let [width, height] = PLANE;
        let at = |[low, high]: [f64; 2], i: u32, n: u32| low + (high - low) * (f64::from(i) + 0.5) / f64::from(n);
        let pixel = |i: u32| {
            let c = transfer.eval(at(self.plane[0], i % width, width), at(self.plane[1], height - 1 - i / width, height));
            [c.rgb[0], c.rgb[1], c.rgb[2], c.alpha.sqrt()].map(|x| (255.0 * x.clamp(0.0, 1.0) + 0.5) as u8)
        };
        let bytes: Vec<u8> = (0..width * height).flat_map(pixel).collect();
        Ok(Some(png::rgba8(width, height, &bytes)?))
    }
}

/// Colour and opacity by the gradient at one fragment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ByGradientAt {
    /// Colour times optical depth, and optical depth of a whole slab, which the stage found; by the value alone.
    pub(super) before: [f32; 4],
    /// Premultiplied colour and opacity that it left.
    pub(super) left: [f32; 4],
    /// The same as they are worked out here.
    pub(super) want: [f32; 4],
    /// What the rounding of a stage may change each of them by.
    pub(super) rounding: f32,
    /// The factor on the extinction, or the strength of each region.
    pub(super) shares: Vec<f32>,
}

/// A premultiplied colour and opacity of optical depth `depth` and colour times that `rgb`, over a piece of `length` slabs.
fn piece(rgb: [f64; 3], depth: f64, length: f64) -> [f64; 4] {
    let alpha = -libm::expm1(-depth * length);
    let share = if depth > 0.0 { alpha / depth } else { 0.0 };
    [rgb[0] * share, rgb[1] * share, rgb[2] * share, alpha]
}

fn farthest(a: &[f64; 4], others: &[[f64; 4]]) -> f64 {
    others.iter().flat_map(|b| (0..4).map(|c| (a[c] - b[c]).abs())).fold(0.0, f64::max)
}

impl ByGradientAt {
    /// At a fragment whose ray's piece is `length` slabs long.
    pub(super) fn new(context: Context<'_>, stack: &Stack, gradient: &GradientAt, before: [f32; 4], left: [f32; 4], length: f32) -> Self {
        let exact = &gradient.exact;
        let (size, length) = (exact.gradient.length(), f64::from(length));
        let sizes = [-1.0, 1.0].map(|s| (size + s * 2.0 * exact.rounding).max(0.0));
        let (want, others, shares): (_, Vec<[f64; 4]>, Vec<f64>) = match context.scene.transfer2d() {
            Some(transfer) => {
                let unit = transfer.opacity_length(context.volume.grid());
                let at = |v: f64, g: f64| regions(transfer, v, g, stack.spacing / unit, length);
                let values = [-1.0, 1.0].map(|s| exact.value + s * exact.value_rounding);
                let others = values.iter().flat_map(|&v| sizes.map(|g| at(v, g))).collect();
                let shares = transfer.region_list().iter().map(|r| r.shape.at(exact.value, size)).collect();
                (at(exact.value, size), others, shares)
            }
            None => {
                let depth = f64::from(before[3]);
                let rgb = [0, 1, 2].map(|c: usize| f64::from(before[c]));
                let at = |g: f64| {
                    let factor = context.scene.transfer().gradient_factor(g);
                    let [r, g, b, a] = piece(rgb, depth, length * factor);
                    [r, g, b, a]
                };
                (at(size), sizes.map(at).to_vec(), vec![context.scene.transfer().gradient_factor(size)])
            }
        };
        let rounding = 1e-5 + farthest(&want, &others);
        Self {
            before,
            left,
            want: want.map(|x| x as f32),
            rounding: rounding as f32,
            shares: shares.into_iter().map(|x| x as f32).collect(),
        }
    }
}

/// What regions or the table give for a value and a gradient, over `length` slabs that are `ratio` reference lengths thick.
fn regions(transfer: &Transfer2d, value: f64, gradient: f64, ratio: f64, length: f64) -> [f64; 4] {
    if transfer.entries().is_some() {
        let c = transfer.eval(value, gradient);
        let depth = (-libm::log1p(-c.alpha.min(1.0 - f64::EPSILON / 2.0)) * ratio).min(DEEPEST);
        return piece(c.rgb.map(|x| x * depth), depth, length);
    }
    let (mut rgb, mut depth) = ([0.0; 3], 0.0);
    for region in transfer.region_list() {
        let opacity = (region.opacity * region.shape.at(value, gradient)).min(1.0 - f64::EPSILON / 2.0);
        let more = (-libm::log1p(-opacity) * ratio).min(DEEPEST);
        depth += more;
        for (sum, c) in rgb.iter_mut().zip(region.color) {
            *sum += more * c;
        }
    }
    piece(rgb, depth, length)
}
