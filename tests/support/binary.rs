//! The real binary, as users start it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::report::{Part, timed};

/// Long enough for anything here on a busy machine; what takes longer hangs.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// `spectile` with these arguments, in this folder.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    // As under cron: nothing on stderr may be for want of it.
    command.env_remove("XDG_RUNTIME_DIR").current_dir(folder).args(arguments);
    command
}

/// As on a machine that has no Vulkan.
pub fn without_devices(command: &mut Command) -> &mut Command {
    command.env("VK_DRIVER_FILES", "/nonexistent.json").env("VK_ICD_FILENAMES", "/nonexistent.json")
}

/// What a command says, when it has ended.
pub fn output(command: &mut Command) -> Output {
    timed(Part::Program, || command.output().expect("it runs"))
}

pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    output(&mut command(folder, arguments))
}

/// Asks again and again until there is an answer.
pub fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(began.elapsed() < PATIENCE, "waited too long for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The events of `--json`.
pub fn events(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).expect("a JSON object a line")).collect()
}

/// Width, height and pixels of a PNG file.
pub fn png(path: &Path) -> ([u32; 2], Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a file"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    ([info.width, info.height], pixels)
}

/// A file of this repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

pub fn cornell() -> PathBuf {
    repository("scenes/cornell/cornell.toml")
}
