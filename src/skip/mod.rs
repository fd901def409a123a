//! Skipping of empty space: which bricks show something, and what a block's rays can touch on a run of slices.
//!
//! ```text
//!  bricks (least, greatest value) --classifier--> a class for each brick --windows--> skip table --box query--> classes of runs of slices
//! ```
//! A frame asks of eight runs of slices at once what a block's rays can touch on them. Every brick stands for the greatest class of a
//! window of bricks from it on, and the two windows at the ends of a run's box cover it, as long as it is no more than twice as large.
//!
//! ```text
//!   box of bricks   . . x x x x x . .
//!   two windows         [first  ]
//!                         [second ]
//! ```
//!
//! Projections of the largest or smallest value have classes of their own, by how far bricks reach (`peaks.rs`), in the same windows.
//!
//! Along parallel rays all boxes are of one size or a brick larger. There a window is as large as the smaller of them, so that the second one
//! is the first one's neighbour, and both come in one load.

mod classes;
mod peaks;
mod query;
mod runs;
mod windows;

pub(crate) use classes::BrickClasses;
pub(crate) use peaks::{PeakClasses, PeakTable};
pub(crate) use query::{BOXES, BoxClasses, BoxQuery, QueryBoxes};
pub(crate) use runs::{MERGED, Runs};
pub(crate) use windows::{SHOWN, Sides, SkipTable, Windows};
