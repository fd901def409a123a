//! `slicestack info`: what a volume file is.

use super::Usage;
use super::flags::VolumeFlags;
use super::output::{Sink, is_picture, print};
use super::progress::Bar;
use super::scene::{ReadingArgs, scene_of};
use super::signals::go_on;
use super::stats::depths_json;
use anyhow::{Result, bail};
use serde_json::{Value, json};
use slicestack::scene::preset::Guess;
use slicestack::scene::{OpacityFrom, Overrides, Preset, SceneDepths};
use slicestack::study::{Units, joint_histogram_png};
use slicestack::volume::io::{self, Format, Item, Part};
use slicestack::volume::{Channels, JointHistogram, LengthUnit, Modality, Segment, Space, VolumeSource};
use slicestack::{Limits, Volume};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `info` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = help())]
pub(super) struct InfoArgs {
    /// Volume file, or a scene file whose volume is meant.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write how often values occur together with sizes of the gradient, 256 x 256 bins: a picture (.png) or a table (.csv).
    #[arg(long, value_name = "FILE")]
    histogram2d: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    flags: VolumeFlags,
}

const EXAMPLES: &str = "\
Examples:
  slicestack info head.nrrd
  slicestack info head.nrrd --histogram2d boundaries.png
  slicestack info ct.raw --volume.dimensions 256,256,113 --volume.type i16 --volume.spacing 1,1,2";

/// What stands below the flags: examples, and the formats by their own words.
fn help() -> String {
    let mut text = format!("{EXAMPLES}\n\nFormats (all but archives also inside gzip, .gz):");
    let extensions = |format: &Format| format.extensions().iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" ");
    let widest = Format::ALL.iter().map(|f| extensions(f).len()).max().unwrap_or(0);
    for format in Format::ALL {
        text += &format!("\n  {:15}{:widest$}  {}", format.name(), extensions(format), format.reads());
    }
    text
}

/// Columns of the text histogram.
const COLUMNS: usize = 64;

pub(super) fn run(args: &InfoArgs) -> Result<()> {
    let joint = args.histogram2d.as_deref().map(|path| JointOutput::of(path, &args.file)).transpose()?;
    let mut overrides = Overrides::default();
    let text = scene_of(Some(&args.file), &mut overrides);
    args.flags.apply(&mut overrides)?;
    let source = text.open(&overrides)?;
    if let (Some(joint), Some(path)) = (&joint, source.volume().path()) {
        joint.sink.spare(joint.kind(), joint.like(), &[path])?;
    }
    let limits = args.reading.limits();
    // Listed first: where what would be taken cannot be read, something else may be chosen.
    let mut items = match source.volume().path() {
        Some(path) if source.volume().is_described_by_file() => io::list(path, &source.volume().reading(&limits))?,
        _ => Vec::new(),
    };
    if source.volume().choice.magnitude {
        for item in items.iter_mut().filter(|item| item.part == Part::Channel) {
            (item.taken, item.about) = (true, "all are read, as the magnitude of a vector".into());
        }
    }
    let volume = load_listed(source.volume(), &limits, &items, args.json)?;
    if let Some(joint) = joint {
        joint.write(&volume)?;
    }
    go_on()?;
    // The scene's own view, or the usual one.
    let depths = source.resolve(&volume).ok().and_then(|found| found.scene.depths(&volume));
    let text =
        if args.json { serde_json::to_string_pretty(&as_json(&volume, depths, &items))? + "\n" } else { as_text(&volume, depths, &items) };
    print(text.as_bytes())
}

/// Where the joint histogram goes.
struct JointOutput {
    sink: Sink,
    table: bool,
}

impl JointOutput {
    fn of(path: &Path, input: &Path) -> Result<Self> {
        let is = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        if !is("png") && !is("csv") {
            bail!(Usage(format!("--histogram2d {}: write .png or .csv", path.display())));
        }
        let joint = Self { sink: Sink::new(path)?, table: is("csv") };
        joint.sink.spare(joint.kind(), joint.like(), &[input])?;
        Ok(joint)
    }

