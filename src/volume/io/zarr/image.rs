//! One volume of an image or array: its level, frame and channel, and where its voxels are.

use super::array::Array;
use super::axes::{Axes, Axis, Role, shown};
use super::choice::{self, Chosen, Detail};
use super::chunks::Wanted;
use super::fetch;
use super::multiscale::Multiscale;
use super::node::{Node, join};
use super::tree::Tree;
use crate::volume::io::field;
use crate::volume::io::reading::{Item, Part, Reading, pick};
use crate::volume::{Grid, LengthUnit, Space, Volume, VoxelType, Voxels};
use crate::{Error, Result};
use glam::{DMat3, DVec3};

/// One array of an image, and what its dimensions are.
struct Level {
    array: Array,
    axes: Axes,
}

impl Level {
    fn new(array: Array, named: &[Axis]) -> Result<Self> {
        let axes = Axes::new(&array, named)?;
        Ok(Self { array, axes })
    }

    fn dims(&self) -> [usize; 3] {
        self.axes.dims(&self.array.shape)
    }
}

/// Sizes of voxels and the place of the first one, along x, y and z.
#[derive(Debug, Clone, Copy)]
struct Place {
    spacing: [f64; 3],
    origin: [f64; 3],
}

/// The levels of an image, finest first.
pub(super) struct FinestFirst<'i> {
    /// The array of each, what its dimensions are, and where its voxels are.
    pub(super) levels: Vec<(&'i Array, &'i Axes, Grid)>,
    pub(super) frame: usize,
    pub(super) channel: usize,
    /// A volume of one voxel with the properties of the whole.
    pub(super) like: Volume,
}

/// What is to be read.
pub(super) struct Image {
    /// One sentence for each thing that was chosen or supplied.
    pub(super) notes: Vec<String>,
    multiscale: Option<Multiscale>,
    /// All levels; those that were not looked at, or cannot be read, are faults.
    levels: Vec<Result<Level>>,
    level: usize,
    frame: usize,
    channel: usize,
}

impl Image {
    /// What `chosen` holds, as far as more is chosen.
    ///
    /// # Errors
    /// When its metadata are not as they should be, or it has nothing of what is chosen.
    pub(super) fn open(tree: &Tree, chosen: Chosen, reading: &Reading) -> Result<Self> {
        let node = &chosen.node;
        let multiscale = Multiscale::of(node)?;
        let levels: Vec<Result<Level>> = match &multiscale {
            Some(multiscale) => multiscale.levels.iter().map(|level| open_level(tree, node, &level.path, multiscale)).collect(),
            None => vec![open_array(tree, node)],
        };
        let mut image = Self { notes: Vec::new(), multiscale, levels, level: 0, frame: 0, channel: 0 };
        image.level = match (chosen.level, reading.choice.level) {
            (Some(level), None) => level,
            (Some(level), Some(other)) if level != other => {
                let what = format!("volume.level is {other}: the array that is chosen is level {level}");
                return Err(Error::format(&node.path, what));
            }
            (_, Some(_)) => pick(&node.path, Part::Level, reading.choice.level, image.levels.len())?,
            (None, None) => choice::level(&image.details(), reading.pixels, reading.limits.voxel_bytes).unwrap_or(0),
        };
        let level = image.taken()?;
        let (array, axes) = (&level.array, &level.axes);
        let frame = pick(&array.path, Part::Frame, reading.choice.frame, axes.count(&array.shape, Role::Time))?;
        let channel = pick(&array.path, Part::Channel, reading.choice.channel, axes.count(&array.shape, Role::Channel))?;
        (image.frame, image.channel) = (frame, channel);
        image.notes = chosen.note.into_iter().chain(image.told()?).collect();
        Ok(image)
    }

    /// The level that is read.
    ///
    /// # Errors
    /// Why it cannot be.
    fn taken(&self) -> Result<&Level> {
        match &self.levels[self.level] {
            Ok(level) => Ok(level),
            Err(Error::Limit { what, needed, limit }) => Err(Error::Limit { what: what.clone(), needed: *needed, limit: *limit }),
            Err(Error::Format { path, what }) => Err(Error::format(path, what.clone())),
            Err(other) => Err(Error::invalid(other.to_string())),
        }
    }

    fn details(&self) -> Vec<Option<Detail>> {
        let detail = |i: usize| {
            let level = self.levels[i].as_ref().ok()?;
            let dims = level.dims();
            let count = dims.iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
            let bytes = count.saturating_mul(level.array.stored.voxel_type().bytes() as u128);
            Some(Detail { dims, spacing: self.place(i)?.spacing, bytes })
        };
        (0..self.levels.len()).map(detail).collect()
    }

