//! Classification by a value and the size of its gradient: optical depths of regions added up, then turned into colour and opacity.
//!
//! Regions are computed fragment by fragment, so that a narrow one is as exact as a wide one; tables are looked up. Classification by the
//! value alone has gone before: it has told which rows may show anything.

use super::Run;
use super::batch::Batch;
use super::frame::Frame;
use super::gradient::GradientFrame;
use super::gradient_opacity::finish;
use crate::lanes::math::{exp_negative, ln_below_one, log1p_negated};
use crate::lanes::{Kernel, Lanes, Level, LookupTable, for_rows, row, row_mut, rows_of};
use crate::scene::{DEEPEST, GAUSSIAN_END, Shape, Transfer2d};
use std::sync::Arc;

/// Opacities of regions from which on what they leave is a number of its own.
const NEARLY_OPAQUE: f64 = 0.9;

/// A region in the stages' numbers.
#[derive(Debug, Clone, Copy)]
struct RegionFrame {
    shape: ShapeFrame,
    color: [f32; 3],
    opacity: f32,
    /// What an opacity close to 1 leaves, 1 - opacity, whose digits the opacity has lost; `None` for others.
    left: Option<f32>,
}

/// [`Shape`] in the stages' numbers: v is a value, g the size of a gradient.
#[derive(Debug, Clone, Copy)]
enum ShapeFrame {
    /// 1 within both.
    Box { value: [f32; 2], gradient: [f32; 2] },
    /// 1 - |v - value| slope / g, for g up to `gradient`.
    Triangle { value: f32, slope: f32, gradient: f32 },
    /// exp(-(x^2 + y^2)/2), x = (v - value) per_width, y = (g - gradient) per_height.
    Gaussian { value: f32, per_width: f32, gradient: f32, per_height: f32 },
    /// 1 - |v - value| per_thickness / g.
    Levoy { value: f32, per_thickness: f32 },
}

/// A table of optical depths, and colours times those.
#[derive(Debug, Clone)]
struct EntriesFrame {
    table: Arc<LookupTable>,
    columns: f32,
    /// First value, entries per value, last entry that has one behind it; the same along gradients.
    along: [[f32; 3]; 2],
}

/// What it takes.
#[derive(Debug, Clone)]
pub(crate) struct Transfer2dFrame {
    regions: Vec<RegionFrame>,
    table: Option<EntriesFrame>,
    /// Thickness of a slab in reference lengths.
    ratio: f32,
}

/// How values of the data become the stages' numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers {
    /// Data value = `scale` * number + `offset`.
    pub(crate) scale: f64,
    pub(crate) offset: f64,
}

impl Numbers {
    fn number(self, value: f64) -> f32 {
        ((value - self.offset) / self.scale).clamp(-1e38, 1e38) as f32
    }
}

impl Transfer2dFrame {
    /// `transfer` for slabs `ratio` reference lengths thick.
    pub(crate) fn new(transfer: &Transfer2d, gradient: &GradientFrame, numbers: Numbers, ratio: f64) -> Self {
        let bounded = |x: f64| x.min(1e38) as f32;
        let value = |v: f64| numbers.number(v);
        let regions = transfer.region_list().iter().map(|region| RegionFrame {
            shape: match region.shape {
                Shape::Box { value: [a, b], gradient: [g, h] } => {
                    ShapeFrame::Box { value: [value(a), value(b)], gradient: [gradient.number(g), gradient.number(h)] }
                }
                Shape::Triangle { value: v, width, gradient: g } => {
                    let slope = bounded(g / gradient.unit * numbers.scale / width);
                    ShapeFrame::Triangle { value: value(v), slope, gradient: gradient.number(g) }
                }
                Shape::Gaussian { value: v, width, gradient: g, height } => ShapeFrame::Gaussian {
                    value: value(v),
                    per_width: bounded(numbers.scale / width),
                    gradient: gradient.number(g),
                    per_height: bounded(gradient.unit / height),
                },
                Shape::Levoy { value: v, thickness } => {
                    ShapeFrame::Levoy { value: value(v), per_thickness: bounded(numbers.scale / (thickness * gradient.unit)) }
                }
            },
            color: region.color.map(|c| c as f32),
            opacity: region.opacity as f32,
            // Opacity 1 has no finite extinction; the largest below it has.
            left: (region.opacity >= NEARLY_OPAQUE).then(|| (1.0 - region.opacity).max(f64::EPSILON / 2.0) as f32),
        });
        let table = transfer.entries().map(|t| {
            let depths = t.colors.iter().map(|&[r, g, b, a]| {
                let depth = (-ratio * libm::log1p(-f64::from(a).min(1.0 - f64::EPSILON / 2.0))).min(DEEPEST);
                [f64::from(r) * depth, f64::from(g) * depth, f64::from(b) * depth, depth].map(|x| x as f32)
            });
            let side = |[low, high]: [f32; 2], n: usize| [low, (n - 1) as f32 / (high - low), (n - 2) as f32];
            EntriesFrame {
                table: Arc::new(LookupTable::new(&depths.collect::<Vec<_>>())),
                columns: t.columns as f32,
                along: [side(t.range.map(value), t.columns), side(t.gradient_range.map(|g| gradient.number(g)), t.rows)],
            }
        });
        Self { regions: regions.collect(), table, ratio: ratio as f32 }
    }
}

