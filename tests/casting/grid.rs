//! Rays along an axis, through the voxels of a row each: a classroom's loops, number by number.

use crate::{PARALLEL, drawn, numbers, plain, telling, with};
use slicestack::scene::{Algorithm, Blend, Camera, Hit, LevelSurface, Lighting, Order, Placement, Shading, Straight, TransferFunction};
use slicestack::volume::BoxConvention;
use slicestack::{Scene, Volume};

fn along(axis: usize, backwards: bool) -> Camera {
    Camera::new(Placement::Along { axis, backwards }, PARALLEL).unwrap()
}

/// A scene of `volume` with a pixel for each row of voxels.
fn fitted(scene: Scene, volume: &Volume, axis: usize, backwards: bool) -> Scene {
    let scene = with(&scene.with_camera(along(axis, backwards)), Algorithm::Grid);
    let (width, height) = scene.voxel_rows(volume).unwrap();
    scene.with_size(width, height).unwrap()
}

/// What each ray meets, written out: for a view along z a pixel's column is i and its row j, and k runs from 0 on; for y they are i and k; for x j and k.
/// From the other side rays run the other way, and columns too.
fn rows(volume: &Volume, axis: usize, backwards: bool, mut each: impl FnMut(&[f64])) {
    let [nx, ny, nz] = volume.grid().dims();
    let (columns, rows, deep) = [(ny, nz, nx), (nx, nz, ny), (nx, ny, nz)][axis];
    let mut values = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let column = if backwards { columns - 1 - column } else { column };
            values.clear();
            for k in 0..deep {
                let k = if backwards { deep - 1 - k } else { k };
                values.push(volume.value([[k, column, row], [column, k, row], [column, row, k]][axis]));
            }
            each(&values);
        }
    }
}

fn sides() -> impl Iterator<Item = (usize, bool)> {
    (0..3).flat_map(|axis| [(axis, false), (axis, true)])
}

fn check(name: &str, picture: &[[f32; 4]], want: &[[f32; 4]]) {
    assert_eq!(picture.len(), want.len(), "{name}");
    for (at, (have, want)) in picture.iter().zip(want).enumerate() {
        assert_eq!(have.map(f32::to_bits), want.map(f32::to_bits), "{name}, pixel {at}: {have:?} for {want:?}");
    }
    assert!(want.iter().filter(|p| p[3] > 0.1).count() > want.len() / 20, "{name}: hardly anything shows");
}

/// The transfer function of the classroom: skin, nothing, bone.
fn skin_and_bone(value: f64) -> ([f64; 3], f64) {
    if (-300.0..50.0).contains(&value) {
        ([1.0, 0.79, 0.6], 0.12)
    } else if (300.0..=4096.0).contains(&value) {
        ([1.0, 1.0, 1.0], 0.8)
    } else {
        ([0.0; 3], 0.0)
    }
}

/// The same as control points: two at one value make a step.
fn as_points(unit: f64) -> TransferFunction {
    let (skin, white) = ([1.0, 0.79, 0.6], [1.0; 3]);
    let color = vec![(300.0, skin), (300.0, white)];
    let opacity = vec![(-300.0, 0.0), (-300.0, 0.12), (50.0, 0.12), (50.0, 0.0), (300.0, 0.0), (300.0, 0.8)];
    TransferFunction::new(color, opacity).unwrap().with_unit(unit).unwrap()
}

