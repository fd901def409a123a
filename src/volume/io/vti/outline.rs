//! The outline of a VTK file: its XML without the numbers in it, and where those lie.
//!
//! The numbers may be gigabytes of text, or bytes that are no XML at all, which no XML parser should see. So the file is gone through once:
//! what stands outside the arrays is kept as text, bounded by the limit on headers, and of each array only the place of its content is.

use super::super::source::Source;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::ops::Range;

/// Most bytes of one tag or comment.
const LONGEST: usize = 1 << 16;
/// Most attributes of an element. An XML parser compares each with each.
const ATTRIBUTES: usize = 64;
/// Most elements that are open, one in the other.
const DEEPEST: usize = 32;

/// See the module's page.
pub(super) struct Outline {
    /// The XML without the content of arrays; ends where appended data starts.
    pub(super) text: String,
    /// Which bytes of the file are the content of an array, by where in `text` its element starts.
    pub(super) contents: BTreeMap<usize, Range<u64>>,
    /// Where the appended data starts: the byte after its underscore. The source stands there.
    pub(super) appended: Option<u64>,
    /// How many bytes of the file are passed.
    pub(super) place: u64,
}

/// An element whose end has not come yet.
struct Open {
    name: Vec<u8>,
    /// Where it starts in the text, if it is an array.
    array: Option<usize>,
}

struct Scanner<'s> {
    source: &'s mut Source,
    /// Bytes of the file that are passed already.
    place: u64,
    text: Vec<u8>,
    contents: BTreeMap<usize, Range<u64>>,
    open: Vec<Open>,
}

/// Goes through the file up to its appended data, or to its end.
///
/// # Errors
/// When it cannot be read, ends within an element, has a DTD, or its outline is over the limit.
pub(super) fn scan(source: &mut Source) -> Result<Outline> {
    let mut scanner = Scanner { source, place: 0, text: Vec::new(), contents: BTreeMap::new(), open: Vec::new() };
    let appended = scanner.run()?;
    let Scanner { source, place, mut text, contents, open } = scanner;
    for element in open.iter().rev() {
        text.extend([b"</", &element.name[..], b">"].concat());
    }
    let text = String::from_utf8(text).map_err(|e| source.fault(format!("the XML is no UTF-8: {}", e.utf8_error())))?;
    Ok(Outline { text, contents, appended, place })
}

