//! Scenes of volumes whose voxels are colours.

use super::{PARALLEL, Sample, WIDE, foggy, looked, scene};
use slicestack::scene::{Filter, FogDistance, FogMode, FogWeighting, Method, OpacityFrom, Order, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Scene, Volume};

const SIDE: usize = 20;

/// A ball of coloured shells in clear air: straight red, green, blue and alpha.
fn ball() -> impl Iterator<Item = [f64; 4]> {
    (0..SIDE * SIDE * SIDE).map(|i| {
        let [x, y, z] = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|v| v as f64 / (SIDE - 1) as f64 - 0.5);
        let r = (x * x + y * y + z * z).sqrt();
        let shell = 1.0 - ((r * 8.0) % 1.0 - 0.5).abs() * 2.0;
        let alpha = if r > 0.48 { 0.0 } else { 0.35 * shell };
        // Clear voxels have a colour too, which must not be seen.
        if r > 0.48 { [0.0, 1.0, 0.0, 0.0] } else { [0.5 + x, 0.5 - 0.8 * y, 0.5 + 0.9 * z, alpha] }
    })
}

fn volume(numbers: impl Into<Voxels>) -> Volume {
    Volume::with_colors(Grid::with_spacing([SIDE; 3], [1.0, 1.1, 0.9]).unwrap(), numbers.into()).unwrap()
}

fn bytes() -> Volume {
    volume(ball().flatten().map(|c| (c * 255.0).round() as u8).collect::<Vec<_>>())
}

/// The scene of colours whose opacity goes by `from`, through `opacity` unless that is alpha.
fn colors(scene: Scene, from: OpacityFrom, opacity: &[(f64, f64)]) -> Scene {
    let points = if from == OpacityFrom::Alpha { vec![(0.0, 0.0), (1.0, 1.0)] } else { opacity.to_vec() };
    scene.with_transfer(TransferFunction::new(vec![(0.0, [1.0; 3])], points).unwrap()).with_opacity_from(Some(from))
}

pub(super) fn samples(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let s = || looked(scene((48, 40), 50), 35.0, 25.0, 0.0, 1.2, PARALLEL);
    let near = || looked(scene((48, 40), 50), 35.0, 25.0, 0.0, 1.2, WIDE);
    let alpha = |s: Scene| colors(s, OpacityFrom::Alpha, &[]);
    add("colors-u8", bytes(), alpha(near()));
    let nearest = Method::default().with_filter(Filter::Nearest);
    let words = volume(ball().flatten().map(|c| (c * 65535.0).round() as u16).collect::<Vec<_>>());
    add("colors-u16-nearest", words, alpha(s()).with_method(nearest).unwrap().with_order(Order::BackToFront));
    let mut holes: Vec<f32> = ball().flatten().map(|c| c as f32).collect();
    holes.chunks_exact_mut(4).step_by(37).for_each(|c| c[3] = f32::NAN);
    holes.chunks_exact_mut(4).step_by(23).for_each(|c| (c[0], c[3]) = (3.0, 0.9));
    add("colors-f32-holes", volume(holes), alpha(s()));
    // Without alpha what is around the ball is black.
    let seen = ball().flat_map(|[r, g, b, a]| if a > 0.0 { [r, g, b, 1.0] } else { [0.0, 0.0, 0.0, 1.0] });
    let rgb = volume(seen.map(|c| (c * 255.0).round() as u8).collect::<Vec<_>>()).without_alpha().unwrap();
    add("rgb-luma", rgb.clone(), colors(near(), OpacityFrom::Luma, &[(0.35, 0.0), (0.6, 0.1), (0.9, 0.5)]));
    let fog = foggy(s(), FogMode::Exp { density: 0.02 }, FogDistance::Planar, FogWeighting::Alpha).with_linear_light(true).unwrap();
    add("rgb-maximum-fog-linear-light", rgb, colors(fog, OpacityFrom::Maximum, &[(0.6, 0.0), (0.95, 0.3)]));
}
