//! What was done for a frame's blocks and what was not, counted.

use crate::fragment::Batch;
use crate::fragment::batch::{BATCH, SIDE, spread};

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
    }

    /// A slice's batch goes through the stages in part, or with pixels that it does not cover.
    pub(super) fn part(&mut self, batch: &Batch) {
        let lanes = lanes_of(batch.rows);
        let inside = spread(batch.rows);
        self.lanes += lanes;
        self.fetches += lanes;
        self.looked_up += u64::from((batch.mask & inside).count_ones());
        // Rows are left out when their pixels are all finished.
        self.finished_fragments += u64::from((batch.mask & !inside).count_ones());
    }

    /// `rows` of a slice's batch go through the stages, all of its pixels covered by whole slabs.
    #[inline(always)]
    pub(super) fn whole(&mut self, rows: u8) {
        let lanes = lanes_of(rows);
        self.whole += 1;
        self.whole_lanes += lanes;
        self.lanes += lanes;
        self.fetches += lanes;
        self.looked_up += lanes;
        self.finished_fragments += BATCH as u64 - lanes;
    }
}

/// Lanes of `rows`.
#[inline(always)]
pub(super) fn lanes_of(rows: u8) -> u64 {
    u64::from(rows.count_ones()) * SIDE as u64
}
