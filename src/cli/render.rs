//! `slicestack render`.

use super::output::{Outputs, Sink, encoding, is_picture, is_plane, is_statistics, print};
use super::paged;
use super::progress::Bar;
use super::saved::{SavedScene, is_saved_scene};
use super::scene::{SceneArgs, level, load, threads};
use super::signals::go_on;
use super::stats::{self, Clock};
use super::{Usage, complain, show, tell};
use anyhow::{Result, anyhow, bail};
use clap::builder::{PossibleValue, PossibleValuesParser};
use slicestack::annotate::{annotate, check};
use slicestack::picture::{Aov, Depth, Format, Metadata, PlaneFormat};
use slicestack::proof::Provenance;
use slicestack::scene::{ResolvedScene, Slicing};
use slicestack::{Error, Picture, Renderer, Settings};
use std::io::{IsTerminal, stderr, stdout};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What `render` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct RenderArgs {
    #[arg(short, long, value_name = "OUT", default_value = "slicestack.png", help = format!("Picture to write: {}; - for stdout", Format::choices()))]
    output: PathBuf,
    #[arg(long, value_parser = formats(), hide_possible_values = true, help = format!("Format, where the name of OUT does not tell it: {}", Format::ALL.map(Format::name).join(", ")))]
    format: Option<String>,
    /// Bits of the components of a PNG or TIFF.
    #[arg(long, value_parser = ["8", "16"], default_value = "8")]
    depth: String,
    /// Render so often, and report the shortest time.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
    /// Write statistics as JSON; - for stdout.
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Estimate the RMS error of the colours, from a second picture of twice as many slices; told here and in --stats.
    #[arg(long)]
    estimate: bool,
    /// Write planes of f32 beside the picture, OUT-depth.npy for OUT.png: of the first surface, or where opacity passes a half; alpha: the volume's.
    #[arg(long, value_name = "PLANE", value_delimiter = ',', value_parser = Aov::ALL.map(Aov::name))]
    aov: Vec<String>,
    /// Format of the planes.
    #[arg(long, value_parser = ["npy", "exr"], default_value = "npy")]
    aov_format: String,
    /// Show the picture in the terminal: by kitty's or iTerm2's protocol, else as half blocks in colour.
    #[arg(long)]
    show: bool,
    /// Write the scene as a scene file (.toml, .json), presets and defaults resolved: `slicestack render FILE` makes the same picture.
    #[arg(long, value_name = "FILE")]
    save_scene: Option<PathBuf>,
    /// Leave out of the picture what `slicestack verify` needs: the scene, the version, the SHA-256 of pixels and volume. No path is among it.
    #[arg(long)]
    no_metadata: bool,
    /// Tell on stderr where the work went, what the picture did not need, and why.
    #[arg(long)]
    explain: bool,
    /// Worker threads; one per core unless given. The picture is the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    threads: Option<u64>,
    /// Side of a screen tile in pixels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(slicestack::scene::MAX_SIDE)))]
    tile: Option<u32>,
    /// Vector level: auto (the fastest here), scalar, wide, ...
    #[arg(long, value_name = "LEVEL", default_value = "auto")]
    simd: String,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  slicestack render head.nrrd -o head.png
  slicestack render ct.nii.gz --preset ct-bone --azimuth -40 --background white
  slicestack render ct.raw --volume.dimensions 256,256,113 --volume.type i16 --volume.spacing 1,1,2
  slicestack render scene.toml --slices.count 1024 --fog.mode exp2 --fog.density 0.01
  slicestack render scene.toml -o - --format npy | python3 -c 'import sys, numpy; ...'
  slicestack render head.nrrd --preset mr-brain --save-scene head.toml
  slicestack render huge.ome.zarr --memory 1GiB -o huge.png      a volume larger than memory";

/// What `--format` takes: each format by its usual extension, with the others as further names.
pub(super) fn formats() -> PossibleValuesParser {
    let value = |f: Format| PossibleValue::new(f.name()).aliases(&f.extensions()[1..]).help(f.about());
    Format::ALL.map(value).into()
}

pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let settings_level = level(&args.simd)?;
    let (text, overrides) = args.scene.read_for_pieces()?;
    let sink = Sink::new(&args.output)?;
    let (format, depth) = encoding(&sink, args.format.as_deref(), &args.depth)?;
    let stats_sink = args.stats.as_deref().map(Sink::new).transpose()?;
    if sink == Sink::Stdout && stats_sink == Some(Sink::Stdout) {
        bail!(Usage("picture and statistics cannot both go to stdout".into()));
    }
    let inputs: Vec<&Path> = args.scene.input.as_deref().into_iter().collect();
    sink.spare("picture", is_picture, &inputs)?;
    if let Some(stats_sink) = &stats_sink {
        stats_sink.spare("file of statistics", is_statistics, &inputs)?;
        if *stats_sink == sink {
            bail!(Usage(format!("{}: picture and statistics cannot both go there", args.output.display())));
        }
    }
    if args.show && sink == Sink::Stdout {
        bail!(Usage("--show: the picture goes to stdout itself".into()));
    }
    if args.show && std::env::var("TERM").is_ok_and(|term| term == "dumb") {
        bail!(Usage("--show: this terminal has no colours (TERM=dumb)".into()));
    }
    if args.show && !stdout().is_terminal() {
        bail!(Usage("--show: stdout is no terminal".into()));
    }
    if args.scene.memory.is_some() && !args.aov.is_empty() {
        bail!(Usage("--aov: planes are looked up in the whole volume; leave out --memory".into()));
    }
    let planes = Planes::new(args, &sink, &inputs)?;
    let saved = args.save_scene.as_deref().map(SavedScene::new).transpose()?;
    if let Some(saved) = &saved {
        saved.sink.spare("scene saved by this command", is_saved_scene, &inputs)?;
        if saved.sink == sink || Some(&saved.sink) == stats_sink.as_ref() {
            bail!(Usage(format!("--save-scene {}: something else goes there already", saved.path.display())));
        }
    }

    let scene_file = text.open(&overrides)?;
    let annotations = scene_file.annotations();
    if annotations.any() {
        refuse_numbers(format)?;
    }
    let bar = Arc::new(Bar::new());
    let settings = Settings::new()
        .threads(threads(args.threads))
        .tile(args.tile)
        .level(settings_level)
        .limits(args.scene.limits())
        .estimate(args.estimate)
        .progress(bar.clone());
    let mut clock = Clock::default();
    let start = Instant::now();
    if let Some(path) = scene_file.volume().path() {
        sink.spare("picture", is_picture, &[path])?;
        if let Some(stats_sink) = &stats_sink {
            stats_sink.spare("file of statistics", is_statistics, &[path])?;
        }
        planes.spare(&[path])?;
        if let Some(saved) = &saved {
            saved.sink.spare("scene saved by this command", is_saved_scene, &[path])?;
        }
    }
    if let Some(memory) = args.scene.memory {
        let out = paged::Targets {
            sink: &sink,
            format,
            depth,
            stats: stats_sink.as_ref(),
            saved,
            show: args.show,
            explain: args.explain,
            metadata: !args.no_metadata,
            repeat: args.repeat,
        };
        return paged::run(&scene_file, memory, settings, &bar, out);
    }
    let volume = load(scene_file.volume(), &settings.limits).map_err(|e| match e.downcast_ref() {
        Some(Error::Limit { .. }) => anyhow!("{e}; with --memory SIZE a file that can be mapped is rendered piece by piece"),
        _ => e,
    })?;
    sink.spare_read()?;
    clock.load = start.elapsed().as_secs_f64();
    // Presets look at the voxels, and keep what they found for the frame.
    let start = Instant::now();
    let ResolvedScene { scene, mut warnings, notes, .. } = scene_file.resolve(&volume)?;
    clock.prepare = start.elapsed().as_secs_f64();

    check(&annotations, &scene)?;
    let mut renderer = Renderer::new(&volume, settings);
    let (mut picture, mut stats, seen) = renderer.render_with(&scene, &planes.wanted)?;
    clock.prepare += stats.prepare_seconds;
    clock.render = stats.render_seconds;
    for _ in 1..args.repeat {
        (picture, stats) = renderer.render(&scene)?;
        clock.render = clock.render.min(stats.render_seconds);
    }
    bar.clear();
    warnings.extend(stats.warnings.iter().cloned());
    notes.iter().for_each(|note| complain("note", note));
    let notes: Vec<String> = volume.notes().iter().cloned().chain(notes).collect();
    let annotated = if annotations.any() { Some(annotate(&picture, &annotations, &scene, &volume)?) } else { None };
    if let Some((_, left_out)) = &annotated {
        warnings.extend(left_out.iter().cloned());
    }
    warnings.iter().for_each(|w| complain("warning", w));

    go_on()?;
    let start = Instant::now();
    let metadata = if args.no_metadata || !format.carries_metadata() || annotated.is_some() {
        Metadata::new()
    } else {
        // A table too large for a scene file is the one thing that a picture cannot carry.
        match Provenance::of(&scene, scene_file.volume(), &volume, &picture) {
            Err(e @ Error::Limit { .. }) => {
                complain("warning", &format!("the picture carries no scene: {e}"));
                Metadata::new()
            }
            provenance => provenance?.metadata()?,
        }
    };
    let bytes = annotated.as_ref().map_or(&picture, |a| &a.0).encode_with(format, depth, &metadata)?;
    let saved =
        saved.map(|saved| Ok::<_, anyhow::Error>((saved.text(&scene, scene_file.volume(), &annotations)?, saved.sink))).transpose()?;
    let plane_bytes = seen.iter().map(|plane| plane.encode(planes.format)).collect::<Result<Vec<_>, _>>()?;
    clock.encode = start.elapsed().as_secs_f64();
    let mut outputs = Outputs::default();
    outputs.add(&sink, &bytes)?;
    planes.sinks.iter().zip(&plane_bytes).try_for_each(|(to, bytes)| outputs.add(to, bytes))?;
    if let Some((text, to)) = &saved {
        outputs.add(to, text.as_bytes())?;
    }
    if let Some(stats_sink) = &stats_sink {
        let told = stats::Told { depths: scene.depths(&volume), warnings, notes };
        let text = serde_json::to_string_pretty(&stats::json(clock, &stats, &told, &picture, &volume))? + "\n";
        outputs.add(stats_sink, text.as_bytes())?;
    }
    outputs.finish()?;
    if args.show {
        shown(&picture)?;
    }
    if let Some(error) = stats.error_estimate.filter(|_| args.estimate) {
        tell!("estimated RMS error of the colours: {error:.2e} in {}", stats::counted(stats.slices, "slice"));
    }
    if args.repeat > 1 {
        tell!(
            "shortest of {}: {:.3} ms a picture, {:.3} ms of preparation before the first",
            args.repeat,
            1e3 * clock.render,
            1e3 * clock.prepare
        );
    }
    if args.explain {
        if !scene_file.says_slices() {
            let told = match scene.slicing() {
                Slicing::Tolerance(error) => format!("as many slices as an error of {error} takes, one of 256 levels"),
                Slicing::Spacing(spacing) => format!("slices {spacing} apart, half a voxel"),
                _ => stats::counted(stats.slices, "slice"),
            };
            tell!("{told}: the scene asks for no number of slices\n");
        }
        tell!("{}", stats::explain(&stats, &picture).trim_end_matches('\n'));
    } else if let Sink::File(path) = &sink {
        tell_written(path, format, clock);
    }
    Ok(())
}

