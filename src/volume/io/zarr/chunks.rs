//! Which chunks a volume needs, and which of them are there.
//!
//! Chunks that are all fill value need not be stored. So nothing is looked for by its name: folders are listed, and what is not there costs
//! nothing, however many chunks the metadata claim.

use super::array::Array;
use super::axes::{Axes, Role};
use super::node::join;
use super::shard;
use super::tree::Tree;
use crate::Result;
use rayon::prelude::*;
use std::ops::Range;

/// One volume of an array of perhaps more dimensions.
pub(super) struct Wanted<'a> {
    pub(super) array: &'a Array,
    /// The dimensions of the array that are x, y and z.
    pub(super) space: [Option<usize>; 3],
    /// The place along each other dimension; 0 along those of space.
    pub(super) at: Vec<usize>,
}

/// One stored chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Its place among the chunks along x, y and z.
    pub(super) place: [usize; 3],
    /// Which of the files it is in.
    pub(super) file: usize,
    /// First byte and number of bytes in a shard; else it is all of the file.
    pub(super) within: Option<(u64, u64)>,
}

/// A file that may be there, and its place among the files along each dimension.
pub(super) struct ChunkFile {
    pub(super) way: String,
    pub(super) index: Vec<usize>,
}

impl<'a> Wanted<'a> {
    /// The volume at `frame` and `channel` of `array`.
    pub(super) fn new(array: &'a Array, axes: &Axes, frame: usize, channel: usize) -> Self {
        let at = |role: &Role| match role {
            Role::Time => frame,
            Role::Channel => channel,
            Role::Space(_) | Role::Single => 0,
        };
        Self { array, space: [0, 1, 2].map(|axis| axes.find(Role::Space(axis))), at: axes.roles.iter().map(at).collect() }
    }

    /// What `sizes` are along x, y and z: 1 where the array has no such dimension.
    pub(super) fn along(&self, sizes: &[usize]) -> [usize; 3] {
        self.space.map(|dimension| dimension.map_or(1, |d| sizes[d]))
    }

    /// Chunks along x, y and z.
    pub(super) fn grid(&self) -> [usize; 3] {
        let (dims, chunk) = (self.along(&self.array.shape), self.along(&self.array.chunk_shape));
        [0, 1, 2].map(|axis| dims[axis].div_ceil(chunk[axis]))
    }

    /// The places along each dimension that are needed, in boxes of `shape`.
    fn ranges(&self, shape: &[usize]) -> Vec<Range<usize>> {
        let range = |dimension: usize| {
            if self.space.contains(&Some(dimension)) {
                0..self.array.shape[dimension].div_ceil(shape[dimension])
            } else {
                let at = self.at[dimension] / shape[dimension];
                at..at + 1
            }
        };
        (0..shape.len()).map(range).collect()
    }

    /// The places along each dimension of the chunk at `place` along x, y and z.
    pub(super) fn only(&self, place: [usize; 3]) -> Vec<Range<usize>> {
        let mut ranges = self.ranges(&self.array.chunk_shape);
        for (axis, dimension) in self.space.iter().enumerate() {
            if let Some(d) = *dimension {
                ranges[d] = place[axis]..place[axis] + 1;
            }
        }
        ranges
    }

    /// The file that the chunk at `place` along x, y and z is in, if that is stored.
    pub(super) fn file_of(&self, place: [usize; 3]) -> ChunkFile {
        let array = self.array;
        let each = array.chunks_of_file();
        let index: Vec<usize> = self.only(place).iter().zip(&each).map(|(range, each)| range.start / each).collect();
        let numbers: Vec<String> = index.iter().map(usize::to_string).collect();
        let between = if array.keys.nested { "/" } else { "." };
        let prefix = if array.keys.prefix { format!("c{between}") } else { String::new() };
        ChunkFile { way: join(&array.way, &format!("{prefix}{}", numbers.join(between))), index }
    }

