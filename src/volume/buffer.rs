//! Where voxels lie: in memory of their own, in memory that somebody else owns, or in a file that is mapped.

#[cfg(feature = "formats")]
use crate::lanes::Mapped;
use bytemuck::Pod;
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Numbers in a row, to be used as a slice.
///
/// They are in memory of the buffer's own, in memory that somebody else owns (see [`Buffer::shared`]), or in a memory-mapped file (see
/// [`crate::Limits::map_bytes`]). Clones share the numbers. Only memory that a buffer has to itself is written to: before the first write,
/// numbers that others see are copied, so neither theirs nor the owner's nor the file's are ever changed.
#[derive(Clone)]
pub struct Buffer<T>(Place<T>);

/// Whoever owns numbers that a buffer looks at.
type Owner<T> = dyn AsRef<[T]> + Send + Sync;

enum Place<T> {
    Memory(Arc<Vec<T>>),
    /// The owner, and how many numbers it held when it was handed over.
    Shared(Arc<Owner<T>>, usize),
    #[cfg(feature = "formats")]
    File(Mapped<T>),
}

impl<T> Clone for Place<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Memory(values) => Self::Memory(Arc::clone(values)),
            Self::Shared(owner, length) => Self::Shared(Arc::clone(owner), *length),
            #[cfg(feature = "formats")]
            Self::File(mapped) => Self::File(mapped.clone()),
        }
    }
}

/// The numbers of `owner`. The length is the one noted at first, so that an owner that gives another slice later cannot change it: it
/// may give more numbers, and giving fewer ends in a panic.
#[inline]
fn lent<T>(owner: &Owner<T>, length: usize) -> &[T] {
    &owner.as_ref()[..length]
}

impl<T: Pod> Buffer<T> {
    /// The numbers of `owner`, without a copy: for memory of another library, such as an array of NumPy.
    ///
    /// `owner` lives as long as the buffer or a clone of it. Cloning the buffer copies no number either.
    ///
    /// ```
    /// use slicestack::volume::Buffer;
    /// use std::sync::Arc;
    ///
    /// let numbers = Arc::new(vec![1u16, 2, 3]);
    /// let buffer = Buffer::shared(numbers.clone());
    /// assert_eq!(buffer.as_ptr(), numbers.as_ptr());
    /// ```
    pub fn shared(owner: Arc<dyn AsRef<[T]> + Send + Sync>) -> Self {
        let length = owner.as_ref().as_ref().len();
        Self(Place::Shared(owner, length))
    }

    /// Whether the numbers lie in a mapped file.
    pub fn is_mapped(&self) -> bool {
        match self.0 {
            Place::Memory(_) | Place::Shared(..) => false,
            #[cfg(feature = "formats")]
            Place::File(_) => true,
        }
    }

    /// Whether the numbers lie in memory that somebody else owns; see [`Buffer::shared`].
    pub fn is_shared(&self) -> bool {
        matches!(self.0, Place::Shared(..))
    }

    /// The numbers as a vector: the buffer's own, or a copy of what the owner or the file holds.
    pub fn into_vec(self) -> Vec<T> {
        match self.0 {
            Place::Memory(values) => Arc::try_unwrap(values).unwrap_or_else(|shared| shared.to_vec()),
            Place::Shared(owner, length) => lent(&*owner, length).to_vec(),
            #[cfg(feature = "formats")]
            Place::File(mapped) => mapped.as_slice().to_vec(),
        }
    }

    /// The file that the numbers lie in, and the byte of it at which they begin.
    pub(crate) fn place(&self) -> Option<(Arc<std::fs::File>, u64)> {
        match &self.0 {
            Place::Memory(_) | Place::Shared(..) => None,
            #[cfg(feature = "formats")]
            Place::File(mapped) => mapped.place().cloned(),
        }
    }

    /// Lets go of the pages of a mapped file that were looked at: see [`Mapped::let_go`].
    pub(crate) fn let_go(&self) {
        #[cfg(feature = "formats")]
        if let Place::File(mapped) = &self.0 {
            mapped.let_go();
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
            Place::Shared(owner, length) => lent(&**owner, *length),
            #[cfg(feature = "formats")]
            Place::File(mapped) => mapped.as_slice(),
        }
    }
}

impl<T: Pod> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        if !matches!(self.0, Place::Memory(_)) {
            self.0 = Place::Memory(Arc::new(self.to_vec()));
        }
        match &mut self.0 {
            // Clones keep the numbers as they are.
            Place::Memory(values) => Arc::make_mut(values).as_mut_slice(),
            // Just brought into memory.
            _ => &mut [],
        }
    }
}

impl<T> From<Vec<T>> for Buffer<T> {
    fn from(values: Vec<T>) -> Self {
        Self(Place::Memory(Arc::new(values)))
    }
}

impl<T> FromIterator<T> for Buffer<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self(Place::Memory(Arc::new(values.into_iter().collect())))
    }
}

impl<T: Pod + PartialEq> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = match self.0 {
            Place::Memory(_) => "in memory",
            Place::Shared(..) => "in memory of another owner",
            #[cfg(feature = "formats")]
            Place::File(_) => "in a file",
        };
        write!(f, "{} numbers {place}", self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_numbers_are_not_copied_until_they_are_written_to() {
        let owner = Arc::new(vec![1i16, -2, 3]);
        let mut buffer = Buffer::shared(owner.clone());
        let clone = buffer.clone();
        assert!(buffer.is_shared() && clone.is_shared() && !buffer.is_mapped());
        assert_eq!((buffer.as_ptr(), clone.as_ptr()), (owner.as_ptr(), owner.as_ptr()));
        assert_eq!(format!("{buffer:?}"), "3 numbers in memory of another owner");
        assert_eq!(Arc::strong_count(&owner), 3);

        buffer[1] = 20;
        assert!(!buffer.is_shared() && clone.is_shared());
        assert_eq!((buffer.to_vec(), clone.to_vec(), owner.to_vec()), (vec![1, 20, 3], vec![1, -2, 3], vec![1, -2, 3]));
        assert_eq!(clone.into_vec(), *owner);
        // The owner is let go with the last buffer.
        assert_eq!(Arc::strong_count(&owner), 1);
    }

    /// Gives ever more numbers, which no honest owner does.
    struct Growing(std::sync::atomic::AtomicUsize);

    impl AsRef<[u8]> for Growing {
        fn as_ref(&self) -> &[u8] {
            &[7; 100][..2 + self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed)]
        }
    }

    #[test]
    fn an_owner_cannot_change_the_length() {
        let buffer = Buffer::shared(Arc::new(Growing(0.into())));
        assert_eq!((buffer.len(), buffer.len(), &buffer[..]), (2, 2, &[7, 7][..]));
    }
}
