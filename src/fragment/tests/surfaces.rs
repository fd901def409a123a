//! The twin of level surfaces, with colours as they are and hits at the slice behind a crossing.

use super::super::pair::BEHIND;
use super::*;
use crate::proxy::Stack;
use crate::scene::{Hit, LevelSurface, Scene, TransferFunction};
use crate::volume::{Grid, Volume};

/// Every level between the values at both ends of a piece is crossed, in the order of the values. Each surface adds its colour, times its opacity
/// and what those before let through; nothing is crossed where a value is NaN or the pixel lets nothing through.
#[test]
pub(super) fn surfaces() {
    let mut n = Numbers::new(93);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let mut frame = frame(&none, &mut n);
    let volume = Volume::new(Grid::with_spacing([2; 3], [1.0; 3]).unwrap(), Voxels::zeros(VoxelType::F32, 8)).unwrap();
    let levels = [(250.0, [0.9, 0.1, 0.4], 0.25), (100.0, [0.2, 0.7, 0.3], 1.0), (40.0, [0.5, 0.6, 0.9], 0.5)];
    let scene = Scene::new(TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap())
        .with_levels(levels.iter().map(|&(v, c, a)| LevelSurface::new(v, Some(c), a).unwrap()).collect())
        .unwrap()
        .with_hit(Hit::FirstSample)
        .with_flat_surfaces(true);
    let view = scene.camera().resolve(volume.grid(), 8, 8).unwrap();
    let stack = Stack::new(volume.grid(), &view, &[], 12);
    frame.surfaces = Some(Box::new(SurfaceFrame::new(&scene.surfaces().unwrap(), &scene, &volume, &stack, |v| v)));
    let mut found = [0; 4];
    for round in 0..300 {
        let mut before = batch(&mut n);
        before.pixels.alive = n.bits();
        if round % 5 == 0 {
            before.slice = BEHIND;
        }
        for i in 0..BATCH {
            before.pixels.transmittance[i] = [0.0, 0.3, 1.0, 1.0][n.bits() as usize % 4];
            before.pixels.color.iter_mut().for_each(|c| c[i] *= 0.002);
            match n.bits() % 12 {
                0 => before.sample.value[i] = f32::NAN,
                1 => before.pixels.previous[0][i] = f32::INFINITY,
                2 => before.sample.value[i] = 100.0,
                _ => {}
            }
        }
        let sets = [Part::Sum, Part::Transmittance, Part::Alive, Part::Previous];
        run::<BlendSurfaces>(&frame, &before, &sets, |after, level| {
            for i in 0..BATCH {
                let p = &before.pixels;
                let front = if before.slice == p.first[i] { p.entry[i] } else { p.previous[0][i] };
                let back = before.sample.value[i];
                let (mut sum, mut left) = (p.color.map(|c| f64::from(c[i])), f64::from(p.transmittance[i]));
                let takes = listed(before.rows, i) && bit(before.mask, i) && left > 0.0 && front.is_finite() && back.is_finite();
                let mut met: Vec<_> = levels.iter().filter(|l| takes && (f64::from(front) >= l.0) != (f64::from(back) >= l.0)).collect();
                met.sort_by(|a, b| a.0.total_cmp(&b.0));
                if back < front {
                    met.reverse();
                }
                found[met.len()] += 1;
                for (_, color, opacity) in met.iter().copied() {
                    sum = std::array::from_fn(|c| sum[c] + left * opacity * color[c]);
                    left *= 1.0 - opacity;
                }
                (0..3).for_each(|c| assert_near(after.pixels.color[c][i], sum[c], 8.0 * ROUNDING * (sum[c] + 1.0), level, i));
                assert_near(after.pixels.transmittance[i], left, 4.0 * ROUNDING, level, i);
                if met.is_empty() {
                    assert_same(after.pixels.transmittance[i], p.transmittance[i], level, i);
                }
                let alive = if listed(before.rows, i) { left >= 0.01 && p.last[i] > before.slice } else { bit(p.alive, i) };
                assert_eq!(bit(after.pixels.alive, i), alive, "at {level}, fragment {i}");
                if listed(before.rows, i) {
                    assert_same(after.pixels.previous[0][i], back, level, i);
                }
            }
        });
    }
    assert!(found.iter().all(|&count| count > 300), "{found:?}");
}
