//! Rasterization: screen tiles in parallel, blocks of 8 x 8 pixels inside them, slice after slice inside a block.
//!
//! ```text
//!  picture -> tiles (one task each) -> blocks on the picture's own 8 x 8 grid -> slices, nearest or farthest first
//! ```
//! Blocks do not depend on tiles: a tile of odd size renders its part of a block. So tiles, like threads, cannot change a pixel.
//!
//! This room executes a [`crate::plan::FramePlan`] and decides nothing about a scene.

mod aov;
mod block;
mod block_transform;
mod march;
mod observer;
mod owned;
mod ray_intervals;
mod rays;
mod resolve;
mod resume;
mod surface;
mod tiles;
mod work;

pub(crate) use aov::{Looker, Seen, Told};
pub(crate) use observer::Observer;
pub(crate) use owned::Owned;
pub(crate) use ray_intervals::RayIntervals;
pub(crate) use resolve::{Finish, Resolve, Sums};
pub(crate) use resume::{Gathered, covered, resume};
pub(crate) use surface::Surface;
pub(crate) use tiles::{BlockMask, Job, render_tiles};
pub(crate) use work::Work;
