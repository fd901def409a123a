//! The truth in f64: what a picture would be without slices, and how far a picture is from it.
//!
//! ```text
//!   eye ---near-----|=====|===|==|=======|====|---->   one ray
//!                 entry  cuts: cell faces,    exit
//!                        knots of the transfer function, fog's start and end
//! ```
//!
//! Between two cuts the interpolated value is a polynomial (cubic where it is trilinear) and the transfer function a straight line, so the
//! emission-absorption integral is smooth there and is computed to a bound. Light and the factor of the gradient opacity have more kinks, which
//! are cut at or found by halving. Where an estimate of the error is not enough, [`Prover`] encloses pixels: intervals, rounded outwards, that the
//! truth lies in. Nothing in this room uses the slicing pipeline: only scenes and volumes.

pub mod closed;
mod colors;
mod cuts;
mod enclosure;
mod field;
mod gradient;
mod image;
mod integrate;
mod light;
pub mod metrics;
mod panel;
mod places;
mod regions;
mod roots;
mod segments;
mod spline;
mod surfaces;

pub use enclosure::{Enclosure, Prover};
pub use image::{ReferenceImage, Region, image};
pub use integrate::{Integrator, RayResult};
pub use surfaces::{Crossing, SurfaceTracer};
