//! Numbers that Python owns, seen as a slice without a copy. The only `unsafe` of this crate.

#![allow(unsafe_code, reason = "Python's memory is looked at in place")]

use pyo3::buffer::{Element, PyBuffer};
use std::ptr::NonNull;

/// The elements of a C-contiguous buffer of Python's, such as an array of NumPy.
///
/// # Guarantees
/// The buffer is held as long as this lives: by the buffer protocol its exporter neither moves nor frees the memory meanwhile (NumPy refuses to
/// resize such an array).
pub(crate) struct Borrowed<T: Element> {
    numbers: NonNull<[T]>,
    /// What keeps `numbers` where they are.
    _buffer: PyBuffer<T>,
}

impl<T: Element> Borrowed<T> {
    /// The elements of `buffer`; `None` where they do not lie in C order without gaps.
    pub(crate) fn new(buffer: PyBuffer<T>) -> Option<Self> {
        // pyo3 has checked type, alignment and size of the elements.
        let numbers = buffer.as_slice_ptr()?;
        Some(Self { numbers, _buffer: buffer })
    }
}

impl<T: Element> AsRef<[T]> for Borrowed<T> {
    fn as_ref(&self) -> &[T] {
        // SAFETY: `as_slice_ptr` gives elements that are initialized, aligned and without gaps, and the buffer that we hold keeps them there.
        // Nothing here writes to them. Should Python code write into the array while a picture is made of it, the numbers change under us as
        // those of a mapped file may: any bits are a valid number of these types, and no length or index is taken from a voxel unchecked
        // (lookups into tables wrap around), so what comes of it is a picture of some mixture, which the package's documentation says.
        unsafe { self.numbers.as_ref() }
    }
}

// SAFETY: the pointer is to memory that the buffer holds, which is readable from any thread; `PyBuffer` is `Send` itself, and gives the memory
// back under Python's lock.
unsafe impl<T: Element + Send> Send for Borrowed<T> {}
// SAFETY: as above; there is no way to write through this.
unsafe impl<T: Element + Sync> Sync for Borrowed<T> {}
