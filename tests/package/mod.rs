//! Spectile from Python: the tests of the package in `python/tests/` and the examples in its docstrings, by pytest in one process, since
//! what they import takes longer than many of them.

use std::process::Command;

use crate::binary::repository;
use crate::outside::package;
use crate::program::scenes::make_scene;
use crate::report::{Part, skip, timed};

#[test]
fn tests_and_docstrings() {
    let Some(mut pytest) = package(&["--doctest-modules", "--durations=10", "--pyargs", "spectile", "."]) else {
        return;
    };
    // What the notebook on the grove needs is not committed.
    let grove = tempfile::tempdir().expect("a folder");
    let scene = repository("scenes/grove");
    std::fs::create_dir(grove.path().join("spectra")).expect("a folder");
    for file in ["grove.toml", "spectra/leaf.csv", "spectra/ground.csv"] {
        std::fs::copy(scene.join(file), grove.path().join(file)).expect("copied");
    }
    make_scene::make("grove", grove.path()).expect("the grove");
    pytest.env("SPECTILE_GROVE", grove.path());
    if crate::size::is_full() {
        pytest.arg("--long");
    }
    let output = timed(Part::Program, || pytest.output().expect("Python runs"));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    let last = said.lines().last().unwrap_or_default();
    let passed = last.split(" passed").next().and_then(|words| words.split_whitespace().last()?.parse::<u32>().ok());
    assert!(passed.is_some_and(|passed| passed > 80), "{said}");
    println!("{said}");
}

/// Takes a release build of the wheel, and the network for what it needs.
#[test]
#[ignore = "makes a wheel and two environments: minutes, and the network"]
fn wheels_work_in_fresh_environments() {
    let Some(python) = std::env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty()) else {
        skip("SPECTILE_PYTHON names no Python");
        return;
    };
    let made = Command::new(repository("run")).arg("wheel").output().expect("it runs");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let wheel = String::from_utf8(made.stdout).expect("UTF-8");
    let tried = Command::new(python).arg(repository("python/tests/wheel.py")).arg(wheel.trim()).output();
    let tried = tried.expect("Python runs");
    assert!(tried.status.success(), "{}", String::from_utf8_lossy(&tried.stderr));
    assert!(String::from_utf8_lossy(&tried.stdout).ends_with("works\n"));
}
