//! What each kind of hit of level surfaces costs, and how far its hits lie from the exact crossings.

use super::clock::Clock;
use super::precision::{sampled, terminate};
use super::record::HitKind;
use crate::picture::{Aov, Plane};
use crate::proxy::Stack;
use crate::reference::metrics::{self, Displayed};
use crate::reference::{Region, SurfaceTracer, image};
use crate::scene::{Blend, Hit, MAX_SLICES, Method, Slicing};
use crate::{Renderer, Result, Scene, Volume};
use rayon::prelude::*;

/// The kinds, under the names that scene files give them.
const KINDS: [(&str, Hit); 2] = [("refined", Hit::Refined), ("first-sample", Hit::FirstSample)];
/// Rows and columns that a picture's reference has at most.
const SIDE: u32 = 40;
/// What hits may be apart beyond a slab and still be of the same surface, slabs: room for the stages' rounding.
const SLACK: f64 = 1e-3;

/// Pictures of the level surfaces of `scene` with each kind of hit, in a quarter, a half, once and twice of `slices` slices, against the
/// exact crossings of linearly interpolated values. Nothing where the scene draws no level surfaces. Frames are repeated until `part` of the
/// budget is gone.
///
/// # Errors
/// As [`Renderer::render_with`] and [`image`].
pub(super) fn measure(
    volume: &Volume,
    renderer: &mut Renderer,
    scene: &Scene,
    slices: u64,
    clock: &Clock,
    part: f64,
) -> Result<Vec<HitKind>> {
    if scene.blend() != Blend::Surfaces {
        return Ok(Vec::new());
    }
    let scene = scene.clone().with_method(Method::default())?;
    let (width, height) = scene.size();
    let region = Region::every(&scene, width.max(height).div_ceil(SIDE));
    let truth = image(&scene, volume, region)?;
    let shown = Displayed::over_black(truth.size().0, truth.pixels())?;
    let tracer = SurfaceTracer::new(&scene, volume)?;
    let places: Vec<(u32, u32)> = (0..truth.pixels().len()).map(|i| truth.place(i)).collect();
    let exact: Vec<Option<f64>> = places.par_iter().map(|&(x, y)| tracer.crossings(x, y).first().map(|c| c.depth)).collect();
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let (mut list, mut scenes) = (Vec::new(), Vec::new());
    for slices in counts(slices) {
        let slicing = Slicing::Count(slices);
        let scene = scene.clone().with_slices(slicing)?.with_terminate(terminate(scene.terminate(), slicing))?;
        let slab = Stack::new(volume.grid(), &view, scene.clip_planes(), slices).spacing;
        for (kind, hit) in KINDS {
            let scene = scene.clone().with_hit(hit);
            let (picture, _, planes) = renderer.render_with(&scene, &[Aov::Depth])?;
            let found = metrics::difference(&shown, &sampled(&picture, region.step)?)?;
            let pairs = places.iter().zip(&exact).map(|(&place, &exact)| (planes.first().and_then(|p| met_at(p, place)), exact));
            let distances = Distances::new(pairs, slab);
            list.push(HitKind {
                kind: kind.into(),
                slices,
                seconds: renderer.render(&scene)?.1.render_seconds,
                rms: found.rms,
                max: found.max,
                reference_pixels: places.len(),
                met: distances.met,
                elsewhere: distances.elsewhere,
                mean_distance: (distances.met > 0).then(|| distances.sum / distances.met as f64),
                max_distance: (distances.met > 0).then_some(distances.max),
            });
            scenes.push(scene);
        }
    }
    clock.shortest(part, renderer, scenes.iter().zip(list.iter_mut().map(|row| &mut row.seconds)).collect())?;
    Ok(list)
}

/// The slice counts compared for a scene of `slices`: rising, none twice.
fn counts(slices: u64) -> Vec<u64> {
    let mut list = [slices / 4, slices / 2, slices, slices.saturating_mul(2)].map(|n| n.clamp(1, MAX_SLICES)).to_vec();
    list.dedup();
    list
}

/// The depth at which a pixel's ray meets its nearest surface.
fn met_at(depths: &Plane, (x, y): (u32, u32)) -> Option<f64> {
    depths.pixel(x, y).first().map(|&d| f64::from(d)).filter(|d| d.is_finite())
}

/// How far hits lie from exact crossings.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Distances {
    met: usize,
    elsewhere: usize,
    /// Of those that met, in slabs.
    sum: f64,
    max: f64,
}

