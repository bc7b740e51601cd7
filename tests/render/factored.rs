//! `render --factored` and `relight` as users meet them: nothing is lost, everything reads such cubes, and relit ones are what a
//! new render makes.

use std::fs;

use spectile::cube::Cube;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Place, Running, SCENE, arrays, samples, spectrum, text};
use crate::outside;

const TILES_OF_8: &[&str] = &["--tile", "8"];

/// The scene with a red paint and two lamps, one of which is off.
fn scene() -> String {
    SCENE.replace(
        "[materials.black.black]",
        r#"[spectra.other]
constant = 0.0

[spectra.paint]
samples = [[400, 0.2], [550, 0.3], [560, 0.8], [700, 0.9]]

[materials.red.diffuse]
reflectance = "paint"

[[objects]]
sphere = { center = [-0.6, -0.7, -0.2], radius = 0.3 }
material = "red"

[[objects]]
sphere = { center = [0.7, 0.7, 0.2], radius = 0.2 }
material = "black"
emission = "other"

[materials.black.black]"#,
    )
}

fn values(cube: &Cube) -> Vec<f32> {
    let [width, height] = cube.header().size;
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| spectrum(cube, x, y)).collect()
}

/// In portions, on other devices, tile by tile, in processes side by side, with little memory: the same bytes.
#[test]
fn weights_go_on_where_they_were() {
    let place = Place::of(&scene());
    let more = [TILES_OF_8, &["--factored"]].concat();
    let straight = arrays(&place.render("straight.zarr", &[&more[..], &["--spp", "320"]].concat()));
    assert!(straight.keys().any(|name| name == "weights/c/2/2/0/0"), "{:?}", straight.keys());
    assert!(straight.keys().all(|name| !name.starts_with("radiance")), "{:?}", straight.keys());
    for (i, spp) in ["1", "64", "128", "192", "320"].into_iter().enumerate() {
        let existing: &[&str] = if spp == "1" { &[] } else { &["--resume"] };
        let devices = ["1", "2", "3"][i % 3];
        place.render("parts.zarr", &[&more[..], existing, &["--spp", spp, "--devices", devices]].concat());
    }
    assert!(arrays(&place.cube("parts.zarr")) == straight, "in portions");
    // All of the first epoch at once, as several processes would.
    for tiles in ["0..4", "4..9"] {
        place.render("tiles.zarr", &[&more[..], &["--spp", "320", "--tiles", tiles]].concat());
    }
    assert!(arrays(&place.cube("tiles.zarr")) == straight, "by tiles");
    place.render("small.zarr", &[&more[..], &["--spp", "320", "--memory", "24MiB"]].concat());
    assert!(arrays(&place.cube("small.zarr")) == straight, "in small waves");
    let (stdout, _) = place.success(&["info", "parts.zarr", "--verify"]);
    assert!(stdout.lines().any(|line| line.starts_with("verified") && line.ends_with(" 0 damaged")), "{stdout}");
    // Other tiles hold the same pixels.
    let large = place.render("large.zarr", &["--factored", "--spp", "320"]);
    assert_eq!(values(&large), values(&place.cube("straight.zarr")));
    // What it is, is part of it.
    let render = ["render", "scene.toml", "-o", "parts.zarr", "--resume", "--spp", "384", "--tile", "8"];
    let output = place.run(&render);
    assert!(output.status.code() == Some(2) && text(&output.stderr).contains("factored"), "{}", text(&output.stderr));
}

