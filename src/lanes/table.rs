//! A table of colours to interpolate in, laid out so that an entry and the next one are one load each, side by side.

/// Entries of a lookup table; their number is a power of two, so that any index can be made safe by a mask.
///
/// # Guarantees
/// `entries.len() == mask + 2`: a power of two, and one more, so that each of them has a next one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LookupTable {
    /// Red, green, blue (premultiplied) and alpha.
    entries: Vec<[f32; 4]>,
    mask: u32,
}

impl LookupTable {
    /// A table that interpolates between `colors`, padded with the last one.
    ///
    /// An empty list gives a transparent table. A table of rows, one after the other, may be looked up too, as long as no lookup
    /// has a fraction at a row's last entry.
    ///
    /// # Panics
    /// For more than 2^27 colours: no plan makes that many.
    pub(crate) fn new(colors: &[[f32; 4]]) -> Self {
        let last = colors.last().copied().unwrap_or_default();
        let len = colors.len().max(1).next_power_of_two();
        assert!(len <= 1 << 27, "a table of {len} entries");
        let mut entries = Vec::with_capacity(len + 1);
        entries.extend_from_slice(colors);
        entries.resize(len + 1, last);
        Self { mask: len as u32 - 1, entries }
    }

    /// Number of intervals at the beginning of the first `side` entries in which nothing shows.
    pub(crate) fn clear(&self, side: usize) -> usize {
        self.entries[..side.min(self.entries.len())].iter().take_while(|&&e| e == [0.0; 4]).count().saturating_sub(1)
    }

    /// The first entry's first number, and the largest index that has a next one: one less than a power of two, below 2^27.
    #[cfg(any(target_arch = "x86_64", all(target_arch = "aarch64", target_endian = "little")))]
    #[inline(always)]
    pub(super) fn raw(&self) -> (*const f32, u32) {
        (self.entries.as_ptr().cast(), self.mask)
    }

    /// Entry `index` modulo the length, and the next one.
    #[inline(always)]
    pub(crate) fn get(&self, index: i32) -> [&[f32; 4]; 2] {
        let at = (index as u32 & self.mask) as usize;
        // SAFETY: the index is masked to at most `mask`, and there are mask + 2 entries.
        unsafe { [self.entries.get_unchecked(at), self.entries.get_unchecked(at + 1)] }
    }
}
