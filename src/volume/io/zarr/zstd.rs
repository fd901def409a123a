//! Zstandard frames within a size that is known.
//!
//! Source of the format: RFC 8878, sections 3.1.1 and 3.1.2. Frames are decoded by another library, which keeps as much of its output as
//! the frame's window says before it gives any away. A frame of a large window could fill the memory that way, so the frame is given
//! another header: with a window no larger than the output.

use super::codecs::{Want, room};
use crate::volume::io::Endian;
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::{self, Read, Write};

const LE: Endian = Endian::Little;

const MAGIC: u32 = 0xfd2f_b528;
/// With any last half byte: a frame to be passed over.
const SKIPPED: u32 = 0x184d_2a50;

/// The bytes in one or more frames.
pub(super) fn decode(bytes: &[u8], want: Want) -> Result<Vec<u8>, String> {
    let most = want.most();
    let mut out = Bounded { bytes: room(most.min(bytes.len().saturating_mul(16)))?, most };
    frames(bytes, &mut out)?;
    Ok(out.bytes)
}

/// Fills `out` from one or more frames.
pub(super) fn decode_into(bytes: &[u8], out: &mut [u8]) -> Result<(), String> {
    let found = decode(bytes, Want::Exactly(out.len()))?;
    Want::Exactly(out.len()).check(found.len()).map_err(|e| format!("zstd: {e}"))?;
    out.copy_from_slice(&found);
    Ok(())
}

/// Output of so many bytes at most.
struct Bounded {
    bytes: Vec<u8>,
    most: usize,
}

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.most - self.bytes.len() {
            return Err(io::Error::other(format!("its bytes should be {}, there are more", self.most)));
        }
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn frames(mut bytes: &[u8], out: &mut Bounded) -> Result<(), String> {
    while !bytes.is_empty() {
        if bytes.len() < 5 {
            return Err(format!("{} bytes are too few for a frame", bytes.len()));
        }
        let magic = LE.u32(bytes);
        if magic & !15 == SKIPPED {
            let after = bytes.get(4..8).and_then(|length| bytes.get(8 + LE.u32(length) as usize..));
            bytes = after.ok_or("a frame to be passed over is cut short")?;
            continue;
        }
        if magic != MAGIC {
            return Err(format!("no frame starts with {magic:#010x}"));
        }
        let (header, length) = new_header(bytes, out.most)?;
        let mut rest = &bytes[length..];
        let mut decoder = FrameDecoder::new();
        // What the decoder says names its own types; what the bounds say is for people.
        let fault = |done: usize| format!("damaged after {done} bytes");
        let over = |e: io::Error, done: usize| format!("damaged after {done} bytes: {e}");
        decoder.reset(header.chain(&mut rest)).map_err(|_| fault(out.bytes.len()))?;
        while !decoder.is_finished() {
            decoder.decode_blocks(&mut rest, BlockDecodingStrategy::UptoBlocks(1)).map_err(|_| fault(out.bytes.len()))?;
            decoder.collect_to_writer(&mut *out).map_err(|e| over(e, out.bytes.len()))?;
        }
        bytes = rest;
    }
    Ok(())
}

/// A header for the frame that `bytes` starts with, with a window that holds `most` bytes at most but for rounding; and how many bytes the
/// header takes that it replaces.
fn new_header(bytes: &[u8], most: usize) -> Result<([u8; 6], usize), String> {
    let short = "a frame's header is cut short";
    let descriptor = bytes[4];
    let single = descriptor & 0x20 != 0;
    let mut at = 5;
    let mut window = u64::MAX;
    if !single {
        let byte = bytes.get(at).copied().ok_or(short)?;
        window = window_size(byte);
        at += 1;
    }
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let id = bytes.get(at..at + dictionary).ok_or(short)?;
    if id.iter().any(|&b| b != 0) {
        return Err("a frame that needs a dictionary is not supported".to_owned());
    }
    at += dictionary;
    let digits = match descriptor >> 6 {
        0 => usize::from(single),
        code => 1 << code,
    };
    let content = bytes.get(at..at + digits).ok_or(short)?;
    at += digits;
    let content = match content {
        [] => None,
        [byte] => Some(u64::from(*byte)),
        [low, high] => Some(u64::from(u16::from_le_bytes([*low, *high])) + 256),
        _ => Some(content.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b))),
    };
    if let Some(content) = content.filter(|&n| n > most as u64) {
        return Err(format!("its bytes should be {most}, a frame claims {content}"));
    }
    // No copy reaches further back than the output is long.
    let window = window.min(content.unwrap_or(u64::MAX)).min(most as u64);
    let byte = (0..=u8::MAX).find(|&byte| window_size(byte) >= window).unwrap_or(u8::MAX);
    let [a, b, c, d] = MAGIC.to_le_bytes();
    // Of the descriptor only the flag of a checksum stays.
    Ok(([a, b, c, d, descriptor & 4, byte], at))
}

/// The window that a descriptor's exponent and mantissa stand for.
fn window_size(byte: u8) -> u64 {
    let base = 1u64 << (10 + (byte >> 3));
    base + base / 8 * u64::from(byte & 7)
}
