//! What it costs a render that somebody watches: the Cornell box with `--listen` and the page open, against the same without,
//! by the CPU time of the render's process, all threads. Rounds take turns, and so does who comes first; the median of the
//! ratios with the range of the middle half. The page is open in a real Chromium where SPECTILE_CHROMIUM names one (its own
//! CPU time does not count); without, a client asks what the page asks. Without `--bench`, as `cargo test` runs it, one short
//! round shows that it still works.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;

fn main() {
    let measure = std::env::args().any(|a| a == "--bench");
    let (size, spp, rounds) = if measure { ("128x128", "192", 11) } else { ("32x32", "4", 1) };
    let mut ratios = Vec::new();
    for round in 0..rounds {
        let mut seconds = [0.0; 2];
        for watched in if round % 2 == 0 { [false, true] } else { [true, false] } {
            seconds[usize::from(watched)] = render(size, spp, watched, measure);
        }
        let [alone, watched] = seconds;
        ratios.push(watched / alone);
        println!(
            "round {round}: {alone:.2} CPU s alone, {watched:.2} watched: {:+.2} %",
            100.0 * (watched / alone - 1.0)
        );
    }
    ratios.sort_by(f64::total_cmp);
    let percent = |at: usize| 100.0 * (ratios[at.min(ratios.len() - 1)] - 1.0);
    println!(
        "a page that is open costs {:+.2} % of CPU time (middle half {:+.2} … {:+.2})",
        percent(ratios.len() / 2),
        percent(ratios.len() / 4),
        percent(3 * ratios.len() / 4)
    );
}

/// CPU seconds of a render, from its beginning to its end.
fn render(size: &str, spp: &str, watched: bool, measure: bool) -> f64 {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    command.env("XDG_RUNTIME_DIR", folder.path()).current_dir(folder.path());
    command.arg("render").arg(scene).args(["-o", "cube.zarr", "--json", "--size", size, "--spp", spp, "--tile", "32"]);
    if watched {
        command.args(["--listen", "127.0.0.1:0"]);
    }
    let mut child = command.stdout(Stdio::piped()).spawn().expect("runs");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut viewer = None;
    for line in lines.by_ref() {
        let event: Value = serde_json::from_str(&line.expect("UTF-8")).expect("JSON");
        if event["event"] == "listening" {
            viewer = Some(Viewer::open(event["url"].as_str().expect("a URL"), measure));
        }
    }
    let seconds = cpu_seconds_of(&mut child);
    if let Some(viewer) = viewer {
        viewer.close();
    }
    seconds
}

/// User and system time of a process that has ended and has not been waited for, which is then done.
fn cpu_seconds_of(child: &mut Child) -> f64 {
    let path = format!("/proc/{}/stat", child.id());
    loop {
        let stat = std::fs::read_to_string(&path).expect("Linux");
        let fields: Vec<&str> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
        if fields[0] == "Z" {
            assert!(child.wait().expect("ends").success());
            let ticks = |i: usize| fields[i].parse::<f64>().expect("a number");
            return (ticks(11) + ticks(12)) / 100.0;
        }
        thread::sleep(Duration::from_millis(5));
    }
}

enum Viewer {
    Browser(Child),
    Client(JoinHandle<()>),
}

impl Viewer {
    fn open(url: &str, measure: bool) -> Viewer {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
        if measure && std::env::var_os("SPECTILE_CHROMIUM").is_some() {
            let mut node = Command::new("node");
            node.arg(folder.join("hold.mjs")).arg(url).stdin(Stdio::piped()).stdout(Stdio::null());
            return Viewer::Browser(node.spawn().expect("node runs"));
        }
        let host = url.trim_start_matches("http://").trim_end_matches('/').to_owned();
        Viewer::Client(thread::spawn(move || {
            // The server goes when the render ends.
            let _ = watch(&host);
        }))
    }

    fn close(self) {
        match self {
            Viewer::Browser(mut node) => {
                drop(node.stdin.take());
                node.wait().expect("ends");
            }
            Viewer::Client(client) => client.join().expect("no panic"),
        }
    }
}

/// Asks as the page does: for the picture when it has changed, not more often than at leisure, and for a pixel.
fn watch(host: &str) -> std::io::Result<()> {
    let ask = |target: &str| -> std::io::Result<usize> {
        let mut stream = TcpStream::connect(host)?;
        write!(stream, "GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")?;
        stream.read_to_end(&mut Vec::new())
    };
    let mut events = TcpStream::connect(host)?;
    write!(events, "GET /api/events HTTP/1.1\r\nHost: {host}\r\n\r\n")?;
    let mut next = Instant::now();
    for line in BufReader::new(events).lines() {
        if line?.starts_with("data: ") && next <= Instant::now() {
            let began = Instant::now();
            ask("/api/image?show=colour&format=f32")?;
            ask("/api/spectrum?x=9&y=9")?;
            next = Instant::now() + Duration::from_millis(400).max(10 * began.elapsed());
        }
    }
    Ok(())
}
