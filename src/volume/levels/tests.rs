use super::*;
use crate::volume::phantom::Phantom;
use glam::DVec3;

/// A volume of `dims` whose voxels tell where they are.
fn told(dims: [usize; 3], spacing: [f64; 3]) -> Volume {
    let [nx, ny, nz] = dims;
    let mut values = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            values.extend((0..nx).map(|x| ((x * 7 + y * 131 + z * 1009) % 60_000) as u16));
        }
    }
    Volume::new(Grid::with_spacing(dims, spacing).unwrap(), values.into()).unwrap()
}

#[test]
fn every_voxel_of_every_level_is_the_one_at_its_place() {
    let volume = told([300, 41, 70], [1.0, 1.0, 2.0]).with_rescale(2.0, -5.0).unwrap();
    let levels = Levels::of_volume(&volume).unwrap();
    assert_eq!(levels.levels()[0].grid(), volume.grid());
    assert!(levels.levels().len() >= 4);
    for (l, level) in levels.levels().iter().enumerate() {
        let dims = level.grid().dims();
        let part = levels.part(l, [0; 3], dims).unwrap();
        assert_eq!(part.rescale(), volume.rescale());
        for at in [[0; 3], dims.map(|n| n / 2), dims.map(|n| n - 1), [dims[0] - 1, 0, dims[2] / 3]] {
            let world = level.grid().index_to_world().transform_point3(DVec3::from_array(at.map(|n| n as f64)));
            let whole = volume.grid().world_to_index().transform_point3(world);
            let near = [0, 1, 2].map(|axis| whole[axis].round());
            assert!((0..3).all(|axis| (whole[axis] - near[axis]).abs() < 1e-9), "level {l} voxel {at:?} lies at {whole}");
            assert_eq!(part.value(at), volume.value(near.map(|n| n as usize)), "level {l} voxel {at:?}");
        }
    }
    // Slices twice as thick are left alone until the others have caught up.
    assert_eq!(levels.levels()[1].grid().spacing(), [2.0; 3]);
    assert_eq!(levels.levels()[2].grid().spacing(), [4.0; 3]);
}

#[test]
fn a_part_is_cut_out_of_the_whole_level() {
    let volume = told([300, 41, 70], [1.0, 2.0, 1.0]);
    let levels = Levels::of_volume(&volume).unwrap();
    for l in 0..3 {
        let dims = levels.levels()[l].grid().dims();
        let whole = levels.part(l, [0; 3], dims).unwrap();
        let first = dims.map(|n| n / 3);
        let size = dims.map(|n| n - n / 3 - n / 7);
        let part = levels.part(l, first, size).unwrap();
        let to_world = |v: &Volume, at: [usize; 3]| v.grid().index_to_world().transform_point3(DVec3::from_array(at.map(|n| n as f64)));
        for at in [[0; 3], size.map(|n| n - 1), size.map(|n| n / 2)] {
            let there = [0, 1, 2].map(|axis| first[axis] + at[axis]);
            assert_eq!(part.value(at), whole.value(there));
            assert!(to_world(&part, at).abs_diff_eq(to_world(&whole, there), 1e-9));
        }
    }
    let refused = |first, size| levels.part(0, first, size).unwrap_err().to_string();
    assert!(refused([0; 3], [301, 1, 1]).contains("level 0 has [300, 41, 70]"));
    assert!(refused([usize::MAX, 0, 0], [2, 1, 1]).contains("level 0 has"));
    assert!(levels.part(99, [0; 3], [1; 3]).unwrap_err().to_string().contains("level 99"));
}

#[test]
fn an_overview_is_small_and_covers_the_box() {
    let volume = Phantom::SheppLogan.volume(100).unwrap();
    let levels = Levels::of_volume(&volume).unwrap();
    let overview = levels.overview(30_000).unwrap();
    assert!(overview.grid().voxel_count() <= 30_000);
    assert!(overview.grid().voxel_count() > 3_000);
    let radius = |v: &Volume| v.grid().radius();
    assert!((radius(&overview) / radius(&volume) - 1.0).abs() < 0.05);
}

#[test]
fn what_has_no_levels_is_refused() {
    let grid = Grid::with_spacing([2; 3], [1.0; 3]).unwrap();
    let colors = Volume::with_colors(grid.clone(), vec![0u8; 32].into()).unwrap();
    assert!(Levels::of_volume(&colors).unwrap_err().to_string().contains("neither colours nor labels"));
    let labels = Volume::new(grid, vec![0u8; 8].into()).unwrap().with_segments(Vec::new()).unwrap();
    assert!(Levels::of_volume(&labels).is_err());
}

#[test]
fn axes_of_one_voxel_stay() {
    let levels = Levels::of_volume(&told([1, 200, 1], [1.0; 3])).unwrap();
    assert!(levels.levels().iter().all(|level| level.grid().dims()[0] == 1 && level.grid().dims()[2] == 1));
    assert!(levels.levels().last().unwrap().grid().dims()[1] <= COARSEST);
}

#[cfg(feature = "formats")]
#[test]
fn voxels_of_a_file_are_those_of_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nrrd");
    let volume = told([300, 41, 70], [1.0; 3]);
    crate::volume::io::write(&volume, &path, &crate::volume::io::Writing::new()).unwrap();
    let mapped = crate::volume::io::read(&path, &crate::Limits::new().map_bytes(0)).unwrap();
    assert!(mapped.voxels().is_mapped());
    let (a, b) = (Levels::of_volume(&volume).unwrap(), Levels::of_volume(&mapped).unwrap());
    for l in 0..a.levels().len() {
        let dims = a.levels()[l].grid().dims();
        assert_eq!(a.part(l, [0; 3], dims).unwrap().voxels(), b.part(l, [0; 3], dims).unwrap().voxels(), "level {l}");
    }
}
