//! The bar on a terminal.

use super::signals::is_stopped;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use slicestack::Progress;
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

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
        is_stopped()
    }
}
