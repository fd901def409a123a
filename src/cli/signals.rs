//! Signals: Ctrl-C and SIGTERM end the command within a fifth of a second, whatever it does, and nothing half-written stays.
//!
//! Work that looks for it stops by itself and tells so. What does not (a pipe that nobody writes to, an encoder) is ended by the thread that waits
//! for signals here: it takes the temporary files away first. The exit status is 128 and the signal's number, as shells have it.

use super::complain;
use slicestack::Error;
use slicestack::files::discard_unfinished;
use slicestack::volume::io::{cut_file, survive_cut_files};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;

/// Time that work has to stop by itself.
const PATIENCE: Duration = Duration::from_millis(140);

/// The signal that came; 0 before one does.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// Whether it is said already that the work was stopped.
static TOLD: AtomicBool = AtomicBool::new(false);
/// Whether the command runs until a signal ends it: then that is no news, and there is nothing to wait for.
static SERVES: AtomicBool = AtomicBool::new(false);

/// Whether a signal has come.
pub(super) fn is_stopped() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// From here on the command does nothing but serve until a signal comes.
pub(super) fn serve() {
    SERVES.store(true, Ordering::SeqCst);
}

/// Before what comes of the work is written.
///
/// # Errors
/// Where a signal has come, and where a file that was read from became shorter meanwhile.
pub(super) fn go_on() -> anyhow::Result<()> {
    anyhow::ensure!(!is_stopped(), Error::Stopped);
    match cut_file() {
        Some(path) => {
            Err(Error::format(path, "was cut short by another program while it was read; --no-mmap reads it before the work").into())
        }
        None => Ok(()),
    }
}

/// The exit status of a command that a signal has stopped, and the line about it; `None` where none came.
pub(super) fn ended() -> Option<ExitCode> {
    let signal = SIGNAL.load(Ordering::SeqCst);
    (signal != 0).then(|| {
        tell();
        ExitCode::from(status(signal) as u8)
    })
}

fn tell() {
    if !TOLD.swap(true, Ordering::SeqCst) {
        complain("error", "stopped");
    }
}

fn status(signal: i32) -> i32 {
    128 + signal
}

/// A signal has come: the work is asked to stop, then made to.
fn end(signal: i32) {
    SIGNAL.store(signal, Ordering::SeqCst);
    let serves = SERVES.load(Ordering::SeqCst);
    if !serves {
        std::thread::sleep(PATIENCE);
    }
    // Waits for what is getting its name just now; nothing gets one later.
    discard_unfinished();
    if !serves {
        tell();
    }
    std::process::exit(status(signal));
}

/// Ends the command cleanly where a signal asks for it; a file that grows too large for a limit becomes an error of the write.
///
/// # Errors
/// When the system refuses the handler.
#[cfg(unix)]
pub(super) fn catch() -> anyhow::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use std::sync::Arc;
    survive_cut_files()?;
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
    let mut wanted = vec![SIGINT, SIGTERM];
    if !is_ignored(SIGHUP) {
        wanted.push(SIGHUP);
    }
    let mut signals = signal_hook::iterator::Signals::new(wanted)?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(end))?;
    Ok(())
}

/// Whether the command was started with `signal` ignored, as `nohup` does; known on Linux.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Ends the command cleanly at Ctrl-C.
///
/// # Errors
/// When the system refuses the handler.
#[cfg(not(unix))]
pub(super) fn catch() -> anyhow::Result<()> {
    const INTERRUPT: i32 = 2;
    ctrlc::set_handler(|| end(INTERRUPT))?;
    Ok(())
}