/// Every exercise of the classroom on `volume`, whose values are in Hounsfield units.
fn exercises(volume: &Volume) {
    let volume = &volume.clone().with_convention(BoxConvention::Nodes);
    for (axis, backwards) in sides() {
        let name = |what: &str| format!("{what} along axis {axis}, backwards {backwards}");
        let unit = volume.grid().spacing()[axis];
        let scene = || plain(as_points(unit), 1, 1);

        // Is there a value above 400? White if there is.
        let mut want = Vec::new();
        rows(volume, axis, backwards, |values| {
            let mut white = 0.0;
            for &value in values {
                if value > 400.0 {
                    white = 1.0;
                }
            }
            want.push([white; 4]);
        });
        let surface = LevelSurface::new(401.0, Some([1.0; 3]), 1.0).unwrap();
        let bone = scene().with_levels(vec![surface]).unwrap().with_hit(Hit::FirstSample);
        let white = bone.clone().with_flat_surfaces(true);
        check(&name("white"), &drawn(volume, &fitted(white, volume, axis, backwards)), &want);

        // How far away is it? 1 - k/112 where the first value above 400 lies, k/255 for the other views.
        let mut want = Vec::new();
        rows(volume, axis, backwards, |values| {
            let first = values.iter().position(|&value| value > 400.0);
            let shade = first.map(|k| 1.0 - k as f64 / (values.len() - 1) as f64);
            want.push(shade.map_or([0.0; 4], |s| [s as f32, s as f32, s as f32, 1.0]));
        });
        let mut depth = Lighting::default();
        depth.shading = Shading::Depth;
        let cued = bone.with_lighting(Some(depth)).unwrap();
        check(&name("depth"), &drawn(volume, &fitted(cued, volume, axis, backwards)), &want);

        // Back to front: C = sigma L C + (1 - sigma) C_in.
        let mut want = Vec::new();
        rows(volume, axis, backwards, |values| {
            let (mut sum, mut left) = ([0.0; 3], 1.0);
            for &value in values.iter().rev() {
                let (color, sigma) = skin_and_bone(value);
                (0..3).for_each(|c| sum[c] = sigma * color[c] + (1.0 - sigma) * sum[c]);
                left *= 1.0 - sigma;
            }
            want.push([sum[0] as f32, sum[1] as f32, sum[2] as f32, 1.0 - left as f32]);
        });
        let back = fitted(scene().with_order(Order::BackToFront), volume, axis, backwards);
        check(&name("back to front"), &drawn(volume, &back), &want);

        // Front to back: C += T sigma L C, T *= 1 - sigma.
        let mut want = Vec::new();
        rows(volume, axis, backwards, |values| {
            let (mut sum, mut left) = ([0.0; 3], 1.0);
            for &value in values {
                let (color, sigma) = skin_and_bone(value);
                (0..3).for_each(|c| sum[c] += left * (sigma * color[c]));
                left *= 1.0 - sigma;
            }
            want.push([sum[0] as f32, sum[1] as f32, sum[2] as f32, 1.0 - left as f32]);
        });
        let front = fitted(scene(), volume, axis, backwards);
        check(&name("front to back"), &drawn(volume, &front), &want);
    }
}

/// A head of the same values: nothing around a skin around a skull.
fn small_head() -> Volume {
    let [nx, ny, nz] = [20, 17, 13];
    let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let values = (0..nx * ny * nz).map(|i| {
        let (x, y, z) = (at(i % nx, nx), at(i / nx % ny, ny), at(i / nx / ny, nz));
        let r = (x * x + 1.3 * y * y + z * z).sqrt();
        (if r > 0.9 {
            -1000.0
        } else if r > 0.75 {
            -100.0 + 40.0 * x
        } else if r > 0.4 {
            380.0 + 200.0 * z + 90.0 * x
        } else {
            120.0
        }) as i16
    });
    let grid = slicestack::volume::Grid::with_spacing([nx, ny, nz], [1.0, 1.0, -2.0]).unwrap();
    Volume::new(grid, slicestack::volume::Voxels::I16(values.collect::<Vec<_>>().into())).unwrap()
}

#[test]
fn loops_over_a_small_head_give_the_same_numbers() {
    exercises(&small_head());
}

#[test]
#[cfg(feature = "formats")]
fn loops_over_the_ct_head_give_the_same_numbers() {
    use slicestack::volume::VoxelType;
    use slicestack::volume::io::{Endian, RawSpec, read_raw};
    let root = std::env::var_os("SLICESTACK_DATA")
        .map_or_else(|| std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), std::path::PathBuf::from);
    let path = root.join("cthead/CThead_256x256x113_int16be.raw.gz");
    if !path.is_file() {
        eprintln!("data absent: {}", path.display());
        assert!(std::env::var_os("CI").is_none(), "data absent: {}", path.display());
        return;
    }
    let spec = RawSpec::new([256, 256, 113], VoxelType::I16).with_endian(Endian::Big).with_spacing([1.0, 1.0, -2.0]);
    let stored = read_raw(&path, &spec, &slicestack::Limits::default()).unwrap();
    let volume = stored.with_rescale(1.0, -1024.0).unwrap();
    assert_eq!(volume.grid().dims(), [256, 256, 113]);
    exercises(&volume);
}

