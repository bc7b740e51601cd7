//! Gases and what they fill: what good ones resolve to, number by number, and what is said about wrong ones.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use spectile::Error;
use spectile::device::prepared::Prepared;
use spectile::device::words::VOLUME_WORDS;
use spectile::scene::{self, Field, Scene};
use spectile::spectral::{Curve, Outside};
use zarrs::array::builder::ArrayBuilderFillValue;
use zarrs::array::{ArrayBuilder, DataType, Element, data_type};
use zarrs::filesystem::FilesystemStore;

use super::wrong::check_wrong;
use super::{BASE, folder, good, overrides};

/// A species at 300 and 600 K from 400 to 600 nm: the channels reach to 700.
const GAS: &str = "wavelength_nm,kappa_300K,kappa_600K\n400,1,2\n500,-0,4\n600,3,0\n";

fn filled(object: &str, media: &str) -> String {
    BASE.replace("[[objects]]\nmesh", &format!("{media}\n[[objects]]\n{object}\n\n[[objects]]\nmesh"))
}

const BALL: &str = "sphere = { center = [0, 0, 0], radius = 1 }\ninterior = \"gas\"";

fn write_grid<T: Element + Into<ArrayBuilderFillValue>>(path: &Path, shape: &[u64], kind: DataType, values: &[T]) {
    let store = Arc::new(FilesystemStore::new(path).expect("a folder"));
    let chunks: Vec<u64> = shape.iter().map(|n| n.div_ceil(2)).collect();
    let array = ArrayBuilder::new(shape.to_vec(), chunks, kind, values[0].clone()).build(store, "/").expect("an array");
    array.store_metadata().expect("metadata");
    array.store_array_subset(&array.subset_all(), values).expect("values");
}

/// The scene `text` beside grids: t.zarr has shape [2, 3, 4] and the values 300, 301, …; d.zarr whole numbers.
fn with_grids(text: &str) -> spectile::Result<Scene> {
    let dir = folder(&[("gas.csv", GAS)]);
    let t: Vec<f64> = (0..24).map(|i| 300.0 + f64::from(i)).collect();
    write_grid(&dir.path().join("t.zarr"), &[2, 3, 4], data_type::float64(), &t);
    write_grid(&dir.path().join("d.zarr"), &[2, 3, 4], data_type::uint16(), &[3u16; 24]);
    write_grid(&dir.path().join("other.zarr"), &[2, 3, 5], data_type::float32(), &[1f32; 30]);
    write_grid(&dir.path().join("flat.zarr"), &[6, 4], data_type::float32(), &[1f32; 24]);
    let mut negative = [0f32; 24];
    negative[17] = -2.0;
    write_grid(&dir.path().join("negative.zarr"), &[2, 3, 4], data_type::float32(), &negative);
    std::fs::create_dir(dir.path().join("yes.zarr")).expect("a folder");
    let yes = r#"{ "zarr_format": 3, "node_type": "array", "shape": [2, 3, 4], "data_type": "bool",
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [2, 3, 4] } },
        "chunk_key_encoding": { "name": "default" }, "fill_value": true, "codecs": [{ "name": "bytes" }] }"#;
    std::fs::write(dir.path().join("yes.zarr/zarr.json"), yes).expect("a file");
    scene::parse(text, &dir.path().join("scene.toml"), &overrides(&[]))
}

