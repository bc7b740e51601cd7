//! How much a camera sees, in the words of data sheets; where a map of all directions has which.

use std::path::Path;

use glam::{DVec2, DVec3};
use spectile::scene::{Projection, Scene, parse};

fn scene(camera: &str) -> Result<Scene, String> {
    let text = format!(
        "{camera}\n[film]\nwidth = 400\nheight = 200\n[channels]\nequal = {{ from = 400, to = 700, count = 2 }}\n[environment]\nradiance = 1\n"
    );
    parse(&text, Path::new("scene.toml"), &[]).map_err(|error| error.to_string())
}

fn perspective(keys: &str) -> Result<Scene, String> {
    scene(&format!("[camera.perspective]\nposition = [0, 0, 800]\nlook_at = [0, 0, 0]\n{keys}"))
}

/// 400 pixels of 5.5 µm behind 50 mm; of 0.11 mrad; of 8.8 cm from 800 m: the same, but for the curvature of an arc.
#[test]
fn data_sheets_say_how_much_is_seen() {
    let half = |keys: &str| match perspective(keys).expect("a scene").camera.projection {
        Projection::Perspective { tan_half } => tan_half,
        other => panic!("{other:?}"),
    };
    let expected = DVec2::new(200.0, 100.0) * 5.5e-3 / 50.0;
    for keys in ["focal_length = 50\npixel_pitch = 5.5", "ground_sampling_distance = 0.088\naltitude = 800"] {
        assert!((half(keys) - expected).length() < 1e-15, "{keys}: {}", half(keys));
    }
    let by_angle = half("ifov = 0.11");
    assert!((by_angle - DVec2::new(400.0, 200.0) * (0.5 * 0.11e-3f64).tan()).length() < 1e-15);
    assert!((by_angle / expected - 1.0).abs().max_element() < 2e-9);
    let fov = 2.0 * expected.x.atan().to_degrees();
    assert!((half(&format!("fov = {fov}")) - expected).length() < 1e-15);
    let lens = "[camera.thin_lens]\nposition = [0, 0, 800]\nlook_at = [0, 0, 0]\nfocal_length = 50\npixel_pitch = 5.5\naperture_radius = 0.01\nfocus_distance = 800";
    let Projection::ThinLens { tan_half, .. } = scene(lens).expect("a scene").camera.projection else {
        panic!("a lens")
    };
    assert!((tan_half - expected).length() < 1e-15);
}

#[test]
fn what_data_sheets_do_not_say_is_refused() {
    for (keys, what) in [
        ("", "`fov` is missing"),
        ("fov = 40\nifov = 1", "once more how much is seen"),
        ("ifov = 1\nfocal_length = 50", "once more how much is seen"),
        ("focal_length = 50", "`pixel_pitch` is missing"),
        ("pixel_pitch = 5", "`focal_length` is missing"),
        ("ground_sampling_distance = 1", "`altitude` is missing"),
        ("focal_length = 0\npixel_pitch = 5", "greater than 0"),
        ("ifov = -1", "milliradians"),
        ("ifov = 4000", "milliradians"),
        ("ifov = 1\nfov_axis = \"y\"", "says nothing without `fov`"),
    ] {
        let error = perspective(keys).expect_err(keys);
        assert!(error.contains(what), "{keys}: {error}");
    }
}

/// Row 0 is up; in the middle is -z, a quarter to the right +x (docs/scene.md, `environment`); all of it turns with `rotate_degrees`, and
/// tips over with `up`.
#[test]
fn maps_have_directions_where_environments_have_them() {
    let direction = |keys: &str, x: f64, y: f64| {
        let scene = scene(&format!("[camera.latlong]\nposition = [1, 2, 3]\n{keys}")).expect("a scene");
        let [origin, direction] = scene.camera.ray(&scene.film, DVec2::new(x, y), DVec2::ZERO);
        assert_eq!(origin, DVec3::new(1.0, 2.0, 3.0));
        direction
    };
    for (keys, x, y, expected) in [
        ("", 200.0, 100.0, DVec3::NEG_Z),
        ("", 300.0, 100.0, DVec3::X),
        ("", 100.0, 100.0, DVec3::NEG_X),
        ("", 0.0, 100.0, DVec3::Z),
        ("", 123.0, 0.0, DVec3::Y),
        ("", 200.0, 50.0, DVec3::new(0.0, 0.5f64.sqrt(), -(0.5f64.sqrt()))),
        // Counter-clockwise as seen from above: -z turns to -x.
        ("rotate_degrees = 90", 200.0, 100.0, DVec3::NEG_X),
        // The shortest turn from +y to +z takes -z to +y.
        ("up = [0, 0, 1]", 200.0, 100.0, DVec3::Y),
        ("up = [0, 0, 1]", 300.0, 100.0, DVec3::X),
        ("up = [0, 0, 1]", 300.0, 200.0, DVec3::NEG_Z),
    ] {
        assert!((direction(keys, x, y) - expected).length() < 1e-15, "{keys} {x} {y}: {}", direction(keys, x, y));
    }
}

