//! Equal steps along each ray.
//!
//! Sample k stands for the slab from r0 + k D to r0 + (k + 1) D and is taken in its middle. Along parallel rays these are depths, so samples lie
//! on the slices. In perspective they are distances from the eye: r0 is the least distance of the box from the eye, 0 inside it, or that of
//! the near plane where that is more; r1 the greatest distance of a corner; D = (r1 - r0) / count. Every whole piece of every ray is then D long.
//!
//! ```text
//!      entry                       exit
//!   --|--+---|---+---|---+---|---+--|--     the outermost samples stand for what is left up to the box's faces, as those of slices do
//! ```

use super::Piece;
use super::sight::{Ray, Sight};
use crate::plan::FramePlan;
use crate::proxy::Stack;
use crate::scene::View;
use crate::volume::Grid;
use glam::{DMat3, DVec3};

/// Distances from the eye of `view` between which rays pass through the box of `grid`: the least (0 inside it), or the near plane's where that is
/// more, and the greatest; `None` when nothing of the box is that far.
pub(crate) fn distances(grid: &Grid, view: &View) -> Option<(f64, f64)> {
    let far = grid.corners().iter().map(|c| c.distance(view.eye)).fold(0.0, f64::max);
    let near = nearest(grid, view.eye).max(view.near);
    let ahead = grid.corners().iter().any(|c| view.depth(*c) > view.near);
    (ahead && far > near).then_some((near, far))
}

/// Least distance from `point` to the box of `grid`, whose edges may meet at any angle.
///
/// The nearest point lies inside, or within a face, an edge or a corner: of each of these 27 the point where the distance is least along it,
/// if that lies within it.
fn nearest(grid: &Grid, point: DVec3) -> f64 {
    let (low, high) = grid.index_bounds();
    let map = grid.index_to_world();
    let mut least = f64::INFINITY;
    for part in 0..27 {
        let kind = [part % 3, part / 3 % 3, part / 9];
        let mut index = DVec3::from_array([0, 1, 2].map(|i: usize| if kind[i] == 1 { high[i] } else { low[i] }));
        let free: Vec<usize> = (0..3).filter(|&i| kind[i] == 2).collect();
        // Least squares over the free coordinates; the identity stands for the others.
        let away = point - map.transform_point3(index);
        let column = |i: usize| map.matrix3.col(i);
        let mut normal = DMat3::IDENTITY;
        let mut right = DVec3::ZERO;
        for &i in &free {
            right[i] = column(i).dot(away);
            for &j in &free {
                normal.col_mut(j)[i] = column(i).dot(column(j));
            }
        }
        let step = normal.inverse() * right;
        free.iter().for_each(|&i| index[i] += step[i]);
        if free.iter().all(|&i| index[i] >= low[i] && index[i] <= high[i]) {
            least = least.min(map.transform_point3(index).distance(point));
        }
    }
    // Within the box the distance is 0 but for rounding.
    if least < 1e-12 * grid.radius() { 0.0 } else { least }
}

/// The steps of a frame.
pub(super) struct Steps {
    near: f64,
    spacing: f64,
    count: i64,
    /// Where in its slab a sample is taken, in slabs from the middle.
    sample: f64,
    /// Whether the outermost samples stand for whole slabs.
    whole_ends: bool,
}

impl Steps {
    /// Those of the slabs of `plan`.
    pub(super) fn new(plan: &FramePlan<'_>) -> Self {
        Self { sample: plan.sample, whole_ends: plan.needs.ends.whole(), ..Self::plain(&plan.stack) }
    }

    /// Those of `stack`, taken in the middle, the outermost as long as the ray is in the box.
    pub(super) fn plain(stack: &Stack) -> Self {
        Self { near: stack.near, spacing: stack.spacing, count: stack.count as i64, sample: 0.0, whole_ends: false }
    }

    /// Depth at which `ray` is `k` slabs behind the middle of the first.
    fn depth(&self, ray: &Ray, k: f64) -> f64 {
        (self.near + (k + 0.5) * self.spacing) / ray.stretch
    }
}

/// Samples of one ray.
pub(super) struct StepsAlong<'s> {
    steps: &'s Steps,
    ray: &'s Ray,
    next: i64,
    first: i64,
    last: i64,
    lengths: (f64, f64),
}

impl<'s> StepsAlong<'s> {
    /// Those of `ray`.
    pub(super) fn new(steps: &'s Steps, sight: &Sight<'_>, ray: &'s Ray) -> Self {
        // In slabs from the middle of the first.
        let position = |depth: f64| (depth * ray.stretch - steps.near) / steps.spacing - 0.5;
        let count = steps.count as f64;
        let (entry, exit) = (position(ray.entry).max(-0.5), position(ray.exit).min(count - 0.5));
        let error = ray.error * ray.stretch / steps.spacing;
        let covers = |k: i64| k >= 0 && k < steps.count && sight.covers(ray.window, steps.depth(ray, k as f64));
        // A sample within rounding of an end belongs by the fill rule.
        let rounded = |x: f64| libm::floor(x + 0.5) as i64;
        let close = rounded(entry);
        let mut first =
            if (entry - close as f64).abs() > error { close + i64::from(entry > close as f64) } else { close + i64::from(!covers(close)) };
        let close = rounded(exit);
        let mut last =
            if (exit - close as f64).abs() > error { close - i64::from(exit < close as f64) } else { close - i64::from(!covers(close)) };
        if first > last && !steps.whole_ends && exit - entry > error {
            // The ray cuts a corner of the box between two samples.
            first = rounded(0.5 * (entry + exit)).clamp(0, steps.count - 1);
            last = first;
        }
        let (first, last) = (first.max(0), last.min(steps.count - 1));
        let lengths = if steps.whole_ends {
            (1.0, 1.0)
        } else if first == last {
            (exit - entry, exit - entry)
        } else {
            ((first as f64 + 0.5) - entry, exit - (last as f64 - 0.5))
        };
        Self { steps, ray, next: first, first, last, lengths }
    }
}

impl Iterator for StepsAlong<'_> {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        let k = self.next;
        if k > self.last {
            return None;
        }
        self.next += 1;
        let length = match k {
            k if k == self.first => self.lengths.0,
            k if k == self.last => self.lengths.1,
            _ => 1.0,
        };
        let middle = self.steps.depth(self.ray, k as f64);
        let sampled = if self.steps.sample == 0.0 { middle } else { self.steps.depth(self.ray, k as f64 + self.steps.sample) };
        Some(Piece { place: self.ray.at(sampled), depth: middle, length })
    }
}
