//! Memory that the system may not give.
//!
//! Large amounts are asked for with [`reserve`], whose refusal becomes an error that says what they were for. Whatever else runs out of memory, a
//! few bytes or a buffer of another crate's, would end the process by an abort; a program that takes [`crate::OrOneLine`] for its allocator
//! ends with one line instead.

use std::cell::Cell;
use std::collections::TryReserveError;

thread_local! {
    /// Whether this thread takes a refusal for an answer just now.
    static ASKS: Cell<bool> = const { Cell::new(false) };
}

/// Room for `more` elements of `vec` beyond those it has, no more than that.
///
/// # Errors
/// Where the system does not give it.
pub(crate) fn reserve<T>(vec: &mut Vec<T>, more: usize) -> Result<(), TryReserveError> {
    ASKS.set(true);
    let given = vec.try_reserve_exact(more);
    ASKS.set(false);
    given
}

/// Whether this thread takes a refusal for an answer just now.
pub(crate) fn asks() -> bool {
    // While a thread ends its own numbers may be gone.
    ASKS.try_with(Cell::get).unwrap_or(false)
}