/// Shows `picture` in the terminal.
pub(super) fn shown(picture: &Picture) -> Result<()> {
    let png = picture.encode(Format::Png, Depth::Eight)?;
    let protocol = show::Protocol::of(|name| std::env::var(name).ok());
    print(show::shown(picture, &png, protocol, show::size()).as_bytes())
}

/// Refuses annotations where pictures are arrays of numbers: whoever reads them computes with them, and ink is no result.
///
/// # Errors
/// [`Usage`] for the format that holds such arrays.
pub(super) fn refuse_numbers(format: Format) -> Result<()> {
    if format == Format::Npy {
        bail!(Usage(
            "annotate: a .npy file holds numbers to compute with, nothing is drawn on them; write .png, .exr or another picture".into()
        ));
    }
    Ok(())
}

/// Planes beside the picture, and where they go.
struct Planes {
    wanted: Vec<Aov>,
    sinks: Vec<Sink>,
    format: PlaneFormat,
}

impl Planes {
    /// Those that `args` ask for beside a picture in `sink`.
    ///
    /// # Errors
    /// [`Usage`] where the picture goes to stdout, and for a plane whose file is there already and is none.
    fn new(args: &RenderArgs, sink: &Sink, inputs: &[&Path]) -> Result<Self> {
        let format = if args.aov_format == "exr" { PlaneFormat::Exr } else { PlaneFormat::Npy };
        let wanted: Vec<Aov> = Aov::ALL.into_iter().filter(|aov| args.aov.iter().any(|name| name == aov.name())).collect();
        let beside = |aov: &Aov| match sink {
            Sink::File(path) => {
                let mut name = path.file_stem().unwrap_or_default().to_os_string();
                name.push(format!("-{}.{}", aov.name(), format.extension()));
                Sink::new(&path.with_file_name(name))
            }
            Sink::Stdout => bail!(Usage(format!("--aov {}: goes beside a picture file; the picture goes to stdout", aov.name()))),
        };
        let planes = Self { sinks: wanted.iter().map(beside).collect::<Result<_>>()?, wanted, format };
        planes.spare(inputs)?;
        Ok(planes)
    }

    /// Refuses to replace what is no plane, and `inputs`.
    fn spare(&self, inputs: &[&Path]) -> Result<()> {
        self.sinks.iter().try_for_each(|sink| sink.spare("plane", is_plane, inputs))
    }
}

/// Tells on a terminal what was written, and how long that took.
pub(super) fn tell_written(path: &Path, format: Format, clock: Clock) {
    if !stderr().is_terminal() {
        return;
    }
    let Clock { load, prepare, render, encode } = clock;
    tell!(
        "{}: {} written; read {load:.2} s, prepared {prepare:.2} s, rendered {render:.2} s, encoded {encode:.2} s",
        path.display(),
        format.name()
    );
}
