//! Codecs of bytes: what was done to the bytes of a chunk, undone within the size that the array's metadata give it.
//!
//! Sources: RFC 1950 and 1952 (zlib and gzip), <https://numcodecs.readthedocs.io> for what stands around a block of LZ4 (its length first)
//! and for the filters shuffle and delta, RFC 3720 appendix B.4 for CRC-32C.

use super::blosc;
use super::json::Json;
use super::zstd;
use crate::Result;
use crate::volume::VoxelType;
use crate::volume::io::Stored;
use std::io::Read;

/// One codec.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Gzip,
    Zlib,
    Zstd,
    Bzip2,
    Lz4,
    Blosc,
    /// Four bytes of checksum follow.
    Crc32c,
    /// First bytes of all numbers first, then all second bytes: numbers of so many bytes.
    Shuffle(usize),
    /// Differences to the number before: little-endian integers of so many bytes.
    Delta(usize),
}

/// How many bytes a codec is to give back.
#[derive(Debug, Clone, Copy)]
pub(super) enum Want {
    Exactly(usize),
    /// At most so many: another codec is applied to them.
    Most(usize),
}

impl Want {
    /// Most bytes that may come.
    pub(super) fn most(self) -> usize {
        match self {
            Self::Exactly(n) | Self::Most(n) => n,
        }
    }

    /// Refuses another number of bytes.
    pub(super) fn check(self, found: usize) -> Result<(), String> {
        match self {
            Self::Exactly(n) if found < n => Err(format!("its bytes should be {n}, there are {found}")),
            Self::Exactly(n) if found > n => Err(format!("its bytes should be {n}, there are more")),
            Self::Most(n) if found > n => Err(format!("its bytes should be {n} at most, there are more")),
            _ => Ok(()),
        }
    }
}

impl Codec {
    /// The codec of bytes called `name`.
    pub(super) fn compressor(json: &Json, name: &str) -> Result<Self> {
        Ok(match name {
            "gzip" => Self::Gzip,
            "zlib" => Self::Zlib,
            "zstd" => Self::Zstd,
            "bz2" => Self::Bzip2,
            "lz4" => Self::Lz4,
            "blosc" => Self::Blosc,
            "crc32c" => Self::Crc32c,
            _ => return Err(json.fault(format!("the codec {name} is not supported"))),
        })
    }

    /// The filter called `name`, of numbers of `stored`.
    pub(super) fn filter(json: &Json, name: &str, configured: &Json, stored: Stored) -> Result<Self> {
        match name {
            "shuffle" => {
                let size = configured.get("elementsize").map_or(Ok(4), |size| size.count())?;
                if size == 0 { Err(json.fault("elementsize must be at least 1")) } else { Ok(Self::Shuffle(size)) }
            }
            "delta" => {
                let kind = configured.need("dtype")?.text()?;
                let kept = configured.get("astype").map_or(Ok(kind), |kind| kind.text())?;
                let integer = match stored {
                    Stored::Native(VoxelType::F32 | VoxelType::F64) => false,
                    Stored::Native(_) | Stored::I64 | Stored::U64 => true,
                    _ => false,
                };
                if !integer || kept != kind || kind.starts_with('>') {
                    return Err(json.fault("differences are read of little-endian integers alone, kept in the same type"));
                }
                Ok(Self::Delta(stored.bytes()))
            }
            _ => Err(json.fault(format!("the filter {name} is not supported"))),
        }
    }

    /// How many bytes come of `length`, where that does not depend on what they are.
    fn length_of(self, length: usize) -> Option<usize> {
        match self {
            Self::Shuffle(_) | Self::Delta(_) => Some(length),
            Self::Crc32c => length.checked_add(4),
            _ => None,
        }
    }

    /// Undoes this codec.
    fn undo(self, bytes: Vec<u8>, want: Want) -> Result<Vec<u8>, String> {
        match self {
            // Several gzip streams in a row are one.
            Self::Gzip => inflate(flate2::bufread::MultiGzDecoder::new(&bytes[..]), bytes.len(), want),
            Self::Zlib => inflate(flate2::bufread::ZlibDecoder::new(&bytes[..]), bytes.len(), want),
            Self::Bzip2 => inflate(bzip2::bufread::MultiBzDecoder::new(&bytes[..]), bytes.len(), want),
            Self::Zstd => zstd::decode(&bytes, want),
            Self::Lz4 => lz4(&bytes, want),
            Self::Blosc => blosc::decode(&bytes, want),
            Self::Crc32c => checked(bytes),
            Self::Shuffle(size) => {
                let mut out = vec![0; bytes.len()];
                blosc::unshuffle(size, &bytes, &mut out);
                Ok(out)
            }
            Self::Delta(size) => Ok(summed(bytes, size)),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zlib => "zlib",
            Self::Zstd => "zstd",
            Self::Bzip2 => "bz2",
            Self::Lz4 => "lz4",
            Self::Blosc => "blosc",
            Self::Crc32c => "crc32c",
            Self::Shuffle(_) => "shuffle",
            Self::Delta(_) => "delta",
        }
    }
}

/// Most bytes that a chunk of `bytes` may take as it is stored: what does not compress grows a little.
pub(super) fn most_stored(bytes: usize) -> usize {
    bytes.saturating_add(bytes / 8).saturating_add(1 << 16)
}

