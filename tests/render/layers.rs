//! `--layers`: what the first surface behind each pixel is, in closed form; the same bytes whoever makes them.

use std::path::Path;

use glam::DVec3;
use serde_json::Value;
use spectile::cube::{Cube, Layer};

use super::{Place, arrays};
use crate::binary::{run, text};

/// Seen from straight above, far from the origin as maps are: a floor, a ball on it, a gas without a surface and two sheets above, one
/// with more holes than cloth and one with fewer. The sun stands 45 degrees high in the east.
const SCENE: &str = r#"
[camera.orthographic]
position = [650000, 4800000, 10]
look_at = [650000, 4800000, 0]
up = [0, 1, 0]
width = 8

[film]
width = 48
height = 32

[channels]
equal = { from = 500, to = 600, count = 2 }

[integrator]
max_bounces = 1

[materials]
floor.diffuse.reflectance = 0.5
"a ball".diffuse.reflectance = 0.2
veil = { diffuse = { reflectance = 0.3, opacity = 0.3 } }
cloth = { diffuse = { reflectance = 0.3, opacity = 0.7 } }

[media.gas]
absorption = 0.01

[[objects]]
quad = { corner = [649996, 4799998, 0], edge_u = [7, 0, 0], edge_v = [0, 8, 0] }
material = "floor"

[[objects]]
sphere = { center = [650000.53, 4800000.27, 0.75], radius = 0.75 }
material = "a ball"

[[objects]]
sphere = { center = [649999, 4800000, 4], radius = 1 }
interior = "gas"

[[objects]]
quad = { corner = [649996, 4799998, 2], edge_u = [2, 0, 0], edge_v = [0, 4, 0] }
material = "veil"

[[objects]]
disk = { center = [650001, 4799999, 3], normal = [0, 0, -1], radius = 0.5 }
material = "cloth"

[[lights]]
directional = { direction = [-1, 0, -1], irradiance = 1.0 }
"#;

/// Floor, ball and cloth of [`SCENE`] as assemblies, each in other sizes, places and directions than where it is placed.
fn placed() -> String {
    let mut scene = SCENE.to_owned();
    let mut more = String::new();
    for (written, name, own, transform) in [
        (
            "quad = { corner = [649996, 4799998, 0], edge_u = [7, 0, 0], edge_v = [0, 8, 0] }\nmaterial = \"floor\"",
            "floor",
            "quad = { corner = [0, 0, 0], edge_u = [0, 0, 1], edge_v = [1, 0, 0] }\nmaterial = \"floor\"",
            "matrix = [0, 0, 7, 649996, 8, 0, 0, 4799998, 0, 3, 0, 0, 0, 0, 0, 1]",
        ),
        (
            "sphere = { center = [650000.53, 4800000.27, 0.75], radius = 0.75 }\nmaterial = \"a ball\"",
            "ball",
            "sphere = { center = [0, 1, 0], radius = 1.5 }\nmaterial = \"a ball\"",
            "scale = 0.5, rotate = [1, 0, 0, 90], translate = [650000.53, 4800000.27, 0.25]",
        ),
        (
            "disk = { center = [650001, 4799999, 3], normal = [0, 0, -1], radius = 0.5 }\nmaterial = \"cloth\"",
            "cloth",
            "disk = { center = [0, 0, 0], normal = [0, 1, 0], radius = 0.25 }\nmaterial = \"cloth\"",
            "scale = 2, rotate = [1, 0, 0, 90], translate = [650001, 4799999, 3]",
        ),
    ] {
        let object = format!("[[objects]]\n{written}\n");
        assert_eq!(scene.matches(&object).count(), 1, "{name}");
        scene = scene.replace(&object, "");
        more += &format!(
            "[[assemblies.{name}.objects]]\n{own}\n[[instances]]\nassembly = \"{name}\"\ntransform = {{ {transform} }}\n"
        );
    }
    scene + &more
}

const ALL: &str = "depth,normal,object,material,coordinates,sun";
const CENTER: DVec3 = DVec3::new(650_000.0, 4_800_000.0, 0.0);
/// Device coordinates are f32 over half of the scene's size, so about so many metres.
const ROUNDING: f64 = 4.0 * 1.2e-7;

fn place() -> Place {
    let place = Place::new();
    std::fs::write(place.path().join("layers.toml"), SCENE).expect("written");
    place
}