/// SIGKILL at moments anywhere; then the end.
#[test]
fn kills_change_no_bit_of_weights() {
    let place = Place::of(&scene());
    let mut random = 7u64;
    let is_under_way = || place.path().join("cube.zarr").exists();
    let has_epochs = || is_under_way() && place.cube("cube.zarr").progress().expect("progress").samples[0] > 64;
    for i in (0..160).take_while(|&i| i < 8 || !has_epochs()) {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let resume: &[&str] = if is_under_way() { &["--resume"] } else { &[] };
        let devices = ["1", "2"][i as usize % 2];
        let more = [TILES_OF_8, resume, &["--factored", "--devices", devices, "--quiet"]].concat();
        let mut child: Running = place.start("cube.zarr", &more);
        std::thread::sleep(std::time::Duration::from_millis(100 + (random >> 33) % 1500));
        child.0.kill().expect("killed");
        child.0.wait().expect("ended");
    }
    let [_, most] = place.cube("cube.zarr").progress().expect("progress").samples;
    let spp = &(most + 64).to_string();
    let more = [TILES_OF_8, &["--factored", "--spp", spp]].concat();
    place.success(&[&["render", "scene.toml", "-o", "cube.zarr", "--resume"], &more[..]].concat());
    let straight = place.render("straight.zarr", &more);
    assert!(arrays(&place.cube("cube.zarr")) == arrays(&straight));
}

/// A bit that flips, and a file that is of another time than its neighbour: found, told and mended.
#[test]
fn damage_is_found() {
    let place = Place::of(&scene());
    let more = ["--factored", "--spp", "64"];
    let cube = place.render("cube.zarr", &more);
    let before = arrays(&cube);
    for part in ["weights", "products"] {
        let file = cube.path().join(part).join("c/0/0/0/0");
        let mut bytes = fs::read(&file).expect("read");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        fs::write(&file, &bytes).expect("written");
        let output = place.run(&["info", "cube.zarr", "--verify"]);
        assert!(text(&output.stdout).contains(&format!("{part}/c/0/0/0/0 is not what was written")), "{part}");
        let output = place.run(&["spectrum", "cube.zarr", "3", "3"]);
        assert_eq!(output.status.code(), Some(5), "{part}: {}", text(&output.stdout));
        let (_, stderr) =
            place.success(&[&["render", "scene.toml", "-o", "cube.zarr", "--resume"], &more[..]].concat());
        assert!(stderr.contains("rendered again"), "{part}: {stderr}");
        assert!(arrays(&place.cube("cube.zarr")) == before, "{part}");
    }
    // The products of fewer samples beside weights of more.
    let products = cube.path().join("products/c/0/0/0/0");
    let few = place.render("few.zarr", &["--factored", "--spp", "1"]);
    let old = fs::read(few.path().join("products/c/0/0/0/0")).expect("read");
    place.success(&["render", "scene.toml", "-o", "cube.zarr", "--resume", "--factored", "--spp", "128", "--quiet"]);
    fs::write(&products, old).expect("written");
    let output = place.run(&["spectrum", "cube.zarr", "3", "3"]);
    let said = text(&output.stderr);
    assert!(output.status.code() == Some(5) && said.contains("does not belong"), "{said}");
}

