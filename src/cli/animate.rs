//! `slicestack animate`: frames between key frames.

use super::movie::{Movie, MovieArgs};
use super::scene::{SceneArgs, load};
use super::{Usage, complain};
use anyhow::{Result, anyhow, bail};
use slicestack::picture::MAX_FRAMES;
use slicestack::scene::Animation;
use std::path::{Path, PathBuf};

/// What `animate` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct AnimateArgs {
    /// List of key frames (.toml): moments, each with keys of a scene.
    #[arg(value_name = "KEYS.toml")]
    keys: PathBuf,
    #[command(flatten)]
    movie: MovieArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Key frames:
  scene = \"head.toml\"                 relative to this file; or volume = \"head.nrrd\", or [SCENE|VOLUME] beside it
  ease = \"smooth\"                     slow at every key; or \"linear\"
  [[key]]
  time = 0                            seconds
  camera.azimuth = 0
  [[key]]
  time = 4
  camera.azimuth = 360                numbers and lists of numbers go from key to key; words hold

Examples:
  slicestack animate keys.toml -o around.gif
  slicestack animate keys.toml head.nrrd -o frames --fps 30     a PNG a frame, resumed where it was stopped";

pub(super) fn run(args: &AnimateArgs) -> Result<()> {
    let animation = Animation::read(&args.keys)?;
    let named = animation.scene().is_some() || animation.volume().is_some();
    if named && args.scene.input.is_some() {
        bail!(Usage(format!("{}: names a scene or a volume itself; leave the one beside it out", args.keys.display())));
    }
    if !named && !args.scene.names_a_volume() {
        bail!(Usage(format!("{}: names no scene and no volume; name one in it or beside it", args.keys.display())));
    }
    let (text, overrides) = args.scene.read()?;
    let mut inputs: Vec<&Path> = vec![&args.keys];
    inputs.extend(args.scene.input.as_deref().into_iter().chain(animation.scene()).chain(animation.volume()));
    let movie = Movie::new(&args.movie, args.scene.limits(), &inputs)?;
    // The last moment is shown too, unless it leads back to the first: then it is that one.
    let steps = (animation.duration() * f64::from(args.movie.fps)).round() as u32;
    if !(1..=MAX_FRAMES).contains(&steps) {
        bail!(Usage(format!("{}: makes {steps} frames; there can be 1 to {MAX_FRAMES}", args.keys.display())));
    }
    // What a picture is fitted to would change from frame to frame, and its size with it.
    let mut usual = overrides.clone();
    if !animation.sets("camera.fit")
        && !args.scene.has("camera.fit")
        && !["camera.eye", "camera.along"].iter().any(|key| animation.sets(key) || args.scene.has(key))
        && animation.scene().is_none()
        && !text.is_file()
    {
        usual.set("camera.fit", "box");
    }
    let open = |time: f64| -> Result<_> {
        let opened = if named { animation.scene_at(time, &usual).map_err(Into::into) } else { text.open(&animation.at(time, &usual)) };
        opened.map_err(|e| anyhow!("{}: at {time:.2} s: {}", args.keys.display(), e.to_string().trim_start_matches("--")))
    };
    for path in animation.jumps() {
        complain("warning", &format!("{path}: its lists differ in length from key to key: it jumps there instead of moving"));
    }
    let first = open(0.0)?;
    movie.spare(first.volume().path())?;
    let volume = load(first.volume(), movie.limits())?;
    let mut scenes = Vec::with_capacity(steps as usize + 1);
    for n in 0..=steps {
        let found = open(f64::from(n) / f64::from(args.movie.fps))?.resolve(&volume)?;
        if n == 0 {
            found.notes.iter().for_each(|note| complain("note", note));
            found.warnings.iter().for_each(|w| complain("warning", w));
        }
        scenes.push(found.scene);
    }
    if returns(&scenes) {
        scenes.pop();
    }
    movie.make(&scenes, &volume)
}

/// Whether the last scene is the first again, as far as a picture shows: a full turn leads back to it.
fn returns(scenes: &[slicestack::Scene]) -> bool {
    let (Some(first), Some(last)) = (scenes.first(), scenes.last()) else { return false };
    let same = first.clone().with_camera(*last.camera()) == *last;
    let angles = |scene: &slicestack::Scene| match scene.camera().placement() {
        slicestack::scene::Placement::Orbit { azimuth, elevation, roll, zoom } => Some([azimuth, elevation, roll, zoom]),
        _ => None,
    };
    let turned = match (angles(first), angles(last)) {
        (Some(a), Some(b)) => (0..3).all(|i| (a[i] - b[i]).rem_euclid(360.0) == 0.0) && a[3] == b[3],
        _ => first.camera() == last.camera(),
    };
    scenes.len() > 1 && same && turned && first.camera().projection() == last.camera().projection()
}
