//! Lesson 2, coverage: a pixel belongs to a polygon if its centre does, and a centre on a shared side belongs to exactly one of two.
//!
//! ```sh
//! cargo run --release --example lesson_2_coverage -- coverage.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/coverage.rs; `slicestack lesson 2` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[1].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "coverage.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