impl RegionFrame {
    /// Extinction times reference length where the value is `v` and the gradient's size `g`.
    #[inline(always)]
    fn extinction<L: Lanes>(&self, v: L::F, g: L::F) -> L::F {
        let strength = self.shape.at::<L>(v, g);
        let opacity = L::mul(strength, L::splat(self.opacity));
        let mut log = log1p_negated::<L>(opacity);
        if let Some(left) = self.left {
            // 1 - s a = (1 - a) + a (1 - s).
            let all = L::add(L::splat(left), L::mul(L::splat(self.opacity), L::sub(L::splat(1.0), strength)));
            log = L::select(L::lt(opacity, L::splat(0.5)), log, ln_below_one::<L>(all));
        }
        L::sub(L::splat(0.0), log)
    }
}

impl ShapeFrame {
    /// Its strength, 0 to 1.
    #[inline(always)]
    fn at<L: Lanes>(&self, v: L::F, g: L::F) -> L::F {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        match *self {
            Self::Box { value, gradient } => {
                let values = L::and(L::le(L::splat(value[0]), v), L::le(v, L::splat(value[1])));
                let gradients = L::and(L::le(L::splat(gradient[0]), g), L::le(g, L::splat(gradient[1])));
                L::keep(L::and(values, gradients), one)
            }
            Self::Triangle { value, slope, gradient } => {
                let inside = L::and(L::lt(zero, g), L::le(g, L::splat(gradient)));
                let aside = distance::<L>(v, value);
                let share = L::div(L::mul(aside, L::splat(slope)), L::select(inside, g, one));
                L::keep(inside, L::max(L::sub(one, share), zero))
            }
            Self::Gaussian { value, per_width, gradient, per_height } => {
                let x = L::mul(distance::<L>(v, value), L::splat(per_width));
                let y = L::mul(distance::<L>(g, gradient), L::splat(per_height));
                let end = L::splat(GAUSSIAN_END as f32);
                let inside = L::and(L::le(x, end), L::le(y, end));
                let power = L::mul(L::splat(-0.5), L::add(L::mul(x, x), L::mul(y, y)));
                L::keep(inside, exp_negative::<L>(L::keep(inside, power)))
            }
            Self::Levoy { value, per_thickness } => {
                let aside = distance::<L>(v, value);
                let steep = L::lt(zero, g);
                let share = L::div(L::mul(aside, L::splat(per_thickness)), L::select(steep, g, one));
                let there = L::keep(steep, L::max(L::sub(one, share), zero));
                L::select(L::lt(zero, aside), there, one)
            }
        }
    }
}

/// |v - value|
#[inline(always)]
fn distance<L: Lanes>(v: L::F, value: f32) -> L::F {
    let value = L::splat(value);
    L::max(L::sub(v, value), L::sub(value, v))
}

/// The kernel.
pub(super) fn kernel<'v>(level: Level) -> Run<'v> {
    level.kernel::<Classify2d, _, _>()
}

/// Colour and opacity of slabs by their values and gradients.
pub(super) struct Classify2d;

impl<'v> Kernel<Frame<'v>, Batch> for Classify2d {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(transfer) = &frame.optional.transfer2d else { return };
        let zero = L::splat(0.0);
        // Rows without a gradient hold nothing that shows.
        let Some(gradient) = batch.gradient.as_deref() else { return };
        batch.shown &= rows_of(gradient.lanes);
        for_rows!(batch.shown, r => {
            let v = L::load(row(&batch.sample.value, r));
            let g = L::load(row(&gradient.size, r));
            let (mut color, mut depth) = ([zero; 3], zero);
            for region in &transfer.regions {
                let more = L::min(L::mul(region.extinction::<L>(v, g), L::splat(transfer.ratio)), L::splat(DEEPEST as f32));
                depth = L::add(depth, more);
                for c in 0..3 {
                    color[c] = L::add(color[c], L::mul(more, L::splat(region.color[c])));
                }
            }
            if let Some(EntriesFrame { table, columns, along }) = &transfer.table {
                let (i, x) = place::<L>(v, &along[0]);
                let (j, y) = place::<L>(g, &along[1]);
                // Whole numbers below 2^24: exact in f32.
                let at = L::add(L::mul(j, L::splat(*columns)), i);
                let near = L::lookup(table, L::trunc(at), x);
                let far = L::lookup(table, L::trunc(L::add(at, L::splat(*columns))), x);
                let [red, green, blue, all] = super::classify::lerp::<L>(near, far, y);
                color = [red, green, blue];
                depth = all;
            }
            // A row that the value let through may still show nothing.
            let shows = L::lt(zero, depth);
            for c in 0..3 {
                L::store(L::keep(shows, color[c]), row_mut(&mut batch.slab.color[c], r));
            }
            L::store(L::keep(shows, depth), row_mut(&mut batch.slab.alpha, r));
            finish::<L>(&mut batch.slab, r, L::splat(1.0));
        });
    }
}

/// The entry below `x`, one before the last at most, and the way from it to the next.
#[inline(always)]
fn place<L: Lanes>(x: L::F, &[low, per, last]: &[f32; 3]) -> (L::F, L::F) {
    let at = L::mul(L::sub(x, L::splat(low)), L::splat(per));
    let at = L::min(L::max(at, L::splat(0.0)), L::splat(last + 1.0));
    let entry = L::min(L::whole(at), L::splat(last));
    (entry, L::sub(at, entry))
}
