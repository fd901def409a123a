//! What is rendered: 8-bit volumes on plain grids, transfer functions of 256 entries, one view. Every peer can take these as they are.

use glam::DVec3;
use slicestack::scene::{Camera, Lighting, Overrides, Placement, Projection, SceneFile, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, Origin, VoxelType, Voxels};
use slicestack::{Limits, Scene, Volume};
use std::error::Error;
use std::path::Path;

/// Voxels of a built-in volume along each axis.
pub(crate) const SIZE: usize = 256;
/// Columns and rows of every picture.
pub(crate) const SIDE: u32 = 512;
/// Degrees the view is tilted and turned.
pub(crate) const TILT: f64 = 20.0;
pub(crate) const TURN: f64 = 30.0;
/// Half the height of the view, in longest sides of the volume.
const HALF_HEIGHT: f64 = 0.9;

/// A volume and how it is looked at.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) volume: Volume,
    pub(crate) scene: Scene,
}

impl Case {
    /// The volume and the transfer function of a scene file; `None` when its data is not there.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>, Box<dyn Error>> {
        let file = SceneFile::read(path, &Overrides::default())?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut source = file.volume().clone();
        if let (Origin::File(data) | Origin::Raw(data, _), Some(root)) = (&mut source.origin, std::env::var_os("SLICESTACK_DATA")) {
            let inside: Vec<_> = data.components().rev().take(2).collect();
            *data = inside.into_iter().rev().fold(root.into(), |path, part| path.join(part));
        }
        if let Some(data) = source.path().filter(|d| !d.is_file()) {
            eprintln!("{}: left out, its data is absent: {}", path.display(), data.display());
            return Ok(None);
        }
        let given = source.load(&Limits::default())?;
        let (scene, warnings) = file.to_scene(&given)?;
        warnings.iter().for_each(|w| eprintln!("{}: {w}", path.display()));
        let volume = match source.origin {
            Origin::Phantom(phantom, size) => phantom.volume_as(size, VoxelType::U8, &Limits::default())?,
            _ => eight_bits(&given)?,
        };
        Self::new(name, volume, scene.transfer()).map(Some)
    }

    /// A built-in volume as it is meant to be looked at.
    pub(crate) fn phantom(phantom: Phantom) -> Result<Self, Box<dyn Error>> {
        let volume = phantom.volume_as(SIZE, VoxelType::U8, &Limits::default())?;
        Self::new(phantom.name().into(), volume, &phantom.default_transfer(SIZE))
    }

    pub(crate) fn new(name: String, volume: Volume, transfer: &TransferFunction) -> Result<Self, Box<dyn Error>> {
        let unit = transfer.opacity_length(volume.grid());
        let scene = Scene::new(snapped(transfer, volume.rescale())?)
            .with_size(SIDE, SIDE)?
            .with_opacity_unit(unit)?
            .with_camera(view(volume.grid(), TURN)?);
        Ok(Self { name, volume, scene })
    }

    /// The same in a head light of full strength, whose formula VTK has too: c (0.25 + 0.75 |n.v|) + 0.2 |n.v|^20.
    pub(crate) fn lit(&self) -> Result<Self, Box<dyn Error>> {
        let scene = self.scene.clone().with_lighting(Some(Lighting::default()))?;
        Ok(Self { name: self.name.clone(), volume: self.volume.clone(), scene })
    }

    /// The 256 colours and opacities per unit length.
    pub(crate) fn table(&self) -> Vec<[f64; 4]> {
        let (slope, intercept) = self.volume.rescale();
        let entry = |i: u32| {
            let color = self.scene.transfer().eval(slope * f64::from(i) + intercept);
            [color.rgb[0], color.rgb[1], color.rgb[2], color.alpha]
        };
        (0..256).map(entry).collect()
    }

    /// The length that opacities refer to.
    pub(crate) fn unit(&self) -> f64 {
        self.scene.transfer().opacity_length(self.volume.grid())
    }

    /// The voxels.
    pub(crate) fn bytes(&self) -> &[u8] {
        match self.volume.voxels() {
            Voxels::U8(bytes) => bytes,
            _ => &[],
        }
    }
}

/// The camera from a slant, turned by `turn` degrees.
pub(crate) fn view(grid: &Grid, turn: f64) -> Result<Camera, Box<dyn Error>> {
    let (n, h) = (grid.dims(), grid.spacing());
    let longest = (0..3).map(|i| n[i] as f64 * h[i]).fold(0.0, f64::max);
    let ((sa, ca), (sb, cb)) = (TILT.to_radians().sin_cos(), turn.to_radians().sin_cos());
    let back = DVec3::new(-ca * sb, sa, ca * cb);
    let up = DVec3::new(sa * sb, ca, -sa * cb);
    let target = grid.center();
    let placement = Placement::LookAt { eye: target + 3.0 * longest * back, target, up };
    Ok(Camera::new(placement, Projection::Orthographic { height: Some(2.0 * HALF_HEIGHT * longest) })?)
}

/// `volume` in 8 bits, on axes of its own: integers in steps of a power of two, so that round values stay on the steps; other numbers
/// in 255 steps from the least to the greatest.
fn eight_bits(volume: &Volume) -> Result<Volume, Box<dyn Error>> {
    let grid = Grid::with_spacing(volume.grid().dims(), volume.grid().spacing())?;
    let (slope, intercept) = volume.rescale();
    if let Voxels::U8(bytes) = volume.voxels() {
        return Ok(Volume::new(grid, Voxels::U8(bytes.to_vec().into()))?.with_rescale(slope, intercept)?);
    }
    let voxels = volume.voxels();
    let finite = || (0..voxels.len()).map(|i| voxels.get(i)).filter(|v| v.is_finite());
    let (least, most) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let exact = (most - least).max(f64::MIN_POSITIVE) / 255.0;
    let (first, step) = if voxels.voxel_type().is_float() {
        (least, exact)
    } else {
        let step = exact.log2().ceil().exp2().max(1.0);
        // Zero stays on a step; where that costs the greatest values, steps start at the least.
        let first = (least / step).floor() * step;
        (first, if first + 255.0 * step < most { 2.0 * step } else { step })
    };
    let bytes: Vec<u8> = (0..voxels.len()).map(|i| ((voxels.get(i) - first) / step + 0.5) as u8).collect();
    Ok(Volume::new(grid, Voxels::U8(bytes.into()))?.with_rescale(slope * step, slope * first + intercept)?)
}

/// `transfer` with its points moved to the nearest of the 256 values that a voxel may have: every table then holds it exactly.
fn snapped(transfer: &TransferFunction, (slope, intercept): (f64, f64)) -> Result<TransferFunction, Box<dyn Error>> {
    let near = |value: f64| {
        let i = (value - intercept) / slope;
        // Beyond the voxels' values a point counts as it stands: it only bends the line towards it.
        if (0.0..=255.0).contains(&i) { slope * i.round() + intercept } else { value }
    };
    let color = transfer.color().iter().map(|&(v, c)| (near(v), c)).collect();
    let opacity = transfer.opacity().iter().map(|&(v, a)| (near(v), a)).collect();
    Ok(TransferFunction::new(color, opacity)?)
}
