//! Small Zarr folders, made by a writer that shares nothing with the reader.

use crate::files::{Sample, gz, zlib};
use slicestack::volume::VoxelType;
use slicestack::volume::io::Endian;
use std::io::Write;
use std::path::Path;

/// How a frame of Blosc is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    /// 0 blosclz (literal bytes alone), 1 LZ4, 3 zlib, 4 Zstandard.
    pub(crate) method: u8,
    /// 0 not shuffled, 1 bytes, 2 bits.
    pub(crate) shuffle: u8,
    pub(crate) block: usize,
    pub(crate) split: bool,
    /// Bytes as they are.
    pub(crate) copied: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packed {
    Not,
    Gzip,
    Zlib,
    Bzip2,
    Zstd,
    Lz4,
    Blosc(Frame),
}

/// How a sample is written; dimensions are z, y, x.
#[derive(Debug, Clone)]
pub(crate) struct Zarr {
    pub(crate) version: u8,
    pub(crate) chunk: [usize; 3],
    /// Chunks in a shard along each dimension; version 3 only.
    pub(crate) shard: Option<[usize; 3]>,
    pub(crate) index_at_start: bool,
    pub(crate) endian: Endian,
    /// Which dimension is the first, second and third of a chunk; version 2 takes z, y, x and x, y, z alone.
    pub(crate) order: [usize; 3],
    pub(crate) packed: Packed,
    /// A checksum behind each chunk; version 3 only.
    pub(crate) checked: bool,
    pub(crate) separator: char,
}

impl Zarr {
    pub(crate) fn new(version: u8, chunk: [usize; 3]) -> Self {
        let separator = if version == 2 { '.' } else { '/' };
        Self {
            version,
            chunk,
            shard: None,
            index_at_start: false,
            endian: Endian::Little,
            order: [0, 1, 2],
            packed: Packed::Not,
            checked: false,
            separator,
        }
    }

