//! Which images belong together: those of one series that lie in parallel planes and are of one size and type.

use super::dataset::{FOREIGN, Found, Kind, LIST, SEGMENTATION, look};
use super::image::{Facts, Image, Layout};
use super::moments::listed;
use crate::volume::io::reading::{Item, Part, Reading};
use crate::volume::io::tree::Tree;
use crate::{Error, Result};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Directions may differ so much in each number within a group, sizes of pixels by so much of themselves.
const ALIKE: f64 = 1e-3;

/// What is said behind the fault of one file, where others can be read.
pub(super) const TAKE_AWAY: &str = ": take the file away to read the others";
/// Groups of one series that a frame is held against, the newest ones: a scan may turn from image to image.
const MOST_OPEN: usize = 256;

/// One frame of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Frame {
    /// Which of the images.
    pub(super) image: usize,
    /// Which of its frames.
    pub(super) frame: usize,
}

/// All that was found in a tree.
pub(super) struct Study {
    pub(super) images: Vec<Image>,
    /// In the order that they are counted in.
    pub(super) groups: Vec<Group>,
    /// What was left out, one sentence each.
    pub(super) left_out: Vec<String>,
    /// Of every series, how many files are damaged, and what is said of the first one. The UID is empty where it is not known; those that may
    /// be no DICOM files at all have none.
    damaged: BTreeMap<Option<String>, (usize, Error)>,
}

/// Frames that belong together.
pub(super) struct Group {
    pub(super) frames: Vec<Frame>,
}

fn compare(a: DVec3, b: DVec3) -> Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

fn compare_maybe(a: Option<DVec3>, b: Option<DVec3>) -> Ordering {
    match (a, b) {
        (Some(a), Some(b)) => compare(a, b),
        (a, b) => a.is_some().cmp(&b.is_some()),
    }
}

impl Study {
    /// Looks into every file of the tree.
    ///
    /// # Errors
    /// When there is no image in it; for one file, when it cannot be read.
    pub(super) fn scan(tree: &Tree, reading: &Reading) -> Result<Self> {
        let mut images = Vec::new();
        let mut others: BTreeMap<Kind, usize> = BTreeMap::new();
        let mut damaged: BTreeMap<Option<String>, (usize, Error)> = BTreeMap::new();
        let mut done = 0;
        tree.visit(&|_| true, &mut |leaf| {
            done += 1;
            reading.step(done, tree.count().map_or(0, |n| n as u64).max(done) * 2)?;
            let path = leaf.path.clone();
            let (series, fault) = match look(leaf) {
                Ok(Found::Image(image)) => {
                    images.push(*image);
                    return Ok(true);
                }
                Ok(Found::Other(what)) => {
                    *others.entry(what).or_default() += 1;
                    return Ok(true);
                }
                Ok(Found::Nothing) => {
                    *others.entry(FOREIGN).or_default() += 1;
                    return Ok(true);
                }
                Ok(Found::Damaged(series, fault)) => (series, fault),
                Err(e) => return Err(e),
            };
            // A file of a folder that is damaged may be of another series than the one that is meant.
            if tree.is_one() {
                return Err(fault);
            }
            // An archive's file is named, not the archive alone.
            let fault = match fault {
                Error::Format { path: at, what } if at == tree.path() => Error::format(path, what),
                other => other,
            };
            damaged.entry(series).and_modify(|(n, _)| *n += 1).or_insert((1, fault));
            Ok(true)
        })?;
        let are = |(&(one, many), &n): (&Kind, &usize)| if n == 1 { format!("1 is {one}") } else { format!("{n} are {many}") };
        let counts: Vec<String> = others.iter().map(are).collect();
        if images.is_empty() {
            return Err(match damaged.into_values().next() {
                Some((_, e)) => e,
                None if tree.is_one() => {
                    let what = match others.keys().next().copied() {
                        None | Some(FOREIGN) => "no DICOM file: it has neither \"DICM\" at byte 128 nor a data set at its start".to_owned(),
                        Some(SEGMENTATION) => {
                            let what = SEGMENTATION.0;
                            format!("a DICOM file that is {what}: it is not read, give the folder of the series that it belongs to")
                        }
                        Some(LIST) => format!("a DICOM file that is {}: give the folder of the files that it lists", LIST.0),
                        Some((what, _)) => {
                            format!("a DICOM file that is {what}: there are no voxels in it, give another file or the folder of a series")
                        }
                    };
                    Error::format(tree.path(), what)
                }
                None if others.is_empty() => Error::format(tree.path(), "there are no files in it"),
                None => Error::format(tree.path(), format!("no DICOM image among its files: {}", counts.join(", "))),
            });
        }
        let left_out = if counts.is_empty() { Vec::new() } else { vec![format!("Files left out: {}.", counts.join(", "))] };
        let groups = grouped(&images);
        Ok(Self { images, groups, left_out, damaged })
    }

