//! Where the fragments and lookups of a picture went, and what was left out.

mod counters;

pub(crate) use counters::Counters;

/// Where the fragments and lookups of a picture went. Where several frames make up one picture, their numbers are added.
///
/// # Guarantees
/// - `fragments + corners = looked_up + empty + finished + merged`;
/// - lookups done (`fetches` of the statistics) `= looked_up + beside + between`.
///
/// Stages work on batches of 64 lanes, the pixels of an 8 x 8 block on one slice, covered or not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Tally {
    /// Frames rendered.
    pub frames: u64,
    /// Fragments covered by slice polygons.
    pub fragments: u64,
    /// Pieces of rays that cross a corner of the box between two slices: one each, which no polygon covers.
    pub corners: u64,
    /// Fragments and pieces that went through the stages.
    pub looked_up: u64,
    /// Fragments and pieces passed over because the transfer function shows nothing near them; in projections of the largest or smallest value,
    /// because the values near them are no larger, or smaller, than what their pixels have seen.
    pub empty: u64,
    /// Fragments and pieces passed over because every pixel of their block, or of their row in it, let no more light through, or had its value already.
    pub finished: u64,
    /// Fragments that a neighbour stood for: of three or nine slabs that became one, all but the middle one.
    pub merged: u64,
    /// Lookups in lanes of batches that no fragment covers.
    pub beside: u64,
    /// Lookups besides those of slices: where slabs lie between two values, at the rays' ends and where slices were passed over.
    pub between: u64,
    /// Lanes of the batches that went through the stages: 8 a row, where a row has pixels that still take light.
    pub lanes: u64,
    /// Lanes, of those, in rows in which nothing shows at the values looked up: classification and blending were left out.
    pub hidden: u64,
    /// Gradients taken: of fragments that show, of pixels that still take light, where the scene needs them.
    pub gradients: u64,
    /// Batches that went through the stages.
    pub batches: u64,
    /// Batches, of those, covered by whole slabs throughout.
    pub whole_batches: u64,
    /// Batches passed over as empty.
    pub empty_batches: u64,
    /// Batches passed over as finished.
    pub finished_batches: u64,
    /// Batches left out because their neighbour stood for them.
    pub merged_batches: u64,
    /// Blocks of 8 x 8 pixels looked at.
    pub blocks: u64,
    /// Blocks, of those, that no slice covers.
    pub missed_blocks: u64,
}

/// Something that a picture did not need.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LeftOut {
    /// A stage, a check or a part of the work.
    pub what: String,
    /// Why it could be left out, or why it could not help.
    pub why: String,
    /// The work saved, where it can be counted.
    pub saved: Option<Saved>,
}

/// Work that was saved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Saved {
    /// How much was saved.
    pub count: u64,
    /// How much there would have been; not 0.
    pub of: u64,
    /// What is counted, in the plural.
    pub unit: &'static str,
}

impl LeftOut {
    /// Something whose work cannot be counted.
    pub(crate) fn uncounted(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self { what: what.into(), why: why.into(), saved: None }
    }

    /// Why, with what it saved, in one sentence.
    pub fn told(&self) -> String {
        match self.saved {
            Some(s) => format!("{} of {} {} ({:.1} %): {}", s.count, s.of, s.unit, 100.0 * s.share(), self.why),
            None => self.why.clone(),
        }
    }

    /// `count` of `of` units saved; uncounted where there are none.
    pub(crate) fn counted(what: impl Into<String>, why: impl Into<String>, (count, of): (u64, u64), unit: &'static str) -> Self {
        Self { what: what.into(), why: why.into(), saved: (of > 0).then_some(Saved { count, of, unit }) }
    }
}

impl Saved {
    /// The share saved, 0 to 1.
    pub fn share(&self) -> f64 {
        self.count as f64 / self.of as f64
    }
}
