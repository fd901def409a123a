//! Finished pictures and their files.

mod picture;

pub use picture::Picture;
