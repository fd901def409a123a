//! Finished pictures and their files.

#[cfg(feature = "encoders")]
mod encode;
mod pixels;

#[cfg(feature = "encoders")]
pub use encode::{Depth, Format, write_whole};
pub use pixels::Picture;
