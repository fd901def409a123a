//! The first local maximum of rays, from its definition.

use super::oracle::Oracle;
use glam::DVec3;
use slicestack::scene::{Blend, Camera, Filter, Method, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Scene, Volume};

/// The first maximum at or above `threshold` of a row: of its runs of equal values, the first with smaller values, or the row's end, on both
/// sides. Without one, the largest value.
fn first_maximum(row: &[u8], threshold: f64) -> u8 {
    let mut first = 0;
    while first < row.len() {
        let last = (first..row.len()).take_while(|&i| row[i] == row[first]).last().unwrap();
        let rises = first == 0 || row[first - 1] < row[first];
        let falls = last + 1 == row.len() || row[last + 1] < row[last];
        if rises && falls && f64::from(row[first]) >= threshold {
            return row[first];
        }
        first = last + 1;
    }
    row.iter().copied().max().unwrap()
}

#[test]
fn the_definition_itself() {
    assert_eq!(first_maximum(&[1, 3, 2, 9], 2.0), 3);
    assert_eq!(first_maximum(&[1, 3, 3, 2, 9], 3.0), 3);
    assert_eq!(first_maximum(&[1, 3, 3, 4, 1], 2.0), 4);
    assert_eq!(first_maximum(&[5, 4, 9], 5.0), 5);
    assert_eq!(first_maximum(&[1, 2, 3], 2.0), 3);
    assert_eq!(first_maximum(&[3, 3, 3], 3.0), 3);
    assert_eq!(first_maximum(&[1, 3, 2], 4.0), 3);
}

/// Rows of small numbers: monotone, with plateaus, at random; thresholds are hit exactly.
#[test]
fn pictures_show_the_first_maximum_of_every_ray() {
    let dims = [16usize, 8, 12];
    let mut seed = 7u64;
    let mut next = |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    let mut voxels = vec![0u8; dims.iter().product()];
    for column in 0..dims[0] * dims[1] {
        let mut row: Vec<u8> = (0..dims[2]).map(|_| next(7) as u8).collect();
        match next(5) {
            0 => row.sort_unstable(),
            1 => row.sort_unstable_by(|a, b| b.cmp(a)),
            2 => (1..row.len()).for_each(|i| row[i] = if next(2) == 0 { row[i - 1] } else { row[i] }),
            _ => {}
        }
        for (k, value) in row.into_iter().enumerate() {
            voxels[k * dims[0] * dims[1] + column] = value;
        }
    }
    let volume = Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), Voxels::U8(voxels.into())).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.0, 1.0, 0.2]), (6.0, [1.0, 0.0, 0.4])], vec![(0.0, 1.0)]).unwrap();
    for side in [-1.0, 1.0] {
        let center = volume.grid().center();
        let placement = Placement::LookAt { eye: center + DVec3::Z * (40.0 * side), target: center, up: DVec3::Y };
        let camera = Camera::new(placement, Projection::Orthographic { height: Some(8.0) }).unwrap();
        for filter in [Filter::Nearest, Filter::Linear] {
            // None, some and all values count; 2.5 lies between two.
            for threshold in [-1.0, 1.0, 2.5, 3.0, 6.0, 7.0] {
                let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(16, 8).unwrap();
                let scene = scene.with_slices(Slicing::Count(12)).unwrap().with_blend(Blend::Lmip { threshold }).unwrap();
                let scene = scene.with_method(Method::default().with_filter(filter)).unwrap();
                let (picture, _) = super::render(&volume, &scene);
                let oracle = Oracle::new(&volume, &scene);
                for (x, y) in (0..8).flat_map(|y| (0..16).map(move |x| (x, y))) {
                    let voxel = |at: DVec3| volume.value([0, 1, 2].map(|axis: usize| at[axis].round() as usize)) as u8;
                    let row: Vec<u8> = oracle.fragments(x, y).iter().map(|f| voxel(f.index)).collect();
                    assert_eq!(row.len(), 12);
                    let want = transfer.eval(f64::from(first_maximum(&row, threshold)));
                    let got = picture.pixel(x, y);
                    let off = (0..3).map(|c| (f64::from(got[c]) - want.rgb[c]).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-6, "{row:?} at {threshold}, {filter:?}: {got:?}, not {want:?}");
                }
            }
        }
    }
}
