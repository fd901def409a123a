//! A transfer function built in code: thin coloured shells at chosen values, clear in between.
//!
//! ```sh
//! cargo run --release --example transfer_function -- shells.png [VOLUME]
//! ```

use slicestack::scene::{ColorMap, Straight, TransferFunction};
use slicestack::target::Depth;
use slicestack::volume::phantom::Phantom;
use slicestack::{Result, Scene, Volume};
use std::path::{Path, PathBuf};

/// `count` shells spread over the upper part of the volume's values, the inner ones denser.
fn shells(volume: &Volume, count: usize) -> Result<TransferFunction> {
    let statistics = volume.statistics();
    // The lower part is usually background: begin where half of all voxels lie below.
    let (low, high) = (statistics.percentile(0.5), statistics.max);
    let step = (high - low) / count as f64;
    let mut opacity = vec![(low, 0.0)];
    for i in 0..count {
        let middle = low + (i as f64 + 0.5) * step;
        let peak = 0.08 + 0.5 * i as f64 / count as f64;
        // A triangle a fifth of a step wide. Points are (value in the data's units, opacity per reference length).
        opacity.extend([(middle - 0.1 * step, 0.0), (middle, peak), (middle + 0.1 * step, 0.0)]);
    }
    // Colours need no points of their own: a colour map stretched over the same values.
    TransferFunction::new(ColorMap::Plasma.spread(low, high), opacity)
}

pub(crate) fn run(out: &Path, volume: &Volume) -> Result<()> {
    let transfer = shells(volume, 6)?;
    let scene = Scene::new(transfer)
        .with_size(384, 384)?
        // Opacities are meant per hundredth of the box's diagonal here: the picture does not depend on the voxels' size.
        .with_opacity_unit(volume.grid().radius() / 50.0)?
        .with_background(Straight { rgb: [0.02, 0.02, 0.05], alpha: 1.0 })?;
    slicestack::render(volume, &scene)?.save(out, Depth::Eight)
}

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let out = arguments.next().map_or_else(|| "shells.png".into(), PathBuf::from);
    let volume = match arguments.next() {
        Some(path) => Volume::open(path)?,
        None => Phantom::Hydrogen.volume(96)?,
    };
    run(&out, &volume)
}
