//! Sensors while rendering (`channels.responses`) against sensors after the fact, and colours against colour-science.

use std::fs;

use super::{Place, SCENE, events, spectrum};
use crate::binary;
use crate::outside::{python, shared};

/// A band with a tail, one that overlaps it, and one far away.
const RESPONSES: &str = "wavelength_nm,red,green,infrared\n480,0,0,\n500,0,0.6,\n540,0.1,1,\n580,0.5,0.8,\n620,1,0.1,\n\
    660,0.7,0,\n700,0,0,\n900,,,0\n920,,,1\n1000,,,1\n1040,,,0\n";

/// The scene with spectra that vary, in these channels.
fn scene(channels: &str) -> String {
    let lamp = "[[400, 1.0], [500, 3.0], [505, 1.0], [610, 2.5], [700, 0.5], [950, 4.0], [1100, 0.2]]";
    SCENE
        .replace("equal = { from = 400.0, to = 700.0, count = 5 }", channels)
        .replace("[[400, 1.0], [700, 2.0]]", lamp)
        .replace("reflectance = 0.5", "reflectance = { samples = [[400, 0.2], [600, 0.8], [1100, 0.3]] }")
}

/// The same answer within noise: pixel by pixel in units of the standard error, and the mean of all.
#[test]
fn both_ways_to_a_sensor_agree() {
    let place = Place::of(&scene("responses = \"s.csv\""));
    fs::write(place.path().join("s.csv"), RESPONSES).expect("written");
    let before = place.render("before.zarr", &["--spp", "1024", "--uncertainty", "--size", "16x12"]);
    assert_eq!(before.channels().names, ["red", "green", "infrared"]);
    let bounds = &before.channels().bounds;
    assert_eq!((bounds[0], bounds[2]), ([500.0, 700.0], [900.0, 1040.0]));

    // Channels of 2 nm, whose errors are below 1e-4: the responses bend at their ends, the spectra hardly within.
    let wide = scene("equal = { from = 480, to = 1100, count = 310 }");
    fs::write(place.path().join("scene.toml"), wide).expect("written");
    place.render("fine.zarr", &["--spp", "4096", "--seed", "5", "--size", "16x12"]);
    let (_, warnings) = place.success(&["sensor", "fine.zarr", "--responses", "s.csv", "-o", "after.zarr"]);
    assert_eq!(warnings, "");
    let done = place.events(&["compare", "before.zarr", "after.zarr"]).pop().expect("done");
    for channel in done["channels"].as_array().expect("channels") {
        let number = |key: &str| channel[key].as_f64().expect("a number");
        // The errors of `after` count as none: a quarter of the variance of `before`, and t² of 16 epochs has a mean of 15/13.
        // So z has a standard deviation of 1.12, and z_rms is 1.2, give or take 6 % in 192 pixels.
        assert!(number("z").abs() < 5.0 && (0.95..1.5).contains(&number("z_rms")), "{channel}");
        let relative = number("bias") / number("reference_mean");
        assert!(relative.abs() < 0.02 && number("mean") > 0.0, "{channel}");
    }
    let (info, _) = place.success(&["info", "before.zarr"]);
    assert!(info.contains("false colours: green as red, red as green, infrared as blue"), "{info}");
}

/// What is seen directly is the mean weighted by the response: nothing but the wavelength is left to chance.
#[test]
fn directly_visible_light_is_weighted() {
    let text = scene("responses = \"s.csv\"\nfalse_colour = [2, 0, 1]");
    // Nothing but the sky.
    let head = text.split("[[objects]]").next().expect("a head");
    // Drawn evenly: by emission single samples vary less, and nets of them more.
    let head = head.replace("[integrator]", "[integrator]\nwavelengths = \"uniform\"");
    let place = Place::of(&format!("{head}[environment]\nradiance = \"lamp\"\n"));
    fs::write(place.path().join("s.csv"), RESPONSES).expect("written");
    let cube = place.render("cube.zarr", &["--spp", "1024"]);
    let curve = |nodes: &[(f64, f64)], x: f64| {
        let i = nodes.partition_point(|node| node.0 <= x).clamp(1, nodes.len() - 1);
        let ((a, p), (b, q)) = (nodes[i - 1], nodes[i]);
        p + (x - a) / (b - a) * (q - p)
    };
    let lamp = [(400., 1.), (500., 3.), (505., 1.), (610., 2.5), (700., 0.5), (950., 4.), (1100., 0.2)];
    let red = [(500., 0.), (540., 0.1), (580., 0.5), (620., 1.), (660., 0.7), (700., 0.)];
    let infrared = [(900., 0.), (920., 1.), (1000., 1.), (1040., 0.)];
    let expected = |response: &[(f64, f64)]| {
        const N: u32 = 100_000;
        let (from, to) = (response[0].0, response[response.len() - 1].0);
        let nm = |i: u32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(N);
        let sum = |f: &dyn Fn(f64) -> f64| (0..N).map(|i| f(nm(i))).sum::<f64>();
        sum(&|x| curve(response, x) * curve(&lamp, x)) / sum(&|x| curve(response, x))
    };
    for (k, expected) in [(0, expected(&red)), (2, expected(&infrared))] {
        for (x, y) in [(0, 0), (11, 7), (23, 19)] {
            let got = f64::from(spectrum(&cube, x, y)[k]);
            // 1,024 stratified wavelengths in each stratum: far below 1e-4.
            assert!((got / expected - 1.0).abs() < 1e-4, "channel {k}: {got} {expected}");
        }
    }
    // What is stored says what it is.
    let names = &cube.header().channels.names;
    assert_eq!((names[2].as_str(), cube.channels().false_colour), ("infrared", Some([2, 0, 1])));
    assert!(
        (cube.channels().integral(2) - 110.0).abs() < 1e-9
            && (cube.channels().centre(2) - 106_200.0 / 110.0).abs() < 1e-9
    );
    let output = place.run(&["render", "scene.toml", "-o", "cube.zarr", "--resume", "--spp", "1088"]);
    assert!(output.status.success(), "{}", super::text(&output.stderr));
    fs::write(place.path().join("s.csv"), RESPONSES.replace("620,1,", "620,0.9,")).expect("written");
    let output = place.run(&["render", "scene.toml", "-o", "cube.zarr", "--resume", "--spp", "1152"]);
    assert_eq!(output.status.code(), Some(2), "other responses are another cube");
}

