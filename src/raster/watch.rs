//! Looking on while batches go through the stages: to record what each stage did, or to time it.
//!
//! The march over slices is compiled once for each kind of onlooker; for `()`, which sees nothing, the calls vanish.

use crate::fragment::{Batch, Frame};

/// Someone who looks on. Each worker thread has one; they are merged at the end.
pub(crate) trait Watch: Default + Send {
    /// A block begins: its first pixel is (x,y), `batch.pixels` holds its rays and nothing gathered yet.
    fn block(&mut self, x: u32, y: u32, batch: &Batch) {
        let _ = (x, y, batch);
    }

    /// A slice begins: `batch.slice`, `batch.depth` and `batch.fog` are set, no stage has run.
    fn slice(&mut self, frame: &Frame<'_>, batch: &Batch) {
        let _ = (frame, batch);
    }

    /// The stage called `name` has run.
    fn stage(&mut self, name: &'static str, frame: &Frame<'_>, batch: &Batch) {
        let _ = (name, frame, batch);
    }

    /// Slices `from..to` of the block are passed over: nothing in them shows, or (`finished`) every pixel is done.
    fn skipped(&mut self, from: i64, to: i64, finished: bool) {
        let _ = (from, to, finished);
    }

    /// Takes in what another thread's onlooker saw.
    fn merge(&mut self, other: Self);
}

/// Nobody looks on.
impl Watch for () {
    fn merge(&mut self, (): Self) {}
}