    /// The metadata of the array.
    pub(crate) fn metadata(&self, sample: &Sample) -> String {
        let [x, y, z] = sample.dims;
        let kind = sample.kind();
        if self.version == 2 {
            let order = if self.order == [0, 1, 2] { 'C' } else { 'F' };
            return format!(
                r#"{{"zarr_format": 2, "shape": [{z}, {y}, {x}], "chunks": {:?}, "dtype": "{}", "compressor": {}, "fill_value": 0,
                "order": "{order}", "filters": null, "dimension_separator": "{}"}}"#,
                self.chunk,
                code(kind, self.endian),
                self.compressor(),
                self.separator
            );
        }
        let grid: Vec<usize> = self.chunk.iter().zip(self.shard.unwrap_or([1; 3])).map(|(c, s)| c * s).collect();
        let endian = if self.endian == Endian::Big { "big" } else { "little" };
        let mut codecs = vec![
            format!(r#"{{"name": "transpose", "configuration": {{"order": {:?}}}}}"#, self.order),
            format!(r#"{{"name": "bytes", "configuration": {{"endian": "{endian}"}}}}"#),
        ];
        if self.packed != Packed::Not {
            codecs.push(self.compressor());
        }
        if self.checked {
            codecs.push(r#"{"name": "crc32c"}"#.to_owned());
        }
        let mut codecs = codecs.join(", ");
        if self.shard.is_some() {
            let place = if self.index_at_start { "start" } else { "end" };
            codecs = format!(
                r#"{{"name": "sharding_indexed", "configuration": {{"chunk_shape": {:?}, "codecs": [{codecs}], "index_codecs":
                [{{"name": "bytes", "configuration": {{"endian": "little"}}}}, {{"name": "crc32c"}}], "index_location": "{place}"}}}}"#,
                self.chunk
            );
        }
        format!(
            r#"{{"zarr_format": 3, "node_type": "array", "shape": [{z}, {y}, {x}], "data_type": "{}", "fill_value": 0, "chunk_grid":
            {{"name": "regular", "configuration": {{"chunk_shape": {grid:?}}}}}, "codecs": [{codecs}], "attributes": {{}},
            "chunk_key_encoding": {{"name": "default", "configuration": {{"separator": "{}"}}}}}}"#,
            name(kind),
            self.separator
        )
    }

    fn compressor(&self) -> String {
        let id = match self.packed {
            Packed::Not => return "null".to_owned(),
            Packed::Gzip => "gzip",
            Packed::Zlib => "zlib",
            Packed::Bzip2 => "bz2",
            Packed::Zstd => "zstd",
            Packed::Lz4 => "lz4",
            Packed::Blosc(_) => "blosc",
        };
        match (self.version, self.packed) {
            (2, _) => format!(r#"{{"id": "{id}", "level": 1}}"#),
            (_, Packed::Zlib | Packed::Bzip2 | Packed::Lz4) => format!(r#"{{"name": "numcodecs.{id}", "configuration": {{"level": 1}}}}"#),
            _ => format!(r#"{{"name": "{id}", "configuration": {{"level": 1}}}}"#),
        }
    }

    /// Writes `sample` into the folder `dir`.
    pub(crate) fn write(&self, sample: &Sample, dir: &Path) {
        std::fs::create_dir_all(dir).unwrap();
        let file = if self.version == 2 { ".zarray" } else { "zarr.json" };
        std::fs::write(dir.join(file), self.metadata(sample)).unwrap();
        let per_file = self.shard.unwrap_or([1; 3]);
        let shape = [sample.dims[2], sample.dims[1], sample.dims[0]];
        let files = [0, 1, 2].map(|d| shape[d].div_ceil(self.chunk[d] * per_file[d]));
        for at in places(files) {
            let chunks = places(per_file).map(|inner| {
                let start = [0, 1, 2].map(|d| (at[d] * per_file[d] + inner[d]) * self.chunk[d]);
                // Chunks of a shard that lie outside are left out.
                let inside = (0..3).all(|d| start[d] < shape[d]);
                inside.then(|| self.packed(&self.chunk_bytes(sample, start), sample.kind().bytes()))
            });
            let chunks: Vec<Option<Vec<u8>>> = chunks.collect();
            let bytes = if self.shard.is_some() { self.shard_bytes(&chunks) } else { chunks.into_iter().flatten().next().unwrap() };
            let path = dir.join(self.key(at));
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
    }

    /// The name of the file of the chunks at `at`.
    pub(crate) fn key(&self, at: [usize; 3]) -> String {
        let key = at.map(|n| n.to_string()).join(&self.separator.to_string());
        if self.version == 2 { key } else { format!("c{}{key}", self.separator) }
    }

    fn shard_bytes(&self, chunks: &[Option<Vec<u8>>]) -> Vec<u8> {
        let index_bytes = chunks.len() * 16 + 4;
        let (mut index, mut data) = (Vec::new(), Vec::new());
        for chunk in chunks {
            let before = if self.index_at_start { index_bytes } else { 0 };
            let entry = chunk.as_ref().map_or([u64::MAX; 2], |chunk| [(before + data.len()) as u64, chunk.len() as u64]);
            entry.iter().for_each(|n| index.extend(n.to_le_bytes()));
            data.extend(chunk.iter().flatten());
        }
        index.extend(crc32c(&index).to_le_bytes());
        if self.index_at_start { [index, data].concat() } else { [data, index].concat() }
    }

    /// The numbers of the chunk whose first one is at `start`, zeros outside the sample.
    fn chunk_bytes(&self, sample: &Sample, start: [usize; 3]) -> Vec<u8> {
        let size = sample.kind().bytes();
        let all = sample.bytes(self.endian);
        let [nx, ny, nz] = sample.dims;
        let mut out = Vec::new();
        for inner in places(self.order.map(|d| self.chunk[d])) {
            let mut at = start;
            (0..3).for_each(|i| at[self.order[i]] += inner[i]);
            let [z, y, x] = at;
            if z < nz && y < ny && x < nx {
                out.extend(&all[((z * ny + y) * nx + x) * size..][..size]);
            } else {
                out.extend(vec![0; size]);
            }
        }
        out
    }

    fn packed(&self, bytes: &[u8], size: usize) -> Vec<u8> {
        let mut out = match self.packed {
            Packed::Not => bytes.to_vec(),
            Packed::Gzip => gz(bytes),
            Packed::Zlib => zlib(bytes),
            Packed::Bzip2 => {
                let mut out = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
                out.write_all(bytes).unwrap();
                out.finish().unwrap()
            }
            Packed::Zstd => zstd(bytes),
            Packed::Lz4 => [&(bytes.len() as u32).to_le_bytes()[..], &lz4_flex::block::compress(bytes)].concat(),
            Packed::Blosc(frame) => frame.bytes(bytes, size),
        };
        if self.checked {
            out.extend(crc32c(&out).to_le_bytes());
        }
        out
    }
}

impl Frame {
    /// `bytes` of numbers of `size` bytes each, as a frame.
    pub(crate) fn bytes(&self, bytes: &[u8], size: usize) -> Vec<u8> {
        let block = self.block.min(bytes.len());
        let mut flags = [0, 1, 4][usize::from(self.shuffle)] | self.method << 5;
        flags |= if self.split { 0 } else { 16 } | if self.copied { 2 } else { 0 };
        let mut body = Vec::new();
        if self.copied {
            body.extend(bytes);
        } else {
            let blocks = bytes.len().div_ceil(block);
            let mut starts = Vec::new();
            let mut streams: Vec<u8> = Vec::new();
            for plain in bytes.chunks(block) {
                starts.extend(((16 + 4 * blocks + streams.len()) as u32).to_le_bytes());
                let shuffled = match self.shuffle {
                    0 => plain.to_vec(),
                    1 => shuffled(plain, size),
                    _ => bits_shuffled(plain, size),
                };
                let split = self.split && block / size >= 128 && plain.len() == block;
                let length = if split { block / size } else { plain.len() };
                for part in shuffled.chunks(length) {
                    let stream = self.stream(part);
                    // What does not get smaller stays as it is.
                    let stream = if stream.len() < part.len() { stream } else { part.to_vec() };
                    streams.extend((stream.len() as u32).to_le_bytes());
                    streams.extend(stream);
                }
            }
            body = [starts, streams].concat();
        }
        let mut out = vec![2, 1, flags, size as u8];
        [bytes.len(), block, 16 + body.len()].iter().for_each(|n| out.extend((*n as u32).to_le_bytes()));
        [out, body].concat()
    }

    fn stream(&self, part: &[u8]) -> Vec<u8> {
        match self.method {
            0 => blosclz(part),
            1 => lz4_flex::block::compress(part),
            3 => zlib(part),
            _ => zstd(part),
        }
    }
}

/// A stream of BloscLZ: repeats of the byte before as copies, all else as literal bytes.
fn blosclz(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let run = bytes[at..].iter().take_while(|&&b| at > 0 && b == bytes[at - 1]).count();
        if run >= 9 {
            out.push(0xe0);
            let mut more = run - 9;
            while more >= 255 {
                out.push(255);
                more -= 255;
            }
            out.extend([more as u8, 0]);
            at += run;
        } else {
            let literal = &bytes[at..bytes.len().min(at + 1 + 7)];
            out.push(literal.len() as u8 - 1);
            out.extend(literal);
            at += literal.len();
        }
    }
    out
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

/// All places in a box, the last dimension fastest.
fn places([a, b, c]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..a).flat_map(move |i| (0..b).flat_map(move |j| (0..c).map(move |k| [i, j, k])))
}

fn shuffled(bytes: &[u8], size: usize) -> Vec<u8> {
    let whole = bytes.len() / size * size;
    let mut out: Vec<u8> = (0..size).flat_map(|b| bytes[..whole].iter().skip(b).step_by(size).copied()).collect();
    out.extend(&bytes[whole..]);
    out
}

fn bits_shuffled(bytes: &[u8], size: usize) -> Vec<u8> {
    let count = bytes.len() / size;
    if count % 8 != 0 {
        return bytes.to_vec();
    }
    let mut out = vec![0; count * size];
    for i in 0..count * size * 8 {
        // Bit i of the result is bit `i / count` of number `i % count`.
        let (bit, number) = (i / count, i % count);
        out[i / 8] |= (bytes[number * size + bit / 8] >> (bit % 8) & 1) << (i % 8);
    }
    out.extend(&bytes[count * size..]);
    out
}

fn crc32c(bytes: &[u8]) -> u32 {
    let step = |rest: u32| if rest & 1 == 1 { rest >> 1 ^ 0x82f6_3b78 } else { rest >> 1 };
    !bytes.iter().fold(u32::MAX, |rest, &b| (0..8).fold(rest ^ u32::from(b), |rest, _| step(rest)))
}

/// The type's code in version 2.
pub(crate) fn code(kind: VoxelType, endian: Endian) -> String {
    let order = match (kind.bytes(), endian) {
        (1, _) => '|',
        (_, Endian::Big) => '>',
        _ => '<',
    };
    let letter = name(kind).chars().next().unwrap();
    format!("{order}{letter}{}", kind.bytes())
}

/// The type's name in version 3.
pub(crate) fn name(kind: VoxelType) -> &'static str {
    match kind {
        VoxelType::U8 => "uint8",
        VoxelType::I8 => "int8",
        VoxelType::U16 => "uint16",
        VoxelType::I16 => "int16",
        VoxelType::U32 => "uint32",
        VoxelType::I32 => "int32",
        VoxelType::F32 => "float32",
        VoxelType::F64 => "float64",
    }
}
