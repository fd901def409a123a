//! scratch
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Scene, Settings};
use slicestack::lanes::Level;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[1].parse()?;
    let bytes: usize = a[3].parse()?;
    let volume0 = Phantom::MarschnerLobb.volume(200)?;
        let st = volume0.statistics(); let (lo, hi) = (st.min, st.max);
        let c = volume0.grid().voxel_count();
        let vox = match bytes { 1 => slicestack::volume::Voxels::U8((0..c).map(|i| ((volume0.voxels().get(i) - lo) / (hi - lo) * 255.0) as u8).collect()), 2 => slicestack::volume::Voxels::U16((0..c).map(|i| ((volume0.voxels().get(i) - lo) / (hi - lo) * 65535.0) as u16).collect()), _ => volume0.voxels().clone() };
        let m = match bytes { 1 => 255.0, 2 => 65535.0, _ => hi - lo };
        let volume = slicestack::Volume::new(volume0.grid().clone(), vox)?.with_rescale(if bytes == 4 {1.0} else {(hi - lo) / m}, if bytes == 4 {0.0} else {lo})?;
    let scene = Scene::new(Phantom::MarschnerLobb.default_transfer()).with_terminate(0.0)?;
    let mut r = Renderer::new(&volume, Settings{threads:Some(1), level:Level::from_name(&a[2]), ..Default::default()});
    let mut f = 0;
    for _ in 0..n { f += r.render(&scene)?.1.fetches; }
    println!("{}", f);
    Ok(())
}
