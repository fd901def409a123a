//! Finished pictures and their files. Nothing else in the crate knows how PNG or any other picture file looks.
//!
//! ```text
//!  Picture --encode--> bytes --save--> file      format.rs says of each format its names, its first bytes, what it can hold
//!     ^                  |               |
//!     '-----decode-------'<-----open-----'
//! ```

#[cfg(feature = "encoders")]
mod animated;
#[cfg(feature = "encoders")]
mod decode;
#[cfg(feature = "encoders")]
mod encode;
#[cfg(feature = "encoders")]
mod exr;
#[cfg(feature = "encoders")]
mod file;
#[cfg(feature = "encoders")]
mod format;
#[cfg(feature = "encoders")]
mod metadata;
#[cfg(feature = "encoders")]
mod npy;
mod pixels;
mod plane;
#[cfg(feature = "encoders")]
pub(crate) mod png;
#[cfg(all(test, feature = "encoders"))]
mod tests;
#[cfg(feature = "encoders")]
mod tiff;

#[cfg(feature = "encoders")]
pub use animated::{Animated, AnimatedFormat, MAX_FRAMES};
#[cfg(feature = "scene-file")]
pub(crate) use decode::picture_bytes;
#[cfg(feature = "encoders")]
#[cfg(feature = "encoders")]
pub use format::{Depth, Format};
#[cfg(feature = "encoders")]
pub use metadata::Metadata;
pub use pixels::{MAX_SIDE, Picture};
#[cfg(feature = "encoders")]
pub use plane::PlaneFormat;
pub use plane::{Aov, Plane};
