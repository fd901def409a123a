//! `slicestack view`.

use super::output::print;
use super::progress::catch_signals;
use super::scene::{SceneArgs, load};
use super::{Usage, complain, export};
use anyhow::{Context, Result, bail};
use clap::Parser;
use slicestack::scene::SceneFile;
use slicestack::view::Server;
use slicestack::view::export::Views;
use slicestack::{Error, Settings};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What `view` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ViewArgs {
    /// Port to listen at, on this machine alone; a free one unless given.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// Open no browser: print the address alone.
    #[arg(long)]
    no_browser: bool,
    /// Worker threads; one per core unless given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=4096))]
    threads: Option<u64>,
    /// Write pictures from all around into this folder, and a page that turns them without a server; made if it is not there.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["port", "no_browser"])]
    export: Option<PathBuf>,
    /// Pictures of an export: so many around, times so many upwards from -60 to 60 degrees; 36x5 unless given.
    #[arg(long, value_name = "AROUNDxUPWARDS")]
    views: Option<Views>,
    #[command(flatten)]
    scene: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  slicestack view                                     a built-in volume
  slicestack view head.nrrd                           a browser opens; Ctrl-C ends the view
  slicestack view scene.toml --size 800x600
  slicestack view ct.nii.gz --no-browser --port 8123  on another machine: ssh -L 8123:127.0.0.1:8123 host
  slicestack view head.nrrd --export head --views 24x3 --size 400x400     head/index.html, for papers and lectures

The scene takes the same flags as in `slicestack render`.";

pub(super) fn run(args: &ViewArgs) -> Result<()> {
    // Said here: no flag that goes without an export waives it.
    if args.views.is_some() && args.export.is_none() {
        bail!(Usage("--views: is for the pictures of --export DIR".into()));
    }
    let settings = Settings::new().threads(args.threads.map(|n| n as usize)).limits(args.scene.limits());
    if let Some(folder) = &args.export {
        catch_signals()?;
        return export::run(folder, args.views.unwrap_or_default(), &args.scene, settings);
    }
    let (text, overrides) = args.scene.read()?;
    let scene = text.open(&overrides)?;
    let volume = load(scene.volume(), &settings.limits)?;
    let mut view = Server::builder(scene, volume).port(args.port).settings(settings).command_line(scene_arguments(), read_again);
    if let Some(name) = args.scene.input.as_deref().and_then(Path::file_name) {
        view = view.title(name.to_string_lossy());
    }
    let server = view.start()?;
    server.notes().iter().for_each(|note| complain("note", note));
    server.warnings().iter().for_each(|warning| complain("warning", warning));
    let (url, port) = (server.url(), server.port());
    print(format!("{url}\n").as_bytes())?;
    eprintln!("Ctrl-C ends the view. From another machine: ssh -L {port}:127.0.0.1:{port} HOST, then open the address there.");
    if !args.no_browser && has_display() {
        if let Err(e) = browse(&url) {
            complain("note", &format!("no browser could be opened ({e}): open the address above"));
        }
    }
    server.wait();
    Ok(())
}

/// Flags of the view itself, and whether they take a value.
const OWN: [(&str, bool); 3] = [("--port", true), ("--threads", true), ("--no-browser", false)];

/// The arguments of this command that are about the scene.
fn scene_arguments() -> Vec<String> {
    let mut words = std::env::args_os().skip(2).map(|word| word.to_string_lossy().into_owned());
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        let name = word.split('=').next().unwrap_or_default();
        match OWN.iter().find(|(own, _)| *own == name) {
            None => kept.push(word),
            Some((_, true)) if !word.contains('=') => drop(words.next()),
            Some(_) => {}
        }
    }
    kept
}

/// Arguments as `slicestack render` reads them.
fn read_again(arguments: &[String]) -> slicestack::Result<SceneFile> {
    /// A command of nothing but a scene.
    #[derive(Parser)]
    struct Again {
        #[command(flatten)]
        scene: SceneArgs,
    }
    let words = ["render".to_owned()].into_iter().chain(arguments.iter().cloned());
    let read = || {
        let again = Again::try_parse_from(words).context("arguments")?;
        let (text, overrides) = again.scene.read()?;
        text.open(&overrides)
    };
    read().map_err(|e| Error::invalid(format!("{e:#}")))
}

/// Whether there is a screen that a browser could show itself on.
fn has_display() -> bool {
    cfg!(any(windows, target_os = "macos")) || ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(|name| std::env::var_os(name).is_some())
}

/// Opens the browser that the system takes for `url`.
fn browse(url: &str) -> std::io::Result<()> {
    let mut command = if cfg!(windows) {
        let mut command = Command::new("cmd");
        command.args(["/C", "start", ""]);
        command
    } else {
        Command::new(if cfg!(target_os = "macos") { "open" } else { "xdg-open" })
    };
    let mut child = command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    // Some of them stay as long as the browser does.
    std::thread::spawn(move || drop(child.wait()));
    Ok(())
}
