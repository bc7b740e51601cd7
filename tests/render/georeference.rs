//! Pictures that lie on a map: where each pixel is, in the cube and as GDAL, rasterio and rioxarray place the exports.

use glam::DVec3;
use spectile::cube::{Cube, Layer};

use super::Place;
use crate::binary::{run, text};

/// A floor 20 m above the sea, seen by a camera that the tests choose.
const SCENE: &str = r#"
CAMERA

[film]
width = 40
height = 24
crop = [4, 2, 36, 22]

[georeference]
crs = "EPSG:32631"
origin = [650000, 4800000, 120]
up = [0, 0, 1]
ground = 20

[channels]
equal = { from = 400, to = 700, count = 3 }

[materials.floor.diffuse]
reflectance = { samples = [[400, 0.2], [700, 0.6]] }

[[objects]]
quad = { corner = [-300, -300, -100], edge_u = [600, 0, 0], edge_v = [0, 600, 0] }
material = "floor"

[environment]
radiance = 1.0
"#;

const UPRIGHT: &str = "[camera.orthographic]\nposition = [5, 7, 50]\nlook_at = [5, 7, 0]\nup = [0, 1, 0]\nwidth = 80\n";
const TURNED: &str = "[camera.orthographic]\nposition = [5, 7, 50]\nlook_at = [5, 7, 0]\nup = [0.5, 0.8660254037844386, 0]\nwidth = 80\n";
const SLANTED: &str =
    "[camera.orthographic]\nposition = [5, 7, 50]\nlook_at = [5, 40, 0]\nup = [0, 0, 1]\nwidth = 80\n";
const MIRRORED: &str =
    "[camera.orthographic]\nposition = [5, 7, 50]\nlook_at = [5, 7, 0]\nup = [0, 1, 0]\nwidth = 80\nflip_x = true\n";
/// 100 m above the ground: 2 m a pixel.
const NADIR: &str = "[camera.perspective]\nposition = [5, 7, 0]\nlook_at = [5, 7, -1]\nup = [0, 1, 0]\nground_sampling_distance = 2\naltitude = 100\n";

fn place(camera: &str) -> Place {
    Place::of(&SCENE.replace("CAMERA", camera))
}

/// Eastings and northings of the pixels' centres, by the layer of coordinates, which the affine transform must give too.
fn agree(cube: &Cube) {
    let (crs, [a, b, c, d, e, f]) = cube.header().georeference().expect("on a map");
    assert_eq!(crs, "EPSG:32631");
    let tile = cube.tile_layers(0).expect("read").expect("there");
    let (layer, bytes) = &tile.0[0];
    assert_eq!((*layer, cube.header().size), (Layer::Coordinates, [32, 20]));
    for (i, pixel) in bytes.chunks_exact(24).enumerate() {
        let number = |axis: usize| f64::from_le_bytes(pixel[8 * axis..][..8].try_into().expect("eight bytes"));
        let (x, y) = ((i % 32) as f64 + 0.5, (i / 32) as f64 + 0.5);
        let expected = DVec3::new(a * x + b * y + c, d * x + e * y + f, 20.0);
        let found = DVec3::new(number(0) + 650_000.0, number(1) + 4_800_000.0, number(2) + 120.0);
        // The scene measures 600 m: f32 in device units are 4e-5 m apart at its rim.
        assert!((found - expected).abs().max_element() < 2e-4, "pixel {x} {y}: {found} {expected}");
    }
}

#[test]
fn pixels_lie_where_the_cube_says() {
    for camera in [UPRIGHT, TURNED, SLANTED, MIRRORED, NADIR] {
        let place = place(camera);
        agree(&place.render("cube.zarr", &["--spp", "1", "--layers", "coordinates"]));
    }
    // By hand: columns of 2 m from 5 - 40 + 2 x 4 on, lines of 2 m from 7 + 24 - 2 x 2 downwards.
    let place = place(UPRIGHT);
    let cube = place.render("cube.zarr", &["--spp", "1"]);
    let (_, affine) = cube.header().georeference().expect("on a map");
    assert_eq!(affine, [2.0, 0.0, 649_973.0, 0.0, -2.0, 4_800_027.0]);
}

