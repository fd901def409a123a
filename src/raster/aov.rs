//! Where each ray ends up, noted while batches go by: for planes beside the picture.

use super::observer::Observer;
use crate::fragment::{BEHIND, Batch, Frame};
use crate::lanes::{BATCH, SIDE};
use crate::proxy::Stack;
use crate::scene::StageId;
use std::array;

/// Transmittance at which an opacity of a half is passed.
const HALF: f32 = 0.5;

/// What tells where a ray ends up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Told {
    /// Transmittance, slab by slab; whether slabs end at their slices.
    Transmittance { between: bool },
    /// The surfaces met.
    Surfaces,
    /// The slice position of the first crossing, which the pixel keeps.
    FirstCrossing,
}

/// What is known of one pixel's ray.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) pixel: (u32, u32),
    /// Depth of the place, or its slice position where the first crossing tells it; infinite where there is none.
    pub(crate) at: f64,
    /// Level of the surface there.
    pub(crate) level: Option<f64>,
    /// Opacity: what transmittance leaves to 1, and what rounding has added to that.
    pub(crate) alpha: f32,
}

/// Notes where rays end up.
pub(crate) struct Looker {
    pub(crate) told: Told,
    pub(crate) seen: Vec<Seen>,
    first: (u32, u32),
    /// Depth of each ray's slice position 0, and distance of its slices.
    depths: [(f64, f64); BATCH],
    at: [f64; BATCH],
    left: [f32; BATCH],
}

impl Looker {
    /// One that has seen nothing.
    pub(crate) fn new(told: Told) -> Self {
        Self { told, seen: Vec::new(), first: (0, 0), depths: [(0.0, 0.0); BATCH], at: [f64::INFINITY; BATCH], left: [1.0; BATCH] }
    }

    /// Where in the slab that pixel `i` has just passed its opacity came to a half.
    fn passed(&self, batch: &Batch, i: usize, between: bool) -> f64 {
        // Behind the last slices of rays that end at planes are those.
        if let (BEHIND, Some(rays)) = (batch.slice, batch.rays.as_deref()) {
            return rays.cut[i];
        }
        let pixels = &batch.pixels;
        let length = f64::from(batch.slab.length[i] / pixels.slant[i]);
        let (from, to) = match batch.slice {
            BEHIND => (f64::from(pixels.last[i]), f64::from(pixels.last[i]) + length),
            k if between => (f64::from(k) - length, f64::from(k)),
            k if k == pixels.last[i] && k != pixels.first[i] => (f64::from(k) - 0.5, f64::from(k) - 0.5 + length),
            k => (f64::from(k) + 0.5 - length, f64::from(k) + 0.5),
        };
        // Transmittance falls exponentially through a slab.
        let (before, after) = (f64::from(self.left[i]), f64::from(pixels.transmittance[i]));
        let share = if after > 0.0 { libm::log(before / f64::from(HALF)) / libm::log(before / after) } else { 0.0 };
        let k = from + share.clamp(0.0, 1.0) * (to - from);
        self.depths[i].0 + (k + 0.5) * self.depths[i].1
    }
}

impl Observer for Looker {
    const OBSERVES: bool = false;

    fn fresh(&self) -> Self {
        Self::new(self.told)
    }

    fn block(&mut self, stack: &Stack, x: u32, y: u32, batch: &Batch) {
        self.first = (x, y);
        self.depths = match batch.rays.as_deref() {
            Some(rays) => array::from_fn(|i| (rays.near[i], rays.spacing[i])),
            None => [(stack.near, stack.spacing); BATCH],
        };
        self.at = [f64::INFINITY; BATCH];
        self.left = batch.pixels.transmittance;
    }

    fn stage(&mut self, id: StageId, _: &Frame<'_>, batch: &Batch) {
        let (Told::Transmittance { between }, StageId::Blend) = (self.told, id) else { return };
        for i in 0..BATCH {
            if self.left[i] >= HALF && batch.pixels.transmittance[i] < HALF {
                self.at[i] = self.passed(batch, i, between);
            }
        }
        self.left = batch.pixels.transmittance;
    }

    fn done(&mut self, batch: &Batch) {
        for i in 0..BATCH {
            let left = batch.pixels.transmittance[i];
            // Zero where sums are not compensated.
            let lost = batch.pixels.excess[3][i];
            let (at, level) = match self.told {
                Told::Transmittance { .. } => (self.at[i], None),
                Told::Surfaces => batch.hits.as_ref().map_or((f64::INFINITY, None), |hits| (hits.depth[i], Some(hits.level[i]))),
                Told::FirstCrossing => (if left == 0.0 { f64::from(batch.pixels.color[1][i]) } else { f64::INFINITY }, None),
            };
            // Lanes of other tiles have seen nothing here.
            if at.is_finite() || left < 1.0 || lost > 0.0 {
                let pixel = (self.first.0 + (i % SIDE) as u32, self.first.1 + (i / SIDE) as u32);
                self.seen.push(Seen { pixel, at, level, alpha: (1.0 - left) + lost });
            }
        }
    }

    fn merge(&mut self, other: Self) {
        self.seen.extend(other.seen);
    }
}
