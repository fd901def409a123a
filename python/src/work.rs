//! Long work: without Python's lock, stopped by Ctrl-C, telling how far it has come.

use crate::error::raised;
use pyo3::prelude::*;
use slicestack::{Error, Progress};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often the calling thread looks after signals and tells of progress.
const TICK: Duration = Duration::from_millis(50);

/// How far some work has come, and whether it is to stop. Threads write it, the calling thread reads it: no thread but that one runs Python.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    what: Mutex<String>,
    done: AtomicU64,
    total: AtomicU64,
    stop: AtomicBool,
}

impl Progress for Watch {
    fn step(&self, what: &str, done: u64, total: u64) -> bool {
        // Whoever comes second leaves the name as it is.
        if let Ok(mut name) = self.what.try_lock() {
            if *name != what {
                what.clone_into(&mut name);
                self.done.store(0, Ordering::Relaxed);
            }
        }
        self.done.fetch_max(done, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        !self.is_stopped()
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl Watch {
    /// Tells `callback`; whether it wants the work to go on.
    fn tell(&self, py: Python<'_>, callback: &Py<PyAny>) -> PyResult<bool> {
        let what = self.what.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let (done, total) = (self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed));
        if total == 0 {
            return Ok(true);
        }
        let said = callback.call1(py, (what, done, total))?;
        // Whoever says nothing lets it go on.
        Ok(said.is_none(py) || said.is_truthy(py)?)
    }
}

/// Does `work` on a thread of its own without Python's lock. `watch` hears of Ctrl-C, and of `callback`'s wish to stop: `callback(what, done,
/// total)` is called on this thread, and stops the work by `False`.
///
/// # Errors
/// What `work` says; what a signal's handler or the callback raises.
pub(crate) fn run<R: Send>(
    py: Python<'_>,
    watch: &Arc<Watch>,
    callback: Option<&Py<PyAny>>,
    work: impl FnOnce() -> Result<R, Error> + Send,
) -> PyResult<R> {
    watch.stop.store(false, Ordering::Relaxed);
    watch.total.store(0, Ordering::Relaxed);
    let mut raised_here = None;
    let found = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let thread = scope.spawn(move || {
                // The other end is there as long as this thread is.
                drop(sender.send(work()));
            });
            let found = loop {
                match receiver.recv_timeout(TICK) {
                    Ok(found) => break Some(found),
                    Err(RecvTimeoutError::Disconnected) => break None,
                    Err(RecvTimeoutError::Timeout) if raised_here.is_some() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        let heard = Python::attach(|py| {
                            py.check_signals()?;
                            callback.map_or(Ok(true), |callback| watch.tell(py, callback))
                        });
                        match heard {
                            Ok(true) => {}
                            Ok(false) => watch.stop.store(true, Ordering::Relaxed),
                            Err(e) => {
                                watch.stop.store(true, Ordering::Relaxed);
                                raised_here = Some(e);
                            }
                        }
                    }
                }
            };
            // A panic of the work goes on as one of this thread, which Python sees as an exception.
            if let Err(panic) = thread.join() {
                std::panic::resume_unwind(panic);
            }
            found
        })
    });
    if let Some(e) = raised_here {
        return Err(e);
    }
    match found {
        Some(Ok(found)) => {
            // Work that took no tick is told of at its end.
            if let Some(callback) = callback {
                watch.tell(py, callback)?;
            }
            Ok(found)
        }
        Some(Err(e)) => Err(raised(e)),
        None => Err(raised(Error::Stopped)),
    }
}
