//! `slicestack completions`.

use super::output::print;
use anyhow::Result;
use clap::CommandFactory;
use clap_complete::Shell;

/// What `completions` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  slicestack completions bash > ~/.local/share/bash-completion/completions/slicestack")]
pub(super) struct CompletionArgs {
    /// The shell that is to complete.
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(args: &CompletionArgs) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut super::Cli::command(), "slicestack", &mut script);
    print(&script)
}
