//! Volume rendering by texture slicing on the CPU alone.

mod error;
mod fragment;
pub mod lanes;
mod plan;
pub mod proxy;
mod raster;
pub mod reference;
mod renderer;
pub mod scene;
mod settings;
pub mod target;
mod tolerance;
pub mod volume;

pub use error::{Error, Result};
pub use renderer::{RenderStats, Renderer, render};
pub use scene::Scene;
pub use settings::{Limits, Progress, Settings};
pub use target::Picture;
pub use volume::Volume;
