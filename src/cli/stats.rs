//! What a picture cost, as JSON and as a table.

use serde_json::{Value, json};
use slicestack::{Picture, RenderStats, Volume};

/// Times that the command takes itself, in seconds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    pub(super) load: f64,
    pub(super) prepare: f64,
    pub(super) render: f64,
    pub(super) encode: f64,
}

/// The statistics file.
pub(super) fn json(clock: Clock, stats: &RenderStats, warnings: &[String], picture: &Picture, volume: &Volume) -> Value {
    let left_out: Vec<Value> = stats.left_out.iter().map(|(stage, why)| json!({ "stage": stage, "why": why })).collect();
    let mut value = json!({
        "seconds": { "load": clock.load, "prepare": clock.prepare, "render": clock.render, "encode": clock.encode },
        "slices": stats.slices,
        "fragments": stats.fragments,
        "fetches": stats.fetches,
        "threads": stats.threads,
        "simd": stats.simd,
        "left_out": left_out,
        "sha256": picture.sha256(),
        "warnings": warnings,
        "non_finite_voxels": stats.non_finite_voxels,
        "image": { "width": picture.width(), "height": picture.height() },
        "volume": {
            "name": volume.name(),
            "dimensions": volume.grid().dims(),
            "type": volume.voxels().voxel_type().name(),
            "bytes": volume.voxels().bytes(),
        },
        "version": env!("CARGO_PKG_VERSION"),
    });
    if let (Some(estimate), Some(map)) = (stats.error_estimate, value.as_object_mut()) {
        map.insert("error_estimate".into(), json!(estimate));
    }
    value
}

/// What was left out and why, for people.
pub(super) fn explain(stats: &RenderStats) -> String {
    let width = stats.left_out.iter().map(|(stage, _)| stage.chars().count()).max().unwrap_or(0);
    let mut text = format!(
        "{} slices, {} fragments, {} voxel lookups, {} threads, {}\n",
        stats.slices, stats.fragments, stats.fetches, stats.threads, stats.simd
    );
    for (stage, why) in &stats.left_out {
        text += &format!("  left out: {stage:width$}  {why}\n");
    }
    text
}
