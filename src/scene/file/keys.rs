//! Every key of a scene file: its type, and the words that the schema and `--help` show for it.
//!
//! Keys are optional here, so that a missing one takes the default of the scene's own types; what goes together is decided in
//! `build.rs`.

use super::opengl::OpenGlKeys;
use super::schema::{colormap_names, phantom_names, preset_names, type_names};
use schemars::JsonSchema;
use serde::Deserialize;

/// A scene file for slicestack: a volume, and how to picture it. Every key but the volume has a default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Document {
    /// What to picture.
    pub volume: VolumeKeys,
    /// Where the eye is and how it projects: the look-at form (eye, target, up) or the orbit form (azimuth, elevation, roll, zoom).
    pub camera: CameraKeys,
    /// The picture itself.
    pub image: ImageKeys,
    /// From values to colour and opacity: a preset, a colour map, or lists of points.
    pub transfer: TransferKeys,
    /// How many slices, and how they are blended.
    pub slices: SliceKeys,
    /// OpenGL's fog.
    pub fog: FogKeys,
    /// How fragments become pixels.
    pub render: RenderKeys,
    /// State of the OpenGL pipeline, for render.profile = "opengl".
    pub opengl: OpenGlKeys,
    /// Up to six planes that cut the box.
    pub clip: Vec<ClipKeys>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct VolumeKeys {
    /// File to read (NRRD, NIfTI, MetaImage, VTK, NumPy, raw), relative to the scene file.
    pub path: Option<String>,
    /// Built-in volume instead of a file.
    #[schemars(schema_with = "phantom_names")]
    pub phantom: Option<String>,
    /// Voxels along each axis of a built-in volume; 128 unless given.
    pub size: Option<usize>,
    /// Box that the voxels fill: cells (index -1/2 to n-1/2, the default) or nodes (0 to n-1).
    #[serde(rename = "box")]
    pub convention: Option<BoxKey>,
    /// Raw file: voxels along x, y and z.
    pub dimensions: Option<[usize; 3]>,
    /// Raw file: type of a voxel.
    #[serde(rename = "type")]
    #[schemars(schema_with = "type_names")]
    pub kind: Option<String>,
    /// Raw file: byte order, little unless given.
    pub endian: Option<EndianKey>,
    /// World units from voxel to voxel along x, y and z, instead of the file's; a negative one turns the axis around.
    pub spacing: Option<[f64; 3]>,
    /// World position of the first voxel's centre, instead of the file's.
    pub origin: Option<[f64; 3]>,
    /// Raw file: bytes before the first voxel.
    pub offset: Option<u64>,
    /// Slope of value = slope * stored + intercept, instead of the file's.
    pub slope: Option<f64>,
    /// Intercept of value = slope * stored + intercept, instead of the file's.
    pub intercept: Option<f64>,
    /// Kind of values, where the file does not say: ct (Hounsfield units) or mr.
    pub modality: Option<ModalityKey>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CameraKeys {
    /// Parallel rays (orthographic, the default) or rays from the eye (perspective).
    pub projection: Option<ProjectionKey>,
    /// Look-at form: the eye, world units.
    pub eye: Option<[f64; 3]>,
    /// Look-at form: the point in the middle of the picture; the box's centre unless given.
    pub target: Option<[f64; 3]>,
    /// Look-at form: a direction that points upwards in the picture; the subject's up unless given.
    pub up: Option<[f64; 3]>,
    /// Orbit form: degrees around the box to the right, from the subject's front; 30 unless given.
    pub azimuth: Option<f64>,
    /// Orbit form: degrees upwards; 20 unless given.
    pub elevation: Option<f64>,
    /// Orbit form: degrees the camera turns clockwise about its line of sight.
    pub roll: Option<f64>,
    /// Orbit form: 1 fits the box's bounding sphere into the picture; 1.2 unless given.
    pub zoom: Option<f64>,
    /// Orthographic: world height of the view; fitted to the box unless given.
    pub height: Option<f64>,
    /// Perspective: full vertical angle of the view in degrees; 30 unless given.
    pub fov_y: Option<f64>,
    /// Depth of the near plane, world units.
    pub near: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ImageKeys {
    /// Columns of pixels; 512 unless given.
    pub width: Option<u32>,
    /// Rows of pixels; 512 unless given.
    pub height: Option<u32>,
    /// Red, green, blue, opacity behind the volume, each 0 to 1, not premultiplied; transparent unless given.
    pub background: Option<[f64; 4]>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TransferKeys {
    /// Ready-made transfer function; the best guess for the data where the scene has no transfer keys at all.
    #[schemars(schema_with = "preset_names")]
    pub preset: Option<String>,
    /// Colour map laid over range.
    #[schemars(schema_with = "colormap_names")]
    pub colormap: Option<String>,
    /// Values at which the colour map begins and ends; the data's object, background left out, unless given.
    pub range: Option<[f64; 2]>,
    /// Points [value, red, green, blue], piecewise linear.
    pub color: Option<Vec<[f64; 4]>>,
    /// Points [value, opacity per opacity_unit], piecewise linear.
    pub opacity: Option<Vec<[f64; 2]>>,
    /// Length that opacities refer to, world units; the smallest voxel spacing or the preset's own unless given.
    pub opacity_unit: Option<f64>,
    /// Interpolate and then classify (post, the default), classify first (pre), or integrate over slabs (pre-integrated, or
    /// second-order, which knows the values' curvature too).
    pub classification: Option<ClassificationKey>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SliceKeys {
    /// Number of slices through the box's depth; 256 unless given.
    pub count: Option<u64>,
    /// Distance of slices, world units, instead of their number.
    pub spacing: Option<f64>,
    /// Root-mean-square error of the colours to stay below, instead of a number of slices.
    pub tolerance: Option<f64>,
    /// Which slice is blended first: front-to-back (the default) or back-to-front (the default in the profile opengl).
    pub order: Option<OrderKey>,
    /// Transmittance below which a pixel is finished; 1/1024 unless given, 0 = never.
    pub terminate: Option<f64>,
    /// Opacity of a slab: exponential (1 - exp(-kappa L), the default) or riemann (kappa L, for comparison).
    pub slab: Option<SlabKey>,
    /// Where in its slab a value is taken: center (the default) or end (for comparison).
    pub sample: Option<SampleKey>,
    /// What the outermost fragments stand for: partial slabs (the default) or whole ones, as in OpenGL.
    pub ends: Option<EndsKey>,
    /// Sums over slices: auto (the default), plain, or compensated, which a million slices need.
    pub accumulation: Option<AccumulationKey>,
    /// Whether pictures of N and 2 N slices are extrapolated to infinitely many.
    pub extrapolate: Option<bool>,
    /// Whether three slabs or nine become one where colour and opacity hardly change, or hardly any light comes from; always where a tolerance is given.
    pub merge: Option<bool>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FogKeys {
    /// How the fog factor falls with distance; none unless given.
    pub mode: Option<FogModeKey>,
    /// exp and exp2: density per world unit; 1 unless given.
    pub density: Option<f64>,
    /// linear: distance at which fog begins; 0 unless given.
    pub start: Option<f64>,
    /// linear: distance at which only fog is left; 1 unless given.
    pub end: Option<f64>,
    /// Red, green, blue of the fog, each 0 to 1; black unless given.
    pub color: Option<[f64; 3]>,
    /// Distance along the view direction (planar, the default) or from the eye (radial).
    pub distance: Option<FogDistanceKey>,
    /// Fog weighted by opacity (alpha, the default) or as OpenGL writes it (literal, the default in the profile opengl), which lights
    /// up empty slices of premultiplied colours.
    pub weighting: Option<FogWeightingKey>,
    /// Whether the background is fogged too.
    pub background: Option<bool>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RenderKeys {
    /// Exact slabs (accurate, the default) or what an OpenGL 1.x driver does (opengl).
    pub profile: Option<ProfileKey>,
    /// What a lookup between voxels gives: linear interpolation (the default) or the nearest voxel.
    pub filter: Option<FilterKey>,
    /// Numbers that fragments are blended in; f32 unless given, in the profile opengl unorm8. unorm16 is for that profile alone.
    pub target: Option<TargetKey>,
    /// How fragments of a pixel combine; over unless given.
    pub blend: Option<BlendKey>,
    /// lmip: smallest value that stops a ray.
    pub threshold: Option<f64>,
    /// iso: value of the surface.
    pub level: Option<f64>,
    /// Whether colours are blended as linear light.
    pub linear_light: Option<bool>,
}

/// A plane that cuts the box: kept is where normal . p >= offset.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ClipKeys {
    /// Direction from the plane to what is kept, world space.
    pub normal: [f64; 3],
    /// Where the plane cuts a line along normal, in world units for a normal of length 1.
    #[serde(default)]
    pub offset: f64,
}

macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident { $($variant:ident),* })*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
            #[serde(rename_all = "kebab-case")]
            pub(super) enum $name { $($variant),* }
        )*
    };
}
pub(super) use choices;

choices! {
    BoxKey { Cells, Nodes }
    EndianKey { Little, Big }
    ModalityKey { Ct, Mr }
    ProjectionKey { Orthographic, Perspective }
    ClassificationKey { Post, Pre, PreIntegrated, SecondOrder }
    SlabKey { Exponential, Riemann }
    SampleKey { Center, End }
    EndsKey { Partial, Whole }
    AccumulationKey { Auto, Plain, Compensated }
    FilterKey { Linear, Nearest }
    OrderKey { FrontToBack, BackToFront }
    FogModeKey { None, Linear, Exp, Exp2 }
    FogDistanceKey { Planar, Radial }
    FogWeightingKey { Alpha, Literal }
    ProfileKey { Accurate, Opengl }
    TargetKey { F32, Unorm8, Unorm16 }
    BlendKey { Over, Mip, Min, Lmip, Average, Add, Iso }
}
