//! Any bytes as a transfer function of another program: read, or refused in one line; what is read can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use slicestack::transfer_io::{FileKind, parse, write};
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let Some((&kind, bytes)) = data.split_first() else { return };
    let kind = FileKind::ALL[usize::from(kind) % FileKind::ALL.len()];
    let name = format!("input.{}", kind.extension());
    match parse(bytes, Path::new(&name), kind, None) {
        Ok(contents) => {
            let (text, _) = write(&contents.property, kind);
            parse(text.as_bytes(), Path::new(&name), kind, None).expect("what is written can be read");
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "{text:?}");
        }
    }
});