    fn kind(&self) -> &'static str {
        if self.table { "table of a joint histogram" } else { "picture" }
    }

    /// Whether a file that begins with `start` gives way.
    fn like(&self) -> fn(&[u8]) -> bool {
        if self.table { |start| start.starts_with(b"value_low,") } else { is_picture }
    }

    fn write(&self, volume: &Volume) -> Result<()> {
        let bar = Bar::new();
        let joint = JointHistogram::of(volume, Some(&bar))?;
        bar.clear();
        go_on()?;
        let bytes = if self.table {
            joint.csv().into_bytes()
        } else {
            let units = if volume.modality() == Modality::Ct { Units::Hounsfield } else { Units::Unknown };
            // The folder says nothing about the data, and may say something about people.
            let name = Path::new(volume.name()).file_name().map_or_else(|| "volume".into(), |n| n.to_string_lossy());
            joint_histogram_png(&format!("{name}: values and their gradients"), &joint, units)?
        };
        self.sink.write(&bytes)?;
        Ok(())
    }
}

/// Lower and upper corner of the box in the world, by component.
fn world_box(volume: &Volume) -> [[f64; 3]; 2] {
    let corners = volume.grid().corners();
    let by = |f: fn(f64, f64) -> f64, start: f64| std::array::from_fn(|axis| corners.iter().map(|c| c[axis]).fold(start, f));
    [by(f64::min, f64::INFINITY), by(f64::max, f64::NEG_INFINITY)]
}

fn space(volume: &Volume) -> Option<&'static str> {
    match volume.grid().space() {
        Space::Unknown => None,
        Space::Ras => Some("right-anterior-superior"),
        Space::Lps => Some("left-posterior-superior"),
    }
}

/// Bytes that the voxels take.
fn bytes(volume: &Volume) -> usize {
    let kind = volume.voxels().voxel_type();
    volume.grid().voxel_count() * volume.channels().count() * kind.bytes()
}

/// The direction in the body that each axis of the voxels leads to, by its nearest letter: `LPS`, `RAS` ...
fn orientation(volume: &Volume) -> Option<String> {
    let directions = volume.grid().directions();
    let letter = |axis: usize| volume.grid().space().letters(directions.col(axis))?.chars().next();
    (0..3).map(letter).collect()
}

/// Every preset with the reason against it, the suggested ones first.
fn verdicts(volume: &Volume) -> Vec<(Preset, Option<String>)> {
    let suggested = Preset::suggest(volume);
    let others = Preset::ALL.into_iter().filter(|p| !suggested.contains(p));
    suggested.iter().copied().chain(others).map(|p| (p, p.suits(volume).err())).collect()
}

fn as_json(volume: &Volume, depths: Option<SceneDepths>, items: &[Item]) -> Value {
    let (grid, s) = (volume.grid(), volume.statistics());
    let (slope, intercept) = volume.rescale();
    let directions = grid.directions();
    let (verdicts, guess) = (verdicts(volume), Guess::of(volume));
    let labels = own_labels(volume);
    let taken_for = match labels {
        Some(_) => json!({ "preset": null, "reason": "a label map", "advice": null }),
        None => json!({ "preset": guess.preset.name(), "reason": guess.reason, "advice": guess.advice }),
    };
    let rejected = verdicts.iter().filter_map(|(p, why)| Some(json!({ "preset": p.name(), "why": why.as_ref()? })));
    let suggested: Vec<&str> = Preset::suggest(volume).into_iter().map(Preset::name).collect();
    json!({
        "name": volume.name(),
        "dimensions": grid.dims(),
        "voxels": grid.voxel_count(),
        "type": volume.voxels().voxel_type().name(),
        "bytes": bytes(volume),
        "channels": volume.channels().count(),
        "colors": match volume.channels() {
            Channels::Rgba => Some("rgba"),
            Channels::Rgb => Some("rgb"),
            _ => None,
        },
        "spacing": grid.spacing(),
        "unit": volume.unit().map(LengthUnit::name),
        "origin": grid.origin().to_array(),
        "directions": directions.to_cols_array_2d(),
        "space": space(volume),
        "box": world_box(volume),
        "slope": slope,
        "intercept": intercept,
        "modality": volume.modality().name(),
        "min": s.min,
        "max": s.max,
        "mean": s.mean,
        "non_finite": s.non_finite,
        "histogram": s.histogram,
        "taken_for": taken_for,
        "depths": depths.map(depths_json),
        "choices": items.iter().map(item_json).collect::<Vec<_>>(),
        "notes": volume.notes(),
        "details": volume.details(),
        "orientation": orientation(volume),
        "labels": labels.map(|(values, segments)| {
            let named: Vec<Value> = segments.iter().map(|s| json!({ "value": s.value, "name": s.name, "color": s.color })).collect();
            json!({ "values": values, "segments": named })
        }),
        "presets": suggested,
        "rejected": rejected.collect::<Vec<_>>(),
    })
}

