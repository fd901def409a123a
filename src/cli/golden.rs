//! `slicestack golden`: a folder of scene files and of their pictures on record.

use super::compare::ToleranceArgs;
use super::output::{Outputs, Sink, print};
use super::progress::Bar;
use super::signals::go_on;
use super::{Differs, Usage};
use anyhow::{Result, bail};
use clap::Subcommand;
use slicestack::Settings;
use slicestack::compare::Tolerance;
use slicestack::proof::{Outcome, bless, check, page};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `golden` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct GoldenArgs {
    #[command(subcommand)]
    verb: GoldenVerb,
}

#[derive(Debug, Subcommand)]
enum GoldenVerb {
    /// Render every scene file of a folder and hold it against the picture of its name beside it.
    Check {
        /// Folder of scene files (.toml, .json) and pictures.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        #[command(flatten)]
        limits: ToleranceArgs,
        /// Folder for a page of what differs: before, after, difference, FLIP map. Made where it is not there; written where something differs.
        #[arg(short, long, value_name = "PAGE")]
        output: Option<PathBuf>,
    },
    /// Render every scene file of a folder and put its picture on record beside it.
    Bless {
        /// Folder of scene files (.toml, .json).
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Replace pictures that do not say that they were made here.
        #[arg(long)]
        force: bool,
    },
}

const EXAMPLES: &str = "\
Exit status of check: 0 where all pictures are within the limits, which without any means the same pixels; 3 where one is not; 1 where a scene
cannot be rendered.

Examples:
  slicestack golden bless scenes                      scenes/a.toml becomes scenes/a.png
  slicestack golden check scenes                      the same pixels again?
  slicestack golden check scenes --max-flip 0.01 -o page";

pub(super) fn run(args: &GoldenArgs) -> Result<()> {
    match &args.verb {
        GoldenVerb::Check { folder, limits, output } => run_check(folder, limits, output.as_deref()),
        GoldenVerb::Bless { folder, force } => run_bless(folder, *force),
    }
}

/// Does `work` with the settings of a command that renders.
fn rendering<T>(work: impl FnOnce(&Settings) -> slicestack::Result<T>) -> Result<T> {
    let bar = Arc::new(Bar::new());
    let done = work(&Settings::new().progress(bar.clone()));
    bar.clear();
    let done = done?;
    go_on()?;
    Ok(done)
}

fn run_check(folder: &Path, limits: &ToleranceArgs, output: Option<&Path>) -> Result<()> {
    let given = limits.tolerance()?;
    let tolerance = if given.is_given() { given } else { Tolerance::exact() };
    output.map(may_hold_page).transpose()?;
    let checked = rendering(|settings| check(folder, &tolerance, settings))?;
    let (mut differ, mut failed) = (0, 0);
    let mut text = String::new();
    for c in &checked {
        let told = match &c.outcome {
            Outcome::Same(found) if found.differing == 0 => "same pixels".to_owned(),
            Outcome::Same(found) => format!("within the limits: {} pixels differ, FLIP {:.3e}", found.differing, found.flip),
            Outcome::Differs(why) => {
                differ += 1;
                format!("differs: {why}")
            }
            Outcome::Failed(why) => {
                failed += 1;
                format!("cannot be rendered: {why}")
            }
            _ => continue,
        };
        text += &format!("{}: {}\n", c.scene.display(), told.split_whitespace().collect::<Vec<_>>().join(" "));
    }
    if let Some(folder) = output.filter(|_| differ + failed > 0) {
        let mut outputs = Outputs::default();
        outputs.folder(folder)?;
        for (name, bytes) in page(&checked) {
            outputs.add(&Sink::File(folder.join(name)), &bytes)?;
        }
        outputs.finish()?;
        text += &format!("{}\n", folder.join("index.html").display());
    }
    print(text.as_bytes())?;
    let all = checked.len();
    match (differ, failed) {
        (0, 0) => Ok(()),
        (_, 0) => bail!(Differs(format!("{}: {differ} of {all} pictures differ", folder.display()))),
        _ => bail!("{}: {failed} of {all} scenes cannot be rendered, {differ} pictures differ", folder.display()),
    }
}

/// # Errors
/// [`Usage`] where `folder` is none, or holds what is no such page.
fn may_hold_page(folder: &Path) -> Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!(Usage(format!("{}: is a file, not a folder", folder.display())));
    }
    let Ok(mut entries) = fs::read_dir(folder) else { return Ok(()) };
    let index = fs::read_to_string(folder.join("index.html")).unwrap_or_default();
    if entries.next().is_some() && !index.contains("<title>Golden pictures</title>") {
        bail!(Usage(format!("{}: holds other files; name an empty folder, a new one, or one of an earlier check", folder.display())));
    }
    Ok(())
}

fn run_bless(folder: &Path, force: bool) -> Result<()> {
    let blessed = rendering(|settings| bless(folder, force, settings))?;
    let line = |b: &slicestack::proof::Blessed| format!("{}: {}\n", b.picture.display(), if b.changed { "written" } else { "unchanged" });
    print(blessed.iter().map(line).collect::<String>().as_bytes())
}
