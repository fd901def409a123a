//! Bytes written as pairs of hexadecimal digits.

use std::io::{self, BufRead, Read};

/// Reads the bytes behind pairs of digits; white space between digits is passed over.
pub(super) struct Hex<R> {
    inner: R,
}

impl<R: BufRead> Hex<R> {
    pub(super) fn new(inner: R) -> Self {
        Self { inner }
    }

    /// The next digit, or `None` at the end.
    fn digit(&mut self) -> io::Result<Option<u8>> {
        loop {
            let Some(&byte) = self.inner.fill_buf()?.first() else { return Ok(None) };
            self.inner.consume(1);
            if !byte.is_ascii_whitespace() {
                let digit = char::from(byte).to_digit(16);
                let no_digit = || io::Error::new(io::ErrorKind::InvalidData, format!("{:?} is no hexadecimal digit", char::from(byte)));
                return digit.map(|d| Some(d as u8)).ok_or_else(no_digit);
            }
        }
    }
}

impl<R: BufRead> Read for Hex<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        for (n, byte) in out.iter_mut().enumerate() {
            let Some(high) = self.digit()? else { return Ok(n) };
            let low = self.digit()?;
            let low = low.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "the last byte has one digit only"))?;
            *byte = high << 4 | low;
        }
        Ok(out.len())
    }
}