fn as_text(volume: &Volume, depths: Option<SceneDepths>, items: &[Item]) -> String {
    let (grid, s) = (volume.grid(), volume.statistics());
    let [nx, ny, nz] = grid.dims();
    let list = |v: [f64; 3]| v.map(short).join(" ");
    let kind = volume.voxels().voxel_type();
    let mib = bytes(volume) as f64 / (1 << 20) as f64;
    let (colors, labels) = (volume.colors().is_some(), own_labels(volume));
    let axes = grid.directions().to_cols_array_2d().map(list);
    let [low, high] = world_box(volume);
    let (slope, intercept) = volume.rescale();
    let guess = Guess::of(volume);
    let mut lines = vec![
        ("dimensions", format!("{nx} x {ny} x {nz} = {} voxels", grid.voxel_count())),
        ("type", format!("{kind}{}, {mib:.1} MiB", components(volume.channels()))),
        ("spacing", list(grid.spacing()) + &volume.unit().map_or_else(String::new, |unit| format!(" {}s", unit.name()))),
        ("origin", list(grid.origin().to_array())),
        ("axes", format!("({}) ({}) ({})", axes[0], axes[1], axes[2])),
        ("space", space(volume).unwrap_or("not stated").to_owned()),
        (
            "orientation",
            orientation(volume)
                .map_or_else(|| "not known".to_owned(), |o| format!("{o} (where the axes x, y and z of the voxels lead to)")),
        ),
        ("box", format!("({}) to ({})", list(low), list(high))),
        ("modality", volume.modality().name().unwrap_or("not stated").to_owned()),
    ];
    if colors {
        let from = match OpacityFrom::usual(volume.channels()) {
            Some(OpacityFrom::Alpha) => "alpha",
            _ => "luma (--transfer.opacity points, over 0 to 1)",
        };
        lines.push(("opacity", format!("by {from}; --transfer.opacity_from: another number, --volume.channel 0: red as values")));
    } else {
        let taken = match &labels {
            Some((values, _)) => {
                let shown = values.iter().filter(|&&label| label != 0).count();
                format!("a label map of {shown} segments; first picture with a colour for each")
            }
            None => format!("{}; first picture with {}", guess.reason, guess.preset.name()),
        };
        lines.push(("taken for", taken));
        lines.push(("values", format!("{} to {}, mean {}", short(s.min), short(s.max), short(s.mean))));
    }
    if (slope, intercept) != (1.0, 0.0) {
        lines.push(("rescale", format!("value = {} * stored + {}", short(slope), short(intercept))));
    }
    if s.non_finite > 0 {
        lines.push(("non-finite", format!("{} voxels are NaN or infinite: transparent", s.non_finite)));
    }
    if let Some(depths) = depths {
        let between = |[near, far]: [f64; 2]| format!("{} to {}", short(near), short(far));
        let seen = depths.visible.map_or_else(String::new, |visible| format!(", what shows from {}", between(visible)));
        lines.push(("eye to", format!("box from {}{seen}", between(depths.whole))));
    }
    if !colors {
        lines.push(("histogram", histogram(&s.histogram)));
        lines.push(("", format!("{:<half$}{:>half$}", short(s.min), short(s.max), half = COLUMNS / 2)));
    }
    let name = if volume.name().is_empty() { "volume" } else { volume.name() };
    let mut text = format!("{name}\n");
    for (label, value) in lines {
        text += &format!("  {label:12}{value}\n");
    }
    for detail in volume.details() {
        text += &format!("  {:12}{detail}\n", "placed by");
    }
    for note in volume.notes() {
        text += &format!("  {:12}{note}\n", "note");
    }
    text += &listed(items);
    if colors {
        return text;
    }
    if let Some((values, segments)) = &labels {
        return text + &listed_segments(values, segments);
    }
    text += "presets\n";
    // Presets that one reason speaks against stand in one line.
    let mut against: Vec<(String, Vec<&str>)> = Vec::new();
    for (preset, why) in verdicts(volume) {
        let Some(why) = why else {
            text += &format!("  + {:18}{}\n", preset.name(), preset.about());
            continue;
        };
        let why = why.strip_prefix(preset.name()).unwrap_or(&why).trim_start_matches([':', ' ']).to_owned();
        match against.iter_mut().find(|a| a.0 == why) {
            Some((_, names)) => names.push(preset.name()),
            None => against.push((why, vec![preset.name()])),
        }
    }
    for (why, names) in against {
        text += &format!("  - {}: {why}\n", names.join(", "));
    }
    text
}

