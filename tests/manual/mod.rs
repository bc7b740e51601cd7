//! `docs/scene.md` and `docs/cube.md` against the program: what they say is what it reads and writes.

mod cube;
mod examples;
mod files;
mod scene;

use std::path::Path;
use std::process::{Command, Output};

use crate::binary::without_devices;

/// A run of the real binary in `folder`; without any device unless one is asked for.
fn spectile(folder: &Path, arguments: &[&str], device: bool) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    // The Vulkan loader wants a folder, and would say so on stderr.
    command.current_dir(folder).env("XDG_RUNTIME_DIR", folder).args(arguments);
    if !device {
        without_devices(&mut command);
    }
    command.output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Blocks of code in `language` of a page.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let (mut found, mut open) = (Vec::new(), None::<(bool, String)>);
    for line in page.lines() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(name)) => open = Some((name == language, String::new())),
            (Some(_), Some(_)) => found.extend(open.take().filter(|block| block.0).map(|block| block.1)),
            (Some((_, block)), None) => {
                block.push_str(line);
                block.push('\n');
            }
            (None, None) => {}
        }
    }
    found
}

/// The cells of the rows of every table of a page, headers included.
fn rows(page: &str) -> Vec<Vec<String>> {
    let cells = |line: &str| {
        let inner = line.trim().trim_start_matches('|').trim_end_matches('|');
        inner.split(" | ").map(|cell| cell.trim().to_owned()).collect()
    };
    page.lines().filter(|line| line.starts_with('|')).map(cells).collect()
}
