//! Classification: from values to the colour and opacity of slabs, by table; and what a brick of values may show.
//!
//! | file | a table over | used for |
//! |---|---|---|
//! | `value.rs` | the value of a slab | midpoint slabs, pre-classified voxels, projections |
//! | `pair.rs` | the values on both sides of a slab | pre-integrated slabs |
//! | `colors.rs` | the number that a colour's opacity goes by: opacities alone, voxels have colours of their own | volumes of colours |
//! | `knots.rs` | the value of a slab, with entries at the knots of the transfer function | labels of the nearest voxel, whatever their size |
//!
//! Another way to classify (a value and its gradient, a label) is a file here that implements [`Classify`], and a variant of [`Classifier`];
//! a stage in `fragment` then looks its table up.

mod change;
mod colors;
mod knots;
mod pair;
mod slab;
mod value;

pub(crate) use change::{CHANGES, ChangeClasses, most as most_change, strongest};
pub(crate) use colors::ColorTable;
pub(crate) use knots::{KnotTable, Piece as KnotPiece};
pub(crate) use pair::PairTable;
pub(crate) use slab::{Detail, Measure, Slab, of_straight};
pub(crate) use value::ValueTable;

use crate::lanes::LookupTable;
use crate::scene::TransferFunction;
use std::ops::Deref;

/// What every way of classifying tells a plan.
pub(crate) trait Classify {
    /// Values at the first and last entry of the table, data units.
    fn range(&self) -> (f64, f64);

    /// Index of the last entry, along each side.
    fn last(&self) -> usize;

    /// A second table, over the mean values of slabs within an interval of the first, where there is one.
    fn fine(&self) -> Option<&ValueTable> {
        None
    }

    /// The opacities of slabs like `slab`, where voxels have colours of their own: see [`ColorTable`].
    fn alphas(&self, _transfer: &TransferFunction, _slab: Slab) -> Option<Vec<f64>> {
        None
    }

    /// The table for slabs like `slab`.
    fn table(&self, transfer: &TransferFunction, slab: Slab) -> LookupTable;

    /// Whether anything may show of a field that stays within `[lo, hi]`, data units: what a brick is asked. Never a false no.
    fn may_show(&self, lo: f64, hi: f64) -> bool;
}

/// What a classifier goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum By {
    /// The value of a slab, interpolated between voxels.
    Value,
    /// The values of voxels.
    Voxel,
    /// The values on both sides of a slab.
    Pair,
    /// The exact value of the nearest voxel.
    Label,
    /// A number of colours, told apart in so many entries.
    Color(usize),
}

/// How a frame classifies: everything but the thickness of its slabs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Classifier {
    /// By the value of a slab.
    Value(ValueTable),
    /// By the values on both sides of a slab.
    Pair(PairTable),
    /// By the exact value of the nearest voxel.
    Label(KnotTable),
    /// By a number of colours.
    Color(ColorTable),
}

impl Classifier {
    /// A classifier `by` what it goes, for values in `range` through `transfer`.
    pub(crate) fn new(transfer: &TransferFunction, range: (f64, f64), slab: Slab, by: By) -> Self {
        match by {
            By::Value => Self::Value(ValueTable::new(transfer, range, slab)),
            By::Voxel => Self::Value(ValueTable::new(transfer, range, slab).of_voxels()),
            By::Pair => Self::Pair(PairTable::new(transfer, range, slab)),
            By::Label => Self::Label(KnotTable::new(transfer, slab)),
            By::Color(entries) => Self::Color(ColorTable::new(transfer, range, entries)),
        }
    }
}

impl Deref for Classifier {
    type Target = dyn Classify;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Value(table) => table,
            Self::Pair(table) => table,
            Self::Label(table) => table,
            Self::Color(table) => table,
        }
    }
}
