//! Light on premultiplied colour. With C = A c and the terms of `scene::Lighting`:
//!
//! ```text
//!  C' = min(A, C (emission + ambient + diffuse sum(S c_light)) + A specular sum(H^shininess c_light))
//! ```
//! That is the formula on straight colour, times A. It is taken after the length of the piece is known and before fog.

use super::batch::Batch;
use super::frame::Frame;
use super::gradient::{GradientFrame, index_of};
use super::{Pieces, Run};
use crate::lanes::math::{exp_negative, log1p_negated};
use crate::lanes::{BATCH, Kernel, Lanes, Level, SIDE, for_rows, row, row_mut};
use crate::proxy::Stack;
use crate::scene::{LightSource, Lighting, Shading};
use crate::volume::Grid;
use glam::{DAffine3, DVec3};

/// Coefficients beyond this are this: any colour is as bright as can be then, and products stay finite.
const MOST: f64 = 1e30;

/// A light in the numbers of its stage.
#[derive(Debug, Clone, Copy)]
struct LightFrame {
    source: Source,
    color: [f32; 3],
}

/// Where a light is.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// At the eye.
    Head,
    /// Towards it, world space.
    Direction([f32; 3]),
    /// World space.
    Position(DVec3),
}

/// What light needs.
#[derive(Debug, Clone)]
pub(crate) struct LightingFrame {
    /// Emission and ambient light.
    own: f32,
    diffuse: f32,
    specular: f32,
    shininess: f32,
    two_sided: bool,
    /// Gradient at which light counts half, as a number of the batch.
    floor: f32,
    lights: Vec<LightFrame>,
    /// Towards the eye, of length 1, where rays are parallel; else where the eye is.
    eye: Result<[f32; 3], DVec3>,
    to_world: DAffine3,
    /// Depths at which the box begins and ends, and the share of the depth that a world position has: forward . p + offset.
    box_depths: [f64; 2],
    forward: DVec3,
    eye_depth: f64,
}

impl LightingFrame {
    /// For slices of `stack` through a volume on `grid`; sizes of gradients are in the numbers of `gradient`.
    pub(crate) fn new(lighting: &Lighting, gradient: Option<&GradientFrame>, grid: &Grid, stack: &Stack) -> Self {
        let view = &stack.view;
        let coefficient = |x: f64| x.min(MOST) as f32;
        let light = |light: &crate::scene::Light| LightFrame {
            source: match light.source() {
                LightSource::Direction(d) => Source::Direction(d.as_vec3().to_array()),
                LightSource::Position(p) => Source::Position(p),
                _ => Source::Head,
            },
            color: light.color().map(|c| c as f32),
        };
        // The box's own depths, whatever part of it the stack fills.
        let box_depths = Stack::depth_range(grid, view).map_or([stack.near, stack.far], |(near, far)| [near, far]);
        Self {
            own: coefficient(lighting.emission + lighting.ambient),
            diffuse: coefficient(lighting.diffuse),
            specular: coefficient(lighting.specular),
            shininess: lighting.shininess as f32,
            two_sided: lighting.two_sided,
            floor: gradient.map_or(0.0, |g| g.number(lighting.gradient_floor)),
            lights: lighting.lights().iter().map(light).collect(),
            eye: if stack.perspective { Err(view.eye) } else { Ok((-view.forward).as_vec3().to_array()) },
            to_world: grid.index_to_world(),
            box_depths,
            forward: view.forward,
            eye_depth: view.forward.dot(view.eye),
        }
    }

    /// What is left of the colour at depth `d`.
    fn cue(&self, d: f64) -> f32 {
        let [near, far] = self.box_depths;
        (1.0 - (d - near) / (far - near)).clamp(0.0, 1.0) as f32
    }
}

/// The kernel for `lighting` on batches of such pieces.
pub(super) fn kernel<'v>(shading: Shading, pieces: Pieces, far: bool, level: Level) -> Run<'v> {
    match (shading, pieces, far) {
        (Shading::Depth, Pieces::OnSlice, _) => level.kernel::<CueDepth, _, _>(),
        (Shading::Depth, Pieces::BehindSlices, true) => level.kernel::<CueEach<true>, _, _>(),
        (Shading::Depth, Pieces::BehindSlices, false) => level.kernel::<CueEach<false>, _, _>(),
        (_, Pieces::OnSlice, _) => level.kernel::<Shade, _, _>(),
        (_, Pieces::BehindSlices, true) => level.kernel::<ShadeEach<true>, _, _>(),
        (_, Pieces::BehindSlices, false) => level.kernel::<ShadeEach<false>, _, _>(),
    }
}

