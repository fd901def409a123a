//! Rasterization: screen tiles in parallel, blocks of 8 x 8 pixels inside them, slice after slice inside a block.
//!
//! ```text
//!  picture -> tiles (one task each) -> blocks on the picture's own 8 x 8 grid -> slices, nearest or farthest first
//! ```
//! Blocks do not depend on tiles: a tile of odd size renders its part of a block. So tiles, like threads, cannot change a pixel.

mod beam;
mod block;
mod contents;
mod counters;
mod merge;
mod pairs;
mod placing;
mod resolve;
mod tiles;
mod watch;

pub(crate) use beam::{Outer, Spans};
pub(crate) use block::Work;
pub(crate) use contents::{Contents, LookAt, Runs, Sight};
pub(crate) use counters::Counters;
pub(crate) use merge::{Merging, THICK};
pub(crate) use pairs::PairWork;
pub(crate) use resolve::Resolve;
pub(crate) use tiles::{BlockMask, render_tiles};
pub(crate) use watch::Watch;
