//! What to picture: plain data with checked invariants. How to run it is [`crate::Settings`]; nothing there may change a pixel.

mod agreement;
mod algorithm;
mod annotations;
mod blend;
mod by_place;
mod camera;
mod clip;
mod color;
mod colormap;
mod colors;
mod cut;
#[cfg(feature = "scene-file")]
mod file;
mod fog;
mod framing;
mod lighting;
mod linear_light;
mod method;
mod opengl;
mod parts;
mod phantom_transfer;
pub mod preset;
#[cfg(feature = "scene-file")]
mod property;
mod regions;
mod segments;
mod shade;
mod stage;
mod surfaces;
#[cfg(test)]
mod tests;
mod transfer;
mod transfer2d;

pub use crate::picture::MAX_SIDE;
pub use crate::volume::OpacityFrom;
pub use algorithm::{Algorithm, Connectivity, MAX_GAMES, TemplatePlane};
pub use annotations::Annotations;
pub use blend::{Blend, Order};
pub(crate) use by_place::ByPlace;
pub use camera::{Camera, Placement, Projection, View};
pub use clip::{ClipPlane, MAX_CLIP_PLANES};
pub use color::{Premultiplied, Straight};
pub use colormap::ColorMap;
pub(crate) use cut::CutColors;
pub use cut::{CutPlane, MAX_CUT_PLANES};
#[cfg(feature = "scene-file")]
pub use file::{
    Animation, FoundTransfer, Key, KeyKind, Overrides, ResolvedScene, SceneFile, SceneFormat, TransferFile, keys, schema,
    transfer_sections, write_scene, write_transfer,
};
pub use fog::{Fog, FogDistance, FogMode, FogWeighting};
pub use framing::{SceneDepths, Visible};
pub use lighting::{Gradient, Light, LightSource, Lighting, MAX_LIGHTS, Shading};
pub use method::{Accumulation, Classification, Ends, Filter, Method, SampleAt, SlabForm, Target};
pub use opengl::{
    AlphaTest, Arithmetic, BlendFunction, Compare, Environment, Equation, Factor, FogEvaluation, OpenGl, Scissor, TableColors,
    TextureFormat, Wrap,
};
pub use preset::Preset;
use regions::Share;
pub use regions::{FocusRegion, FocusShape, MAX_FOCUS_REGIONS};
pub(crate) use segments::LUMINANCE;
pub use segments::{SegmentEffect, SegmentStyle, label_color};
pub(crate) use shade::{LitPoint, unit};
pub use stage::{Fits, InProjections, OptionalStage, Quantity, StageId, StageInfo, StageOption};
pub(crate) use surfaces::Surfaces;
pub use surfaces::{Hit, LevelSurface, MAX_LEVELS};
pub use transfer::TransferFunction;
pub(crate) use transfer::slab_ratio;
pub(crate) use transfer2d::GAUSSIAN_END;
pub use transfer2d::{MAX_REGIONS, Region, Shape, Transfer2d};

use crate::{Error, Result};
use linear_light::ColorNumbers;
pub(crate) use linear_light::{to_display, to_linear};

/// The largest optical depth of a slab, where opacities are added up as such: opaque in the thinnest piece, and for the smallest factor. A power
/// of two, so that dividing by it is exact.
pub(crate) const DEEPEST: f64 = 1.267_650_600_228_229_4e30;

/// Whether a direction is of length 1 but for rounding. Such a one is kept as it is: what was normalized once is not changed when it is read
/// from a file again.
pub(crate) fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() <= 1e-15
}

/// Most slices of one picture.
pub const MAX_SLICES: u64 = 1 << 24;

/// How many slices a picture is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Slicing {
    /// This many slices through the box's depth range.
    Count(u64),
    /// Slices this far apart at most, world units.
    Spacing(f64),
    /// As many as it takes to keep the RMS error of the colours below this, as pictures of more slices tell it; a warning says where it is out of
    /// reach.
    Tolerance(f64),
}

