//! `slicestack turntable`: once around the volume.

use super::Usage;
use super::complain;
use super::output::{Sink, is_picture};
use super::progress::{Bar, Phase, catch_signals, enter, rendered};
use super::scene::{SceneArgs, level};
use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};
use slicestack::picture::{Animated, AnimatedFormat, Depth, Format, MAX_FRAMES, write_whole};
use slicestack::scene::{ResolvedScene, Scene};
use slicestack::{Picture, Progress, Renderer, Settings, Volume};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What `turntable` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct TurntableArgs {
    /// Where to: .gif, .png (animated), .webp, or a folder for a PNG a frame, which goes on where it was stopped.
    #[arg(short, long, value_name = "OUT", default_value = "turntable.gif")]
    output: PathBuf,
    /// Frames of one turn.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FRAMES)))]
    frames: u32,
    /// Frames a second.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100))]
    fps: u32,
    /// Worker threads; one per core unless given. The pictures are the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=4096))]
    threads: Option<u64>,
    /// Vector level: auto (the fastest here), scalar, wide, ...
    #[arg(long, value_name = "LEVEL", default_value = "auto")]
    simd: String,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  slicestack turntable head.nrrd -o head.gif --background black
  slicestack turntable scene.toml -o turn.webp --frames 120 --fps 30 --size 640x480
  slicestack turntable ct.nii.gz --preset ct-bone -o frames/     a PNG a frame, resumed where it was stopped";

/// The file in a folder of frames that says what they are of.
const OF: &str = "turntable.txt";

/// The bar over all frames.
struct Frames {
    bar: Arc<Bar>,
    done: AtomicU64,
    total: u64,
}

/// Steps of a frame: the renderer's are told in shares of it.
const STEPS: u64 = 1000;

impl Progress for Frames {
    fn step(&self, _: &str, done: u64, total: u64) -> bool {
        let before = self.done.load(Ordering::Relaxed);
        let text = format!("frame {} of {}", (before + 1).min(self.total), self.total);
        self.bar.step(&text, before * STEPS + done * STEPS / total.max(1), self.total * STEPS)
    }

    fn is_stopped(&self) -> bool {
        self.bar.is_stopped()
    }
}

pub(super) fn run(args: &TurntableArgs) -> Result<()> {
    let settings_level = level(&args.simd)?;
    let (text, overrides) = args.scene.read()?;
    let inputs: Vec<&Path> = args.scene.input.as_deref().into_iter().collect();
    let into = Into::new(&args.output, &inputs)?;
    catch_signals()?;
    let scene_file = text.open(&overrides)?;
    if let (Some(path), Into::File(sink, _)) = (scene_file.volume().path(), &into) {
        sink.spare("picture", is_picture, &[path])?;
    }
    let frames = Arc::new(Frames { bar: Arc::new(Bar::new()), done: AtomicU64::new(0), total: u64::from(args.frames) });
    let settings = Settings::new()
        .threads(args.threads.map(|n| n as usize))
        .level(settings_level)
        .limits(args.scene.limits())
        .progress(Arc::clone(&frames) as Arc<dyn Progress>);
    let volume = scene_file.volume().load(&settings.limits)?;
    let ResolvedScene { scene, warnings, notes, .. } = scene_file.resolve(&volume)?;
    let cameras = scene_file.turntable(&scene, &volume, args.frames)?;
    notes.iter().for_each(|note| complain("note", note));
    warnings.iter().for_each(|w| complain("warning", w));
    let scenes: Vec<Scene> = cameras.into_iter().map(|camera| scene.clone().with_camera(camera)).collect();
    enter(Phase::Rendering);
    let mut renderer = Renderer::new(&volume, settings);
    let mut picture = |n: usize| -> Result<Picture> {
        let picture = renderer.render(&scenes[n])?.0;
        frames.done.fetch_add(1, Ordering::Relaxed);
        Ok(picture)
    };
    match &into {
        Into::File(sink, format) => {
            let mut animated = Animated::new(*format, scene.size(), args.frames, args.fps)?;
            for n in 0..scenes.len() {
                animated.frame(&picture(n)?)?;
            }
            frames.bar.clear();
            rendered()?;
            let bytes = animated.finish()?;
            enter(Phase::Writing);
            sink.write(&bytes)?;
        }
        Into::Folder(folder) => {
            let of = identity(&scenes, &volume);
            begin(folder, &of)?;
            for n in 0..scenes.len() {
                let path = folder.join(format!("frame-{n:04}.png"));
                if path.exists() {
                    frames.done.fetch_add(1, Ordering::Relaxed);
                    continue;
                }
                let bytes = picture(n)?.encode(Format::Png, Depth::Eight)?;
                write_whole(&path, &bytes)?;
            }
            frames.bar.clear();
            rendered()?;
        }
    }
    enter(Phase::Idle);
    Ok(())
}

/// Where frames go.
enum Into {
    File(Sink, AnimatedFormat),
    Folder(PathBuf),
}

impl Into {
    /// What `output` names: a file by its extension, else a folder.
    ///
    /// # Errors
    /// For a file that is there and no picture, and a name of another format.
    fn new(output: &Path, inputs: &[&Path]) -> Result<Self> {
        if let Some(format) = AnimatedFormat::of_path(output).filter(|_| !output.is_dir()) {
            let sink = Sink::new(output)?;
            sink.spare("picture", is_picture, inputs)?;
            return Ok(Self::File(sink, format));
        }
        if output.extension().is_some() && !output.is_dir() {
            bail!(Usage(format!("{}: write .gif, .png or .webp, or the name of a folder", output.display())));
        }
        if output.exists() && !output.is_dir() {
            bail!(Usage(format!("{}: is there already and is no folder", output.display())));
        }
        Ok(Self::Folder(output.to_path_buf()))
    }
}

/// What the frames in a folder are of, as a number: scenes and volume.
fn identity(scenes: &[Scene], volume: &Volume) -> String {
    let mut hash = Sha256::new();
    hash.update(env!("CARGO_PKG_VERSION"));
    hash.update(format!("{scenes:?} {:?} {:?} {:?}", volume.grid(), volume.rescale(), volume.statistics()));
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// Makes `folder` ready for frames of `of`, or finds it so.
///
/// # Errors
/// For a folder that holds anything else, or frames of something else.
fn begin(folder: &Path, of: &str) -> Result<()> {
    let note = folder.join(OF);
    if let Ok(found) = std::fs::read_to_string(&note) {
        if found.trim_end() != of {
            bail!("{}: holds frames of another turntable; remove it or choose another name", folder.display());
        }
        return Ok(());
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    if entries.next().is_some() {
        bail!("{}: is there already and not empty", folder.display());
    }
    Sink::new(&note)?.write(format!("{of}\n").as_bytes())
}
