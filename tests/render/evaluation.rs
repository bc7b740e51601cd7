//! Which paths are evaluated, and at how many wavelengths: decided once, kept with the cube, adopted by whoever goes on.

use std::fs;

use serde_json::Value;

use super::{Place, arrays, text};

/// So many channels that it is worth a thought.
const MANY: &[&str] = &["--tile", "8", "--set", "channels.equal.count=120"];
const COMB: &str = r#"
[camera.perspective]
position = [0, -3, 2]
look_at = [0, 0, 0]
up = [0, 0, 1]
fov = 40

[film]
width = 16
height = 16

[channels]
equal = { from = 400.0, to = 700.0, count = 4 }

[integrator]
max_bounces = 1

[environment]
radiance = 1.0

[materials.comb.diffuse]
reflectance = { samples = [TEETH] }

[[objects]]
disk = { center = [0, 0, 0], normal = [0, 0, 1], radius = 100 }
material = "comb"
"#;
const ROULETTE: &[&str] = &["--set", "integrator.evaluation=roulette"];

fn radiance(mut files: crate::cube_files::Files) -> crate::cube_files::Files {
    files.retain(|name, _| name.starts_with("radiance/c"));
    files
}

fn choices(place: &Place, name: &str) -> Option<Value> {
    let file = fs::read(place.path().join(name).join(".spectile/choices.json")).ok()?;
    Some(serde_json::from_slice(&file).expect("JSON"))
}

