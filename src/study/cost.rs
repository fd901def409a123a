//! Cost against the size of the picture and of the volume.

use super::clock::Clock;
use super::record::Cost;
use crate::scene::{MAX_SIDE, Method, Slicing};
use crate::volume::{BoxConvention, Grid, Voxel, Voxels, with_voxels};
use crate::{Renderer, Result, Scene, Settings, Volume};
use glam::{DMat3, DVec3};

/// Factors on the sides of picture and volume.
const FACTORS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Largest volume made for this, in bytes of voxels.
const MOST_BYTES: f64 = 256.0 * 1024.0 * 1024.0;

/// Frames of the default method at `slices` slices, at other sizes of picture and volume, until `part` of the budget is gone.
///
/// # Errors
/// As [`Renderer::render`].
pub(super) fn measure(volume: &Volume, scene: &Scene, settings: &Settings, slices: u64, clock: &Clock, part: f64) -> Result<Vec<Cost>> {
    let settings = Settings { progress: clock.progress(), ..settings.clone() };
    let unit = scene.transfer().opacity_length(volume.grid());
    let scene = scene.clone().with_method(Method::default())?.with_slices(Slicing::Count(slices))?.with_opacity_unit(unit)?;
    let mut list = Vec::new();
    let middle = clock.gone() + 0.5 * clock.left(part);
    let mut renderer = Renderer::new(volume, settings.clone());
    let (width, height) = scene.size();
    for factor in FACTORS {
        let side = |n: u32| (f64::from(n) * factor).round().max(1.0);
        let (w, h) = (side(width), side(height));
        let expected = list.last().map_or(0.0, |c: &Cost| 4.0 * c.seconds);
        if w.max(h) > f64::from(MAX_SIDE) || (factor > 1.0 && clock.gone() + 3.0 * expected > middle) {
            continue;
        }
        let scene = scene.clone().with_size(w as u32, h as u32)?;
        list.push(timed("image", volume, &mut renderer, &scene, middle, clock)?);
    }
    drop(renderer);
    let end = clock.gone() + clock.left(part);
    for factor in FACTORS {
        let bytes = volume.voxels().bytes() as f64 * factor * factor * factor;
        let expected = list.last().map_or(0.0, |c| 8.0 * (c.prepare_seconds + c.seconds));
        if bytes > MOST_BYTES || (factor > 1.0 && clock.gone() + expected > end) {
            continue;
        }
        let other = resampled(volume, factor)?;
        let mut renderer = Renderer::new(&other, settings.clone());
        list.push(timed("volume", &other, &mut renderer, &scene, end, clock)?);
    }
    Ok(list)
}

/// The shortest of some frames.
fn timed(of: &str, volume: &Volume, renderer: &mut Renderer, scene: &Scene, end: f64, clock: &Clock) -> Result<Cost> {
    let (_, first) = renderer.render(scene)?;
    let mut seconds = first.render_seconds;
    for run in 0..9 {
        if run >= 2 && clock.gone() + seconds > end {
            break;
        }
        seconds = seconds.min(renderer.render(scene)?.1.render_seconds);
    }
    let ((width, height), dimensions) = (scene.size(), volume.grid().dims());
    let size = if of == "image" { u64::from(width) * u64::from(height) } else { volume.grid().voxel_count() as u64 };
    let prepare_seconds = first.prepare_seconds;
    Ok(Cost { of: of.into(), image: [width, height], dimensions, size, seconds, prepare_seconds, fetches: first.fetches })
}

/// The volume in the same box with its sides' voxels times `factor`, each the nearest of the old ones.
fn resampled(volume: &Volume, factor: f64) -> Result<Volume> {
    let old = volume.grid();
    let dims = old.dims().map(|n| ((n as f64 * factor).round() as usize).max(1));
    let ratio: [f64; 3] = std::array::from_fn(|i| {
        let (n, m) = (old.dims()[i] as f64, dims[i] as f64);
        if old.convention() == BoxConvention::Nodes && m > 1.0 { (n - 1.0).max(1.0) / (m - 1.0) } else { n / m }
    });
    // Where the new voxel (0,0,0) lies among the old ones.
    let shift = DVec3::from_array(ratio.map(|r| if old.convention() == BoxConvention::Nodes { 0.0 } else { 0.5 * r - 0.5 }));
    let steps = old.index_to_world().matrix3 * DMat3::from_diagonal(DVec3::from_array(ratio));
    let grid =
        Grid::new(dims, old.index_to_world().transform_point3(shift), steps)?.with_convention(old.convention()).with_space(old.space());
    let pick: [Vec<usize>; 3] = std::array::from_fn(|axis| {
        let nearest = |i: usize| ((i as f64 * ratio[axis] + shift[axis]).round().max(0.0) as usize).min(old.dims()[axis] - 1);
        (0..dims[axis]).map(nearest).collect()
    });
    let voxels = with_voxels!(volume.voxels(), v => gather(v, old.dims(), &pick));
    let (slope, intercept) = volume.rescale();
    let other = Volume::new(grid, voxels)?.with_rescale(slope, intercept)?;
    other.with_labels_of(volume, |places| Ok(with_voxels!(places, v => gather(v, old.dims(), &pick))))
}

fn gather<T: Voxel>(voxels: &[T], [nx, ny, _]: [usize; 3], [x, y, z]: &[Vec<usize>; 3]) -> Voxels {
    let mut values = Vec::with_capacity(x.len() * y.len() * z.len());
    for k in z {
        for j in y {
            let row = (k * ny + j) * nx;
            values.extend(x.iter().map(|i| voxels[row + i]));
        }
    }
    T::wrap(values.into())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn other_sizes_fill_the_same_box() {
        for convention in [BoxConvention::Cells, BoxConvention::Nodes] {
            let steps = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.0, -2.0, 0.0), DVec3::new(0.0, 0.3, 1.0));
            let grid = Grid::new([8, 4, 6], DVec3::new(5.0, -3.0, 1.0), steps).unwrap().with_convention(convention);
            let voxels = Voxels::U8((0..192).map(|i| (i % 8) as u8).collect());
            let volume = Volume::new(grid.clone(), voxels).unwrap().with_rescale(2.0, 1.0).unwrap();
            let labels = Volume::new(grid.clone(), Voxels::U8((0..192).map(|i| (i % 8 / 4) as u8).collect())).unwrap();
            let volume = volume.with_labels(&labels).unwrap();
            for factor in [0.5, 2.0] {
                let other = resampled(&volume, factor).unwrap();
                assert_eq!(other.grid().dims(), grid.dims().map(|n| (n as f64 * factor) as usize));
                for (a, b) in other.grid().corners().iter().zip(grid.corners()) {
                    assert!(a.distance(b) < 1e-12, "{convention:?} {factor}: {a} {b}");
                }
                let [x, y, z] = other.grid().dims();
                let map = other.labels().unwrap();
                assert!((0..x).all(|i| map.label(i) == i64::from(i >= x / 2)));
                assert!((0..x).all(|i| (other.value([i, y / 2, z - 1]) - (1.0 + 2.0 * (i as f64 / factor).floor())).abs() <= 2.0));
            }
        }
    }
}
