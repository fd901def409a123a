//! Any bytes as a picture file: decoded, or refused in one line.
#![no_main]

use libfuzzer_sys::fuzz_target;
use slicestack::Picture;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    match Picture::decode(bytes, Path::new("input")) {
        Ok(picture) => assert_eq!(picture.pixels().len(), picture.width() as usize * picture.height() as usize),
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "{text:?}");
        }
    }
});
