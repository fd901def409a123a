//! The probe: what lies behind a pixel, and how its colour comes about.
//!
//! ```text
//!  scene, pixel --explain::journey--> values and opacities along the ray --blend--> the place that is seen --volume--> voxel, value, label
//!                     | refused: the scene has no flat slices
//!                     +--> values half a voxel apart, in f64
//! ```

use super::document::{Asked, Opened};
use crate::explain::{PixelJourney, journey};
use crate::scene::{Blend, Scene, View};
use crate::volume::{Channels, Segment};
use crate::{Error, Renderer, Result, Volume};
use glam::DVec3;
use serde_json::{Value, json};

/// Most samples along a ray that has no slices.
const SAMPLES: f64 = 4096.0;

/// Values and opacities along a ray, front to back.
#[derive(Default)]
struct Along {
    depth: Vec<f64>,
    value: Vec<f64>,
    opacity: Vec<f64>,
    /// Distance of two of them.
    spacing: f64,
}

/// What lies behind `pixel` of the picture that `asked` describes.
///
/// # Errors
/// [`Error::Invalid`] for a pixel outside the picture; as [`Renderer::render`].
pub(super) fn answer(opened: &Opened, renderer: &mut Renderer, asked: &Asked, (x, y): (u32, u32)) -> Result<Value> {
    let (scene, volume) = (&asked.scene, &opened.volume);
    let (width, height) = scene.size();
    if x >= width || y >= height {
        return Err(Error::invalid(format!("pixel {x},{y}: the picture has {width} x {height} pixels")));
    }
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let (origin, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let through = through(volume, &view, origin, direction);
    let (found, mut notes) = match journey(renderer, scene, (x, y)) {
        Ok(mut found) => {
            let notes = std::mem::take(&mut found.notes);
            (Some(found), notes)
        }
        Err(Error::Stopped) => return Err(Error::Stopped),
        Err(refused) => (None, vec![refused.to_string()]),
    };
    let (pixel, along) = match &found {
        Some(found) => (found.pixel, along_slices(found)),
        None => (renderer.render(scene)?.0.pixel(x, y), along_ray(scene, volume, (origin, direction), through)),
    };
    let depth = place(scene, &along);
    if depth.is_none() && through.is_some() && scene.blend() == Blend::Average {
        notes.push("The mean of a ray has no place on it.".to_owned());
    }
    let world = depth.map(|d| origin + direction * d);
    let index = world.map(|p| volume.grid().world_to_index().transform_point3(p));
    let value = index.filter(|_| volume.scalars().is_some()).map(|p| value_at(volume, p)).filter(|v| v.is_finite());
    Ok(json!({
        "hit": through.is_some(),
        "ray": { "origin": origin.to_array(), "direction": direction.to_array() },
        "voxel": index.map(|p| p.to_array()),
        "world": world.map(|p| p.to_array()),
        "value": value,
        "label": index.and_then(|p| label_at(volume, p)),
        "pixel": pixel,
        "journey": found.map(|found| plotted(&found)),
        "note": (!notes.is_empty()).then(|| notes.join(" ")),
    }))
}

/// The columns that are plotted; colours without their opacity.
fn plotted(found: &PixelJourney) -> Value {
    let straight = |(color, &alpha): (&[f32; 3], &f32)| color.map(|c| if alpha > 0.0 { (c / alpha).clamp(0.0, 1.0) } else { 0.0 });
    let colors: Vec<[f32; 3]> = found.color.iter().zip(&found.opacity).map(straight).collect();
    json!({
        "depth": found.depth, "value": found.value, "opacity": found.opacity, "color": colors, "transmittance": found.transmittance,
    })
}

fn along_slices(found: &PixelJourney) -> Along {
    let opacity = found.opacity.iter().map(|&a| f64::from(a)).collect();
    Along { depth: found.depth.clone(), value: found.value.clone(), opacity, spacing: found.spacing }
}

/// Values half a voxel apart, and the opacities that the transfer function gives them.
fn along_ray(scene: &Scene, volume: &Volume, (origin, direction): (DVec3, DVec3), through: Option<[f64; 2]>) -> Along {
    let (Some([near, far]), Some(_)) = (through, volume.scalars()) else { return Along::default() };
    let count = ((far - near) * direction.length() / (0.5 * volume.grid().smallest_spacing())).ceil().clamp(1.0, SAMPLES);
    let spacing = (far - near) / count;
    let mut along = Along { spacing, ..Along::default() };
    let reference = scene.transfer().opacity_length(volume.grid());
    for k in 0..count as u64 {
        let depth = near + (k as f64 + 0.5) * spacing;
        let world = origin + direction * depth;
        if scene.clip_planes().iter().any(|plane| plane.distance(world) < 0.0) {
            continue;
        }
        let value = value_at(volume, volume.grid().world_to_index().transform_point3(world));
        let alpha = if scene.blend().blends_colors() { scene.transfer().eval(value).alpha } else { 0.0 };
        along.depth.push(depth);
        along.value.push(value);
        along.opacity.push(1.0 - libm::pow(1.0 - alpha, spacing * direction.length() / reference));
    }
    along
}

/// The depth of what is seen: where opacity passes a half, else of most opacity; of a surface where it is met; of a projection where its value is.
fn place(scene: &Scene, along: &Along) -> Option<f64> {
    let highest = |better: fn(f64, f64) -> bool| {
        let numbers = along.value.iter().zip(&along.depth).filter(|(v, _)| v.is_finite());
        numbers.reduce(|a, b| if better(*b.0, *a.0) { b } else { a }).map(|(_, &d)| d)
    };
    match scene.blend() {
        Blend::Mip | Blend::AttenuatedMip { .. } => highest(|new, old| new > old),
        Blend::Min => highest(|new, old| new < old),
        Blend::Average => None,
        Blend::Lmip { threshold } => local_maximum(along, threshold).or_else(|| highest(|new, old| new > old)),
        Blend::Iso { level } => crossing(along, level, true),
        Blend::Surfaces => scene.levels().iter().filter_map(|s| crossing(along, s.level(), false)).reduce(f64::min),
        Blend::Over | Blend::Under | Blend::Add => half_way(along),
    }
}

/// Where opacity passes a half, its slab taken to absorb evenly; else the slab of most opacity.
fn half_way(along: &Along) -> Option<f64> {
    let mut left = 1.0;
    let mut most = (0.0, None);
    for (&depth, &alpha) in along.depth.iter().zip(&along.opacity) {
        let after = left * (1.0 - alpha);
        if after < 0.5 {
            let share = if after > 0.0 { libm::log(left / 0.5) / libm::log(left / after) } else { 0.0 };
            return Some(depth + (share.clamp(0.0, 1.0) - 0.5) * along.spacing);
        }
        if left * alpha > most.0 {
            most = (left * alpha, Some(depth));
        }
        left = after;
    }
    most.1
}

/// Where the values first cross `level`; where they begin above it, if surfaces are closed there.
fn crossing(along: &Along, level: f64, closed: bool) -> Option<f64> {
    if closed && along.value.first().is_some_and(|&v| v >= level) {
        return along.depth.first().copied();
    }
    let pairs = along.value.windows(2).zip(along.depth.windows(2));
    pairs.filter(|(v, _)| (v[0] < level) != (v[1] < level)).map(|(v, d)| d[0] + (d[1] - d[0]) * (level - v[0]) / (v[1] - v[0])).next()
}

/// The first value that is no smaller than `threshold` and larger than those around it.
fn local_maximum(along: &Along, threshold: f64) -> Option<f64> {
    let at = |k: usize| along.value.get(k).copied().unwrap_or(f64::NEG_INFINITY);
    let before = |k: usize| if k == 0 { f64::NEG_INFINITY } else { at(k - 1) };
    (0..along.value.len()).find(|&k| at(k) >= threshold && at(k) > before(k) && at(k) > at(k + 1)).map(|k| along.depth[k])
}

/// Depths at which a ray enters and leaves the box, none of them nearer than the view's nearest.
fn through(volume: &Volume, view: &View, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let map = volume.grid().world_to_index();
    let (from, step) = (map.transform_point3(origin), map.transform_vector3(direction));
    let (low, high) = volume.grid().index_bounds();
    let (mut near, mut far) = (view.near, f64::INFINITY);
    for axis in 0..3 {
        if step[axis] == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return None;
            }
            continue;
        }
        let [a, b] = [low[axis], high[axis]].map(|side| (side - from[axis]) / step[axis]);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    (near < far && far.is_finite()).then_some([near, far])
}

