//! `slicestack report`.

use super::output::{Outputs, Sink, is_new_folder, print};
use super::progress::Bar;
use super::scene::{SceneArgs, level, load, threads};
use super::{Usage, complain};
use anyhow::{Context, Result, bail};
use slicestack::scene::Slicing;
use slicestack::study::{File, METHODS, NamedMethod, Options, Record, Stability, scene_files, stability, stability_files, study};
use slicestack::{Settings, Volume};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `report` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ReportArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the report; made where it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Check extreme cases instead of a scene: what is promised, what was measured, what holds. Exit status 1 when something does not.
    #[arg(long)]
    stability: bool,
    /// Methods to compare, separated by commas; all unless given.
    #[arg(long, value_name = "LIST")]
    methods: Option<String>,
    /// Seconds the study may take, about.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, allow_hyphen_values = true)]
    budget: f64,
    /// Worker threads; one per core unless given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    threads: Option<u64>,
    /// Vector level: auto (the fastest here), scalar, wide, ...
    #[arg(long, value_name = "LEVEL", default_value = "auto")]
    simd: String,
}

const EXAMPLES: &str = "\
Examples:
  slicestack report scene.toml -o report
  slicestack report head.nrrd -o report --preset mr-brain --budget 20
  slicestack report scene.toml -o report --methods midpoint,pre-integrated,tolerance
  slicestack report --volume.phantom marschner-lobb -o report
  slicestack report --stability -o stability";

pub(super) fn run(args: &ReportArgs) -> Result<()> {
    let level = level(&args.simd)?;
    let methods = methods(args.methods.as_deref())?;
    if !(args.budget > 0.0 && args.budget.is_finite()) {
        bail!(Usage(format!("--budget {}: must be a positive number of seconds", args.budget)));
    }
    let named = args.scene.names_a_volume();
    if named == args.stability {
        let why =
            if named { "--stability has its own scenes: leave out the scene" } else { "name a scene or a volume, or give --stability" };
        bail!(Usage(why.into()));
    }
    let (text, overrides) = args.scene.read()?;
    let folder = Folder::new(&args.output)?;
    let bar = Arc::new(Bar::new());
    let settings = Settings::new().threads(threads(args.threads)).level(level).limits(args.scene.limits()).progress(bar.clone());
    if args.stability {
        let found = stability(&settings)?;
        bar.clear();
        folder.write(&stability_files(&found)?)?;
        print(told_stability(&found, &folder.path).as_bytes())?;
        return match found.broken().count() {
            0 => Ok(()),
            n => bail!("{n} of {} promises do not hold", found.rows.len()),
        };
    }
    let scene_file = text.open(&overrides)?;
    let volume = load(scene_file.volume(), &settings.limits)?;
    let volume = shown_name(volume, args.scene.input.as_deref());
    let (mut scene, warnings) = scene_file.to_scene(&volume)?;
    if !scene_file.says_slices() {
        // Methods are compared in slices that are counted: a tolerance would choose their number itself.
        scene = scene.with_slices(Slicing::Count(256))?;
    }
    let found = study(&volume, &scene, &Options::new().budget(args.budget).methods(methods).settings(settings))?;
    bar.clear();
    warnings.iter().for_each(|w| complain("warning", w));
    folder.write(&scene_files(&found)?)?;
    print(told(&found.record, &folder.path).as_bytes())
}

/// The volume under the name that the report gives it: the scene's file without its folders, which say more about the machine than
/// about the picture.
fn shown_name(volume: Volume, input: Option<&Path>) -> Volume {
    let path = input.map_or_else(|| PathBuf::from(volume.name()), Path::to_path_buf);
    match path.file_stem() {
        Some(stem) => volume.with_name(stem.to_string_lossy()),
        None => volume,
    }
}

fn methods(list: Option<&str>) -> Result<Vec<&'static NamedMethod>> {
    let Some(list) = list else { return Ok(METHODS.iter().collect()) };
    let mut methods: Vec<&NamedMethod> = Vec::new();
    for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
        let method = NamedMethod::named(name).map_err(|e| Usage(format!("--methods: {e}")))?;
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    if methods.is_empty() {
        let names: Vec<&str> = METHODS.iter().map(|m| m.name).collect();
        bail!(Usage(format!("--methods {list}: names no method; there are {}", names.join(", "))));
    }
    Ok(methods)
}