#[test]
fn absorption_resolves() {
    let text = filled(
        BALL,
        "[media.gas]\nabsorption = { samples = [[400, 1], [700, 3]] }\ntemperature = 288.5\ndensity = 0.5",
    )
    .replace("fov = 60.0", "fov = 60.0\nmedium = \"air\"")
        + "[media.air]\nabsorption = 0.25\n[media.unused]\nabsorption = 7\n";
    let scene = good(&text, &[], &[]);
    let names: Vec<&str> = scene.media.iter().map(|m| m.name.as_str()).collect();
    assert_eq!((names, scene.camera_medium), (vec!["gas", "air"], Some(1)));
    let [gas, air] = &scene.media[..] else { panic!() };
    assert_eq!((&gas.temperature, &gas.components[0].density), (&Some(Field::Constant(288.5)), &Field::Constant(0.5)));
    assert_eq!((&air.temperature, &air.components[0].density), (&None, &Field::Constant(1.0)));
    let [absorber] = &gas.components[0].absorbers[..] else { panic!() };
    assert_eq!((absorber.strength, absorber.columns.len()), (1.0, 1));
    let expected = Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.0, 3.0], outside: Outside::Zero };
    assert_eq!(scene.spectra[absorber.columns[0].1].curve, expected);
    let ball = &scene.objects[1];
    assert_eq!((ball.material, ball.interior.unwrap().medium), (None, 0));
    // The box of the ball is the unit cube.
    let to_grid = ball.interior.unwrap().to_grid;
    for (world, grid) in [(DVec3::splat(-1.0), DVec3::ZERO), (DVec3::new(1.0, 0.0, -1.0), DVec3::new(1.0, 0.5, 0.0))] {
        assert!((to_grid.transform_point3(world) - grid).length() < 1e-14);
    }
    let without = good(&text, &[], &[("media.gas.temperature", "288.4")]);
    assert_ne!(scene.digest, without.digest);
    assert_ne!(scene.digest, good(&text, &[], &[("camera.perspective.medium", "unused")]).digest);
}

/// Molecules per volume are p / (k T), T the gas's own, whatever the columns are of: at 273.15 K and 1 atm Loschmidt's number,
/// 2.686 780 111e25 m⁻³ (CODATA 2018), and half of it at twice that.
#[test]
fn cross_sections_count_the_molecules_of_the_gas() {
    let table =
        "wavenumber (cm-1),273.15 K (cm2/molecule),546.3 K [cm2/molecule]\n14000,1e-21,2e-21\n26000,3e-21,4e-21\n";
    let media = "[media.gas]\nspecies = [{ table = \"gas.csv\", fraction = 1.0 }]\ntemperature = 300";
    let at_14000 = |scene: &Scene, component: usize| -> Vec<f64> {
        let columns = &scene.media[0].components[component].absorbers[0].columns;
        columns.iter().map(|(_, spectrum)| scene.spectra[*spectrum].curve.eval(1e7 / 14_000.0)).collect()
    };
    let close = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).for_each(|(a, b)| assert!((a / b - 1.0).abs() < 1e-9, "{found:?}, {expected:?}"));
    };
    const LOSCHMIDT: f64 = 2.686_780_111;
    for (kelvin, share) in [("273.15", 1.0), ("546.3", 0.5)] {
        let scene = good(&filled(BALL, media), &[("gas.csv", table)], &[("media.gas.temperature", kelvin)]);
        close(&at_14000(&scene, 0), &[LOSCHMIDT * share, 2.0 * LOSCHMIDT * share]);
    }
    // Of one column without a temperature its own is all that is known.
    let one = "nm,300 K (cm2/molecule)\n400,1e-21\n800,1e-21\n";
    let media = "[media.gas]\nspecies = [{ table = \"gas.csv\", fraction = 1.0 }]";
    let scene = good(&filled(BALL, media), &[("gas.csv", one)], &[]);
    close(&at_14000(&scene, 0), &[LOSCHMIDT * 273.15 / 300.0]);
    // In voxels the density of the gas goes by their temperatures, and that of what scatters beside it does not.
    let media = "[media.gas]\nspecies = [{ table = \"gas.csv\", fraction = 1.0 }]\nscattering = 2.0\ndensity = 0.5\n\
        temperature = { grid = \"t.zarr\" }";
    let dir = folder(&[("gas.csv", one)]);
    write_grid(&dir.path().join("t.zarr"), &[1, 1, 2], data_type::float64(), &[273.15, 546.3]);
    let scene = scene::parse(&filled(BALL, media), &dir.path().join("scene.toml"), &overrides(&[])).unwrap();
    let [cloud, gas] = &scene.media[0].components[..] else { panic!("{:?}", scene.media[0].components) };
    assert!(cloud.absorbers.is_empty() && cloud.scattering.is_some() && cloud.density == Field::Constant(0.5));
    let Field::Grid(density) = &gas.density else { panic!("{:?}", gas.density) };
    let reference = at_14000(&scene, 1)[0];
    for (density, expected) in density.values.iter().zip([0.5 * LOSCHMIDT, 0.25 * LOSCHMIDT]) {
        let found = reference * f64::from(*density);
        // The grid has f32.
        assert!((found / expected - 1.0).abs() < 2e-7, "{found}, {expected}");
    }
    // Without a temperature nothing follows.
    let alone = "[media.gas]\nabsorption = { file = \"one.csv\" }";
    let one = "nm,sigma (cm2/molecule)\n400,1e-21\n700,1e-21\n";
    let dir = folder(&[("one.csv", one)]);
    let error = scene::parse(&filled(BALL, alone), &dir.path().join("scene.toml"), &overrides(&[])).unwrap_err();
    assert!(error.to_string().contains("p / (k T)"), "{error}");
}