/// Blinn and Phong's light on fragments of a slice.
pub(super) struct Shade;
/// The same on fragments at depths of their own. `FAR` batches have offsets beyond i32.
pub(super) struct ShadeEach<const FAR: bool>;
/// Darker with depth, on a slice.
pub(super) struct CueDepth;
/// The same on fragments at depths of their own.
pub(super) struct CueEach<const FAR: bool>;

/// Index coordinates of fragments relative to the base voxel, where each is at a depth of its own.
fn places<const FAR: bool>(frame: &Frame<'_>, batch: &Batch) -> [[f32; BATCH]; 3] {
    let (base, strides) = (batch.geometry.cells.base, frame.sample.strides);
    let first = index_of(base, strides);
    let mut places = [[0.0; BATCH]; 3];
    for i in 0..BATCH {
        let offset = if FAR { batch.rare.far_offset[i] as usize } else { batch.sample.offset[i] as usize };
        let cell = index_of(base + offset, strides);
        for axis in 0..3 {
            places[axis][i] = ((cell[axis] as f64 - first[axis] as f64) + f64::from(batch.sample.weight[axis][i])) as f32;
        }
    }
    places
}

#[inline(always)]
fn dot<L: Lanes>(a: [L::F; 3], b: [L::F; 3]) -> L::F {
    L::add(L::add(L::mul(a[0], b[0]), L::mul(a[1], b[1])), L::mul(a[2], b[2]))
}

/// `a` at length 1; 0 where it has none.
#[inline(always)]
fn unit<L: Lanes>(a: [L::F; 3]) -> [L::F; 3] {
    let zero = L::splat(0.0);
    let abs = |x: L::F| L::max(x, L::sub(zero, x));
    let most = L::max(L::max(abs(a[0]), abs(a[1])), abs(a[2]));
    let there = L::and(L::le(L::splat(f32::MIN_POSITIVE), most), L::le(most, L::splat(f32::MAX)));
    let most = L::select(there, most, L::splat(1.0));
    let q = a.map(|x| L::div(L::keep(there, x), most));
    let length = L::select(there, L::sqrt(dot::<L>(q, q)), L::splat(1.0));
    q.map(|x| L::div(x, length))
}

/// h^shininess for h in [0,1].
#[inline(always)]
fn power<L: Lanes>(h: L::F, shininess: f32) -> L::F {
    let below_one = L::max(L::sub(L::splat(1.0), h), L::splat(0.0));
    exp_negative::<L>(L::mul(log1p_negated::<L>(below_one), L::splat(shininess)))
}

