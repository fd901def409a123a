//! Any bytes as a transfer function of another program: read, or refused in one line.

use super::check_line;
use slicestack::transfer_io::{FileKind, parse};
use std::path::Path;

pub fn run(data: &[u8]) {
    let Some((&kind, bytes)) = data.split_first() else { return };
    // The first byte chooses among them.
    let kind = FileKind::ALL[usize::from(kind) % FileKind::ALL.len()];
    if let Err(error) = parse(bytes, Path::new("input"), kind, None) {
        check_line(&error);
    }
}
