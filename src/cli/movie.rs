//! Frames one after the other: where they go, and how far they have come.

use super::output::{Sink, is_picture};
use super::progress::Bar;
use super::scene::{level, threads};
use super::signals::go_on;
use super::{Usage, complain};
use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};
use slicestack::files::write_whole;
use slicestack::picture::{Animated, AnimatedFormat, Depth, Format};
use slicestack::{Limits, Progress, Renderer, Scene, Settings, Volume};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What every command that makes frames takes.
#[derive(Debug, clap::Args)]
pub(super) struct MovieArgs {
    /// Where to: .gif, .png (animated), .webp, or a folder for a PNG a frame, which goes on where it was stopped.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Frames a second.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(super) fps: u32,
    /// Worker threads; one per core unless given. The pictures are the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    threads: Option<u64>,
    /// Vector level: auto (the fastest here), scalar, wide, ...
    #[arg(long, value_name = "LEVEL", default_value = "auto")]
    simd: String,
}

/// The file in a folder of frames that says what they are of.
const OF: &str = "frames.txt";

/// Steps of a frame: the renderer's are told in shares of it.
const STEPS: u64 = 1000;

/// The bar over all frames.
pub(super) struct Frames {
    bar: Bar,
    /// What one of them is called.
    what: &'static str,
    done: AtomicU64,
    total: AtomicU64,
}

impl Frames {
    pub(super) fn new(what: &'static str, total: u64) -> Self {
        Self { bar: Bar::new(), what, done: AtomicU64::new(0), total: AtomicU64::new(total) }
    }

    /// One more is done.
    pub(super) fn next(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// Takes the bar off the screen.
    pub(super) fn clear(&self) {
        self.bar.clear();
    }
}

impl Progress for Frames {
    fn step(&self, _: &str, done: u64, total: u64) -> bool {
        let (before, all) = (self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed));
        let text = format!("{} {} of {all}", self.what, (before + 1).min(all));
        self.bar.step(&text, before * STEPS + done * STEPS / total.max(1), all * STEPS)
    }

    fn is_stopped(&self) -> bool {
        self.bar.is_stopped()
    }
}

/// Frames on their way to a file or a folder.
pub(super) struct Movie {
    into: Into,
    per_second: u32,
    settings: Settings,
    frames: Arc<Frames>,
}

impl Movie {
    /// As `args` say, with volumes read within `limits`; none of `inputs` is replaced.
    ///
    /// # Errors
    /// [`Usage`] for a name that is taken or of no format, and a level that this machine does not have.
    pub(super) fn new(args: &MovieArgs, limits: Limits, inputs: &[&Path]) -> Result<Self> {
        let frames = Arc::new(Frames::new("frame", 1));
        let settings = Settings::new()
            .threads(threads(args.threads))
            .level(level(&args.simd)?)
            .limits(limits)
            .progress(Arc::clone(&frames) as Arc<dyn Progress>);
        Ok(Self { into: Into::new(&args.output, inputs)?, per_second: args.fps, settings, frames })
    }

    pub(super) fn limits(&self) -> &Limits {
        &self.settings.limits
    }

    /// Refuses to replace `input`.
    ///
    /// # Errors
    /// [`Usage`] naming it.
    pub(super) fn spare(&self, input: Option<&Path>) -> Result<()> {
        match (&self.into, input) {
            (Into::File(sink, _), Some(path)) => sink.spare("picture", is_picture, &[path]),
            _ => Ok(()),
        }
    }

    /// Renders `scenes` of `volume`, and writes them.
    ///
    /// # Errors
    /// As rendering and writing.
    pub(super) fn make(self, scenes: &[Scene], volume: &Volume) -> Result<()> {
        let Self { into, per_second, settings, frames } = self;
        frames.total.store(scenes.len() as u64, Ordering::Relaxed);
        let mut renderer = Renderer::new(volume, settings);
        let clear = scenes.iter().any(|s| s.background().alpha < 1.0);
        if clear && matches!(into, Into::File(_, AnimatedFormat::Gif)) {
            complain("note", "GIF has no translucent pixels: give a --background, or write .webp or .png");
        }
        match &into {
            Into::File(sink, format) => {
                sink.spare_read()?;
                let size = scenes.first().map_or((1, 1), Scene::size);
                let mut animated = Animated::new(*format, size, scenes.len() as u32, per_second)?;
                for scene in scenes {
                    animated.frame(&renderer.render(scene)?.0)?;
                    frames.next();
                }
                frames.clear();
                go_on()?;
                let bytes = animated.finish()?;
                sink.write(&bytes)?;
            }
            Into::Folder(folder) => {
                begin(folder, &identity(scenes, volume))?;
                for (n, scene) in scenes.iter().enumerate() {
                    let path = folder.join(format!("frame-{n:04}.png"));
                    if !is_whole(&path)? {
                        write_whole(&path, &renderer.render(scene)?.0.encode(Format::Png, Depth::Eight)?)?;
                    }
                    frames.next();
                }
                frames.clear();
                go_on()?;
            }
        }
        Ok(())
    }
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
        if output.is_dir() {
            return Ok(Self::Folder(output.to_path_buf()));
        }
        if let Some(format) = AnimatedFormat::of_path(output) {
            let sink = Sink::new(output)?;
            sink.spare("picture", is_picture, inputs)?;
            return Ok(Self::File(sink, format));
        }
        if output.exists() || output.extension().is_some() {
            bail!(Usage(format!("{}: write .gif, .png or .webp, or the name of a folder", output.display())));
        }
        Ok(Self::Folder(output.to_path_buf()))
    }
}

/// Whether a whole frame is at `path`: one that was cut short is made again.
///
/// # Errors
/// For a file that is no frame.
fn is_whole(path: &Path) -> Result<bool> {
    let bytes = match std::fs::read(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        read => read.with_context(|| path.display().to_string())?,
    };
    if !bytes.starts_with(b"\x89PNG") {
        bail!("{}: is there already and is no frame", path.display());
    }
    Ok(bytes.ends_with(b"IEND\xae\x42\x60\x82"))
}

/// What the frames in a folder are of, as a number: scenes and volume.
fn identity(scenes: &[Scene], volume: &Volume) -> String {
    let mut hash = Sha256::new();
    hash.update(env!("CARGO_PKG_VERSION"));
    hash.update(format!("{scenes:?} {:?} {:?} {:?}", volume.grid(), volume.rescale(), volume.statistics()));
    if volume.colors().is_some() {
        // They have no statistics.
        hash.update(volume.sha256());
    }
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
            bail!("{}: holds frames of something else; remove it or choose another name", folder.display());
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
