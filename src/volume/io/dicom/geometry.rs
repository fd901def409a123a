//! From the frames of a group to a stack of slices on a grid: their order, what is missing, and which of several moments is meant.
//!
//! Source: DICOM PS3.3, section C.7.6.2.1.1: a pixel lies at position + row direction * column number * column spacing + column direction *
//! row number * row spacing. Slices are ordered by how far their positions lie along the normal, the cross product of the two directions.

use super::image::{Facts, KEYS, key};
use super::series::{Frame, Study};
use crate::volume::Space;
use crate::volume::io::reading::{Part, Reading, pick};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::Path;

/// Distances from slice to slice may differ by so much of themselves.
const UNEVEN: f64 = 0.01;
/// Positions nearer to each other than this are the same, in millimetres.
const NEAREST: f64 = 1e-5;
/// Slices that are made up where some are missing or uneven: at most so many for each one that is there.
const MOST_MADE: usize = 8;

/// How slices that are there become slices of the volume.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Plan {
    /// One to one.
    Direct,
    /// Each has its place among so many; those between are interpolated.
    Fill { places: Vec<usize>, count: usize },
    /// Each of the volume's lies at a place between two, counted in slices that are there.
    Resample { places: Vec<f64> },
}

impl Plan {
    /// Slices of the volume, where `there` are there.
    pub(super) fn count(&self, there: usize) -> usize {
        match self {
            Self::Direct => there,
            Self::Fill { count, .. } => *count,
            Self::Resample { places } => places.len(),
        }
    }
}

/// Slices in their order, and where they lie.
pub(super) struct Stack {
    pub(super) slices: Vec<Frame>,
    pub(super) plan: Plan,
    pub(super) origin: DVec3,
    /// Steps along a row, along a column, and to the next slice.
    pub(super) steps: DMat3,
    pub(super) space: Space,
    /// How many moments there are.
    pub(super) moments: usize,
    pub(super) notes: Vec<String>,
}

/// What images at one position may be told apart by, the surest first.
const SIGNS: [(&str, &[usize]); 8] = [
    ("temporal position", &[key::TEMPORAL]),
    ("trigger time", &[key::TRIGGER]),
    ("echo time", &[key::ECHO]),
    ("b-value", &[key::B_VALUE]),
    ("diffusion", &[key::B_VALUE, key::GRADIENT, key::GRADIENT + 1, key::GRADIENT + 2]),
    ("temporal position, trigger time, echo time and diffusion", ALL_BUT_TIME),
    ("acquisition", &[key::ACQUISITION]),
    ("acquisition time", &[key::TIME]),
];

/// All keys but number and time of the acquisition.
const ALL_BUT_TIME: &[usize] = &[0, 1, 2, 3, 4, 5, 6];

/// Something to order images at one position by.
type Sign = ([Option<f64>; KEYS], Option<String>, usize);

fn sign_of(facts: &Facts, keys: &[usize]) -> [Option<f64>; KEYS] {
    std::array::from_fn(|i| if keys.contains(&i) { facts.keys[i] } else { None })
}

fn order(a: &Sign, b: &Sign) -> std::cmp::Ordering {
    let keys = a.0.iter().zip(&b.0).map(|(a, b)| a.unwrap_or(f64::NEG_INFINITY).total_cmp(&b.unwrap_or(f64::NEG_INFINITY)));
    keys.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then).then_with(|| a.1.cmp(&b.1)).then(a.2.cmp(&b.2))
}

struct Builder<'a> {
    study: &'a Study,
    path: &'a Path,
    notes: Vec<String>,
}

