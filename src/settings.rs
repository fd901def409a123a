//! How to run: threads, tiles, vector level, limits, progress. Nothing here may change a pixel.

use crate::{Error, Level, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How much one volume may take: memory, and bytes of a header.
///
/// ```
/// use slicestack::Limits;
///
/// let limits = Limits::new().voxel_bytes(4 << 30).map_bytes(u64::MAX); // at most 4 GiB of voxels, every file read
/// assert_eq!(limits.header_bytes, Limits::default().header_bytes);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// Most bytes the voxels of one volume may take.
    pub voxel_bytes: u64,
    /// Most bytes of a header.
    pub header_bytes: u64,
    /// Files of at least so many bytes of voxels are mapped into memory instead of read, where they hold the voxels as they are
    /// needed: not compressed, in this machine's byte order, in a type that is kept, x fastest, aligned. 0 maps all of them,
    /// `u64::MAX` none.
    ///
    /// A mapped file must not be cut short while the volume lives: the system then ends the process with SIGBUS (on Windows it
    /// refuses the cut). Let files be read instead that others rewrite in place, or that lie on a network drive that may go away.
    pub map_bytes: u64,
    /// Most bytes the voxels of a mapped file may take: they lie in the file, and memory holds no more of them than are looked at.
    pub mapped_bytes: u64,
}

impl Limits {
    /// 16 GiB of voxels, mapped or not, 1 MiB of header; files of 16 MiB of voxels and more are mapped.
    pub const fn new() -> Self {
        Self { voxel_bytes: 16 << 30, header_bytes: 1 << 20, map_bytes: 16 << 20, mapped_bytes: 16 << 30 }
    }

    /// The limits for a volume of which no more than `memory` bytes are held at a time: voxels that can be mapped may be as many as there are.
    pub const fn within(memory: u64) -> Self {
        Self { voxel_bytes: memory, mapped_bytes: u64::MAX, ..Self::new() }
    }

    /// The limits with another most for the bytes of a volume's voxels, mapped or not.
    #[must_use]
    pub const fn voxel_bytes(mut self, bytes: u64) -> Self {
        self.voxel_bytes = bytes;
        self.mapped_bytes = bytes;
        self
    }

    /// The limits with another most for the bytes of the voxels of a mapped file.
    #[must_use]
    pub const fn mapped_bytes(mut self, bytes: u64) -> Self {
        self.mapped_bytes = bytes;
        self
    }

    /// The limits with another most for the bytes of a header.
    #[must_use]
    pub const fn header_bytes(mut self, bytes: u64) -> Self {
        self.header_bytes = bytes;
        self
    }

    /// The limits with files mapped from another number of bytes on: see [`Limits::map_bytes`](field@Limits::map_bytes).
    #[must_use]
    pub const fn map_bytes(mut self, bytes: u64) -> Self {
        self.map_bytes = bytes;
        self
    }
}

impl Default for Limits {
    /// [`Limits::new`].
    fn default() -> Self {
        Self::new()
    }
}

/// Is told how far a long task has come, and may stop it. Called from any thread.
pub trait Progress: Send + Sync {
    /// `done` of `total` steps of the task `what` are over. Returning `false` stops the work with [`crate::Error::Stopped`].
    fn step(&self, what: &str, done: u64, total: u64) -> bool;

    /// Whether the work is to stop: asked often, also within a step.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Most worker threads that are started, whatever is asked for: each takes memory, and those beyond the cores only wait for each other.
pub const MAX_THREADS: usize = 512;

/// How a picture is made. No field changes a byte of it.
///
/// ```
/// use slicestack::{Level, Settings};
///
/// let settings = Settings::new().threads(2).tile(64).level(Level::SCALAR);
/// assert_eq!(settings.threads, Some(2));
/// assert_eq!(settings.threads(None).threads, None); // one per core again
/// ```
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Settings {
    /// Worker threads, of which at most [`MAX_THREADS`] are started; `None` takes one per core.
    pub threads: Option<usize>,
    /// Side of the square screen tiles that threads take in turn, in pixels; `None` lets the plan choose.
    pub tile: Option<u32>,
    /// Vector level; `None` takes the fastest this machine has.
    pub level: Option<Level>,
    /// Limits on memory.
    pub limits: Limits,
    /// Whether the error of a picture is estimated where the scene gives the number of slices. It takes a second picture of twice
    /// as many slices.
    pub estimate: bool,
    /// Who is told about progress.
    pub progress: Option<Arc<dyn Progress>>,
}

impl Settings {
    /// A thread per core, the tile and the vector level that are fastest, the default limits; no error estimate, nobody told.
    pub fn new() -> Self {
        Self::default()
    }

    /// The settings with so many worker threads; `None` takes one per core.
    #[must_use]
    pub fn threads(mut self, threads: impl Into<Option<usize>>) -> Self {
        self.threads = threads.into();
        self
    }

    /// Threads to work with.
    ///
    /// # Errors
    /// [`Error::Invalid`] for 0 of them, and where the system does not start so many.
    pub(crate) fn pool(&self) -> Result<ThreadPool> {
        if self.threads == Some(0) {
            return Err(Error::invalid("threads 0: at least one is needed"));
        }
        let threads = self.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).min(MAX_THREADS);
        ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| Error::invalid(format!("{threads} threads: {e}")))
    }

    /// The settings with tiles of another side, in pixels; `None` lets the plan choose.
    #[must_use]
    pub fn tile(mut self, side: impl Into<Option<u32>>) -> Self {
        self.tile = side.into();
        self
    }

    /// The settings with another vector level; `None` takes the fastest this machine has.
    #[must_use]
    pub fn level(mut self, level: impl Into<Option<Level>>) -> Self {
        self.level = level.into();
        self
    }

    /// The settings with other limits on memory.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// The settings with or without an estimate of the error.
    #[must_use]
    pub fn estimate(mut self, estimate: bool) -> Self {
        self.estimate = estimate;
        self
    }

    /// The settings with `progress` told how far the work has come.
    #[must_use]
    pub fn progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = Some(progress);
        self
    }
}

impl std::fmt::Debug for Settings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Settings")
            .field("threads", &self.threads)
            .field("tile", &self.tile)
            .field("level", &self.level)
            .field("limits", &self.limits)
            .field("estimate", &self.estimate)
            .field("progress", &self.progress.is_some())
            .finish()
    }
}

/// Stops the picture in the making, from any thread: see [`crate::Renderer::stopper`].
#[derive(Debug, Clone, Default)]
pub struct Stopper(Arc<AtomicBool>);

impl Stopper {
    /// The picture in the making ends with [`crate::Error::Stopped`] before long; where none is, the next one does at once.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Forgets that somebody wanted to stop.
    pub(crate) fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// Who hears of the work, and who may stop it.
#[derive(Clone, Copy)]
pub(crate) struct Control<'c> {
    pub(crate) progress: Option<&'c dyn Progress>,
    pub(crate) stopper: &'c Stopper,
}

impl Control<'_> {
    /// `done` of `total` steps of `what` are over; false where the work is to stop.
    pub(crate) fn step(&self, what: &str, done: u64, total: u64) -> bool {
        self.progress.is_none_or(|p| p.step(what, done, total)) && !self.is_stopped()
    }

    /// Whether somebody wants to stop.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopper.0.load(Ordering::Relaxed) || self.progress.is_some_and(Progress::is_stopped)
    }
}
