//! Files of results, which appear whole or not at all, and which files were read, so that no result replaces one of them.
//!
//! A result is written into a temporary file beside its own name, made for it alone, and renamed once everything is there. Several results of
//! one piece of work ([`Staged`]) are renamed together: where one of them fails, every earlier file stays as it was. Temporary files are known
//! to the process ([`discard_unfinished`]), so that a signal can take them away.
//!
//! ```text
//! bytes --> .slicestack-PID-N.part --+
//! bytes --> .slicestack-PID-N.part --+--> all written? --> renamed, or all taken away
//! ```

mod folder;
mod reads;
mod staged;
mod unfinished;
mod whole;

pub use folder::WholeFolder;
#[cfg(feature = "formats")]
pub(crate) use reads::note;
#[cfg(any(feature = "formats", feature = "encoders"))]
pub(crate) use reads::open;
pub use reads::{remember_reads, was_read};
pub use staged::Staged;
pub use unfinished::discard_unfinished;
pub(crate) use unfinished::discard_unfinished_now;
pub use whole::{Whole, check, write_whole};
