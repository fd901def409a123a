//! The live view's server, asked over sockets as a browser asks it, and as nobody should.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod client;
#[cfg(feature = "cli")]
mod command;
mod documents;
mod frames;
mod load;
mod probe;
mod refusals;
