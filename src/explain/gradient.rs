//! The gradient at recorded fragments, worked out a second time: in f64, from the voxels of the volume and where the camera's ray is.
//!
//! Nothing here reads what the stage has computed. Of the record only the cell is taken, and only where it lies beside the ray's place: on a
//! cell's face both cells are right, and the derivative of linear interpolation differs from one to the other.

use super::choose::interval;
use super::record::Context;
use super::recorder::Snapshot;
use crate::proxy::Stack;
use crate::scene::{Gradient, SampleAt};
use crate::volume::Volume;
use glam::{DMat3, DVec3};
use serde::Serialize;

/// Distance in voxels between a recorded place and the ray's from which on they are not the same place.
pub(super) const ASIDE: f64 = 1e-3;

/// How gradients of a scene are taken, and how many the picture took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct GradientRecord {
    pub(super) kind: &'static str,
    /// From differences along the voxel axes to world space: rows are world x, y, z.
    pub(super) matrix: [[f64; 3]; 3],
    /// Gradients taken, and lanes that went through the stages.
    pub(super) taken: u64,
    pub(super) lanes: u64,
}

impl GradientRecord {
    pub(super) fn new(kind: Gradient, volume: &Volume, taken: u64, lanes: u64) -> Self {
        let m = to_world(volume);
        Self {
            kind: match kind {
                Gradient::Central => "central",
                Gradient::Analytic => "analytic",
                Gradient::Sobel => "sobel",
            },
            matrix: [0, 1, 2].map(|r: usize| m.row(r).to_array()),
            taken,
            lanes,
        }
    }
}

/// What a difference of 1 from voxel to voxel is as a gradient, world space: a column for each axis, at right angles to the other two.
fn to_world(volume: &Volume) -> DMat3 {
    let m = volume.grid().index_to_world().matrix3;
    let across = |a: DVec3, b: DVec3, own: DVec3| a.cross(b) / own.dot(a.cross(b));
    DMat3::from_cols(across(m.y_axis, m.z_axis, m.x_axis), across(m.z_axis, m.x_axis, m.y_axis), across(m.x_axis, m.y_axis, m.z_axis))
}

/// The gradient at one fragment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct GradientAt {
    /// Index coordinates of the ray's place on the slice.
    pub(super) at: [f32; 3],
    /// Data units: for central differences the values a voxel before and behind along x, along y, along z; for the analytic gradient the
    /// cell's eight voxels, x fastest.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) around: Vec<f32>,
    /// Differences along the voxel axes, data units per voxel.
    pub(super) along: [f32; 3],
    /// World space, data units per world unit.
    pub(super) g: [f32; 3],
    /// What the rounding of a stage may change each component by.
    pub(super) rounding: f32,
    /// Distance between the recorded place and the ray's, voxels.
    pub(super) aside: f32,
    #[serde(skip)]
    pub(super) exact: Exact,
}

/// The same in f64, for what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Exact {
    pub(super) gradient: DVec3,
    /// World space.
    pub(super) position: DVec3,
    /// Value there, and what rounding may change it by; data units.
    pub(super) value: f64,
    pub(super) value_rounding: f64,
    pub(super) rounding: f64,
    /// World units by which rounding may move the place.
    pub(super) moved: f64,
}

/// Depth of a pixel's sample on slice `slice`; of the place where its ray leaves what clip planes leave, behind the last slice.
pub(super) fn sample_depth(stack: &Stack, pixel: (u32, u32), slice: u64, sample: SampleAt) -> f64 {
    if slice >= stack.count {
        return interval(stack, &stack.half_spaces, pixel).map_or(stack.far, |[_, exit]| exit);
    }
    stack.depth(slice) + if sample == SampleAt::End { 0.5 * stack.spacing } else { 0.0 }
}

/// World position of a pixel's ray at depth `d`.
pub(super) fn ray_at(stack: &Stack, (x, y): (u32, u32), d: f64) -> DVec3 {
    let (origin, direction) = stack.view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
    origin + direction * d
}

/// A place in a cell of a volume.
struct Place<'v> {
    volume: &'v Volume,
    cell: [i64; 3],
    weight: [f64; 3],
}

