//! NumPy archives, `.npz`: a zip file of `.npy` arrays. One of them is read: the one that is chosen by its name, else the first of three dimensions.
//!
//! Source of the format: <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>; `zip.rs` says what of zip files is read.

use super::npy;
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading, no_array};
use super::store::Store;
use super::zip::{Archive, Entry};
use crate::volume::Volume;
use crate::{Error, Result};

pub(super) const READER: Reader = Reader {
    name: "NumPy archive",
    extensions: &["npz"],
    reads: "an array by its name, else the first of three dimensions; stored or deflated",
    parts: &[Part::Array, Part::Frame, Part::Channel],
    probe: |clues| if clues.has(0, b"PK\x03\x04") || clues.has(0, b"PK\x05\x06") { Certainty::Magic } else { Certainty::No },
    read,
    list: Some(list),
};

/// Most arrays of one archive.
const MOST_ARRAYS: usize = 4096;

/// An array of the archive.
struct Found<'a> {
    entry: &'a Entry,
    /// Its name, without `.npy`.
    name: &'a str,
    header: npy::Header,
    /// What it is, in a few words; of one that is no volume, why.
    about: String,
    volume: bool,
}

/// What is behind the name of so many things.
fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// The arrays of `entries`. One of text or records does not stand in the way of the volume behind it.
fn found<'a>(archive: &Archive, entries: &'a [Entry]) -> Result<(Vec<Found<'a>>, Vec<String>)> {
    let arrays: Vec<&Entry> = entries.iter().filter(|e| e.name.ends_with(".npy")).collect();
    if arrays.is_empty() {
        let files: Vec<&Entry> = entries.iter().filter(|e| !e.name.ends_with('/')).collect();
        // What is packed in a way that is not read cannot be looked into.
        files.first().map(|first| archive.open(first)).transpose()?;
        // By its name an archive of arrays, or any.
        let named = archive.0.path().extension().is_some_and(|e| e.eq_ignore_ascii_case("npz"));
        let what = match files[..] {
            [] if named => "the zip archive holds 0 files and no .npy array".to_owned(),
            [first, ..] if named => {
                format!("the zip archive holds {} file{} and no .npy array, such as {:?}", files.len(), plural(files.len()), first.name)
            }
            [] => "the zip archive is empty".to_owned(),
            [one] => {
                format!("the zip archive holds one file, {:?}, of no format that is read from archives (DICOM, NumPy, Zarr)", one.name)
            }
            [first, ..] => format!(
                "the zip archive holds {} files, none of a format that is read from archives (DICOM, NumPy, Zarr), such as {:?}",
                files.len(),
                first.name
            ),
        };
        return Err(archive.0.fault(what));
    }
    if arrays.len() > MOST_ARRAYS {
        return Err(archive.0.fault(format!("{} arrays: at most {MOST_ARRAYS} are looked into", arrays.len())));
    }
    let (mut found, mut others) = (Vec::new(), Vec::new());
    for entry in arrays {
        let name = entry.name.trim_end_matches(".npy");
        match npy::Header::read(&mut archive.open(entry)?) {
            Err(Error::Format { what, .. }) => others.push(format!("{name} ({what})")),
            Err(e) => return Err(e),
            Ok(header) => {
                let volume = header.shape.len() >= 3 && header.layout(archive.0.path(), &Reading::new()).is_some();
                if !volume {
                    others.push(format!("{name} {:?}", header.shape));
                }
                let about = format!("{:?} of {}", header.shape, header.stored());
                found.push(Found { entry, name, header, about, volume });
            }
        }
    }
    Ok((found, others))
}

/// Which array is read: the one of that name, else the first that is a volume.
fn choose(archive: &Archive, found: &[Found], mut others: Vec<String>, reading: &Reading) -> Result<usize> {
    if let Some(name) = &reading.choice.array {
        return found.iter().position(|f| f.name == name).ok_or_else(|| archive.0.fault(no_array(name, found.iter().map(|f| f.name))));
    }
    found.iter().position(|f| f.volume).ok_or_else(|| {
        let more = if others.len() > 4 { format!(", and {} more", others.len() - 4) } else { String::new() };
        others.truncate(4);
        archive.0.fault(format!("no array of three dimensions (z, y, x) among: {}{more}", others.join(", ")))
    })
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let archive = Archive(store.places("a zip archive")?);
    let entries = archive.entries()?;
    let (found, others) = found(&archive, &entries)?;
    let taken = choose(&archive, &found, others, reading)?;
    let mut items = Vec::new();
    if found.len() > 1 {
        items.extend(found.iter().enumerate().map(|(i, f)| Item::new(Part::Array, f.name, f.about.clone(), i == taken)));
    }
    if let Some(layout) = found[taken].header.layout(archive.0.path(), reading) {
        items.extend(layout.list(reading)?);
    }
    Ok(items)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    // A zip file is read from its end.
    let archive = Archive(store.places("a zip archive")?);
    let path = archive.0.path();
    let entries = archive.entries()?;
    let (found, others) = found(&archive, &entries)?;
    let taken = choose(&archive, &found, others, reading)?;
    let Found { entry, name, about, .. } = &found[taken];
    let mut source = archive.open(entry)?;
    let header = npy::Header::read(&mut source)?;
    let claimed = header.length.saturating_add(header.data_bytes());
    if claimed != entry.unpacked {
        return Err(archive
            .0
            .fault(format!("{:?} takes {claimed} bytes by its header, {} by the zip directory", entry.name, entry.unpacked)));
    }
    let mut volume = header.volume(&mut source, reading)?;
    let volumes = found.iter().filter(|f| f.volume).count();
    if volumes > 1 && reading.choice.array.is_none() {
        volume = volume.with_note(format!("array {name:?} of {volumes} is read ({about}; volume.array chooses another)"));
    }
    // One array needs no name; among several, say which it is.
    let alone = entries.iter().filter(|e| e.name.ends_with(".npy")).count() == 1;
    Ok(volume.with_name(if alone { path.display().to_string() } else { format!("{}:{name}", path.display()) }))
}
