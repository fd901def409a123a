//! A file per verb; here: the verbs, exit statuses, and how errors are told.
//!
//! Exit status 0: done. 1: the work failed; one line `error: ...` on stderr, no output file left behind. 2: wrong usage. 3: pictures that were to
//! be the same are not.

mod animate;
mod color;
mod compare;
mod completions;
mod convert;
mod explain;
mod export;
mod flags;
mod golden;
mod info;
mod lesson;
mod manual;
mod movie;
mod output;
mod paged;
mod presets;
mod progress;
mod render;
mod report;
mod saved;
mod scene;
mod schema;
mod show;
mod signals;
mod slices;
mod stats;
mod tf;
mod turntable;
mod verify;
mod view;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use std::fmt;
use std::process::ExitCode;

/// Render volumes by texture slicing, on the CPU alone.
#[derive(Debug, Parser)]
#[command(name = "slicestack", version, arg_required_else_help = true, subcommand_required = true, term_width = 0, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  slicestack render                                   a built-in volume, to slicestack.png
  slicestack info head.nrrd                           what is in a file, and which presets suit it
  slicestack render head.nrrd -o head.png             a picture with the preset that fits best
  slicestack render head.nrrd --preset mr-brain --azimuth 60 --size 800x600
  slicestack render scene.toml --slices.count 512     a scene file, one of its keys overridden
  slicestack view head.nrrd                           turn it, cut it and colour it in a browser
  slicestack slices head.nrrd --montage 4x5           cut pictures through it
  slicestack convert head.nii.gz head.nrrd            the volume in another format
  slicestack explain scene.toml -o page               a page that shows how the picture comes about
  slicestack lesson                                   six lessons from a box to a picture
  slicestack help render                              every flag, and more examples
  slicestack help opengl                              flags of the profile opengl";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Make a picture of a scene or a volume.
    Render(Box<render::RenderArgs>),
    /// Make cut pictures through a volume: axial, coronal, sagittal or oblique, one or many.
    Slices(Box<slices::SlicesArgs>),
    /// Show a scene or a volume in a browser, to be turned, cut and coloured; on this machine alone.
    View(Box<view::ViewArgs>),
    /// Write a page that leads through a scene step by step.
    Explain(Box<explain::ExplainArgs>),
    /// Run one of six short lessons: what each step of the pipeline does, with a picture. Without a number, list them.
    Lesson(lesson::LessonArgs),
    /// Measure what error costs in time for a scene, method by method; or what holds in extreme cases.
    Report(Box<report::ReportArgs>),
    /// Make an animation that goes once around a volume.
    Turntable(Box<turntable::TurntableArgs>),
    /// Make an animation between key frames: cameras, transfer functions, clip planes and other keys of a scene.
    Animate(Box<animate::AnimateArgs>),
    /// Write a volume in another format, or a part of it, or with other voxels.
    Convert(Box<convert::ConvertArgs>),
    /// Tell how far one picture is from another.
    Compare(compare::CompareArgs),
    /// Render the scene that a picture carries again, and tell whether it is the same.
    Verify(verify::VerifyArgs),
    /// Hold a folder of scenes against their pictures on record, or put them there.
    Golden(golden::GoldenArgs),
    /// Tell what is in a volume file, and which presets suit it.
    Info(info::InfoArgs),
    /// Draw a transfer function, or turn it into a file of another program.
    Tf(Box<tf::TfArgs>),
    /// List presets and colour maps.
    Presets,
    /// List the keys of the profile opengl.
    #[command(after_help = flags::opengl_keys())]
    Opengl,
    /// Print the JSON schema of scene files.
    Schema,
    /// Write the manual as pages for `man`, one a verb.
    Manual(manual::ManualArgs),
    /// Print a completion script for a shell.
    Completions(completions::CompletionArgs),
}