#[test]
fn projections_are_those_of_the_values() {
    let volume = numbers([11, 8, 9]);
    let scene = |blend| plain(telling(), 1, 1).with_blend(blend).unwrap();
    let shown = |value: f64| {
        let Straight { rgb, alpha } = telling().eval(value);
        [rgb[0] * alpha, rgb[1] * alpha, rgb[2] * alpha, alpha].map(|x| x as f32)
    };
    type Of = fn(&[f64]) -> f64;
    let first_peak: Of = |values| {
        let peak = values.windows(2).find(|w| w[1] < w[0] && w[0] >= 30.0).map(|w| w[0]);
        peak.unwrap_or_else(|| values.iter().copied().fold(0.0, f64::max))
    };
    let cases: [(Blend, Of); 4] = [
        (Blend::Mip, |values| values.iter().copied().fold(0.0, f64::max)),
        (Blend::Min, |values| values.iter().copied().fold(f64::INFINITY, f64::min)),
        (Blend::Average, |values| values.iter().sum::<f64>() / values.len() as f64),
        (Blend::Lmip { threshold: 30.0 }, first_peak),
    ];
    for (blend, of) in cases {
        for (axis, backwards) in sides() {
            let mut want = Vec::new();
            rows(&volume, axis, backwards, |values| want.push(shown(of(values))));
            let have = drawn(&volume, &fitted(scene(blend), &volume, axis, backwards));
            assert!(crate::largest(&have, &want) < 1e-7, "{blend:?} along axis {axis}, backwards {backwards}");
        }
    }
}

#[test]
fn opacities_belong_to_the_distance_of_voxels() {
    let volume = numbers([6, 7, 5]);
    for (axis, spacing) in [1.0, 1.25, 0.75].into_iter().enumerate() {
        let scene = plain(telling().with_unit(0.5).unwrap(), 1, 1);
        let mut want = Vec::new();
        rows(&volume, axis, false, |values| {
            let left = values.iter().map(|&value| (1.0 - telling().eval(value).alpha).powf(spacing / 0.5)).product::<f64>();
            want.push((1.0 - left) as f32);
        });
        let have = drawn(&volume, &fitted(scene, &volume, axis, false));
        assert!(have.iter().zip(want).all(|(have, want)| (have[3] - want).abs() < 1e-6), "axis {axis}");
    }
}

#[test]
fn larger_pictures_show_each_voxel_as_a_rectangle() {
    let volume = numbers([6, 7, 5]);
    let small = drawn(&volume, &fitted(plain(telling(), 1, 1), &volume, 2, true));
    let large = drawn(&volume, &fitted(plain(telling(), 1, 1), &volume, 2, true).with_size(18, 14).unwrap());
    for (at, pixel) in large.iter().enumerate() {
        assert_eq!(*pixel, small[at / 18 / 2 * 6 + at % 18 / 3], "pixel {at}");
    }
}

#[test]
fn voxels_beyond_clip_planes_and_holes_are_not_there() {
    let volume = numbers([6, 7, 5]);
    let plane = slicestack::scene::ClipPlane::new(glam::DVec3::X, 2.5).unwrap();
    let scene = fitted(plain(telling(), 1, 1), &volume, 2, false).with_clip_planes(vec![plane]).unwrap();
    let (cut, whole) = (drawn(&volume, &scene), drawn(&volume, &fitted(plain(telling(), 1, 1), &volume, 2, false)));
    for (at, (cut, whole)) in cut.iter().zip(&whole).enumerate() {
        assert_eq!(cut, if at % 6 < 3 { &[0.0; 4] } else { whole }, "pixel {at}");
    }
}
