//! Where voxels lie: in memory of their own, or in a file that is mapped.

#[cfg(feature = "formats")]
use crate::lanes::Mapped;
use bytemuck::Pod;
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Numbers in a row, to be used as a slice.
///
/// They are in memory, or lie in a memory-mapped file (see [`crate::Limits::map_bytes`]). What is written to goes to memory first: a file
/// is never changed.
#[derive(Clone)]
pub struct Buffer<T>(Place<T>);

#[derive(Clone)]
enum Place<T> {
    Memory(Vec<T>),
    #[cfg(feature = "formats")]
    File(Mapped<T>),
}

impl<T: Pod> Buffer<T> {
    /// Whether the numbers lie in a mapped file.
    pub fn is_mapped(&self) -> bool {
        !matches!(self.0, Place::Memory(_))
    }

    /// The numbers as a vector: their own, or a copy of what the file holds.
    pub fn into_vec(self) -> Vec<T> {
        match self.0 {
            Place::Memory(values) => values,
            #[cfg(feature = "formats")]
            Place::File(mapped) => mapped.as_slice().to_vec(),
        }
    }

    #[cfg(feature = "formats")]
    pub(crate) fn mapped(mapped: Mapped<T>) -> Self {
        Self(Place::File(mapped))
    }
}

impl<T: Pod> Deref for Buffer<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Place::Memory(values) => values,
            #[cfg(feature = "formats")]
            Place::File(mapped) => mapped.as_slice(),
        }
    }
}

impl<T: Pod> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        #[cfg(feature = "formats")]
        if let Place::File(mapped) = &self.0 {
            self.0 = Place::Memory(mapped.as_slice().to_vec());
        }
        match &mut self.0 {
            Place::Memory(values) => values,
            // Just brought into memory.
            #[cfg(feature = "formats")]
            Place::File(_) => &mut [],
        }
    }
}

impl<T> From<Vec<T>> for Buffer<T> {
    fn from(values: Vec<T>) -> Self {
        Self(Place::Memory(values))
    }
}

impl<T> FromIterator<T> for Buffer<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self(Place::Memory(values.into_iter().collect()))
    }
}

impl<T: Pod + PartialEq> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} numbers {}", self.len(), if self.is_mapped() { "in a file" } else { "in memory" })
    }
}
