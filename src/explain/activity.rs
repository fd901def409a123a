//! The first look: how much happens at each pixel of a picture, to choose those worth recording.

use crate::fragment::Batch;
use crate::lanes::BATCH;
use crate::proxy::Stack;
use crate::raster::Observer;
use crate::scene::Blend;
use std::collections::BTreeMap;

/// Change of a pixel's transmittance or colour that counts as something happening: about half a step of 8 bits.
const SEEN: f32 = 1.0 / 512.0;

/// Slices that a hit is worth.
const HIT: u32 = 1 << 24;

/// What happened in one block.
#[derive(Debug, Clone)]
struct Block {
    /// Planes of the stack that the block was cut into.
    slices: u64,
    /// Batches that went through the stages.
    batches: u32,
    /// Slices between first and last, for each pixel; 0 where none covers it.
    covered: [u32; BATCH],
    /// Slices at which the pixel changed.
    events: [u32; BATCH],
    /// The slice that took most light from the pixel, and how much.
    heaviest: [(i64, f32); BATCH],
}

/// What one pixel is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Worth {
    /// Slices that change it.
    pub(super) events: u32,
    /// Slices that cover it.
    pub(super) covered: u32,
    /// Slices of its block that went through the stages.
    pub(super) batches: u32,
    /// The slice that changes it most.
    pub(super) heaviest: u64,
    /// Planes of the stack there.
    pub(super) slices: u64,
}

/// Counts what happens at every pixel.
#[derive(Debug, Default)]
pub(super) struct Activity {
    blocks: BTreeMap<(u32, u32), Block>,
    current: Option<((u32, u32), Block)>,
    /// Whether a pixel ends with a hit, which is then worth more than any number of slices without one.
    hits: bool,
    /// Transmittance and first channel before the slice at hand.
    before: Option<(i64, Box<[[f32; BATCH]; 2]>)>,
}

impl Activity {
    /// A activity of a scene blended this way.
    pub(super) fn new(blend: Blend) -> Self {
        Self {
            hits: matches!(blend, Blend::AttenuatedMip { .. } | Blend::Lmip { .. } | Blend::Iso { .. } | Blend::Surfaces),
            ..Self::default()
        }
    }

    /// What happened at pixel (x,y); `None` where no slice covers it.
    pub(super) fn at(&self, x: u32, y: u32) -> Option<Worth> {
        let block = self.blocks.get(&(x & !7, y & !7))?;
        let i = (y % 8 * 8 + x % 8) as usize;
        let worth = Worth {
            events: block.events[i],
            covered: block.covered[i],
            batches: block.batches,
            heaviest: block.heaviest[i].0.max(0) as u64,
            slices: block.slices,
        };
        (worth.covered > 0).then_some(worth)
    }

    /// First pixels of all blocks that some slice covers, in order.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.blocks.keys().copied()
    }

    /// Counts what the slice before did.
    fn settle(&mut self, batch: &Batch) {
        let (Some((slice, before)), Some((_, block))) = (self.before.take(), &mut self.current) else { return };
        for i in 0..BATCH {
            let change = (before[0][i] - batch.pixels.transmittance[i]).abs();
            // Projections gather in the first channel, which starts at -inf: a step from there is a change too.
            let moved = before[1][i] != batch.pixels.color[0][i];
            if self.hits && change > 0.0 {
                block.events[i] += HIT;
            } else if change > SEEN || (change == 0.0 && moved) {
                block.events[i] += 1;
            }
            if change > block.heaviest[i].1 {
                block.heaviest[i] = (slice, change);
            }
        }
    }
}

impl Observer for Activity {
    fn fresh(&self) -> Self {
        Self { hits: self.hits, ..Self::default() }
    }

    fn block(&mut self, stack: &Stack, x: u32, y: u32, batch: &Batch) {
        let covered = std::array::from_fn(|i| (batch.pixels.last[i] - batch.pixels.first[i] + 1).max(0) as u32);
        let heaviest = std::array::from_fn(|i| (i64::from(batch.pixels.first[i]), 0.0));
        self.before = None;
        self.current = Some(((x, y), Block { slices: stack.count, batches: 0, covered, events: [0; BATCH], heaviest }));
    }

    fn slice(&mut self, _: &crate::fragment::Frame<'_>, batch: &Batch) {
        self.settle(batch);
        self.before = Some((i64::from(batch.slice), Box::new([batch.pixels.transmittance, batch.pixels.color[0]])));
        if let Some((_, block)) = &mut self.current {
            block.batches += 1;
        }
    }

    fn done(&mut self, batch: &Batch) {
        self.settle(batch);
        self.blocks.extend(self.current.take());
    }

    fn merge(&mut self, other: Self) {
        self.blocks.extend(other.blocks);
    }
}
