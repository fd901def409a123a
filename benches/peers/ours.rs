//! Our own pictures: the slice counts that reach an error, and what they cost.

use super::case::Case;
use super::judge::Judge;
use slicestack::scene::{Classification, Method, Slicing};
use slicestack::{RenderStats, Renderer, Scene, Settings};
use std::cell::RefCell;
use std::error::Error;

/// Most slices tried.
const MOST: u64 = 1 << 14;
/// Pixels end at this part of the error that is aimed at.
const TERMINATE: f64 = 0.5;

/// A renderer of one case with so many threads.
pub(crate) struct Ours<'c> {
    case: &'c Case,
    renderer: RefCell<Renderer>,
}

/// A way to a picture, and how good it is.
#[derive(Clone)]
pub(crate) struct Way {
    pub(crate) scene: Scene,
    /// Slices asked for, or taken to a tolerance.
    pub(crate) slices: u64,
    pub(crate) method: &'static str,
    pub(crate) error: f64,
}

/// What a method is called.
pub(crate) fn method_name(method: &Method) -> &'static str {
    match method.classification {
        Classification::Post if method.merge => "merged",
        Classification::Post => "midpoint",
        Classification::SecondOrder => "second-order",
        Classification::PreIntegrated => "pre-integrated",
        Classification::Pre => "pre-classified",
        _ => "another method",
    }
}

impl<'c> Ours<'c> {
    pub(crate) fn new(case: &'c Case, threads: usize) -> Self {
        let settings = Settings::new().threads(threads);
        Self { case, renderer: RefCell::new(Renderer::new(&case.volume, settings)) }
    }

    /// Seconds of one frame, without what is kept from frame to frame, and its statistics.
    pub(crate) fn frame(&self, scene: &Scene) -> Result<(f64, RenderStats), Box<dyn Error>> {
        let (picture, stats) = self.renderer.borrow_mut().render(scene)?;
        std::hint::black_box(picture);
        Ok((stats.render_seconds, stats))
    }

    /// The fewest slices of midpoint slabs, merged ones and second-order ones whose error is `error` at most; a method that never gets there
    /// is left out.
    pub(crate) fn counted(&self, judge: &Judge, error: f64) -> Result<Vec<Way>, Box<dyn Error>> {
        let mut ways = Vec::new();
        let plain = Method::default();
        for method in [plain, plain.with_merge(true), plain.with_classification(Classification::SecondOrder)] {
            let terminate = self.case.scene.terminate().min((TERMINATE * error) as f32);
            // Lit slabs are not merged.
            let Ok(base) = self.case.scene.clone().with_method(method) else { continue };
            let base = base.with_terminate(terminate)?;
            let make = |count: u64| self.way(judge, base.clone().with_slices(Slicing::Count(count))?);
            let (mut below, mut best) = (0, None);
            for count in std::iter::successors(Some(32), |n| Some(2 * n)).take_while(|&n| n <= MOST) {
                let way = make(count)?;
                if way.error <= error {
                    best = Some(way);
                    break;
                }
                below = count;
            }
            let Some(mut best) = best else { continue };
            // To a hundredth of the count: finer is noise of hit and miss.
            while best.slices - below > (best.slices / 100).max(1) {
                let way = make((below + best.slices) / 2)?;
                if way.error <= error {
                    best = way;
                } else {
                    below = way.slices;
                }
            }
            ways.push(best);
        }
        Ok(ways)
    }

    /// The picture to a tolerance of `error`.
    pub(crate) fn tolerance(&self, judge: &Judge, error: f64) -> Result<Way, Box<dyn Error>> {
        self.way(judge, self.case.scene.clone().with_slices(Slicing::Tolerance(error))?)
    }

    fn way(&self, judge: &Judge, scene: Scene) -> Result<Way, Box<dyn Error>> {
        let (picture, stats) = self.renderer.borrow_mut().render(&scene)?;
        let error = judge.error(scene.size().0, picture.pixels())?;
        Ok(Way { slices: stats.slices, method: method_name(&stats.method), error, scene })
    }
}
