//! The files of a cube, for tests that compare every byte.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Content by path in the cube.
pub type Files = BTreeMap<String, Vec<u8>>;

/// The files of the arrays: all outside `.spectile`.
pub fn arrays(cube: &Path) -> Files {
    files(cube, |name| !name.starts_with(".spectile"))
}

/// The files under `root` whose path in it is wanted.
pub fn files(root: &Path, is_wanted: impl Fn(&str) -> bool) -> Files {
    fn walk(root: &Path, folder: &Path, is_wanted: &dyn Fn(&str) -> bool, found: &mut Files) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(root).expect("inside").to_str().expect("UTF-8");
            if path.is_dir() {
                walk(root, &path, is_wanted, found);
            } else if is_wanted(name) {
                found.insert(name.to_owned(), fs::read(&path).expect("read"));
            }
        }
    }
    let mut found = Files::new();
    walk(root, root, &is_wanted, &mut found);
    found
}
