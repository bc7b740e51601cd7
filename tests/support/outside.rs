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

/// pytest in the folder of the package's tests, with these arguments, where SPECTILE_PACKAGE names the package as
/// `python/develop.py` puts it together.
pub fn package(arguments: &[&str]) -> Option<Command> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let (Some(python), Some(package)) = (set("SPECTILE_PYTHON"), set("SPECTILE_PACKAGE")) else {
        skip("SPECTILE_PYTHON and SPECTILE_PACKAGE name no Python and no package: ./check builds both");
        return None;
    };
    let mut command = Command::new(python);
    // Without the folder of the sources on the path, whose package has no library.
    command.args(["-P", "-m", "pytest", "-p", "no:cacheprovider", "--tb=short"]).args(arguments);
    command.env("PYTHONPATH", package).env("PYTHONDONTWRITEBYTECODE", "1").current_dir(repository("python/tests"));
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
