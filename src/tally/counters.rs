//! What was done for a frame's blocks and what was not, counted.

use super::Tally;
use crate::lanes::{BATCH, lanes_of, spread};

/// What was done and what was not, in whole numbers that any number of threads adds up to the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Counters {
    /// Fragments covered by slice polygons.
    pub(crate) fragments: u64,
    /// Voxel lookups done, 8 a row of a batch.
    pub(crate) fetches: u64,
    /// Batches that went through the stages.
    pub(crate) batches: u64,
    /// Batches passed over because nothing in them shows.
    pub(crate) empty: u64,
    /// Batches passed over because their pixels were finished.
    pub(crate) finished: u64,
    /// Blocks that no slice covers.
    pub(crate) missed_blocks: u64,
    /// Batches without the stages for partial coverage.
    pub(crate) whole: u64,
    /// Pieces of rays between two slices, which no polygon covers.
    pub(crate) corners: u64,
    /// Fragments and such pieces in batches that went through the stages.
    pub(crate) looked_up: u64,
    /// Fragments and such pieces in batches passed over because their pixels were finished.
    pub(crate) finished_fragments: u64,
    /// Batches behind the last slices, whose lookups are counted apart.
    pub(crate) exits: u64,
    /// Blocks looked at.
    pub(crate) blocks: u64,
    /// Lanes of slices' batches that went through the stages: 8 a row.
    pub(crate) lanes: u64,
    /// Lanes, of those, in batches without the stages for partial coverage.
    pub(crate) whole_lanes: u64,
    /// Lanes, of those, in rows in which nothing shows: looked up, and no more.
    pub(crate) hidden: u64,
    /// Batches left out because the one between them stood for them too.
    pub(crate) merged: u64,
    /// Fragments in those.
    pub(crate) merged_fragments: u64,
    /// Gradients taken, 8 a row of a batch.
    pub(crate) gradients: u64,
}

impl Counters {
    pub(crate) fn add(&mut self, other: &Self) {
        self.fragments += other.fragments;
        self.fetches += other.fetches;
        self.batches += other.batches;
        self.empty += other.empty;
        self.finished += other.finished;
        self.missed_blocks += other.missed_blocks;
        self.whole += other.whole;
        self.corners += other.corners;
        self.looked_up += other.looked_up;
        self.finished_fragments += other.finished_fragments;
        self.exits += other.exits;
        self.blocks += other.blocks;
        self.lanes += other.lanes;
        self.whole_lanes += other.whole_lanes;
        self.hidden += other.hidden;
        self.merged += other.merged;
        self.merged_fragments += other.merged_fragments;
        self.gradients += other.gradients;
    }

    /// `rows` of a slice's batch go through the stages; `mask` tells the pixels it covers, one bit each.
    #[inline(always)]
    pub(crate) fn part(&mut self, rows: u8, mask: u64) {
        let lanes = lanes_of(rows);
        let inside = spread(rows);
        self.lanes += lanes;
        self.fetches += lanes;
        self.looked_up += u64::from((mask & inside).count_ones());
        // Rows are left out when their pixels are all finished.
        self.finished_fragments += u64::from((mask & !inside).count_ones());
    }

    /// `rows` of a slice's batch go through the stages, all of its pixels covered by whole slabs.
    #[inline(always)]
    pub(crate) fn whole(&mut self, rows: u8) {
        let lanes = lanes_of(rows);
        self.whole += 1;
        self.whole_lanes += lanes;
        self.lanes += lanes;
        self.fetches += lanes;
        self.looked_up += lanes;
        self.finished_fragments += BATCH as u64 - lanes;
    }

    /// The numbers of `frames` frames.
    pub(crate) fn tally(&self, frames: u64) -> Tally {
        let c = self;
        Tally {
            frames,
            fragments: c.fragments,
            corners: c.corners,
            looked_up: c.looked_up,
            // Counting these one by one would cost more than passing over them.
            empty: (c.fragments + c.corners).saturating_sub(c.looked_up + c.finished_fragments + c.merged_fragments),
            merged: c.merged_fragments,
            finished: c.finished_fragments,
            beside: c.lanes - c.looked_up,
            between: c.fetches - c.lanes,
            hidden: c.hidden,
            gradients: c.gradients,
            lanes: c.lanes + BATCH as u64 * c.exits,
            batches: c.batches,
            whole_batches: c.whole,
            empty_batches: c.empty,
            finished_batches: c.finished,
            merged_batches: c.merged,
            blocks: c.blocks,
            missed_blocks: c.missed_blocks,
        }
    }
}
