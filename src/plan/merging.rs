//! When several slabs become one.

use super::prepared::MergedData;
use crate::classify::{CHANGES, most_change};
use crate::fragment::{ColorFrame, Frame};

/// The largest change of a slab's colour and opacity at which as many slabs as [`crate::skip::MERGED`] says become one, times the root mean
/// square of what the block's pixels let through: as a share of the strongest slab's opacity, or of [`STRONG`] where that is less.
///
/// A share, and not a number: as slabs get thinner, or a scene fainter, changes shrink, and so must those that do not matter, or all of
/// them would be merged and the error be that of a third or a ninth of the slices. From a half to twice these values the lookups for the
/// same error are about the same; much smaller ones find fewer places, much larger ones cost more in error than they save.
const SHARES: [f32; 2] = [0.08, 0.006];
/// Opacity of slabs that count as strong: of stronger ones hardly any light comes from behind.
const STRONG: f32 = 0.5;

/// What a frame needs to take several slabs for one.
#[derive(Debug, Clone)]
pub(crate) struct Merging<'v> {
    /// The frame with tables for slabs so many times as thick as [`crate::skip::MERGED`] says.
    pub(crate) frames: [Frame<'v>; 2],
    /// The largest change of a slab's colour and opacity in bricks of each class, as a share of the strongest slab's opacity.
    changes: [f32; CHANGES],
    /// The largest that is merged.
    pub(crate) most: [f32; 2],
}

impl<'v> Merging<'v> {
    /// Merging in a frame like `frame`.
    pub(super) fn new(frame: &Frame<'v>, data: &MergedData) -> Self {
        let thick = |at: usize| {
            let table = data.tables[at].clone();
            Frame { color: ColorFrame { table, ..frame.color.clone() }, ..frame.clone() }
        };
        Self {
            frames: [thick(0), thick(1)],
            changes: std::array::from_fn(|class| most_change(class as u8) as f32),
            most: SHARES.map(|share| share * (STRONG / data.strongest).min(1.0)),
        }
    }

    /// The largest change in bricks of `class`.
    pub(crate) fn change(&self, class: u8) -> f32 {
        self.changes.get(usize::from(class)).copied().unwrap_or(f32::INFINITY)
    }
}