/// Labels that occur in a volume that is a label map, and what its file calls them; nothing for other volumes.
fn own_labels(volume: &Volume) -> Option<(Vec<i64>, Vec<Segment>)> {
    let map = volume.own_labels().ok().flatten()?;
    Some((map.values().to_vec(), map.segments().to_vec()))
}

/// Most labels that are listed.
const LISTED: usize = 32;

/// A line for each label: itself, its name and its colour, as far as the file gives any.
fn listed_segments(values: &[i64], segments: &[Segment]) -> String {
    let mut text = "labels\n".to_owned();
    for label in values.iter().take(LISTED) {
        let segment = segments.iter().find(|s| s.value == *label);
        let name = segment.map_or("", |s| s.name.as_str());
        let color = segment.and_then(|s| s.color).map_or_else(String::new, |c| format!("  colour {}", c.map(short).join(" ")));
        text += format!("  {label:<12}{name}{color}").trim_end();
        text += "\n";
    }
    if values.len() > LISTED {
        text += &format!("  ... {} more\n", values.len() - LISTED);
    }
    text
}

/// What the numbers of a voxel are, where there is more than one.
fn components(channels: &Channels) -> &'static str {
    match channels {
        Channels::Rgba => " x 4, red, green, blue and alpha",
        Channels::Rgb => " x 3, red, green and blue, kept with an alpha of 1",
        _ => "",
    }
}

/// What there is to choose from, a line each: those that are taken with a `*`.
fn listed(items: &[Item]) -> String {
    let mut text = String::new();
    for item in items {
        if text.is_empty() {
            text += "choices\n";
        }
        let id = match item.count {
            1 if item.id.contains(char::is_whitespace) => format!("{:?}", item.id),
            1 => item.id.clone(),
            n => format!("{} to {}", item.id, n - 1),
        };
        let mark = if item.taken { '*' } else { ' ' };
        text += &format!("  {mark} {:18} {}\n", format!("{} {id}", item.part), item.about);
    }
    text
}

fn item_json(item: &Item) -> Value {
    json!({ "part": item.part.name(), "id": item.id, "count": item.count, "about": item.about, "taken": item.taken })
}

/// Loads the volume; where that fails and there is a choice, what there is to choose from is told too.
fn load_listed(source: &VolumeSource, limits: &Limits, items: &[Item], json: bool) -> Result<Volume> {
    let bar = Arc::new(Bar::new());
    let volume = source.load_told(limits, Some(bar.clone()));
    bar.clear();
    volume.or_else(|e| {
        if !items.is_empty() && !json {
            print(listed(items).as_bytes())?;
        }
        Err(e.into())
    })
}

/// Up to six significant digits.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-4..1e9).contains(&x.abs()) {
        return format!("{x:.4e}");
    }
    let digits = if x.abs() >= 100.0 { 2 } else { 5 };
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A bar a column, its height the logarithm of the count: rare values show beside a large background.
fn histogram(counts: &[u64]) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let columns: Vec<u64> = counts.chunks(counts.len().div_ceil(COLUMNS).max(1)).map(|c| c.iter().sum()).collect();
    let most = libm::log1p(columns.iter().copied().max().unwrap_or(0) as f64);
    let bar = |&count: &u64| {
        if count == 0 { ' ' } else { BARS[((libm::log1p(count as f64) / most * 8.0) as usize).min(7)] }
    };
    columns.iter().map(bar).collect()
}