/// Undoes all `codecs` of a chunk that holds `length` bytes.
///
/// # Errors
/// What is wrong with the bytes: also when there are more or fewer.
pub(super) fn decode(codecs: &[Codec], bytes: Vec<u8>, length: usize) -> Result<Vec<u8>, String> {
    // What each codec was given to work on.
    let mut given = Vec::with_capacity(codecs.len());
    let mut exact = Some(length);
    for codec in codecs {
        given.push(exact.map_or(Want::Most(most_stored(length)), Want::Exactly));
        exact = exact.and_then(|n| codec.length_of(n));
    }
    let mut bytes = bytes;
    for (codec, &want) in codecs.iter().zip(&given).rev() {
        let named = |e| format!("{}: {e}", codec.name());
        bytes = codec.undo(bytes, want).map_err(named)?;
        want.check(bytes.len()).map_err(named)?;
    }
    Want::Exactly(length).check(bytes.len())?;
    Ok(bytes)
}

/// All that `stream` has to give; the memory grows with what comes.
fn inflate(stream: impl Read, packed: usize, want: Want) -> Result<Vec<u8>, String> {
    let most = want.most();
    let mut out = room(most.min(packed.saturating_mul(16).saturating_add(1 << 12)))?;
    // One byte more tells that there is too much.
    stream.take(most as u64 + 1).read_to_end(&mut out).map_err(|e| format!("damaged after {} bytes: {e}", out.len()))?;
    Ok(out)
}

/// An empty vector with room for `bytes`.
pub(super) fn room(bytes: usize) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    crate::memory::reserve(&mut out, bytes).map_err(|_| format!("this machine does not give {bytes} bytes of memory"))?;
    Ok(out)
}

/// A block of LZ4 behind its own length.
fn lz4(bytes: &[u8], want: Want) -> Result<Vec<u8>, String> {
    let Some((length, block)) = bytes.split_first_chunk::<4>() else {
        return Err(format!("{} bytes are too few", bytes.len()));
    };
    let length = u32::from_le_bytes(*length) as usize;
    want.check(length)?;
    lz4_block(block, length)
}

/// The `length` bytes in a block of LZ4.
fn lz4_block(block: &[u8], length: usize) -> Result<Vec<u8>, String> {
    // A byte stands for 255 at most.
    if length > block.len().saturating_mul(255) {
        return Err(format!("{} bytes cannot hold {length}", block.len()));
    }
    let mut out = room(length)?;
    out.resize(length, 0);
    lz4_into(block, &mut out)?;
    Ok(out)
}

/// Fills `out` from a block of LZ4.
pub(super) fn lz4_into(block: &[u8], out: &mut [u8]) -> Result<(), String> {
    match lz4_flex::block::decompress_into(block, out) {
        Ok(n) if n == out.len() => Ok(()),
        Ok(n) => Err(format!("a block of {} bytes ends after {n}", out.len())),
        Err(e) => Err(format!("a damaged block: {e}")),
    }
}

/// Sums of what went before, for little-endian integers of `size` bytes that wrap around.
fn summed(mut bytes: Vec<u8>, size: usize) -> Vec<u8> {
    let mut sum = 0u64;
    for number in bytes.chunks_exact_mut(size) {
        let mut word = [0; 8];
        word[..size].copy_from_slice(number);
        sum = sum.wrapping_add(u64::from_le_bytes(word));
        number.copy_from_slice(&sum.to_le_bytes()[..size]);
    }
    bytes
}

/// The bytes before a checksum that is theirs.
pub(super) fn checked(mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let Some((body, sum)) = bytes.split_last_chunk::<4>() else {
        return Err(format!("{} bytes are too few for a checksum", bytes.len()));
    };
    let (found, noted) = (crc32c(body), u32::from_le_bytes(*sum));
    if found != noted {
        return Err(format!("the checksum is {found:#010x}, {noted:#010x} is noted"));
    }
    bytes.truncate(bytes.len() - 4);
    Ok(bytes)
}

/// Remainders for one byte that so many others follow.
const TABLES: [[u32; 256]; 8] = {
    let mut tables = [[0u32; 256]; 8];
    let mut byte = 0;
    while byte < 256 {
        let mut rest = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            // Castagnoli's polynomial, bits turned around.
            rest = if rest & 1 == 1 { rest >> 1 ^ 0x82f6_3b78 } else { rest >> 1 };
            bit += 1;
        }
        tables[0][byte] = rest;
        byte += 1;
    }
    let mut after = 1;
    while after < 8 {
        let mut byte = 0;
        while byte < 256 {
            let rest = tables[after - 1][byte];
            tables[after][byte] = rest >> 8 ^ tables[0][(rest & 255) as usize];
            byte += 1;
        }
        after += 1;
    }
    tables
};

/// CRC-32C of `bytes`.
fn crc32c(bytes: &[u8]) -> u32 {
    let mut rest = u32::MAX;
    let mut words = bytes.chunks_exact(8);
    for word in &mut words {
        let mut eight = [0; 8];
        eight.copy_from_slice(word);
        let mixed = u64::from_le_bytes(eight) ^ u64::from(rest);
        rest = (0..8).fold(0, |sum, i| sum ^ TABLES[7 - i][(mixed >> (8 * i) & 255) as usize]);
    }
    for &byte in words.remainder() {
        rest = rest >> 8 ^ TABLES[0][((rest ^ u32::from(byte)) & 255) as usize];
    }
    !rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_rfc() {
        // RFC 3720, B.4.
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(crc32c(&(0..32).collect::<Vec<u8>>()), 0x46dd_794e);
    }

    #[test]
    fn differences_wrap_around() {
        assert_eq!(summed(vec![250, 10, 0], 1), [250, 4, 4]);
        assert_eq!(summed(vec![0xff, 0x01, 0x01, 0xff], 2), [0xff, 0x01, 0x00, 0x01]);
    }
}
