//! TIFF files of many pages: stacks, ImageJ's hyperstacks, OME-TIFF, BigTIFF.
//!
//! Source of the format: TIFF, revision 6.0 (Adobe, 1992), with Adobe's supplements on deflate and floating point; BigTIFF as libtiff
//! reads it, <http://www.libtiff.org/bigtiff.html>. What the pages are is told by their description: see `ome.rs` and `imagej.rs`;
//! without one each page is a slice.
//!
//! Numbers of a pixel may be kept apart, in strips or tiles of their own. A palette becomes colours. Numbers of less than 8 bits are kept as
//! they are stored, but for colours, which are stretched.
//!
//! Directories are read and strips unpacked here, since the crate `tiff` reads no palettes, only the first of numbers that are kept apart,
//! and takes memory by what a directory claims.

mod bytes;
mod codec;
mod decode;
mod directory;
mod entry;
mod imagej;
mod layout;
mod ome;
mod series;

pub(super) use directory::Tiff;

use super::NO_SIZES;
use super::field::named;
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading, pick};
use super::slices::{self, Color, Pixels, Take};
use super::source::{Source, Tail};
use super::store::Store;
use crate::volume::{Grid, Volume, VoxelType, Voxels};
use crate::{Error, Result};
use layout::Layout;
use series::{Plane, Series};

