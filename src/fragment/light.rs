//! Light on premultiplied colour. With C = A c and the terms of `scene::Lighting`:
//!
//! ```text
//!  C' = min(A, C (emission + ambient + diffuse sum(S c_light)) + A specular sum(H^shininess c_light))
//! ```
//! That is the formula on straight colour, times A. It is taken after the length of the piece is known and before fog.

use super::batch::Batch;
use super::frame::Frame;
use super::gradient::GradientFrame;
use super::places::{AlongRays, Each, OnSlice, Places, base_voxel, corner, load, place};
use super::{Pieces, Run};
use crate::lanes::math::{exp_negative, log1p_negated};
use crate::lanes::{BATCH, Kernel, Lanes, Level, SIDE, for_rows, row, row_mut, rows_of};
use crate::proxy::Stack;
use crate::scene::{LightSource, Lighting, MAX_LIGHTS, Shading};
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
    shininess: Exponent,
    two_sided: bool,
    /// Gradient at which light counts half, as a number of the batch.
    floor: f32,
    lights: Vec<LightFrame>,
    /// Towards the eye, of length 1, where rays are parallel; else where the eye is.
    eye: Result<[f32; 3], DVec3>,
    pub(super) to_world: DAffine3,
    /// A power of two that makes the box about 1 long.
    pub(super) per_box: f64,
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
            shininess: Exponent::new(lighting.shininess),
            two_sided: lighting.two_sided,
            floor: gradient.map_or(0.0, |g| g.number(lighting.gradient_floor)),
            lights: lighting.lights().iter().map(light).collect(),
            eye: if stack.perspective { Err(view.eye) } else { Ok((-view.forward).as_vec3().to_array()) },
            to_world: grid.index_to_world(),
            per_box: libm::scalbn(1.0, -libm::frexp(grid.radius()).1),
            box_depths,
            forward: view.forward,
            eye_depth: view.forward.dot(view.eye),
        }
    }

    /// Whether light on a fragment depends on where it lies.
    fn is_positional(&self) -> bool {
        self.eye.is_err() || self.lights.iter().any(|light| matches!(light.source, Source::Position(_)))
    }

    /// What is left of the colour at depth `d`.
    fn cue(&self, d: f64) -> f32 {
        let [near, far] = self.box_depths;
        (1.0 - (d - near) / (far - near)).clamp(0.0, 1.0) as f32
    }
}

/// The kernel for such light on batches of such pieces; of a part of a volume, where that is looked up.
pub(super) fn kernel<'v>(shading: Shading, pieces: Pieces, part: bool, level: Level) -> Run<'v> {
    match (shading, pieces) {
        (Shading::Depth, Pieces::OnSlice) => level.kernel::<CueDepth, _, _>(),
        (Shading::Depth, _) if part => level.kernel::<CueEach<true>, _, _>(),
        (Shading::Depth, Pieces::BehindSlices | Pieces::AlongRays) => level.kernel::<CueEach<false>, _, _>(),
        (_, Pieces::OnSlice) if part => level.kernel::<ShadePart, _, _>(),
        (_, Pieces::OnSlice) => level.kernel::<Shade, _, _>(),
        (_, Pieces::BehindSlices) if part => level.kernel::<ShadeEach<true>, _, _>(),
        (_, Pieces::BehindSlices) => level.kernel::<ShadeEach<false>, _, _>(),
        (_, Pieces::AlongRays) => level.kernel::<ShadeAlong, _, _>(),
    }
}

/// Blinn and Phong's light on fragments of a slice.
pub(super) struct Shade;
/// The same in a part of a volume.
pub(super) struct ShadePart;
/// The same on fragments at depths of their own; in a `PART` of a volume or not.
pub(super) struct ShadeEach<const PART: bool>;
/// The same on fragments along rays with samples of their own.
pub(super) struct ShadeAlong;
/// Darker with depth, on a slice.
pub(super) struct CueDepth;
/// The same on fragments at depths of their own; in a `PART` of a volume or not.
pub(super) struct CueEach<const PART: bool>;