    /// Where the voxels of level `i` are. Where no sizes are given, those of the finest level are 1, and all levels fill the same box.
    fn place(&self, i: usize) -> Option<Place> {
        let level = self.levels[i].as_ref().ok()?;
        if let Some(multiscale) = &self.multiscale {
            if let Some((spacing, origin)) = multiscale.levels[i].geometry(&level.axes) {
                let (_, factors) = multiscale.unit(&level.axes);
                let scaled = |v: [f64; 3]| [0, 1, 2].map(|axis| v[axis] * factors[axis]);
                return Some(Place { spacing: scaled(spacing), origin: scaled(origin) });
            }
        }
        let finest = self.levels.iter().flatten().next()?.dims();
        let dims = level.dims();
        let spacing = [0, 1, 2].map(|axis| finest[axis] as f64 / dims[axis] as f64);
        Some(Place { spacing, origin: spacing.map(|s| 0.5 * (s - 1.0)) })
    }

    /// Sizes of the voxels of level `i`, in words.
    fn sizes(&self, i: usize) -> Option<String> {
        let (level, place) = (self.levels[i].as_ref().ok()?, self.place(i)?);
        let [x, y, z] = place.spacing.map(|s| libm::rint(s * 1e6) / 1e6);
        let unit = self.multiscale.as_ref().and_then(|m| m.unit(&level.axes).0);
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        Some(format!("{} voxels of {x} x {y} x {z}{unit}", shown(&level.dims())))
    }

    /// What was chosen, one sentence each.
    fn told(&self) -> Result<Vec<String>> {
        let level = self.taken()?;
        let mut notes: Vec<String> = level.axes.note.clone().into_iter().collect();
        let Some(multiscale) = &self.multiscale else {
            notes.push("The array tells no sizes of its voxels: taken as 1.".to_owned());
            notes.extend(self.moment(level, &[]));
            return Ok(notes);
        };
        if multiscale.images > 1 {
            let name = multiscale.name.as_ref().map_or(String::new(), |name| format!(", {name:?}"));
            notes.push(format!("The first of {} images{name}, is read.", multiscale.images));
        }
        let sizes = self.sizes(self.level).unwrap_or_default();
        notes.push(match self.levels.len() {
            1 => format!("The image has one level: {sizes}."),
            n => format!("Level {} of 0 to {} is read, of which 0 is the finest: {sizes}.", self.level, n - 1),
        });
        if self.levels[..self.level].iter().any(Result::is_err) {
            notes.push("A finer level cannot be read.".to_owned());
        }
        if multiscale.levels[self.level].geometry(&level.axes).is_none() {
            notes.push("The image tells no sizes of its voxels: taken as 1 at the finest level.".to_owned());
        }
        notes.extend(self.moment(level, &multiscale.channels));
        Ok(notes)
    }

    /// Which frame and channel, where there are several.
    fn moment(&self, level: &Level, channels: &[String]) -> Vec<String> {
        let shape = &level.array.shape;
        let frames = level.axes.count(shape, Role::Time);
        let count = level.axes.count(shape, Role::Channel);
        let frame = (frames > 1).then(|| format!("Frame {} of 0 to {} is read.", self.frame, frames - 1));
        let name = channels.get(self.channel).map_or(String::new(), |name| format!(", {name:?},"));
        let channel = (count > 1).then(|| format!("Channel {} of 0 to {}{name} is read.", self.channel, count - 1));
        frame.into_iter().chain(channel).collect()
    }

    /// What may be chosen.
    pub(super) fn items(&self) -> Vec<Item> {
        let mut items = Vec::new();
        if self.levels.len() > 1 {
            for i in 0..self.levels.len() {
                let about = match &self.levels[i] {
                    Ok(_) => self.sizes(i).unwrap_or_default(),
                    Err(e) => format!("cannot be read: {e}"),
                };
                items.push(Item::new(Part::Level, i.to_string(), about, i == self.level));
            }
        }
        let Ok(level) = &self.levels[self.level] else { return items };
        let count = |role| level.axes.count(&level.array.shape, role);
        let (frames, channels) = (count(Role::Time), count(Role::Channel));
        if frames > 1 {
            items.push(Item::row(Part::Frame, frames, format!("frame {} is taken", self.frame)));
        }
        let names = self.multiscale.as_ref().map_or(&[][..], |m| &m.channels);
        if channels > 1 && names.len() == channels {
            let channel = |(i, name): (usize, &String)| Item::new(Part::Channel, i.to_string(), name.clone(), i == self.channel);
            items.extend(names.iter().enumerate().map(channel));
        } else if channels > 1 {
            items.push(Item::row(Part::Channel, channels, format!("channel {} is taken", self.channel)));
        }
        items
    }

