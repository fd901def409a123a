//! See it work: a scene's way through the pipeline, recorded between its stages, and a page that leads through it.
//!
//! Nothing here computes a picture: an observer copies what the stages leave in their batches, for chosen pixels, on every slice.
//! What the page compares with (the other order, the other fog) is the same pipeline run on another scene.
//!
//! ```
//! # fn main() -> slicestack::Result<()> {
//! use slicestack::explain::{Request, explain};
//! use slicestack::volume::phantom::Phantom;
//! use slicestack::{Scene, Settings};
//!
//! let volume = Phantom::SheppLogan.volume(16)?;
//! let scene = Scene::new(Phantom::SheppLogan.default_transfer(16)).with_size(32, 32)?;
//! let explanation = explain(&volume, &scene, &Settings::default(), &Request::default())?;
//! assert!(explanation.json()?.contains("\"texcoord\"")); // a column for each stage
//! assert!(explanation.page()?.starts_with("<!doctype html>"));
//! # Ok(())
//! # }
//! ```

mod activity;
mod by_gradient;
mod choose;
mod frames;
mod geometry;
mod gradient;
mod journey;
mod labels;
mod light;
mod others;
mod page;
mod record;
mod recorder;
mod scenery;

pub use frames::build_up;
pub use journey::{PixelJourney, journey};

use crate::picture::png;
use crate::plan::start_values;
use crate::proxy::Stack;
use crate::renderer::adaptive::search;
use crate::scene::{Algorithm, Blend, Method, Scene, Slicing};
use crate::{Error, Picture, RenderStats, Renderer, Result, Settings, Volume};
use activity::Activity;
use by_gradient::ByGradientRecord;
use choose::{busiest, choose, shown, through};
use geometry::{Side, StackRecord};
use gradient::GradientRecord;
use light::LightRecord;
use others::{example_fog, fogged_pictures, others};
use record::{Context, PixelRecord, Twin};
use recorder::{Recorder, Wanted};
use scenery::SceneRecord;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Most slices of one page.
pub const MAX_SLICES: u64 = 1024;

/// What to explain of a scene.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Request {
    /// The pixel to begin with, column and row; `None` takes one at which much happens.
    pub pixel: Option<(u32, u32)>,
    /// Slices to show, at most [`MAX_SLICES`]; `None` takes all of them, or those around the slice that matters most to the pixel.
    pub slices: Option<Range<u64>>,
}

impl Request {
    /// All slices of a pixel at which much happens.
    pub fn new() -> Self {
        Self::default()
    }

    /// The request to begin with another pixel, column and row; `None` takes one at which much happens.
    #[must_use]
    pub fn pixel(mut self, pixel: impl Into<Option<(u32, u32)>>) -> Self {
        self.pixel = pixel.into();
        self
    }

    /// The request to show other slices, at most [`MAX_SLICES`]; `None` takes all of them, or those that matter most to the pixel.
    #[must_use]
    pub fn slices(mut self, slices: impl Into<Option<Range<u64>>>) -> Self {
        self.slices = slices.into();
        self
    }
}

/// Everything that the page and notebooks read.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Record {
    format: &'static str,
    version: &'static str,
    scene: SceneRecord,
    stack: StackRecord,
    /// How gradients are taken, what depends on them, and light: in scenes that have them.
    #[serde(skip_serializing_if = "Option::is_none")]
    gradient: Option<GradientRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    by_gradient: Option<ByGradientRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    light: Option<LightRecord>,
    /// To the picture's right, to its top, and along the line of sight: for scenes with one of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    axes: Option<Axes>,
    /// Slices recorded: from, up to but without.
    slices: [u64; 2],
    /// Value in the data's units = scale * number + offset.
    scale: f64,
    offset: f64,
    /// Place of the chosen pixel in `pixels`.
    chosen: usize,
    pixels: Vec<PixelRecord>,
    /// How the twins of every pixel differ from the scene.
    twins: BTreeMap<&'static str, String>,
    left_out: Vec<[String; 2]>,
    notes: Vec<String>,
    fragments: u64,
    fetches: u64,
}

/// Unit vectors of the camera, world space.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Axes {
    right: [f64; 3],
    up: [f64; 3],
    forward: [f64; 3],
}

/// A recorded scene.
#[derive(Debug, Clone)]
pub struct Explanation {
    record: Record,
    picture: Picture,
    /// PNG of the box and its slices.
    drawing: Vec<u8>,
    /// PNG of the plane of values and gradients that the transfer function is over.
    plane: Option<Vec<u8>>,
    /// The picture with fog weighted by opacity, and by the literal formula.
    fogs: Option<[Picture; 2]>,
    warnings: Vec<String>,
}

impl Explanation {
    /// The scene's picture.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// What the user should hear about, one line each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The pixel that the page begins with, column and row.
    pub fn pixel(&self) -> (u32, u32) {
        let p = &self.record.pixels[self.record.chosen];
        (p.x, p.y)
    }