pub(super) const READER: Reader = Reader {
    name: "TIFF",
    extensions: &["tif", "tiff", "btf", "tf8"],
    reads: "many pages, BigTIFF, OME-TIFF, ImageJ; integers and floats; strips and tiles; LZW, deflate and PackBits",
    parts: &[Part::Series, Part::Frame, Part::Channel],
    probe: |clues| if directory::starts(clues.head) { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: Some(list),
};

/// What a file holds, and what of it is taken.
struct Chosen {
    tiff: Tiff,
    series: Series,
    pixels: Pixels,
    /// Whether colours of a palette come in place of their positions in it.
    expand: bool,
    take: Take,
    /// Among the planes that are kept apart by channel.
    channel: usize,
    frame: usize,
}

impl Chosen {
    /// # Errors
    /// When there is nothing of what is chosen, and for what is not supported.
    fn new(store: Store, reading: &Reading) -> Result<Self> {
        let tiff = Tiff::open(store)?;
        let path = tiff.places.path();
        let series = if ome::is_it(&tiff.description) {
            ome::series(&tiff, reading)?
        } else {
            if let Some(n) = &reading.choice.series {
                return Err(tiff.fault(format!("volume.series is {n}: only OME-TIFF files hold several images")));
            }
            if imagej::is_it(&tiff.description) { imagej::series(&tiff)? } else { Series::plain(&tiff) }
        };
        match series.planes[..] {
            [] => return Err(tiff.fault(format!("none of {} pages is a full image", tiff.pages.len()))),
            [_] => return Err(tiff.fault("one image, not a volume: give the folder that its slices are in")),
            _ => {}
        }
        let first = series.planes[0];
        let expand = !series.plain_palette;
        let pixels = one_page(file(&tiff, &series, first), first.page, expand)?;
        let frame = pick(path, Part::Frame, reading.choice.frame, series.frames)?;
        // Numbers of a pixel are channels too: the faster ones.
        let (channel, take) = match reading.choice.channel {
            None => (0, pixels.whole(path)?),
            chosen => {
                let n = pick(path, Part::Channel, chosen, series.channels * pixels.samples)?;
                (n / pixels.samples, Take::Sample(n % pixels.samples))
            }
        };
        Ok(Self { tiff, series, pixels, expand, take, channel, frame })
    }

    /// Channels of the file: planes that are kept apart, and numbers of a pixel.
    fn channels(&self) -> usize {
        self.series.channels * self.pixels.samples
    }

    /// What a channel is called; empty where it has no name.
    fn name(&self, channel: usize) -> String {
        let own = self.series.names.get(channel).filter(|_| self.series.names.len() == self.channels());
        match own {
            Some(name) if !name.is_empty() => name.clone(),
            _ if self.series.channels == 1 => self.pixels.name(channel).to_owned(),
            _ => String::new(),
        }
    }

    /// Which channel is taken; none where all numbers of a pixel are.
    fn taken(&self) -> Option<usize> {
        match self.take {
            Take::Sample(n) => Some(self.channel * self.pixels.samples + n),
            Take::Colors => None,
        }
    }

    fn planes(&self) -> &[Plane] {
        self.series.of(self.channel, self.frame)
    }

    /// How the first plane is laid out.
    fn layout(&self) -> &Layout {
        let first = self.planes()[0];
        file(&self.tiff, &self.series, first).layout(first.page)
    }

    /// Checks that all planes are alike and within the files, before anything is read.
    fn check(&self) -> Result<()> {
        let mut last = None;
        for plane in self.planes() {
            let tiff = file(&self.tiff, &self.series, *plane);
            let layout = tiff.layout(plane.page);
            if last == Some(layout) {
                continue;
            }
            let found = one_page(tiff, plane.page, self.expand)?;
            if found != self.pixels {
                return Err(decode::unlike(tiff, plane.page, &self.pixels, &found));
            }
            last = Some(layout);
        }
        let layout = self.layout();
        let needed = (self.pixels.width as u128 * self.pixels.height as u128 * layout.samples as u128 * layout.bits as u128).div_ceil(8)
            * self.planes().len() as u128;
        let held = self.series.others.iter().map(|t| t.places.length()).sum::<u64>().saturating_add(self.tiff.places.length());
        let most = layout.most(held);
        if needed > u128::from(most) {
            let count = self.planes().len();
            return Err(self
                .tiff
                .fault(format!("{count} planes of {} take {needed} bytes, there cannot be more than {most}", self.pixels)));
        }
        Ok(())
    }

    /// First byte of the planes, where all of them are one run of numbers as they are needed.
    fn run(&self) -> Result<Option<u64>> {
        let samples = self.take.count();
        if samples != self.pixels.samples || !self.series.others.is_empty() || self.pixels.note(self.take).is_some() {
            return Ok(None);
        }
        let mut bytes = self.tiff.bytes()?;
        let mut run: Option<(u64, u64)> = None;
        for plane in self.planes() {
            let whole = self.pixels.bytes() as u64;
            let found = match plane.raw {
                Some(at) => Some((at, whole)),
                None => self.tiff.run(&mut bytes, plane.page)?,
            };
            run = match (run, found) {
                (None, found) => found,
                (Some((first, length)), Some((at, more))) if first + length == at => Some((first, length + more)),
                _ => return Ok(None),
            };
            if run.is_none() {
                return Ok(None);
            }
        }
        Ok(run.map(|(first, _)| first))
    }

    fn voxels(&self, reading: &Reading) -> Result<Voxels> {
        let (path, pixels, planes) = (self.tiff.places.path(), &self.pixels, self.planes());
        if let Some(first) = self.run()? {
            reading.step(0, 1)?;
            let mut source = Source::open_plain(path, &reading.limits)?;
            source.skip(first)?;
            let dims = [pixels.width * pixels.samples, pixels.height, planes.len()];
            let voxels = source.voxels(dims, pixels.stored, self.tiff.endian, Tail::Ignored)?;
            reading.step(1, 1)?;
            return Ok(voxels);
        }
        slices::stacked(path, reading, (pixels, self.take, planes.len()), |n, out| {
            let plane = planes[n];
            match plane.raw {
                Some(at) => self.tiff.raw((at, plane.page), out),
                None => file(&self.tiff, &self.series, plane).page(plane.page, pixels, self.expand, out),
            }
        })
    }

    /// What is told of the choice.
    fn notes(&self) -> Vec<String> {
        let mut notes = self.series.notes.clone();
        let count = self.channels();
        if let (Some(taken), true) = (self.taken(), count > 1) {
            let name = self.name(taken);
            let name = if name.is_empty() { String::new() } else { format!(" ({name})") };
            notes.push(format!("Channel {taken}{name} of {count} was taken: volume.channel chooses another."));
        } else if self.series.channels > 1 {
            notes.push(format!("The first colours of {count} channels were taken: volume.channel chooses one channel."));
        }
        if self.series.frames > 1 {
            notes.push(format!("Frame {} of {} was taken: volume.frame chooses another.", self.frame, self.series.frames));
        }
        notes.extend(self.pixels.note(self.take));
        let left_out = self.tiff.pages.iter().filter(|p| p.left_out).count();
        if left_out > 0 {
            notes.push(format!("{left_out} of {} pages are smaller versions or masks and were left out.", self.tiff.pages.len()));
        }
        let layout = self.layout();
        notes.extend(layout.notes(self.expand));
        if self.series.spacing == [1.0; 3] && self.series.unit.is_none() {
            notes.push(NO_SIZES.to_owned());
        }
        notes
    }
}

/// The file that `plane` is in.
fn file<'a>(tiff: &'a Tiff, series: &'a Series, plane: Plane) -> &'a Tiff {
    match plane.file {
        0 => tiff,
        n => &series.others[n - 1],
    }
}

/// What the pixels of page `index` are; with `expand` positions in a palette are colours.
fn one_page(tiff: &Tiff, index: usize, expand: bool) -> Result<Pixels> {
    let layout = tiff.layout(index);
    let pixels = layout.pixels().map_err(|e| tiff.fault(format!("page {index}: {e}")))?;
    if layout.color_map.is_none() {
        return Ok(pixels);
    }
    if expand {
        tiff.palette(index)?;
        return Ok(pixels);
    }
    let kind = if layout.bits > 8 { VoxelType::U16 } else { VoxelType::U8 };
    Ok(Pixels { stored: kind.into(), samples: 1, color: Color::Grey, ..pixels })
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let chosen = Chosen::new(store, reading)?;
    chosen.check()?;
    let voxels = chosen.voxels(reading)?;
    let (path, pixels) = (chosen.tiff.places.path(), &chosen.pixels);
    let grid = named(path, Grid::with_spacing([pixels.width, pixels.height, chosen.planes().len()], chosen.series.spacing))?;
    let mut volume = named(path, slices::volume(grid, (pixels, chosen.take), voxels))?;
    if let (Some((slope, intercept)), Some(_)) = (chosen.series.rescale, volume.scalars()) {
        volume = named(path, volume.with_rescale(slope, intercept))?;
    }
    Ok(chosen.notes().into_iter().fold(volume.with_unit(chosen.series.unit), Volume::with_note))
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let chosen = Chosen::new(store, reading)?;
    let mut items = Vec::new();
    if ome::is_it(&chosen.tiff.description) {
        let images = ome::images(&chosen.tiff);
        let taken = reading.choice.series.as_deref().unwrap_or("0");
        if images.len() > 1 {
            items.extend(
                images.into_iter().enumerate().map(|(i, name)| Item::new(Part::Series, i.to_string(), name, i.to_string() == taken)),
            );
        }
    }
    if chosen.channels() > 1 {
        let one = |n: usize| Item::new(Part::Channel, n.to_string(), chosen.name(n), chosen.taken() == Some(n));
        items.extend((0..chosen.channels()).map(one));
    }
    if chosen.series.frames > 1 {
        items.push(Item::row(Part::Frame, chosen.series.frames, "moments of a sequence"));
    }
    Ok(items)
}

/// A file of one image, as a slice of a stack.
pub(super) struct Single {
    tiff: Tiff,
    page: usize,
    /// As for files of many pages.
    expand: bool,
    pub(super) pixels: Pixels,
}

impl Single {
    /// # Errors
    /// When it holds more than one image, or one that is not supported.
    pub(super) fn open(store: Store) -> Result<Self> {
        let tiff = Tiff::open(store)?;
        let images = tiff.images();
        let &[page] = &images[..] else {
            return Err(tiff.fault(format!("{} pages: a slice of a stack has one image (give the file alone)", images.len())));
        };
        let expand = !imagej::is_it(&tiff.description);
        let pixels = one_page(&tiff, page, expand)?;
        // Refuses at once what the file cannot hold.
        tiff.chunks(&mut tiff.bytes()?, page)?;
        Ok(Self { tiff, page, expand, pixels })
    }

    /// Reads its numbers.
    pub(super) fn decode(&self, out: &mut [u8]) -> Result<()> {
        self.tiff.page(self.page, &self.pixels, self.expand, out)
    }

    /// An error about this file.
    pub(super) fn fault(&self, what: &str) -> Error {
        self.tiff.fault(what)
    }

    /// What is to be told of how its numbers are read.
    pub(super) fn notes(&self) -> Vec<String> {
        self.tiff.layout(self.page).notes(self.expand)
    }

    /// Whether it is one of several files that OME-XML describes.
    pub(super) fn is_part(&self) -> bool {
        ome::is_it(&self.tiff.description) && ome::files(&self.tiff) > 1
    }
}

impl Tiff {
    /// Reads the plain numbers at a byte of the file, which are laid out like those of a page.
    fn raw(&self, plane: (u64, usize), out: &mut [u8]) -> Result<()> {
        let (at, page) = plane;
        self.bytes()?.exactly(at, out)?;
        codec::to_native(out, self.layout(page).word(), self.endian);
        Ok(())
    }
}
