//! A table of colours to interpolate in, laid out so that one entry is one aligned load.

/// One entry: the colour there, and the step to the next entry's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub(crate) struct Entry {
    /// Red, green, blue (premultiplied) and alpha.
    pub(crate) value: [f32; 4],
    /// What to add per entry.
    pub(crate) step: [f32; 4],
}

/// Entries of a lookup table; their number is a power of two, so that any index can be made safe by a mask.
///
/// # Guarantees
/// `entries.len() == mask + 1`, a power of two.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LookupTable {
    entries: Vec<Entry>,
    mask: u32,
}

impl LookupTable {
    /// A table that interpolates between `colors`, padded with the last one.
    ///
    /// An empty list gives a transparent table.
    pub(crate) fn new(colors: &[[f32; 4]]) -> Self {
        let last = colors.last().copied().unwrap_or_default();
        let len = colors.len().max(1).next_power_of_two();
        let color = |i: usize| colors.get(i).copied().unwrap_or(last);
        let entries: Vec<Entry> = (0..len)
            .map(|i| {
                let (a, b) = (color(i), color(i + 1));
                Entry { value: a, step: std::array::from_fn(|c| b[c] - a[c]) }
            })
            .collect();
        Self { mask: len as u32 - 1, entries }
    }

    /// A table of rows of `side` colours each, which interpolates within rows; row r begins at entry r `side`.
    pub(crate) fn rows(colors: &[[f32; 4]], side: usize) -> Self {
        let len = colors.len().max(1).next_power_of_two();
        let mut entries = vec![Entry::default(); len];
        for (row, colors) in entries.chunks_mut(side).zip(colors.chunks(side)) {
            for (j, entry) in row.iter_mut().enumerate().take(colors.len()) {
                let (a, b) = (colors[j], colors[(j + 1).min(colors.len() - 1)]);
                *entry = Entry { value: a, step: std::array::from_fn(|c| b[c] - a[c]) };
            }
        }
        Self { mask: len as u32 - 1, entries }
    }

    /// Entry `index` modulo the length.
    #[inline(always)]
    pub(crate) fn get(&self, index: i32) -> &Entry {
        // SAFETY: the index is masked to at most `mask`, and there are mask + 1 entries.
        unsafe { self.entries.get_unchecked((index as u32 & self.mask) as usize) }
    }
}