/// Lights the rows that have gradients; `place` gives the index coordinates of a row relative to the base voxel.
#[inline(always)]
fn shade<L: Lanes>(frame: &Frame<'_>, batch: &mut Batch, place: impl Fn(usize) -> [L::F; 3]) {
    let Some(light) = &frame.optional.light else { return };
    let base = index_of(batch.geometry.cells.base, frame.sample.strides).map(|x| x as f64);
    let corner = light.to_world.transform_point3(DVec3::from_array(base));
    let steps = [0, 1, 2].map(|r: usize| light.to_world.matrix3.row(r).as_vec3().to_array());
    // From a fragment towards a point: from the base voxel towards it, less the way to the fragment.
    let towards = |point: DVec3, place: [L::F; 3]| {
        let from_corner = (point - corner).as_vec3().to_array();
        unit::<L>([0, 1, 2].map(|axis: usize| L::sub(L::splat(from_corner[axis]), dot::<L>(steps[axis].map(|s| L::splat(s)), place))))
    };
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let facing = |cosine: L::F| L::min(L::max(cosine, if light.two_sided { L::sub(zero, cosine) } else { zero }), one);
    for_rows!(batch.gradient.rows & batch.shown, r => {
        let normal = [0, 1, 2].map(|axis: usize| L::load(row(&batch.gradient.normal[axis], r)));
        let size = L::load(row(&batch.gradient.size, r));
        let alpha = L::load(row(&batch.slab.alpha, r));
        let view = match light.eye {
            Ok(towards_eye) => towards_eye.map(|x| L::splat(x)),
            Err(eye) => towards(eye, place(r)),
        };
        let mut glow = [L::splat(light.own); 3];
        let mut shine = [zero; 3];
        for LightFrame { source, color } in &light.lights {
            let (surface, mirror) = match *source {
                Source::Head => {
                    let cosine = facing(dot::<L>(normal, view));
                    (cosine, cosine)
                }
                Source::Direction(_) | Source::Position(_) => {
                    let to_light = match *source {
                        Source::Position(point) => towards(point, place(r)),
                        Source::Direction(d) => d.map(|x| L::splat(x)),
                        Source::Head => view,
                    };
                    let half = unit::<L>([0, 1, 2].map(|axis: usize| L::add(to_light[axis], view[axis])));
                    (facing(dot::<L>(normal, to_light)), facing(dot::<L>(normal, half)))
                }
            };
            let diffuse = L::mul(L::splat(light.diffuse), surface);
            for (glow, &c) in glow.iter_mut().zip(color) {
                *glow = L::add(*glow, L::mul(diffuse, L::splat(c)));
            }
            if light.specular > 0.0 {
                let specular = L::mul(L::splat(light.specular), power::<L>(mirror, light.shininess));
                for (shine, &c) in shine.iter_mut().zip(color) {
                    *shine = L::add(*shine, L::mul(specular, L::splat(c)));
                }
            }
        }
        let there = L::lt(zero, size);
        for channel in 0..3 {
            let to = row_mut(&mut batch.slab.color[channel], r);
            let color = L::load(to);
            let lit = L::min(L::add(L::mul(color, glow[channel]), L::mul(alpha, shine[channel])), alpha);
            let mixed = if light.floor > 0.0 {
                // |g|^2 / (|g|^2 + floor^2), by a quotient that cannot leave f32 where it matters.
                let q = L::div(L::splat(light.floor), L::select(there, size, one));
                let weight = L::div(one, L::add(one, L::mul(q, q)));
                L::add(color, L::mul(weight, L::sub(lit, color)))
            } else {
                lit
            };
            L::store(L::select(there, mixed, color), to);
        }
    });
}

impl<'v> Kernel<Frame<'v>, Batch> for Shade {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let g = &batch.geometry;
        let (origin, across, down) = (g.origin, g.across, g.down);
        let numbers = L::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        shade::<L>(frame, batch, |r| {
            [0, 1, 2].map(|axis: usize| {
                let first = origin[axis] + r as f32 * down[axis];
                L::add(L::splat(first), L::mul(numbers, L::splat(across[axis])))
            })
        });
    }
}

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for ShadeEach<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let places = places::<FAR>(frame, batch);
        shade::<L>(frame, batch, |r| [0, 1, 2].map(|axis: usize| L::load(row(&places[axis], r))));
    }
}

/// Row `r` of a batch, darkened.
#[inline(always)]
fn darken<L: Lanes>(batch: &mut Batch, r: usize, factor: L::F) {
    for channel in &mut batch.slab.color {
        let c = row_mut(channel, r);
        L::store(L::mul(L::load(c), factor), c);
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for CueDepth {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(light) = &frame.optional.light else { return };
        let factor = L::splat(light.cue(f64::from(batch.depth)));
        for_rows!(batch.shown, r => {
            darken::<L>(batch, r, factor);
        });
    }
}

impl<'v, const FAR: bool> Kernel<Frame<'v>, Batch> for CueEach<FAR> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(light) = &frame.optional.light else { return };
        let base = index_of(batch.geometry.cells.base, frame.sample.strides).map(|x| x as f64);
        let places = places::<FAR>(frame, batch);
        let mut factor = [0.0; SIDE];
        for_rows!(batch.shown, r => {
            for (i, factor) in factor.iter_mut().enumerate() {
                let index = DVec3::from_array([0, 1, 2].map(|axis: usize| base[axis] + f64::from(places[axis][SIDE * r + i])));
                *factor = light.cue(light.forward.dot(light.to_world.transform_point3(index)) - light.eye_depth);
            }
            darken::<L>(batch, r, L::load(&factor));
        });
    }
}