impl Scanner<'_> {
    /// Returns where the appended data starts, if it was reached.
    fn run(&mut self) -> Result<Option<u64>> {
        loop {
            if !self.characters()? {
                let inside = self.open.last().map(|o| String::from_utf8_lossy(&o.name).into_owned());
                return match inside {
                    Some(name) => Err(self.source.fault(format!("the file ends after {} bytes, within the element {name}", self.place))),
                    None => Ok(None),
                };
            }
            let tag = self.markup()?;
            match &tag[..] {
                [b'<', b'?', ..] => {}
                tag if tag.starts_with(b"<!--") => {}
                [b'<', b'!', ..] => self.section(&tag)?,
                [b'<', b'/', ..] => {
                    self.keep(&tag)?;
                    self.open.pop();
                    // Whatever follows the outermost element is not looked at.
                    if self.open.is_empty() {
                        return Ok(None);
                    }
                }
                _ => {
                    let closed = tag.ends_with(b"/>");
                    if tag.iter().filter(|&&b| b == b'=').count() > ATTRIBUTES {
                        return Err(self.source.fault(format!("more than {ATTRIBUTES} attributes in the tag before byte {}", self.place)));
                    }
                    let name: Vec<u8> = tag[1..].iter().copied().take_while(|b| !b.is_ascii_whitespace() && !b"/>".contains(b)).collect();
                    let start = self.text.len();
                    self.keep(&tag)?;
                    if !closed {
                        if self.open.len() == DEEPEST {
                            return Err(self.source.fault(format!("elements more than {DEEPEST} deep in each other")));
                        }
                        let appended = name == b"AppendedData";
                        let array = (name == b"DataArray" || name == b"Array").then_some(start);
                        self.open.push(Open { name, array });
                        if appended {
                            return self.underscore().map(Some);
                        }
                    }
                }
            }
        }
    }

    /// Passes over the characters before the next `<`, which are kept unless they are an array's; false at the end of the file.
    fn characters(&mut self) -> Result<bool> {
        let array = self.open.last().and_then(|o| o.array);
        // The first and last character that are no space.
        let mut solid: Option<Range<u64>> = None;
        loop {
            if self.source.peek(1)?.is_empty() {
                return Ok(false);
            }
            let ahead = self.source.buffered();
            let length = ahead.iter().position(|&b| b == b'<').unwrap_or(ahead.len());
            let (run, found) = (&ahead[..length], length < ahead.len());
            if array.is_some() {
                let first = run.iter().position(|b| !b.is_ascii_whitespace());
                let last = run.iter().rposition(|b| !b.is_ascii_whitespace());
                if let (Some(first), Some(last)) = (first, last) {
                    let start = solid.map_or(self.place + first as u64, |s| s.start);
                    solid = Some(start..self.place + last as u64 + 1);
                }
            } else {
                let run = run.to_vec();
                self.keep(&run)?;
            }
            self.pass(length);
            if found {
                break;
            }
        }
        if let (Some(array), Some(solid)) = (array, solid) {
            if self.contents.insert(array, solid).is_some() {
                return Err(self.source.fault(format!("the content of an array is in several parts before byte {}", self.place)));
            }
        }
        Ok(true)
    }

    /// The next tag, comment or section, from its `<` to its end.
    fn markup(&mut self) -> Result<Vec<u8>> {
        let start = self.source.peek(9)?;
        let end: &[u8] = match start {
            s if s.starts_with(b"<!--") => b"-->",
            s if s.starts_with(b"<![CDATA[") => b"]]>",
            s if s.starts_with(b"<!") => return Err(self.source.fault("the XML has a DTD: not supported")),
            s if s.starts_with(b"<?") => b"?>",
            _ => b">",
        };
        let mut have = 0;
        loop {
            let ahead = self.source.peek(have + 1)?;
            if ahead.len() <= have {
                return Err(self.source.fault(format!("the file ends within a tag, after {} bytes", self.place + have as u64)));
            }
            let ahead = self.source.buffered();
            have = ahead.len();
            let found =
                if end == b">" { end_of_tag(ahead) } else { ahead.windows(end.len()).position(|w| w == end).map(|at| at + end.len()) };
            match found {
                Some(length) if length <= LONGEST => {
                    let tag = ahead[..length].to_vec();
                    self.pass(length);
                    return Ok(tag);
                }
                None if have <= LONGEST => {}
                _ => return Err(self.source.fault(format!("a tag of more than {LONGEST} bytes at byte {}", self.place))),
            }
        }
    }

    /// A section of characters that need no escapes.
    fn section(&mut self, section: &[u8]) -> Result<()> {
        if self.open.last().is_some_and(|o| o.array.is_some()) {
            return Err(self.source.fault(format!("a CDATA section within an array before byte {}: not supported", self.place)));
        }
        self.keep(section)
    }

    /// Passes over the underscore that stands before appended data, and returns where they start.
    fn underscore(&mut self) -> Result<u64> {
        loop {
            match self.source.peek(1)?.first().copied() {
                Some(b'_') => {
                    self.pass(1);
                    return Ok(self.place);
                }
                Some(b) if b.is_ascii_whitespace() => self.pass(1),
                Some(b) => {
                    let shown = std::ascii::escape_default(b);
                    return Err(self
                        .source
                        .fault(format!("AppendedData starts with \"{shown}\" at byte {}, not with an underscore", self.place)));
                }
                None => {
                    return Err(self.source.fault(format!("the file ends after {} bytes, where appended data should start", self.place)));
                }
            }
        }
    }

    fn pass(&mut self, n: usize) {
        self.source.consume(n);
        self.place += n as u64;
    }

    fn keep(&mut self, bytes: &[u8]) -> Result<()> {
        let (needed, limit) = ((self.text.len() + bytes.len()) as u128, u128::from(self.source.limits().header_bytes));
        if needed > limit {
            return Err(Error::Limit { what: format!("{}: bytes of XML outside the arrays", self.source.path().display()), needed, limit });
        }
        self.text.extend(bytes);
        Ok(())
    }
}

/// Bytes of the tag that `text` starts with: up to the first `>` that is not quoted.
fn end_of_tag(text: &[u8]) -> Option<usize> {
    let mut quote = None;
    for (at, &b) in text.iter().enumerate() {
        match quote {
            Some(q) if b == q => quote = None,
            Some(_) => {}
            None if b == b'"' || b == b'\'' => quote = Some(b),
            None if b == b'>' => return Some(at + 1),
            None => {}
        }
    }
    None
}
