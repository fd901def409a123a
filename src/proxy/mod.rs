//! Proxy geometry: the stack of slice planes, and their polygons inside the box.

mod domain;
mod order;
mod polygon;
mod rays;
mod stack;

pub use domain::Domain;
pub use order::order;
pub use polygon::{Edge, SlicePolygon, Vertex};
pub(crate) use rays::{RaySlabs, RaySteps, is_in_shells, shell_range};
pub use stack::{HalfSpace, Stack};
