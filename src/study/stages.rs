//! Where the time of a frame goes.

use super::methods::NamedMethod;
use super::record::StageTime;
use super::watch::StageClock;
use crate::scene::Slicing;
use crate::{Error, Renderer, Result, Scene};

/// Methods whose stages are told apart, where they are among those compared.
const SHOWN: [&str; 4] = ["midpoint", "pre-integrated", "second-order", "pre-classified"];

/// Time of every stage at `slices` slices.
///
/// Batches are timed on the way through a frame, some of them; the means are scaled to all batches, and what is left of
/// the frame's shortest time is geometry, passing over what is empty, and everything else between the stages.
///
/// # Errors
/// As [`Renderer::render`]; a method that cannot render the scene is left out.
pub(super) fn measure(
    renderer: &mut Renderer<'_>,
    scene: &Scene,
    methods: &[&NamedMethod],
    slices: u64,
    left: impl Fn() -> f64,
) -> Result<Vec<StageTime>> {
    let mut list = Vec::new();
    for method in methods.iter().filter(|m| SHOWN.contains(&m.name)) {
        let scene = scene.clone().with_method(method.method)?.with_slices(Slicing::Count(slices))?;
        let mut frame = match renderer.render(&scene) {
            Ok((_, stats)) => stats,
            Err(Error::Stopped) => return Err(Error::Stopped),
            // Told where its pictures are missing.
            Err(_) => continue,
        };
        let mut clock = StageClock::default();
        for run in 0..8 {
            let (_, stats, seen) = renderer.render_watched::<StageClock>(&scene)?;
            // The frame with the least disturbance speaks for all: the times between stages are only scaled.
            if run == 0 || stats.render_seconds < frame.render_seconds {
                clock = seen;
            }
            frame = stats;
            let (_, plain) = renderer.render(&scene)?;
            frame.render_seconds = frame.render_seconds.min(plain.render_seconds);
            if left() <= 0.0 {
                break;
            }
        }
        let threads = frame.threads as f64;
        let stage = |stage: &str, seconds: f64| StageTime {
            method: method.name.into(),
            slices,
            stage: stage.into(),
            seconds,
            share: seconds / frame.render_seconds,
            batches: clock.timed(),
        };
        let mut stages: Vec<StageTime> =
            clock.per_batch().into_iter().map(|(name, mean)| stage(name, mean * clock.batches() as f64 / threads)).collect();
        let told: f64 = stages.iter().map(|s| s.seconds).sum();
        stages.push(stage("between stages", (frame.render_seconds - told).max(0.0)));
        list.extend(stages);
    }
    Ok(list)
}
