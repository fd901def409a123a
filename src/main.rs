//! The command: arguments in, one library call, a picture or a line on stderr out.

mod cli;

#[global_allocator]
static ALLOCATOR: slicestack::OrOneLine = slicestack::OrOneLine;

fn main() -> std::process::ExitCode {
    cli::run()
}
