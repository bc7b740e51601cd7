//! Scenes at the edges of what there can be, with exact answers; and the memory of a large one.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use super::{Place, arrays, samples, spectrum};

const CAMERA: &str = "[camera.perspective]\nposition = [0, 0, 0]\nlook_at = [0, 0, -1]\nup = [0, 1, 0]\nfov = 40\n";

fn scene(width: u32, height: u32, channels: u32, rest: &str) -> String {
    format!(
        "{CAMERA}[film]\nwidth = {width}\nheight = {height}\n\
         [channels]\nequal = {{ from = 400, to = 700, count = {channels} }}\n{rest}"
    )
}

/// A wall that fills the view and shines with radiance 0.75 in all channels.
const SHINING: &str = "[materials.wall.black]\n[[objects]]\n\
    quad = { corner = [-9, -9, -1], edge_u = [18, 0, 0], edge_v = [0, 18, 0] }\nmaterial = \"wall\"\nemission = 0.75\n";

#[track_caller]
fn renders_as(scene: &str, arguments: &[&str], answer: f32) {
    let place = Place::of(scene);
    let cube = place.render("cube.zarr", arguments);
    let [width, height] = cube.header().size;
    assert!(samples(&cube) >= 4);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let spectrum = spectrum(&cube, x, y);
        assert_eq!(spectrum.len(), cube.channels().len());
        let wrong = spectrum.iter().position(|v| v.to_bits() != answer.to_bits());
        assert_eq!(wrong, None, "pixel {x} {y}: {:?} ...", &spectrum[..spectrum.len().min(4)]);
    }
}

/// A directly visible constant is exact to the last bit, at any number of channels and samples.
#[test]
fn any_number_of_channels() {
    for channels in [1, 2, 3, 2000, 5000] {
        renders_as(&scene(9, 5, channels, SHINING), &["--spp", "16"], 0.75);
    }
}

#[test]
fn one_pixel() {
    renders_as(&scene(1, 1, 4, SHINING), &["--spp", "128"], 0.75);
    renders_as(&scene(1, 1, 1, SHINING), &["--spp", "4", "--tile", "8"], 0.75);
}

#[test]
fn nothing_that_shines() {
    let wall = SHINING
        .replace("emission = 0.75\n", "")
        .replace("[materials.wall.black]", "[materials.wall.diffuse]\nreflectance = 0.5");
    renders_as(&scene(9, 5, 4, &wall), &["--spp", "4"], 0.0);
}

#[test]
fn nothing_at_all() {
    renders_as(&scene(9, 5, 4, ""), &["--spp", "4"], 0.0);
    renders_as(&scene(9, 5, 4, "[environment]\nradiance = 0.3\n"), &["--spp", "70"], 0.3);
}

/// A picture of nothing is black, not an error.
#[test]
fn a_preview_of_nothing() {
    let place = Place::of(&scene(9, 5, 4, ""));
    let cube = place.render("cube.zarr", &["--spp", "1", "--preview", "black.png"]);
    assert!(arrays(&cube).contains_key("preview/c/0/0/0"));
    assert!(super::png(&place.path().join("black.png")).1.iter().all(|&v| v == 0));
}

/// 256 x 256 x 400 through the real binary. The bound is on the process as a whole, what it holds of the device's
/// buffers included, so it is stricter than what is promised: 200 MiB apart from scene and device buffers.
#[test]
#[cfg(target_os = "linux")]
fn anonymous_memory_stays_small() {
    let place = Place::new();
    let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.toml");
    let arguments = ["render", cornell, "-o", "cube.zarr", "--spp", "2", "--json", "--preview", "preview.png"];
    let mut child = place.command(&arguments).stdout(Stdio::piped()).spawn().expect("starts");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    // Every group of units says something, while it is still held.
    for line in BufReader::new(child.stdout.take().expect("piped")).lines() {
        line.expect("UTF-8");
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let kib =
            status.lines().find_map(|l| l.strip_prefix("RssAnon:")?.trim().strip_suffix(" kB")?.parse::<u64>().ok());
        peak = peak.max(kib.unwrap_or(0));
    }
    assert!(child.wait().expect("ends").success());
    assert_eq!(samples(&place.cube("cube.zarr")), 2);
    println!("at most {} MiB", peak >> 10);
    assert!((10 << 10..200 << 10).contains(&peak), "{} MiB", peak >> 10);
}
