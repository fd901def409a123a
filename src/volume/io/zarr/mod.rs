//! Zarr of versions 2 and 3, and OME-Zarr: a folder of groups and arrays, the numbers of an array in chunks, one file each.
//!
//! Sources of the format: <https://zarr-specs.readthedocs.io> (both versions) and <https://ngff.openmicroscopy.org> (OME-Zarr 0.1 to 0.5);
//! the files here name the sections that they follow. Of an array of time, channels and space one frame and one channel are read, and only
//! the chunks that have a part in them.
//!
//! - `tree`: the folder, or the zip file of one;
//! - `node`, `v2`, `v3`, `array`, `types`, `json`: what the metadata say;
//! - `multiscale`, `axes`, `choice`: which array of which level is the volume, and where its voxels are;
//! - `chunks`, `shard`, `fetch`: which files hold its numbers, and these in their place;
//! - `levels`: the levels of an image, chunk by chunk; `write`: an image of several levels;
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
mod levels;
mod multiscale;
mod node;
mod shard;
mod tree;
mod types;
mod v2;
mod v3;
mod write;
mod zstd;

use super::Endian;
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading};
use super::store::Store;
use crate::Result;
use crate::volume::Volume;
use image::Image;
pub(super) use levels::levels;
use node::Node;
use tree::Tree;
pub use write::write_pyramid;

/// Where the name of the first file stands in a zip file; its length is four bytes before.
const ZIP_NAME: usize = 30;

pub(super) const READER: Reader = Reader {
    name: "Zarr",
    extensions: &["zarr", "zip", "ozx"],
    reads: "folders and zip files of versions 2 and 3, OME-Zarr 0.1 to 0.5; a level, frame, channel; gzip, zlib, bz2, LZ4, Zstandard, Blosc; shards",
    parts: &[Part::Array, Part::Level, Part::Frame, Part::Channel],
    probe,
    read,
    list: Some(list),
};

/// A folder with metadata in it, a zip file of such a folder, or the metadata file itself.
fn probe(clues: &Clues) -> Certainty {
    let name = clues.path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let is_metadata = |name: &str| node::FILES.contains(&tree::last(name));
    let found = if clues.entries.is_some() {
        node::FILES.iter().any(|file| clues.has_entry(file))
    } else if clues.has(0, b"PK\x03\x04") && clues.head.len() >= ZIP_NAME {
        let length = usize::from(Endian::Little.u16(&clues.head[ZIP_NAME - 4..]));
        let first = clues.head.get(ZIP_NAME..ZIP_NAME + length).map(String::from_utf8_lossy);
        let told = first.is_some_and(|name| is_metadata(&name)) || name.ends_with(".zarr.zip") || name.ends_with(".ozx");
        // Most programs put folders in front of what is in them.
        told || !clues.once && !name.ends_with(".npz") && tree::is_zip_of(clues.path, clues.limits, is_metadata)
    } else {
        is_metadata(&name) && clues.head.trim_ascii_start().starts_with(b"{")
    };
    if found { Certainty::Magic } else { Certainty::No }
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let tree = Tree::open(store)?;
    Image::open(&tree, choice::node(&tree, reading.choice.array.as_deref())?, reading)?.read(&tree, reading)
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let tree = Tree::open(store)?;
    let chosen = choice::node(&tree, reading.choice.array.as_deref())?;
    let mut items = Vec::new();
    if let Some(root) = Node::open(&tree, "")?.filter(|root| root.array.is_none()) {
        let candidates = choice::candidates(&tree, &root)?;
        if candidates.len() > 1 {
            items.extend(candidates.iter().map(|c| Item::new(Part::Array, c.name(), c.about.clone(), c.way == chosen.node.way)));
        }
    }
    items.extend(Image::open(&tree, chosen, reading)?.items());
    Ok(items)
}