/// Whatever reads cubes reads these as it reads the ordinary cube that `relight` makes of them.
#[test]
fn everything_reads_weights() {
    let place = Place::of(&scene());
    let cube = place.render("cube.zarr", &["--factored", "--uncertainty", "--tile", "16", "--spp", "640"]);
    place.success(&["relight", "cube.zarr", "-o", "plain.zarr"]);
    let plain = place.cube("plain.zarr");
    assert_eq!((values(&cube), samples(&cube)), (values(&plain), samples(&plain)));
    for (x, y) in [(0, 0), (23, 19), (16, 3)] {
        let of = |cube: &Cube| cube.standard_error(x, y).expect("inside").expect("there");
        assert_eq!(of(&cube), of(&plain));
    }
    let same = |arguments: &dyn Fn(&str) -> Vec<String>| {
        let [a, b] = ["cube.zarr", "plain.zarr"].map(|name| {
            let arguments = arguments(name);
            place.success(&arguments.iter().map(String::as_str).collect::<Vec<_>>()).0
        });
        assert_eq!(a.replace("cube.zarr", "plain.zarr"), b);
    };
    let words = |text: String| text.split(' ').map(str::to_owned).collect();
    same(&|name| words(format!("spectrum {name} 5 7")));
    for format in ["csv", "exr", "png"] {
        let file = |name: &str| format!("{name}.{format}");
        for name in ["cube.zarr", "plain.zarr"] {
            place.success(&["export", name, "-o", &file(name)]);
        }
        let [a, b] = ["cube.zarr", "plain.zarr"].map(|name| fs::read(place.path().join(file(name))).expect("read"));
        // Attributes tell which is which.
        assert!(a == b || format == "exr" && a.len() > 1000, "{format}");
    }
    let (stdout, _) = place.success(&["compare", "cube.zarr", "plain.zarr"]);
    assert!(stdout.contains("relMSE: 0.00000e0"), "{stdout}");
    fs::write(place.path().join("s.csv"), "wavelength_nm,red\n560,0\n600,1\n640,0\n").expect("written");
    for name in ["cube.zarr", "plain.zarr"] {
        place.success(&["sensor", name, "--responses", "s.csv", "-o", &format!("seen-{name}")]);
    }
    assert_eq!(values(&place.cube("seen-cube.zarr")), values(&place.cube("seen-plain.zarr")));
    let model = "[optics]\nf_number = 4\npsf = \"diffraction\"\n[detector]\npitch = 2e-6\nintegration_time = 0.1\n\
                 quantum_efficiency = 0.5\ngain = 1\nread_noise = 5\nbits = 16\n";
    fs::write(place.path().join("sensor.toml"), model).expect("written");
    let counts = ["cube.zarr", "plain.zarr"].map(|name| {
        let out = format!("counts-{name}");
        place.success(&["sensor", name, "--model", "sensor.toml", "-o", &out]);
        place.success(&["spectrum", &out, "5", "7"]).0
            + &place.success(&["export", &out, "-o", "-", "--format", "csv"]).0
    });
    assert_eq!(counts[0], counts[1]);
    let (told, _) = place.success(&["info", "cube.zarr"]);
    assert!(told.contains("relight changes the spectra paint, other, lamp") && !told.contains("\"basis\""), "{told}");
    assert!(told.contains("10 epochs (Student's t, 7 degrees of freedom)"), "{told}");
    let (told, _) = place.success(&["info", "plain.zarr"]);
    assert!(told.contains("relit"), "{told}");
    if let Some(mut python) = outside::python("read_weights.py") {
        let output = python.arg(cube.path()).arg(plain.path()).output().expect("python");
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}

/// Other lamps, paints, channels and bands: what a render with them makes, by the standard errors of both.
#[test]
fn relit_cubes_are_what_renders_make() {
    let place = Place::of(&scene());
    place.render("cube.zarr", &["--factored", "--uncertainty", "--spp", "1024", "--seed", "1"]);
    fs::write(place.path().join("s.csv"), "wavelength_nm,red,blue\n420,0,0\n450,0,1\n480,0,0\n590,0.5,0\n640,1,0\n")
        .expect("written");
    let lamps = ["--set", "spectra.other.blackbody=4000", "--set", "spectra.other.scale=1e-4"];
    let paint = ["--set", "spectra.paint={ samples = [[400, 0.95], [500, 0.9], [500, 0.02], [700, 0.1]] }"];
    let off = ["--set", "spectra.lamp=0.0", "--set", "spectra.other=2.0"];
    let (fine, bands) = (["--channels", "equal.count=37"], ["--responses", "s.csv"]);
    let of_render = [vec!["--set", "channels.equal.count=37"], vec!["--set", "channels.responses=s.csv"]];
    let cases: [(Vec<&str>, Vec<&str>); 5] = [
        (lamps.to_vec(), lamps.to_vec()),
        (paint.to_vec(), paint.to_vec()),
        (off.to_vec(), off.to_vec()),
        ([&lamps[..], &paint, &fine].concat(), [&lamps[..], &paint, &of_render[0]].concat()),
        ([&paint[..], &bands].concat(), [&paint[..], &of_render[1]].concat()),
    ];
    for (i, (of_relight, of_render)) in cases.iter().enumerate() {
        let (relit, new) = (format!("relit{i}.zarr"), format!("new{i}.zarr"));
        let (said, _) = place.success(&[&["relight", "cube.zarr", "-o", &relit], &of_relight[..]].concat());
        assert!(said.contains("error estimate at most"), "{said}");
        let more = [&of_render[..], &["--uncertainty", "--spp", "1024", "--seed", "2"]].concat();
        let new = place.render(&new, &more);
        let relit = place.cube(&relit);
        assert_eq!(relit.channels(), new.channels());
        let channels = new.channels().len();
        let [width, height] = new.header().size;
        let pixels: Vec<_> = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).collect();
        for k in 0..channels {
            let (mut difference, mut variance, mut sum) = (0.0, 0.0, 0.0);
            for &(x, y) in &pixels {
                let of = |cube: &Cube| {
                    let error = cube.standard_error(x, y).expect("inside").expect("there")[k];
                    (f64::from(spectrum(cube, x, y)[k]), f64::from(error))
                };
                let ((a, e), (b, f)) = (of(&relit), of(&new));
                difference += a - b;
                variance += e * e + f * f;
                sum += b;
            }
            let sigmas = difference / variance.sqrt();
            assert!(variance.sqrt() < 0.02 * sum, "{of_relight:?}, channel {k}: nothing can be seen");
            // Of some fifty channels in all.
            assert!(
                sigmas.abs() < 4.0,
                "{of_relight:?}, channel {k}: {sigmas:.2} sigma of {:.3e}",
                variance.sqrt() / sum
            );
        }
    }
}