impl Distances {
    /// For pairs of depths, of a picture's nearest hit and of the exact nearest crossing, and slabs of thickness `slab`.
    fn new(pairs: impl Iterator<Item = (Option<f64>, Option<f64>)>, slab: f64) -> Self {
        let mut all = Self::default();
        for pair in pairs {
            match pair {
                (None, None) => {}
                (Some(hit), Some(exact)) => {
                    // Depths come as f32.
                    let rounding = f64::from(f32::EPSILON) * exact.abs() / slab;
                    let distance = (hit - exact).abs() / slab;
                    if distance > 1.0 + SLACK + rounding {
                        all.elsewhere += 1;
                    } else {
                        all.met += 1;
                        all.sum += distance;
                        all.max = all.max.max(distance);
                    }
                }
                _ => all.elsewhere += 1,
            }
        }
        all
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::Settings;
    use crate::scene::LevelSurface;
    use crate::volume::phantom::Phantom;
    use crate::volume::{Grid, Voxels};
    use glam::DVec3;

    #[test]
    fn counts_rise_and_none_comes_twice() {
        assert_eq!(counts(64), [16, 32, 64, 128]);
        assert_eq!(counts(1), [1, 2]);
        assert_eq!(counts(3), [1, 3, 6]);
        assert_eq!(counts(MAX_SLICES), [MAX_SLICES / 4, MAX_SLICES / 2, MAX_SLICES]);
    }

    #[test]
    fn distances_are_in_slabs_and_other_surfaces_count_apart() {
        let pairs = [
            (Some(10.5), Some(10.0)),
            (Some(10.0), Some(11.5)),
            (Some(14.0), Some(10.0)),
            (None, Some(1.0)),
            (Some(1.0), None),
            (None, None),
        ];
        let found = Distances::new(pairs.into_iter(), 2.0);
        assert_eq!(found, Distances { met: 2, elsewhere: 3, sum: 1.0, max: 0.75 });
    }

    fn rows(scene: &Scene, volume: &Volume) -> Vec<HitKind> {
        let mut renderer = Renderer::new(volume, Settings::default());
        measure(volume, &mut renderer, scene, 128, &Clock::new(0.01, None), 0.0).unwrap()
    }

    #[test]
    fn refined_hits_are_near_the_crossings_and_first_samples_half_a_slab_behind() {
        let n = 24;
        let place = |i: usize| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
        // How far inside a ball a voxel is. The ball is off the middle, so that no pixel's ray only just grazes it.
        let voxels = (0..n * n * n).map(|i| (8.0 - place(i).distance(DVec3::new(11.2, 11.9, 11.6))) as f32).collect();
        let volume = Volume::new(Grid::with_spacing([n; 3], [1.0; 3]).unwrap(), Voxels::F32(voxels)).unwrap();
        let scene = Scene::new(Phantom::MarschnerLobb.default_transfer(n)).with_size(40, 32).unwrap();
        assert!(rows(&scene, &volume).is_empty());
        // Both kinds are drawn, whichever the scene itself asks for.
        let scene =
            scene.with_levels(vec![LevelSurface::new(0.0, Some([0.9, 0.4, 0.3]), 1.0).unwrap()]).unwrap().with_hit(Hit::FirstSample);
        let found = rows(&scene, &volume);
        assert_eq!(found.iter().map(|r| r.slices).collect::<Vec<_>>(), [32, 32, 64, 64, 128, 128, 256, 256]);
        for pair in found.chunks(2) {
            let [refined, first] = pair else { panic!("{pair:?}") };
            assert_eq!((refined.kind.as_str(), first.kind.as_str()), ("refined", "first-sample"));
            assert!(refined.seconds > 0.0 && first.seconds > 0.0);
            assert!(refined.rms < 1e-3 * first.rms, "{refined:?} {first:?}");
            let (near, far) = (refined.mean_distance.unwrap(), first.mean_distance.unwrap());
            assert!(near < 1e-3 && (0.4..0.6).contains(&far), "{refined:?} {first:?}");
            assert!(first.max_distance.unwrap() > 0.8, "{first:?}");
            assert!(refined.met > 150 && refined.elsewhere == 0 && first.elsewhere == 0, "{refined:?} {first:?}");
        }
        // Of first order: eight times as many slices.
        let fell = found[1].rms / found[7].rms;
        assert!((5.0..13.0).contains(&fell), "{fell}");
    }
}