#[test]
fn exports_are_placed() {
    for (camera, turned) in [(UPRIGHT, false), (TURNED, true), (MIRRORED, true), (NADIR, false)] {
        let place = place(camera);
        place.render("cube.zarr", &["--spp", "1"]);
        let formats: &[&str] =
            if camera == MIRRORED { &["map.tif", "map.zarr"] } else { &["map.tif", "map.img", "map.zarr"] };
        for file in formats {
            place.success(&["export", "cube.zarr", "-o", file, "--crop", "3,1,32,20"]);
        }
        if let Some(mut python) = crate::outside::python("read_map.py") {
            python.arg(if turned { "turned" } else { "upright" }).args(formats).current_dir(place.path());
            let output = python.output().expect("Python runs");
            assert!(output.status.success(), "{camera} {}", text(&output.stderr));
        }
        if camera == MIRRORED {
            let output = place.run(&["export", "cube.zarr", "-o", "map.img"]);
            assert!(
                output.status.success() && text(&output.stderr).contains("no word for EPSG:32631"),
                "{}",
                text(&output.stderr)
            );
        }
    }
}

/// A crop is placed by itself; and what is a place on no map, or of a camera that has none, is refused.
#[test]
fn what_is_nonsense_is_refused() {
    let perspective = NADIR.replace("look_at = [5, 7, -1]", "look_at = [5, 8, -1]");
    let latlong = "[camera.latlong]\nposition = [5, 7, 50]\nup = [0, 0, 1]\n";
    let below =
        NADIR.replace("position = [5, 7, 0]\nlook_at = [5, 7, -1]", "position = [5, 7, -101]\nlook_at = [5, 7, -102]");
    for (scene, key, what) in [
        (SCENE.replace("CAMERA", &perspective), "georeference", "this one looks 45.0000 degrees off"),
        (SCENE.replace("CAMERA", latlong), "georeference", "camera.latlong"),
        (SCENE.replace("CAMERA", &below), "georeference.ground", "not above the ground"),
        (
            SCENE.replace("CAMERA", &UPRIGHT.replace("look_at = [5, 7, 0]", "look_at = [5, 7, 90]")),
            "georeference",
            "looks down",
        ),
        (SCENE.replace("CAMERA", UPRIGHT).replace("EPSG:32631", "UTM 31"), "georeference.crs", "EPSG"),
        (SCENE.replace("CAMERA", UPRIGHT).replace("EPSG:32631", "EPSG:"), "georeference.crs", "EPSG"),
        (SCENE.replace("CAMERA", UPRIGHT).replace("crs = \"EPSG:32631\"", ""), "georeference.crs", "missing"),
        (
            SCENE.replace("CAMERA", UPRIGHT).replace("ground = 20", "north = [0, 0, 2]"),
            "georeference",
            "must not be parallel",
        ),
    ] {
        let place = Place::of(&scene);
        let output = run(place.path(), &["render", "scene.toml", "-o", "no.zarr"]);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(key) && said.contains(what), "{what}: {said}");
    }
    // WKT goes where there is room for it.
    let wkt = "LOCAL_CS[\\\"a yard\\\", UNIT[\\\"metre\\\", 1]]";
    let place = Place::of(&SCENE.replace("CAMERA", UPRIGHT).replace("EPSG:32631", wkt));
    place.render("cube.zarr", &["--spp", "1"]);
    place.success(&["export", "cube.zarr", "-o", "map.img"]);
    let header = std::fs::read_to_string(place.path().join("map.hdr")).expect("read");
    assert!(header.contains("coordinate system string = {LOCAL_CS[\"a yard\""), "{header}");
    let output = place.run(&["export", "cube.zarr", "-o", "map.tif"]);
    assert!(text(&output.stderr).contains("number of its reference system"), "{}", text(&output.stderr));
}
