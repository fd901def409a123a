//! The one error type of the library: every message names the file or key, and the number at fault.

use std::fmt;
use std::path::{Path, PathBuf};

/// What can go wrong, from the file on disk to the encoded picture.
///
/// Each variant prints as one line, fit to follow `error: ` on a terminal; `{:?}` prints that line too, so that
/// `fn main() -> slicestack::Result<()>` ends with it.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused a read or a write.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file concerned.
        path: PathBuf,
        /// The system's own word.
        source: std::io::Error,
    },
    /// A file is not what it claims to be.
    #[error("{}: {what}", path.display())]
    Format {
        /// The file concerned.
        path: PathBuf,
        /// What is wrong, with the number at fault.
        what: String,
    },
    /// More was asked for than a limit allows.
    #[error("{what}: {needed} is over the limit of {limit}")]
    Limit {
        /// The quantity, its unit, and whose it is.
        what: String,
        /// How much was asked for.
        needed: u128,
        /// How much is allowed.
        limit: u128,
    },
    /// A scene, grid or setting that cannot be rendered.
    #[error("{0}")]
    Invalid(String),
    /// The work was stopped through [`crate::Progress`].
    #[error("stopped")]
    Stopped,
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl Error {
    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_path_buf(), source }
    }

    /// An [`Error::Format`] for `path`.
    pub fn format(path: impl AsRef<Path>, what: impl Into<String>) -> Self {
        Self::Format { path: path.as_ref().to_path_buf(), what: what.into() }
    }

    /// An [`Error::Invalid`].
    pub fn invalid(what: impl Into<String>) -> Self {
        Self::Invalid(what.into())
    }
}

/// Shorthand for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn debug_prints_the_line_that_display_prints() {
        let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
        let all = [
            (Error::io("a.png", missing), "a.png: entity not found"),
            (Error::format("a.npy", "3 bytes"), "a.npy: 3 bytes"),
            (Error::Limit { what: "a.nrrd: bytes".into(), needed: 7, limit: 6 }, "a.nrrd: bytes: 7 is over the limit of 6"),
            (Error::invalid("image width 0"), "image width 0"),
            (Error::Stopped, "stopped"),
        ];
        for (error, line) in all {
            assert_eq!((format!("{error}"), format!("{error:?}"), format!("{error:#?}")), (line.into(), line.into(), line.into()));
        }
    }
}
