//! Lookups of the nearest voxel that tell values apart exactly, whatever their size: each becomes its position in a table whose entries follow the
//! knots of the transfer function (see `classify/knots.rs`). In f64, and one by one: such volumes are rare.

use super::batch::Batch;
use super::fetch::nearest_steps;
use super::frame::Frame;
use crate::lanes::{BATCH, Kernel, Lanes, Number, convert, spread};
use crate::volume::with_slices;

/// Values between two knots, the first of them among those.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LabelPiece {
    /// Value at its first entry, data units.
    pub(crate) from: f64,
    /// Distance from there to the next knot.
    pub(crate) width: f64,
    /// Its first entry, and the intervals between its entries.
    pub(crate) first: f64,
    pub(crate) intervals: f64,
}

/// How stored values become positions in the table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LabelFrame {
    /// Data value = slope times stored value + intercept.
    pub(crate) rescale: (f64, f64),
    /// From those below the first knot to those from the last one on.
    pub(crate) pieces: Vec<LabelPiece>,
}

impl LabelFrame {
    /// The position of a stored value; NaN where that is NaN or infinite.
    pub(crate) fn position_of_stored(&self, stored: f64) -> f32 {
        let (slope, intercept) = self.rescale;
        self.position(slope * stored + intercept)
    }

    /// The position of a value in the data's units; NaN where that is NaN or infinite.
    pub(crate) fn position(&self, value: f64) -> f32 {
        if !value.is_finite() {
            return f32::NAN;
        }
        let behind = &self.pieces[1..];
        let piece = &self.pieces[behind.partition_point(|piece| piece.from <= value)];
        if piece.intervals == 0.0 {
            return piece.first as f32;
        }
        let share = ((value - piece.from) / piece.width).min(1.0);
        // Rounding must not reach the next piece's entries.
        ((piece.first + share * piece.intervals) as f32).min((piece.first + piece.intervals) as f32)
    }
}

/// The nearest voxel's position in the table as the value, and the number that stands for it elsewhere beside it.
pub(crate) struct FetchLabels<const FAR: bool>;

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for FetchLabels<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(labels) = &frame.sample.labels else { return };
        let lanes = spread(batch.rows);
        let step = nearest_steps(frame, batch, lanes);
        let numbers = batch.numbers.get_or_insert_with(|| Box::new([0.0; BATCH]));
        with_slices!(frame.sample.voxels, voxels => {
            for i in (0..BATCH).filter(|i| lanes >> i & 1 == 1) {
                let offset = if FAR { batch.rare.far_offset[i] as usize } else { batch.sample.offset[i] as usize };
                let voxel = voxels[batch.geometry.cells.base + offset + step[i]];
                batch.sample.value[i] = labels.position_of_stored(voxel.to_f64());
                numbers[i] = convert(voxel, frame.sample.to_f32);
            }
        });
    }
}
