//! The live view: a server for the browsers of this machine, and the page that they show.
//!
//! ```text
//!  browser: page --document, size--> http: bounded --> guard: who asks? --> api --> frames: a renderer for each page, the latest request wins
//!            ^                                                               +----> probe, thumbnails, save, command
//!            +------- picture, JSON <----------------------------------------+
//! ```
//! The page holds the scene and sends all of it with each request; the server keeps renderers and nothing else that a page could miss. Files are
//! named by whoever starts the server alone. It listens on the loopback, answers requests that carry its token, and serves its own files.
//!
//! ```
//! # fn main() -> slicestack::Result<()> {
//! use slicestack::scene::{Overrides, SceneFile};
//! use slicestack::view::Server;
//!
//! let scene = SceneFile::parse("[volume]\nphantom = \"shepp-logan\"\nsize = 16", "", &Overrides::default())?;
//! let volume = scene.volume().load(&slicestack::Limits::default())?;
//! let server = Server::builder(scene, volume).start()?;
//! assert!(server.url().starts_with("http://127.0.0.1:")); // to be opened in a browser
//! server.stop();
//! # Ok(())
//! # }
//! ```

mod api;
mod command;
mod document;
pub mod export;
mod frames;
mod guard;
mod http;
mod open;
mod page;
mod presets;
mod probe;
mod quality;
mod save;
mod server;
mod watch;

pub use server::{Builder, Server};
