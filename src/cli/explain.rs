//! `slicestack explain`.

use super::output::{Outputs, Sink, is_new_folder, is_record};
use super::progress::Bar;
use super::scene::{SceneArgs, load};
use super::signals::go_on;
use super::{Usage, complain, tell};
use anyhow::{Result, bail};
use slicestack::Settings;
use slicestack::explain::{Request, build_up, explain};
use slicestack::picture::{Depth, Format};
use std::io::{IsTerminal, stderr};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames of the picture building up.
const FRAMES: u32 = 32;

/// What `explain` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ExplainArgs {
    /// Folder to write index.html into; made if it is not there.
    #[arg(short, long, value_name = "DIR", default_value = "slicestack-explain")]
    output: PathBuf,
    /// Pixel to begin with, column and row from the upper left; one at which much happens unless given.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pixel: Option<String>,
    /// Slices to show, from A up to but without B.
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    slices: Option<String>,
    /// Write the record as JSON too; - for stdout.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the picture building up into DIR too: frame-00.png and so on, and build-up.png, which is animated.
    #[arg(long)]
    frames: bool,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  slicestack explain scene.toml -o page               page/index.html, for any browser
  slicestack explain head.nrrd --preset mr-brain --pixel 120,200
  slicestack explain scene.toml --slices 100..140 --json record.json
  slicestack explain --volume.phantom cloud --frames -o cloud

The scene takes the same flags as in `slicestack render`.";

pub(super) fn run(args: &ExplainArgs) -> Result<()> {
    let request =
        Request::new().pixel(args.pixel.as_deref().map(pixel).transpose()?).slices(args.slices.as_deref().map(slices).transpose()?);
    let (text, overrides) = args.scene.read()?;
    is_new_folder(&args.output, "--output")?;
    let sink = |name: &str| Sink::File(args.output.join(name));
    let json = args.json.as_deref().map(Sink::new).transpose()?;
    let page = sink("index.html");
    let inputs: Vec<&Path> = args.scene.input.as_deref().into_iter().collect();
    page.spare("page", |start| start.starts_with(b"<!doctype html>"), &inputs)?;
    let pictures: Vec<Sink> = if args.frames {
        ["build-up.png".to_owned()].into_iter().chain((0..FRAMES).map(frame_name)).map(|n| sink(&n)).collect()
    } else {
        Vec::new()
    };
    for picture in &pictures {
        picture.spare("picture", |start| Format::of_start(start) == Some(Format::Png), &inputs)?;
    }
    if let Some(json) = &json {
        json.spare("record", is_record, &inputs)?;
    }

    let scene_file = text.open(&overrides)?;
    let bar = Arc::new(Bar::new());
    let settings = Settings::new().limits(args.scene.limits()).progress(bar.clone());
    if let (Some(path), Some(json)) = (scene_file.volume().path(), &json) {
        json.spare("record", is_record, &[path])?;
    }
    let volume = load(scene_file.volume(), &settings.limits)?;
    let (scene, mut warnings) = scene_file.to_scene(&volume)?;
    let explanation = explain(&volume, &scene, &settings, &request)?;
    warnings.extend(explanation.warnings().iter().cloned());
    let mut files: Vec<(Sink, Vec<u8>)> = vec![(page, explanation.page()?.into_bytes())];
    if args.frames {
        let mut encoded = Vec::new();
        let animated = build_up(&volume, &scene, &settings, FRAMES, |_, frame| {
            encoded.push(frame.encode(Format::Png, Depth::Eight)?);
            Ok(())
        })?;
        let mut sinks = pictures.into_iter();
        // A stack of fewer slices has fewer frames; the animation's place is the first.
        files.extend(sinks.next().map(|s| (s, animated)));
        files.extend(sinks.zip(encoded));
    }
    if let Some(json) = json {
        files.push((json, (explanation.json()? + "\n").into_bytes()));
    }
    bar.clear();
    go_on()?;
    warnings.iter().for_each(|w| complain("warning", w));
    let mut outputs = Outputs::default();
    outputs.folder(&args.output)?;
    files.iter().try_for_each(|(sink, bytes)| outputs.add(sink, bytes))?;
    outputs.finish()?;
    if stderr().is_terminal() {
        let (x, y) = explanation.pixel();
        tell!("{}: open it in a browser; it begins at pixel {x},{y}", args.output.join("index.html").display());
    }
    Ok(())
}

fn frame_name(i: u32) -> String {
    format!("frame-{i:02}.png")
}

/// `X,Y`.
fn pixel(text: &str) -> Result<(u32, u32)> {
    let parts = text.split_once(',').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    match parts {
        Some((Ok(x), Ok(y))) => Ok((x, y)),
        _ => bail!(Usage(format!("--pixel {text}: write column,row, such as 120,200"))),
    }
}

/// `A..B`.
fn slices(text: &str) -> Result<Range<u64>> {
    let parts = text.split_once("..").map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match parts {
        Some((Ok(start), Ok(end))) if start < end => Ok(start..end),
        Some((Ok(start), Ok(end))) => {
            let what = if start == end { "empty" } else { "reversed" };
            bail!(Usage(format!(
                "--slices {text}: the range is {what}; it runs from A up to but without B, such as {}..{}",
                start.min(end),
                start.max(end).saturating_add(1)
            )))
        }
        _ => bail!(Usage(format!("--slices {text}: write FROM..TO, such as 100..140"))),
    }
}