    /// The level that was chosen, or the finest, and those that are coarser, as far as they can be read.
    ///
    /// # Errors
    /// When there is none, or the voxels are labels.
    pub(super) fn finest_first(&self) -> Result<FinestFirst<'_>> {
        let level = self.taken()?;
        let path = &level.array.path;
        if self.multiscale.as_ref().is_some_and(|m| m.labels.is_some()) {
            return Err(Error::format(path, "labels have no levels of detail to be rendered from"));
        }
        let same = |level: &&Level| {
            level.array.stored.voxel_type() == self.levels[self.level].as_ref().map_or(VoxelType::U8, |l| l.array.stored.voxel_type())
        };
        let mut all = Vec::new();
        for (i, level) in self.levels.iter().enumerate().skip(self.level) {
            let Some(level) = level.as_ref().ok().filter(same) else { break };
            all.push((&level.array, &level.axes, self.grid(i, level)?));
        }
        let one = Voxels::zeros(level.array.stored.voxel_type(), 1);
        let unit = self.multiscale.as_ref().and_then(|m| m.unit(&level.axes).0).and_then(LengthUnit::from_word);
        let mut like = field::named(path, Volume::new(Grid::with_spacing([1; 3], [1.0; 3])?, one))?.with_unit(unit);
        // All levels are read, whichever was the one to begin with.
        for note in self.notes.iter().filter(|note| !note.starts_with("Level ")) {
            like = like.with_note(note.clone());
        }
        Ok(FinestFirst { levels: all, frame: self.frame, channel: self.channel, like })
    }

    /// Where the voxels of `level`, the one at `i`, are.
    fn grid(&self, i: usize, level: &Level) -> Result<Grid> {
        let place = self.place(i).unwrap_or(Place { spacing: [1.0; 3], origin: [0.0; 3] });
        let steps = DMat3::from_diagonal(place.spacing.into());
        field::grid(&level.array.path, level.dims(), DVec3::from(place.origin), steps, Space::Unknown)
    }

    /// Reads the voxels.
    ///
    /// # Errors
    /// When they are over the limits or damaged, or their sizes are none.
    pub(super) fn read(self, tree: &Tree, reading: &Reading) -> Result<Volume> {
        let level = self.taken()?;
        let path = &level.array.path;
        let grid = self.grid(self.level, level)?;
        let wanted = Wanted::new(&level.array, &level.axes, self.frame, self.channel);
        let (voxels, missing, total) = fetch::voxels(tree, &wanted, reading)?;
        let kind = voxels.voxel_type();
        let mut volume = field::named(path, Volume::new(grid, voxels))?;
        let unit = self.multiscale.as_ref().and_then(|m| m.unit(&level.axes).0).and_then(LengthUnit::from_word);
        volume = volume.with_unit(unit);
        for note in &self.notes {
            volume = volume.with_note(note.clone());
        }
        if missing > 0 {
            let fill = &level.array.fill.shown;
            volume = volume.with_note(format!("{missing} of {total} chunks are not stored: their voxels have the fill value {fill}."));
        }
        let labels = self.multiscale.as_ref().and_then(|m| m.labels.clone()).filter(|_| !kind.is_float());
        match labels {
            None => Ok(volume),
            Some(mut segments) => {
                let (low, high) = kind.limits();
                // What no voxel can be needs no name.
                segments.retain(|s| (low as i64..=high as i64).contains(&s.value));
                field::named(path, volume.with_segments(segments))
            }
        }
    }
}

fn open_level(tree: &Tree, group: &Node, path: &str, multiscale: &Multiscale) -> Result<Level> {
    let way = join(&group.way, path);
    let node = Node::open(tree, &way)?;
    match node.and_then(|node| node.array()) {
        Some(array) => Level::new(array?, &multiscale.axes),
        None => Err(Error::format(&group.path, format!("the level {path:?} is not there"))),
    }
}

fn open_array(tree: &Tree, node: &Node) -> Result<Level> {
    match node.array() {
        Some(array) => {
            let array = array?;
            let names: Vec<Axis> = array.names.iter().map(|name| Axis::named(name.as_deref().unwrap_or_default())).collect();
            Level::new(array, &names)
        }
        None => Err(Error::format(tree.path(), format!("{:?} is no array", node.name()))),
    }
}
