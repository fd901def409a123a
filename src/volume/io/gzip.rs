//! Gzip files of one or more members, with the padding that tools leave behind them.

use flate2::bufread::GzDecoder;
use std::io::{self, BufRead, Read};

/// Inflates every member of a gzip file in turn, checking each one's checksum.
///
/// Zeros after the last member (padding to a block) are passed over; anything else there is an error.
pub(super) struct Members<R> {
    /// `None` only while one member gives way to the next, and at the end.
    member: Option<GzDecoder<R>>,
}

impl<R: BufRead> Members<R> {
    pub(super) fn new(inner: R) -> Self {
        Self { member: Some(GzDecoder::new(inner)) }
    }
}

impl<R: BufRead> Read for Members<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if out.is_empty() {
            return Ok(0);
        }
        while let Some(member) = &mut self.member {
            let n = member.read(out)?;
            if n > 0 {
                return Ok(n);
            }
            let Some(mut inner) = self.member.take().map(GzDecoder::into_inner) else { break };
            loop {
                let ahead = inner.fill_buf()?;
                let zeros = ahead.iter().take_while(|&&b| b == 0).count();
                match ahead.get(zeros) {
                    None if zeros == 0 => return Ok(0),
                    None => inner.consume(zeros),
                    Some(0x1f) => {
                        inner.consume(zeros);
                        self.member = Some(GzDecoder::new(inner));
                        break;
                    }
                    Some(_) => return Err(io::Error::new(io::ErrorKind::InvalidData, "bytes that are no gzip data follow its end")),
                }
            }
        }
        Ok(0)
    }
}
