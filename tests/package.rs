//! Spectile from Python: the tests of the package in `python/tests/`, by pytest, a test here for each file there, and the examples in its
//! docstrings.

use std::process::Command;

use crate::outside::package;
use crate::report::{Part, timed};

fn pass(mut pytest: Command) {
    if crate::size::is_full() {
        pytest.arg("--long");
    }
    let output = timed(Part::Program, || pytest.output().expect("Python runs"));
    let said = String::from_utf8_lossy(&output.stdout);
    // 5: no test was found.
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains(" passed"), "{said}");
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
            let folder = crate::binary::repository("python/tests");
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

files!(arrays cubes manual render scenes);

#[test]
fn docstrings() {
    if let Some(pytest) = package(&["--doctest-modules", "--pyargs", "spectile"]) {
        pass(pytest);
    }
}
