//! Slices of files that do not give their positions: ordered by what else they say, or by their names.

use super::geometry::{Builder, NEAREST, Plan, Stack, short};
use super::series::Frame;
use super::tags::{INSTANCE_NUMBER, POSITION, SLICE_LOCATION, shown};
use crate::Result;
use crate::volume::Space;
use crate::volume::io::natural::natural;
use crate::volume::io::reading::{Part, Reading, pick};
use glam::{DMat3, DVec3};
use std::collections::BTreeSet;

impl Builder<'_> {
    /// Where slices lie along an axis, in their order, if all are at places of their own.
    fn located(&self, frames: &[Frame]) -> Option<(Vec<Frame>, Vec<f64>)> {
        let each: Option<Vec<(f64, Frame)>> = frames.iter().map(|f| Some((self.facts(f).location?, *f))).collect();
        let mut each = each?;
        each.sort_by(|a, b| a.0.total_cmp(&b.0));
        let distinct = each.windows(2).all(|w| w[1].0 - w[0].0 > NEAREST);
        distinct.then(|| each.into_iter().map(|(at, frame)| (frame, at)).unzip())
    }

    /// Slices of files that do not say where they lie, or all say the same.
    pub(super) fn unplaced(mut self, frames: &[Frame], reading: &Reading) -> Result<Stack> {
        pick(self.path, Part::Frame, reading.choice.frame, 1)?;
        let [x, y] = self.pixel(&frames[0]);
        let mut slices = frames.to_vec();
        let (mut plan, mut z) = (Plan::Direct, None);
        let images: BTreeSet<usize> = frames.iter().map(|f| f.image).collect();
        let instances: Option<BTreeSet<i64>> = images.iter().map(|&i| self.study.images[i].instance).collect();
        let position = shown(POSITION);
        let why = match self.facts(&frames[0]).position {
            Some(_) => format!("All slices have the same {position}"),
            None => format!("Files give no {position}"),
        };
        if frames.len() == 1 {
            // One slice is where it is.
        } else if let Some((ordered, mut along)) = self.located(frames) {
            slices = ordered;
            plan = self.plan(&mut slices, &mut along)?;
            let step = (along[along.len() - 1] - along[0]) / (plan.count(along.len()) - 1) as f64;
            self.notes.push(format!("{why}: slices are ordered by {}, {} mm apart.", shown(SLICE_LOCATION), short(step)));
            z = Some(step);
        } else if images.len() == 1 {
            self.notes.push(format!("{why}: slices are in the order of the frames in the file."));
        } else if instances.is_some_and(|found| found.len() == images.len()) {
            slices.sort_by_key(|f| (self.study.images[f.image].instance, f.frame));
            self.notes.push(format!("{why}: slices are ordered by {}.", shown(INSTANCE_NUMBER)));
        } else {
            let named = |f: &Frame| self.study.images[f.image].path.to_string_lossy();
            slices.sort_by(|a, b| natural(&named(a), &named(b)).then_with(|| (a.image, a.frame).cmp(&(b.image, b.frame))));
            self.notes.push(format!("{why} and no {} of their own: slices are ordered by the names of files.", shown(INSTANCE_NUMBER)));
        }
        let z = match z {
            Some(z) => z,
            None => self.thickness(&slices[0]),
        };
        let steps = DMat3::from_diagonal(DVec3::new(x, y, z));
        let (origin, space) = (DVec3::ZERO, Space::Unknown);
        Ok(Stack { slices, plan, origin, steps, space, moments: 1, values: String::new(), notes: self.notes })
    }
}
