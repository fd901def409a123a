//! Volume rendering by texture slicing, on the CPU alone: no GPU, no display, the same bytes on every machine.
//!
//! A stack of planes cuts the box of a volume; each plane leaves fragments on the screen; each fragment looks up a value, turns
//! it into colour and opacity, and is blended over what is behind it.
//!
//! ```text
//!  file or formula                 what to picture                 how to run it
//!      Volume                          Scene                          Settings
//!        |                               |                               |
//!        +---------------+---------------+-------------------------------+
//!                        |
//!                     Renderer       kept between pictures: bricks (min, max), tables
//!                        |
//!                      plan          which slices, tables and stages; what is left out, and why
//!                        |
//!                      proxy         planes of constant depth x box x clip planes
//!                        |
//!                      raster        tiles in parallel > blocks of 8 x 8 pixels > slices
//!                        |
//!                     fragment       span > texture coordinates > fetch > classify > fog > blend, 64 at a time
//!                        |
//!                     Picture        premultiplied RGBA in f32 > PNG, NumPy, OpenEXR, JPEG, WebP, TIFF
//! ```
//!
//! # A picture in five lines
//!
//! ```
//! use slicestack::volume::phantom::Phantom;
//! use slicestack::{Scene, render};
//!
//! fn main() -> slicestack::Result<()> {
//!     let volume = Phantom::SheppLogan.volume(32)?; // or Volume::open("head.nrrd")?
//!     let scene = Scene::new(Phantom::SheppLogan.default_transfer(32)).with_size(64, 64)?;
//!     let picture = render(&volume, &scene)?; // picture.save("head.png", Depth::Eight)? writes it
//!     assert_eq!(picture.pixel(0, 0), [0.0; 4]); // beside the head: nothing
//!     assert!(picture.pixel(32, 32)[3] > 0.1); // through it: something
//!     Ok(())
//! }
//! ```
//!
//! # Where things are
//!
//! | to | look at |
//! |---|---|
//! | read or make a volume | [`Volume::open`], [`volume::io`], [`volume::phantom`], [`Volume::new`] |
//! | crop or resample a volume, change its type | [`volume::edit`] |
//! | write a volume | [`volume::io::write()`] |
//! | say what to picture | [`Scene`], [`scene::Camera`], [`scene::TransferFunction`], [`scene::Preset`], [`scene::Fog`], [`scene::ClipPlane`], [`scene::Blend`] |
//! | draw as OpenGL 1.x does, bit depth by bit depth | [`scene::OpenGl`], [`Scene::with_opengl`] |
//! | read a scene file | [`scene::SceneFile`] |
//! | read or write the transfer functions of 3D Slicer and ParaView, or a table | [`transfer_io`] |
//! | make one picture, or many of one volume | [`render`], [`Renderer`] |
//! | render into your own memory, show a coarse picture first, stop | [`Renderer::render_into`], [`Renderer::render_progressive`], [`Stopper`] |
//! | render a large volume in parts | [`Renderer::render_part`], [`proxy::Domain`], [`proxy::order`], [`halo`], [`Partial`] |
//! | know which stages there are | [`scene::StageId`] |
//! | bound memory, choose threads and vector level, hear of progress | [`Settings`], [`Limits`], [`Level`] |
//! | see how a picture comes about, step by step | [`explain`](mod@explain) |
//! | write a picture | [`Picture::save`](picture::Picture::save), [`picture::Format`] |
//! | cut pictures out of a volume | [`cut`] |
//! | draw a colour bar, a scale bar, letters on a picture | [`annotate`](mod@annotate), [`scene::Annotations`] |
//! | show a volume in a browser, to be turned | [`view`](mod@view) |
//! | read a picture | [`Picture::open`](picture::Picture::open) |
//! | hold pictures against each other, or against pictures on record | [`compare`], [`assert_golden`] |
//! | let a picture say how it was made, and render it again | [`proof`] |
//! | know the truth without slices | [`reference`](mod@reference) |
//! | know what error costs, and what holds in extreme cases | [`study`] |
//!
//! # Promises
//!
//! - One scene gives the same bytes for any number of threads, any tile size, any vector level, any machine: [`Settings`] never
//!   change a pixel.
//! - Values keep the file's scale (Hounsfield units stay Hounsfield units) and axes the file's directions.
//! - Opacities belong to a length, not to a slice: more slices make a picture more exact, not more opaque.
//! - Input that is wrong gives an [`Error`] of one line that names the file and the number at fault.
//!
//! # Features
//!
//! All but `conformance` are on by default, because the command needs them:
//!
//! | feature | adds |
//! |---|---|
//! | `formats` | readers for NRRD, NIfTI, MetaImage, VTK, NumPy and raw files, and writers for most of them |
//! | `scene-file` | scenes as TOML or JSON, and their schema; takes `formats` and `encoders` with it |
//! | `encoders` | picture files, written and read: PNG, NumPy, OpenEXR, JPEG, WebP, TIFF |
//! | `annotate` | colour bar, scale bar, orientation letters, title, box on a finished picture |
//! | `explain` | teaching pages; takes `encoders` with it |
//! | `study` | error against run time, and proof of stability; takes `encoders` with it |
//! | `view` | the live view in a browser; takes `scene-file`, `encoders`, `annotate` and `explain` with it |
//! | `cli` | the command `slicestack`, with all of the above |
//! | `conformance` | nothing in the library: a test and a bench against a real OpenGL |
//!
//! `slicestack = { version = "0.1", default-features = false }` is the light library: the renderer, its scenes and the built-in
//! volumes, without the command and what it depends on (no `clap`). Any of the features can be added to it alone.

#[cfg(feature = "annotate")]
pub mod annotate;
#[doc(hidden)]
pub mod bench;
mod casting;
mod classify;
pub mod compare;
pub mod cut;
mod error;
#[cfg(feature = "explain")]
pub mod explain;
pub mod files;
mod fragment;
mod lanes;
mod lean;
mod memory;
mod opengl;
pub mod paged;
pub mod picture;
mod plan;
#[cfg(feature = "scene-file")]
pub mod proof;
pub mod proxy;
mod raster;
pub mod reference;
mod renderer;
pub mod scene;
mod settings;
mod skip;
#[cfg(feature = "study")]
pub mod study;
mod tally;
#[cfg(feature = "scene-file")]
pub mod transfer_io;
#[cfg(feature = "view")]
pub mod view;
pub mod volume;

pub use error::{Error, Result};
pub use lanes::{Level, OrOneLine, give_back_memory};
pub use picture::{Aov, Picture, Plane};
#[cfg(feature = "encoders")]
pub use picture::{Depth, Format};
pub use renderer::{Layer, Partial, PartialKind, Pass, RenderStats, Renderer, halo, render};
pub use scene::Scene;
pub use settings::{Limits, MAX_THREADS, Progress, Settings, Stopper};
pub use tally::{LeftOut, Saved, Tally};
pub use volume::Volume;