#[inline(always)]
fn dot<L: Lanes>(a: [L::F; 3], b: [L::F; 3]) -> L::F {
    L::add(L::add(L::mul(a[0], b[0]), L::mul(a[1], b[1])), L::mul(a[2], b[2]))
}

/// `a` at length 1; 0 where it has none. Its numbers are near 1, or 0: squares stay within f32.
#[inline(always)]
pub(super) fn unit<L: Lanes>(a: [L::F; 3]) -> [L::F; 3] {
    let squared = dot::<L>(a, a);
    let there = L::le(L::splat(f32::MIN_POSITIVE), squared);
    let per = L::keep(there, L::div(L::splat(1.0), L::sqrt(L::select(there, squared, L::splat(1.0)))));
    [L::mul(a[0], per), L::mul(a[1], per), L::mul(a[2], per)]
}

/// An exponent.
#[derive(Debug, Clone, Copy)]
enum Exponent {
    /// A whole number that products reach fast.
    Whole(u32),
    Real(f32),
}

impl Exponent {
    /// The largest whole one: its products are off by as many roundings at most.
    const MOST: f64 = 128.0;

    fn new(x: f64) -> Self {
        if x <= Self::MOST && libm::floor(x) == x { Self::Whole(x as u32) } else { Self::Real(x as f32) }
    }

    /// h to this power, for h in [0,1].
    #[inline(always)]
    fn of<L: Lanes>(self, h: L::F) -> L::F {
        match self {
            Self::Whole(n) => {
                // h, h^2, h^4, ... : those whose bits n has, multiplied.
                let (mut square, mut left) = (h, n >> 1);
                let mut product = if n & 1 == 1 { h } else { L::splat(1.0) };
                while left > 0 {
                    square = L::mul(square, square);
                    if left & 1 == 1 {
                        product = L::mul(product, square);
                    }
                    left >>= 1;
                }
                product
            }
            Self::Real(x) => {
                let below_one = L::max(L::sub(L::splat(1.0), h), L::splat(0.0));
                exp_negative::<L>(L::mul(log1p_negated::<L>(below_one), L::splat(x)))
            }
        }
    }
}

