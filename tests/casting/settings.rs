//! Threads, tiles and vector levels change no byte; work can be watched and stopped.

use crate::{PARALLEL, looking, numbers, plain, telling, with};
use glam::DVec3;
use slicestack::scene::{Algorithm, Camera, Connectivity, Lighting, Placement, Projection, TemplatePlane};
use slicestack::{Error, Level, Progress, Renderer, Settings};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

fn algorithms() -> Vec<Algorithm> {
    vec![
        Algorithm::Rays,
        Algorithm::Traversal(Connectivity::Six),
        Algorithm::Traversal(Connectivity::Eighteen),
        Algorithm::Traversal(Connectivity::TwentySix),
        Algorithm::Template(TemplatePlane::Base),
        Algorithm::Template(TemplatePlane::Image),
        Algorithm::ObjectSlices { spacing_correction: true },
        Algorithm::Grid,
        Algorithm::CoinFlips { games: 20, seed: 1 },
    ]
}

#[test]
fn no_setting_changes_a_byte() {
    let volume = numbers([17, 9, 12]);
    let mut lighting = Lighting::default();
    lighting.shininess = 7.5;
    for algorithm in algorithms() {
        let camera = if algorithm == Algorithm::Grid {
            Camera::new(Placement::Along { axis: 1, backwards: true }, PARALLEL).unwrap()
        } else if matches!(algorithm, Algorithm::Template(_)) {
            looking(DVec3::new(20.0, 12.0, 9.0), &volume, PARALLEL)
        } else {
            looking(DVec3::new(20.0, 12.0, 9.0), &volume, Projection::Perspective { fov_y: 50.0 })
        };
        let scene = plain(telling(), 37, 40).with_camera(camera).with_lighting(Some(lighting.clone())).unwrap();
        let scene = with(&scene.with_terminate(0.01).unwrap(), algorithm);
        let sha = |threads: usize, tile: u32, level: Level| {
            let settings = Settings::new().threads(threads).tile(tile).level(level);
            let (picture, stats) = Renderer::new(&volume, settings).render(&scene).unwrap();
            (picture.sha256(), stats.tally, stats.slices, stats.left_out)
        };
        let want = sha(1, 64, Level::SCALAR);
        let t = want.1;
        assert_eq!(t.fragments + t.corners, t.looked_up + t.empty + t.finished + t.merged, "{algorithm:?}");
        assert!(t.looked_up > 1000, "{algorithm:?}: {t:?}");
        for level in Level::available() {
            for (threads, tile) in [(1, 16), (2, 8), (5, 13)] {
                assert_eq!(sha(threads, tile, level), want, "{algorithm:?} at {threads} threads, tiles of {tile}, {}", level.name());
            }
        }
    }
}

struct Stop(AtomicU64);

impl Progress for Stop {
    fn step(&self, _: &str, done: u64, total: u64) -> bool {
        assert!(done <= total && total == 37);
        self.0.fetch_add(1, Ordering::Relaxed) < 3
    }
}

#[test]
fn work_is_told_and_stops() {
    let volume = numbers([9, 9, 9]);
    for algorithm in algorithms() {
        let camera = Camera::new(Placement::Along { axis: 0, backwards: false }, PARALLEL).unwrap();
        let scene = with(&plain(telling(), 37, 40).with_camera(camera), algorithm);
        let stop = Arc::new(Stop(AtomicU64::new(0)));
        let settings = Settings::new().threads(1).progress(stop.clone());
        let stopped = Renderer::new(&volume, settings).render(&scene);
        assert!(matches!(stopped, Err(Error::Stopped)), "{algorithm:?}");
        assert_eq!(stop.0.load(Ordering::Relaxed), 4, "{algorithm:?}: rows after it was stopped");
    }
}