    /// What is told of damaged files of other series than that of group `taken`.
    ///
    /// # Errors
    /// When one belongs to that series, or must do so since there is no other one.
    pub(super) fn damaged(&self, tree: &Tree, taken: usize) -> Result<Option<String>> {
        let uid = &self.first(&self.groups[taken]).series;
        let alone = self.images.iter().all(|i| i.series == *uid);
        let of_this = |series: &str| series == uid || (series.is_empty() && alone);
        if let Some((_, (_, fault))) = self.damaged.iter().find(|(series, _)| series.as_deref().is_some_and(of_this)) {
            return Err(match fault {
                Error::Format { path, what } => Error::format(path, format!("{what}{TAKE_AWAY}")),
                other => Error::format(tree.path(), format!("a file of the series cannot be read, {other}{TAKE_AWAY}")),
            });
        }
        let count: usize = self.damaged.values().map(|(n, _)| n).sum();
        let first = self.damaged.values().next();
        Ok(first.map(|(_, fault)| match count {
            1 => format!("A file is left out since it is damaged: {fault}."),
            n => format!("Files left out since they are damaged: {n}, such as {fault}."),
        }))
    }

    /// Which group is read, as far as chosen; the one of most images where it is not.
    ///
    /// # Errors
    /// When there is none like the chosen one, or several.
    pub(super) fn choose(&self, tree: &Tree, reading: &Reading) -> Result<usize> {
        let fault = |what: String| Err(Error::format(tree.path(), what));
        let Some(chosen) = reading.choice.series.as_deref() else {
            // Of several that are as good, the first.
            let best = (0..self.groups.len()).rev().max_by_key(|&i| self.good(&self.groups[i]));
            return Ok(best.unwrap_or(0));
        };
        let count = self.groups.len();
        if let Ok(number) = chosen.parse::<usize>() {
            return match number {
                n if n < count => Ok(n),
                n if count == 1 => fault(format!("volume.series is {n}: there is one series only, series 0")),
                n => fault(format!("volume.series is {n}: there are {count}, 0 to {}", count - 1)),
            };
        }
        let found: Vec<usize> =
            (0..count).filter(|&i| !chosen.is_empty() && self.first(&self.groups[i]).series.starts_with(chosen)).collect();
        match found[..] {
            [one] => Ok(one),
            [] => fault(format!("volume.series is {chosen:?}: none of the {count} series has a UID that starts so")),
            _ => {
                let numbers: Vec<String> = found.iter().take(8).map(usize::to_string).collect();
                fault(format!("volume.series is {chosen:?}: it may be any of {}; give one of these numbers", numbers.join(", ")))
            }
        }
    }

    /// What makes a group the one to read: the more, the better.
    fn good(&self, group: &Group) -> (bool, bool, usize) {
        (self.is_readable(group), !self.first(group).is_localizer(), group.frames.len())
    }

    /// Whether another group is as good as the one that is taken.
    pub(super) fn is_tied(&self, taken: usize) -> bool {
        let best = self.good(&self.groups[taken]);
        self.groups.iter().enumerate().any(|(i, g)| i != taken && self.good(g) == best)
    }

    /// What groups of the same series differ from this one in.
    fn parted_by(&self, group: &Group) -> Vec<String> {
        let this = self.first(group);
        let facts = &this.frames[group.frames[0].frame];
        let mut found = [false; 6];
        for other in self.groups.iter().filter(|g| self.first(g).series == this.series && !std::ptr::eq(*g, group)) {
            let image = self.first(other);
            let those = &image.frames[other.frames[0].frame];
            let size = |l: &Layout| [l.rows, l.columns];
            let rest = |l: &Layout| Layout { rows: 0, columns: 0, ..*l };
            let differs = [
                image.series_number != this.series_number,
                size(&image.layout) != size(&this.layout),
                !same_directions(those, facts),
                !same_spacing(those, facts),
                rest(&image.layout) != rest(&this.layout),
                those.position.is_some() != facts.position.is_some(),
            ];
            found.iter_mut().zip(differs).for_each(|(f, d)| *f |= d);
        }
        let names = ["series number", "size", "orientation", "size of pixels", "type of pixels", "whether positions are given"];
        names.into_iter().zip(found).filter(|(_, f)| *f).map(|(name, _)| name.to_owned()).collect()
    }

    /// Whether any of its images can be read. One that cannot is an error when the group is taken.
    fn is_readable(&self, group: &Group) -> bool {
        group.frames.iter().any(|f| self.images[f.image].unread.is_none())
    }

    /// The image of the group's first frame.
    pub(super) fn first(&self, group: &Group) -> &Image {
        &self.images[group.frames[0].image]
    }

