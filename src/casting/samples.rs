//! Samples of one ray through the plan's stages, 64 at a time.

use super::gather::Take;
use super::sight::Ray;
use super::{Cast, Piece, Scratch};
use crate::fragment::{BEHIND, Batch};
use crate::lanes::{BATCH, SIDE};
use crate::plan::FramePlan;
use crate::scene::FogDistance;
use std::array;

/// A batch for samples of rays, and what was done with it.
pub(super) struct Samples<'p, 'v> {
    plan: &'p FramePlan<'v>,
    batch: Box<Batch>,
    pieces: [Piece; BATCH],
    /// Index of the last cell's lower corner along each axis, and of the last voxel.
    top: [f64; 3],
    reach: [f64; 3],
    cast: Cast,
}

/// What a few samples span, index coordinates.
struct Span {
    low: [f64; 3],
    high: [f64; 3],
}

impl Span {
    const NONE: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    fn add(&mut self, place: [f64; 3]) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(place[axis]);
            self.high[axis] = self.high[axis].max(place[axis]);
        }
    }
}

impl<'p, 'v> Samples<'p, 'v> {
    /// For samples that go through the stages of `plan`.
    pub(super) fn new(plan: &'p FramePlan<'v>) -> Self {
        let strides = plan.frame.sample.strides;
        let top = plan.stack.dims.map(|n| n.saturating_sub(2) as f64);
        let mut batch = Batch::new(plan.frame.optional.gradient.is_some(), false);
        batch.geometry.cells.strides = strides;
        // Samples at depths of their own, of rays that no stage is to end.
        batch.slice = BEHIND;
        batch.pixels.transmittance = [1.0; BATCH];
        batch.places = plan.frame.optional.light.is_some().then(|| Box::new([[0.0; BATCH]; 3]));
        Self {
            plan,
            batch,
            pieces: [Piece::NONE; BATCH],
            top,
            reach: array::from_fn(|axis| if strides[axis] == 0 { 0.0 } else { top[axis] + 1.0 }),
            cast: Cast::default(),
        }
    }

    /// The samples `pieces` of `ray`, nearest first, until `take` wants no more.
    pub(super) fn cast(&mut self, ray: &Ray, mut pieces: impl Iterator<Item = Piece>, take: &mut impl Take) {
        let skip_table = self.plan.skip_table.as_deref().filter(|table| !table.all);
        let (mut over, mut met) = (false, 0);
        while !over {
            let mut count = 0;
            while count < BATCH && !over {
                // Eight that follow each other are asked about together.
                let (first, mut span) = (count, Span::NONE);
                while count < first + SIDE && !over {
                    match pieces.next() {
                        Some(piece) => {
                            self.pieces[count] = piece;
                            span.add(piece.place);
                            count += 1;
                        }
                        None => over = true,
                    }
                }
                met += (count - first) as u64;
                if count > first && skip_table.is_some_and(|table| !table.any || table.class(span.low, span.high) == 0) {
                    count = first;
                }
            }
            if count > 0 {
                self.run(ray, count);
                if !take.take(&self.batch, count) {
                    break;
                }
            }
        }
        self.cast.counters.fragments += met;
        self.cast.most = self.cast.most.max(met);
    }

    /// Takes the first `count` pieces through the stages.
    fn run(&mut self, ray: &Ray, count: usize) {
        self.place(count);
        let (plan, batch) = (self.plan, &mut *self.batch);
        let rows = count.div_ceil(SIDE);
        for (i, piece) in self.pieces[..count].iter().enumerate() {
            batch.slab.length[i] = piece.length as f32;
            if let Some(fog) = &plan.fog {
                let along = piece.depth * ray.stretch;
                let radial = fog.distance() == FogDistance::Radial;
                batch.fog.each[i] = fog.factor(if radial { (along * along + ray.aside).sqrt() } else { piece.depth }) as f32;
            }
        }
        batch.slab.length[count..].fill(1.0);
        batch.mask = u64::MAX >> (BATCH - count);
        (batch.rows, batch.shown) = (u8::MAX >> (SIDE - rows), u8::MAX >> (SIDE - rows));
        for stage in &plan.stages.each {
            (stage.run)(&plan.frame, batch);
        }
        let counters = &mut self.cast.counters;
        let lanes = (SIDE * rows) as u64;
        counters.batches += 1;
        counters.lanes += lanes;
        counters.fetches += lanes;
        counters.looked_up += count as u64;
    }

    /// Sets where the first `count` samples lie: their cells from a base voxel, and their places in them.
    fn place(&mut self, count: usize) {
        let strides = self.plan.frame.sample.strides.map(|s| s as u64);
        let batch = &mut *self.batch;
        let mut at = [0u64; BATCH];
        for (i, piece) in self.pieces[..count].iter().enumerate() {
            for axis in 0..3 {
                // Clamp to edge. Truncation equals floor from 0 up; a lookup on the upper border belongs to the last cell.
                let u = piece.place[axis].clamp(0.0, self.reach[axis]);
                let cell = libm::trunc(u).min(self.top[axis]);
                batch.sample.weight[axis][i] = (u - cell) as f32;
                at[i] += cell as u64 * strides[axis];
            }
        }
        if let Some(places) = batch.places.as_deref_mut() {
            for (i, piece) in self.pieces[..count].iter().enumerate() {
                (0..3).for_each(|axis| places[axis][i] = piece.place[axis]);
            }
        }
        let base = at[..count].iter().copied().fold(u64::MAX, u64::min);
        // Lanes without a sample look the base voxel up.
        at[count..].fill(base);
        batch.geometry.cells.base = base as usize;
        if self.plan.frame.sample.far {
            batch.rare.far_offset = at.map(|at| at - base);
        } else {
            // The plan takes lookups of far voxels where these numbers could leave i32.
            batch.sample.offset = at.map(|at| (at - base) as i32);
        }
    }
}

impl Scratch for Samples<'_, '_> {
    fn done(&mut self) -> Cast {
        let mut cast = std::mem::take(&mut self.cast);
        cast.counters.gradients = self.batch.gradient.as_deref_mut().map_or(0, |g| std::mem::take(&mut g.taken));
        cast
    }
}
