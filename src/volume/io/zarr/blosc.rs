//! Blosc frames: a chunk in blocks, each shuffled and compressed.
//!
//! Source of the format: "Blosc Chunk Format", <https://github.com/Blosc/c-blosc/blob/main/README_CHUNK_FORMAT.rst>, format version 2. What
//! it does not say: a block is split into as many streams as a number has bytes, where a number has 16 bytes at most, the block 128 numbers
//! at least, and it is not a last, shorter one; bits are shuffled where the block is a multiple of eight numbers, and the bytes behind the
//! last whole number are left as they are.

use super::blosclz;
use super::codecs::{Want, lz4_into, room};
use super::zstd;
use crate::volume::io::Endian;
use std::io::Read;

const LE: Endian = Endian::Little;

/// Bytes of a frame's header.
const HEADER: usize = 16;
/// Most bytes of a number whose blocks are split.
const MOST_SPLITS: usize = 16;
/// Fewest numbers of a block that is split.
const LEAST_SPLIT: usize = 128;

const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const NOT_SPLIT: u8 = 16;

/// What a frame's header says.
struct Frame<'a> {
    /// The whole frame, its header included.
    bytes: &'a [u8],
    flags: u8,
    /// Bytes of a number.
    size: usize,
    /// Bytes of a block.
    block: usize,
}

/// The bytes in a frame.
pub(super) fn decode(bytes: &[u8], want: Want) -> Result<Vec<u8>, String> {
    let Some(header) = bytes.get(..HEADER) else {
        return Err(format!("a frame of {} bytes, its header takes {HEADER}", bytes.len()));
    };
    let [version, _, flags, size] = [header[0], header[1], header[2], header[3]];
    let [length, block, stored] = [4, 8, 12].map(|at| LE.u32(&header[at..]) as usize);
    if version != 2 {
        return Err(format!("a frame of format version {version}, 2 is read"));
    }
    if flags & (SHUFFLED | BITS_SHUFFLED) == SHUFFLED | BITS_SHUFFLED {
        return Err("a frame of Blosc2 is not supported".to_owned());
    }
    want.check(length)?;
    let Some(bytes) = bytes.get(..stored).filter(|b| b.len() >= HEADER) else {
        return Err(format!("a frame of {stored} bytes, {} are there", bytes.len()));
    };
    if length == 0 {
        return Ok(Vec::new());
    }
    if flags & COPIED != 0 {
        let body = &bytes[HEADER..];
        return if body.len() == length { Ok(body.to_vec()) } else { Err(format!("{length} bytes as they are, {} follow", body.len())) };
    }
    if size == 0 || block == 0 || block > length {
        return Err(format!("{length} bytes in blocks of {block} of numbers of {size} bytes"));
    }
    let blocks = length.div_ceil(block);
    if bytes.len() < HEADER + 4 * blocks {
        return Err(format!("{blocks} blocks in a frame of {} bytes", bytes.len()));
    }
    let frame = Frame { bytes, flags, size: size.into(), block };
    let mut out = room(length)?;
    out.resize(length, 0);
    let shuffled = flags & (SHUFFLED | BITS_SHUFFLED) != 0;
    let mut plain = vec![0; if shuffled { block } else { 0 }];
    for (i, place) in out.chunks_mut(block).enumerate() {
        let at = LE.u32(&bytes[HEADER + 4 * i..]) as usize;
        let fault = |e| format!("block {i}: {e}");
        if shuffled {
            let plain = &mut plain[..place.len()];
            frame.read_block(at, plain).map_err(fault)?;
            if flags & SHUFFLED != 0 {
                unshuffle(frame.size, plain, place);
            } else {
                unshuffle_bits(frame.size, plain, place);
            }
        } else {
            frame.read_block(at, place).map_err(fault)?;
        }
    }
    Ok(out)
}

impl Frame<'_> {
    /// Fills `out` with the block that starts at byte `at`, still shuffled.
    fn read_block(&self, mut at: usize, out: &mut [u8]) -> Result<(), String> {
        let split =
            self.flags & NOT_SPLIT == 0 && self.size <= MOST_SPLITS && self.block / self.size >= LEAST_SPLIT && out.len() == self.block;
        let streams = if split { self.size } else { 1 };
        let length = out.len() / streams;
        for place in out.chunks_exact_mut(length) {
            let stream = self.bytes.get(at..).and_then(|rest| {
                let (stored, rest) = rest.split_first_chunk::<4>()?;
                rest.get(..u32::from_le_bytes(*stored) as usize)
            });
            let Some(stream) = stream else {
                return Err(format!("its stream at byte {at} of {} is not there", self.bytes.len()));
            };
            at += 4 + stream.len();
            if stream.len() == length {
                place.copy_from_slice(stream);
            } else {
                self.expand(stream, place)?;
            }
        }
        Ok(())
    }

    /// Fills `out` from one compressed stream.
    fn expand(&self, stream: &[u8], out: &mut [u8]) -> Result<(), String> {
        match self.flags >> 5 {
            0 => blosclz::decode(stream, out),
            1 => lz4_into(stream, out),
            2 => Err("compressed by Snappy: not supported".to_owned()),
            3 => {
                let mut stream = flate2::bufread::ZlibDecoder::new(stream);
                stream.read_exact(out).map_err(|e| format!("zlib: {e}"))
            }
            4 => zstd::decode_into(stream, out),
            other => Err(format!("compressed by method {other}: not known")),
        }
    }
}

