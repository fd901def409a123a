//! Bytes from files.

use super::format::{readable, recognized};
use crate::{Error, Result, files};
use std::io::{Error as Fault, ErrorKind, Read};
use std::path::Path;

/// The bytes of the picture file `path`. A file that is no picture by its first bytes is not read any further.
///
/// # Errors
/// [`Error::Io`], [`Error::Format`] when the file is no picture, [`Error::Limit`] when it has more than `limit` bytes.
pub(super) fn read_picture(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let io = |e| Error::io(path, e);
    let file = files::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    (&file).take(16).read_to_end(&mut bytes).map_err(io)?;
    if recognized(&bytes).is_none() {
        return Err(unknown(path, &bytes));
    }
    let over = |needed: u64| Error::Limit {
        what: format!("{}: bytes of a picture file", path.display()),
        needed: needed.into(),
        limit: limit.into(),
    };
    let claimed = file.metadata().map_err(io)?.len();
    if claimed > limit {
        return Err(over(claimed));
    }
    // A pipe tells no length: the limit holds while it is read, too.
    crate::memory::reserve(&mut bytes, usize::try_from(claimed).unwrap_or(usize::MAX)).map_err(|_| no_memory(path, claimed))?;
    let rest = limit - bytes.len() as u64;
    let read = file.take(rest.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    if read as u64 > rest {
        return Err(over(bytes.len() as u64));
    }
    Ok(bytes)
}

/// The error for a file whose first bytes, given in `start`, are those of no picture.
pub(super) fn unknown(path: &Path, start: &[u8]) -> Error {
    let what = match start {
        [] => "is empty".to_owned(),
        _ => format!("is no picture: it starts with \"{}\"", start[..start.len().min(8)].escape_ascii()),
    };
    Error::format(path, format!("{what}; {} are read", readable()))
}

/// The error for `bytes` of memory that the system does not give.
pub(super) fn no_memory(path: &Path, bytes: u64) -> Error {
    Error::io(path, Fault::new(ErrorKind::OutOfMemory, format!("no memory for {bytes} bytes")))
}
