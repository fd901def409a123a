//! Lesson 4, transfer function: an opacity belongs to a length, so a slab's opacity is 1 - (1 - a)^(thickness / length).
//!
//! ```sh
//! cargo run --release --example lesson_4_transfer_function -- opacity.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/transfer_function.rs; `slicestack lesson 4` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[3].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "opacity.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
