//! The section `[render]`: how fragments become pixels.

use super::section::{Context, Data, Rivals, choices};
use crate::Result;
use crate::scene::preset::Landmarks;
use crate::scene::{Algorithm, Blend, Connectivity, Filter, Hit, LevelSurface, Method, Scene, Target, TemplatePlane};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Attenuation of attenuated-mip, unless the scene gives one.
const ATTENUATION: f64 = 4.0;

/// Games of a pixel, unless the scene says how many.
const GAMES: u32 = 256;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RenderKeys {
    /// Exact slabs (accurate, the default) or what an OpenGL 1.x driver does (opengl).
    pub profile: Option<ProfileKey>,
    /// What a lookup between voxels gives: linear interpolation (the default), the nearest voxel, or a smooth cubic spline.
    pub filter: Option<FilterKey>,
    /// cubic: whether the spline goes through the voxels (true unless given) or smooths them.
    pub prefilter: Option<bool>,
    /// What draws the picture: slices (the default), or to compare and to teach: rays (ray casting at equal steps), traversal (from voxel to voxel), template (one
    /// voxelized ray, moved), object-slices (stacks of 2D textures), grid (along an axis, voxel by voxel), shells (spheres about the eye), coin-flips (a game of chance).
    pub algorithm: Option<AlgorithmKey>,
    /// traversal: neighbours that voxels of a ray may be: 6 (they share a face; the default), 18 (or an edge) or 26 (or a corner).
    pub connectivity: Option<u8>,
    /// template: the plane that it is moved over: base (the default), or image (the known mistake).
    pub plane: Option<PlaneKey>,
    /// object-slices: whether opacities are corrected for the length of a ray between two layers; true unless given.
    pub spacing_correction: Option<bool>,
    /// coin-flips: games of each pixel, 1 to 1048576; 256 unless given.
    pub games: Option<u32>,
    /// coin-flips: what the flips depend on besides pixel and game; 0 unless given.
    pub seed: Option<u32>,
    /// Numbers that fragments are blended in; f32 unless given, in the profile opengl unorm8. unorm16 is for that profile alone.
    pub target: Option<TargetKey>,
    /// How fragments of a pixel combine: over (unless given), under (over with the operator of the other order: back to front, far things hide near ones), add,
    /// iso (surfaces), or the value that shows: mip (the largest), min, lmip (the first local maximum), average, attenuated-mip (the largest, near ones first).
    pub blend: Option<BlendKey>,
    /// attenuated-mip: how fast values fade behind others, per longest side of the box full of the window's largest value; 4 unless given.
    pub attenuation: Option<f64>,
    /// Window [center, width]. add: the sums of colours and opacities that become 0 to 1; without it they end at 1. Other projections: the values that
    /// the grey map goes over, and attenuated-mip goes by; chosen by the data unless given.
    pub window: Option<[f64; 2]>,
    /// lmip: smallest value that stops a ray; where the data splits into background and object, unless given.
    pub threshold: Option<f64>,
    /// iso: value of one opaque surface in the transfer function's colour.
    pub level: Option<f64>,
    /// iso: surfaces, up to 16, nearest in front: each { level = value, color = [red, green, blue] (0 to 1; the transfer function's unless given), opacity = 0 to 1 (1 unless given) }.
    pub levels: Option<Vec<LevelKeys>>,
    /// iso: where between two slices a surface is met: where the values cross the level (refined, the default), or at the slice behind that (first-sample, to compare).
    pub hit: Option<HitKey>,
    /// Whether colours (sRGB numbers) are blended as amounts of light, and the picture's turned back; false unless given.
    pub linear_light: Option<bool>,
}

/// A level surface.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a surface: { level = value, color = [r, g, b], opacity = a }")]
pub(super) struct LevelKeys {
    /// Value of the surface.
    pub level: f64,
    /// Red, green, blue, each 0 to 1; the transfer function's colour at the level unless given.
    #[serde(default)]
    pub color: Option<[f64; 3]>,
    /// Opacity, 0 to 1; 1 unless given.
    #[serde(default = "opaque")]
    pub opacity: f64,
}

