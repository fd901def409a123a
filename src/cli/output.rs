//! Where results go: a file that appears whole, or stdout.

use super::Usage;
use super::signals::go_on;
use anyhow::{Context, Result, anyhow, bail};
use slicestack::Plane;
use slicestack::files::{Staged, check, was_read};
use slicestack::picture::{Depth, Format};
use std::fs::File;
use std::io::{ErrorKind, Read, Write, stdout};
use std::path::{Path, PathBuf};

/// A place for bytes: a file, or stdout where the path is `-`.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Sink {
    File(PathBuf),
    Stdout,
}

impl Sink {
    /// The sink that `path` names.
    ///
    /// # Errors
    /// When no file can be written there: better told before a long rendering than after.
    pub(super) fn new(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            anyhow::ensure!(!is_closed(), "stdout: is closed: nothing can be written there");
            return Ok(Self::Stdout);
        }
        check_parent(path)?;
        if path.is_dir() {
            bail!("{}: is a directory", path.display());
        }
        check(path)?;
        Ok(Self::File(path.to_path_buf()))
    }

    /// Refuses to replace a file that was read, by whatever name.
    ///
    /// # Errors
    /// [`Usage`] naming it.
    pub(super) fn spare_read(&self) -> Result<()> {
        match self {
            Self::File(path) if was_read(path) => bail!(Usage(format!("{}: would overwrite a part of the input", path.display()))),
            _ => Ok(()),
        }
    }

    /// Refuses to replace what is not of `kind`: an input by a slip of the hand, or any file whose first bytes `is` does not know.
    ///
    /// # Errors
    /// [`Usage`] naming the file.
    pub(super) fn spare(&self, kind: &str, is: fn(&[u8]) -> bool, inputs: &[&Path]) -> Result<()> {
        let Self::File(path) = self else { return Ok(()) };
        let Ok(real) = path.canonicalize() else { return Ok(()) };
        if inputs.iter().any(|input| is_same(input, &real)) {
            bail!(Usage(format!("{}: would overwrite the input", path.display())));
        }
        if !real.is_file() {
            return Ok(());
        }
        let mut head = Vec::new();
        File::open(&real).and_then(|f| f.take(1024).read_to_end(&mut head)).with_context(|| path.display().to_string())?;
        if inputs.iter().any(|input| is_part_of(&real, &head, input)) {
            bail!(Usage(format!("{}: would overwrite a part of the input", path.display())));
        }
        if !head.is_empty() && !is(&head) {
            bail!(Usage(format!("{}: is there already and is no {kind}; remove it or choose another name", path.display())));
        }
        Ok(())
    }

    /// Writes all of `bytes`, or nothing.
    ///
    /// # Errors
    /// As [`Outputs::finish`].
    pub(super) fn write(&self, bytes: &[u8]) -> Result<()> {
        let mut outputs = Outputs::default();
        outputs.add(self, bytes)?;
        outputs.finish()
    }
}

/// All results of a command: they appear together at its end, or none does and every earlier file is as it was.
#[derive(Default)]
pub(super) struct Outputs {
    staged: Staged,
    stdout: Vec<Vec<u8>>,
}

impl Outputs {
    /// Makes the folder `path`, unless it is there; it goes again with a failure.
    ///
    /// # Errors
    /// Where none can be made.
    pub(super) fn folder(&mut self, path: &Path) -> Result<()> {
        Ok(self.staged.folder(path)?)
    }

    /// `bytes` for `sink`.
    ///
    /// # Errors
    /// Where they cannot be written beside the file, and for a file that was read.
    pub(super) fn add(&mut self, sink: &Sink, bytes: &[u8]) -> Result<()> {
        go_on()?;
        sink.spare_read()?;
        match sink {
            Sink::File(path) => self.staged.add(path, bytes)?,
            Sink::Stdout => self.stdout.push(bytes.to_vec()),
        }
        Ok(())
    }

    /// Puts everything where it belongs.
    ///
    /// # Errors
    /// When stdout, a device or a file cannot be written; then no file was replaced.
    pub(super) fn finish(self) -> Result<()> {
        self.stdout.iter().try_for_each(|bytes| print(bytes))?;
        Ok(self.staged.finish()?)
    }
}

