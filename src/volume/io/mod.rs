//! Readers of volume files.