fn opaque() -> f64 {
    1.0
}

choices! {
    AlgorithmKey { Slices, Rays, Traversal, Template, ObjectSlices, Grid, Shells, CoinFlips }
    PlaneKey => TemplatePlane { Base, Image }
    HitKey => Hit { Refined, FirstSample }
    ProfileKey { Accurate, Opengl }
    FilterKey { Linear, Nearest, Cubic }
    TargetKey => Target { F32, Unorm8, Unorm16 }
    BlendKey { Over, Under, Mip, AttenuatedMip, Min, Lmip, Average, Add, Iso }
}

/// One surface in short, or several.
pub(super) const RIVALS: &[Rivals] = &[(&["render.level"], &["render.levels"]), (&["render.levels"], &["render.level"])];

/// The keys of an algorithm.
struct AlgorithmKeys {
    word: AlgorithmKey,
    connectivity: Option<u8>,
    plane: Option<PlaneKey>,
    spacing_correction: Option<bool>,
    games: Option<u32>,
    seed: Option<u32>,
}

impl AlgorithmKeys {
    fn of(algorithm: Algorithm) -> Self {
        let plain = |word| Self { word, connectivity: None, plane: None, spacing_correction: None, games: None, seed: None };
        match algorithm {
            Algorithm::Slices => plain(AlgorithmKey::Slices),
            Algorithm::Shells => plain(AlgorithmKey::Shells),
            Algorithm::Rays => plain(AlgorithmKey::Rays),
            Algorithm::Grid => plain(AlgorithmKey::Grid),
            Algorithm::Traversal(connectivity) => {
                let neighbours = match connectivity {
                    Connectivity::Six => 6,
                    Connectivity::Eighteen => 18,
                    Connectivity::TwentySix => 26,
                };
                Self { connectivity: Some(neighbours), ..plain(AlgorithmKey::Traversal) }
            }
            Algorithm::Template(plane) => Self { plane: Some(plane.into()), ..plain(AlgorithmKey::Template) },
            Algorithm::ObjectSlices { spacing_correction } => {
                Self { spacing_correction: Some(spacing_correction), ..plain(AlgorithmKey::ObjectSlices) }
            }
            Algorithm::CoinFlips { games, seed } => Self { games: Some(games), seed: Some(seed), ..plain(AlgorithmKey::CoinFlips) },
        }
    }
}

impl RenderKeys {
    /// The keys that say how fragments of `scene` become pixels.
    pub(super) fn of(scene: &Scene) -> Self {
        let method = scene.method();
        let (filter, prefilter) = match method.filter {
            Filter::Linear => (FilterKey::Linear, None),
            Filter::Nearest => (FilterKey::Nearest, None),
            Filter::Cubic { prefilter } => (FilterKey::Cubic, Some(prefilter)),
        };
        let (blend, threshold, level) = match scene.blend() {
            Blend::Over => (BlendKey::Over, None, None),
            Blend::Under => (BlendKey::Under, None, None),
            Blend::Mip => (BlendKey::Mip, None, None),
            Blend::Min => (BlendKey::Min, None, None),
            Blend::Average => (BlendKey::Average, None, None),
            Blend::Add => (BlendKey::Add, None, None),
            Blend::AttenuatedMip { .. } => (BlendKey::AttenuatedMip, None, None),
            Blend::Lmip { threshold } => (BlendKey::Lmip, Some(threshold), None),
            Blend::Iso { level } => (BlendKey::Iso, None, Some(level)),
            Blend::Surfaces => (BlendKey::Iso, None, None),
        };
        let algorithm = AlgorithmKeys::of(scene.algorithm());
        let surface = |s: &LevelSurface| LevelKeys { level: s.level(), color: s.color(), opacity: s.opacity() };
        Self {
            profile: Some(if scene.opengl().is_some() { ProfileKey::Opengl } else { ProfileKey::Accurate }),
            filter: Some(filter),
            prefilter,
            algorithm: Some(algorithm.word),
            connectivity: algorithm.connectivity,
            plane: algorithm.plane,
            spacing_correction: algorithm.spacing_correction,
            games: algorithm.games,
            seed: algorithm.seed,
            target: Some(method.target.into()),
            blend: Some(blend),
            attenuation: if let Blend::AttenuatedMip { attenuation } = scene.blend() { Some(attenuation) } else { None },
            window: scene.window(),
            threshold,
            level,
            levels: (scene.blend() == Blend::Surfaces).then(|| scene.levels().iter().map(surface).collect()),
            hit: (blend == BlendKey::Iso).then_some(scene.hit().into()),
            linear_light: Some(scene.linear_light()),
        }
    }

