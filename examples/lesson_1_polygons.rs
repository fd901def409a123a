//! Lesson 1, polygons: planes of constant depth cut a box, and each cut is a convex polygon of 3 to 6 corners.
//!
//! ```sh
//! cargo run --release --example lesson_1_polygons -- polygons.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/polygons.rs; `slicestack lesson 1` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[0].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "polygons.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
