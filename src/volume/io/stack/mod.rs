//! Stacks of images: a folder, or the files that a pattern stands for, each image one slice.
//!
//! Slices are in the natural order of the files' names: `slice2` comes before `slice10`. All images must be of one kind, size and type.
//! Greys stay one number a voxel, also where every image stores them as equal red, green and blue; colours are kept as colours, or one
//! channel of them where it is chosen. A resolution in the files is one of printing and is passed over: the spacing is 1.

mod names;
mod picture;

use super::Format;
use super::NO_SIZES;
use super::field::named;
use super::folder::Folder;
use super::natural::natural;
use super::reader::{Certainty, Clues, Reader};
use super::reading::{Item, Part, Reading, pick};
use super::slices::{self, Pixels, Take};
use super::store::Store;
use crate::volume::{Grid, Volume};
use crate::{Error, Result};
use names::{Kind, oddities};
use picture::Picture;
use rayon::prelude::*;
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "image stack",
    extensions: &[],
    reads: "a folder or a pattern of PNG, TIFF, JPEG, BMP or PNM images, one a slice, of 8 and 16 bits; float TIFF; greys and colours",
    parts: &[Part::Channel],
    probe,
    read,
    list: Some(list),
};

/// Images whose headers are read at the same time.
const HEADERS: usize = 256;

/// Two images at least, and nothing in the folder that looks like a volume of its own.
fn probe(clues: &Clues) -> Certainty {
    let Some(folder) = clues.folder else { return Certainty::No };
    let names = folder.names();
    let is_stack = names.iter().filter(|name| Kind::of(name).is_some()).nth(1).is_some();
    let is_volume = |name: &String| {
        let name = name.to_ascii_lowercase();
        let extension = name.strip_suffix(".gz").unwrap_or(&name).rsplit_once('.').map_or("", |(_, extension)| extension);
        Kind::of(&name).is_none() && Format::ALL.iter().any(|format| format.extensions().contains(&extension))
    };
    if is_stack && !names.iter().any(is_volume) { Certainty::Hint } else { Certainty::No }
}

/// The slices of a stack, in order.
struct Stack {
    folder: Folder,
    names: Vec<String>,
    /// Files of other kinds.
    others: Vec<String>,
    kind: Kind,
    /// What all of them are.
    pixels: Pixels,
    /// What is to be told of how their numbers are read.
    read: Vec<String>,
}

impl Stack {
    fn open(store: Store) -> Result<Self> {
        let folder = match store {
            Store::Folder(folder) => folder,
            Store::File(source) => return Err(source.fault("one image, not a volume: give its folder")),
        };
        let (mut names, others): (Vec<String>, Vec<String>) = folder.names().iter().cloned().partition(|name| Kind::of(name).is_some());
        names.sort_by(|a, b| natural(a, b));
        let mut kinds = names.iter().filter_map(|name| Some((name, Kind::of(name)?)));
        let Some((first, kind)) = kinds.next() else { return Err(Error::format(folder.path(), "no image in it")) };
        if let Some((other, _)) = kinds.find(|(_, other)| *other != kind) {
            let extension = first.rsplit_once('.').map_or("", |(_, extension)| extension);
            let what = format!(
                "images of several kinds, such as {first:?} and {other:?}: give a pattern of those that are meant, such as \"*.{extension}\""
            );
            return Err(Error::format(folder.path(), what));
        }
        let open = |name: &String| Picture::open(&folder, name, kind);
        let picture = open(&names[0])?;
        if picture.is_part() {
            let what = format!("the OME-XML in {:?} tells how its files belong together: give that file in place of the folder", names[0]);
            return Err(Error::format(folder.path(), what));
        }
        let (pixels, read) = (picture.pixels(), picture.notes());
        for group in names.chunks(HEADERS) {
            let found: Vec<Result<(Pixels, Vec<String>)>> =
                group.par_iter().map(|name| open(name).map(|p| (p.pixels(), p.notes()))).collect();
            for (name, found) in group.iter().zip(found) {
                let (found, notes) = found?;
                if found != pixels || notes != read {
                    let path = folder.place(name);
                    let what = format!("an image of {found}, but {:?} has {pixels}: the images of a stack must be alike", names[0]);
                    return Err(Error::format(
                        &path,
                        if found == pixels { format!("numbers stored unlike those of {:?}", names[0]) } else { what },
                    ));
                }
            }
        }
        Ok(Self { folder, names, others, kind, pixels, read })
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn take(&self, reading: &Reading) -> Result<Take> {
        match reading.choice.channel {
            None => self.pixels.whole(self.path()),
            chosen => Ok(Take::Sample(pick(self.path(), Part::Channel, chosen, self.pixels.samples)?)),
        }
    }

    fn notes(&self, take: Take) -> Vec<String> {
        let (count, first) = (self.names.len(), &self.names[0]);
        let last = &self.names[count - 1];
        let mut notes =
            vec![format!("{count} {} images are the slices, in the order of their names from {first:?} to {last:?}.", self.kind)];
        notes.extend(oddities(&self.names));
        notes.push(NO_SIZES.to_owned());
        if let Some(first) = self.others.first() {
            notes.push(match self.others.len() {
                1 => format!("One file of another kind was passed over: {first:?}."),
                n => format!("{n} files of other kinds were passed over, {first:?} among them."),
            });
        }
        if let (Take::Sample(n), true) = (take, self.pixels.samples > 1) {
            let name = self.pixels.name(n);
            let name = if name.is_empty() { String::new() } else { format!(" ({name})") };
            notes.push(format!("Channel {n}{name} of {} was taken.", self.pixels.samples));
        }
        notes.extend(self.pixels.note(take));
        notes.extend(self.read.iter().cloned());
        notes
    }
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let stack = Stack::open(store)?;
    let take = stack.take(reading)?;
    let (path, pixels) = (stack.path(), &stack.pixels);
    let numbers = slices::stacked(path, reading, (pixels, take, stack.names.len()), |n, out| {
        let picture = Picture::open(&stack.folder, &stack.names[n], stack.kind)?;
        // It may have been replaced since its header was read.
        if picture.pixels() == *pixels { picture.decode(out) } else { Err(picture.changed()) }
    })?;
    let grid = named(path, Grid::with_spacing([pixels.width, pixels.height, stack.names.len()], [1.0; 3]))?;
    let volume = named(path, slices::volume(grid, (pixels, take), numbers))?;
    Ok(stack.notes(take).into_iter().fold(volume, Volume::with_note))
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let stack = Stack::open(store)?;
    let take = stack.take(reading)?;
    let count = if stack.pixels.samples > 1 { stack.pixels.samples } else { 0 };
    Ok((0..count).map(|n| Item::new(Part::Channel, n.to_string(), stack.pixels.name(n), take == Take::Sample(n))).collect())
}
