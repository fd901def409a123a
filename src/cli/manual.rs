//! `slicestack manual`.

use super::output::{Outputs, Sink, is_new_folder};
use anyhow::{Result, bail};
use clap::{Command, CommandFactory};
use clap_mangen::Man;
use std::path::{Path, PathBuf};

/// What `manual` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  slicestack manual ~/.local/share/man/man1             man slicestack-render")]
pub(super) struct ManualArgs {
    /// Folder for the pages; made if it is not there.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn run(args: &ManualArgs) -> Result<()> {
    is_new_folder(&args.folder, "DIR")?;
    let mut command = super::Cli::command();
    command.build();
    let mut pages = Vec::new();
    page(&command, "slicestack", &mut pages)?;
    for (name, _) in &pages {
        let path = args.folder.join(name);
        let is_own = std::fs::read_to_string(&path).is_ok_and(|text| text.contains(".TH slicestack"));
        if path.exists() && !is_own {
            bail!("{}: is there already and is no page of this manual", path.display());
        }
    }
    let mut outputs = Outputs::default();
    outputs.folder(&args.folder)?;
    pages.iter().try_for_each(|(name, text)| outputs.add(&Sink::File(Path::new(&args.folder).join(name)), text))?;
    outputs.finish()
}

/// The page of `command`, which is called by `name`, and those of its verbs.
fn page(command: &Command, name: &str, pages: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    let mut text = Vec::new();
    Man::new(command.clone()).manual("slicestack").render(&mut text)?;
    pages.push((format!("{name}.1"), text));
    for verb in command.get_subcommands().filter(|verb| verb.get_name() != "help" && !verb.is_hide_set()) {
        page(verb, &format!("{name}-{}", verb.get_name()), pages)?;
    }
    Ok(())
}
