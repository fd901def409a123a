//! Numbers that lie in a file, seen as a slice: the operating system brings the pages that are looked at.

use super::cut_short::Watched;
use bytemuck::Pod;
use memmap2::{Mmap, MmapOptions};
use std::fs::File;
use std::io;
use std::marker::PhantomData;
use std::path::Path;
use std::sync::Arc;

/// A run of numbers in a mapped file; clones share the mapping.
///
/// # Guarantees
/// The bytes are a whole number of `T`, aligned for it, and stay mapped while this lives.
#[derive(Debug)]
pub(crate) struct Mapped<T> {
    map: Arc<Watch>,
    /// The file, and the byte of it at which the numbers begin.
    place: Option<(Arc<File>, u64)>,
    kind: PhantomData<T>,
}

/// A mapping, and the watch over it, which ends first.
#[derive(Debug)]
struct Watch {
    _watched: Option<Watched>,
    map: Mmap,
}

impl<T> Clone for Mapped<T> {
    fn clone(&self) -> Self {
        Self { map: self.map.clone(), place: self.place.clone(), kind: PhantomData }
    }
}

impl<T: Pod> Mapped<T> {
    /// `count` numbers from byte `first` of `file` on, whose name is `path`; `None` where they do not lie aligned or the file ends before them.
    ///
    /// # Errors
    /// What the operating system says where it cannot map the file.
    pub(crate) fn new(path: &Path, file: &File, first: u64, count: usize) -> io::Result<Option<Self>> {
        let Some(bytes) = count.checked_mul(size_of::<T>()) else { return Ok(None) };
        let end = first.checked_add(bytes as u64);
        if count == 0 || first % align_of::<T>() as u64 != 0 || end.is_none_or(|end| file.metadata().is_ok_and(|m| m.len() < end)) {
            return Ok(None);
        }
        // SAFETY: the mapping is private and only read, and any bytes are a valid `T` (`Pod`). Should another program write to the
        // file meanwhile, the numbers change as they would have before reading it; no index and no length is taken from them
        // unchecked (lookups into tables wrap around). A file cut short meanwhile reads as zeros from there on where
        // `survive_cut_files` was called, and else ends the process with SIGBUS, which touches no memory that is not ours;
        // `Limits::map_bytes` says so and turns mapping off.
        let map = unsafe { MmapOptions::new().offset(first).len(bytes).map_copy_read_only(file) }?;
        // All of it will be looked at soon: the system may read ahead. A hint it cannot follow changes nothing.
        #[cfg(unix)]
        drop(map.advise(memmap2::Advice::WillNeed));
        // A page starts at a multiple of any alignment here, but that is the system's word.
        let place = file.try_clone().ok().map(|file| (Arc::new(file), first));
        Ok(bytemuck::try_cast_slice::<u8, T>(&map).is_ok().then(|| {
            let watched = Watched::over(&map, path);
            Self { map: Arc::new(Watch { _watched: watched, map }), place, kind: PhantomData }
        }))
    }

    /// The file, and the byte of it at which the numbers begin: to read some that lie far from others.
    pub(crate) fn place(&self) -> Option<&(Arc<File>, u64)> {
        self.place.as_ref()
    }

    /// Lets go of the pages that were looked at: they count as this process's memory no longer, and are brought again when they are looked at
    /// again. Where the system has no way to do so, nothing happens.
    pub(crate) fn let_go(&self) {
        // SAFETY: the mapping is private and was never written to, so each page holds what the file holds; a page that is let go is
        // brought from the file when it is read next, with the same bytes. No reference becomes invalid: the addresses stay mapped.
        #[cfg(unix)]
        drop(unsafe { self.map.map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) });
    }

    /// The numbers.
    #[inline]
    pub(crate) fn as_slice(&self) -> &[T] {
        bytemuck::cast_slice(&self.map.map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn numbers_that_were_let_go_come_back() {
        let mut file = tempfile::tempfile().expect("file");
        let bytes: Vec<u8> = (0..100_000u32).map(|i| (i % 251) as u8).collect();
        file.write_all(&bytes).expect("write");
        let mapped = Mapped::<u8>::new(Path::new("numbers"), &file, 4097, 90_000).expect("map").expect("aligned and inside");
        let slice = mapped.as_slice();
        assert_eq!(slice, &bytes[4097..94_097]);
        mapped.clone().let_go();
        assert_eq!(slice, &bytes[4097..94_097]);
    }

    #[test]
    fn numbers_are_those_of_the_file_or_refused() {
        let mut file = tempfile::tempfile().expect("file");
        let bytes: Vec<u8> = (0..200u8).collect();
        file.write_all(&bytes).expect("write");
        let map = |first, count| Mapped::<u16>::new(Path::new("numbers"), &file, first, count).expect("map");
        for (first, count) in [(0, 100), (2, 99), (198, 1), (64, 3)] {
            let mapped = map(first, count).expect("aligned and inside");
            let want: Vec<u16> = bytes[first as usize..].chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]])).take(count).collect();
            assert_eq!(mapped.clone().as_slice(), want, "{count} from byte {first}");
        }
        for (first, count) in [(0, 101), (200, 1), (1, 4), (0, 0), (u64::MAX - 1, 1), (0, usize::MAX)] {
            assert!(map(first, count).is_none(), "{count} from byte {first}");
        }
    }
}
