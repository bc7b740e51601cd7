//! Every recipe of docs/interop.md, on a cube and every export of it, with the readers that people have.
//!
//! SPECTILE_PYTHON names a Python that has tests/python/requirements.txt. Without it these tests say so and pass, except where
//! CI=true.

use tempfile::tempdir;

use crate::binary::output;
use crate::outside::python;
use crate::report::excuse_a_part;
use crate::size;

const ALL: &str = "8,400,1000,5000";

/// interop.py on cubes of these numbers of channels.
fn recipes(channels: &str, more: &[&str]) {
    let Some(mut command) = python("interop.py") else { return };
    let folder = tempdir().expect("folder");
    command.arg(env!("CARGO_BIN_EXE_spectile")).arg(folder.path()).args(["--channels", channels]).args(more);
    let output = output(&mut command);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said.lines().filter_map(|line| line.strip_prefix("skipped: ")).for_each(excuse_a_part);
    for count in channels.split(',') {
        assert!(said.contains(&format!("xarray, the cube, {count} channels: right")), "{said}");
    }
}

#[test]
fn every_recipe_reads_every_export() {
    recipes(if size::is_full() { ALL } else { "8,400" }, &[]);
}

#[test]
#[ignore = "installs packages of Python"]
fn other_versions_of_readers_do_too() {
    recipes(ALL, &["--more"]);
}