impl Builder<'_> {
    fn facts(&self, frame: &Frame) -> &Facts {
        &self.study.images[frame.image].frames[frame.frame]
    }

    /// What messages call a frame.
    fn name(&self, frame: &Frame) -> String {
        let image = &self.study.images[frame.image];
        let path = image.path.display();
        if image.frames.len() > 1 { format!("frame {} of {path}", frame.frame) } else { path.to_string() }
    }

    fn position(&self, frame: &Frame) -> DVec3 {
        self.facts(frame).position.unwrap_or_default()
    }

    /// Sizes of a pixel along a row and along a column.
    fn pixel(&mut self, first: &Frame) -> [f64; 2] {
        match self.facts(first).spacing {
            Some([y, x]) if y > 0.0 && x > 0.0 => [x, y],
            _ => {
                self.notes.push("The size of a pixel is not given: taken for 1 x 1 mm.".to_owned());
                [1.0, 1.0]
            }
        }
    }

    /// Distance of slices where positions do not tell it.
    fn thickness(&mut self, first: &Frame) -> f64 {
        let facts = self.facts(first);
        let said = [(facts.between, "spacing between slices"), (facts.thickness, "slice thickness")];
        let found = said.into_iter().find_map(|(value, name)| Some((value.filter(|v| *v > 0.0)?, name)));
        match found {
            Some((value, name)) => {
                self.notes.push(format!("Slices are {value} mm apart by the {name}."));
                value
            }
            None => {
                self.notes.push("The distance of slices is not given: taken for 1 mm.".to_owned());
                1.0
            }
        }
    }

    /// Images at the same position: one of each for every moment, ordered, and what they differ in. `None` where nothing tells them apart.
    fn moments(&self, clusters: &[Vec<Frame>]) -> Option<(&'static str, Vec<Vec<Frame>>)> {
        let count = clusters[0].len();
        if clusters.iter().any(|c| c.len() != count) {
            return SIGNS.into_iter().find_map(|(name, keys)| Some((name, self.complete(clusters, keys)?)));
        }
        let one_file = clusters.iter().flatten().all(|f| f.image == clusters[0][0].image);
        let tried = SIGNS.map(|(name, keys)| (name, keys, false, false));
        let last = [("kind of image", ALL_BUT_TIME, true, false), ("order in the file", &[][..], false, true)];
        for (name, keys, by_kind, by_order) in tried.into_iter().chain(last) {
            if by_order && !one_file {
                continue;
            }
            let sign = |f: &Frame| -> Sign {
                let kind = if by_kind { self.facts(f).kind.as_deref().map(str::to_owned) } else { None };
                (sign_of(self.facts(f), keys), kind, if by_order { f.frame } else { 0 })
            };
            let sorted = clusters.iter().map(|cluster| {
                let mut signed: Vec<(Sign, Frame)> = cluster.iter().map(|f| (sign(f), *f)).collect();
                signed.sort_by(|a, b| order(&a.0, &b.0));
                let distinct = signed.windows(2).all(|w| order(&w[0].0, &w[1].0).is_lt());
                distinct.then(|| signed.into_iter().map(|s| s.1).collect::<Vec<_>>())
            });
            if let Some(sorted) = sorted.collect::<Option<Vec<_>>>() {
                return Some((name, sorted));
            }
        }
        None
    }

    /// Those moments that have one image at every position, where others do not: a scan that was broken off.
    fn complete(&self, clusters: &[Vec<Frame>], keys: &[usize]) -> Option<Vec<Vec<Frame>>> {
        let sign = |f: &Frame| -> Sign { (sign_of(self.facts(f), keys), None, 0) };
        let mut moments: Vec<Sign> = clusters[0].iter().map(sign).collect();
        moments.sort_by(order);
        let of = |cluster: &[Frame], moment: &Sign| -> Vec<Frame> {
            cluster.iter().filter(|f| order(&sign(f), moment).is_eq()).copied().collect()
        };
        let distinct = moments.windows(2).all(|w| order(&w[0], &w[1]).is_lt());
        moments.retain(|m| clusters.iter().all(|c| of(c, m).len() == 1));
        (distinct && !moments.is_empty()).then(|| clusters.iter().map(|c| moments.iter().flat_map(|m| of(c, m)).collect()).collect())
    }

    /// Slices of files that do not say where they lie.
    fn unplaced(mut self, frames: &[Frame], reading: &Reading) -> Result<Stack> {
        pick(self.path, Part::Frame, reading.choice.frame, 1)?;
        let [x, y] = self.pixel(&frames[0]);
        let z = self.thickness(&frames[0]);
        if frames.len() > 1 {
            let what = "Files do not say where slices lie: they are ordered by their instance numbers, or as they stand in the file.";
            self.notes.push(what.to_owned());
        }
        let steps = DMat3::from_diagonal(DVec3::new(x, y, z));
        Ok(Stack {
            slices: frames.to_vec(),
            plan: Plan::Direct,
            origin: DVec3::ZERO,
            steps,
            space: Space::Unknown,
            moments: 1,
            notes: self.notes,
        })
    }

    /// Slices of one moment, in their order, from the frames of every position.
    fn one_each(&mut self, clusters: Vec<Vec<Frame>>, normal: DVec3, reading: &Reading) -> Result<(Vec<Frame>, usize)> {
        let Some(several) = clusters.iter().find(|c| c.len() > 1) else {
            pick(self.path, Part::Frame, reading.choice.frame, 1)?;
            return Ok((clusters.into_iter().flatten().collect(), 1));
        };
        let Some((name, sorted)) = self.moments(&clusters) else {
            let (first, second) = (&several[0], &several[1]);
            let at = self.position(first);
            let what = format!(
                "lies at the same position as {}, ({}, {}, {}), which is {} mm along the normal, and nothing tells them apart",
                self.name(second),
                at.x,
                at.y,
                at.z,
                at.dot(normal)
            );
            return Err(Error::format(self.name(first), what));
        };
        let count = sorted[0].len();
        let left_out = clusters.iter().map(Vec::len).sum::<usize>() - count * clusters.len();
        if left_out > 0 {
            self.notes.push(format!("Images left out: {left_out}, of moments that were not taken at every position."));
        }
        let chosen = pick(self.path, Part::Frame, reading.choice.frame, count)?;
        let how = if reading.choice.frame.is_some() { "as chosen" } else { "the first" };
        self.notes.push(format!("There are {count} images at each position, which differ in {name}: frame {chosen} is read, {how}."));
        Ok((sorted.into_iter().map(|c| c[chosen]).collect(), count))
    }

    /// Where slices belong whose distances along the normal are these.
    fn plan(&mut self, along: &[f64]) -> Plan {
        let n = along.len();
        let range = along[n - 1] - along[0];
        let mean = range / (n - 1) as f64;
        let gaps: Vec<f64> = along.windows(2).map(|w| w[1] - w[0]).collect();
        if gaps.iter().all(|gap| (gap - mean).abs() <= UNEVEN * mean) {
            return Plan::Direct;
        }
        let least = gaps.iter().fold(f64::INFINITY, |a, &b| a.min(b)).max(range / (MOST_MADE * n) as f64);
        let whole: Vec<f64> = gaps.iter().map(|gap| libm::rint(gap / least).max(1.0)).collect();
        let count = whole.iter().sum::<f64>() as usize + 1;
        let step = range / (count - 1) as f64;
        if gaps.iter().zip(&whole).all(|(gap, k)| (gap - k * step).abs() <= UNEVEN * k * step) {
            let wide: Vec<usize> = (0..gaps.len()).filter(|&i| whole[i] > 1.0).collect();
            let shown: Vec<String> = wide.iter().take(4).map(|&i| format!("{} to {} mm", short(along[i]), short(along[i + 1]))).collect();
            let more = if wide.len() > 4 { format!(" and {} more", wide.len() - 4) } else { String::new() };
            self.notes.push(format!(
                "Slices are missing: {} of {count}, between {}{more} along the normal; they are interpolated linearly.",
                count - n,
                shown.join(", ")
            ));
            let mut place = 0;
            let places = std::iter::once(0).chain(whole.iter().map(|k| {
                place += *k as usize;
                place
            }));
            return Plan::Fill { places: places.collect(), count };
        }
        let count = (libm::rint(range / least) as usize).max(1) + 1;
        let step = range / (count - 1) as f64;
        let most = gaps.iter().fold(0.0, |a: f64, &b| a.max(b));
        let smallest = gaps.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        self.notes.push(format!(
            "Slices are unevenly spaced, {} to {} mm: {count} slices {} mm apart are interpolated linearly between the {n} that are there.",
            short(smallest),
            short(most),
            short(step)
        ));
        let mut below = 0;
        let places = (0..count).map(|k| {
            let at = along[0] + step * k as f64;
            while below + 2 < n && along[below + 1] <= at {
                below += 1;
            }
            below as f64 + ((at - along[below]) / gaps[below]).clamp(0.0, 1.0)
        });
        Plan::Resample { places: places.collect() }
    }
}

