//! How evenly a frame's work falls on threads: measured on those there are, and worked out for more.

use super::record::{Balance, Shared};
use crate::raster::Observer;
use crate::scene::{Method, Slicing};
use crate::{Renderer, Result, Scene, Settings, Volume};
use std::time::Instant;

/// Sides of tiles compared.
const TILES: [u32; 3] = [8, 16, 32];
/// Threads that schedules are worked out for.
const THREADS: [usize; 4] = [2, 4, 16, 64];
/// Fewest and most frames of each.
const LEAST: usize = 4;
const FRAMES: usize = 20;

/// When a tile began and ended, and who rendered it.
#[derive(Debug, Clone, Copy)]
struct Span {
    thread: usize,
    start: Instant,
    end: Instant,
}

/// Notes the time of every tile, in the order of tiles.
#[derive(Debug, Default)]
struct TileClock {
    spans: Vec<Span>,
}

impl Observer for TileClock {
    fn fresh(&self) -> Self {
        let start = Instant::now();
        Self { spans: vec![Span { thread: rayon::current_thread_index().unwrap_or(0), start, end: start }] }
    }

    fn over(&mut self) {
        if let Some(span) = self.spans.last_mut() {
            span.end = Instant::now();
        }
    }

    fn merge(&mut self, other: Self) {
        self.spans.extend(other.spans);
    }
}

/// The share of a frame that the thread with the least to do stands idle, from the first tile's beginning to the last one's end.
fn idle(spans: &[Span], threads: usize) -> f64 {
    let (Some(start), Some(end)) = (spans.iter().map(|s| s.start).min(), spans.iter().map(|s| s.end).max()) else { return 0.0 };
    let mut busy = vec![0.0; threads.max(1)];
    for s in spans {
        if let Some(busy) = busy.get_mut(s.thread) {
            *busy += (s.end - s.start).as_secs_f64();
        }
    }
    let least = busy.iter().copied().fold(f64::INFINITY, f64::min);
    (1.0 - least / (end - start).as_secs_f64().max(1e-12)).clamp(0.0, 1.0)
}

/// Seconds until all of `tiles` are done when each goes to the first of `threads` that is free, as the renderer hands them out; and the
/// largest share of that time that a thread stands idle.
fn schedule(tiles: &[f64], threads: usize) -> Shared {
    let mut busy = vec![0.0f64; threads];
    for &tile in tiles {
        let free = (0..threads).min_by(|&a, &b| busy[a].total_cmp(&busy[b])).unwrap_or(0);
        busy[free] += tile;
    }
    let seconds = busy.iter().copied().fold(0.0, f64::max);
    let least = busy.iter().copied().fold(f64::INFINITY, f64::min);
    let all: f64 = tiles.iter().sum();
    let share = |part: f64| if seconds > 0.0 { part / seconds } else { 0.0 };
    Shared { threads, seconds, speedup: share(all), idle: share(seconds - least), mean_idle: share(seconds - all / threads as f64) }
}

/// Balance of frames in `slices` slices for tiles of several sides, until `left` says that time is up.
///
/// Tiles are timed in several frames, and the shortest time of each counts: what other programs take from the machine falls out.
///
/// # Errors
/// As [`Renderer::render`].
pub(super) fn measure(volume: &Volume, scene: &Scene, settings: &Settings, slices: u64, left: impl Fn() -> f64) -> Result<Vec<Balance>> {
    let scene = scene.clone().with_method(Method::default())?.with_slices(Slicing::Count(slices))?;
    let mut list = Vec::new();
    for tile in TILES {
        let mut renderer = Renderer::new(volume, Settings { tile: Some(tile), ..settings.clone() });
        let (mut tiles, mut least, mut seconds, mut threads): (Vec<f64>, f64, f64, usize) = (Vec::new(), 1.0, f64::INFINITY, 1);
        // Not the first frame, which meets cold caches.
        renderer.render(&scene)?;
        for frame in 0..FRAMES {
            if frame >= LEAST && left() <= 0.0 {
                break;
            }
            let (_, stats, clock) = renderer.render_observed(&scene, TileClock::default())?;
            threads = stats.threads;
            let times = clock.spans.iter().map(|s| (s.end - s.start).as_secs_f64());
            tiles.resize(clock.spans.len(), f64::INFINITY);
            tiles.iter_mut().zip(times).for_each(|(tile, time)| *tile = tile.min(time));
            least = least.min(idle(&clock.spans, threads));
            seconds = seconds.min(stats.render_seconds);
        }
        list.push(Balance {
            tile,
            tiles: tiles.len(),
            longest: tiles.iter().copied().fold(0.0, f64::max),
            threads,
            seconds,
            idle: least,
            shared: THREADS.map(|threads| schedule(&tiles, threads)).to_vec(),
        });
    }
    Ok(list)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::volume::phantom::Phantom;
    use std::time::Duration;

    #[test]
    fn a_schedule_hands_the_next_tile_to_the_first_free_thread() {
        let found = schedule(&[3.0, 1.0, 1.0, 1.0, 2.0], 2);
        // 3 + 2 on one, 1 + 1 + 1 on the other.
        assert_eq!((found.seconds, found.speedup, found.idle, found.mean_idle), (5.0, 1.6, 0.4, 0.2));
        let alone = schedule(&[1.0, 2.0], 1);
        assert_eq!((alone.seconds, alone.speedup, alone.idle), (3.0, 1.0, 0.0));
        assert_eq!(schedule(&[], 4).idle, 0.0);
    }

    #[test]
    fn idle_time_is_that_of_the_thread_with_the_least_to_do() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let span = |thread, from, to| Span { thread, start: at(from), end: at(to) };
        let found = idle(&[span(0, 0, 10), span(1, 0, 4), span(1, 5, 8)], 2);
        assert!((found - 0.3).abs() < 1e-9, "{found}");
    }

    #[test]
    fn every_tile_of_a_frame_is_timed() {
        let volume = Phantom::SheppLogan.volume(24).unwrap();
        let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(70, 33).unwrap();
        let settings = Settings { threads: Some(3), ..Settings::default() };
        let found = measure(&volume, &scene, &settings, 40, || 0.0).unwrap();
        let tiles: Vec<(u32, usize)> = found.iter().map(|b| (b.tile, b.tiles)).collect();
        assert_eq!(tiles, [(8, 9 * 5), (16, 5 * 3), (32, 3 * 2)]);
        assert!(
            found.iter().all(|b| b.threads == 3 && b.longest > 0.0 && (0.0..=1.0).contains(&b.idle) && b.shared.len() == THREADS.len())
        );
    }
}