/// Devices make the radiance and the standard errors that the processor makes, but for rounding.
#[test]
fn devices_expand_as_the_processor_does() {
    let place = Place::of(&scene());
    place.render("cube.zarr", &["--factored", "--uncertainty", "--spp", "256"]);
    let relit = |name: &str, more: &[&str]| {
        let lamp = ["--set", "spectra.lamp.blackbody=4000", "--channels", "equal.count=70", "--json"];
        let (said, _) = place.success(&[&["relight", "cube.zarr", "-o", name], &lamp[..], more].concat());
        (place.cube(name), said)
    };
    let (processor, said) = relit("processor.zarr", &[]);
    assert!(said.contains("\"devices\":null"), "{said}");
    let (devices, said) = relit("devices.zarr", &["--devices", "1"]);
    assert!(said.contains("\"devices\":[\""), "{said}");
    let [width, height] = processor.header().size;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let near = |a: &[f32], b: &[f32], bound: f32| {
            a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() <= bound * a, "{x}, {y}: {a} {b}"));
        };
        near(&spectrum(&processor, x, y), &spectrum(&devices, x, y), 2e-6);
        let errors = |cube: &Cube| cube.standard_error(x, y).expect("inside").expect("there");
        near(&errors(&processor), &errors(&devices), 1e-4);
    }
}

