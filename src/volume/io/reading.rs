//! What a reader is asked for: which of several volumes is meant, within which limits, and who is told how far it has come.

use crate::settings::{Limits, Progress};
use crate::{Error, Result};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// What several volumes in one file or folder are told apart by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Part {
    /// One acquisition of a study: DICOM.
    Series,
    /// One of several named arrays.
    Array,
    /// One resolution of the same image: 0 is the finest.
    Level,
    /// One moment of a sequence.
    Frame,
    /// One number of several that each voxel has: red, green and blue, or the stains of a microscope.
    Channel,
}

impl Part {
    /// Its key in the section `[volume]` of a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Series => "series",
            Self::Array => "array",
            Self::Level => "level",
            Self::Frame => "frame",
            Self::Channel => "channel",
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Which of the volumes in a file or folder is meant. What is not given is chosen by the reader, which tells it in [`crate::Volume::notes`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Choice {
    /// A series by its number, counted from 0 as [`list`](super::list) gives them, or by the beginning of its UID.
    pub series: Option<String>,
    /// An array by its name.
    pub array: Option<String>,
    /// A level of detail, counted from 0, the finest.
    pub level: Option<usize>,
    /// A frame of a sequence, counted from 0.
    pub frame: Option<usize>,
    /// A channel, counted from 0.
    pub channel: Option<usize>,
    /// Whether of voxels of several numbers the magnitude is meant, the square root of the sum of their squares, and no channel.
    pub magnitude: bool,
}

impl Choice {
    /// Nothing chosen.
    pub fn new() -> Self {
        Self::default()
    }

    /// The choice of a series: its number, counted from 0, or the beginning of its UID.
    #[must_use]
    pub fn series(mut self, series: impl Into<String>) -> Self {
        self.series = Some(series.into());
        self
    }

    /// The choice of an array by its name.
    #[must_use]
    pub fn array(mut self, name: impl Into<String>) -> Self {
        self.array = Some(name.into());
        self
    }

    /// The choice of a level of detail, counted from 0, the finest.
    #[must_use]
    pub fn level(mut self, level: usize) -> Self {
        self.level = Some(level);
        self
    }

    /// The choice of a frame, counted from 0.
    #[must_use]
    pub fn frame(mut self, frame: usize) -> Self {
        self.frame = Some(frame);
        self
    }

    /// The choice of a channel, counted from 0.
    #[must_use]
    pub fn channel(mut self, channel: usize) -> Self {
        self.channel = Some(channel);
        self
    }

    /// The choice of the magnitude of all channels.
    #[must_use]
    pub fn magnitude(mut self) -> Self {
        self.magnitude = true;
        self
    }

    /// What is chosen, in words.
    fn given(&self) -> impl Iterator<Item = (Part, String)> {
        let number = |n: Option<usize>| n.map(|n| n.to_string());
        let all = [
            (Part::Series, self.series.clone()),
            (Part::Array, self.array.clone()),
            (Part::Level, number(self.level)),
            (Part::Frame, number(self.frame)),
            (Part::Channel, number(self.channel)),
        ];
        all.into_iter().filter_map(|(part, value)| Some((part, value?)))
    }
}

/// How a file or folder is read.
///
/// ```
/// use slicestack::Limits;
/// use slicestack::volume::io::{Choice, Reading};
///
/// let reading = Reading::new().limits(Limits::new().voxel_bytes(1 << 30)).choice(Choice::new().frame(3));
/// assert_eq!(reading.choice.frame, Some(3));
/// ```
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Reading {
    /// Limits on memory.
    pub limits: Limits,
    /// Which of several volumes is meant.
    pub choice: Choice,
    /// Pixels along the shorter side of the picture that is to be made. Where several levels of detail are there and none is chosen, the
    /// coarsest is taken whose voxels are not larger than pixels when the box fills the picture; without this number, the finest.
    pub pixels: Option<u32>,
    /// Who is told how far it has come.
    pub progress: Option<Arc<dyn Progress>>,
}

impl Reading {
    /// Nothing chosen, the default limits, nobody told.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with other limits.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// The same with another choice.
    #[must_use]
    pub fn choice(mut self, choice: Choice) -> Self {
        self.choice = choice;
        self
    }

    /// The same for a picture of so many pixels along its shorter side; see [`Reading::pixels`](field@Reading::pixels).
    #[must_use]
    pub fn pixels(mut self, pixels: impl Into<Option<u32>>) -> Self {
        self.pixels = pixels.into();
        self
    }

    /// The same with `progress` told.
    #[must_use]
    pub fn progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = Some(progress);
        self
    }

    /// Tells that `done` of `total` steps of reading are over.
    ///
    /// # Errors
    /// [`Error::Stopped`] when the work is to stop.
    pub(super) fn step(&self, done: u64, total: u64) -> Result<()> {
        match &self.progress {
            Some(progress) if !progress.step("reading", done, total) => Err(Error::Stopped),
            _ => Ok(()),
        }
    }

    /// Refuses a choice that a format does not know, here files of `format` that are told apart by `parts` alone.
    pub(super) fn check(&self, path: &Path, format: &str, parts: &[Part]) -> Result<()> {
        match self.choice.given().find(|(part, _)| !parts.contains(part)) {
            Some((part, value)) => Err(Error::format(path, format!("volume.{part} is {value}: {format} has no {part} to choose"))),
            None => Ok(()),
        }
    }
}

/// Which of `count` is meant where `chosen` was given: the first one unless it was.
///
/// # Errors
/// When there are not so many.
pub(super) fn pick(path: &Path, part: Part, chosen: Option<usize>, count: usize) -> Result<usize> {
    match chosen {
        None => Ok(0),
        Some(n) if n < count => Ok(n),
        Some(n) if count == 1 => Err(Error::format(path, format!("volume.{part} is {n}: there is one {part} only, {part} 0"))),
        Some(n) => Err(Error::format(path, format!("volume.{part} is {n}: there are {count}, 0 to {}", count - 1))),
    }
}

/// What is said where there is no array `name`, but those of `names`.
pub(super) fn no_array<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> String {
    const SHOWN: usize = 8;
    let names: Vec<String> = names.map(|n| format!("{n:?}")).collect();
    match names.len() {
        0 => format!("volume.array is {name:?}: there is none that can be read"),
        n if n > SHOWN => format!("volume.array is {name:?}: there are {}, and {} more", names[..SHOWN].join(", "), n - SHOWN),
        _ => format!("volume.array is {name:?}: there are {}", names.join(", ")),
    }
}

/// One of the things in a file or folder that can be chosen, or several of a kind in a row.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Item {
    /// What it is.
    pub part: Part,
    /// What to give as the key's value: a number or a name; of several in a row the first one.
    pub id: String,
    /// How many there are in a row: 1 for all but frames and channels.
    pub count: usize,
    /// What is known of it, in a few words: nothing that identifies a person.
    pub about: String,
    /// Whether it is the one that is read, as far as chosen.
    pub taken: bool,
}

impl Item {
    /// One item.
    pub(super) fn new(part: Part, id: impl Into<String>, about: impl Into<String>, taken: bool) -> Self {
        Self { part, id: id.into(), count: 1, about: about.into(), taken }
    }

    /// So many in a row, counted from 0.
    pub(super) fn row(part: Part, count: usize, about: impl Into<String>) -> Self {
        Self { part, id: "0".to_owned(), count, about: about.into(), taken: true }
    }
}
