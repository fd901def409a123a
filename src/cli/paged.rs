//! `slicestack render --memory`: a picture of a volume of which no more is held than a limit allows.

use super::output::{Outputs, Sink};
use super::progress::Bar;
use super::saved::SavedScene;
use super::signals::go_on;
use super::stats::{self, Clock};
use super::{Usage, complain, tell};
use anyhow::{Result, bail};
use serde_json::{Value, json};
use slicestack::paged::{PageStats, PagedRenderer};
use slicestack::picture::{Depth, Format, Metadata};
use slicestack::scene::{ResolvedScene, SceneFile};
use slicestack::{Limits, Settings};
use std::sync::Arc;
use std::time::Instant;

/// Voxels of the volume that a scene is resolved with: presets and framing look at it in the place of the whole.
const OVERVIEW: usize = 1 << 21;

/// Sizes by their ends.
const UNITS: [(&str, u64); 8] = [
    ("KiB", 1 << 10),
    ("MiB", 1 << 20),
    ("GiB", 1 << 30),
    ("TiB", 1 << 40),
    ("KB", 1_000),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
    ("TB", 1_000_000_000_000),
];

/// The bytes that `text` says: a number, with or without one of the units.
///
/// # Errors
/// What is expected instead.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let (number, unit) = UNITS
        .iter()
        .find_map(|(end, unit)| {
            let at = text.len().checked_sub(end.len())?;
            text.is_char_boundary(at)
                .then(|| text.split_at(at))
                .filter(|(_, tail)| tail.eq_ignore_ascii_case(end))
                .map(|(head, _)| (head, *unit))
        })
        .unwrap_or((text, 1));
    let value: f64 = number.trim().parse().map_err(|_| "write a number of bytes, such as 1GiB or 512MiB".to_owned())?;
    let bytes = value * unit as f64;
    if !(bytes >= 1.0 && bytes < u64::MAX as f64) {
        return Err("a number of bytes from 1 to 2^64".to_owned());
    }
    Ok(bytes as u64)
}

/// Where a picture and what belongs to it go.
pub(super) struct Targets<'o> {
    pub(super) sink: &'o Sink,
    pub(super) format: Format,
    pub(super) depth: Depth,
    pub(super) stats: Option<&'o Sink>,
    pub(super) saved: Option<SavedScene>,
    pub(super) show: bool,
    pub(super) explain: bool,
    pub(super) metadata: bool,
    pub(super) repeat: u32,
}