/// Puts numbers of `size` bytes together whose first bytes come first, then all second ones. Bytes behind the last whole number stay.
pub(super) fn unshuffle(size: usize, bytes: &[u8], out: &mut [u8]) {
    let count = bytes.len() / size;
    let whole = count * size;
    match size {
        1 => out[..whole].copy_from_slice(&bytes[..whole]),
        2 => interleave::<2>(bytes, count, out),
        4 => interleave::<4>(bytes, count, out),
        8 => interleave::<8>(bytes, count, out),
        _ => {
            for (i, number) in out[..whole].chunks_exact_mut(size).enumerate() {
                number.iter_mut().enumerate().for_each(|(b, byte)| *byte = bytes[b * count + i]);
            }
        }
    }
    out[whole..].copy_from_slice(&bytes[whole..]);
}

/// [`unshuffle`] for a size known to the compiler.
fn interleave<const SIZE: usize>(bytes: &[u8], count: usize, out: &mut [u8]) {
    let rows: [&[u8]; SIZE] = std::array::from_fn(|b| &bytes[b * count..][..count]);
    for (i, number) in out[..count * SIZE].chunks_exact_mut(SIZE).enumerate() {
        for b in 0..SIZE {
            number[b] = rows[b][i];
        }
    }
}

/// Puts numbers of `size` bytes together whose lowest bits come first, then all second bits. Bytes behind the last whole number stay; where
/// there is no multiple of eight numbers, all do.
fn unshuffle_bits(size: usize, bytes: &[u8], out: &mut [u8]) {
    let count = bytes.len() / size;
    let whole = if count % 8 == 0 { count * size } else { 0 };
    let row = count / 8;
    for group in 0..if whole > 0 { row } else { 0 } {
        for b in 0..size {
            // Eight bytes, each with one bit of eight numbers.
            let bits = (0..8).fold(0u64, |all, k| all | u64::from(bytes[(b * 8 + k) * row + group]) << (8 * k));
            for (i, byte) in transpose(bits).to_le_bytes().into_iter().enumerate() {
                out[(group * 8 + i) * size + b] = byte;
            }
        }
    }
    out[whole..].copy_from_slice(&bytes[whole..]);
}

/// Bit `j` of byte `i` becomes bit `i` of byte `j`: halves of ever smaller squares change places.
fn transpose(x: u64) -> u64 {
    let swap = |x: u64, shift: u32, mask: u64| {
        let t = (x ^ x >> shift) & mask;
        x ^ t ^ t << shift
    };
    swap(swap(swap(x, 7, 0x00aa_00aa_00aa_00aa), 14, 0x0000_cccc_0000_cccc), 28, 0x0000_0000_f0f0_f0f0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_bits_are_turned() {
        let mut x = 0x9e37_79b9_7f4a_7c15u64;
        for _ in 0..100 {
            x = x.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            let turned = transpose(x);
            for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
                assert_eq!(x >> (8 * i + j) & 1, turned >> (8 * j + i) & 1, "{x:#x} {i} {j}");
            }
        }
    }

    #[test]
    fn numbers_are_put_together_again() {
        for size in [1, 2, 3, 4, 5, 8, 16] {
            for bytes in [0, 1, size * 7, size * 16, size * 16 + size - 1] {
                let plain: Vec<u8> = (0..bytes).map(|i| (i * 37 + 11) as u8).collect();
                let count = bytes / size;
                let mut shuffled = plain.clone();
                for (i, b) in (0..count).flat_map(|i| (0..size).map(move |b| (i, b))) {
                    shuffled[b * count + i] = plain[i * size + b];
                }
                let mut out = vec![0; bytes];
                unshuffle(size, &shuffled, &mut out);
                assert_eq!(out, plain, "{size} {bytes}");
                let mut bits = plain.clone();
                if count % 8 == 0 {
                    bits[..count * size].fill(0);
                    for i in 0..count {
                        for (b, k) in (0..size).flat_map(|b| (0..8).map(move |k| (b, k))) {
                            bits[(b * 8 + k) * (count / 8) + i / 8] |= (plain[i * size + b] >> k & 1) << (i % 8);
                        }
                    }
                }
                unshuffle_bits(size, &bits, &mut out);
                assert_eq!(out, plain, "bits: {size} {bytes}");
            }
        }
    }
}
