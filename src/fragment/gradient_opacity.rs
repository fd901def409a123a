//! Opacity by the size of the gradient: a factor on the extinction, so on the opacity per unit length.
//!
//! Classification has left the slab's optical depth tau in the place of opacity, and colour times tau. With the factor f and the piece's
//! length l, in slabs: A = 1 - exp(-tau f l). Opacities near 1 keep their extinction that way, however small the factor.

use super::Run;
use super::batch::{Batch, SlabBatch};
use super::frame::Frame;
use super::gradient::GradientFrame;
use crate::lanes::math::expm1_negative;
use crate::lanes::{Kernel, Lanes, Level, for_rows, row, row_mut, rows_of};
use crate::scene::TransferFunction;

/// A piecewise-linear function of the gradient's size, as a first value and what is added from point to point.
#[derive(Debug, Clone)]
pub(crate) struct OpacityFrame {
    first: f32,
    rises: Vec<Rise>,
}

/// From one point to the next: `change`, spread over sizes from `from` on, `1 / per` of them wide.
#[derive(Debug, Clone, Copy)]
struct Rise {
    from: f32,
    per: f32,
    change: f32,
}

impl OpacityFrame {
    /// That of `transfer`, in the numbers of `gradient`; `None` where opacity does not depend on the gradient.
    pub(crate) fn of(transfer: &TransferFunction, gradient: &GradientFrame) -> Option<Self> {
        let points: Vec<(f32, f32)> = transfer.gradient_opacity().iter().map(|&(g, f)| (gradient.number(g), f as f32)).collect();
        let first = points.first()?.1;
        let rises = points.windows(2).map(|p| Rise { from: p[0].0, per: 1.0 / (p[1].0 - p[0].0), change: p[1].1 - p[0].1 });
        Some(Self { first, rises: rises.filter(|rise| rise.change != 0.0).collect() })
    }

    /// The factor where the gradient has the given sizes.
    #[inline(always)]
    fn factor<L: Lanes>(&self, size: L::F) -> L::F {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut factor = L::splat(self.first);
        for rise in &self.rises {
            let beyond = L::sub(size, L::splat(rise.from));
            let share = if rise.per.is_finite() {
                L::min(L::max(L::mul(beyond, L::splat(rise.per)), zero), one)
            } else {
                // A step, whose right-hand side counts at the size itself.
                L::keep(L::le(zero, beyond), one)
            };
            factor = L::add(factor, L::mul(share, L::splat(rise.change)));
        }
        L::min(L::max(factor, zero), one)
    }
}

/// The kernel.
pub(super) fn kernel<'v>(level: Level) -> Run<'v> {
    level.kernel::<WeighByGradient, _, _>()
}

/// From optical depth to opacity, by the factor of the gradient.
pub(super) struct WeighByGradient;

impl<'v> Kernel<Frame<'v>, Batch> for WeighByGradient {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(opacity) = &frame.optional.opacity else { return };
        // Rows without a gradient hold nothing that shows.
        let Some(gradient) = batch.gradient.as_deref() else { return };
        batch.shown &= rows_of(gradient.lanes);
        for_rows!(batch.shown, r => {
            let factor = opacity.factor::<L>(L::load(row(&gradient.size, r)));
            finish::<L>(&mut batch.slab, r, factor);
        });
    }
}

/// From optical depth, and colour times that, to opacity and premultiplied colour: of row `r`, for its pieces' lengths times `factor`.
#[inline(always)]
pub(super) fn finish<L: Lanes>(slab: &mut SlabBatch, r: usize, factor: L::F) {
    let zero = L::splat(0.0);
    let depth = L::load(row(&slab.alpha, r));
    let piece = L::mul(L::mul(depth, factor), L::load(row(&slab.length, r)));
    let alpha = L::sub(zero, expm1_negative::<L>(L::sub(zero, piece)));
    let some = L::lt(zero, depth);
    let share = L::div(L::keep(some, alpha), L::select(some, depth, L::splat(1.0)));
    L::store(alpha, row_mut(&mut slab.alpha, r));
    for channel in &mut slab.color {
        let c = row_mut(channel, r);
        L::store(L::mul(L::load(c), share), c);
    }
}