/// Finds out whether `path`, which the flag `flag` names, is a folder for results that files can be written into, or can become one; tells whether it
/// is still to be made.
///
/// # Errors
/// [`Usage`] for `-`; for a file, and where nothing can be written.
pub(super) fn is_new_folder(path: &Path, flag: &str) -> Result<bool> {
    if path == Path::new("-") {
        bail!(Usage(format!("{flag} -: results go into a folder; give its name")));
    }
    if path.exists() && !path.is_dir() {
        bail!("{}: is a file, not a folder", path.display());
    }
    check_parent(path)?;
    if path.exists() {
        check(&path.join("file")).map_err(|e| match e {
            slicestack::Error::Io { source, .. } => anyhow!("{}: no file can be written there: {source}", path.display()),
            other => other.into(),
        })?;
        return Ok(false);
    }
    check(path)?;
    Ok(true)
}

/// # Errors
/// Where there is no directory for `path` to be in.
fn check_parent(path: &Path) -> Result<()> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !parent.is_dir() {
        bail!("{}: there is no directory {}", path.display(), parent.display());
    }
    Ok(())
}

/// Whether two names are those of one file: the same after links are followed, or two of its hard links.
fn is_same(input: &Path, real: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (input.metadata(), real.metadata()) {
        use std::os::unix::fs::MetadataExt;
        return (a.dev(), a.ino()) == (b.dev(), b.ino());
    }
    input.canonicalize().is_ok_and(|input| input == real)
}

/// What a file that this command wrote has among its first bytes.
const OWN: &[u8] = b"slicestack";

/// Most bytes of a header that are looked through for names of files.
const HEADER: u64 = 1 << 20;

/// Whether the file `real`, which begins with `start`, belongs to the volume `input`: what standard input comes from, a file of a folder or of a
/// pattern, or the voxels that a header names. Files in a folder that this command wrote belong to nothing.
fn is_part_of(real: &Path, start: &[u8], input: &Path) -> bool {
    let own = start.windows(OWN.len()).any(|w| w == OWN);
    if input == Path::new("-") {
        return is_same(Path::new("/dev/stdin"), real);
    }
    if input.is_dir() {
        return !own && input.canonicalize().is_ok_and(|folder| real.starts_with(folder));
    }
    let folder = input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = folder.canonicalize().is_ok_and(|folder| real.parent() == Some(&folder));
    if !input.exists() {
        // A pattern.
        return !own && beside;
    }
    let extension = |path: &Path| path.extension().map(|e| e.to_ascii_lowercase()).unwrap_or_default();
    let pair = |a: &str, b: &str| extension(input) == a && extension(real) == b && input.file_stem() == real.file_stem();
    if beside && (pair("hdr", "img") || pair("img", "hdr")) {
        return true;
    }
    if !["mhd", "nhdr"].iter().any(|e| extension(input) == *e) {
        return false;
    }
    let mut header = Vec::new();
    let read = File::open(input).and_then(|f| f.take(HEADER).read_to_end(&mut header));
    let text = String::from_utf8_lossy(&header);
    // Names with numbers in them stand for files beside the header.
    let named = real.file_name().is_some_and(|name| text.contains(&*name.to_string_lossy()));
    read.is_ok() && (named || beside && text.contains('%'))
}

/// Writes `bytes` to stdout. A reader that has gone (`| head`) is no error.
///
/// # Errors
/// Whatever else stdout says.
pub(super) fn print(bytes: &[u8]) -> Result<()> {
    let mut out = stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout"),
    }
}

/// Whether the command was started with stdout closed. The standard library then opens `/dev/null` in its place, to read and to write; a shell's
/// `>/dev/null` is opened to write alone. Known on Linux.
fn is_closed() -> bool {
    let flags = std::fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = flags.lines().find_map(|line| u32::from_str_radix(line.strip_prefix("flags:")?.trim(), 8).ok());
    let is_null = || std::fs::read_link("/proc/self/fd/1").is_ok_and(|to| to == Path::new("/dev/null"));
    flags.is_some_and(|flags| flags & 3 == 2) && is_null()
}

/// Format and depth of a picture for `sink`.
///
/// # Errors
/// [`Usage`] when neither a file name nor `--format` tells the format.
pub(super) fn encoding(sink: &Sink, format: Option<&str>, depth: &str) -> Result<(Format, Depth)> {
    let depth = if depth == "16" { Depth::Sixteen } else { Depth::Eight };
    let named = format.and_then(Format::of_name);
    let format = match (named, sink) {
        (Some(format), _) => format,
        (None, Sink::Stdout) => Format::Png,
        (None, Sink::File(path)) => Format::of_path(path).map_err(|e| Usage(e.to_string()))?,
    };
    if depth == Depth::Sixteen && !format.takes_depth() {
        bail!(Usage(format!("--depth 16 is for {}; {} holds {}", with_depth(), format.title(), format.components())));
    }
    Ok((format, depth))
}

