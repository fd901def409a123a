//! A transfer function built in code: thin coloured shells at chosen values, clear in between.
//!
//! ```sh
//! cargo run --release --example transfer_function -- shells.png [VOLUME]
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{ColorMap, Straight, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::{Result, Scene, Volume};
use std::path::{Path, PathBuf};

/// A shell around each value that a given share of all voxels lies below; the inner ones denser.
fn shells(volume: &Volume, shares: &[f64]) -> Result<TransferFunction> {
    let statistics = volume.statistics();
    let mut values: Vec<f64> = shares.iter().map(|&share| statistics.percentile(share)).collect();
    values.dedup();
    // Points are (value in the data's units, opacity per reference length). Their values must not fall.
    let mut opacity = vec![(statistics.min, 0.0)];
    for (i, near) in values.windows(3).enumerate() {
        let (below, value, above) = (near[0], near[1], near[2]);
        let peak = 0.08 + 0.3 * i as f64 / values.len() as f64;
        opacity.extend([(value - 0.4 * (value - below), 0.0), (value, peak), (value + 0.4 * (above - value), 0.0)]);
    }
    // Colours need no points of their own: a colour map stretched over the same values.
    let (low, high) = (values[0], values[values.len() - 1]);
    TransferFunction::new(ColorMap::Plasma.spread(low, high), opacity)
}

pub(crate) fn run(out: &Path, volume: &Volume) -> Result<()> {
    // Opacities are meant per hundredth of the box's diagonal here: the picture does not depend on the voxels' size.
    let transfer = shells(volume, &[0.6, 0.8, 0.9, 0.96, 0.99, 0.998])?.with_unit(volume.grid().radius() / 50.0)?;
    let scene = Scene::new(transfer).with_size(384, 384)?.with_background(Straight { rgb: [0.02, 0.02, 0.05], alpha: 1.0 })?;
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
