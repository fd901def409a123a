//! Proxy geometry: the stack of slice planes, and their polygons inside the box.

mod polygon;
mod stack;

pub use polygon::{Edge, SlicePolygon, Vertex};
pub use stack::{HalfSpace, Stack};
