//! A budget of seconds, told as progress.

use crate::settings::Progress;
use crate::{Error, Renderer, Result, Scene};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Most frames of a scene.
const REPEATS: usize = 9;

/// How much of a budget is gone.
pub(super) struct Clock {
    start: Instant,
    budget: f64,
    ear: Option<Arc<Ear>>,
}

impl Clock {
    /// A clock that starts now, and tells `progress`.
    pub(super) fn new(budget: f64, progress: Option<Arc<dyn Progress>>) -> Self {
        let total = (budget * 1000.0) as u64;
        let ear = progress
            .map(|inner| Arc::new(Ear { inner, what: Mutex::new(String::new()), start: Instant::now(), done: AtomicU64::new(0), total }));
        Self { start: Instant::now(), budget, ear }
    }

    /// What renderers are to tell: that the study goes on.
    pub(super) fn progress(&self) -> Option<Arc<dyn Progress>> {
        self.ear.clone().map(|ear| ear as Arc<dyn Progress>)
    }

    /// Seconds gone.
    pub(super) fn gone(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Seconds left until `part` of the budget is gone; 0 when it is.
    pub(super) fn left(&self, part: f64) -> f64 {
        (part * self.budget - self.gone()).max(0.0)
    }

    /// Renders each scene again, in turns, as long as its frame fits into `part` of the budget, up to [`REPEATS`] times; the number beside it, the seconds
    /// of its frame, becomes the least.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub(super) fn shortest(&self, part: f64, renderer: &mut Renderer, mut frames: Vec<(&Scene, &mut f64)>) -> Result<()> {
        for _ in 0..REPEATS {
            for (scene, seconds) in &mut frames {
                if self.left(part) >= **seconds {
                    **seconds = seconds.min(renderer.render(scene)?.1.render_seconds);
                }
            }
        }
        Ok(())
    }

    /// Says what is being done now.
    ///
    /// # Errors
    /// [`Error::Stopped`] when progress said so.
    pub(super) fn now(&self, what: &str) -> Result<()> {
        let Some(ear) = &self.ear else { return Ok(()) };
        *ear.what.lock().unwrap_or_else(PoisonError::into_inner) = what.to_owned();
        if ear.step("", 0, 1) { Ok(()) } else { Err(Error::Stopped) }
    }
}

/// Turns the steps of single frames into those of the whole study.
struct Ear {
    inner: Arc<dyn Progress>,
    what: Mutex<String>,
    start: Instant,
    done: AtomicU64,
    total: u64,
}

impl Progress for Ear {
    fn step(&self, _: &str, _: u64, _: u64) -> bool {
        let gone = (self.start.elapsed().as_secs_f64() * 1000.0) as u64;
        let done = self.done.fetch_max(gone, Ordering::Relaxed).max(gone).min(self.total.saturating_sub(1));
        let what = self.what.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.inner.step(&what, done, self.total)
    }

    fn is_stopped(&self) -> bool {
        self.inner.is_stopped()
    }
}
