//! Files that other programs cut short while they are mapped. The system then has no bytes for what lies behind the new end, and answers a look
//! at it with the signal SIGBUS, which ends the process. With [`survive_cut_files`] such a look finds zeros instead, and [`cut_file`] tells of it
//! afterwards, so that the work ends with an error and whatever was begun is tidied up.

use memmap2::Mmap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Most mappings that are watched at a time; of more than these the first ones are.
const SLOTS: usize = 256;

/// A mapping: its addresses, from `start` up to but without `end`, which are 0 while the slot is free.
struct Slot {
    taken: AtomicBool,
    start: AtomicUsize,
    end: AtomicUsize,
    cut: AtomicBool,
}

static MAPPINGS: [Slot; SLOTS] =
    [const { Slot { taken: AtomicBool::new(false), start: AtomicUsize::new(0), end: AtomicUsize::new(0), cut: AtomicBool::new(false) } };
        SLOTS];

/// The first file found cut short among mappings that are gone.
static FOUND: Mutex<Option<PathBuf>> = Mutex::new(None);

/// A mapping under watch, for as long as this lives.
#[derive(Debug)]
pub(super) struct Watched {
    slot: usize,
}

/// The mappings that live, by slot: their paths.
static PATHS: Mutex<Vec<(usize, PathBuf)>> = Mutex::new(Vec::new());

impl Watched {
    /// Watches `map`, a mapping of the file `path`. `None` where too many are watched already.
    pub(super) fn over(map: &Mmap, path: &Path) -> Option<Self> {
        let free = |slot: &&Slot| slot.taken.compare_exchange(false, true, Ordering::AcqRel, Ordering::Relaxed).is_ok();
        let (slot, place) = MAPPINGS.iter().enumerate().find(|(_, slot)| free(slot))?;
        place.cut.store(false, Ordering::Release);
        let start = map.as_ptr() as usize;
        place.end.store(start + map.len(), Ordering::Release);
        place.start.store(start, Ordering::Release);
        PATHS.lock().unwrap_or_else(PoisonError::into_inner).push((slot, path.to_path_buf()));
        Some(Self { slot })
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let place = &MAPPINGS[self.slot];
        place.end.store(0, Ordering::Release);
        place.start.store(0, Ordering::Release);
        let mut paths = PATHS.lock().unwrap_or_else(PoisonError::into_inner);
        let path = paths.iter().position(|(slot, _)| *slot == self.slot).map(|at| paths.swap_remove(at).1);
        if let Some(path) = path.filter(|_| place.cut.load(Ordering::Acquire)) {
            FOUND.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(path);
        }
        place.taken.store(false, Ordering::Release);
    }
}

/// A file that was cut short while it was mapped, and looked at behind its new end since [`survive_cut_files`]; what was read there are zeros, and
/// whatever came of them is not to be trusted.
pub fn cut_file() -> Option<PathBuf> {
    if let Some(path) = &*FOUND.lock().unwrap_or_else(PoisonError::into_inner) {
        return Some(path.clone());
    }
    let paths = PATHS.lock().unwrap_or_else(PoisonError::into_inner);
    paths.iter().find(|(slot, _)| MAPPINGS[*slot].cut.load(Ordering::Acquire)).map(|(_, path)| path.clone())
}

/// Looks at `bytes`, page for page, where that is safe: the system does not, when it writes them to a file; it only says that the address is bad.
/// Tells as [`cut_file`] what it finds.
pub(crate) fn look_for_cut(bytes: &[u8]) -> Option<PathBuf> {
    #[cfg(unix)]
    if handler::is_installed() {
        bytes.iter().step_by(512).for_each(|byte| {
            std::hint::black_box(*byte);
        });
    }
    #[cfg(not(unix))]
    let _ = bytes;
    cut_file()
}

/// From here on a volume's file that is cut short while it is mapped does not end the process: see [`cut_file`]. For programs, which have
/// signals to themselves; a library leaves them alone. On systems other than Unix nothing is to be done.
///
/// # Errors
/// When the system refuses the handler.
#[cfg(not(unix))]
pub fn survive_cut_files() -> io::Result<()> {
    Ok(())
}

/// From here on a volume's file that is cut short while it is mapped does not end the process: see [`cut_file`]. For programs, which have
/// signals to themselves; a library leaves them alone.
///
/// # Errors
/// When the system refuses the handler.
#[cfg(unix)]
pub fn survive_cut_files() -> io::Result<()> {
    handler::install()
}

#[cfg(unix)]
mod handler {
    use super::{MAPPINGS, Ordering};
    use std::io;
    use std::mem::zeroed;
    use std::ptr::null_mut;
    use std::sync::atomic::AtomicUsize;

    /// Bytes of a page.
    static PAGE: AtomicUsize = AtomicUsize::new(0);

    pub(super) fn is_installed() -> bool {
        PAGE.load(Ordering::Acquire) != 0
    }

    pub(super) fn install() -> io::Result<()> {
        // SAFETY: asks for a number.
        let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
        PAGE.store(usize::try_from(page).map_err(|_| io::Error::last_os_error())?, Ordering::Release);
        // SAFETY: all zeros are a valid `sigaction`: no flags, no signals blocked.
        let mut action: libc::sigaction = unsafe { zeroed() };
        let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = on_fault;
        action.sa_sigaction = handler as usize;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        // SAFETY: `action` is valid, and the handler does nothing that a handler may not: it reads atomics and maps memory.
        match unsafe { libc::sigaction(libc::SIGBUS, &action, null_mut()) } {
            0 => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    }

    /// Puts zeros where a mapping under watch has no bytes any more; what is no such mapping goes the way it would have gone.
    extern "C" fn on_fault(_: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
        // SAFETY: the system hands over a valid record; that of SIGBUS has an address.
        let at = unsafe { (*info).si_addr() } as usize;
        let page = PAGE.load(Ordering::Acquire);
        for slot in &MAPPINGS {
            let (start, end) = (slot.start.load(Ordering::Acquire), slot.end.load(Ordering::Acquire));
            if start == 0 || !(start..end).contains(&at) {
                continue;
            }
            let from = at - at % page;
            let length = end.next_multiple_of(page) - from;
            let kind = libc::MAP_PRIVATE | libc::MAP_ANON | libc::MAP_FIXED;
            // SAFETY: the pages belong to a mapping of ours that is only read, and stay readable; they are unmapped with it.
            let zeros = unsafe { libc::mmap(from as *mut libc::c_void, length, libc::PROT_READ, kind, -1, 0) };
            if zeros != libc::MAP_FAILED {
                slot.cut.store(true, Ordering::Release);
                return;
            }
        }
        // SAFETY: all zeros are the default action; the fault happens again, and ends the process.
        unsafe {
            let default: libc::sigaction = zeroed();
            libc::sigaction(libc::SIGBUS, &default, null_mut());
        }
    }
}
