//! Maps outcomes to exit codes; everything else is in the library.

use std::process::ExitCode;

use clap::Parser;
use spectile::Error;
use spectile::cli::{Cli, Output};

fn main() -> ExitCode {
    // A file that would outgrow its limit is an error like a full disk, not the end of the process. Where the signal cannot
    // be caught, it stays that.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(nix::libc::SIGXFSZ, Default::default());
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(usage) => return explain(&usage),
    };
    let output = Output::new(cli.json());
    match cli.run(&output) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output.error(&error);
            exit_code(&error)
        }
    }
}

/// Help and version go to stdout and are a success, mistakes in the arguments go to stderr and are exit code 2.
fn explain(usage: &clap::Error) -> ExitCode {
    // If nobody reads it, nobody misses it.
    let _ = usage.print();
    if !usage.use_stderr() {
        return ExitCode::SUCCESS;
    }
    let message = usage.render().to_string();
    let error = Error::Usage(message.trim_start_matches("error: ").trim_end().to_owned());
    if std::env::args_os().any(|argument| argument == "--json") {
        Output::new(true).error_event(&error);
    }
    exit_code(&error)
}

fn exit_code(error: &Error) -> ExitCode {
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(u8::MAX))
}
