//! Voxels that a header says to lie in other files: one, or several of which each holds as many as the others.

use super::field::Field;
use super::source::Source;
use crate::settings::Limits;
use crate::{Error, Result};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Most files that voxels are spread over.
const MOST_FILES: usize = 1 << 16;

/// Longest name of a file, with its folders.
const LONGEST_NAME: usize = 4096;

/// What is done with a file before its first voxel comes: lines and bytes skipped, data inflated.
pub(super) type Prepare = Box<dyn Fn(Source) -> Result<Source>>;

/// The numbers that stand in for `%d` in the names of several files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pattern {
    names: String,
    first: i64,
    last: i64,
    step: i64,
}

impl Pattern {
    /// `name%03d.raw first last step`, with one more integer behind it where `more` allows that; `None` for the name of one file, which may have
    /// spaces and `%` in it too. Returns that last integer as well.
    pub(super) fn of(text: &str, more: bool) -> Option<(Self, Option<i64>)> {
        let numbers_of = |count: usize| -> Option<(&str, Vec<i64>)> {
            let mut rest = text.trim_end();
            let mut numbers = Vec::new();
            for _ in 0..count {
                let (before, word) = rest.rsplit_once(|c: char| c.is_ascii_whitespace())?;
                numbers.insert(0, word.parse().ok()?);
                rest = before.trim_end();
            }
            conversion(rest).map(|_| (rest, numbers))
        };
        let found = if more { numbers_of(4).or_else(|| numbers_of(3)) } else { numbers_of(3) };
        let (names, numbers) = found?;
        let pattern = Self { names: names.to_owned(), first: numbers[0], last: numbers[1], step: numbers[2] };
        Some((pattern, numbers.get(3).copied()))
    }

    /// The names, first to last.
    pub(super) fn names(&self, field: Field) -> Result<Vec<String>> {
        let away = self.step == 0 || (self.last > self.first && self.step < 0) || (self.last < self.first && self.step > 0);
        if away {
            return Err(field.fault(format!("a step of {} does not lead from {} to {}", self.step, self.first, self.last)));
        }
        let count = (i128::from(self.last) - i128::from(self.first)) / i128::from(self.step) + 1;
        if count > MOST_FILES as i128 {
            return Err(field.fault(format!("{count} files: at most {MOST_FILES} are read")));
        }
        // A file system's longest name is far below.
        if self.names.len() > LONGEST_NAME {
            return Err(field.fault(format!("a name of {} bytes: at most {LONGEST_NAME} are read", self.names.len())));
        }
        let number = |i: i128| i128::from(self.first) + i * i128::from(self.step);
        (0..count).map(|i| shaped(&self.names, number(i)).ok_or_else(|| field.fault("its % is no %d"))).collect()
    }
}

/// The one `%d` of a name: where it starts, where it ends, whether zeros fill it, and how wide it is.
fn conversion(name: &str) -> Option<(usize, usize, bool, usize)> {
    let at = name.find('%')?;
    let rest = &name[at + 1..];
    let digits = rest.find(|c: char| !c.is_ascii_digit())?;
    let end = at + 1 + digits + 1;
    let width = &rest[..digits];
    (matches!(name.as_bytes()[end - 1], b'd' | b'i' | b'u') && !name[end..].contains('%') && digits < 3).then(|| {
        let wide = width.parse().unwrap_or(0);
        (at, end, width.starts_with('0'), wide)
    })
}

/// The name with `number` in the place of its `%d`.
fn shaped(name: &str, number: i128) -> Option<String> {
    let (at, end, zeros, width) = conversion(name)?;
    let number = if zeros { format!("{number:0width$}") } else { format!("{number:width$}") };
    Some(format!("{}{number}{}", &name[..at], &name[end..]))
}

/// The names on the lines that follow in `source`, up to its end.
pub(super) fn listed(source: &mut Source) -> Result<Vec<String>> {
    let mut names = Vec::new();
    while let Some(line) = source.line()? {
        let name = line.trim();
        if name.is_empty() {
            continue;
        }
        if names.len() == MOST_FILES {
            return Err(source.fault(format!("more than {MOST_FILES} files of voxels are listed")));
        }
        names.push(name.to_owned());
    }
    if names.is_empty() {
        return Err(source.fault("no file is listed after LIST"));
    }
    Ok(names)
}

