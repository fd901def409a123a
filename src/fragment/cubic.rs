//! Lookup in the tricubic B-spline over a volume, and its gradient.
//!
//! ```text
//!   c0          c1    *     c2          c3       along an axis, at w from 0 to 1 between c1 and c2:
//!    o-----------o-----------o-----------o       value = w0 c0 + w1 c1 + w2 c2 + w3 c3
//!                 \\__w__/
//! ```
//! The weights are (1-w)^3 / 6, (3w^3 - 6w^2 + 4) / 6, (-3w^3 + 3w^2 + 3w + 1) / 6 and w^3 / 6. Their sum is 1, so the value lies between two linear
//! lookups: one between c0 and c1 at w1 / (w0 + w1), one between c2 and c3 at w3 / (w2 + w3), mixed by w2 + w3. In three dimensions these are eight
//! trilinear lookups (Sigg and Hadwiger 2005); they share positions along the axes, so all interpolations along x are done first, then those along y
//! and z. A value that is a mean in every step is as exact as its coefficients, and a constant stays the same number.

use super::batch::Batch;
use super::fetch::lerp;
use super::frame::Frame;
use super::gradient::At;
use crate::lanes::{Blocks, Kernel, Lanes, for_rows, row_mut};
use crate::volume::spline::{Coefficients, TAPS};

/// The spline's value at each fragment. `FAR` batches span more coefficients than an i32 counts.
pub(crate) struct FetchCubic<const FAR: bool>;

/// Where a fragment lies among four coefficients along an axis.
struct Axis<L: Lanes> {
    /// Position between the first two, and between the last two.
    low: L::F,
    high: L::F,
    /// Weight of the last two.
    upper: L::F,
}

impl<L: Lanes> Axis<L> {
    /// At `w` from 0 to 1 between the second and the third.
    #[inline(always)]
    fn new(w: L::F) -> Self {
        let (one, three) = (L::splat(1.0), L::splat(3.0));
        let rest = L::sub(one, w);
        // The four weights times six, without a difference in which bits would be lost.
        let both = L::add(one, L::mul(w, rest));
        let (w0, w3) = (L::mul(L::mul(rest, rest), rest), L::mul(L::mul(w, w), w));
        let (w1, w2) = (L::add(one, L::mul(L::mul(three, rest), both)), L::add(one, L::mul(L::mul(three, w), both)));
        let (lower, upper) = (L::add(w0, w1), L::add(w2, w3));
        Self { low: L::div(w1, lower), high: L::div(w3, upper), upper: L::mul(upper, L::splat(1.0 / 6.0)) }
    }

    /// The spline's value between `c`.
    #[inline(always)]
    fn value(&self, c: [L::F; TAPS]) -> L::F {
        lerp::<L>(lerp::<L>(c[0], c[1], self.low), lerp::<L>(c[2], c[3], self.high), self.upper)
    }
}

/// The spline's slope along an axis: the quadratic B-spline over the differences of neighbours.
struct Slope<L: Lanes> {
    weights: [L::F; TAPS - 1],
}

impl<L: Lanes> Slope<L> {
    /// As [`Axis::new`].
    #[inline(always)]
    fn new(w: L::F) -> Self {
        let (one, half) = (L::splat(1.0), L::splat(0.5));
        let rest = L::sub(one, w);
        Self { weights: [L::mul(half, L::mul(rest, rest)), L::add(half, L::mul(w, rest)), L::mul(half, L::mul(w, w))] }
    }

    /// The slope between `c`, per step from one to the next.
    #[inline(always)]
    fn value(&self, c: [L::F; TAPS]) -> L::F {
        let [a, b, d] = self.weights;
        L::add(L::add(L::mul(a, L::sub(c[1], c[0])), L::mul(b, L::sub(c[2], c[1]))), L::mul(d, L::sub(c[3], c[2])))
    }
}

/// The coefficients of the frame.
fn coefficients<'v>(frame: &Frame<'v>) -> &'v Coefficients {
    let Some(coefficients) = frame.sample.coefficients else { unreachable!("the plan chose the spline without its coefficients") };
    coefficients
}

/// The coefficients around the fragments of row `r`.
#[inline(always)]
fn blocks<'v, const FAR: bool>(frame: &Frame<'v>, of: At<'_>, r: usize) -> Blocks<'v> {
    let offset = |i: usize| if FAR { of.far_offset[i] as usize } else { of.offset[i] as usize };
    of.cells.blocks(&coefficients(frame).values, r, offset)
}

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchCubic<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let (sample, rare) = (&mut batch.sample, &batch.rare);
        let of = At { cells: &batch.geometry.cells, offset: &sample.offset, far_offset: &rare.far_offset, weight: &sample.weight };
        for_rows!(batch.rows, r => {
            let blocks = blocks::<FAR>(frame, of, r);
            let [x, y, z] = of.weights::<L>(r);
            let (x, y, z) = (Axis::<L>::new(x), Axis::<L>::new(y), Axis::<L>::new(z));
            let zero = L::splat(0.0);
            let mut layers = [zero; TAPS];
            for (k, layer) in layers.iter_mut().enumerate() {
                let mut rows = [zero; TAPS];
                for (j, row) in rows.iter_mut().enumerate() {
                    *row = x.value(blocks.four::<L>(j, k));
                }
                *layer = y.value(rows);
            }
            L::store(z.value(layers), row_mut(&mut sample.value, r));
        });
    }
}

/// The spline's gradient at the fragments of row `r`: change of the value (as the number that stages compute with) per voxel along x, y and z. Along
/// an axis of one voxel it is 0.
#[inline(always)]
pub(super) fn spline_gradient<L: Lanes, const FAR: bool>(frame: &Frame<'_>, of: At<'_>, r: usize) -> [L::F; 3] {
    let zero = L::splat(0.0);
    let blocks = blocks::<FAR>(frame, of, r);
    let [x, y, z] = of.weights::<L>(r);
    let (along_x, along_y, along_z) = (Slope::<L>::new(x), Slope::<L>::new(y), Slope::<L>::new(z));
    let (x, y, z) = (Axis::<L>::new(x), Axis::<L>::new(y), Axis::<L>::new(z));
    // Of each layer the value and its slopes along x and y.
    let (mut layers, mut slopes_x, mut slopes_y) = ([zero; TAPS], [zero; TAPS], [zero; TAPS]);
    for k in 0..TAPS {
        let (mut values, mut slopes) = ([zero; TAPS], [zero; TAPS]);
        for j in 0..TAPS {
            let c = blocks.four::<L>(j, k);
            (values[j], slopes[j]) = (x.value(c), along_x.value(c));
        }
        (layers[k], slopes_x[k], slopes_y[k]) = (y.value(values), y.value(slopes), along_y.value(values));
    }
    [z.value(slopes_x), z.value(slopes_y), along_z.value(layers)]
}