/// What is undone is what was done, within f64; a lens that folds the picture over is refused; digests of others stay.
#[test]
fn distortions_are_undone() {
    let lens = "fov = 80\ndistortion = { k1 = -0.28, k2 = 0.09, k3 = -0.01, p1 = 2e-3, p2 = -1e-3 }";
    let distorted = perspective(lens).expect("a scene");
    let lens = distorted.camera.distortion.expect("one");
    let Projection::Perspective { tan_half } = distorted.camera.projection else { panic!("a perspective") };
    let mut most = 0.0f64;
    for (x, y) in (0..=20).flat_map(|y| (0..=40).map(move |x| (10.0 * f64::from(x), 10.0 * f64::from(y)))) {
        let [_, direction] = distorted.camera.ray(&distorted.film, DVec2::new(x, y), DVec2::ZERO);
        // The camera looks along -z, with y up.
        let at = DVec2::new(direction.x, -direction.y) / -direction.z;
        let (seen, _) = lens.of(at);
        let film = DVec2::new(x / 200.0 - 1.0, y / 100.0 - 1.0) * tan_half;
        assert!((seen - film).length() < 1e-13, "{x} {y}: {seen} {film}");
        most = most.max((at - film).length());
    }
    assert!(most > 0.1, "{most}: a poor test");
    // By hand: barrels bring what is far out towards the middle, so that more is seen.
    let (seen, slopes) = lens.of(DVec2::new(0.5, 0.0));
    let radial = 1.0 - 0.28 * 0.25 + 0.09 * 0.0625 - 0.01 * 0.015625;
    assert!((seen - DVec2::new(0.5 * radial - 1e-3 * 0.75, 2e-3 * 0.25)).length() < 1e-15, "{seen}");
    let step = 1e-6;
    let by_x = (lens.of(DVec2::new(0.5 + step, 0.0)).0 - lens.of(DVec2::new(0.5 - step, 0.0)).0) / (2.0 * step);
    assert!((slopes.x_axis - by_x).length() < 1e-9, "{slopes} {by_x}");

    let error = perspective("fov = 100\ndistortion = { k1 = -0.5 }").expect_err("it folds");
    assert!(error.contains("camera.perspective.distortion") && error.contains("folds the picture over"), "{error}");
    let error = perspective("fov = 40\ndistortion = { k4 = 1 }").expect_err("no such key");
    assert!(error.contains("k4"), "{error}");
    let [plain, none] =
        ["fov = 40", "fov = 40\ndistortion = { k1 = 0.1 }"].map(|keys| perspective(keys).expect("a scene"));
    assert_ne!(plain.digest, none.digest);
}

/// A scanner that flies north at 100 m, then turned about each axis, by hand: what the middle of a row sees, and its right end.
#[test]
fn line_scanners_look_where_they_are_turned() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |text: &str| std::fs::write(folder.path().join("track.csv"), text).expect("written");
    let scene = |height: u32, more: &str| {
        let text = format!(
            "[camera.pushbroom]\nlines = \"track.csv\"\nup = [0, 0, 1]\nfov = 90\n{more}\n[film]\nwidth = 100\nheight = {height}\n\
             [channels]\nequal = {{ from = 400, to = 700, count = 2 }}\n[environment]\nradiance = 1\n"
        );
        parse(&text, &folder.path().join("scene.toml"), &[]).map_err(|error| error.to_string())
    };
    write(
        "x,y,z,yaw_degrees,pitch_degrees,roll_degrees\n0,0,100,0,0,0\n0,10,100,90,0,0\n0,20,100,0,30,0\n0,30,100,0,0,30\n0,40,100,90,30,0\n",
    );
    let flight = scene(5, "").expect("a scene");
    let ray = |x: f64, y: f64, along: f64| flight.camera.ray(&flight.film, DVec2::new(x, y), DVec2::new(along, 0.0));
    let (sin, cos) = (0.5, 0.75f64.sqrt());
    for (row, down, right) in [
        (0, DVec3::NEG_Z, DVec3::X),
        (1, DVec3::NEG_Z, DVec3::NEG_Y),
        // The nose up: it looks ahead.
        (2, DVec3::new(0.0, sin, -cos), DVec3::X),
        // The right wing down: it looks to the left.
        (3, DVec3::new(-sin, 0.0, -cos), DVec3::new(cos, 0.0, -sin)),
        (4, DVec3::new(sin, 0.0, -cos), DVec3::NEG_Y),
    ] {
        let y = f64::from(row) + 0.5;
        let [origin, middle] = ray(50.0, y, 0.0);
        assert_eq!(origin, DVec3::new(0.0, 10.0 * f64::from(row), 100.0));
        assert!((middle - down).length() < 1e-15, "{row}: {middle}");
        let [_, end] = ray(100.0, y, 0.0);
        assert!((end - (down + right).normalize()).length() < 1e-15, "{row}: {end}");
    }
    // A pixel is as long as it is wide, and a line lasts until the next begins.
    let [_, ahead] = ray(50.0, 0.5, 1.0);
    assert!((ahead - DVec3::new(0.0, 0.01, -1.0).normalize()).length() < 1e-15, "{ahead}");
    assert_eq!(ray(50.0, 0.0, 0.0)[0].y, -5.0);
    assert_eq!(ray(50.0, 5.0, 0.0)[0].y, 45.0);
    let error = scene(6, "").expect_err("a row too many");
    assert!(error.contains("has 5 lines, and the film 6 rows"), "{error}");
    let error = scene(5, "north = [0, 0, 1]").expect_err("no north");
    assert!(error.contains("must not be parallel"), "{error}");
    write("x,y\n0,0\n");
    let error = scene(5, "").expect_err("no height");
    assert!(error.contains("track.csv") && error.contains("no column `z`"), "{error}");
    let error =
        scene(5, "[camera.orthographic]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\nwidth = 1\n").expect_err("two");
    assert!(error.contains("camera"), "{error}");
}
