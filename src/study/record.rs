//! What a study found, as plain numbers: the JSON holds all of it, each list is a CSV file.

use serde::Serialize;

/// A study of one scene.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Record {
    /// What was studied, and how.
    pub setting: Setting,
    /// What errors look like: pictures made to have them.
    pub details: Vec<Detail>,
    /// The methods, in the order of the report.
    pub methods: Vec<MethodRecord>,
    /// Pictures made and measured.
    pub points: Vec<Point>,
    /// Where the time of a frame goes.
    pub stages: Vec<StageTime>,
    /// Cost against image size and volume size.
    pub costs: Vec<Cost>,
    /// What each kind of gradient costs, where the scene depends on one.
    pub gradients: Vec<GradientKind>,
    /// What each kind of hit costs at several slice counts, where the scene draws level surfaces.
    pub hits: Vec<HitKind>,
    /// What the other algorithms cost, where colours are blended over each other.
    pub algorithms: Vec<AlgorithmRow>,
    /// How evenly a frame's work falls on threads.
    pub balance: Vec<Balance>,
    /// Which method to use for which error.
    pub advice: Vec<Advice>,
    /// How pre-integration did, and why.
    pub pre_integration: Option<PreIntegration>,
}

/// A picture made to have an error, of which the report shows a detail.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Detail {
    /// The RMS error that was wanted.
    pub error: f64,
    /// Name of the method.
    pub method: String,
    /// Slices.
    pub slices: u64,
    /// The error of the whole picture: root of the mean squared error of red, green and blue over black.
    pub rms: f64,
    /// Seconds of a frame, the shortest of several.
    pub seconds: f64,
    /// First column of the detail.
    pub column: u32,
    /// First row of the detail.
    pub row: u32,
    /// Width of the detail in pixels.
    pub width: u32,
    /// Height of the detail in pixels.
    pub height: u32,
}

/// The scene with one kind of gradient, against the reference with the same kind.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct GradientKind {
    /// `central`, `analytic` or `sobel`.
    pub kind: String,
    /// Slices.
    pub slices: u64,
    /// Seconds of a frame, the shortest of several.
    pub seconds: f64,
    /// Root of the mean squared error of red, green and blue over black.
    pub rms: f64,
    /// Largest error.
    pub max: f64,
    /// Bound on the reference's own error.
    pub reference_bound: f64,
    /// Pixels of the reference.
    pub reference_pixels: usize,
}

/// The scene's level surfaces with one kind of hit at one slice count, against the exact crossings of the rays.
///
/// Distances of hits are those of the nearest surface a pixel's ray meets, along the view direction.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct HitKind {
    /// `refined` or `first-sample`.
    pub kind: String,
    /// Slices.
    pub slices: u64,
    /// Seconds of a frame, the shortest of several.
    pub seconds: f64,
    /// Root of the mean squared error of red, green and blue over black.
    pub rms: f64,
    /// Largest error.
    pub max: f64,
    /// Pixels of the reference.
    pub reference_pixels: usize,
    /// Of those, the ones whose ray meets a surface both in the picture and in the reference, not more than a slab apart.
    pub met: usize,
    /// The ones that meet another surface than in the reference, or meet one in only one of the two. Neither kind of hit sees a level that is
    /// crossed twice within a slab.
    pub elsewhere: usize,
    /// Mean distance between hit and exact crossing in the pixels of `met`, in thicknesses of a slab.
    pub mean_distance: Option<f64>,
    /// Largest of those distances, in thicknesses of a slab.
    pub max_distance: Option<f64>,
}

/// The scene by one algorithm, in few pixels, against the reference.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct AlgorithmRow {
    /// Its name in scene files, and what sets it apart.
    pub algorithm: String,
    /// Slices, steps of a ray, or the most voxels of any ray.
    pub samples: u64,
    /// Seconds of a frame, the shortest of several.
    pub seconds: f64,
    /// Voxel lookups.
    pub fetches: u64,
    /// Root of the mean squared error of red, green and blue over black.
    pub rms: f64,
    /// Largest error.
    pub max: f64,
    /// Pixels of the reference.
    pub reference_pixels: usize,
}

/// How evenly a frame's tiles fall on threads.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Balance {
    /// Side of a tile in pixels.
    pub tile: u32,
    /// Number of tiles.
    pub tiles: usize,
    /// Seconds of the longest.
    pub longest: f64,
    /// Worker threads that there were.
    pub threads: usize,
    /// Seconds of a frame on them.
    pub seconds: f64,
    /// The share of a frame that the least busy of them stood idle, in the frame where it was least.
    pub idle: f64,
    /// What as many threads as these would do, worked out from the times of the tiles.
    pub shared: Vec<Shared>,
}

/// A frame's tiles on so many threads, each tile handed to the first that is free.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Shared {
    /// Threads.
    pub threads: usize,
    /// Seconds until the last tile is done.
    pub seconds: f64,
    /// Times as fast as one thread.
    pub speedup: f64,
    /// The share of that time that the least busy thread stands idle.
    pub idle: f64,
    /// The same, of all threads on average.
    pub mean_idle: f64,
}

