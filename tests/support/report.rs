//! What tests tell `scripts/tests.py` beside their result, in the file that SPECTILE_TEST_REPORT names: how long they compiled,
//! rendered, worked out the reference and waited for the program, and what this machine lacks.

use std::fs::File;
use std::io::Write;
use std::time::Instant;

/// What a test spends its time on.
#[derive(Debug, Clone, Copy)]
pub enum Part {
    /// Kernels, from their text to the end of the first wave.
    Compilation,
    Rendering,
    Reference,
    /// The real binary.
    Program,
}

/// Does some of a test's work, and tells how long it took.
pub fn timed<T>(part: Part, work: impl FnOnce() -> T) -> T {
    let began = Instant::now();
    let done = work();
    let name = match part {
        Part::Compilation => "compilation",
        Part::Rendering => "rendering",
        Part::Reference => "reference",
        Part::Program => "program",
    };
    tell(name, &format!("{:.3}", began.elapsed().as_secs_f64()));
    done
}

/// Says loudly that this test, or a part of it, shows nothing here. CI must have what it needs.
#[track_caller]
pub fn skip(why: &str) {
    assert!(std::env::var("CI").as_deref() != Ok("true"), "must not be skipped under CI: {why}");
    excuse(why);
}

/// As [`skip`], where CI may lack it too.
pub fn excuse(why: &str) {
    eprintln!("skipped: {why}");
    tell("skipped", &format!("skipped: {why}"));
}

/// Says loudly that a part of this test shows nothing here.
pub fn excuse_a_part(why: &str) {
    eprintln!("skipped in part: {why}");
    tell("note", &format!("skipped in part: {why}"));
}

/// Tells which share of the standard error that a test allows there was: a small one means that it takes more samples than what it
/// shows needs.
pub fn resolution(what: &str, share: f64) {
    tell("resolution", &format!("{share:.3} of the resolution: {what}"));
}

fn tell(what: &str, value: &str) {
    let Some(path) = std::env::var_os("SPECTILE_TEST_REPORT") else { return };
    let thread = std::thread::current();
    let test = thread.name().expect("tests have threads of their name");
    let mut file = File::options().append(true).open(path).expect("the report");
    file.write_all(format!("{test}\t{what}\t{value}\n").as_bytes()).expect("written");
}
