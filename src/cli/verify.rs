//! `slicestack verify`: a picture's scene, rendered again.

use super::output::print;
use super::progress::Bar;
use super::scene::ReadingArgs;
use super::signals::go_on;
use super::{Differs, complain};
use anyhow::{Result, bail};
use slicestack::Settings;
use slicestack::proof::{Inputs, MAX_PROOF, verify, verify_bounded};
use std::path::PathBuf;
use std::sync::Arc;

/// What `verify` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct VerifyArgs {
    /// Picture that `slicestack render` made: PNG or OpenEXR.
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,
    /// Volume file that it was made of. A picture does not say where that is.
    #[arg(long, value_name = "FILE")]
    volume: Option<PathBuf>,
    /// File of the label map beside the volume that it was made of.
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// Prove how far N pixels are from the true integral: in interval arithmetic, for pixels that a hash of the scene chooses.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_PROOF))]
    proof: Option<u64>,
    /// How narrow the bounds on the true integral are to be, on colours from 0 to 1.
    #[arg(long, value_name = "W", default_value_t = 1e-4, requires = "proof", value_parser = width)]
    width: f64,
    #[command(flatten)]
    reading: ReadingArgs,
}

const EXAMPLES: &str = "\
Exit status: 0 where the pixels are the same, of the same volume and scene; 3 where something differs, or where a tolerance of the scene is
proven to be missed; 1 where it cannot be told.

Examples:
  slicestack verify head.png --volume head.nrrd
  slicestack verify rings.png                        a picture of a built-in volume
  slicestack verify rings.png --proof 1000           and how far 1000 pixels are from the truth, proven";

/// A width of bounds.
fn width(text: &str) -> Result<f64, String> {
    let width: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if (1e-12..=1.0).contains(&width) { Ok(width) } else { Err("must lie between 1e-12 and 1".to_owned()) }
}

pub(super) fn run(args: &VerifyArgs) -> Result<()> {
    let bar = Arc::new(Bar::new());
    let settings = Settings::new().limits(args.reading.limits()).progress(bar.clone());
    let mut inputs = Inputs::new();
    (inputs.volume, inputs.labels) = (args.volume.clone(), args.labels.clone());
    let (verdict, bounded) = match args.proof {
        None => (verify(&args.picture, &inputs, &settings)?, None),
        Some(count) => {
            let (verdict, bounded) = verify_bounded(&args.picture, &inputs, count, args.width, &settings)?;
            (verdict, Some(bounded))
        }
    };
    bar.clear();
    go_on()?;
    let lines = verdict.lines();
    // What is proven of the rendering says nothing about a picture that is another.
    let told = |line: &String| verdict.is_same() || !line.starts_with("tolerance");
    let proven: String = bounded.iter().flat_map(|b| b.lines()).filter(told).map(|line| line + "\n").collect();
    if verdict.is_same() {
        lines.iter().for_each(|line| complain("note", &format!("{}: {line}", args.picture.display())));
        print(("same bytes\n".to_owned() + &proven).as_bytes())?;
        if bounded.is_some_and(|b| b.is_missed()) {
            bail!(Differs(format!("{}: the scene's tolerance is missed", args.picture.display())));
        }
        return Ok(());
    }
    print((lines.join("\n") + "\n" + &proven).as_bytes())?;
    bail!(Differs(format!("{}: not the same", args.picture.display())))
}
