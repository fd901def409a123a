//! Rasterization: screen tiles in parallel, blocks of 8 x 8 pixels inside them, slice after slice inside a block.
//!
//! ```text
//!  picture -> tiles (one task each) -> blocks on the picture's own 8 x 8 grid -> slices, nearest or farthest first
//! ```
//! Blocks do not depend on tiles: a tile of odd size renders its part of a block. So tiles, like threads, cannot change a pixel.

mod block;
mod block_transform;
mod merge;
mod observer;
mod pairs;
mod ray_intervals;
mod resolve;
mod skip;
mod tiles;

pub(crate) use block::Work;
pub(crate) use merge::{Merging, THICK};
pub(crate) use observer::Observer;
pub(crate) use pairs::PairStages;
pub(crate) use ray_intervals::EndPieces;
pub(crate) use resolve::Resolve;
pub(crate) use skip::{BrickClasses, QueryBoxes, Runs, SkipTable};
pub(crate) use tiles::{BlockMask, render_tiles};
