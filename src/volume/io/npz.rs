//! NumPy archives, `.npz`: a zip file of `.npy` arrays. The first array of three dimensions is read.
//!
//! Source of the format: <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>; `zip.rs` says what of zip files is read.

use super::npy;
use super::reader::{Certainty, Reader};
use super::reading::Reading;
use super::store::Store;
use super::zip::{Archive, Entry};
use crate::volume::Volume;
use crate::{Error, Result};

pub(super) const READER: Reader = Reader {
    name: "NumPy archive",
    extensions: &["npz"],
    reads: "its first array of three dimensions, stored or deflated",
    parts: &[],
    probe: |clues| if clues.has(0, b"PK\x03\x04") || clues.has(0, b"PK\x05\x06") { Certainty::Magic } else { Certainty::No },
    read,
    list: None,
};

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    // A zip file is read from its end.
    let archive = Archive(store.places("a zip archive")?);
    let path = archive.0.path();
    let entries = archive.entries()?;
    let arrays: Vec<&Entry> = entries.iter().filter(|e| e.name.ends_with(".npy")).collect();
    if arrays.is_empty() {
        let first = entries.first().map_or(String::new(), |e| format!(", only {:?}", e.name));
        return Err(archive.0.fault(format!("the zip archive holds {} files and no .npy array{first}", entries.len())));
    }
    let mut seen = Vec::new();
    for entry in &arrays {
        let mut source = archive.open(entry)?;
        let stem = entry.name.trim_end_matches(".npy");
        // An array of text or records does not stand in the way of the volume behind it.
        let header = match npy::Header::read(&mut source) {
            Err(Error::Format { what, .. }) => {
                seen.push(format!("{stem} ({what})"));
                continue;
            }
            header => header?,
        };
        if header.shape.len() < 3 || header.layout(path).is_none() {
            seen.push(format!("{stem} {:?}", header.shape));
            continue;
        }
        let claimed = header.length.saturating_add(header.data_bytes());
        if claimed != entry.unpacked {
            return Err(archive
                .0
                .fault(format!("{:?} takes {claimed} bytes by its header, {} by the zip directory", entry.name, entry.unpacked)));
        }
        let volume = header.volume(&mut source, reading)?;
        // One array needs no name; among several, say which it is.
        let name = if arrays.len() == 1 { path.display().to_string() } else { format!("{}:{stem}", path.display()) };
        return Ok(volume.with_name(name));
    }
    let more = if seen.len() > 4 { format!(", and {} more", seen.len() - 4) } else { String::new() };
    seen.truncate(4);
    Err(archive.0.fault(format!("no array of three dimensions (z, y, x) among: {}{more}", seen.join(", "))))
}
