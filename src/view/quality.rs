//! How coarse a moving frame is: fewer slices first, then fewer pixels, so that a frame is made in the time there is for it.
//!
//! Levels go from fine to coarse. The times of the last frames choose one. A level that has proved too slow is not tried again for a while, so that
//! the view does not flicker between two of them.

use crate::renderer::slice_count;
use crate::scene::{Algorithm, Scene, Slicing};
use crate::{Result, Volume};

/// Seconds for a frame, its encoding included: more than 30 of them a second, with time to spare for their way and for the screen.
const TIME: f64 = 0.023;
/// Share of it that a finer level may be expected to take.
const SPARE: f64 = 0.85;
/// Frames whose times are kept for a level.
const KEPT: usize = 5;
/// Frames for which it is remembered that a level was slow.
const MEMORY: u32 = 150;
/// Fewest slices, unless the scene has fewer.
const FEWEST: u64 = 64;
/// Divisors of the picture's sides.
const DIVISORS: [f64; 12] = [1.125, 1.25, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0];
/// Seconds that a slice of a pixel is taken for before anything is measured.
const GUESS: f64 = 5e-10;
/// Share of a frame's time that fewer slices do not shorten, and fewer pixels do not: empty space is passed over, and pixels end early.
const FIXED: [f64; 2] = [0.4, 0.1];

/// What a scene's moving frames have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Subject {
    /// Columns and rows of the still frame.
    pub(super) size: (u32, u32),
    /// Slices of a frame in full.
    pub(super) slices: u64,
    /// Whether frames of fewer slices look alike.
    pub(super) fewer: bool,
}

/// How coarse a frame is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// Slices of the frame.
    pub(super) slices: u64,
    /// What the picture's sides are divided by.
    pub(super) divisor: f64,
}

/// What is known of a level.
#[derive(Debug, Clone, Default)]
struct Known {
    /// Seconds of its last frames.
    times: Vec<f64>,
    /// The frame at which the last of them was made.
    at: u32,
}

impl Known {
    fn median(&self) -> Option<f64> {
        let mut sorted = self.times.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }
}

/// Chooses levels.
#[derive(Debug, Default)]
pub(super) struct Quality {
    subject: Subject,
    levels: Vec<Level>,
    known: Vec<Known>,
    now: usize,
    frames: u32,
    /// Seconds for a slice of a pixel, as measured last.
    rate: Option<f64>,
}

impl Subject {
    /// That of `scene`.
    ///
    /// # Errors
    /// Where the camera does not resolve.
    pub(super) fn of(scene: &Scene, volume: &Volume) -> Result<Self> {
        let slices = match scene.slicing() {
            Slicing::Count(count) => count,
            // In steps of 32: a turn changes the depth all the time.
            _ => slices(scene, volume)?.div_ceil(32).clamp(1, 64) * 32,
        };
        let sliced = matches!(scene.algorithm(), Algorithm::Slices | Algorithm::Shells) && scene.opengl().is_none();
        // A projection of fewer values is another projection.
        Ok(Self { size: scene.size(), slices, fewer: sliced && !scene.blend().projects_values() })
    }
}

/// Slices of a frame of `scene` in full; with a tolerance those that are half a voxel apart.
///
/// # Errors
/// Where the camera does not resolve, and for more slices than there can be.
pub(super) fn slices(scene: &Scene, volume: &Volume) -> Result<u64> {
    let spacing = match scene.slicing() {
        Slicing::Count(count) => return Ok(count),
        Slicing::Spacing(spacing) => spacing,
        Slicing::Tolerance(_) => 0.5 * volume.grid().smallest_spacing(),
    };
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    slice_count(spacing, scene, volume.grid(), &view)
}

impl Level {
    /// Columns and rows of a picture of `size`.
    pub(super) fn size(self, (width, height): (u32, u32)) -> (u32, u32) {
        let side = |side: u32| ((f64::from(side) / self.divisor).round() as u32).max(1);
        (side(width), side(height))
    }

    /// `scene` that coarse.
    ///
    /// # Errors
    /// Where the scene does not go together with a number of slices.
    pub(super) fn coarse(self, scene: &Scene, subject: Subject) -> Result<Scene> {
        let (width, height) = self.size(subject.size);
        let scene = scene.clone().with_size(width, height)?;
        if !subject.fewer && !matches!(scene.slicing(), Slicing::Tolerance(_)) {
            return Ok(scene);
        }
        let method = crate::scene::Method { extrapolate: false, ..scene.method() };
        scene.with_method(method)?.with_slices(Slicing::Count(self.slices))
    }

    /// Slices times pixels.
    fn work(self, (width, height): (u32, u32)) -> f64 {
        self.slices as f64 * f64::from(width) * f64::from(height) / (self.divisor * self.divisor)
    }
}

impl Quality {
    /// The level for the next frame.
    pub(super) fn choose(&mut self, subject: Subject) -> Level {
        if subject != self.subject || self.levels.is_empty() {
            self.subject = subject;
            self.levels = levels(subject);
            self.known = vec![Known::default(); self.levels.len()];
            let rate = self.rate.unwrap_or(GUESS);
            let fits = |level: &Level| rate * level.work(subject.size) <= TIME * SPARE;
            self.now = self.levels.iter().position(fits).unwrap_or(self.levels.len() - 1);
        }
        self.levels[self.now]
    }