/// An error of the caller's: exit status 2.
#[derive(Debug)]
struct Usage(String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Pictures are not the same: exit status 3.
#[derive(Debug)]
struct Differs(String);

impl fmt::Display for Differs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Differs {}

/// Parses the command line and does what it says.
pub(crate) fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => return told(&e),
    };
    if let Err(e) = signals::catch() {
        complain("error", &format!("signals: {e}"));
        return ExitCode::FAILURE;
    }
    if let Err(e) = start_threads() {
        complain("error", &e);
        return ExitCode::FAILURE;
    }
    slicestack::files::remember_reads();
    let done = match cli.verb {
        Verb::Render(args) => render::run(&args),
        Verb::Slices(args) => slices::run(&args),
        Verb::View(args) => view::run(&args),
        Verb::Explain(args) => explain::run(&args),
        Verb::Lesson(args) => lesson::run(&args),
        Verb::Report(args) => report::run(&args),
        Verb::Animate(args) => animate::run(&args),
        Verb::Turntable(args) => turntable::run(&args),
        Verb::Convert(args) => convert::run(&args),
        Verb::Compare(args) => compare::run(&args),
        Verb::Verify(args) => verify::run(&args),
        Verb::Golden(args) => golden::run(&args),
        Verb::Info(args) => info::run(&args),
        Verb::Tf(args) => tf::run(&args),
        Verb::Presets => presets::run(),
        Verb::Opengl => output::print(flags::opengl_keys().as_bytes()),
        Verb::Schema => schema::run(),
        Verb::Manual(args) => manual::run(&args),
        Verb::Completions(args) => completions::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            // Whatever fails after a signal does so because of it.
            if let Some(status) = signals::ended() {
                return status;
            }
            complain("error", &chain(&e));
            // What a flag says cannot be: the library's line begins with the flag.
            let of_a_flag = |e: &slicestack::Error| matches!(e, slicestack::Error::Invalid(what) if what.starts_with("--"));
            ExitCode::from(if e.is::<Usage>() || e.downcast_ref().is_some_and(of_a_flag) {
                2
            } else if e.is::<Differs>() {
                3
            } else {
                1
            })
        }
    }
}

/// Starts the threads that volumes are read and prepared with: as many as `RAYON_NUM_THREADS` says, or one per core.
fn start_threads() -> Result<(), String> {
    const NAME: &str = "RAYON_NUM_THREADS";
    let most = slicestack::MAX_THREADS;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let wanted = std::env::var(NAME).ok().and_then(|n| n.trim().parse::<usize>().ok()).filter(|n| *n > 0);
    if let Some(n) = wanted.filter(|n| *n > most) {
        complain("note", &format!("{NAME} {n}: {most} are started, the most there are"));
    }
    let count = wanted.unwrap_or(cores).min(most);
    rayon::ThreadPoolBuilder::new().num_threads(count).build_global().map_err(|e| format!("{count} threads: {e}"))
}

/// An error and its causes, each told once: the library's errors hold their cause's words already.
fn chain(e: &anyhow::Error) -> String {
    let mut text = e.to_string();
    for cause in e.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Help goes out as it is; a mistake becomes one line.
fn told(e: &clap::Error) -> ExitCode {
    if !e.use_stderr() || e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        if e.use_stderr() {
            // Nobody is left to tell when printing fails.
            drop(e.print());
            return ExitCode::from(2);
        }
        return match e.print() {
            Err(fault) if fault.kind() != std::io::ErrorKind::BrokenPipe => {
                complain("error", &format!("stdout: {fault}"));
                ExitCode::FAILURE
            }
            _ => ExitCode::SUCCESS,
        };
    }
    let text = e.render().to_string();
    let lines = text.lines().map(str::trim).take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more information"));
    let line = lines.filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ");
    complain("error", &line.strip_prefix("error: ").unwrap_or(&line).replace(":;", ":"));
    ExitCode::from(2)
}

/// Most characters of an error: what follows helps nobody.
const LONGEST: usize = 400;

/// One line on stderr, whatever `text` holds; errors have at most [`LONGEST`] characters.
fn complain(kind: &str, text: &str) {
    let mut text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let most = LONGEST - kind.len() - 2;
    if kind == "error" && text.chars().count() > most {
        text = shortened(&text, most);
    }
    tell!("{kind}: {text}");
}

/// The two ends of `text`, `most` characters of it: at the start stands the file, at the end what is wrong with it.
fn shortened(text: &str, most: usize) -> String {
    let all: Vec<char> = text.chars().collect();
    let start = most / 2;
    let end = all.len() - (most - start - 3);
    all[..start].iter().chain(&['.'; 3]).chain(&all[end..]).collect()
}

/// Writes a line to stderr: as `eprintln`, but where nobody listens, or stderr is full, nothing is lost.
macro_rules! tell {
    ($($words:tt)*) => {
        // In one piece: other commands of a pipe may write at the same time.
        drop(std::io::Write::write_all(&mut std::io::stderr(), (format!($($words)*) + "\n").as_bytes()))
    };
}
use tell;
