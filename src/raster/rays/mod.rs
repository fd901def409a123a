//! Blocks whose rays have samples of their own (shells, stacks shifted pixel by pixel), or end at opaque planes.
//!
//! Each ray is asked by itself where it enters, leaves and ends, in f64; then the block's samples of one number go through the same stages as
//! the fragments of a slice. Nothing here runs for scenes whose rays go through flat slices to the far side of the box.

mod march;

use super::block::Outcome;
use super::block_transform::BlockTransform;
use super::march::begin;
use super::observer::Observer;
use super::ray_intervals::{BlockRange, Path, RayIntervals};
use super::work::Work;
use crate::fragment::{Batch, RayBatch};
use crate::lanes::{BATCH, SIDE};
use crate::plan::RayPlan;
use crate::proxy::RaySlabs;
use crate::scene::{FogDistance, Order};
use crate::tally::Counters;
use march::RayMarch;

/// Renders the block at pixel (x0,y0) into `batch.pixels`. Bit i of `inside` tells whether lane i belongs to the picture and tile.
#[inline(never)]
pub(super) fn render<'v, O: Observer>(
    (work, plan): (&Work<'_, 'v>, &RayPlan<'v>),
    intervals: &RayIntervals<'_>,
    (x0, y0): (u32, u32),
    inside: u64,
    batch: &mut Batch,
    counters: &mut Counters,
    observer: &mut O,
) -> Outcome {
    intervals.plane(x0, y0, &mut batch.pixels);
    let forward = if work.order == Order::FrontToBack { 1.0 } else { -1.0 };
    let transform = BlockTransform::new(work.stack, work.frame.sample.strides, forward, f64::from(x0) + 0.5, f64::from(y0) + 0.5);
    let (range, cut) = settle((work, plan), intervals, (x0, y0), inside, batch);
    counters.blocks += 1;
    counters.fragments += range.fragments;
    counters.corners += range.corners;
    if range.any.0 > range.any.1 && cut == 0 {
        counters.missed_blocks += 1;
        return Outcome::Missed;
    }
    if plan.steps.is_some() {
        place(work, &transform, batch);
    }
    begin(work, &transform, batch);
    observer.block(work.stack, x0, y0, batch);
    let slices = observer.slices(range.any.0..range.any.1 + 1);
    let mut march = RayMarch::new((work, plan), range, transform, batch, counters, observer);
    if work.order == Order::FrontToBack {
        march.slices(slices.start, slices.end);
        march.planes(cut);
    } else {
        march.planes(cut);
        march.slices(slices.start, slices.end);
    }
    observer.done(batch);
    Outcome::Rendered
}

