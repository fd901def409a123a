//! Proxy geometry: the stack of slice planes, and their polygons inside the box.

mod domain;
mod polygon;
mod stack;

pub use domain::Domain;
pub use polygon::{Edge, SlicePolygon, Vertex};
pub use stack::{HalfSpace, Stack};
