//! The one error type of the library: every message names the file or key, and the number at fault.

use std::path::{Path, PathBuf};

/// What can go wrong, from the file on disk to the encoded picture.
///
/// Each variant prints as one line, fit to follow `error: ` on a terminal.
#[derive(Debug, thiserror::Error)]
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
