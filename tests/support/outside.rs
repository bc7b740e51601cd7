//! What this machine may lack: other people's programs, and data that is no part of the repository.

use std::path::PathBuf;
use std::process::Command;

use crate::binary::repository;
use crate::report::{excuse, skip};

/// A script of `tests/python` in a Python that has its requirements.
pub fn python(script: &str) -> Option<Command> {
    let Some(python) = std::env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty()) else {
        skip("SPECTILE_PYTHON names no Python with tests/python/requirements.txt");
        return None;
    };
    let mut command = Command::new(python);
    // A warning is an error: users should not see any.
    command.args(["-W", "error"]).arg(repository("tests/python").join(script));
    Some(command)
}

/// Data that lies beside the repository.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = repository("../shared/data").join(name);
    if !path.exists() {
        excuse(&format!("there is no {}", path.display()));
        return None;
    }
    Some(path)
}
