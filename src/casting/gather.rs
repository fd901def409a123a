//! What the samples of a ray come to: colours blended over each other, or one number of their values. Nearest first, one by one, in f64.

use crate::fragment::Batch;
use crate::fragment::project::NOTHING;
use crate::lanes::SIDE;
use crate::plan::FramePlan;
use crate::raster::{Finish, Resolve};
use crate::scene::Blend;

/// Opacities below this keep their digits: an f32 transmittance tells larger ones to 3e-5 of them.
const FAINT: f64 = 1.0 / 1024.0;

/// Whoever takes samples of a ray.
pub(super) trait Take {
    /// Takes the first `count` samples of `batch`; false where those behind do not matter any more.
    fn take(&mut self, batch: &Batch, count: usize) -> bool;
}

/// The samples of `batch` that are there, by their lanes.
pub(super) fn there(batch: &Batch, count: usize) -> impl Iterator<Item = usize> + use<> {
    let mask = batch.mask;
    (0..count).filter(move |i| mask >> i & 1 == 1)
}

/// The samples, of those, of which something may show.
pub(super) fn shown(batch: &Batch, count: usize) -> impl Iterator<Item = usize> + use<> {
    let rows = batch.shown;
    there(batch, count).filter(move |i| rows >> (i / SIDE) & 1 == 1)
}

/// What a ray has gathered.
pub(super) struct Gather {
    blend: Blend,
    /// Premultiplied colour.
    color: [f64; 3],
    /// Transmittance left.
    left: f64,
    /// Sum of what each sample takes of the light, or of opacities.
    opacity: f64,
    /// Transmittance below which nothing is taken any more, if there is one.
    terminate: Option<f64>,
    /// The value so far, and the largest.
    value: f32,
    most: f32,
    /// Threshold, as a number of the stages.
    level: f32,
    /// Sum of lengths, and of values times lengths, the values relative to a number.
    length: f64,
    sum: f64,
    low: f64,
}

impl Gather {
    /// Of no sample, by `plan`.
    pub(super) fn new(plan: &FramePlan<'_>, blend: Blend) -> Self {
        Self {
            blend,
            color: [0.0; 3],
            left: 1.0,
            opacity: 0.0,
            terminate: plan.needs.terminate.then(|| f64::from(plan.frame.blend.terminate)),
            value: NOTHING,
            most: NOTHING,
            level: plan.frame.blend.level,
            length: 0.0,
            sum: 0.0,
            low: f64::from(plan.frame.color.low),
        }
    }

    /// Lane `i` over what is behind; false once nothing more is taken.
    fn over(&mut self, batch: &Batch, i: usize) -> bool {
        let alpha = f64::from(batch.slab.alpha[i]);
        for (sum, channel) in self.color.iter_mut().zip(&batch.slab.color) {
            *sum += self.left * f64::from(channel[i]);
        }
        self.opacity += self.left * alpha;
        self.left *= 1.0 - alpha;
        self.terminate.is_none_or(|least| self.left >= least)
    }

    /// Lane `i` added.
    fn add(&mut self, batch: &Batch, i: usize) -> bool {
        for (sum, channel) in self.color.iter_mut().zip(&batch.slab.color) {
            *sum += f64::from(channel[i]);
        }
        self.opacity += f64::from(batch.slab.alpha[i]);
        true
    }

    /// The value of lane `i`; false once the result stands.
    fn project(&mut self, batch: &Batch, i: usize) -> bool {
        let value = batch.sample.value[i];
        match self.blend {
            Blend::Min => self.value = if self.value == NOTHING { value } else { self.value.min(value) },
            Blend::Average => {
                let length = f64::from(batch.slab.length[i]);
                self.sum += length * (f64::from(value) - self.low);
                self.length += length;
            }
            Blend::Lmip { .. } => {
                if value < self.value && self.value >= self.level {
                    self.left = 0.0;
                    return false;
                }
                self.value = value;
                self.most = self.most.max(value);
            }
            _ => self.value = self.value.max(value),
        }
        true
    }

    /// The pixel, at (x,y) of the picture.
    pub(super) fn finished(&self, resolve: &Resolve<'_>, finish: &impl Finish, at: (usize, usize)) -> [f32; 4] {
        match self.blend {
            Blend::Over => {
                let [r, g, b] = self.color.map(|c| c as f32);
                let left = self.left as f32;
                let layer = [r, g, b, left];
                if self.opacity < FAINT {
                    finish.faint(layer, (self.opacity - (1.0 - f64::from(left))) as f32)
                } else {
                    finish.pixel(layer)
                }
            }
            Blend::Add => resolve.of_sums(finish, self.color.map(|c| c as f32), self.opacity as f32, at),
            Blend::Average => resolve.of_sums(finish, [self.sum as f32, self.length as f32, 0.0], 0.0, at),
            _ => resolve.of_sums(finish, [self.value, self.most, 0.0], self.left as f32, at),
        }
    }
}

impl Take for Gather {
    fn take(&mut self, batch: &Batch, count: usize) -> bool {
        match self.blend {
            Blend::Over => shown(batch, count).all(|i| self.over(batch, i)),
            Blend::Add => shown(batch, count).all(|i| self.add(batch, i)),
            _ => there(batch, count).all(|i| self.project(batch, i)),
        }
    }
}
