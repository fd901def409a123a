//! Projections of values, and every type of voxel, against the slow picture.

use super::oracle::{Oracle, slab};
use super::{PARALLEL, WIDE, difference, fill_as, oblique, orbit, render, simple, smooth, telling};
use slicestack::scene::{Blend, Slicing};
use slicestack::volume::VoxelType;
use slicestack::{Scene, Volume};

const BLENDS: [Blend; 9] = [
    Blend::Over,
    Blend::Add,
    Blend::Mip,
    Blend::Min,
    Blend::Average,
    Blend::Lmip { threshold: 0.45 },
    Blend::Iso { level: 0.52 },
    Blend::AttenuatedMip { attenuation: 3.0 },
    Blend::Under,
];

/// A volume of `kind` that uses most of the type's range for values in [0,1]; a negative slope turns stored values around.
fn typed(kind: VoxelType, dims: [usize; 3], negative: bool) -> Volume {
    let (low, high) = match kind {
        VoxelType::F32 => (-3.0, 5.0),
        VoxelType::F64 => (1000.0, 1000.5),
        _ => kind.limits(),
    };
    let (slope, intercept) = if negative { (-1.0 / (high - low), high / (high - low)) } else { (1.0 / (high - low), -low / (high - low)) };
    let stored = |p: [f64; 3]| (smooth(p) - intercept) / slope;
    Volume::new(oblique(dims), fill_as(kind, dims, &stored)).unwrap().with_rescale(slope, intercept).unwrap()
}

/// Pixels whose colour is further than `bound` from the slow picture's.
fn off(volume: &Volume, scene: &Scene, bound: f64) -> (usize, f64) {
    let (picture, _) = render(volume, scene);
    let want = Oracle::new(volume, scene).picture();
    let wrong = picture.pixels().iter().zip(&want).filter(|(a, b)| (0..4).any(|c| (f64::from(a[c]) - b[c]).abs() > bound)).count();
    (wrong, difference(&picture, &want))
}

#[test]
fn every_blend_of_every_voxel_type() {
    for kind in VoxelType::ALL {
        for negative in [false, true] {
            let volume = typed(kind, [9, 11, 8], negative);
            for (camera, blend) in BLENDS.iter().enumerate() {
                let camera = if camera % 2 == 0 { orbit(25.0, -15.0, 1.2, PARALLEL) } else { orbit(140.0, 30.0, 1.2, WIDE) };
                let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(17, 15).unwrap().with_blend(*blend).unwrap();
                let scene = scene.with_slices(Slicing::Count(40)).unwrap().with_terminate(0.0).unwrap();
                let unit = slab(&volume, &scene);
                let (wrong, worst) = off(&volume, &scene.with_opacity_unit(unit).unwrap(), 3e-5);
                // A local maximum or a first crossing may hang on the last bit of a value: in a pixel here and there.
                let allowed = if matches!(blend, Blend::Lmip { .. } | Blend::Iso { .. }) { 4 } else { 0 };
                assert!(wrong <= allowed, "{kind}, negative {negative}, {blend:?}: {wrong} pixels off by up to {worst}");
            }
        }
    }
}

#[test]
fn every_blend_in_every_view() {
    let volume = typed(VoxelType::F32, [13, 10, 12], false);
    for camera in super::cameras(volume.grid()) {
        for blend in BLENDS {
            let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(20, 20).unwrap().with_blend(blend).unwrap();
            let scene = scene.with_slices(Slicing::Count(57)).unwrap().with_terminate(0.0).unwrap();
            let unit = slab(&volume, &scene);
            let (wrong, worst) = off(&volume, &scene.with_opacity_unit(unit).unwrap(), 3e-5);
            let allowed = if matches!(blend, Blend::Lmip { .. } | Blend::Iso { .. }) { 3 } else { 0 };
            assert!(wrong <= allowed, "{blend:?} from {camera:?}: {wrong} pixels off by up to {worst}");
        }
    }
}

#[test]
fn single_voxels_along_any_axes() {
    for dims in [[1, 1, 1], [1, 6, 7], [6, 1, 7], [6, 7, 1], [1, 1, 9], [1, 9, 1], [9, 1, 1], [2, 1, 2]] {
        for kind in VoxelType::ALL {
            let volume = typed(kind, dims, false);
            for blend in [Blend::Over, Blend::Mip, Blend::Average] {
                let scene = Scene::new(simple(0.0, 1.0)).with_camera(orbit(40.0, 25.0, 1.0, WIDE)).with_size(14, 13).unwrap();
                let scene = scene.with_slices(Slicing::Count(12)).unwrap().with_blend(blend).unwrap().with_terminate(0.0).unwrap();
                let unit = slab(&volume, &scene);
                let (_, worst) = off(&volume, &scene.with_opacity_unit(unit).unwrap(), 0.0);
                // So few voxels do not reach 1: points of the transfer function lie between entries of its table.
                assert!(worst < 3e-4, "{dims:?} of {kind}, {blend:?}: {worst}");
            }
        }
    }
}
