//! Any bytes as a picture file: decoded, or refused in one line.

use super::check_line;
use slicestack::Picture;
use std::path::Path;

pub fn run(bytes: &[u8]) {
    // The size of a picture is what its header says: those of many pixels take long, and nothing else.
    match Picture::decode(bytes, Path::new("input")) {
        Ok(picture) => assert_eq!(picture.pixels().len(), picture.width() as usize * picture.height() as usize),
        Err(error) => check_line(&error),
    }
}
