//! The page in a real browser: tests/page/drive.mjs does what somebody who looks at it would.
//!
//! SPECTILE_CHROMIUM names a Chromium, and tests/page/node_modules has what drives it (`./check` installs both). Without them
//! these tests say so and pass, except where CI=true. SPECTILE_SHOTS names a folder for screenshots.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use spectile::cube::{Cube, Header};
use spectile::spectral::{Channels, planck};
use tempfile::tempdir;

use super::client::Running;
use crate::binary::{command, cornell};
use crate::cubes::{create, factored, header, pattern, patterned, unit};
use crate::report::skip;

/// What the page showed; `None` without a browser.
fn drive(what: &str, url: &str, [x, y]: [u32; 2]) -> Option<Value> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    let chromium = std::env::var_os("SPECTILE_CHROMIUM").filter(|path| !path.is_empty());
    if chromium.is_none() || !folder.join("node_modules/playwright-core").is_dir() {
        skip("SPECTILE_CHROMIUM names no browser, or tests/page/node_modules is not there");
        return None;
    }
    let mut node = Command::new("node");
    node.arg(folder.join("drive.mjs")).args([what, url, &x.to_string(), &y.to_string()]);
    if let Some(shots) = std::env::var_os("SPECTILE_SHOTS") {
        node.arg(shots);
    }
    let output = node.stdin(Stdio::null()).stderr(Stdio::inherit()).output().expect("node runs");
    assert!(output.status.success(), "{what}: the page could not be driven");
    let seen: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(seen["complaints"], serde_json::json!([]), "the browser complains");
    assert_eq!(seen["elsewhere"], serde_json::json!([]), "something is asked of others");
    // An empty canvas has a handful.
    assert!(seen["start"]["colours"].as_u64() > Some(20), "there is a picture: {}", seen["start"]);
    Some(seen)
}

/// Numbers of the second column of CSV.
fn column(csv: &str) -> Vec<f64> {
    let lines = csv.lines().skip(1);
    lines.map(|line| line.split(',').nth(1).expect("a column").parse().expect("a number")).collect()
}

/// What every picture of a cube does.
#[track_caller]
fn check_looking(seen: &Value, folder: &Path, [x, y]: [u32; 2]) {
    assert_eq!((&seen["pin"]["x"], &seen["pin"]["y"], &seen["pin"]["plotted"]), (&x.into(), &y.into(), &true.into()));
    let printed = command(folder, &["spectrum", "cube.zarr", &x.to_string(), &y.to_string()]).output().expect("runs");
    let printed = String::from_utf8(printed.stdout).expect("UTF-8");
    let downloaded = seen["csv"]["text"].as_str().expect("text");
    // As numbers: scripts write 1e-7 where Rust writes 1e-7 or 0.0000001.
    assert_eq!(column(downloaded), column(&printed));
    assert_eq!(downloaded.lines().next(), printed.lines().next());
    let cube = Cube::open(&folder.join("cube.zarr")).expect("a cube");
    let spectrum = |x, y| cube.spectrum(x, y).expect("read").expect("there");
    let shown = |pin: &Value| -> Vec<f64> {
        pin["radiance"].as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let as_f32 = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect::<Vec<_>>();
    assert_eq!(as_f32(shown(&seen["pins"][1])), spectrum(x + 1, y + 1), "the cursor moved by keys");
    let region = &seen["pins"][2];
    let of = |name: &str| region[name].as_u64().expect("a number") as u32;
    let (xs, ys) = (of("x")..of("x1"), of("y")..of("y1"));
    assert_eq!(u64::from(xs.len() as u32 * ys.len() as u32), region["pixels"].as_u64().expect("a count"));
    assert!(xs.len() > 1 && ys.len() > 1);
    for (k, got) in shown(region).into_iter().enumerate() {
        let sum: f64 =
            ys.clone().flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| f64::from(spectrum(x, y)[k])).sum();
        let mean = sum / region["pixels"].as_f64().expect("a count");
        assert!((got - mean).abs() <= 1e-12 * mean.abs(), "{k}: {got} {mean}");
    }
    let all = seen["all_csv"].as_str().expect("text");
    let columns = |csv: &str| csv.lines().next().expect("a header").split(',').count();
    assert_eq!(columns(all), 1 + 3 * (columns(downloaded) - 1));
    assert_eq!(all.lines().count(), cube.channels().len() + 1);
    for change in ["brighter", "automatic", "channel", "slider", "step", "false_colour", "closer", "fit"] {
        assert_eq!(seen[change]["changed"], true, "{change}: {}", seen[change]);
    }
    assert!(seen["brighter"]["after"].as_f64() > seen["brighter"]["before"].as_f64());
    assert_eq!((&seen["slider"]["label"], &seen["step_back"]), (&true.into(), &true.into()));
    let zooms: Vec<f64> = seen["zooms"].as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
    let [fits, closer, farther, one, again] = zooms[..] else { panic!("{zooms:?}") };
    assert!(closer > 1.4 * fits && (farther / fits - 1.0).abs() < 1e-9 && one == 1.0 && again == fits, "{zooms:?}");
    assert_ne!(seen["themes"][0], seen["themes"][1], "light and dark");
    assert_eq!((&seen["pins_left"], &seen["help"]), (&0.into(), &true.into()));
}

