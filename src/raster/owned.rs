//! The fragments of a picture that a part of a volume renders: those whose samples it owns.

use super::observer::Observer;
use crate::fragment::Batch;
use crate::lanes::BATCH;
use crate::proxy::{Domain, Stack};
use std::ops::Range;

/// Asks for the fragments that a part of a volume owns.
pub(crate) struct Owned<'d> {
    domain: &'d Domain,
    stack: &'d Stack,
    /// The slices on which it may own some of the block at hand.
    slices: Range<i64>,
}

impl<'d> Owned<'d> {
    /// For a part that holds `domain` of its whole, on the slices of `stack`.
    pub(crate) fn new(domain: &'d Domain, stack: &'d Stack) -> Self {
        Self { domain, stack, slices: 0..0 }
    }

    /// Slices on which it may own some of the block whose first pixel is (x,y).
    fn slices_of(&self, x: u32, y: u32) -> Range<i64> {
        self.domain.slices(self.stack, (x, y), 0..self.stack.count as i64)
    }
}

impl Observer for Owned<'_> {
    const OBSERVES: bool = false;
    const SELECTS: bool = true;

    fn fresh(&self) -> Self {
        Self::new(self.domain, self.stack)
    }

    fn wants(&self, x: u32, y: u32) -> bool {
        !self.slices_of(x, y).is_empty()
    }

    fn block(&mut self, _: &Stack, x: u32, y: u32, _: &Batch) {
        self.slices = self.slices_of(x, y);
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
