//! Volumes and scenes that the benches share: built-in ones alone, so that a clone has all it takes.
#![allow(dead_code, reason = "no bench uses all of them")]

use slicestack::scene::{
    Camera, Classification, Filter, Fog, FogDistance, FogMode, Method, Placement, Projection, Slicing, Target, TransferFunction,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, VoxelType, Voxels};
use slicestack::{Limits, Result, Scene, Volume};

/// A smooth volume of any type.
pub(crate) fn signal(size: usize, kind: VoxelType) -> Result<Volume> {
    Phantom::MarschnerLobb.volume_as(size, kind, &Limits::default())
}

/// How much of [`block`] shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Share {
    Nothing,
    Half,
    All,
}

/// A volume for [`haze`]: its nearer half along x, all of it or none of it shows.
pub(crate) fn block(size: usize, share: Share) -> Result<Volume> {
    let voxel = |i: usize| {
        let [x, y, z] = [i % size, i / size % size, i / size / size];
        let shows = match share {
            Share::Nothing => false,
            Share::Half => 2 * x >= size,
            Share::All => true,
        };
        if shows { (100 + (7 * x + 13 * y + 29 * z) % 100) as u8 } else { 0 }
    };
    Volume::new(Grid::with_spacing([size; 3], [1.0; 3])?, Voxels::U8((0..size * size * size).map(voxel).collect()))
}

/// A picture of `side` x `side` pixels in `count` slices.
pub(crate) fn scene(transfer: TransferFunction, side: u32, count: u64) -> Result<Scene> {
    Scene::new(transfer).with_size(side, side)?.with_slices(Slicing::Count(count))
}

/// Everything above 50 shows, and so little of it that no pixel is ever finished; nor would it be if it could.
pub(crate) fn haze(side: u32, count: u64) -> Result<Scene> {
    let colors = vec![(0.0, [1.0, 0.5, 0.2]), (255.0, [0.2, 0.5, 1.0])];
    scene(TransferFunction::new(colors, vec![(50.0, 0.0), (51.0, 0.001)])?, side, count)?.with_terminate(0.0)
}

/// The same for [`signal`], whose values lie between 0 and 1.
pub(crate) fn mist(side: u32, count: u64) -> Result<Scene> {
    let colors = vec![(0.0, [1.0, 0.5, 0.2]), (1.0, [0.2, 0.5, 1.0])];
    scene(TransferFunction::new(colors, vec![(0.0, 0.001), (1.0, 0.002)])?, side, count)?.with_terminate(0.0)
}

/// [`signal`] of `size` as it is meant to be looked at.
pub(crate) fn shells(size: usize, side: u32, count: u64) -> Result<Scene> {
    scene(Phantom::MarschnerLobb.default_transfer(size), side, count)
}

/// As from a scanner: a head in air, opaque bone.
pub(crate) fn head(size: usize) -> Result<Volume> {
    Phantom::SheppLogan.volume_as(size, VoxelType::U16, &Limits::default())
}

/// [`head`] with an opaque skull before a faint brain.
pub(crate) fn skull(side: u32, count: u64) -> Result<Scene> {
    let transfer = TransferFunction::new(
        vec![(0.1, [0.8, 0.3, 0.2]), (0.6, [1.0, 0.95, 0.9])],
        vec![(0.15, 0.0), (0.25, 0.01), (0.5, 0.02), (0.9, 0.6)],
    )?;
    scene(transfer, side, count)
}

/// From a slant, near.
pub(crate) fn perspective(scene: Scene) -> Result<Scene> {
    let placement = Placement::Orbit { azimuth: 30.0, elevation: 20.0, roll: 0.0, zoom: 1.2 };
    Ok(scene.with_camera(Camera::new(placement, Projection::Perspective { fov_y: 40.0 })?))
}

/// In fog.
pub(crate) fn fog(scene: Scene, distance: FogDistance) -> Result<Scene> {
    let fog = Fog::new(FogMode::Exp2 { density: 0.004 }, [0.5, 0.6, 0.7])?;
    Ok(scene.with_fog(Some(fog.with_distance(distance))))
}

/// Classified another way.
pub(crate) fn classified(scene: Scene, classification: Classification) -> Result<Scene> {
    scene.with_method(Method::default().with_classification(classification))
}

/// Looked up another way.
pub(crate) fn filtered(scene: Scene, filter: Filter) -> Result<Scene> {
    scene.with_method(Method::default().with_filter(filter))
}

/// In the numbers of another target.
pub(crate) fn target(scene: Scene, target: Target) -> Result<Scene> {
    scene.with_method(Method::default().with_target(target))
}

/// A volume and a scene of it.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) volume: Volume,
    pub(crate) scene: Scene,
}

/// The names of [`case`].
pub(crate) const CASES: [&str; 11] = [
    "dense",
    "half-empty",
    "empty",
    "dense-u16",
    "dense-f32",
    "shells",
    "head",
    "perspective-fog",
    "pre-integrated",
    "second-order",
    "cubic",
];

/// The case called `name`, in the size that its instructions are counted in.
pub(crate) fn case(name: &str) -> Result<Option<Case>> {
    const SIZE: usize = 64;
    const SIDE: u32 = 128;
    const COUNT: u64 = 64;
    let (name, volume, scene) = match name {
        // Large, so that the border between the halves is a small part of them.
        "dense" => ("dense", block(2 * SIZE, Share::All)?, haze(2 * SIDE, 4 * COUNT)?),
        "half-empty" => ("half-empty", block(2 * SIZE, Share::Half)?, haze(2 * SIDE, 4 * COUNT)?),
        "empty" => ("empty", block(2 * SIZE, Share::Nothing)?, haze(2 * SIDE, 4 * COUNT)?),
        "dense-u16" => ("dense-u16", signal(SIZE, VoxelType::U16)?, mist(SIDE, COUNT)?),
        "dense-f32" => ("dense-f32", signal(SIZE, VoxelType::F32)?, mist(SIDE, COUNT)?),
        "shells" => ("shells", signal(SIZE, VoxelType::U8)?, shells(SIZE, SIDE, COUNT)?),
        "head" => ("head", head(SIZE)?, skull(SIDE, COUNT)?),
        "perspective-fog" => {
            ("perspective-fog", signal(SIZE, VoxelType::U8)?, fog(perspective(shells(SIZE, SIDE, COUNT)?)?, FogDistance::Planar)?)
        }
        "pre-integrated" => ("pre-integrated", head(SIZE)?, classified(skull(SIDE, COUNT)?, Classification::PreIntegrated)?),
        "cubic" => ("cubic", signal(SIZE, VoxelType::U8)?, filtered(mist(SIDE, COUNT)?, Filter::CUBIC)?),
        "second-order" => ("second-order", head(SIZE)?, classified(skull(SIDE, COUNT)?, Classification::SecondOrder)?),
        _ => return Ok(None),
    };
    Ok(Some(Case { name, volume, scene }))
}
