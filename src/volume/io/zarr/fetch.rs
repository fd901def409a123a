//! Voxels out of chunks: several chunks at a time are read and decoded in parallel, then their rows are copied into place.

use super::array::Array;
use super::axes::shown;
use super::chunks::{Chunk, ChunkFile, Wanted};
use super::codecs;
use super::shard;
use super::tree::Tree;
use crate::volume::io::source::Tail;
use crate::volume::io::stored::TooLarge;
use crate::volume::io::{Endian, Reading, Stored, source};
use crate::volume::{Voxels, with_voxels};
use crate::{Error, Result};
use rayon::prelude::*;

/// Bytes of chunks that are decoded at a time: few, so that they are still in the cache when they are copied into place.
const BATCH: usize = 8 << 20;
/// Chunks for each thread that are decoded at a time: several, so that none waits long for the others.
const EACH: usize = 4;
/// Bytes that are never gone beyond but for a single chunk, besides a quarter of the voxels'.
const MOST_BATCH: usize = 32 << 20;

/// The voxels of a chunk that lie inside the volume, x fastest, as they are kept.
enum Block {
    Bytes(Vec<u8>),
    Voxels(Voxels),
}

impl Block {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Voxels(voxels) => with_voxels!(voxels, v => bytemuck::cast_slice(v)),
        }
    }
}

/// All that is needed to read a volume's chunks.
struct Fetch<'a> {
    wanted: &'a Wanted<'a>,
    tree: &'a Tree,
    files: &'a [ChunkFile],
    dims: [usize; 3],
    /// Numbers of a chunk along x, y and z.
    chunk: [usize; 3],
    /// Bytes of a chunk when nothing is compressed.
    chunk_bytes: usize,
    /// Steps from one number to the next along x, y and z, and to the first one that is wanted.
    steps: [usize; 3],
    first: usize,
}

/// The voxels of `wanted`, and how many of its chunks are not stored, of how many.
///
/// # Errors
/// When they are over the limits, or a chunk is damaged: the first one in the order of z, y and x.
pub(super) fn voxels(tree: &Tree, wanted: &Wanted, reading: &Reading) -> Result<(Voxels, u128, u128)> {
    let array = wanted.array;
    let limit = reading.limits.voxel_bytes;
    let chunk_bytes = array.chunk_bytes();
    if chunk_bytes > u128::from(limit) || usize::try_from(chunk_bytes).is_err() {
        let what = format!("{}: bytes of a chunk of {} numbers of {}", array.path.display(), shown(&array.chunk_shape), array.stored);
        return Err(Error::Limit { what, needed: chunk_bytes, limit: limit.into() });
    }
    let dims = wanted.along(&array.shape);
    let (chunks, files) = wanted.chunks(tree)?;
    let total = wanted.grid().iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
    let strides = array.strides();
    let fetch = Fetch {
        wanted,
        tree,
        files: &files,
        dims,
        chunk: wanted.along(&array.chunk_shape),
        chunk_bytes: chunk_bytes as usize,
        steps: wanted.space.map(|dimension| dimension.map_or(0, |d| strides[d])),
        first: (0..strides.len()).map(|d| wanted.at[d] % array.chunk_shape[d] * strides[d]).sum(),
    };
    reading.step(0, chunks.len() as u64)?;
    if let Some(voxels) = fetch.whole(&chunks, total)? {
        return Ok((voxels, 0, total));
    }
    // Nothing needs to be stored of voxels that are all fill value.
    let mut voxels = source::room(&array.path, &reading.limits, dims, array.stored, u64::MAX)?;
    let mut missing = total - chunks.len() as u128;
    let pattern = array.fill.pattern();
    if missing > 0 {
        check_fill(array)?;
        if let Some(pattern) = &pattern {
            let tile = pattern.repeat(1 << 13);
            voxels.as_bytes_mut().par_chunks_mut(tile.len()).for_each(|part| part.copy_from_slice(&tile[..part.len()]));
        }
    }
    let most = MOST_BATCH + voxels.bytes() / 4;
    let several = (BATCH / fetch.chunk_bytes).max(EACH * rayon::current_num_threads());
    let batch = several.min(most / fetch.chunk_bytes).max(1);
    let mut done = 0;
    for chunks_now in chunks.chunks(batch) {
        let blocks: Vec<Result<Option<Block>>> = chunks_now.par_iter().map(|chunk| fetch.block(chunk)).collect();
        let mut found = Vec::with_capacity(blocks.len());
        for (chunk, block) in chunks_now.iter().zip(blocks) {
            match block? {
                Some(block) => found.push((chunk, block)),
                None => {
                    check_fill(array)?;
                    missing += 1;
                    let count = fetch.extent(chunk).iter().product();
                    found.extend(pattern.as_ref().map(|pattern| (chunk, Block::Bytes(pattern.repeat(count)))));
                }
            }
        }
        fetch.put(&found, &mut voxels);
        done += chunks_now.len() as u64;
        reading.step(done, chunks.len() as u64)?;
    }
    Ok((voxels, missing, total))
}