fn render(folder: &Path, name: &str, more: &str) -> Cube {
    let line = format!("render layers.toml -o {name} --quiet --tile 16 {more}");
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let output = run(folder, &arguments);
    assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    Cube::open(&folder.join(name)).expect("a cube")
}

/// The values of a layer, of all pixels row by row.
fn values(cube: &Cube, layer: Layer) -> Vec<Vec<f64>> {
    let (grid, [width, height]) = (cube.grid(), cube.header().size);
    let tiles: Vec<_> = (0..grid.count()).map(|tile| cube.tile_layers(tile).expect("read").expect("there")).collect();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let tile = grid.tile_at(x, y);
            let (rect, (_, bytes)) =
                (grid.rect(tile), tiles[tile as usize].0.iter().find(|(of, _)| *of == layer).expect("the layer"));
            let size = layer.pixel_bytes();
            let at = ((y - rect.y0) * grid.tile[0] + x - rect.x0) as usize * size;
            let number = |bytes: &[u8]| match layer {
                Layer::Object | Layer::Material => f64::from(i32::from_le_bytes(bytes.try_into().expect("four"))),
                Layer::Coordinates => f64::from_le_bytes(bytes.try_into().expect("eight")),
                _ => f64::from(f32::from_le_bytes(bytes.try_into().expect("four"))),
            };
            bytes[at..at + size].chunks(size / layer.axes().len()).map(number).collect()
        })
        .collect()
}

/// What is seen at a place of the map, relative to its middle: object, material, height, normal.
fn seen(x: f64, y: f64) -> Option<(f64, f64, f64, DVec3)> {
    let ball = 0.75f64.powi(2) - (x - 0.53).powi(2) - (y - 0.27).powi(2);
    if (x - 1.0).hypot(y + 1.0) < 0.5 {
        return Some((4.0, 3.0, 3.0, DVec3::Z));
    }
    if ball > 0.0 {
        let up = ball.sqrt();
        return Some((1.0, 1.0, 0.75 + up, DVec3::new(x - 0.53, y - 0.27, up) / 0.75));
    }
    ((-4.0..3.0).contains(&x) && (-2.0..6.0).contains(&y)).then_some((0.0, 0.0, 0.0, DVec3::Z))
}

/// Whether something stands between a place and the sun, that is as far east as high.
fn is_shaded(at: DVec3) -> bool {
    let sun = DVec3::new(1.0, 0.0, 1.0) / 2f64.sqrt();
    let to_ball = DVec3::new(0.53, 0.27, 0.75) - at;
    let along = to_ball.dot(sun);
    let by_ball = along > 1e-3 && to_ball.length_squared() - along * along < 0.75f64.powi(2);
    let on_cloth = at + (3.0 - at.z) * DVec3::new(1.0, 0.0, 1.0);
    by_ball || (at.z < 2.99 && (on_cloth.x - 1.0).hypot(on_cloth.y + 1.0) < 0.5)
}

#[test]
fn layers_are_what_is_seen() {
    are_what_is_seen(SCENE, [0.0, 1.0, 4.0], [0.0, 1.0, 3.0]);
}

#[test]
fn layers_of_what_is_placed_are_those_of_its_place() {
    are_what_is_seen(&placed(), [2.0, 3.0, 4.0], [1.0, 2.0, 3.0]);
}

