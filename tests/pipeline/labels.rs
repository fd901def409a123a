//! Labels of any size keep their own colours where the nearest voxel is looked up.

use glam::DVec3;
use slicestack::scene::{Blend, Camera, Classification, Filter, Method, Order, Placement, Projection, Slicing, Straight, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Level, Renderer, Scene, Settings, Volume};

/// Two layers of labels: each pixel's ray meets label i + 1 first, then label i.
fn layers<T: Copy>(labels: &[T]) -> Vec<T> {
    let n = labels.len();
    (0..4 * n).map(|i| labels[(i % n + i / (2 * n)) % n]).collect()
}

/// A step between any two labels that follow each other, each label with a colour of its own.
fn colors(labels: &[f64]) -> TransferFunction {
    let mut sorted = labels.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let (mut color, mut opacity) = (Vec::new(), Vec::new());
    for (i, pair) in sorted.windows(2).enumerate() {
        let at = 0.5 * pair[0] + 0.5 * pair[1];
        let of = |i: usize| [(i * 37 % 101) as f64 / 101.0, (i * 61 % 89) as f64 / 89.0, (i * 17 % 71) as f64 / 71.0];
        let a = |i: usize| if i % 3 == 1 { 0.0 } else { 0.2 + 0.6 * (i * 7 % 13) as f64 / 13.0 };
        // Labels side by side in f64 have no number between them: the step is at the upper one.
        color.extend([(at, of(i)), (at, of(i + 1))]);
        opacity.extend([(at, a(i)), (at, a(i + 1))]);
    }
    TransferFunction::new(color, opacity).unwrap()
}

/// Holds the picture of two layers of labels against the transfer function itself.
fn hold(voxels: Voxels, labels: &[f64], rescale: (f64, f64), name: &str) {
    let n = labels.len();
    let values: Vec<f64> = labels.iter().map(|l| rescale.0 * l + rescale.1).collect();
    let grid = Grid::with_spacing([n, 2, 2], [1.0; 3]).unwrap();
    let volume = Volume::new(grid.clone(), voxels).unwrap().with_rescale(rescale.0, rescale.1).unwrap();
    let transfer = colors(&values);
    let center = grid.center();
    let place = Placement::LookAt { eye: center.with_z(50.0), target: center, up: DVec3::Y };
    let camera = Camera::new(place, Projection::Orthographic { height: Some(2.0) }).unwrap();
    let middle = values[n / 2];
    for blend in [Blend::Over, Blend::Add, Blend::Mip, Blend::Min, Blend::Lmip { threshold: middle }] {
        for (classification, order) in [(Classification::Post, Order::FrontToBack), (Classification::Pre, Order::BackToFront)] {
            let method = Method::default().with_classification(classification).with_filter(Filter::Nearest);
            let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(n as u32, 2).unwrap();
            let scene = scene.with_slices(Slicing::Count(2)).unwrap().with_terminate(0.0).unwrap().with_opacity_unit(1.0).unwrap();
            let Ok(scene) = scene.with_blend(blend).and_then(|s| s.with_order(order).with_method(method)) else { continue };
            for level in Level::available() {
                let picture = Renderer::new(&volume, Settings::new().level(level)).render(&scene).unwrap().0;
                for x in 0..n {
                    let (front, back) = (values[(x + 1) % n], values[x]);
                    let of = |value: f64| {
                        let Straight { rgb, alpha } = transfer.eval(value);
                        [rgb[0] * alpha, rgb[1] * alpha, rgb[2] * alpha, alpha]
                    };
                    let (f, b) = (of(front), of(back));
                    let want: [f64; 4] = std::array::from_fn(|c| match blend {
                        Blend::Over => f[c] + (1.0 - f[3]) * b[c],
                        Blend::Add => (f[c] + b[c]).min(1.0),
                        Blend::Min => of(front.min(back))[c],
                        _ => of(front.max(back))[c],
                    });
                    let got = picture.pixel(x as u32, 1);
                    let apart = (0..4).map(|c| (f64::from(got[c]) - want[c]).abs()).fold(0.0, f64::max);
                    assert!(
                        apart < 1e-5,
                        "{name}, {blend:?}, {classification:?}, {}, {back} behind {front}: {got:?} not {want:?}",
                        level.name()
                    );
                }
            }
        }
    }
}

#[test]
fn labels_of_any_size_have_their_own_colors() {
    let u: [u32; 9] = [0, 1, 16_777_216, 16_777_217, 16_777_218, 16_777_219, 4_294_967_293, 4_294_967_294, 4_294_967_295];
    hold(Voxels::U32(layers(&u).into()), &u.map(f64::from), (1.0, 0.0), "u32");
    hold(Voxels::U32(layers(&u).into()), &u.map(f64::from), (-2.0, 7.0), "u32, turned around");
    let i: [i32; 9] = [i32::MIN, i32::MIN + 1, -16_777_218, -16_777_217, 0, 1, 16_777_217, i32::MAX - 1, i32::MAX];
    hold(Voxels::I32(layers(&i).into()), &i.map(f64::from), (1.0, 0.0), "i32");
    // Close together, far from 0.
    let near: [u32; 4] = [4_000_000_001, 4_000_000_002, 4_000_000_003, 4_000_000_004];
    hold(Voxels::U32(layers(&near).into()), &near.map(f64::from), (1.0, 0.0), "u32 near each other");
    let d = [-1e300, -1.0, 0.0, 1.0, 9_007_199_254_740_991.0, 9_007_199_254_740_992.0, 9_007_199_254_740_994.0, 1e300];
    hold(Voxels::F64(layers(&d).into()), &d, (1.0, 0.0), "f64");
    let fine = [1.0, 1.0 + 1e-12, 1.0 + 2e-12, 2.0];
    hold(Voxels::F64(layers(&fine).into()), &fine, (1.0, 0.0), "f64 side by side");
    let many: Vec<u16> = (0..200).map(|i| i * 327 + i % 2).collect();
    let values: Vec<f64> = many.iter().map(|&v| f64::from(v)).collect();
    hold(Voxels::U16(layers(&many).into()), &values, (1.0, 0.0), "u16");
}
