//! What a page is told when it opens: the scene, the volume's geometry and histogram, presets, and what keys of a scene there are.

use super::document::{Document, Opened};
use crate::cut::Window;
use crate::scene::preset::Kind;
use crate::scene::{KeyKind, Preset, keys};
use crate::volume::{Channels, Modality, Space};
use crate::{Result, Volume};
use glam::DVec3;
use serde_json::{Map, Value, json};

/// The answer to a page that opens.
///
/// # Errors
/// Where the scene cannot be written.
pub(super) fn answer(opened: &Opened, title: &str, notes: &[String], warnings: &[String]) -> Result<Value> {
    let document: Document = opened.write(&opened.scene, &opened.annotations)?;
    let (width, height) = opened.scene.size();
    let volume = &opened.volume;
    let choices: Map<String, Value> = keys()
        .iter()
        .filter_map(|key| match &key.kind {
            KeyKind::Text(words) if !words.is_empty() => Some((key.path.clone(), json!(words))),
            _ => None,
        })
        .collect();
    let about: Map<String, Value> = keys().iter().map(|key| (key.path.clone(), json!(key.about))).collect();
    let notes: Vec<&String> = volume.notes().iter().chain(notes).collect();
    Ok(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "title": title,
        "document": document,
        "size": [width, height],
        "volume": geometry(volume),
        "histogram": histogram(volume),
        "windows": windows(volume),
        "presets": presets(volume),
        "choices": choices,
        "about": about,
        "notes": notes,
        "warnings": warnings,
    }))
}

fn geometry(volume: &Volume) -> Value {
    let grid = volume.grid();
    let map = grid.index_to_world();
    let rows: Vec<[f64; 4]> = (0..3)
        .map(|row| {
            let [x, y, z] = map.matrix3.row(row).to_array();
            [x, y, z, map.translation[row]]
        })
        .collect();
    let (low, high) = grid.index_bounds();
    let kind = match volume.channels() {
        Channels::Scalar => "values",
        Channels::Label(_) => "labels",
        Channels::Rgb | Channels::Rgba => "colors",
    };
    let range = volume.scalars().map(|_| [volume.statistics().min, volume.statistics().max]);
    json!({
        "dims": grid.dims(),
        "index_to_world": rows,
        "box": { "low": low.to_array(), "high": high.to_array() },
        "spacing": grid.spacing(),
        "range": range,
        "unit": (volume.modality() == Modality::Ct).then_some("HU"),
        "length_unit": volume.unit().map(|unit| unit.symbol()),
        "kind": kind,
        "directions": directions(grid.space()),
    })
}

/// The letter at each end of each axis of the world.
fn directions(space: Space) -> Option<Value> {
    let ends = [("+x", DVec3::X), ("-x", DVec3::NEG_X), ("+y", DVec3::Y), ("-y", DVec3::NEG_Y), ("+z", DVec3::Z), ("-z", DVec3::NEG_Z)];
    let letters: Option<Map<String, Value>> =
        ends.into_iter().map(|(name, direction)| Some((name.to_owned(), space.letters(direction)?.into()))).collect();
    letters.map(Value::Object)
}

fn histogram(volume: &Volume) -> Option<Value> {
    volume.scalars()?;
    let found = volume.statistics();
    Some(json!({ "low": found.min, "high": found.max, "counts": found.histogram }))
}

/// Windows for slices, the one to begin with at the front: name, centre and width.
fn windows(volume: &Volume) -> Vec<Value> {
    let named = |(name, window): (&str, Window)| {
        let (center, width) = window.center_and_width();
        json!({ "name": name, "center": center, "width": width })
    };
    if volume.scalars().is_none() {
        return Vec::new();
    }
    if Kind::of(volume) == Kind::Hounsfield {
        return Window::OF_CT.into_iter().map(named).collect();
    }
    let statistics = volume.statistics();
    let (low, high) = (statistics.percentile(0.01), statistics.percentile(0.995));
    let whole = (statistics.min, statistics.max);
    let (low, high) = if low < high { (low, high) } else { whole };
    Window::new(0.5 * low + 0.5 * high, high - low).ok().map(|window| named(("1 to 99.5 %", window))).into_iter().collect()
}

/// All presets, those that fit first and the best of them at the front.
fn presets(volume: &Volume) -> Vec<Value> {
    if volume.scalars().is_none() {
        return Vec::new();
    }
    let best = Preset::suggest(volume);
    let rest = Preset::ALL.into_iter().filter(|preset| !best.contains(preset));
    let told = |preset: Preset| {
        let why = preset.suits(volume).err();
        // Grey ramps over values that are projected: blended one over the other they are black.
        let blend = matches!(preset, Preset::CtMip | Preset::MrMip).then_some("mip");
        json!({ "name": preset.name(), "about": preset.about(), "fits": why.is_none(), "why": why, "blend": blend })
    };
    best.iter().copied().chain(rest).map(told).collect()
}
