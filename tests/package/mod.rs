//! Spectile from Python: the tests of the package in `python/tests/`, by pytest, a test here for each file there, and the examples in its
//! docstrings.

use std::process::Command;

use crate::binary::repository;
use crate::outside::package;
use crate::report::{Part, skip, timed};

fn pass(mut pytest: Command) {
    if crate::size::is_full() {
        pytest.arg("--long");
    }
    let output = timed(Part::Program, || pytest.output().expect("Python runs"));
    let said = String::from_utf8_lossy(&output.stdout);
    // 5: no test was found.
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    // Where all are long ones they are skipped, and that is said here.
    assert!(said.contains(" passed") || (!crate::size::is_full() && said.contains(" skipped")), "{said}");
}

macro_rules! files {
    ($($name:ident)*) => {$(
        #[test]
        fn $name() {
            if let Some(pytest) = package(&[concat!("test_", stringify!($name), ".py")]) {
                pass(pytest);
            }
        }
    )*

        /// Each file there is run here.
        #[test]
        fn all_files_are_named() {
            let folder = repository("python/tests");
            let there = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
            let mut there: Vec<String> = there.map(|name| name.to_string_lossy().into_owned()).collect();
            there.retain(|name| name.starts_with("test_"));
            there.sort();
            let mut named = vec![$(concat!("test_", stringify!($name), ".py")),*];
            named.sort_unstable();
            assert_eq!(there, named);
        }
    };
}

files!(arrays cubes long manual notebooks render scenes);

#[test]
fn docstrings() {
    if let Some(pytest) = package(&["--doctest-modules", "--pyargs", "spectile"]) {
        pass(pytest);
    }
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
