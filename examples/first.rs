//! The smallest render: a built-in volume, its own colours, one picture.

use slicestack::lanes::Level;
use slicestack::volume::phantom::Phantom;
use slicestack::{Renderer, Scene, Settings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for p in [Phantom::MarschnerLobb, Phantom::SheppLogan] {
        let volume0 = p.volume(256)?;
        for bytes in [1, 2, 4] {
            let v = slicestack::volume::Voxels::F32(vec![]);
            let _ = v;
            let st = volume0.statistics();
            let (lo, hi) = (st.min, st.max);
            let n = volume0.grid().voxel_count();
            let vox = match bytes {
                1 => slicestack::volume::Voxels::U8((0..n).map(|i| ((volume0.voxels().get(i) - lo) / (hi - lo) * 255.0) as u8).collect()),
                2 => {
                    slicestack::volume::Voxels::U16((0..n).map(|i| ((volume0.voxels().get(i) - lo) / (hi - lo) * 65535.0) as u16).collect())
                }
                _ => volume0.voxels().clone(),
            };
            let m = match bytes {
                1 => 255.0,
                2 => 65535.0,
                _ => hi - lo,
            };
            let volume = slicestack::Volume::new(volume0.grid().clone(), vox)?
                .with_rescale(if bytes == 4 { 1.0 } else { (hi - lo) / m }, if bytes == 4 { 0.0 } else { lo })?;

            let scene = Scene::new(p.default_transfer());
            for level in Level::available() {
                let mut r = Renderer::new(&volume, Settings { threads: Some(1), level: Some(level), ..Default::default() });
                r.render(&scene)?;
                let (picture, stats) = r.render(&scene)?;
                println!(
                    "{} {} {} {:.1} ms, {:.1} Mfrag {:.1} Mfetch {:.1} Mfetch/s",
                    p.name(),
                    level.name(),
                    &picture.sha256()[..8],
                    stats.render_seconds * 1e3,
                    stats.fragments as f64 / 1e6,
                    stats.fetches as f64 / 1e6,
                    stats.fetches as f64 / 1e6 / stats.render_seconds
                );
                picture.save(format!("/tmp/{}.png", p.name()), slicestack::target::Depth::Eight)?;
            }
        }
    }
    Ok(())
}