/// A vector of the same three numbers in every lane.
#[inline(always)]
fn splat<L: Lanes>(v: &[f32; 3]) -> [L::F; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

/// The cosine of an angle to a surface's normal, 0 to 1.
#[inline(always)]
fn facing<L: Lanes>(cosine: L::F, two_sided: bool) -> L::F {
    let zero = L::splat(0.0);
    let other = if two_sided { L::sub(zero, cosine) } else { zero };
    L::min(L::max(cosine, other), L::splat(1.0))
}

/// Lights the fragments that have gradients.
#[inline(always)]
fn shade<L: Lanes, P: Places>(frame: &Frame<'_>, batch: &mut Batch) {
    let Some(light) = &frame.optional.light else { return };
    let Some(gradient) = batch.gradient.as_deref() else { return };
    let rows = rows_of(gradient.lanes);
    if rows == 0 {
        return;
    }
    let positional = light.is_positional().then(|| (corner::<P>(frame, light, batch), P::of(frame, batch)));
    let mut ways = [[0.0; 3]; MAX_LIGHTS];
    if let Some((corner, _)) = &positional {
        for (way, light) in ways.iter_mut().zip(&light.lights) {
            if let Source::Position(point) = light.source {
                *way = corner.way(point);
            }
        }
    }
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mut views = [[0.0; BATCH]; 3];
    if let (Err(eye), Some((corner, places))) = (light.eye, &positional) {
        let way = corner.way(eye);
        // In a loop of its own: roots and quotients of several rows are under way at a time.
        for_rows!(rows, r => {
            let view = corner.towards::<L>(&way, places.row::<L>(batch, r));
            for (to, x) in views.iter_mut().zip(view) {
                L::store(x, row_mut(to, r));
            }
        });
    }
    for_rows!(rows, r => {
        let normal = load::<L>(&gradient.normal, r);
        let size = L::load(row(&gradient.size, r));
        let alpha = L::load(row(&batch.slab.alpha, r));
        let view = match &light.eye {
            Ok(towards_eye) => splat::<L>(towards_eye),
            Err(_) => load::<L>(&views, r),
        };
        let mut glow = [L::splat(light.own); 3];
        let mut shine = [zero; 3];
        for (LightFrame { source, color }, way) in light.lights.iter().zip(&ways) {
            let (surface, mirror) = match (source, &positional) {
                (Source::Direction(_), _) | (Source::Position(_), Some(_)) => {
                    let to_light = match (source, &positional) {
                        (Source::Position(_), Some((corner, places))) => corner.towards::<L>(way, places.row::<L>(batch, r)),
                        (Source::Direction(d), _) => splat::<L>(d),
                        _ => view,
                    };
                    let between = [L::add(to_light[0], view[0]), L::add(to_light[1], view[1]), L::add(to_light[2], view[2])];
                    let half = unit::<L>(between);
                    (facing::<L>(dot::<L>(normal, to_light), light.two_sided), facing::<L>(dot::<L>(normal, half), light.two_sided))
                }
                _ => {
                    let cosine = facing::<L>(dot::<L>(normal, view), light.two_sided);
                    (cosine, cosine)
                }
            };
            let diffuse = L::mul(L::splat(light.diffuse), surface);
            for c in 0..3 {
                glow[c] = L::add(glow[c], L::mul(diffuse, L::splat(color[c])));
            }
            if light.specular > 0.0 {
                let specular = L::mul(L::splat(light.specular), light.shininess.of::<L>(mirror));
                for c in 0..3 {
                    shine[c] = L::add(shine[c], L::mul(specular, L::splat(color[c])));
                }
            }
        }
        let there = L::lt(zero, size);
        let weight = if light.floor > 0.0 {
            // |g|^2 / (|g|^2 + floor^2), by a quotient that cannot leave f32 where it matters.
            let q = L::div(L::splat(light.floor), L::select(there, size, one));
            L::div(one, L::add(one, L::mul(q, q)))
        } else {
            one
        };
        for c in 0..3 {
            let to = row_mut(&mut batch.slab.color[c], r);
            let color = L::load(to);
            let lit = L::min(L::add(L::mul(color, glow[c]), L::mul(alpha, shine[c])), alpha);
            // Rounding may take a mixed colour past its opacity.
            let mixed = if light.floor > 0.0 { L::min(L::add(color, L::mul(weight, L::sub(lit, color))), alpha) } else { lit };
            L::store(L::select(there, mixed, color), to);
        }
    });
}

impl<'v> Kernel<Frame<'v>, Batch> for Shade {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        shade::<L, OnSlice<false>>(frame, batch);
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ShadePart {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        shade::<L, OnSlice<true>>(frame, batch);
    }
}

impl<'v, const PART: bool> Kernel<Frame<'v>, Batch> for ShadeEach<PART> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        shade::<L, Each<PART>>(frame, batch);
    }
}

impl<'v> Kernel<Frame<'v>, Batch> for ShadeAlong {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        shade::<L, AlongRays>(frame, batch);
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

impl<'v, const PART: bool> Kernel<Frame<'v>, Batch> for CueEach<PART> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(light) = &frame.optional.light else { return };
        let first = base_voxel::<PART>(frame, batch);
        let mut factor = [0.0; SIDE];
        for_rows!(batch.shown, r => {
            for (i, factor) in factor.iter_mut().enumerate() {
                let place = place(frame, batch, first, SIDE * r + i);
                let index = DVec3::from_array([0, 1, 2].map(|axis: usize| first[axis] as f64 + f64::from(place[axis])));
                *factor = light.cue(light.forward.dot(light.to_world.transform_point3(index)) - light.eye_depth);
            }
            darken::<L>(batch, r, L::load(&factor));
        });
    }
}
