//! The bar on a terminal, and Ctrl-C.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use slicestack::Progress;
use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// What Ctrl-C meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Phase {
    /// Reading: nothing to tidy up, the process ends at once.
    Idle = 0,
    /// Rendering: the work is asked to stop; a second Ctrl-C ends the process.
    Rendering = 1,
    /// Writing: the file is finished first.
    Writing = 2,
    /// Writing a large file: the work is asked to stop, and takes away what is there of it.
    Streaming = 3,
}

static PHASE: AtomicU8 = AtomicU8::new(Phase::Idle as u8);
static STOP: AtomicBool = AtomicBool::new(false);

/// Says what is going on from here.
pub(super) fn enter(phase: Phase) {
    PHASE.store(phase as u8, Ordering::SeqCst);
}

/// Makes Ctrl-C (and SIGTERM) stop cleanly.
///
/// # Errors
/// When the system refuses the handler.
pub(super) fn catch_signals() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        let again = STOP.swap(true, Ordering::SeqCst);
        let phase = PHASE.load(Ordering::SeqCst);
        let tidies_up = phase == Phase::Writing as u8 || phase == Phase::Streaming as u8;
        if tidies_up || (phase == Phase::Rendering as u8 && !again) {
            return;
        }
        super::complain("error", "stopped");
        std::process::exit(1);
    })?;
    Ok(())
}

/// Work is over, and nothing is written yet: from here Ctrl-C ends the process at once, and so does one that came just before.
///
/// # Errors
/// In that case.
pub(super) fn rendered() -> anyhow::Result<()> {
    enter(Phase::Idle);
    anyhow::ensure!(!STOP.load(Ordering::SeqCst), "stopped");
    Ok(())
}

/// A bar on stderr where that is a terminal; everywhere: the ear for Ctrl-C.
pub(super) struct Bar {
    shown: bool,
    state: Mutex<State>,
}

struct State {
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Bar {
    pub(super) fn new() -> Self {
        Self { shown: stderr().is_terminal(), state: Mutex::new(State { start: Instant::now(), bar: None }) }
    }

    /// Takes the bar off the screen.
    pub(super) fn clear(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bar) = state.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Bar {
    fn step(&self, what: &str, done: u64, total: u64) -> bool {
        if self.shown {
            // Whoever finds the bar busy leaves it: the next step tells more anyway.
            if let Ok(mut state) = self.state.try_lock() {
                if state.bar.is_none() && state.start.elapsed() > PATIENCE {
                    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}");
                    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
                    state.bar = Some(bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())));
                }
                if let Some(bar) = &state.bar {
                    bar.set_message(what.to_owned());
                    bar.set_length(total);
                    bar.set_position(done);
                }
            }
        }
        !self.is_stopped()
    }

    fn is_stopped(&self) -> bool {
        STOP.load(Ordering::Relaxed)
    }
}
