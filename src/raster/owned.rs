//! The fragments of a picture that a part of a volume renders: those whose samples it owns.

use super::observer::Observer;
use crate::fragment::Batch;
use crate::lanes::BATCH;
use crate::proxy::{Domain, Stack};
use std::ops::Range;

/// Asks for the fragments that a part of a volume owns.
pub(crate) struct Owned<'d> {
    domain: &'d Domain,
    /// The slices on which it may own some of the block at hand.
    slices: Range<i64>,
}

impl<'d> Owned<'d> {
    /// For a part that holds `domain` of its whole.
    pub(crate) fn new(domain: &'d Domain) -> Self {
        Self { domain, slices: 0..0 }
    }
}

impl Observer for Owned<'_> {
    const OBSERVES: bool = false;
    const SELECTS: bool = true;

    fn fresh(&self) -> Self {
        Self::new(self.domain)
    }

    fn block(&mut self, stack: &Stack, x: u32, y: u32, _: &Batch) {
        self.slices = self.domain.slices(stack, (x, y), i64::MIN..i64::MAX);
    }

    fn slices(&self, covered: Range<i64>) -> Range<i64> {
        covered.start.max(self.slices.start)..covered.end.min(self.slices.end)
    }

    fn fragments(&self, stack: &Stack, first: (u32, u32), d: f64) -> u64 {
        self.domain.fragments(stack, first, d)
    }

    fn fragments_each(&self, stack: &Stack, first: (u32, u32), depths: &[f64; BATCH]) -> u64 {
        self.domain.fragments_each(stack, first, depths)
    }

    fn merge(&mut self, _: Self) {}
}