    /// Whether level surfaces are drawn.
    pub(super) fn is_iso(&self) -> bool {
        self.blend == Some(BlendKey::Iso)
    }

    /// Whether the scene is drawn as OpenGL draws.
    pub(super) fn is_opengl(&self) -> bool {
        self.profile == Some(ProfileKey::Opengl)
    }

    /// The part of the method that stands in this section.
    pub(super) fn method(&self, mut method: Method) -> Method {
        method.filter = match self.filter {
            None => method.filter,
            Some(FilterKey::Linear) => Filter::Linear,
            Some(FilterKey::Nearest) => Filter::Nearest,
            Some(FilterKey::Cubic) => Filter::Cubic { prefilter: self.prefilter != Some(false) },
        };
        method.target = self.target.map_or(method.target, Target::from);
        method
    }

    /// What draws the picture.
    fn algorithm(&self, cx: &Context<'_>) -> Result<Algorithm> {
        let word = self.algorithm.unwrap_or(AlgorithmKey::Slices);
        let only = |key, given, of: AlgorithmKey, name| {
            cx.refuse(&[(key, given && word != of)], &format!("is for render.algorithm = \"{name}\" alone"))
        };
        only("render.connectivity", self.connectivity.is_some(), AlgorithmKey::Traversal, "traversal")?;
        only("render.plane", self.plane.is_some(), AlgorithmKey::Template, "template")?;
        only("render.spacing_correction", self.spacing_correction.is_some(), AlgorithmKey::ObjectSlices, "object-slices")?;
        only("render.games", self.games.is_some(), AlgorithmKey::CoinFlips, "coin-flips")?;
        only("render.seed", self.seed.is_some(), AlgorithmKey::CoinFlips, "coin-flips")?;
        Ok(match word {
            AlgorithmKey::Slices => Algorithm::Slices,
            AlgorithmKey::Shells => Algorithm::Shells,
            AlgorithmKey::Rays => Algorithm::Rays,
            AlgorithmKey::Grid => Algorithm::Grid,
            AlgorithmKey::Traversal => Algorithm::Traversal(match self.connectivity {
                None | Some(6) => Connectivity::Six,
                Some(18) => Connectivity::Eighteen,
                Some(26) => Connectivity::TwentySix,
                Some(other) => return Err(cx.error("render.connectivity", format!("{other}: must be 6, 18 or 26"))),
            }),
            AlgorithmKey::Template => Algorithm::Template(self.plane.map_or(TemplatePlane::Base, TemplatePlane::from)),
            AlgorithmKey::ObjectSlices => Algorithm::ObjectSlices { spacing_correction: self.spacing_correction != Some(false) },
            AlgorithmKey::CoinFlips => Algorithm::CoinFlips { games: self.games.unwrap_or(GAMES), seed: self.seed.unwrap_or(0) },
        })
    }