/// A grid fills the box of each instance, and its voxels are on a device once; so many instances that devices cannot number them are
/// refused by name.
#[test]
fn grids_fill_each_instance() {
    let text = "[media.gas]\nabsorption = 1\ndensity = { grid = \"d.zarr\" }\n[[assemblies.balls.objects]]\n\
        sphere = { center = [0, 0, 0], radius = 1 }\ninterior = \"gas\"\n[[instances]]\nassembly = \"balls\"\n";
    let placed = |count: usize| {
        let places = (0..count)
            .map(|i| format!("[[instances]]\nassembly = \"balls\"\ntransform = {{ translate = [{i}, 0, 0] }}\n"));
        with_grids(&format!("{BASE}{text}{}", places.collect::<String>())).unwrap_or_else(|e| panic!("{e}"))
    };
    let words = |scene: &Scene| Prepared::new(scene, 0).map(|prepared| prepared.media.unwrap().volumes.len());
    let [one, many] = [0, 252].map(|more| words(&placed(more)).unwrap());
    // A line of VOLUME_WORDS and a list of its one kind of matter each.
    assert_eq!(many, one + 252 * (VOLUME_WORDS as usize + 9));
    let error = words(&placed(254)).unwrap_err().to_string();
    for words in ["254", "assembly \"balls\" with \"gas\" is placed 255 times", "place it less often"] {
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn species_resolve_with_what_they_do_not_cover() {
    let media = "[media.gas]\nspecies = [{ table = \"gas.csv\", fraction = 0.25 }, { table = \"gas.csv\", fraction = 0.5 }]\npressure = 2.0\ntemperature = 650";
    let scene = good(&filled(BALL, media), &[("gas.csv", GAS)], &[]);
    let gas = &scene.media[0];
    let strengths: Vec<f64> = gas.components[0].absorbers.iter().map(|a| a.strength).collect();
    assert_eq!(strengths, [0.5, 1.0]);
    for absorber in &gas.components[0].absorbers {
        let kelvin: Vec<f64> = absorber.columns.iter().map(|c| c.0).collect();
        assert_eq!(kelvin, [300.0, 600.0]);
        let curve = &scene.spectra[absorber.columns[1].1].curve;
        assert_eq!((curve.eval(500.0), curve.eval(650.0)), (4.0, 0.0));
    }
    let said = |words: &[&str]| scene.warnings.iter().filter(|w| words.iter().all(|word| w.contains(word))).count();
    assert_eq!(
        said(&[
            "gas.csv (300 K)",
            "an absorption coefficient",
            "does not cover 600-700 nm",
            "nothing is absorbed there"
        ]),
        1
    );
    assert_eq!(said(&["gas.csv (600 K)", "600-700 nm"]), 1);
    assert_eq!(said(&["`media.gas.species.0`", "covers 300-600 K", "not the medium's 650 K", "held"]), 1);
    assert_eq!(scene.warnings.len(), 4, "{:?}", scene.warnings);
    let quiet = "[media.gas]\nabsorption = { samples = [[400, 1], [500, 3]], outside = \"zero\" }";
    assert!(good(&filled(BALL, quiet), &[], &[]).warnings.is_empty());
}

/// Grids of any real numbers, [z, y, x] with x fastest, in the object's box before its transform.
#[test]
fn grids_resolve() {
    let object = "cube = { min = [0, 0, 0], max = [4, 6, 2] }\ntransform = { translate = [10, 0, 0], rotate = [0, 0, 1, 90], scale = 2 }\ninterior = \"gas\"";
    let media = "[media.gas]\nspecies = [{ table = \"gas.csv\", fraction = 1 }]\ntemperature = { grid = \"t.zarr\" }\ndensity = { grid = \"d.zarr\" }";
    let scene = with_grids(&filled(object, media)).unwrap_or_else(|e| panic!("{e}"));
    let gas = &scene.media[0];
    assert_eq!(gas.grid_size(), Some([4, 3, 2]));
    let Some(Field::Grid(t)) = &gas.temperature else { panic!() };
    let expected: Vec<f32> = (0..24).map(|i| 300.0 + i as f32).collect();
    assert_eq!((t.size, &*t.values), ([4, 3, 2], &expected));
    let Field::Grid(d) = &gas.components[0].density else { panic!() };
    assert_eq!(*d.values, [3.0; 24]);
    let to_grid = scene.objects[1].interior.unwrap().to_grid;
    // Scaled by 2, a quarter turn about z, then moved.
    let world = DVec3::new(10.0 - 2.0 * 6.0, 2.0 * 4.0, 2.0 * 1.0);
    assert!((to_grid.transform_point3(world) - DVec3::new(1.0, 1.0, 0.5)).length() < 1e-14);
}

/// What attributes call a grid's values: the unit of a temperature, or another quantity.
#[test]
fn names_of_grids_are_applied_or_refused() {
    let with = |key: &str, name: &str, text: &str, value: f64| {
        let dir = folder(&[]);
        let store = Arc::new(FilesystemStore::new(dir.path().join("g.zarr")).expect("a folder"));
        let mut builder = ArrayBuilder::new(vec![1, 1, 1], vec![1, 1, 1], data_type::float64(), 0.0f64);
        let attributes = serde_json::json!({ name: text });
        builder.attributes(attributes.as_object().expect("an object").clone());
        let array = builder.build(store, "/d").expect("an array");
        array.store_metadata().expect("metadata");
        array.store_array_subset(&array.subset_all(), &[value]).expect("values");
        let media = format!("[media.gas]\nabsorption = 1\n{key} = {{ grid = \"g.zarr/d\" }}");
        scene::parse(&filled(BALL, &media), &dir.path().join("s.toml"), &[])
    };
    for (name, text) in
        [("long_name", "Temperature (C)"), ("description", "temperature in Celsius"), ("long_name", "T_degC")]
    {
        let scene = with("temperature", name, text, 26.85).unwrap_or_else(|e| panic!("{text}: {e}"));
        let Some(Field::Grid(grid)) = &scene.media[0].temperature else { panic!("{text}") };
        assert!((grid.values[0] - 300.0).abs() < 1e-3, "{text}: {:?}", grid.values);
    }
    for (key, name, text, words) in [
        ("density", "standard_name", "air_temperature", "a temperature"),
        ("density", "long_name", "log10 density", "logarithms"),
        ("density", "long_name", "density uncertainty", "an error or spread"),
        ("temperature", "long_name", "transmittance", "a transmittance"),
    ] {
        let error = with(key, name, text, 1.0).err().unwrap_or_else(|| panic!("{text}"));
        assert!(error.to_string().contains(words), "{text}: {error}");
    }
    for text in ["mass concentration of water", "extinction coefficient", "liquid water content"] {
        assert!(with("density", "long_name", text, 1.0).is_ok(), "{text}");
    }
}

/// Height grows with z; depth, of which CF says `positive` = `down`, grows against it.
#[test]
fn depths_run_downward() {
    let text = filled(BALL, "[media.gas]\nabsorption = 1\ndensity = { grid = \"g.zarr/d\" }");
    for (positive, places, expected) in [
        ("up", [10.0, 20.0], [1f32, 2.0]),
        ("up", [20.0, 10.0], [2.0, 1.0]),
        ("down", [10.0, 20.0], [2.0, 1.0]),
        ("down", [20.0, 10.0], [1.0, 2.0]),
    ] {
        let dir = folder(&[]);
        let store = Arc::new(FilesystemStore::new(dir.path().join("g.zarr")).expect("a folder"));
        let array = |name: &str, shape: Vec<u64>, dimensions: &[&str], values: &[f64]| {
            let mut builder = ArrayBuilder::new(shape.clone(), shape, data_type::float64(), 0.0f64);
            let attributes = serde_json::json!({ "positive": positive });
            builder.dimension_names(Some(dimensions.iter().copied()));
            builder.attributes(attributes.as_object().expect("an object").clone());
            let array = builder.build(store.clone(), name).expect("an array");
            array.store_metadata().expect("metadata");
            array.store_array_subset(&array.subset_all(), values).expect("values");
        };
        array("/d", vec![2, 1, 1], &["z", "y", "x"], &[1.0, 2.0]);
        array("/z", vec![2], &["z"], &places);
        let scene = scene::parse(&text, &dir.path().join("scene.toml"), &overrides(&[])).unwrap();
        let Field::Grid(grid) = &scene.media[0].components[0].density else { panic!("no grid") };
        assert_eq!(*grid.values, expected, "{positive}, {places:?}");
    }
}

/// The mesh as a whole has the box, and a `material` of its own, or of its usemtl names, or none.
#[test]
fn meshes_with_interiors() {
    let cube = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 1 2 0\nv 0 0 4\nv 1 0 4\nv 0 2 4\nv 1 2 4\nusemtl white\nf 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nusemtl soot\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    let files = [("box.obj", cube)];
    let media = "[media.gas]\nabsorption = 1";
    let scene = good(&filled("mesh = \"box.obj\"\nmaterial = \"white\"\ninterior = \"gas\"", media), &files, &[]);
    assert_eq!((scene.objects[1].material, scene.objects.len()), (Some(0), 3));
    let scene = good(&filled("mesh = \"box.obj\"\ninterior = \"gas\"", media), &files, &[]);
    assert_eq!((scene.objects[1].material, scene.objects.len()), (None, 3));
    assert!(scene.warnings.iter().any(|w| w.contains("usemtl") && w.contains("\"white\"")), "{:?}", scene.warnings);
    let to_grid = scene.objects[1].interior.unwrap().to_grid;
    assert_eq!(to_grid.transform_point3(DVec3::new(1.0, 2.0, 4.0)), DVec3::ONE);
}

#[test]
fn wrong_media() {
    let gas = |text: &str| filled(BALL, &format!("[media.gas]\n{text}"));
    let box_of = |object: &str| filled(object, "[media.gas]\nabsorption = 1");
    #[rustfmt::skip]
    let cases: &[(&str, String, &str, &[&str])] = &[
        ("nothing", gas("temperature = 300").replace("gas]", "gas] #!"), "media.gas", &["neither an absorption nor a scattering", "or several `components`"]),
        ("both", gas("absorption = 1\nspecies = [] #!"), "media.gas.species", &["cannot stand beside `absorption`"]),
        ("phase alone", gas("absorption = 1\nphase = { hg = 0.5 } #!"), "media.gas.phase", &["goes with `scattering` only"]),
        ("two phases", gas("scattering = 1\nphase = { hg = 0.5, rayleigh = 0.1 } #!"), "media.gas.phase.rayleigh", &["only one phase function"]),
        ("forward", gas("scattering = 1\nphase = { hg = 1 } #!"), "media.gas.phase.hg", &["an asymmetry g must lie in (-1, 1), but is 1"]),
        ("depolarised", gas("scattering = 1\nphase = { rayleigh = 0.6 } #!"), "media.gas.phase.rayleigh", &["a depolarisation factor in [0, 0.5]"]),
        ("negative scattering", gas("scattering = -1 #!"), "media.gas.scattering", &["a scattering coefficient must lie in [0, 1e15], but is -1"]),
        ("cut phase", gas("scattering = 1\nphase = { table = \"cut.csv\" } #!"), "media.gas.phase.table", &["cut.csv", "from 0 to 180 degrees"]),
        ("kinds beside keys", gas("absorption = 1 #!\n[[media.gas.components]]\nscattering = 1"), "media.gas.absorption", &["cannot stand beside `components`"]),
        ("no kinds", gas("components = [] #!"), "media.gas.components", &["has no components"]),
        ("empty kind", gas("[[media.gas.components]] #!\ndensity = 1"), "media.gas.components.0", &["neither an absorption nor a scattering", "absorption, species or scattering"]),
        ("old phase", gas("scattering = 1\nphase_g = 0.5 #!"), "media.gas.phase_g", &["unknown key", "phase"]),
        ("endless fog", filled(BALL, "[media.gas]\nscattering = 1").replace("fov = 60.0", "fov = 60.0\nmedium = \"gas\" #!"), "camera.perspective.medium", &["scatters, which matter without an end cannot", "give the matter a shape"]),
        ("negative", gas("absorption = -1 #!"), "media.gas.absorption", &["an absorption coefficient must lie in [0, 1e15], but is -1"]),
        ("a colour", gas("absorption = { rgb = [1, 1, 1] } #!"), "media.gas.absorption.rgb", &["is a colour"]),
        ("pressure alone", gas("absorption = 1\npressure = 2 #!"), "media.gas.pressure", &["goes with `species` only"]),
        ("no species", gas("species = [] #!"), "media.gas.species", &["has no species"]),
        ("no fraction", gas("species = [{ table = \"gas.csv\" }] #!\ntemperature = 300"), "media.gas.species.0.fraction", &["`fraction` is missing"]),
        ("share", gas("species = [{ table = \"gas.csv\", fraction = 1.5 }] #!\ntemperature = 300"), "media.gas.species.0.fraction", &["a share of volume in [0, 1]"]),
        ("shares", gas("species = [{ table = \"gas.csv\", fraction = 0.6 }, { table = \"gas.csv\", fraction = 0.6 }] #!\ntemperature = 300"), "media.gas.species", &["sum to 1.2"]),
        ("no table", gas("species = [{ table = \"none.csv\", fraction = 0.6 }] #!"), "media.gas.species.0.table", &["none.csv", "cannot be read"]),
        ("columns", gas("species = [{ table = \"named.csv\", fraction = 0.6 }] #!"), "media.gas.species.0.table", &["named by temperatures", "\"hot\""]),
        ("twice", gas("species = [{ table = \"twice.csv\", fraction = 0.6 }] #!"), "media.gas.species.0.table", &["two columns for 300 K"]),
        ("which column", gas("species = [{ table = \"gas.csv\", fraction = 0.6 }]").replace("gas]", "gas] #!"), "media.gas", &["has no `temperature`", "300 to 600 K"]),
        ("density", gas("absorption = 1\ndensity = -1 #!"), "media.gas.density", &["0 or greater"]),
        ("temperature", gas("absorption = 1\ntemperature = 0 #!"), "media.gas.temperature", &["above 0"]),
        ("grid", gas("absorption = 1\ntemperature = { gird = \"t.zarr\" } #!"), "media.gas.temperature.gird", &["did you mean `grid`?"]),
        ("no grid", gas("absorption = 1\ntemperature = { grid = \"t.zarr\" } #!"), "media.gas.temperature.grid", &["t.zarr is not a folder", "[z, y, x]"]),
        ("unknown", box_of("sphere = { center = [0, 0, 0], radius = 1 }\ninterior = \"gass\" #!"), "objects.1.interior", &["no medium is named \"gass\"", "did you mean `gas`?"]),
        ("a disk", box_of("disk = { center = [0, 0, 0], normal = [0, 0, 1], radius = 1 }\ninterior = \"gas\" #!"), "objects.1.interior", &["fills closed shapes only", "a disk has no inside"]),
        ("a quad", box_of("quad = { corner = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }\ninterior = \"gas\" #!"), "objects.1.interior", &["is not closed: 4 edges", "[0, 0, 0]"]),
        ("a pipe", box_of("cylinder = { from = [0, 0, 0], to = [0, 0, 1], radius = 1 }\nmaterial = \"white\"\ninterior = \"gas\" #!"), "objects.1.interior", &["open at both ends"]),
        ("a lamp", box_of("sphere = { center = [0, 0, 0], radius = 1 }\ninterior = \"gas\"\nemission = \"lamp\" #!"), "objects.1.emission", &["goes with a `material` only"]),
        ("outer", BASE.replace("fov = 60.0", "fov = 60.0\nmedium = \"air\" #!"), "camera.perspective.medium", &["no medium is named \"air\"", "[media.air]"]),
    ];
    let files = [
        ("gas.csv", GAS),
        ("cut.csv", "degrees,500\n0,1\n90,1\n"),
        ("named.csv", "nm,hot\n400,1\n500,1\n"),
        ("twice.csv", "nm,300,300K\n400,1,1\n500,1,1\n"),
    ];
    for (name, text, key, words) in cases {
        check_wrong(text, &files, name, key, words);
    }
}

#[test]
fn chunks_of_grids_without_a_file_are_told() {
    // Chunks of nothing but the fill value are not written.
    let scene =
        with_grids(&filled(BALL, "[media.gas]\nabsorption = 1\ndensity = { grid = \"d.zarr\" }")).expect("a scene");
    let told: Vec<&String> = scene.warnings.iter().filter(|warning| warning.contains("no file")).collect();
    assert_eq!(told.len(), 1, "{:?}", scene.warnings);
    assert!(
        told[0].starts_with("d.zarr has no file of 8 of the 8 chunks") && told[0].ends_with("fill value, 3"),
        "{told:?}"
    );
}

#[test]
fn wrong_grids() {
    #[rustfmt::skip]
    let cases: &[(&str, &str, &[&str])] = &[
        ("density = { grid = \"flat.zarr\" }", "media.gas.density.grid", &["flat.zarr has 2 dimensions", "[z, y, x]"]),
        ("density = { grid = \"negative.zarr\" }", "media.gas.density.grid", &["densities, not negative, but is -2 at [1, 1, 1]"]),
        ("density = { grid = \"yes.zarr\" }", "media.gas.density.grid", &["must hold real numbers"]),
        ("density = { grid = \".\" }", "media.gas.density.grid", &["cannot be read as a Zarr array"]),
    ];
    let camera = filled(BALL, "[media.gas]\nabsorption = 1\ntemperature = { grid = \"t.zarr\" }")
        .replace("fov = 60.0", "fov = 60.0\nmedium = \"gas\"");
    let cases = cases
        .iter()
        .map(|(text, key, words)| (filled(BALL, &format!("[media.gas]\nabsorption = 1\n{text}")), *key, *words));
    let all = cases.chain([(camera, "camera.perspective.medium", &["has a grid", "`interior`"][..])]);
    for (text, key, words) in all {
        let Err(Error::Input(problems)) = with_grids(&text) else { panic!("{key}: accepted") };
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert_eq!(problems[0].key.as_deref(), Some(key));
        let message = problems[0].to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}