impl Place<'_> {
    /// The voxel `step` from the cell's lowest, or the one at the edge before it.
    fn voxel(&self, step: [i64; 3]) -> f64 {
        let dims = self.volume.grid().dims();
        self.volume.value(std::array::from_fn(|a| (self.cell[a] + step[a]).clamp(0, dims[a] as i64 - 1) as usize))
    }

    /// The interpolated value `step` voxels from the place.
    fn value(&self, step: [i64; 3]) -> f64 {
        let corner = |c: usize| {
            let bit = |a: usize| (c >> a & 1) as i64;
            let share: f64 = (0..3).map(|a| if bit(a) == 1 { self.weight[a] } else { 1.0 - self.weight[a] }).product();
            share * self.voxel(std::array::from_fn(|a| step[a] + bit(a)))
        };
        (0..8).map(corner).sum()
    }

    /// Least and greatest of the voxels that any kind of gradient looks at.
    fn range(&self) -> (f64, f64) {
        let steps = (0..64).map(|i| [i % 4 - 1, i / 4 % 4 - 1, i / 16 - 1]);
        steps.map(|s| self.voxel(s)).filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    }

    /// What is looked at, and the differences along the axes per voxel.
    fn differences(&self, kind: Gradient) -> (Vec<f64>, [f64; 3]) {
        let axis = |a: usize, n: i64| std::array::from_fn(|b| if a == b { n } else { 0 });
        match kind {
            Gradient::Central => {
                let around: Vec<f64> = (0..3).flat_map(|a| [self.value(axis(a, -1)), self.value(axis(a, 1))]).collect();
                let along = std::array::from_fn(|a| 0.5 * (around[2 * a + 1] - around[2 * a]));
                (around, along)
            }
            Gradient::Analytic => {
                let around: Vec<f64> = (0..8).map(|c: i64| self.voxel([c & 1, c >> 1 & 1, c >> 2])).collect();
                // Along its own axis the weights are -1 and 1, along the others as for values.
                let along = |own: usize| {
                    let share = |c: usize, a: usize| match (c >> a & 1 == 1, a == own) {
                        (upper, true) => f64::from(i8::from(upper) * 2 - 1),
                        (true, false) => self.weight[a],
                        (false, false) => 1.0 - self.weight[a],
                    };
                    (0..8).map(|c| around[c] * (0..3).map(|a| share(c, a)).product::<f64>()).sum()
                };
                let along = [along(0), along(1), along(2)];
                (around, along)
            }
            Gradient::Sobel => {
                let mut along = [0.0; 3];
                for i in 0..27 {
                    let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
                    let value = self.value(step);
                    for (own, sum) in along.iter_mut().enumerate() {
                        let share = |a: usize| if a == own { step[a] } else { 2 - step[a].abs() };
                        *sum += (share(0) * share(1) * share(2)) as f64 / 32.0 * value;
                    }
                }
                (Vec::new(), along)
            }
        }
    }
}

impl GradientAt {
    /// At the fragment of `pixel` on `slice`, recorded as `seen`.
    pub(super) fn new(context: Context<'_>, stack: &Stack, pixel: (u32, u32), slice: u64, seen: &Snapshot) -> Self {
        let (volume, scene) = (context.volume, context.scene);
        let dims = volume.grid().dims();
        let position = ray_at(stack, pixel, sample_depth(stack, pixel, slice, scene.method().sample));
        let index = volume.grid().world_to_index().transform_point3(position).to_array();
        // Behind the last slice light is taken at the place of the lookup, which is never beyond the outermost voxel centres.
        let beyond = (0..3).map(|a| (index[a] - index[a].clamp(0.0, (dims[a] - 1) as f64)).abs()).sum::<f64>();
        let beyond = if slice < stack.count { 0.0 } else { beyond };
        let index: [f64; 3] = std::array::from_fn(|a| index[a].clamp(0.0, (dims[a] - 1) as f64));
        let aside = (0..3).map(|a| (seen.cell[a] as f64 + f64::from(seen.weight[a]) - index[a]).abs()).fold(0.0, f64::max);
        let cell: [i64; 3] = std::array::from_fn(|a| {
            let own = (index[a] as i64).min(dims[a] as i64 - 2).max(0);
            if aside <= ASIDE { seen.cell[a] as i64 } else { own }
        });
        let place = Place { volume, cell, weight: std::array::from_fn(|a| (index[a] - cell[a] as f64).clamp(0.0, 1.0)) };
        let (around, along) = place.differences(scene.gradient());
        let matrix = to_world(volume);
        let gradient = matrix * DVec3::from_array(along);
        let gradient = if gradient.is_finite() { gradient } else { DVec3::ZERO };
        let (low, high) = place.range();
        let (scale, offset) = context.scale();
        // Numbers of the stages, in data units.
        let most = [low, high].map(|v| (v - offset).abs()).into_iter().fold(offset.abs().min(scale.abs()), f64::max);
        let moved = aside.min(ASIDE);
        let spread = high - low;
        let norm = matrix.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let rounding = (spread * (8.0 * moved + 4e-6) + 1e-6 * most) * norm;
        let longest = volume.grid().spacing().into_iter().fold(0.0, f64::max);
        let single = |v: f64| v as f32;
        Self {
            at: index.map(single),
            around: around.into_iter().map(single).collect(),
            along: along.map(single),
            g: gradient.to_array().map(single),
            rounding: single(rounding),
            aside: single(aside),
            exact: Exact {
                gradient,
                position,
                value: place.value([0; 3]),
                value_rounding: spread * (4.0 * moved + 1e-6) + 1e-6 * most,
                rounding,
                moved: longest * (moved + beyond),
            },
        }
    }
}
