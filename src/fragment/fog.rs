//! Fog on premultiplied colour: C' = f C + (1 - f) A C_fog; the literal formula leaves A out.

use super::batch::Batch;
use super::frame::Frame;
use super::{Pieces, Run};
use crate::lanes::math::exp_negative;
use crate::lanes::{Kernel, Lanes, Level, for_rows, row, row_mut};
use crate::scene::{FogDistance, FogMode};

/// The kernel for fog by `distance`.
pub(super) fn kernel<'v>(distance: FogDistance, pieces: Pieces, level: Level) -> Run<'v> {
    match (pieces, distance) {
        (Pieces::BehindSlices, _) => level.kernel::<FogEach, _, _>(),
        (Pieces::AlongRays, _) => level.kernel::<FogAlong, _, _>(),
        (Pieces::OnSlice, FogDistance::Planar) => level.kernel::<FogPlanar, _, _>(),
        (Pieces::OnSlice, FogDistance::Radial) => level.kernel::<FogRadial, _, _>(),
    }
}

/// One factor for the whole slice.
pub(super) struct FogPlanar;
/// A factor for each fragment, from its distance to the eye.
pub(super) struct FogRadial;

/// A factor for each fragment, which the batch holds already.
pub(super) struct FogEach;

/// A factor for each fragment, from the distance that fog goes by along rays with samples of their own.
pub(super) struct FogAlong;

/// Mixes row `r` with the fog colour by factor `f`.
#[inline(always)]
fn mix<L: Lanes>(batch: &mut Batch, r: usize, f: L::F, color: [f32; 3], weighted: bool) {
    let rest = L::sub(L::splat(1.0), f);
    let amount = if weighted { L::mul(rest, L::load(row(&batch.slab.alpha, r))) } else { rest };
    for (channel, fog) in batch.slab.color.iter_mut().zip(color) {
        let c = row_mut(channel, r);
        L::store(L::add(L::mul(L::load(c), f), L::mul(amount, L::splat(fog))), c);
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FogPlanar {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(fog) = frame.optional.fog else { return };
        let f = L::splat(batch.fog.slice);
        for_rows!(batch.shown, r => {
            mix::<L>(batch, r, f, fog.color, fog.weighted);
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FogEach {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(fog) = frame.optional.fog else { return };
        for_rows!(batch.shown, r => {
            let f = L::load(row(&batch.fog.each, r));
            mix::<L>(batch, r, f, fog.color, fog.weighted);
        });
    }
}

/// A density in f32, infinity and its products kept away: nothing is seen through less.
fn bounded(density: f64) -> f32 {
    density.min(1e18) as f32
}

/// The factor at distance `z`.
#[inline(always)]
fn factor<L: Lanes>(mode: FogMode, z: L::F) -> L::F {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let f = match mode {
        FogMode::Linear { start, end } if start == end => L::select(L::lt(z, L::splat(end as f32)), one, zero),
        FogMode::Linear { start, end } => {
            // Lengths that f32 has no room for are measured by themselves.
            let most = start.abs().max(end.abs());
            let unit = if most < 1e30 { 1.0 } else { 1.0 / most };
            let (end, width) = (end * unit, end * unit - start * unit);
            L::div(L::sub(L::splat(end as f32), L::mul(z, L::splat(unit as f32))), L::splat(width as f32))
        }
        FogMode::Exp { density } => exp_negative::<L>(L::mul(L::splat(-bounded(density)), z)),
        FogMode::Exp2 { density } => {
            let x = L::mul(L::splat(bounded(density)), z);
            exp_negative::<L>(L::mul(L::sub(zero, x), x))
        }
    };
    L::min(L::max(f, zero), one)
}

impl<'v> Kernel<Frame<'v>, Batch> for FogRadial {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(fog) = frame.optional.fog else { return };
        let depth = L::splat(batch.depth);
        for_rows!(batch.shown, r => {
            // Perspective: slant stretches the depth. Orthographic: slant is 1 and the plane coordinates are distances.
            let along = L::mul(depth, L::load(row(&batch.pixels.slant, r)));
            let z = L::sqrt(L::add(L::mul(along, along), L::load(row(&batch.pixels.plane_squared, r))));
            mix::<L>(batch, r, factor::<L>(fog.mode, z), fog.color, fog.weighted);
        });
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for FogAlong {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(fog) = frame.optional.fog else { return };
        let slice = L::splat(batch.slice as f32);
        for_rows!(batch.shown, r => {
            let Some(rays) = batch.rays.as_deref() else { return };
            let along = L::add(L::load(row(&rays.along, r)), L::mul(slice, L::load(row(&rays.along_step, r))));
            let z = L::sqrt(L::add(L::mul(along, along), L::load(row(&rays.aside_squared, r))));
            mix::<L>(batch, r, factor::<L>(fog.mode, z), fog.color, fog.weighted);
        });
    }
}
