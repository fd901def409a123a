//! `slicestack lesson`.

use super::Usage;
use super::output::{Outputs, Sink, is_new_folder, print};
use anyhow::{Result, bail};
use slicestack::picture::Format;
use slicestack::study::{LESSONS, Lesson};
use std::path::PathBuf;

/// What `lesson` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct LessonArgs {
    /// Number or name of the lesson; the list of all unless given.
    lesson: Option<String>,
    /// Folder for its picture; made where it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = ".", requires = "lesson")]
    output: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  slicestack lesson                                   the list
  slicestack lesson 1                                 what it finds, and lesson_1_polygons.png
  slicestack lesson fog -o lessons                    lessons/lesson_6_fog.png

docs/tutorial.md tells what each of them shows.";

pub(super) fn run(args: &LessonArgs) -> Result<()> {
    let Some(name) = &args.lesson else { return print(list().as_bytes()) };
    let Some(lesson) = Lesson::named(name) else {
        let names: Vec<String> = LESSONS.iter().map(|l| format!("{} ({})", l.number, l.name)).collect();
        bail!(Usage(format!("lesson {name}: there is none; there are {}", names.join(", "))));
    };
    let folder = &args.output;
    is_new_folder(folder, "--output")?;
    let picture = folder.join(lesson.file_name());
    let sink = Sink::File(picture.clone());
    sink.spare("picture", |start| Format::of_start(start) == Some(Format::Png), &[])?;
    let shown = lesson.run()?;
    let mut outputs = Outputs::default();
    outputs.folder(folder)?;
    outputs.add(&sink, &shown.picture)?;
    outputs.finish()?;
    print(format!("{}picture: {}\n", shown.told, picture.display()).as_bytes())
}

/// All lessons, one a line.
fn list() -> String {
    let line = |l: &Lesson| format!("  {}  {:18}  {}\n", l.number, l.name, l.about);
    let lines: String = LESSONS.iter().map(line).collect();
    format!("Lessons (slicestack lesson NUMBER):\n{lines}")
}