/// `objects` and `materials`: the numbers of floor, ball and cloth.
fn are_what_is_seen(scene: &str, objects: [f64; 3], materials: [f64; 3]) {
    let place = place();
    std::fs::write(place.path().join("layers.toml"), scene).expect("written");
    let cube = render(place.path(), "cube.zarr", &format!("--spp 1 --layers {ALL}"));
    let [depth, normal, object, material, coordinates, sun] = Layer::ALL.map(|layer| values(&cube, layer));
    let mut kinds = std::collections::BTreeMap::new();
    for (i, (x, y)) in (0..32).flat_map(|y| (0..48).map(move |x| (x, y))).enumerate() {
        let at = DVec3::new((f64::from(x) + 0.5) / 6.0 - 4.0, 16.0 / 6.0 - (f64::from(y) + 0.5) / 6.0, 0.0);
        let what = format!("pixel {x} {y}");
        let Some((of, made_of, height, along)) = seen(at.x, at.y) else {
            assert_eq!((object[i][0], material[i][0]), (-1.0, -1.0), "{what}");
            let all = [&depth, &normal, &coordinates, &sun];
            assert!(all.iter().all(|layer| layer[i].iter().all(|value| value.is_nan())), "{what}");
            *kinds.entry(-1).or_insert(0) += 1;
            continue;
        };
        let kind = [0.0, 1.0, 4.0].iter().position(|known| *known == of).expect("one of three");
        assert_eq!([0.0, 1.0, 3.0][kind], made_of);
        assert_eq!((object[i][0], material[i][0]), (objects[kind], materials[kind]), "{what}");
        let position = DVec3::from_slice(&coordinates[i]) - CENTER;
        let expected = DVec3::new(at.x, at.y, height);
        // Near its rim a ball is steep: what is off by e sidewards is off by e over the cosine in height.
        let rounding = 4.0 * ROUNDING / along.z.max(1e-3);
        assert!((position - expected).abs().max_element() < rounding, "{what}: {position} {expected}");
        // And of the f32 that the array holds.
        assert!((depth[i][0] - (10.0 - height)).abs() < rounding + 1e-6, "{what}: {}", depth[i][0]);
        let n = DVec3::from_slice(&normal[i]);
        assert!((n - along).length() < 4.0 * rounding, "{what}: {n} {along}");
        let cosine = along.dot(DVec3::new(1.0, 0.0, 1.0)) / 2f64.sqrt();
        let is_dark = cosine <= 0.0 || is_shaded(expected);
        let wanted = if is_dark { 0.0 } else { cosine };
        assert!((sun[i][0] - wanted).abs() < 4.0 * rounding, "{what}: {} {wanted}", sun[i][0]);
        *kinds.entry(of as i32).or_insert(0) += 1;
        *kinds.entry(10 + i32::from(is_dark)).or_insert(0) += 1;
    }
    // Something of everything: nothing, floor, ball, cloth, light and shade.
    assert!([-1, 0, 1, 4, 10, 11].iter().all(|kind| kinds.get(kind).is_some_and(|n| *n > 15)), "{kinds:?}");
}

/// Names and units stand in the store; who asks for fewer layers gets those, in any order.
#[test]
fn layers_have_names() {
    let place = place();
    let cube = render(place.path(), "cube.zarr", "--spp 1 --layers material,depth,depth,object");
    assert_eq!(cube.layers(), [Layer::Depth, Layer::Object, Layer::Material]);
    let group: Value =
        serde_json::from_slice(&std::fs::read(cube.path().join("zarr.json")).expect("read")).expect("JSON");
    let array = &group["consolidated_metadata"]["metadata"]["material"];
    assert_eq!(array["data_type"], "int32");
    assert_eq!(array["attributes"]["flag_meanings"], "floor a_ball cloth veil".replace("cloth veil", "veil cloth"));
    assert!(!cube.path().join("normal").exists());
    let layers: Value = serde_json::from_str(group["attributes"]["layers"].as_str().expect("text")).expect("JSON");
    assert_eq!(layers["materials"], serde_json::json!(["floor", "a ball", "veil", "cloth"]));
    assert_eq!(layers["objects"][4], "objects.4");
}

