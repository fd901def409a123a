//! Which files were read: by what the file system knows them by, not by name.

use std::collections::BTreeSet;
#[cfg(any(feature = "formats", feature = "encoders"))]
use std::fs::File;
#[cfg(any(feature = "formats", feature = "encoders"))]
use std::io;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What tells one file from all others: device and inode where there are such, else the path without links.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = std::path::PathBuf;

/// The files read so far; `None` while nobody has asked to remember them.
static READS: Mutex<Option<BTreeSet<Identity>>> = Mutex::new(None);

fn reads() -> MutexGuard<'static, Option<BTreeSet<Identity>>> {
    READS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Remembers from here on which files this process reads volumes, scenes, transfer functions and pictures from; for [`was_read`]. Without it
/// nothing is remembered: a program that runs for long may read one file today and replace it tomorrow.
pub fn remember_reads() {
    reads().get_or_insert_default();
}

/// Whether the file that `path` leads to was read since [`remember_reads`], under whatever name. `false` where there is no such file.
pub fn was_read(path: &Path) -> bool {
    let Some(identity) = identity(path) else { return false };
    reads().as_ref().is_some_and(|reads| reads.contains(&identity))
}

/// Opens the file `path` to read it.
///
/// # Errors
/// What the system says.
#[cfg(any(feature = "formats", feature = "encoders"))]
pub(crate) fn open(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    note(&file);
    #[cfg(not(unix))]
    if let Some(reads) = reads().as_mut() {
        reads.extend(identity(path));
    }
    Ok(file)
}

/// `file` is read.
#[cfg(all(unix, any(feature = "formats", feature = "encoders")))]
pub(crate) fn note(file: &File) {
    if let Some(reads) = reads().as_mut() {
        reads.extend(file.metadata().ok().map(|m| of(&m)));
    }
}

/// `file` is read; it has no identity that is not its path.
#[cfg(all(not(unix), any(feature = "formats", feature = "encoders")))]
pub(crate) fn note(_: &File) {}

#[cfg(unix)]
fn of(metadata: &std::fs::Metadata) -> Identity {
    use std::os::unix::fs::MetadataExt;
    (metadata.dev(), metadata.ino())
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    path.metadata().ok().map(|m| of(&m))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    path.canonicalize().ok()
}

#[cfg(all(test, any(feature = "formats", feature = "encoders")))]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_is_known_by_all_its_names() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::write(at("a"), "x").unwrap();
        fs::write(at("b"), "x").unwrap();
        remember_reads();
        assert!(!was_read(&at("a")));
        drop(open(&at("a")).unwrap());
        assert!(was_read(&at("a")) && !was_read(&at("b")) && !was_read(&at("none")));
        #[cfg(unix)]
        {
            fs::hard_link(at("a"), at("hard")).unwrap();
            std::os::unix::fs::symlink(at("a"), at("soft")).unwrap();
            assert!(was_read(&at("hard")) && was_read(&at("soft")));
        }
        // Another file under the name is another file.
        fs::write(at("c"), "x").unwrap();
        fs::rename(at("c"), at("a")).unwrap();
        assert_eq!(was_read(&at("a")), cfg!(not(unix)));
    }
}