/// Renders the scene of `file` within `memory` bytes.
pub(super) fn run(file: &SceneFile, memory: u64, settings: Settings, bar: &Arc<Bar>, out: Targets<'_>) -> Result<()> {
    if file.annotations().any() {
        bail!(Usage("--memory: annotations are drawn with the whole volume at hand; leave one of them out".into()));
    }
    // What is kept of bricks and boxes that are gone would count as well.
    slicestack::give_back_memory();
    let mut clock = Clock::default();
    let start = Instant::now();
    // Small files are mapped too, unless none may be.
    let map_bytes = if settings.limits.map_bytes == u64::MAX { u64::MAX } else { 1 << 20 };
    let limits = Limits::within(memory).map_bytes(map_bytes);
    let levels = file.volume().load_levels(&limits, Some(bar.clone()));
    bar.clear();
    let levels = levels?;
    levels.notes().iter().for_each(|note| complain("note", note));
    out.sink.spare_read()?;
    clock.load = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let overview = levels.overview(OVERVIEW)?;
    let ResolvedScene { scene, mut warnings, notes, .. } = file.resolve(&overview)?;
    PagedRenderer::check(&scene).map_err(|e| Usage(format!("--memory: {e}")))?;
    clock.prepare = start.elapsed().as_secs_f64();
    let estimate = settings.estimate;
    let mut renderer = PagedRenderer::new(levels, settings, memory);
    let (mut picture, mut stats, mut pages) = renderer.render(&scene)?;
    clock.render = stats.render_seconds;
    for _ in 1..out.repeat {
        (picture, stats, pages) = renderer.render(&scene)?;
        clock.render = clock.render.min(stats.render_seconds);
    }
    bar.clear();
    warnings.extend(stats.warnings.iter().cloned());
    notes.iter().for_each(|note| complain("note", note));
    warnings.iter().for_each(|w| complain("warning", w));
    go_on()?;
    let start = Instant::now();
    if out.metadata && out.format.carries_metadata() {
        complain("note", "the picture carries no scene: the volume's SHA-256, which goes with it, would take reading all of the file");
    }
    let bytes = picture.encode_with(out.format, out.depth, &Metadata::new())?;
    let saved =
        out.saved.map(|saved| Ok::<_, anyhow::Error>((saved.text(&scene, file.volume(), &file.annotations())?, saved.sink))).transpose()?;
    clock.encode = start.elapsed().as_secs_f64();
    let mut outputs = Outputs::default();
    outputs.add(out.sink, &bytes)?;
    if let Some((text, to)) = &saved {
        outputs.add(to, text.as_bytes())?;
    }
    if let Some(to) = out.stats {
        let told = stats::Told { depths: scene.depths(&overview), warnings, notes };
        let mut value = stats::json(clock, &stats, &told, &picture, &overview);
        let grid = renderer.levels().grid();
        value["volume"]["dimensions"] = json!(grid.dims());
        value["volume"]["bytes"] = json!(u64::try_from(renderer.levels().bytes()).unwrap_or(u64::MAX));
        value["pages"] = pages_json(&pages);
        let text = serde_json::to_string_pretty(&value)? + "\n";
        outputs.add(to, text.as_bytes())?;
    }
    outputs.finish()?;
    if out.show {
        super::render::shown(&picture)?;
    }
    if let Some(error) = stats.error_estimate.filter(|_| estimate) {
        tell!("estimated RMS error of the colours: {error:.2e} in {}", stats::counted(stats.slices, "slice"));
    }
    if out.repeat > 1 {
        tell!(
            "shortest of {}: {:.3} ms a picture, {:.3} ms of preparation before the first",
            out.repeat,
            1e3 * clock.render,
            1e3 * clock.prepare
        );
    }
    if out.explain {
        tell!("{}\n{}", stats::explain(&stats, &picture), explain(&pages).trim_end());
    } else if let Sink::File(path) = out.sink {
        super::render::tell_written(path, out.format, clock);
    }
    Ok(())
}

/// What a picture took of its volume, for the file of statistics.
fn pages_json(pages: &PageStats) -> Value {
    json!({
        "bricks_visited": pages.bricks_asked,
        "bricks_read": pages.bricks_read,
        "bytes_read": pages.bytes_read,
        "peak_cache_bytes": pages.peak_bytes,
        "limit_cache_bytes": pages.limit_bytes,
        "pieces_by_level": pages.pieces,
        "empty_pieces": pages.empty_pieces,
        "finer_levels": pages.finer,
        "level_error": pages.level_error,
    })
}

/// The same for people.
fn explain(pages: &PageStats) -> String {
    let mib = |bytes: u64| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
    let levels: Vec<String> = pages.pieces.iter().enumerate().filter(|(_, n)| **n > 0).map(|(l, n)| format!("{n} of level {l}")).collect();
    format!(
        "bricks: {} visited, {} read, {}; {} of {} kept at most\npieces: {}; {} with nothing in them\n",
        pages.bricks_asked,
        pages.bricks_read,
        mib(pages.bytes_read),
        mib(pages.peak_bytes),
        mib(pages.limit_bytes),
        if levels.is_empty() { "none".to_owned() } else { levels.join(", ") },
        pages.empty_pieces
    )
}

#[cfg(test)]
mod tests {
    use super::bytes;

    #[test]
    fn sizes_are_read_with_and_without_units() {
        for (text, want) in [("1GiB", 1 << 30), ("512MiB", 512 << 20), ("1.5 gib", 3 << 29), ("2GB", 2_000_000_000), ("4096", 4096)] {
            assert_eq!(bytes(text), Ok(want), "{text}");
        }
        for text in ["", "GiB", "-1GiB", "1e30TiB", "much", "NaN", "ü"] {
            assert!(bytes(text).is_err(), "{text}");
        }
    }
}
