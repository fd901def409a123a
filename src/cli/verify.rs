//! `slicestack verify`: a picture's scene, rendered again.

use super::output::print;
use super::progress::{Bar, Phase, catch_signals, enter, rendered};
use super::scene::ReadingArgs;
use super::{Differs, complain};
use anyhow::{Result, bail};
use slicestack::Settings;
use slicestack::proof::verify;
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
    #[command(flatten)]
    reading: ReadingArgs,
}

const EXAMPLES: &str = "\
Exit status: 0 where the pixels are the same, of the same volume and scene; 3 where something differs; 1 where it cannot be told.

Examples:
  slicestack verify head.png --volume head.nrrd
  slicestack verify rings.png                        a picture of a built-in volume";

pub(super) fn run(args: &VerifyArgs) -> Result<()> {
    catch_signals()?;
    let bar = Arc::new(Bar::new());
    let settings = Settings::new().limits(args.reading.limits()).progress(bar.clone());
    enter(Phase::Rendering);
    let verdict = verify(&args.picture, args.volume.as_deref(), &settings)?;
    bar.clear();
    rendered()?;
    let lines = verdict.lines();
    if verdict.is_same() {
        lines.iter().for_each(|line| complain("note", &format!("{}: {line}", args.picture.display())));
        return print(b"same bytes\n");
    }
    print((lines.join("\n") + "\n").as_bytes())?;
    bail!(Differs(format!("{}: not the same", args.picture.display())))
}
