//! Lesson 6, fog: on premultiplied colours the fog's part is weighted by the opacity, or empty slices light up.
//!
//! ```sh
//! cargo run --release --example lesson_6_fog -- fog.png
//! ```
//!
//! This calls the lesson, which is in src/study/lessons/fog.rs; `slicestack lesson 6` runs it too.

use slicestack::Result;
use slicestack::files::write_whole;
use slicestack::study::LESSONS;
use std::path::{Path, PathBuf};

pub(crate) fn run(out: &Path) -> Result<()> {
    let shown = LESSONS[5].run()?;
    print!("{}", shown.told);
    write_whole(out, &shown.picture)
}

fn main() -> std::process::ExitCode {
    let done = run(&std::env::args_os().nth(1).map_or_else(|| "fog.png".into(), PathBuf::from));
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