/// A length with as many digits as are of use.
fn short(millimetres: f64) -> f64 {
    libm::rint(millimetres * 1e4) / 1e4 + 0.0
}

/// The stack of one group's `frames`.
///
/// # Errors
/// When directions are no directions, or images at one position cannot be told apart.
pub(super) fn stack(study: &Study, path: &Path, frames: &[Frame], reading: &Reading) -> Result<Stack> {
    let mut builder = Builder { study, path, notes: Vec::new() };
    let first = builder.facts(&frames[0]).clone();
    let (Some([row, column]), Some(_)) = (first.orientation, first.position) else {
        return builder.unplaced(frames, reading);
    };
    if (row.length() - 1.0).abs() > 0.01 || (column.length() - 1.0).abs() > 0.01 || row.dot(column).abs() > 0.01 {
        let what = format!("directions of rows {row} and columns {column} are not of length 1 and at right angles to each other");
        return Err(Error::format(builder.name(&frames[0]), what));
    }
    let (row, column) = (row.normalize(), column.normalize());
    let normal = row.cross(column).normalize();
    let mut sorted: Vec<(f64, Frame)> = frames.iter().map(|f| (builder.position(f).dot(normal), *f)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A few slices far away from the others do not make these the same.
    let apart = sorted.len() / 20;
    let inner = &sorted[apart..sorted.len() - apart];
    let near = NEAREST.max(UNEVEN * (inner[inner.len() - 1].0 - inner[0].0) / (inner.len() - 1).max(1) as f64);
    let mut clusters: Vec<Vec<Frame>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (along, frame) in sorted {
        match clusters.last_mut() {
            Some(cluster) if along - last <= near => cluster.push(frame),
            _ => clusters.push(vec![frame]),
        }
        last = along;
    }
    let (slices, moments) = builder.one_each(clusters, normal, reading)?;
    let [x, y] = builder.pixel(&slices[0]);
    let positions: Vec<DVec3> = slices.iter().map(|f| builder.position(f)).collect();
    let (origin, end) = (positions[0], positions[positions.len() - 1]);
    let n = slices.len();
    let (plan, z) = if n == 1 {
        (Plan::Direct, normal * builder.thickness(&slices[0]))
    } else {
        let along: Vec<f64> = positions.iter().map(|p| p.dot(normal)).collect();
        let plan = builder.plan(&along);
        let z = (end - origin) / (plan.count(n) - 1) as f64;
        let lean = libm::acos((z.dot(normal) / z.length()).clamp(-1.0, 1.0)).to_degrees();
        if lean > 0.1 {
            builder
                .notes
                .push(format!("Slices are shifted against each other by {} degrees (gantry tilt): the grid is sheared.", short(lean)));
        }
        // Where slices would lie if they stood in one line.
        let off = |(p, a): (&DVec3, &f64)| (*p - origin - (end - origin) * ((a - along[0]) / (along[n - 1] - along[0]))).length();
        let most = positions.iter().zip(&along).map(off).fold(0.0, f64::max);
        if most > 0.5 * x.min(y) {
            builder.notes.push(format!("Slices do not stand in one line: some lie {} mm beside it, which is not followed.", short(most)));
        }
        (plan, z)
    };
    let steps = DMat3::from_cols(row * x, column * y, z);
    Ok(Stack { slices, plan, origin, steps, space: Space::Lps, moments, notes: builder.notes })
}
