//! The program `spectile`: maps arguments to what is done, and its outcome to an exit code.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

use clap::Parser;

use super::{Cli, Output};
use crate::Error;

/// Where the program is, if its process is an interpreter's.
static SCRIPT: OnceLock<PathBuf> = OnceLock::new();

/// Does what the arguments ask for, the first of which is the name of the program; the exit code.
pub fn program(arguments: &[OsString]) -> u8 {
    // A file that would outgrow its limit is an error like a full disk, not the end of the process. Where the signal cannot
    // be caught, it stays that.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(nix::libc::SIGXFSZ, Default::default());
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(usage) => return explain(&usage, arguments),
    };
    let output = Output::new(cli.json());
    match cli.run(&output) {
        Ok(()) => 0,
        Err(error) => {
            output.error(&error);
            exit_code(&error)
        }
    }
}

/// [`program`] where an interpreter runs it: the first argument is the path of the script by which others can run it too.
pub fn program_of_script(arguments: &[OsString]) -> u8 {
    if let Some(script) = arguments.first().and_then(|script| std::path::absolute(script).ok()) {
        SCRIPT.get_or_init(|| script);
    }
    program(arguments)
}

/// The file by which other processes, also on other machines, run this program.
pub(super) fn path() -> std::io::Result<PathBuf> {
    SCRIPT.get().map_or_else(std::env::current_exe, |script| Ok(script.clone()))
}

/// Help and version go to stdout and are a success, mistakes in the arguments go to stderr and are exit code 2.
fn explain(usage: &clap::Error, arguments: &[OsString]) -> u8 {
    // If nobody reads it, nobody misses it.
    let _ = usage.print();
    if !usage.use_stderr() {
        return 0;
    }
    let message = usage.render().to_string();
    let error = Error::Usage(message.trim_start_matches("error: ").trim_end().to_owned());
    if arguments.iter().any(|argument| argument == "--json") {
        Output::new(true).error_event(&error);
    }
    exit_code(&error)
}

fn exit_code(error: &Error) -> u8 {
    u8::try_from(error.exit_code()).unwrap_or(u8::MAX)
}
