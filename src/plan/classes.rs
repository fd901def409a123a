//! The table a frame classifies by: over values, or over pairs of values.

use super::{Layout, PairTable, Slab};
use crate::lanes::LookupTable;
use crate::scene::TransferFunction;

/// What a table runs over; everything but the thickness of the slab.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Classes {
    /// The value of a slab.
    Values(Layout),
    /// The values on both sides of a slab.
    PairTable(PairTable),
}

impl Classes {
    /// Classes for values in `range` through `transfer`.
    pub(crate) fn new(transfer: &TransferFunction, range: (f64, f64), slab: Slab, pairs: bool) -> Self {
        if pairs { Self::PairTable(PairTable::new(transfer, range, slab)) } else { Self::Values(Layout::new(transfer, range, slab)) }
    }

    /// Values at the first and last entry, data units.
    pub(crate) fn range(&self) -> (f64, f64) {
        match self {
            Self::Values(l) => (l.low, l.high),
            Self::PairTable(p) => (p.low(), p.high()),
        }
    }

    /// Index of the last entry (along each side).
    pub(crate) fn last(&self) -> usize {
        match self {
            Self::Values(l) => l.last(),
            Self::PairTable(p) => p.last(),
        }
    }

    /// The layout of a second table, over the mean values of slabs within an interval.
    pub(crate) fn fine(&self) -> Option<&Layout> {
        match self {
            Self::Values(_) => None,
            Self::PairTable(p) => p.fine(),
        }
    }

    /// The table for slabs like `slab`.
    pub(crate) fn table(&self, transfer: &TransferFunction, slab: Slab) -> LookupTable {
        match self {
            Self::Values(l) => l.table(transfer, slab),
            Self::PairTable(p) => p.table(transfer, slab),
        }
    }

    /// Whether anything shows of a field that stays within [lo, hi]; never a false no.
    pub(crate) fn opaque_within(&self, lo: f64, hi: f64) -> bool {
        match self {
            Self::Values(l) => l.opaque_within(lo, hi),
            Self::PairTable(p) => p.opaque_within(lo, hi),
        }
    }
}