    /// The last frame took so many seconds.
    pub(super) fn measured(&mut self, seconds: f64) {
        let Some(level) = self.levels.get(self.now).copied() else { return };
        self.frames += 1;
        self.rate = Some(seconds / level.work(self.subject.size));
        let known = &mut self.known[self.now];
        if self.frames.saturating_sub(known.at) > MEMORY {
            known.times.clear();
        }
        known.times.push(seconds);
        if known.times.len() > KEPT {
            known.times.remove(0);
        }
        known.at = self.frames;
        let (count, median) = (known.times.len(), known.median().unwrap_or(seconds));
        let last = self.levels.len() - 1;
        // One frame that is late by chance changes nothing; one that is late by far shows that the guess was wrong.
        if median > TIME && (count >= 3 || seconds > 2.0 * TIME) {
            self.now = (self.now + 1..last).find(|&k| self.expected(k, median) <= TIME).unwrap_or(last);
        } else if count >= 3 {
            self.now = (0..self.now).find(|&k| self.expected(k, median) <= TIME * SPARE).unwrap_or(self.now);
        }
    }

    /// Seconds that level `k` is expected to take where the present one takes `seconds`.
    fn expected(&self, k: usize, seconds: f64) -> f64 {
        let (from, to) = (self.levels[self.now], self.levels[k]);
        let slices = FIXED[0] + (1.0 - FIXED[0]) * to.slices as f64 / from.slices as f64;
        let pixels = FIXED[1] + (1.0 - FIXED[1]) * (from.divisor / to.divisor) * (from.divisor / to.divisor);
        let by_work = seconds * slices * pixels;
        let known = &self.known[k];
        let fresh = self.frames.saturating_sub(known.at) <= MEMORY;
        known.median().filter(|_| fresh).map_or(by_work, |median| if k < self.now { median.max(by_work) } else { median })
    }
}

/// The levels of a subject, the finest first.
fn levels(subject: Subject) -> Vec<Level> {
    let mut levels = vec![Level { slices: subject.slices, divisor: 1.0 }];
    let mut slices = subject.slices;
    while subject.fewer && slices > (subject.slices / 4).max(FEWEST) {
        slices = (slices * 4 / 5).max(FEWEST);
        levels.push(Level { slices, divisor: 1.0 });
    }
    levels.extend(DIVISORS.map(|divisor| Level { slices, divisor }));
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUBJECT: Subject = Subject { size: (512, 512), slices: 512, fewer: true };

    /// Levels of `frames` frames that take `seconds` each, which may depend on the frame.
    fn run(frames: u32, seconds: impl Fn(u32, Level) -> f64) -> Vec<Level> {
        let mut quality = Quality::default();
        (0..frames)
            .map(|n| {
                let level = quality.choose(SUBJECT);
                quality.measured(seconds(n, level));
                level
            })
            .collect()
    }

    fn work(level: Level) -> f64 {
        level.work(SUBJECT.size) / (512.0 * 512.0 * 512.0)
    }

    /// Noise from 0 to 1.
    fn noise(n: u32) -> f64 {
        f64::from(n.wrapping_mul(2_654_435_761) >> 16) / 65536.0
    }

    #[test]
    fn frames_come_in_time_and_as_fine_as_that_allows() {
        for full in [0.004, 0.03, 0.1, 0.4, 1.5] {
            let time = |level: Level| 0.002 + full * work(level);
            let found = run(100, |_, level| time(level));
            let last = found[99];
            assert!(time(last) <= TIME, "{full}: {last:?}");
            let finer = levels(SUBJECT).into_iter().rev().find(|l| work(*l) > work(last));
            assert!(finer.is_none_or(|l| time(l) > 0.6 * TIME), "{full}: {last:?} where {finer:?} would do");
        }
    }

    #[test]
    fn slices_go_first_and_projections_keep_theirs() {
        let found = levels(SUBJECT);
        let first = found.iter().position(|l| l.divisor > 1.0).map_or(0, |at| found[at].slices);
        assert_eq!(first, found.iter().map(|l| l.slices).min().unwrap_or(0));
        assert!(first < 150, "{first}");
        let mip = levels(Subject { fewer: false, ..SUBJECT });
        assert!(mip.iter().all(|l| l.slices == 512) && mip.len() == DIVISORS.len() + 1);
    }

    #[test]
    fn noise_does_not_make_it_flicker() {
        let found = run(600, |n, level| (0.004 + 0.12 * work(level)) * (0.85 + 0.3 * noise(n)));
        let changes = found[20..].windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes <= 10, "{changes} changes of level in 580 frames");
    }

    #[test]
    fn one_late_frame_changes_nothing() {
        let found = run(100, |n, level| if n == 60 { 0.045 } else { 0.003 + 0.1 * work(level) });
        assert_eq!(found[59], found[70]);
    }
}
