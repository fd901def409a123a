//! Ray casting: the algorithms that go pixel by pixel, and from sample to sample along each ray.
//!
//! ```text
//!  pixel --Sight--> ray: where it enters and leaves --way--> pieces, nearest first --Samples--> 64 at a time through the plan's stages
//!                                  (rays, traversal, template, object slices)                            |
//!                                                          layer <--finish-- sums in f64 <--Gather-- colours, or values
//! ```
//! A way says where the samples of a ray lie and how much of it each stands for. What a sample looks like is the business of the same stages
//! that slices go through: here a batch holds samples of one ray, not of one slice. Sums are taken one by one, in f64.
//!
//! [`grid`] has rays along an axis of the volume, whose samples are voxels: no lookup, no table, no batch.

mod coins;
mod gather;
mod grid;
mod object_slices;
mod rays;
mod samples;
mod sight;
mod surfaces;
mod template;
mod traversal;

pub(crate) use grid::Grid;
pub(crate) use rays::distances;
pub(crate) use surfaces::SurfaceRays;

use crate::plan::FramePlan;
use crate::proxy::Stack;
use crate::raster::{Finish, Resolve};
use crate::scene::{Algorithm, Blend, Connectivity, Filter, Scene, TemplatePlane, View};
use crate::settings::Control;
use crate::tally::Counters;
use crate::volume::Volume;
use crate::{Error, Result};
use coins::Coins;
use gather::{Gather, Take};
use object_slices::{Layers, nearest_axis};
use rayon::prelude::*;
use rays::{Steps, StepsAlong};
use samples::Samples;
use sight::{Ray, Sight};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use template::Template;
use traversal::{Passed, Voxelized};

/// A sample, and the piece of the ray that it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Where its value is looked up, index coordinates.
    place: [f64; 3],
    /// Depth of its middle, world units.
    depth: f64,
    /// Its length, in slabs of the plan.
    length: f64,
}

impl Piece {
    const NONE: Self = Self { place: [0.0; 3], depth: 0.0, length: 1.0 };
}

/// What was done for some pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cast {
    pub(crate) counters: Counters,
    /// Most samples of any ray.
    pub(crate) most: u64,
}

impl Cast {
    fn joined(mut self, other: Self) -> Self {
        self.counters.add(&other.counters);
        self.most = self.most.max(other.most);
        self
    }
}

/// The slabs that tables are made for, as a stack: as thick as what a sample of `scene` stands for, which is drawn with `count` steps where it
/// goes by a count.
pub(crate) fn slabs(scene: &Scene, volume: &Volume, view: &View, count: u64) -> Stack {
    let (grid, planes) = (volume.grid(), scene.clip_planes());
    let stack = |range: Option<(f64, f64)>, count| match range {
        Some(range) => Stack::between(grid, view, planes, range, count),
        None => Stack::between(grid, view, planes, (0.0, 0.0), 0),
    };
    let by_voxel = |thickness: f64, count: usize| {
        let mut stack = stack(Stack::depth_range(grid, view), count as u64);
        if !stack.is_empty() {
            stack.spacing = thickness;
        }
        stack
    };
    match scene.algorithm() {
        Algorithm::ObjectSlices { .. } => {
            let axis = nearest_axis(grid, view);
            by_voxel(grid.spacing()[axis], grid.dims()[axis])
        }
        Algorithm::Traversal(_) | Algorithm::Template(_) => by_voxel(grid.smallest_spacing(), grid.dims().iter().sum()),
        _ if view.perspective => stack(distances(grid, view), count),
        _ => Stack::new(grid, view, planes, count),
    }
}

/// How samples lie along rays.
enum Way {
    Rays(Steps),
    Traversal(Connectivity),
    Template(Template),
    ObjectSlices(Layers),
    CoinFlips(Steps, Coins),
}

/// A frame of an algorithm whose samples go through the stages.
pub(crate) struct Caster<'p, 'v> {
    plan: &'p FramePlan<'v>,
    resolve: &'p Resolve<'p>,
    sight: Sight<'p>,
    way: Way,
    blend: Blend,
    /// Whether samples are voxels' own values.
    nearest: bool,
}

