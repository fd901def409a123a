//! Finished pictures and their files.

#[cfg(feature = "encoders")]
mod encode;
mod picture;

#[cfg(feature = "encoders")]
pub use encode::{Depth, Format, write_whole};
pub use picture::Picture;
