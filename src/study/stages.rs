//! Where the time of a frame goes.

use super::methods::NamedMethod;
use super::observer::StageClock;
use super::record::StageTime;
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
    renderer: &mut Renderer,
    scene: &Scene,
    methods: &[&NamedMethod],
    slices: u64,
    left: impl Fn() -> f64,
) -> Result<Vec<StageTime>> {
    let mut list = Vec::new();
    for method in methods.iter().filter(|m| SHOWN.contains(&m.name)) {
        // Told where its pictures are missing.
        let Ok(scene) = method.of(scene) else { continue };
        let scene = scene.with_slices(Slicing::Count(slices))?;
        let mut plain = match renderer.render(&scene) {
            Ok((_, stats)) => stats.render_seconds,
            Err(Error::Stopped) => return Err(Error::Stopped),
            // Told where its pictures are missing.
            Err(_) => continue,
        };
        // The watched frame with the least disturbance tells the shares, the shortest plain one what they are shares of.
        let (_, stats, mut clock) = renderer.render_observed(&scene, StageClock::default())?;
        let mut watched = stats.render_seconds;
        for _ in 0..8 {
            if left() <= 0.0 {
                break;
            }
            let (_, stats, seen) = renderer.render_observed(&scene, StageClock::default())?;
            if stats.render_seconds < watched {
                (watched, clock) = (stats.render_seconds, seen);
            }
            plain = plain.min(renderer.render(&scene)?.1.render_seconds);
        }
        let whole = watched * stats.threads as f64;
        let stage = |stage: &str, share: f64| StageTime {
            method: method.name.into(),
            slices,
            stage: stage.into(),
            seconds: share * plain,
            share,
            batches: clock.timed(),
        };
        let mut shares: Vec<(&str, f64)> =
            clock.per_batch().into_iter().map(|(name, mean)| (name, mean * clock.batches() as f64 / whole)).collect();
        // Other programs on the machine may take a thread away in the middle of a stage.
        let told: f64 = shares.iter().map(|s| s.1).sum();
        shares.iter_mut().for_each(|s| s.1 /= told.max(1.0));
        shares.push(("between stages", (1.0 - told).max(0.0)));
        list.extend(shares.into_iter().map(|(name, share)| stage(name, share)));
    }
    Ok(list)
}