/// Stopped and gone on with, by several devices, by processes with some of the tiles each: the same choice and the same bytes, which
/// are not those of all paths.
#[test]
fn what_is_chosen_stays_with_the_cube() {
    let place = Place::new();
    let args = |more: &[&'static str]| [MANY, ROULETTE, more].concat();
    let straight = arrays(&place.render("straight.zarr", &args(&["--spp", "64"])));
    let chosen = choices(&place, "straight.zarr").expect("a choice");
    assert!(chosen["scale"].as_f64() > Some(0.0) && chosen["mean_radiance"].as_array().map(Vec::len) == Some(120));
    assert!(arrays(&place.render("all.zarr", &[MANY, &["--spp", "64"]].concat())) != straight);

    place.render("resumed.zarr", &args(&["--spp", "2"]));
    let resumed = place.render("resumed.zarr", &args(&["--spp", "64", "--resume", "--devices", "2"]));
    assert!(arrays(&resumed) == straight && choices(&place, "resumed.zarr") == Some(chosen.clone()));
    for tiles in ["0..4", "4..9"] {
        place.render("tiles.zarr", &[&args(&["--spp", "64", "--tiles"])[..], &[tiles]].concat());
    }
    assert!(arrays(&place.cube("tiles.zarr")) == straight && choices(&place, "tiles.zarr") == Some(chosen));

    let (info, _) = place.success(&["info", "straight.zarr"]);
    assert!(info.lines().any(|line| line.starts_with("evaluation") && line.contains("roulette: a path")), "{info}");
    // What is there decides, not what would be chosen now.
    let file = place.path().join("resumed.zarr/.spectile/choices.json");
    let other = fs::read_to_string(&file).expect("text").replace("\"scale\"", "\"scales\"");
    fs::write(&file, other).expect("written");
    let output = place
        .run(&[&["render", "scene.toml", "-o", "resumed.zarr"], &args(&["--spp", "128", "--resume"])[..]].concat());
    assert_eq!(output.status.code(), Some(5));
    assert!(text(&output.stderr).contains("choices.json: is damaged"), "{}", text(&output.stderr));
}

/// Where nothing can be saved nobody is asked; nothing else of the cube knows of it.
#[test]
fn few_channels_need_no_pilot() {
    let place = Place::new();
    let with = |name: &str, evaluation: &str| {
        let set = format!("integrator.evaluation={evaluation}");
        arrays(&place.render(name, &["--spp", "4", "--set", &set]))
    };
    assert!(radiance(with("auto.zarr", "auto")) == radiance(with("all.zarr", "all")));
    let chosen = choices(&place, "auto.zarr").expect("a choice");
    assert_eq!((&chosen["scale"], &chosen["samples"]), (&Value::Null, &Value::from(0)), "{chosen}");
    assert!(chosen["reason"].as_str().is_some_and(|reason| reason.contains("too little to save")), "{chosen}");
    let smooth = "no spectrum varies by much within a channel";
    assert_eq!((&chosen["wavelengths_per_channel"], &chosen["wavelengths_reason"]), (&Value::from(1), &smooth.into()));
    // Of two choices one is made by the scene, or both.
    assert_eq!(choices(&place, "all.zarr").expect("a choice")["reason"], "as the scene says");
    let one = ["--spp", "4", "--set", "integrator.evaluation=all", "--set", "integrator.wavelengths_per_channel=1"];
    assert!(radiance(arrays(&place.render("one.zarr", &one))) == radiance(arrays(&place.cube("all.zarr"))));
    assert_eq!(choices(&place, "one.zarr"), None);
    // `pt` evaluates while it traces.
    place.render("pt.zarr", &[ROULETTE, &["--spp", "1", "--set", "integrator.evaluator=pt"]].concat());
    assert_eq!(choices(&place, "pt.zarr"), None);
    // Light that the pilot does not see could starve.
    let dark = ["--spp", "1", "--set", "integrator.max_bounces=0", "--set", "objects.2.emission=0"];
    let output = place.run(&[&["render", "scene.toml", "-o", "dark.zarr"], &dark[..], ROULETTE].concat());
    assert!(text(&output.stderr).contains("all paths are evaluated: channel 0 was dark"), "{}", text(&output.stderr));
}

/// A comb painted on a floor under an even sky, whose paths differ by their wavelengths and little else: several are chosen, by every way
/// of rendering the cube, and what is expected comes.
#[test]
fn several_wavelengths_are_chosen_where_they_pay() {
    let teeth: Vec<String> = (0..=150).map(|i| format!("[{}, {}]", 400 + 2 * i, [0.05, 0.9][i % 2])).collect();
    let place = Place::of(&COMB.replace("TEETH", &teeth.join(", ")));
    let render = |name: &str, more: &[&str]| arrays(&place.render(name, &[&["--uncertainty"], more].concat()));
    let straight = render("comb.zarr", &["--spp", "256"]);
    let chosen = choices(&place, "comb.zarr").expect("a choice");
    let (count, gain) = (&chosen["wavelengths_per_channel"], chosen["wavelengths_gain"].as_f64().expect("a number"));
    assert!(count.as_u64() > Some(1) && gain > 1.1, "{chosen}");
    render("resumed.zarr", &["--spp", "4"]);
    assert!(render("resumed.zarr", &["--spp", "256", "--resume", "--devices", "2"]) == straight);
    // As if it had been asked for.
    let same = format!("integrator.wavelengths_per_channel={count}");
    assert!(radiance(render("asked.zarr", &["--spp", "256", "--set", &same])) == radiance(straight));
    let errors = |name: &str| {
        let (info, _) = place.success(&["info", name, "--json"]);
        let info: Value = serde_json::from_str(info.lines().last().expect("an event")).expect("JSON");
        let of = |channel: &Value| channel["error_estimate"].as_f64().expect("a number").powi(2);
        info["channels"].as_array().expect("channels").iter().map(of).sum::<f64>()
    };
    render("one.zarr", &["--spp", "256", "--set", "integrator.wavelengths_per_channel=1"]);
    let (one, several) = (errors("one.zarr"), errors("comb.zarr"));
    println!("{count} wavelengths: variance {:.3} of that with one, {gain} expected", several / one);
    // Evaluation costs next to nothing here, so that the gain is nearly the variance that goes, by 1/m at least.
    assert!(several * gain < 1.2 * one, "{several} {one}");
}

#[test]
fn a_plan_decides_where_it_is_asked_to() {
    let place = Place::new();
    let plan = [&["plan", "scene.toml"], MANY, ROULETTE].concat();
    let (undecided, _) = place.success(&plan);
    assert!(
        undecided
            .contains("\npaths     which are worth evaluating, and at how many wavelengths, is decided by samples"),
        "{undecided}"
    );
    let (decided, _) = place.success(&[&plan[..], &["--pilot"]].concat());
    assert!(decided.contains("\npaths     roulette: a path that brings the mean"), "{decided}");
    assert!(decided.contains("\nused") && decided.contains("roulette on evaluation ("), "{decided}");
    assert!(decided.contains("\nper path  1 wavelength a channel ("), "{decided}");
    let asked = ["--set", "integrator.evaluation=all", "--set", "integrator.wavelengths_per_channel=2"];
    let (plain, _) = place.success(&[&["plan", "scene.toml"][..], &asked].concat());
    assert!(
        !plain.contains("\npaths ") && plain.contains("several wavelengths a channel (every path is evaluated at 2)"),
        "{plain}"
    );
}
