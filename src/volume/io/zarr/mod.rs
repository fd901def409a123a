//! Zarr of versions 2 and 3, and OME-Zarr: a folder of groups and arrays, the numbers of an array in chunks, one file each.
//!
//! Sources of the format: <https://zarr-specs.readthedocs.io> (both versions) and <https://ngff.openmicroscopy.org> (OME-Zarr 0.1 to 0.5);
//! the files here name the sections that they follow. Of an array of time, channels and space one frame and one channel are read, and only
//! the chunks that have a part in them.
//!
//! - `node`, `v2`, `v3`, `array`, `types`, `json`: what the metadata say;
//! - `multiscale`, `axes`, `choice`: which array of which level is the volume, and where its voxels are;
//! - `chunks`, `shard`, `fetch`: which files hold its numbers, and these in their place;
//! - `codecs`, `blosc`, `blosclz`, `zstd`: how chunks are compressed.

mod array;
mod axes;
mod blosc;
mod blosclz;
mod choice;
mod chunks;
mod codecs;
mod fetch;
mod image;
mod json;
mod multiscale;
mod node;
mod shard;
mod types;
mod v2;
mod v3;
mod zstd;

use super::folder::Folder;
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading};
use super::store::Store;
use crate::Result;
use crate::volume::Volume;
use image::Image;
use node::Node;
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "Zarr",
    extensions: &["zarr"],
    reads: "folders of versions 2 and 3, OME-Zarr 0.1 to 0.5; a level, frame, channel; gzip, zlib, bz2, LZ4, Zstandard, Blosc; shards",
    parts: &[Part::Array, Part::Level, Part::Frame, Part::Channel],
    probe,
    read,
    list: Some(list),
};

/// A folder with metadata in it, or the metadata file itself.
fn probe(clues: &Clues) -> Certainty {
    let name = clues.path.file_name().unwrap_or_default();
    let found = match clues.entries {
        Some(_) => node::FILES.iter().any(|file| clues.has_entry(file)),
        None => node::FILES.iter().any(|file| *file == name) && clues.head.trim_ascii_start().starts_with(b"{"),
    };
    if found { Certainty::Magic } else { Certainty::No }
}

/// The folder that was given, or the one of the metadata file that was.
fn folder(store: Store) -> Result<Folder> {
    match store {
        Store::Folder(folder) => Ok(folder),
        Store::File(source) => {
            let parent = source.path().parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Folder::open(parent, source.limits())
        }
    }
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let folder = folder(store)?;
    Image::open(&folder, choice::node(&folder, reading.choice.array.as_deref())?, reading)?.read(&folder, reading)
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let folder = folder(store)?;
    let chosen = choice::node(&folder, reading.choice.array.as_deref())?;
    let mut items = Vec::new();
    if let Some(root) = Node::open(&folder, "")?.filter(|root| root.array.is_none()) {
        let candidates = choice::candidates(&folder, &root)?;
        if candidates.len() > 1 {
            items.extend(candidates.iter().map(|c| Item::new(Part::Array, c.name(), c.about.clone(), c.way == chosen.node.way)));
        }
    }
    items.extend(Image::open(&folder, chosen, reading)?.items());
    Ok(items)
}
