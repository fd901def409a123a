//! Opacities of voxels that have colours of their own, over the number from 0 to 1 that their opacity goes by.
//!
//! Bytes and 16-bit numbers are entries themselves. Other numbers lie between entries, which are interpolated; the last one is there twice,
//! so that a number of 1 finds itself and not what rounding makes of its neighbour.

use super::Classify;
use super::slab::{Measure, Slab, of_straight};
use crate::lanes::LookupTable;
use crate::scene::{Straight, TransferFunction};

/// Over how many numbers opacities are told apart, and which of them occur and show something.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColorTable {
    /// Entries: number i / (entries - 1) at entry i.
    entries: usize,
    /// First and last entry that voxels come to.
    occurs: [usize; 2],
    /// Count of entries with any opacity before entry i: one longer than there are entries.
    shown: Vec<u32>,
}

impl ColorTable {
    /// A table of `entries`, at least two, for numbers in [min, max] through `transfer`.
    pub(super) fn new(transfer: &TransferFunction, (min, max): (f64, f64), entries: usize) -> Self {
        let mut table = Self { entries, occurs: [0; 2], shown: vec![0] };
        let mut count = 0;
        for i in 0..entries {
            count += u32::from(transfer.eval(table.number(i)).alpha > 0.0);
            table.shown.push(count);
        }
        table.occurs = table.around(min, max);
        table
    }

    /// The number at entry `i`.
    fn number(&self, i: usize) -> f64 {
        i as f64 / (self.entries - 1) as f64
    }

    /// First and last entry that numbers from `low` to `high` are looked up in.
    fn around(&self, low: f64, high: f64) -> [usize; 2] {
        // Numbers may be rounded to f32; 0 stays 0.
        let top = (self.entries - 1) as f64;
        let (low, high) = (low * (1.0 - 1e-7) * top, high * (1.0 + 1e-7) * top);
        [low.clamp(0.0, top) as usize, libm::ceil(high.clamp(0.0, top)) as usize]
    }
}

impl Classify for ColorTable {
    fn range(&self) -> (f64, f64) {
        (0.0, 0.0)
    }

    fn last(&self) -> usize {
        0
    }

    fn alphas(&self, transfer: &TransferFunction, slab: Slab) -> Option<Vec<f64>> {
        let alpha = |i: usize| {
            let alpha = transfer.eval(self.number(i)).alpha;
            of_straight(Straight { rgb: [0.0; 3], alpha }, slab)[3]
        };
        let mut alphas: Vec<f64> = (0..self.entries).map(alpha).collect();
        alphas.extend(alphas.last().copied());
        Some(alphas)
    }

    /// One entry: the strongest slab that voxels come to, white.
    fn table(&self, transfer: &TransferFunction, slab: Slab) -> LookupTable {
        let slab = Slab { measure: Measure::Opacity, ..slab };
        let all = self.alphas(transfer, slab).unwrap_or_default();
        let [first, last] = self.occurs;
        let most = all[first..=last].iter().fold(0.0, |most: f64, &alpha| most.max(alpha));
        LookupTable::new(&[[most as f32; 4]])
    }

    fn may_show(&self, lo: f64, hi: f64) -> bool {
        if lo > hi {
            return false;
        }
        let [first, last] = self.around(lo, hi);
        self.shown[last + 1] > self.shown[first]
    }
}