/// Sets where the block's rays have their slabs, begin and end, and what planes they end at; what matters of them, and the rays that end at a
/// plane, one bit each.
fn settle(
    (work, plan): (&Work<'_, '_>, &RayPlan<'_>),
    intervals: &RayIntervals<'_>,
    (x0, y0): (u32, u32),
    inside: u64,
    batch: &mut Batch,
) -> (BlockRange, u64) {
    let (stack, pixels) = (work.stack, &mut batch.pixels);
    let mut range = BlockRange::NONE;
    let mut cut = 0u64;
    let Some(rays) = batch.rays.as_deref_mut() else { return (range, cut) };
    pixels.doubt = 0;
    (pixels.first, pixels.last) = ([1; BATCH], [0; BATCH]);
    let (mut first, mut last, mut covered) = ((i64::MAX, i64::MIN), (i64::MAX, i64::MIN), 0u32);
    for i in 0..BATCH {
        let at = (x0 + (i % SIDE) as u32, y0 + (i / SIDE) as u32);
        let (x, y) = (f64::from(at.0) + 0.5, f64::from(at.1) + 0.5);
        let (px, py) = stack.view.plane(x, y);
        let slant = if stack.perspective { (1.0 + (px * px + py * py)).sqrt() } else { 1.0 };
        let flat = RaySlabs { near: stack.near, spacing: stack.spacing };
        let slabs = plan.steps.map_or(flat, |steps| steps.slabs(stack, at, slant));
        (rays.near[i], rays.spacing[i]) = (slabs.near, slabs.spacing);
        let along = if work.radial { slant } else { 1.0 };
        rays.along[i] = ((slabs.near + 0.5 * slabs.spacing) * along) as f32;
        rays.along_step[i] = (slabs.spacing * along) as f32;
        rays.aside_squared[i] = if work.radial && !stack.perspective { (px * px + py * py) as f32 } else { 0.0 };
        rays.cut[i] = f64::INFINITY;
        if plan.steps.is_some_and(|steps| steps.in_shells()) {
            // Every ray crosses a shell's slab at its thickness.
            pixels.slant[i] = 1.0;
        }
        let Some(mut path) = intervals.path(x, y).filter(|_| inside >> i & 1 == 1) else { continue };
        if let Some((depth, color)) = nearest_plane(work, plan, path, (x, y)) {
            path.exit = depth;
            rays.cut[i] = depth;
            (0..3).for_each(|c| rays.cut_color[c][i] = color[c] as f32);
            cut |= 1 << i;
        }
        let Some(end) = intervals.pieces(path, slabs) else { continue };
        (pixels.first[i], pixels.last[i]) = (end.first as i32, end.last as i32);
        (pixels.first_length[i], pixels.last_length[i]) = (end.first_length, end.last_length);
        first = (first.0.min(end.first), first.1.max(end.first));
        last = (last.0.min(end.last), last.1.max(end.last));
        covered += 1;
        if end.corner {
            range.corners += 1;
        } else {
            range.fragments += (end.last - end.first + 1) as u64;
        }
    }
    if covered > 0 {
        (range.any, range.last_first) = ((first.0, last.1), first.1);
    }
    if covered == BATCH as u32 {
        range.whole = intervals.whole(first.1, last.0);
    }
    (range, cut)
}

/// The nearest plane that the ray through window position (x,y) meets on its `path`: the depth and the colour there.
fn nearest_plane(work: &Work<'_, '_>, plan: &RayPlan<'_>, path: Path, (x, y): (f64, f64)) -> Option<(f64, [f64; 3])> {
    // A plane on a face of the box counts as inside, whatever rounding makes of it.
    let margin = 1e-9 * work.stack.spacing;
    let mut nearest: Option<(f64, [f64; 3])> = None;
    for cut in &plan.cuts {
        let (base, slope) = cut.plane.along(work.stack.perspective, x, y);
        let depth = -base / slope;
        // Rays along a plane do not meet it: their depth is no number.
        let inside = depth >= path.entry - margin && depth <= path.exit + margin;
        if !inside || nearest.is_some_and(|(known, _)| known <= depth) {
            continue;
        }
        let value = plan.lookup.value(work.stack.index_at(x, y, depth));
        if value.is_finite() {
            nearest = Some((depth, cut.colors.at(value)));
        }
    }
    nearest
}

/// Sets where the samples of the block's rays lie.
fn place(work: &Work<'_, '_>, transform: &BlockTransform, batch: &mut Batch) {
    let Some(rays) = batch.rays.as_deref_mut() else { return };
    let RayBatch { near, spacing, start, step, top, last, .. } = rays;
    for axis in 0..3 {
        top[axis] = transform.top[axis];
        last[axis] = if work.frame.sample.strides[axis] == 0 { 0.0 } else { top[axis] + 1.0 };
        for i in 0..BATCH {
            let aside = (i % SIDE) as f64 * transform.across[axis] + (i / SIDE) as f64 * transform.down[axis];
            // Pixel steps grow with depth in perspective.
            let (from, slope) = if work.stack.perspective {
                (transform.start[axis], transform.slope[axis] + aside)
            } else {
                (transform.start[axis] + aside, transform.slope[axis])
            };
            let first = near[i] + (0.5 + work.sample) * spacing[i];
            start[axis][i] = from + first * slope;
            step[axis][i] = spacing[i] * slope;
        }
    }
}

/// Distance that fog goes by at depth `d` of ray `i` of a block.
fn distance(work: &Work<'_, '_>, rays: &RayBatch, i: usize, d: f64) -> f64 {
    debug_assert!(work.fog.is_none_or(|fog| (fog.distance() == FogDistance::Radial) == work.radial));
    // The length of the ray per unit of depth, as fog counts it.
    let along = d * (f64::from(rays.along_step[i]) / rays.spacing[i]);
    (along * along + f64::from(rays.aside_squared[i])).sqrt()
}