/// A picture to make of some volume.
///
/// # Guarantees
/// Width and height lie between 1 and [`MAX_SIDE`], the slice count between 1 and [`MAX_SLICES`], numbers are finite and in
/// range, and there are at most [`MAX_CLIP_PLANES`] clip planes and [`MAX_CUT_PLANES`] cut planes: a `Scene` that exists can be rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    camera: Camera,
    width: u32,
    height: u32,
    background: Straight,
    transfer: TransferFunction,
    opacity_from: Option<OpacityFrom>,
    transfer2d: Option<Transfer2d>,
    slicing: Slicing,
    order: Order,
    terminate: f32,
    fog: Option<Fog>,
    fog_background: bool,
    colors: ColorNumbers,
    lighting: Option<Lighting>,
    gradient: Gradient,
    clip_planes: Vec<ClipPlane>,
    cuts: Vec<CutPlane>,
    segments: Vec<SegmentStyle>,
    regions: Vec<FocusRegion>,
    blend: Blend,
    window: Option<[f64; 2]>,
    levels: Vec<LevelSurface>,
    hit: Hit,
    flat_surfaces: bool,
    method: Method,
    algorithm: Algorithm,
    jitter: Option<u32>,
    opengl: Option<OpenGl>,
}

impl Scene {
    /// A 512 x 512 picture of 256 slices through `transfer`, seen by [`Camera::default`] over transparent black.
    pub fn new(transfer: TransferFunction) -> Self {
        Self {
            camera: Camera::default(),
            width: 512,
            height: 512,
            background: Straight::default(),
            transfer,
            opacity_from: None,
            transfer2d: None,
            slicing: Slicing::Count(256),
            order: Order::FrontToBack,
            terminate: 1.0 / 1024.0,
            fog: None,
            fog_background: false,
            colors: ColorNumbers::Display,
            lighting: None,
            gradient: Gradient::default(),
            clip_planes: Vec::new(),
            cuts: Vec::new(),
            segments: Vec::new(),
            regions: Vec::new(),
            blend: Blend::Over,
            window: None,
            levels: Vec::new(),
            hit: Hit::default(),
            flat_surfaces: false,
            method: Method::default(),
            algorithm: Algorithm::default(),
            jitter: None,
            opengl: None,
        }
    }

