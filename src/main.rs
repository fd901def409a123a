//! The command: arguments in, one library call, a picture or a line on stderr out.

// They panic where nobody can be told: `cli::tell` does not.
#[warn(clippy::print_stderr, clippy::print_stdout)]
mod cli;

#[global_allocator]
static ALLOCATOR: slicestack::OrOneLine = slicestack::OrOneLine;

fn main() -> std::process::ExitCode {
    cli::run()
}