/// The radiance is that without layers; and layers are the same by several devices, in little memory, tile by tile, gone on with,
/// and in a factored cube.
#[test]
fn layers_change_nothing_and_are_the_same_however_they_are_made() {
    let place = place();
    let folder = place.path();
    let layers = format!("--layers {ALL}");
    let straight = arrays(&render(folder, "straight.zarr", &format!("--spp 4 {layers}")));
    let without = arrays(&render(folder, "without.zarr", "--spp 4"));
    assert!(
        without.iter().filter(|(name, _)| name.contains("/c/")).all(|(name, bytes)| straight.get(name) == Some(bytes))
    );
    assert!(straight.keys().any(|name| name.starts_with("coordinates/c/1/2/0")), "{:?}", straight.keys());
    render(folder, "parts.zarr", &format!("--spp 1 {layers}"));
    let parts = arrays(&render(folder, "parts.zarr", &format!("--spp 4 --resume --devices 2 --memory 16MiB {layers}")));
    assert!(parts == straight);
    render(folder, "tiles.zarr", &format!("--spp 4 --tiles 3..6 {layers}"));
    assert!(arrays(&render(folder, "tiles.zarr", &format!("--spp 4 --tiles 0..3 {layers}"))) == straight);
    let kept = |name: &str| Layer::ALL.iter().any(|layer| name.starts_with(&format!("{}/c", layer.name())));
    let factored = SCENE.replace("opacity = 0.3", "opacity = 1").replace("opacity = 0.7", "opacity = 1");
    std::fs::write(folder.join("layers.toml"), factored.replace("interior = \"gas\"", "material = \"veil\""))
        .expect("written");
    let plain = arrays(&render(folder, "plain.zarr", &format!("--spp 1 {layers}")));
    let factored = arrays(&render(folder, "factored.zarr", &format!("--spp 1 --factored {layers}")));
    assert!(plain.iter().filter(|(name, _)| kept(name)).all(|(name, bytes)| factored.get(name) == Some(bytes)));
    // What is made of a cube keeps them.
    let output = run(folder, &["relight", "factored.zarr", "-o", "relit.zarr"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let relit = arrays(&Cube::open(&folder.join("relit.zarr")).expect("a cube"));
    assert!(plain.iter().filter(|(name, _)| kept(name)).all(|(name, bytes)| relit.get(name) == Some(bytes)));
}

#[test]
fn layers_that_are_none_are_refused() {
    let place = place();
    let refused = |line: &str, what: &str| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let output = run(place.path(), &arguments);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(what), "{line}: {said}");
        assert!(!place.path().join("no.zarr").exists());
    };
    refused("render layers.toml -o no.zarr --layers depht", "layers are depth, normal, object");
    std::fs::write(
        place.path().join("dark.toml"),
        SCENE.replace("[[lights]]\ndirectional", "[environment]\nradiance = 1\n#"),
    )
    .expect("written");
    refused("render dark.toml -o no.zarr --layers sun", "no `sun` and no `directional` light");
    let more = "\n[[lights]]\ndirectional = { direction = [0, 0, -1], irradiance = 1.0 }\n";
    std::fs::write(place.path().join("two.toml"), format!("{SCENE}{more}")).expect("written");
    refused("render two.toml -o no.zarr --layers depth,sun", "2 lights that are infinitely far away");
    // And so before anything is rendered.
    refused("plan layers.toml --layers depht", "layers are depth, normal, object");
    refused("plan dark.toml --layers sun", "no `sun` and no `directional` light");
    render(place.path(), "some.zarr", "--spp 1 --layers depth");
    refused("render layers.toml -o some.zarr --tile 16 --spp 2 --resume", "layers");
}

/// `plan` says what layers take: on disk as much as their files and folders do, by `du`.
#[test]
fn plans_know_what_layers_take() {
    let place = place();
    let planned = |more: &str| {
        let line = format!("plan layers.toml --tile 16 --json {more}");
        let output = run(place.path(), &line.split_whitespace().collect::<Vec<_>>());
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
        crate::binary::events(&text(&output.stdout)).pop().expect("done")
    };
    let number = |plan: &serde_json::Value, key: &str| plan[key].as_u64().expect("a number");
    let (plain, layered) = (planned(""), planned("--layers sun,depth,coordinates"));
    assert_eq!(layered["layers"], serde_json::json!(["depth", "coordinates", "sun"]));
    assert_eq!(plain["layers"], serde_json::json!([]));
    assert_eq!([number(&plain, "layer_disk_bytes"), number(&plain, "layer_device_bytes")], [0, 0]);
    let more = |key: &str| number(&layered, key) - number(&plain, key);
    assert_eq!(more("disk_bytes"), number(&layered, "layer_disk_bytes"));
    assert!(number(&layered, "layer_device_bytes") > 1 << 16);
    // Files of tiles alone: 4, 24 and 4 bytes a pixel.
    let tiles = number(&layered, "tiles");
    assert!(
        more("disk_bytes") >= tiles * 16 * 16 * 32
            && more("disk_bytes") < tiles * (16 * 16 * 32 + 8 * 4096) + (1 << 17)
    );
    let said = text(&run(place.path(), &["plan", "layers.toml", "--layers", "depth"]).stdout);
    assert!(said.lines().any(|line| line.starts_with("layers    depth: ")), "{said}");
}