/// The voxels of the chunk at `place` along x, y and z, x fastest, and how many bytes were read for them; those of a chunk that is not stored
/// are all fill value.
///
/// # Errors
/// When it is damaged, or its fill value is none that voxels can have.
pub(super) fn chunk(tree: &Tree, wanted: &Wanted, place: [usize; 3]) -> Result<(Vec<u8>, u64)> {
    let array = wanted.array;
    let strides = array.strides();
    let file = wanted.file_of(place);
    let found = match array.shard {
        None => Some(Chunk { place, file: 0, within: None }),
        Some(index) => {
            let entries = shard::entries(tree, array, index, &file, &wanted.only(place))?;
            entries.first().map(|&(_, within)| Chunk { place, file: 0, within: Some(within) })
        }
    };
    let fetch = Fetch {
        wanted,
        tree,
        files: &[file],
        dims: wanted.along(&array.shape),
        chunk: wanted.along(&array.chunk_shape),
        chunk_bytes: array.chunk_bytes() as usize,
        steps: wanted.space.map(|dimension| dimension.map_or(0, |d| strides[d])),
        first: (0..strides.len()).map(|d| wanted.at[d] % array.chunk_shape[d] * strides[d]).sum(),
    };
    let block = found.as_ref().map(|chunk| fetch.block(chunk)).transpose()?.flatten();
    match block {
        Some(Block::Bytes(bytes)) => {
            let read = bytes.len() as u64;
            Ok((bytes, read))
        }
        Some(block) => Ok((block.bytes().to_vec(), block.bytes().len() as u64)),
        None => {
            check_fill(array)?;
            let count = fetch.extent(&Chunk { place, file: 0, within: None }).iter().product();
            let pattern = array.fill.pattern().unwrap_or_else(|| vec![0; array.stored.voxel_type().bytes()]);
            Ok((pattern.repeat(count), 0))
        }
    }
}

/// Refuses a fill value that voxels cannot have, where it is needed.
fn check_fill(array: &Array) -> Result<()> {
    if array.fill.voxel.is_some() {
        return Ok(());
    }
    let (kind, stored) = (array.stored.voxel_type(), array.stored);
    let what = format!("fill_value is {} ({stored}), which chunks that are not stored have: it does not fit {kind}", array.fill.shown);
    Err(Error::format(&array.path, what))
}

