//! Shards: files of many chunks, with a list of where each one lies.
//!
//! Source of the format: "Sharding codec", <https://zarr-specs.readthedocs.io/en/latest/v3/codecs/sharding-indexed/index.html>.

use super::array::{Array, ShardIndex};
use super::axes::shown;
use super::chunks::ChunkFile;
use super::codecs;
use super::tree::Tree;
use crate::Result;
use std::ops::Range;

/// First byte and number of bytes of a chunk.
type Within = (u64, u64);

/// The chunks in `file` that are in all ranges of `needed` and not missing: the place of each among all chunks of the array, and where it
/// lies in the file.
///
/// # Errors
/// When the list is damaged, or a chunk would lie outside the file.
pub(super) fn entries(
    tree: &Tree,
    array: &Array,
    index: ShardIndex,
    file: &ChunkFile,
    needed: &[Range<usize>],
) -> Result<Vec<(Vec<usize>, Within)>> {
    let Some(mut source) = tree.at(&file.way)? else { return Ok(Vec::new()) };
    let counts = array.chunks_of_file();
    let count = counts.iter().fold(1usize, |a, &n| a.saturating_mul(n));
    let (entries, checksum) = (count.saturating_mul(16), if index.checked { 4 } else { 0 });
    let (bytes, length) = (entries.saturating_add(checksum) as u64, source.left());
    if bytes > length {
        return Err(source.fault(format!("a list of {count} chunks takes {bytes} bytes, the shard has {length}")));
    }
    if index.at_end {
        source.skip(length - bytes)?;
    }
    let mut list = vec![0; bytes as usize];
    source.read_exact_into(&mut list, 0, bytes)?;
    if index.checked {
        list = codecs::checked(list).map_err(|e| source.fault(format!("the list of chunks: {e}")))?;
    }
    // The part of the needed places that this file holds.
    let first: Vec<usize> = file.index.iter().zip(&counts).map(|(at, count)| at * count).collect();
    let part = |d: usize| needed[d].start.saturating_sub(first[d])..needed[d].end.saturating_sub(first[d]).min(counts[d]);
    let ranges: Vec<Range<usize>> = (0..counts.len()).map(part).collect();
    let mut found = Vec::new();
    let mut at: Vec<usize> = ranges.iter().map(|r| r.start).collect();
    if ranges.iter().any(Range::is_empty) {
        return Ok(found);
    }
    loop {
        let entry = at.iter().zip(&counts).fold(0, |entry, (at, count)| entry * count + at);
        let [start, size] = [0, 8].map(|word| index.endian.u64(&list[16 * entry + word..]));
        // All ones stand for a chunk that is not stored.
        if (start, size) != (u64::MAX, u64::MAX) {
            if start.checked_add(size).is_none_or(|end| end > length) {
                let what = format!("chunk {} should take {size} bytes from byte {start} on, the shard has {length}", shown(&at));
                return Err(source.fault(what));
            }
            found.push((first.iter().zip(&at).map(|(first, at)| first + at).collect(), (start, size)));
        }
        // The next place, the last dimension fastest.
        let Some(d) = (0..at.len()).rev().find(|&d| at[d] + 1 < ranges[d].end) else { return Ok(found) };
        at[d] += 1;
        (d + 1..at.len()).for_each(|d| at[d] = ranges[d].start);
    }
}