    /// What is known of a group, in a few words: nothing that tells who was examined.
    pub(super) fn about(&self, group: &Group) -> String {
        let image = self.first(group);
        let facts = &image.frames[group.frames[0].frame];
        let mut parts = vec![if image.modality.is_empty() { "images".to_owned() } else { image.modality.clone() }];
        if !image.description.is_empty() {
            parts.push(format!("{:?}", image.description));
        }
        let n = group.frames.len();
        let spacing = facts.spacing.map_or(String::new(), |[y, x]| format!(" of {x} x {y} mm"));
        parts.push(format!("{n} image{}, {} x {} pixels{spacing}", if n == 1 { "" } else { "s" }, image.layout.columns, image.layout.rows));
        if image.is_localizer() {
            parts.push("a localizer".to_owned());
        }
        let by = self.parted_by(group);
        if !by.is_empty() {
            parts.push(format!("apart from others of its series by {}", listed(&by)));
        }
        if !self.is_readable(group) {
            parts.push("cannot be read here".to_owned());
        }
        parts.join(", ")
    }

    /// The groups as they may be chosen.
    pub(super) fn items(&self, taken: usize) -> Vec<Item> {
        let item = |(i, group): (usize, &Group)| Item::new(Part::Series, i.to_string(), self.about(group), i == taken);
        self.groups.iter().enumerate().map(item).collect()
    }
}

/// What all frames of a group have in common to the letter.
fn exactly(image: &Image) -> (Option<i64>, &str, Layout, bool) {
    (image.series_number, &image.series, image.layout, image.is_localizer())
}

/// The groups, in an order that depends neither on names nor on the order of files.
fn grouped(images: &[Image]) -> Vec<Group> {
    let facts = |f: &Frame| &images[f.image].frames[f.frame];
    let mut all: Vec<Frame> =
        images.iter().enumerate().flat_map(|(image, i)| (0..i.frames.len()).map(move |frame| Frame { image, frame })).collect();
    all.sort_by(|a, b| {
        let (ia, ib, fa, fb) = (&images[a.image], &images[b.image], facts(a), facts(b));
        let spacing = |s: Option<[f64; 2]>| s.map_or(DVec3::NEG_ONE, |[y, x]| DVec3::new(y, x, 0.0));
        let direction = |i: usize| compare_maybe(fa.orientation.map(|o| o[i]), fb.orientation.map(|o| o[i]));
        exactly(ia)
            .cmp(&exactly(ib))
            .then_with(|| ia.instance.cmp(&ib.instance))
            .then_with(|| compare_maybe(fa.position, fb.position))
            .then_with(|| direction(0).then_with(|| direction(1)))
            .then_with(|| compare(spacing(fa.spacing), spacing(fb.spacing)))
            .then_with(|| ia.object.cmp(&ib.object))
            .then(a.frame.cmp(&b.frame))
    });
    let mut groups: Vec<Group> = Vec::new();
    // Groups of the same series that are being filled.
    let mut open = 0;
    for frame in all {
        let same = |a: &Frame, b: &Frame| exactly(&images[a.image]) == exactly(&images[b.image]);
        if groups.last().is_some_and(|g| !same(&g.frames[0], &frame)) {
            open = groups.len();
        }
        let fits = |g: &&mut Group| fits(facts(&g.frames[0]), facts(&frame));
        let near = open.max(groups.len().saturating_sub(MOST_OPEN));
        match groups[near..].iter_mut().find(fits) {
            Some(group) => group.frames.push(frame),
            None => groups.push(Group { frames: vec![frame] }),
        }
    }
    groups
}

/// Whether two frames lie in parallel planes and have pixels of the same size.
fn fits(a: &Facts, b: &Facts) -> bool {
    same_directions(a, b) && same_spacing(a, b) && a.position.is_some() == b.position.is_some()
}

fn same_directions(a: &Facts, b: &Facts) -> bool {
    let direction = |a: DVec3, b: DVec3| (a - b).abs().max_element() <= ALIKE;
    match (a.orientation, b.orientation) {
        (Some([ar, ac]), Some([br, bc])) => direction(ar, br) && direction(ac, bc),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Whether pixels are of the same size, or where that is not given of the same ratio.
fn same_spacing(a: &Facts, b: &Facts) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs().max(b.abs());
    match (a.spacing, b.spacing) {
        (Some(a), Some(b)) => close(a[0], b[0]) && close(a[1], b[1]),
        (None, None) => a.aspect == b.aspect,
        _ => false,
    }
}

/// UIDs of images that occur more than once in a group: they may be copies.
pub(super) fn repeated(images: &[Image], group: &Group) -> BTreeSet<usize> {
    let mut first: BTreeMap<&str, usize> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for frame in &group.frames {
        let image = &images[frame.image];
        if image.object.is_empty() {
            continue;
        }
        let earlier = *first.entry(&image.object).or_insert(frame.image);
        if earlier != frame.image {
            found.extend([earlier, frame.image]);
        }
    }
    found
}
