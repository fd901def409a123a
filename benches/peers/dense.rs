//! What does not depend on an error: fragments with nothing to leave out, volumes that are empty, frames while the view turns.

use super::case::{Case, SIDE, SIZE, TURN, view};
use super::gl::Gl;
use super::llvmpipe::Llvmpipe;
use super::ours::Ours;
use super::rounds;
use super::scenes::{Share, block, haze};
use serde::Serialize;
use slicestack::{Renderer, Settings};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

/// Slices of a haze.
const COUNT: u64 = 256;
/// Passes of a stage over its batches; the shortest counts.
const PASSES: usize = 400;
/// Cycles of a core for a sample that no loop over eight lanes is expected to beat.
pub(crate) const BOUND: f64 = 3.0;
/// Views of a whole turn.
pub(crate) const VIEWS: u32 = 36;
/// Error asked for while turning.
pub(crate) const TURNING: f64 = 2e-3;

/// A stage alone, over batches as the frame brought them to it, from the cache.
#[derive(Debug, Serialize)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    /// Whether every batch goes through it; else those at the box's faces alone.
    pub(crate) everywhere: bool,
    /// Cycles of a core for a fragment.
    pub(crate) cycles: f64,
}

/// A volume that shows everywhere, pixels that never end.
#[derive(Debug, Serialize)]
pub(crate) struct Dense {
    pub(crate) slices: u64,
    pub(crate) fragments: u64,
    pub(crate) llvmpipe_seconds: f64,
    pub(crate) seconds: f64,
    /// Cycles of a core a second, as a chain of multiplications ran.
    pub(crate) clock: f64,
    pub(crate) cycles: f64,
    pub(crate) stages: Vec<Stage>,
    /// The same with half of the volume transparent, and with all of it.
    pub(crate) half_seconds: f64,
    pub(crate) empty_seconds: f64,
}

/// A whole turn in steps of ten degrees.
#[derive(Debug, Serialize)]
pub(crate) struct Turn {
    pub(crate) scene: String,
    /// In 256 slices, the default.
    pub(crate) mean_seconds: f64,
    pub(crate) worst_seconds: f64,
    /// To an error of [`TURNING`].
    pub(crate) tolerance_mean_seconds: f64,
    pub(crate) tolerance_worst_seconds: f64,
}

fn case(share: Share) -> Result<Case, Box<dyn Error>> {
    let scene = haze(SIDE, COUNT)?;
    let case = Case::new("haze".into(), block(SIZE, share)?, scene.transfer())?;
    let scene = case.scene.clone().with_terminate(0.0)?.with_slices(scene.slicing())?;
    Ok(Case { scene, ..case })
}

/// Cycles a second, from steps that wait for each other: a 64-bit product takes three cycles on the processors of this decade, an
/// exclusive or takes one.
fn clock() -> f64 {
    const STEPS: u64 = 2_000_000;
    let factor = black_box(0x9E37_79B9_7F4A_7C15u64);
    let once = || {
        let start = Instant::now();
        black_box((0..STEPS).fold(black_box(3u64), |x, i| x.wrapping_mul(factor) ^ i));
        4.0 * STEPS as f64 / start.elapsed().as_secs_f64()
    };
    (0..50).map(|_| once()).fold(0.0, f64::max)
}

/// Each stage of the haze's frame. What it takes to bring batches back before each pass is taken off.
fn stages(case: &Case, clock: f64) -> Result<Vec<Stage>, Box<dyn Error>> {
    let mut renderer = Renderer::new(&case.volume, Settings::default());
    let mut list = Vec::new();
    for mut stage in slicestack::bench::stages(&mut renderer, &case.scene)? {
        let (mut whole, mut copy) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..PASSES {
            let start = Instant::now();
            stage.run();
            let between = Instant::now();
            stage.copy();
            copy = copy.min(between.elapsed().as_secs_f64());
            whole = whole.min((between - start).as_secs_f64());
        }
        let cycles = (whole - copy).max(0.0) * clock / stage.fragments() as f64;
        list.push(Stage { name: stage.name(), everywhere: stage.is_everywhere(), cycles });
    }
    Ok(list)
}

/// Everything about the haze.
pub(crate) fn dense(gl: &Gl, rounds: usize, threads: usize) -> Result<Dense, Box<dyn Error>> {
    let (all, half, nothing) = (case(Share::All)?, case(Share::Half)?, case(Share::Nothing)?);
    let llvmpipe = Llvmpipe::new(gl, &all, &[COUNT as usize]);
    let (a, h, n) = (Ours::new(&all, threads), Ours::new(&half, threads), Ours::new(&nothing, threads));
    let times = rounds::run(
        rounds,
        &mut [
            Box::new(|| Ok(llvmpipe.frame(0))),
            Box::new(|| Ok(a.frame(&all.scene)?.0)),
            Box::new(|| Ok(h.frame(&half.scene)?.0)),
            Box::new(|| Ok(n.frame(&nothing.scene)?.0)),
        ],
    )?;
    let seconds = times[1].least;
    let stats = a.frame(&all.scene)?.1;
    let clock = clock();
    let cycles = |seconds: f64| seconds * threads as f64 * clock / stats.fragments as f64;
    Ok(Dense {
        slices: COUNT,
        fragments: stats.fragments,
        llvmpipe_seconds: times[0].least,
        seconds,
        clock,
        cycles: cycles(seconds),
        stages: stages(&all, clock)?,
        half_seconds: times[2].least,
        empty_seconds: times[3].least,
    })
}

/// Frames of `case` all the way around; of each view the shorter of two.
pub(crate) fn turn(case: &Case, threads: usize) -> Result<Turn, Box<dyn Error>> {
    let settings = Settings::new().threads(threads);
    let mut renderer = Renderer::new(&case.volume, settings);
    let mut around = |scene: slicestack::Scene| -> Result<(f64, f64), Box<dyn Error>> {
        renderer.render(&scene)?;
        let (mut sum, mut worst) = (0.0, 0.0f64);
        for k in 0..VIEWS {
            let turn = TURN + 360.0 * f64::from(k) / f64::from(VIEWS);
            let scene = scene.clone().with_camera(view(case.volume.grid(), turn)?);
            let first = renderer.render(&scene)?.1.render_seconds;
            let least = first.min(renderer.render(&scene)?.1.render_seconds);
            sum += least;
            worst = worst.max(least);
        }
        Ok((sum / f64::from(VIEWS), worst))
    };
    let (mean_seconds, worst_seconds) = around(case.scene.clone())?;
    let to_tolerance = case.scene.clone().with_slices(slicestack::scene::Slicing::Tolerance(TURNING))?;
    let (tolerance_mean_seconds, tolerance_worst_seconds) = around(to_tolerance)?;
    Ok(Turn { scene: case.name.clone(), mean_seconds, worst_seconds, tolerance_mean_seconds, tolerance_worst_seconds })
}