/// The files that hold the voxels of the header `path`, one after the other, as one stream of `total` bytes.
///
/// # Errors
/// When the bytes do not divide evenly among the files, or the first file cannot be opened.
pub(super) fn joined(path: &Path, names: &[String], total: u64, limits: &Limits, prepare: Prepare) -> Result<Source> {
    let count = names.len() as u64;
    if total % count != 0 {
        return Err(Error::format(path, format!("{total} bytes of voxels cannot be shared out evenly among {count} files")));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut files =
        Files { paths: names.iter().map(|n| folder.join(n)).collect(), next: 0, each: total / count, open: None, limits: *limits, prepare };
    // A wrong name is told before anything is read.
    files.advance().map_err(|e| Error::format(path, e.to_string()))?;
    Ok(Source::from_stream(path, Box::new(files), total, None, limits))
}

/// Files of `each` bytes, read one after the other.
struct Files {
    paths: Vec<PathBuf>,
    next: usize,
    each: u64,
    /// The file that is read, and how many of its bytes are still to come.
    open: Option<(Source, u64)>,
    limits: Limits,
    prepare: Prepare,
}

impl Files {
    /// Opens the next file, where there is one more.
    fn advance(&mut self) -> Result<()> {
        self.open = None;
        if let Some(path) = self.paths.get(self.next) {
            let source = (self.prepare)(Source::open_plain(path, &self.limits)?)?;
            if !source.is_packed() && source.left() < self.each {
                return Err(source.fault(format!("{} bytes of voxels are needed, the file holds {}", self.each, source.left())));
            }
            self.open = Some((source, self.each));
            self.next += 1;
        }
        Ok(())
    }
}

impl Read for Files {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let damaged = |what: String| io::Error::new(io::ErrorKind::InvalidData, what);
        if self.open.as_ref().is_some_and(|(_, left)| *left == 0) {
            self.advance().map_err(|e| damaged(e.to_string()))?;
        }
        let Some((source, left)) = &mut self.open else { return Ok(0) };
        let most = usize::try_from(*left).unwrap_or(usize::MAX).min(out.len());
        let n = source.read(&mut out[..most]).map_err(|e| damaged(format!("{}: {e}", source.path().display())))?;
        if n == 0 && most > 0 {
            return Err(damaged(format!("{}: {left} bytes of voxels are missing at its end", source.path().display())));
        }
        *left -= n as u64;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_told_from_a_name() {
        let names = |text: &str, more| {
            let (pattern, last) = Pattern::of(text, more)?;
            Some((pattern.names(Field::new(Path::new("h"), "data file", text)).map_err(|e| e.to_string()), last))
        };
        let list = |names: &[&str]| Ok(names.iter().map(|&n| n.to_owned()).collect());
        assert_eq!(names("dose 20% iter a.raw", true), None);
        assert_eq!(names("20%d", true), None);
        assert_eq!(names("a %03d.raw 8 10 1", true), Some((list(&["a 008.raw", "a 009.raw", "a 010.raw"]), None)));
        assert_eq!(names("b%d 4 0 -2 2", true), Some((list(&["b4", "b2", "b0"]), Some(2))));
        assert_eq!(names("c%2d.z 1 1 1", false), Some((list(&["c 1.z"]), None)));
        let line = names("d%d 1 5 -1", false).and_then(|n| n.0.err()).unwrap_or_default();
        assert!(line.contains("a step of -1 does not lead from 1 to 5"), "{line}");
        let line = names("d%d 1 99999999 1", false).and_then(|n| n.0.err()).unwrap_or_default();
        assert!(line.contains("99999999 files"), "{line}");
        assert_eq!(names("e%s 1 2 1", true), None);
        assert_eq!(names("f%é 1 2 1", true), None);
        let line = names(&format!("{}%d 1 2 1", "x".repeat(5000)), true).and_then(|n| n.0.err()).unwrap_or_default();
        assert!(line.contains("a name of 5002 bytes"), "{line}");
    }
}
