//! Volume and scene in, picture and statistics out.

use crate::scene::Scene;
use crate::target::Picture;
use crate::{Error, Result, Settings, Volume};

/// What a picture cost, and what was left out.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct RenderStats {
    /// Seconds spent on what depends on volume and transfer function only: packing, bricks, tables.
    pub prepare_seconds: f64,
    /// Seconds a frame costs once prepared: planning, geometry, pixels.
    pub render_seconds: f64,
    /// Slice planes of the stack.
    pub slices: u64,
    /// Fragments covered by slice polygons.
    pub fragments: u64,
    /// Voxel lookups (trilinear samples) really done.
    pub fetches: u64,
    /// Worker threads.
    pub threads: usize,
    /// Name of the vector level.
    pub simd: &'static str,
    /// Stages and work that this scene did not need: (what, why).
    pub left_out: Vec<(String, String)>,
    /// The RMS error of the colours as estimated, where the scene asked for a tolerance.
    pub error_estimate: Option<f64>,
    /// Voxels that are NaN or infinite: they are transparent.
    pub non_finite_voxels: usize,
    /// Things the user should hear about, one line each.
    pub warnings: Vec<String>,
}

/// Makes pictures of one volume; keeps between frames what depends on volume and transfer function only.
#[derive(Debug)]
pub struct Renderer<'v> {
    volume: &'v Volume,
    settings: Settings,
}

impl<'v> Renderer<'v> {
    /// A renderer for `volume`.
    pub fn new(volume: &'v Volume, settings: Settings) -> Self {
        Self { volume, settings }
    }

    /// One picture of `scene`, and what it cost.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene's camera cannot be resolved for the volume's box, [`Error::Limit`] when memory would
    /// exceed the settings' limits, [`Error::Stopped`] when progress said so.
    pub fn render(&mut self, scene: &Scene) -> Result<(Picture, RenderStats)> {
        let _ = (self.volume, &self.settings, scene);
        Err(Error::invalid("the pipeline is not in place yet"))
    }
}

/// One picture of `volume` as `scene` describes it, made with default settings.
///
/// # Errors
/// As [`Renderer::render`].
pub fn render(volume: &Volume, scene: &Scene) -> Result<Picture> {
    Ok(Renderer::new(volume, Settings::default()).render(scene)?.0)
}
