//! The truth in f64: what a picture would be without slices, and how far a picture is from it.
//!
//! ```text
//!   eye ---near-----|=====|===|==|=======|====|---->   one ray
//!                 entry  cuts: cell faces,    exit
//!                        knots of the transfer function, fog's start and end
//! ```
//!
//! Between two cuts the interpolated value is a cubic polynomial and the transfer function a straight line, so the
//! emission-absorption integral is smooth there and is computed to a bound. Nothing in this room uses the slicing pipeline:
//! only scenes and volumes.

pub mod closed;
mod field;
mod image;
mod integrate;
pub mod metrics;
mod panel;
mod segments;
mod surfaces;

pub use image::{ReferenceImage, Region, image};
pub use integrate::{Integrator, RayResult};
pub use surfaces::{Crossing, SurfaceTracer};
