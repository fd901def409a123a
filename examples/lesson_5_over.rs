//! Lesson 5, over: slabs are blended front to back or back to front, and both are the same sum.
//!
//! ```sh
//! cargo run --release --example lesson_5_over -- over.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/over.rs; `slicestack lesson 5` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[4].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "over.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
