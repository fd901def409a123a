//! Bytes that stand in a file as base64 (RFC 4648, section 4), decoded as they are asked for.

use super::super::source::Source;
use std::io::{self, Read};

/// Characters decoded at a time.
const CHUNK: usize = 1 << 16;
/// What stands for no digit in [`DIGITS`].
const NONE: u8 = 0xff;
/// What stands for the padding in [`DIGITS`].
const PAD: u8 = 0xfe;

/// The digit that each character stands for.
const DIGITS: [u8; 256] = {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut digits = [NONE; 256];
    let mut digit = 0;
    while digit < 64 {
        digits[alphabet[digit] as usize] = digit as u8;
        digit += 1;
    }
    digits[b'=' as usize] = PAD;
    digits
};

/// The bytes that the next characters of a file stand for. Padding may stand between them: VTK ends what it encodes in several parts, such as
/// a table and the blocks it describes, each for itself.
pub(super) struct Base64 {
    source: Source,
    /// Characters that may be read.
    left: u64,
    bytes: Vec<u8>,
    /// Of `bytes`, how many are given out.
    given: usize,
    quad: [u8; 4],
    /// Of `quad`, how many digits are there.
    have: usize,
    /// The character at which decoding ended.
    stopped: Option<u8>,
}

impl Base64 {
    /// At most `left` characters of `source`.
    pub(super) fn new(source: Source, left: u64) -> Self {
        Self { source, left, bytes: Vec::new(), given: 0, quad: [0; 4], have: 0, stopped: None }
    }

    /// Decodes the next characters.
    fn refill(&mut self) -> io::Result<()> {
        self.bytes.clear();
        self.given = 0;
        let most = self.left.min(CHUNK as u64) as usize;
        let Self { source, bytes, quad, have, stopped, .. } = self;
        let text = source.peek(most.max(1)).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.to_string()))?;
        let text = &text[..text.len().min(most)];
        for &c in text {
            let digit = DIGITS[usize::from(c)];
            if digit == NONE {
                if c.is_ascii_whitespace() {
                    continue;
                }
                *stopped = Some(c);
                break;
            }
            quad[*have] = digit;
            *have += 1;
            if *have == 4 {
                *have = 0;
                let pads = quad.iter().rev().take_while(|&&d| d == PAD).count();
                if pads > 2 || quad[..4 - pads].contains(&PAD) {
                    *stopped = Some(b'=');
                    break;
                }
                let word = quad.iter().fold(0, |w: u32, &d| w << 6 | u32::from(d & 63));
                bytes.extend_from_slice(&word.to_be_bytes()[1..4 - pads]);
            }
        }
        let read = text.len();
        if read == 0 {
            // The padding at the end may be missing.
            let digits = quad[..*have].iter().take_while(|&&d| d != PAD).count();
            let word = quad[..digits].iter().fold(0, |w: u32, &d| w << 6 | u32::from(d)) << (6 * (4 - digits));
            bytes.extend_from_slice(&word.to_be_bytes()[1..digits.max(1)]);
            *have = 0;
        }
        self.source.consume(read);
        self.left = if read == 0 { 0 } else { self.left - read as u64 };
        Ok(())
    }
}

impl Read for Base64 {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.given == self.bytes.len() {
            if let Some(c) = self.stopped {
                let what = format!("\"{}\" stands where base64 has no such character", std::ascii::escape_default(c));
                return Err(io::Error::new(io::ErrorKind::InvalidData, what));
            }
            let ended = self.left == 0 && self.have < 2;
            if ended || out.is_empty() {
                return Ok(0);
            }
            self.refill()?;
        }
        let n = out.len().min(self.bytes.len() - self.given);
        out[..n].copy_from_slice(&self.bytes[self.given..self.given + n]);
        self.given += n;
        Ok(n)
    }
}
