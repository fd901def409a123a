//! The command: arguments in, one library call, a picture or a line on stderr out.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
