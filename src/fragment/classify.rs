//! Classification: from the interpolated value to premultiplied colour and slab opacity, by table.

use super::batch::{Batch, Frame, SIDE, row, row_mut};
use crate::lanes::{Kernel, Lanes};

/// One linear lookup a fragment. `SPLIT` scales in two steps, for ranges whose scale leaves f32.
pub(crate) struct Classify<const SPLIT: bool>;

impl<'v, const SPLIT: bool> Kernel<Frame<'v>, Batch> for Classify<SPLIT> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let (low, last) = (L::splat(frame.table_low), L::splat(frame.table_last));
        let (scale, more) = (L::splat(frame.table_scale[0]), L::splat(frame.table_scale[1]));
        for r in 0..SIDE {
            let mut x = L::mul(L::sub(L::load(row(&batch.value, r)), low), scale);
            if SPLIT {
                x = L::mul(x, more);
            }
            // Constant beyond the table's ends.
            let x = L::min(L::max(x, L::splat(0.0)), last);
            let index = L::trunc(x);
            let [red, green, blue, alpha] = L::lookup(&frame.table, index, L::sub(x, L::to_f(index)));
            L::store(red, row_mut(&mut batch.color[0], r));
            L::store(green, row_mut(&mut batch.color[1], r));
            L::store(blue, row_mut(&mut batch.color[2], r));
            L::store(alpha, row_mut(&mut batch.alpha, r));
        }
    }
}
