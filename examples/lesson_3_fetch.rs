//! Lesson 3, fetch: a texture coordinate becomes an index, the index a cell and weights, and eight voxels become one value.
//!
//! ```sh
//! cargo run --release --example lesson_3_fetch -- fetch.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/fetch.rs; `slicestack lesson 3` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[2].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "fetch.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