#[test]
fn a_render_is_watched() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let small =
        ["--size", "128x128", "--tile", "32", "--set", "channels.equal.count=50", "--set", "integrator.epoch=4"];
    let render =
        ["render", scene.to_str().expect("UTF-8"), "-o", "cube.zarr", "--spp", "1000000000", "--json", "--listen"];
    let running = Running::start(folder.path(), &[&render[..], &["127.0.0.1:0"], &small].concat());
    let place = [20, 75];
    let Some(seen) = drive("render", &running.url, place) else { return };
    println!("first picture after {} ms in the browser", seen["first_picture_ms"]);
    assert_eq!((&seen["updates"], &seen["rests"], &seen["stage"]), (&true.into(), &true.into(), &"stopped".into()));
    assert!(seen["curve"]["points"].as_u64() >= Some(3) && seen["curve"]["drawn"] == true);
    assert_eq!(seen["devices"], 1);
    assert_eq!(running.ends().0, Some(130));
    // Stopped while it rested: the cube that is left is the one that was looked at.
    check_looking(&seen, folder.path(), place);
}

#[test]
fn a_finished_cube_opens() {
    let folder = tempdir().expect("folder");
    // Larger than a square of the page, so that it is zoomed out at first; smooth, with every channel its own picture.
    let cube = create(folder.path(), "cube.zarr", header([640, 400], [64, 64], 31));
    for tile in 0..cube.grid().count() {
        let value = |x: u32, y: u32, k: usize| {
            let (u, v) = (f64::from(x) / 640.0, f64::from(y) / 400.0);
            (0.1 + u * (k as f64 / 30.0) + v * (1.0 - k as f64 / 30.0) + 0.2 * (20.0 * u).sin() * (15.0 * v).cos())
                .abs() as f32
        };
        cube.merge_unit(tile, 1, &unit(&cube, tile, value)).expect("merged");
    }
    let running = Running::start(folder.path(), &["view", "cube.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let place = [321, 77];
    let Some(seen) = drive("view", &running.url, place) else { return };
    check_looking(&seen, folder.path(), place);
    assert_eq!((&seen["stage"], &seen["panel"]), (&"viewing".into(), &false.into()), "nothing to relight");
    // The page looks sRGB up in a table of 8192 steps, which are 0.05 of a value apart at most.
    for how in ["against_png", "channel_against_png"] {
        assert!(seen[how].as_u64() <= Some(1) && seen[how].is_u64(), "{how}: {}", seen[how]);
    }
}

#[test]
fn heat_is_shown_in_kelvins() {
    let folder = tempdir().expect("folder");
    let bounds: Vec<[f64; 2]> = (0..20).map(|i| [8e3 + 200.0 * f64::from(i), 8.2e3 + 200.0 * f64::from(i)]).collect();
    let channels = Channels::from_bounds(bounds.clone(), None);
    let cube = create(folder.path(), "cube.zarr", Header { channels, ..header([160, 120], [64, 64], 20) });
    let kelvin = |x: u32, y: u32| 280.0 + 0.2 * f64::from(x) + 10.0 * (f64::from(y) / 12.0).sin();
    for tile in 0..cube.grid().count() {
        let value = |x, y, k: usize| planck::radiance(0.5 * (bounds[k][0] + bounds[k][1]), kelvin(x, y)) as f32;
        // Of tiles in every other column more than once.
        let portions = if tile % 2 == 0 { &[1][..] } else { &[1, 1, 2] };
        portions.iter().for_each(|&n| cube.merge_unit(tile, n, &unit(&cube, tile, value)).expect("merged"));
    }
    let running = Running::start(folder.path(), &["view", "cube.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let Some(seen) = drive("heat", &running.url, [80, 60]) else { return };
    assert_eq!(seen["opens_as"], "temperature");
    assert_eq!(seen["against_png"], 0, "one colour map for the page and for pictures");
    let cursor = seen["cursor"].as_str().expect("text");
    let shown: f64 =
        cursor.split(": ").nth(1).and_then(|text| text.split(' ').next()).expect("a number").parse().expect("a number");
    // Radiance at the centre of a narrow channel stands for its mean, to a hundredth of a kelvin; four digits are shown.
    assert!((shown - kelvin(80, 60)).abs() < 0.1, "{cursor} {}", kelvin(80, 60));
    let range: Vec<f64> = [0, 1].map(|i| seen["range"][i].as_str().expect("text").parse().expect("a number")).to_vec();
    assert!(range[0] > 269.0 && range[0] < 276.0 && range[1] > 315.0 && range[1] < 323.0, "{range:?}");
    assert_eq!((&seen["samples"]["changed"], &seen["samples_against_png"]), (&json!(true), &json!(0)));
    let (cursor, range) = (seen["samples_cursor"].as_str().expect("text"), &seen["samples_range"]);
    assert!(cursor.ends_with(": 4 samples") && *range == json!([1, 4]), "{cursor} {range}");
}

/// Light and paint, by the menus of the page: what it shows is what `relight` makes of the command line that it shows.
#[test]
fn light_and_paint_are_chosen() {
    let folder = tempdir().expect("folder");
    let cube = factored(folder.path(), "cube.zarr", header([96, 64], [32, 32], 40), true);
    let running = Running::start(folder.path(), &["view", "cube.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let [x, y] = [70, 40];
    let Some(seen) = drive("relight", &running.url, [x, y]) else { return };
    assert_eq!((&seen["panel"], &seen["rows"]), (&json!(true), &json!(["ceiling", "desk lamp", "grey", "paint"])));
    let radiance = |of: &str, which: &str| -> Vec<f32> {
        let values = seen[of][which].as_array().unwrap_or_else(|| panic!("{of} {which}: {}", seen[of]));
        values.iter().map(|v| v.as_f64().expect("a number") as f32).collect()
    };
    let rendered = cube.spectrum(x, y).expect("read").expect("there");
    assert_eq!((radiance("before", "radiance"), &seen["before"]["other"]), (rendered.clone(), &Value::Null));
    for change in ["illuminant", "scaled", "mixed", "dropped", "switched", "difference", "white"] {
        assert_eq!(seen[change]["changed"], true, "{change}: {}", seen[change]);
    }
    // B is shown, and A, as it was rendered, beside it.
    assert_eq!(
        (radiance("under_illuminant", "other"), &seen["under_illuminant"]["series"]),
        (rendered.clone(), &json!(2))
    );
    assert_ne!(radiance("under_illuminant", "radiance"), rendered);
    // A quarter of the luminance that was rendered, so of all but the remainder.
    let y_of = |of: &str| seen[of]["difference"]["b"]["xyz"][1].as_f64().expect("a number");
    assert!(y_of("under_scaled") < 0.9 * y_of("under_illuminant"));
    assert!(
        seen["scaled"]["after"].as_f64() < seen["scaled"]["before"].as_f64(),
        "exposed as A is: {}",
        seen["scaled"]
    );
    // The same by the command line.
    std::fs::write(folder.path().join("paint.csv"), "nm,r\n400,0.9\n700,0.1\n").expect("written");
    let mut arguments = vec!["relight", "cube.zarr", "-o", "relit.zarr"];
    let sets = seen["sets"].as_array().expect("a list");
    sets.iter().for_each(|set| arguments.extend(["--set", set.as_str().expect("text")]));
    assert!(command(folder.path(), &arguments).output().expect("runs").status.success());
    let relit = Cube::open(&folder.path().join("relit.zarr")).expect("a cube");
    assert_eq!(radiance("under_dropped", "radiance"), relit.spectrum(x, y).expect("read").expect("there"));
    let line = seen["command"].as_str().expect("text");
    assert!(
        line.starts_with("spectile relight cube.zarr -o relit.zarr --set '") && line.contains("paint.csv"),
        "{line}"
    );
    assert!(seen["wrong"].as_str().expect("text").contains("must lie in [0, 1]"), "{}", seen["wrong"]);
    let refusals = seen["refusals"].as_array().expect("a list");
    assert!(refusals.len() == 1 && refusals[0].to_string().contains("400"), "{refusals:?}");
    assert_eq!((&seen["shown"], &seen["against_png"]), (&json!("a"), &json!(0)));
    let delta = |of: &str| seen[of]["difference"]["delta_e_2000"].as_f64();
    let shown = format!("ΔE {:.2}", delta("under_dropped").expect("a number"));
    assert_eq!(seen["list"], shown);
    let cursor = seen["cursor"].as_str().expect("text");
    assert!(cursor.ends_with(" ΔE 2000"), "{cursor}");
    // Its own white under each choice.
    assert!(delta("under_white").expect("a number") < 1e-9, "{}", seen["under_white"]);
    assert_eq!((delta("copied"), &seen["copied"]["other"]), (None, &Value::Null));
    assert_eq!(seen["end"]["hash"], seen["start"]["hash"], "reset");
    let ceiling = &seen["forms"]["ceiling"];
    assert_eq!((&ceiling["first"]["kind"], &ceiling["first"]["value"]), (&json!("constant"), &json!(0.02)));
}

/// Where the cube has standard errors, the plot has a band around each spectrum, and the file a column.
#[test]
fn standard_errors_are_plotted() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header([64, 48], [16, 16], 12).with_uncertainty());
    for (tile, epoch) in (0..cube.grid().count()).flat_map(|tile| [(tile, 0u32), (tile, 1)]) {
        let value = |x, y, k| pattern(x, y, k) * (1.0 + 0.1 * epoch as f32);
        cube.merge_unit(tile, 64, &unit(&cube, tile, value)).expect("merged");
    }
    let running = Running::start(folder.path(), &["view", "cube.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let Some(seen) = drive("view", &running.url, [30, 20]) else { return };
    check_looking(&seen, folder.path(), [30, 20]);
    assert_eq!(seen["pin"]["bands"], 1);
    let downloaded = seen["csv"]["text"].as_str().expect("text");
    assert!(downloaded.starts_with("wavelength_nm,radiance,standard_error\n"), "{downloaded}");
    let errors = downloaded.lines().skip(1).map(|line| line.rsplit(',').next().expect("a column").parse::<f32>());
    let errors: Vec<f32> = errors.map(|error| error.expect("a number")).collect();
    assert_eq!(errors, cube.standard_error(30, 20).expect("read").expect("there"));
    // Of two epochs, half their distance: 5 %.
    for (k, error) in errors.into_iter().enumerate() {
        assert!((error / pattern(30, 20, k) - 0.05).abs() < 1e-5, "{k}: {error}");
    }
}

/// A cube under somebody's eyes in two browsers at once, which is what loopback is for.
#[test]
fn two_may_look_at_once() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([64, 48], [16, 16], 12));
    let running = Running::start(folder.path(), &["view", "cube.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let url = running.url.clone();
    let other = std::thread::spawn(move || drive("view", &url, [30, 20]));
    let own = drive("view", &running.url, [10, 20]);
    let other = other.join().expect("no panic");
    for (seen, place) in [(own, [10, 20]), (other, [30, 20])] {
        let Some(seen) = seen else { continue };
        check_looking(&seen, cube.path().parent().expect("a folder"), place);
    }
}