    /// `scene` blended as the section says.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        let kind = self.blend.unwrap_or(BlendKey::Over);
        cx.refuse(&[("render.threshold", self.threshold.is_some() && kind != BlendKey::Lmip)], "is for render.blend = \"lmip\" alone")?;
        cx.refuse(&[("render.level", self.level.is_some() && kind != BlendKey::Iso)], "is for render.blend = \"iso\" alone")?;
        cx.refuse(
            &[("render.prefilter", self.prefilter.is_some() && self.filter != Some(FilterKey::Cubic))],
            "is for render.filter = \"cubic\" alone",
        )?;
        let others = [("render.levels", self.levels.is_some()), ("render.hit", self.hit.is_some())]
            .map(|(key, given)| (key, given && kind != BlendKey::Iso));
        cx.refuse(&others, "is for render.blend = \"iso\" alone")?;
        cx.refuse(&[("render.levels", self.levels.is_some() && self.level.is_some())], "render.level is given too; give one of them")?;
        let attenuated = kind == BlendKey::AttenuatedMip;
        cx.refuse(&[("render.attenuation", self.attenuation.is_some() && !attenuated)], "is for render.blend = \"attenuated-mip\" alone")?;
        let windowless = matches!(kind, BlendKey::Over | BlendKey::Under | BlendKey::Iso);
        cx.refuse(
            &[("render.window", self.window.is_some() && windowless)],
            "is for render.blend = \"add\" and for projections of values",
        )?;
        let merge = scene.method().merge;
        cx.refuse(&[("slices.merge", merge && kind != BlendKey::Over)], "is for render.blend = \"over\" alone")?;
        let scene = scene.with_linear_light(self.linear_light == Some(true))?.with_hit(self.hit.map_or(Hit::Refined, Hit::from));
        let algorithm = self.algorithm(cx)?;
        if let Some(levels) = &self.levels {
            let each = |(i, l): (usize, &LevelKeys)| {
                LevelSurface::new(l.level, l.color, l.opacity).map_err(|e| cx.error(&format!("render.levels[{i}]"), e.to_string()))
            };
            let scene = scene.with_levels(levels.iter().enumerate().map(each).collect::<Result<_>>()?)?;
            return scene.with_algorithm(algorithm);
        }
        let scene = scene.with_blend(match kind {
            BlendKey::Over => Blend::Over,
            BlendKey::Under => Blend::Under,
            BlendKey::Mip => Blend::Mip,
            BlendKey::Min => Blend::Min,
            BlendKey::Average => Blend::Average,
            BlendKey::Add => Blend::Add,
            BlendKey::AttenuatedMip => Blend::AttenuatedMip { attenuation: self.attenuation.unwrap_or(ATTENUATION) },
            // Any local maximum stops the ray.
            BlendKey::Lmip => Blend::Lmip { threshold: self.threshold.unwrap_or(f64::MIN) },
            // Without a level of its own the surface is placed by `finish`, when the data is known.
            BlendKey::Iso => Blend::Iso { level: self.level.unwrap_or(0.0) },
        })?;
        let scene = match self.window {
            Some([center, width]) if !(center.is_finite() && width.is_finite() && width > 0.0) => {
                Err(cx.error("render.window", format!("[{center}, {width}]: a finite center and a positive width are needed")))
            }
            // Other projections show it as their transfer function.
            Some(_) if kind == BlendKey::Add || attenuated => scene.with_window(self.window),
            _ => Ok(scene),
        }?;
        // Last: what an algorithm does not have may depend on the blend.
        scene.with_algorithm(algorithm)
    }

    /// The values that a projection shows from black to white, where the section says so.
    pub(super) fn values(&self) -> Option<[f64; 2]> {
        self.window.map(|[center, width]| [center - 0.5 * width, center + 0.5 * width])
    }

    /// A surface without a level, and maxima without a threshold, are taken where the data splits into background and object.
    pub(super) fn finish(&self, data: &mut Data<'_>) -> Result<()> {
        if self.blend == Some(BlendKey::Iso) && self.level.is_none() && self.levels.is_none() {
            let level = Landmarks::of(data.volume.statistics()).split;
            data.warnings.push(format!("render.level is not given: the surface is taken at {level}"));
            data.scene = data.scene.clone().with_blend(Blend::Iso { level })?;
        }
        if self.blend == Some(BlendKey::Lmip) && self.threshold.is_none() {
            let threshold = Landmarks::of(data.volume.statistics()).split;
            data.warnings.push(format!("render.threshold is not given: the first maximum above {threshold} is taken"));
            data.scene = data.scene.clone().with_blend(Blend::Lmip { threshold })?;
        }
        Ok(())
    }
}
