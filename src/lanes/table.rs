//! A table of colours to interpolate in, laid out so that an entry and the next one are one load each, side by side.

use super::{Lanes, SIDE, WIDTH};

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
    pub(crate) fn hidden_intervals(&self, side: usize) -> usize {
        self.entries[..side.min(self.entries.len())].iter().take_while(|&&e| e == [0.0; 4]).count().saturating_sub(1)
    }

    /// The colours, padded to a power of two and one more.
    pub(crate) fn entries(&self) -> &[[f32; 4]] {
        &self.entries
    }

    /// The first entry's first number.
    #[cfg(any(target_arch = "x86_64", all(target_arch = "aarch64", target_endian = "little")))]
    #[inline(always)]
    pub(super) fn raw(&self) -> *const f32 {
        self.entries.as_ptr().cast()
    }

    /// Where entries `index` begin, modulo the length, in numbers from the first: all of them have a next one.
    #[inline(always)]
    pub(super) fn places<L: Lanes>(&self, index: L::I) -> [u32; WIDTH] {
        let mut at = [0; WIDTH];
        // Below 2^27 entries of four numbers: no overflow.
        L::store_i(L::shl::<2>(L::and_i(index, L::splat_i(self.mask as i32))), bytemuck::cast_mut(&mut at));
        at
    }

    /// The entry at `place`, and the next one.
    ///
    /// # Safety
    /// One of [`LookupTable::places`] of this table.
    #[inline(always)]
    pub(super) unsafe fn pair(&self, place: u32) -> [&[f32; 4]; 2] {
        let at = (place / 4) as usize;
        // SAFETY: the index was masked to at most `mask`, and there are mask + 2 entries.
        unsafe { [self.entries.get_unchecked(at), self.entries.get_unchecked(at + 1)] }
    }
}

/// Where in a table the fragments of a batch look, found out before any of them does: lookups then wait for nothing but the table.
#[repr(C, align(64))]
pub(crate) struct Places<'t> {
    /// Places of `table` alone.
    at: [[u32; WIDTH]; SIDE],
    /// Of the way to the next entry.
    fraction: [[f32; WIDTH]; SIDE],
    table: &'t LookupTable,
}

impl<'t> Places<'t> {
    /// All at the first entry.
    #[inline(always)]
    pub(crate) fn new(table: &'t LookupTable) -> Self {
        Self { at: [[0; WIDTH]; SIDE], fraction: [[0.0; WIDTH]; SIDE], table }
    }

    /// Row `r` looks at entries `index`, modulo the table's length, and `fraction` of the way to the next.
    #[inline(always)]
    pub(crate) fn set<L: Lanes>(&mut self, r: usize, index: L::I, fraction: L::F) {
        self.at[r] = self.table.places::<L>(index);
        L::store(fraction, &mut self.fraction[r]);
    }

    /// What row `r` finds there: red, green, blue, alpha.
    #[inline(always)]
    pub(crate) fn look_up<L: Lanes>(&self, r: usize) -> [L::F; 4] {
        // SAFETY: `at` holds places of this table: zero, or what `set` has put there.
        unsafe { L::entries(self.table, &self.at[r], L::load(&self.fraction[r])) }
    }
}
