//! An allocator whose refusals end the process with one line instead of an abort.

use crate::files::discard_unfinished_now;
use crate::memory::asks;
use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{Cursor, Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The system's allocator for a command: where the system gives no memory, and nobody is there to take that for an answer, the process ends with
/// `error: no memory for N bytes`, exit status 1, and its unfinished files taken away.
///
/// ```
/// #[global_allocator]
/// static ALLOCATOR: slicestack::OrOneLine = slicestack::OrOneLine;
/// ```
#[derive(Debug)]
pub struct OrOneLine;

/// Whether a thread ends the process already.
static ENDING: AtomicBool = AtomicBool::new(false);

// SAFETY: every method hands its arguments to the system's allocator and its answer back; what is done about a refusal does not touch them.
unsafe impl GlobalAlloc for OrOneLine {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are the ones that are asked for.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.realloc(at, layout, size) }, size)
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

/// Lets the system's allocator give the memory of pictures back as soon as they are gone, and share what it keeps among threads: for a program that makes
/// pictures for hours. Without it each thread that ever held one keeps some megabytes. On systems without glibc nothing changes.
pub fn give_back_memory() {
    #[cfg(all(feature = "formats", target_os = "linux", target_env = "gnu"))]
    for (what, value) in [(libc::M_ARENA_MAX, 2), (libc::M_MMAP_THRESHOLD, 1 << 20), (libc::M_TRIM_THRESHOLD, 4 << 20)] {
        // SAFETY: sets a number of the allocator, at any time and from any thread.
        unsafe { libc::mallopt(what, value) };
    }
}

#[inline]
fn checked(given: *mut u8, bytes: usize) -> *mut u8 {
    if given.is_null() && !asks() {
        end(bytes);
    }
    given
}

/// Tells, tidies up, and ends the process. Asks for no memory itself; where something here does, the allocator's own abort ends the process.
#[cold]
fn end(bytes: usize) {
    thread_local! {
        static HERE: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
    }
    if HERE.replace(true) {
        return;
    }
    if ENDING.swap(true, Ordering::SeqCst) {
        // Another thread does.
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut line = Cursor::new([0_u8; 80]);
    // Nobody is left to tell where this fails.
    drop(writeln!(line, "error: no memory for {bytes} bytes"));
    let length = line.position() as usize;
    drop(stderr().write_all(&line.get_ref()[..length]));
    discard_unfinished_now();
    std::process::exit(1);
}