/// Whether a file that begins with `start` is a picture like those written here. Of NumPy files only such arrays are: others are data, such as
/// volumes.
pub(super) fn is_picture(start: &[u8]) -> bool {
    match Format::of_start(start) {
        Some(Format::Npy) => {
            matches!(npy_shape(start).as_deref(), Some([_, _, 4]))
        }
        Some(_) => true,
        None => false,
    }
}

/// The shape of the NumPy array of little-endian f32 in C order that a file beginning with `start` holds.
fn npy_shape(start: &[u8]) -> Option<Vec<u64>> {
    if Format::of_start(start) != Some(Format::Npy) {
        return None;
    }
    let text = String::from_utf8_lossy(start.get(10..).unwrap_or_default());
    let header = text.lines().next().unwrap_or_default();
    let shape = header.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')')).map_or("", |(shape, _)| shape);
    let plain = header.contains("'<f4'") && header.contains("'fortran_order': False");
    if plain { shape.split(',').map(|side| side.trim().parse().ok()).collect() } else { None }
}

/// Whether a file that begins with `start` is a plane like those written here: an OpenEXR file that says so, or a NumPy array of one or three
/// f32 a pixel.
pub(super) fn is_plane(start: &[u8]) -> bool {
    let sides = npy_shape(start);
    Plane::is_exr(start) || matches!(sides.as_deref(), Some([_, _] | [_, _, 3]))
}

/// Whether a file that begins with `start` holds statistics of this command: keys come in the order of the alphabet.
pub(super) fn is_statistics(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let first = text.trim_start_matches(|c: char| c == '{' || c.is_whitespace());
    let begins = ["\"depths\"", "\"error_estimate\"", "\"fetches\""].iter().any(|key| first.starts_with(key));
    text.starts_with('{') && begins && text.contains("\"fragments\"")
}

/// Whether a file that begins with `start` holds a record of this command.
pub(super) fn is_record(start: &[u8]) -> bool {
    start.starts_with(b"{\"format\":\"slicestack explain")
}

/// The formats that `--depth` is for: "PNG and TIFF".
fn with_depth() -> String {
    Format::ALL.into_iter().filter(|f| f.takes_depth()).map(Format::title).collect::<Vec<_>>().join(" and ")
}

#[cfg(test)]
mod tests {
    use super::{is_picture, is_plane, is_record, is_statistics};

    #[test]
    fn only_the_like_of_what_is_written_gives_way() {
        let npy = |descr: &str, shape: &str| {
            let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((header.len() as u16).to_le_bytes());
            bytes.extend(header.as_bytes());
            bytes
        };
        assert!(is_picture(&npy("<f4", "(512, 512, 4)")));
        for data in
            [npy("<f4", "(4, 5, 6)"), npy("<f8", "(10, 10, 4)"), npy("<f4", "(1000,)"), npy("<f4", "(2, 3, 3, 4)"), npy("<f4", "(7, 4)")]
        {
            assert!(!is_picture(&data), "{}", String::from_utf8_lossy(&data));
        }
        assert!(is_plane(&npy("<f4", "(512, 512)")) && is_plane(&npy("<f4", "(512, 512, 3)")));
        for other in [npy("<f4", "(512, 512, 4)"), npy("<f8", "(10, 10)"), npy("<f4", "(1000,)"), b"\x76\x2f\x31\x01 another".to_vec()] {
            assert!(!is_plane(&other), "{}", String::from_utf8_lossy(&other));
        }
        assert!(is_picture(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR") && !is_picture(b"GIF89a, twelve bytes") && !is_picture(b"{\"a\": 1}"));
        assert!(is_statistics(b"{\n  \"fetches\": 85544,\n  \"fragments\": 77378,"));
        assert!(is_statistics(b"{\n  \"error_estimate\": 0.1,\n  \"fetches\": 85544,\n  \"fragments\": 77378,"));
        assert!(!is_statistics(b"{\"package\": \"fetches\"}") && !is_statistics(b"{\"volume\": {\"path\": \"a.nrrd\"}}"));
        assert!(is_record(b"{\"format\":\"slicestack explain 1\",") && !is_record(b"{\"format\":\"other\"}"));
    }
}
