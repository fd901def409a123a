//! Classification: from the interpolated value to premultiplied colour and slab opacity, by table.

use super::batch::Batch;
use super::fetch;
use super::frame::{ColorFrame, Frame};
use crate::lanes::{Kernel, Lanes, LookupTable, Places, for_rows, row, row_mut};

/// One linear lookup a fragment. `SPLIT` scales in two steps, for ranges whose scale leaves f32. Values are finite: the guard comes before it.
pub(crate) struct Classify<const SPLIT: bool>;

/// Position in the table of a value, constant beyond the table's ends.
#[inline(always)]
pub(super) fn position<L: Lanes, const SPLIT: bool>(frame: &Frame<'_>, value: L::F) -> L::F {
    let mut x = L::mul(L::sub(value, L::splat(frame.color.low)), L::splat(frame.color.scale[0]));
    if SPLIT {
        x = L::mul(x, L::splat(frame.color.scale[1]));
    }
    L::min(L::max(x, L::splat(0.0)), L::splat(frame.color.last))
}

/// Keeps row `r` of a batch's colours and opacities.
#[inline(always)]
pub(super) fn keep<L: Lanes>(batch: &mut Batch, r: usize, [red, green, blue, alpha]: [L::F; 4]) {
    L::store(red, row_mut(&mut batch.slab.color[0], r));
    L::store(green, row_mut(&mut batch.slab.color[1], r));
    L::store(blue, row_mut(&mut batch.slab.color[2], r));
    L::store(alpha, row_mut(&mut batch.slab.alpha, r));
}

/// Premultiplied colour and opacity of values, by the table of `color`, whose scale is applied in two steps.
#[inline(always)]
pub(super) fn of_table<L: Lanes>(color: &ColorFrame, table: &LookupTable, value: L::F) -> [L::F; 4] {
    let x = L::mul(L::mul(L::sub(value, L::splat(color.low)), L::splat(color.scale[0])), L::splat(color.scale[1]));
    let x = L::min(L::max(x, L::splat(0.0)), L::splat(color.last));
    let index = L::trunc(x);
    L::lookup(table, index, L::sub(x, L::to_f(index)))
}

#[inline(always)]
fn classify<L: Lanes, const SPLIT: bool>(frame: &Frame<'_>, value: L::F) -> [L::F; 4] {
    look_up::<L>(frame, position::<L, SPLIT>(frame, value))
}

/// The table's colour at position `x`.
#[inline(always)]
fn look_up<L: Lanes>(frame: &Frame<'_>, x: L::F) -> [L::F; 4] {
    let index = L::trunc(x);
    L::lookup(&frame.color.table, index, L::sub(x, L::to_f(index)))
}

impl<'v, const SPLIT: bool> Kernel<Frame<'v>, Batch> for Classify<SPLIT> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let first_visible = L::splat(frame.color.first_visible);
        let mut places = Places::new(&frame.color.table);
        let mut shown = 0;
        for_rows!(batch.shown, r => {
            let x = position::<L, SPLIT>(frame, L::load(row(&batch.sample.value, r)));
            let index = L::trunc(x);
            places.set::<L>(r, index, L::sub(x, L::to_f(index)));
            // Rows in which nothing shows are left out of what follows.
            shown |= u8::from(L::bits(L::le(first_visible, x)) != 0) << r;
        });
        for_rows!(shown, r => {
            let color = places.look_up::<L>(r);
            keep::<L>(batch, r, color);
        });
        batch.shown = shown;
    }
}

/// Pre-classification: the eight voxels around each fragment become premultiplied colours, and those are interpolated.
pub(crate) struct ClassifyCorners<const SPLIT: bool>;

/// Corner `c` of row `r`, classified; transparent where it is NaN or infinite.
#[inline(always)]
fn corner<L: Lanes, const SPLIT: bool>(frame: &Frame<'_>, batch: &Batch, c: usize, r: usize) -> [L::F; 4] {
    let value = L::load(row(&batch.rare.corners.0[c], r));
    let finite = fetch::finite::<L>(value);
    let [red, green, blue, alpha] = classify::<L, SPLIT>(frame, L::select(finite, value, L::splat(frame.color.low)));
    [L::keep(finite, red), L::keep(finite, green), L::keep(finite, blue), L::keep(finite, alpha)]
}

/// a + t (b - a), component by component.
#[inline(always)]
pub(super) fn lerp<L: Lanes>(a: [L::F; 4], b: [L::F; 4], t: L::F) -> [L::F; 4] {
    [fetch::lerp::<L>(a[0], b[0], t), fetch::lerp::<L>(a[1], b[1], t), fetch::lerp::<L>(a[2], b[2], t), fetch::lerp::<L>(a[3], b[3], t)]
}

impl<'v, const SPLIT: bool> Kernel<Frame<'v>, Batch> for ClassifyCorners<SPLIT> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        for_rows!(batch.rows, r => {
            let x = L::load(row(&batch.sample.weight[0], r));
            let y = L::load(row(&batch.sample.weight[1], r));
            let z = L::load(row(&batch.sample.weight[2], r));
            let e00 = lerp::<L>(corner::<L, SPLIT>(frame, batch, 0, r), corner::<L, SPLIT>(frame, batch, 1, r), x);
            let e10 = lerp::<L>(corner::<L, SPLIT>(frame, batch, 2, r), corner::<L, SPLIT>(frame, batch, 3, r), x);
            let near = lerp::<L>(e00, e10, y);
            let e01 = lerp::<L>(corner::<L, SPLIT>(frame, batch, 4, r), corner::<L, SPLIT>(frame, batch, 5, r), x);
            let e11 = lerp::<L>(corner::<L, SPLIT>(frame, batch, 6, r), corner::<L, SPLIT>(frame, batch, 7, r), x);
            let far = lerp::<L>(e01, e11, y);
            let color = lerp::<L>(near, far, z);
            keep::<L>(batch, r, color);
        });
        batch.shown = batch.rows;
    }
}