    /// The record as JSON: what the page shows, for notebooks.
    ///
    /// # Errors
    /// [`Error::Invalid`] when it cannot be written.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string(&self.record).map_err(|e| Error::invalid(format!("record: {e}")))
    }

    /// The page: one HTML file that needs nothing else.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a picture cannot be encoded.
    pub fn page(&self) -> Result<String> {
        page::page(self)
    }
}

/// Records `scene` of `volume`.
///
/// A scene with a tolerance is explained with the slices that the pixel's block takes, everywhere.
///
/// # Errors
/// [`Error::Invalid`] for volumes of colours, for scenes of the profile `opengl`, of shells, jitter and cut planes, when the pixel lies outside the picture or its ray misses the box, when the slices are none of the stack's or
/// too many, and when nothing of the box is in the picture; else as [`Renderer::render`].
pub fn explain(volume: &Volume, scene: &Scene, settings: &Settings, request: &Request) -> Result<Explanation> {
    volume.check_scalars("the teaching page")?;
    let mut renderer = Renderer::new(volume, plain(settings));
    let (width, height) = scene.size();
    if let Some((x, y)) = request.pixel.filter(|&(x, y)| x >= width || y >= height) {
        return Err(Error::invalid(format!(
            "pixel {x},{y}: the picture has {width} x {height} pixels, from 0,0 to {},{}",
            width - 1,
            height - 1
        )));
    }
    let Steady { scene, picture, stats, activity, pixel, mut notes } = steady(&mut renderer, scene, request.pixel)?;
    let view = scene.camera().resolve(volume.grid(), width, height)?;
    let stack = Stack::new(volume.grid(), &view, scene.clip_planes(), stats.slices);
    if stack.is_empty() {
        return Err(Error::invalid("the whole box lies behind the eye: there is nothing to explain"));
    }
    let Some(pixel) = pixel else {
        return Err(Error::invalid("no slice covers any pixel of the picture: there is nothing to explain"));
    };
    if through(&stack, pixel).is_none() {
        return Err(Error::invalid(format!("pixel {},{}: its ray passes the box by", pixel.0, pixel.1)));
    }
    if renderer.plan(&scene).is_some_and(|plan| plan.labels().is_some() && !plan.needs.colors()) {
        let (low, high) = (volume.statistics().min, volume.statistics().max);
        let values =
            format!("render.filter nearest: values from {low} to {high} are projected as places between the transfer function's points");
        return Err(Error::invalid(format!("{values}, which this page cannot show; choose the blend over")));
    }
    let slices = shown(request.slices.clone(), stack.count, activity.at(pixel.0, pixel.1), &mut notes)?;
    let mut pixels = vec![pixel];
    pixels.extend(
        choose(&activity, (width, height), (slices.end - slices.start) as f64 / stack.count as f64).into_iter().filter(|&p| p != pixel),
    );

    let wanted = Arc::new(Wanted::new(&pixels, slices.clone(), stack.count));
    let mut record = |scene: &Scene| Ok(renderer.render_observed(scene, Recorder::new(Arc::clone(&wanted)))?.2);
    let seen: Recorder = record(&scene)?;
    let context = Context { volume, scene: &scene, to_f32: seen.to_f32 };
    let side = Side::new(volume.grid(), &view)?;
    let start = start_values(&scene);
    let mut records: Vec<PixelRecord> = Vec::new();
    for (at, &(x, y)) in pixels.iter().enumerate() {
        let mut record = PixelRecord::new((x, y), picture.pixel(x, y), start, seen.journeys.get(&at), context);
        if let Some(journey) = seen.journeys.get(&at) {
            record.compare(journey, context, &stack);
        }
        record.through = through(&stack, (x, y));
        let (origin, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        record.drawn = [stack.near, stack.far].map(|d| side.at(origin + direction * d));
        records.push(record);
    }
    let mut twins = BTreeMap::new();
    for (name, how, other) in others(&scene, &stack)? {
        let seen = record(&other)?;
        twins.insert(name, how);
        for (at, pixel) in records.iter_mut().enumerate() {
            if let Some(journey) = seen.journeys.get(&at) {
                pixel.twins.insert(name, Twin::new(journey, name == "front-to-back"));
            }
        }
    }
    let stack_record = StackRecord::new(&stack, volume.grid(), &side, slices.clone(), scene.fog());
    let drawing = stack_record.draw(volume.grid(), &side)?;
    let fogs = match scene.blend() {
        Blend::Over => Some(fogged_pictures(&mut renderer, &scene, &stack)?),
        _ => None,
    };
    let (scale, offset) = context.scale();
    // Light on surfaces and projections of values have no stages for these.
    let sloped = scene.needs_gradient() && scene.blend().blends_colors();
    let sizes = records.iter().flat_map(|p| p.gradient.iter().flatten()).map(|g| g.exact.gradient.length());
    let by_gradient = if sloped { ByGradientRecord::new(&scene, volume, sizes.fold(0.0, f64::max)) } else { None };
    let plane = by_gradient.as_ref().map_or(Ok(None), |b| b.draw(scene.transfer2d()))?;
    let lit = scene.lighting().filter(|_| scene.blend().blends_colors());
    let record = Record {
        format: "slicestack explain 1",
        version: env!("CARGO_PKG_VERSION"),
        scene: SceneRecord::new(volume, &scene, &stack, example_fog(&stack)?),
        stack: stack_record,
        gradient: sloped.then(|| GradientRecord::new(scene.gradient(), volume, stats.tally.gradients, stats.tally.lanes)),
        by_gradient,
        axes: (sloped || lit.is_some()).then(|| Axes {
            right: view.right.to_array(),
            up: view.up.to_array(),
            forward: view.forward.to_array(),
        }),
        light: lit.map(|light| LightRecord::new(light, context, &stack)),
        slices: [slices.start, slices.end],
        scale,
        offset,
        chosen: 0,
        pixels: records,
        twins,
        left_out: stats.left_out.iter().map(|l| [l.what.clone(), l.told()]).collect(),
        notes,
        fragments: stats.fragments,
        fetches: stats.fetches,
    };
    Ok(Explanation {
        record,
        picture,
        drawing: png::rgba8(drawing.width(), drawing.height(), &straight(&drawing))?,
        plane,
        fogs,
        warnings: stats.warnings,
    })
}

/// Settings with which each block is rendered once, and by one tile.
fn plain(settings: &Settings) -> Settings {
    Settings { tile: None, estimate: false, ..settings.clone() }
}

/// A scene whose slices are counted, and its picture.
struct Steady {
    scene: Scene,
    picture: Picture,
    stats: RenderStats,
    activity: Activity,
    /// The pixel asked for, or one at which much happens.
    pixel: Option<(u32, u32)>,
    notes: Vec<String>,
}

/// Renders `scene`; where its slices vary from block to block, again with those that the pixel's block takes.
fn steady(renderer: &mut Renderer, scene: &Scene, pixel: Option<(u32, u32)>) -> Result<Steady> {
    check_stages(scene)?;
    let mut notes = Vec::new();
    let mut scene = scene.blended();
    if scene.linear_light() {
        notes.push("Colours are blended as amounts of light: those on this page are such amounts, the picture's are sRGB.".to_owned());
    }
    if scene.method().extrapolate {
        let method = Method { extrapolate: false, ..scene.method() };
        scene = scene.with_method(method)?;
        notes.push("The scene extrapolates pictures of N and 2 N slices; this page follows the picture of N.".to_owned());
    }
    if scene.method().merge {
        scene = scene.clone().with_method(Method { merge: false, ..scene.method() })?;
        notes.push("The scene lets several slabs be one where hardly anything changes; this page follows every slice.".to_owned());
    }
    let (mut picture, mut stats, mut activity) = renderer.render_observed(&scene, Activity::new(scene.blend()))?;
    let pixel = pixel.or_else(|| busiest(&activity));
    if let Slicing::Tolerance(asked) = scene.slicing() {
        let count = pixel.and_then(|(x, y)| activity.at(x, y)).map_or(stats.slices, |w| w.slices).max(1);
        notes.push(format!(
            "The scene asks for an error of {asked}, so each block of pixels takes slices of its own; this page gives the {count} slices \
             of the chosen pixel's block to all of them."
        ));
        // A tolerance may choose the method too.
        scene = scene
            .clone()
            .with_method(Method { merge: false, ..stats.method })?
            .with_slices(Slicing::Count(count))?
            .with_terminate(search::terminate(scene.terminate(), asked))?;
        (picture, stats, activity) = renderer.render_observed(&scene, Activity::new(scene.blend()))?;
    }
    Ok(Steady { scene, picture, stats, activity, pixel, notes })
}

/// Refuses scenes whose rays do not go through flat slices, stage by stage, or whose lookups are not those of a cell.
fn check_stages(scene: &Scene) -> Result<()> {
    if scene.opengl().is_some() {
        return Err(Error::invalid("the profile opengl draws without the stages that are explained here; choose accurate"));
    }
    if scene.method().filter.is_cubic() {
        return Err(Error::invalid("render filter cubic: a page shows a cell of eight voxels, the spline mixes 64; choose linear"));
    }
    if scene.algorithm() != Algorithm::Slices || scene.jitter().is_some() {
        let what =
            if scene.jitter().is_some() { "slices jitter".to_owned() } else { format!("render algorithm {}", scene.algorithm().name()) };
        return Err(Error::invalid(format!("{what}: a page shows flat slices, at one depth for all pixels; choose slices without jitter")));
    }
    if !scene.cuts().is_empty() {
        return Err(Error::invalid("cut: a page follows rays through the whole box; leave the planes out"));
    }
    Ok(())
}

/// Straight RGBA of a drawing.
fn straight(map: &tiny_skia::Pixmap) -> Vec<u8> {
    let pixel = |p: &tiny_skia::PremultipliedColorU8| {
        let c = p.demultiply();
        [c.red(), c.green(), c.blue(), c.alpha()]
    };
    map.pixels().iter().flat_map(pixel).collect()
}

#[cfg(test)]
mod label_tests;
#[cfg(test)]
mod lit_tests;
#[cfg(test)]
mod tests;
