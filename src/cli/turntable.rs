//! `slicestack turntable`: once around the volume.

use super::complain;
use super::movie::{Movie, MovieArgs};
use super::scene::{SceneArgs, load};
use anyhow::Result;
use slicestack::Scene;
use slicestack::picture::MAX_FRAMES;
use slicestack::scene::ResolvedScene;
use std::path::Path;

/// What `turntable` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct TurntableArgs {
    /// Frames of one turn.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FRAMES)))]
    frames: u32,
    #[command(flatten)]
    movie: MovieArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  slicestack turntable head.nrrd -o head.gif --background black
  slicestack turntable scene.toml -o turn.webp --frames 120 --fps 30 --size 640x480
  slicestack turntable ct.nii.gz --preset ct-bone -o frames     a PNG a frame, resumed where it was stopped";

pub(super) fn run(args: &TurntableArgs) -> Result<()> {
    let (text, overrides) = args.scene.read()?;
    let inputs: Vec<&Path> = args.scene.input.as_deref().into_iter().collect();
    let movie = Movie::new(&args.movie, args.scene.limits(), &inputs)?;
    let scene_file = text.open(&overrides)?;
    movie.spare(scene_file.volume().path())?;
    let volume = load(scene_file.volume(), movie.limits())?;
    let ResolvedScene { scene, warnings, notes, .. } = scene_file.resolve(&volume)?;
    let cameras = scene_file.turntable(&scene, &volume, args.frames)?;
    notes.iter().for_each(|note| complain("note", note));
    warnings.iter().for_each(|w| complain("warning", w));
    let scenes: Vec<Scene> = cameras.into_iter().map(|camera| scene.clone().with_camera(camera)).collect();
    movie.make(&scenes, &volume)
}