/// Files of the data pack as they are, without a device: as `plan` sees them.
#[test]
fn sensors_of_the_data_pack_are_cheap() {
    for (file, channels) in
        [("rsr_landsat8_oli_tirs.csv", 11), ("rsr_sentinel2a_msi.csv", 13), ("camera_nikon_5100_npl.csv", 3)]
    {
        let Some(path) = shared(&format!("sensor/{file}")) else { return };
        let place = Place::of(&scene(&format!("responses = \"{}\"", path.display())));
        let mut plan = place.command(&["plan", "scene.toml", "--size", "8x8", "--json"]);
        let output = binary::output(binary::without_devices(&mut plan));
        let done = events(&super::text(&output.stdout)).pop().expect("done");
        let features = done["features"].as_array().expect("features");
        let responses = features.iter().find(|f| f["name"] == "responses").expect("a feature");
        let strata = responses["effect"].as_str().and_then(|text| text.split(' ').next()?.parse::<u32>().ok());
        println!("{file}: {strata:?} strata");
        assert!(strata.is_some_and(|n| n >= 4 * channels && n <= 16 * channels), "{file}: {responses}");
    }
}

/// The 24 patches of a ColorChecker under daylight from everywhere, in one row of pixels, against X, Y, Z that
/// colour-science integrates from the same tables: delta E 2000 below 0.1.
#[test]
fn a_colour_checker_has_the_colours_of_colour_science() {
    let (Some(patches), Some(daylight)) =
        (shared("reflectance/colorchecker_ohta_380-780_5nm.csv"), shared("illum/cie_illuminants_300-780_5nm.csv"))
    else {
        return;
    };
    let table = fs::read_to_string(&patches).expect("read");
    let names: Vec<&str> =
        table.lines().find(|line| !line.starts_with('#')).expect("a header").split(',').skip(1).collect();
    assert_eq!(names.len(), 24);
    let mut text = format!(
        "[camera.orthographic]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nwidth = 24\n\
         [film]\nwidth = 24\nheight = 1\n[channels]\nequal = {{ from = 380, to = 780, count = 400 }}\n\
         [integrator]\nmax_bounces = 1\n[environment]\nradiance = {{ file = \"{}\", column = \"D65\", scale = 0.01 }}\n",
        daylight.display()
    );
    for (i, name) in names.iter().enumerate() {
        text += &format!(
            "[materials.patch{i}.diffuse]\nreflectance = {{ file = \"{}\", column = \"{name}\" }}\n[[objects]]\n\
             quad = {{ corner = [{}, -1, 0], edge_u = [1, 0, 0], edge_v = [0, 2, 0] }}\nmaterial = \"patch{i}\"\n",
            patches.display(),
            i as f64 - 12.0
        );
    }
    let place = Place::of(&text);
    place.render("cube.zarr", &["--spp", "1024"]);
    for observer in ["1931", "1964"] {
        let file = format!("xyz{observer}.csv");
        place.success(&["export", "cube.zarr", "-o", &file, "--xyz", observer]);
        let Some(mut command) = python("colour_checker.py") else { return };
        let output = command.args([&patches, &daylight]).arg(place.path().join(file)).arg(observer).output();
        let output = output.expect("Python runs");
        assert!(output.status.success(), "{}", super::text(&output.stderr));
        let worst: f64 = super::text(&output.stdout).trim().parse().expect("a number");
        println!("CIE {observer}: delta E 2000 at most {worst:.4}");
        assert!(worst < 0.1, "{worst}");
    }
}
