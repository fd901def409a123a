//! A frame takes little memory beside the voxels. Alone in its process: it measures the whole of it.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod peak;

use peak::peak;
use slicestack::scene::{Blend, Scene, Slicing, TransferFunction};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Renderer, Settings, Volume};

#[test]
fn a_frame_takes_little_beside_the_voxels() {
    const DIMS: [usize; 3] = [512, 512, 256];
    let bytes = DIMS.iter().product::<usize>();
    let before = peak();
    let voxels: Vec<u8> = (0..bytes).map(|i| (i >> 12) as u8 ^ i as u8).collect();
    let volume = Volume::new(Grid::with_spacing(DIMS, [1.0; 3]).unwrap(), Voxels::U8(voxels.into())).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.5; 3])], vec![(100.0, 0.0), (255.0, 0.3)]).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    for blend in [Blend::Over, Blend::Mip] {
        let scene = Scene::new(transfer.clone()).with_size(128, 128).unwrap().with_slices(Slicing::Count(64)).unwrap();
        let (picture, stats) = renderer.render(&scene.with_blend(blend).unwrap()).unwrap();
        assert!(stats.fetches > 100_000 && picture.pixel(64, 64)[3] > 0.1);
    }
    let grown = peak() - before;
    let most = bytes as u64 / 4 * 9 + (64 << 20);
    assert!(grown >= bytes as u64 && grown <= most, "{grown} bytes for {bytes} bytes of voxels, {most} allowed");
}