impl Fetch<'_> {
    /// Voxels of the chunk along x, y and z that lie inside the volume.
    fn extent(&self, chunk: &Chunk) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.chunk[axis].min(self.dims[axis] - chunk.place[axis] * self.chunk[axis]))
    }

    /// Whether the wanted numbers are all of a chunk of such an `extent`, x fastest.
    fn is_dense(&self, [nx, ny, nz]: [usize; 3]) -> bool {
        let [sx, sy, sz] = self.steps;
        let in_order = (nx == 1 || sx == 1) && (ny == 1 || sy == nx) && (nz == 1 || sz == nx * ny);
        in_order && nx * ny * nz * self.wanted.array.stored.bytes() == self.chunk_bytes
    }

    /// The voxels where they are one chunk that is a file as it is needed: mapped where the limits allow it, as other formats are.
    fn whole(&self, chunks: &[Chunk], total: u128) -> Result<Option<Voxels>> {
        let array = self.wanted.array;
        let [Chunk { file, within: None, .. }] = chunks else { return Ok(None) };
        if total > 1 || !array.codecs.is_empty() || !self.is_dense(self.dims) {
            return Ok(None);
        }
        let source = self.tree.at(&self.files[*file].way)?;
        source.map(|mut source| source.voxels(self.dims, array.stored, array.endian, Tail::Exact)).transpose()
    }

    /// Reads and decodes a chunk; `None` where it is not stored.
    fn block(&self, chunk: &Chunk) -> Result<Option<Block>> {
        let array = self.wanted.array;
        let Some(mut source) = self.tree.at(&self.files[chunk.file].way)? else { return Ok(None) };
        let (start, length) = chunk.within.unwrap_or((0, source.left()));
        let place = if chunk.within.is_some() { format!("the chunk from byte {start} on: ") } else { String::new() };
        let most = if array.codecs.is_empty() { self.chunk_bytes } else { codecs::most_stored(self.chunk_bytes) };
        if length > most as u64 {
            return Err(source.fault(format!("{place}{length} bytes, a chunk takes {most} at most")));
        }
        source.skip(start)?;
        let mut bytes = vec![0; length as usize];
        source.read_exact_into(&mut bytes, 0, length)?;
        if source.is_packed() && chunk.within.is_none() {
            // An entry of a zip file has a checksum, which is looked at behind its last byte.
            source.check_tail(length, Tail::Exact)?;
        }
        let bytes = codecs::decode(&array.codecs, bytes, self.chunk_bytes).map_err(|e| source.fault(format!("{place}{e}")))?;
        let extent = self.extent(chunk);
        let bytes = self.gather(bytes, extent);
        self.kept(bytes, chunk, extent).map(Some)
    }

    /// The wanted numbers of a decoded chunk, x fastest.
    fn gather(&self, bytes: Vec<u8>, extent: [usize; 3]) -> Vec<u8> {
        if self.is_dense(extent) {
            return bytes;
        }
        let size = self.wanted.array.stored.bytes();
        let ([nx, ny, nz], [sx, sy, sz]) = (extent, self.steps);
        let mut out = Vec::with_capacity(nx * ny * nz * size);
        for row in 0..nz * ny {
            let start = self.first + row / ny * sz + row % ny * sy;
            if sx == 1 || nx == 1 {
                out.extend_from_slice(&bytes[start * size..(start + nx) * size]);
                continue;
            }
            match size {
                1 => pick::<1>(&bytes, start, sx, nx, &mut out),
                2 => pick::<2>(&bytes, start, sx, nx, &mut out),
                4 => pick::<4>(&bytes, start, sx, nx, &mut out),
                8 => pick::<8>(&bytes, start, sx, nx, &mut out),
                _ => pick::<16>(&bytes, start, sx, nx, &mut out),
            }
        }
        out
    }

    /// The numbers as they are kept in memory.
    fn kept(&self, mut bytes: Vec<u8>, chunk: &Chunk, [nx, ny, nz]: [usize; 3]) -> Result<Block> {
        let Array { stored, endian, ref path, .. } = *self.wanted.array;
        if let Stored::Native(kind) = stored {
            if endian != Endian::NATIVE {
                match kind.bytes() {
                    2 => turn::<2>(&mut bytes),
                    4 => turn::<4>(&mut bytes),
                    8 => turn::<8>(&mut bytes),
                    _ => {}
                }
            }
            return Ok(Block::Bytes(bytes));
        }
        let mut voxels = Voxels::zeros(stored.voxel_type(), nx * ny * nz);
        match stored.put(endian, &bytes, &mut voxels, 0) {
            Ok(()) => Ok(Block::Voxels(voxels)),
            Err(TooLarge { index, value }) => {
                let inside = [index % nx, index / nx % ny, index / nx / ny];
                let [x, y, z] = [0, 1, 2].map(|axis| chunk.place[axis] * self.chunk[axis] + inside[axis]);
                let index = (z * self.dims[1] + y) * self.dims[0] + x;
                Err(source::too_large(path, stored, 0, TooLarge { index, value }))
            }
        }
    }

    /// Copies the rows of `blocks`, which are sorted, into place: each plane of the volume is one thread's.
    fn put(&self, blocks: &[(&Chunk, Block)], voxels: &mut Voxels) {
        let (Some((low, _)), Some((high, _))) = (blocks.first(), blocks.last()) else { return };
        let size = voxels.voxel_type().bytes();
        let [nx, ny, nz] = self.dims;
        let [cx, cy, cz] = self.chunk;
        let planes = low.place[2] * cz..((high.place[2] + 1) * cz).min(nz);
        let plane_bytes = nx * ny * size;
        let bytes = &mut voxels.as_bytes_mut()[planes.start * plane_bytes..planes.end * plane_bytes];
        bytes.par_chunks_mut(plane_bytes).enumerate().for_each(|(i, plane)| {
            let z = planes.start + i;
            let layer = z / cz;
            let from = blocks.partition_point(|(chunk, _)| chunk.place[2] < layer);
            for (chunk, block) in blocks[from..].iter().take_while(|(chunk, _)| chunk.place[2] == layer) {
                let [bx, by, _] = self.extent(chunk);
                let rows = &block.bytes()[(z - layer * cz) * by * bx * size..][..by * bx * size];
                for (row, from) in rows.chunks_exact(bx * size).enumerate() {
                    let at = ((chunk.place[1] * cy + row) * nx + chunk.place[0] * cx) * size;
                    plane[at..at + bx * size].copy_from_slice(from);
                }
            }
        });
    }
}

/// Appends `count` numbers of `SIZE` bytes, each so many `step`s behind the one before, the first one at `start`.
fn pick<const SIZE: usize>(bytes: &[u8], start: usize, step: usize, count: usize, out: &mut Vec<u8>) {
    let numbers = bytes[start * SIZE..].chunks_exact(SIZE).step_by(step).take(count);
    numbers.for_each(|number| out.extend_from_slice(number));
}

/// Turns the bytes of every number around.
fn turn<const SIZE: usize>(bytes: &mut [u8]) {
    bytes.chunks_exact_mut(SIZE).for_each(<[u8]>::reverse);
}
