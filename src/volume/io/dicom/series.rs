//! Which images belong together: those of one series that lie in parallel planes and are of one size and type.

use super::dataset::{Found, look};
use super::image::{Image, Layout};
use crate::volume::io::reading::{Item, Part, Reading};
use crate::volume::io::tree::Tree;
use crate::{Error, Result};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Directions may differ so much in each number within a group, sizes of pixels by so much of themselves.
const ALIKE: f64 = 1e-3;

/// What is said of a file that is no DICOM file.
const NOTHING: &str = "no DICOM file";
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
        let mut others: BTreeMap<&str, usize> = BTreeMap::new();
        let mut damaged: Option<(usize, Error)> = None;
        let mut done = 0;
        tree.visit(&|_| true, &mut |leaf| {
            done += 1;
            reading.step(done, tree.count().map_or(0, |n| n as u64).max(done) * 2)?;
            match look(leaf) {
                Ok(Found::Image(image)) => images.push(*image),
                Ok(Found::Other(what)) => *others.entry(what).or_default() += 1,
                Ok(Found::Nothing) => *others.entry(NOTHING).or_default() += 1,
                // A file of a folder that is damaged may be of another series than the one that is meant.
                Err(e @ (Error::Format { .. } | Error::Limit { .. } | Error::Io { .. })) if !tree.is_one() => {
                    damaged = Some(damaged.take().map_or((1, e), |(n, first)| (n + 1, first)));
                }
                Err(e) => return Err(e),
            }
            Ok(true)
        })?;
        let mut left_out: Vec<String> = others.iter().map(|(what, n)| format!("Files left out: {n}, each {what}.")).collect();
        if images.is_empty() {
            return Err(match damaged {
                Some((_, e)) => e,
                None if tree.is_one() => {
                    let what = match others.keys().next().copied() {
                        None | Some(NOTHING) => "no DICOM file: it has neither \"DICM\" at byte 128 nor a data set at its start".to_owned(),
                        Some(what) => {
                            format!("a DICOM file that is {what}: there are no voxels in it, give another file or the folder of a series")
                        }
                    };
                    Error::format(tree.path(), what)
                }
                None if others.is_empty() => Error::format(tree.path(), "there are no files in it"),
                None => {
                    let counts: Vec<String> = others.iter().map(|(what, n)| format!("{n} of {what}")).collect();
                    Error::format(tree.path(), format!("no DICOM image among its files: {}", counts.join(", ")))
                }
            });
        }
        if let Some((n, first)) = damaged {
            left_out.push(format!("Files left out since they are damaged: {n}, such as {first}."));
        }
        let groups = grouped(&images);
        Ok(Self { images, groups, left_out })
    }

    /// Which group is read, as far as chosen; the one of most images where it is not.
    ///
    /// # Errors
    /// When there is none like the chosen one, or several.
    pub(super) fn choose(&self, tree: &Tree, reading: &Reading) -> Result<usize> {
        let fault = |what: String| Err(Error::format(tree.path(), what));
        let Some(chosen) = reading.choice.series.as_deref() else {
            let good = |g: &Group| (self.is_readable(g), !self.first(g).is_localizer(), g.frames.len());
            // Of several that are as good, the first.
            let best = (0..self.groups.len()).rev().max_by_key(|&i| good(&self.groups[i]));
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
fn fits(a: &super::image::Facts, b: &super::image::Facts) -> bool {
    let direction = |a: DVec3, b: DVec3| (a - b).abs().max_element() <= ALIKE;
    let orientation = match (a.orientation, b.orientation) {
        (Some([ar, ac]), Some([br, bc])) => direction(ar, br) && direction(ac, bc),
        (a, b) => a.is_none() && b.is_none(),
    };
    let close = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs().max(b.abs());
    let spacing = match (a.spacing, b.spacing) {
        (Some(a), Some(b)) => close(a[0], b[0]) && close(a[1], b[1]),
        (a, b) => a.is_none() && b.is_none(),
    };
    orientation && spacing && a.position.is_some() == b.position.is_some()
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