/// What was studied, and how.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Setting {
    /// The scene's or the volume's name.
    pub name: String,
    /// Voxels along x, y, z.
    pub dimensions: [usize; 3],
    /// Type of the voxels.
    pub voxel_type: String,
    /// Width and height of the picture in pixels: times are for all of it.
    pub image: [u32; 2],
    /// Slices that the scene itself asks for.
    pub slices: u64,
    /// Worker threads.
    pub threads: usize,
    /// Vector level.
    pub simd: String,
    /// Seconds that were granted.
    pub budget: f64,
    /// Seconds that were taken.
    pub seconds: f64,
    /// Errors are measured on every so many columns and rows.
    pub reference_step: u32,
    /// Pixels of the reference.
    pub reference_pixels: usize,
    /// Bound on the reference's own error.
    pub reference_bound: f64,
    /// Seconds the reference took.
    pub reference_seconds: f64,
    /// Version of the program.
    pub version: String,
}

/// A method and what its pictures show about it.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct MethodRecord {
    /// Its name.
    pub name: String,
    /// What it does.
    pub about: String,
    /// Order of the error in the thickness of slabs expected on smooth scenes.
    pub expected_order: Option<u32>,
    /// Order measured here.
    pub measured_order: Option<f64>,
    /// Why it converges to something else than the reference.
    pub other_limit: Option<String>,
    /// Why there are no pictures of it.
    pub missing: Option<String>,
}

/// One picture, measured.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Point {
    /// Name of the method.
    pub method: String,
    /// Slices; the most of any block, where blocks have different ones.
    pub slices: u64,
    /// The error asked for, where one was.
    pub tolerance: Option<f64>,
    /// Seconds of a frame, the shortest of `repeats` after a first one.
    pub seconds: f64,
    /// Seconds for what is kept between frames: tables and their like.
    pub prepare_seconds: f64,
    /// Frames timed.
    pub repeats: u32,
    /// Voxel lookups.
    pub fetches: u64,
    /// Root of the mean squared error of red, green and blue over black.
    pub rms: f64,
    /// Largest error.
    pub max: f64,
    /// Error that 99.9 % of the components do not exceed.
    pub p999: f64,
    /// Peak signal-to-noise ratio in decibels; none for equal pictures.
    pub psnr: Option<f64>,
    /// Components that differ by one step of 1/255 or more once rounded to 8 bits, of all.
    pub visible: f64,
    /// Structural similarity, where there was time for it.
    pub ssim: Option<f64>,
    /// FLIP, where there was time for it.
    pub flip: Option<f64>,
    /// RMS difference to the picture of half as many slices.
    pub change: Option<f64>,
    /// The error as the renderer estimated it itself.
    pub estimate: Option<f64>,
}

/// Time of one stage in a frame.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct StageTime {
    /// Name of the method.
    pub method: String,
    /// Slices.
    pub slices: u64,
    /// Name of the stage.
    pub stage: String,
    /// Its part of the frame's seconds.
    pub seconds: f64,
    /// Its share of the frame, 0 to 1.
    pub share: f64,
    /// Batches of 64 fragments that were timed.
    pub batches: u64,
}

/// A frame of another size.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Cost {
    /// What varies: `image` or `volume`.
    pub of: String,
    /// Width and height of the picture.
    pub image: [u32; 2],
    /// Voxels along x, y, z.
    pub dimensions: [usize; 3],
    /// Pixels or voxels.
    pub size: u64,
    /// Seconds of a frame.
    pub seconds: f64,
    /// Seconds for what is kept between frames.
    pub prepare_seconds: f64,
    /// Voxel lookups.
    pub fetches: u64,
}

/// The cheapest method measured for an error.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Advice {
    /// RMS error that must not be exceeded.
    pub error: f64,
    /// The method, if any reached it.
    pub method: Option<String>,
    /// Its slices.
    pub slices: Option<u64>,
    /// The tolerance to ask for, where the method is to be asked for one.
    pub tolerance: Option<f64>,
    /// Its seconds for a frame.
    pub seconds: Option<f64>,
    /// Its error.
    pub rms: Option<f64>,
    /// Seconds of the default method with the fewest slices that reach the error.
    pub default_seconds: Option<f64>,
    /// Those slices.
    pub default_slices: Option<u64>,
}

/// Pre-integrated slabs against the default.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PreIntegration {
    /// What an error takes by both, between measured pictures.
    pub slices_for: Vec<SlicesFor>,
    /// In slabs that show something, at the scene's slice count: how far the value in the middle lies from the mean of the two sides,
    /// over how far the sides lie apart (both RMS). 0 where the field is straight, which is what pre-integration takes it for.
    pub bend: Option<f64>,
    /// The verdict in words.
    pub verdict: String,
}

/// Slices that an error takes.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct SlicesFor {
    /// RMS error.
    pub error: f64,
    /// Slices of the default.
    pub midpoint: f64,
    /// Slices of pre-integrated slabs.
    pub pre_integrated: f64,
    /// Seconds of a frame of the default.
    pub midpoint_seconds: f64,
    /// Seconds of a frame of pre-integrated slabs.
    pub pre_integrated_seconds: f64,
}