/// 95 % intervals by Student's t of 7 degrees of freedom, after relighting, hold the truth in 93 to 97 %.
#[test]
fn intervals_of_relit_cubes_hold_the_truth() {
    let place = Place::of(&scene());
    let size = ["--size", "32x24", "--factored", "--uncertainty"];
    let lamp = ["--set", "spectra.lamp={ samples = [[400, 3.0], [700, 0.5]] }", "--set", "spectra.other=0.7"];
    let relit = |name: &str, seed: &str, spp: &str| {
        place.render("weights.zarr", &[&size[..], &["--seed", seed, "--spp", spp, "--overwrite"]].concat());
        place.success(&[&["relight", "weights.zarr", "-o", name, "--overwrite"], &lamp[..]].concat());
        place.cube(name)
    };
    let truth = relit("truth.zarr", "1", "4096");
    let t = StudentsT::new(0.0, 1.0, 7.0).expect("freedom").inverse_cdf(0.975);
    let (mut inside, mut count) = (0u32, 0u32);
    for seed in ["2", "3", "4"] {
        let cube = relit("cube.zarr", seed, "1024");
        let [width, height] = cube.header().size;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let (values, of_truth) = (spectrum(&cube, x, y), spectrum(&truth, x, y));
            let errors = |cube: &Cube| cube.standard_error(x, y).expect("inside").expect("there");
            let (e, f) = (errors(&cube), errors(&truth));
            for k in 0..values.len() {
                let error = f64::from(e[k]).hypot(f64::from(f[k]));
                if error > 0.0 {
                    count += 1;
                    inside += u32::from(f64::from(values[k] - of_truth[k]).abs() <= t * error);
                }
            }
        }
    }
    let share = f64::from(inside) / f64::from(count);
    println!("{inside} of {count}, {:.2} %", 100.0 * share);
    assert!(count > 5_000 && (0.93..=0.97).contains(&share), "{share}");
}

/// Of 1,000 channels a cube takes less than an eighth; no bit depends on how many there are.
#[test]
fn size_does_not_depend_on_channels() {
    let place = Place::of(&scene());
    let bytes = |name: &str, arrays: &[&str]| -> u64 {
        let cube = place.cube(name);
        arrays.iter().map(|array| spectile::files::bytes_of(&cube.path().join(array))).sum()
    };
    let thousand = ["--set", "channels.equal.count=1000", "--spp", "64"];
    place.render("weights.zarr", &[&thousand[..], &["--factored"]].concat());
    place.render("radiance.zarr", &thousand);
    let (small, large) = (bytes("weights.zarr", &["weights", "products"]), bytes("radiance.zarr", &["radiance"]));
    println!("{small} bytes of weights, {large} of radiance");
    assert!(8 * small < large, "{small} {large}");
    place.render("few.zarr", &["--factored", "--spp", "64"]);
    let weights = |name: &str| fs::read(place.cube(name).path().join("weights/c/0/0/0/0")).expect("read");
    assert!(weights("few.zarr") == weights("weights.zarr"));
}

#[test]
fn what_cannot_be_done_is_said() {
    let place = Place::of(&scene());
    place.render("weights.zarr", &["--factored", "--spp", "1"]);
    place.render("radiance.zarr", &["--spp", "1"]);
    let refused = |arguments: &[&str], words: &str| {
        let output = place.run(arguments);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(words), "{arguments:?}: {said}");
        assert!(!place.path().join("out.zarr").exists());
    };
    let relight = |more: &[&'static str]| [&["relight", "weights.zarr", "-o", "out.zarr"], more].concat();
    refused(&["relight", "radiance.zarr", "-o", "out.zarr"], "holds radiance");
    refused(&relight(&["--set", "objects.0.material=red"]), "needs a new render");
    refused(&relight(&["--set", "spectra.pain=0.5"]), "paint");
    refused(&relight(&["--set", "spectra.paint=1.5"]), "must lie in [0, 1]");
    refused(&relight(&["--set", "spectra.lamp=-1"]), "spectra.lamp");
    refused(&relight(&["--set", "materials.red.temperature=300"]), "no hot material");
    refused(&relight(&["--channels", "no.toml"]), "no.toml");
    refused(&relight(&["--channels", "equal.count=0"]), "equal.count");
    refused(&relight(&["--channels", "scene.toml", "--channels", "equal.count=3"]), "one scene");
    refused(&["relight", "weights.zarr", "-o", "weights.zarr"], "into itself");
    refused(
        &["render", "scene.toml", "-o", "out.zarr", "--factored", "--set", "integrator.max_bounces=65"],
        "integrator.max_bounces",
    );
    let (planned, _) = place.success(&["plan", "scene.toml"]);
    assert!(planned.contains("the scene separates:"), "{planned}");
}