/// The folder of a report.
struct Folder {
    path: PathBuf,
}

impl Folder {
    /// # Errors
    /// When it cannot be made or written to; [`Usage`] when it holds what is no report.
    fn new(path: &Path) -> Result<Self> {
        let new = is_new_folder(path, "--output")?;
        let reported = || ["report.json", "stability.json"].iter().any(|name| path.join(name).is_file());
        if !new && !reported() && fs::read_dir(path).with_context(|| path.display().to_string())?.next().is_some() {
            bail!(Usage(format!("{}: holds other files; name an empty folder, a new one, or one of an earlier report", path.display())));
        }
        Ok(Self { path: path.to_path_buf() })
    }

    /// Writes the files, all or none.
    ///
    /// # Errors
    /// When one cannot be written.
    fn write(&self, files: &[File]) -> Result<()> {
        let mut outputs = Outputs::default();
        outputs.folder(&self.path)?;
        for file in files {
            outputs.add(&Sink::File(self.path.join(&file.name)), &file.bytes)?;
        }
        outputs.finish()
    }
}

/// What a terminal is told of a study.
fn told(record: &Record, folder: &Path) -> String {
    let mut out = format!("{:>10}  {:36} {:>10} {:>10}\n", "error", "cheapest way", "time", "its error");
    for a in &record.advice {
        let way = match (&a.method, a.tolerance, a.slices) {
            (Some(_), Some(t), _) => format!("tolerance = {t}"),
            (Some(m), None, Some(n)) => format!("{m}, {n} slices"),
            _ => "not reached within the budget".into(),
        };
        let number = |x: Option<f64>, say: &dyn Fn(f64) -> String| x.map_or_else(|| "-".into(), say);
        let time = number(a.seconds, &|s| format!("{:.1} ms", 1e3 * s));
        out += &format!("{:>10}  {way:36} {time:>10} {:>10}\n", format!("{:e}", a.error), number(a.rms, &|e| format!("{e:.1e}")));
    }
    if !record.hits.is_empty() {
        out += &format!("{:>12} {:>8} {:>10} {:>10} {:>10} {:>16}\n", "hits", "slices", "time", "RMS error", "largest", "off, in slabs");
    }
    for h in &record.hits {
        let off = h.mean_distance.map_or_else(|| "-".into(), |x| format!("{x:.1e}"));
        let time = format!("{:.1} ms", 1e3 * h.seconds);
        out += &format!("{:>12} {:>8} {time:>10} {:>10.1e} {:>10.1e} {off:>16}\n", h.kind, h.slices, h.rms, h.max);
    }
    for m in &record.methods {
        if let Some(why) = &m.missing {
            out += &format!("{}: not made: {why}\n", m.name);
        }
    }
    if let Some(p) = &record.pre_integration {
        out += &format!("{}\n", p.verdict);
    }
    let s = &record.setting;
    out + &format!("{} pictures in {:.0} s; {}\n", record.points.len(), s.seconds, folder.join("report.html").display())
}

/// What a terminal is told of the extreme cases.
fn told_stability(found: &Stability, folder: &Path) -> String {
    let mut groups: Vec<(&str, usize, usize)> = Vec::new();
    for row in &found.rows {
        match groups.iter_mut().find(|g| g.0 == row.group) {
            Some(group) => *group = (group.0, group.1 + 1, group.2 + usize::from(row.holds)),
            None => groups.push((&row.group, 1, usize::from(row.holds))),
        }
    }
    let mut out = format!("{:20} {:>6} {:>6}\n", "", "rows", "hold");
    for (group, rows, hold) in groups {
        out += &format!("{group:20} {rows:>6} {hold:>6}\n");
    }
    for row in found.broken() {
        out += &format!("does not hold: {}: {}; promised: {}; measured: {}\n", row.group, row.case, row.promise, row.measured);
    }
    if let Some(depth) = found.divergent_from {
        out += &format!("riemann diverges from kappa D = {depth:.2} on\n");
    }
    out + &format!("{:.0} s; {}\n", found.seconds, folder.join("stability.html").display())
}