    /// The scene seen by another camera.
    #[must_use]
    pub fn with_camera(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// The scene at another picture size.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a side is 0 or above [`MAX_SIDE`].
    pub fn with_size(mut self, width: u32, height: u32) -> Result<Self> {
        for (name, side) in [("width", width), ("height", height)] {
            if !(1..=MAX_SIDE).contains(&side) {
                return Err(Error::invalid(format!("image {name} {side}: must lie between 1 and {MAX_SIDE}")));
            }
        }
        self.width = width;
        self.height = height;
        Ok(self)
    }

    /// The scene over another background.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a component is outside `[0,1]`.
    pub fn with_background(mut self, background: Straight) -> Result<Self> {
        if let Some(c) = background.rgb.iter().chain([&background.alpha]).find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::invalid(format!("image background {c}: outside [0,1]")));
        }
        self.background = background;
        Ok(self)
    }

    /// The scene through another transfer function, with the length that its opacities refer to.
    ///
    /// Where a function with a gradient opacity meets what that does not go together with, [`Scene::check`] says so.
    #[must_use]
    pub fn with_transfer(mut self, transfer: TransferFunction) -> Self {
        self.transfer = transfer;
        self
    }

    /// The scene through a transfer function of value and gradient, in the place of [`Scene::transfer`]; or without one.
    ///
    /// # Errors
    /// [`Error::Invalid`] together with what has no gradients: projections of values, pre-integrated slabs, [`Method::merge`], the profile
    /// `opengl`.
    pub fn with_transfer2d(mut self, transfer: Option<Transfer2d>) -> Result<Self> {
        self.transfer2d = transfer;
        self.agreed()
    }

    /// The scene whose transfer function has opacities per `length` world units: [`TransferFunction::with_unit`] on the one it
    /// has now. [`Scene::with_transfer`], called afterwards, brings another function with its own length.
    ///
    /// # Errors
    /// [`Error::Invalid`] when `length` is not positive and finite.
    pub fn with_opacity_unit(mut self, length: f64) -> Result<Self> {
        self.transfer = self.transfer.with_unit(length)?;
        Ok(self)
    }

    /// The scene cut into slices another way.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the count is 0 or above [`MAX_SLICES`], a spacing or tolerance is not positive and finite, or a
    /// tolerance meets a method of extrapolation or of 8 bits.
    pub fn with_slices(mut self, slicing: Slicing) -> Result<Self> {
        match slicing {
            Slicing::Count(n) if !(1..=MAX_SLICES).contains(&n) => {
                return Err(Error::invalid(format!("slices count {n}: must lie between 1 and {MAX_SLICES}")));
            }
            Slicing::Spacing(s) if !(s > 0.0 && s.is_finite()) => {
                return Err(Error::invalid(format!("slices spacing {s}: must be positive and finite")));
            }
            Slicing::Tolerance(t) if !(t > 0.0 && t.is_finite()) => {
                return Err(Error::invalid(format!("slices tolerance {t}: must be positive and finite")));
            }
            Slicing::Tolerance(_) => check_tolerance(self.method)?,
            _ => {}
        }
        self.slicing = slicing;
        self.agreed()
    }

    /// The scene blended in another order.
    #[must_use]
    pub fn with_order(mut self, order: Order) -> Self {
        self.order = order;
        self
    }

    /// The scene whose pixels are finished below another transmittance; 0 = never.
    ///
    /// # Errors
    /// [`Error::Invalid`] when it is outside `[0,1)`.
    pub fn with_terminate(mut self, transmittance: f32) -> Result<Self> {
        if !(0.0..1.0).contains(&transmittance) {
            return Err(Error::invalid(format!("slices terminate {transmittance}: must lie in [0,1)")));
        }
        self.terminate = transmittance;
        Ok(self)
    }

    /// The scene in fog, or out of it.
    #[must_use]
    pub fn with_fog(mut self, fog: Option<Fog>) -> Self {
        self.fog = fog;
        self
    }

    /// The scene in light, or without any.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a coefficient that is negative or not finite, a shininess outside 1 to 1000, and together with projections of
    /// values, [`Method::merge`] and the profile `opengl`.
    pub fn with_lighting(mut self, lighting: Option<Lighting>) -> Result<Self> {
        lighting.iter().try_for_each(Lighting::check)?;
        self.lighting = lighting;
        self.agreed()
    }

    /// The scene with gradients taken another way: for light, for [`TransferFunction::gradient_opacity`], and for level surfaces.
    #[must_use]
    pub fn with_gradient(mut self, gradient: Gradient) -> Self {
        self.gradient = gradient;
        self
    }

    /// Whether colours are blended as amounts of light instead of as the display's numbers: those of transfer function, background and fog
    /// are taken for sRGB and turned into light, the picture's are turned back.
    ///
    /// # Errors
    /// [`Error::Invalid`] together with the profile `opengl`, which blends the display's numbers.
    pub fn with_linear_light(mut self, linear: bool) -> Result<Self> {
        self.colors = if linear { ColorNumbers::ToBeLinear } else { ColorNumbers::Display };
        self.agreed()
    }

    /// Whether the background takes the fog of infinite distance too.
    #[must_use]
    pub fn with_fogged_background(mut self, fogged: bool) -> Self {
        self.fog_background = fogged;
        self
    }

    /// The scene cut by planes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for more than [`MAX_CLIP_PLANES`].
    pub fn with_clip_planes(mut self, planes: Vec<ClipPlane>) -> Result<Self> {
        if planes.len() > MAX_CLIP_PLANES {
            return Err(Error::invalid(format!("{} clip planes: at most {MAX_CLIP_PLANES} are allowed", planes.len())));
        }
        self.clip_planes = planes;
        Ok(self)
    }

    /// The scene with opaque planes inside it that show the data on them: the nearest that a ray meets within the box, and within what clip
    /// planes leave of it, ends the ray.
    ///
    /// # Errors
    /// [`Error::Invalid`] for more than [`MAX_CUT_PLANES`], and together with what has no place for them: blends other than [`Blend::Over`],
    /// pre-integrated slabs, [`Method::merge`], the profile `opengl`, algorithms other than slices and shells.
    pub fn with_cuts(mut self, planes: Vec<CutPlane>) -> Result<Self> {
        if planes.len() > MAX_CUT_PLANES {
            return Err(Error::invalid(format!("{} cut planes: at most {MAX_CUT_PLANES} are allowed", planes.len())));
        }
        self.cuts = planes;
        self.agreed()
    }

    /// The scene blended another way.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a level or threshold is not finite or an attenuation not 0 and up, and for [`Blend::Surfaces`] without
    /// [`Scene::with_levels`]; together with a [`Scene::with_window`] that the blend does not have.
    pub fn with_blend(mut self, blend: Blend) -> Result<Self> {
        if let Blend::Lmip { threshold: x } | Blend::Iso { level: x } = blend {
            if !x.is_finite() {
                return Err(Error::invalid(format!("render level {x}: must be finite")));
            }
        }
        if let Blend::AttenuatedMip { attenuation: x } = blend {
            if !(x >= 0.0 && x.is_finite()) {
                return Err(Error::invalid(format!("render attenuation {x}: must be finite, 0 or more")));
            }
        }
        if blend == Blend::Surfaces && self.levels.is_empty() {
            return Err(Error::invalid("render levels: none are given"));
        }
        self.blend = blend;
        self.agreed()
    }

    /// The scene with another window, `[center, width]`; or without one.
    ///
    /// Of [`Blend::Add`]: sums of colour and of opacity become `(sum - (center - width / 2)) / width`, clamped to 0 and 1, each component on its own.
    /// Of [`Blend::AttenuatedMip`]: the values (in the data's units) that count as 0 and 1.
    ///
    /// # Errors
    /// [`Error::Invalid`] for numbers that are not finite, for a width that is not positive, for other blends, and where the window of sums begins below
    /// 0, so that nothing at all would have a colour.
    pub fn with_window(mut self, window: Option<[f64; 2]>) -> Result<Self> {
        if let Some([center, width]) = window {
            if !(center.is_finite() && width.is_finite() && width > 0.0) {
                return Err(Error::invalid(format!("render window [{center}, {width}]: a finite center and a positive width are needed")));
            }
        }
        self.window = window;
        self.agreed()
    }

    /// The scene integrated another way.
    ///
    /// # Errors
    /// [`Error::Invalid`] for choices that exclude each other.
    pub fn with_method(mut self, method: Method) -> Result<Self> {
        method.check()?;
        if matches!(self.slicing, Slicing::Tolerance(_)) {
            check_tolerance(method)?;
        }
        self.method = method;
        self.agreed()
    }

    /// The scene drawn by another algorithm.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number outside its range, and together with what the algorithm does not have.
    pub fn with_algorithm(mut self, algorithm: Algorithm) -> Result<Self> {
        algorithm.check()?;
        self.algorithm = algorithm;
        self.agreed()
    }

    /// The scene whose pixels have their slices shifted, each by a part of a slab that depends on its place and on `seed`: rings of too few slices
    /// become noise.
    ///
    /// # Errors
    /// [`Error::Invalid`] together with what has no slices to shift.
    pub fn with_jitter(mut self, seed: Option<u32>) -> Result<Self> {
        self.jitter = seed;
        self.agreed()
    }

    /// The scene as an OpenGL 1.x program with this state draws it, and with what such programs have: slices back to front, an 8-bit
    /// framebuffer. [`Scene::with_order`] and [`Scene::with_method`], called afterwards, choose others.
    ///
    /// Slices are whole slabs, classified through a table of 256 entries; every one is drawn ([`Scene::terminate`] does not count).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number outside its range, and for choices that OpenGL does not have: pre-integrated
    /// classification, the other forms of slabs and sums of [`Method`], a tolerance, blends other than [`Blend::Over`].
    pub fn with_opengl(mut self, state: OpenGl) -> Result<Self> {
        state.check()?;
        self.opengl = Some(state);
        self.order = Order::BackToFront;
        self.method.target = Target::Unorm8;
        self.agreed()
    }

    /// Whether the scene's parts go together.
    ///
    /// # Errors
    /// [`Error::Invalid`] where they do not: what every setter that returns a `Result` has checked already, and every renderer checks again.
    pub fn check(&self) -> Result<()> {
        self.clone().agreed().map(drop)
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Straight colour behind the volume.
    pub fn background(&self) -> Straight {
        self.background
    }

    /// The transfer function.
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// How many slices.
    pub fn slicing(&self) -> Slicing {
        self.slicing
    }

    /// Which slice is to be blended first, as the scene asks for it. See [`Scene::blending_order`].
    pub fn order(&self) -> Order {
        self.order
    }

    /// Which slice is blended first in fact: [`Scene::order`] where colours are blended over each other slice by slice.
    ///
    /// Projections, and slabs that are integrated between the values on their two sides, take values in the order in which
    /// rays meet them, so for them it is front to back whatever the scene asks for. Sums ([`Blend::Add`]) do not depend on the
    /// order; they are front to back too.
    pub fn blending_order(&self) -> Order {
        let ordered = matches!(self.blend, Blend::Over | Blend::Under) && !self.method.is_pre_integrated();
        if ordered { self.order } else { Order::FrontToBack }
    }

    /// Transmittance below which a pixel is finished; 0 = never.
    pub fn terminate(&self) -> f32 {
        self.terminate
    }

    /// Fog, if any.
    pub fn fog(&self) -> Option<&Fog> {
        self.fog.as_ref()
    }

    /// Light, if any.
    pub fn lighting(&self) -> Option<&Lighting> {
        self.lighting.as_ref()
    }

    /// How gradients are taken, where the scene needs them.
    pub fn gradient(&self) -> Gradient {
        self.gradient
    }

    /// The transfer function of value and gradient, where there is one.
    pub fn transfer2d(&self) -> Option<&Transfer2d> {
        self.transfer2d.as_ref()
    }

    /// The length (world units) that opacities refer to in a volume on `grid`.
    pub(crate) fn opacity_length(&self, grid: &crate::volume::Grid) -> f64 {
        self.transfer2d.as_ref().map_or_else(|| self.transfer.opacity_length(grid), |t| t.opacity_length(grid))
    }

    /// Whether opacity depends on the gradient.
    pub(crate) fn opacity_by_gradient(&self) -> bool {
        self.transfer2d.is_some() || !self.transfer.gradient_opacity().is_empty()
    }

    /// Whether fragments need the gradient of the values.
    pub(crate) fn needs_gradient(&self) -> bool {
        self.lighting.as_ref().is_some_and(Lighting::needs_gradient) || self.opacity_by_gradient()
    }

    /// Whether the background is fogged.
    pub fn fogged_background(&self) -> bool {
        self.fog_background
    }

    /// Planes that cut the box.
    pub fn clip_planes(&self) -> &[ClipPlane] {
        &self.clip_planes
    }

    /// Opaque planes inside the picture.
    pub fn cuts(&self) -> &[CutPlane] {
        &self.cuts
    }

    /// How fragments combine.
    pub fn blend(&self) -> Blend {
        self.blend
    }

    /// Center and width of the window that sums or attenuated values are seen through, if there is one: see [`Scene::with_window`].
    pub fn window(&self) -> Option<[f64; 2]> {
        self.window
    }

    /// How rays are integrated.
    pub fn method(&self) -> Method {
        self.method
    }

    /// What draws it.
    pub fn algorithm(&self) -> Algorithm {
        self.algorithm
    }

    /// What the shifts of its pixels' slices depend on, where they are shifted.
    pub fn jitter(&self) -> Option<u32> {
        self.jitter
    }

    /// State of the OpenGL pipeline, where that draws the scene.
    pub fn opengl(&self) -> Option<&OpenGl> {
        self.opengl.as_ref()
    }
}

/// Methods that a tolerance can choose slices for.
fn check_tolerance(method: Method) -> Result<()> {
    if method.extrapolate {
        return Err(Error::invalid("slices extrapolate: a tolerance chooses its slice counts itself; give slices count"));
    }
    if method.target == Target::Unorm8 {
        return Err(Error::invalid("slices tolerance: rounding to 8 bits adds errors with every slice; choose target f32"));
    }
    Ok(())
}
