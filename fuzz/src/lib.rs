//! What the fuzz targets do with their bytes, a module each. A panic is a fault found. The tests of the crate run them too, over the corpus and
//! mutations of it.

#[path = "../../tests/coverage/mod.rs"]
mod coverage;
#[path = "../../tests/random/mod.rs"]
#[allow(dead_code)]
pub(crate) mod random;
mod scenes;

pub mod blending;
pub mod geometry;
pub mod levels;
pub mod pictures;
pub mod readers;
pub mod scene_files;
pub mod tolerance;
pub mod transfer_files;

/// An error as all are: one line.
fn check_line(error: &slicestack::Error) {
    let text = error.to_string();
    assert!(!text.is_empty() && !text.contains('\n'), "{text:?}");
}
