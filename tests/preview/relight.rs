//! Light and paint chosen on the server are what `spectile relight` makes of the cube, and nothing else is let in.

use std::fs;
use std::net::SocketAddr;

use serde_json::{Value, json};
use spectile::cube::{Cube, Header, KeptWeights, Light, Relit};
use spectile::preview::web::Server;
use spectile::spectral::Channels;
use spectile::spectral::colour::{Observer, xyz_weights};
use spectile::spectral::lab::{delta_e_2000, lab};
use tempfile::tempdir;

use super::client::{Events, ask, get, put, serve};
use crate::binary::run;
use crate::cubes::{factored, header, patterned};

const SIZE: [u32; 2] = [48, 30];
/// A column that is chosen, and one that is not.
const CSV: &str = "nm,red,blue\n400,0.05,0.7\n550,0.1,0.3\n700,0.9,0.1\n";

fn choose(server: &Server, address: SocketAddr, which: &str, choice: &Value) -> Value {
    let answer = put(address, &format!("/api/relight/{which}"), Some(server.token()), &choice.to_string());
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.json()
}

fn floats(address: SocketAddr, target: &str) -> Vec<f32> {
    get(address, &format!("/api/image?{target}&format=f32")).floats()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
}

/// Two choices, and the cubes that the program makes of the words that the server answers.
#[test]
fn choices_are_what_relight_makes() {
    let folder = tempdir().expect("folder");
    let cube = factored(folder.path(), "cube.zarr", header(SIZE, [16, 16], 40), true);
    fs::write(folder.path().join("paint.csv"), CSV).expect("written");
    let (server, address) = serve(cube.path(), "127.0.0.1:0");
    let a = json!({ "spectra": { "desk lamp": { "illuminant": "D65" } }, "luminances": { "desk lamp": 1.0 } });
    let b = json!({
        "spectra": {
            "desk lamp": { "mix": [{ "named": "desk lamp" }, { "blackbody": 6500, "scale": 1e-6 }], "share": 0.75, "scale": 0.5 },
            "ceiling": { "illuminant": "FL11", "scale": 0.02 },
            "paint": { "file": "paint.csv", "column": "blue" },
        },
        "files": { "paint.csv": CSV },
    });
    for (which, choice) in [("a", &a), ("b", &b)] {
        let said = choose(&server, address, which, choice);
        assert_eq!(&said["choice"]["spectra"], &choice["spectra"]);
        let out = format!("{which}.zarr");
        let mut arguments = vec!["relight", "cube.zarr", "-o", &out, "--json"];
        for set in said["sets"].as_array().expect("a list") {
            arguments.extend(["--set", set.as_str().expect("text")]);
        }
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let relit = Cube::open(&folder.path().join(&out)).expect("a cube");
        let channel = |k: usize| {
            let at = |x, y| relit.spectrum(x, y).expect("read").expect("there")[k];
            (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect::<Vec<f32>>()
        };
        for k in [0, 17, 39] {
            assert_eq!(floats(address, &format!("show=channel&k={k}&choice={which}")), channel(k), "{which} {k}");
        }
        let three: Vec<f32> = [3, 20, 30].map(channel).concat();
        let n = three.len() / 3;
        let three: Vec<f32> = (0..n).flat_map(|i| [three[i], three[n + i], three[2 * n + i]]).collect();
        assert_eq!(floats(address, &format!("show=false&r=3&g=20&b=30&choice={which}")), three, "{which}");
        for [x, y] in [[0, 0], [47, 29], [30, 16]] {
            let json = get(address, &format!("/api/spectrum?x={x}&y={y}&choice={which}")).json();
            let got: Vec<f32> = numbers(&json["radiance"]).into_iter().map(|v| v as f32).collect();
            assert_eq!(got, relit.spectrum(x, y).expect("read").expect("there"), "{which} {x} {y}");
        }
        // The preview is rounded in each of its channels and in each of a pixel's five sums, the server's colours at the end only; weights of
        // a channel's colour add up to 5.3, signs left aside.
        let most = (0..40).flat_map(channel).fold(0.0, f32::max);
        let bound = 5.3 * most * 8.0 * f32::EPSILON;
        let (got, want) = (floats(address, &format!("show=colour&choice={which}")), relit.preview().expect("read").rgb);
        assert_eq!(got.len(), want.len());
        for (i, (got, want)) in got.iter().zip(&want).enumerate() {
            assert!((got - want).abs() <= bound, "{which} {i}: {got} {want}");
        }
        let mean = get(address, &format!("/api/spectrum?x=10&y=3&x1=40&y1=25&choice={which}")).json();
        let want =
            relit.state().region(spectile::cube::Rect { x0: 10, y0: 3, x1: 40, y1: 25 }).expect("read").expect("there");
        for (got, want) in numbers(&mean["radiance"]).iter().zip(&want.radiance) {
            // Sums of f32 products on one side, products of f64 sums on the other.
            assert!((got / want - 1.0).abs() < 6.0 * f64::from(f32::EPSILON), "{which}: {got} {want}");
        }
        assert!(said["warnings"].to_string().contains("does not separate and stays as it was: the material"), "{said}");
    }
    differences_are_those_of_both(folder.path(), address);
    // What was copied is what it was copied from.
    choose(&server, address, "a", &b);
    assert!(floats(address, "show=difference").iter().all(|v| *v == 0.0));
    // And what was reset is as it was rendered, which is what `preview` holds.
    let said = choose(&server, address, "b", &json!({}));
    assert_eq!((&said["sets"], &said["changed"]), (&json!([]), &json!([])));
    assert_eq!(floats(address, "show=colour&choice=b"), cube.preview().expect("read").rgb);
}

/// X, Y, Z of relit cubes by hand, and what follows from them.
fn differences_are_those_of_both(folder: &std::path::Path, address: SocketAddr) {
    let cubes = ["a", "b"].map(|name| Cube::open(&folder.join(format!("{name}.zarr"))).expect("a cube"));
    let weights = xyz_weights(cubes[0].channels(), Observer::Cie1931);
    let xyz = |cube: &Cube, x: u32, y: u32| {
        let spectrum = cube.spectrum(x, y).expect("read").expect("there");
        spectrum
            .iter()
            .zip(&weights)
            .fold([0.0f64; 3], |sum, (l, w)| std::array::from_fn(|i| sum[i] + w[i] * f64::from(*l)))
    };
    let near = |got: &Value, want: [f64; 3], bound: f64| {
        numbers(got).iter().zip(want).all(|(got, want)| (got - want).abs() <= bound)
    };
    let same = |got: &Value, want: [f64; 3]| {
        near(&json!(numbers(got).iter().zip(want).map(|(a, b)| a / b).collect::<Vec<_>>()), [1.0; 3], 2e-6)
    };
    // The picture of the first choice says what is white.
    let ev: f64 =
        get(address, "/api/image?show=colour&choice=a").header("x-exposure-ev").expect("EV").parse().expect("EV");
    let daylight = [0.95047, 1.0, 1.08883].map(|v| v * (-ev).exp2());
    let own = cubes.each_ref().map(|cube| xyz(cube, 7, 9).map(|v| v / 0.9));
    for (more, white) in [
        ("", [daylight; 2]),
        ("&white_luminance=0.25", [[0.95047, 1.0, 1.08883].map(|v| v * 0.25); 2]),
        ("&white_x=7&white_y=9&white_factor=0.9", own),
    ] {
        let picture = floats(address, &format!("show=difference{more}"));
        for [x, y] in [[0, 0], [47, 29], [20, 11]] {
            let found = get(address, &format!("/api/difference?x={x}&y={y}{more}")).json();
            let both = cubes.each_ref().map(|cube| xyz(cube, x, y));
            let [first, second] = [0, 1].map(|i| lab(both[i], white[i]));
            // L*, a*, b* of colours that are right to 1e-6: at most 500 times as much, and the slope at the dark end is 7.8.
            assert!(near(&found["a"]["lab"], first, 4e-3) && near(&found["b"]["lab"], second, 4e-3), "{found}");
            assert!(same(&found["a"]["xyz"], both[0]) && same(&found["b"]["white"], white[1]), "{found}");
            let (got, want) = (found["delta_e_2000"].as_f64().expect("a number"), delta_e_2000(first, second));
            assert!((got - want).abs() < 0.01 && want > 0.05, "{more} {x} {y}: {got} {want}");
            let shown = picture[(y * SIZE[0] + x) as usize];
            assert!((f64::from(shown) - got).abs() < 1e-5 * got, "{shown} {got}");
            let luminance = found["a"]["luminance_cd_m2"].as_f64().expect("a number");
            assert!((luminance / (683.002 * 106.857 * both[0][1]) - 1.0).abs() < 1e-4, "{luminance}");
        }
    }
    let (png, range) = (get(address, "/api/image?show=difference&high=20"), "0,20");
    assert_eq!((png.header("x-range-de"), png.header("content-type")), (Some(range), Some("image/png")));
    let small = floats(address, "show=difference&scale=64")[0];
    let all = floats(address, "show=difference");
    let mean = all.iter().sum::<f32>() / all.len() as f32;
    assert!((small / mean - 1.0).abs() < 1e-4, "{small} {mean}");
}

/// What is kept and what is read again are the same.
#[test]
fn cubes_that_do_not_fit_are_read_again() {
    let folder = tempdir().expect("folder");
    let cube = factored(folder.path(), "cube.zarr", header(SIZE, [16, 16], 9), true);
    let light = || Light::new(&cube, &crate::cubes::basis());
    let (large, small) = (KeptWeights::new(&cube, 1 << 30), KeptWeights::new(&cube, 40_000));
    let (light_of_large, light_of_small) = (light(), light());
    let of = |kept, light| Relit { state: cube.state(), kept, light };
    let whole = cube.grid().whole();
    for _ in 0..2 {
        let [a, b] = [of(&large, &light_of_large), of(&small, &light_of_small)]
            .map(|relit| relit.colour(whole, 1).expect("a picture"));
        assert_eq!(a, b);
        let [a, b] = [of(&large, &light_of_large), of(&small, &light_of_small)]
            .map(|relit| relit.spectrum(40, 20).expect("read"));
        assert_eq!(a, b);
        assert_eq!(a, cube.spectrum(40, 20).expect("read"));
    }
    assert!(
        small.bytes() <= 40_000 && small.bytes() > 0 && large.bytes() > small.bytes(),
        "{} {}",
        small.bytes(),
        large.bytes()
    );
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let folder = tempdir().expect("folder");
    let cube = factored(folder.path(), "cube.zarr", header(SIZE, [16, 16], 9), true);
    let (server, address) = serve(cube.path(), "127.0.0.1:0");
    let token = Some(server.token());
    let what = get(address, "/api/relight").json();
    let names: Vec<&str> =
        what["spectra"].as_array().expect("a list").iter().filter_map(|s| s["name"].as_str()).collect();
    assert_eq!(names, ["ceiling", "desk lamp", "grey", "paint"]);
    assert_eq!(what["not_changed"], json!(["varnish"]));
    assert_eq!(what["choices"]["b"]["command"], "spectile relight cube.zarr -o relit.zarr");
    assert_eq!(get(address, "/api/status").json()["relight"], json!({ "a": 0, "b": 0 }));
    let secret = folder.path().join("secret.csv");
    fs::write(&secret, CSV).expect("written");
    for (choice, words) in [
        (json!({ "spectra": { "lmap": 1 } }), "the cube has ceiling, desk lamp, grey, paint"),
        (json!({ "spectra": { "varnish": 1 } }), "only by what does not separate (the material \"cat\" (plastic))"),
        (json!({ "spectra": { "paint": 1.5 } }), "must lie in [0, 1]"),
        (json!({ "spectra": { "paint": { "file": secret } } }), "no file of this machine is read here"),
        (
            json!({ "spectra": { "paint": { "mix": [0.5, { "file": "secret.csv" }] } } }),
            "no file of this machine is read here",
        ),
        (
            json!({ "spectra": { "paint": { "file": "p.csv" } }, "files": { "p.csv": "nm,r\n400,0.5\n500,7\n" } }),
            "p.csv, line 3",
        ),
        (json!({ "spectra": { "desk lamp": { "illuminant": "D66" } } }), "D65"),
        (json!({ "spectra": { "ceiling": 1 }, "luminances": { "ceiling": 1 } }), "without luminance"),
        (json!({ "temperatures": { "oven": 400 } }), "no hot material"),
        (json!({ "paints": {} }), "unknown field `paints`"),
        (json!(1), "no choice"),
    ] {
        let answer = put(address, "/api/relight/a", token, &choice.to_string());
        let said = answer.json()["error"].as_str().expect("text").to_owned();
        assert!(answer.status == 400 && said.contains(words), "{choice}: {} {said}", answer.status);
        assert!(!said.contains(folder.path().to_str().expect("UTF-8")) || said.contains("names the file"), "{said}");
    }
    let status = |target: &str, token: Option<&str>, body: &str| put(address, target, token, body).status;
    assert_eq!(status("/api/relight/a", None, "{}"), 403);
    assert_eq!(status("/api/relight/a", Some("0"), "{}"), 403);
    assert_eq!(status("/api/relight/c", token, "{}"), 400);
    assert_eq!(status("/api/relight/a", token, "{"), 400);
    let bearer = format!("Bearer {}", server.token());
    let too_long = [("Authorization", bearer.as_str()), ("Content-Length", "1048577")];
    assert_eq!(ask(address, "PUT", "/api/relight/a", &too_long).status, 413);
    assert_eq!(status("/api/relight/a", token, &format!("{{}}{}", " ".repeat((1 << 20) - 2))), 200);
    assert_eq!(
        ask(address, "POST", "/api/relight/a", &[("Authorization", &format!("Bearer {}", server.token()))]).status,
        405
    );
    for target in [
        "image?show=difference&choice=a",
        "image?show=samples&choice=a",
        "image?show=colour&choice=c",
        "image?show=colour&white_x=3",
        "image?show=difference&white_x=3",
        "image?show=difference&white_x=3&white_y=30",
        "image?show=difference&white_factor=0.5",
        "image?show=difference&white_luminance=0",
        "difference?x=48&y=0",
        "difference?x=1&y=1&white_luminance=1&white_x=1&white_y=1",
    ] {
        assert_eq!(ask(address, "GET", &format!("/api/{target}"), &[]).status, 400, "{target}");
    }
    // Cubes of radiance, and of channels that no eye sees.
    let plain = patterned(folder.path(), "plain.zarr", header([16, 8], [8, 8], 5));
    let (plain_server, plain_address) = serve(plain.path(), "127.0.0.1:0");
    for target in
        ["relight", "difference?x=1&y=1", "image?choice=a", "image?show=difference", "spectrum?x=1&y=1&choice=b"]
    {
        assert_eq!(ask(plain_address, "GET", &format!("/api/{target}"), &[]).status, 404, "{target}");
    }
    assert_eq!(put(plain_address, "/api/relight/a", Some(plain_server.token()), "{}").status, 404);
    assert!(get(plain_address, "/api/status").json()["relight"].is_null());
    let warm = Header { channels: Channels::equal(2000.0, 3000.0, 5), ..header([16, 8], [8, 8], 5) };
    let warm = factored(folder.path(), "warm.zarr", warm, false);
    let (warm_server, warm_address) = serve(warm.path(), "127.0.0.1:0");
    choose(&warm_server, warm_address, "b", &json!({ "spectra": { "desk lamp": { "blackbody": 2000 } } }));
    assert_ne!(floats(warm_address, "choice=b"), floats(warm_address, "choice=a"));
    let answer = ask(warm_address, "GET", "/api/difference?x=1&y=1", &[]);
    assert!(answer.status == 400 && answer.text().contains("do not cover the visible"), "{}", answer.text());
}

/// Whoever else looks hears of a choice.
#[test]
fn choices_are_news() {
    let folder = tempdir().expect("folder");
    let cube = factored(folder.path(), "cube.zarr", header([16, 8], [8, 8], 9), false);
    let (server, address) = serve(cube.path(), "127.0.0.1:0");
    let mut events = Events::listen(address);
    assert_eq!(events.next().expect("an event").1["relight"], json!({ "a": 0, "b": 0 }));
    let said = choose(&server, address, "b", &json!({ "spectra": { "ceiling": 0.01 } }));
    let heard = events.find(|(_, state)| state["relight"]["b"] == said["revision"]).expect("an event").1;
    assert_eq!(heard["relight"]["a"], 0);
    assert_eq!(heard["changed"], json!([]));
}