    /// The needed chunks that are there, sorted by z, y and x, and the files they are in.
    ///
    /// # Errors
    /// When a folder cannot be listed, or a shard is damaged.
    pub(super) fn chunks(&self, tree: &Tree) -> Result<(Vec<Chunk>, Vec<ChunkFile>)> {
        let array = self.array;
        let mut files = Vec::new();
        let ranges = self.ranges(&array.file_shape);
        if array.keys.nested {
            let start = if array.keys.prefix { join(&array.way, "c") } else { array.way.clone() };
            nested(tree, &start, &ranges, &mut Vec::new(), &mut files)?;
        } else {
            flat(tree, array, &ranges, &mut files)?;
        }
        let mut chunks = match array.shard {
            None => {
                let chunk = |(file, of): (usize, &ChunkFile)| Chunk { place: self.along_or_0(&of.index), file, within: None };
                files.iter().enumerate().map(chunk).collect()
            }
            Some(index) => {
                let inner = self.ranges(&array.chunk_shape);
                let found: Vec<Result<Vec<Chunk>>> = files
                    .par_iter()
                    .enumerate()
                    .map(|(number, file)| {
                        let entries = shard::entries(tree, array, index, file, &inner)?;
                        let chunk = |(place, within): (Vec<usize>, _)| {
                            let place = self.along_or_0(&place);
                            Chunk { place, file: number, within: Some(within) }
                        };
                        Ok(entries.into_iter().map(chunk).collect())
                    })
                    .collect();
                // The first fault in the order of the files, whichever thread was first.
                let mut chunks = Vec::new();
                for found in found {
                    chunks.extend(found?);
                }
                chunks
            }
        };
        chunks.sort_unstable_by_key(|chunk: &Chunk| (chunk.place[2], chunk.place[1], chunk.place[0]));
        Ok((chunks, files))
    }

    fn along_or_0(&self, index: &[usize]) -> [usize; 3] {
        self.space.map(|dimension| dimension.map_or(0, |d| index[d]))
    }
}

/// The number that a name is, written as the format writes it.
fn number(name: &str, range: &Range<usize>) -> Option<usize> {
    name.parse().ok().filter(|n: &usize| range.contains(n) && n.to_string() == name)
}

/// Finds files whose numbers are names of folders in each other.
fn nested(tree: &Tree, way: &str, ranges: &[Range<usize>], index: &mut Vec<usize>, files: &mut Vec<ChunkFile>) -> Result<()> {
    let Some(range) = ranges.get(index.len()) else {
        files.push(ChunkFile { way: way.to_owned(), index: index.clone() });
        return Ok(());
    };
    let last = index.len() + 1 == ranges.len();
    let mut found = Vec::new();
    if range.len() == 1 {
        found.push(range.start);
    } else {
        tree.entries(way, |name, is_folder| {
            found.extend(number(&name, range).filter(|_| is_folder != last));
            Ok(())
        })?;
        found.sort_unstable();
    }
    for number in found {
        index.push(number);
        nested(tree, &join(way, &number.to_string()), ranges, index, files)?;
        index.pop();
    }
    Ok(())
}

/// Finds files whose numbers stand in one name with points between.
fn flat(tree: &Tree, array: &Array, ranges: &[Range<usize>], files: &mut Vec<ChunkFile>) -> Result<()> {
    tree.entries(&array.way, |name, is_folder| {
        let numbers = if array.keys.prefix { name.strip_prefix("c.") } else { Some(name.as_str()) };
        let (Some(numbers), false) = (numbers, is_folder) else { return Ok(()) };
        let mut parts = numbers.split('.');
        let index: Option<Vec<usize>> = ranges.iter().map(|range| number(parts.next()?, range)).collect();
        if let (Some(index), None) = (index, parts.next()) {
            files.push(ChunkFile { way: join(&array.way, &name), index });
        }
        Ok(())
    })?;
    files.sort_unstable_by(|a, b| a.index.cmp(&b.index));
    Ok(())
}