impl<'p, 'v> Caster<'p, 'v> {
    /// Rays of `scene` by `plan`, whose stack came from [`slabs`].
    pub(crate) fn new(scene: &Scene, plan: &'p FramePlan<'v>, resolve: &'p Resolve<'p>) -> Self {
        let (stack, grid) = (&plan.stack, plan.volume.grid());
        let steps = || Steps::new(plan);
        let way = match scene.algorithm() {
            Algorithm::Traversal(connectivity) => Way::Traversal(connectivity),
            Algorithm::Template(plane) => Way::Template(Template::new(stack, plane == TemplatePlane::Base)),
            Algorithm::ObjectSlices { spacing_correction } => {
                Way::ObjectSlices(Layers::new(stack, nearest_axis(grid, &stack.view), spacing_correction))
            }
            Algorithm::CoinFlips { games, seed } => Way::CoinFlips(steps(), Coins::new(games, seed)),
            _ => Way::Rays(steps()),
        };
        Self { plan, resolve, sight: Sight::new(stack, grid), way, blend: scene.blend(), nearest: scene.method().filter == Filter::Nearest }
    }

    /// Fills `pixels`, on the current thread pool.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `control` says so.
    pub(crate) fn draw(&self, finish: &impl Finish, control: Control<'_>, pixels: &mut [[f32; 4]]) -> Result<Cast> {
        let width = self.plan.stack.view.width as usize;
        if self.plan.stack.is_empty() {
            pixels.fill(finish.nothing());
            return Ok(Cast::default());
        }
        rows(
            pixels,
            width,
            control,
            || Samples::new(self.plan),
            |samples, x, y| {
                let Some(ray) = self.sight.ray(f64::from(x) + 0.5, f64::from(y) + 0.5) else { return finish.nothing() };
                if let Way::CoinFlips(steps, coins) = &self.way {
                    let mut game = coins.game(u64::from(y) * width as u64 + u64::from(x));
                    samples.cast(&ray, StepsAlong::new(steps, &self.sight, &ray), &mut game);
                    return finish.pixel(game.played());
                }
                let mut gather = Gather::new(self.plan, self.blend);
                self.cast(&ray, samples, &mut gather);
                gather.finished(self.resolve, finish, (x as usize, y as usize))
            },
        )
    }

    /// The samples of `ray`, gathered by `take`.
    fn cast(&self, ray: &Ray, samples: &mut Samples<'_, 'v>, take: &mut impl Take) {
        let stack = &self.plan.stack;
        match &self.way {
            Way::Rays(steps) | Way::CoinFlips(steps, _) => samples.cast(ray, StepsAlong::new(steps, &self.sight, ray), take),
            Way::Traversal(Connectivity::Six) => samples.cast(ray, Passed::new(stack, ray, self.nearest), take),
            Way::Traversal(connectivity) => {
                samples.cast(ray, Voxelized::new(stack, ray, *connectivity == Connectivity::Eighteen, self.nearest), take);
            }
            Way::Template(template) => samples.cast(ray, template.along(stack, ray), take),
            Way::ObjectSlices(layers) => samples.cast(ray, layers.along(ray), take),
        }
    }
}

/// What a row of pixels is drawn with.
trait Scratch {
    /// What was done since this was asked last.
    fn done(&mut self) -> Cast;
}

/// Fills `pixels`, `width` to a row, each with what `pixel` makes of its column and row; rows in parallel, each by one thread with `scratch` of
/// its own.
fn rows<S: Scratch>(
    pixels: &mut [[f32; 4]],
    width: usize,
    control: Control<'_>,
    scratch: impl Fn() -> S + Sync + Send,
    pixel: impl Fn(&mut S, u32, u32) -> [f32; 4] + Sync + Send,
) -> Result<Cast> {
    let total = pixels.len().div_ceil(width) as u64;
    let (done, stopped) = (AtomicU64::new(0), AtomicBool::new(false));
    let cast = pixels
        .par_chunks_mut(width)
        .enumerate()
        .map_init(scratch, |scratch, (y, row)| {
            if stopped.load(Ordering::Relaxed) {
                return Cast::default();
            }
            for (x, to) in row.iter_mut().enumerate() {
                // Whoever stops it does not want what is in the row.
                if control.is_stopped() {
                    stopped.store(true, Ordering::Relaxed);
                    return Cast::default();
                }
                *to = pixel(scratch, x as u32, y as u32);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if !control.step("rendering", done, total) {
                stopped.store(true, Ordering::Relaxed);
            }
            scratch.done()
        })
        .reduce(Cast::default, Cast::joined);
    if stopped.into_inner() { Err(Error::Stopped) } else { Ok(cast) }
}