/// The voxel that is nearest to a place.
fn nearest(volume: &Volume, place: DVec3) -> [usize; 3] {
    let dims = volume.grid().dims();
    [0, 1, 2].map(|axis: usize| (place[axis].round().max(0.0) as usize).min(dims[axis] - 1))
}

/// The value at a place: between labels there is none, so there that of the nearest voxel.
fn value_at(volume: &Volume, place: DVec3) -> f64 {
    match volume.channels() {
        Channels::Label(_) => volume.value(nearest(volume, place)),
        _ => volume.sample(place),
    }
}

/// The name of the segment at a place, where voxels have labels or a label map lies beside them.
fn label_at(volume: &Volume, place: DVec3) -> Option<String> {
    let voxel = nearest(volume, place);
    let named = |label: i64, segment: Option<&Segment>| match segment.filter(|s| !s.name.is_empty()) {
        Some(segment) => format!("{} ({label})", segment.name),
        None => label.to_string(),
    };
    if let Some(map) = volume.labels() {
        let [nx, ny, _] = volume.grid().dims();
        let label = map.label((voxel[2] * ny + voxel[1]) * nx + voxel[0]);
        return Some(named(label, map.segments().iter().find(|s| s.value == label)));
    }
    match volume.channels() {
        channels @ Channels::Label(_) => {
            let label = volume.value(voxel) as i64;
            Some(named(label, channels.segment(label)))
        }
        _ => None,
    }
}
