//! Compressed blocks, decoded one after the other as their bytes are asked for.

use flate2::{Decompress, FlushDecompress, Status};
use std::io::{self, Read};

/// Bytes of compressed data read at a time.
const CHUNK: usize = 1 << 16;

/// What the blocks are compressed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
}

impl Compressor {
    /// Most bytes that one compressed byte can stand for.
    pub(super) fn ratio(self) -> u64 {
        match self {
            // See `Source` on deflate.
            Self::Zlib => 1032,
            // A byte of length adds 255 (LZ4 Block Format Description).
            Self::Lz4 => 255,
        }
    }
}

fn damaged(what: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// How many bytes each block takes, compressed and not.
pub(super) struct Table {
    pub(super) packed: Vec<u64>,
    /// Bytes of each block but the last one.
    pub(super) size: u64,
    pub(super) last: u64,
}

impl Table {
    fn unpacked(&self, block: usize) -> u64 {
        if block + 1 == self.packed.len() { self.last } else { self.size }
    }
}

/// The bytes of all blocks in a row.
pub(super) struct Blocks {
    stream: Box<dyn Read>,
    table: Table,
    compressor: Compressor,
    /// Blocks that are begun.
    begun: usize,
    /// Of the last one that is begun: bytes still to be read, and bytes still to be given out.
    packed: u64,
    left: u64,
    inflate: Decompress,
    /// Compressed bytes; those before `used` are used up.
    input: Vec<u8>,
    used: usize,
    /// A whole decoded block, where it had no place in what was asked for.
    block: Vec<u8>,
}

impl Blocks {
    pub(super) fn new(stream: Box<dyn Read>, table: Table, compressor: Compressor) -> Self {
        let inflate = Decompress::new(true);
        Self { stream, table, compressor, begun: 0, packed: 0, left: 0, inflate, input: Vec::new(), used: 0, block: Vec::new() }
    }

    /// Begins the next block; false where there is none.
    fn begin(&mut self) -> bool {
        let Some(&packed) = self.table.packed.get(self.begun) else { return false };
        (self.packed, self.left) = (packed, self.table.unpacked(self.begun));
        self.begun += 1;
        self.inflate.reset(true);
        self.input.clear();
        self.used = 0;
        true
    }

    /// One step of inflating: bytes that came out, and whether the stream ended.
    fn step(&mut self, out: &mut [u8]) -> io::Result<(usize, bool)> {
        if self.used == self.input.len() && self.packed > 0 {
            let n = self.packed.min(CHUNK as u64) as usize;
            self.input.resize(n, 0);
            self.stream.read_exact(&mut self.input)?;
            self.used = 0;
            self.packed -= n as u64;
        }
        let (read, written) = (self.inflate.total_in(), self.inflate.total_out());
        let status = self.inflate.decompress(&self.input[self.used..], out, FlushDecompress::None);
        let status = status.map_err(|e| damaged(format!("block {}: {e}", self.begun - 1)))?;
        let (read, written) = ((self.inflate.total_in() - read) as usize, (self.inflate.total_out() - written) as usize);
        self.used += read;
        let ended = status == Status::StreamEnd;
        if read == 0 && written == 0 && !ended {
            return Err(damaged(format!(
                "block {} of {} compressed bytes is cut short",
                self.begun - 1,
                self.table.packed[self.begun - 1]
            )));
        }
        Ok((written, ended))
    }

    /// Inflates into `out`, which is at most what is left of the block, and is not empty.
    fn inflate(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut done = 0;
        while done < out.len() {
            let (written, ended) = self.step(&mut out[done..])?;
            done += written;
            if ended && (done as u64) < self.left {
                let (block, lacking) = (self.begun - 1, self.left - done as u64);
                return Err(damaged(format!("block {block} has {lacking} of {} bytes too few", self.table.unpacked(block))));
            }
            if ended {
                return self.end(done);
            }
        }
        if done as u64 == self.left {
            // The checksum comes behind the last byte.
            let mut more = [0];
            loop {
                let (written, ended) = self.step(&mut more)?;
                if written > 0 {
                    let block = self.begun - 1;
                    return Err(damaged(format!("block {block} has more than {} bytes", self.table.unpacked(block))));
                }
                if ended {
                    break;
                }
            }
            return self.end(done);
        }
        Ok(done)
    }

    /// Passes over what stands between a compressed stream and the end of its block.
    fn end(&mut self, done: usize) -> io::Result<usize> {
        io::copy(&mut (&mut self.stream).take(self.packed), &mut io::sink())?;
        self.packed = 0;
        Ok(done)
    }

    /// Decodes a whole block of LZ4, into `out` where there is room, and returns how many bytes came into it.
    fn decode(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let (block, size) = (self.begun - 1, self.left as usize);
        self.input.resize(self.packed as usize, 0);
        self.stream.read_exact(&mut self.input)?;
        let direct = out.len() >= size;
        let place = if direct {
            &mut out[..size]
        } else {
            self.block.resize(size, 0);
            &mut self.block[..]
        };
        match lz4_flex::block::decompress_into(&self.input, place) {
            Ok(n) if n == size => {}
            Ok(n) => return Err(damaged(format!("block {block} has {n} bytes instead of {size}"))),
            Err(e) => return Err(damaged(format!("block {block}: {}", e.to_string().replace('\n', " ")))),
        }
        Ok(if direct { size } else { 0 })
    }
}

impl Read for Blocks {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if out.is_empty() {
            return Ok(0);
        }
        let mut fresh = false;
        while self.left == 0 {
            if !self.begin() {
                return Ok(0);
            }
            fresh = true;
        }
        let want = out.len().min(usize::try_from(self.left).unwrap_or(usize::MAX));
        let done = match self.compressor {
            Compressor::Zlib => self.inflate(&mut out[..want])?,
            Compressor::Lz4 => match if fresh { self.decode(&mut out[..want])? } else { 0 } {
                0 => {
                    let from = self.block.len() - self.left as usize;
                    out[..want].copy_from_slice(&self.block[from..from + want]);
                    want
                }
                whole => whole,
            },
        };
        self.left -= done as u64;
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn blocks_are_decoded_whatever_is_asked_for_at_a_time() {
        let bytes: Vec<u8> = (0..1000u32).flat_map(|n| (n * n / 7).to_le_bytes()).collect();
        for compressor in [Compressor::Zlib, Compressor::Lz4] {
            let pack = |block: &[u8]| match compressor {
                Compressor::Lz4 => lz4_flex::block::compress(block),
                Compressor::Zlib => {
                    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                    out.write_all(block).expect("packed");
                    out.finish().expect("packed")
                }
            };
            let packed: Vec<Vec<u8>> = bytes.chunks(700).map(pack).collect();
            for ask in [1, 2, 699, 700, 701, 4000, 5000] {
                let table = Table { packed: packed.iter().map(|p| p.len() as u64).collect(), size: 700, last: 500 };
                let mut blocks = Blocks::new(Box::new(io::Cursor::new(packed.concat())), table, compressor);
                let (mut found, mut out) = (Vec::new(), vec![0; ask]);
                loop {
                    match blocks.read(&mut out).expect("decoded") {
                        0 => break,
                        n => found.extend_from_slice(&out[..n]),
                    }
                }
                assert!(found == bytes, "{compressor:?} by {ask}");
            }
            for (change, says) in [(-1i64, "block 5 has"), (1, "block 5 has")] {
                let last = (500 + change) as u64;
                let table = Table { packed: packed.iter().map(|p| p.len() as u64).collect(), size: 700, last };
                let mut blocks = Blocks::new(Box::new(io::Cursor::new(packed.concat())), table, compressor);
                let told = io::copy(&mut blocks, &mut io::sink()).expect_err("refused").to_string();
                assert!(told.contains(says) || compressor == Compressor::Lz4 && told.contains("block 5"), "{told}");
            }
        }
    }
}