/// Of the exports, by readers of their own.
#[test]
fn layers_are_exported() {
    let place = place();
    let folder = place.path();
    let cube = render(folder, "cube.zarr", &format!("--spp 1 --layers {ALL}"));
    let told = text(&run(folder, &["info", "cube.zarr"]).stdout);
    assert!(told.contains("layers           depth, normal, object, material, coordinates, sun\n"), "{told}");
    let export = |line: &str| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        run(folder, &[&["export", "cube.zarr"], &arguments[..]].concat())
    };
    for line in [
        "-o all.csv --layers sun,coordinates,material,object,normal,depth",
        "-o all.img --layers depth,normal,object,material,coordinates,sun --crop 3,5,40,29",
        "-o some.exr --layers normal,depth,material",
    ] {
        let output = export(line);
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    }
    let all: Vec<Vec<f64>> =
        Layer::ALL.iter().map(|&layer| values(&cube, layer)).fold(vec![Vec::new(); 48 * 32], |mut all, layer| {
            all.iter_mut().zip(layer).for_each(|(all, values)| all.extend(values));
            all
        });
    // What is f32 has the digits of one.
    let same = |a: f64, b: f64| {
        a == b || (a as f32 == b as f32 && b.abs() < 20.0) || (a.is_nan() && (b.is_nan() || b == -1.0))
    };
    let table = std::fs::read_to_string(folder.join("all.csv")).expect("read");
    let mut lines = table.lines();
    assert_eq!(
        lines.next(),
        Some("x,y,depth,normal.x,normal.y,normal.z,object,material,coordinates.x,coordinates.y,coordinates.z,sun")
    );
    for (i, line) in lines.enumerate() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        assert_eq!((cells[0] as usize, cells[1] as usize), (i % 48, i / 48));
        assert!(cells[2..].iter().zip(&all[i]).all(|(a, b)| same(*a, *b)), "{line} {:?}", all[i]);
    }
    let header = std::fs::read_to_string(folder.join("all.hdr")).expect("read");
    assert!(
        header.contains("data type = 5") && header.contains("x start = 4") && !header.contains("wavelength"),
        "{header}"
    );
    let bytes = std::fs::read(folder.join("all.img")).expect("read");
    let numbers: Vec<f64> = bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    assert_eq!(numbers.len(), 37 * 24 * 10);
    for (i, number) in numbers.iter().enumerate() {
        let (line, band, column) = (i / 370, i / 37 % 10, i % 37);
        let expected = all[(line + 5) * 48 + column + 3][band];
        let expected = if same(f64::NAN, expected) { -9999.0 } else { expected };
        assert_eq!(*number, expected, "{line} {band} {column}");
    }
    let image = exr::prelude::read_first_flat_layer_from_file(folder.join("some.exr")).expect("an EXR");
    for (name, column) in [("depth", 0), ("normal.x", 1), ("normal.z", 3), ("material", 5)] {
        let channel = image.layer_data.channel_data.list.iter().find(|channel| channel.name.to_string() == name);
        let channel = channel.unwrap_or_else(|| panic!("no channel {name}"));
        for (value, pixel) in channel.sample_data.values_as_f32().zip(&all) {
            assert!(same(value.into(), pixel[column]), "{name}");
        }
    }
    for (line, what) in [
        ("-o x.exr --layers coordinates", "32 would round"),
        ("-o x.zarr --layers depth", "--layers goes with envi, exr, csv"),
        ("-o x.img --layers depth --bands 0", "cannot be used with"),
        ("-o x.img --layers depth --interleave bsq", "by lines"),
    ] {
        let output = export(line);
        assert!(
            output.status.code() == Some(2) && text(&output.stderr).contains(what),
            "{line}: {}",
            text(&output.stderr)
        );
    }
    render(folder, "cube.zarr", "--spp 1 --overwrite --layers sun");
    let output = export("-o x.img --layers depth");
    assert!(
        text(&output.stderr).contains("has only sun; `spectile render --layers depth`"),
        "{}",
        text(&output.stderr)
    );
    // As users of Python see them.
    if let Some(mut python) = crate::outside::python("read_layers.py") {
        render(folder, "cube.zarr", &format!("--spp 1 --overwrite --layers {ALL}"));
        let output = python.arg("cube.zarr").current_dir(folder).output().expect("Python runs");
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}
