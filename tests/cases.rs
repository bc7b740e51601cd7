//! Inputs and uses that went wrong once, each a folder of `tests/cases` whose `run.sh` drives the real program and ends with PASS.
//!
//! A script gets the program in SPECTILE and may write only to folders that it makes itself. Those that call Python need
//! SPECTILE_PYTHON, whose folder comes first in their PATH; without it they say that they are skipped, and fail where CI=true.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use libtest_mimic::{Arguments, Failed, Trial};

fn main() -> ExitCode {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut cases: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("an entry of the folder").path())
        .filter(|case| case.join("run.sh").is_file())
        .collect();
    cases.sort();
    assert!(!cases.is_empty(), "{} has no cases", folder.display());
    let trials = cases.into_iter().map(trial).collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

fn trial(case: PathBuf) -> Trial {
    let name = case.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let script = fs::read_to_string(case.join("run.sh")).expect("a script");
    let needs_python = script.lines().any(|line| !line.trim_start().starts_with('#') && line.contains("python"));
    let python = env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty());
    if needs_python && python.is_none() && env::var("CI").as_deref() != Ok("true") {
        eprintln!("skipped: {name}: SPECTILE_PYTHON names no Python with tests/python/requirements.txt");
        return Trial::test(name, || Ok(())).with_ignored_flag(true);
    }
    Trial::test(name, move || {
        if needs_python && python.is_none() {
            return Err(Failed::from("CI must set SPECTILE_PYTHON"));
        }
        run(&case, python.as_deref().map(Path::new))
    })
}

fn run(case: &Path, python: Option<&Path>) -> Result<(), Failed> {
    let mut command = Command::new("bash");
    command.arg(case.join("run.sh")).env("SPECTILE", env!("CARGO_BIN_EXE_spectile"));
    if let Some(folder) = python.and_then(Path::parent) {
        let before = env::var_os("PATH").unwrap_or_default();
        let path = env::join_paths(std::iter::once(folder.to_owned()).chain(env::split_paths(&before)));
        command.env("PATH", path.map_err(|error| error.to_string())?);
    }
    let output = command.output().map_err(|error| format!("bash: {error}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    if output.status.success() && said.lines().last() == Some("PASS") {
        return Ok(());
    }
    Err(Failed::from(format!("{}\n{said}{}", output.status, String::from_utf8_lossy(&output.stderr))))
}
