//! One array as its metadata describes it, the same for both versions of the format.

use super::codecs::Codec;
use super::json::Json;
use super::types::Fill;
use crate::Result;
use crate::volume::io::{Endian, Stored};
use std::path::PathBuf;

/// Most dimensions of an array: NumPy's limit too.
const MOST_DIMENSIONS: usize = 32;

/// An array: its numbers lie in chunks, boxes of equal shape, one file each.
#[derive(Debug, Clone)]
pub(super) struct Array {
    /// Its metadata file, for messages.
    pub(super) path: PathBuf,
    /// Its folder in the folder that was given; empty where it is that one.
    pub(super) way: String,
    /// Numbers along each dimension.
    pub(super) shape: Vec<usize>,
    /// Names of the dimensions, where they have any.
    pub(super) names: Vec<Option<String>>,
    pub(super) stored: Stored,
    pub(super) endian: Endian,
    pub(super) fill: Fill,
    /// Numbers along each dimension of what lies in one file.
    pub(super) file_shape: Vec<usize>,
    /// Numbers along each dimension of what is compressed as one piece: less than the file's where that is a shard.
    pub(super) chunk_shape: Vec<usize>,
    /// How the files are named.
    pub(super) keys: Keys,
    /// The dimensions of the array in the order in which a chunk has them, the last one fastest.
    pub(super) order: Vec<usize>,
    /// What was done to the bytes of a chunk, the first first.
    pub(super) codecs: Vec<Codec>,
    /// Where the chunks of a file are noted, if a file holds several.
    pub(super) shard: Option<ShardIndex>,
}

/// How the file of a chunk is named by its place in the grid of chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Keys {
    /// Whether the name starts with `c` and a separator.
    pub(super) prefix: bool,
    /// Whether numbers are names of folders in each other; else they stand in one name with points between.
    pub(super) nested: bool,
}

/// The list of the chunks in a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ShardIndex {
    /// Whether it ends the file; else it starts it.
    pub(super) at_end: bool,
    pub(super) endian: Endian,
    /// Whether a checksum follows it.
    pub(super) checked: bool,
}

impl Array {
    /// The bytes of one chunk when nothing is compressed.
    pub(super) fn chunk_bytes(&self) -> u128 {
        // As many factors as there are dimensions: saturate, any limit is far below.
        self.chunk_shape.iter().fold(self.stored.bytes() as u128, |a, &n| a.saturating_mul(n as u128))
    }

    /// Chunks of a shard along each dimension.
    pub(super) fn chunks_of_file(&self) -> Vec<usize> {
        self.file_shape.iter().zip(&self.chunk_shape).map(|(file, chunk)| file / chunk).collect()
    }

    /// Steps from one number to the next along each dimension within a chunk.
    pub(super) fn strides(&self) -> Vec<usize> {
        let mut strides = vec![0; self.order.len()];
        let mut step = 1usize;
        for &axis in self.order.iter().rev() {
            strides[axis] = step;
            step = step.saturating_mul(self.chunk_shape[axis]);
        }
        strides
    }
}

/// The shape of an array.
pub(super) fn shape(json: &Json) -> Result<Vec<usize>> {
    let shape = json.sizes()?;
    match shape.len() {
        1..=MOST_DIMENSIONS => Ok(shape),
        n => Err(json.fault(format!("{n} dimensions: there must be 1 to {MOST_DIMENSIONS}"))),
    }
}

/// The shape of a chunk of an array of as many dimensions as `shape` has.
pub(super) fn chunk_shape(json: &Json, shape: &[usize]) -> Result<Vec<usize>> {
    let sizes = json.sizes()?;
    if sizes.len() != shape.len() {
        return Err(json.fault(format!("{} numbers for an array of {} dimensions", sizes.len(), shape.len())));
    }
    Ok(sizes)
}
